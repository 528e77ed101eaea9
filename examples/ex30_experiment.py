r"""
From a recording to a calibrated model
======================================

This example goes from the free decays of a beam to a measured response beside the simulated one. The measurements are
synthetic, so that each step can be compared with the true values: a simulated beam replaces the test specimen. All
later steps use only files such as camera and vibrometer write. With your own files, omit the simulation. The page on
experiments has the same steps as commands, and the last one: many tests as points on a map.
"""

import dataclasses
import tempfile
from pathlib import Path

import numpy as np

import snapbeam as sb
import snapbeam.lab as lab
from snapbeam import paper
from snapbeam.lab.plot.calibration import plot_calibration
from snapbeam.lab.plot.comparison import plot_waveform_comparison
from snapbeam.lab.plot.fit_decay import plot_decay
from snapbeam.lab.plot.tracking import plot_frame, plot_tracking_quality
from snapbeam.lab.plot.vibrometer import plot_drive

folder = tempfile.TemporaryDirectory()
files = Path(folder.name)
rng = np.random.default_rng(0)


def on_the_bench(buckling_level):
    """The beam on the bench, with eight modes."""
    beam = dataclasses.replace(
        paper.BEAM, buckling_level=buckling_level, axial_load=None
    )
    return sb.ReducedModel.from_beam(beam, modes=8, damping_ratio=0.005)


# %%
# The beam: free decays about both wells
# --------------------------------------
# No real beam is exactly symmetric. The paper's beam has 81.3 Hz about one well and 80.5 Hz about the other. The
# simulated beam vibrates about each well like a symmetric beam of another buckling level. It is deflected by a tenth of
# that level and released. The displacement at mid-span is recorded at 5 kHz for half a second; the initial sine is
# 20 dB above the noise.

rate, wells = 5e3, {}
for well, level in (("lower", 0.3323e-3), ("upper", 0.3289e-3)):
    model = on_the_bench(level)
    deflected = np.array(model.well_amplitude)
    deflected[0] *= 0.9
    free = sb.simulate(
        sb.System(
            model,
            initial_state=sb.State(
                amplitude=deflected, velocity=np.zeros(model.modes)
            ),
        ),
        sb.Integration(cycles=41),
        sample_times=np.arange(int(0.5 * rate)) / rate,
    )
    noise = 0.01 / np.sqrt(2.0) * rng.standard_normal(free.dataset.sizes["time"])
    signal = lab.make_signal(
        level * (free.dataset.midspan_displacement.values + noise), "m", rate
    )
    lab.write_signal(files / f"decay_{well}.csv", signal)
    wells[well] = lab.identify_decay(lab.read_signal(files / f"decay_{well}.csv"))
    mode = wells[well].modes[0]
    print(
        f"{well} well: {mode.natural_frequency:.3f} ± {mode.natural_frequency_se:.3f} Hz "
        f"(truth {model.natural_frequencies[0]:.3f}), damping ratio "
        f"{mode.damping_ratio:.5f} ± {mode.damping_ratio_se:.5f} (truth 0.005)"
    )
print(lab.compare_wells(wells["lower"], wells["upper"]).statement)

# %%
# The beam softens: its frequency is lower while it moves far. The fit extrapolates the
# backbone curve to the frequency of zero amplitude (below, right).

figure = plot_decay(lab.read_signal(files / "decay_upper.csv"), wells["upper"])

# %%
# Calibration
# -----------
# With the paper's frequencies of the straight beam, 80 and 221 Hz, and those of the wells, the thickness and the
# buckling level follow by least squares. They are values of the model and differ from the measured ones (0.44 and 0.5 mm),
# because they include elastic clamps and an initial deflection. The standard errors of the frequencies are half a
# percent: the difference of the wells is much larger than the errors of the decays, and a symmetric model cannot show it.

measured = lab.Measurements(
    straight_frequencies=(80.0, 221.0),
    lower_well_frequencies=(round(wells["lower"].natural_frequency, 2),),
    upper_well_frequencies=(round(wells["upper"].natural_frequency, 2),),
    damping_ratio=[fit.damping_ratio for fit in wells.values()],
    thickness=0.44e-3,
    buckling_level=0.5e-3,
)
calibration = lab.calibrate(measured)
for text in (*calibration.remarks, *calibration.warnings):
    print("-", text)
figure = plot_calibration(calibration)

# %%
# A test: the shaker
# ------------------
# 22 cycles at about 98 Hz. The shaker needs a few cycles to reach its amplitude, which the paper names as one
# cause of disagreement with simulations that start at once. The vibrometer records its velocity.

truth_model = on_the_bench(0.3306e-3)
first, cycles = truth_model.natural_frequencies[0], 22
frequency = 1.21 * first
velocity = 0.18 * 0.3306e-3 * 2.0 * np.pi * first
record = {"duration": 0.1 + (cycles + 2) / frequency, "start_up": 0.015}
true_velocity = lab.render_vibrometer(frequency, velocity, snr_db=100.0, **record)
lab.write_signal(
    files / "velocity.csv",
    lab.render_vibrometer(frequency, velocity, snr_db=30.0, **record),
)

