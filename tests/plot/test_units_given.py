"""Every figure of inputs in g, Hz, um and mm/s: its axes have these units, with short numbers, and nothing is said twice."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable

import matplotlib.pyplot as plt
import numpy as np
import pytest

import snapbeam as sb
from snapbeam.plot.dataset import _KINDS, figures_of
from snapbeam.plot.units import in_symbols
from snapbeam.util.datasets import xr

BEAM = """
[beam]
length = "300 mm"
thickness = "400 um"
width = "20 mm"
density = "7.85 g/cm^3"
young_modulus = "200 GPa"
buckling_level = "700 um"
[model]
modes = 1
damping_ratio = 0.02
"""
BASE = """
[base_excitation]
type = "acceleration_sine"
frequency_hz = "40 Hz"
amplitude_g = "0.9 g"
"""
STRIKER = """
[[contact]]
stiffness = 1e8
location_m = "90 mm"
[contact.drive]
type = "sine"
frequency_hz = "38 Hz"
velocity_m_s = "120 mm/s"
"""
ARCH = """
[beam]
length = "800 um"
thickness = "3 um"
width = "30 um"
density = "2.33 g/cm^3"
young_modulus = "160 GPa"
axial_load = 0.0
[imperfection]
midspan_amplitude = "6 um"
[model]
modes = 1
damping_ratio = 0.02
[base_excitation]
type = "acceleration_sine"
frequency_hz = "40 kHz"
amplitude_g = "20000 g"
"""
SHOCK = """
[base_excitation]
type = "shock"
acceleration_g = "20 g"
duration_ms = "5 ms"
"""
RANDOM = """
[base_excitation]
type = "random_vibration"
psd = [["20 Hz", "1 m^2/s^3"], ["200 Hz", "1 m^2/s^3"]]
duration_s = "500 ms"
seed = 1
"""
POWER = """
[harvester]
type = "piezo"
moment_per_volt = -1.66e-4
capacitance = "767 nF"
resistance = "10 kohm"
"""
FILES = {
    "powered": BEAM + BASE + POWER,
    "shock": BEAM + SHOCK,
    "random": BEAM + RANDOM,
    "base": BEAM + BASE,
    "striker": BEAM + STRIKER,
    "arch": ARCH,
    "free": BEAM,
}
SHORT = sb.Integration(cycles=12)
HERTZ = "base_excitation.frequency_hz", "30 Hz:45 Hz:4"
GRAVITIES = "base_excitation.amplitude_g", "0.2 g:2 g:4"
STRUCK = "drive.frequency_hz", "30 Hz:45 Hz:4"
SPEED = "drive.velocity_m_s", "50 mm/s:200 mm/s:4"


@pytest.fixture(scope="module")
def systems(tmp_path_factory) -> dict[str, sb.System]:
    folder = tmp_path_factory.mktemp("files")
    found = {}
    for name, text in FILES.items():
        (folder / f"{name}.toml").write_text(text)
        found[name] = sb.System.load(folder / f"{name}.toml")
    return found


@pytest.fixture(autouse=True)
def closed():
    yield
    plt.close("all")


def axes(*given: tuple[str, str]) -> dict[str, str]:
    return dict(given)


def numbers(axis: tuple[str, str]) -> tuple[str, np.ndarray]:
    name, text = axis
    low, high, count = text.replace(" mm/s", "e-3").replace(" Hz", "").replace(" g", "").split(":")
    return name, np.linspace(float(low), float(high), int(count))


def tolerance(**more: float) -> sb.uncertainty.ParameterUncertainty:
    of = {"beam.thickness": 0.02} | more
    spread = {name: sb.uncertainty.Normal(share, relative=True) for name, share in of.items()}
    return sb.uncertainty.ParameterUncertainty(of=spread)


def points() -> xr.Dataset:
    columns = dict(map(numbers, (STRUCK, SPEED)))
    return xr.Dataset({name: ("point", values) for name, values in columns.items()})


def designs(system: sb.System) -> xr.Dataset:
    u = sb.uncertainty
    return u.optimize_design(
        system, {"drive.frequency_hz": (30.0, 45.0), "drive.velocity_m_s": (0.05, 0.2)},
        [u.Objective(quantity="peak_midspan_displacement")], [], tolerance(),
        u.OptimizerSettings(population=6, generations=1, samples=8, validation_samples=20), integration=SHORT,
    )  # fmt: skip


def quantiles(system: sb.System, parameter: str, bounds: tuple[float, float], *over: tuple[str, str]) -> xr.Dataset:
    settings = sb.uncertainty.QuantileSearchSettings(runs=120, rounds=1)
    return sb.uncertainty.quantile_threshold(
        system, parameter, bounds, axes(*over), tolerance(), settings, integration=SHORT
    )


def orbit_of(system: sb.System) -> sb.dynamics.PeriodicOrbit:
    return sb.dynamics.periodic_orbit(system.replace(**{"base_excitation.amplitude_g": 0.1}), transient=100)


U, D = sb.uncertainty, sb.dynamics
G, HZ, MM_S = (
    "Acceleration amplitude of the base (g)",
    "Frequency of the base (Hz)",
    "Velocity amplitude of the striker (mm/s)",
)
EXCITATION = "Excitation frequency (Hz)"
OVER_B = "$w/b$ ($b$ = 700 µm)"
CASES: dict[str, tuple[str, Callable[[sb.System], xr.Dataset], tuple[str, ...]]] = {
    "map of the base": ("base", lambda s: sb.sweep(s, axes(HERTZ, GRAVITIES), SHORT), (HZ, G)),
    "map of the arch": (
        "arch",
        lambda s: sb.sweep(s, axes((HERTZ[0], "20 kHz:80 kHz:4"), (GRAVITIES[0], "1e4 g:4e4 g:3")), SHORT),
        ("Frequency of the base (kHz)", G),
    ),
    "map of the striker": ("striker", lambda s: sb.sweep(s, axes(SPEED, STRUCK), SHORT), (EXCITATION, MM_S)),
    "map over a thickness": (
        "striker",
        lambda s: sb.sweep(s, axes(("beam.thickness", "380 um:420 um:3"), SPEED), SHORT),
        ("Thickness in the direction of bending\n$h$ (µm)", MM_S),
    ),
    "map over a location": (
        "striker", lambda s: sb.sweep(s, axes(("contact.location_m", "60 mm:150 mm:4"), SPEED), SHORT),
        ("Distance from the left end of the\nstriker (mm)", MM_S),
    ),
    "line of a map": (
        "base", lambda s: sb.sweep(s, axes(GRAVITIES), SHORT), (G, "Mid-span displacement $w/b$\n($b$ = 700 µm),\nminimum and maximum")
    ),
    "points": ("striker", lambda s: sb.sweep(s, points(), SHORT), (EXCITATION, MM_S)),
    "threshold of the base": ("base", lambda s: sb.threshold(s, *numbers(GRAVITIES), dict([numbers(HERTZ)]), SHORT), (HZ, G)),
    "threshold of the striker": (
        "striker", lambda s: sb.threshold(s, SPEED[0], np.linspace(0.005, 0.1, 8), dict([numbers(STRUCK)]), SHORT),
        (EXCITATION, MM_S),
    ),
    "one threshold": ("base", lambda s: sb.threshold(s, *numbers(GRAVITIES), {}, SHORT), (G,)),
    "probability of the base": (
        "base", lambda s: U.probability_map(s, axes(GRAVITIES, HERTZ), tolerance(), 4, integration=SHORT), (HZ, G)
    ),
    "probability of the striker": (
        "striker", lambda s: U.probability_map(s, axes(SPEED), tolerance(), 4, integration=SHORT),
        (MM_S, "Probability of snap-through"),
    ),
    "power beyond a value": (
        "powered", lambda s: U.probability_map(
            s, axes(GRAVITIES), tolerance(), 4, outcomes=["harvested_power > 20 uW"], statistics=["harvested_power"],
            integration=SHORT,
        ), (G, "Probability of snap-through"),
    ),
    "quantiles of the base": (
        "base", lambda s: quantiles(s, GRAVITIES[0], (0.2, 4.0), HERTZ), (HZ, "Threshold: acceleration amplitude of the\nbase (g)")
    ),
    "quantiles of the striker": (
        "striker", lambda s: quantiles(s, SPEED[0], (0.005, 0.2), STRUCK),
        (EXCITATION, "Threshold: velocity amplitude of the\nstriker (mm/s)"),
    ),
    "sensitivities": (
        "striker",
        lambda s: U.sensitivity(s, U.StatisticQoI("peak_force"), tolerance(**{"drive.velocity_m_s": 0.02}), integration=SHORT),
        ("Peak contact force (N)",),
    ),
    "gradient": (
        "striker",
        lambda s: U.gradient(s, "peak_midspan_velocity", ["beam.thickness", "drive.velocity_m_s"], integration=sb.Integration(cycles=2)),
        ("Change of maximum speed of mid-span\nfor 1 % of the parameter (%)",),
    ),
    "designs": ("striker", designs, ("Excitation frequency (Hz)",)),
    "hysteresis": ("base", lambda s: D.hysteresis(s, *numbers(GRAVITIES), integration=SHORT), (G,)),
    "diagram": (
        "striker", lambda s: D.bifurcation_diagram(s, *numbers(SPEED)),
        (MM_S, f"Displacement at mid-span\nonce a period, {OVER_B}"),
    ),
    "branch": (
        "base", lambda s: D.continuation(orbit_of(s), "base_excitation.amplitude_g", (0.05, 0.2), max_points=8).to_dataset(), (G,)
    ),
    "exponents": ("base", lambda s: D.lyapunov_spectrum(s, periods=20, transient=5), ("Periods of the excitation",)),
    "lifetimes": (
        "striker",
        lambda s: D.lifetime_map(
            s, axes(SPEED, STRUCK), SHORT, initial_conditions=2, settings=D.LifetimeSettings(settling_cycles=3)
        ),
        (EXCITATION, MM_S),
    ),
    "section": ("base", lambda s: D.poincare_section(s), (f"Displacement at mid-span {OVER_B}",)),
    "attractors": ("base", lambda s: D.find_attractors(s, 6).to_dataset(), ()),
    "run of the base": ("base", lambda s: sb.simulate(s, SHORT).dataset, ("Displacement $w/b$\n($b$ = 700 µm)",)),
    "run under a shock": ("shock", lambda s: sb.simulate(s, SHORT).dataset, ("Base\nacceleration (g)", "Time (ms)")),
    "run in random vibration": ("random", lambda s: sb.simulate(s, SHORT).dataset, ("Base\nacceleration (g)", "Time (ms)")),
    "run of the striker": ("striker", lambda s: sb.simulate(s, SHORT).dataset, ("Displacement $w/b$\n($b$ = 700 µm)",)),
    "growth": (
        "striker", lambda s: sb.perturbation_growth(s, SHORT), ("Maximum change of the displacement\n" + OVER_B,)
    ),
}  # fmt: skip
"""Input, result, and labels that its first figure has."""


def texts_of(figure: plt.Figure) -> list[str]:
    """Every text of a figure but the numbers of ticks."""
    found = [text.get_text() for text in figure.texts]
    found += [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    for ax in figure.axes:
        found += [ax.get_xlabel(), ax.get_ylabel(), *(ax.get_title(loc) for loc in ("left", "center", "right"))]
        found += [text.get_text() for text in ax.texts]
        found += [] if ax.get_legend() is None else [text.get_text() for text in ax.get_legend().get_texts()]
        found += [text.get_text() for text in (*ax.get_xticklabels(), *ax.get_yticklabels())]
    return [text.replace("\u00a0", " ") for text in found if text]


def plain(text: str) -> str:
    """A text without its formulae."""
    return re.sub(r"\$[^$]*\$", "", text)


@pytest.mark.sampled(5)
@pytest.mark.parametrize("case", CASES)
def test_figures_have_the_units_that_were_given(case: str, systems: dict[str, sb.System]) -> None:
    of, compute, labels = CASES[case]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        dataset = compute(systems[of])
    for number, (name, draw) in enumerate(figures_of(dataset)[1].items()):
        if number > 5:  # further statistics of a map
            break
        ax = draw(dataset)
        figure = ax.get_figure(root=True)
        figure.canvas.draw()
        drawn = [label for each in figure.axes for label in (each.get_xlabel(), each.get_ylabel())]
        swept_over = [label for label in drawn if not label.startswith("Base")]  # its motion in time is no axis
        if number == 0:
            assert set(labels) <= set(drawn), drawn
        texts, heading = texts_of(figure), ax.get_title()
        for text in texts:
            assert not re.search(r"[a-z]_[a-z0-9]|\^|\bm s\b", plain(text)), f"{name}: a raw name, {text!r}"
            assert not re.search(r"[0-9]e[+-]?[0-9]", text), f"{name}: a raw number, {text!r}"
            if re.search(r"w/b|over \$?b\b", text) and text in drawn and "\\" not in text:
                assert "= 700 µm" in text or "= 6 µm" in text, f"{name}: no length scale, {text!r}"
        assert sum("$b$ =" in text for text in (heading, "".join(drawn))) <= 1, f"{name}: b is said twice"
        for word in ("cycles", "$N$ ="):
            assert heading.count(word) <= 1
        for unit in ("Hz)", "(g)", "m/s)"):
            if any(unit in label for label in swept_over):
                swept = {"Hz)": "Hz", "(g)": "$g$", "m/s)": "m/s"}[unit]
                assert swept not in heading.partition("steps")[0], (
                    f"{name}: the heading {heading!r} has a value that is swept"
                )
        ax.set_title("")
        assert not any(each.get_title(loc) for each in figure.axes for loc in ("left", "center", "right"))
        plt.close(figure)


ELSEWHERE = {
    "posterior", "measured classes", "sensitivity indices", "estimated density", "displacement field", "frequency response",
    "homoclinic points", "homoclinic tangency", "manifold", "edge state", "bifurcation curve", "periodic orbit",
    "backbone curve", "basins of attraction", "force-displacement curve", "equilibrium branches",
}  # fmt: skip
"""Kinds of figures over states, measurements or SI units alone, which no parameter's unit decides."""


