"""The study of lifetimes as it is stored: it agrees with the stored maps, with itself, and with what the docs say."""

from __future__ import annotations

import math

import pytest
import study_claims
import study_table as study


@pytest.mark.slow
def test_shares_agree_with_the_stored_maps() -> None:
    """Within counting error, at 200 and at 1000 cycles, with one mode and with 32."""
    for modes, figure, cycles, _, _, apart in study.figures():
        assert abs(apart) < 3.0, (modes, figure, cycles)


@pytest.mark.slow
def test_the_four_points_come_again() -> None:
    """Each within its own interval and that of some 210 runs measured before; all runs ended in the far well."""
    points = study.stored("lifetimes")["points"]
    for k, earlier in enumerate(study.EARLIER):
        one = points.isel(point=k)
        spread = 1.96 * earlier / math.sqrt(210.0)
        assert float(one["lifetime_low"]) < earlier + spread
        assert float(one["lifetime_high"]) > earlier - spread
        assert int(one["runs_snapping"]) == 0
        assert float(one["end_probability"].sel(well="other")) == 1.0


@pytest.mark.slow
def test_three_measurements_of_sensitivity_agree() -> None:
    """alpha = kappa/lambda, each measured by itself."""
    found = study.sensitivity()
    (ratio, ratio_error), (alpha, alpha_error) = found["ratio"], found["alpha"]
    assert abs(ratio - alpha) < 2.5 * math.hypot(ratio_error, alpha_error)
    assert ratio_error < 0.1 * ratio and alpha_error < 0.1 * alpha


def test_the_documentation_says_what_is_stored() -> None:
    """Made again by ``python tests/paper/study_table.py``."""
    assert study.FILE.read_text(encoding="utf-8") == study.text()


def test_claims_hold_by_rules_that_could_fail() -> None:
    """No claim fails, each has an uncertainty, and data that say otherwise make it fail."""
    claims = study.rows()
    assert len(claims) >= 6
    for row in claims:
        assert row.result.verdict in ("holds", "in part"), row.says
        assert all(quantity.uncertainty > 0.0 for quantity in row.result.quantities.values())
    data = study.stored("lifetimes")
    shares = {modes: (0.4, 0.01) for modes in study.MODES}
    odd = [(1, "Fig. 6", 200, 0.5, 0.9, 8.0)]
    apart = {"ratio": (0.05, 0.001), "alpha": (0.02, 0.001)}
    points = data["points"].copy(deep=True)
    points["runs_snapping"][:], points["end_probability"][:], points["lifetime"][:] = 200, 0.1, 900.0
    endless = {f"long_{level}": data[f"long_{level}"].copy(deep=True) for level in ("standard", "reference")}
    for ds in endless.values():
        ds["last_snap"][:] = 10_000.0
    verdicts = [row.result.verdict for row in study_claims.claims({"points": points} | endless, shares, odd, apart)]
    assert verdicts == ["fails"] * 6
