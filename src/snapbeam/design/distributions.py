"""How a parameter differs from its nominal value: tolerances as distributions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from snapbeam.core.validate import InputError, finite, finite_array, flag, positive

__all__ = ["KINDS", "UniformRange", "Distribution", "Empirical", "LogNormal", "Normal", "UniformTolerance"]

_Array = NDArray[np.float64]


@dataclass(frozen=True)
class Distribution:
    """What a parameter is drawn from, given its nominal value."""

    kind: ClassVar[str] = ""

    def at(self, nominal: _Array, normal: _Array) -> _Array:
        """Values that have the rank Phi(*normal*), of the broadcast shape."""
        raise NotImplementedError

    def describe(self) -> dict[str, Any]:
        """Its kind and its numbers, plain."""
        return {"type": self.kind, **self.__dict__}


@dataclass(frozen=True)
class Normal(Distribution):
    """Normally distributed about the nominal value.

    Parameters
    ----------
    standard_deviation : float
        In the unit of the parameter, or as a share of the nominal value.
    relative : bool
        Whether it is a share.
    """

    standard_deviation: float
    relative: bool = False
    kind: ClassVar[str] = "normal"

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "standard_deviation", positive("standard_deviation", self.standard_deviation)
        )
        flag("relative", self.relative)

    def at(self, nominal: _Array, normal: _Array) -> _Array:
        """Nominal value plus the standard deviation times *normal*."""
        size = self.standard_deviation * np.abs(nominal) if self.relative else self.standard_deviation
        return np.asarray(nominal + size * normal)


@dataclass(frozen=True)
class UniformTolerance(Distribution):
    """Uniformly distributed within a half width of the nominal value, as a drawing's tolerance +- is.

    Parameters
    ----------
    half_width : float
        In the unit of the parameter, or as a share of the nominal value.
    relative : bool
        Whether it is a share.
    """

    half_width: float
    relative: bool = False
    kind: ClassVar[str] = "uniform"

    def __post_init__(self) -> None:
        object.__setattr__(self, "half_width", positive("half_width", self.half_width))
        flag("relative", self.relative)

    def at(self, nominal: _Array, normal: _Array) -> _Array:
        """Nominal value plus the half width times 2 Phi(*normal*) - 1."""
        size = self.half_width * np.abs(nominal) if self.relative else self.half_width
        return np.asarray(nominal + size * (2.0 * ndtr(normal) - 1.0))


@dataclass(frozen=True)
class LogNormal(Distribution):
    """The nominal value times exp(sigma z), z standard normal: for what is positive and known to a factor.

    Parameters
    ----------
    sigma : float
        Standard deviation of the logarithm.
    """

    sigma: float
    kind: ClassVar[str] = "lognormal"

    def __post_init__(self) -> None:
        object.__setattr__(self, "sigma", positive("sigma", self.sigma))

    def at(self, nominal: _Array, normal: _Array) -> _Array:
        """Nominal value, which is the median, times the factor."""
        return np.asarray(nominal * np.exp(self.sigma * normal))


@dataclass(frozen=True)
class UniformRange(Distribution):
    """Uniformly distributed between two values, whatever the nominal value: a phase that nobody sets.

    Parameters
    ----------
    low, high : float
        In the unit of the parameter.
    """

    low: float
    high: float
    kind: ClassVar[str] = "between"

    def __post_init__(self) -> None:
        for name in ("low", "high"):
            object.__setattr__(self, name, finite(name, getattr(self, name)))
        if not self.low < self.high:
            raise InputError(f"low = {self.low:g}, high = {self.high:g}: low must be less than high")

    def at(self, nominal: _Array, normal: _Array) -> _Array:
        """Between the two by the rank."""
        return np.asarray(self.low + (self.high - self.low) * ndtr(normal) + 0.0 * nominal)


@dataclass(frozen=True)
class Empirical(Distribution):
    """As something was seen to be distributed, whatever the nominal value.

    Parameters
    ----------
    quantiles : tuple of float
        At evenly spaced ranks from 0 to 1, at least two, not falling.
    """

    quantiles: tuple[float, ...]
    kind: ClassVar[str] = "empirical"

    def __post_init__(self) -> None:
        table = finite_array("quantiles", self.quantiles, 1)
        if table.size < 2 or (np.diff(table) < 0.0).any():
            raise InputError("quantiles: must be at least two that do not fall")
        object.__setattr__(self, "quantiles", tuple(table.tolist()))

    def at(self, nominal: _Array, normal: _Array) -> _Array:
        """Between the quantiles by the rank."""
        ranks = np.linspace(0.0, 1.0, len(self.quantiles))
        return np.asarray(np.interp(ndtr(normal), ranks, self.quantiles) + 0.0 * nominal)


KINDS: dict[str, type[Distribution]] = {
    each.kind: each for each in (Normal, UniformTolerance, LogNormal, UniformRange)
}
"""Distributions by the names that files use."""
