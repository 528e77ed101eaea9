"""Histories given by evenly spaced samples, and the keys by which a parameter file names the file of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.drive.base import Scale, Timed
from snapbeam.model.quantity import check_fields
from snapbeam.util.validation import InputError, choice, finite_array

_Array = NDArray[np.float64]

_KNOTS = 8.0
"""Samples in the shortest period that the steps resolve."""
DRIFT = ("keep", "remove")
"""Treatments of the drift of a record: nothing, or subtraction of the straight line fitted to its samples."""


class Sampled(Timed):
    """A history by its ``record`` at ``sampling_frequency``, which ends with the record.  A cycle is a period of the first mode."""

    recorded = True
    record: Any
    sampling_frequency: Any

    def __post_init__(self) -> None:
        check_fields(self)
        record = finite_array("record", self.record, 1).copy()
        if record.size < 4:
            raise InputError(f"record of {record.size} samples: must hold at least 4; give a longer one")
        record.setflags(write=False)
        object.__setattr__(self, "record", record)

    def _identity(self) -> tuple[Any, ...]:
        return (*(value for _, value in sorted(self.values().items())), self.record.tobytes())

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, type(self)):
            return NotImplemented
        return self._identity() == other._identity()

    def __hash__(self) -> int:
        return hash(self._identity())

    @property
    def duration(self) -> float:
        """Length of the record, s."""
        return float((self.record.size - 1) / self.sampling_frequency)

    def cycle(self, columns: Mapping[str, _Array], scale: Scale) -> _Array:
        """A period of the first mode."""
        return np.full(next(iter(columns.values())).size, 2.0 * math.pi / scale.omega)

    def shape_numbers(self, columns: Mapping[str, _Array], scale: Scale) -> dict[str, _Array]:
        """A rate that the steps resolve, rad/s."""
        return {"fastest": np.full(next(iter(columns.values())).size, 2.0 * math.pi * self.sampling_frequency / _KNOTS)}


# ----------------------------------------------------------------------------------------------------
# Records from files.


class FileKeys:
    """A kind of drive that a file of samples describes: :meth:`from_file` in Python, the same names in a parameter file."""

    file_keys: ClassVar[tuple[str, ...]] = (
        "column", "unit", "sensitivity", "sampling_frequency", "drift"
    )  # fmt: skip
    """Arguments of :meth:`from_file` beside *file* and the fields of the kind."""
    file_gives: ClassVar[tuple[str, ...]] = ("record", "sampling_frequency")
    """Fields that follow from the file."""

    @classmethod
    def from_file(
        cls,
        file: Any,
        *,
        column: str | int | None = None,
        unit: str | None = None,
        sensitivity: str | None = None,
        sampling_frequency: float | None = None,
        drift: str | None = None,
        **fields: Any,
    ) -> Self:
        """Return the history that a file of a measured signal contains, from its first sample.

        Parameters
        ----------
        file : path
            CSV or text table, WAV, MAT, NetCDF or HDF5, UFF, TDMS or NumPy, as :func:`snapbeam.lab.read_signal` reads it.
        column : str or int, optional
            Name of the column or channel, or its number from 0; needed if there are several.
        unit : str, optional
            Unit of the samples where the file does not state it, such as ``"g"``; a contradiction is refused.
        sensitivity : str, optional
            Value of a volt or of full scale, such as ``"100 mV/g"`` or ``"5 g/FS"``.
        sampling_frequency : float, optional
            Samples per second, Hz, where the file does not state it.
        drift : {"keep", "remove"}, optional
            ``"remove"`` subtracts the straight line that least squares fit to the samples; ``"keep"`` changes nothing.  Needed
            if an offset of the samples dominates the displacement.
        **fields
            Other fields of the history.

        Raises
        ------
        InputError
            For a file that cannot be read, a unit of another quantity, and a drift without a decision.

        Examples
        --------
        >>> import numpy as np
        >>> import snapbeam as sb
        >>> time = np.arange(2000) / 5e3  # s
        >>> table = np.column_stack((time, 0.3 * np.sin(2.0 * np.pi * 70.0 * time)))
        >>> np.savetxt("shaker.csv", table, delimiter=",", header="time (s),base (g)", comments="")
        >>> motion = sb.RecordedAcceleration.from_file("shaker.csv")
        >>> round(float(motion.sampling_frequency), 6)
        5000.0
        """
        from snapbeam.parts import signal_files

        if drift is not None:
            choice("drift", drift, DRIFT)
        signal = signal_files().read_signal(
            file, column, units=unit, sensitivity=sensitivity, sampling_frequency=sampling_frequency
        )
        values, of = signal.values, str(signal.attrs["units"])
        if drift == "remove":
            values = straightened(values)
        rate = (signal.size - 1) / float(signal["time"].values[-1] - signal["time"].values[0])
        try:
            return cls._of_signal(values, of, rate, drift is not None, **fields)
        except InputError as error:
            raise InputError(f"file = {str(file)!r}: {error}") from error

    @classmethod
    def _of_signal(cls, values: _Array, unit: str, rate: float, decided: bool, **fields: Any) -> Self:
        """The history of samples in an SI unit; with a drift it is refused unless that is *decided*."""
        raise NotImplementedError


def require_unit(unit: str, allowed: Mapping[str, str]) -> None:
    """Refuse samples in an SI unit that is not one of those *allowed*, with words for each."""
    if unit not in allowed:
        known = " or ".join(f"{each} ({words})" for each, words in allowed.items())
        raise InputError(f"unit = {unit!r}: must be {known}")


def refuse_drift(size: float, of: str) -> None:
    """Refuse a drift of a displacement, m, of which the user has not decided."""
    raise InputError(
        f"drift: {of} moves the displacement by {size:.3g} m within the record; must be 'remove', which subtracts the "
        "straight line fitted to the samples, or 'keep'"
    )


def straightened(values: _Array) -> _Array:
    """Samples without the straight line that least squares fit to them."""
    from scipy.signal import detrend

    found: _Array = detrend(values, type="linear")
    return found
