"""Newton's law of impact with several modes and strikers, against an own integration that jumps at every impact.

Nothing of the solver is taken but the numbers of the structure.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.solver import native
from snapbeam.solver.assemble import make_ensemble

pytestmark = pytest.mark.filterwarnings("ignore:.*the mass that an impulse at a point meets")
STEEL = dict(length=0.16, thickness=4e-4, width=15e-3, density=7800.0, young_modulus=200e9, buckling_level=3.35e-4)


def bouncing(system, cycles, times):
    """Amplitudes at *times*, and the number of impacts of each striker."""
    ensemble = make_ensemble(system, sb.Integration(cycles=cycles, engine="native"))
    structure, channels = ensemble.structure, ensemble.channels
    n, omega = structure.omega.size, structure.omega
    sigma, g, coupling = structure.damping_ratio * omega, structure.well, structure.coupling
    contacts = range(len(system.contacts))
    rows = [channels.rows[channels.row_of[0, j]] for j in contacts]
    offsets = [float(channels.offset[0, j]) for j in contacts]

    def tip(j, t):
        drive = system.contacts[j].striker.drive
        rate = drive.frequency_ratio * system.scale.omega
        speed = drive.velocity_amplitude * system.scale.length * system.scale.omega
        return speed / rate * np.sin(rate * t), speed * np.cos(rate * t)

    def slope(t, y):
        q, p = y[:n], y[n:]
        pulled = coupling @ q
        stretch = q @ pulled
        tension = stretch * g + (2.0 * g @ q + stretch) * pulled
        return np.r_[p, -(omega**2) * q - 2.0 * sigma * p - structure.nonlinear_stiffness * tension]

    def gap(j):
        def value(t, y):
            return offsets[j] + tip(j, t)[0] - rows[j] @ y[:n]

        value.direction, value.terminal = 1, True
        return value

    gaps = [gap(j) for j in contacts]
    y, t, end = np.r_[ensemble.starts[0, 0], ensemble.starts[0, 1]], 0.0, times[-1]
    found, impacts = np.zeros((times.size, n)), [0 for _ in contacts]
    for j in contacts:
        if abs(gaps[j](0.0, y)) < 1e-15:
            y[n:] += (
                rows[j]
                * (1.0 + system.contacts[j].law.coefficient)
                * (tip(j, 0.0)[1] - rows[j] @ y[n:])
                / (rows[j] @ rows[j])
            )
            impacts[j] += 1
    while t < end:
        piece = solve_ivp(
            slope, (t, end), y, method="DOP853", rtol=1e-12, atol=1e-17, dense_output=True, events=gaps, max_step=2e-5
        )
        inside = (times >= t) & (times <= piece.t[-1])
        if inside.any():
            found[inside] = piece.sol(times[inside])[:n].T
        t, y = piece.t[-1], piece.y[:, -1].copy()
        for j in contacts if piece.status == 1 else ():
            if piece.t_events[j].size:
                e, row = system.contacts[j].law.coefficient, rows[j]
                y[n:] += row * (1.0 + e) * (tip(j, t)[1] - row @ y[n:]) / (row @ row)
                impacts[j] += 1
    return structure.amplitudes(found), impacts


def shaken(modes, *strikers):
    model = sb.ReducedModel.from_beam(sb.Beam(**STEEL), modes=modes, damping_ratio=0.005)
    contacts = [
        sb.Contact(
            sb.Restitution(e),
            sb.Shaker(frequency_ratio=ratio, velocity_amplitude=speed, location=place),
            **({} if i == 0 else {"label": f"tip_{i}"}),
        )
        for i, (e, ratio, speed, place) in enumerate(strikers)
    ]
    return sb.System(model, contacts=contacts)


@pytest.mark.sampled(2)
@pytest.mark.parametrize(
    ("modes", "strikers"),
    [(3, [(0.8, 1.21, 0.3, 0.45)]), (8, [(0.9, 0.7, 0.3, 0.45)]), (4, [(0.7, 1.1, 0.2, 0.45), (0.9, 1.1, 0.15, 0.6)])],
)
def test_every_impact_is_that_of_all_modes(modes, strikers):
    system = shaken(modes, *strikers)
    times = np.linspace(0.0, 1.5 * 2.0 * np.pi / system.scale.omega / strikers[0][1], 300)
    expected, impacts = bouncing(system, 2, times)
    for level, limit in (("standard", 1e-5), ("reference", 1e-8)):
        run = sb.simulate(system, sb.Integration(cycles=2, accuracy=level, engine="native"), sample_times=times)
        error = np.abs(run.dataset["modal_amplitude"].values - expected) / system.scale.length
        assert error.max() < limit
    met = run.impacts.where(run.impacts.onset <= times[-1], drop=True)
    assert met.onset.size == sum(impacts) >= 2


@pytest.mark.parametrize(("modes", "e"), list(itertools.product((1, 4, 8), (0.0, 0.5))))
def test_a_contact_that_is_held_together_balances(modes, e):
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=modes, damping_ratio=0.02)
    system = sb.System(
        model, contacts=[sb.Contact(sb.Restitution(e), sb.Shaker(frequency_ratio=0.15, velocity_amplitude=0.05))]
    )
    times = np.linspace(0.0, 2.0 * np.pi / system.scale.omega / 0.15, 300)[:-1]
    found = []
    for level in ("standard", "reference"):
        run = sb.simulate(system, sb.Integration(cycles=1, accuracy=level, engine="native"), sample_times=times)
        data = run.dataset
        residual = data.energy_beam + data.energy_contact + data.energy_dissipated - data.striker_work
        assert abs(residual).max() < 1e-4 * data.attrs["gross_work"]
        assert run.impacts.duration.sum() > 0.2 * times[-1]
        assert data.penetration_normalised.max() < 1e-9
        found.append(data["modal_amplitude"].values / system.scale.length)
    assert np.abs(found[0] - found[1]).max() < 1e-5


def test_a_record_in_pieces_has_every_impact_once(monkeypatch):
    """The impact at the beginning of a run in touch belongs to its first piece."""
    system = shaken(1, (0.8, 1.21, 0.05, 0.45))
    whole, pieces = [], []
    for found, samples in ((whole, native._SAMPLES), (pieces, 300)):
        monkeypatch.setattr(native, "_SAMPLES", samples)
        run = sb.simulate(system, sb.Integration(cycles=20, engine="native"))
        found += [run.impacts.onset.values, run.impacts.impulse.values]
    assert whole[0].size > 10
    np.testing.assert_array_equal(pieces, whole)


@pytest.mark.parametrize(("ratio", "velocity", "location"), [(0.8, 0.24, 0.48), (0.46, 0.36, 0.35), (0.25, 0.55, 0.49)])
def test_a_contact_that_opens_does_not_land_again_at_once(ratio, velocity, location):
    """It opens where the force that holds it together is zero, with a gap that grows."""
    model = sb.ReducedModel.from_beam(sb.model.default_values.BEAM, 1, damping_ratio=0.005)
    shaker = sb.Shaker(frequency_ratio=ratio, velocity_amplitude=velocity, location=location)
    system = sb.System(model, contacts=[sb.Contact(sb.Restitution(0.0), shaker)])
    impulse = sb.simulate(system, sb.Integration(cycles=6, engine="native")).impacts.impulse.values
    assert impulse.size > 2 and impulse.min() > 1e-6 * impulse.max()


def test_energies_over_impacts_do_not_depend_on_the_step():
    """The mean energy before an impact is that before it: the step that ends there had the energy after it at both ends."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=3, damping_ratio=0.01)
    striker = sb.Contact(sb.Restitution(0.5), sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.3))
    system = sb.System(model, contacts=[striker])
    axes = {"drive.velocity_amplitude": [0.1, 0.3]}
    runs = [
        sb.sweep(system, axes, sb.Integration(cycles=4, step=step, high_frequency_ratio=1.5)) for step in (2e-5, 1e-5)
    ]
    assert (runs[0].impacts > 3).all()
    high = [run.high_frequency_energy_fraction.values for run in runs]
    np.testing.assert_allclose(high[0], high[1], rtol=1e-6)


