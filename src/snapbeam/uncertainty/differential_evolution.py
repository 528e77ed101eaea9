"""Differential evolution for one objective or several under constraints, in ask-and-tell form.

Generalised differential evolution (GDE3; Kukkonen and Lampinen, IEEE Congress on Evolutionary Computation 2005, 443):
DE/rand/1/bin, in which a design that satisfies its constraints beats one that does not, of two that do not the one that breaks
them less, and of two that do the one that is nowhere worse; where neither is, both stay until the population is
cut back to its size by fronts and crowding (Deb et al., IEEE Trans. Evol. Comput. 6 (2002) 182).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from snapbeam.util.validation import InputError, finite_array, integer, seed_of, within

_Array = NDArray[np.float64]


class DifferentialEvolution:
    """Differential evolution in ask-and-tell form: a population of designs with objectives and violations.

    Parameters
    ----------
    bounds : array_like of shape (variables, 2)
        Minimum and maximum of every variable.
    population : int
        Number of designs of a generation, at least 6.
    rng : int, numpy.random.Generator or None
        Seed or its generator; None: random. Generation g samples from its number and the seed alone.
    weight, crossover : float
        F in (0, 2) and CR in [0, 1].

    See Also
    --------
    snapbeam.uncertainty.optimize_design, snapbeam.uncertainty.design_problem

    Examples
    --------
    >>> import numpy as np
    >>> import snapbeam as sb
    >>> search = sb.uncertainty.DifferentialEvolution([(-1.0, 1.0)] * 2, population=20)
    >>> for _ in range(40):
    ...     x = search.ask()
    ...     search.tell(np.sum(x**2, axis=1)[:, None], np.zeros(len(x)))
    >>> bool(np.abs(search.designs[0]).max() < 1e-2)
    True
    """

    def __init__(
        self,
        bounds: ArrayLike,
        population: int = 24,
        rng: int | np.random.Generator | None = 0,
        weight: float = 0.6,
        crossover: float = 0.9,
    ) -> None:
        self.bounds = finite_array("bounds", bounds, 2)
        if self.bounds.shape[1] != 2 or (self.bounds[:, 0] >= self.bounds[:, 1]).any():
            raise InputError("bounds: must be pairs of which the first is less than the second")
        self.population = integer("population", population, 6, 100_000)
        self.seed = seed_of(rng)
        self.weight = within("weight", weight, 0.0, 2.0)
        self.crossover = within("crossover", crossover, 0.0, 1.0, closed="both")
        self.generation = 0
        self.designs: _Array = np.empty((0, len(self.bounds)))
        """The population, the best first."""
        self.objectives: _Array = np.empty((0, 0))
        self.violation: _Array = np.empty(0)
        self._asked: _Array | None = None

    def ask(self) -> _Array:
        """Designs to evaluate next, of shape (population, variables)."""
        if self._asked is None:
            generator = np.random.default_rng(np.random.SeedSequence([self.seed, self.generation]))
            unit = self._first(generator) if self.generation == 0 else self._offspring(generator)
            low, high = self.bounds.T
            self._asked = low + (high - low) * unit
        return self._asked.copy()

    def tell(self, objectives: ArrayLike, violation: ArrayLike) -> None:
        """Set the objectives and constraint violations of the last designs.

        Parameters
        ----------
        objectives : array_like of shape (population, objectives)
            Values to minimise; infinite if unknown.
        violation : array_like of shape (population,)
            0 where all constraints are satisfied.
        """
        if self._asked is None:
            raise InputError("tell: nothing was asked for")
        values, broken = np.asarray(objectives, dtype=np.float64), np.asarray(violation, dtype=np.float64)
        if values.ndim != 2 or len(values) != len(self._asked) or broken.shape != (len(self._asked),):
            raise InputError(
                f"objectives of shape {values.shape}: must have a row for each of {len(self._asked)} designs"
            )
        if np.isnan(values).any() or np.isnan(broken).any() or (broken < 0.0).any():
            raise InputError("objectives, violation: must be numbers, violations at least 0")
        x = self._asked
        if self.generation > 0:
            x, values, broken = self._survivors(x, values, broken)
        order = _ranked(values, broken)[: self.population]
        self.designs, self.objectives, self.violation = x[order], values[order], broken[order]
        self._asked = None
        self.generation += 1

    def _first(self, generator: np.random.Generator) -> _Array:
        sequence = stats.qmc.LatinHypercube(len(self.bounds), seed=generator)
        return np.asarray(sequence.random(self.population))

    def _offspring(self, generator: np.random.Generator) -> _Array:
        low, high = self.bounds.T
        unit = (self.designs - low) / (high - low)
        size, count = unit.shape
        made = np.empty_like(unit)
        for i in range(size):
            a, b, c = generator.choice(np.delete(np.arange(size), i), 3, replace=False)
            mutant = unit[a] + self.weight * (unit[b] - unit[c])
            # what leaves the bounds comes to lie between its parent and the bound
            mutant = np.where(mutant < 0.0, unit[a] * generator.random(count), mutant)
            mutant = np.where(mutant > 1.0, 1.0 - (1.0 - unit[a]) * generator.random(count), mutant)
            taken = generator.random(count) < self.crossover
            taken[generator.integers(count)] = True
            made[i] = np.where(taken, mutant, unit[i])
        return made

    def _survivors(self, x: _Array, objectives: _Array, broken: _Array) -> tuple[_Array, _Array, _Array]:
        kept: list[tuple[_Array, _Array, float]] = []
        for i in range(len(x)):
            old = (self.designs[i], self.objectives[i], float(self.violation[i]))
            new = (x[i], objectives[i], float(broken[i]))
            if _beats(new[1], new[2], old[1], old[2]):
                kept.append(new)
            elif _beats(old[1], old[2], new[1], new[2]) or (old[1] == new[1]).all():
                kept.append(old)
            else:
                kept += [old, new]
        return (
            np.array([each[0] for each in kept]),
            np.array([each[1] for each in kept]),
            np.array([each[2] for each in kept]),
        )


def dominates(one: _Array, other: _Array) -> bool:
    """Return whether objectives are nowhere worse and somewhere better (Pareto dominance)."""
    return bool((one <= other).all() and (one < other).any())


def _beats(objectives: _Array, broken: float, others: _Array, others_broken: float) -> bool:
    if broken > 0.0 or others_broken > 0.0:
        return broken < others_broken
    return dominates(objectives, others)


def front_of(objectives: _Array) -> NDArray[np.bool_]:
    """Mask of the designs that no other one dominates, shape (designs,)."""
    return np.array([not any(dominates(other, own) for other in objectives) for own in objectives], dtype=bool)


def _ranked(objectives: _Array, broken: _Array) -> NDArray[np.int64]:
    """Order of designs: fronts of those that satisfy their constraints, uncrowded first, then the rest by what they break."""
    good = np.flatnonzero(broken == 0.0)
    order: list[int] = []
    while good.size:
        first = front_of(objectives[good])
        members = good[first]
        order += members[np.argsort(-_crowding(objectives[members]), kind="stable")].tolist()
        good = good[~first]
    bad = np.flatnonzero(broken > 0.0)
    order += bad[np.argsort(broken[bad], kind="stable")].tolist()
    return np.array(order, dtype=np.int64)


def _crowding(objectives: _Array) -> _Array:
    """Distance of the neighbours of each member of a front, along every objective; the ends are infinitely far."""
    found = np.zeros(len(objectives))
    if objectives.shape[1] == 1:
        return found
    for column in objectives.T:
        order = np.argsort(column, kind="stable")
        span = column[order[-1]] - column[order[0]]
        found[order[[0, -1]]] = np.inf
        if span > 0.0 and np.isfinite(span):
            found[order[1:-1]] += (column[order[2:]] - column[order[:-2]]) / span
    return found
