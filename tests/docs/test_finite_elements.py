"""The worked example of the page on finite element codes, against the package's own beam and exact frequencies."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model.natural_frequencies import exact_natural_frequencies

PAGE = Path(__file__).parents[2] / "docs" / "finite_elements.md"


def test_finite_elements_agree_with_the_beam() -> None:
    scope: dict[str, Any] = {}
    exec(re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.S)[0], scope)
    model = scope["model"]
    beam = sb.Beam(
        young_modulus=scope["young"], density=scope["density"], width=scope["width"], thickness=scope["thickness"],
        length=scope["length"], axial_load=0.0,
    )  # fmt: skip
    exact = np.asarray(exact_natural_frequencies(beam, count=4))
    np.testing.assert_allclose(model.natural_frequencies[:4], exact, rtol=1e-4)  # of 24 elements
    own = sb.ReducedModel.from_beam(beam, modes=16)
    # the static deflection of all elements under a central force, and the tension that goes with it
    force = 5.0
    for_fe = sb.ReducedModel.from_matrices(
        scope["M"], scope["K"], contact_shape=scope["contact"], nonlinear_stiffness=model.nonlinear_stiffness,
        elongation_matrix=scope["G"], transverse_force=force * scope["contact"],
    )  # fmt: skip
    loaded = sb.ReducedModel.from_beam(beam, modes=64, imperfection=sb.Imperfection(point_load=force))
    height = float(loaded.midspan_shape @ loaded.well_amplitude)
    assert height > 2.0 * beam.thickness  # stiffened by its tension
    assert float(for_fe.midspan_shape @ for_fe.well_amplitude) == pytest.approx(height, rel=2e-4)
    # the share of the base's motion that each mode takes
    np.testing.assert_allclose(
        (model.mass @ model.base_shape)[0] ** 2, (own.linear_modes.T @ inertial_row(own))[0] ** 2, rtol=2e-3
    )


def inertial_row(model: sb.ReducedModel) -> np.ndarray:
    """The inertial row of the package's own beam."""
    from snapbeam.model.base_excitation import rigid_mass

    return rigid_mass(model)
