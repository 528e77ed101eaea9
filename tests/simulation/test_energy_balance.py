"""Runs that miss their energy ledger say so."""

from __future__ import annotations

import dataclasses
import warnings

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.solver.assemble import make_ensemble
from snapbeam.solver.native import run_ensemble
from snapbeam.solver.statistics import statistics_of
from snapbeam.util.diagnostics import DiagnosticWarning

VIOLENT = sb.System(
    sb.ReducedModel.from_beam(default_values.BEAM, 1),
    contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=6.8, velocity_amplitude=30.0))],
)


@pytest.mark.filterwarnings("ignore:drive.velocity_amplitude = 30")
def test_a_run_with_steps_too_long_for_it_says_so() -> None:
    """Four modes and a step of about a quarter of the cycle."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, 4)
    shaker = sb.Shaker(frequency_ratio=1.2, velocity_amplitude=1.0)
    system = sb.System(model, contacts=[sb.Contact(default_values.CONTACT, shaker)])
    step = 0.24 / (1.2 * model.reference_frequency)
    with pytest.warns(DiagnosticWarning, match="the energy-balance error is"):
        rough = sb.simulate(system, sb.Integration(cycles=20, step=step))
    assert abs(rough.dataset.attrs["energy_error"]) > 1e-3
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fine = sb.simulate(system, sb.Integration(cycles=20, accuracy="reference"))
    assert abs(fine.dataset.attrs["energy_error"]) < 1e-7


def test_the_error_is_that_of_the_energy_balance_in_the_dataset() -> None:
    system = VIOLENT.replace(**{"drive.frequency_ratio": 1.4, "drive.velocity_amplitude": 0.3})
    data = sb.simulate(system, sb.Integration(cycles=20)).dataset
    stored = data.energy_beam + data.energy_contact + data.energy_dissipated - data.striker_work
    missed = -float(stored[-1] - stored[0]) / data.attrs["gross_work"]
    assert data.attrs["energy_error"] == pytest.approx(missed, rel=1e-3, abs=1e-12)


def test_energy_out_of_nothing_is_no_result() -> None:
    """Also where no ledger is kept: a map's class is unknown where more energy is found than was put in."""
    ensemble = make_ensemble(VIOLENT, sb.Integration(cycles=2))
    accumulators_of_runs = run_ensemble(ensemble, 1)
    believed = statistics_of(ensemble, accumulators_of_runs)
    assert believed["status"][0] == sb.RunStatus.OK
    accumulators_of_runs["energy"] = (
        accumulators_of_runs["first_energy"] + accumulators_of_runs["work"] + 0.02 * accumulators_of_runs["gross_work"]
    )
    found = statistics_of(ensemble, accumulators_of_runs)
    assert found["status"][0] == sb.RunStatus.ENERGY_ERROR
    assert found["response_class"][0] == sb.ResponseClass.UNKNOWN
    assert np.isnan(found["peak_displacement"][0])
    assert "more energy than the striker put in" in sb.RunStatus.ENERGY_ERROR.advice


def test_free_vibration_is_balanced() -> None:
    model = sb.ReducedModel.from_beam(default_values.BEAM, 4)
    start = (0.9 * np.asarray(model.well_amplitude), np.zeros(4))
    run = sb.simulate(
        sb.System(model, initial_state=sb.State(amplitude=start[0], velocity=start[1])), sb.Integration(cycles=3)
    )
    assert run.summary.status == sb.RunStatus.OK
    assert abs(run.dataset.attrs["energy_error"]) < 1e-4


@pytest.mark.parametrize("modes", [1, 4])
def test_rounding_at_rest_is_no_error(modes) -> None:
    """Without contact the state decays until only the rounding of its energy is left."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes, damping_ratio=0.05)
    away = sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.01))
    below = sb.simulate(sb.System(model, contacts=[away]), sb.Integration(cycles=1)).final_state
    assert below is not None
    at_well = -np.asarray(model.well_amplitude)
    state = dataclasses.replace(below, amplitude=at_well * (1.0 + 1e-9), velocity=0.0 * at_well, modal=None)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(6):
            run = sb.simulate(sb.System(model, contacts=[away], initial_state=state), sb.Integration(cycles=15))
            assert run.summary.status == sb.RunStatus.OK
            state = run.final_state
            assert state is not None
    assert run.summary["impacts"] == 0
