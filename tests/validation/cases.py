"""Cases that other people published, computed with snapbeam: each returns rows with the published value and ours.

No parameter of a case was adjusted.  The tolerance of a row is relative.  Where the theory of the source and that of
snapbeam differ, the row has the difference that is expected and its remark the reason.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ellipe, ellipk

import snapbeam as sb
from snapbeam.model.natural_frequencies import exact_natural_frequencies

REFERENCE = "reference"


class Row(NamedTuple):
    """One quantity of a case."""

    source: str
    origin: str
    """How the value is known: PRINTED, FORMULA or COMPUTED."""
    quantity: str
    published: float
    ours: float
    tolerance: float
    remark: str = ""
    expected: float = 0.0
    """Relative difference that has the reason in the remark."""

    @property
    def difference(self) -> float:
        """Ours over the published value, less 1."""
        return self.ours / self.published - 1.0


PRINTED = "printed in the source"
FORMULA = "formula of the source"
COMPUTED = "computed from the parameters of the source, without snapbeam"


# ----------------------------------------------------------------------------------------------------
# Impacts of one mass.


COCO = "Impact oscillator, COCO `po/examples/impact`"


def impact_oscillator() -> list[Row]:
    """x'' + c x' + x = A cos t with a stop at 1 and the restitution .8, at resonance.

    The steady motion without the stop is (A/c) sin t.  Relative to it the oscillator is free and the stop moves as a
    sine, exactly.  Seen from the stop, x is negative.
    """
    rows = []
    for force, phase, velocity in ((1.0, 0.0759522, -1.3565864), (0.2, 0.4992441, -0.2388903)):
        e, damping = 0.8, 0.1
        model = sb.ReducedModel.from_matrices([[1.0]], [1.0], contact_shape=[1.0], damping_ratio=0.5 * damping)
        stop = sb.Striker(
            drive=sb.DisplacementSine(frequency_ratio=1.0, displacement_amplitude=force / damping), gap=1.0
        )
        system = sb.System(model, contacts=[sb.Contact(sb.Restitution(e), stop)])
        run = sb.simulate(system, sb.Integration(cycles=400, accuracy=REFERENCE))
        last = run.impacts.isel(impact=-1)
        at = float(last[IMPACT_TIME]) % (2.0 * math.pi)
        after = -e / (1.0 + e) * float(last["impulse"])
        rows.append(Row(COCO, COMPUTED, f"A = {force:g}: phase of the impact (rad)", phase, at, 1e-6))
        rows.append(Row(COCO, COMPUTED, f"A = {force:g}: velocity after the impact", velocity, after, 1e-6))
    return rows


IMPACT_TIME = "onset"


def mass_on_a_stop() -> list[Row]:
    """A mass of 100 kg on a spring of 1e4 N/m meets a stop of 1e6 N/m at 1 m/s."""
    model = sb.ReducedModel.from_matrices([[100.0]], [1e4], contact_shape=[1.0])
    start = sb.State(amplitude=[0.0], velocity=[-1.0])
    stop = sb.Striker(drive=sb.FixedStop(), gap=0.0)
    system = sb.System(model, contacts=[sb.Contact(sb.KelvinVoigt(1e6, 0.0), stop)], initial_state=start)
    run = sb.simulate(system, sb.Integration(cycles=1, accuracy=REFERENCE))
    first, second = (run.impacts.isel(impact=i) for i in (0, 1))
    source = "code_aster test SDND101"
    middle = float(second[IMPACT_TIME]) + 0.5 * float(second["duration"])
    return [
        Row(source, FORMULA, "peak force (N)", 9950.372, float(first["peak_force"]), 1e-6),
        Row(source, FORMULA, "contact duration (s)", 0.03126002, float(first["duration"]), 1e-6),
        Row(source, FORMULA, "time of the second peak (s)", 0.3610493, middle, 1e-6),
        Row(source, FORMULA, "impulse (N s)", 198.0198, float(first["impulse"]), 1e-6, "The source prints 198.05 N s."),
    ]


def bouncing_ball() -> list[Row]:
    """A ball on a sine table: the amplitude from which period 1 exists, and that at which its period doubles.

    A spring and a damper without inertia have the same restitution at any speed as Newton's law; their contact lasts
    1/400 of the table's period.
    """
    rows = []
    for e, least, doubling in ((0.5, 1.0471976, 1.5268237), (0.8, 0.3490659, 1.0708365)):
        for words, published, holds in (("period 1 from", least, _lives), ("doubling at", doubling, _single)):
            found = _ball(e, published, holds)
            remark = "Bisected to 0.4 %; the contact lasts 1/400 of a period."
            rows.append(
                Row("Bouncing ball, Tufillaro", FORMULA, f"e = {e:g}: {words} G =", published, found, 0.01, remark)
            )
    return rows


def _ball(e: float, published: float, holds: Callable[[NDArray[np.float64]], bool]) -> float:
    """Where between 0.96 and 1.04 of the published value a property of the flights changes, by bisection."""
    low, high = 0.96 * published, 1.04 * published
    inside = _flights(e, low, holds)
    if _flights(e, high, holds) == inside:
        return math.nan
    while high - low > 4e-3 * published:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _flights(e, middle, holds) == inside else (low, middle)
    return 0.5 * (low + high)


def _flights(e: float, strength: float, holds: Callable[[NDArray[np.float64]], bool]) -> bool:
    """Whether the last flights of a ball that begins near the period-1 orbit have a property.

    Unit mass, gravity and angular frequency: the table moves by G sin t; an orbit of period 1 leaves it with the speed
    pi at the phase where cos = pi (1 - e)/((1 + e) G).
    """
    ball = sb.ReducedModel.from_matrices([[1.0]], [0.0], contact_shape=[1.0], reference_frequency=0.5 / math.pi)
    stiffness = 200.0**2  # a contact lasts about pi/200
    law = sb.KelvinVoigt.from_restitution(stiffness, e, 1.0)
    phase = math.acos(min(1.0, math.pi * (1.0 - e) / ((1.0 + e) * strength)))
    table = sb.Striker(drive=sb.DisplacementSine(frequency_ratio=1.0, displacement_amplitude=strength, phase=phase))
    weight = sb.ExternalForce(history=sb.ConstantForce(force=-1.0))
    start = sb.State(amplitude=[strength * math.sin(phase)], velocity=[1.001 * math.pi], striker_position=0.0)
    system = sb.System(ball, contacts=[sb.Contact(law, table)], forces=[weight], initial_state=start)
    run = sb.simulate(system, sb.Integration(cycles=60))
    onset = run.impacts[IMPACT_TIME].values
    flights = onset[1:] - onset[:-1] - run.impacts["duration"].values[:-1]
    return holds(flights / (2.0 * math.pi))


def _lives(flights: NDArray[np.float64]) -> bool:
    """Whether the ball still flies for a period between impacts, and does not rest on the table."""
    return bool(np.abs(flights[-10:] - 1.0).max() < 0.1)


def _single(flights: NDArray[np.float64]) -> bool:
    """Whether long and short flights, which take turns, differ less and less."""
    turns = np.abs(np.diff(flights))
    return bool(turns[-6:].max() < turns[2:8].max())


# ----------------------------------------------------------------------------------------------------
# Oscillators with two wells.


def duffing(damping: float, force: float, phase: float) -> sb.System:
    """x'' + damping x' - x + x^3 = force sin(t + phase)."""
    model = sb.ReducedModel.from_matrices(
        [[1.0]], [-1.0], contact_shape=[1.0], nonlinear_stiffness=1.0, well_amplitude=[-1.0],
        damping_ratio=damping / (2.0 * math.sqrt(2.0)), reference_frequency=0.5 / math.pi,
    )  # fmt: skip
    history = sb.HarmonicForce(frequency_ratio=1.0, amplitude=force, phase=phase)
    return sb.System(model, forces=[sb.ExternalForce(history=history)])


