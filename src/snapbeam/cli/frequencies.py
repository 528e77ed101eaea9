"""``snapbeam frequencies``: natural frequencies of the beam, reduced and exact, buckled and straight."""

from __future__ import annotations

from typing import Annotated

import typer

from snapbeam.cli import options as opt
from snapbeam.cli.console import door, out

__all__ = ["frequencies"]


@door
def frequencies(
    ctx: typer.Context,
    config: opt.ConfigFile = None,
    count: Annotated[int, opt.count_option("How many to print (10).", "Output")] = 10,
    modes: opt.Modes = None,
    length: opt.Length = None,
    thickness: opt.Thickness = None,
    width: opt.Width = None,
    density: opt.Density = None,
    young_modulus: opt.YoungModulus = None,
    buckling_level: opt.BucklingLevel = None,
    axial_load: opt.AxialLoad = None,
) -> None:
    """Print the natural frequencies about the equilibrium: reduced, exact, and without load.

    The exact ones solve the eigenvalue problem of the buckled beam (Nayfeh, Kreider and Anderson 1995);
    the error of the reduced model is relative to them.
    """
    from rich.table import Table

    from snapbeam import ReducedModel, exact_natural_freq
    from snapbeam.core.validate import integer

    count = integer("count", count, 1, 200)
    settings = opt.configured(ctx.params)
    beam = settings.beam.build()
    model = ReducedModel.from_beam(beam, **settings.model.model_dump())
    reduced = model.natural_freq
    exact = exact_natural_freq(beam, count=count)
    straight = exact_natural_freq(beam.replace(axial_load=0.0), count=count)
    state = f"buckled by b = {1e3 * beam.buckling_level:.4g} mm" if beam.is_buckled else "not buckled"
    console = out()
    load = f"P = {beam.axial_load:.4f} N, P_cr = {beam.critical_load:.4f} N"
    console.print(f"{load}: {state}; {settings.model.modes} modes")
    table = Table(box=None, pad_edge=False)
    for title in ("", "reduced (Hz)", "exact (Hz)", "error (%)", "without load (Hz)"):
        table.add_column(title, justify="right")
    for at in range(count):
        has = at < len(reduced)
        table.add_row(
            str(at + 1),
            f"{reduced[at]:.3f}" if has else "",
            f"{exact[at]:.3f}",
            f"{100.0 * (reduced[at] / exact[at] - 1.0):.4f}" if has else "",
            f"{straight[at]:.3f}",
        )
    console.print(table)
