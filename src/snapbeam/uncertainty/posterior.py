"""Bayesian update of the parameters of a beam: weighted samples."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize, special, stats

from snapbeam.model.beam import Beam
from snapbeam.model.integration import Integration
from snapbeam.model.parameter_axes import unit_of
from snapbeam.model.parameters import lookup
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.model.system import System
from snapbeam.simulation.simulate import simulate
from snapbeam.simulation.tolerance import perturbation_growth
from snapbeam.sweeps.compute import CheckpointOptions
from snapbeam.uncertainty.distributions import Distribution, Empirical, ParameterUncertainty
from snapbeam.uncertainty.measured_classes import KNOWN_CLASSES, PSEUDOCOUNT
from snapbeam.uncertainty.measurements import Measurements
from snapbeam.uncertainty.monte_carlo import reached, trials_of
from snapbeam.util.diagnostics import Diagnostic, DiagnosticWarning, counting, tell
from snapbeam.util.display import plotter
from snapbeam.util.proportions import weighted_quantiles
from snapbeam.util.validation import (
    InputError,
    InputTypeError,
    checked,
    choice,
    finite_array,
    instance,
    integer,
    positive,
    seed_of,
    shown,
    within,
)

if TYPE_CHECKING:
    import xarray as xr

    from snapbeam.sweeps.measured_points import MeasuredPoints

_STATES = ("straight", "lower_well", "upper_well")
_TINY = 1e-13
"""Relative change of the drive whose response is measured."""
_LOST = 1e3
"""Standard errors of a run that fails, at every sample."""
_SEEN = {"striker": "displacement_at_striker", "midspan": "midspan_displacement"}
_Array = NDArray[np.float64]
_FREEDOM = 5.0
"""Degrees of freedom of the proposals: their tails are wider than those of what is sought."""
_STAGES = 3
_NEARER = "give a beam nearer to the measured one, or a narrower prior"
_EVALUATIONS = 200
"""Maximum number of evaluations of the search for the most likely beam."""
_FEWEST = 100.0
"""Samples that weighted ones must be worth."""
_BEAM = ("thickness", "young_modulus", "density", "length", "buckling_level")
_STEP = 2e-5
"""Relative step of the logarithms by which runs are compared: beyond what steps in time make of them."""
_BESIDE = {"damping_ratio": "model.damping_ratio", "contact_stiffness": "contact.stiffness"}
"""Parameters in addition to the beam that a waveform determines."""


# The frequencies that a beam would show, beside those that were measured.


@dataclass(frozen=True, eq=False)
class Forward:
    """Function from a beam to every measured frequency, in the order in which they are listed.

    Raises
    ------
    InputError
        If no frequency was measured, one has no standard error, or there are more than the model has modes.
    """

    measured: Measurements
    modes: int

    def __post_init__(self) -> None:
        for state in _STATES:
            values, errors = (
                getattr(self.measured, f"{state}_frequencies"),
                getattr(self.measured, f"{state}_frequencies_se"),
            )
            if values and errors is None:
                raise InputError(
                    f"{state}_frequencies_se: is needed; without standard errors nothing can be said of the rest"
                )
            if len(values) > self.modes:
                raise InputError(f"{state}_frequencies: {len(values)} frequencies for a model of {self.modes} modes")
        if not self.target.size:
            raise InputError("measured: has no frequency")

    def _listed(self, ending: str) -> _Array:
        parts: list[Any] = [getattr(self.measured, f"{state}_frequencies{ending}") or () for state in _STATES]
        return np.concatenate([np.asarray(part, dtype=np.float64) for part in parts])

    @property
    def target(self) -> _Array:
        """Measured frequencies, Hz."""
        return self._listed("")

    @property
    def errors(self) -> _Array:
        """Standard errors of the frequencies, Hz."""
        return self._listed("_se")

    def frequencies(self, beam: Beam) -> _Array:
        """Frequencies of a beam, Hz."""
        found = []
        for state in _STATES:
            count = len(getattr(self.measured, f"{state}_frequencies"))
            if not count:
                continue
            own = beam.replace(axial_load=0.0) if state == "straight" else beam
            model = ReducedModel.from_beam(own, self.modes)
            shapes = getattr(self.measured, f"{state}_shape", ())
            if not shapes:
                found += model.natural_frequencies[:count].tolist()
                continue
            seen = {1: 0, -1: 0}
            for shape in shapes:
                parity = 1 if shape == "symmetric" else -1
                found.append(float(model.natural_frequencies[model.parity == parity][seen[parity]]))
                seen[parity] += 1
        return np.array(found)

    def misfit(self, beam: Beam) -> _Array:
        """(model - measured)/standard error of each."""
        return (self.frequencies(beam) - self.target) / self.errors


# A tracked waveform as a measurement: what a beam would have done, sample by sample, as far as that can be known.


@dataclass(frozen=True, eq=False, kw_only=True)
class Waveform:
    """Measured motion of a beam under impact, for :func:`snapbeam.uncertainty.estimate_posterior`.

    It counts up to its **horizon**: the time until which the response to a relative change of the drive by
    *drive_error* stays below the standard error.  Beyond it, the measurement contains no information about the beam.

    Parameters
    ----------
    system : System
        Nominal system with one sinusoidal striker, whose frequency and speed are held in Hz and m/s.
    time : array_like of shape (samples,)
        s since the drive began, ascending.
    displacement : array_like of shape (samples,)
        m, from the straight beam; NaN where nothing was found.
    standard_error : float
        Standard error of a sample, m, independent: thin samples that are not.
    at : {"striker", "midspan"}
        Place of the measurement.
    drive_error : float
        Relative standard error of the amplitude of the drive.

    See Also
    --------
    snapbeam.uncertainty.estimate_posterior, snapbeam.lab.compare_waveforms

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18)
    >>> run = sb.simulate(system, sb.Integration(cycles=5))
    >>> displacement = run.dataset.displacement_at_striker.values * system.scale.length  # m, here of a simulation
    >>> waveform = sb.uncertainty.Waveform(
    ...     system=system, time=run.dataset.time.values, displacement=displacement, standard_error=5e-6
    ... )
    """

    system: System
    time: ArrayLike
    displacement: ArrayLike
    standard_error: float
    at: str = "striker"
    drive_error: float = 1e-4

    def __post_init__(self) -> None:
        instance("system", self.system, System, "a System")
        striker = self.system.striker
        if striker is None or not striker.drive.harmonic or not hasattr(striker.drive, "velocity_amplitude"):
            raise InputError("system: must have a striker with a sine of given velocity")
        if self.system.model.beam is None:
            raise InputError("system: must be that of a beam; a model of matrices has no parameters to find")
        time = finite_array("time", self.time, 1)
        if time.size < 2 or time[0] < 0.0 or (np.diff(time) <= 0.0).any():
            raise InputError("time: must hold two instants at least, ascending, none before 0")
        try:
            seen = np.array(self.displacement, dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            raise InputTypeError(f"displacement = {shown(self.displacement)}: must be an array of numbers") from None
        if seen.shape != time.shape or np.isinf(seen).any() or not np.isfinite(seen).any():
            raise InputError(f"displacement of shape {seen.shape}: must hold a number, or NaN, for each time")
        positive("standard_error", self.standard_error, "m")
        positive("drive_error", self.drive_error)
        choice("at", self.at, tuple(_SEEN))
        object.__setattr__(self, "time", time)
        object.__setattr__(self, "displacement", seen)

    @classmethod
    @checked
    def from_dataset(
        cls, dataset: xr.Dataset, system: System, standard_error: float, *, at: str = "striker", **more: Any
    ) -> Waveform:
        """Waveform from a tracked or simulated run with displacements over the buckling level of the system.

        *standard_error* is in m; *more* are other arguments.
        """
        choice("at", at, tuple(_SEEN))
        if _SEEN[at] not in dataset:
            raise InputError(f"dataset: has no {_SEEN[at]}")
        seen = dataset[_SEEN[at]].values * system.scale.length
        if "valid" in dataset:
            seen = np.where(dataset["valid"].values.astype(bool), seen, np.nan)
        return cls(
            system=system, time=dataset["time"].values, displacement=seen, standard_error=standard_error, at=at, **more
        )  # fmt: skip

    @property
    def period(self) -> float:
        """Period of the drive, s."""
        assert self.system.striker is not None
        ratio = float(self.system.striker.drive.frequency_ratio)  # type: ignore[attr-defined]
        return 1.0 / (ratio * unit_of(self.system, "drive.frequency_hz"))

    @cached_property
    def horizon(self) -> float:
        """Up to when it counts, s.  Refused (InputError) if that is before its second sample."""
        cycles = int(np.ceil(np.asarray(self.time)[-1] / self.period - 1e-9)) or 1
        with _untold():
            change = perturbation_growth(self.system, Integration(cycles=cycles))
        moved = change["separation"].values * self.system.scale.length * (self.drive_error / _TINY)
        late = np.flatnonzero(moved > self.standard_error)
        until = float(change["time"][late[0] - 1]) if late.size and late[0] else float(change["time"][-1])
        if (late.size and late[0] == 0) or until < np.asarray(self.time)[1]:
            raise InputError(
                f"standard_error = {self.standard_error:g} m: with drive_error = {self.drive_error:g} nothing of the "
                "waveform can be known so well"
            )
        return until

    @cached_property
    def used(self) -> NDArray[np.bool_]:
        """Samples that count."""
        return np.isfinite(np.asarray(self.displacement)) & (np.asarray(self.time) <= self.horizon)

    def misfit(self, values: Mapping[str, Any]) -> _Array:
        """(model - measured)/standard error of every sample that counts, of the system with other parameters.

        *values* are by dotted name; the drive has constant Hz and m/s.
        """
        times = np.asarray(self.time)[self.used]
        seen = np.asarray(self.displacement)[self.used]
        with _untold():
            system = self.system.replace(**values)
            drive = {}
            for ratio, unit in (("frequency_ratio", "frequency_hz"), ("velocity_amplitude", "velocity_m_s")):
                own = getattr(self.system.striker.drive, ratio)  # type: ignore[union-attr]
                there = unit_of(self.system, f"drive.{unit}") / unit_of(system, f"drive.{unit}")
                drive[f"drive.{ratio}"] = own * there
            system = system.replace(**drive)
            cycles = int(np.ceil(times[-1] / self.period - 1e-9)) or 1
            last = cycles * self.period * (1.0 - 1e-9)
            run = simulate(system, Integration(cycles=cycles), sample_times=np.minimum(times, last))
        found = run.dataset[_SEEN[self.at]].values * system.scale.length
        off = (found - seen) / self.standard_error
        return np.where(np.isfinite(off), off, _LOST)


@contextmanager
def _untold() -> Iterator[None]:
    """Suppress diagnostics of neighbouring systems; they were reported for the first one."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DiagnosticWarning)
        yield