signal = lab.read_signal(files / "velocity.csv")
drive = lab.measure_drive(signal)
print(
    "accepted" if drive.accepted else "not accepted",
    f"({drive.steady.sinad:.1f} dB, at least {drive.snr_limit:g})",
)
print(
    f"{drive.steady.frequency:.3f} ± {drive.steady.frequency_se:.3f} Hz "
    f"(truth {frequency:.3f})"
)
print(
    f"{1e3 * drive.steady.amplitude:.3f} ± {1e3 * drive.steady.amplitude_se:.3f} mm/s "
    f"(truth {1e3 * velocity:.3f})"
)
print(drive.startup.description)
figure = plot_drive(signal, drive)

# %%
# The test: the camera
# --------------------
# What the beam on the bench did, as a camera of 10 000 frames/s and 12 µm pixels sees it, with 30 dB between the
# contrast of the edges and the noise, written as a Photron header with 12-bit pixels. The recording begins 30 ms, or
# three cycles, before the shaker: without some rest nobody can tell the first cycle from the second.

motion = sb.Striker(
    drive=sb.RecordedMotion.from_dataset(lab.recorded_drive(true_velocity, 1e5)),
    location=paper.LOCATION,
)
truth = sb.simulate(
    sb.System(truth_model, contacts=[sb.Contact(paper.CONTACT, motion)]),
    sb.Integration(cycles=cycles),
)
camera = lab.SyntheticCamera(shape=(192, 64), snr_db=30.0)
stage = lab.SyntheticStage(shaker_width=0.4e-3)
rendered = lab.render_run(truth, camera=camera, stage=stage, rest_frames=300)
path = rendered.write(files / "test.cihx")

recording = lab.open_recording(path)
print(
    f"{len(recording)} frames of {recording.shape} pixels at {recording.frame_rate} Hz"
)

# %%
# Tracking knows the calibrated buckling level, because a camera cannot know where the middle between the wells is.
# A frame with the edges that were found:

tracked = lab.track(
    recording, buckling_level=calibration.beam.buckling_level, location=paper.LOCATION
)
figure = plot_frame(recording, tracked, 450)

# %%
# The report on the whole recording says what was not measured and why; nothing is filled in.

print(lab.tracking_report(tracked))
figure = plot_tracking_quality(tracked)

# %%
# Against the truth, which is the mean over each exposure:

pixel = 1e3 * camera.pixel_size
for name in ("displacement_mm", "shaker_displacement_mm"):
    error = (tracked[name].values - rendered.truth[name].values) / pixel
    print(
        f"{name}: mean error {np.nanmean(error):+.3f} px, RMS about it {np.nanstd(error):.3f} px"
    )

# %%
# The mean error is that of the calibrated buckling level, which places the beam at rest.
#
# Measured beside simulated
# -------------------------
# The measured velocity, start-up included, drives the calibrated model; what results stands beside what the camera
# saw. The response class is counted in both by the same rules.

model = sb.ReducedModel.from_beam(
    calibration.beam, modes=8, damping_ratio=calibration.damping_ratio
)
recorded = sb.Striker(
    drive=sb.RecordedMotion.from_dataset(
        lab.recorded_drive(signal, 1e5, measurement=drive)
    ),
    location=paper.LOCATION,
)
simulated = sb.simulate(
    sb.System(model, contacts=[sb.Contact(paper.CONTACT, recorded)]),
    sb.Integration(cycles=cycles),
)

shaker_seen = lab.make_signal(
    tracked.shaker_displacement_mm.values,
    "mm",
    time=tracked.time.values,
    name="shaker",
)
alignment = lab.align(shaker_seen, signal, drive.steady.frequency)
print(alignment.description, f"(truth {0.03 - 0.1:.4f} s)")
start = drive.startup.onset + alignment.delay
seen = lab.measure_response(
    tracked, drive.steady.frequency, cycles=cycles, start=start
)
print("measured: ", seen.description)
print(
    "simulated:",
    simulated.summary.response_class.label,
    f"({simulated.summary.zero_crossings} crossings)",
)

onsets = lab.contact_onsets(tracked).onset.values
comparison = lab.compare_waveforms(
    tracked,
    simulated.dataset,
    drive.steady.frequency,
    start=start,
    measured_onsets=onsets,
    simulated_onsets=simulated.impacts.onset.values,
)
figure = plot_waveform_comparison(comparison, window=(0.0, 20.0))

# %%
# For two or three cycles the beam does what the model says; then an impact comes a little sooner or later and the
# two part, as two runs of one model do whose parameters differ in the fourth digit. From there on the waveforms
# cannot agree; what can be compared are spectra and classes.

for last in (2, 5, 10, 22):
    part = comparison.waveforms.sel(cycle=slice(0.0, last))
    difference = np.sqrt(
        ((part.measured_displacement - part.simulated_displacement) ** 2).mean()
    )
    print(f"first {last} cycles: RMS difference {float(difference):.3f} b")

recording.close()
folder.cleanup()
