"""``snapbeam process-tests``: process all tests of a folder to a table, a page and a comparison with a map."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from snapbeam.cli import parameter_options as opt
from snapbeam.cli.console import FAILED, add_json, cli_command, file_line, out
from snapbeam.lab.cli import options as lab
from snapbeam.lab.cli.options import option

_TESTS = "Tests"
_CAMERA = "Camera"


@cli_command
def process_tests(
    folder: Annotated[
        Path, typer.Argument(help="Folder of recordings and vibrometer files.", metavar="FOLDER")
    ],
    table: Annotated[
        Path | None,
        option(
            "Table of tests: test, recording, vibrometer, frequency_hz, velocity_m_s, location; by default, files are "
            "paired by name.",
            _TESTS, "FILE",
        ),
    ] = None,
    settings: Annotated[
        Path | None,
        option("TOML file with the sections [camera], [tracking], [signal] and [test_series].", _TESTS, "FILE"),
    ] = None,
    cycles: Annotated[
        int | None, opt.count_option("Number of cycles for the response class (200).", _TESTS)
    ] = None,
    buckling_level: Annotated[float | None, opt.number_option("Buckling level b, m.", _TESTS)] = None,
    location: Annotated[float | None, opt.number_option("Location of the contact over the length (x_s).", _TESTS)] = None,
    beam_thickness: Annotated[
        float | None, opt.number_option("Thickness of the beam by gauge, m, for a check.", _TESTS)
    ] = None,
    frame_rate: Annotated[float | None, opt.number_option("Frame rate, Hz.", _CAMERA)] = None,
    pixel_size: Annotated[float | None, opt.number_option("Pixel size, m.", _CAMERA)] = None,
    side: Annotated[str | None, option("Side of the beam on which the shaker is.", _CAMERA)] = None,
    units: lab.Units = None,
    sensitivity: lab.Sensitivity = None,
    sampling_frequency: lab.SamplingFreq = None,
    simulated: Annotated[
        Path | None, option("Map to compare the responses with.", lab.OUTPUT, "FILE", "--map")
    ] = None,
    output: Annotated[
        Path | None,
        option("Folder of the results; FOLDER/test_series by default.", lab.OUTPUT, "FOLDER", "--output", "-o"),
    ] = None,
    operator: lab.Operator = None,
    strict: lab.Strict = False,
) -> None:  # fmt: skip
    """Track, align and classify every test of a folder, and write a table.

    The command stores each test when it is finished.  If you repeat the command, it continues with the next test, and
    repeats only tests whose input changed.  A test that cannot be measured has a row with the reason.  With --strict a
    test with any warning counts as failed.

    Example: snapbeam process-tests tests/ --buckling-level 0.331e-3 --location 0.47619 --pixel-size 12e-6 --map
    map.nc
    """
    from snapbeam.lab.batch import PAGE_START, load_settings, run_test_series, write_page
    from snapbeam.lab.waveform_comparison import TOO_SHORT
    from snapbeam.util.files import check_writable

    wanted = load_settings(
        settings,
        {
            "camera": {"frame_rate": frame_rate, "pixel_size": pixel_size},
            "tracking": {
                "buckling_level": buckling_level, "location": location, "beam_thickness": beam_thickness,
                "side": side,
            },
            "signal": {"units": units, "sensitivity": sensitivity, "sampling_frequency": sampling_frequency},
            "test_series": {"cycles": cycles, "operator": operator},
        },
    )  # fmt: skip
    target = folder / "test_series" if output is None else output
    console = out()
    for name, begin in (("tests.png", ""), ("measurements.png", ""), ("tests.html", PAGE_START)):
        if target.is_dir():
            check_writable(target / name, begin=begin)
    results = run_test_series(folder, wanted, target, table=table, strict=strict, progress=_tell)
    spoiled = [result for result in results if result.status == "spoiled"]
    short = [result for result in results if result.status == TOO_SHORT]
    console.print(f"{len(results)} tests, {len(spoiled)} spoiled" + (f", {len(short)} too short" if short else ""))
    import matplotlib

    matplotlib.use("Agg")
    from snapbeam.lab.plot.process_tests import plot_test_series
    from snapbeam.plot.style import save_figure

    files = [target / "tests.csv", save_figure(plot_test_series(results, target / "tests"), target / "tests.png")]
    if simulated is not None and len(spoiled) + len(short) < len(results):
        files.append(_on_map(target, simulated))
    files.append(write_page(target / "tests.html", results, wanted, files[1:]))
    add_json(tests=[asdict(result) for result in results], spoiled=len(spoiled), too_short=len(short), files=files)
    for path in files:
        console.print(f"Written: {file_line(path)}")
    if len(spoiled) == len(results):
        raise typer.Exit(FAILED)


def _tell(done: int, total: int, result: Any) -> None:
    """One line for each test."""
    console = out()
    if result is None:
        console.print(f"{total} tests")
        return
    head = f"[{done}/{total}] {result.test}: "
    if result.status == "measured":
        console.print(
            f"{head}{result.frequency_hz:.5g} Hz, {1e3 * result.velocity_m_s:.4g} mm/s, {result.response_class}",
            markup=False,
        )
    else:
        console.print(f"{head}{result.status}: {result.reason}", markup=False)
    for code, severity, words in result.diagnostics:
        if severity != "info" and words != result.reason:
            console.print(f"    {severity} [{code}] {words}", markup=False)


def _on_map(target: Path, simulated: Path) -> Path:
    """Draw the responses on a map, and print the fraction that agrees."""
    from snapbeam.cli.console import open_result
    from snapbeam.lab.plot.comparison import plot_map_comparison
    from snapbeam.plot.style import save_figure

    dataset = open_result(simulated)
    points, result = lab.map_comparison(dataset, target / "tests.csv")
    if result.used:
        low, high = result.agreement_interval
        out().print(
            f"{100 * result.agreement:.0f} % of {result.used} agree with the map "
            f"(95 %: {100 * low:.0f} to {100 * high:.0f} %)"
        )
    lab.print_notes(result)
    return save_figure(plot_map_comparison(dataset, points, result), target / "measurements.png")
