"""``snapbeam equilibria``: every equilibrium of the beam, the frequencies about its wells, and the barrier between them."""

from __future__ import annotations

import functools
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from snapbeam.cli import parameter_options as opt
from snapbeam.cli.console import (
    add_json,
    check_pictures,
    cli_command,
    draw_computed,
    file_line,
    out,
    progress,
    write_map,
)
from snapbeam.cli.parameter_options import BEAM, BOUNDARY, IMPERFECTION, MODEL, configured, with_parameters
from snapbeam.util.validation import InputError, choice

if TYPE_CHECKING:
    from snapbeam.model.potential import Potential
    from snapbeam.model.system import System


_OUTCOMES = {
    "unstable": "on an unstable branch",
    "pull-in": "a stable branch ends, pull-in",
    "another well": "a stable branch ends, the beam goes to another well",
}
"""Words for the outcome of a critical point."""


@cli_command
@with_parameters(*BEAM, *BOUNDARY, *IMPERFECTION, *MODEL)
def equilibria(
    given: Any,
    lower_frequency: Annotated[
        float | None, opt.number_option("First frequency measured about the lower well, Hz.", "Identification")
    ] = None,
    upper_frequency: Annotated[
        float | None, opt.number_option("First frequency measured about the upper well, Hz.", "Identification")
    ] = None,
    identify: Annotated[
        str,
        opt.option(
            "Imperfection to identify from them: midspan_amplitude, point_load or uniform_load.",
            "Identification",
            flags="--identify-imperfection",
        ),
    ] = "midspan_amplitude",
    with_force: Annotated[
        bool,
        opt.option(
            "Compute the static force-displacement curve of a point force.",
            "Force-displacement",
            flags="--force-displacement",
        ),
    ] = False,
    location: Annotated[
        float | None, opt.number_option("Location of the force over the length (0.5).", "Force-displacement")
    ] = None,
    well: Annotated[
        str | None,
        opt.option(
            "Well from which the force pushes: lower or upper; the as-fabricated one by default.", "Force-displacement"
        ),
    ] = None,
    over: Annotated[
        str | None,
        opt.option(
            "Follow the equilibria over a parameter: force.voltage=0:40, beam.buckling_level=0.1mm:0.5mm.",
            "Branches over a parameter",
            "NAME=START:STOP",
        ),
    ] = None,
    variable: Annotated[
        str | None,
        opt.option(
            "Variable that --plot draws over the parameter: midspan_displacement (default) or natural_frequency.",
            "Branches over a parameter",
            "NAME",
        ),
    ] = None,
    output: Annotated[
        Path | None, opt.option("NetCDF file of the curve or the branches to write.", "Output", "FILE", "--output -o")
    ] = None,
    plot: opt.Plot = None,
) -> None:
    """Print every equilibrium with its stability, the frequencies about the wells, and the barriers.

    If you give both measured frequencies, the command first identifies the buckling level and the imperfection.

    Example: snapbeam equilibria --axial-load 0 --midspan-amplitude 1e-3 --force-displacement --plot curve.png
    """
    from rich.table import Table

    from snapbeam.cli.frequencies import modal_error_text
    from snapbeam.model.imperfection_identification import identify_imperfection
    from snapbeam.model.modal_convergence import modal_error
    from snapbeam.model.potential import Potential
    from snapbeam.model.system import System
    from snapbeam.util.si_prefixes import prefixed, scale_of

    asked = [
        name
        for name, value in (
            ("--location", location),
            ("--well", well),
            *(() if over is not None else (("--output", output), ("--plot", plot))),
        )
        if value is not None
    ]
    if asked and not with_force:
        raise InputError(f"{', '.join(asked)}: belongs to the force-displacement curve; add --force-displacement")
    if variable is not None and (over is None or plot is None):
        raise InputError(f"variable = {variable!r}: names what --plot draws over a parameter; give --over and --plot")
    if with_force and over is not None:
        raise InputError("--over, --force-displacement: give one of the two")
    check_pictures(("plot", plot))
    settings = configured(given)
    settings_potential = potential = settings.potential
    model = potential.model
    if (lower_frequency is None) != (upper_frequency is None):
        raise InputError("lower_frequency, upper_frequency: give both, or neither")
    console = out()
    if lower_frequency is not None and upper_frequency is not None:
        if not potential.is_of_the_structure_alone:
            raise InputError(
                "lower_frequency, upper_frequency with a force: the imperfection is identified from a beam without forces; "
                "leave the force out"
            )
        if model.beam is None:
            raise InputError(
                "lower_frequency, upper_frequency: the imperfection is that of a beam; this model has none"
            )
        model = identify_imperfection(
            model.beam, lower_frequency, upper_frequency, identify, model.modes, model.imperfection
        )
        potential = Potential.of(model, ())
        assert model.beam is not None
        assert model.imperfection is not None
        unit = {"midspan_amplitude": "m", "point_load": "N", "uniform_load": "N/m"}[identify]
        console.print(
            f"buckling_level = {model.beam.buckling_level:.6g} m, imperfection {identify} = "
            f"{getattr(model.imperfection, identify):.6g} {unit}"
        )
    found = potential.equilibria
    heights = [potential.center(each) for each in found]
    metres, length_unit = scale_of(heights, "m")
    joules, energy_unit = scale_of([each.energy for each in found], "J")
    table = Table(box=None, pad_edge=False)
    for title in ("", f"centre ({length_unit})", f"energy ({energy_unit})", "unstable directions"):
        table.add_column(title, justify="right")
    kinds = {0: "well", 1: "saddle"}
    for each, height in zip(found, heights, strict=True):
        kind = kinds.get(each.unstable_directions, "hilltop")
        values = f"{height / metres:.4f}", f"{each.energy / joules:.4f}"
        table.add_row(kind, *values, str(each.unstable_directions))
    console.print(table)
    freq = [potential.natural_frequencies(well)[:3] for well in potential.wells]
    barriers = [potential.barrier(i) for i in range(len(freq))] if len(freq) > 1 else []
    for name, row, barrier in zip_longest(potential.well_names, freq, barriers):
        own = ", ".join(f"{each:.3f}" for each in row)
        console.print(
            f"monostable: {own} Hz" if barrier is None else f"{name}: {own} Hz; barrier {prefixed(barrier, 'J', 4)}"
        )
    if len(freq) < 2 and model.imperfection is not None and potential.is_of_the_structure_alone:
        console.print(model.two_well_limits)
    for line in potential.force_texts:
        console.print(line)
    console.print(model.reference_text)
    same = settings.static_system if potential is settings_potential else System(model=model)
    error = modal_error(same)
    if error == error:
        console.print(modal_error_text("frequencies", error, model.modes))
    add_json(
        modal_error=error,
        bistable=len(freq) > 1,
        buckling_level=None if model.beam is None else model.beam.buckling_level,
        imperfection={} if model.imperfection is None else {
            name: value for name, value in vars(model.imperfection).items() if isinstance(value, (float, str))
        },
        centers=heights,
        energies=[each.energy for each in found],
        unstable_directions=[each.unstable_directions for each in found],
        frequencies=freq,
        barriers=barriers, reference_well=model.reference_well, reference_frequency=model.reference_frequency,
    )  # fmt: skip
    if with_force:
        _force_displacement(same, potential, 0.5 if location is None else location, well, output, plot)
    if over is not None:
        _branches(settings, over, output, plot, variable)


