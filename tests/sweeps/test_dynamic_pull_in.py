"""Dynamic pull-in and survival as thresholds, against the energy of a plate on a spring."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model.contact.base import LAWS
from snapbeam.model.quantity import RUN
from snapbeam.util.validation import InputError

STIFFNESS, GAP, AREA = 2.0, 3e-6, 4e-8
EPSILON = 8.8541878188e-12
PLATE = sb.ReducedModel.from_matrices([[1e-9]], [[STIFFNESS]], contact_shape=[1.0], base_shape=[1.0], length_scale=GAP)
STATIC = (8.0 * STIFFNESS * GAP**3 / (27.0 * EPSILON * AREA)) ** 0.5
SWITCHED = (STIFFNESS * GAP**3 / (4.0 * EPSILON * AREA)) ** 0.5
"""A voltage that is switched on at rest: the plate reaches half of the gap with no velocity."""


def plate(**around) -> sb.System:
    return sb.System(PLATE, forces=[sb.ElectrostaticForce(voltage=1.0, area=AREA, gap=GAP)], **around)


def test_a_voltage_that_is_switched_on() -> None:
    values = SWITCHED * np.array([0.8, 0.99, 0.998, 1.002, 1.01, 1.2])
    found = sb.threshold(plate(initial_well="unforced"), "force.voltage", values, integration=sb.Integration(cycles=40))
    assert float(found["lower_threshold"]) == float(found["upper_threshold"]) == pytest.approx(1.002 * SWITCHED)
    assert found["failed_runs"] == 0 and found.attrs["pull_in_runs"] == 3
    assert SWITCHED < STATIC  # where a slow increase pulls in


@pytest.mark.slow
def test_a_shock_on_a_charged_plate_over_its_voltage() -> None:
    """An impulse gives a velocity; the plate survives while its energy is below that of the saddle."""
    shock = sb.Shock(acceleration_g=100.0, duration_ms=1e-3)
    system = plate(base_excitation=sb.BaseExcitation(motion=shock, direction="down"))
    levels = np.linspace(500.0, 15e3, 117)
    voltages = [0.5 * STATIC, 0.8 * STATIC]
    found = sb.threshold(
        system, "acceleration_g", levels, {"force.voltage": voltages}, sb.Integration(cycles=20, step=2e-8)
    )

    def potential(u: np.ndarray, volts: float) -> np.ndarray:
        return 0.5 * STIFFNESS * u**2 - 0.5 * EPSILON * AREA * volts**2 / (GAP - u)

    u = np.linspace(0.0, 0.999 * GAP, 200_001)
    for volts, lower in zip(voltages, found["lower_threshold"].values, strict=True):
        energy = potential(u, volts)
        well = int(np.argmax(np.diff(energy) > 0.0))
        barrier = energy[well:].max() - energy[well]
        speed = (2.0 * barrier / 1e-9) ** 0.5
        assert lower == pytest.approx(speed / (2.0 / np.pi * 1e-6) / 9.80665, abs=1.2 * np.diff(levels)[0])


def test_words_are_no_threshold_and_frequencies_are_about_an_equilibrium() -> None:
    with pytest.raises(InputError, match="must be a real number"):
        sb.threshold(plate(), "force.coordinate", [1.0, 2.0])
    with pytest.raises(InputError, match="'unforced'"):
        plate(initial_well="middle")
    loaded = plate().replace(voltage=0.9 * STATIC)
    assert loaded.replace(initial_well="unforced").poles() == pytest.approx(loaded.poles())


@pytest.fixture
def broken_stop():
    """A law of one's own whose force is no number beyond a penetration; taken back afterwards."""

    @dataclass(frozen=True, kw_only=True)
    class BrokenStop(sb.ContactLaw):
        softness: float = sb.quantity("N/m", "constant", low=0.0, scope=RUN)
        name = "broken_stop_of_a_test"

        def time_scale(self, mass, velocity):
            return 1e-5

        @staticmethod
        def force(law, penetration):
            return law.softness * penetration * (1.0 if penetration < 1e-8 else math.nan)

    yield BrokenStop
    del LAWS[BrokenStop.name]


def test_a_run_that_fails_for_another_reason_is_no_pull_in(broken_stop) -> None:
    """A stop that breaks the runs before the plate reaches the electrode: they failed."""
    values = SWITCHED * np.array([0.3, 0.9, 1.05])
    stop = sb.Striker(drive=sb.FixedStop(), side="above", gap=0.1 * GAP)
    for contacts, failed in (([], 0), ([sb.Contact(broken_stop(softness=1.0), stop)], 2)):
        system = plate(initial_well="unforced", contacts=contacts)
        found = sb.threshold(system, "force.voltage", values, integration=sb.Integration(cycles=40))
        assert (found["status"] == sb.RunStatus.DIVERGED).values.tolist() == [False, failed > 0, True]
        assert found["pull_in"].values.tolist() == [False, False, not failed]
        assert found["failed_runs"] == failed and found.attrs["pull_in_runs"] == int(not failed)
