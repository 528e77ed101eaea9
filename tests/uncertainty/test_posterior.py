"""What is known of a beam after it was measured: the linear answer, coverage, prior, what follows from it, classes."""

from __future__ import annotations

import covering
import numpy as np
import pytest
from small import small_system

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.sweeps.measured_points import MeasuredPoints
from snapbeam.uncertainty.measurements import ContactTest, Measurements
from snapbeam.util.validation import InputError

PRIOR = {"thickness": 0.1, "buckling_level": 0.1}


def measured_of(beam, modes: int = 2, error: float = 0.003, draw=None) -> Measurements:
    """Frequencies of a beam, straight and about its well, with errors of their own if *draw* is given."""
    straight = sb.ReducedModel.from_beam(beam.replace(axial_load=0.0), modes).natural_frequencies
    well = sb.ReducedModel.from_beam(beam, modes).natural_frequencies
    noise = [np.zeros(modes), np.zeros(modes)] if draw is None else draw.standard_normal((2, modes))
    values = [f * (1.0 + error * z) for f, z in zip((straight, well), noise, strict=True)]
    return Measurements(
        straight_frequencies=values[0].tolist(), straight_frequencies_se=(error * straight).tolist(),
        lower_well_frequencies=values[1].tolist(), lower_well_frequencies_se=(error * well).tolist(),
        damping_ratio=[0.005, 0.0052, 0.0048],
        contact=[ContactTest(closing_speed=0.1, duration=5e-4, peak_force=4.0)],
    )  # fmt: skip


@pytest.mark.slow
def test_what_the_data_do_not_say_stays_as_it_was() -> None:
    """Density and modulus come in as a ratio: their product is as uncertain as before."""
    prior = {"young_modulus": 0.05, "density": 0.05}
    found = sb.uncertainty.estimate_posterior(
        measured_of(default_values.BEAM), default_values.BEAM, prior, modes=2, samples=500
    ).resampled(500)
    ratio = np.log(found.values[:, 0] / found.values[:, 1])
    product = np.log(found.values[:, 0] * found.values[:, 1])
    assert ratio.std() < 0.01 and product.std() == pytest.approx(0.05 * np.sqrt(2.0), rel=0.2)


@pytest.mark.slow
def test_intervals_cover() -> None:
    """400 beams from the prior, measured with errors of 2 %: 93 to 97 % of the intervals hold the beam."""
    counted = covering.posterior()
    assert counted.trials == 400 and 0.93 <= counted.all <= 0.97, counted


@pytest.mark.slow
def test_a_search_that_does_not_converge_keeps_its_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    from snapbeam.uncertainty import posterior

    monkeypatch.setattr(posterior, "_EVALUATIONS", 1)
    measured, far = measured_of(default_values.BEAM), default_values.BEAM.replace(thickness=8e-4)
    with pytest.warns(sb.DiagnosticWarning, match="give a beam nearer to the measured one, or a narrower prior"):
        found = sb.uncertainty.estimate_posterior(measured, far, {"thickness": 0.5}, modes=2, samples=200)
    assert found.values.shape == (200, 3) and np.isfinite(found.values).all()
    assert not found.converged and found.is_doubtful and not found.resampled(10).converged
    assert found.to_dataset().attrs["converged"] == 0
    assert "least squares stopped after 1 evaluation" in found.termination_reason
    with pytest.raises(InputError, match=r"stopped after 1 evaluation.*; give a beam nearer"):
        found.interval()
    # the advice works
    nearer = default_values.BEAM.replace(thickness=1.001 * default_values.BEAM.thickness)
    monkeypatch.undo()
    assert sb.uncertainty.estimate_posterior(measured, nearer, {"thickness": 0.1}, modes=2, samples=200).converged


@pytest.mark.slow
def test_what_follows_is_drawn_from_it() -> None:
    found = sb.uncertainty.estimate_posterior(
        measured_of(default_values.BEAM, error=0.02), default_values.BEAM, PRIOR, modes=2, samples=400
    )
    spread = found.uncertainty(of={"velocity_amplitude": sb.uncertainty.Normal(0.02, relative=True)})
    scores = spread.normals(np.arange(2000))
    for j, name in enumerate(found.parameters):
        values = spread.of[name].at(np.zeros(2000), scores[:, j])
        middle, low, _ = found.interval()[name]
        assert np.median(values) == pytest.approx(middle, rel=0.01)
        assert (values < low).mean() == pytest.approx(0.025, abs=0.015)
    held = sb.Integration(cycles=2, threads=1)
    axes = {"velocity_amplitude": [0.02, 0.5]}
    ds = sb.uncertainty.probability_map(small_system(2), axes, spread, 12, integration=held)
    assert (ds["runs"] == 12).all() and float(ds["probability"].sel(outcome="snap")[1]) == 1.0


def test_classes_weigh_samples() -> None:
    """A dot that snapped speaks for the beam that snaps there."""
    values = np.array([[0.8], [1.25]]) * default_values.BEAM.buckling_level
    found = sb.uncertainty.Posterior(("beam.buckling_level",), values, np.array([0.5, 0.5]))
    system = small_system(frequency_ratio=0.02, location=0.4)
    limit = float(sb.model.quasi_static_threshold(0.4, 0.02))
    one = MeasuredPoints(np.array([0.02]), np.array([1.02 * limit]), np.array([0.4]), np.array([2], dtype=np.int8))
    spread = sb.uncertainty.ParameterUncertainty(
        of={"velocity_amplitude": sb.uncertainty.Normal(0.01, relative=True)}, hold_fixed="normalised"
    )
    likelihood = sb.uncertainty.class_likelihood(
        found, system, one, spread, runs=8, integration=sb.Integration(cycles=1)
    )
    assert likelihood.shape == (2,) and (likelihood < 0.0).all()
    np.testing.assert_allclose(found.updated([0.0, np.log(3.0)]).weights, [0.25, 0.75])
    assert found.updated([0.0, 0.0]).is_doubtful
    with pytest.raises(InputError, match="worth"):
        found.interval()


def test_refusals() -> None:
    measured = measured_of(default_values.BEAM)
    with pytest.raises(InputError, match="must be one of"):
        sb.uncertainty.estimate_posterior(measured, default_values.BEAM, {"width": 0.1})
    with pytest.raises(InputError, match="prior"):
        sb.uncertainty.estimate_posterior(measured, default_values.BEAM, {})
    with pytest.raises(InputError, match="straight_frequencies_se"):
        sb.uncertainty.estimate_posterior(Measurements(straight_frequencies=[30.0]), default_values.BEAM, PRIOR)
