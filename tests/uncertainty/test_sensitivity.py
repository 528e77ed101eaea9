"""Sensitivity: Ishigami's indices within their intervals, coverage, and which parameter of a beam matters."""

from __future__ import annotations

import covering
import numpy as np
import pytest
from small import small_system

import snapbeam as sb
from snapbeam.uncertainty.sensitivity_analysis import first_order
from snapbeam.util.validation import InputError

A, B = 7.0, 0.1
VARIANCE = A**2 / 8.0 + B * np.pi**4 / 5.0 + B**2 * np.pi**8 / 18.0 + 0.5
FIRST = np.array([0.5 * (1.0 + B * np.pi**4 / 5.0) ** 2, A**2 / 8.0, 0.0]) / VARIANCE
SHARED = 8.0 * B**2 * np.pi**8 / 225.0 / VARIANCE
TOTAL = FIRST + np.array([SHARED, 0.0, SHARED])


def ishigami(ranks):
    x = np.pi * (2.0 * ranks - 1.0)
    return np.sin(x[0]) + A * np.sin(x[1]) ** 2 + B * x[2] ** 4 * np.sin(x[0])


def test_ishigami() -> None:
    """0.314, 0.442 and 0, within the intervals of both estimates; at 99 %, since there are nine of them."""
    np.testing.assert_allclose(FIRST, [0.314, 0.442, 0.0], atol=5e-4)
    found = sb.uncertainty.sobol_indices(ishigami, 3, 2048, confidence=0.99)
    for indices, truth in ((found.first, FIRST), (found.total, TOTAL)):
        assert (indices.low <= truth).all() and (truth <= indices.high).all()
        assert (indices.high - indices.low < 0.2).all()
    ranks = np.random.default_rng(4).random((4000, 3))
    given = first_order(ranks, ishigami(ranks.T), 0.99, 0)
    assert (given.low <= FIRST).all() and (FIRST <= given.high).all()
    assert (given.high - given.low < 0.2).all()


def test_the_default_split_has_less_than_half_the_error_of_many_short_sequences() -> None:
    """At 4096 points of a matrix: four sequences have a median error of 1.8e-3, sixteen one of 4.7e-3."""
    truth = np.concatenate([FIRST, TOTAL])

    def error(samples: int, **split: int) -> float:
        found = [sb.uncertainty.sobol_indices(ishigami, 3, samples, rng=seed, **split) for seed in range(30)]
        assert {each.runs for each in found} == {5 * 4096}
        return float(
            np.median([np.abs(np.concatenate([each.first.estimate, each.total.estimate]) - truth) for each in found])
        )

    assert error(1024) < 0.5 * error(256, replicates=16)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["sobol", "given"])
def test_intervals_cover(kind: str) -> None:
    """93 to 97 % of 400 trials, over the indices."""
    counted = covering.KINDS[kind][1]()
    assert counted.trials == 400 and 0.93 <= counted.all <= 0.97, counted
    assert min(counted.shares.values()) > 0.92, counted


def test_correlated_inputs_are_no_trouble_for_given_data() -> None:
    """y = x1 with x2 correlated by 0.8: the first has all of the variance, the second 0.64 of it."""
    generator = np.random.default_rng(3)
    x = generator.multivariate_normal([0.0, 0.0], [[1.0, 0.8], [0.8, 1.0]], 6000)
    found = first_order(x, x[:, 0], 0.95, 0)
    np.testing.assert_allclose(found.estimate, [1.0, 0.64], atol=0.05)


def test_the_quasi_static_threshold_moves_with_the_location() -> None:
    """At Omega = 0.02 V_QS1 = Omega sin^2(pi x_s): the derivative is known, and damping has no part in it."""
    system = small_system(frequency_ratio=0.02, location=0.3)
    of = {"location": sb.uncertainty.Normal(0.005), "model.damping_ratio": sb.uncertainty.LogNormal(0.1)}
    answer = sb.uncertainty.ThresholdQoI(bounds=(0.005, 0.02), values=9, halvings=6)
    ds = sb.uncertainty.sensitivity(
        system,
        answer,
        sb.uncertainty.ParameterUncertainty(of=of),
        samples=2,
        integration=sb.Integration(cycles=1, threads=1),
    )
    slope = 0.02 * np.pi * np.sin(2.0 * np.pi * 0.3)
    assert float(ds["derivative"][0]) == pytest.approx(slope, rel=0.1)
    assert abs(float(ds["effect"][1])) < 0.15 * abs(float(ds["effect"][0]))
    assert ds["unit"].values.tolist() == ["1", "1"] and ds["step"][0] == pytest.approx(0.005)


