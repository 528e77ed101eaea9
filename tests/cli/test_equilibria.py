"""``snapbeam equilibria``."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from snapbeam.cli.app import app
from snapbeam.util.netcdf import read_netcdf


def run(*arguments: object):
    return CliRunner().invoke(app, [str(each) for each in arguments])


def test_every_equilibrium() -> None:
    answer = run("equilibria", "--midspan-amplitude", 1e-5, "--modes", 8)
    assert answer.exit_code == 0, answer.output
    assert answer.output.count("well ") >= 1
    assert "lower well:" in answer.output
    assert "barrier" in answer.output
    assert "monostable" in run("equilibria", "--midspan-amplitude", 2e-4, "--modes", 8).output


def test_what_explains_measured_wells() -> None:
    answer = run("equilibria", "--lower-frequency", 81.3, "--upper-frequency", 80.5, "--json", "-")
    assert answer.exit_code == 0, answer.output
    found = json.loads(answer.output)
    assert found["frequencies"][0][0] == pytest.approx(81.3, rel=1e-6)
    assert found["imperfection"]["midspan_amplitude"] == pytest.approx(-1.17e-6, abs=0.01e-6)
    refused = run("equilibria", "--lower-frequency", 81.3)
    assert refused.exit_code != 0
    assert "give both" in refused.output


def test_the_well_that_normalises_is_named() -> None:
    """An arch with two wells: the deepest one, and the one in which a run without a striker begins."""
    silicon = (
        "--length", 5e-4, "--width", 2e-5, "--thickness", 2e-6, "--density", 2330, "--young-modulus", 160e9,
        "--axial-load", 0, "--modes", 3,
    )  # fmt: skip
    bistable = (*silicon, "--midspan-amplitude", 13e-6)
    for command in ("equilibria", "frequencies"):
        text = " ".join(run(command, *bistable).output.split())
        assert "Omega = 1 is 190541.304 Hz, the first frequency about the upper well" in text
        assert "a run without a striker begins in the upper well, as fabricated" in text
        assert json.loads(run(command, *bistable, "--json", "-").stdout)["reference_well"] == "upper"
    assert "centre (µm)" in run("equilibria", *bistable).output
    shallow = run("equilibria", *silicon, "--midspan-amplitude", 6e-6).output
    assert "the first frequency about the equilibrium" in " ".join(shallow.split())
    given = run("equilibria", *bistable, "--reference-frequency", 1e5).output
    assert "Omega = 1 is 100000.000 Hz, as given" in given


@pytest.mark.slow
def test_force_displacement_curve(tmp_path) -> None:
    arch = ("--axial-load", 0, "--midspan-amplitude", 1e-3, "--modes", 3)
    curve, figure = tmp_path / "curve.nc", tmp_path / "curve.png"
    answer = run("equilibria", *arch, "--force-displacement", "-o", curve, "--plot", figure, "--json", "-")
    assert answer.exit_code == 0, answer.output
    found = json.loads(answer.stdout)
    assert found["well"] == "upper"
    assert found["snap_through_force"] == pytest.approx(-1.33, rel=0.01)
    assert set(found["critical_kinds"]) == {"limit", "bifurcation"}
    assert figure.stat().st_size > 10_000
    dataset = read_netcdf(curve, "file")
    assert float(dataset.snap_back_force) == found["snap_back_force"]
    text = run("equilibria", *arch, "--force-displacement").output
    assert "from the upper well (the only equilibrium)" in text
    assert "snap-back: " in text
    refused = run("equilibria", *arch, "--plot", figure)
    assert refused.exit_code != 0
    assert "--force-displacement" in refused.output


@pytest.mark.slow
def test_the_displacement_of_an_eccentric_force_is_named(tmp_path) -> None:
    """Off the centre w is not the displacement of the centre: text, dataset and figure say which it is."""
    import matplotlib.pyplot as plt
    import numpy as np

    import snapbeam as sb
    from snapbeam.model.default_values import BEAM

    arch = ("--axial-load", 0, "--midspan-amplitude", 1e-3, "--modes", 3)
    path = tmp_path / "curve.nc"
    text = run("equilibria", *arch, "--force-displacement", "--location", 0.4, "-o", path).output
    assert " ".join(text.split()).count("at the force's location (") == text.count(" at w = ") == 2
    curve = read_netcdf(path, "file")
    assert all(
        "displacement at the force's location" in curve[name].attrs["long_name"]
        for name in ("displacement", "critical_displacement", "snap_through_displacement", "snap_back_displacement")
    )
    beam = BEAM.replace(axial_load=0.0)
    model = sb.ReducedModel.from_beam(beam, modes=3, imperfection=sb.Imperfection(midspan_amplitude=1e-3))
    amplitude = curve["amplitude"].values
    np.testing.assert_allclose(curve["displacement"], amplitude @ model.shape_at(0.4), rtol=1e-9, atol=1e-15)
    assert np.abs(curve["displacement"].values - amplitude @ model.midspan_shape).max() > 1e-5
    ax = sb.plot.plot_force_displacement(curve)
    assert ax.get_xlabel().startswith("Displacement at the force's location, $w$")
    plt.close("all")
