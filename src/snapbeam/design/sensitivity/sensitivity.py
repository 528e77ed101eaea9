"""Which parameter moves an answer most, and per its real tolerance."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import special, stats

from snapbeam.config.parameters import lookup
from snapbeam.core.kinds import checked
from snapbeam.core.provenance import canonical_json
from snapbeam.core.validate import InputError, choice, integer, within
from snapbeam.design.sensitivity.answers import Answer, answer_of
from snapbeam.design.sensitivity.given_data import sobol_indices_from_samples
from snapbeam.design.sensitivity.variance import sobol_indices
from snapbeam.design.spread import ParameterUncertainty
from snapbeam.design.trials import Trials, trials_of
from snapbeam.model.integration import Integration
from snapbeam.model.system import System
from snapbeam.sweeps.stored import CheckpointOptions

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["METHODS", "sensitivity"]

_Array = NDArray[np.float64]
METHODS = ("local", "sobol", "given_data")
_DEFAULT = {"local": 16, "sobol": 32, "given_data": 1000}
_REPLICATES = 16
PARAMETER = "parameter"


@checked
def sensitivity(
    system: System,
    quantity: Answer | str,
    uncertainty: ParameterUncertainty,
    method: str = "local",
    *,
    samples: int | None = None,
    confidence: float = 0.95,
    integration: Integration | None = None,
    checkpoint: str | os.PathLike[str] | CheckpointOptions | None = None,
) -> xr.Dataset:
    """Which parameter of a spread moves an answer most, with intervals.

    Parameters
    ----------
    system : System
        The nominal one.
    quantity : str or ThresholdQoI or NotchQoI or LifetimeQoI
        What is asked: a statistic by its name, such as ``"peak_force"``, an outcome, or one of these.
    uncertainty : Spread
        What differs, at least one parameter.
    method : {"local", "sobol", "given_data"}
        ``"local"``: half the difference of the answers with a parameter one standard normal score up and down, the
        others and the start as in *samples* draws (common random numbers).  ``"sobol"``: indices of the first order and
        in total over sixteen scrambled sequences of *samples* points, all from one start.  ``"given_data"``: indices of
        the first order from *samples* plain draws, which may be correlated.
    samples : int, optional
        16, 32 and 1000 by default.
    confidence : float
    integration : Integration, optional
    checkpoint : path or Keeping, optional
        Folder that keeps the runs of all answers but lifetimes; one that exists is resumed.

    Returns
    -------
    xarray.Dataset
        Over ``parameter``, with ``unit``: locally ``effect`` (of +1 standard score), ``derivative`` (per unit of the
        parameter) and ``answer_minus`` and ``answer_plus``, the first two with limits; else ``first_order``, and
        ``total_order`` of Sobol's, with limits.  The answer's mean and standard deviation are attributes.

    Raises
    ------
    InputError
        For bad input, an answer that is not there for some draws, such as a threshold out of range, correlated
        parameters with Sobol's indices, and an answer that does not vary.
    """
    choice("method", method, METHODS)
    within("confidence", confidence, 0.0, 1.0)
    asked = answer_of(quantity)
    trials = trials_of(
        system, uncertainty, integration, store=checkpoint, early=not isinstance(quantity, str)
    )
    names = trials.spread.parameters
    if not names:
        raise InputError("spread: draws no parameter, so there is nothing to compare")
    count = integer("samples", _DEFAULT[method] if samples is None else samples, 2, 2**24)
    if trials.spread.correlation is not None and method == "sobol":
        raise InputError(
            "correlation with method = 'sobol': its indices are of independent parameters; use 'given_data'"
        )
    made = {"local": _local, "sobol": _sobol, "given_data": _given_data}[method]
    table, values = made(trials, asked, count, confidence)
    return _dataset(trials, asked, method, count, confidence, table, values)


def _ask(trials: Trials, answer: Answer, scores: _Array, numbers: NDArray[np.int64]) -> _Array:
    values = answer.of(trials, scores, numbers)
    lost = ~np.isfinite(values)
    if lost.any():
        raise InputError(
            f"answer: {answer.words} is not there for {int(lost.sum())} of {values.size} draws; give it a wider range, "
            "or a spread in which every system has it"
        )
    return values


def _local(trials: Trials, answer: Answer, count: int, confidence: float) -> tuple[dict[str, _Array], _Array]:
    spread = trials.spread
    inputs = len(spread.of)
    numbers = np.arange(count)
    base = spread.normals(numbers)
    stack = []
    for j in range(inputs):
        for score in (-1.0, 1.0):
            moved = base.copy()
            moved[:, j] = score
            stack.append(moved)
    values = _ask(trials, answer, np.concatenate(stack), np.tile(numbers, 2 * inputs))
    both = values.reshape(inputs, 2, count)
    half = 0.5 * (both[:, 1] - both[:, 0])
    width = np.array([_width(trials, name) for name in spread.of])
    table = {"answer_minus": both[:, 0].mean(axis=1), "answer_plus": both[:, 1].mean(axis=1)}
    table |= _limits("effect", half, confidence) | {"step": width}
    table |= _limits("derivative", half / width[:, None], confidence)
    return table, values


def _width(trials: Trials, name: str) -> float:
    """Half of what a parameter differs by between the scores -1 and +1."""
    nominal = np.full(2, trials.system.parameters.get(name, 0.0) or 0.0, dtype=np.float64)
    return 0.5 * float(np.ptp(trials.spread.of[name].at(nominal, np.array([-1.0, 1.0]))))


def _limits(name: str, pairs: _Array, confidence: float) -> dict[str, _Array]:
    count = pairs.shape[1]
    middle = pairs.mean(axis=1)
    reach = stats.t.ppf(0.5 * (1.0 + confidence), count - 1) * pairs.std(axis=1, ddof=1) / np.sqrt(count)
    return {name: middle, f"{name}_low": middle - reach, f"{name}_high": middle + reach}


def _sobol(trials: Trials, answer: Answer, count: int, confidence: float) -> tuple[dict[str, _Array], _Array]:
    kept: list[_Array] = []

    def function(ranks: _Array) -> _Array:
        values = _ask(trials, answer, special.ndtri(ranks).T, np.zeros(ranks.shape[1], dtype=np.int64))
        kept.append(values)
        return values

    found = sobol_indices(
        function, len(trials.spread.of), count, replicates=_REPLICATES, confidence=confidence, seed=trials.spread.seed
    )  # fmt: skip
    table: dict[str, _Array] = {}
    for name, indices in (("first_order", found.first), ("total_order", found.total)):
        table |= {name: indices.estimate, f"{name}_low": indices.low, f"{name}_high": indices.high}
    return table, kept[0]


def _given_data(
    trials: Trials, answer: Answer, count: int, confidence: float
) -> tuple[dict[str, _Array], _Array]:
    numbers = np.arange(count)
    scores = trials.spread.normals(numbers)
    values = _ask(trials, answer, scores, numbers)
    found = sobol_indices_from_samples(scores, values, confidence=confidence, seed=trials.spread.seed)
    return {
        "first_order": found.estimate,
        "first_order_low": found.low,
        "first_order_high": found.high,
    }, values


_WORDS = {
    "effect": "change of the answer for +1 standard score",
    "derivative": "change of the answer for a unit of the parameter",
    "answer_minus": "mean answer at the score -1",
    "answer_plus": "mean answer at the score +1",
    "step": "half of what the parameter differs by between the scores -1 and +1, in its unit",
    "first_order": "share of the variance of the answer that the parameter makes by itself",
    "total_order": "share of the variance of the answer that the parameter has a part in",
}


def _dataset(
    trials: Trials,
    answer: Answer,
    method: str,
    count: int,
    confidence: float,
    table: dict[str, _Array],
    values: _Array,
) -> xr.Dataset:
    import xarray as xr

    names = list(trials.spread.of)
    attrs: dict[str, Any] = {
        "title": "sensitivity of a struck bistable beam", "method": method, "samples": count, "runs_made": trials.runs,
        "confidence": confidence, "quantity": answer.words, "answer_units": answer.unit,
        "answer_mean": float(values.mean()), "answer_sd": float(values.std(ddof=1)),
        "uncertainty": canonical_json(trials.spread.describe()), "system": trials.system.hash, "seed": trials.spread.seed,
    }  # fmt: skip
    dataset = xr.Dataset(attrs=attrs)
    dataset[PARAMETER] = ((PARAMETER,), names, {"long_name": "parameter"})
    dataset["unit"] = ((PARAMETER,), [lookup(name).quantity.unit for name in names])
    for name, array in table.items():
        plain, _, end = name.rpartition("_") if name.endswith(("_low", "_high")) else (name, "", "")
        text = {"low": "lower limit: ", "high": "upper limit: "}.get(end, "") + _WORDS[plain]
        unit = answer.unit if plain in ("effect", "answer_minus", "answer_plus") else "1"
        dataset[name] = ((PARAMETER,), array, {"units": unit, "long_name": text})
    return dataset
