"""Base class of drives, and the drives by name."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.components import Component, Tone, fitted, side_by_side
from snapbeam.model.extension import check_defined, check_names, overrides
from snapbeam.model.quantity import RUN, check_fields, quantity
from snapbeam.util.diagnostics import Diagnostic
from snapbeam.util.validation import InputError, NamedTable

if TYPE_CHECKING:
    from snapbeam.model.reduced_model import ReducedModel

_Array = NDArray[np.float64]


SUMS: dict[str, Callable[..., Any]] = {}
"""Functions on sums of drives, which :mod:`snapbeam.model.drive.sum` enters: "of" adds drives, "named" finds a kind of sum."""
DRIVES: dict[str, type[Drive]] = NamedTable(lambda name: SUMS["named"](name, DRIVES))
"""Every drive by the name it has in parameter files; one such as ``sine+burst`` is found too, though not listed."""


# Fields that several drives share.


def excitation_ratio() -> Any:
    """Return the field of a frequency over that of the first mode."""
    text = "excitation frequency over the first natural frequency"
    return quantity("1", text, low=0.0, scope=RUN, symbol=r"\Omega")


def velocity_ratio() -> Any:
    """Return the field of a velocity amplitude."""
    return quantity("1", "velocity amplitude over b omega_1", low=0.0, closed="left", scope=RUN, symbol="V")


def displacement_ratio() -> Any:
    """Return the field of a displacement amplitude."""
    return quantity("1", "displacement amplitude over b", low=0.0, closed="left", scope=RUN, symbol="A/b")


def acceleration_ratio() -> Any:
    """Return the field of an acceleration amplitude."""
    return quantity("1", "acceleration amplitude over b omega_1^2", low=0.0, closed="left", scope=RUN)


class Scale(NamedTuple):
    """Scales of the normalised quantities of a drive."""

    length: float
    """Length that normalises displacements, m: the buckling level b."""
    omega: float
    """Angular frequency that Omega and V are normalised by, rad/s."""


class Drive:
    """A prescribed motion of the striker's tip about its mid-position: a frozen dataclass in a file of its own.

    The motion is the sum of its ``components``: tones, polynomials in pieces and sweeps of the time since the drive
    began (:mod:`snapbeam.model.drive.components`), or a scalar function ``motion(drive, t)`` that returns displacement
    (m) and velocity (m/s); ``drive`` has the numbers by name. The function is approximated by quintics within 1e-9 of
    its maximum. Drives that do not repeat derive from :class:`Timed`.

    ``numbers`` returns the numbers, of which ``omega`` is the rate of the phase (rad/s). A field ``phase`` is the phase
    at the start, one of the *columns*; the phase of a state replaces it. ``discontinuities`` names the times at which
    the motion or a derivative jumps. Names of your own begin with an underscore; others are refused.

    See Also
    --------
    snapbeam.Striker, snapbeam.SumDrive, snapbeam.quantity

    Examples
    --------
    >>> import snapbeam as sb
    >>> isinstance(sb.Sine(frequency_ratio=1.2, velocity_amplitude=0.18), sb.Drive)
    True
    """

    hooks: ClassVar[tuple[str, ...]] = (
        "name", "discontinuities", "numbers", "cycle", "frequencies", "bounds", "mirrored_bounds", "peak_acceleration",
        "components", "motion", "diagnostics", "file_keys", "file_gives",
    )  # fmt: skip
    """Names that are read of a drive of one's own."""
    required: ClassVar[tuple[str, ...]] = ("numbers", "cycle", "bounds")
    """Hooks without which a drive cannot move."""
    name: ClassVar[str] = ""
    """Name in parameter files and attributes."""
    harmonic: ClassVar[bool] = False
    """True for a sine, whose tone has the numbers ``omega`` and ``amplitude``."""
    is_periodic: ClassVar[bool] = True
    """True if the motion repeats after one turn of its phase; otherwise one turn is longer than any run."""
    recorded: ClassVar[bool] = False
    """True for a record of a certain ``duration``."""
    discontinuities: ClassVar[tuple[str, ...]] = ()
    """Numbers that are times at which the velocity or one of its derivatives jumps, s since the drive began: steps end there."""
    registry: ClassVar[dict[str, type[Drive]]] = DRIVES
    """Registry of the class, by name."""

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        check_names(cls)
        if cls.name:
            check_defined(cls, Drive, cls.required)
            moving = [each for each in ("components", "motion") if overrides(cls, Drive, each)]
            if cls.harmonic and moving:
                raise InputError(f"{cls.__name__}.{moving[0]}: is not read of a sine; set harmonic = False")
            if not cls.harmonic and len(moving) != 1:
                raise InputError(
                    f"{cls.__name__}: has {' and '.join(moving) or 'no components and no motion'}; see the docstring of Drive "
                    "and define one of components and motion"
                )
            cls.registry[cls.name] = cls

    def __post_init__(self) -> None:
        check_fields(self)

    def __add__(self, other: Drive) -> Drive:
        """One over the other, a :class:`~snapbeam.SumDrive`."""
        found: Drive = SUMS["of"](self, other)
        return found

    def values(self) -> dict[str, float]:
        """The fields that are plain numbers, by name."""
        fields = dataclasses.fields(self)  # type: ignore[arg-type]
        found = {item.name: getattr(self, item.name) for item in fields}
        return {name: value for name, value in found.items() if isinstance(value, float)}

    def columns(self) -> dict[str, _Array]:
        """:meth:`values` as columns of one run."""
        return {name: np.array([value]) for name, value in self.values().items()} or {"": np.zeros(1)}

    def numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """The numbers of many runs, arrays of shape (runs,), from its fields as such arrays."""
        raise NotImplementedError

    def cycle(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """Seconds of one cycle of excitation, shape (runs,)."""
        raise NotImplementedError

    def frequencies(self, columns: Mapping[str, _Array], scale: Scale) -> list[_Array] | None:
        """Angular frequencies (rad/s) that the motion consists of, arrays of shape (runs,); None: it does not repeat."""
        return [2.0 * math.pi / self.cycle(columns, scale)] if self.is_periodic else None

    def bounds(self, columns: Mapping[str, _Array], scale: Scale) -> tuple[_Array, _Array]:
        """Highest displacement (m) from the mid-position and maximum speed (m/s) ever, shape (runs,)."""
        raise NotImplementedError

    def mirrored_bounds(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """Bound of the displacement of the mirrored motion; differs from :meth:`bounds` if asymmetric."""
        return self.bounds(columns, scale)[0]

    @classmethod
    def can_excite_base(cls) -> bool:
        """Return whether a base may have this motion: its acceleration has a known bound."""
        return cls.peak_acceleration is not Drive.peak_acceleration

    def peak_acceleration(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """Maximum acceleration (m/s^2) ever, shape (runs,): of a motion that a base may have."""
        raise NotImplementedError

    def components(self, columns: Mapping[str, _Array], scale: Scale) -> list[Component]:
        """Tones, pieces and sweeps of which the motion is the sum; of a sine the tone of its numbers."""
        if not self.harmonic:
            raise NotImplementedError
        found = self.numbers(columns, scale)
        return [Tone(found["amplitude"], found["omega"], columns.get("phase", 0.0), found.get("mean", 0.0))]

    def jumps(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """Times of the discontinuities since the drive began, s, by name; arrays of shape (runs,).

        Raises
        ------
        InputError
            For a discontinuity that is not among the numbers.
        """
        if not self.discontinuities:
            return {}
        found = self.numbers(columns, scale)
        for name in self.discontinuities:
            if name not in found:
                raise InputError(
                    f"{type(self).__name__}.discontinuities = {self.discontinuities}: {name} is not among the numbers "
                    f"{', '.join(found)}; return it from numbers or shape_numbers, or leave it out of discontinuities"
                )
        later = columns.get("phase", 0.0) / found["omega"]
        return {name: found[name] - later for name in self.discontinuities}

    def components_until(self, columns: Mapping[str, _Array], scale: Scale, until: _Array) -> list[Component]:
        """The components, valid up to a time of each run (s), shape (runs,); of a :meth:`motion` quintics that approximate it."""
        if not overrides(type(self), Drive, "motion"):
            return self.components(columns, scale)
        kind: Any = type(self)
        numbers, jumps = self.numbers(columns, scale), self.jumps(columns, scale)
        phase, until = columns.get("phase", 0.0), np.maximum(until, self.cycle(columns, scale))
        parts = np.broadcast_arrays(*numbers.values(), phase, *jumps.values(), until)
        rows, which = np.unique(np.stack(parts, axis=1), axis=0, return_inverse=True)
        turn = math.tau if self.is_periodic else math.inf
        found = []
        for row in rows.tolist():
            drive, begun = SimpleNamespace(**dict(zip(numbers, row, strict=False))), row[len(numbers)]

            def moved(t: float, drive: Any = drive, begun: float = begun) -> tuple[float, float]:
                w, v = kind.motion(drive, math.fmod(drive.omega * t + begun, turn) / drive.omega)
                return w, v

            longest = 1.5 / max(getattr(drive, "fastest", drive.omega), 1e-300)
            found.append(fitted(kind.__name__, moved, row[-1], longest, row[len(numbers) + 1 : -1]))
        return [side_by_side(found, which.reshape(-1))]

    def diagnostics(self, section: str, model: ReducedModel) -> list[Diagnostic]:
        """Diagnostics of values that are implausible for a model; none by default."""
        return []


# ----------------------------------------------------------------------------------------------------
# Drives that do not repeat: their motion is a formula of the time since they began.


HORIZON = 1 << 24
"""Cycles in which the phase of such a drive makes its one turn: more than a run may last."""


class Timed(Drive):
    """A drive whose motion depends on the time since it began; its displacement begins at zero, without a jump.

    Its phase is omega t, where omega is so small that it never turns round; ``fastest`` bounds the angular frequency of what
    happens, rad/s.  A subclass brings :meth:`cycle`, :meth:`shape_numbers`, :meth:`bounds`, and ``components`` or ``motion``.
    """

    is_periodic = False
    hooks = (*Drive.hooks, "shape_numbers")
    required: ClassVar[tuple[str, ...]] = ("shape_numbers", "cycle", "bounds")

    def shape_numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """Numbers in addition to ``omega``."""
        raise NotImplementedError

    def numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """The rate of the phase, and what the subclass needs."""
        return {"omega": 2.0 * math.pi / (HORIZON * self.cycle(columns, scale))} | self.shape_numbers(columns, scale)
