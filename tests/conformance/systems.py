"""Small systems with every kind of part, their mirror images, and ranges of parameters for random runs."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from oracle import LEVEL

import snapbeam as sb
from snapbeam.model import default_values

SINE = {"drive.frequency_ratio": (0.3, 3.5), "drive.velocity_amplitude": (0.02, 0.6)}
PLACE = {"contact.location": (0.15, 0.85)}
SHAKEN = {"base_excitation.frequency_ratio": (0.4, 2.0), "base_excitation.acceleration_amplitude": (0.05, 0.6)}


@dataclass(frozen=True)
class ExtendedSystem:
    """Parts of a system, as a function of its reduced model, and ranges of parameters for random runs."""

    parts: Callable[[sb.ReducedModel], dict[str, object]]
    varied: dict[str, tuple[float, float]]
    beam: sb.Beam = default_values.BEAM
    imperfection: sb.Imperfection | None = None
    modes: int = 3
    fewest: int = 1
    """Modes that it needs."""
    cycles: int = 60
    """How long its runs may be."""
    reference_frequency: float | None = None
    decides: bool = True
    """Whether a run of it can be decided early at all."""

    def system(self, modes: int | None = None) -> sb.System:
        model = sb.ReducedModel.from_beam(
            self.beam, modes=self.modes if modes is None else modes, imperfection=self.imperfection
        )
        if self.reference_frequency is not None:
            model = dataclasses.replace(model, given_reference_frequency=self.reference_frequency)
        return sb.System(model, **self.parts(model))  # type: ignore[arg-type]

    def points(self, count: int, seed: int) -> dict[str, NDArray[np.float64]]:
        rng = np.random.default_rng(seed)
        return {name: rng.uniform(*span, count) for name, span in self.varied.items()}


def mirror_image(system: sb.System) -> sb.System:
    """Upside down: striker, wells, base and records."""
    model, base = system.model, system.base_excitation
    if model.imperfection is not None:
        assert model.beam is not None
        model = sb.ReducedModel.from_beam(model.beam, modes=model.modes, imperfection=model.imperfection.mirrored)
    contacts = []
    for each in system.contacts:
        drive, side = each.striker.drive, "above" if each.striker.side == "below" else "below"
        if isinstance(drive, sb.RecordedMotion):
            drive = dataclasses.replace(drive, displacement=-drive.displacement, velocity=-drive.velocity)
        striker = dataclasses.replace(each.striker, side=side, drive=drive)
        contacts.append(dataclasses.replace(each, striker=striker))
    if base is not None:
        base = dataclasses.replace(base, direction="down" if base.direction == "up" else "up")
    return dataclasses.replace(system, model=model, contacts=contacts, base_excitation=base)


def struck(drive: sb.Drive, contact: sb.ContactLaw = default_values.CONTACT, **striker: object):
    return lambda model: {"contacts": [sb.Contact(contact, sb.Striker(drive=drive, **striker))]}


def sine(velocity: float = 0.2) -> sb.Sine:
    return sb.Sine(frequency_ratio=1.3, velocity_amplitude=velocity)


def on_a_base(motion: sb.Drive, **more: object):
    """A stop beside a beam that is shaken."""
    stop = sb.Striker(drive=sb.FixedStop(), gap=0.05 * LEVEL)
    return lambda model: {
        "contacts": [sb.Contact(default_values.CONTACT, stop)],
        "base_excitation": sb.BaseExcitation(motion=motion, **more),
    }


def record(model: sb.ReducedModel) -> dict[str, object]:
    """A tip that starts up over three cycles, with a second harmonic."""
    frequency, rate = 1.3 * model.reference_frequency, 40_000.0
    t = np.arange(0.0, 12.0 / frequency, 1.0 / rate)
    omega, amplitude = 2.0 * math.pi * frequency, 0.25 * LEVEL / 1.3
    x = np.minimum(t * frequency / 3.0, 1.0)
    e, slope = x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x) * frequency / 3.0
    s, c = (np.sin(omega * t) + 0.2 * np.sin(2.0 * omega * t), np.cos(omega * t) + 0.4 * np.cos(2.0 * omega * t))
    drive = sb.RecordedMotion(
        displacement=amplitude * e * s,
        velocity=amplitude * (slope * s + e * omega * c),
        sampling_frequency=rate,
        frequency=frequency,
    )
    return {"contacts": [sb.Contact(default_values.CONTACT, sb.Striker(drive=drive))]}


def loaded(motion: sb.Drive):
    return lambda model: {
        "contacts": [sb.Contact(default_values.CONTACT, sb.Striker(drive=sine()))],
        "axial_load": sb.AxialLoadModulation(motion=motion),
    }


def harvested(harvester: sb.Harvester):
    return lambda model: {
        "contacts": [sb.Contact(default_values.CONTACT, sb.Striker(drive=sine()))],
        "harvesters": [harvester],
    }


BURST = sb.Burst(
    frequency_ratio=1.21,
    velocity_amplitude=0.25,
    duration_cycles=4.0,
    ramp_up_cycles=1.0,
    ramp_down_cycles=0.5,
    retraction=0.3,
)
CHIRP = sb.Chirp(start_ratio=0.8, stop_ratio=2.0, velocity_amplitude=0.25, sweep_cycles=8.0)
ACCELERATION_CHIRP = sb.model.AccelerationChirp(
    start_ratio=0.6, stop_ratio=2.0, acceleration_amplitude=0.2, sweep_cycles=6.0, sweep_type="log"
)
NOISE = sb.BandLimitedNoise(low_ratio=0.5, high_ratio=2.0, velocity_rms=0.2, seed=3, ramp_up_cycles=1.0)
TWO = sb.Sine(frequency_ratio=1.2, velocity_amplitude=0.2) + sb.Sine(frequency_ratio=2.4, velocity_amplitude=0.1)
SPRUNG = default_values.BEAM.replace(
    boundary=sb.BoundaryConditions(
        left_rotational_stiffness=40.0, right_rotational_stiffness=5.0, axial_support_stiffness=2e7
    )
)
PIEZO = sb.PiezoelectricHarvester(
    moment_per_volt=4e-3, capacitance=60e-9, resistance=2e4, patch_start=0.0, patch_end=0.25
)
UNEVEN = sb.Imperfection(
    midspan_amplitude=4e-6,
    antisymmetric_amplitude=3e-6,
    point_load=0.01,
    point_location=0.4,
    uniform_load=0.02,
    gravity=0.01,
)
MEASURED = sb.Imperfection(
    profile=np.array([[0.0, 0.2, 0.5, 0.7, 1.0], [0.0, 3e-6, 6e-6, 4e-6, 0.0]]), midspan_amplitude=2e-6, shape="sine"
)

SYSTEMS: dict[str, ExtendedSystem] = {
    "the paper's": ExtendedSystem(struck(sine()), SINE | PLACE),
    "restitution": ExtendedSystem(struck(sine(), sb.Restitution(0.6)), SINE | PLACE, modes=1),
    "power": ExtendedSystem(struck(sine(), sb.PowerLaw.from_stiffness(4e11, 2.0)), SINE | PLACE),
    "layer": ExtendedSystem(struck(sine(), sb.LayeredHertz(stiffness=4e8, layer_stiffness=1e10)), SINE | PLACE),
    "hunt_crossley": ExtendedSystem(
        struck(sine(), sb.HuntCrossley.from_restitution(4e8, 0.6, 0.05)), SINE | PLACE
    ),
    "kelvin_voigt": ExtendedSystem(struck(sine(), sb.KelvinVoigt(2e6, 20.0)), SINE | PLACE),
    "a gap": ExtendedSystem(struck(sine(), gap=4e-5), SINE | {"contact.gap": (-5e-5, 1e-4)}),
    "a phase": ExtendedSystem(
        struck(sb.DisplacementSine(frequency_ratio=1.3, displacement_amplitude=0.2, phase=0.7)),
        {"drive.frequency_ratio": (0.3, 3.0), "drive.displacement_amplitude": (0.02, 0.5), "drive.phase": (-3.0, 3.0)},
    ),
    "acceleration_sine": ExtendedSystem(
        struck(sb.AccelerationSine(frequency_ratio=1.3, acceleration_amplitude=0.3)),
        {"drive.frequency_ratio": (0.3, 3.0), "drive.acceleration_amplitude": (0.02, 1.2)},
    ),
    "burst": ExtendedSystem(
        struck(BURST),
        {"drive.frequency_ratio": (0.5, 3.0), "drive.velocity_amplitude": (0.1, 0.8), "drive.duration_cycles": (2.0, 12.0)},
    ),
    "chirp": ExtendedSystem(
        struck(CHIRP),
        {"drive.start_ratio": (0.5, 2.0), "drive.stop_ratio": (0.5, 3.0), "drive.velocity_amplitude": (0.02, 0.5)},
    ),
    "logarithmic chirp": ExtendedSystem(
        struck(dataclasses.replace(CHIRP, sweep_type="log")),
        {"drive.start_ratio": (0.5, 2.0), "drive.stop_ratio": (0.5, 3.0), "drive.velocity_amplitude": (0.02, 0.5)},
    ),
    "half_sine": ExtendedSystem(
        struck(sb.HalfSine(displacement_amplitude=0.6, duration=0.5)),
        {"drive.displacement_amplitude": (0.1, 2.0), "drive.duration": (0.05, 2.0)},
    ),
    "noise": ExtendedSystem(
        struck(NOISE), {"drive.velocity_rms": (0.02, 0.4), "drive.low_ratio": (0.2, 1.0)}
    ),
    "two_tone": ExtendedSystem(
        struck(TWO),
        {f"{name}_1": bounds for name, bounds in SINE.items()}
        | {"drive.velocity_amplitude_2": (0.0, 0.3), "drive.phase_2": (-3.0, 3.0)},
    ),
    "recorded": ExtendedSystem(record, PLACE, cycles=11),
    "still": ExtendedSystem(struck(sb.FixedStop(), gap=-1e-4), {"contact.gap": (-3e-4, 1e-4)} | PLACE),
    "a body": ExtendedSystem(
        struck(sine(), mass=0.02, suspension_stiffness=700.0, suspension_damping=0.7), SINE | PLACE, decides=False
    ),
    "a sphere": ExtendedSystem(
        struck(sb.ConstantVelocity(speed=0.4), mass=2e-3, gap=5e-5), {"drive.speed": (0.1, 2.0)} | PLACE, decides=False
    ),
    "two strikers": ExtendedSystem(
        lambda model: {
            "contacts": [
                sb.Contact(default_values.CONTACT, sb.Striker(drive=sine())),
                sb.Contact(
                    sb.PowerLaw.from_stiffness(4e11, 2.0),
                    sb.Striker(drive=sb.DisplacementSine(frequency_ratio=2.6, displacement_amplitude=0.05), location=0.3,
                        side="above", gap=0.1 * LEVEL),
                ),
            ],
        },
        SINE | {"contact.2.gap": (-2e-5, 1e-4), "drive.2.displacement_amplitude": (0.0, 0.2)},
        decides=False,
    ),
    "unequal wells": ExtendedSystem(struck(sine()), SINE | PLACE, imperfection=UNEVEN, fewest=2),
    "a measured shape": ExtendedSystem(struck(sine()), SINE | PLACE, imperfection=MEASURED),
    "other ends": ExtendedSystem(struck(sine()), SINE | PLACE, beam=SPRUNG),
    "a given load": ExtendedSystem(
        struck(sine()),
        SINE | PLACE,
        beam=default_values.BEAM.replace(axial_load=1.5 * default_values.BEAM.critical_load),
        reference_frequency=80.0,
    ),
    "a base": ExtendedSystem(
        on_a_base(sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.25, phase=0.3)), SHAKEN,
    ),
    "a base under a stop in space": ExtendedSystem(
        on_a_base(sb.Sine(frequency_ratio=0.9, velocity_amplitude=0.25), striker_on_base=False),
        {"base_excitation.frequency_ratio": (0.4, 2.0), "base_excitation.velocity_amplitude": (0.05, 0.5)},
    ),
    "a base by its displacement": ExtendedSystem(
        on_a_base(sb.DisplacementSine(frequency_ratio=0.9, displacement_amplitude=0.25)),
        {"base_excitation.frequency_ratio": (0.4, 2.0), "base_excitation.displacement_amplitude": (0.05, 0.5)},
    ),
    "a base of two sines": ExtendedSystem(on_a_base(TWO), {"base_excitation.velocity_amplitude_1": (0.05, 0.5)}),
    "a burst of the base": ExtendedSystem(on_a_base(BURST), {"base_excitation.velocity_amplitude": (0.05, 0.5)}),
    "a swept base": ExtendedSystem(on_a_base(CHIRP), {"base_excitation.velocity_amplitude": (0.05, 0.5)}),
    "a noisy base": ExtendedSystem(on_a_base(NOISE), {"base_excitation.velocity_rms": (0.02, 0.3)}),
    "a changing load": ExtendedSystem(
        loaded(sb.HarmonicForce(frequency_ratio=2.0, amplitude=3.0)), SINE | {"axial_load.amplitude": (0.0, 20.0)}
    ),
    "a load that falls": ExtendedSystem(
        loaded(sb.RampForce(change=-5.0, duration=3.0, hold_periods=4.0)), SINE | {"axial_load.change": (-20.0, 10.0)}
    ),
    "a piezo": ExtendedSystem(harvested(PIEZO), SINE | {"harvester.resistance": (1e3, 1e6)}),
    "a coil": ExtendedSystem(
        harvested(sb.ElectromagneticHarvester(force_factor=1.5, resistance=30.0, coil_resistance=10.0, location=0.4)),
        SINE | {"harvester.resistance": (1.0, 100.0)},
    ),
    "a coil with inductance": ExtendedSystem(
        harvested(sb.ElectromagneticHarvester(force_factor=1.5, resistance=30.0, coil_resistance=10.0, inductance=0.01)),
        SINE | {"harvester.resistance": (1.0, 100.0)},
    ),
    "a bit of all": ExtendedSystem(
        lambda model: {
            "contacts": [sb.Contact(
                default_values.CONTACT,
                sb.Striker(drive=sine(), mass=0.02, suspension_stiffness=700.0, suspension_damping=0.7, gap=1e-5),
            )],
            "base_excitation": sb.BaseExcitation(motion=sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.1)),
            "axial_load": sb.AxialLoadModulation(motion=sb.HarmonicForce(frequency_ratio=2.0, amplitude=3.0)),
            "harvesters": [PIEZO],
        },
        SINE | PLACE,
        beam=SPRUNG,
        imperfection=UNEVEN,
        fewest=2,
    ),
    "a chirp of constant acceleration": ExtendedSystem(
        struck(ACCELERATION_CHIRP),
        {"drive.start_ratio": (0.5, 2.0), "drive.stop_ratio": (0.5, 3.0), "drive.acceleration_amplitude": (0.02, 0.5)},
    ),
    "a base of swept acceleration": ExtendedSystem(
        on_a_base(ACCELERATION_CHIRP), {"base_excitation.acceleration_amplitude": (0.05, 0.5)}
    ),
}  # fmt: skip
"""By name; a test proves that no kind of part and no parameter is missing."""
