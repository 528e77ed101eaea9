"""``snapbeam equilibria``: every equilibrium of the beam, the frequencies about its wells, and the barrier between them."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from snapbeam.cli import parameter_options as opt
from snapbeam.cli.console import answer, door, out
from snapbeam.cli.parameter_options import BEAM, ENDS, IMPERFECTION, MODEL, configured, with_parameters

__all__ = ["equilibria"]


@door
@with_parameters(*BEAM, *ENDS, *IMPERFECTION, *MODEL)
def equilibria(
    given: Any,
    lower_frequencies: Annotated[
        float | None, opt.number_option("First frequency measured about the lower well, Hz.", "Fit")
    ] = None,
    upper_frequencies: Annotated[
        float | None, opt.number_option("First frequency measured about the upper well, Hz.", "Fit")
    ] = None,
    fit: Annotated[
        str,
        typer.Option(
            help="What makes them unequal: rise, point_load or uniform_load.", rich_help_panel="Fit"
        ),
    ] = "rise",
) -> None:
    """Print every equilibrium with its stability, the frequencies about the wells, and the barriers.

    With the two frequencies, the buckling level and the imperfection that explain them are found first.
    """
    from rich.table import Table

    from snapbeam.model.imperfection_identification import identify_imperfection
    from snapbeam.util.validation import InputError

    model = configured(given).model
    assert model.beam is not None
    if (lower_frequencies is None) != (upper_frequencies is None):
        raise InputError("lower_frequencies, upper_frequencies: give both, or neither")
    console = out()
    if lower_frequencies is not None and upper_frequencies is not None:
        model = identify_imperfection(
            model.beam, lower_frequencies, upper_frequencies, fit, model.modes, model.imperfection
        )
        assert model.beam is not None
        assert model.imperfection is not None
        unit = {"rise": "m", "point_load": "N", "uniform_load": "N/m"}[fit]
        console.print(
            f"buckling_level = {model.beam.buckling_level:.6g} m, imperfection {fit} = "
            f"{getattr(model.imperfection, fit):.6g} {unit}"
        )
    beam = model.beam
    assert beam is not None
    heights = [1e3 * float(model.midspan_shape @ each.amplitude) for each in model.equilibria]
    table = Table(box=None, pad_edge=False)
    for title in ("", "centre (mm)", "energy (µJ)", "unstable directions"):
        table.add_column(title, justify="right")
    kinds = {0: "well", 1: "saddle"}
    for each, height in zip(model.equilibria, heights, strict=True):
        row = kinds.get(each.unstable_directions, "hilltop"), f"{height:.4f}", f"{1e6 * each.energy:.4f}"
        table.add_row(*row, str(each.unstable_directions))
    console.print(table)
    freq = model.well_frequencies[:, :3]
    if model.is_bistable:
        barriers = [model.saddle_energy - float(model.potential_energy(well)) for well in model.wells]
        for name, row, barrier in zip(("lower", "upper"), freq, barriers, strict=True):
            own = ", ".join(f"{each:.3f}" for each in row)
            console.print(f"{name} well: {own} Hz; barrier {1e6 * barrier:.4f} µJ")
    else:
        barriers = []
        console.print(f"monostable: {', '.join(f'{each:.3f}' for each in freq[0])} Hz")
    answer(
        bistable=model.is_bistable,
        buckling_level=beam.buckling_level,
        imperfection={} if model.imperfection is None else {
            name: value for name, value in vars(model.imperfection).items() if isinstance(value, (float, str))
        },
        centers=[1e-3 * each for each in heights],
        energies=[each.energy for each in model.equilibria],
        unstable_directions=[each.unstable_directions for each in model.equilibria],
        frequencies=freq if model.is_bistable else freq[:1],
        barriers=barriers,
    )  # fmt: skip
