"""Estimated error by the number of modes against models with 128 modes."""

from __future__ import annotations

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model.force_displacement import force_displacement
from snapbeam.model.modal_convergence import modal_error, well_frequencies, with_modes
from snapbeam.model.parameter_file import config_from_mapping

pytestmark = [
    pytest.mark.filterwarnings("ignore:this imperfection leaves one well"),
    pytest.mark.filterwarnings("ignore:the lowest mode about the equilibrium"),
]
ARCH = {
    "beam": {"length": 800e-6, "thickness": 3e-6, "width": 30e-6, "density": 2330.0, "young_modulus": 160e9, "axial_load": 0.0},
    "imperfection": {"midspan_amplitude": 6e-6, "antisymmetric_amplitude": 20e-9},
}  # fmt: skip
PLATE = {
    "beam": {"length": 0.3, "thickness": 4e-4, "width": 0.02, "density": 7850.0, "young_modulus": 2e11, "buckling_level": 7e-4},
}  # fmt: skip
SPRING = {"type": "local_spring", "stiffness": 5.0, "location": 0.4}


def system_of(sections: dict, modes: int | str, **more) -> sb.System:
    given = sections | {"model": {"modes": modes, "damping_ratio": 0.01}} | more
    return config_from_mapping(given).static_system


@pytest.mark.parametrize("modes", [2, 3, 4, 8, 16])
@pytest.mark.parametrize(
    ("sections", "more"),
    [(ARCH, {}), (PLATE, {}), pytest.param(ARCH, {"force": SPRING}, marks=pytest.mark.slow)],
    ids=["arch", "plate", "spring"],
)
def test_the_estimate_bounds_the_error_of_frequencies(sections, more, modes) -> None:
    """From above, by at most two fifths."""
    system = system_of(sections, modes, **more)
    here = well_frequencies(system)
    exact = well_frequencies(with_modes(system, 128 if not more else 48))[:, : here.shape[1]]
    error = float(np.abs(exact / here - 1.0).max())
    assert error <= modal_error(system) <= 1.4 * error + 1e-6


@pytest.mark.slow
def test_the_estimate_of_a_snap_through_force() -> None:
    """2 and 4 modes of an arch have the same force; the estimate of 2 modes is not 0."""
    forces = {n: float(force_displacement(system_of(ARCH, n), 0.5).snap_through_force) for n in (2, 4, 16)}
    assert forces[2] == pytest.approx(forces[4], rel=1e-9)
    for modes in (2, 4):
        estimate = modal_error(system_of(ARCH, modes), lambda each: force_displacement(each, 0.5)["snap_through_force"])
        assert abs(forces[16] / forces[modes] - 1.0) <= estimate <= 0.01


def test_an_automatic_number_of_modes() -> None:
    """The stated error is met, and not with half of the modes."""
    for text, error in (("auto", 0.01), ("auto 0.2%", 0.002)):
        system = system_of(ARCH, text)
        assert modal_error(system) <= error
        assert modal_error(with_modes(system, system.model.modes // 2)) > error
    with pytest.raises(sb.InputError, match="must be a number in"):
        system_of(ARCH, "auto 90%")
    with pytest.raises(sb.InputError, match="modes"):
        system_of(ARCH, "many")


def test_given_modes_have_no_estimate() -> None:
    model = sb.ReducedModel.from_matrices([[1.0]], [[4.0]], contact_shape=[1.0], length_scale=1e-3)
    assert np.isnan(modal_error(sb.System(model=model)))
    with pytest.raises(sb.InputError, match="matrices"):
        sb.model.converged_modes(sb.System(model=model))
