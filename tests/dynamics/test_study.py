"""The study of lifetimes as it is stored: it agrees with the stored maps, with itself, and with what the docs say."""

from __future__ import annotations

import math

import study_table as study


def test_shares_agree_with_the_stored_maps() -> None:
    """Within counting error, at 200 and at 1000 cycles, with one mode and with 32."""
    for modes, figure, cycles, _, _, apart in study.figures():
        assert abs(apart) < 3.0, (modes, figure, cycles)


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


def test_three_measurements_of_sensitivity_agree() -> None:
    """alpha = kappa/lambda, each measured by itself."""
    found = study.sensitivity()
    (ratio, ratio_error), (alpha, alpha_error) = found["ratio"], found["alpha"]
    assert abs(ratio - alpha) < 2.5 * math.hypot(ratio_error, alpha_error)
    assert ratio_error < 0.1 * ratio and alpha_error < 0.1 * alpha


def test_the_documentation_says_what_is_stored() -> None:
    """Made again by ``python tests/dynamics/study_table.py``."""
    assert study.FILE.read_text(encoding="utf-8") == study.text()
