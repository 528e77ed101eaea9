"""Calls of every public function and command with arguments that nobody should give, made from their signatures.

A new function or command is among them the day it is public.  Run as a program for a long time:

    python fuzz.py CALLS SEED REPORT [SECONDS]
"""

from __future__ import annotations

import collections
import datetime
import enum
import fractions
import functools
import importlib
import inspect
import json
import math
import os
import pkgutil
import random
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

os.environ.setdefault("MPLBACKEND", "Agg")

import numpy as np
import xarray as xr

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.util.files import NoRoomError
from snapbeam.util.validation import InputError

LONGEST = 10.0
"""Seconds that a call may take."""
PACKAGE = str(Path(sb.__file__).parent)
_NOT_WALKED = ("cli", "explorer", "__main__", "paper", "parts")
"""Commands are taken from the program itself; a server and the making of the paper take as long as they should."""
_LONG_COMMANDS = ("reproduce", "explore", "look")

MODEL = sb.ReducedModel.from_beam(default_values.BEAM, modes=1)
SHAKER = sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.3)
SYSTEM = sb.System(MODEL, contacts=[sb.Contact(default_values.CONTACT, SHAKER)])
SHORT = sb.Integration(cycles=1)
DATASET = xr.Dataset({"a": ("x", [1.0, 2.0])})


class _Odd:
    """An object that cannot even describe itself."""

    def __repr__(self):
        raise RuntimeError("no representation")


class _Unit(float):
    units = "mm"


_LARGE = 10**5
HOSTILE: list[Any] = [
    None, True, False, 0, -1, 1, 2, 3.5, -0.0, 1e-320, 1e-200, 1e200, 1e308, -1e308, float("nan"), float("inf"),
    float("-inf"), _LARGE, 10**400, -(10**400), 10**5000, 2**63, 1j, complex("nan"), fractions.Fraction(1, 3),
    fractions.Fraction(10**400, 3), np.float32(0.1), np.int8(-3), np.uint64(2**64 - 1), np.bool_(True),
    np.timedelta64(3, "s"), np.datetime64("2024-01-01"), datetime.timedelta(1), "", "abc", "1", "nan", "../x", "\0",
    "x" * 10_000, "0.1:2:5", "0.1:2:1000000000", "1/0", b"bytes", (), [], {}, set(), object(), _Odd(), _Unit(3.0),
    [1, [2, 3]], [[]], [None], ["a", 1], np.array([]), np.array(0.5), np.array([0.1, 0.2]), np.array([0.2, 0.1]),
    np.array([np.nan, 1.0]), np.zeros((2, 2)), np.zeros((2, 3, 4)), np.array([1j]), np.array(["a"]),
    np.array([True, False]), np.ma.array([0.1, 0.2], mask=[True, False]), np.ma.masked,
    np.array([10**400], dtype=object),
    xr.DataArray([1.0, 2.0]), DATASET, MODEL, SYSTEM, SHAKER, default_values.BEAM, default_values.CONTACT, SHORT, lambda *a: None,
    enum.Enum("E", "A").A, range(3), range(10**12), "a\udcff.nc", Path("a\udcff.toml"), [1, 2], DATASET.to_dataframe(),
    (0.5, 0.1), (0, 10**9), {"a": 1}, iter([1]), Path("nowhere/x.nc"), "x.nc", "x.toml", Ellipsis, int, np,
]  # fmt: skip
WORDS = [
    "a\udcff.toml",
    "", "-1", "0", "1", "2", "0.3", "1e400", "nan", "inf", "1e-300", "abc", "0.1:2:3", "0.1:2:1000000000", "2:1:3",
    "1/0", "1/2.1", "9" * 5000, "x.nc", "x.toml", "x.csv", "x.png", ".", "/", "nowhere/x.nc", "\u00b5m", "a,b", "1,2",
    "--", "-", "true", "below", "drive.frequency_ratio=0.1:2:3", "contact.location=nan", "beam.length", "[]", "{}",
]  # fmt: skip