def basin_shares(points: int = 100) -> list[Row]:
    """x'' + .15 x' - x + x^3 = .2 cos t: the attractors, and the shares of their basins in [-2.2, 2.2]^2."""
    x = np.linspace(-2.2, 2.2, points)
    first, second = (each.ravel()[:, None] for each in np.meshgrid(x, x, indexing="ij"))
    system = duffing(0.15, 0.2, 0.5 * math.pi)
    end = sb.advance(system, sb.State(amplitude=first, velocity=second), periods=80)
    at = end.amplitude[:, 0]
    left = at < 0.2
    source = "Two-well Duffing oscillator, Attractors.jl `attractor_mapping.jl`"
    share = float(left.mean())
    grid = "Of a grid; the source has 1000 random starts, a standard error of .016."
    two_errors = 2.0 * 0.016 / 0.488
    return [
        Row(source, COMPUTED, "attractor in the left well, x at t = 0", -0.779, float(np.median(at[left])), 1e-3),
        Row(source, COMPUTED, "attractor in the right well, x at t = 0", 1.210, float(np.median(at[~left])), 1e-3),
        Row(source, PRINTED, "share of the left basin", 0.488, share, two_errors, grid),
        Row(source, PRINTED, "share of the right basin", 0.512, 1.0 - share, two_errors, grid),
    ]