def test_a_chaotic_table_to_rounding() -> None:
    """A ball on a vibrating table, exact flights between impacts: small errors grow by 1e9 over eleven impacts."""
    speed, table, e = 4.0, 0.2, 0.8  # units of the ball: g = 1
    model = sb.ReducedModel.from_matrices([[1.0]], [0.0], contact_shape=[1.0], reference_frequency=1.0 / (2.0 * np.pi))
    weight = sb.ExternalForce(history=sb.ConstantForce(force=-1.0))
    tip = sb.Striker(drive=sb.DisplacementSine(frequency_ratio=speed, displacement_amplitude=table), gap=0.0)
    start = sb.State(amplitude=[0.5], velocity=[0.0])
    system = sb.System(model, contacts=[sb.Contact(sb.Restitution(e), tip)], forces=[weight], initial_state=start)
    run = sb.simulate(system, sb.Integration(cycles=20), sample_times=np.arange(0.0, 31.0, 0.5))
    t0, x0, v0 = 0.0, 0.5, 0.0
    impacts = run.impacts["onset"].values
    grid = np.linspace(0.0, 5.0, 20_001)
    for found in impacts[:6]:
        gap = lambda s: x0 + v0 * s - 0.5 * s * s - table * np.sin(speed * (t0 + s))  # noqa: B023, E731
        first = int(np.flatnonzero((gap(grid[1:]) < 0.0) & (grid[1:] > 1e-6))[0])
        s = brentq(gap, grid[first], grid[first + 1], xtol=1e-16)
        w = table * speed * np.cos(speed * (t0 + s))
        x0, v0, t0 = x0 + v0 * s - 0.5 * s * s, w - e * (v0 - s - w), t0 + s
        assert found == pytest.approx(t0, abs=3e-11)
