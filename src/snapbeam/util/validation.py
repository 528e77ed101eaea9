"""Checks of user input: one way in, one kind of refusal.

Every function here takes the name of a parameter and the value that was given, returns the
value as a plain Python or NumPy number, or raises :class:`InputError` with the name, the value and
what is allowed.  Nothing is clipped or converted silently.
"""

from __future__ import annotations

import functools
import inspect
import json
import math
import os
import re
import types
import typing
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib import import_module
from numbers import Integral, Real
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

_F = TypeVar("_F", bound=Callable[..., Any])
_ABSTRACT = {Sequence: "a sequence", Mapping: "a mapping", Iterable: "a sequence", Callable: "callable"}
_LIBRARIES = {"xr": "xarray", "np": "numpy", "pd": "pandas"}
_NAMESPACES = ("snapbeam", "snapbeam.dynamics", "snapbeam.model", "snapbeam.uncertainty")
Kind = TypeVar("Kind")


_LONGEST_MESSAGE = 8000
_CONTROLS = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff\ud800-\udfff]")
"""Characters that control a terminal or the direction of text, and those that no file format takes as text."""


def printable(text: str, longest: int = _LONGEST_MESSAGE) -> str:
    """Return text that a terminal shows as it is: control characters escaped, and no longer than *longest*."""
    short = text if len(text) <= longest else f"{text[: longest - 4]} ..."
    return _CONTROLS.sub(lambda found: ascii(found[0])[1:-1], short)


class InputError(ValueError):
    """Invalid parameter; the message names the parameter, its value and the allowed values.

    Examples
    --------
    >>> import snapbeam as sb
    >>> try:
    ...     sb.HertzContact(-1.0)
    ... except sb.InputError as error:
    ...     print(error)
    stiffness = -1.0: must be a finite number greater than 0 N/m^1.5
    """

    def __init__(self, *args: Any) -> None:
        super().__init__(*(printable(each) if isinstance(each, str) else each for each in args))


class InputTypeError(InputError, TypeError):
    """A parameter of a kind that cannot be used, such as text where a number belongs.

    Examples
    --------
    >>> import snapbeam as sb
    >>> try:
    ...     sb.HertzContact("stiff")
    ... except sb.InputTypeError as error:
    ...     print(type(error).__name__)
    InputTypeError
    """


_LONGEST = 300
_LONGEST_PATH = 4000
_MOST_NUMBERS = 1e8
_NO_NUMBERS = (bool, np.bool_, np.timedelta64)
"""Kinds that count as numbers in Python or NumPy and are none here."""


def _refuse(name: str, value: Any, allowed: str) -> InputError:
    return InputError(f"{name} = {shown(value)}: must be {allowed}")


def shown(value: Any) -> str:
    """*value* as a message shows it: its representation, if it has one, and no more than a line of it."""
    try:
        text = repr(value)
    except Exception:  # an integer of thousands of digits, an object that cannot describe itself
        return f"<{type(value).__name__}>"
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 4]} ..."


def _require_plain(name: str, value: Any) -> None:
    """Refuse numbers that carry more than numbers, which would be lost: a mask, a unit."""
    if isinstance(value, np.ma.MaskedArray) or value is np.ma.masked:
        raise InputTypeError(f"{name}: must be plain numbers, not a masked array, whose hidden values would be used")
    if type(value).__module__.partition(".")[0] != "xarray" and any(
        hasattr(value, attribute) for attribute in ("units", "unit", "dimensionality")
    ):
        raise InputTypeError(f"{name} = {shown(value)}: must be plain numbers, without a unit of their own")


def _require_room(name: str, value: Any) -> None:
    """Refuse a range whose numbers would fill the memory."""
    if isinstance(value, range) and (value.stop - value.start) // value.step > _MOST_NUMBERS:
        raise InputError(f"{name} = {shown(value)}: must have at most {_MOST_NUMBERS:g} numbers")


def _number(name: str, value: Any, allowed: str) -> float:
    _require_plain(name, value)
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value.item()
    if isinstance(value, _NO_NUMBERS) or not isinstance(value, Real):
        raise InputTypeError(f"{name} = {shown(value)}: must be {allowed}, not {type(value).__name__}")
    try:
        return float(value)
    except (OverflowError, ValueError, TypeError, ArithmeticError):
        raise _refuse(name, value, allowed) from None


def finite(name: str, value: Any, allowed: str = "a finite number") -> float:
    """Return *value* as a float; refuse NaN, infinity and whatever is no real number."""
    number = _number(name, value, allowed)
    if not math.isfinite(number):
        raise _refuse(name, value, allowed)
    return number