def test_no_kind_of_figure_is_left_out(systems) -> None:
    assert {kind.words for kind in _KINDS} >= ELSEWHERE
    assert len(CASES) >= len(_KINDS) - len(ELSEWHERE)


@pytest.mark.parametrize(("words", "drawn"), [
    ("maximum speed of mid-span, over b omega_1", r"maximum speed of mid-span over $b\omega_1$"),
    ("acceleration over b omega_1^2, of the base", r"acceleration over $b\omega_1^2$, of the base"),
    ("peak displacement, over b", "peak displacement over $b$"),
    ("energy above a multiple of omega_1", r"energy above a multiple of $\omega_1$"),
    ("work over beams, b in all", "work over beams, b in all"),
])  # fmt: skip
def test_long_names_are_drawn_with_symbols(words: str, drawn: str) -> None:
    assert in_symbols(words) == drawn


def test_fixed_values_are_told_in_the_units_that_were_given(tmp_path) -> None:
    """In the heading and the summary of a map and of a run; ratios that were given stay ratios."""
    from snapbeam.cli.summary import coordinate_text, lowest_interwell
    from snapbeam.plot.units import in_units

    axes = {"drive.velocity_amplitude": [0.05, 0.3], "model.damping_ratio": [0.01, 0.02]}
    how = sb.Integration(cycles=20)
    drive = "[drive]\n{} = {}\n[contact]\n{} = {}\n[model]\nmodes = 2\n"
    for given, told, title in (
        (("frequency_hz", '"0.1 kHz"', "location_m", '"70 mm"'), {"excitation frequency = 100 Hz"}, "100 Hz"),
        (("frequency_ratio", "1.2", "location", "0.4"), {"Omega = 1.2", "x_s = 0.4"}, r"$\Omega$ = 1.2"),
    ):
        (tmp_path / "own.toml").write_text('extends = "paper"\n' + drive.format(*given))
        system = sb.System.load(tmp_path / "own.toml")
        found = sb.sweep(system, axes, how)
        low = lowest_interwell(in_units(found))
        assert low is not None
        words = {coordinate_text(in_units(found), name, value) for name, value in low.items()}
        assert told <= words
        assert any("70 mm" in each for each in words) == (given[2] == "location_m")
        heading = sb.plot.plot_dataset(found).get_title().replace("\xa0", " ")
        assert title in heading and ("70 mm" in heading) == (given[2] == "location_m")
        assert heading.count("Omega") == (given[0] == "frequency_ratio")
        of_run = sb.simulate(system, how).plot().get_figure().axes[0].get_title()
        assert title in of_run.replace("\xa0", " ")
        other = sb.sweep(system.replace(frequency_ratio=1.3), axes, how)  # what was given in Hz holds no more
        assert r"$\Omega$ = 1.3" in sb.plot.plot_dataset(other).get_title().replace("\xa0", " ")
