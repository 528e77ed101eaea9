"""Random systems of any parts, and the same written out for the independent reference; a seed gives a system.

``python tests/composition/generator.py SEED ...`` prints and checks the systems of seeds.
"""

from __future__ import annotations

import dataclasses
import math
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from composition_reference import BeamNumbers, Circuit, Motion, Parts, PointForce, ReferenceBeam, Tip
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline, CubicSpline

import snapbeam as sb
from snapbeam.model.contact.base import LAWS
from snapbeam.model.local_force import LOCAL_FORCES
from snapbeam.model.quantity import quantities

__all__ = ["Composition", "Features", "composed", "features_of"]

Array = NDArray[np.float64]
Rng = np.random.Generator
Acting = tuple[sb.Drive, Callable[[float], float], list[float]]
DRIVES = (
    "sine", "sine", "displacement_sine", "sine+sine", "chirp", "burst", "half_sine", "fixed", "sum", "constant_velocity",
    "recorded_motion", "noise", "acceleration_chirp",
)  # fmt: skip
BASES = (
    "acceleration_sine", "displacement_sine", "sine+sine", "chirp", "burst", "shock", "recorded_acceleration", "noise",
    "sum", "acceleration_chirp",
)  # fmt: skip
FORCES = (
    "harmonic_force", "constant_force", "half_sine_force", "burst_force", "chirp_force", "noise_force", "ramp_force",
    "recorded_force", "sum",
)  # fmt: skip
CIRCUITS = ("piezo", "coil", "coil with inductance", "any piezo", "any coil")
"""Of any time constant, and of stronger couplings, too."""
SEPARATE = frozenset(name for name, law in LAWS.items() if law.impulsive or law.memory)
"""Laws with solutions of their own: Newton's (``test_surrounded_bounces``) and those with a memory."""
KNOWN_FORCES = ("local_spring", "rotation", "magnetic_force", "electrostatic_force", "quadratic_damping")
ATTRACTIVE = ("electrostatic_force", "attracting_magnet", "softening_spring")
"""Local forces with a negative potential energy."""
GRAVITY = 9.80665
PERMITTIVITY = 8.8541878188e-12


@dataclass(frozen=True)
class Features:
    """The parts of a system, without their numbers."""

    modes: int
    contacts: tuple[tuple[str, str, bool], ...] = ()
    """Law, drive, and whether the striker has a mass."""
    base: str | None = None
    carried: bool = True
    external: tuple[str, ...] = ()
    local: tuple[str, ...] = ()
    load: str | None = None
    circuits: tuple[str, ...] = ()
    uneven: bool = False
    started: bool = False


@dataclass
class Composition:
    """A system and what the reference needs."""

    features: Features
    system: sb.System
    beam: ReferenceBeam
    parts: Parts
    volts: list[float]
    """Voltage across the load per z, of each circuit."""
    mirrors: bool
    """Whether the mirror image is known."""
    places: list[float] = field(default_factory=list)

    @property
    def exact_mirror(self) -> bool:
        """Whether the numbers of the mirror image are those of the system up to signs."""
        return bool(self.features.contacts) and "harmonic_force" not in self.features.external


def laws() -> list[str]:
    """The laws of the package that take part, in the order of the alphabet; those of other tests are not drawn."""
    return sorted(_of_package(LAWS) - SEPARATE)


def local_forces() -> list[str]:
    """The local forces that take part."""
    return [*KNOWN_FORCES, *sorted(_of_package(LOCAL_FORCES) - set(KNOWN_FORCES))]


def _of_package(kinds: Mapping[str, type]) -> set[str]:
    return {name for name, kind in kinds.items() if kind.__module__.startswith("snapbeam.")}