def positive(name: str, value: Any, unit: str = "") -> float:
    """Return *value* as a float; refuse what is not finite and greater than zero."""
    allowed = f"a finite number greater than 0{' ' + unit if unit else ''}"
    number = finite(name, value, allowed)
    if not number > 0.0:
        raise _refuse(name, value, allowed)
    return number


def nonnegative(name: str, value: Any, unit: str = "") -> float:
    """Return *value* as a float; refuse what is not finite or less than zero."""
    allowed = f"a finite number of at least 0{' ' + unit if unit else ''}"
    number = finite(name, value, allowed)
    if number < 0.0:
        raise _refuse(name, value, allowed)
    return number


def within(name: str, value: Any, low: float, high: float, *, closed: str = "neither", unit: str = "") -> float:
    """Return *value* as a float inside an interval.

    ``closed`` is ``"neither"``, ``"left"``, ``"right"`` or ``"both"``.
    """
    left = closed in ("left", "both")
    right = closed in ("right", "both")
    interval = f"{'[' if left else '('}{low:g}, {high:g}{']' if right else ')'}"
    allowed = f"a number in {interval}{' ' + unit if unit else ''}"
    number = finite(name, value, allowed)
    above = number >= low if left else number > low
    below = number <= high if right else number < high
    if not (above and below):
        raise _refuse(name, value, allowed)
    return number


def integer(name: str, value: Any, low: int, high: int | None = None) -> int:
    """Return *value* as an int between *low* and *high*, both included."""
    allowed = f"an integer of at least {low}" if high is None else f"an integer in [{low}, {high}]"
    _require_plain(name, value)
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value.item()
    if isinstance(value, _NO_NUMBERS):
        raise InputTypeError(f"{name} = {shown(value)}: must be {allowed}, not {type(value).__name__}")
    if isinstance(value, Integral):
        number = int(value)
    elif isinstance(value, Real):
        real = finite(name, value, allowed)
        if not real.is_integer():
            raise _refuse(name, value, allowed)
        number = int(real)
    else:
        raise InputTypeError(f"{name} = {shown(value)}: must be {allowed}, not {type(value).__name__}")
    if number < low or (high is not None and number > high):
        raise _refuse(name, value, allowed)
    return number


def seed_of(rng: int | np.random.Generator | None) -> int:
    """Return the seed of *rng*: itself, a number that the generator draws, or one from the system (SPEC 7)."""
    if rng is None:
        rng = np.random.default_rng()
    if isinstance(rng, np.random.Generator):
        return int(rng.integers(2**63))
    if isinstance(rng, (str, bytes)) or not isinstance(rng, (Integral, Real, np.ndarray)):
        raise InputTypeError(
            f"rng = {shown(rng)}: must be an integer of at least 0, a numpy.random.Generator or None, not "
            f"{type(rng).__name__}"
        )
    return integer("rng", rng, 0, 2**63 - 1)


