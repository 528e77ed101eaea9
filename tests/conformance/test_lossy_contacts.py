"""Contacts that lose energy: a free mass that bounces, beams against an independent solution, the ledger."""

from __future__ import annotations

import math

import numpy as np
import pytest
from extended_oracle import Tip, follow
from oracle import LEVEL, PaperBeam
from scipy.integrate import solve_ivp

import snapbeam as sb
from snapbeam import _core
from snapbeam.model import default_values
from snapbeam.solver.step_size import composition_of

MASS, SPEED = 2e-3, 0.05


def thrown(law: sb.ContactLaw) -> sb.System:
    """A free mass that meets a tip at rest."""
    model = sb.ReducedModel.from_matrices(
        [[MASS]], [0.0], contact_shape=[1.0], length_scale=LEVEL, reference_frequency=80.0
    )
    return sb.System(
        model,
        contacts=[sb.Contact(law, sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.0))],
        initial_state=sb.State(amplitude=[0.0], velocity=[-SPEED]),
    )  # fmt: skip


def ledger(run: sb.Run) -> np.ndarray:
    data = run.dataset
    return (data.energy_beam + data.energy_contact + data.energy_dissipated - data.striker_work).values


@pytest.mark.parametrize("e", [0.9, 0.5, 0.05])
@pytest.mark.parametrize("name", ["hunt_crossley", "kelvin_voigt"])
def test_restitution_of_a_free_mass(name, e) -> None:
    law = (
        sb.HuntCrossley.from_restitution(4e8, e, SPEED)
        if name == "hunt_crossley"
        else sb.KelvinVoigt.from_restitution(1e6, e, MASS)
    )
    run = sb.simulate(thrown(law), sb.Integration(cycles=1, accuracy="reference"))
    share = run.dataset.modal_velocity.values[-1, 0] / SPEED
    assert share == pytest.approx(e, abs=1e-8)
    energy = 0.5 * MASS * SPEED**2
    assert run.summary.energy_lost_contact == pytest.approx((1.0 - e * e) * energy, abs=1e-8 * energy)
    assert np.ptp(ledger(run)) < 1e-8 * energy
    assert run.dataset.energy_lost_contact.values[-1] == run.summary.energy_lost_contact


