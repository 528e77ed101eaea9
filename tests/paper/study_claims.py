"""What the study of lifetimes claims, each by a rule that could fail, with 95 % uncertainties."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import xarray as xr

from snapbeam.paper.claims.claim_result import Check, ClaimResult, Quantity, above, below, found
from snapbeam.util.proportions import proportion

__all__ = ["Row", "claims", "table"]

_WIDE = 1.96
"""Standard errors of a half width: 95 %."""
_EARLY = 200.0


class Row(NamedTuple):
    """A claim of the study."""

    says: str
    measured: str
    rule: str
    fails: str
    result: ClaimResult


def _all(*checks: Check) -> Check:
    whole = Check(True, True, True)
    for check in checks:
        whole = whole & check
    return whole


def _share(hits: int, runs: int) -> Quantity:
    """With the greater half of Wilson's interval of 95 %."""
    value, low, high = (float(part) for part in proportion(hits, runs))
    return Quantity(value, max(high - value, value - low))


def _told(value: Quantity, form: str = ".3f") -> str:
    return f"{value.value:{form}} ± {value.uncertainty:{form}}"


def _ends(points: xr.Dataset) -> Row:
    """Snapping ends, at a rate."""
    runs = points.sizes["start"]
    each_point = [points.isel(point=k) for k in range(points.sizes["point"])]
    left = [_share(int(one["runs_snapping"]), runs) for one in each_point]
    tau = [
        Quantity(float(one["lifetime"]), 0.5 * float(one["lifetime_high"] - one["lifetime_low"])) for one in each_point
    ]
    ended = _all(*(below(each, 0.05) for each in left))
    short = _all(*(below(each, 200.0) for each in tau))
    told = ", ".join(_told(each, ".0f") for each in tau)
    return Row(
        "With 32 modes continuous snapping is a transient that ends within a thousand cycles.",
        f"lifetimes of {told} cycles at the four points; still snapping at the end: at most {left[0].uncertainty:.1%}",
        "At each of the four points fewer than 5 % still snap at the end and the lifetime is below 200 cycles; in part "
        "if that is so of the lifetimes alone.",
        "a point whose runs go on.",
        found(ended & short, short, longest=max(tau), left=max(left, key=lambda each: each.value)),
    )


def _far(points: xr.Dataset) -> Row:
    """It ends in the far well."""
    runs = int(points.sizes["start"] * points.sizes["point"])
    share = points["end_probability"].sel(well="other")
    value = _share(round(float(share.sum()) * points.sizes["start"]), runs)
    return Row(
        "It ends in the far well.",
        f"{_told(value)} of {runs} runs",
        "Share of the runs of the four points that end in the well opposite to the first. Holds above 95 %, in part "
        "above one half.",
        "as many ends in the first.",
        found(above(value, 0.95), above(value, 0.5), share=value),
    )


def _more_modes(shares: Mapping[int, tuple[float, float]]) -> Row:
    """More modes, shorter lives."""
    one, many = shares[1], shares[32]
    fall = Quantity(one[0] - many[0], _WIDE * math.hypot(one[1], many[1]))
    four = Quantity(one[0] - shares[4][0], _WIDE * math.hypot(one[1], shares[4][1]))
    return Row(
        "More modes make snapping end sooner: what one mode has for ever, four have not.",
        f"share of the plane that still snaps at 950 cycles: {_told(fall)} less with 32 modes than with one, "
        f"{_told(four)} less with 4",
        "Both differences are above 0.1; in part if both are above 0.",
        "as much continuous response with many modes as with one.",
        found(above(fall, 0.1) & above(four, 0.1), above(fall, 0.0) & above(four, 0.0), fall=fall, four=four),
    )


def _attractor(data: Mapping[str, xr.Dataset]) -> Row:
    """An attractor beside a transient."""
    shares, gaps = [], []
    for level in ("standard", "reference"):
        ds = data[f"long_{level}"]
        last = np.nan_to_num(ds["last_snap"].values)
        on = last > float(ds.attrs["cycles"]) - float(ds.attrs["settling_cycles"])
        shares.append(_share(int(on.sum()), last.size))
        gaps.append(float(last[~on].max(initial=0.0)))
    both = _all(*(above(each, 0.0) & below(each, 1.0 - 1e-9) for each in shares))
    late = max(gaps)
    return Row(
        "One mode at (1.625, 0.3) has an attractor beside a transient, at both accuracy levels.",
        f"{_told(shares[0], '.2f')} still snap at 10,000 cycles at level standard, {_told(shares[1], '.2f')} at reference; "
        f"the last of the others ended at {late:.0f}",
        f"At both levels some still snap at 10,000 cycles, some ended, and none ended between {_EARLY:.0f} and that; "
        "in part if one ended late.",
        "all of them ending, or going on ending.",
        found(both & below(late, _EARLY), both, map=shares[0], reference=shares[1]),
    )


def _maps(rows: list[tuple[int, str, int, float, float, float]]) -> Row:
    """What Figs. 6 and 7 show."""
    worst = max(rows, key=lambda row: abs(row[5]))
    apart = _all(*(below(abs(row[5]), _WIDE) for row in rows))
    near = _all(*(below(abs(row[5]), 3.0) for row in rows))
    off = Quantity(abs(worst[5]), 1.0)
    return Row(
        "What Figs. 6 and 7 call continuous is how many runs still snap when one looks.",
        f"shares of the stored maps and of the lifetimes differ by at most {abs(worst[5]):.1f} standard errors "
        f"({worst[1]}, {worst[0]} modes)",
        "All four differ by less than 1.96 standard errors of counting; in part if by less than 3.",
        "a map that calls more continuous than still snaps.",
        found(apart, near, apart=off),
    )


def _alpha(values: Mapping[str, tuple[float, float]]) -> Row:
    """Three measurements that check one another."""
    (ratio, ratio_error), (alpha, alpha_error) = values["ratio"], values["alpha"]
    off = Quantity(ratio - alpha, _WIDE * math.hypot(ratio_error, alpha_error))
    same = abs(off.value) <= off.uncertainty
    known = off.uncertainty < 0.5 * alpha
    return Row(
        "The sensitivity of the end is that of a chaotic transient: alpha = kappa/lambda.",
        f"kappa/lambda - alpha = {off.value:+.4f} ± {off.uncertainty:.4f}, of alpha = {alpha:.4f}",
        "Zero is within the interval, which is narrower than half of alpha; in part if it is wider.",
        "an interval that leaves zero out.",
        found(Check(same and known, same and known, same and known), Check(same, same, same), difference=off),
    )


def claims(
    data: Mapping[str, xr.Dataset],
    shares: Mapping[int, tuple[float, float]],
    figures: list[tuple[int, str, int, float, float, float]],
    sensitivity: Mapping[str, tuple[float, float]],
) -> list[Row]:
    """All of them, from the stored data and what :mod:`study_table` reads off them."""
    points = data["points"]
    return [
        _ends(points), _far(points), _more_modes(shares), _attractor(data), _maps(figures), _alpha(sensitivity),
    ]  # fmt: skip


def table(rows: list[Row]) -> list[str]:
    """Lines of Markdown."""
    lines = ["| # | claim | measured, 95 % | rule | fails with | verdict |", "|---|---|---|---|---|---|"]
    for number, row in enumerate(rows, start=1):
        verdict = f"**{row.result.verdict}**" + (" †" if row.result.close else "")
        lines.append(f"| T{number} | {row.says} | {row.measured} | {row.rule} | {row.fails} | {verdict} |")
    return lines
