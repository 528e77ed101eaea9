"""The table of outcomes: one row a statistic, each against what the run itself shows."""

from __future__ import annotations

import math

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.solver.statistics import (
    ACCUMULATORS,
    STATISTICS,
    Statistic,
    accumulators_dtype,
    empty_accumulators,
    register_statistic,
    unregister_statistic,
)
from snapbeam.util.validation import InputError

MODEL = sb.ReducedModel.from_beam(default_values.BEAM, modes=8)


def run_of(pair: tuple[float, float], cycles: int, side: str = "below") -> tuple[sb.Run, sb.Run]:
    """A run, and the same one sampled densely and evenly."""
    shaker = sb.Shaker(frequency_ratio=pair[0], velocity_amplitude=pair[1], location=0.4, side=side)
    system, integration = (
        sb.System(MODEL, contacts=[sb.Contact(default_values.CONTACT, shaker)]),
        sb.Integration(cycles=cycles),
    )
    end = cycles / (pair[0] * MODEL.reference_frequency)
    return sb.simulate(system, integration), sb.simulate(
        system, integration, sample_times=np.linspace(0.0, end, 60_001)
    )


@pytest.fixture(
    scope="module", params=[((1.21, 0.18), 8, "below"), ((3.0, 0.5), 8, "above"), ((1.4, 0.02), 5, "below")]
)
def runs(request):
    return run_of(*request.param)


def mean(dataset, values) -> float:
    time = dataset.time.values
    return float(np.trapezoid(values, time) / time[-1])


def test_peaks(runs) -> None:
    run, dense = runs
    shown, outcome = dense.dataset, run.summary
    for name, values in (
        ("displacement", shown.displacement_at_striker),
        ("midspan_displacement", shown.midspan_displacement),
    ):
        assert outcome[f"peak_{name}"] == pytest.approx(float(abs(values).max()), abs=2e-3)
        assert outcome[f"peak_{name}"] == max(abs(outcome[f"min_{name}"]), abs(outcome[f"max_{name}"]))
    for name, values in (("velocity", shown.velocity_at_striker), ("midspan_velocity", shown.midspan_velocity)):
        peak = float(abs(values).max())
        # taken at the ends of steps
        assert 0.9 * peak < outcome[f"peak_{name}"] < 1.0001 * peak


def test_root_mean_squares(runs) -> None:
    run, dense = runs
    shown, outcome = dense.dataset, run.summary
    for name, values in (
        ("displacement", shown.displacement_at_striker),
        ("midspan_displacement", shown.midspan_displacement),
        ("velocity", shown.velocity_at_striker),
        ("midspan_velocity", shown.midspan_velocity),
    ):
        assert outcome[f"rms_{name}"] == pytest.approx(math.sqrt(mean(shown, values.values**2)), rel=2e-2), name


def test_impulse_work_and_power(runs) -> None:
    run, dense = runs
    shown, outcome = dense.dataset, run.summary
    open_at_end = float(dense.dataset.contact_force[-1]) > 0.0
    if not open_at_end:
        assert outcome.impulse == pytest.approx(float(run.impacts.impulse.sum()), rel=1e-12)
    time = shown.time.values
    assert outcome.impulse == pytest.approx(np.trapezoid(shown.contact_force, time), rel=2e-2)
    assert outcome.striker_work == pytest.approx(float(shown.striker_work[-1]), rel=1e-6, abs=1e-12)
    assert outcome.gross_work == float(run.dataset.attrs["gross_work"])
    assert outcome.gross_work >= abs(outcome.striker_work) * (1.0 - 1e-14)
    assert outcome.mean_power == pytest.approx(outcome.striker_work / time[-1], rel=1e-12)


def test_dissipated_energy_is_what_the_ledger_says(runs) -> None:
    run, dense = runs
    assert run.summary.energy_dissipated == pytest.approx(
        float(dense.dataset.energy_dissipated[-1]), abs=2e-4 * run.summary.gross_work
    )


