"""Diagnostics of a system: assumptions that do not hold, and values that look like another unit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from snapbeam.model.beam import Beam
from snapbeam.model.drive.base import Drive
from snapbeam.model.drive.recorded_acceleration import RecordedAcceleration
from snapbeam.model.drive.shock import GRAVITY
from snapbeam.model.drive.sine import Sine
from snapbeam.model.harvester import Harvester, PiezoelectricHarvester
from snapbeam.model.potential import Potential
from snapbeam.model.quantity import quantities
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.model.striker import Striker
from snapbeam.util.diagnostics import Diagnostic

__all__ = ["doubts_of"]


_STEEP = 0.2
"""Greatest slope of the buckled beam, pi b / L, up to which w is small against L."""
_STOCKY = 0.1
"""Thickness over length up to which shear and rotary inertia may be left out."""
_CENTRAL = 0.05
"""Distance of a striker from the centre, over the length, below which it hardly excites antisymmetric modes."""
_LONGEST_DRIFT = 1.0
"""Displacement by an offset of a recorded acceleration, over the length scale, up to which it is plausible."""
_LARGEST_RATIO = 20.0
_LARGEST_AMPLITUDE = 20.0


_STRONGEST_COUPLING = 1.0
"""Theta^2 (x_2 - x_1) L/(C E I) that no layers reach: e^2/(eps c) of the material, which stiffens the beam too."""


def doubts_of(
    potential: Potential,
    striker: Striker | None,
    harvester: Harvester | None = None,
    moving: Sequence[tuple[str, Drive]] = (),
) -> tuple[Diagnostic, ...]:
    """Diagnostics about a structure, the forces on it, what strikes it, its harvester and prescribed motions, by section."""
    model = potential.model
    found = [] if model.beam is None else _of_beam(model.beam) + _of_modes(model, model.beam, striker)
    if striker is not None and isinstance(striker.drive, Sine):
        found += _of_sine(striker.drive, model)
    if isinstance(harvester, PiezoelectricHarvester) and model.beam is not None:
        found += _of_layers(harvester, model.beam)
    for section, drive in moving:
        if isinstance(drive, RecordedAcceleration):
            found += _of_record(section, drive, model)
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


def _of_record(section: str, drive: RecordedAcceleration, model: ReducedModel) -> list[Diagnostic]:
    drift = drive.drift
    if model.length_scale is None or drift <= _LONGEST_DRIFT * model.length_scale:
        return []
    offset = float(np.median(drive.record))
    return [
        Diagnostic(
            "drifting-record",
            f"{section}.record: its acceleration has an offset of {offset:.3g} m/s^2 ({offset / GRAVITY:.2g} g), by which "
            f"its displacement drifts by {drift:.3g} m ({drift / model.length_scale:.3g} times the length scale) within "
            f"{drive.duration:.4g} s; subtract the offset, record - numpy.median(record), or filter the record by a "
            "high-pass below the lowest frequency that matters",
            {"drift": drift, "drift_over_length_scale": drift / model.length_scale, "offset": offset},
        )
    ]


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
    limit = " (of a clamped beam above 6.21)" if model.imperfection is None else ""
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


def _of_layers(harvester: PiezoelectricHarvester, beam: Beam) -> list[Diagnostic]:
    covered = (harvester.patch_end - harvester.patch_start) * beam.length
    stiffness = harvester.capacitance * beam.bending_stiffness
    coupling = harvester.moment_per_volt**2 * covered / stiffness
    if coupling < _STRONGEST_COUPLING:
        return []
    most = (_STRONGEST_COUPLING * stiffness / covered) ** 0.5
    return [
        Diagnostic(
            "unphysical-coupling",
            f"harvester.moment_per_volt = {harvester.moment_per_volt:g} N m/V with capacitance = "
            f"{harvester.capacitance:g} F: must be below {most:.3g} N m/V; Theta^2 (x_2 - x_1) L/(C E I) is "
            f"{coupling:.3g}, and no material reaches 1; use PiezoelectricHarvester.from_material",
            {"coupling": coupling, "greatest_moment_per_volt": most},
        )
    ]


def _of_sine(drive: Sine, model: ReducedModel) -> list[Diagnostic]:
    found = []
    if drive.frequency_ratio >= _LARGEST_RATIO:
        found.append(
            Diagnostic(
                "ratio-like-hertz",
                f"drive.frequency_ratio = {drive.frequency_ratio:g}: a ratio to the first natural frequency "
                f"({model.reference_frequency:.4g} Hz); is it given in Hz?",
                {"frequency_ratio": drive.frequency_ratio},
            )
        )
    if drive.velocity_amplitude >= _LARGEST_AMPLITUDE:
        found.append(
            Diagnostic(
                "amplitude-like-speed",
                f"drive.velocity_amplitude = {drive.velocity_amplitude:g}: a ratio to b omega_1; is it given in mm/s?",
                {"velocity_amplitude": drive.velocity_amplitude},
            )
        )
    return found
