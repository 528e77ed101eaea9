"""Equilibria of a system over one of its parameters: branches, stability, limit points and bifurcations."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.equilibrium_paths import (
    EquilibriumPath,
    attributes,
    count_incomplete,
    critical_points,
    paths_over_parameter,
    stable_parts,
)
from snapbeam.model.parameters import ratio_of
from snapbeam.model.potential import Potential
from snapbeam.model.system import System
from snapbeam.util.diagnostics import counting
from snapbeam.util.validation import InputError, checked, instance, interval, shown

if TYPE_CHECKING:
    import xarray as xr

_BEYOND = 1e-3
"""Distance beyond a critical point at which the beam is let go, over the range of the parameter."""


@checked
def equilibrium_branches(
    system: System,
    parameter: str,
    values: tuple[float, float],
    *,
    progress: Callable[[int, int], object] | bool | None = None,
) -> xr.Dataset:
    """Follow the equilibria of a system over one of its parameters.

    Branches solve dU(alpha; p)/dalpha = 0, with the potential energy U of :attr:`snapbeam.System.potential`, by
    continuation in arc length (Keller 1977) from the equilibria at five values of p.  A branch that exists between
    two of these values alone, and meets no other one, is not found.

    Parameters
    ----------
    system : System
        System at rest.
    parameter : str
        Dotted name or name in datasets of a number, such as ``"force.voltage"`` or ``"beam.buckling_level"``.
    values : (float, float)
        Range of the parameter, in its unit.
    progress : callable or bool, optional
        Called as ``progress(done, total)`` with the equilibria from which branches were followed; True prints it.

    Returns
    -------
    xarray.Dataset
        Variables over ``point``: the parameter under its name in datasets, ``midspan_displacement`` (m), ``energy``
        (J), ``unstable_directions`` (0: stable), ``branch``, ``amplitude`` (alpha, over ``mode``) and
        ``natural_frequency`` (Hz, over ``mode``; NaN where unstable).  Over ``critical_point``: ``critical_kind``
        ("limit" or "bifurcation"), ``critical_value``, ``critical_displacement`` (m), ``critical_branch``,
        ``critical_unstable_directions``, 0 where a stable part of the branch ends, and ``critical_outcome``: "unstable"
        on an unstable branch, else "pull-in" if the beam leaves the range of a law beyond the point, or "another well".
        Over ``stable_part`` and ``stable_end`` (first, last): ``stable_value``, ``stable_displacement`` (m) and
        ``stable_frequency`` (the first, Hz) where each stable part of a branch begins and ends, and ``stable_end_kind``, "limit", "bifurcation", or "none" where
        it ends at the end of the range, at the end of the range of a law or at another branch.

    See Also
    --------
    snapbeam.force_displacement, snapbeam.plot.plot_equilibrium_branches

    Examples
    --------
    Pull-in of a plate on a spring, V^2 = 8 k g^3/(27 eps_0 A) at a third of the gap:

    >>> import snapbeam as sb
    >>> plate = sb.ReducedModel.from_matrices([[1e-9]], [[2.0]], contact_shape=[1.0], length_scale=3e-6)
    >>> electrode = sb.ElectrostaticForce(voltage=1.0, area=4e-8, gap=3e-6)
    >>> found = sb.model.equilibrium_branches(sb.System(plate, forces=[electrode]), "force.voltage", (0.0, 8.0))
    >>> print(f"{float(found.critical_value[0]):.4f} V, {found.critical_kind.item(0)}")
    6.7213 V, limit
    """
    from snapbeam.util.datasets import xr

    instance("system", system, System, "a System")
    row = system.parameter(parameter)
    name = row.name
    if row.quantity.kind is not float or not isinstance(system.parameters.get(ratio_of(name)), float):
        raise InputError(
            f"parameter = {shown(parameter)}: must be a number that the system has; it has "
            f"{', '.join(key for key, value in system.parameters.items() if isinstance(value, float))}"
        )
    low, high = interval("values", values)
    for end in (low, high):
        system.replace(**{name: end})

    def potential_of(value: float) -> Potential:
        return system.replace(**{name: value}).potential

    report = counting(progress, "equilibrium branches", "equilibria")
    branches = paths_over_parameter(name, row.quantity.unit, potential_of, (low, high), report)
    value = np.concatenate([each.value for each in branches])
    alpha = np.concatenate([each.amplitude for each in branches])
    unstable = np.concatenate([each.unstable for each in branches])
    potentials = [potential_of(each) for each in value.tolist()]
    points, critical = critical_points(branches)
    outcomes = [
        _outcome(path, each.place, potential_of, _BEYOND * (high - low)) for path in branches for each in path.singular
    ]
    parts = [(path, part) for path in branches for part in stable_parts(path)]
    kinds = [{each.place: each.kind for each in path.singular} for path, _ in parts]
    ends = [[(float(path.value[at]), path.amplitude[at]) for at in part] for path, part in parts]
    places: dict[str, Any] = {
        row.short: ("point", value, attributes(row.quantity.unit, row.quantity.long_name)),
        "midspan_displacement": (
            "point",
            np.array([each.model.midspan_shape @ a for each, a in zip(potentials, alpha, strict=True)]),
            attributes("m", "displacement of the centre"),
        ),
        "energy": (
            "point",
            np.array([float(each.energy(a)) for each, a in zip(potentials, alpha, strict=True)]),
            attributes("J", "potential energy"),
        ),
        "unstable_directions": ("point", unstable, attributes("1", "unstable directions; 0 is stable")),
        "branch": (
            "point",
            np.repeat(np.arange(len(branches)), [each.value.size for each in branches]),
            attributes("1", "number of the branch"),
        ),
        "amplitude": (
            ("point", "mode"),
            alpha,
            attributes("m^0.5" if system.model.beam is not None else "1", "amplitudes of the modes"),
        ),
        "natural_frequency": (
            ("point", "mode"),
            np.array([_frequencies(*each) for each in zip(potentials, alpha, unstable, strict=True)]),
            attributes("Hz", "natural frequencies about the equilibrium"),
        ),
        **critical,
        "critical_unstable_directions": (
            "critical_point",
            np.array([each for _, _, each in points], dtype=np.int64),
            attributes("1", "unstable directions beside the critical point; 0 where a stable part ends"),
        ),
        "critical_outcome": (
            "critical_point",
            np.array(outcomes, dtype="<U12"),
            {"long_name": "what becomes of a beam beyond the critical point"},
        ),
        "stable_value": (
            ("stable_part", "stable_end"),
            np.array([[value for value, _ in each] for each in ends]).reshape(-1, 2),
            attributes(row.quantity.unit, f"{row.quantity.long_name}, at the ends of a stable part"),
        ),
        "stable_displacement": (
            ("stable_part", "stable_end"),
            np.array([[potential_of(value).model.midspan_shape @ a for value, a in each] for each in ends]).reshape(
                -1, 2
            ),
            attributes("m", "displacement of the centre at the ends of a stable part"),
        ),
        "stable_frequency": (
            ("stable_part", "stable_end"),
            np.array([[_frequencies(potential_of(value), a, 0)[0] for value, a in each] for each in ends]).reshape(
                -1, 2
            ),
            attributes("Hz", "first natural frequency at the ends of a stable part"),
        ),
        "stable_end_kind": (
            ("stable_part", "stable_end"),
            np.array(
                [[own.get(at, "none") for at in part] for own, (_, part) in zip(kinds, parts, strict=True)],
                dtype="<U11",
            ).reshape(-1, 2),
            {"long_name": "kind of the critical point at the end of a stable part"},
        ),
        "critical_value": (
            "critical_point",
            np.array([each for each, _, _ in points], dtype=np.float64),
            attributes(row.quantity.unit, f"{row.quantity.long_name}, at the critical point"),
        ),
        "critical_displacement": (
            "critical_point",
            np.array([potential_of(each).model.midspan_shape @ a for each, a, _ in points], dtype=np.float64),
            attributes("m", "displacement of the centre at the critical point"),
        ),
    }
    return xr.Dataset(
        places,
        coords={"mode": np.arange(1, system.model.modes + 1)},
        attrs={
            "description": f"equilibria over {row.quantity.long_name}",
            "parameter": name,
            "modes": system.model.modes,
            "incomplete_branches": count_incomplete(branches),
        },
    )


def _frequencies(potential: Potential, alpha: NDArray[np.float64], unstable: int) -> NDArray[np.float64]:
    """Natural frequencies, Hz; NaN about an unstable equilibrium."""
    if unstable:
        return np.full(alpha.size, np.nan)
    squared = np.linalg.eigvalsh(potential.in_modes(potential.tangent(alpha)))
    return np.asarray(np.sqrt(np.maximum(squared, 0.0)) / (2.0 * np.pi))


def _outcome(path: EquilibriumPath, at: int, potential_of: Callable[[float], Potential], beyond: float) -> str:
    """The motion without inertia beyond a critical point: "unstable", "pull-in" or "another well"."""
    if path.unstable[at]:
        return "unstable"
    # beyond a limit point there is no branch, beyond a bifurcation an unstable one
    last = len(path.value) - 1
    sides = [min(max(at + shift, 0), last) for shift in (-1, 1)]
    away = [float(path.value[side] - path.value[at]) for side in sides]
    kind = {each.place: each.kind for each in path.singular}[at]
    if kind == "limit":
        sign = -np.sign(sum(away))
    else:
        sign = np.sign(away[int(np.argmax([path.unstable[side] for side in sides]))])
    try:
        potential = potential_of(float(path.value[at] + sign * beyond))
        direction = np.linalg.eigh(potential.in_modes(potential.tangent(path.amplitude[at])))[1][:, 0]
        aside = potential.model.linear_modes @ direction
        aside *= 1e-3 * np.abs(potential.size).max() / np.abs(aside).max()
        settled = [potential.settles(path.amplitude[at] + each * aside) for each in (-1.0, 1.0)]
    except InputError:  # the parameter cannot go beyond
        return "another well"
    return "another well" if all(settled) else "pull-in"
