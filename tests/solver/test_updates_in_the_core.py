"""Statistics with ``update`` in the native core: called once for each step that is accepted, whatever integrates it."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.solver import native
from snapbeam.solver.statistics import Statistic, register_statistic, unregister_statistic
from snapbeam.util.validation import InputError

MODEL = sb.ReducedModel.from_beam(default_values.BEAM, modes=2)
HOW = sb.Integration(cycles=3, engine="native")
_seen: dict[str, list] = {}


def struck(**drive):
    motion = sb.Sine(frequency_ratio=1.21, **{"velocity_amplitude": 0.4, **drive})
    return sb.System(MODEL, contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=motion))])


@contextlib.contextmanager
def registered(**updates):
    """Statistics that hold what their functions return; each begins with 0.5."""
    rows = [
        Statistic(name, "float64", "1", "own", lambda reading, held: held, update=update, start=0.5)
        for name, update in updates.items()
    ]
    for row in rows:
        register_statistic(row)
    try:
        yield
    finally:
        for row in rows:
            unregister_statistic(row.name)


def _time(held, step):
    return held + step.length


def _in_touch(held, step):
    return held + (step.length if step.touching else 0.0)


def _deepest(held, step):
    return max(held, 0.5 + max(step.penetration[0], step.penetration[1]))


def _square(held, step):
    u, v, h = step.displacement, step.velocity, step.length
    return held + 1e9 * (0.5 * h * (u[0] ** 2 + u[1] ** 2) + h * h / 6.0 * (u[0] * v[0] - u[1] * v[1]))


def _in_python(held, step):
    return held + len(_seen) + step.length


OWN = {"own_time": _time, "own_touch": _in_touch, "own_depth": _deepest, "own_square": _square}


@pytest.mark.parametrize("layout", ["thread", "runs", "modes"])
def test_an_own_statistic_is_the_package_s_own(layout, monkeypatch):
    """Of runs of different lengths and numbers of steps; those that end leave a lane to others."""
    monkeypatch.setenv("SNAPBEAM_LAYOUT", layout)
    points = {"drive.velocity_amplitude": np.linspace(0.05, 0.9, 5), "drive.frequency_ratio": np.linspace(0.5, 1.7, 4)}
    with registered(**OWN):
        found = sb.sweep(struck(), points, HOW)
    found = getattr(found, "dataset", found)
    cycle = 1.0 / (found.frequency_ratio * MODEL.reference_frequency)
    time = found.own_time - 0.5
    assert float(abs(time / (HOW.cycles * cycle) - 1.0).max()) < 1e-9
    assert float(abs((found.own_touch - 0.5) / time - found.contact_time_fraction).max()) < 1e-9
    rms = np.sqrt(1e-9 * (found.own_square - 0.5) / time) / MODEL.length_scale
    np.testing.assert_allclose(rms, found.rms_displacement, rtol=1e-9)
    assert ((found.own_depth > 0.5) == (found.peak_force > 0.0)).all() and (found.peak_force > 0.0).sum() > 10


def test_a_record_in_many_pieces_updates_each_step_once(monkeypatch):
    with registered(**OWN):
        whole = sb.simulate(struck(), HOW, sample_times=np.linspace(0.0, 0.01, 50)).summary
        monkeypatch.setattr(native, "_BUDGET", 7)
        parts = sb.simulate(struck(), HOW, sample_times=np.linspace(0.0, 0.01, 50)).summary
    for name in OWN:
        assert parts[name] == whole[name]
    assert whole.own_time == pytest.approx(0.5 + HOW.cycles / (1.21 * MODEL.reference_frequency), rel=1e-12)


def test_python_gives_the_same_and_says_that_it_is_slow():
    with registered(own_time=_time, own_python=_in_python):
        _seen.clear()
        with pytest.warns(sb.DiagnosticWarning, match="'own_python'.*calls Python after every step") as told:
            outcome = sb.simulate(struck(), HOW).summary
    assert not any("own_time" in str(each.message) for each in told)
    assert outcome.own_python == outcome.own_time > 0.5


def _divides(held, step):
    return held + 1.0 / (step.length - step.length)


def _refuses(held, step):
    if step.time > 1e-3:
        _seen.setdefault("called", []).append(step)
        raise KeyError("too late")
    return held


@pytest.mark.filterwarnings("ignore::snapbeam.DiagnosticWarning")
@pytest.mark.parametrize(("update", "kind"), [(_divides, ZeroDivisionError), (_refuses, KeyError)])
def test_an_error_in_an_update_is_raised_with_the_step(update, kind):
    with registered(own_bad=update):
        for call in (
            lambda: sb.simulate(struck(), HOW),
            lambda: sb.sweep(struck(), {"drive.velocity_amplitude": [0.1, 0.4, 0.6]}, HOW),
        ):
            _seen.clear()
            with pytest.raises(InputError, match=rf"{update.__name__}\(0.5, CompletedStep.*{kind.__name__}") as raised:
                call()
            assert isinstance(raised.value.__cause__, kind)
            assert len(_seen.get("called", [None])) == 1
    assert sb.simulate(struck(), HOW).summary.impacts > 0


def test_a_beam_without_a_striker_is_never_touched():
    shaken = sb.System(
        MODEL, base_excitation=sb.BaseExcitation(motion=sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.3))
    )  # fmt: skip
    with registered(own_time=_time, own_touch=_in_touch, own_depth=_deepest):
        outcome = sb.simulate(shaken, HOW).summary
    assert outcome.own_time > 0.5 and outcome.own_touch == outcome.own_depth == 0.5
