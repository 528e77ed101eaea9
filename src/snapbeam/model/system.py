"""A system: everything that is studied, as one value."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from snapbeam.model.axial_load import AxialLoadModulation
from snapbeam.model.base_excitation import BaseExcitation, rigid_mass
from snapbeam.model.contact.base import ContactLaw
from snapbeam.model.diagnostics import doubts_of
from snapbeam.model.drive.base import Drive, Scale
from snapbeam.model.drive.fixed_stop import FixedStop
from snapbeam.model.equilibria import Equilibrium
from snapbeam.model.external_force import ExternalForce
from snapbeam.model.harvester import Harvester
from snapbeam.model.local_force import LocalForce
from snapbeam.model.mapping import PARTS, nested, parts_from_mapping, parts_to_mapping, replaced, resolved, sequence_of
from snapbeam.model.parameter_axes import ratios_of, to_physical
from snapbeam.model.parameters import PHYSICAL, SECTIONS, Parameter, lookup, named_in, ratio_of
from snapbeam.model.potential import Potential
from snapbeam.model.quantity import section_of
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.model.state import UNFORCED, State, checked_initial_well, checked_well, rest_state, started
from snapbeam.model.striker import Contact, Striker
from snapbeam.util.diagnostics import Diagnostic
from snapbeam.util.files import atomic_path, check_writable
from snapbeam.util.provenance import canonical_json
from snapbeam.util.si_prefixes import prefixed, with_unit
from snapbeam.util.validation import InputError, InputTypeError, instance, shown

_A: dict[str, tuple[Any, str]] = {
    "contacts": (Contact, "a Contact(law, striker)"),
    "forces": (
        (ExternalForce, LocalForce),
        "an ExternalForce(history=HarmonicForce(...)), a LocalSpring(...), or a law that is derived from LocalForce",
    ),
    "harvesters": (Harvester, "a PiezoelectricHarvester(...) or an ElectromagneticHarvester(...)"),
    "base_excitation": (BaseExcitation, "a BaseExcitation(motion=AccelerationSine(...))"),
    "axial_load": (AxialLoadModulation, "an AxialLoadModulation(motion=HarmonicForce(...))"),
}
"""Parts of a system other than the model: their classes and names."""


def told_as(system: System, given: Mapping[str, Any]) -> System:
    """The system, just made, which :meth:`System.save` writes with the texts and units *given* where they are its values."""
    object.__setattr__(system, "as_given", dict(given))
    return system


@dataclass(frozen=True, eq=False)
class System:
    """Model of an experiment: structure, strikers, contacts, excitation and initial state.

    Parameters
    ----------
    model : ReducedModel
        Reduced model of the structure.
    contacts : sequence of Contact, optional
        Strikers, each with the law of its contact; without any the structure vibrates freely.
    forces : sequence of LocalForce or ExternalForce, optional
        Forces on one point that depend on its motion (:class:`~snapbeam.LocalForce`) or on time
        (:class:`~snapbeam.ExternalForce`).
    base_excitation : BaseExcitation, optional
        Motion of both ends of the beam.
    axial_load : AxialLoadModulation, optional
        Change of the axial load in time.
    harvesters : sequence of PiezoelectricHarvester or ElectromagneticHarvester, optional
        Circuits that turn motion into power in a resistor.
    initial_state : State, optional
        State in which runs begin; at rest in *initial_well* by default.
    initial_well : {"lower", "upper", "unforced"} or int, optional
        Well in which runs begin at rest, by name or index in ``unloaded_potential.wells``; "unforced" is the well
        without the local forces, which then begin with the run. By default the one that the first striker or stop
        pushes away from, touched by it; :attr:`initial_well_text` names it.

    See Also
    --------
    snapbeam.simulate, snapbeam.State

    Notes
    -----
    A system with parts that the solver cannot integrate has a potential energy; a run raises an error.

    Examples
    --------
    >>> import snapbeam as sb
    >>> from snapbeam.model import default_values
    >>> system = sb.System(
    ...     sb.ReducedModel.from_beam(default_values.BEAM, modes=8),
    ...     contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.18))],
    ... )
    >>> thicker = system.replace(**{"beam.thickness": 5e-4, "contact.location": 0.3})
    """

    model: ReducedModel
    contacts: Sequence[Contact] = ()
    forces: Sequence[LocalForce | ExternalForce] = ()
    base_excitation: BaseExcitation | None = None
    axial_load: AxialLoadModulation | None = None
    harvesters: Sequence[Harvester] = ()
    initial_state: State | None = None
    initial_well: str | int | None = None
    as_given: ClassVar[dict[str, Any]] = {}
    """Values that were given as texts with units or in physical units, as they were given, by dotted name."""

    def __post_init__(self) -> None:
        model, start = self.model, self.initial_state
        instance("model", model, ReducedModel, "a ReducedModel")
        for name, (kind, words) in _A.items():
            given = getattr(self, name)
            if name.endswith("s"):
                object.__setattr__(self, name, given := sequence_of(name, given))
                for i, each in enumerate(given):
                    if not isinstance(each, kind):
                        raise InputTypeError(f"{name}[{i}] = {shown(each)}: must be {words}")
                labels = [label for each in given if (label := getattr(each, "label", ""))]
                for label in labels:
                    if labels.count(label) > 1:
                        raise InputError(f"{name}: two have the label {label!r}; give each its own")
            elif given is not None and not isinstance(given, kind):
                raise InputTypeError(f"{name} = {shown(given)}: must be {words}")
        if self.base_excitation is not None:
            rigid_mass(model)
        for each in (*self.forces, *self.harvesters):
            each.row(model)
        if self.initial_well is not None:
            if start is not None:
                raise InputError("initial_well, initial_state: give one of the two")
            object.__setattr__(self, "initial_well", checked_initial_well("initial_well", self.initial_well))
        if self.axial_load is not None and model.beam is None:
            raise InputError(
                "axial_load: changes the axial load of a beam; a structure given by matrices has its load in its stiffness"
            )
        if model.length_scale is None:
            model.require_bistable("a run")
        if start is not None:
            instance("initial_state", start, State, "a State")
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

        Names are those of :func:`snapbeam.model.parameters.parameters`: ``velocity_amplitude``, ``beam.thickness``,
        ``model.modes``, ``contact.stiffness``, ``drive.frequency_ratio``. The second contact, drive or force has its
        number, ``contact.2.gap``, or its label, ``contact.stop.gap``. Whole parts are ``beam``, ``model``,
        ``contacts``, ``forces``, ``base_excitation``, ``axial_load``, ``harvesters``, ``initial_state`` and
        ``initial_well``; one of several is ``contact``, ``contact.law``, ``contact.striker``, ``drive``, ``force`` or
        ``harvester``, with its number after the first word.
        """
        prefix = "initial_state."
        parts = {item.name: getattr(self, item.name) for item in fields(self)}
        changes = {resolved(self._full_name(name), self.labels): value for name, value in changes.items()}
        in_units = {name: changes.pop(name) for name in [*changes] if name in PHYSICAL}
        if in_units:  # of the structure as changed
            found = self.replace(**changes)
            ratios = {name: float(value) for name, value in ratios_of(found, in_units).items()}
            return told_as(found.replace(**ratios), self.as_given | in_units)
        other = {name: value for name, value in changes.items() if not name.startswith(prefix)}
        found = System(**replaced(parts, other))
        start = {name.removeprefix(prefix): changes[name] for name in changes if name not in other}
        if "initial_well" in start:
            found = dataclasses.replace(found, initial_state=None, initial_well=start.pop("initial_well"))
        if start:
            state = started(found.model, found.start_state, start)
            found = dataclasses.replace(found, initial_state=state, initial_well=None)
        return told_as(found, self.as_given)

    def get(self, name: str) -> Any:
        """The value of a parameter by a name as :meth:`parameter` takes it."""
        found, name = self.parameters, self._full_name(resolved(instance("name", name, str, "text"), self.labels))
        if ratio_of(name) not in found:
            raise InputError(f"{name}: is not a parameter of this system; it has {', '.join(found)}")
        value = found[ratio_of(name)]
        return float(to_physical(self, name, value)) if name in PHYSICAL else value

    def _full_name(self, name: str) -> str:
        """The dotted name of a parameter whose last part was given; names of sections and parts as they are."""
        if "." in name or name in (*SECTIONS, *PARTS):
            return name
        return self.parameter(name).name

    def parameter(self, name: str) -> Parameter:
        """The row of the table of parameters of a name: dotted, by label, as in datasets, or its last part alone.

        A last part that one part of the system alone has is that part's: ``frequency_hz`` is that of the base if nothing
        else has a frequency.
        """
        instance("name", name, str, "text")
        return lookup(named_in(resolved(name, self.labels), self.to_mapping() if "." not in name else {}))

    @cached_property
    def parameters(self) -> dict[str, Any]:
        """Every parameter by dotted name, plain numbers, words and arrays."""
        return {
            f"{section}.{name}": value
            for section, values in self.to_mapping().items()
            for name, value in values.items()
        }

    @property
    def labels(self) -> dict[str, list[str]]:
        """Labels of the contacts and forces in their order, empty where none was given, by the section of the first."""
        parts = {"contact": self.contacts, "force": self.forces, "harvester": self.harvesters}
        return {kind: [getattr(each, "label", "") for each in own] for kind, own in parts.items()}

    @property
    def scale(self) -> Scale:
        """Length and angular frequency that displacements and drives are normalised by."""
        assert self.model.length_scale is not None
        return Scale(self.model.length_scale, 2.0 * np.pi * self.model.reference_frequency)

    @property
    def moving(self) -> tuple[tuple[str, Drive], ...]:
        """Prescribed motions with the names of their sections; one cycle of the first is a cycle of excitation.

        A stationary striker counts only if neither a base nor an axial load moves.
        """
        around = (self.base_excitation, self.axial_load, *self.external_forces)
        drives = [(section_of("drive", number), each.striker.drive) for number, each in enumerate(self.contacts, 1)]
        found: list[tuple[str, Drive]] = [each for each in drives if not isinstance(each[1], FixedStop)]
        if not found and all(each is None for each in around):
            found = drives[:1]
        if self.base_excitation is not None:
            found.append(("base_excitation", self.base_excitation.motion))
        if self.axial_load is not None:
            found.append(("axial_load", self.axial_load.motion))
        for number, each in enumerate(self.forces, 1):
            history = getattr(each, "history", None)
            if history is not None:
                found.append((section_of("force", number), history))
        return tuple(found)

    @property
    def striker(self) -> Striker | None:
        """The first striker: runs begin in the well that it pushes away from."""
        return self.contacts[0].striker if self.contacts else None

    @property
    def contact_law(self) -> ContactLaw | None:
        """The law of the first contact."""
        return self.contacts[0].law if self.contacts else None

    @property
    def local_forces(self) -> tuple[LocalForce, ...]:
        """The forces that depend on the displacement or velocity of a point."""
        return tuple(each for each in self.forces if not isinstance(each, ExternalForce))

    @property
    def external_forces(self) -> tuple[ExternalForce, ...]:
        """The forces that depend on time."""
        return tuple(each for each in self.forces if isinstance(each, ExternalForce))

    @property
    def harvester(self) -> Harvester | None:
        """The first harvester."""
        return self.harvesters[0] if self.harvesters else None

    @property
    def surroundings(self) -> tuple[Any, ...]:
        """Parts other than strikers that act on the structure: forces, base, axial load, harvesters."""
        parts = (*self.forces, self.base_excitation, self.axial_load, *self.harvesters)
        return tuple(each for each in parts if each is not None)

    @property
    def primary_excitation(self) -> tuple[str, Drive] | None:
        """Drive whose cycle is the cycle of excitation, with its section; None if nothing moves."""
        return self.moving[0] if self.moving else None

    @cached_property
    def potential(self) -> Potential:
        """Potential energy of the structure, the local forces and the constant parts of the external forces, with its wells."""
        return Potential.of(self.model, self.forces)

    @cached_property
    def unloaded_potential(self) -> Potential:
        """The potential energy before a run, when no external force acts yet: its wells are those that a run begins in."""
        if not self.potential.constant.any():
            return self.potential
        return Potential.of(self.model, self.local_forces)

    @cached_property
    def rest_state(self) -> State:
        """State at rest in the well that the first striker pushes away from, touched by it.

        Without a striker it is the well of the start. With local forces it is the well that a beam without inertia
        reaches from that well of the structure; from a saddle, on the side of the striker. An external force begins
        with the run. If the local forces leave no well there, an InputError is raised.
        """
        state, local = rest_state(self.model, self.striker), self.unloaded_potential
        if local.is_of_the_structure_alone:
            return state
        side = self.striker.side if self.striker is not None else "below"
        well = local.descent(state.amplitude, side) if local.holds(state.amplitude) else None
        if well is None:
            limits = [law.displacement_range(law.numbers) for law in self.local_forces]
            valid = [
                f"valid from {a:.4g} to {b:.4g} m or rad" for a, b in limits if math.isfinite(a) or math.isfinite(b)
            ]
            others = "an initial_well, " if local.wells else ""
            raise InputError(
                f"forces = {shown(self.local_forces)}: leave no well where a run begins, such as beyond pull-in or outside "
                f"the displacements of a law ({', '.join(valid) or 'all are valid'}); give {others}an initial_state, or "
                "a weaker force"
            )
        return State(amplitude=local.wells[well].amplitude)

    @property
    def struck_model(self) -> ReducedModel:
        """The model about the well that the first striker pushes away from: with it above, the mirror image.

        Without a striker it is the one about the well of minimum energy.  Damping ratios are those of this model's linear
        modes, about whichever well the beam vibrates.
        """
        if self.striker is None:
            return self.model.about_reference_well
        return self.model.mirrored if self.striker.side == "above" else self.model

    def poles(self, equilibrium: Equilibrium | str | int | None = None) -> NDArray[np.complex128]:
        """Poles of small oscillations about an equilibrium, with damping, local forces and circuits.

        The equations are m a'' + C a' + K a = sum_j theta_j z_j and M_j z_j' = -theta_j . a' - rho_j z_j, with the
        tangent stiffness K and the damping C of the modes and, at rest, of the local forces. Contacts are open.

        Parameters
        ----------
        equilibrium : Equilibrium, {"lower", "upper"} or int, optional
            One of ``potential.equilibria``, or a well by name or index in ``potential.wells``; by default that of
            *initial_well* or :attr:`rest_state`.

        Returns
        -------
        array of shape (2 N + circuits with inertia,)
            s, rad/s, by abs(s) and Im(s): frequencies abs(s)/(2 pi) Hz, damping ratios -Re(s)/abs(s).

        Examples
        --------
        A piezoelectric layer with an open circuit stiffens a mass on a spring, omega^2 = k/m + theta^2/(m C):

        >>> import snapbeam as sb
        >>> model = sb.ReducedModel.from_matrices(
        ...     [[1.0]], [1.0], contact_shape=[1.0], patch_shape=[1.0], reference_frequency=1.0
        ... )
        >>> layer = sb.PiezoelectricHarvester(moment_per_volt=0.5, capacitance=1.0, resistance=1e12)
        >>> print(abs(sb.System(model, harvesters=[layer]).poles())[-1].round(6))
        1.118034
        """
        model, potential, alpha = self.model, self.potential, self._amplitude_at(equilibrium)
        n, modes = model.modes, model.linear_modes
        damping = modes.T @ self.struck_model.damping_matrix @ modes
        for force in self.local_forces:
            row = force.row(model)
            if force.dissipative:
                coefficient = force.damping_coefficient(force.numbers, float(row @ alpha), 0.0)
                damping = damping + coefficient * np.outer(modes.T @ row, modes.T @ row)
        circuits = []
        for each in self.harvesters:
            theta, loss = modes.T @ each.row(model), float(each.loss(np.array([each.resistance]))[0])
            if each.inertia > 0.0:
                circuits.append((theta / np.sqrt(each.inertia), loss / each.inertia))
            else:
                damping = damping + np.outer(theta, theta) / loss
        matrix = np.zeros((2 * n + len(circuits),) * 2)
        matrix[:n, n : 2 * n] = np.eye(n)
        matrix[n : 2 * n, :n] = -potential.in_modes(potential.tangent(alpha))
        matrix[n : 2 * n, n : 2 * n] = -damping
        for i, (theta, rate) in enumerate(circuits, 2 * n):
            matrix[n : 2 * n, i], matrix[i, n : 2 * n], matrix[i, i] = theta, -theta, -rate
        found = np.linalg.eigvals(matrix)
        return np.asarray(found[np.lexsort((found.imag, np.abs(found)))])

    def circuit_frequencies(
        self, equilibrium: Equilibrium | str | int | None = None
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Natural frequencies about an equilibrium with all loads open, and with all loads shorted.

        From m a'' + (K + sum_j theta_j theta_j^T/M_j) a = 0 with the circuits that lose nothing: layers with an open
        circuit, coils with an inductance and no resistance with a shorted one.

        Parameters
        ----------
        equilibrium : Equilibrium, {"lower", "upper"} or int, optional
            Equilibrium or well, as in :meth:`poles`.

        Returns
        -------
        open, short : arrays of shape (N,)
            Hz, ascending; 0 in an unstable direction.
        """
        stiffness = self.potential.in_modes(self.potential.tangent(self._amplitude_at(equilibrium)))
        found = [np.array(stiffness), np.array(stiffness)]
        for each in self.harvesters:
            if each.inertia > 0.0:
                theta = self.model.linear_modes.T @ each.row(self.model)
                little, much = (float(each.loss(np.array([ohms]))[0]) for ohms in (1e-9, 1e9))
                for at in (0, 1) if little == much == 0.0 else (int(little < much),):
                    found[at] += np.outer(theta, theta) / each.inertia
        opened, short = (np.sqrt(np.maximum(np.linalg.eigvalsh(each), 0.0)) / (2.0 * np.pi) for each in found)
        return opened, short

    def _amplitude_at(self, equilibrium: Equilibrium | str | int | None) -> NDArray[np.float64]:
        """Amplitudes of an equilibrium, by default of the well that runs begin in."""
        if equilibrium is not None and not isinstance(equilibrium, Equilibrium):
            equilibrium = self.potential.well(checked_well("equilibrium", equilibrium))
        if equilibrium is not None:
            return equilibrium.amplitude
        return (self.rest_state if self.initial_well == UNFORCED else self._start_at_rest).amplitude

    @property
    def _start_at_rest(self) -> State:
        """State at rest in the initial well."""
        if self.initial_well is None:
            return self.rest_state
        if self.initial_well == UNFORCED:
            return rest_state(self.model, self.striker)
        try:
            return State(amplitude=self.unloaded_potential.well(self.initial_well))  # type: ignore[arg-type]
        except InputError as error:
            raise InputError(f"initial_{error}") from None

    @property
    def start_state(self) -> State:
        """The state that runs begin in: the initial state, or at rest in the initial well."""
        return self._start_at_rest if self.initial_state is None else self.initial_state

    @cached_property
    def start_well(self) -> str:
        """Well that runs begin in: "lower", "upper", "only", or "well 2" of more than two wells.

        Of an initial state it is the well on whose side of the dividing height the centre is.
        """
        if self.initial_state is not None or self.initial_well == UNFORCED:
            return self.model.side_of(self.start_state.amplitude)
        potential, alpha = self.unloaded_potential, self.start_state.amplitude
        distances = [float(np.abs(each.amplitude - alpha).max()) for each in potential.wells]
        if len(distances) < 2:
            return "only"
        return potential.well_names[int(np.argmin(distances))].removesuffix(" well")

    @property
    def initial_well_reason(self) -> str:
        """Reason for the well that runs begin in, in a few words."""
        if self.initial_state is not None:
            return "side of the initial state"
        if self.initial_well is not None:
            return f"initial_well = {self.initial_well!r}"
        if self.striker is not None:
            return f"contact on side {self.striker.side!r}"
        return "default" if self.model.as_fabricated_well is None else "as fabricated"

    @property
    def initial_well_text(self) -> str:
        """Sentence part with the well that runs begin in and the reason."""
        well = self.start_well
        return f"{well if well[-1].isdigit() else f'{well} well'} ({self.initial_well_reason})"

    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Diagnostics: values that look like another unit, and assumptions of the model that do not hold."""
        parts = [(section_of("harvester", number), each) for number, each in enumerate(self.harvesters, 1)]
        found = doubts_of(self.unloaded_potential, self.striker, [*parts, *self.moving])
        return (*found, *self._overlaps()) if self.initial_well not in (None, UNFORCED) else found

    def _overlaps(self) -> Iterator[Diagnostic]:
        """Contacts with a gap that a run in the chosen well begins inside of."""
        for number, each in enumerate(self.contacts, 1):
            gap, side = each.striker.gap, 1.0 if each.striker.side == "above" else -1.0
            if gap is None or gap < 0.0:
                continue
            moved = self.start_state.amplitude - self.rest_state.amplitude
            depth = side * float(self.model.shape_at(each.striker.location) @ moved) - gap
            if depth > 1e-6 * (self.model.length_scale or 1.0):
                section = section_of("contact", number)
                yield Diagnostic(
                    "begins-inside",
                    f"{section}: its tip begins {prefixed(depth, 'm', 3)} inside the beam: the gap is that to the beam in the "
                    f"well that the first striker pushes away from, but initial_well is {self.initial_well!r}",
                    {"depth": depth},
                )

    # ------------------------------------------------------------------ identity and files

    def to_mapping(self) -> dict[str, dict[str, Any]]:
        """System as sections of plain values, as in a parameter file."""
        return parts_to_mapping(self)

    @classmethod
    def from_mapping(cls, sections: Mapping[str, Mapping[str, Any]]) -> System:
        """The system that such sections describe."""
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
        """Write the system to a TOML file, whole or not at all; :meth:`load` reads it back equal.

        Values that were read from a file keep the units that they have there.
        """
        import tomli_w

        from snapbeam.model.parameter_file import sections_as_given

        target = check_writable(path, "path", (".toml",))
        with atomic_path(target) as temporary:
            temporary.write_text(tomli_w.dumps(nested(_without_none(sections_as_given(self)))), encoding="utf-8")

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> System:
        """Read a parameter file, or a file that :meth:`save` wrote.

        Sections of commands, such as ``integration`` and ``probability``, are left out.
        """
        from snapbeam.model.parameter_file import system_of_file

        return system_of_file(path)

    def describe(self) -> str:
        """The system in a few lines, for a person to read."""
        lines = []
        from snapbeam.model.parameter_file import sections_as_given

        for section, values in sections_as_given(self).items():
            given = {name: value for name, value in values.items() if value is not None}
            words = ", ".join(f"{name} = {_brief(value, f'{section}.{name}')}" for name, value in given.items())
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
        parts = [f"modes={self.model.modes}"]
        for each in self.contacts:
            drive = each.striker.drive
            parts.append(f"contact={each.law!r}, striker={each.striker if drive.harmonic else drive.name}")
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


def _brief(value: Any, name: str) -> str:
    if isinstance(value, np.ndarray):
        return f"array of shape {value.shape}" if value.size > 4 else json.dumps(value.tolist())
    if not isinstance(value, float):
        return str(value)
    with suppress(InputError):  # of a part of the user's own
        return with_unit(value, lookup(name).quantity.unit)
    return f"{value:.6g}"


def _parted(line: str) -> tuple[str, str, str]:
    return line.partition("  ")
