"""Arguments at random: the entries of the module take them or raise ValueError or TypeError, and nothing else happens."""

from __future__ import annotations

import contextlib
import mmap
import re
import signal
import subprocess
import sys
from unittest import mock

import numpy as np
import pytest
from core_systems import arrays, crowded, struck

from snapbeam import _core
from snapbeam.solver import native
from snapbeam.solver.channels import LAWS

FIELDS = ("force", "potential", "stiffness", "damping", "low", "high")
REFUSED = (ValueError, TypeError)
RESULTS = {"states", "statistics", "of_channels", "held"}
WRITTEN = {
    "integrate": (set(), RESULTS),
    "integrate_tangents": (set(), RESULTS, RESULTS - {"held"}),
    "record": (set(), RESULTS, {"rows", "values", "impacts", "marks", "saved"}),
    "law_values": (set(FIELDS),),
}
"""What an entry writes, of each of its mappings."""
NAMED = re.compile(r"\['\w+'\]|^(batch|recorder|layout|threads|law|instruction set)\b|incompatible function arguments")
BAND, GUARD = 64, 0xA5
LONG = 5.0
"""Time after which a call is stopped, s: how long a run takes is for its arguments to say."""
LAYOUTS = ("runs", "modes", "thread")
POINTS = {"drive.frequency_ratio": [1.0, 1.1, 1.2]}


def spoiled(rng, value):
    """A value of another shape, type, order, alignment or size, not finite, negative, read-only, or none."""
    if not isinstance(value, np.ndarray):
        others = [
            "text",
            None,
            -1,
            -(2**40),
            2**70,
            2**31,
            0,
            1.5,
            float("nan"),
            float("inf"),
            np.zeros(2),
            [],
            {},
            b"",
        ]
        return others[rng.integers(len(others))]
    kind, flat = rng.integers(13), value.astype(value.dtype.newbyteorder("="), order="C")
    if kind == 0:
        return flat.reshape(-1)[: rng.integers(value.size + 1)]
    if kind == 1:
        return flat[..., None]
    if kind == 2:
        return np.concatenate([flat, flat], axis=rng.integers(flat.ndim)) if flat.ndim else flat
    if kind == 3:
        return np.repeat(flat, 2, axis=-1)[..., ::2] if flat.ndim else flat
    if kind == 4:
        return np.asfortranarray(flat[..., ::-1]) if flat.ndim else flat
    if kind == 5:
        types = [np.float32, np.float16, np.int64, np.int32, np.uint64, np.complex128, np.bool_, object, ">f8", "M8[s]"]
        with np.errstate(all="ignore"):
            return np.nan_to_num(flat).astype(np.int64).astype(types[rng.integers(len(types))])
    if kind == 6:
        none = np.zeros((0,) * max(flat.ndim, 1), flat.dtype)
        return [None, "text", -1, flat.tolist(), none, np.zeros((), flat.dtype), memoryview(b"ab"), {}][rng.integers(8)]
    if kind == 7 and flat.dtype != object:
        return beside(flat, 1, flat.dtype.alignment - 1 or 1)[1]
    if kind == 8 and flat.ndim and flat.size:
        return np.broadcast_to(flat.reshape(-1)[:1], flat.shape)
    for at in rng.integers(flat.size, size=rng.integers(1, 4)) if flat.size else ():
        if flat.dtype == np.float64:
            numbers = [np.nan, np.inf, -np.inf, -1.0, 0.0, 0.5, 1.0, 1e300, -1e300, 1e-300, 5e-324, 2.0**53]
            flat.reshape(-1)[at] = rng.choice(numbers)
        elif flat.dtype.kind in "iu":
            limits = np.iinfo(flat.dtype)
            flat.reshape(-1)[at] = rng.choice([limits.min, limits.max, 99, 0, 1, -1])
    flat.setflags(write=kind != 12)
    return flat


def beside(value, before=BAND, after=BAND):
    """Bytes, and a copy of an array that lies between them."""
    room = np.full(before + value.nbytes + after, GUARD, np.uint8)
    inner = room[before : before + value.nbytes].view(value.dtype).reshape(value.shape)
    inner[...] = value
    return room, inner


def copies(mapping):
    return {name: each.copy() if isinstance(each, np.ndarray) else each for name, each in mapping.items()}


def changed(rng, *mappings):
    """The mappings, of which one to three entries are spoiled, missing or in the memory of others."""
    found = [dict(each) for each in mappings]
    for _ in range(rng.integers(1, 4)):
        chosen, other = (found[rng.integers(len(found))] for _ in range(2))
        if not chosen:
            continue
        name, kind = sorted(chosen)[rng.integers(len(chosen))], rng.random()
        value = chosen[name]
        if kind < 0.05:
            del chosen[name]
            continue
        if kind < 0.15 and isinstance(value, np.ndarray) and value.dtype != object:
            long = [each for each in other.values() if isinstance(each, np.ndarray) and each.nbytes >= value.nbytes]
            long = [each for each in long if each.flags.c_contiguous and each.dtype.kind in "fiu" and each.ndim]
            if long:
                memory = long[rng.integers(len(long))].reshape(-1).view(np.uint8)
                chosen[name] = memory[: value.nbytes].view(value.dtype).reshape(value.shape)
                continue
        chosen[name] = spoiled(rng, value)
    return found


