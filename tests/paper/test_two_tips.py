"""Slow pushers with one tip or two: what is published, mirror images, a creeping beam, and the integration itself."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from studies import two_tips
from studies.two_tips import push

import snapbeam as sb
from snapbeam import paper

PAIR = np.array([0.373, 0.513])


@pytest.mark.slow
@pytest.mark.parametrize("place", [0.3, 0.45, 0.6])
@pytest.mark.parametrize("level", [0.8375, 3.0])
def test_one_slow_tip_crosses_the_centre_line(level, place) -> None:
    """Published, and Eq. (21) where the saddle is the straight beam."""
    height = push(two_tips.beam_of(level, 8), np.array([place]), 0.02).height
    assert height > -2e-4
    if level < two_tips.second_level():
        assert height == pytest.approx(0.0, abs=2e-3)


@pytest.mark.slow
def test_two_slow_tips_need_not() -> None:
    """A beam buckled far; the mirrored pusher, smaller steps and more modes; the paper's beam has no such pair."""
    model = two_tips.beam_of(two_tips.LEVEL, 8)
    pair = push(model, PAIR, 0.02)
    assert pair.height < -0.3 and pair.tips == 1
    for other in (
        push(model, 1.0 - PAIR[::-1], 0.02),
        push(model, PAIR, 0.007),
        push(two_tips.beam_of(two_tips.LEVEL, 16), PAIR, 0.02),
    ):
        assert other.height == pytest.approx(pair.height, abs=2e-3)
    assert push(two_tips.beam_of(0.8375, 8), PAIR, 0.02).height == pytest.approx(0.0, abs=2e-3)


def test_never_left() -> None:
    """Tips near both clamps carry the beam over: said by NaN, at once."""
    pushed = push(two_tips.beam_of(two_tips.LEVEL, 8), np.array([0.093, 0.831]), 0.02)
    assert np.isnan(pushed.height) and pushed.tips == 2


@pytest.mark.slow
def test_a_creeping_beam() -> None:
    """The gradient's flow against stiff tips, with no equilibrium solved for, snaps at the same height."""
    model = two_tips.beam_of(two_tips.LEVEL, 8)
    rows, size = np.array([model.shape_at(x) for x in PAIR]), model.length_scale
    unit = float(np.abs(model.stiffness).max())
    stiffness, tension = model.stiffness / unit, model.nonlinear_stiffness * size**2 / unit
    firm = 50.0 / float((rows @ rows.T).max())

    def creep(_, a, height):
        pressed = firm * rows.T @ np.maximum(height - rows @ a, 0.0)
        return pressed - (stiffness + tension * (a @ a)) * a

    a, step = model.well_amplitude / size, 0.02
    height = float((rows @ a).min())
    while step > 0.002:
        new = solve_ivp(creep, (0.0, 3e4), a, "LSODA", args=(height + step,), rtol=1e-7, atol=1e-10).y[:, -1]
        if model.midspan_shape @ new > 0.0:
            step *= 0.25
        else:
            a, height = new, height + step
    assert height - 1e-3 < push(model, PAIR, 0.02).height < height + step + 2e-3
    assert (rows @ a)[1] > height + 0.1  # it has left the tip by the centre before


@pytest.mark.slow
def test_two_strikers_that_move_slowly() -> None:
    """The integrate_ensemble, two tips at constant speed: forces and the height at which the beam leaves the one by the centre.

    With the paper's damping the beam then goes over at once; one that creeps comes to rest on the other tip.
    """
    model = two_tips.beam_of(two_tips.LEVEL, 8)
    rest = np.array([model.shape_at(x) for x in PAIR]) @ model.well_amplitude
    drive = sb.ConstantVelocity(speed=1.0 / (2.0 * np.pi * 500.0))
    tips = [
        sb.Striker(drive=drive, location=float(x), gap=float(at - rest.min())) for x, at in zip(PAIR, rest, strict=True)
    ]
    with pytest.warns(sb.DiagnosticWarning, match="antisymmetric"):
        run = sb.simulate(
            sb.System(model, contacts=[sb.Contact(paper.CONTACT, tip) for tip in tips]), sb.Integration(cycles=540)
        )
    height = run.dataset.striker_displacements.values[:, 0]
    force = run.dataset.striker_forces.values
    path = push(model, PAIR, 0.002).path
    unit = model.beam.bending_stiffness / model.beam.length**3 * model.length_scale
    both = path[(path[:, 1:] > 0.0).all(axis=1)]
    assert height[force[:, 1] > 0.0].max() == pytest.approx(both[-1, 0], abs=0.005)
    assert height[force[:, 0] > 0.0].max() < both[-1, 0] + 0.005
    for at in (-0.95, -0.8, -0.65, -0.5):
        own, still = np.argmin(np.abs(height - at)), np.argmin(np.abs(path[:, 0] - at))
        np.testing.assert_allclose(force[own], unit * path[still, 1:], atol=0.02)
    assert run.summary.final_well == 1
