"""The instruction set of the native core: the best, or the one that a variable names."""

import pytest

import snapbeam as sb
from snapbeam import _core
from snapbeam.model import default_values
from snapbeam.util.cores import instruction_set
from snapbeam.util.provenance import processor_name


@pytest.mark.parametrize("named", [None, "", *_core.instruction_sets()])
def test_the_set_that_is_named(named, monkeypatch):
    if named is None:
        monkeypatch.delenv("SNAPBEAM_SET", raising=False)
    else:
        monkeypatch.setenv("SNAPBEAM_SET", named)
    assert instruction_set() == (named or _core.instruction_sets()[0])
    assert processor_name().endswith(instruction_set())


def test_another_is_refused(monkeypatch):
    shaker = sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.18)
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1)
    system = sb.System(model, contacts=[sb.Contact(default_values.CONTACT, shaker)])
    monkeypatch.setenv("SNAPBEAM_SET", "mmx")
    with pytest.raises(sb.InputError, match=r"SNAPBEAM_SET = 'mmx': must be one of '"):
        sb.simulate(system, sb.Integration(cycles=1))
