"""Random systems against an independent reference: whether parts combine.

``SNAPBEAM_COMPOSITIONS=2000 pytest tests/composition -m slow`` tests 2,000 seeds in place of 500, and
``python tests/composition/generator.py SEED`` repeats one.
"""

from __future__ import annotations

import math
import os
import re
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from composition_reference import Solution
from generator import BASES, DRIVES, FORCES, Composition, Features, composed, features_of
from numpy.typing import NDArray

import snapbeam as sb
from snapbeam.util.validation import InputError

Array = NDArray[np.float64]

PHYSICAL = {
    "no well": r"leave no well where a run begins",
    "start beyond a law": r"initial_state: the displacement .* must be within the range of its law",
    "kink of a chirp": r"striker_on_base = False with a chirp",
}
"""Refusals with a physical reason, or for data that are missing."""
QUICK = (
    Features(2, (("hertz", "sine", False),), base="acceleration_sine", local=("local_spring",), uneven=True),
    Features(3, (("hunt_crossley", "burst", False), ("kelvin_voigt", "fixed", True)), local=("local_spring",)),
    Features(2, (("power", "displacement_sine", True),), load="harmonic_force", circuits=("piezo", "coil")),
    Features(4, external=("harmonic_force",), local=("quadratic_damping", "magnetic_force"), started=True),
    Features(
        2,
        (("hertz", "sine", False), ("hertz", "sine", False)),
        local=("attracting_magnet", "softening_spring"),
        circuits=("piezo",),
    ),
    Features(3, external=("harmonic_force",), uneven=True),
    Features(3, (("hertz", "fixed", False),), external=("half_sine_force",), started=True),
)
"""Parts whose numbers are drawn in the quick tests."""
LIMIT = {"standard": 1e-3, "reference": 5e-7}
"""Greatest errors of a run, over b, of well-conditioned problems; most are a hundred times smaller."""
LOCAL = {"standard": 1e-5, "reference": 1e-9}
"""Errors over b that a run makes on its way, which its conditioning enlarges."""
BEYOND = 100.0
"""Multiple of the limit up to which an error that the conditioning enlarges is compared."""
QUIET = 1e-5
"""Voltage, V, below which errors are not relative."""
KICK = 1e-10
"""Relative change of the start by which the conditioning is measured."""
BALANCE = {"standard": 1e-3, "reference": 1e-6}
"""Greatest errors of the energy balance, over the gross work, that a run may have without a word."""
STORED = 1e-8
"""The same over the energy that the beam holds beside work that is small."""
ROUNDING = 1e-11
"""Difference over b of runs whose numbers agree to rounding, before the conditioning enlarges it."""
PIECES = 1e-6
"""Greatest relative difference of runs in pieces that agree to rounding, which their conditioning enlarges."""
COUNT = int(os.environ.get("SNAPBEAM_COMPOSITIONS", "500"))
CHUNK = 20


@dataclass
class Report:
    """The results of one system."""

    seed: int
    refused: str = ""
    compared: float = math.nan
    """Share of the run up to the horizon."""
    error: dict[str, float] = field(default_factory=dict)
    """Greatest error over b up to the horizon, over what is allowed, by level."""
    balance: dict[str, float] = field(default_factory=dict)
    largest: float = math.nan
    """Greatest amplification of a change of the start."""
    failures: list[str] = field(default_factory=list)
    impacts: int = 0
    left: float = math.inf
    """Time at which the motion leaves the range of a law, s."""


def reason(error: InputError) -> str:
    """The name of a refusal; raises what is not in the lists."""
    for name, words in PHYSICAL.items():
        if re.search(words, str(error)):
            return name
    raise error


def lasting(system: sb.System) -> tuple[int, float]:
    """Cycles that take about one and a half periods of the first mode, at most 3, and their duration."""
    lead, first = system.primary_excitation, 2.0 * math.pi / system.scale.omega
    cycle = first
    if lead is not None:
        columns = {name: np.array([value]) for name, value in lead[1].values().items()} or {"": np.zeros(1)}
        cycle = float(lead[1].cycle(columns, system.scale)[0])
    cycles = min(max(round(1.5 * first / cycle), 1), 3)
    return cycles, cycles * cycle


def observed(composition: Composition, solution: Solution, times: Array) -> Array:
    """Heights at many places, penetrations and voltages of the reference, over b and over their greatest."""
    length = composition.system.scale.length
    heights, depths = solution.heights(composition.places) / length, solution.depths(times) / length
    return np.concatenate((heights, depths.reshape(times.size, -1)), axis=1)


