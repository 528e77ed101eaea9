"""Public names of the lab part."""

import pytest

import snapbeam
import snapbeam.lab as lab
from snapbeam.util import diagnostics


@pytest.mark.parametrize("name", lab.__all__)
def test_every_public_name_is_there(name):
    assert getattr(lab, name).__module__.startswith("snapbeam.")
    assert name in dir(lab)


def test_a_diagnostic_of_the_part_is_a_diagnostic_of_the_package():
    assert lab.Diagnostic is diagnostics.Diagnostic is snapbeam.Diagnostic


def test_a_name_that_is_not_there():
    with pytest.raises(AttributeError, match="vibrometers"):
        lab.vibrometers  # noqa: B018
