"""The sum of drives: any number of the motions that there are, one over the other."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.base import DRIVES, SUMS, Drive, Scale, Timed
from snapbeam.model.drive.components import Component, Tone
from snapbeam.model.drive.force import FORCES, ForceHistory
from snapbeam.util.validation import InputError, instance

_Array = NDArray[np.float64]
_SEPARATOR = "__"
_JOIN = "+"
MOST_TERMS = 4


class SumDrive(Timed):
    """Sum of two to four drives.

    The displacement of the tip is

        w_s(t) = w_0 + sum_i [w_i(t) - w_i(0)],

    without a jump at w_0. Use :meth:`of` or ``+`` to create a sum: ``Sine(...) + Burst(...)``.

    In parameter files its type is ``"sine+burst"``; the parameters of term i end with its number:
    ``frequency_ratio_1``, ``duration_cycles_2``. A cycle is one of the first term.

    See Also
    --------
    snapbeam.Drive, snapbeam.Sine

    Examples
    --------
    >>> import snapbeam as sb
    >>> drive = sb.Sine(frequency_ratio=1.2, velocity_amplitude=0.1) + sb.Sine(
    ...     frequency_ratio=1.8, velocity_amplitude=0.05
    ... )
    >>> isinstance(drive, sb.SumDrive)
    True
    """

    hooks = (*Timed.hooks, "terms")
    terms: ClassVar[tuple[type[Drive], ...]] = ()
    """Kinds of its terms."""

    @classmethod
    def of(cls, *drives: Drive) -> SumDrive:
        """The sum of two to four drives, sums included, in their order.

        Raises
        ------
        InputError
            For a recorded drive, whose clock is its own, for a stop, which adds nothing, and for more terms.
        """
        flat: list[Drive] = []
        for drive in drives:
            instance("drive", drive, Drive, "a drive, such as Sine(...)")
            if drive.recorded:
                raise InputError(
                    f"drive = {drive.name!r} in a sum: a recording has its own time axis; add the records instead"
                )
            flat += drive.parts_of_sum if isinstance(drive, SumDrive) else [drive]
        made = mixture(tuple(type(each) for each in flat))
        values = {
            f"{item.name}_{i}": getattr(each, item.name)
            for i, each in enumerate(flat, 1)
            for item in dataclasses.fields(each)  # type: ignore[arg-type]
        }
        return made(**values)

    @property
    def parts_of_sum(self) -> list[Drive]:
        """Terms of the sum."""
        return [
            kind(**{name: getattr(self, f"{name}_{i}") for name in _names(kind)})
            for i, kind in enumerate(self.terms, 1)
        ]

    def __post_init__(self) -> None:
        super().__post_init__()
        self.parts_of_sum  # noqa: B018  terms refuse what they are not

    @classmethod
    def can_excite_base(cls) -> bool:
        """Return whether every term has a bounded acceleration."""
        return all(kind.can_excite_base() for kind in cls.terms)

    def each_term(self, columns: Mapping[str, _Array]) -> list[tuple[int, Drive, dict[str, _Array]]]:
        """Number, drive and columns of every term."""
        found = []
        for i, drive in enumerate(self.parts_of_sum, 1):
            own = {name: columns[f"{name}_{i}"] for name in _names(type(drive)) if f"{name}_{i}" in columns}
            found.append((i, drive, own or {"": np.zeros(next(iter(columns.values())).size)}))
        return found

    def cycle(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """Cycle of the first term."""
        _, drive, own = self.each_term(columns)[0]
        return drive.cycle(own, scale)

    def _begun(self, drive: Drive, own: Mapping[str, _Array], scale: Scale) -> _Array:
        """Initial displacement of a term: nonzero only for a sine with a phase."""
        runs = next(iter(own.values())).size
        if not drive.harmonic or "phase" not in own:
            return np.zeros(runs)
        return np.asarray(drive.numbers(own, scale)["amplitude"] * np.sin(own["phase"]))

    def shape_numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """Highest rate of the terms, rad/s."""
        every = [drive.numbers(own, scale) for _, drive, own in self.each_term(columns)]
        return {"fastest": np.maximum.reduce([each.get("fastest", each["omega"]) for each in every])}

    def jumps(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """Those of every term, whose number begins the name."""
        return {
            f"{i} {name}": times
            for i, drive, own in self.each_term(columns)
            for name, times in drive.jumps(own, scale).items()
        }

    def components_until(self, columns: Mapping[str, _Array], scale: Scale, until: _Array) -> list[Component]:
        """Those of every term, each less where it begins."""
        found: list[Component] = []
        for _, drive, own in self.each_term(columns):
            begun = self._begun(drive, own, scale)
            found += [
                each._replace(mean=each.mean - begun) if isinstance(each, Tone) and drive.harmonic else each
                for each in drive.components_until(own, scale, until)
            ]
        return found

    def frequencies(self, columns: Mapping[str, _Array], scale: Scale) -> list[_Array] | None:
        """Frequencies of every term; None if one of them is not periodic."""
        found: list[_Array] = []
        for _, drive, own in self.each_term(columns):
            of_term = drive.frequencies(own, scale)
            if of_term is None:
                return None
            found += of_term
        return found

    def bounds(self, columns: Mapping[str, _Array], scale: Scale) -> tuple[_Array, _Array]:
        """All terms at their heights at once."""
        pairs = [
            (drive.bounds(own, scale), self._begun(drive, own, scale)) for _, drive, own in self.each_term(columns)
        ]
        highest = sum(pair[0] - begun for pair, begun in pairs)
        return np.asarray(highest), np.asarray(sum(pair[1] for pair, _ in pairs))

    def mirrored_bounds(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """The same of the mirror image."""
        return np.asarray(
            sum(
                drive.mirrored_bounds(own, scale) + self._begun(drive, own, scale)
                for _, drive, own in self.each_term(columns)
            )
        )

    def peak_acceleration(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """All terms at their hardest at once."""
        return np.asarray(sum(drive.peak_acceleration(own, scale) for _, drive, own in self.each_term(columns)))


class SumForce(ForceHistory, SumDrive):
    """Sum of two to four forces, F(t) = sum_i F_i(t)."""

    @property
    def constant_part(self) -> float:
        """Sum of the constant parts of the terms, N."""
        return sum(each.constant_part for each in self.parts_of_sum if isinstance(each, ForceHistory))

    @classmethod
    def can_excite_base(cls) -> bool:
        """A force moves no base."""
        return False

    def _begun(self, drive: Drive, own: Mapping[str, _Array], scale: Scale) -> _Array:
        """Zero: a force may begin with a jump."""
        return np.zeros(next(iter(own.values())).size)


def _names(kind: type[Drive]) -> list[str]:
    return [item.name for item in dataclasses.fields(kind)]  # type: ignore[arg-type]


def mixture(kinds: tuple[type[Drive], ...]) -> type[SumDrive]:
    """The class of the sums of such kinds of drives."""
    words = " + ".join(kind.name for kind in kinds)
    if not 2 <= len(kinds) <= MOST_TERMS:
        raise InputError(f"{words or 'no drive'}: a sum has 2 to {MOST_TERMS} terms")
    for kind in kinds:
        if kind.recorded or kind.name == "fixed" or kinds[0].registry.get(kind.name) is not kind:
            raise InputError(
                f"{words}: {kind.name!r} cannot be a term of a sum; a recording has its own time axis, a stop adds nothing, and a force is no motion"
            )
    name = _SEPARATOR.join(["SumDrive", *(kind.name for kind in kinds)])
    if name not in globals():
        globals()[name] = _made(name, kinds)
    found: type[SumDrive] = globals()[name]
    return found


def _made(name: str, kinds: tuple[type[Drive], ...]) -> type[SumDrive]:
    fields: list[tuple[str, Any, Any]] = []
    for i, kind in enumerate(kinds, 1):
        for item in dataclasses.fields(kind):  # type: ignore[arg-type]
            own = item.metadata["quantity"]
            more = dataclasses.replace(
                own, long_name=f"{own.long_name}, of term {i}", short=f"{own.short or item.name}_{i}"
            )
            made = dataclasses.field(default=item.default, metadata={"quantity": more})
            fields.append((f"{item.name}_{i}", item.type, made))
    body = {
        "__module__": __name__,
        "__qualname__": name,
        "__doc__": f"The sum of {', '.join(kind.name for kind in kinds)}.",
        "terms": kinds,
    }
    bases = (SumForce if issubclass(kinds[0], ForceHistory) else SumDrive,)
    found: Any = dataclasses.make_dataclass(name, fields, bases=bases, namespace=body, frozen=True, kw_only=True)
    found.name = _JOIN.join(kind.name for kind in kinds)  # later than the class, so that no table of drives has it
    mixed: type[SumDrive] = found
    return mixed


def named(name: str, known: Mapping[str, type[Drive]], join: str = _JOIN) -> type[SumDrive] | None:
    """The class of a kind such as ``"sine+burst"`` of *known* ones; None if it is none."""
    words = name.split(join)
    return (
        mixture(tuple(known[word] for word in words))
        if len(words) > 1 and all(map(known.__contains__, words))
        else None
    )


def __getattr__(name: str) -> type[SumDrive]:
    """A mixture by its name, as another process knows it."""
    kinds = name.removeprefix(f"SumDrive{_SEPARATOR}")
    found = named(kinds, {**DRIVES, **FORCES}, _SEPARATOR) if kinds != name else None
    if found is None:
        raise AttributeError(name)
    return found


SUMS |= {"of": SumDrive.of, "named": named}
