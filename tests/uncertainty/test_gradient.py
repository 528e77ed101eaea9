"""Gradients of quantities by parameters."""

from __future__ import annotations

from typing import Any

import pytest

import snapbeam as sb
from snapbeam.model import default_values as paper

PRECISE = sb.Integration(cycles=3, accuracy="reference", early_termination=False)
gradient = sb.uncertainty.gradient


def system_of(velocity: float = 0.18, **parts: Any) -> sb.System:
    model = sb.ReducedModel.from_beam(paper.BEAM, modes=1, damping_ratio=0.005)
    shaker = sb.Shaker(frequency_ratio=1.2, velocity_amplitude=velocity)
    return sb.System(model, contacts=[sb.Contact(paper.CONTACT, shaker)], **parts)


def first_frequency(system: sb.System) -> float:
    return float(system.model.natural_frequencies[0])


def test_frequencies_of_a_beam_scale_exactly() -> None:
    found = gradient(system_of(), first_frequency, ["beam.young_modulus", "beam.density", "beam.length"])
    # with a constant ratio of length and buckling level the first frequency is that of sqrt(E b^2 / (rho L^4))
    assert found["elasticity"].values == pytest.approx([0.5, -0.5, -2.0], abs=1e-8)
    assert found["relative_error"].max() < 1e-6
    assert found.attrs["value"] == first_frequency(system_of())


@pytest.mark.slow
@pytest.mark.parametrize("quantity", ["peak_force", "impulse", "energy_dissipated", "max_displacement"])
def test_derivatives_of_runs_are_those_of_two_runs(quantity: str) -> None:
    # the maximum hardly depends on Young's modulus, which changes all times alike
    names = ["drive.velocity_amplitude", "contact.stiffness", "beam.young_modulus"][
        : 2 if quantity == "max_displacement" else 3
    ]
    system = system_of()
    found = gradient(system, quantity, names, integration=PRECISE)
    for name, derivative in zip(names, found["derivative"].values, strict=True):
        value, step = system.get(name), 1e-5
        ends = [
            getattr(sb.simulate(system.replace(**{name: value * (1.0 + sign * step)}), PRECISE).summary, quantity)
            for sign in (1.0, -1.0)
        ]
        # two runs move their steps against the maximum, which a cubic finds between them
        close = 2e-4 if quantity == "max_displacement" else 1e-5
        assert derivative == pytest.approx((ends[0] - ends[1]) / (2.0 * step * value), rel=close)


@pytest.mark.slow
def test_a_grazing_impact_is_reported() -> None:
    def impacts(velocity: float) -> int:
        return int(sb.simulate(system_of(velocity), PRECISE).summary.impacts)

    low, high = 0.05, 0.25
    assert impacts(low) != impacts(high)
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if impacts(middle) == impacts(low) else (low, middle)
    with pytest.warns(UserWarning, match="estimated relative error"):
        found = gradient(system_of(high), "peak_force", "drive.velocity_amplitude", integration=PRECISE)
    assert "gradient.doubtful" in found.attrs["diagnostics"]


@pytest.mark.parametrize(
    ("quantity", "parameters", "message"),
    [
        ("zero_crossings", "location", "is a class or a count, which changes by jumps"),
        ("response_class", "location", "has no derivative"),
        ("last_zero_crossing", "location", "jumps where a crossing appears"),
        ("force", "location", "must be one of min_displacement"),
        ("peak_force", "drive.phase", "drive.phase = 0: must not be 0"),
        ("peak_force", "model.modes", "must be a number, for a derivative by it"),
        ("peak_force", ["location", "contact.location"], "must be different names"),
        ("peak_force", [], "at least one"),
        (3.0, "location", "must be text or a sequence or callable"),
        (["peak_force", "peak_force"], "location", "must be different statistics"),
        (
            ["impacts", "early_stop_time"],
            "location",
            "impacts: is a class or a count.* early_stop_time: is the time of an event",
        ),
        (lambda system: float("nan"), "location", "is nan for the system itself"),
    ],
)
def test_refusals(quantity: Any, parameters: Any, message: str) -> None:
    with pytest.raises((sb.InputError, TypeError), match=message):
        gradient(system_of(), quantity, parameters)


def test_several_statistics_are_as_each_alone_and_jumps_are_stated() -> None:
    """One table: numbers of the smooth ones, reasons of the others, without a number."""
    names = ["drive.velocity_amplitude", "contact.stiffness", "beam.thickness"]
    many = ["peak_force", "impacts", "striker_work", "last_zero_crossing"]
    how = sb.Integration(cycles=3)
    found = gradient(system_of(), many, names, integration=how)
    for name in ("peak_force", "striker_work"):
        alone, one = gradient(system_of(), name, names, integration=how), found.sel(statistic=name)
        for each in ("derivative", "elasticity", "relative_error", "method"):
            assert one[each].values.tolist() == alone[each].values.tolist()
        assert float(one["value"]) == alone.attrs["value"] and str(one["statistic_unit"].values) == alone.attrs["units"]
    assert found["method"].sel(statistic="peak_force").values.tolist() == ["exact", "exact", "exact"]
    reasons = dict(zip(many, found["no_derivative"].values.tolist(), strict=True))
    assert reasons["peak_force"] == "" and "changes by jumps" in reasons["impacts"]
    assert "a crossing appears or vanishes" in reasons["last_zero_crossing"]
    assert found["derivative"].sel(statistic=["impacts", "last_zero_crossing"]).isnull().all()
    assert found["derivative"].sel(statistic=["peak_force", "striker_work"]).notnull().all()
