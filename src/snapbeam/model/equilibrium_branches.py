"""Equilibria of a system over one of its parameters: branches, stability, limit points and bifurcations."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.equilibrium_paths import (
    attributes,
    count_incomplete,
    critical_points,
    paths_over_parameter,
)
from snapbeam.model.parameters import ratio_of
from snapbeam.model.potential import Potential
from snapbeam.model.system import System
from snapbeam.util.validation import InputError, checked, instance, interval, shown

if TYPE_CHECKING:
    import xarray as xr


@checked
def equilibrium_branches(system: System, parameter: str, values: tuple[float, float]) -> xr.Dataset:
    """Follow the equilibria of a system over one of its parameters.

    Branches solve dU(alpha; p)/dalpha = 0, with the potential energy U of :attr:`snapbeam.System.potential`, by
    continuation in arc length (Keller 1977) from the equilibria at five values of p.  A branch that exists between
    two of these values alone, and meets no other one, is not found.

    Parameters
    ----------
    system : System
    parameter : str
        Dotted name or name in datasets of a number, such as ``"force.voltage"`` or ``"beam.buckling_level"``.
    values : (float, float)
        Range of the parameter, in its unit.

    Returns
    -------
    xarray.Dataset
        Over ``point``: the parameter under its name in datasets, ``midspan_displacement`` (m), ``energy`` (J),
        ``unstable_directions`` (0: stable), ``branch``, ``amplitude`` (alpha, over ``mode``) and
        ``natural_frequency`` (Hz, over ``mode``; NaN where unstable).  Over ``critical_point``: ``critical_kind``
        ("limit" or "bifurcation"), ``critical_value``, ``critical_displacement`` (m), ``critical_branch``, and
        ``critical_unstable_directions``, 0 where a stable part of the branch ends.

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

    branches = paths_over_parameter(name, row.quantity.unit, potential_of, (low, high))
    value = np.concatenate([each.value for each in branches])
    alpha = np.concatenate([each.amplitude for each in branches])
    unstable = np.concatenate([each.unstable for each in branches])
    potentials = [potential_of(each) for each in value.tolist()]
    points, critical = critical_points(branches)
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
