"""The figure of a force-displacement curve."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.util.validation import InputError

BEAM = sb.Beam(length=5e-4, thickness=2e-6, width=2e-5, density=2330.0, young_modulus=160e9, axial_load=0.0)


def test_branches_units_and_snaps() -> None:
    model = sb.ReducedModel.from_beam(BEAM, modes=3, imperfection=sb.Imperfection(midspan_amplitude=6e-6))
    curve = sb.force_displacement(model, 0.5)
    ax = sb.plot.plot_force_displacement(curve)
    assert "µm" in ax.get_xlabel()
    assert "µN" in ax.get_ylabel()
    texts = [each.get_text() for each in ax.texts]
    assert any(each.startswith("snap-through \N{MINUS SIGN}37") for each in texts)
    legend = [each.get_text() for each in ax.figure.legends[0].get_texts()]
    assert legend == ["stable", "stable under displacement control only", "unstable", "bifurcation point"]
    low, high = ax.get_ylim()
    assert low < 1e6 * float(curve.snap_through_force) < 1e6 * float(curve.snap_back_force) < high
    stable = [line for line in ax.lines if line.get_color() == "#16245E"]
    assert len(stable) == 2
    drawn = np.concatenate([line.get_ydata() for line in stable])
    assert np.isfinite(drawn).all()
    with pytest.raises(InputError, match="no force-displacement curve among"):
        sb.plot.plot_force_displacement(xr.Dataset({"force": 0.0}))


def test_critical_points_are_seen_on_the_triangles() -> None:
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1)  # both limit points are the snaps
    ax = sb.plot.plot_force_displacement(sb.force_displacement(model, 0.5))
    (points,) = [line for line in ax.lines if line.get_label() == "limit point"]
    triangles = [line for line in ax.lines if str(line.get_marker()) in "^v"]
    places = np.array([line.get_xydata()[0] for line in triangles])
    np.testing.assert_allclose(np.sort(points.get_xydata(), axis=0), np.sort(places, axis=0), rtol=1e-6)
    for line in triangles:
        assert line.get_zorder() < points.get_zorder() and line.get_markersize() > 2.0 * points.get_markersize()