class _Given(Exception):
    """Arguments of the module's record, in place of a run."""


def recording(system, **settings):
    """Arguments of a recorded run, with little room."""
    given = []

    def kept(problem, batch, recorder, layout, which):
        few = {name: recorder[name][:60] for name in ("rows", "values", "impacts")}
        given.extend((problem, batch, {**recorder, **few, "budget": 1000}))
        raise _Given

    with mock.patch.object(native._core, "record", kept), contextlib.suppress(_Given):
        next(native.record(arrays(system, 1, **settings).ensemble, np.linspace(0.0, 1e-3, 20), True))
    return given


def sources(entry, max_steps):
    """Arguments that are right, of a few systems."""
    if entry == "law_values":
        x, y, numbers = np.random.default_rng(5).normal(size=(3, 5))
        return [[{"x": x, "y": y, "numbers": np.abs(numbers[:3])} | {name: np.empty(5) for name in FIELDS}]]
    systems = struck(1), struck(2), crowded(2)
    if entry == "record":
        return [recording(system, max_steps=max_steps) for system in systems]
    fresh = [arrays(system, 1, POINTS, max_steps=max_steps) for system in systems]
    if entry == "integrate":
        return [[each.problem, each.batch] for each in fresh]
    tangents = [native._differentiated(each.ensemble) for each in fresh]
    return [[each.problem, each.batch, each.no_change() | of_all_runs(each)] for each in tangents]


def of_all_runs(each):
    """Derivatives of the structure and of the pieces of its signals, which a call may leave out."""
    n, pieces = each.order.size, each.batch["pieces"]
    shapes = {
        "structure": (len(native._ROWS), n),
        "scalars": (len(native._SCALARS),),
        "G": (n, n),
        "pieces": pieces.shape,
    }
    return {name: np.zeros((_core.DIRECTIONS, *shape)) for name, shape in shapes.items()}


def others_of(rng, entry):
    """The arguments that are no mappings; seldom wrong."""
    layout, which, threads = LAYOUTS[rng.integers(3)], "", int(rng.integers(1, 3))
    if rng.random() < 0.02:
        layout, which, threads = [
            ("columns", "", 1), ("runs", "mmx", 1), ("runs", "", -1), ("runs", "", 10**12), (None, "", 1), ("runs", None, 1),
            ("runs", "", 1.5), ("\ud800", "", 1), ("runs", "", 0),
        ][rng.integers(9)]  # fmt: skip
    return {
        "integrate": (layout, which, threads, None),
        "integrate_tangents": (which, threads, None),
        "record": (layout, which),
    }[entry]


def _stopped(*_):
    raise TimeoutError


def attack(entry, seed, calls, max_steps=200):
    """Call an entry of the module with spoiled arguments; how often they were refused, and how often the call was stopped."""
    rng, given, refused, stopped = np.random.default_rng(seed), sources(entry, max_steps), 0, 0
    timed = hasattr(signal, "setitimer")
    before = signal.signal(signal.SIGALRM, _stopped) if timed else None
    for number in range(calls):
        mappings = [copies(each) for each in given[rng.integers(len(given))]]
        # outputs between bytes that must stay, and inputs that must too
        rooms = {}
        for at, written in enumerate(WRITTEN[entry]):
            for name in sorted(written):
                rooms[at, name], mappings[at][name] = beside(mappings[at][name])
        if number % 8:
            mappings = changed(rng, *mappings)
        inputs = [
            (name, each, each.tobytes()) for at, mapping in enumerate(mappings) for name, each in mapping.items()
            if number % 4 == 0 and isinstance(each, np.ndarray) and name not in WRITTEN[entry][at] and each.dtype != object
        ]  # fmt: skip
        if entry == "law_values":
            words = (int(rng.choice([*(law for law, _ in LAWS.values()), -1, 99, 2**31 - 1])), *mappings)
        else:
            words = (*mappings, *others_of(rng, entry))
        try:
            if timed:
                signal.setitimer(signal.ITIMER_REAL, LONG)
            getattr(_core, entry)(*words)
        except REFUSED as error:
            assert NAMED.search(str(error)), error
            refused += 1
        except TimeoutError:
            stopped += 1
        finally:
            if timed:
                signal.setitimer(signal.ITIMER_REAL, 0.0)
        for room in rooms.values():
            assert (room[:BAND] == GUARD).all() and (room[-BAND:] == GUARD).all(), (entry, seed, number)
        for name, each, content in inputs:
            assert each.tobytes() == content, (entry, seed, number, name)
    if timed:
        signal.signal(signal.SIGALRM, before)
    return refused, stopped