def test_share_of_the_energy_in_high_modes() -> None:
    """Of linear modes about the well at hand; the multiple of omega_1 is asked for."""
    run, dense = run_of((1.4, 0.02), 5)
    assert run.summary.zero_crossings == 0
    limit = run.integration.high_frequency_ratio * MODEL.reference_frequency
    back = MODEL.mass @ MODEL.linear_modes
    q = (dense.dataset.modal_amplitude.values - MODEL.well_amplitude) @ back
    p = dense.dataset.modal_velocity.values @ back
    energy = 0.5 * (p**2 + (MODEL.omega * q) ** 2)
    high = MODEL.natural_frequencies > limit
    assert high.any() and not high.all()
    share = mean(dense.dataset, energy[:, high].sum(axis=1)) / mean(dense.dataset, energy.sum(axis=1))
    assert run.summary.high_frequency_energy_fraction == pytest.approx(share, rel=0.1)
    whole = sb.simulate(run.system, run.integration.replace(high_frequency_ratio=0.5), sample_times=[0.0])
    none = sb.simulate(run.system, run.integration.replace(high_frequency_ratio=1e4), sample_times=[0.0])
    assert (whole.summary.high_frequency_energy_fraction, none.summary.high_frequency_energy_fraction) == (
        pytest.approx(1.0),
        0.0,
    )
    assert whole.summary.peak_force == run.summary.peak_force


def test_a_map_has_the_statistics_of_its_runs() -> None:
    system = sb.System(
        MODEL, contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.18))]
    )
    integration = sb.Integration(cycles=4)
    ds = sb.sweep(system, {"velocity_amplitude": [0.18, 0.3]}, integration)
    assert set(STATISTICS) == set(ds.data_vars)
    for i, amplitude in enumerate(ds.velocity_amplitude.values):
        run = sb.simulate(system.replace(**{"drive.velocity_amplitude": float(amplitude)}), integration)
        assert list(run.summary) == list(STATISTICS)
        for name in STATISTICS:
            np.testing.assert_equal(ds[name].values[i], run.summary[name], err_msg=name)


def test_rows_say_what_they_are() -> None:
    for name, row in STATISTICS.items():
        assert row.name == name and name.isidentifier()
        assert np.dtype(row.dtype)
        assert len(row.long_name) > 5 and row.long_name[0].islower() and not row.long_name.endswith(".")
        assert row.update is None, "the package's own are columns of every engine"
    assert ACCUMULATORS == accumulators_dtype()


def test_books_begin_empty() -> None:
    accumulators_of_runs = empty_accumulators(3)
    assert accumulators_of_runs.dtype == ACCUMULATORS
    assert (accumulators_of_runs["status"] == sb.RunStatus.NOT_RUN).all()
    assert (
        np.isnan(accumulators_of_runs["last_zero_crossing"]).all()
        and np.isnan(accumulators_of_runs["early_stop_time"]).all()
    )
    assert (accumulators_of_runs["peak_force"] == 0.0).all()


# ---------------------------------------------------------------------- rows of somebody


def test_a_formula_of_what_is_kept_needs_no_update() -> None:
    """In runs, maps, outcomes and files at once."""
    row = Statistic(
        "mean_force", "float64", "N", "mean contact force over the time of the run",
        lambda reading: reading.seen("total_impulse") / reading.duration,
    )  # fmt: skip
    system = sb.System(
        MODEL, contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.4, velocity_amplitude=0.02))]
    )
    register_statistic(row)
    try:
        run = sb.simulate(system, sb.Integration(cycles=4))
        duration = 4.0 / (1.4 * MODEL.reference_frequency)
        assert run.summary.mean_force == pytest.approx(run.summary.impulse / duration, rel=1e-12)
        ds = sb.sweep(system, {"velocity_amplitude": [0.02, 0.03]}, sb.Integration(cycles=4))
        assert ds.mean_force.values[0] == run.summary.mean_force
        assert ds.mean_force.attrs == {"units": "N", "long_name": row.long_name}
        assert "mean_force" in run.summary.to_text()
        assert accumulators_dtype() == ACCUMULATORS
    finally:
        unregister_statistic("mean_force")
    assert "mean_force" not in sb.simulate(system, sb.Integration(cycles=1)).summary


def test_what_cannot_be_registered() -> None:
    def value(reading):
        return reading.accumulators["impacts"]

    for name, message in (
        ("impacts", "statistic 'impacts': there is one of that name"),
        ("two words", "statistic 'two words': must be a name, such as 'rms_force'"),
    ):
        with pytest.raises(InputError, match=message):
            register_statistic(Statistic(name, "float64", "1", "what it is", value))
    for name in ("impacts", "nothing"):
        with pytest.raises(InputError, match=f"statistic '{name}': was not registered"):
            unregister_statistic(name)