def features_of(seed: int) -> Features:
    """The parts that a seed draws."""
    rng = np.random.default_rng([seed, 0])

    def some(names: Any, *weights: float) -> tuple[str, ...]:
        count = int(rng.choice(len(weights), p=np.array(weights) / sum(weights)))
        return tuple(str(name) for name in rng.choice(list(names), count))

    modes = int(rng.integers(1, 7)) if rng.random() < 0.92 else int(rng.choice([8, 12, 20, 32]))
    count = int(rng.choice(6, p=[0.12, 0.42, 0.22, 0.12, 0.07, 0.05]))
    contacts = tuple(
        (str(rng.choice(laws())), str(rng.choice(DRIVES)), bool(rng.random() < 0.25)) for _ in range(count)
    )
    base = str(rng.choice(BASES)) if rng.random() < 0.35 else None
    carried = bool(rng.random() < 0.7) or base in ("chirp", "acceleration_chirp", "shock", "recorded_acceleration")
    features = Features(
        modes=modes,
        contacts=contacts,
        base=base,
        carried=carried,
        external=some(FORCES, 0.65, 0.25, 0.1),
        local=some(local_forces(), 0.55, 0.25, 0.12, 0.08),
        load=str(rng.choice(FORCES)) if rng.random() < 0.25 else None,
        circuits=some(CIRCUITS, 0.6, 0.28, 0.12),
        uneven=bool(rng.random() < 0.35),
        started=not contacts or bool(rng.random() < 0.2),
    )
    if seed % 2 == 1:
        # a circuit and a negative energy together, in every second system
        attractive, tapped = str(rng.choice(ATTRACTIVE)), features.circuits or (str(rng.choice(CIRCUITS)),)
        features = dataclasses.replace(features, local=(*features.local, attractive), circuits=tapped)
    moves = any(drive != "fixed" for _, drive, _ in contacts)
    if not (moves or features.started):
        return dataclasses.replace(features, started=True)
    return features


# ----------------------------------------------------------------------------------------------------
# Motions.  Each is drawn as a part of the package and written out again.


@dataclass
class Numbers:
    """Random numbers with the length b and the angular frequency omega_1 that normalise them."""

    rng: Rng
    unit: float
    first: float
    flip: float
    """-1 for the mirror image."""

    def __call__(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))


def sine(rate: float, reach: float, phase: float = 0.0) -> Motion:
    """A sine about the mid-position."""

    def motion(t: float) -> tuple[float, float, float]:
        s, c = math.sin(rate * t + phase), math.cos(rate * t + phase)
        return reach * s, reach * rate * c, -reach * rate * rate * s

    return motion


def added(*motions: Motion) -> Motion:
    """The sum of motions that each begin at zero."""
    starts = [motion(0.0)[0] for motion in motions]

    def motion(t: float) -> tuple[float, float, float]:
        found = [each(t) for each in motions]
        return sum(f[0] for f in found) - sum(starts), sum(f[1] for f in found), sum(f[2] for f in found)

    return motion


def smooth(x: float) -> tuple[float, float, float]:
    """A smooth step from 0 to 1 and its derivatives."""
    x = min(max(x, 0.0), 1.0)
    first = 30.0 * x * x * (1.0 - x) ** 2
    return x**3 * (10.0 - 15.0 * x + 6.0 * x * x), first, 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x)


def burst(rate: float, reach: float, duration: float, up: float, down: float) -> tuple[Motion, list[float]]:
    """A sine with an envelope; times in cycles."""
    period, wave = 2.0 * math.pi / rate, sine(rate, reach)

    def motion(t: float) -> tuple[float, float, float]:
        n = t / period
        e, d, b = 1.0, 0.0, 0.0
        if n < up:
            e, d, b = smooth(n / up)
            d, b = d / (up * period), b / (up * period) ** 2
        elif n > duration - down:
            e, d, b = smooth((duration - n) / down)
            d, b = -d / (down * period), b / (down * period) ** 2
        w, v, a = wave(t)
        return e * w, d * w + e * v, b * w + 2.0 * d * v + e * a

    return motion, [up * period, (duration - down) * period, duration * period]


def chirp(first: float, last: float, size: float, length: float, log: bool, p: int = 1) -> tuple[Motion, list[float]]:
    """A sweep of the frequency at a constant value (p = 0), velocity (1) or acceleration (2)."""

    def motion(t: float) -> tuple[float, float, float]:
        s = min(t, length)
        if log:
            grow = math.log(last / first) / length
            now, change, bend = (first * math.exp(grow * s) * grow**i for i in range(3))
            angle = (now - first) / grow
        else:
            change, bend = (last - first) / length, 0.0
            now = first + change * s
            angle = first * s + 0.5 * change * s * s
        if t >= length:
            now, change, bend, angle = last, 0.0, 0.0, angle + last * (t - length)
        a, b = size / now**p, -p * size * change / now ** (p + 1)
        c = p * (p + 1) * size * change**2 / now ** (p + 2) - p * size * bend / now ** (p + 1)
        sn, cs = math.sin(angle), math.cos(angle)
        return a * sn, b * sn + a * now * cs, c * sn + 2.0 * b * now * cs + a * (change * cs - now**2 * sn)

    return motion, [length]


