"""The rules of the claims on results known by formula: each verdict can be reached, and is where it should be."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from claims_data import DRIVE, RATIO, Given, calm_sensitivity, response_map, two_maps

from snapbeam.paper.claims.topics import (
    classes,
    disturbances,
    efficiency,
    questions,
    resonances,
    thresholds,
    transients,
    waveforms,
)
from snapbeam.paper.recipes.waveforms import BIN_EDGES
from snapbeam.util.status_codes import ResponseClass

STEP = DRIVE[1] - DRIVE[0]


def notched(at: float, wide: float = 0.4, depth: float = 0.1) -> np.ndarray:
    """A threshold of 0.2 with a notch."""
    return 0.2 - depth * np.exp(-(((RATIO - at) / wide) ** 2))


@pytest.mark.parametrize(("at", "wide", "verdict"), [(1.4, 0.1, "holds"), (1.55, 0.4, "in part"), (1.9, 0.1, "fails")])
def test_notch_of_one_mode(at, wide, verdict):
    """2a: at the printed place, near enough for a step of V, elsewhere."""
    result = thresholds.ROWS["2a"](two_maps(notched(at, wide), notched(1.2)))
    assert result.verdict == verdict
    position = result.quantities["position"]
    assert abs(position.value - at) <= position.uncertainty


def test_notch_shifts():
    """2c: by how much, and which way."""
    assert thresholds.notch_shifts(two_maps(notched(1.5, 0.1), notched(1.2, 0.1))).verdict == "holds"
    back = thresholds.notch_shifts(two_maps(notched(1.2, 0.1), notched(1.5, 0.1)))
    assert back.verdict == "fails" and back.quantities["shift"].value == pytest.approx(-0.3, abs=0.05)


@pytest.mark.parametrize(("lower", "verdict"), [(0, "holds"), (4, "in part"), (20, "fails")])
def test_universally_higher(lower, verdict):
    """3a: nowhere, at few and at many frequencies lower."""
    one, many = np.full(RATIO.size, 0.1), np.full(RATIO.size, 0.2)
    many[30 : 30 + lower] = 0.05
    result = thresholds.universally_higher(two_maps(one, many))
    assert result.verdict == verdict
    assert result.numbers["own_count"] == lower
    assert result.quantities["own"].value == pytest.approx(lower / RATIO.size)


def test_the_axes_matter_for_what_is_lower():
    """3a: a threshold that rises steeply is lower only where the frequency is the same in Hz."""
    one = np.round(0.02 + 0.12 * RATIO, 2)
    many = np.round(one + 0.005, 2)  # never below by half a step on its own axes
    result = thresholds.universally_higher(two_maps(one, many))
    assert result.numbers["own_count"] == 0
    assert result.numbers["hertz_count"] > result.numbers["own_count"] or result.verdict == "holds"


def test_high_frequency():
    """3b: one mode falls and many rise; both rise; many fall."""
    falling, rising = 0.2 - 0.03 * RATIO, 0.2 + 0.05 * RATIO
    assert thresholds.high_frequency(two_maps(falling, rising)).verdict == "holds"
    assert thresholds.high_frequency(two_maps(0.5 * rising, rising + 0.02)).verdict == "in part"
    assert thresholds.high_frequency(two_maps(0.3 * falling, falling)).verdict == "fails"


def long_maps(kinds_200: np.ndarray, kinds_1000: np.ndarray, modes: int) -> Given:
    """Figs. 6 and 7 of the same maps for both models, without chaos."""
    short, long = response_map(kinds_200, modes), response_map(kinds_1000, modes, 1000)
    pair = {"modes_1": short.assign_attrs(modes=1), "modes_32": short.assign_attrs(modes=32)}
    after = {"modes_1": long.assign_attrs(modes=1), "modes_32": long.assign_attrs(modes=32)}
    calm = calm_sensitivity(pair["modes_1"], pair["modes_32"])
    calm |= {name: after["modes_32"] for name in ("long", "perturbed_long")}
    calm |= {f"one_mode_{name}": after["modes_1"] for name in ("long", "perturbed_long")}
    return Given(fig6=pair, fig7=after, sensitivity=calm)


def settled(share: float = 0.0, kind: ResponseClass = ResponseClass.CONTINUOUS) -> np.ndarray:
    """Interwell above 0.1, all in the second well but a share of another kind, evenly spread."""
    kinds = np.where(DRIVE[None, :] > 0.1, ResponseClass.TRANSIENT_2, ResponseClass.INTRAWELL)
    kinds = np.broadcast_to(kinds, (RATIO.size, DRIVE.size)).copy()
    inside = np.flatnonzero(kinds > 0)
    count = round(share * inside.size)
    kinds.flat[inside[np.linspace(0, inside.size - 1, count).astype(int)]] = kind
    return kinds


@pytest.mark.parametrize(("share", "verdict"), [(0.0, "holds"), (0.05, "in part"), (0.5, "fails")])
def test_entirely_settled(share, verdict):
    """4a: all, most, half of the responses at high V/Omega."""
    assert classes.settled(long_maps(settled(), settled(share), 32)).verdict == verdict


def test_entirely_settled_depends_on_the_cut():
    """4a: a share that is right above the dashed line and wrong far above it does not hold."""
    kinds = settled()
    slow = np.broadcast_to(RATIO[:, None] < 0.13, kinds.shape)
    kinds[slow & (kinds > 0)] = ResponseClass.CONTINUOUS
    result = classes.settled(long_maps(settled(), kinds, 32))
    assert result.quantities["fourth"].value < result.quantities["share"].value
    assert result.verdict == "fails"


@pytest.mark.parametrize(
    ("before", "after", "verdict"),
    [(0.05, 0.001, "holds"), (0.0045, 0.0025, "in part"), (0.05, 0.04, "fails"), (0.011, 0.009, "in part")],
)
def test_first_well_disappears(before, after, verdict):
    """4c: gone, never there, still there, hardly fewer."""
    first = ResponseClass.TRANSIENT_1
    results = long_maps(settled(before, first), settled(after, first), 1)
    assert classes.first_well_disappears(results).verdict == verdict


def test_changes_have_an_uncertainty_of_changes():
    """4d: its uncertainty is how much the share of changes differs, not the share of a class."""
    results = long_maps(settled(), settled(0.3), 32)
    quiet = classes.changes(results).quantities["many"]
    calm = results["sensitivity"]
    # the changed drive moves half as many points between 200 and 1000 cycles
    calm["perturbed_long"] = response_map(settled(0.15), 32, 1000)
    moved = classes.changes(results).quantities["many"]
    base = float((settled() != settled(0.3)).mean())
    assert quiet.value == moved.value == pytest.approx(base)
    assert moved.uncertainty == pytest.approx(0.5 * base, rel=0.1) and quiet.uncertainty < 0.02
    assert classes.changes(results).verdict == "holds"
    assert classes.changes(long_maps(settled(), settled(0.05), 32)).verdict == "fails"


def test_how_transients_end():
    """24a and 24b: in the second well mostly, in the first sometimes."""
    results = long_maps(settled(0.1, ResponseClass.TRANSIENT_1), settled(0.1, ResponseClass.TRANSIENT_1), 32)
    assert transients.ends_in_second_well(results).verdict == "holds"
    assert transients.ends_in_first_well(results).verdict == "holds"
    other = long_maps(settled(0.8, ResponseClass.TRANSIENT_1), settled(0.8, ResponseClass.TRANSIENT_1), 32)
    assert transients.ends_in_second_well(other).verdict == "fails"
    assert transients.ends_in_first_well(long_maps(settled(), settled(), 32)).verdict == "fails"


@pytest.mark.parametrize(("near", "far", "verdict"), [(0.5, 0.0, "holds"), (0.2, 0.15, "in part"), (0.0, 0.2, "fails")])
def test_late_changes_lie_near_the_threshold(near, far, verdict):
    """32b."""
    before = response_map(np.full(RATIO.size, 0.3), 32, 1000)
    kinds = before.response_class.values.copy()
    close = np.abs(DRIVE / 0.3 - 1.0) <= 0.15
    rng = np.random.default_rng(0)
    chance = np.where(close[None, :], near, far)
    after = response_map(np.where(rng.random(kinds.shape) < chance, ResponseClass.TRANSIENT_1, kinds), 32, 3000)
    late = {"modes_1_before": before, "modes_1_after": after, "modes_32_before": before, "modes_32_after": after}
    assert transients.outlasts_near_threshold(Given(transients=late)).verdict == verdict


def swept(*peaks: tuple[float, float]) -> np.ndarray:
    """A displacement over RATIO with maxima at given frequencies and of given heights."""
    ratio = np.linspace(0.25, 4.0, 151)
    curve = np.full(ratio.size, -1.0)
    for at, height in peaks:
        curve += height * np.exp(-(((ratio - at) / 0.06) ** 2))
    return curve


def resonance_data(one: np.ndarray, many: np.ndarray) -> Given:
    ratio = np.linspace(0.25, 4.0, 151)
    maps = {}
    for name, curve, modes in (("modes_1", one, 1), ("modes_32", many, 32)):
        maps[name] = xr.Dataset(
            {"max_displacement": (("frequency_ratio", "velocity_amplitude"), np.stack([curve, curve], axis=1))},
            {"frequency_ratio": ratio, "velocity_amplitude": [0.005, 0.02]},
            {"modes": modes, "reference_frequency": 83.93 if modes == 1 else 81.85, "cycles": 1000},
        )
    return Given(figB10=maps)


PAIR = swept((1.8, 1.0), (3.6, 0.8))


def test_maxima_of_many_modes():
    """9c: both lower; both lower and another one above; one of them higher."""
    lower = swept((1.5, 1.0), (3.0, 0.8))
    assert resonances.lower_with_many(resonance_data(PAIR, lower)).verdict == "holds"
    more = resonances.lower_with_many(resonance_data(PAIR, lower + swept((3.8, 0.4)) + 1.0))
    assert more.verdict == "in part" and more.numbers["beyond"] == (pytest.approx(3.8, abs=0.02),) * 2
    higher = swept((1.5, 1.0), (3.7, 0.8))
    assert resonances.lower_with_many(resonance_data(PAIR, higher)).verdict == "fails"


def test_one_mode_is_adequate():
    """9d: within 5 %, 10 % and not, in Hz."""
    for scale, verdict in ((1.0, "holds"), (0.93, "in part"), (0.8, "fails")):
        # in Hz one mode is 2.5 % higher at the same Omega
        peaks = (1.8 * 83.93 / 81.85 * scale, 1.0), (3.6 * 83.93 / 81.85 * scale, 0.8)
        result = resonances.one_mode_is_adequate(resonance_data(PAIR, swept(*peaks)))
        assert result.verdict == verdict
        assert result.quantities["first"].value == pytest.approx(1.0 / scale - 1.0, abs=0.02)


def test_printed_maxima():
    """9a and 9e."""
    assert resonances.low_drive(resonance_data(PAIR, PAIR)).verdict == "holds"
    assert resonances.low_drive(resonance_data(swept((1.9, 1.0), (3.6, 0.8)), PAIR)).verdict == "in part"
    assert resonances.low_drive(resonance_data(swept((2.2, 1.0), (3.6, 0.8)), PAIR)).verdict == "fails"
    assert resonances.another_maximum(resonance_data(swept((1.8, 1.0), (3.5, 0.8)), PAIR)).verdict == "holds"
    assert resonances.another_maximum(resonance_data(swept((1.8, 1.0)), PAIR)).verdict == "fails"


@pytest.mark.parametrize(("end", "verdict"), [(1.2, "holds"), (1.4, "in part"), (1.75, "fails")])
def test_notch_is_where_the_resonance_ends(end, verdict):
    """31: a ridge from 1.8 to the notch at 1.2, more than half way, hardly."""
    ratio, drives = np.round(np.arange(0.8, 2.2001, 0.02), 6), np.linspace(0.01, 0.1, 10)
    ridge = 1.8 + (end - 1.8) * (drives - drives[0]) / (drives[-1] - drives[0])
    height = -1.0 + drives[None, :] * np.exp(-(((ratio[:, None] - ridge[None, :]) / 0.05) ** 2))
    study = xr.Dataset(
        {"max_displacement": (("frequency_ratio", "velocity_amplitude"), height),
         "response_class": (("frequency_ratio", "velocity_amplitude"), np.zeros(height.shape, dtype=np.int8))},
        {"frequency_ratio": ratio, "velocity_amplitude": drives},
    )  # fmt: skip
    results = two_maps(notched(1.2, 0.1), notched(1.2, 0.1), resonance={"modes_1": study, "modes_32": study})
    assert resonances.ROWS["31a"](results).verdict == verdict


def window_data(end: tuple[float, float], centre: tuple[float, float]) -> Given:
    """Transient from a first to a last V near a clamp and near the centre, continuous above."""
    x = np.array([0.04, 0.06, 0.08, 0.1, 0.12, 0.42, 0.44, 0.46, 0.48, 0.5])
    drives = np.linspace(0.01, 3.25, 325)
    kinds = np.zeros((x.size, drives.size), dtype=np.int8)
    for row, at in zip(kinds, x, strict=True):
        low, high = end if at < 0.2 else centre
        row[drives >= low] = ResponseClass.TRANSIENT_2
        row[drives > high] = ResponseClass.CONTINUOUS
    ds = xr.Dataset(
        {"response_class": (("location", "velocity_amplitude"), kinds)}, {"location": x, "velocity_amplitude": drives}
    )
    return Given(windows={"omega_0.625": ds, "omega_1.625": ds})


def test_windows_in_amplitude_and_as_a_share_of_it():
    """15: a window ten times as wide at ten times the amplitude needs no finer control."""
    scaled = window_data((0.1, 0.2), (1.0, 2.0))
    assert efficiency.ROWS["15b"](scaled).verdict == "holds"
    assert efficiency.ROWS["15b"](scaled).quantities["times"].value == pytest.approx(10.0, rel=0.1)
    finer = efficiency.ROWS["15d"](scaled)
    assert finer.verdict != "holds" and finer.quantities["times"].value == pytest.approx(1.0, abs=0.15)
    narrow = window_data((0.5, 0.55), (0.5, 2.0))
    assert efficiency.ROWS["15b"](narrow).verdict == efficiency.ROWS["15d"](narrow).verdict == "holds"
    assert efficiency.ROWS["15b"](window_data((0.5, 2.0), (0.5, 2.0))).verdict == "fails"


def dominance_data(until: float) -> Given:
    """Runs in which the higher modes lead exactly while |alpha_1| is below a value, and Fig. 5 alike."""
    middle = 0.5 * (BIN_EDGES[1:] + BIN_EDGES[:-1])
    samples = np.full((12, middle.size), 100)
    lead = np.where(middle < until, 100, 0) * np.ones((12, 1), dtype=int)
    runs = xr.Dataset({"samples": (("run", "bin"), samples), "higher_exceed": (("run", "bin"), lead)}, {"bin": middle})
    time = np.linspace(0.0, 1.0, 400)
    alpha = np.stack([np.cos(20.0 * time), np.full(time.size, until)], axis=1)
    run = xr.Dataset({"modal_amplitude": (("time", "mode"), alpha)}, {"time": time, "cycle": ("time", time)})
    along = xr.Dataset(attrs={"rest_amplitude": -1.0})
    return Given(waveforms={"runs": runs}, fig5={"run": run, "shapes": along})


@pytest.mark.parametrize(("until", "verdict"), [(0.4, "holds"), (0.15, "in part"), (0.05, "fails")])
def test_dominance_needs_more_than_a_narrow_band(until, verdict):
    """10b: that modes other than the first lead where the first is near zero is no result."""
    result = waveforms.higher_modes_dominate(dominance_data(until))
    assert result.verdict == verdict
    assert result.quantities["twentieth"].value == 1.0


def disturbed(startup: float, alone: float) -> Given:
    """A study in which a share of 400 points changes class."""
    base = np.full(400, ResponseClass.TRANSIENT_2, dtype=np.int8)
    rows = {"base": base}
    for name, share in (("perturbed", alone), ("offset", alone), ("startup", startup)):
        rows[name] = np.where(np.arange(400) < share * 400, ResponseClass.CONTINUOUS, base)
    table = xr.Dataset(
        {
            "response_class": (("variant", "point"), np.stack(list(rows.values()))),
            "at_border": ("point", np.arange(400) < 200),
        },
        {"variant": list(rows)},
    )
    return Given(disturbances={"classes": table})


def test_startup_counts_beyond_chaos():
    """25a: more than chaos does, as much as chaos, and hardly any."""
    assert disturbances.startup(disturbed(0.4, 0.1)).verdict == "holds"
    assert disturbances.startup(disturbed(0.2, 0.21)).verdict == "in part"
    assert disturbances.startup(disturbed(0.02, 0.0)).verdict == "fails"
    assert disturbances.near_transitions(disturbed(0.2, 0.2)).verdict == "holds"


def test_a_question_is_held_against_its_own_model():
    """A: what chaos does to one mode is the measure for one mode, not what it does to many."""
    calm, wild = settled(), settled(0.3)
    one, many = response_map(calm, 1), response_map(calm, 32)
    data = calm_sensitivity(one, many)
    data["one_mode_reference"] = response_map(settled(0.25), 1)
    assert questions.reference_frequency(Given(sensitivity=data)).numbers["matters"] == 1
    data["perturbed"] = response_map(wild, 32)
    assert questions.reference_frequency(Given(sensitivity=data)).numbers["matters"] == 1
    data["one_mode_perturbed"] = response_map(wild, 1)
    result = questions.reference_frequency(Given(sensitivity=data))
    assert result.numbers["matters"] == 0
    assert result.quantities["alone"].value == pytest.approx(float((calm != wild).mean()))