def recorded(composition: Composition, run: sb.Run) -> Array:
    """The same of a run."""
    data, system = run.dataset, composition.system
    shapes = np.array([system.model.shape_at(place) for place in composition.places])
    found = [data["modal_amplitude"].values @ shapes.T / system.scale.length]
    if len(system.contacts) > 1:
        found.append(data["striker_penetrations"].values)
    elif system.contacts:
        found.append(data["penetration_normalised"].values[:, None])
    return np.concatenate(found, axis=1)


def checked(
    seed: int, features: Features | None = None, levels: tuple[str, ...] = ("reference",), engine: str = "native"
) -> Report:
    """Compare one system with the reference; failures are listed in the report."""
    report = Report(seed)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of wells that a local force takes away
            composition = composed(seed, features)
            system = composition.system
            cycles, end = lasting(system)
        times = np.linspace(0.0, end, 121)[1:] * (1.0 - 1e-9)
        runs, warned = {}, {}
        for level in levels:
            how = sb.Integration(cycles=cycles, accuracy=level, engine=engine)
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                runs[level] = sb.simulate(system, how, sample_times=times)
            warned[level] = any("energy-balance error" in str(each.message) for each in caught)
    except InputError as error:
        report.refused = reason(error)
        return report
    kick = np.random.default_rng([seed, 2]).uniform(-KICK, KICK, 200)
    truth, moved = (
        Solution(composition.beam, composition.parts, times, longest=longest, kick=each)
        for longest, each in ((150.0, None), (240.0, kick))
    )
    report.left = truth.left
    if math.isfinite(truth.left):
        for level, run in runs.items():
            check_end(truth, times, recorded(composition, run), level, run, report)
        if report.failures:
            return report
    count = min(len(truth.states), len(moved.states))
    if not count:
        return report
    for each in (truth, moved):
        each.states = each.states[:count]
    times = times[:count]
    expected = observed(composition, truth, times)
    growth = np.abs(observed(composition, moved, times) - expected).max(axis=1) / KICK
    amplified = np.maximum.accumulate(np.maximum(growth, 1.0))
    report.largest = float(amplified[-1])
    for level, run in runs.items():
        report.impacts = run.summary.impacts
        allowed = np.maximum(LIMIT[level], LOCAL[level] * amplified)
        within = allowed <= BEYOND * LIMIT[level]
        found = recorded(composition, run)[:count]
        error = np.abs(found - expected).max(axis=1)
        report.compared = float(within.mean())
        report.error[level] = float((error / allowed)[within].max()) if within.any() else math.nan
        if not report.error[level] < 1.0 and within.any():  # the reference's own error, by shorter steps
            finer = Solution(composition.beam, composition.parts, times, longest=240.0)
            own = np.abs(observed(composition, finer, times) - expected).max(axis=1)
            allowed = np.maximum(allowed, 2.0 * own)
            within = allowed <= BEYOND * LIMIT[level]
            report.error[level] = float((error / allowed)[within].max())
        report.balance[level] = abs(float(run.dataset.attrs["energy_error"]))
        if run.summary.status.name != "OK" and not math.isfinite(truth.left):
            report.failures.append(f"{level}: status {run.summary.status.name}")
        if not report.error[level] < 1.0:
            at = int(np.argmax((error / allowed) * within))
            worst = int(np.argmax(np.abs(found - expected)[at]))
            report.failures.append(
                f"{level}: error {error[at]:.2e} b at t = {times[at]:.5g} s of {end:.5g} s in column {worst}, "
                f"allowed {allowed[at]:.2e} b"
            )
        stored = float(np.nanmax(np.abs(run.dataset["energy_beam"]))) / max(run.dataset.attrs["gross_work"], 1e-300)
        if not (report.balance[level] < BALANCE[level] + STORED * stored or warned[level] or math.isfinite(truth.left)):
            report.failures.append(f"{level}: energy balance {report.balance[level]:.2e}")
        if system.harvesters:
            check_voltages(composition, truth, run, within, LIMIT[level], amplified, report)
    if composition.mirrors:
        level, run = next(iter(runs.items()))
        check_mirror(composition, cycles, times, level, run, amplified, report, engine)
    return report


def check_end(truth: Solution, times: Array, found: Array, level: str, run: sb.Run, report: Report) -> None:
    """Check that a run ends where the motion of the reference leaves the range of a law, between the same samples."""
    known, near = np.isfinite(found).all(axis=1), LIMIT[level] * times[-1]
    if (
        run.summary.status.name != "DIVERGED"
        or known[times > truth.left + near].any()
        or not known[times < truth.latest - near].all()
    ):
        last = times[known].max(initial=0.0)
        report.failures.append(
            f"{level}: status {run.summary.status.name}, known up to {last:.6g} s, and the motion leaves the range of a "
            f"law at {truth.left:.6g} s"
        )