def noise(seed: int, low: float, high: float, rms: float, rise: float, p: int = 1) -> Motion:
    """32 sines of equal amplitude of the value (p = 0) or velocity (1), one in each part of the band, under a rise."""
    x = (seed * 2654435769 + np.arange(64, dtype=np.uint64) * np.uint64(2246822519) + np.uint64(374761393)) % np.uint64(
        2**32
    )
    for shift, factor in ((16, 2146121005), (15, 2221713035)):
        x = ((x ^ (x >> np.uint64(shift))) * np.uint64(factor)) % np.uint64(2**32)
    shares = (x ^ (x >> np.uint64(16))) / 2.0**32
    rates = low + (high - low) / 32.0 * (np.arange(32) + shares[::2])
    phases, sizes = 2.0 * math.pi * shares[1::2], rms * math.sqrt(2.0 / 32.0) / rates**p

    def motion(t: float) -> tuple[float, float, float]:
        angles, s = rates * t + phases, min(t / rise, 1.0)
        w, v, a = (
            float(np.sum(sizes * each))
            for each in (np.sin(angles), rates * np.cos(angles), -(rates**2) * np.sin(angles))
        )
        e, e1 = s**3 * (10.0 - 15.0 * s + 6.0 * s * s), 30.0 * (s * (1.0 - s)) ** 2 / rise
        e2 = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / rise**2
        return e * w, e * v + e1 * w, e * a + 2.0 * e1 * v + e2 * w

    return motion


