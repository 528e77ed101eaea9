"""``snapbeam calibrate``: calibrate the beam model with measured frequencies, decays and collisions."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from snapbeam.cli import parameter_options as opt
from snapbeam.cli.console import add_json, cli_command, file_line, out
from snapbeam.cli.parameter_options import configured
from snapbeam.lab.cli import options as lab
from snapbeam.lab.cli.options import option

if TYPE_CHECKING:
    from snapbeam.uncertainty.measurements import ContactTest
    from snapbeam.util.diagnostics import Diagnostic


_FIT = "Fit"
_MEASURED = "Measured (instead of, or beside, the file)"


@cli_command
def calibrate(
    measurements: Annotated[
        Path | None, typer.Argument(help="TOML file with a section [measured].", metavar="[MEASUREMENTS]")
    ] = None,
    straight: Annotated[str | None, option("Natural frequencies without load, Hz.", _MEASURED, "F,F")] = None,
    lower_well: Annotated[
        str | None,
        option(
            "Natural frequencies about the lower well, Hz; suffix s or a: symmetric or antisymmetric (81.3s,159a).",
            _MEASURED, "F,F",
        ),
    ] = None,
    upper_well: Annotated[
        str | None, option("Natural frequencies about the upper well, Hz, in the same form.", _MEASURED, "F,F")
    ] = None,
    damping: Annotated[str | None, option("Damping ratios of free decays.", _MEASURED, "F,F")] = None,
    frequency_se: Annotated[
        float | None, opt.number_option("Standard error of these frequencies, Hz (0.5 %).", _MEASURED)
    ] = None,
    measured_thickness: Annotated[
        float | None, opt.number_option("Thickness by gauge, m, for comparison.", _MEASURED)
    ] = None,
    measured_buckling_level: Annotated[
        float | None, opt.number_option("Buckling level by gauge, m, for comparison.", _MEASURED)
    ] = None,
    impacts: Annotated[
        Path | None,
        option("NetCDF file of tracked impacts on a heavy body, for the contact stiffness.", _MEASURED, "FILE"),
    ] = None,
    effective_mass: Annotated[
        float | None, opt.number_option("Effective mass 1/(1/m1 + 1/m2) of the two bodies of --impacts, kg.", _MEASURED)
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option("--config", "-c", help="TOML file with the parameters of beam and model.", metavar="FILE"),
    ] = None,
    fit: Annotated[
        str | None,
        option(
            "Parameters to fit: thickness, young_modulus, density, length, buckling_level; by default those that the "
            "measurements determine.",
            _FIT, "NAME,NAME",
        ),
    ] = None,
    imperfection: Annotated[
        str | None,
        option(
            "Imperfection, fitted to the first frequencies about both wells: midspan_amplitude, point_load or "
            "uniform_load.",
            _FIT,
        ),
    ] = None,
    modes: Annotated[int | None, opt.count_option("Number N of buckling modes, 1 to 256.", _FIT)] = None,
    output: Annotated[
        Path | None, option("TOML file to write, for snapbeam map --config.", lab.OUTPUT, "FILE", "--output", "-o")
    ] = None,
    plot: opt.Plot = None,
    strict: lab.Strict = False,
) -> None:  # fmt: skip
    """Fit thickness and buckling level to natural frequencies, and report parameters that the data do not determine.

    Parameters that are not fitted come from --config, or from the section [beam] of the measurements, or are the
    paper's.

    Example: snapbeam calibrate --straight 80,221 --lower-well 81.3 --upper-well 80.5 --measured-thickness
    0.44e-3 --measured-buckling-level 0.5e-3 -o beam.toml
    """
    from rich.table import Table

    from snapbeam.lab.calibration import calibrate as fit_beam
    from snapbeam.lab.calibration import with_error
    from snapbeam.model.parameter_file import config_from_mapping, override
    from snapbeam.plot.style import FIGURE_SUFFIXES
    from snapbeam.uncertainty.measurements import Measurements, load_measurements
    from snapbeam.util.diagnostics import refuse
    from snapbeam.util.validation import InputError

    lab.check_files((".toml",), output=output)
    lab.check_files(FIGURE_SUFFIXES, plot=plot)
    settings = configured({"config": config, "model.modes": modes})
    given: dict[str, Any] = {}
    if measurements is not None:
        from_file, sections = load_measurements(measurements)
        given = {name: getattr(from_file, name) for name in from_file.__dataclass_fields__}
        config_from_mapping(sections | {"extends": "paper"}, str(measurements))
        settings = override(settings, sections)
    for name, text in (
        ("straight_frequencies", straight), ("lower_well_frequencies", lower_well), ("upper_well_frequencies", upper_well),
        ("damping_ratio", damping),
    ):  # fmt: skip
        if text is not None:
            text, shapes = _shapes(text)
            if shapes and not name.endswith("well_frequencies"):
                raise InputError(f"{name} = {text!r}: only frequencies about a well carry a shape, s or a")
            if shapes:
                given[name.replace("_frequencies", "_shape")] = shapes
            given[name] = lab.numbers(name, text)
            given[f"{name}_se"] = frequency_se if "freq" in name else None
    for name, value in (("thickness", measured_thickness), ("buckling_level", measured_buckling_level)):
        if value is not None:
            given[name] = value
    told: tuple[Diagnostic, ...] = ()
    if impacts is not None:
        if effective_mass is None:
            raise InputError("effective_mass (--effective-mass): must be given with impacts (--impacts), in kg")
        tests, told = _contact_tests(impacts, effective_mass)
        given["contact"] = (*given.get("contact", ()), *tests)
    if not given:
        raise InputError("measurements: give a TOML file, or frequencies as options; see --help")
    beam = settings.model.beam
    assert beam is not None
    chosen = tuple(name.strip() for name in fit.split(",")) if fit else None
    count = settings.model.modes
    result = fit_beam(Measurements(**given), beam, fit=chosen, modes=count, imperfection=imperfection)
    console = out()
    for name in result.values:
        console.print(f"  {name:<20}{with_error(result, name)}")
    if result.damping_ratio is not None:
        console.print(f"  {'damping_ratio':<20}{result.damping_ratio:.5g} +- {result.damping_ratio_se:.2g}")
    if result.contact_stiffness is not None:
        words = f"{result.contact_stiffness:.4g} +- {result.contact_stiffness_se:.2g} N/m^1.5"
        console.print(f"  {'contact stiffness':<20}{words}")
    table = Table(box=None, pad_edge=False)
    for title in ("", "measured (Hz)", "model (Hz)", "difference (standard errors)"):
        table.add_column(title, justify="right" if title else "left")
    for item in result.residuals:
        measured = f"{item.measured:.4g} +- {item.standard_error:.2g}"
        table.add_row(item.name, measured, f"{item.model:.3f}", f"{item.deviation:+.2f}")
    console.print(table)
    for text in result.remarks:
        console.print(f"- {text}")
    diagnostics = (*told, *result.diagnostics)
    lab.print_diagnostics(console, diagnostics)
    if strict:
        refuse(diagnostics, "calibration")
    if output is not None:
        result.write_config(output)
        console.print(f"Written: {file_line(output)}")
    if plot is not None:
        from snapbeam.lab.plot.calibration import plot_calibration

        lab.save_plot(plot_calibration(result), plot)
    add_json(**result.summary())


def _shapes(text: str) -> tuple[str, tuple[str, ...]]:
    """Frequencies and mode shapes of text such as ``159a,165s``."""
    words = {"s": "symmetric", "a": "antisymmetric"}
    parts = [part.strip() for part in text.split(",")]
    if not any(part[-1:] in words for part in parts):
        return text, ()
    return ",".join(part[:-1] if part[-1:] in words else part for part in parts), tuple(
        words.get(part[-1:], part) for part in parts
    )


def _contact_tests(path: Path, effective_mass: float) -> tuple[tuple[ContactTest, ...], tuple[Diagnostic, ...]]:
    """Contact stiffness from tracked impacts as one test, with its diagnostics."""
    from snapbeam.cli.console import open_result
    from snapbeam.lab.calibration import stiffness_from_impacts
    from snapbeam.lab.tracking.track import contact_onsets
    from snapbeam.uncertainty.measurements import HERTZ_TIME, ContactTest
    from snapbeam.util.validation import InputError

    found = stiffness_from_impacts(contact_onsets(open_result(path)), effective_mass)
    out().print(
        f"  impacts             {found.impacts}, duration with speed to the power {found.exponent:+.2f} +- "
        f"{found.exponent_se:.2f}: {found.stiffness:.3g} +- {found.stiffness_se:.1g} N/m^1.5"
    )
    if any(one.code == "contact.exponent" for one in found.diagnostics):
        raise InputError(f"{path}: {found.diagnostics[0].message}")
    # one collision at 1 m/s that stands for all
    duration = HERTZ_TIME * (1.25 * effective_mass / found.stiffness) ** 0.4
    # a test's error of both its numbers gives 2.69 times itself
    share = max(found.stiffness_se / found.stiffness / 2.69, 1e-6)
    test = ContactTest(closing_speed=1.0, duration=duration, effective_mass=effective_mass, relative_error=share)
    return (test,), found.diagnostics
