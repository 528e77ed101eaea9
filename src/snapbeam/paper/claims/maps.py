"""Claims 2 to 5: thresholds and classes over frequency and amplitude."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

import snapbeam as sb
from snapbeam.core.codes import ResponseClass
from snapbeam.model.paper_values import LOCATION
from snapbeam.paper.claims.table import Claim
from snapbeam.sweeps.analysis import (
    class_share,
    compare_maps,
    interwell_threshold,
    is_interwell,
    threshold_notch,
)

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.paper.recipe import Results

__all__ = ["long_runs", "low_frequency", "notches", "thresholds"]

_Array = NDArray[np.float64]
_NOTCH_WINDOW = (0.8, 2.2)


def _curves(data: dict[str, xr.Dataset]) -> tuple[_Array, list[_Array], float, list[int]]:
    """Omega, the threshold of each model, the step of V, and the numbers of modes."""
    maps = list(data.values())
    step = float(np.diff(maps[0].velocity_amplitude.values).max())
    modes = [int(ds.attrs["modes"]) for ds in maps]
    return maps[0].frequency_ratio.values, [interwell_threshold(ds) for ds in maps], step, modes


def notches(results: Results) -> list[Claim]:
    """Claim 2."""
    ratio, curves, step, modes = _curves(results["fig6"])
    rows, found = [], []
    for letter, curve, count, printed in zip("ab", curves, modes, (1.4, 1.2), strict=True):
        notch = threshold_notch(ratio, curve, step, _NOTCH_WINDOW)
        found.append(notch)
        half = 0.5 * (notch.high - notch.low) + 0.5 * float(np.diff(ratio).max())
        rows.append(
            Claim(
                f"2{letter}",
                f"notch of the interwell threshold, N = {count}",
                f"near Omega = {printed:g}",
                f"Omega = {notch.position:.2f}, V = {notch.height:.3f}",
                f"{half:.2f} in Omega, {step:.3f} in V",
                "holds" if abs(notch.position - printed) <= max(half, 0.1) else "fails",
                "Threshold: smallest V that is interwell at each Omega after 200 cycles. Notch: its lowest "
                "point between "
                "Omega 0.8 and 2.2; position: the middle of the stretch within one step of V of that, half "
                "its "
                "length the uncertainty. Agreement: within the uncertainty or 0.1, the greater.",
            )
        )
    rows.append(
        Claim(
            "2c",
            f"the notch is at a lower frequency with {modes[1]} modes than with one",
            "lower (1.2 against 1.4)",
            f"{found[1].position:.2f} against {found[0].position:.2f}",
            f"{float(np.diff(ratio).max()):.3f} (grid)",
            "holds" if found[1].high < found[0].position and found[1].position < found[0].low else "in part"
            if found[1].position < found[0].position else "fails",
            "Positions of 2a and 2b; holds if each lies outside the other's stretch.",
        )
    )  # fmt: skip
    return rows


def thresholds(results: Results) -> list[Claim]:
    """Claim 3."""
    ratio, (one, many), step, modes = _curves(results["fig6"])
    both = np.isfinite(one) & np.isfinite(many)
    below = both & (many < one - 0.5 * step)
    where = ratio[below]
    rows = [
        Claim(
            "3a",
            f"the threshold of {modes[1]} modes is universally higher than that of one mode",
            "at every Omega",
            f"lower at {100.0 * below.sum() / both.sum():.1f} % of the frequencies"
            + (f", Omega = {', '.join(f'{x:.2f}' for x in where[:12])}" if where.size else ""),
            f"{step:.3f} in V (grid)",
            "holds" if not below.any() else "in part" if below.sum() < 0.1 * both.sum() else "fails",
            "Share of the frequencies of Fig. 6 at which the threshold of many modes is lower by a step of "
            "V or more.",
            f"Median ratio of the thresholds {float(np.nanmedian(many / one)):.2f}."
            + (
                f" Where it is lower, by {float((one - many)[below].max()):.3f} at most: at and beside the "
                f"notch of many "
                "modes, which lies where one mode has none."
                if where.size
                else ""
            ),
        )
    ]
    low, high = (ratio >= 2.0) & (ratio <= 2.5), ratio >= 3.5
    rise = [float(np.nanmean(curve[high]) / np.nanmean(curve[low])) for curve in (one, many)]
    level = float(np.nanmean(many[high]) / np.nanmean(one[high]))
    rows.append(
        Claim(
            "3b",
            f"at high frequency the threshold of one mode stays relatively low, that of {modes[1]} modes "
            f"keeps rising",
            "low; rising",
            f"from Omega 2-2.5 to 3.5-4: one mode by {rise[0]:.2f}, {modes[1]} modes by {rise[1]:.2f}; "
            f"there {level:.2f} "
            "times as high with many modes",
            f"{step / float(np.nanmean(one[high])):.2f} (a step of V over the lower threshold)",
            "holds"
            if rise[1] > 1.05 and rise[1] > rise[0] and level > 1.5
            else "in part"
            if level > 1.5
            else "fails",
            "Ratio of the mean thresholds over the two ranges; holds if many modes rise by more than 5 % "
            "and more than one "
            "mode, and are 1.5 times as high.",
        )
    )
    return rows


def long_runs(results: Results) -> list[Claim]:
    """Claim 4."""
    long, short = results["fig7"], results["fig6"]
    one, many = (ds.response.values for ds in long.values())
    first = next(iter(long.values()))
    cycles, before = int(first.attrs["cycles"]), int(next(iter(short.values())).attrs["cycles"])
    relative = first.velocity_amplitude.values[None, :] / first.frequency_ratio.values[:, None]
    spread = _share_spread(results)
    high = relative >= float(sb.quasi_static_threshold(LOCATION, 1.0))
    settled = class_share(many, ResponseClass.TRANSIENT_2, high)
    half = (relative >= 0.5) & is_interwell(many)
    continuous = class_share(one, ResponseClass.CONTINUOUS, is_interwell(one))
    back = class_share(one, ResponseClass.TRANSIENT_1, is_interwell(one))
    changed = [compare_maps(short[name], long[name]).changed for name in long]
    return [
        Claim(
            "4a",
            f"after {cycles} cycles {long_modes(long)} are entirely transient interwell 2 at high V/Omega",
            "all",
            f"{100.0 * settled:.1f} % above V_QS1; "
            f"{100.0 * class_share(many, ResponseClass.TRANSIENT_2, half):.1f} % of "
            "the interwell ones with V/Omega above 0.5",
            f"{100.0 * spread:.1f} % (chaos and step)",
            "holds" if settled > 0.99 else "in part" if settled > 0.9 else "fails",
            "Share of transient interwell 2 among the points with V > V_QS1, the dashed line of Fig. 7; "
            "holds above 99 %.",
            _others(many, high),
        ),
        Claim(
            "4b",
            f"after {cycles} cycles many interwell responses of one mode are continuous",
            "many",
            f"{100.0 * continuous:.1f} % of the interwell ones; {long_modes(long)} "
            f"{100.0 * class_share(many, ResponseClass.CONTINUOUS, is_interwell(many)):.1f} %",
            f"{100.0 * spread:.1f} % (chaos and step)",
            "holds" if continuous > 0.25 else "fails",
            "Share of continuous interwell among the interwell points; many: more than a quarter.",
        ),
        Claim(
            "4c",
            f"after {cycles} cycles transient interwell 1 has all but disappeared with one mode",
            "all but gone",
            f"{100.0 * back:.2f} % of the interwell ones ("
            f"{100.0 * _share_before(short, 0):.2f} % after {before} cycles)",
            f"{100.0 * spread:.1f} % (chaos and step)",
            "holds" if back < 0.01 else "in part" if back < 0.5 * _share_before(short, 0) else "fails",
            "Share of transient interwell 1 among the interwell points; all but gone: below 1 %.",
        ),
        Claim(
            "4d",
            f"many points change class between {before} and {cycles} cycles",
            "many",
            f"{100.0 * changed[0]:.1f} % with one mode, {100.0 * changed[1]:.1f} % with {long_modes(long)}",
            f"{100.0 * spread:.1f} % (chaos and step)",
            "holds" if max(changed) > 0.1 else "fails",
            "Share of the points of another class in Fig. 7 than in Fig. 6; many: more than a tenth.",
        ),
    ]


def long_modes(data: dict[str, xr.Dataset]) -> str:
    """The number of modes of the second map, in words."""
    return f"{int(list(data.values())[1].attrs['modes'])} modes"


def _share_before(data: dict[str, xr.Dataset], which: int) -> float:
    response = list(data.values())[which].response.values
    return class_share(response, ResponseClass.TRANSIENT_1, is_interwell(response))


def _share_spread(results: Results) -> float:
    """How far the share of a class moves with a change of 1e-9 in the drive, or with half the step."""
    data = results["sensitivity"]
    return max(compare_maps(data["base"], data[name]).share for name in ("perturbed", "half_step"))


def _others(response: NDArray[np.int8], where: NDArray[np.bool_]) -> str:
    shares = [(kind, class_share(response, kind, where)) for kind in ResponseClass]
    left = [
        f"{kind.label} {100.0 * share:.1f} %"
        for kind, share in shares
        if share > 0.0 and kind is not ResponseClass.TRANSIENT_2
    ]
    return f"The rest: {', '.join(left)}." if left else ""


def low_frequency(results: Results) -> list[Claim]:
    """Claim 5."""
    data = results["low_frequency"]
    rows = []
    for letter, ds in zip("ab", data.values(), strict=True):
        curve = interwell_threshold(ds, "relative_amplitude")
        ratio = ds.frequency_ratio.values
        step = float(np.diff(ds.relative_amplitude.values).max())
        listed = ", ".join(f"{value:.2f} at {x:g}" for x, value in zip(ratio, curve, strict=True) if x <= 0.2)
        fast = curve[ratio >= 1.0]
        needed = (
            f"; {np.nanmin(fast):.2f} to {np.nanmax(fast):.2f} from Omega 1 to {ratio[-1]:g}"
            if fast.size
            else ""
        )
        close = abs(curve[0] - 1.0) <= 0.05
        rows.append(
            Claim(
                f"5{letter}",
                f"at low frequency the threshold goes to V_QS1, at higher ones far less is needed, N = "
                f"{int(ds.attrs['modes'])}",
                "1; far less",
                f"V/V_QS1 = {listed}{needed}",
                f"{step:.2f} (grid)",
                "holds"
                if close and (not fast.size or np.nanmax(fast) < 0.5)
                else "in part"
                if close
                else "fails",
                "Smallest V/V_QS1 that is interwell after 200 cycles; holds if within 5 % of 1 at the "
                "lowest frequency and "
                "below one half from Omega = 1 on.",
            )
        )
    return rows