def moving(kind: str, number: Numbers, side: float = 1.0) -> tuple[sb.Drive, Motion, list[float]]:
    """A drive, its motion as it is written in the documentation, and times at which it is not smooth."""
    unit, first = number.unit, number.first
    ratio, velocity, phase = number(0.7, 2.0), number(0.08, 0.25), number(-1.5, 1.5)
    rate, speed, cycle = ratio * first, velocity * unit * first, 2.0 * math.pi / first
    reach = speed / rate
    if kind == "fixed":
        return sb.FixedStop(), sine(1.0, 0.0), []
    if kind == "sine":
        drive: sb.Drive = sb.Sine(frequency_ratio=ratio, velocity_amplitude=velocity, phase=phase)
        return drive, sine(rate, reach, phase), []
    if kind == "displacement_sine":
        drive = sb.DisplacementSine(frequency_ratio=ratio, displacement_amplitude=velocity / ratio, phase=phase)
        return drive, sine(rate, reach, phase), []
    if kind == "acceleration_sine":
        drive = sb.AccelerationSine(frequency_ratio=ratio, acceleration_amplitude=velocity * ratio, phase=phase)
        return drive, sine(rate, reach, phase), []
    if kind == "sine+sine":
        other, more = number(0.5, 3.0), number(0.01, 0.1)
        drive = sb.Sine(frequency_ratio=ratio, velocity_amplitude=velocity) + sb.Sine(
            frequency_ratio=other, velocity_amplitude=more, phase=phase
        )
        return drive, added(sine(rate, reach), sine(other * first, more * unit / other, phase)), []
    if kind == "chirp":
        stop, cycles, log = ratio * number(0.6, 1.8), number(0.6, 3.0), bool(number(0.0, 1.0) < 0.5)
        drive = sb.Chirp(
            start_ratio=ratio, stop_ratio=stop, velocity_amplitude=velocity, sweep_cycles=cycles,
            sweep_type="log" if log else "linear",
        )  # fmt: skip
        return drive, *chirp(rate, stop * first, speed, cycles * 2.0 * math.pi / rate, log)
    if kind == "acceleration_chirp":
        stop, cycles, log = ratio * number(0.6, 1.8), number(0.6, 3.0), bool(number(0.0, 1.0) < 0.5)
        drive = sb.model.AccelerationChirp(
            start_ratio=ratio, stop_ratio=stop, acceleration_amplitude=velocity * ratio, sweep_cycles=cycles,
            sweep_type="log" if log else "linear",
        )  # fmt: skip
        return drive, *chirp(rate, stop * first, speed * rate, cycles * 2.0 * math.pi / rate, log, 2)
    if kind == "burst":
        up, flat, down = number(0.3, 0.8), number(0.1, 1.0), number(0.3, 0.8)
        drive = sb.Burst(
            frequency_ratio=ratio, velocity_amplitude=velocity, duration_cycles=up + flat + down,
            ramp_up_cycles=up, ramp_down_cycles=down,
        )  # fmt: skip
        return drive, *burst(rate, reach, up + flat + down, up, down)
    if kind == "noise":
        wide, ramp, seed = number(0.2, 1.5), number(0.3, 1.0), int(number(0.0, 2e9))
        drive = sb.BandLimitedNoise(
            low_ratio=ratio, high_ratio=ratio + wide, velocity_rms=0.5 * velocity, seed=seed, ramp_up_cycles=ramp
        )
        rise = ramp * 4.0 * math.pi / ((2.0 * ratio + wide) * first)
        return drive, noise(seed, rate, rate + wide * first, 0.5 * speed, rise), [rise]
    if kind == "half_sine":
        length, height = number(0.3, 0.8), number(0.1, 0.4)
        end, top = length * cycle, height * unit

        def knock(t: float) -> tuple[float, float, float]:
            return sine(math.pi / end, top)(t) if t < end else (0.0, 0.0, 0.0)

        return sb.HalfSine(displacement_amplitude=height, duration=length), knock, [end]
    if kind == "sum":
        one, two = moving("sine", number), moving(("half_sine", "burst")[int(number(0.0, 2.0))], number)
        return one[0] + two[0], added(one[1], two[1]), two[2]
    if kind == "constant_velocity":
        pace = number(0.01, 0.08) * unit * first
        drive = sb.ConstantVelocity(speed=pace / (unit * first))
        return drive, lambda t: (pace * t, pace, 0.0), []
    assert kind == "recorded_motion", kind
    count = 1600
    times = np.arange(count) * (8.0 * cycle / (count - 1))
    turn = number(0.5, 2.5) * first
    moved = reach * np.sin(rate * times) + 0.2 * reach * (np.cos(turn * times) - 1.0)
    pace_of = reach * rate * np.cos(rate * times) - 0.2 * reach * turn * np.sin(turn * times)
    spline = CubicHermiteSpline(times, side * moved, side * pace_of)
    bent = spline.derivative()
    drive = sb.RecordedMotion(
        displacement=number.flip * moved, velocity=number.flip * pace_of, sampling_frequency=1.0 / times[1],
        frequency=rate / (2.0 * math.pi),
    )  # fmt: skip
    return drive, lambda t: (float(spline(t)), float(bent(t)), 0.0), []


def shaken(kind: str, number: Numbers) -> tuple[sb.Drive, Motion, list[float]]:
    """The motion of a base."""
    cycle = 2.0 * math.pi / number.first
    peak = number(0.05, 0.3) * number.unit * number.first**2
    if kind == "shock":
        length, form = number(0.2, 0.8) * cycle, int(number(0.0, 2.0))
        drive = sb.Shock.from_si(peak, length, shape=("half_sine", "haversine")[form])

        def pulse(t: float) -> tuple[float, float, float]:
            a = math.sin(math.pi * t / length) if form == 0 else math.sin(math.pi * t / length) ** 2
            return 0.0, 0.0, peak * a if t < length else 0.0

        return drive, pulse, [length]
    if kind == "recorded_acceleration":
        count = 480
        times = np.arange(count) * (8.0 * cycle / (count - 1))
        turn = number(0.5, 2.5) * number.first
        record = peak * (np.sin(turn * times) + 0.3 * np.cos(2.3 * turn * times))
        spline = CubicSpline(times, record)
        made = sb.RecordedAcceleration(record=record, sampling_frequency=1.0 / times[1])
        return made, lambda t: (0.0, 0.0, float(spline(t))), []
    if kind == "sum":
        one, two = moving("noise", number), moving("burst", number)
        return one[0] + two[0], added(one[1], two[1]), one[2] + two[2]
    return moving(kind, number)