def check_voltages(
    composition: Composition,
    truth: Solution,
    run: sb.Run,
    within: NDArray[np.bool_],
    limit: float,
    amplified: Array,
    report: Report,
) -> None:
    """Compare the voltages of the harvesters, each over its maximum."""
    expected = np.array(composition.volts) * truth.currents()
    several = len(composition.volts) > 1
    found = run.dataset["voltages"].values if several else run.dataset["voltage"].values[:, None]
    # of a beam at rest, or where nothing moves the circuit, the voltage is rounding
    error = (np.abs(found[: len(expected)] - expected) / np.maximum(np.abs(expected).max(axis=0), QUIET)).max(axis=1)
    # impacts change the velocity, which the voltage follows, within short times
    if within.any() and not float((error / amplified)[within].max()) < 100.0 * limit:
        report.failures.append(f"voltage: error {float(error[within].max()):.2e} of its greatest")


def check_mirror(
    composition: Composition,
    cycles: int,
    times: Array,
    level: str,
    run: sb.Run,
    amplified: Array,
    report: Report,
    engine: str = "native",
) -> None:
    """Compare the run of the mirror image: to the last bits where its numbers differ by signs only."""
    image = composed(report.seed, composition.features, mirror=True)
    how = sb.Integration(cycles=cycles, accuracy=level, engine=engine)
    found = sb.simulate(image.system, how, sample_times=times)
    one, other = run.dataset["modal_amplitude"].values[: times.size], found.dataset["modal_amplitude"].values
    if composition.exact_mirror:
        if not (np.abs(one + other) <= 4.0 * np.finfo(float).eps * np.abs(one).max(axis=0)).all():
            report.failures.append(f"mirror image: differs by {np.abs(one + other).max():.2e} m^0.5")
        return
    shapes = np.array([composition.beam.shape(place) for place in composition.places])
    error = np.abs((one + other) @ shapes.T).max(axis=1) / composition.system.scale.length
    rounding = 100.0 * ROUNDING if engine == "python" else ROUNDING  # its steps follow from the last bits of errors
    if not (error < rounding * amplified).all():
        report.failures.append(f"mirror image: differs by {error.max():.2e} b")


def inconsistent(seed: int, folder: Path, features: Features | None = None) -> list[str]:
    """Compare one system run by run: saved and loaded, advanced in pieces, swept; the differences in words."""
    composition, found = composed(seed, features), []
    system = composition.system
    cycles = lasting(system)[0]
    how = sb.Integration(cycles=cycles)
    try:
        run = sb.simulate(system, how)
    except InputError as error:
        reason(error)
        return []
    system.save(folder / "system.toml")
    loaded = sb.System.load(folder / "system.toml")
    if loaded != system or loaded.hash != system.hash:
        found.append("loaded system: not equal")
    again = sb.simulate(loaded, how).dataset.assign_attrs(created=run.dataset.attrs["created"])
    if not again.identical(run.dataset):
        found.append("loaded system: another run")
    run.save(folder / "run.nc")
    back = sb.load(folder / "run.nc").dataset
    for name in run.dataset.data_vars:
        if not np.array_equal(back[name].values, run.dataset[name].values):
            found.append(f"loaded run: {name}")
    found += pieces(composition, cycles) + points(composition, how, run)
    return found


def pieces(composition: Composition, cycles: int) -> list[str]:
    """Differences between an advance in one call and one period at a time."""
    system = composition.system
    whole, state, found = sb.advance(system, periods=2), None, []
    for _ in range(2):
        state = sb.advance(system, state)
    assert state is not None
    again = sb.advance(system, periods=2, save_every_period=True)[-1]
    repeats = len(system.moving) == 0 or (len(system.moving) == 1 and system.moving[0][1].is_periodic)
    exact = repeats and not system.harvesters  # charges hold the coordinates of circuits to rounding
    scale = float(np.abs(system.model.well_amplitude).max())
    for name in ("amplitude", "velocity", "striker_shift", "circuit", "contact_time"):
        one, two, three = (getattr(each, name) for each in (whole, state, again))
        if not np.array_equal(one, three, equal_nan=True):
            found.append(f"every period saved: {name}")
        if exact and not np.array_equal(one, two, equal_nan=True):
            found.append(f"advanced in pieces: {name}")
    if not exact and not np.abs(whole.amplitude - state.amplitude).max() < PIECES * scale:
        found.append(f"advanced in pieces: differs by {np.abs(whole.amplitude - state.amplitude).max() / scale:.2e}")
    return found


