"""The posterior of a beam from measured frequencies, against its calibration by least squares."""

import pytest

import snapbeam as sb
from snapbeam.lab.calibration import calibrate
from snapbeam.model.default_values import BEAM
from snapbeam.uncertainty.measurements import ContactTest, Measurements


@pytest.mark.slow
def test_the_posterior_is_that_of_the_linear_fit() -> None:
    """Small errors: medians and widths agree with those of least squares."""
    straight = sb.ReducedModel.from_beam(BEAM.replace(axial_load=0.0), 2).natural_frequencies
    well = sb.ReducedModel.from_beam(BEAM, 2).natural_frequencies
    measured = Measurements(
        straight_frequencies=straight.tolist(), straight_frequencies_se=(0.003 * straight).tolist(),
        lower_well_frequencies=well.tolist(), lower_well_frequencies_se=(0.003 * well).tolist(),
        damping_ratio=[0.005, 0.0052, 0.0048],
        contact=[ContactTest(closing_speed=0.1, duration=5e-4, peak_force=4.0)],
    )  # fmt: skip
    found = sb.uncertainty.estimate_posterior(
        measured, BEAM, {"thickness": 0.1, "buckling_level": 0.1}, modes=2, samples=400
    )
    fit = calibrate(measured, BEAM, modes=2)
    assert found.effective_sample_size > 200.0 and not found.is_doubtful
    for name in ("thickness", "buckling_level"):
        middle, low, high = found.interval()[f"beam.{name}"]
        assert middle == pytest.approx(getattr(BEAM, name), rel=2e-3)
        assert low < getattr(BEAM, name) < high
        assert high - low == pytest.approx(3.92 * fit.standard_errors[name], rel=0.25)
    damping = found.interval()["model.damping_ratio"]
    assert damping[1] < 0.005 < damping[2]
