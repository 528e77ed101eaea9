"""Claims 9, 10 and 14: resonances, a snap-through, a shaker at the centre."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from snapbeam.paper.claims.table import Claim
from snapbeam.paper.recipes.fig5 import snap_times
from snapbeam.paper.recipes.figB10 import maxima
from snapbeam.paper.system import paper_model, paper_run

if TYPE_CHECKING:
    from snapbeam.paper.recipe import Results

__all__ = ["central_shaker", "resonances", "snap_through"]


def _two_highest(results: Results, which: int, level: int) -> list[float]:
    """Omega of the highest maximum below 2.3 and of that above, NaN where there is none."""
    ds = list(results["figB10"].values())[which]
    found = maxima(ds, level)
    return [
        next((ratio for ratio, _ in found if low <= ratio < high), float("nan"))
        for low, high in ((0.5, 2.3), (2.3, 4.1))
    ]


def resonances(results: Results) -> list[Claim]:
    """Claim 9."""
    data = list(results["figB10"].values())
    step = float(np.diff(data[0].frequency_ratio.values).max())
    low, moderate = data[0].velocity_amplitude.values
    one, shifted = _two_highest(results, 0, 0), _two_highest(results, 0, 1)
    many = _two_highest(results, 1, 0), _two_highest(results, 1, 1)
    lower = np.array(many) < np.array([one, shifted])
    modes, cycles = int(data[1].attrs["modes"]), int(data[0].attrs["cycles"])
    rule = (
        f"Omega of the highest local maximum of the greatest displacement at the contact over {cycles} "
        f"cycles, below and "
        "above Omega = 2.3."
    )
    drives = f"The paper does not give its drives; here V = {low:g} and {moderate:g}."
    return [
        Claim(
            "9a",
            "one mode, low drive: maxima of the displacement",
            "Omega near 1.8 and 3.6",
            f"{one[0]:.2f} and {one[1]:.2f}",
            f"{step:.3f} (grid)",
            "holds" if np.abs(np.array(one) - [1.8, 3.6]).max() <= 0.1 + 0.5 * step else "fails",
            f"{rule} Holds within 0.1.",
            drives,
        ),
        Claim(
            "9b",
            "one mode, moderate drive: the maxima shift to lower frequency",
            "left; a maximum near 3.5",
            f"{shifted[0]:.2f} and {shifted[1]:.2f}",
            f"{step:.3f} (grid)",
            "holds" if shifted[0] < one[0] and shifted[1] < one[1] else "fails",
            rule,
            drives,
        ),
        Claim(
            "9c",
            f"{modes} modes: the maxima are at lower frequencies than with one mode",
            "lower",
            f"{many[0][0]:.2f} and {many[0][1]:.2f} at low, {many[1][0]:.2f} and {many[1][1]:.2f} at "
            f"moderate drive",
            f"{step:.3f} (grid)",
            "holds" if lower.all() else "in part" if lower[0].any() else "fails",
            rule,
            drives,
        ),
    ]  # fmt: skip


def snap_through(results: Results) -> list[Claim]:
    """Claim 10."""
    run, along = results["fig5"]["run"], results["fig5"]["shapes"]
    alpha = run.modal_amplitude.values.astype(float) / abs(float(along.attrs["rest_amplitude"]))
    modes = alpha.shape[1]
    snaps = snap_times(run)
    others = np.sqrt(np.sum(alpha[:, 1:] ** 2, axis=1))
    near = np.abs(alpha[:, 0]) < 0.05
    dominant = float((others > np.abs(alpha[:, 0]))[near].mean()) if near.any() else float("nan")
    second = float(np.median(np.abs(alpha[near, 1]))) if near.any() else float("nan")
    flight = run.contact_force.values == 0.0
    shapes, scale = along["shape"].values, float(along.attrs["length_scale"])
    centre = shapes[shapes.shape[0] // 2] * abs(float(along.attrs["rest_amplitude"])) / scale
    ripple = alpha[:, 2:] @ centre[2:]
    size = float(np.sqrt(np.mean((ripple - ripple[flight].mean())[flight] ** 2)))
    spectrum_freq = _dominant_frequency(run.time.values, ripple)
    first_freq = float(run.attrs["reference_freq"])
    cycles = float(run.cycle[-1])
    return [
        Claim(
            "10a",
            f"Omega = 1.21, V = 0.18, {modes} modes: the beam snaps through",
            "yes",
            f"{'yes' if snaps.size else 'no'}, alpha_1 passes zero {snaps.size} times within {cycles:g} "
            f"cycles",
            "one run; the first crossing does not move with a change of 1e-13 in V",
            "holds" if snaps.size else "fails",
            "Sign of the first modal amplitude.",
        ),
        Claim(
            "10b",
            "while alpha_1 is near zero the higher modes dominate",
            "dominate",
            f"greater than alpha_1 in {100.0 * dominant:.0f} % of the time that |alpha_1| is below 5 % of "
            f"its value at rest; "
            f"then |alpha_2| is {100.0 * second:.1f} % of that value in the median",
            "one run",
            "holds" if dominant > 0.9 else "in part" if dominant > 0.5 else "fails",
            "Root of the sum of the squares of alpha_2 and up against |alpha_1|; holds if greater nine "
            "tenths of the time.",
        ),
        Claim(
            "10c",
            "high-frequency oscillations ride on the free flight",
            "in every cycle",
            f"rms {size:.3f} b at the centre, strongest at {spectrum_freq / first_freq:.1f} omega_1 "
            f"({spectrum_freq:.0f} Hz)",
            "one run",
            "holds" if size > 0.005 and spectrum_freq > 2.0 * first_freq else "fails",
            "Part of the centre displacement that modes 3 and up make, without contact: its root mean "
            "square about the mean "
            "and the peak of its spectrum; holds if above 0.005 b and 2 omega_1.",
        ),
    ]


def _dominant_frequency(time: np.ndarray, signal: np.ndarray) -> float:
    """Frequency of the greatest line of a spectrum, Hz, with a Hann window."""
    window = np.hanning(signal.size)
    spectrum = np.abs(np.fft.rfft((signal - signal.mean()) * window))
    return float(np.fft.rfftfreq(signal.size, time[1] - time[0])[np.argmax(spectrum)])


def central_shaker(results: Results) -> list[Claim]:
    """Claim 14."""
    modes = results.pick(8, 32)
    cycles = results.pick(10, 50)
    run = paper_run(modes, 1.21, 0.3, cycles, location=0.5)
    alpha = run.dataset.modal_amplitude.values
    even = float(np.abs(alpha[:, 1::2]).max() / abs(paper_model(modes).equilibrium[0]))
    return [
        Claim(
            "14",
            "a shaker at the centre leaves the antisymmetric modes unexcited",
            "no direct excitation",
            f"greatest antisymmetric amplitude over {cycles} cycles {even:.1g} of alpha_1 at rest",
            "exact by symmetry",
            "holds" if even == 0.0 else "fails",
            "Omega = 1.21, V = 0.3, x_s = 1/2; holds if exactly zero.",
        )
    ]