def _branches(settings: Any, over: str, output: Path | None, plot: Path | None, variable: str | None) -> None:
    """Print the critical points over a parameter, and write the branches and their figure."""
    from snapbeam.model.equilibrium_branches import equilibrium_branches
    from snapbeam.model.parameters import lookup
    from snapbeam.util.si_prefixes import prefixed, with_unit

    if variable is not None:
        from snapbeam.plot.force_displacement import BRANCH_FIGURES

        choice("variable", variable, BRANCH_FIGURES)
    name, equals, text = over.partition("=")
    name = settings.full_name(name.strip())
    row = lookup(name).quantity
    if not equals:
        raise InputError(f"over = {over!r}: must be name=start:stop, such as force.voltage=0:40")
    ends = opt.parse_range(name, text, row.unit)
    with progress(None, "equilibrium branches", "equilibria") as report:
        found = equilibrium_branches(settings.static_system, name, ends, progress=report)
    console = out()

    words, shown = row.long_name, functools.partial(with_unit, unit=row.unit)
    columns = ("kind", "value", "displacement", "branch", "outcome")
    for kind, value, place, branch, outcome in zip(
        *(found[f"critical_{each}"].values for each in columns), strict=True
    ):
        console.print(
            f"{kind} point at {words} = {shown(float(value))}, centre at {prefixed(float(place), 'm', 4)}: branch {branch}, "
            f"{_OUTCOMES[str(outcome)]}"
        )
    if not found.sizes["critical_point"]:
        console.print(f"no critical points over {words}")
    for part in range(found.sizes["stable_part"]):
        own = found.isel(stable_part=part)
        stable = zip(
            *(own[f"stable_{each}"].values.tolist() for each in ("value", "frequency", "end_kind")), strict=True
        )
        told = [
            f"{prefixed(hertz if kind == 'none' else 0.0, 'Hz', 4)} at {shown(value)}" for value, hertz, kind in stable
        ]
        console.print(f"stable part {part + 1}: first frequency from {' to '.join(told)}")
        if (own["stable_end_kind"] == "none").all():
            first, last = (prefixed(float(each), "m", 4) for each in own["stable_displacement"].values)
            between = " to ".join(shown(each) for each in own["stable_value"].values)
            console.print(f"the stable branch with the centre at {first} to {last} does not end, {words} = {between}")
    add_json(
        parameter=name,
        critical_values=found["critical_value"].values,
        critical_displacements=found["critical_displacement"].values,
        critical_kinds=[str(each) for each in found["critical_kind"].values],
        critical_branches=found["critical_branch"].values,
        critical_outcomes=[str(each) for each in found["critical_outcome"].values],
        stable_values=found["stable_value"].values,
        stable_displacements=found["stable_displacement"].values,
        stable_frequencies=found["stable_frequency"].values,
        stable_end_kinds=found["stable_end_kind"].values.tolist(),
    )
    _write(found, output, plot, variable)


