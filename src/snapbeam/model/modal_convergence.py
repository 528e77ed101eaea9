"""Error of a quantity of a beam by its number of modes, and the number of modes that meets a given error."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.model.reduced_model import ReducedModel
from snapbeam.model.system import System
from snapbeam.util.validation import InputError, InputTypeError, instance, shown, within

_ORDER_FACTOR = 4.0 / 3.0
"""Error of N modes over the change with 2 N modes, of a quantity that converges with the second order or faster."""
_MORE = 4
"""Modes that are added at least, so that a symmetric one is among them."""
_MAX_MODES = 64
AUTO_ERROR = 0.01
"""Relative error of the frequencies that ``modes = "auto"`` meets."""
_AUTO = re.compile(r"auto(?:\s+([0-9.eE+-]+)\s*%)?")


def well_frequencies(system: System) -> NDArray[np.float64]:
    """First natural frequencies about every well with the forces of the system, Hz, shape (wells, min(modes, 3))."""
    potential = system.potential
    return np.array([potential.natural_frequencies(well)[:3] for well in potential.wells])


def with_modes(system: System, modes: int) -> System:
    """The beam with another number of modes and the forces of the system, for static quantities and frequencies."""
    model = system.model
    assert model.beam is not None
    other = ReducedModel.from_beam(model.beam, modes, damping_ratio=0.01, imperfection=model.imperfection)
    return System(model=other, forces=system.forces)


def modal_error(system: System, quantity: Callable[[System], ArrayLike] = well_frequencies) -> float:
    r"""Estimate the relative error of a quantity that follows from the finite number of modes.

    The quantity q is computed with N modes and with N' = max(2 N, N + 4). If its error decreases with the second order
    of N or faster, Richardson's extrapolation bounds the error of q(N) by

        4/3 abs(q(N') - q(N)) / abs(q(N)),

    the largest of its components.  The frequencies about a well of a clamped beam converge with the order 2.5 to 3.

    Parameters
    ----------
    system : System
        Beam with the forces that act at rest; strikers and excitations are left out.
    quantity : callable, optional
        Function of a system that returns numbers; the first three frequencies about each well by default.

    Returns
    -------
    float
        The error; NaN for a structure given by matrices, if the numbers of components differ, or above 64 modes.

    See Also
    --------
    snapbeam.model.converged_modes

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> four, eight = (sb.System(model=sb.ReducedModel.from_beam(paper.BEAM, modes=n)) for n in (4, 8))
    >>> bool(sb.model.modal_error(four) > 4.0 * sb.model.modal_error(eight))
    True
    """
    instance("system", system, System, "a System")
    if not callable(quantity):
        raise InputTypeError(f"quantity = {shown(quantity)}: must be a function of a system")
    modes = system.model.modes
    if system.model.beam is None or modes > _MAX_MODES:
        return float("nan")
    return _change(with_modes(system, modes), with_modes(system, max(2 * modes, modes + _MORE)), quantity)


def _numbers(value: ArrayLike) -> NDArray[np.float64]:
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise InputTypeError(f"quantity: must return numbers, not {shown(value)}") from None


def _change(system: System, more: System, quantity: Callable[[System], ArrayLike]) -> float:
    here, there = (np.atleast_1d(_numbers(quantity(each))) for each in (system, more))
    if here.shape[:-1] != there.shape[:-1] or not here.size:
        return float("nan")
    common = min(here.shape[-1], there.shape[-1])  # one mode has one frequency
    here, there = here[..., :common], there[..., :common]
    with np.errstate(divide="ignore", invalid="ignore"):
        change = np.where(here == there, 0.0, np.abs(there - here) / np.abs(here))
    return float(_ORDER_FACTOR * change.max())


def error_of_auto(text: object) -> float | None:
    """The relative error asked for by a number of modes such as ``"auto"``, ``"auto 0.2%"``; None for others."""
    found = _AUTO.fullmatch(text.strip()) if isinstance(text, str) else None
    if found is None:
        return None
    if found[1] is None:
        return AUTO_ERROR
    try:
        error = float(found[1]) / 100.0
    except ValueError:
        raise InputError(
            f"modes = {shown(text)}: must be a number of modes, auto, or auto with an error, such as auto 0.2%"
        ) from None
    return _checked_error("error of modes = auto", error)


def _checked_error(name: str, error: float) -> float:
    return within(name, error, 1e-5, 0.5, closed="both")


def converged_modes(system: System, error: float = AUTO_ERROR) -> int:
    """Smallest number of modes, 2, 4, 8, ... 64, with which the frequencies about every well meet a given error.

    Parameters
    ----------
    system : System
        A beam with the forces that act on it at rest.
    error : float
        Relative error of the first three frequencies, by :func:`modal_error`.

    Raises
    ------
    InputError
        If 64 modes do not suffice, or the structure is given by matrices.

    See Also
    --------
    snapbeam.model.modal_error, snapbeam.ReducedModel

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> sb.model.converged_modes(sb.System(model=sb.ReducedModel.from_beam(paper.BEAM, modes=1)), 0.005)
    8
    """
    instance("system", system, System, "a System")
    if system.model.beam is None:
        raise InputError("modes = 'auto': a structure given by matrices has the modes of its matrices; give none")
    error = _checked_error("error", error)
    modes, here = 2, with_modes(system, 2)
    while modes <= _MAX_MODES:
        more = with_modes(system, max(2 * modes, modes + _MORE))
        if _change(here, more, well_frequencies) <= error:
            return modes
        modes, here = 2 * modes, with_modes(system, 2 * modes)
    raise InputError(f"modes = 'auto': {_MAX_MODES} modes do not give the frequencies to {100 * error:g} %")