def flag(name: str, value: Any) -> bool:
    """Return *value* if it is True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise InputTypeError(f"{name} = {shown(value)}: must be True or False, not {type(value).__name__}")
    return bool(value)


def choice(name: str, value: Any, allowed: tuple[str, ...]) -> str:
    """Return *value* if it is one of the words *allowed*."""
    words = ", ".join(repr(word) for word in allowed)
    if not isinstance(value, str):
        raise InputTypeError(f"{name} = {shown(value)}: must be one of {words}, not {type(value).__name__}")
    if value not in allowed:
        raise InputError(f"{name} = {shown(value)}: must be one of {words}")
    return value


def finite_array(name: str, value: Any, ndim: int | None = None) -> NDArray[np.float64]:
    """Return *value* as a float64 array; refuse text, NaN, infinity and a wrong number of dimensions."""
    _require_plain(name, value)
    _require_room(name, value)
    try:
        raw = np.asarray(value)
    except ValueError:
        raise InputError(f"{name}: must be an array of numbers, not a list of unequal lengths") from None
    except Exception as error:
        raise InputTypeError(f"{name} = {shown(value)}: must be an array of numbers ({error})") from None
    if raw.dtype.kind not in "iuf":
        raise InputTypeError(f"{name} = {shown(value)}: must be an array of numbers, not of {raw.dtype}")
    array = np.array(raw, dtype=np.float64)
    if ndim is not None and array.ndim != ndim:
        raise InputError(f"{name} of shape {array.shape}: must have {ndim} dimension(s)")
    bad = ~np.isfinite(array)
    if bad.any():
        first = tuple(int(i) for i in np.argwhere(bad)[0])
        raise InputError(f"{name}{list(first)} = {array[first]!r}: must be finite")
    return array


def axis(name: str, value: Any, low: float, high: float, *, closed: str = "neither") -> NDArray[np.float64]:
    """Return *value* as a strictly increasing 1-D axis whose points all lie in the interval."""
    array = finite_array(name, value)
    if array.ndim != 1:
        raise InputError(f"{name} of shape {array.shape}: must be a number or a one-dimensional array")
    if array.size == 0:
        raise InputError(f"{name} = []: must hold at least one point")
    for point in (array.min(), array.max()):
        within(name, float(point), low, high, closed=closed)
    steps = np.diff(array)
    if (steps <= 0.0).any():
        at = int(np.argmax(steps <= 0.0))
        raise InputError(
            f"{name}[{at}] = {array[at]:g}, {name}[{at + 1}] = {array[at + 1]:g}: must be strictly increasing"
        )
    return array


def interval(name: str, value: Any) -> tuple[float, float]:
    """Return *value* as two finite numbers, of which the second is larger."""
    limits = finite_array(name, value, 1)
    if limits.size != 2 or not limits[0] < limits[1]:
        raise InputError(f"{name} = {shown(value)}: must be two numbers, of which the second is larger")
    return float(limits[0]), float(limits[1])


def file_path(name: str, value: Any) -> Path:
    """Return *value* as a path; refuse what is none, such as a number, which would name a stream of the process."""
    if not isinstance(value, (str, os.PathLike)) or "\0" in str(value):
        raise InputTypeError(f"{name} = {shown(value)}: must be a path")
    path = Path(value)
    try:
        os.fsencode(path)
    except UnicodeEncodeError as error:
        raise InputError(f"{name} = {shown(str(value))}: cannot be encoded in this locale ({error.encoding})") from None
    if len(os.fsencode(path)) > _LONGEST_PATH or any(len(os.fsencode(part)) > 255 for part in path.parts):
        raise InputError(f"{name} = {shown(str(value))}: must be a path of names up to 255 bytes")
    return path


def text(name: str, value: str) -> str:
    """Return *value* if every file format takes it: no lone surrogates, which stand for bytes that are not UTF-8."""
    try:
        value.encode()
    except UnicodeEncodeError:
        raise InputError(f"{name} = {shown(value)}: must be text that UTF-8 can encode") from None
    return value


def require_texts(name: str, value: Any, depth: int = 8) -> None:
    """Refuse what :func:`text` refuses, also as a key or an item of mappings, sequences and arrays down to a *depth*."""
    if isinstance(value, str):
        text(name, value)
    elif isinstance(value, Mapping) and depth:
        for key, item in value.items():
            require_texts(f"{name}: key", key, depth - 1)
            require_texts(f"{name}[{shown(key)}]", item, depth - 1)
    elif isinstance(value, (list, tuple, set, frozenset)) and depth:
        for item in value:
            require_texts(name, item, depth - 1)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "OU":
        for item in value.flat:
            require_texts(name, item, 0)


def mapping(name: str, value: Any) -> Mapping[Any, Any]:
    """Return *value* if it is a mapping, such as a dictionary."""
    if not isinstance(value, Mapping):
        raise InputTypeError(f"{name} = {shown(value)}: must be a mapping, not {type(value).__name__}")
    return value


def parsed_json(text: Any, name: str) -> dict[str, Any]:
    """Object of a JSON text; raises an error with the name of the source if it is damaged."""
    try:
        found = json.loads(text)
    except (TypeError, ValueError, RecursionError) as error:
        raise InputError(f"{name}: its description is damaged ({error})") from None
    if not isinstance(found, dict):
        raise InputError(f"{name}: its description is damaged")
    return found


def callback(name: str, value: Any) -> Any:
    """Return *value* if it is None or can be called."""
    if value is not None and not callable(value):
        raise InputTypeError(f"{name} = {shown(value)}: must be callable")
    return value


def instance(name: str, value: Any, kind: type, words: str) -> Any:
    """Return *value* if it is of a kind, which *words* describe."""
    if not isinstance(value, kind):
        raise InputTypeError(f"{name} = {shown(value)}: must be {words}, not {type(value).__name__}")
    return value


def or_default(name: str, value: Any, kind: type, words: str) -> Any:
    """Return *value* if it is of a kind, and one of that kind with its default values for None."""
    return instance(name, kind() if value is None else value, kind, words)


# Types of the arguments of public functions, checked against their annotations.


class _Names(dict[str, Any]):
    """Names of annotations that a module imports for its type checks alone: xarray's and snapbeam's own."""

    def __init__(self, package: str) -> None:
        super().__init__()
        self._namespaces = dict.fromkeys((package, *_NAMESPACES))

    def __missing__(self, name: str) -> Any:
        if name in _LIBRARIES:
            return import_module(_LIBRARIES[name])
        for namespace in map(import_module, self._namespaces):
            if name in getattr(namespace, "__all__", ()):
                return getattr(namespace, name)
        raise KeyError(name)


def _kinds(function: Callable[..., Any]) -> dict[str, Any]:
    """Allowed types of each parameter, as far as its annotation can be read."""
    found = {}
    package = ".".join(function.__module__.split(".")[:2])
    for each in inspect.signature(function).parameters.values():
        if each.kind in (each.VAR_POSITIONAL, each.VAR_KEYWORD) or each.annotation is each.empty:
            continue
        annotation = each.annotation
        if isinstance(annotation, str):
            holder = type(each.name, (), {"__annotations__": {each.name: annotation}})
            try:
                annotation = typing.get_type_hints(holder, function.__globals__, _Names(package))[each.name]
            except Exception:
                continue
        found[each.name] = annotation
    return found


def _members(annotation: Any) -> list[Any]:
    if typing.get_origin(annotation) in (typing.Union, types.UnionType):
        return [each for part in typing.get_args(annotation) for each in _members(part)]
    return [annotation]


def _suits(value: Any, kind: Any) -> bool:
    """Return whether *value* can be of a type; True where the type cannot be checked."""
    origin = typing.get_origin(kind) or kind
    if kind is Any or kind is object:
        return True
    if kind is None or kind is type(None):
        return value is None
    if origin is typing.Literal:
        return True  # the function names the words that it takes
    if kind is float or kind is int:
        return isinstance(value, Real) or (isinstance(value, np.ndarray) and value.ndim == 0)
    if origin in (tuple, list):
        origin = Sequence
    if origin in (Sequence, Iterable):
        if isinstance(value, np.ndarray):
            return value.ndim > 0
        return isinstance(value, origin) and not isinstance(value, (str, bytes))
    if origin is np.ndarray:
        return True  # checked, with its numbers, where it is used
    if not isinstance(origin, type) or getattr(origin, "_is_protocol", False):
        return origin is not Callable or callable(value)
    return isinstance(value, origin)


def _words(kinds: list[Any]) -> str:
    names = []
    for kind in kinds:
        origin = typing.get_origin(kind) or kind
        if kind is None or kind is type(None):
            names.append("None")
        elif origin is tuple and typing.get_args(kind) == (float, float):
            names.append("two numbers")
        elif origin in (tuple, list):
            names.append("a sequence")
        elif origin in _ABSTRACT:
            names.append(_ABSTRACT[origin])
        elif kind in (float, int):
            names.append("a number")
        elif kind is str:
            names.append("text")
        else:
            names.append(getattr(origin, "__name__", str(origin)))
    return " or ".join(dict.fromkeys(names))


def checked(function: _F) -> _F:
    """Raise an error for arguments of another type than the annotations of *function*, before it begins.

    What is a number, a flag, a dataset, a system or a sequence is decided here, and that text can be encoded; which numbers
    and words are allowed is the function's to say.

    Raises
    ------
    InputTypeError
        By the function that comes of it: the parameter, its value and what it must be.
    InputError
        Likewise for text with lone surrogates, which no file takes.  Paths may have any bytes.
    """
    signature = inspect.signature(function)
    known: dict[str, list[Any]] = {}

    @functools.wraps(function)
    def checked(*args: Any, **named: Any) -> Any:
        if not known:
            known.update({name: _members(kind) for name, kind in _kinds(function).items()})
        try:
            given = signature.bind(*args, **named).arguments
        except TypeError:
            return function(*args, **named)  # which says so in Python's words
        for name, value in given.items():
            kinds = known.get(name)
            if kinds is None or not any((typing.get_origin(kind) or kind) in (os.PathLike, Path) for kind in kinds):
                require_texts(name, value)
            if kinds is None:
                continue
            if bool in kinds and len(kinds) == 1:
                flag(name, value)
            elif not any(_suits(value, kind) for kind in kinds):
                raise InputTypeError(f"{name} = {shown(value)}: must be {_words(kinds)}, not {type(value).__name__}")
        return function(*args, **named)

    return typing.cast(_F, checked)


# Things by name, some of which are made when they are first asked for.


class NamedTable(dict[str, Kind]):
    """A list of things by name, *listed* or by *find*, such as ``sine+burst`` or ``impacts_contact_2``."""

    def __init__(self, find: Callable[[str], Kind | None], listed: Iterable[tuple[str, Kind]] = ()) -> None:
        super().__init__(listed)
        self._find = find

    def __missing__(self, name: str) -> Kind:
        found = self._find(name) if isinstance(name, str) else None
        if found is None:
            raise KeyError(name)
        return found

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and (super().__contains__(name) or self._find(name) is not None)

    def get(self, name: str, default: Any = None) -> Any:
        """Return the value of a key, as for any mapping."""
        return self[name] if name in self else default
