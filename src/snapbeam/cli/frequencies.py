"""``snapbeam frequencies``: natural frequencies of the beam, reduced and exact, buckled and straight."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from snapbeam.cli import parameter_options as opt
from snapbeam.cli.console import add_json, cli_command, out
from snapbeam.cli.parameter_options import BEAM, BOUNDARY, IMPERFECTION, MODEL, configured, with_parameters
from snapbeam.model.quantity import numbered
from snapbeam.util.validation import integer

if TYPE_CHECKING:
    from snapbeam.model.parameter_file import Config
    from snapbeam.model.potential import Potential


@cli_command
@with_parameters(*BEAM, *BOUNDARY, *IMPERFECTION, *MODEL)
def frequencies(
    given: Any, count: Annotated[int, opt.count_option("Number of frequencies to print (10).", "Output")] = 10
) -> None:
    """Print the natural frequencies about the equilibrium: reduced, exact, and without load.

    The exact ones solve the eigenvalue problem of the buckled beam (Nayfeh, Kreider and Anderson 1995);
    the error of the reduced model is relative to them.  They are of a perfect beam: with an imperfection the command prints
    the frequencies of the reduced model about each well.  With harvesters it prints those with open and with shorted loads too.
    """
    from rich.table import Table

    from snapbeam.model.modal_convergence import modal_error
    from snapbeam.model.natural_frequencies import exact_natural_frequencies
    from snapbeam.util.si_prefixes import prefixed

    count = integer("count", count, 1, 200)
    settings = configured(given)
    potential = settings.potential
    model = potential.model
    beam = model.beam
    if beam is None or model.imperfection is not None or not potential.is_of_the_structure_alone:
        _print_wells(potential, count, modal_error(settings.static_system))
        _print_circuits(settings, count)
        return
    reduced = model.natural_frequencies
    exact = exact_natural_frequencies(beam, count=count)
    straight = exact_natural_frequencies(beam.replace(axial_load=0.0), count=count)
    state = f"buckled by b = {prefixed(beam.buckling_level, 'm', 4)}" if beam.is_buckled else "not buckled"
    add_json(
        axial_load=beam.axial_load, critical_load=beam.critical_load, buckling_level=beam.buckling_level,
        modes=model.modes, reduced=reduced[:count], exact=exact, without_load=straight,
    )  # fmt: skip
    console = out()
    load = f"P = {prefixed(beam.axial_load, 'N', 4)}, P_cr = {prefixed(beam.critical_load, 'N', 4)}"
    console.print(f"{load}: {state}; {model.modes} modes")
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
    _print_circuits(settings, count)


def modal_error_text(quantity: str, error: float, modes: int) -> str:
    """Sentence with the estimated error of a quantity by the number of modes."""
    from snapbeam.model.modal_convergence import AUTO_ERROR

    advice = "; use more modes, or --modes auto" if error > AUTO_ERROR else ""
    return f"{quantity}: estimated error of {modes} modes {100.0 * error:.2g} %{advice}"


def _print_circuits(settings: Config, count: int) -> None:
    """Print the frequencies about each well with open and with shorted loads, of a system with harvesters."""
    from rich.table import Table

    if not any(numbered(name)[0] == "harvester" for name in settings.given):
        return
    system = settings.system
    found = [[each[:count] for each in system.circuit_frequencies(well)] for well in system.potential.wells]
    names = system.potential.well_names
    add_json(circuits={name: {"open": own[0], "short": own[1]} for name, own in zip(names, found, strict=True)})
    table = Table(box=None, pad_edge=False)
    for title in ("", *(f"{name}, {state} (Hz)" for name in names for state in ("load open", "shorted"))):
        table.add_column(title, justify="right")
    for at in range(found[0][0].size):
        table.add_row(str(at + 1), *(f"{each[at]:.3f}" for own in found for each in own))
    out().print(table)


def _print_wells(potential: Potential, count: int, error: float) -> None:
    """Print the frequencies about each well of a beam with an imperfection or a force, for which no exact ones are known."""
    from rich.table import Table

    model, names = potential.model, potential.well_names
    freq = np.array([potential.natural_frequencies(well)[:count] for well in potential.wells])
    heights = [potential.center(well) for well in potential.wells]
    add_json(
        modes=model.modes, modal_error=error, bistable=len(names) > 1, wells=names, centers=heights, reduced=freq,
        reference_well=model.reference_well, reference_frequency=model.reference_frequency,
    )  # fmt: skip
    console = out()
    console.print(f"{model.modes} modes, reduced model; exact frequencies are of perfect beams without forces only")
    for line in potential.force_texts:
        console.print(line)
    table = Table(box=None, pad_edge=False)
    for title in ("", *(f"{name}, centre at {1e6 * at:.4g} µm (Hz)" for name, at in zip(names, heights, strict=True))):
        table.add_column(title, justify="right")
    for at in range(freq.shape[1]):
        table.add_row(str(at + 1), *(f"{row[at]:.3f}" for row in freq))
    console.print(table)
    console.print(model.reference_text)
    if error == error:
        console.print(modal_error_text("frequencies", error, model.modes))