@dataclass(frozen=True, eq=False)
class Posterior:
    """Samples of parameters with weights.

    Attributes
    ----------
    parameters : tuple of str
        Dotted names of the parameters.
    values : array of shape (samples, parameters)
        Values of the parameters of every sample, SI units.
    weights : array of shape (samples,)
        Weights of the samples, which add up to 1.
    termination_reason : str
        Reason why the search for the most likely beam stopped, and the effective sample size.
    converged : bool
        False if the search reached its maximum number of evaluations: the samples are about the best beam that it found.

    See Also
    --------
    snapbeam.uncertainty.estimate_posterior, snapbeam.uncertainty.class_likelihood

    Examples
    --------
    >>> import numpy as np
    >>> import snapbeam as sb
    >>> levels = np.linspace(3e-4, 5e-4, 200)[:, None]  # m
    >>> posterior = sb.uncertainty.Posterior(("beam.buckling_level",), levels, np.full(200, 1 / 200))
    >>> posterior.parameters, posterior.is_doubtful
    (('beam.buckling_level',), False)
    """

    parameters: tuple[str, ...]
    values: _Array
    weights: _Array
    termination_reason: str = ""
    converged: bool = True

    @property
    def effective_sample_size(self) -> float:
        """Samples of equal weight that they are worth (Kish)."""
        return float(1.0 / np.sum(self.weights**2))

    @property
    def is_doubtful(self) -> bool:
        """True if the search did not converge, or the effective sample size is too small for reliable intervals."""
        return not self.converged or self.effective_sample_size < _FEWEST

    def interval(self, confidence: float = 0.95) -> dict[str, tuple[float, float, float]]:
        """Median, lower and upper limit of each parameter.

        Raises
        ------
        InputError
            If the search did not converge, or the samples are worth too few for it.
        """
        within("confidence", confidence, 0.0, 1.0)
        if not self.converged:
            raise InputError(f"posterior: {self.termination_reason.split(';')[0]}; {_NEARER}")
        if self.is_doubtful:
            raise InputError(
                f"posterior: its samples are worth {self.effective_sample_size:.0f}, fewer than {_FEWEST:.0f}; use more samples"
            )
        shares = (0.5, 0.5 * (1.0 - confidence), 0.5 * (1.0 + confidence))
        return {
            name: tuple(weighted_quantiles(column, self.weights, shares).tolist())
            for name, column in zip(self.parameters, self.values.T, strict=True)
        }

    def updated(self, log_likelihood: ArrayLike) -> Posterior:
        """Posterior with the same samples, weighted by the likelihood of another measurement.

        Parameters
        ----------
        log_likelihood : array_like of shape (samples,)
            Logarithm of the likelihood of the measurement under every sample.
        """
        more = np.asarray(log_likelihood, dtype=np.float64)
        if more.shape != self.weights.shape or np.isnan(more).any():
            raise InputError(f"log_likelihood of shape {more.shape}: must have a number for each of the samples")
        with np.errstate(divide="ignore"):
            return replace(self, weights=special.softmax(np.log(self.weights) + more))

    def resampled(self, count: int, rng: int | np.random.Generator | None = 0) -> Posterior:
        """Samples of equal weight, by systematic resampling."""
        integer("count", count, 1, 10**7)
        generator = np.random.Generator(np.random.Philox(key=[seed_of(rng), 0]))
        ranks = (np.arange(count) + generator.random()) / count
        which = np.minimum(np.searchsorted(np.cumsum(self.weights), ranks), self.weights.size - 1)
        return replace(self, values=self.values[which], weights=np.full(count, 1.0 / count))

    def uncertainty(self, **more: Any) -> ParameterUncertainty:
        """Return the parameter uncertainty: the distributions of the samples, with the correlations of their ranks.

        *more* are other arguments of :class:`snapbeam.uncertainty.ParameterUncertainty`; distributions in *of* are added.
        """
        even = self.resampled(max(2000, len(self.values)))
        beside = dict(more.pop("of", {}))
        of: dict[str, Distribution] = {
            name: Empirical(tuple(np.quantile(column, np.linspace(0.0, 1.0, 201)).tolist()))
            for name, column in zip(self.parameters, even.values.T, strict=True)
        }
        count = len(of)
        matrix = np.eye(count + len(beside))
        if count > 1:
            ranks = stats.rankdata(even.values, axis=0) / (len(even.values) + 1.0)
            matrix[:count, :count] = np.corrcoef(special.ndtri(ranks).T)
        return ParameterUncertainty(of=of | beside, correlation=matrix, **more)

    def plot(self, ax: Any = None) -> Any:
        """Draw the marginal interval of each parameter, over its median; returns the axes."""
        return plotter("plot_dataset")(self.to_dataset(), None, ax)

    def to_dataset(self) -> xr.Dataset:
        """Samples and weights, labelled."""
        from snapbeam.util.datasets import xr

        dataset = xr.Dataset(
            attrs={
                "title": "posterior samples of the parameters of a beam",
                "effective_sample_size": self.effective_sample_size,
                "termination_reason": self.termination_reason,
                "converged": int(self.converged),
            }
        )
        for name, column in zip(self.parameters, self.values.T, strict=True):
            row = lookup(name)
            labels = {"units": row.quantity.unit, "long_name": row.quantity.long_name, "parameter": name}
            dataset[row.short] = (("sample",), column, labels)
        dataset["weight"] = (("sample",), self.weights, {"units": "1", "long_name": "weight of the sample"})
        return dataset


