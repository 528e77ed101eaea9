"""A drive whose velocity jumps while the tip touches: no jump of the energy, and no force above the peak force."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values

MODEL = sb.ReducedModel.from_beam(default_values.BEAM, modes=1, damping_ratio=0.005)


def system_of(drive: sb.Chirp) -> sb.System:
    return sb.System(MODEL, contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=drive))])


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:the energy-balance error")
@pytest.mark.parametrize("accuracy", ["standard", "reference"])
@pytest.mark.parametrize(("start", "stop", "velocity"), [(1.0, 8.0, 0.3), (4.0, 0.5, 0.3), (1.0, 20.0, 0.1)])
def test_chirp_that_ends_in_contact(start: float, stop: float, velocity: float, accuracy: str) -> None:
    """The sweep ends within the first contact, after 0.6 times its duration."""
    cycle = 1.0 / (start * MODEL.reference_frequency)
    drive = sb.Chirp(start_ratio=start, stop_ratio=stop, velocity_amplitude=velocity, sweep_cycles=50.0)
    for _ in range(12):
        first = sb.simulate(system_of(drive), sb.Integration(cycles=1, accuracy=accuracy), sample_times=[0.0])
        sweep = 0.6 * float(first.impacts.duration[0]) / cycle
        sweep = sweep if drive.sweep_cycles > 1.0 else 0.5 * (sweep + drive.sweep_cycles)
        drive = dataclasses.replace(drive, sweep_cycles=sweep)
    edge = drive.sweep_cycles * cycle
    near = edge + np.linspace(-2e-6, 2e-6, 401) * cycle
    times = np.sort(np.concatenate([np.linspace(0.0, 3.0 * edge, 4001), near]))
    run = sb.simulate(
        system_of(drive), sb.Integration(cycles=1, accuracy=accuracy), sample_times=times[times < 0.99 * cycle]
    )
    data, time = run.dataset, run.dataset.time.values
    force = data.contact_force.values
    at_edge = np.abs(time - edge) <= 2.1e-6 * cycle
    assert (force[at_edge] > 0.0).all(), "the tip touches at the edge"
    balance = (data.energy_beam + data.energy_contact + data.energy_dissipated - data.striker_work).values
    if accuracy == "reference" or start == 1.0:
        assert np.ptp(balance[at_edge]) < 2e-9 * run.summary.gross_work
    inside = (time > 0.0) & (time < float(run.impacts.duration[0]))
    most, recorded = float(run.impacts.peak_force[0]), float(force[inside].max())
    assert most >= recorded * (1.0 - (2e-5 if accuracy == "standard" else 1e-9))