# ----------------------------------------------------------------------------------------------------
# Laws and forces.


def plain_constants(kind: Any, rng: Rng, given: dict[str, float]) -> dict[str, float]:
    """Constants of a law that is not known here: defaults, or numbers within their ranges."""
    found = dict(given)
    for name, item in quantities(kind).items():
        default = next(each.default for each in dataclasses.fields(kind) if each.name == name)
        if name in found or item.kind is not float or default is None:
            continue
        draw = float(rng.random())
        if isinstance(default, float) and default != 0.0:
            found[name] = default
        elif math.isfinite(item.low) and math.isfinite(item.high):
            found[name] = item.low + (0.2 + 0.6 * draw) * (item.high - item.low)
        elif item.unit.startswith("N/m^1.5"):
            found[name] = 10.0 ** (8.0 + draw)
        elif item.unit == "N/m":
            found[name] = 10.0 ** (4.0 + draw)
        else:
            found[name] = 0.1 * 10.0**draw
    return found


def touching(
    name: str, number: Numbers
) -> tuple[sb.ContactLaw, Callable[[float], float], Callable[[float], float] | None]:
    """A law of contact, its elastic force, and its force per rate of penetration."""
    k, share = 10.0 ** number(8.0, 9.0), number(0.0, 1.0)
    if name == "hertz":
        return sb.HertzContact(k), lambda d: k * d**1.5, None
    if name == "power":
        p, f = 1.0 + 1.2 * share, number(0.5, 2.0)
        return sb.PowerLaw(f, p), lambda d: f * (1e6 * d) ** p, None
    if name == "hunt_crossley":
        chi = 0.5 + 9.0 * share
        return sb.HuntCrossley(k, chi), lambda d: k * d**1.5, lambda d: chi * k * d**1.5
    if name == "kelvin_voigt":
        spring, c = 10.0 ** number(5.0, 6.0), 0.1 + 3.0 * share
        return sb.KelvinVoigt(spring, c), lambda d: spring * d, lambda d: c
    if name == "layer":
        soft = 10.0 ** number(11.0, 13.0)

        def series(d: float) -> float:
            # d = (f/k)^(2/3) + (f/soft)^(1/2): bisected and polished in x = f^(1/6)
            if d <= 0.0:
                return 0.0
            a, b = k ** (-2.0 / 3.0), soft**-0.5
            x = min((d / a) ** 0.25, (d / b) ** (1.0 / 3.0))
            for _ in range(12):
                x -= (a * x**4 + b * x**3 - d) / (4.0 * a * x**3 + 3.0 * b * x * x)
            return x**6

        return sb.LayeredHertz(k, soft), series, None
    kind: Any = LAWS[name]
    law = kind(**plain_constants(kind, number.rng, {}))
    numbers = law.numbers()
    loss = (lambda d: float(kind.damping_coefficient(numbers, d))) if law.rate_dependent else None
    return law, lambda d: float(kind.force(numbers, d)) if d > 0.0 else 0.0, loss


def falling(stiff: float, cubic: float) -> float:
    """Displacement at which the force of a softening spring falls to zero."""
    return math.sqrt(-stiff / cubic) if cubic < 0.0 else math.inf


