"""What is known of a beam after it was measured: samples of its parameters with weights."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize, special, stats

from snapbeam.config.parameters import lookup
from snapbeam.core.kinds import checked
from snapbeam.core.validate import InputError, InputTypeError, finite_array, integer, positive, shown, within
from snapbeam.design.distributions import Distribution, Empirical
from snapbeam.design.posterior.forward import Forward
from snapbeam.design.posterior.waveforms import Waveform
from snapbeam.design.spread import ParameterUncertainty
from snapbeam.lab.calibration.measurements import Measurements
from snapbeam.model.beam import Beam

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Posterior", "estimate_posterior"]

_Array = NDArray[np.float64]
_FREEDOM = 5.0
"""Degrees of freedom of the proposals: their tails are wider than those of what is sought."""
_STAGES = 3
_FEWEST = 100.0
"""Samples that weighted ones must be worth."""
_BEAM = ("thickness", "young_modulus", "density", "length", "buckling_level")
_STEP = 2e-5
"""Relative step of the logarithms by which runs are compared: beyond what steps in time make of them."""
_BESIDE = {"damping_ratio": "model.damping_ratio", "contact_stiffness": "contact.stiffness"}
"""What a waveform says of beside the beam."""


@dataclass(frozen=True, eq=False)
class Posterior:
    """Samples of parameters with weights.

    Attributes
    ----------
    parameters : tuple of str
        By dotted name.
    values : array of shape (samples, parameters)
        SI.
    weights : array of shape (samples,)
        Add up to 1.
    """

    parameters: tuple[str, ...]
    values: _Array
    weights: _Array

    @property
    def effective_sample_size(self) -> float:
        """Samples of equal weight that they are worth (Kish)."""
        return float(1.0 / np.sum(self.weights**2))

    @property
    def is_doubtful(self) -> bool:
        """Whether too few samples carry the weight for an interval to be trusted."""
        return self.effective_sample_size < _FEWEST

    def interval(self, confidence: float = 0.95) -> dict[str, tuple[float, float, float]]:
        """Median, lower and upper limit of each parameter.

        Raises
        ------
        InputError
            If the samples are worth too few for it.
        """
        within("confidence", confidence, 0.0, 1.0)
        if self.is_doubtful:
            raise InputError(
                f"posterior: its samples are worth {self.effective_sample_size:.0f}, fewer than {_FEWEST:.0f}; ask for more draws"
            )
        shares = (0.5, 0.5 * (1.0 - confidence), 0.5 * (1.0 + confidence))
        return {
            name: tuple(_quantiles(column, self.weights, shares).tolist())
            for name, column in zip(self.parameters, self.values.T, strict=True)
        }

    def updated(self, log_likelihood: ArrayLike) -> Posterior:
        """The same samples, weighed by what another measurement says of each.

        Parameters
        ----------
        log_likelihood : array_like of shape (samples,)
        """
        more = np.asarray(log_likelihood, dtype=np.float64)
        if more.shape != self.weights.shape or np.isnan(more).any():
            raise InputError(
                f"log_likelihood of shape {more.shape}: must have a number for each of the samples"
            )
        with np.errstate(divide="ignore"):
            return replace(self, weights=special.softmax(np.log(self.weights) + more))

    def resampled(self, count: int, seed: int = 0) -> Posterior:
        """Samples of equal weight, by systematic resampling."""
        integer("count", count, 1, 10**7)
        generator = np.random.Generator(np.random.Philox(key=[integer("seed", seed, 0, 2**63 - 1), 0]))
        ranks = (np.arange(count) + generator.random()) / count
        which = np.minimum(np.searchsorted(np.cumsum(self.weights), ranks), self.weights.size - 1)
        return Posterior(self.parameters, self.values[which], np.full(count, 1.0 / count))

    def spread(self, **more: Any) -> ParameterUncertainty:
        """What it leaves open, to be drawn from: the samples' own distributions, tied by correlations of their ranks.

        *more* are other arguments of :class:`snapbeam.Spread`; distributions in *of* stand beside.
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

    def to_dataset(self) -> xr.Dataset:
        """Samples and weights, labelled."""
        import xarray as xr

        dataset = xr.Dataset(
            attrs={
                "title": "what is known of a beam after it was measured",
                "effective_samples": self.effective_sample_size,
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
    seed: int = 0,
) -> Posterior:
    """What measured frequencies, decays, collisions and waveforms say of a beam, beside what was known before.

    Parameters
    ----------
    measured : Measurements or None
        Frequencies with their standard errors; damping ratios and contact tests, if any, are known by themselves.
    beam : Beam
        The middle of what was known before.
    prior : mapping of str to float
        What is sought, among thickness, young_modulus, density, length and buckling_level, and how well it was known:
        the standard deviation of its logarithm.  A parameter that the data say nothing of stays as it was.  With
        waveforms also damping_ratio and contact_stiffness, about those of the first waveform's system, unless
        *measured* knows them.
    waveforms : Waveform or sequence of them
        Tracked motions of the beam under a striker; each counts as far as its conditioning lets it.
    modes : int
        For the frequencies; a waveform has those of its system.
    samples : int
        Samples, at least 200.
    seed : int

    Returns
    -------
    Posterior
        ``posterior.effective`` says how many samples the weighted ones are worth.

    Raises
    ------
    InputError
        For values out of range, nothing measured, and parameters that cannot be sought.

    Notes
    -----
    Population Monte Carlo (Cappe et al., J. Comput. Graph. Stat. 13 (2004) 907): samples of a Student's t about the
    most likely beam, weighed by likelihood times prior over their density, twice fitted anew to what they say.
    """
    if measured is not None and not isinstance(measured, Measurements):
        raise InputTypeError(f"measured = {shown(measured)}: must be Measurements")
    if not isinstance(beam, Beam):
        raise InputTypeError(f"beam = {shown(beam)}: must be a Beam")
    tracked = _checked_waveforms(waveforms)
    if measured is None and not tracked:
        raise InputError("measured = None: give measurements, waveforms, or both")
    names = _checked_prior(prior, measured, tracked)
    known = np.array([positive(f"prior[{name}]", prior[name]) for name in names])
    integer("samples", samples, 200, 10**6)
    integer("seed", seed, 0, 2**63 - 1)
    forward = None
    if measured is not None and (not tracked or _has_frequencies(measured)):
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

    logs, weights = _population(terms, begin, samples, seed, _STEP if tracked else None)
    values, listed = np.exp(logs), [_dotted(name) for name in names]
    if measured is not None:
        for column, (name, given, errors) in enumerate(_known_by_themselves(measured)):
            if given:
                generator = np.random.Generator(np.random.Philox(key=[seed, 10**6 + column]))
                values = np.column_stack([values, _positive(name, given, errors, samples, generator)])
                listed.append(name)
    return Posterior(tuple(listed), values, weights)


def _known_by_themselves(measured: Measurements) -> list[tuple[str, Any, Any]]:
    tests = [test.stiffness() for test in measured.contact]
    return [
        ("model.damping_ratio", measured.damping_ratio, measured.damping_ratio_se),
        ("contact.stiffness", tuple(k for k, _ in tests), tuple(error for _, error in tests)),
    ]


def _has_frequencies(measured: Measurements) -> bool:
    return bool(
        measured.straight_frequencies or measured.lower_well_frequencies or measured.upper_well_frequencies
    )


def _dotted(name: str) -> str:
    return _BESIDE.get(name, f"beam.{name}")


def _nominal(name: str, beam: Beam, tracked: Sequence[Waveform]) -> float:
    if name in _BEAM:
        return float(getattr(beam, name))
    system = tracked[0].system
    if name == "damping_ratio":
        return float(np.mean(system.model.damping_ratio))
    return float(getattr(system.contact, "stiffness"))  # noqa: B009


def _checked_waveforms(given: Sequence[Waveform] | Waveform) -> tuple[Waveform, ...]:
    listed = (given,) if isinstance(given, Waveform) else given
    if not isinstance(listed, Sequence) or not all(isinstance(each, Waveform) for each in listed):
        raise InputTypeError(f"waveforms = {shown(given)}: must be a Waveform, or a list of them")
    return tuple(listed)


def _checked_prior(
    prior: Mapping[str, float], measured: Measurements | None, tracked: Sequence[Waveform]
) -> list[str]:
    if not isinstance(prior, Mapping) or not prior:
        raise InputTypeError(
            f"prior = {shown(prior)}: must map at least one parameter to how well it was known"
        )
    allowed = (*_BEAM, *_BESIDE) if tracked else _BEAM
    for name in prior:
        if name not in allowed:
            raise InputError(f"prior: {name} must be one of {', '.join(allowed)}")
    alone = {} if measured is None else {n: values for n, values, _ in _known_by_themselves(measured)}
    for name, dotted in _BESIDE.items():
        if name in prior and alone.get(dotted):
            raise InputError(f"prior: {name} is measured by itself; leave out one of the two")
        if name == "contact_stiffness" and name in prior:
            if not all(hasattr(each.system.contact, "stiffness") for each in tracked):
                raise InputError("prior: contact_stiffness, of a contact that has none")
    return list(prior)


def _population(
    terms: Callable[[_Array], _Array], begin: _Array, draws: int, seed: int, step: float | None = None
) -> tuple[_Array, _Array]:
    """Samples and weights of exp(-|terms|^2/2); *step* is the relative one of differences."""
    found = optimize.least_squares(terms, begin, x_scale="jac", diff_step=step)
    middle, cover = found.x, np.linalg.inv(found.jac.T @ found.jac)
    logs, weights = np.empty((0, begin.size)), np.empty(0)
    for stage in range(_STAGES):
        count = draws if stage == _STAGES - 1 else max(200, draws // 4)
        generator = np.random.Generator(np.random.Philox(key=[seed, stage]))
        proposal = stats.multivariate_t(middle, 1.2 * cover, df=_FREEDOM)
        logs = np.reshape(proposal.rvs(count, random_state=generator), (count, begin.size))
        density = np.atleast_1d(proposal.logpdf(logs))
        target = np.array([-0.5 * float(np.sum(terms(each) ** 2)) for each in logs])
        weights = special.softmax(target - density)
        middle = weights @ logs
        cover = (logs - middle).T @ ((logs - middle) * weights[:, None]) + 1e-12 * np.diag(np.diag(cover))
    return logs, weights


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


def _quantiles(values: _Array, weights: _Array, shares: tuple[float, ...]) -> _Array:
    order = np.argsort(values, kind="stable")
    ranks = np.cumsum(weights[order]) - 0.5 * weights[order]
    return np.interp(shares, ranks, values[order])