def _force_displacement(
    system: System, potential: Potential, location: float, well: str | None, output: Path | None, plot: Path | None
) -> None:
    """Print snap-through and snap-back, and write the curve and its figure."""
    from snapbeam.cli.frequencies import modal_error_text
    from snapbeam.model.force_displacement import force_displacement
    from snapbeam.model.modal_convergence import modal_error
    from snapbeam.util.si_prefixes import prefixed

    curve = force_displacement(potential, location, well=well)
    where = f"{location:g} of the length" if system.model.beam is not None else "the contact point"
    console = out()
    console.print(
        f"force at {where}, from the {curve.attrs['well']} well ({curve.attrs['well_chosen_as']}); "
        f"branches: {curve.sizes['branch_number']}, critical points: {curve.sizes['critical_point']}"
    )
    for name, words in (("snap_through", "snap-through"), ("snap_back", "snap-back")):
        force, place = float(curve[f"{name}_force"]), float(curve[f"{name}_displacement"])
        if force == force:
            console.print(
                f"{words}: {prefixed(force, 'N', 4)} at w = {prefixed(place, 'm', 4)} at the force's location "
                f"({curve.attrs[f'{name}_kind']} point)"
            )
        else:
            console.print(f"{words}: none; the stable path does not end")
    error = modal_error(system, lambda each: force_displacement(each, location, well=well)["snap_through_force"])
    if error == error:
        console.print(modal_error_text("snap-through force", error, system.model.modes))
    add_json(
        snap_through_modal_error=error,
        location=location,
        well=curve.attrs["well"],
        snap_through_force=float(curve["snap_through_force"]),
        snap_back_force=float(curve["snap_back_force"]),
        critical_forces=curve["critical_force"].values,
        critical_displacements=curve["critical_displacement"].values,
        critical_kinds=[str(each) for each in curve["critical_kind"].values],
    )
    _write(curve, output, plot)


def _write(dataset: Any, output: Path | None, plot: Path | None, variable: str | None = None) -> None:
    """Write a result and its figure."""
    if output is not None:
        out().print(f"Written: {file_line(write_map(dataset, output))}")
    if plot is not None:
        out().print(f"Written: {file_line(draw_computed(dataset, plot, output, variable))}")
