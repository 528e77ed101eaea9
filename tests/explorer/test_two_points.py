"""What tells two points, two runs and two systems apart, in words and numbers."""

from __future__ import annotations

import numpy as np
import pytest

from snapbeam.explorer.maps import Point, brief


@pytest.mark.parametrize(
    ("value", "other", "text"),
    [
        (0.3, 0.3000000003, "0.3"),
        (0.3000000003, 0.3, "0.3000000003"),
        (1.23456789, None, "1.23457"),
        (1.23456789, 2.0, "1.23457"),
        (1.23456789, 1.23456789, "1.23457"),
        (float(np.nextafter(0.1, 1.0)), 0.1, "0.10000000000000002"),
        (60, 61, "60"),
    ],
)
def test_a_value_has_the_digits_that_tell_it_from_another(value, other, text):
    assert brief(value, other) == text
    if other is not None and other != value:
        assert brief(other, value) != text


def test_a_point_in_words_beside_another():
    near = {"drive.frequency_ratio": 1.21, "drive.velocity_amplitude": 0.16}
    far = near | {"drive.velocity_amplitude": 0.160000001}
    assert Point(far).words(Point(near)) == "frequency ratio 1.21, velocity amplitude 0.160000001"
    assert Point(far).words() == "frequency ratio 1.21, velocity amplitude 0.16"


def test_the_separation_is_that_at_common_instants():
    pytest.importorskip("panel")
    from snapbeam.explorer.run_view import separation

    grid = np.linspace(0.0, 5.0, 501)
    extra = np.sort(np.append(grid, [0.123, 2.7182]))
    small = 1e-13 * np.expm1(grid)
    x, apart = separation((grid, np.sin(grid) + small), (extra, np.sin(extra)))
    np.testing.assert_array_less(np.abs(apart - small[np.isin(grid, x)]), 3e-16)
    assert 0.0 not in apart and np.isin(x, grid).all()
    # nothing in common: the second is interpolated, as far as both reach
    other = np.linspace(0.0, 3.0, 4001) + 1e-5
    x, apart = separation((grid, np.sin(grid)), (other, np.sin(other) + 0.25))
    np.testing.assert_allclose(apart, 0.25, atol=1e-4)
    assert x[-1] <= other[-1]
    x, apart = separation((grid, np.sin(grid)), (grid, np.sin(grid)))
    assert x.size == apart.size == 0


def test_changes_are_told_in_the_words_of_the_fields():
    pytest.importorskip("panel")
    from snapbeam.explorer.cards import changed_words

    before = {
        "beam.thickness": 4e-4, "contact.type": "hertz", "contact.stiffness": 4e8, "integration.cycles": 30, "force.amplitude": 1.0,
        "imperfection.shape": [0.0, 0.0], "integration.step": None,
    }  # fmt: skip
    after = {
        "beam.thickness": 5e-4, "contact.type": "restitution", "contact.coefficient": 0.6, "integration.cycles": 200,
        "imperfection.shape": [0.0, 0.1], "integration.step": None, "base_excitation.phase": 0.0, "base_excitation.type": "sine",
    }  # fmt: skip
    words = changed_words(before, after)
    assert words.startswith("Beam: thickness 0.0005 m, Contact law: restitution, ")
    assert "Integration: cycles 200" in words and "no external force" in words and ", Imperfection" in words
    assert "Contact: coefficient 0.6" in words and "phase" not in words
    assert not any(word in words for word in ("None", "default", "stiffness", "[", "step"))
    assert changed_words(after, after) == ""
    many = {f"model.name_{at}": at for at in range(9)}
    assert changed_words({"model.modes": 1}, many | {"model.modes": 1}).endswith("and 3 more")