def lyapunov(runs: int = 64) -> list[Row]:
    """x'' + .25 x' - x + x^3 = .4 sin t: the mean of many runs of 600 periods each."""
    system = duffing(0.25, 0.4, 0.0)
    random = np.random.default_rng(1)
    begun = sb.State(amplitude=random.uniform(-1.5, 1.5, (runs, 1)), velocity=random.uniform(-1.0, 1.0, (runs, 1)))
    one = sb.dynamics.lyapunov_spectrum(system, k=1, periods=600, transient=100, states=begun)["exponent"]
    both = sb.dynamics.lyapunov_spectrum(system, k=2, periods=100, transient=100)["exponent"]
    error = float(one.std()) / math.sqrt(runs)
    source = "Two-well Duffing oscillator, Sprott A.4.6"
    return [
        Row(source, PRINTED, "largest Lyapunov exponent", 0.1572, float(one.mean()), 0.002 / 0.1572,
            f"Our standard error is {error:.4f}."),
        Row(source, FORMULA, "sum of the exponents", -0.25, float(both.sum()), 1e-6),
    ]  # fmt: skip


# ----------------------------------------------------------------------------------------------------
# Beams.


STEEL = {"young_modulus": 210e9, "density": 7800.0, "width": 0.01}


def buckled_frequencies() -> list[Row]:
    """Antisymmetric modes of a buckled clamped beam: their frequencies do not depend on the buckling level."""
    rows = []
    for level in (2e-4, 1e-3):
        beam = sb.Beam(**STEEL, length=0.2, thickness=5e-4, buckling_level=level)
        unit = math.sqrt(beam.bending_stiffness / (beam.mass_per_length * beam.length**4)) / (2.0 * math.pi)
        found = np.asarray(exact_natural_frequencies(beam, count=8)) / unit
        for number, published in enumerate((44.36270, 182.11782, 398.78569), 1):
            near = float(found[np.argmin(np.abs(found - published))])
            rows.append(
                Row("Nayfeh, Kreider, Anderson 1995", COMPUTED, f"antisymmetric mode {number}, b = {1e3 * level:g} mm",
                    published, near, 1e-6)
            )  # fmt: skip
    return rows


def preshaped_beam() -> list[Row]:
    """A beam made with the shape of a cosine, pushed at the centre: the force at which it snaps, in E I h/l^3.

    The formulas of the source have the first three modes.  With more modes the beam also bends under the load: the
    force is less, and the displacement of the centre is greater.
    """
    source = "Pre-shaped beam, Qiu, Lang, Slocum 2004"
    rows = []
    for held, force, at in ((True, 734.25, 0.0770), (False, 390.68, 0.0386)):
        words = "mode 2 held" if held else "free"
        for modes, tolerance, remark, expected in (
            (3, 1e-3, "", (0.0, 0.0)),
            (63, 2e-3, "The source has three modes; other modes bend too.", (-0.0269, 1.625) if held else (-0.0026, 1.087)),
        ):  # fmt: skip
            found, depth = _snap(6.0, modes, held)
            for quantity, published, ours, differs in zip(
                ("greatest force", "displacement there over h"), (force, at), (found, depth), expected, strict=True
            ):
                own = f"Q = 6, {words}, {modes} modes: {quantity}"
                rows.append(Row(source, FORMULA, own, published, ours, tolerance, remark, differs))
    low, high = 1.0, 4.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if _pushed(middle, 3, True, 0.0).is_bistable else (middle, high)
    rows.append(Row(source, PRINTED, "mode 2 held: two wells from h/t =", 2.31, high, 0.003))
    return rows