def points(composition: Composition, how: sb.Integration, run: sb.Run) -> list[str]:
    """Differences between a run and the point of a sweep."""
    ratio = float(composition.system.model.damping_ratio[0])
    swept = sb.sweep(composition.system, {"model.damping_ratio": [ratio, 1.1 * ratio]}, how)
    alone = sb.sweep(composition.system, {"model.damping_ratio": [ratio]}, how)
    found, summary = [], dict(run.summary)
    for name in swept.data_vars:
        one, two = swept[name].values[0], alone[name].values[0]
        if not np.array_equal(one, two, equal_nan=bool(np.asarray(one).dtype.kind == "f")):
            found.append(f"neighbours of a sweep: {name}")
        own: Any = summary.get(str(name))
        if isinstance(own, (int, float)) and not (one == own or (math.isnan(own) and math.isnan(one))):
            found.append(f"sweep: {name} {float(one)!r}, of the run {own!r}")
    return found


MOTIONS = [
    *(
        Features(
            2,
            (("hertz", drive, False),),
            base="acceleration_sine" if drive == "recorded_motion" else None,
            started=drive == "fixed",
        )
        for drive in sorted(set(DRIVES))
    ),
    *(Features(2, (("hertz", "fixed", False),), base=base) for base in BASES),
    *(Features(2, external=(force,), started=True) for force in FORCES),
    *(Features(2, load=load, started=True) for load in FORCES),
]


@pytest.mark.sampled(2)
@pytest.mark.parametrize(
    "features",
    MOTIONS,
    ids=lambda each: str(each.contacts[:1] or each.external or each.load)[:40] + str(each.base or ""),
)
def test_every_motion(features: Features) -> None:
    judge([checked(5, features, ("reference", "standard"))])


@pytest.mark.sampled(2)
@pytest.mark.parametrize("seed", [0, 2, 3, 8])
def test_a_random_system(seed: int) -> None:
    """Any parts with any numbers, at both levels."""
    judge([checked(seed, levels=("reference", "standard"))])


@pytest.mark.parametrize("engine", ["native", "python"])
def test_a_motion_that_leaves_the_range_of_a_law(engine: str) -> None:
    """A softening spring on a struck beam: each engine ends where the reference leaves the range, and is right before."""
    features = Features(1, (("hertz", "sine", False),), local=("softening_spring",), started=True)
    report = checked(33, features, engine=engine)
    judge([report])
    assert math.isfinite(report.left)


@pytest.mark.slow
@pytest.mark.parametrize("kind", range(len(QUICK)))
def test_twenty_systems_of_the_same_parts(kind: int) -> None:
    """The numbers of twenty seeds."""
    judge([checked(seed, QUICK[kind]) for seed in range(20)])


@pytest.mark.slow
@pytest.mark.parametrize("kind", range(len(QUICK)))
def test_runs_of_the_same_parts_are_consistent(kind: int, tmp_path: Path) -> None:
    """Saved and loaded, advanced in pieces, swept."""
    assert inconsistent(0, tmp_path, QUICK[kind]) == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", [607, 810, 933, 1131, 1379, 1424])
def test_systems_with_a_circuit_faster_than_the_step(seed: int) -> None:
    """Their errors were beyond what is allowed before the lag of such a circuit was taken into account."""
    judge([checked(seed, levels=("reference", "standard"))])


@pytest.mark.slow
def test_a_system_with_a_start_deep_in_a_lossy_contact() -> None:
    """Its error at level standard was 5e-2 b before the steps resolved the damping of a contact."""
    judge([checked(317, levels=("reference", "standard"))])


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, COUNT, CHUNK))
def test_random_systems(first: int) -> None:
    """Any parts with any numbers; every tenth also at the standard level."""
    judge([
        checked(seed, levels=("reference", "standard") if seed % 10 == 0 else ("reference",))
        for seed in range(first, min(first + CHUNK, COUNT))
    ])  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(0, COUNT, 4 * CHUNK))
def test_runs_of_random_systems_are_consistent(seed: int, tmp_path: Path) -> None:
    """Saved and loaded, advanced in pieces, swept."""
    assert inconsistent(seed, tmp_path) == [], features_of(seed)


def judge(reports: list[Report]) -> None:
    """Print what was compared, and fail with the seeds that disagree."""
    tested = [each for each in reports if not each.refused]
    for each in reports:
        print(each)
    if tested:
        print(f"compared up to {np.mean([each.compared for each in tested]):.0%} of the runs")
    wrong = {each.seed: each.failures for each in reports if each.failures}
    assert not wrong, f"repeat with python tests/composition/generator.py {' '.join(map(str, wrong))}: {wrong}"