def _valid(name: str, draw: random.Random) -> Any:
    """An argument that suits a parameter of such a name, or one that does not."""
    pool = {
        "model": MODEL, "contact": default_values.CONTACT, "contacts": SYSTEM.contacts,
        "law": default_values.CONTACT, "striker": SHAKER, "shaker": SHAKER, "system": SYSTEM,
        "integration": SHORT, "beam": default_values.BEAM, "modes": 1, "cycles": 1, "periods": 1.0, "count": 2,
        "axes": {"drive.velocity_amplitude": [0.1, 0.2]}, "frequency_ratio": [0.8, 1.0],
        "velocity_amplitude": [0.1, 0.2], "location": 0.4, "length": 0.161, "thickness": 0.4e-3, "width": 15e-3,
        "density": 7800.0, "young_modulus": 200e9, "buckling_level": 0.335e-3, "stiffness": 4e8, "mass": [[1.0]],
        "contact_shape": [1.0], "damping_ratio": 0.01, "parameter": "drive.velocity_amplitude",
        "values": [0.1, 0.3, 0.5], "coefficient": 0.5, "amplitude": [0.1], "velocity": [0.0],
        "drive": sb.Sine(frequency_ratio=1.0, velocity_amplitude=0.3),
    }  # fmt: skip
    if name in _OF_RESULTS:
        return draw.choice(_results())
    return pool[name] if name in pool else draw.choice(HOSTILE)


_OF_RESULTS = ("run", "dataset", "data", "result", "measured", "simulated", "signal", "lower", "upper")


@functools.cache
def _results() -> list[Any]:
    """A run, its dataset, a map, a threshold and a measured signal."""
    run = sb.simulate(SYSTEM, SHORT)
    field = sb.sweep(SYSTEM, {"drive.frequency_ratio": [0.9, 1.0], "drive.velocity_amplitude": [0.1, 0.2]}, SHORT)
    limit = sb.threshold(SYSTEM, "drive.velocity_amplitude", [0.1, 0.2], {"drive.frequency_ratio": [0.9, 1.0]}, SHORT)
    signal = sb.lab.make_signal(np.sin(np.arange(500.0)), sampling_frequency=1e3, units="m/s")
    return [run, run, run.dataset, field, limit, signal]


_KEPT_OFF = {"cluster": [None, "", "abc", "local:x", 3, "x.toml"], "threads": [1, None, 0, "a", -1, 1.5]}
"""Parameters whose hostile values would start processes by the dozen."""

_MANY = ("periods", "transient", "cycles", "runs", "count", "samples", "orbits")
"""Parameters for which 100,000 is a long request, not a mistake."""


def public() -> dict[str, Any]:
    """Every public function, class, class method and method, by name."""
    found: dict[str, Any] = {}
    rooms = [("snapbeam", sb)]
    for info in pkgutil.iter_modules(sb.__path__):
        if info.name not in _NOT_WALKED:
            room = importlib.import_module(f"snapbeam.{info.name}")
            if getattr(room, "__all__", None):
                rooms.append((f"snapbeam.{info.name}", room))
    for where, room in rooms:
        for name in room.__all__:
            value = getattr(room, name)
            if not callable(value) or (inspect.isclass(value) and issubclass(value, (BaseException, enum.Enum))):
                continue
            if getattr(value, "_is_protocol", False) or inspect.isabstract(value):
                continue
            found[f"{where}.{name}"] = value
            if inspect.isclass(value) and not inspect.isabstract(value) and value not in (sb.ContactLaw, sb.Drive):
                for own in vars(value):  # static methods are functions of the solver, which take numbers alone
                    method = inspect.getattr_static(value, own)
                    if not own.startswith("_") and isinstance(method, classmethod):
                        found[f"{where}.{name}.{own}"] = getattr(value, own)
    for instance in (SYSTEM, MODEL, default_values.BEAM, default_values.CONTACT, SHORT):
        for own in dir(type(instance)):
            if not own.startswith("_") and inspect.isfunction(inspect.getattr_static(type(instance), own)):
                found[f"{type(instance).__name__.lower()}.{own}"] = getattr(instance, own)
    return found