def test_no_loss_is_hertz() -> None:
    """chi -> 0: Hertz's law, but for the rounding of its kicks."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=3)
    shaker = sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.1)
    runs = [
        sb.simulate(
            sb.System(model, contacts=[sb.Contact(law, shaker)]), sb.Integration(cycles=1, accuracy="reference")
        )
        for law in (sb.HertzContact(4e8), sb.HuntCrossley(4e8, 0.0), sb.HuntCrossley(4e8, 1e-9))
    ]
    ends = [run.final_state.amplitude / abs(model.well_amplitude[0]) for run in runs]
    np.testing.assert_allclose(ends[1], ends[0], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(ends[2], ends[0], rtol=0.0, atol=1e-8)


LOSSY = {
    "hunt-crossley": (
        sb.HuntCrossley.from_restitution(4e8, 0.6, 0.05),
        lambda law: lambda d, v: law.stiffness * d**1.5 * (1.0 + law.damping_factor * v),
        lambda law: lambda d, v: 1.0 + law.damping_factor * v,
    ),
    "kelvin-voigt": (
        sb.KelvinVoigt(2e6, 20.0),
        lambda law: lambda d, v: law.linear_stiffness * d + law.linear_damping * v,
        lambda law: lambda d, v: law.linear_stiffness * d + law.linear_damping * v,
    ),
}
# error of w in b, measured: level standard and reference; a quarter of the step leaves a fiftieth at most of standard's
CASES = [
    ("hunt-crossley", 1, 5, 4e-6, 5e-11),
    ("hunt-crossley", 3, 2, 6e-7, 4e-11),
    ("hunt-crossley", 8, 1, 1e-7, 1e-11),
    # the force begins with a jump, whose onset lies between two ticks
    ("kelvin-voigt", 1, 5, 1.3e-6, 4e-11),
    ("kelvin-voigt", 3, 2, 2e-7, 4e-12),
    ("kelvin-voigt", 8, 1, 3.4e-8, 1e-11),
]


@pytest.mark.parametrize(
    ("name", "modes", "cycles", "at_standard", "at_reference"),
    [pytest.param(*case, marks=[] if case[1] == 1 else pytest.mark.slow) for case in CASES],
)
def test_trajectory(name, modes, cycles, at_standard, at_reference) -> None:
    law, force, edge = LOSSY[name]
    beam, ratio, velocity = PaperBeam(modes), 1.21, 0.18
    omega = ratio * float(beam.omega[0])
    stroke = velocity * LEVEL * float(beam.omega[0]) / omega
    times = np.linspace(0.0, 2.0 * math.pi * cycles / omega, 1501) * (1.0 - 1e-13)
    tip = Tip(lambda t, _: (stroke * math.sin(omega * t), stroke * omega * math.cos(omega * t)), force(law), edge(law))
    truth = follow(beam, tip, times)
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=modes)
    shaker = sb.Shaker(frequency_ratio=ratio, velocity_amplitude=velocity)
    for accuracy, measured in (("standard", at_standard), ("reference", at_reference)):
        run = sb.simulate(
            sb.System(model, contacts=[sb.Contact(law, shaker)]),
            sb.Integration(cycles=cycles, accuracy=accuracy),
            sample_times=times,
        )
        bound = max(3.0 * measured, 1e-10)
        np.testing.assert_allclose(
            run.dataset.displacement_at_striker, truth.displacement_at_striker, rtol=0.0, atol=bound
        )
        np.testing.assert_allclose(run.dataset.midspan_displacement, truth.midspan_displacement, rtol=0.0, atol=bound)
        assert np.ptp(ledger(run)) < 1e-4 * run.dataset.attrs["gross_work"]
        assert run.summary.energy_lost_contact > 0.1 * run.summary.gross_work
        # the force is what the law says, sampled between the kicks
        np.testing.assert_allclose(
            run.dataset.contact_force, truth.force, rtol=0.0, atol=2e-2 * truth.force.max() + 1e-3
        )


def test_the_force_at_the_onset_counts_as_the_maximum() -> None:
    """A damper alone stops a free mass: its force c v is maximum at the onset, and falls from there."""
    law = sb.KelvinVoigt(1.0, 2.0)
    run = sb.simulate(thrown(law), sb.Integration(cycles=1))
    assert run.summary.peak_force == pytest.approx(2.0 * SPEED, rel=1e-9)


@pytest.mark.parametrize("order", [4, 6])
def test_order_with_kicks_that_depend_on_velocity(order) -> None:
    """An oscillator pressed against a rough wall all the time: the exact kick keeps the order, both at its own cost."""
    flows, kicks = _core.COMPOSITIONS[composition_of(order, general=True)]
    omega, stiffness, loss, deep = 1.0, 0.6, 0.3, 1.0

    def rate(t, y):
        d = deep - y[0]
        return [y[1], -(omega**2) * y[0] + stiffness * d**1.5 * (1.0 - loss * y[1])]

    start, end = [0.3, 0.2], 4.0
    truth = solve_ivp(rate, (0.0, end), start, "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]

    def kicked(q, p, weight):
        force = stiffness * (deep - q) ** 1.5
        return 1.0 / loss + (p - 1.0 / loss) * math.exp(-loss * force * weight)

    errors = []
    for count in (8, 16, 32):
        q, p = start
        h = end / count
        for _ in range(count):
            p = kicked(q, p, kicks[0] * h)
            for flow, kick in zip(flows, kicks[1:], strict=True):
                c, s = math.cos(omega * flow * h), math.sin(omega * flow * h)
                q, p = c * q + s * p / omega, c * p - s * omega * q
                p = kicked(q, p, kick * h)
        errors.append(float(np.hypot(q - truth[0], p - truth[1])))
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert np.abs(orders - order).max() < 0.5, orders