def acting(name: str, number: Numbers, beam: ReferenceBeam) -> tuple[sb.LocalForce, PointForce]:
    """A local force."""
    place, share, far = number(0.25, 0.75), number(0.0, 1.0), number(2.5, 4.0) * number.unit
    side = 1.0 if number(0.0, 1.0) < 0.5 else -1.0
    row, gap = beam.shape(place), side * far
    if name == "rotation":
        stiff = 1e-3 + 2e-2 * share
        spring = sb.LocalSpring(stiffness=stiff, location=place, coordinate="rotation")
        return spring, PointForce(beam.slope(place), lambda u: -stiff * u)
    if name == "local_spring":
        stiff, cubic = 5.0 + 60.0 * share, number(-1e7, 1e8)
        spring = sb.LocalSpring(stiffness=stiff, cubic_stiffness=cubic, location=place)
        return spring, PointForce(row, lambda u: -stiff * u - cubic * u**3, reach=falling(stiff, cubic))
    if name == "softening_spring":
        stiff, cubic = 5.0 * share, number(-3e8, -5e7)
        soft = sb.LocalSpring(stiffness=stiff, cubic_stiffness=cubic, location=place)
        return soft, PointForce(row, lambda u: -stiff * u - cubic * u**3, reach=falling(stiff, cubic))
    if name in ("magnetic_force", "attracting_magnet"):
        share = 2.0 * share - 1.0 if name == "magnetic_force" else 1.0 + 1.5 * share
        strength = 0.02 * share * number.unit**2
        magnet = sb.MagneticForce(strength=strength, gap=number.flip * gap, location=place)
        return magnet, PointForce(row, lambda u: side * strength / (gap - u) ** 2)
    if name == "electrostatic_force":
        volts, area = 20.0 + 60.0 * share, 2e-4
        electrode = sb.ElectrostaticForce(voltage=volts, area=area, gap=number.flip * gap, location=place)
        pull = 0.5 * PERMITTIVITY * area * volts**2
        return electrode, PointForce(row, lambda u: side * pull / (gap - u) ** 2)
    if name == "quadratic_damping":
        c = 0.05 + 0.5 * share
        drag = sb.QuadraticDamping(coefficient=c, location=place)
        return drag, PointForce(row, lambda u: 0.0, lambda u, v: -c * abs(v) * v)
    kind: Any = LOCAL_FORCES[name]
    made = kind(location=place, **plain_constants(kind, number.rng, {}))
    law = made.numbers
    loss = (lambda u, v: float(kind.damping_force(law, u, v))) if made.dissipative else None
    return made, PointForce(row, lambda u: float(kind.force(law, u)), loss)


def history(kind: str, number: Numbers, size: float, mean: float, flip: float) -> Acting:
    """A force as a function of time, its formula for flip = 1, and the times of its corners."""
    first, cycle = number.first, 2.0 * math.pi / number.first
    ratio, phase, share = number(0.5, 2.5), number(-1.5, 1.5), number(0.0, 1.0)
    rate = ratio * first
    if kind == "harmonic_force":
        turned = phase if flip > 0.0 else phase + math.pi
        harmonic = sb.HarmonicForce(frequency_ratio=ratio, amplitude=size, mean=flip * mean, phase=turned)
        return harmonic, lambda t: mean + size * math.sin(rate * t + phase), []
    if kind == "constant_force":
        return sb.ConstantForce(force=flip * mean), lambda t: mean, []
    if kind == "half_sine_force":
        end = 0.3 * ratio * cycle
        blow = sb.model.HalfSineForce(peak=flip * size, duration=0.3 * ratio)
        return blow, lambda t: size * math.sin(math.pi * t / end) if t < end else 0.0, [end]
    if kind == "burst_force":
        up, flat, down = 0.3 + 0.5 * share, 0.1 + share, 0.8 - 0.5 * share
        sent = sb.model.BurstForce(
            frequency_ratio=ratio, amplitude=size, duration_cycles=up + flat + down, ramp_up_cycles=up,
            ramp_down_cycles=down,
        )  # fmt: skip
        motion, corners = burst(rate, size, up + flat + down, up, down)
        return sent, lambda t: motion(t)[0], corners
    if kind == "chirp_force":
        last, lasts, log = rate * (0.6 + 1.2 * share), (0.6 + 2.0 * share) * 2.0 * math.pi / rate, phase > 0.0
        swept = sb.model.ChirpForce(
            start_ratio=ratio, stop_ratio=last / first, amplitude=size, sweep_cycles=0.6 + 2.0 * share,
            sweep_type="log" if log else "linear",
        )  # fmt: skip
        motion, corners = chirp(rate, last, size, lasts, log, 0)
        return swept, lambda t: motion(t)[0], corners
    if kind == "noise_force":
        wide, ramp, seed = 0.2 + 1.3 * share, 0.3 + 0.7 * share, int(2e9 * share)
        random = sb.model.NoiseForce(
            low_ratio=ratio, high_ratio=ratio + wide, rms=0.5 * size, seed=seed, ramp_up_cycles=ramp
        )
        rise = ramp * 4.0 * math.pi / ((2.0 * ratio + wide) * first)
        summed = noise(seed, rate, rate + wide * first, 0.5 * size, rise, 0)
        return random, lambda t: summed(t)[0], [rise]
    if kind == "ramp_force":
        end = ratio * cycle
        ramp_force = sb.RampForce(change=flip * size * phase, duration=ratio)
        return ramp_force, lambda t: size * phase * smooth(t / end)[0], [end]
    if kind == "sum":
        one, two = history("harmonic_force", number, size, mean, flip), history("burst_force", number, size, mean, flip)
        return one[0] + two[0], lambda t: one[1](t) + two[1](t), two[2]
    assert kind == "recorded_force", kind
    times = np.arange(480) * (8.0 * cycle / 479)
    record = size * np.sin(rate * times + phase) + mean
    spline = CubicSpline(times, record)
    made = sb.RecordedForce(record=flip * record, sampling_frequency=1.0 / times[1])
    return made, lambda t: float(spline(t)), []


