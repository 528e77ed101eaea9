"""``snapbeam equilibria``: every equilibrium of the beam, the frequencies about its wells, and the barrier between them."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from snapbeam.cli import parameter_options as opt
from snapbeam.cli.console import add_json, cli_command, out
from snapbeam.cli.parameter_options import BEAM, BOUNDARY, IMPERFECTION, MODEL, configured, with_parameters

__all__ = ["equilibria"]


@cli_command
@with_parameters(*BEAM, *BOUNDARY, *IMPERFECTION, *MODEL)
def equilibria(
    given: Any,
    lower_frequency: Annotated[
        float | None,
        opt.number_option("First frequency measured about the lower well, Hz.", "Identification"),
    ] = None,
    upper_frequency: Annotated[
        float | None,
        opt.number_option("First frequency measured about the upper well, Hz.", "Identification"),
    ] = None,
    identify: Annotated[
        str,
        typer.Option(
            "--identify-imperfection",
            help="Imperfection to identify from them: midspan_amplitude, point_load or uniform_load.",
            rich_help_panel="Identification",
        ),
    ] = "midspan_amplitude",
) -> None:
    """Print every equilibrium with its stability, the frequencies about the wells, and the barriers.

    If you give both measured frequencies, the command first identifies the buckling level and the imperfection.
    """
    from rich.table import Table

    from snapbeam.model.imperfection_identification import identify_imperfection
    from snapbeam.util.validation import InputError

    model = configured(given).model
    assert model.beam is not None
    if (lower_frequency is None) != (upper_frequency is None):
        raise InputError("lower_frequency, upper_frequency: give both, or neither")
    console = out()
    if lower_frequency is not None and upper_frequency is not None:
        model = identify_imperfection(
            model.beam, lower_frequency, upper_frequency, identify, model.modes, model.imperfection
        )
        assert model.beam is not None
        assert model.imperfection is not None
        unit = {"midspan_amplitude": "m", "point_load": "N", "uniform_load": "N/m"}[identify]
        console.print(
            f"buckling_level = {model.beam.buckling_level:.6g} m, imperfection {identify} = "
            f"{getattr(model.imperfection, identify):.6g} {unit}"
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
        if model.imperfection is not None:
            console.print(model.two_well_limits)
    add_json(
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
