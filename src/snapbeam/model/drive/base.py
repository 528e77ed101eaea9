"""Base class of drives, and the drives by name."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.components import Component, Tone
from snapbeam.model.extension import check_defined, check_names, overrides
from snapbeam.model.quantity import check_fields, numbers_type
from snapbeam.util.diagnostics import Diagnostic
from snapbeam.util.validation import InputError, NamedTable

if TYPE_CHECKING:
    from snapbeam.model.reduced_model import ReducedModel

_Array = NDArray[np.float64]


def _sum_named(name: str) -> type[Drive] | None:
    from snapbeam.model.drive.sum import named

    return named(name) if "+" in name else None


DRIVES: dict[str, type[Drive]] = NamedTable(_sum_named)
"""Every drive by the name it has in parameter files; one such as ``sine+burst`` is found too, though not listed."""


class Scale(NamedTuple):
    """Scales of the normalised quantities of a drive."""

    length: float
    """Length that normalises displacements, m: the buckling level b."""
    omega: float
    """Angular frequency that Omega and V are normalised by, rad/s."""


def smooth_rise(x: float) -> tuple[float, float, float]:
    """x^3 (10 - 15 x + 6 x^2), from 0 to 1 with x, and its first two derivatives."""
    return (
        x * x * x * (10.0 + x * (6.0 * x - 15.0)),
        30.0 * x * x * (1.0 - x) * (1.0 - x),
        60.0 * x * (1.0 - x) * (1.0 - 2.0 * x),
    )


def sincos(angle: float) -> tuple[float, float]:
    """Sine and cosine of an angle, rad."""
    return math.sin(angle), math.cos(angle)


class Drive:
    """A prescribed motion of the striker's tip about its mid-position: a frozen dataclass in a file of its own.

    Its motion is a function of one argument that grows by ``omega`` radians a second.  A drive that
    is not a sine brings ``motion(drive, memory, argument)``, a scalar function of numbers that
    returns displacement (m) and velocity (m/s), and ``acceleration`` in the same way (m/s^2); ``drive`` contains its numbers and ``memory[drive.table:]`` its samples.  :class:`Timed` is the base of
    drives that do not repeat.

    The numbers have the names ``number_names``, of which ``omega`` is the first.  ``amplitudes`` names those that the motion is
    proportional to, and ``discontinuities`` those that are times at which a derivative of the motion jumps.  A name that none
    of the hooks has is refused when the class is defined; names of your own begin with an underscore.

    Examples
    --------
    >>> import snapbeam as sb
    >>> isinstance(sb.Sine(frequency_ratio=1.2, velocity_amplitude=0.18), sb.Drive)
    True
    """

    hooks: ClassVar[tuple[str, ...]] = (
        "name", "number_names", "amplitudes", "discontinuities", "numbers", "cycle", "frequencies", "bounds",
        "mirrored_bounds", "peak_acceleration", "motion", "acceleration", "samples", "components", "diagnostics",
        "file_keys", "file_gives",
    )  # fmt: skip
    """Names that are read of a drive of one's own."""
    required: ClassVar[tuple[str, ...]] = ("numbers", "cycle", "bounds")
    """Hooks without which a drive cannot move."""
    name: ClassVar[str] = ""
    """In parameter files and attributes."""
    harmonic: ClassVar[bool] = False
    """True for the sine, which is built into the solver."""
    is_periodic: ClassVar[bool] = True
    """True if the motion repeats after one turn of its argument; otherwise one turn is longer than any run."""
    recorded: ClassVar[bool] = False
    """True for a record of a certain ``duration``."""
    integrated_as: ClassVar[type[Drive] | None] = None
    """The drive whose motion it has, if it is integrated as another one."""
    number_names: ClassVar[tuple[str, ...]] = ("omega",)
    terms: ClassVar[tuple[type[Drive], ...]] = ()
    """The kinds that it is a sum of."""
    amplitudes: ClassVar[tuple[str, ...]] = ("amplitude",)
    """Numbers that the motion is proportional to, all together."""
    discontinuities: ClassVar[tuple[str, ...]] = ()
    """Numbers that are times at which the velocity or one of its derivatives jumps, s since the drive began: steps end there."""
    registry: ClassVar[dict[str, type[Drive]]] = DRIVES
    """Registry of the class, by name."""

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        check_names(cls)
        if cls.name:
            moving = ["motion", "acceleration"]
            check_defined(cls, Drive, [*cls.required, *([] if cls.harmonic else moving)])
            unread = [each for each in moving if cls.harmonic and overrides(cls, Drive, each)]
            if unread:
                raise InputError(f"{cls.__name__}.{unread[0]}: is not read of a sine; set harmonic = False")
            for hook in ("discontinuities", "amplitudes"):
                strange = set(getattr(cls, hook)) - set(cls.number_names)
                # a drive that does not name its amplitudes has the default
                if strange and (hook == "discontinuities" or cls.amplitudes is not Drive.amplitudes):
                    raise InputError(
                        f"{cls.__name__}.{hook} = {getattr(cls, hook)}: {', '.join(sorted(strange))} is not among the numbers "
                        f"{', '.join(cls.number_names)}; name it in number_names, or leave it out of {hook}"
                    )
            cls.registry[cls.name] = cls

    def __post_init__(self) -> None:
        check_fields(self)

    def __add__(self, other: Drive) -> Drive:
        """One over the other, a :class:`~snapbeam.SumDrive`."""
        from snapbeam.model.drive.sum import SumDrive

        return SumDrive.of(self, other)

    @classmethod
    def numbers_type(cls) -> Any:
        """The named tuple of the drive's numbers, as its motion gets them; an attribute of the class, ``Numbers``."""
        return numbers_type(cls, cls.number_names)

    def values(self) -> dict[str, float]:
        """The fields that are plain numbers, by name."""
        fields = dataclasses.fields(self)  # type: ignore[arg-type]
        found = {item.name: getattr(self, item.name) for item in fields}
        return {name: value for name, value in found.items() if isinstance(value, float)}

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

    def samples(self) -> _Array:
        """Table of samples, one row; empty for a formula."""
        return np.empty(0)

    def diagnostics(self, section: str, model: ReducedModel) -> list[Diagnostic]:
        """Diagnostics of values that are implausible for a model; none by default."""
        return []


# ----------------------------------------------------------------------------------------------------
# Drives that do not repeat: their motion is a formula of the time since they began.


HORIZON = 1 << 24
"""Cycles in which the argument of such a drive makes its one turn: more than a run may last."""


class Timed(Drive):
    """A drive whose motion depends on the time since it began; its displacement begins at zero, without a jump.

    A motion gets the argument omega t, where omega is so small that it never turns round; ``fastest`` bounds the angular
    frequency of what happens, rad/s.  A subclass brings :meth:`cycle`, :meth:`shape_numbers`, :meth:`bounds`, and
    ``motion`` and ``acceleration``.
    """

    is_periodic = False
    hooks = (*Drive.hooks, "shape_numbers")
    required: ClassVar[tuple[str, ...]] = ("shape_numbers", "cycle", "bounds")

    def shape_numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """Numbers in addition to ``omega``."""
        raise NotImplementedError

    def numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """The rate of the argument, and what the subclass needs."""
        return {"omega": 2.0 * math.pi / (HORIZON * self.cycle(columns, scale))} | self.shape_numbers(
            columns, scale
        )