def external(kind: str, number: Numbers) -> Acting:
    """An external force."""
    return history(kind, number, number(0.01, 0.15), number(-0.05, 0.05), number.flip)


def loading(kind: str, number: Numbers) -> Acting:
    """The change of the axial load."""
    return history(kind, number, number(1.0, 6.0), number(-2.0, 2.0), 1.0)


def tapping(kind: str, number: Numbers, beam: ReferenceBeam) -> tuple[sb.Harvester, Circuit, float]:
    """A harvester, its circuit, and the voltage across the load per z."""
    wide = kind.startswith("any")
    if kind.endswith("piezo"):
        moment, c, r = number(4e-5, 1.6e-4), 80e-9, 10.0 ** number(4.0, 5.5)
        if wide:
            moment, r = moment * number(1.0, 3.0), 10.0 ** number(0.0, 8.0)
        begin, end = number(0.0, 0.15), number(0.25, 0.45)
        layers = sb.PiezoelectricHarvester(
            moment_per_volt=moment, capacitance=c, resistance=r, patch_start=begin, patch_end=end
        )
        return layers, Circuit(moment * (beam.slope(end) - beam.slope(begin)), c, 1.0 / r), 1.0
    factor, r, place = number(0.5, 1.5), number(5.0, 60.0), number(0.3, 0.7)
    inertia = 0.0 if kind == "coil" else number(0.005, 0.02)
    if wide:
        inertia = 10.0 ** number(-6.0, 0.0)
    coil = sb.ElectromagneticHarvester(
        force_factor=factor, resistance=r, coil_resistance=8.0, inductance=inertia, location=place
    )
    return coil, Circuit(factor * beam.shape(place), inertia, r + 8.0), -r


# ----------------------------------------------------------------------------------------------------


