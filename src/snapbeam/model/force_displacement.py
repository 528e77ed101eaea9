"""Force-displacement curves under a static point force: every branch, its stability, snap-through and snap-back."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.equilibrium_paths import (
    EquilibriumPath,
    attributes,
    count_incomplete,
    critical_points,
    equilibrium_paths,
    stable_parts,
)
from snapbeam.model.potential import Potential
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.model.system import System
from snapbeam.util.singular_values import svd
from snapbeam.util.validation import InputError, InputTypeError, checked, choice, interval, shown, within

if TYPE_CHECKING:
    import xarray as xr

_Array = NDArray[np.float64]

_MARGIN = 0.25
"""Margin of the default range beyond the outermost equilibrium and critical point, over their distance."""
_BEYOND = 2.0
"""Margin of the search for critical points beyond the outermost equilibria, over the size of a well."""


@checked
def force_displacement(
    system: System | ReducedModel | Potential,
    location: float | None = None,
    *,
    well: str | None = None,
    displacement_range: tuple[float, float] | None = None,
) -> xr.Dataset:
    r"""Compute the static force-displacement curve of a point force: every branch and its stability.

    The force F acts at *location*, positive towards the upper well; w is the displacement of that point from the
    straight line through the ends. With c = phi(x_s) and the potential energy U (:attr:`snapbeam.System.potential`) the
    equilibria solve

        dU/dalpha = F c.

    The paths through all equilibria without the force and those that branch off are followed in arc length. Of a
    structure without local forces closed paths are found too, from all equilibria under 40 forces.

    Parameters
    ----------
    system : System, ReducedModel or Potential
        System; its local forces and the constant part of an external force act.
    location : float, optional
        Location x_s in (0, 1); that of the striker, or of a structure given by matrices, by default.
    well : {"lower", "upper"}, optional
        Well from which the force pushes the beam; by default the as-fabricated one, on the side of the initial shape,
        or the lower one.
    displacement_range : (float, float), optional
        Range of w, m; by default all equilibria and critical points, and a quarter more.

    Returns
    -------
    xarray.Dataset
        Variables over ``point``: ``displacement`` (m), ``force`` (N), ``energy`` (J, without the work of the force),
        ``branch``, ``unstable_directions`` under a given force (0: stable),
        ``unstable_directions_at_fixed_displacement``, ``amplitude`` (alpha, over ``mode``). Over ``branch_number``:
        ``branch_kind``, "primary" or "secondary". Over ``critical_point``: ``critical_kind`` ("limit" or
        "bifurcation"), ``critical_displacement`` (m), ``critical_force`` (N), ``critical_branch``.
        ``snap_through_force`` (N) ends the stable path from the well; ``snap_back_force`` ends that of the other well
        on the way back or, with one well, the path from a large force. ``snap_through_displacement`` and
        ``snap_back_displacement`` (m) belong to them. They are NaN without snap-through. ``energy_barrier`` (J) is from
        the well to the lowest adjacent saddle without a force, ``energy_barrier_back`` from the other well; NaN with
        one well. The attributes name the well and its choice.

    Raises
    ------
    InputError
        For a location at a node of all modes, a linear system, or a well that does not exist.

    See Also
    --------
    snapbeam.model.equilibrium_branches, snapbeam.plot.plot_force_displacement

    Examples
    --------
    The bistable arch of Qiu, Lang and Slocum has a rise of six thicknesses:

    >>> import snapbeam as sb
    >>> beam = sb.Beam(length=3e-3, thickness=1e-5, width=5e-4, density=2330, young_modulus=169e9, axial_load=0.0)
    >>> arch = sb.ReducedModel.from_beam(beam, modes=3, imperfection=sb.Imperfection(midspan_amplitude=6e-5))
    >>> curve = sb.force_displacement(arch, 0.5)
    >>> print(f"{float(curve.snap_through_force) * 1e3:.2f} mN, {curve.attrs['snap_through_kind']}")
    -6.11 mN, bifurcation
    """
    from snapbeam.util.datasets import xr

    if isinstance(system, System):
        potential = system.potential
    elif isinstance(system, ReducedModel):
        potential = Potential.of(system, ())
    elif isinstance(system, Potential):
        potential = system
    else:
        raise InputTypeError(f"system = {shown(system)}: must be a System, a ReducedModel or a Potential")
    model = potential.model
    if location is None:
        if isinstance(system, System) and system.striker is not None:
            location = system.striker.location
        elif model.beam is not None:
            raise InputError("location = None: must be given, in (0, 1), for a system without a striker")
        else:
            location = 0.5
    location = within("location", location, 0.0, 1.0)
    if not (model.nonlinear_stiffness > 0.0 or potential.local_forces):
        raise InputError("nonlinear_stiffness = 0: must be greater than 0; a linear structure has a straight line")
    row = np.asarray(model.shape_at(location), dtype=np.float64)
    if np.abs(row).max() <= 1e-12 * np.abs(model.midspan_shape).max():
        raise InputError(f"location = {location:g}: no mode moves there; use another location or more modes")
    side, chosen = _well(potential, well)
    given = None if displacement_range is None else interval("displacement_range", displacement_range)
    places = [float(row @ each.amplitude) for each in potential.equilibria]
    size = max(float(np.abs(row * potential.size).sum()), np.ptp(places))
    between = min(places) - _BEYOND * size, max(places) + _BEYOND * size
    if given is not None:
        between = min(between[0], given[0]), max(between[1], given[1])
    branches = equilibrium_paths(potential, row, between)
    points, critical = critical_points(branches)
    places += [float(row @ each) for _, each, _ in points]
    margin = _MARGIN * np.ptp(places) or size
    low, high = (min(places) - margin, max(places) + margin) if given is None else given

    lost = count_incomplete(branches)
    kept = [(low <= each.amplitude @ row) & (each.amplitude @ row <= high) for each in branches]
    force = np.concatenate([each.value[inside] for each, inside in zip(branches, kept, strict=True)])
    alpha = np.concatenate([each.amplitude[inside] for each, inside in zip(branches, kept, strict=True)])
    unstable = np.concatenate([each.unstable[inside] for each, inside in zip(branches, kept, strict=True)])
    numbers = np.repeat(np.arange(len(branches)), [inside.sum() for inside in kept])
    if not force.size:
        raise InputError(
            f"displacement_range = {displacement_range!r}: must contain a part of the curve, which has equilibria "
            f"without a force at {', '.join(f'{row @ each.amplitude:.4g}' for each in potential.equilibria)} m"
        )
    snaps = _snaps(potential, row, branches, side)
    barriers = {"energy_barrier": math.nan, "energy_barrier_back": math.nan}
    if len(potential.wells) > 1:
        ends = [potential.barrier(0), potential.barrier(len(potential.wells) - 1)]
        barriers = dict(zip(barriers, ends if side == "lower" else ends[::-1], strict=True))
    variables: dict[str, Any] = {
        "displacement": ("point", alpha @ row, attributes("m", "displacement at the force's location")),
        "force": ("point", force, attributes("N", "force")),
        "energy": ("point", potential.energy(alpha), attributes("J", "potential energy without the force")),
        "unstable_directions": ("point", unstable, attributes("1", "unstable directions under the force; 0 is stable")),
        "unstable_directions_at_fixed_displacement": (
            "point",
            _unstable_at_fixed_displacement(potential, row, alpha),
            attributes("1", "unstable directions if the displacement at the force is held"),
        ),
        "branch": ("point", numbers, attributes("1", "number of the branch")),
        "amplitude": (
            ("point", "mode"),
            alpha,
            attributes("m^0.5" if model.beam is not None else "1", "amplitudes of the modes"),
        ),
        "branch_kind": (
            "branch_number",
            np.array(["secondary" if each.secondary else "primary" for each in branches]),
            {"long_name": "kind of the branch"},
        ),
        **critical,
        "critical_displacement": (
            "critical_point",
            np.array([row @ each for _, each, _ in points]),
            attributes("m", "displacement at the force's location, at the critical point"),
        ),
        "critical_force": (
            "critical_point",
            np.array([each for each, _, _ in points]),
            attributes("N", "force at the critical point"),
        ),
    }
    for name in ("snap_through", "snap_back"):
        words = name.replace("_", "-")
        variables[f"{name}_force"] = ((), snaps[name][0], attributes("N", f"{words} force"))
        variables[f"{name}_displacement"] = (
            (),
            snaps[name][1],
            attributes("m", f"displacement at the force's location, at {words}"),
        )
    origins = {"energy_barrier": "from the well", "energy_barrier_back": "from the other well"}
    for name, value in barriers.items():
        variables[name] = ((), value, attributes("J", f"energy barrier {origins[name]}, without a force"))
    return xr.Dataset(
        variables,
        coords={"branch_number": np.arange(len(branches)), "mode": np.arange(1, model.modes + 1)},
        attrs={
            "description": "static force-displacement curve of a point force",
            **({"location": location} if model.beam is not None else {}),
            "well": side,
            "well_chosen_as": chosen,
            "wells": len(potential.wells),
            "snap_through_kind": snaps["snap_through"][2],
            "snap_back_kind": snaps["snap_back"][2],
            "incomplete_branches": lost,
            "modes": model.modes,
        },
    )


def _well(potential: Potential, given: str | None) -> tuple[str, str]:
    """Name of the well that the force pushes from, and how it was chosen."""
    wells = potential.wells
    if not wells:
        raise InputError(
            f"forces = {', '.join(map(shown, potential.local_forces))}: leave no well, such as beyond pull-in; give a "
            "weaker force"
        )
    only = "upper" if potential.center(wells[0]) > 0.0 else "lower"
    if given is not None:
        name = choice("well", given, ("lower", "upper"))
        if len(wells) < 2 and name != only:
            raise InputError(f"well = {name!r}: this system has one well, the {only} one; leave well out")
        return name, "given"
    if len(wells) < 2:
        return only, "the only equilibrium"
    side = potential.model.as_fabricated_well
    return ("lower", "lower by default; no initial shape") if side is None else (side, "as fabricated")


def _unstable_at_fixed_displacement(potential: Potential, row: _Array, alpha: _Array) -> NDArray[np.int_]:
    """Negative eigenvalues of the tangent stiffness, at fixed displacement on the row, at (points, N) amplitudes."""
    if alpha.shape[1] == 1:
        return np.zeros(alpha.shape[0], dtype=np.int_)
    free = svd(row[None, :])[2][1:]
    value = np.linalg.eigvalsh(free @ np.stack([potential.tangent(each) for each in alpha]) @ free.T)
    return np.asarray((value < -1e-12 * np.abs(value).max(axis=1)[:, None]).sum(axis=1))


def _snaps(
    potential: Potential, row: _Array, branches: list[EquilibriumPath], side: str
) -> dict[str, tuple[float, float, str]]:
    """Force, displacement and kind of the critical points where the stable paths of the two sides end."""
    none = math.nan, math.nan, "none"
    push = 1.0 if side == "lower" else -1.0
    stable = [(path, *part) for path in branches for part in stable_parts(path)]

    def distance(part: tuple[EquilibriumPath, int, int], well: _Array) -> float:
        path, first, last = part
        force = path.value[first : last + 1]
        near = np.flatnonzero(force[:-1] * force[1:] <= 0.0) + first
        points = path.amplitude[np.concatenate((near, near + 1))]
        return float(np.abs(points - well).max(axis=1).min()) if near.size else math.inf

    def ends(path: EquilibriumPath, first: int, last: int) -> list[tuple[float, float, str]]:
        return [
            (float(path.value[at]), float(row @ path.amplitude[at]), kind)
            for at, kind in path.singular
            if at in (first, last)
        ]

    wells = [each.amplitude for each in potential.wells]
    wells = wells if side == "lower" else wells[::-1]
    home = min(stable, key=lambda part: distance(part, wells[0]))
    if len(wells) > 1:
        away = min(stable, key=lambda part: distance(part, wells[-1]))
    else:
        # the stable part that goes on to any force in the direction of the push
        away = max(stable, key=lambda part: float((push * part[0].value[part[1] : part[2] + 1]).max()))
    if home is away or not wells[0].any():
        return {"snap_through": none, "snap_back": none}
    return {
        "snap_through": max(ends(*home), key=lambda each: push * each[0], default=none),
        "snap_back": min(ends(*away), key=lambda each: push * each[0], default=none),
    }
