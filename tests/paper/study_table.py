"""What the stored study of lifetimes says, each number with its uncertainty, for the documentation.

``python tests/paper/study_table.py`` reads docs/data/lifetimes.nc, fig6.nc and fig7.nc and writes
docs/data/lifetimes.md.
"""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np
import study_claims
import xarray as xr
from scipy import stats

import snapbeam as sb
from snapbeam.util.proportions import proportion

DATA = Path(__file__).parents[2] / "docs" / "data"
FILE = DATA / "lifetimes.md"
MODES = (1, 2, 4, 8, 32)
EARLIER = (32.0, 46.0, 89.0, 99.0)
"""Lifetimes in cycles at the four points, measured before with some 210 starts each."""
MANY = 0.5


@cache
def stored(name: str) -> dict[str, xr.Dataset]:
    """The datasets of a stored file by name."""
    with xr.open_datatree(DATA / f"{name}.nc", engine="h5netcdf") as tree:
        return {key: node.to_dataset().load() for key, node in tree.children.items()}


def plane(ds: xr.Dataset, cycles: int) -> tuple[float, float]:
    """Share of the runs of the plane that snap after so many cycles, and its counting error."""
    share = (np.nan_to_num(ds["last_snap"].values) > cycles).mean(axis=-1)
    runs = ds.sizes["start"]
    return float(share.mean()), float(np.sqrt((share * (1.0 - share) / runs).sum()) / share.size)


def against(ds: xr.Dataset, figure: xr.Dataset, cycles: int) -> tuple[float, float, float]:
    """Share still snapping, share of a stored map called continuous at the same points, and by how many standard
    errors of counting they differ."""
    at = {name: ds[name].values for name in ("frequency_ratio", "velocity_amplitude")}
    kind = figure["response_class"].sel(at, method="nearest").transpose(*at).values
    share = (np.nan_to_num(ds["last_snap"].values) > cycles).mean(axis=-1)
    called = kind == sb.ResponseClass.CONTINUOUS
    spread = math.sqrt((share * (1.0 - share) * (1.0 + 1.0 / ds.sizes["start"])).sum())
    return float(share.mean()), float(called.mean()), float((called.sum() - share.sum()) / spread)


@cache
def figures() -> list[tuple[int, str, int, float, float, float]]:
    """Number of modes, figure, cycles, and :func:`against` of each."""
    data, six, seven = stored("lifetimes"), stored("fig6"), stored("fig7")
    rows = []
    for modes in (1, 32):
        name = f"modes_{modes}"
        rows.append((modes, "Fig. 6", 200, *against(data[name], six[name], 200)))
        rows.append((modes, "Fig. 7", 950, *against(data[name], seven[name], 950)))
    return rows


@cache
def sensitivity() -> dict[str, tuple[float, float]]:
    """kappa, lambda (a cycle), their ratio and alpha, each with a standard error."""
    data = stored("lifetimes")
    point = data["points"].isel(point=1)
    kappa = 1.0 / float(point["lifetime"])
    kappa_error = kappa / math.sqrt(float(point["runs_ended"]))
    runs = data["exponents"]
    cycles = runs["periods_snapping"].values.astype(float)
    grown = runs["exponent_snapping"].values[:, 0] * float(runs.attrs["period"]) * cycles
    rate = grown.sum() / cycles.sum()
    count = cycles.size
    rate_error = math.sqrt(((grown - rate * cycles) ** 2).sum() * count / (count - 1)) / cycles.sum()
    table = data["sensitivity"]
    line = stats.linregress(np.log(table["size"].values), np.log(table["changed"].values / table.attrs["points"]))
    ratio = kappa / rate
    return {
        "kappa": (kappa, kappa_error),
        "lambda": (rate, rate_error),
        "ratio": (ratio, ratio * math.hypot(kappa_error / kappa, rate_error / rate)),
        "alpha": (float(line.slope), float(line.stderr)),
    }


def lasting(ds: xr.Dataset) -> str:
    """How many runs of one point snap on, with an interval, and when the others ended."""
    last = np.nan_to_num(ds["last_snap"].values)
    end = ds.attrs["cycles"] - ds.attrs["settling_cycles"]
    still = last > end
    _, low, high = proportion(int(still.sum()), last.size)
    share = f"{int(still.sum())} of {last.size} ({low:.2f} to {high:.2f})"
    return share if still.all() else f"{share}, the others ended within {last[~still].max():.0f} cycles"