def composed(seed: int, features: Features | None = None, mirror: bool = False) -> Composition:
    """The system of a seed, or of given parts with the numbers of a seed, or the mirror image of that."""
    features = features_of(seed) if features is None else features
    rng, flip = np.random.default_rng([seed, 1]), -1.0 if mirror else 1.0
    n = features.modes

    def near(value: float) -> float:
        return value * float(rng.uniform(0.9, 1.1))

    given = BeamNumbers(
        near(0.161), near(0.4e-3), near(15e-3), near(7800.0), near(200e9), near(0.335e-3), n,
        float(rng.uniform(0.003, 0.02)),
    )  # fmt: skip
    uneven = {
        "rise": rng.uniform(-5e-6, 5e-6), "skew": rng.uniform(-3e-6, 3e-6) if n > 1 else 0.0,
        "point_load": rng.uniform(-0.01, 0.01), "point_location": rng.uniform(0.3, 0.7),
        "uniform_load": rng.uniform(-0.03, 0.03), "gravity": rng.uniform(0.0, 0.02),
    }  # fmt: skip
    if features.uneven:
        given = dataclasses.replace(given, **uneven)
    beam = ReferenceBeam(given)
    structure = sb.Beam(
        length=given.length, thickness=given.thickness, width=given.width, density=given.density,
        young_modulus=given.young, buckling_level=given.level,
    )  # fmt: skip
    imperfection = sb.Imperfection(
        midspan_amplitude=flip * given.rise, antisymmetric_amplitude=flip * given.skew, point_load=flip * given.point_load,
        point_location=given.point_location, uniform_load=flip * given.uniform_load, gravity=flip * given.gravity,
    )  # fmt: skip
    model = sb.ReducedModel.from_beam(
        structure, modes=n, damping_ratio=given.damping_ratio,
        imperfection=imperfection if features.uneven else None,
    )  # fmt: skip
    number = Numbers(rng, given.level, beam.omega, flip)
    breaks: list[float] = []
    contacts, tips = [], []
    for j, (law_name, drive_name, heavy) in enumerate(features.contacts):
        law, force, loss = touching(law_name, number)
        side = 1.0 if number(0.0, 1.0) < 0.6 else -1.0
        drive, motion, corners = moving(drive_name, number, side)
        place, apart, touches = number(0.25, 0.75), number(0.02, 0.3), number(0.0, 1.0) < 0.4
        gap = None if j == 0 and touches else apart * number.unit * (0.3 if j == 0 else 1.0)
        body = (number(5e-3, 5e-2), number(200.0, 900.0), number(0.0, 1.0))
        names = ("mass", "suspension_stiffness", "suspension_damping")
        of_body = dict(zip(names, body, strict=True)) if heavy else {}
        striker = sb.Striker(
            drive=drive, location=place, side="below" if side * flip > 0.0 else "above", gap=gap, **of_body
        )
        contacts.append(sb.Contact(law, striker))
        tips.append(Tip(motion, place, force, loss, side, gap, body if heavy else None))
        breaks += corners
    base, shaking = None, None
    if features.base is not None:
        drive, shakes, corners = shaken(features.base, number)
        up = 1.0 if number(0.0, 1.0) < 0.5 else -1.0
        base = sb.BaseExcitation(
            motion=drive, direction="up" if up * flip > 0.0 else "down", striker_on_base=features.carried
        )

        def shaking(t: float) -> tuple[float, float, float]:
            w, v, a = shakes(t)
            return up * w, up * v, up * a

        breaks += corners
    forces: list[Any] = []
    rows, local = [], []
    for kind in features.external:
        pushing, value, corners = external(kind, number)
        place = number(0.25, 0.75)
        forces.append(sb.ExternalForce(history=pushing, location=place))
        rows.append((beam.shape(place), value))
        breaks += corners
    for kind in features.local:
        one, other = acting(kind, number, beam)
        forces.append(one)
        local.append(other)
    axial, load = None, None
    if features.load is not None:
        change, load, corners = loading(features.load, number)
        axial = sb.AxialLoadModulation(motion=change)
        breaks += corners
    harvesters, circuits, volts = [], [], []
    for kind in features.circuits:
        harvester, circuit, volt = tapping(kind, number, beam)
        harvesters.append(harvester)
        circuits.append(circuit)
        volts.append(volt)
    start, state = None, None
    if features.started:
        well = beam.wells[-tips[0].side if tips else -1.0]
        size, order = float(np.abs(well).max()), np.arange(1, n + 1) ** 2
        moved = well + 0.05 * size * rng.uniform(-1.0, 1.0, n) / order
        pace = 0.4 * size * beam.omega * rng.uniform(-1.0, 1.0, n) / order
        start, state = (moved, pace), sb.State(amplitude=flip * moved, velocity=flip * pace)
    system = sb.System(
        model, contacts=contacts, forces=forces, base_excitation=base, axial_load=axial, harvesters=harvesters,
        initial_state=state,
    )  # fmt: skip
    parts = Parts(tips, rows, local, shaking, features.carried, load, circuits, start, tuple(sorted(breaks)))
    # their amplitudes are positive, and they have no phase
    signless = {"burst_force", "chirp_force", "noise_force", "sum"}
    known = set(features.local) <= {*KNOWN_FORCES, *ATTRACTIVE} and not signless & set(features.external)
    places = [tip.location for tip in tips] + [i / 8.0 for i in range(1, 8)]
    return Composition(features, system, beam, parts, volts, known, places)


if __name__ == "__main__":
    from test_composition import checked

    for each in map(int, sys.argv[1:]):
        print(each, features_of(each))
        print(checked(each))
