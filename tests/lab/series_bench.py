"""Files of a series of simulated tests, as camera and vibrometer would have written them, some spoiled."""

from __future__ import annotations

import numpy as np

import snapbeam as sb
import snapbeam.lab as lab
from snapbeam.util.status_codes import ResponseClass

LOCATION = 1.0 / 2.1
BEAM = sb.Beam(
    length=0.161, thickness=0.4e-3, width=15e-3, density=7800.0, young_modulus=200e9, buckling_level=0.335e-3
)
MODEL = sb.ReducedModel.from_beam(BEAM, modes=1, damping_ratio=0.005)
CONTACT = sb.HertzContact(stiffness=4e8)
CAMERA = lab.SyntheticCamera(frame_rate=3000.0, pixel_size=24e-6, shape=(160, 64), exposure=1e-4, snr_db=30.0)
CYCLES = 22
POINTS = (
    (0.6, 0.1), (0.6, 0.3), (0.9, 0.08), (0.9, 0.3), (1.3, 0.06), (1.3, 0.35),
    (1.8, 0.1), (1.8, 0.3), (1.8, 0.5), (2.4, 0.15), (2.4, 0.45), (3.0, 0.2),
)  # fmt: skip
SPOILED = {"test03": "cut short", "test07": "begins in motion", "test10": "another test's vibrometer"}


def write_test(folder, name, ratio, velocity, *, seed=0, spoiled=None):
    """Write ``<name>.cihx`` with its pixels and ``<name>_vib.csv``; what is true of it."""
    first = MODEL.natural_frequencies[0]
    frequency = ratio * first
    speed = velocity * BEAM.buckling_level * 2.0 * np.pi * first
    lasting = {"duration": 0.1 + (CYCLES + 2) / frequency, "start_up": 0.01}
    true = lab.render_vibrometer(frequency, speed, snr_db=100.0, **lasting)
    motion = sb.Striker(drive=sb.RecordedMotion.from_dataset(lab.recorded_drive(true, 1e5)), location=LOCATION)
    run = sb.simulate(sb.System(MODEL, contacts=[sb.Contact(CONTACT, motion)]), sb.Integration(cycles=CYCLES))
    clean = ResponseClass(run.summary.response_class).label
    if spoiled == "begins in motion":
        run = run.dataset.isel(time=run.dataset.time.values > 3.3 / frequency)
        run = run.assign_coords(time=("time", run.time.values - run.time.values[0], run.time.attrs))
    stage = lab.SyntheticStage(shaker_width=0.8e-3)
    rest = 0 if spoiled == "begins in motion" else 90
    recording = lab.render_run(run, camera=CAMERA, stage=stage, rng=seed, rest_frames=rest)
    path = recording.write(folder / f"{name}.cihx")
    if spoiled == "cut short":
        pixels = path.with_suffix(".mraw")
        pixels.write_bytes(pixels.read_bytes()[:3_000_000])
    if spoiled == "another test's vibrometer":
        frequency *= 1.4
    seen = lab.render_vibrometer(frequency, speed, snr_db=30.0, rng=seed, **lasting)
    lab.write_signal(folder / f"{name}_vib.csv", seen)
    return {"frequency": frequency, "speed": speed, "response_class": clean}


def write_test_series(folder, points=POINTS):
    """Write all tests; what is true of them by name: frequency [Hz], speed [m/s] and response."""
    truth = {}
    for number, (ratio, velocity) in enumerate(points, start=1):
        name = f"test{number:02d}"
        truth[name] = write_test(folder, name, ratio, velocity, seed=number, spoiled=SPOILED.get(name))
    return truth


def coarse_map(cycles=CYCLES):
    """A small map of the same beam."""
    shaker = sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.2, location=LOCATION)
    return sb.sweep(
        sb.System(MODEL, contacts=[sb.Contact(CONTACT, shaker)]),
        {
            "frequency_ratio": np.linspace(0.3, 3.9, 13),
            "velocity_amplitude": np.linspace(0.05, 0.6, 12),
            "location": [LOCATION],
        },
        sb.Integration(cycles=cycles),
    )
