"""From a simulated run to what a laboratory would have recorded of it: frames, and a vibrometer's signal."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from snapbeam.core.validate import InputError, integer, nonnegative, positive, within
from snapbeam.lab.signals.signal import make_signal
from snapbeam.lab.synthetic.recording import SyntheticRecording, render_recording
from snapbeam.lab.synthetic.setup import SyntheticCamera, SyntheticStage
from snapbeam.runs.schema import check_trajectory

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["render_run", "render_vibrometer"]


def render_run(
    run: Any,
    *,
    camera: SyntheticCamera | None = None,
    stage: SyntheticStage | None = None,
    seed: int = 0,
    **options: Any,
) -> SyntheticRecording:
    """Draw what a high-speed camera would see of a simulated run about the shaker.

    Parameters
    ----------
    run
        A run, or its dataset, with ``displacement_at_striker``, ``striker_displacement`` and the attribute
        ``length_scale``, the buckling level b [m].
    camera, stage, seed, **options
        As for :func:`render_recording`.  Unless a stage is given, its beam is as thick as the run's and the
        shaker stands on the run's side.
    """
    dataset = check_trajectory(
        getattr(run, "dataset", run), ("displacement_at_striker", "striker_displacement")
    )
    attrs = dataset.attrs
    if "length_scale" not in attrs:
        raise InputError("run without the attribute length_scale: must say how many metres its unit b is")
    scale = positive("length_scale", attrs["length_scale"], "m")
    if stage is None:
        plain = SyntheticStage()
        stage = SyntheticStage(
            side=attrs.get("side", plain.side),
            beam_thickness=attrs.get("beam_thickness", plain.beam_thickness),
        )
    recording = render_recording(
        dataset["time"].values,
        scale * dataset["displacement_at_striker"].values,
        scale * dataset["striker_displacement"].values,
        camera=camera,
        stage=stage,
        seed=seed,
        **options,
    )
    for name in ("displacement_at_striker", "striker_displacement", "penetration_normalised"):
        values = recording.truth[f"{name}_mm"]
        recording.truth[name] = ("time", values.values / (scale * 1e3), {**values.attrs, "units": "1"})
    recording.truth.attrs["buckling_level"] = scale
    return recording


def render_vibrometer(
    frequency: float,
    velocity_amplitude: float,
    *,
    duration: float,
    sampling_frequency: float = 20_000.0,
    onset: float = 0.1,
    start_up: float = 0.05,
    start_up_share: float = 0.4,
    phase: float = 0.0,
    distortion: float = 0.0,
    snr_db: float = 30.0,
    seed: int = 0,
) -> xr.DataArray:
    """What a laser vibrometer would record of the shaker: rest, a start-up transient, a sine, and noise.

    From the onset t0 on the velocity is V [1 - s exp(-(t - t0)/T)] cos(omega (t - t0) + phase), with the
    share s and the time T of the start-up, and a second harmonic of relative size ``distortion``.

    Parameters
    ----------
    frequency, velocity_amplitude
        Of the steady motion [Hz], [m/s].
    duration, sampling_frequency
        Length [s] and rate [Hz] of the record.
    onset, start_up, start_up_share
        t0 [s], T [s] and s; 0 for a start-up that is over at once.
    phase, distortion
        Phase [rad] at the onset, and amplitude of the second harmonic over the first.
    snr_db
        20 log10(rms of the steady sine / standard deviation of the noise); infinite for none.
    seed
        Of the noise.

    Returns
    -------
    xarray.DataArray
        The signal [m/s] with the truth in its attributes; write it with :func:`write_signal`.
    """
    freq = positive("frequency", frequency, "Hz")
    amplitude = positive("velocity_amplitude", velocity_amplitude, "m/s")
    rate = positive("sampling_frequency", sampling_frequency, "Hz")
    if rate <= 4.0 * freq:
        raise InputError(
            f"sampling_frequency = {rate:g}: must be more than 4 times the frequency, {4 * freq:g} Hz"
        )
    length = positive("duration", duration, "s")
    begin = within("onset", onset, 0.0, length, closed="left", unit="s")
    time_constant = nonnegative("start_up", start_up, "s")
    share = within("start_up_share", start_up_share, -1.0, 1.0, closed="both")
    second = within("distortion", distortion, 0.0, 1.0, closed="left")
    if not (snr_db == math.inf):
        within("snr_db", snr_db, -20.0, 200.0, closed="both", unit="dB")
    rng = np.random.default_rng(integer("seed", seed, 0))
    time = np.arange(round(length * rate)) / rate
    since = np.maximum(time - begin, 0.0)
    envelope = 1.0 - share * np.exp(-since / time_constant) if time_constant > 0.0 else np.ones_like(since)
    angle = 2.0 * math.pi * freq * since + within("phase", phase, -1e6, 1e6, unit="rad")
    velocity = amplitude * envelope * (np.cos(angle) + second * np.cos(2.0 * angle)) * (time >= begin)
    noise = 0.0 if snr_db == math.inf else amplitude / math.sqrt(2.0) * 10.0 ** (-snr_db / 20.0)
    truth = {
        "true_frequency": freq,
        "true_velocity_amplitude": amplitude,
        "true_onset": begin,
        "true_start_up": time_constant,
        "true_noise": noise,
        "seed": seed,
    }
    values = velocity + noise * rng.standard_normal(time.size)
    return make_signal(values, "m/s", rate, name="shaker velocity", attrs=truth)