def _pushed(ratio: float, modes: int, held: bool, force: float) -> sb.ReducedModel:
    """The beam of height *ratio* t under a central force in E I h/l^3, without its antisymmetric modes if *held*."""
    length, thickness = 0.2, 2e-4
    beam = sb.Beam(**STEEL, length=length, thickness=thickness, axial_load=0.0)
    height = ratio * thickness
    made = sb.ReducedModel.from_beam(beam, modes=modes, imperfection=sb.Imperfection(midspan_amplitude=height))
    kept = np.arange(0, modes, 2) if held else np.arange(modes)
    center = made.midspan_shape[kept]
    assert made.transverse_force is not None
    load = force * beam.bending_stiffness * height / length**3
    return sb.ReducedModel.from_matrices(
        made.mass[np.ix_(kept, kept)], made.stiffness[kept], contact_shape=center, midspan_shape=center,
        nonlinear_stiffness=made.nonlinear_stiffness, length_scale=height,
        transverse_force=made.transverse_force[kept] - load * center,
    )  # fmt: skip


def _snap(ratio: float, modes: int, held: bool) -> tuple[float, float]:
    """Force at which the well above vanishes, and the displacement of the centre there, over h."""
    low, high = 0.0, 1500.0
    for _ in range(48):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _pushed(ratio, modes, held, middle).is_bistable else (low, middle)
    model = _pushed(ratio, modes, held, low)
    assert model.landscape is not None and model.length_scale is not None
    upper = float(model.midspan_shape @ model.landscape.upper.amplitude)
    return low, 1.0 - upper / model.length_scale


def elastica() -> list[Row]:
    """End-shortening of a buckled clamped beam, against the elastica: the limit of the theory of shallow beams.

    With p = sin(alpha/2), where alpha is the greatest slope, the rise over L is p/K(p), and the end-shortening over L
    is 2 (1 - E(p)/K(p)).
    """
    rows = []
    for degrees, rise, expected in (
        (20, 0.10971, -0.0189), (40, 0.21112, -0.0742), (60, 0.29660, -0.1618), (80, 0.35975, -0.2752),
    ):  # fmt: skip
        m = math.sin(math.radians(degrees) / 2.0) ** 2
        exact = 2.0 * (1.0 - float(ellipe(m)) / float(ellipk(m)))
        beam = sb.Beam(**STEEL, length=0.2, thickness=1e-6, buckling_level=rise * 0.2)
        ours = (beam.axial_load - beam.critical_load) / (beam.young_modulus * beam.area)
        rows.append(
            Row("Elastica, Timoshenko and Gere", FORMULA, f"rise/L = {rise:g} ({degrees} degrees): end-shortening/L",
                exact, ours, 1e-3, "snapbeam has the theory of shallow beams.", expected)
        )  # fmt: skip
    return rows


def timoshenko_beams() -> list[Row]:
    """Simply supported steel beams 1 cm x 1 cm of Timoshenko's impact problem: their first period.

    E = 2.2e6 kgf/cm^2 and 7.96 g/cm^3.
    """
    rows = []
    for length, published in ((0.1535, 1.0), (0.307, 4.0)):
        beam = sb.Beam(
            young_modulus=2.2e6 * 98066.5, density=7960.0, width=0.01, thickness=0.01, length=length, axial_load=0.0,
            boundary=sb.BoundaryConditions(left_rotational_stiffness=0.0, right_rotational_stiffness=0.0),
        )  # fmt: skip
        first = float(np.asarray(exact_natural_frequencies(beam, count=1))[0])
        rows.append(
            Row(
                "Timoshenko 1913", COMPUTED, f"L = {100 * length:g} cm: first period (ms)", published, 1e3 / first, 0.01
            )
        )
    return rows


CASES: dict[str, Callable[[], list[Row]]] = {
    each.__name__: each
    for each in (
        impact_oscillator, mass_on_a_stop, bouncing_ball, basin_shares, lyapunov, buckled_frequencies, preshaped_beam,
        elastica, timoshenko_beams,
    )
}  # fmt: skip
