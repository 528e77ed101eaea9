"""Diagnostics of a system: assumptions that do not hold, and values that look like another unit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from snapbeam.model.beam import Beam
from snapbeam.model.potential import Potential
from snapbeam.model.quantity import quantities
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.model.striker import Striker
from snapbeam.util.diagnostics import Diagnostic

_STEEP = 0.2
"""Maximum slope of the buckled beam, pi b / L, up to which w is small against L."""
_STOCKY = 0.1
"""Thickness over length up to which shear and rotary inertia may be left out."""
_CENTRAL = 0.05
"""Distance of a striker from the centre, over the length, below which it hardly excites antisymmetric modes."""


def doubts_of(
    potential: Potential, striker: Striker | None, parts: Sequence[tuple[str, Any]] = ()
) -> tuple[Diagnostic, ...]:
    """Diagnostics about a structure, the forces on it, what strikes it, and its other parts, by section."""
    model = potential.model
    found = [] if model.beam is None else _of_beam(model.beam) + _of_modes(model, model.beam, striker)
    for section, part in parts:
        found += part.diagnostics(section, model)
    if model.imperfection is not None and not model.is_bistable:
        found.append(
            Diagnostic(
                "monostable",
                "this imperfection leaves one well: the beam is monostable, and crossings of its centre are no "
                f"change of wells; {model.two_well_limits}",
            )
        )
    if model.is_bistable and potential.local_forces:
        found += _of_wells(potential)
    return tuple(found)


def _of_wells(potential: Potential) -> list[Diagnostic]:
    """Response classes count crossings of the height that divides two wells."""
    count = len(potential.wells)
    if count == 2:
        return []
    message = (
        f"the local force leaves {count} wells, while response classes count crossings of the centre through "
        f"{potential.dividing_height:.4g} m, which divides the two wells of the structure without it"
    )
    return [Diagnostic("other-wells", message, {"wells": float(count)})]


def _of_beam(beam: Beam) -> list[Diagnostic]:
    found = []
    for name, item in quantities(Beam).items():
        value = float(getattr(beam, name))
        if item.plausible is None or value == 0.0:
            continue
        low, high, meant = item.plausible
        if not low <= abs(value) <= high:
            found.append(
                Diagnostic(
                    "implausible-size",
                    f"beam.{name} = {value:g} {item.unit}: beams have {low:g} to {high:g} {item.unit}; "
                    f"is it given in {meant}?",
                    {name: value},
                )
            )
    for name in ("thickness", "width"):
        if getattr(beam, name) >= beam.length:
            found.append(
                Diagnostic(
                    "implausible-size",
                    f"beam.{name} = {getattr(beam, name):g} m is not less than beam.length = {beam.length:g} m; "
                    "is one of them given in another unit?",
                )
            )
    slope = 3.141592653589793 * beam.buckling_level / beam.length
    if slope > _STEEP:
        found.append(
            Diagnostic(
                "not-shallow",
                f"the buckled beam has a slope of {slope:.2g}: the model takes the displacement as small against the "
                "length (slopes up to 0.2), and its numbers are rough here",
                {"slope": slope},
            )
        )
    if beam.thickness / beam.length > _STOCKY:
        found.append(
            Diagnostic(
                "not-slender",
                f"the thickness is {beam.thickness / beam.length:.2g} of the length: shear and rotary inertia, which "
                "the model leaves out, matter above 0.1",
                {"thickness_over_length": beam.thickness / beam.length},
            )
        )
    return found


def _of_modes(model: ReducedModel, beam: Beam, striker: Striker | None) -> list[Diagnostic]:
    if model.modes < 2 or model.given_reference_frequency is not None:
        return []
    well = model.about_reference_well
    symmetric = well.natural_frequencies[well.parity > 0]
    if well.parity[0] >= 0 or not symmetric.size or not np.any(well.well_amplitude):
        return []
    level = beam.buckling_level / beam.radius_of_gyration
    words = {"upper": "the upper well", "lower": "the lower well", "only": "the equilibrium"}
    name = words.get(model.reference_well, "a well")
    perfect = f"b/r = {level:.3g}: " if model.imperfection is None else ""
    limit = " (of a clamped beam above about 6.2)" if model.imperfection is None else ""
    central = striker is None or abs(striker.location - 0.5) < _CENTRAL
    hint = ", which a striker at the centre does not excite" if central else ""
    return [
        Diagnostic(
            "first-mode-antisymmetric",
            f"{perfect}the lowest mode about {name} is antisymmetric{limit}, and omega_1, by which Omega and V are "
            f"normalised, is its frequency ({well.natural_frequencies[0]:.5g} Hz){hint}; set "
            f"model.reference_frequency = {symmetric[0]:.5g} Hz to normalise by the first symmetric mode",
            {"buckling_level_over_radius": level, "symmetric_frequencies": float(symmetric[0])},
        )
    ]
