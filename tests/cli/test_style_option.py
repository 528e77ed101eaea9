"""``--style`` in every command that draws: the widths of the style, and those of before in the next command."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

import snapbeam as sb
from snapbeam.cli.app import app


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    beam = sb.Beam(
        length=0.161, thickness=4e-4, width=0.015, density=7850.0, young_modulus=200e9, buckling_level=3.35e-4
    )
    contact = sb.Contact(sb.HertzContact(stiffness=4e8), sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.18))
    system = sb.System(sb.ReducedModel.from_beam(beam, modes=1, damping_ratio=0.02), contacts=[contact])
    path = tmp_path_factory.mktemp("style") / "map.nc"
    sb.write_netcdf(
        sb.sweep(system, {"drive.velocity_amplitude": np.linspace(0.05, 0.2, 3)}, sb.Integration(cycles=3)), path
    )
    return path


@pytest.mark.slow
def test_widths_of_a_figure_are_those_of_the_style(stored, tmp_path) -> None:
    sizes = {}
    for style in ("talk", "ieee", ""):
        file = tmp_path / f"map{style}.png"
        more = ["--style", style] if style else []
        result = CliRunner().invoke(app, ["plot", str(stored), "--variable", "peak_force", "-o", str(file), *more])
        assert result.exit_code == 0, result.output
        with Image.open(file) as image:
            sizes[style] = image.size[0] / image.info["dpi"][0] * 25.4
    assert sizes["talk"] == pytest.approx(130.0, abs=0.5) and sizes["ieee"] == pytest.approx(88.9, abs=0.5)
    assert sizes[""] == pytest.approx(90.0, abs=0.5)
    result = CliRunner().invoke(app, ["plot", str(stored), "-o", str(tmp_path / "x.png"), "--style", "poster"])
    assert result.exit_code == 2 and "style = 'poster': must be one of 'elsevier'" in result.output


@pytest.mark.parametrize("command", ["simulate", "map", "threshold", "probability", "gradient", "design", "equilibria",
                                     "plot", "schematic", "track", "frf", "dynamics hysteresis"])  # fmt: skip
def test_every_command_that_draws_has_it(command: str) -> None:
    result = CliRunner().invoke(app, [*command.split(), "--help-all"])
    assert "--style" in result.output and "--json" in result.output