@checked
def estimate_posterior(
    measured: Measurements | None,
    beam: Beam,
    prior: Mapping[str, float],
    *,
    waveforms: Sequence[Waveform] | Waveform = (),
    modes: int = 8,
    samples: int = 2000,
    rng: int | np.random.Generator | None = 0,
    progress: Callable[[int, int], object] | bool | None = None,
) -> Posterior:
    """Posterior of beam parameters from frequencies, decays, collisions and waveforms, with a prior.

    Parameters
    ----------
    measured : Measurements or None
        Frequencies with their standard errors; damping ratios and contact tests stand for themselves.
    beam : Beam
        Median of the prior.
    prior : mapping of str to float
        Parameters to estimate, each with the standard deviation of its logarithm: thickness, young_modulus, density,
        length, buckling_level; with waveforms also damping_ratio and contact_stiffness, about those of the first
        waveform's system, unless *measured* has them. A parameter without information in the data keeps its prior.
    waveforms : Waveform or sequence of them
        Tracked motions of the beam under a striker.
    modes : int
        Number of modes for the frequencies.
    samples : int
        Samples, at least 200.
    rng : int, numpy.random.Generator or None
        Seed, or a generator that gives one; None: random.
    progress : callable or bool, optional
        Report of samples, as in :func:`snapbeam.sweep`.

    Returns
    -------
    Posterior
        Weighted samples, worth ``posterior.effective_sample_size`` independent ones. ``posterior.converged`` is False,
        with a :class:`~snapbeam.DiagnosticWarning`, if the most likely beam was not found.

    See Also
    --------
    snapbeam.uncertainty.Posterior, snapbeam.uncertainty.Waveform, snapbeam.lab.calibrate

    Notes
    -----
    Population Monte Carlo (Cappe et al., J. Comput. Graph. Stat. 13 (2004) 907): samples of a Student's t about the most
    likely beam, weighted by likelihood times prior over their density, fitted twice again to the weighted samples.

    Examples
    --------
    >>> import numpy as np
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> from snapbeam.lab import Measurements
    >>> measured = Measurements(lower_well_frequencies=[46.0], lower_well_frequencies_se=[0.2])  # Hz
    >>> posterior = sb.uncertainty.estimate_posterior(
    ...     measured, paper.BEAM, {"buckling_level": 0.05}, modes=2, samples=200
    ... )
    >>> middle, low, high = posterior.interval()["beam.buckling_level"]  # m
    >>> low < middle < high
    True
    """
    if measured is not None and not isinstance(measured, Measurements):
        raise InputTypeError(f"measured = {shown(measured)}: must be Measurements")
    instance("beam", beam, Beam, "a Beam")
    tracked = (waveforms,) if isinstance(waveforms, Waveform) else waveforms
    if not isinstance(tracked, Sequence) or not all(isinstance(each, Waveform) for each in tracked):
        raise InputTypeError(f"waveforms = {shown(waveforms)}: must be a Waveform, or a list of them")
    if measured is None and not tracked:
        raise InputError("measured = None: give measurements, waveforms, or both")
    names = _checked_prior(prior, measured, tracked)
    known = np.array([positive(f"prior[{name}]", prior[name]) for name in names])
    integer("samples", samples, 200, 10**6)
    seed = seed_of(rng)
    forward = None
    if measured is not None and (not tracked or any(getattr(measured, f"{state}_frequencies") for state in _STATES)):
        forward = Forward(measured, integer("modes", modes, 1, 256))
    begin = np.log([_nominal(name, beam, tracked) for name in names])

    def terms(logs: _Array) -> _Array:
        values = {name: math.exp(log) for name, log in zip(names, logs, strict=True)}
        found = [(logs - begin) / known]
        if forward is not None:
            found.append(forward.misfit(beam.replace(**{n: v for n, v in values.items() if n in _BEAM})))
        dotted = {_dotted(name): value for name, value in values.items()}
        found += [waveform.misfit(dotted) for waveform in tracked]
        return np.concatenate(found)

    logs, weights, reason, converged = _population(
        terms, begin, samples, seed, _STEP if tracked else None, counting(progress, "posterior", "samples")
    )
    values, listed = np.exp(logs), [_dotted(name) for name in names]
    if measured is not None:
        for column, (name, given, errors) in enumerate(_known_by_themselves(measured)):
            if given:
                generator = np.random.Generator(np.random.Philox(key=[seed, 10**6 + column]))
                values = np.column_stack([values, _positive(name, given, errors, samples, generator)])
                listed.append(name)
    return Posterior(tuple(listed), values, weights, reason, converged)