def test_refusals() -> None:
    system, spread = (
        small_system(),
        sb.uncertainty.ParameterUncertainty(
            of={"location": sb.uncertainty.Normal(0.001), "contact.stiffness": sb.uncertainty.LogNormal(0.1)}
        ),
    )
    with pytest.raises(InputError, match="no uncertain parameter"):
        sb.uncertainty.sensitivity(system, "peak_force", sb.uncertainty.ParameterUncertainty(displacement=1e-6))
    with pytest.raises(InputError, match="statistic"):
        sb.uncertainty.sensitivity(system, "peak", spread)
    tied = sb.uncertainty.ParameterUncertainty(of=spread.of, correlation=[[1.0, 0.5], [0.5, 1.0]])
    with pytest.raises(InputError, match="given_data"):
        sb.uncertainty.sensitivity(system, "peak_force", tied, "sobol")
    far = sb.uncertainty.ThresholdQoI(bounds=(1e-4, 2e-4), values=2, halvings=0)
    with pytest.raises(InputError, match="is missing for"):
        sb.uncertainty.sensitivity(system, far, spread, samples=2, integration=sb.Integration(cycles=1))
    with pytest.raises(InputError, match="at least 200"):
        sb.uncertainty.sensitivity(
            system, "peak_force", tied, "given_data", samples=10, integration=sb.Integration(cycles=1)
        )
    with pytest.raises(InputError, match="power of 2"):
        sb.uncertainty.sobol_indices(ishigami, 3, 100)


@pytest.mark.parametrize("value", [0.0, 192.53, -1e-9, 1e12])
def test_constant_output_has_no_indices(value):
    """A constant has no variance to share; its rounding errors (5.7e-14 of 192.53) are none of it either."""
    x = np.random.default_rng(1).uniform(size=(1000, 2))
    for noise in (0.0, 1e-17):
        output = value * (1.0 + noise * np.arange(1000))
        with pytest.raises(InputError, match=r"quantity: is constant"):
            first_order(x, output, 0.95, 0)
    with pytest.raises(InputError, match=r"function: is constant"):
        sb.uncertainty.sobol_indices(lambda ranks: np.full(ranks.shape[1], value), 2, 64)


def test_small_variation_has_indices():
    """Variation far above rounding counts, however small it is beside the mean."""
    x = np.random.default_rng(1).uniform(size=(4000, 2))
    found = first_order(x, 192.53 + 1e-9 * x[:, 0], 0.95, 0)
    assert found.estimate[0] > 0.95
    assert abs(found.estimate[1]) < 0.05


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (lambda ranks: ranks, "dimension"),
        (lambda ranks: ranks[0, :-1], "must have one for each of the 1024 points"),
        (lambda ranks: ranks[0] * np.nan, "must be finite"),
        (lambda ranks: ["a"] * ranks.shape[1], "array of numbers"),
        (lambda ranks: 1.0, "dimension"),
    ],
)
def test_result_of_a_function_is_checked(function, message):
    """A function of the wrong result is refused by name."""
    with pytest.raises(InputError, match=message):
        sb.uncertainty.sobol_indices(function, 2, 64)


def test_a_parameter_in_its_unit_has_the_derivative_of_its_ratio() -> None:
    system, found = small_system(), {}
    for name in ("drive.velocity_m_s", "drive.velocity_amplitude"):
        varied = sb.uncertainty.ParameterUncertainty(of={name: sb.uncertainty.LogNormal(0.05)})
        table = sb.uncertainty.sensitivity(
            system, "peak_force", varied, samples=2, integration=sb.Integration(cycles=2)
        )
        found[name] = float(table.derivative[0])
        assert float(table.step[0]) == pytest.approx(0.05 * system.get(name), rel=1e-2)
    unit = system.get("drive.velocity_m_s") / system.get("drive.velocity_amplitude")
    assert found["drive.velocity_m_s"] * unit == pytest.approx(found["drive.velocity_amplitude"], rel=1e-6)