@pytest.mark.parametrize(("entry", "calls"), [("integrate", 1200), ("integrate_tangents", 150), ("record", 600), ("law_values", 2000)])  # fmt: skip
def test_entries(entry, calls):
    refused, _ = attack(entry, 1, calls)
    assert calls // 3 < refused < calls * 0.9


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals stop what takes long")
@pytest.mark.parametrize(("entry", "calls"), [("integrate", 20_000), ("integrate_tangents", 2_000), ("record", 10_000), ("law_values", 50_000)])  # fmt: skip
def test_entries_in_processes(entry, calls):
    """In processes of their own, so that a crash is a test that fails: ``python test_core_fuzz.py ENTRY SEED CALLS`` repeats one."""
    for seed in range(2, 5):
        words = [sys.executable, "-X", "faulthandler", __file__, entry, str(seed), str(calls)]
        done = subprocess.run(words, capture_output=True, text=True, timeout=1200)
        assert done.returncode == 0, (words, done.stdout, done.stderr[-6000:])


@pytest.mark.sampled(3)
@pytest.mark.parametrize("at", range(5))
@pytest.mark.parametrize("bad", [-1, -(2**31), 2**31 - 1])
def test_marks_beyond_the_records_are_refused(at, bad):
    """They are places in the records, which are read and written there."""
    problem, batch, recorder = recording(crowded(2))
    recorder["marks"][at] = bad
    with pytest.raises(ValueError, match="marks"):
        _core.record(problem, batch, recorder, "thread", "")


def test_what_is_written_shares_no_memory():
    fresh = arrays(struck(2), 1, POINTS)
    run = fresh.batch["run"]
    fresh.batch["statistics"] = run.reshape(-1)[:1]
    memory = np.zeros(10_000)
    for name in ("run", "statistics"):
        value = arrays(struck(2), 1, POINTS).batch[name]
        memory[: value.size] = value.reshape(-1)
        fresh.batch[name] = memory[: value.size].reshape(value.shape)
    memory[: run.size] = run.reshape(-1)
    with pytest.raises(ValueError, match=r"batch\['statistics'\] must not share memory"):
        _core.integrate(fresh.problem, fresh.batch, "runs", "", 1, None)


def test_an_array_beside_its_alignment_is_refused():
    fresh = arrays(struck(2), 1, POINTS)
    fresh.batch["q"] = beside(fresh.batch["q"], 1, 7)[1]
    with pytest.raises(TypeError, match=r"batch\['q'\] must be a contiguous, aligned array"):
        _core.integrate(fresh.problem, fresh.batch, "runs", "", 1, None)


def test_mappings_of_other_kinds():
    fresh = arrays(struck(1), 1)
    for bad in (None, 1, [], "text", {}, {1: 2}):
        for problem, batch in ((bad, fresh.batch), (fresh.problem, bad)):
            with pytest.raises(REFUSED):
                _core.integrate(problem, batch, "runs", "", 1, None)


if __name__ == "__main__":
    print(*attack(sys.argv[1], int(sys.argv[2]), int(sys.argv[3])))


@pytest.mark.parametrize("name", ["statistics", "of_channels", "signals"])
def test_memory_stays_while_the_core_computes(name):
    """A view that is released in a report of progress, whose memory would go: its export is held, so it is refused."""
    fresh = arrays(struck(8), 200_000)
    own = fresh.batch[name]
    memory = mmap.mmap(-1, 1 << 20)
    view = memoryview(memory)[: own.nbytes].cast("d", own.shape)
    view.cast("B")[:] = own.tobytes()
    fresh.batch[name] = view

    def progress(done, runs):
        with pytest.raises(BufferError):
            view.release()
            memory.close()
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        _core.integrate(fresh.problem, fresh.batch, "thread", "", 1, progress)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("name", ["structure", "scalars", "G", "pieces", "jumps"])
def test_derivatives_of_another_shape_are_refused(name):
    """The structure's come together; each has the shape of what it belongs to."""
    problem, batch, seeds = sources("integrate_tangents", 200)[2]
    wrong = seeds | {name: np.zeros((*seeds[name].shape, 2))}
    with pytest.raises(ValueError, match=rf"tangent\['{name}'\] has shape"):
        _core.integrate_tangents(problem, batch, wrong, "", 1, None)
    if name in ("scalars", "G"):
        del wrong[name]
        with pytest.raises(ValueError, match=rf"tangent\['{name}'\] is missing"):
            _core.integrate_tangents(problem, batch, wrong, "", 1, None)