def _known_by_themselves(measured: Measurements) -> list[tuple[str, Any, Any]]:
    tests = [test.stiffness() for test in measured.contact]
    return [
        ("model.damping_ratio", measured.damping_ratio, measured.damping_ratio_se),
        ("contact.stiffness", tuple(k for k, _ in tests), tuple(error for _, error in tests)),
    ]


def _dotted(name: str) -> str:
    return _BESIDE.get(name, f"beam.{name}")


def _nominal(name: str, beam: Beam, tracked: Sequence[Waveform]) -> float:
    if name in _BEAM:
        return float(getattr(beam, name))
    system = tracked[0].system
    if name == "damping_ratio":
        return float(np.mean(system.model.damping_ratio))
    return float(getattr(system.contact_law, "stiffness"))  # noqa: B009


def _checked_prior(prior: Mapping[str, float], measured: Measurements | None, tracked: Sequence[Waveform]) -> list[str]:
    if not isinstance(prior, Mapping) or not prior:
        raise InputTypeError(f"prior = {shown(prior)}: must map at least one parameter to how well it was known")
    allowed = (*_BEAM, *_BESIDE) if tracked else _BEAM
    for name in prior:
        if name not in allowed:
            raise InputError(f"prior: {name} must be one of {', '.join(allowed)}")
    alone = {} if measured is None else {n: values for n, values, _ in _known_by_themselves(measured)}
    for name, dotted in _BESIDE.items():
        if name in prior and alone.get(dotted):
            raise InputError(f"prior: {name} is measured by itself; leave out one of the two")
        if name == "contact_stiffness" and name in prior:
            if not all(hasattr(each.system.contact_law, "stiffness") for each in tracked):
                raise InputError("prior: contact_stiffness, of a contact that has none")
    return list(prior)