def _many(data: dict[str, xr.Dataset]) -> list[str]:
    """The same of 32 modes, once data hold it."""
    if "long_many_standard" not in data:
        return []
    ratio, velocity = (
        float(data["long_many_standard"].attrs[name]) for name in ("frequency_ratio", "velocity_amplitude")
    )
    told = [f"at level {level} {lasting(data[f'long_many_{level}'])}" for level in ("standard", "reference")]
    return ["", f"32 modes at ({ratio:g}, {velocity:g}), 10,000 cycles: still snapping {'; '.join(told)}."]


def rows() -> list[study_claims.Row]:
    """What the study claims."""
    data = stored("lifetimes")
    shares = {modes: plane(data[f"modes_{modes}"], 950) for modes in MODES}
    return study_claims.claims(data, shares, figures(), sensitivity())


def text() -> str:
    """The whole of it."""
    data = stored("lifetimes")
    lines = [
        "| modes | points with snap-through | median lifetime, cycles | still snapping at 200 | at 950 |",
        "|---|---|---|---|---|",
    ]
    for modes in MODES:
        ds = data[f"modes_{modes}"]
        snap = int((ds["runs_never"] < ds.sizes["start"]).sum())
        shares = [plane(ds, cycles) for cycles in (200, 950)]
        told = " | ".join(f"{share:.3f} ± {error:.3f}" for share, error in shares)
        lines.append(
            f"| {modes} | {snap} of {ds['runs_never'].size} | {float(np.nanmedian(ds['lifetime'])):.0f} | {told} |"
        )
    end = data["modes_32"]
    share = (np.nan_to_num(end["last_snap"].values) > 950).mean(axis=-1)
    many = [
        f"({float(end['frequency_ratio'][i]):g}, {float(end['velocity_amplitude'][j]):.2g})"
        for i, j in zip(*np.nonzero(share >= MANY), strict=True)
    ]
    lines += [
        "",
        f"With 32 modes half of the runs or more outlast 950 cycles at (Omega, V) = {', '.join(many)} alone.",
        "",
    ]
    lines += [
        "| (Omega, V), 32 modes | lifetime, cycles | 95 % interval | earlier measurement | still snapping at the end | "
        "end in the second well |",
        "|---|---|---|---|---|---|",
    ]
    points = data["points"]
    for k, earlier in enumerate(EARLIER):
        one = points.isel(point=k)
        where = f"({float(one['frequency_ratio']):g}, {float(one['velocity_amplitude']):g})"
        runs = one.sizes["start"]
        lines.append(
            f"| {where} | {float(one['lifetime']):.1f} | {float(one['lifetime_low']):.1f} to "
            f"{float(one['lifetime_high']):.1f} | {earlier:g} ± {earlier / math.sqrt(210.0):.0f} | "
            f"{int(one['runs_snapping'])} of {runs} | {float(one['end_probability'][1]):.3f} "
            f"({float(one['end_probability_low'][1]):.3f} to {float(one['end_probability_high'][1]):.3f}) |"
        )
    lines += [
        "",
        "| modes | stored map | still snapping after | fraction here | continuous in the map | difference (SE) |",
        "|---|---|---|---|---|---|",
    ]
    for modes, figure, cycles, here, there, off in figures():
        lines.append(f"| {modes} | {figure} | {cycles} cycles | {here:.3f} | {there:.3f} | {off:+.1f} |")
    lines += [
        "",
        "One mode at (1.625, 0.3), 10,000 cycles: still snapping at accuracy level standard "
        f"{lasting(data['long_standard'])}; at level reference {lasting(data['long_reference'])}.",
        *_many(data),
        "",
        "| at (1.625, 0.3), 32 modes | value | from |",
        "|---|---|---|",
    ]
    found = sensitivity()
    sources = {
        "kappa": ("kappa = 1/tau, a cycle", "250 lifetimes"),
        "lambda": ("lambda, a cycle", "tangents of 16 runs while they snap"),
        "ratio": ("kappa/lambda", "the two above"),
        "alpha": ("alpha", "share of 400 ends that change, over eight decades of V"),
    }
    for name, (words, source) in sources.items():
        value, error = found[name]
        lines.append(f"| {words} | {value:.4f} ± {error:.4f} | {source} |")
    lines += ["", *study_claims.table(rows())]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")