def arguments(function: Any, draw: random.Random) -> tuple[list[Any], dict[str, Any]] | None:
    """Arguments that its signature takes: mostly such as suit, one or a few that do not; None if it has none."""
    try:
        parameters = list(inspect.signature(function).parameters.values())
    except (ValueError, TypeError):
        return None
    fixed: list[Any] = []
    named: dict[str, Any] = {}
    spoilt = {draw.randrange(len(parameters) or 1) for _ in range(draw.choice((1, 1, 1, 2, 3)))}
    for at, each in enumerate(parameters):
        if each.kind is each.VAR_POSITIONAL or each.kind is each.VAR_KEYWORD:
            continue
        needed = each.default is each.empty
        if not needed and at not in spoilt and each.name not in ("cycles", "modes", "integration"):
            continue
        off = _KEPT_OFF.get(each.name, HOSTILE)
        value = draw.choice(off) if at in spoilt else _valid(each.name, draw)
        if each.name in _MANY and value is _LARGE:
            value = -1
        if each.name == "progress" and callable(value):
            value = None  # what a function of the caller's raises is the caller's
        if each.kind is each.KEYWORD_ONLY:
            named[each.name] = value
        elif each.kind is each.POSITIONAL_ONLY or (needed and len(fixed) == at):
            fixed.append(value)
        else:
            named[each.name] = value
    return fixed, named


class _TooLong(BaseException):
    pass


def _ring(*_: Any) -> None:
    raise _TooLong


def _trouble(error: BaseException) -> str:
    """Where in the package an error comes from that should not come out of it."""
    frames = [f for f in traceback.extract_tb(error.__traceback__) if f.filename.startswith(PACKAGE)]
    where = f"{frames[-1].filename[len(PACKAGE) + 1 :]}:{frames[-1].lineno}" if frames else "outside"
    return f"{type(error).__name__} at {where}"


def judged(function: Any, fixed: Sequence[Any] = (), named: Mapping[str, Any] | None = None) -> str:
    """Call it: "" for a refusal, a finite result or a status; what is wrong otherwise.

    One that takes long may load libraries: it is given time for that, and called again.
    """
    named = {} if named is None else named
    said = _judged(LONGEST, function, fixed, named)
    if said.startswith("over"):
        _judged(6.0 * LONGEST, function, fixed, named)
        said = _judged(LONGEST, function, fixed, named)
    return said


def _judged(longest: float, function: Any, fixed: Sequence[Any], named: Mapping[str, Any]) -> str:
    previous = signal.signal(signal.SIGALRM, _ring)
    signal.setitimer(signal.ITIMER_REAL, longest)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            result = function(*fixed, **named)
    except (InputError, sb.CheckpointError, sb.dynamics.OrbitNotFoundError, NoRoomError):
        return ""
    except _TooLong as error:
        return f"over {longest:g} s, {_trouble(error)}"
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        return _trouble(error)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, previous)
    if isinstance(result, (float, np.floating)) and not np.isfinite(result):
        return "a number that is not finite"
    return ""


def commands() -> dict[str, list[Any]]:
    """Every command of the program, with its parameters."""
    import typer

    from snapbeam.cli.app import app

    found: dict[str, list[Any]] = {}
    for name, each in typer.main.get_command(app).commands.items():
        below = getattr(each, "commands", None)
        parts = {name: each} if below is None else {f"{name} {part}": below[part] for part in below}
        found |= {words: list(part.params) for words, part in parts.items()}
    return found


_COMMAND_VALUES = {
    "modes": "1",
    "cycles": "1",
    "threads": "1",
    "frequency_ratio": "1.0",
    "velocity_amplitude": "0.3",
    "values": "0.1:0.3:3",
    "amplitudes": "-1.5:1.5:3",
    "velocities": "-1:1:3",
    "states": "20",
    "periods": "20",
}