def _population(
    terms: Callable[[_Array], _Array],
    begin: _Array,
    draws: int,
    seed: int,
    step: float | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> tuple[_Array, _Array, str, bool]:
    """Samples and weights of exp(-|terms|^2/2), why the search stopped, and whether it converged.

    *step* is the relative one of differences.
    """
    found = optimize.least_squares(terms, begin, x_scale="jac", diff_step=step, max_nfev=_EVALUATIONS)
    words = f"least squares stopped after {found.nfev} evaluation{'s' if found.nfev > 1 else ''}: {found.message.rstrip('.')}"
    converged = bool(found.status > 0)
    if not converged:
        tell([Diagnostic("posterior-search", f"{words}; {_NEARER}", {"evaluations": float(found.nfev)})])
    middle, cover = found.x, np.linalg.inv(found.jac.T @ found.jac)
    logs, weights = np.empty((0, begin.size)), np.empty(0)
    counts = [max(200, draws // 4)] * (_STAGES - 1) + [draws]
    done = 0

    def logarithm(each: _Array) -> float:
        nonlocal done
        value, done = -0.5 * float(np.sum(terms(each) ** 2)), done + 1
        if progress is not None:
            progress(done, sum(counts))
        return value

    for stage, count in enumerate(counts):
        generator = np.random.Generator(np.random.Philox(key=[seed, stage]))
        proposal = stats.multivariate_t(middle, 1.2 * cover, df=_FREEDOM)
        logs = np.reshape(proposal.rvs(count, random_state=generator), (count, begin.size))
        density = np.atleast_1d(proposal.logpdf(logs))
        target = np.array([logarithm(each) for each in logs])
        weights = special.softmax(target - density)
        middle = weights @ logs
        cover = (logs - middle).T @ ((logs - middle) * weights[:, None]) + 1e-12 * np.diag(np.diag(cover))
    worth = 1.0 / float(np.sum(weights**2))
    words += f"; {_STAGES} stages of samples, the last worth {worth:.0f} of {draws}"
    return logs, weights, words, converged


def _positive(name: str, given: Any, errors: Any, draws: int, generator: np.random.Generator) -> _Array:
    """Samples of the mean of positive numbers: Student's t of their logarithms, or a normal by their errors."""
    x = finite_array(name, given, 1)
    if errors is None:
        if x.size < 2:
            raise InputError(f"{name}: one value without a standard error says nothing of the rest")
        error, freedom = float(np.log(x).std(ddof=1)) / math.sqrt(x.size), float(x.size - 1)
        return np.asarray(np.exp(np.log(x).mean() + error * generator.standard_t(freedom, draws)))
    relative = np.asarray(errors, dtype=np.float64) / x
    weight = 1.0 / relative**2
    middle = float(np.sum(weight * np.log(x)) / weight.sum())
    return np.asarray(np.exp(middle + generator.standard_normal(draws) / math.sqrt(float(weight.sum()))))


# What measured response classes say of a beam: how likely each sample of it makes them.


@checked
def class_likelihood(
    posterior: Posterior,
    system: System,
    measurements: MeasuredPoints,
    uncertainty: ParameterUncertainty,
    *,
    runs: int = 16,
    integration: Integration | None = None,
    checkpoint: str | os.PathLike[str] | CheckpointOptions | None = None,
    progress: Callable[[int, int], object] | bool | None = None,
) -> _Array:
    """Log likelihood of measured classes under every sample of a posterior, for :meth:`Posterior.updated`.

    With c of *runs* = m runs of its class, a Dirichlet-multinomial of Jeffreys' prior gives a measured point the
    probability (c + 1/2)/(m + 2): a class that no run had is unlikely, not impossible.

    Parameters
    ----------
    posterior : Posterior
        Few samples: :meth:`Posterior.resampled` first.
    system : System
        Nominal system, which normalises Omega and V.
    measurements : MeasuredPoints
        Excitation in Hz and m/s, the same for every sample; points of unknown class are omitted.
    uncertainty : ParameterUncertainty
        Uncertainty from test to test, such as ``ParameterUncertainty(displacement=3.5e-6)``, without parameters of the
        posterior.
    runs : int
        Runs of each measured point and sample, on the same random samples.
    integration, checkpoint, progress
        Settings, folder and report, as in :func:`probability_map`.

    Returns
    -------
    array of shape (samples,)

    See Also
    --------
    snapbeam.uncertainty.estimate_posterior, snapbeam.uncertainty.score_measurements

    Examples
    --------
    >>> import numpy as np
    >>> import snapbeam as sb
    >>> from snapbeam import paper
    >>> levels = np.linspace(3e-4, 5e-4, 4)[:, None]  # m
    >>> posterior = sb.uncertainty.Posterior(("beam.buckling_level",), levels, np.full(4, 0.25))
    >>> system = paper.struck_beam(frequency_ratio=1.2, velocity_amplitude=0.18, modes=2)
    >>> measurements = sb.MeasuredPoints(
    ...     frequency_ratio=[1.2], velocity_amplitude=[0.2], location=[0.4762], response_class=[3]
    ... )
    >>> uncertainty = sb.uncertainty.ParameterUncertainty(of={"location": sb.uncertainty.Normal(0.005)})
    >>> likelihood = sb.uncertainty.class_likelihood(
    ...     posterior, system, measurements, uncertainty, runs=4, integration=sb.Integration(cycles=5)
    ... )
    >>> likelihood.shape
    (4,)
    """
    integer("runs", runs, 2, 10**6)
    shared = sorted(set(posterior.parameters) & set(uncertainty.of))
    if shared:
        raise InputError(f"uncertainty: contains {', '.join(shared)}, which the posterior has")
    known = np.isin(measurements.response_class, KNOWN_CLASSES)
    if not known.any():
        raise InputError("measurements: none has a known class")
    trials = trials_of(system, uncertainty, integration, checkpoint=checkpoint)
    trials.progress = counting(progress, "class likelihood", "runs")
    samples, count = len(posterior.values), int(known.sum())
    sample, dot, number = (
        each.ravel() for each in np.meshgrid(np.arange(samples), np.arange(count), np.arange(runs), indexing="ij")
    )
    points = {name: posterior.values[sample, j] for j, name in enumerate(posterior.parameters)}
    points |= {
        "drive.frequency_ratio": measurements.frequency_ratio[known][dot],
        "drive.velocity_amplitude": measurements.velocity_amplitude[known][dot],
    }
    place = measurements.location[known]
    if np.isfinite(place).all():
        points["contact.location"] = place[dot]
    found = trials.statistics(trials.in_hz(points), number)
    mine = (found["response_class"] == measurements.response_class[known][dot]) & reached(found)
    hits = mine.reshape(samples, count, runs).sum(axis=-1)
    total = reached(found).reshape(samples, count, runs).sum(axis=-1)
    return np.asarray(np.log((hits + PSEUDOCOUNT) / (total + PSEUDOCOUNT * len(KNOWN_CLASSES))).sum(axis=-1))
