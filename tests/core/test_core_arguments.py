"""The entry of the module: whatever is wrong is refused by name before a kernel starts."""

from __future__ import annotations

import numpy as np
import pytest
from core_systems import arrays, beam, crowded

import snapbeam as sb
from snapbeam import _core
from snapbeam.model import default_values
from snapbeam.solver import native

SYSTEM = crowded(3)
GIVEN = arrays(SYSTEM, 1, {"drive.frequency_ratio": [1.0, 1.1]})
MAY_BE_NONE = {"shift", "far_force", "second", "high"}
MAY_BE_NAN = {"run", "since", "states", "statistics", "of_channels"}


def fields(which):
    return sorted(getattr(GIVEN, which))


def call(problem=None, batch=None):
    fresh = arrays(SYSTEM, 1, {"drive.frequency_ratio": [1.0, 1.1]})
    _core.integrate(fresh.problem | (problem or {}), fresh.batch | (batch or {}), "runs", "", 1, None)


@pytest.mark.parametrize(("which", "name"), [(w, n) for w in ("problem", "batch") for n in fields(w)])
def test_every_field_is_checked(which, name):
    """Missing, of another type, of another shape, not finite."""
    value = getattr(GIVEN, which)[name]
    words = rf"{which}\['{name}'\]"
    changed = []
    if isinstance(value, np.ndarray):
        changed += [value.astype(np.float32 if value.dtype.kind == "f" else np.int16), "text", value[..., None]]
        if value.shape[0] > 1:
            changed.append(value[:-1])
            if value.ndim > 1 and value.size:
                changed.append(np.asfortranarray(value) if value.shape[1] > 1 else value[:, :0])
        if value.dtype.kind == "f" and value.size and name not in MAY_BE_NAN:
            for bad in (np.nan, np.inf):
                spoiled = value.copy()
                spoiled.flat[-1] = bad
                changed.append(spoiled)
    elif value is not None:
        changed += ["text", None, -(10**9), float("nan")]
    if name in ("center_rest", "dividing_height", "lift"):
        changed.remove(-(10**9))
    for bad in changed:
        with pytest.raises((ValueError, TypeError), match="|".join((words, "problem", "batch"))):
            call(**{which: {name: bad}})
    if name not in MAY_BE_NONE:
        fresh = arrays(SYSTEM, 1)
        given = {"problem": dict(fresh.problem), "batch": dict(fresh.batch)}
        del given[which][name]
        with pytest.raises((ValueError, TypeError), match=words):
            _core.integrate(given["problem"], given["batch"], "runs", "", 1, None)


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("tick", 0.0), ("tick", -1.0), ("tick", np.nan), ("step", 0.5), ("step", np.inf), ("step", 3.0), ("end", 0.0), ("end", 1e300),
        ("output_interval", 0.0), ("well_sign", 0.5), ("contact_step", 0.0), ("contact_step", 1e15), ("contact_step", 3.0),
        ("halvings", -1.0), ("halvings", 99.0), ("max_steps", 0.0), ("max_steps", np.nan), ("stretch", -1.0),
    ],
)  # fmt: skip
def test_numbers_of_a_run_are_checked(column, value):
    run = GIVEN.batch["run"].copy()
    run[1, native.RUN.index(column)] = value
    with pytest.raises(ValueError, match=r"batch\['run'\]"):
        call(batch={"run": run})


def test_indices_are_checked():
    for name, bad in (("row_of", -1), ("row_of", 10**6), ("order", 0), ("order", 7)):
        value = GIVEN.batch[name].copy()
        value.flat[1] = bad
        with pytest.raises(ValueError, match=name):
            call(batch={name: value})
    laws = GIVEN.problem["laws"].copy()
    laws[0] = 99
    with pytest.raises(ValueError, match="laws"):
        call({"laws": laws})
    coupled = np.ones((3, 3))
    with pytest.raises(ValueError, match="'G'"):
        call({"G": coupled})


def test_the_module_is_left_as_it_was():
    call()


@pytest.mark.parametrize(
    ("which", "name", "index", "value"),
    [
        ("problem", "signal_kinds", 5, 1),  # pieces between partials
        ("problem", "uses", (0, -1), 1.0),  # a force by a partial
        ("problem", "windows", 0, 5),
        ("batch", "signals", (0, 1, 1), 1.0),  # whose first partial is none
        ("batch", "signals", (0, 1, 2), 0.0),
        ("batch", "signals", (0, 1, 4), 33.0),
        ("batch", "signals", (0, 1, 4), 1.5),
    ],
)
def test_sums_of_tones_have_their_partials(which, name, index, value):
    noise = sb.BandLimitedNoise(low_ratio=0.5, high_ratio=3.0, velocity_rms=0.02)
    contact = sb.Contact(default_values.CONTACT, sb.Striker(drive=noise))
    given = arrays(sb.System(beam(2), contacts=[contact]), 1)
    assert given.problem["signal_kinds"].tolist() == [1, 3] + 32 * [4]
    changed = getattr(given, which)[name].copy()
    changed[index] = value
    getattr(given, which)[name] = changed
    with pytest.raises(ValueError, match=name):
        _core.integrate(given.problem, given.batch, "runs", "", 1, None)