def command_line(name: str, parameters: list[Any], draw: random.Random) -> list[str]:
    """Words after the program: a few options with any value, cheap ones where the command has them."""
    words = name.split()
    for each in parameters:
        if each.param_type_name == "argument":
            words.append(draw.choice(WORDS))
    options = [each for each in parameters if each.param_type_name == "option" and each.name != "help"]
    chosen = draw.sample(options, min(len(options), draw.choice((1, 1, 2, 3))))
    for each in options:
        if each in chosen and each.name not in ("cluster", "threads"):
            words.append(max(each.opts, key=len))
            if not each.is_flag:
                words.append(draw.choice(WORDS))
        elif (short := each.name.rpartition("__")[2]) in _COMMAND_VALUES:
            words += [max(each.opts, key=len), _COMMAND_VALUES[short]]
    return words


def judged_command(words: list[str]) -> str:
    """Run a command line here: "" if it ends with a status and words; what is wrong otherwise."""
    from typer.testing import CliRunner

    from snapbeam.cli.app import app

    ended: list[Any] = []
    said = judged(lambda: ended.append(CliRunner().invoke(app, words)))
    if said or not ended:
        return said or "no end"
    error = ended[0].exception
    if error is not None and not isinstance(error, (SystemExit, InputError)):
        return _trouble(error)
    return "" if ended[0].exit_code in (0, 1, 2) else f"status {ended[0].exit_code}"


def fuzz_calls(
    calls: int, seed: int, share_of_commands: float = 0.1, seconds: float = math.inf
) -> tuple[int, dict[str, list[str]]]:
    """So many calls; returns how many were made, and examples of what went wrong, by what and where."""
    draw = random.Random(seed)
    functions, programs = public(), commands()
    programs = {name: each for name, each in programs.items() if name not in _LONG_COMMANDS}
    names, wrong, made, start = list(functions), collections.defaultdict(list), 0, time.monotonic()
    for each in (None, [0.1, 0.2]):  # libraries are loaded before anything is timed
        sb.simulate(SYSTEM, SHORT) if each is None else sb.sweep(SYSTEM, {"drive.velocity_amplitude": each}, SHORT)
    before = os.getcwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            while made < calls and time.monotonic() - start < seconds:
                if draw.random() < share_of_commands:
                    name = draw.choice(list(programs))
                    words = command_line(name, programs[name], draw)
                    said, shown = judged_command(words), " ".join(words)[:300]
                else:
                    name = draw.choice(names)
                    given = arguments(functions[name], draw)
                    if given is None:
                        continue
                    said = judged(functions[name], *given)
                    shown = f"{name} {_short(given)}" if said else ""
                made += 1
                if said:
                    wrong[f"{name}: {said}"].append(shown)
        finally:
            os.chdir(before)
    return made, dict(wrong)


def _short(given: Any) -> str:
    try:
        return repr(given)[:300]
    except Exception:
        return "?"


def _limit_memory(gibibytes: float = 12.0) -> None:
    """Let a large request fail at once; without limits of memory (Windows) it is made as it is."""
    try:
        import resource
    except ImportError:
        return
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    resource.setrlimit(resource.RLIMIT_AS, (int(gibibytes * 2**30), hard))


def main(calls: int, seed: int, report: Path, seconds: float = math.inf) -> None:
    """Fuzzed calls whose result is written to a file: what is tried may close any stream."""
    _limit_memory()
    report = report.absolute()
    start = time.monotonic()
    made, wrong = fuzz_calls(calls, seed, seconds=seconds)
    found = {
        "calls": made,
        "seconds": round(time.monotonic() - start),
        "wrong": {
            name: {"times": len(examples), "example": examples[0]}
            for name, examples in sorted(wrong.items(), key=lambda item: -len(item[1]))
        },
    }
    report.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3]), *map(float, sys.argv[4:]))
