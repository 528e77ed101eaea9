"""A system: everything that is studied, as one value."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np

from snapbeam.model.axial_load import AxialLoadModulation
from snapbeam.model.base_excitation import BaseExcitation, rigid_mass
from snapbeam.model.contact.base import ContactLaw
from snapbeam.model.diagnostics import doubts_of
from snapbeam.model.drive.base import Drive, Scale
from snapbeam.model.drive.fixed_stop import FixedStop
from snapbeam.model.external_force import ExternalForce
from snapbeam.model.harvester import Harvester
from snapbeam.model.local_force import LocalForce
from snapbeam.model.mapping import parts_from_mapping, parts_to_mapping, replaced
from snapbeam.model.potential import Potential
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.model.state import State, rest_state, started
from snapbeam.model.striker import ContactPair, Shaker, Striker, check_others, parted
from snapbeam.util.diagnostics import Diagnostic
from snapbeam.util.files import atomic_path, check_writable
from snapbeam.util.provenance import canonical_json
from snapbeam.util.validation import InputError, InputTypeError, instance, shown

__all__ = ["System", "check_environment"]


# ----------------------------------------------------------------------------------------------------
# What surrounds a beam, held against the rest of a system: mixtures that are refused, with the way out.


_A = {
    "base_excitation": "a BaseExcitation(motion=AccelerationSine(...))",
    "axial_load": "an AxialLoadModulation(motion=HarmonicLoad(...))",
    "external_force": "an ExternalForce(history=HarmonicForce(...))",
    "local_force": "a LocalSpring(...), or a law that is derived from LocalForce",
    "harvester": "a PiezoelectricHarvester(...) or an ElectromagneticHarvester(...)",
}


def check_environment(system: Any) -> None:
    """Refuse surroundings that are none, or that do not go with the rest of a :class:`~snapbeam.System`."""
    base, load, harvester = system.base_excitation, system.axial_load, system.harvester
    force = system.external_force
    for name, part, kind in (
        ("base_excitation", base, BaseExcitation),
        ("axial_load", load, AxialLoadModulation),
        ("external_force", force, ExternalForce),
        ("local_force", system.local_force, LocalForce),
        ("harvester", harvester, Harvester),
    ):
        if part is not None and not isinstance(part, kind):
            raise InputTypeError(f"{name} = {shown(part)}: must be {_A[name]}")
    if base is not None:
        rigid_mass(system.model)
    if force is not None:
        force.row(system.model)
        if base is not None:
            raise InputError(
                "external_force with base_excitation: the solver has one excitation row; add the inertial force of the "
                "base to the external force, or leave one out"
            )
    if harvester is not None:
        harvester.row(system.model)
    _check_local_force(system)
    if base is None and load is None and harvester is None and force is None:
        return
    words = "a harvester" if harvester is not None else "a changing axial load"
    words = "a moving base" if base is not None else words
    words = "an external force" if force is not None else words
    contact, striker = system.contact, system.striker
    if contact is not None and contact.impulsive:
        raise InputError(
            f"contact = {contact!r} with {words}: sticking under Newton's law includes the tip's force only; use a "
            "HertzContact, or a HuntCrossley with the same restitution"
        )
    if contact is not None and contact.rate_dependent and harvester is not None:
        raise InputError(
            f"contact = {shown(contact)} with a harvester: two things that depend on the velocity at once; use a "
            "HertzContact or a PowerLaw, and let damping_ratio stand for the loss"
        )
    if (
        striker is not None
        and striker.drive.samples().size
        and (base is not None or load is not None or force is not None)
    ):
        raise InputError(
            f"drive = {striker.drive.name!r} with {words}: a recording has its own time axis; use a drive given by a formula, "
            "or a FixedStop"
        )
    if load is not None and system.model.beam is None:
        raise InputError(
            "axial_load: changes the axial load of a beam; a structure given by matrices has its load in its stiffness"
        )


def _check_local_force(system: Any) -> None:
    """Refuse a local force beside what is not integrated with it."""
    local, contact = system.local_force, system.contact
    if local is None:
        return
    local.row(system.model)
    if contact is not None and contact.impulsive:
        raise InputError(
            f"contact = {contact!r} with a local force: sticking under Newton's law includes the tip's force only; use a "
            "HertzContact, or a HuntCrossley with the same restitution"
        )
    if local.dissipative and (
        system.harvester is not None or (contact is not None and contact.rate_dependent)
    ):
        raise InputError(
            f"local_force = {shown(local)} with a harvester or a contact law that depends on the velocity: the solver "
            "has one velocity-dependent force; leave one of them out"
        )


# ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class System:
    """A structure, what strikes it and how they touch: what is studied, frozen, described, hashed and saved.

    Parameters
    ----------
    model : ReducedModel
    contact : ContactLaw, or a sequence of them, optional
        Needed with a striker.  Of several strikers, one law each or one for all.
    striker : Striker or Shaker, or a sequence of them, optional
        Without one the structure vibrates freely from *initial_state*.  Several strike at once, each with its own place, side,
        law and drive; runs begin in the well that the first one pushes away from.
    base_excitation : BaseExcitation, optional
        The motion of what both ends of the beam are mounted on.
    axial_load : AxialLoadModulation, optional
        How the axial load changes in time.
    external_force : ExternalForce, optional
        A force on the structure; not beside a base excitation.
    local_force : LocalForce, optional
        A force that depends on the displacement and velocity of one point, such as a :class:`~snapbeam.LocalSpring` or a law of
        one's own.
    harvester : PiezoelectricHarvester or ElectromagneticHarvester, optional
        A circuit that turns motion into power in a resistor.
    initial_state : State, optional
        Where runs begin, one state; by default at rest in the well that the striker pushes away from, touched by it.

    Attributes
    ----------
    further_contacts : tuple of ContactPair
        The strikers beside the first one, with their laws.

    Raises
    ------
    InputError
        For parts that are none, or that do not go together.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam.model import default_values
    >>> system = sb.System(
    ...     sb.ReducedModel.from_beam(default_values.BEAM, modes=8),
    ...     contact=default_values.CONTACT,
    ...     striker=sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.18),
    ... )
    >>> thicker = system.replace(**{"beam.thickness": 5e-4, "striker.location": 0.3})
    """

    model: ReducedModel
    contact: ContactLaw | None = None
    striker: Striker | None = None
    initial_state: State | None = None
    base_excitation: BaseExcitation | None = None
    axial_load: AxialLoadModulation | None = None
    harvester: Harvester | None = None
    further_contacts: tuple[ContactPair, ...] = ()
    external_force: ExternalForce | None = None
    local_force: LocalForce | None = None

    def __post_init__(self) -> None:
        if isinstance(self.striker, (list, tuple)) or isinstance(self.contact, (list, tuple)):
            for name, value in parted(self.striker, self.contact, self.further_contacts).items():
                object.__setattr__(self, name, value)
        model, contact, striker, start = self.model, self.contact, self.striker, self.initial_state
        if not isinstance(model, ReducedModel):
            raise InputTypeError(f"model = {shown(model)}: must be a ReducedModel")
        if isinstance(striker, Shaker):
            striker = striker.striker()
            object.__setattr__(self, "striker", striker)
        if striker is not None and not isinstance(striker, Striker):
            raise InputTypeError(f"striker = {shown(striker)}: must be a Striker or a Shaker")
        if contact is not None and not isinstance(contact, ContactLaw):
            raise InputTypeError(
                f"contact = {shown(contact)}: must be a law of contact, such as HertzContact(stiffness)"
            )
        if contact is not None and contact.max_modes is not None and model.modes > contact.max_modes:
            raise InputError(
                f"contact = {shown(contact)} with modes = {model.modes}: Newton's law needs one mode, since the "
                "mass met by an impulse at a point falls to zero as modes are added; use a HertzContact"
            )
        if striker is not None and striker.mass is not None and contact is not None and contact.impulsive:
            raise InputError(
                f"contact = {contact!r} with striker mass = {striker.mass:g} kg: under Newton's law the striker moves "
                "as prescribed; leave the mass out, or use a HertzContact or a HuntCrossley"
            )
        if striker is not None and contact is None:
            raise InputError(
                "contact = None: a striker needs a law of contact, such as HertzContact(stiffness)"
            )
        check_environment(self)
        check_others(self)
        if model.length_scale is None:
            model.require_bistable("a run")
        if start is not None:
            if not isinstance(start, State):
                raise InputTypeError(f"initial_state = {shown(start)}: must be a State")
            if start.batch:
                raise InputError(f"initial_state: a batch of shape {start.batch}: must be one state")
            if start.modes != model.modes:
                raise InputError(
                    f"initial_state of {start.modes} modes: must have the {model.modes} modes of the model"
                )
            # what a system is made of is what it is hashed and saved by: a state's way here is no part of it
            object.__setattr__(
                self, "initial_state", dataclasses.replace(start, tangent=None, statistics=None, modal=None)
            )

    # ------------------------------------------------------------------ by dotted name

    def replace(self, **changes: Any) -> System:
        """A neighbour: the same system with parameters changed by dotted name.

        Names are those of the table of parameters (:func:`snapbeam.model.parameters.parameters`), such as
        ``beam.thickness``, ``model.modes``, ``contact.stiffness``, ``striker.location`` and
        ``drive.frequency_ratio`` (of the second striker ``striker_2.location``, ``drive_2.frequency_ratio``,
        ``contact_2.stiffness``), or whole parts: ``beam``, ``model``, ``contact``, ``striker``, ``drive``, ``initial_state``,
        ``base_excitation``, ``axial_load``, ``external_force``, ``local_force``, ``harvester``.

        Raises
        ------
        InputError
            For a name that the system does not have, and for values as the parts refuse them.
        """
        prefix = "initial_state."
        parts = {item.name: getattr(self, item.name) for item in fields(self)}
        other = {name: value for name, value in changes.items() if not name.startswith(prefix)}
        found = System(**replaced(parts, other))
        start = {name.removeprefix(prefix): changes[name] for name in changes if name not in other}
        if not start:
            return found
        return dataclasses.replace(found, initial_state=started(found.model, found.start_state, start))

    def get(self, name: str) -> Any:
        """The value of a parameter by its dotted name.

        Raises
        ------
        InputError
            For a name that the system does not have.
        """
        found = self.parameters
        if instance("name", name, str, "text") not in found:
            raise InputError(f"{name}: is not a parameter of this system; it has {', '.join(found)}")
        return found[name]

    @cached_property
    def parameters(self) -> dict[str, Any]:
        """Every parameter by dotted name, plain numbers, words and arrays."""
        return {
            f"{section}.{name}": value
            for section, values in self.to_mapping().items()
            for name, value in values.items()
        }

    @property
    def scale(self) -> Scale:
        """Length and angular frequency that displacements and drives are normalised by."""
        assert self.model.length_scale is not None
        return Scale(self.model.length_scale, 2.0 * np.pi * self.model.reference_frequency)

    @property
    def moving(self) -> tuple[tuple[str, Drive], ...]:
        """What moves as prescribed, by the section that its parameters stand in; the first one's cycle counts.

        A striker that stands still moves nothing where a base or an axial load does.
        """
        found: list[tuple[str, Drive]] = []
        more = [
            (f"drive_{number}", each.striker.drive)
            for number, each in enumerate(self.further_contacts, 2)
            if not isinstance(each.striker.drive, FixedStop)
        ]
        around = self.base_excitation, self.axial_load, self.external_force
        alone = all(each is None for each in around) and not more
        if self.striker is not None and (alone or not isinstance(self.striker.drive, FixedStop)):
            found.append(("drive", self.striker.drive))
        found += more
        if self.base_excitation is not None:
            found.append(("base_excitation", self.base_excitation.motion))
        if self.axial_load is not None:
            found.append(("axial_load", self.axial_load.motion))
        if self.external_force is not None:
            found.append(("external_force", self.external_force.history))
        return tuple(found)

    @property
    def has_environment(self) -> bool:
        """Whether a base moves, the axial load changes, an external or local force acts, or there is a harvester."""
        around = self.base_excitation, self.axial_load, self.external_force, self.local_force, self.harvester
        return any(each is not None for each in around)

    @property
    def primary_excitation(self) -> tuple[str, Drive] | None:
        """That of which one cycle is a cycle of excitation, with its section; None where nothing moves."""
        return self.moving[0] if self.moving else None

    @cached_property
    def potential(self) -> Potential:
        """Potential energy of the structure, the local forces and the constant part of the external force, with its wells."""
        return Potential.of(self.model, self.external_force, self.local_force)

    @cached_property
    def unloaded_potential(self) -> Potential:
        """The potential energy before a run, when no external force acts yet: its wells are those that a run begins in."""
        if not self.potential.constant.any():
            return self.potential
        return Potential.of(self.model, None, self.local_force)

    @cached_property
    def rest_state(self) -> State:
        """At rest in the well that the first striker pushes away from, touched by it; without one, in the well of the start.

        With a local force it is the well of the system that a beam comes to, without inertia, from that well of the
        structure.  An external force begins with the run, its constant part too.

        Raises
        ------
        InputError
            If the local force leaves no well there.
        """
        state, local = rest_state(self.model, self.striker), self.unloaded_potential
        if local.is_of_the_structure_alone:
            return state
        well = local.descent(state.amplitude)
        if well is None:
            raise InputError(
                f"local_force = {shown(self.local_force)}: leaves no well where a run begins, such as beyond pull-in; give "
                "an initial_state, or a weaker force"
            )
        return State(amplitude=local.wells[well].amplitude)

    @property
    def start_state(self) -> State:
        """The state that runs begin in: the initial state, or at rest."""
        return self.rest_state if self.initial_state is None else self.initial_state

    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Diagnostics: values that look like another unit, and assumptions of the model that do not hold."""
        return doubts_of(self.unloaded_potential, self.striker, self.harvester, self.moving)

    # ------------------------------------------------------------------ identity and files

    def to_mapping(self) -> dict[str, dict[str, Any]]:
        """The system as sections of plain values, as a parameter file holds them."""
        return parts_to_mapping(self)

    @classmethod
    def from_mapping(cls, sections: Mapping[str, Mapping[str, Any]]) -> System:
        """The system that such sections describe.

        Raises
        ------
        InputError
            For sections, names or values that are none of a system.
        """
        return cls(**parts_from_mapping(sections))

    @cached_property
    def hash(self) -> str:
        """SHA-256 of everything the numbers depend on, every sample of a recorded drive included."""
        text = canonical_json(_hashable(self.to_mapping()))
        return hashlib.sha256(text.encode()).hexdigest()

    def __eq__(self, other: object) -> bool:
        return self.hash == other.hash if isinstance(other, System) else NotImplemented

    def __hash__(self) -> int:
        return int(self.hash[:15], 16)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the system to a TOML file, whole or not at all; :meth:`load` reads it back equal."""
        import tomli_w

        target = check_writable(path, "path", (".toml",))
        with atomic_path(target) as temporary:
            temporary.write_text(tomli_w.dumps(_without_none(self.to_mapping())), encoding="utf-8")

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> System:
        """Read a parameter file, or a file that :meth:`save` wrote.

        Sections of commands, such as ``integration`` and ``probability``, are left out.

        Raises
        ------
        InputError
            If the file cannot be read, is no TOML or describes no system.
        """
        from snapbeam.model.parameter_file import system_of_file

        return system_of_file(path)

    def describe(self) -> str:
        """The system in a few lines, for a person to read."""
        lines = []
        for section, values in self.to_mapping().items():
            words = ", ".join(
                f"{name} = {_brief(value)}" for name, value in values.items() if value is not None
            )
            lines.append(f"{section:8s}  {words}")
        return "\n".join(lines)

    def plot(self, title: str = "") -> Any:
        """Draw the schematic of the system, and return the figure; see :func:`snapbeam.plot.plot_system`."""
        from snapbeam.util.display import plotter

        return plotter("plot_system")(self, title)

    def _repr_html_(self) -> str:
        from snapbeam.util.display import html_table

        rows = [(section, text.strip()) for section, _, text in map(_parted, self.describe().splitlines())]
        return html_table(f"System, hash {self.hash[:12]}", rows)

    def __repr__(self) -> str:
        parts = [f"modes={self.model.modes}", f"contact={self.contact!r}"]
        if self.striker is not None:
            parts.append(
                f"striker={self.striker!r}"
                if self.striker.drive.harmonic
                else f"striker={self.striker.drive.name}"
            )
        if self.further_contacts:
            parts.append(f"strikers={1 + len(self.further_contacts)}")
        return f"<System {', '.join(parts)}, hash {self.hash[:12]}>"


def _hashable(value: Any) -> Any:
    """*value* with long arrays replaced by the hash of their bytes."""
    if isinstance(value, np.ndarray) and value.size > 256:
        data = np.ascontiguousarray(value, dtype="<f8")
        return {"shape": list(value.shape), "sha256": hashlib.sha256(data.tobytes()).hexdigest()}
    if isinstance(value, Mapping):
        return {key: _hashable(item) for key, item in value.items()}
    return value


def _without_none(sections: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    return {
        section: {
            name: value.tolist() if isinstance(value, np.ndarray) else value
            for name, value in values.items()
            if value is not None
        }
        for section, values in sections.items()
    }


def _brief(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"array of shape {value.shape}" if value.size > 4 else json.dumps(value.tolist())
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _parted(line: str) -> tuple[str, str, str]:
    return line.partition("  ")
