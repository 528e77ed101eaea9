"""Harvesters: what turns the motion of a beam into power in a resistor, by a piezoelectric patch or by a coil."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from snapbeam.model.beam import Beam
from snapbeam.model.boundary_conditions import modes_between
from snapbeam.model.extension import check_defined, check_names
from snapbeam.model.quantity import RUN, check_fields, quantity
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.util.diagnostics import Diagnostic
from snapbeam.util.validation import (
    InputError,
    checked,
    choice,
    finite,
    finite_array,
    instance,
    positive,
    shown,
    within,
)

_Array = NDArray[np.float64]

HARVESTERS: dict[str, type[Harvester]] = {}
"""Every harvester by the name it has in parameter files."""
WIRINGS = ("parallel", "series")
_STRONGEST_COUPLING = 1.0
"""Theta^2 (x_2 - x_1) L/(C E I) that no layers reach: e^2/(eps c) of the material, which stiffens the beam too."""


def _of_resistances(function: Callable[[Any, _Array], _Array]) -> Callable[[Any, ArrayLike], _Array]:
    """Refuse resistances that are not positive and finite, before the formula of any harvester."""

    @functools.wraps(function)
    def checked(self: Any, resistance: ArrayLike) -> _Array:
        given = finite_array("resistance", resistance)
        if not given.size or (given <= 0.0).any():
            raise InputError(f"resistance = {shown(resistance)}: must be greater than 0 ohm")
        with np.errstate(all="ignore"):
            found = np.asarray(function(self, given))
        if not np.isfinite(found).all():
            raise InputError(f"resistance = {shown(resistance)}: {function.__name__} is not finite there")
        return found

    return checked


class Harvester:
    """Circuit with one state, coupled to the beam: a frozen dataclass.

    With theta the row of the coupling in buckling modes, z what pulls back (the voltage, or the current the other way
    round) and M and rho its inertia and its loss,

        m alpha'' + ... = theta z,     M z' = -theta . alpha' - rho z,

    so that what the beam gives, -z theta . alpha', is the change of M z^2/2 and the loss rho z^2, of which a share ends
    in the load.  A subclass defines :meth:`row`, :attr:`inertia`, :meth:`loss`, :meth:`share` and :meth:`volts`.
    """

    hooks: ClassVar[tuple[str, ...]] = ("name", "row", "inertia", "unit", "loss", "share", "volts", "diagnostics")
    """Names that are read of a harvester of one's own; it has no others, but for those that begin with an underscore."""
    name: ClassVar[str] = ""
    noun: ClassVar[str] = "a harvester"
    """Name in messages."""
    rate_dependent: ClassVar[bool] = True
    """True if the force depends on the velocity of the structure."""
    resistance: float
    """Load resistance, ohm."""

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        check_names(cls)
        if cls.name:
            check_defined(cls, Harvester, ["row", "inertia", "loss", "share", "volts"])
            HARVESTERS[cls.name] = cls
        for name in ("loss", "share", "volts"):
            if name in vars(cls):
                setattr(cls, name, _of_resistances(vars(cls)[name]))

    def row(self, model: ReducedModel) -> _Array:
        """theta of every buckling mode, shape (N,)."""
        raise NotImplementedError

    @property
    def inertia(self) -> float:
        """M; 0 if z follows the motion at once."""
        raise NotImplementedError

    @property
    def unit(self) -> float:
        """Volts or amperes, as a meter shows them, per unit of sqrt(M) z, the circuit's coordinate."""
        return 1.0 / math.sqrt(self.inertia) if self.inertia > 0.0 else 1.0

    def loss(self, resistance: _Array) -> _Array:
        """rho of load resistances."""
        raise NotImplementedError

    def share(self, resistance: _Array) -> _Array:
        """Share of the loss that ends in the load."""
        raise NotImplementedError

    def volts(self, resistance: _Array) -> _Array:
        """Voltage across the load per z."""
        raise NotImplementedError

    def diagnostics(self, section: str, model: ReducedModel) -> list[Diagnostic]:
        """Diagnostics of values that are implausible for a model; none by default."""
        return []


class _Layers(Harvester):
    """Piezoelectric layers on one load, as ``_rows``: where each begins, where it ends, its moment per volt of the load."""

    noun = "piezoelectric layers"
    capacitance: float

    @property
    def _rows(self) -> _Array:
        raise NotImplementedError

    @property
    def ends(self) -> _Array:
        """Ends of each patch over the length, shape (patches, 2)."""
        return self._rows[:, :2]

    def row(self, model: ReducedModel) -> _Array:
        """Moments per volt times the differences of the slopes."""
        rows = self._rows
        if model.beam is None:
            if model.patch_shape is None or len(rows) > 1:
                raise InputError(
                    "harvester: needs the difference of the slopes at the ends of its layers per unit of each coordinate; "
                    "give patch_shape to ReducedModel.from_matrices, and one patch"
                )
            return np.asarray(rows[0, 2] * model.patch_shape)
        beam = model.beam
        modes = modes_between(beam.boundary, beam.length, beam.bending_stiffness, model.modes)
        return np.asarray(
            sum(moment * (modes.slope(end * beam.length) - modes.slope(at * beam.length)) for at, end, moment in rows)
        )

    @property
    def inertia(self) -> float:
        """The capacitance."""
        return self.capacitance

    def loss(self, resistance: _Array) -> _Array:
        """1/R."""
        return np.asarray(1.0 / resistance)

    def share(self, resistance: _Array) -> _Array:
        """All."""
        return np.ones_like(resistance)

    def volts(self, resistance: _Array) -> _Array:
        """Voltage: the coordinate itself."""
        return np.ones_like(resistance)

    def diagnostics(self, section: str, model: ReducedModel) -> list[Diagnostic]:
        """A coupling that no material has."""
        if model.beam is None:
            return []
        rows = self._rows
        squared = float(rows[:, 2] ** 2 @ (rows[:, 1] - rows[:, 0])) * model.beam.length
        coupling = squared / (self.capacitance * model.beam.bending_stiffness)
        if coupling < _STRONGEST_COUPLING:
            return []
        largest = float(np.abs(rows[:, 2]).max())
        most = largest * (_STRONGEST_COUPLING / coupling) ** 0.5
        return [
            Diagnostic(
                "unphysical-coupling",
                f"{section}.moment_per_volt = {largest:g} N m/V with capacitance = "
                f"{self.capacitance:g} F: must be below {most:.3g} N m/V; Theta^2 (x_2 - x_1) L/(C E I) is "
                f"{coupling:.3g}, and no material reaches 1; use PiezoelectricHarvester.from_material",
                {"coupling": coupling, "greatest_moment_per_volt": most},
            )
        ]


@dataclass(frozen=True, kw_only=True)
class PiezoelectricHarvester(_Layers):
    """Piezoelectric layers on both faces of the beam, between two locations, with a load resistor.

    The coupling of mode i and the equation of the voltage v are

        theta_i = Theta [phi_i'(x_2) - phi_i'(x_1)],     C v' = -v/R - theta . alpha',

    with Theta the bending moment per volt. Their own mass and stiffness are neglected. A structure given by matrices
    has Theta times its ``patch_shape``.

    Parameters
    ----------
    moment_per_volt : float
        Theta, N m/V.
    capacitance : float
        C, F.
    resistance : float
        R of the load, ohm.
    patch_start, patch_end : float
        x_1 and x_2 over the length.  A patch from clamp to clamp couples to nothing: the slopes at its ends are 0.

    See Also
    --------
    snapbeam.ElectromagneticHarvester

    Examples
    --------
    >>> import snapbeam as sb
    >>> harvester = sb.PiezoelectricHarvester(moment_per_volt=1e-5, capacitance=60e-9, resistance=1e5)
    """

    moment_per_volt: float = quantity("N m/V", "moment of the piezoelectric layers per volt", symbol=r"\Theta")
    capacitance: float = quantity("F", "capacitance of the piezoelectric layers", low=0.0, symbol="C")
    resistance: float = quantity("ohm", "load resistance", low=0.0, scope=RUN, symbol="R")
    patch_start: float = quantity(
        "1", "where the layers begin, over the length", default=0.0, low=0.0, high=1.0, closed="both"
    )
    patch_end: float = quantity(
        "1", "where the layers end, over the length", default=0.25, low=0.0, high=1.0, closed="both"
    )
    name = "piezo"

    def __post_init__(self) -> None:
        check_fields(self)
        if self.patch_start >= self.patch_end:
            raise InputError(f"patch_start = {self.patch_start:g}: must be less than patch_end = {self.patch_end:g}")

    @classmethod
    def from_material(
        cls,
        *,
        stress_constant: float | None = None,
        strain_constant: float | None = None,
        layer_modulus: float | None = None,
        permittivity: float,
        layer_thickness: float,
        layer_width: float,
        beam: Any,
        resistance: float,
        patch_start: float = 0.0,
        patch_end: float = 0.25,
        wiring: str = "parallel",
    ) -> PiezoelectricHarvester:
        """Return the harvester of two equal layers, one on each face, from their material constants.

        With e the effective e_31 of a thin layer, h_p its thickness, w its width, h the thickness of the beam,
        l the length of the patch and eps the permittivity at constant strain, each layer has

            Theta = e w (h + h_p)/2,     C = eps w l/h_p.

        Data sheets have d_31, Young's modulus 1/s_11 of the layer at constant field and the permittivity eps^T at constant stress:

            e = d_31/s_11,     eps = eps^T - d_31^2/s_11.

        Source: Erturk and Inman, Piezoelectric Energy Harvesting, Wiley 2011, ch. 3, for a thin beam.

        Parameters
        ----------
        stress_constant : float, optional
            Effective e_31, C/m^2; its sign is that of the voltage.
        strain_constant : float, optional
            d_31, m/V or C/N, with *layer_modulus*, instead of *stress_constant*.
        layer_modulus : float, optional
            Young's modulus of the layers at constant field, 1/s_11, Pa.
        permittivity : float
            Permittivity, F/m, at constant strain with *stress_constant*, else at constant stress.
        layer_thickness, layer_width : float
            Thickness and width of each layer, m.
        beam : Beam
            Beam between the two layers.
        resistance : float
            Resistance of the load, ohm.
        patch_start, patch_end : float
            Ends of the patch over the length, in [0, 1].
        wiring : {"parallel", "series"}
            Wiring: in parallel twice the moment per volt and twice the capacitance of one layer, in series the moment
            of one and half its capacitance.

        Examples
        --------
        PZT-5A, with d_31 = -171 pm/V:

        >>> import snapbeam as sb
        >>> beam = sb.Beam(
        ...     length=0.1, thickness=2e-4, width=0.01, density=7800, young_modulus=2e11, buckling_level=1e-3
        ... )
        >>> layers = sb.PiezoelectricHarvester.from_material(
        ...     strain_constant=-171e-12, layer_modulus=61e9, permittivity=1700 * 8.854e-12,
        ...     layer_thickness=1e-4, layer_width=0.01, beam=beam, resistance=1e5,
        ... )
        >>> print(f"{layers.moment_per_volt:.3e} N m/V, {layers.capacitance:.3e} F")
        -3.129e-05 N m/V, 6.634e-08 F
        """
        thick = positive("layer_thickness", layer_thickness, "m")
        wide = positive("layer_width", layer_width, "m")
        eps = positive("permittivity", permittivity, "F/m")
        if (stress_constant is None) == (strain_constant is None) or (strain_constant is None) != (
            layer_modulus is None
        ):
            raise InputError("stress_constant: give it, or strain_constant with layer_modulus")
        if strain_constant is not None:
            strain = finite("strain_constant", strain_constant)
            stress_constant = strain * positive("layer_modulus", layer_modulus, "Pa")
            eps = positive("permittivity - strain_constant^2 layer_modulus", eps - strain * stress_constant, "F/m")
        two = 2.0 if choice("wiring", wiring, WIRINGS) == "parallel" else 0.5
        first, last = (
            within(name, at, 0.0, 1.0, closed="both")
            for name, at in (("patch_start", patch_start), ("patch_end", patch_end))
        )
        area = wide * (last - first) * instance("beam", beam, Beam, "a Beam").length
        arm = 0.5 * (beam.thickness + thick)
        return cls(
            moment_per_volt=(2.0 if two == 2.0 else 1.0) * finite("stress_constant", stress_constant) * wide * arm,
            capacitance=two * eps * area / thick,
            resistance=resistance,
            patch_start=patch_start,
            patch_end=patch_end,
        )

    @property
    def _rows(self) -> _Array:
        return np.array([[self.patch_start, self.patch_end, self.moment_per_volt]])


@dataclass(frozen=True, kw_only=True)
class PiezoelectricPatches(_Layers):
    """Several piezoelectric patches on one load, as one circuit.

        theta_i = sum_k Theta_k [phi_i'(x_2k) - phi_i'(x_1k)],     C v' = -v/R - theta . alpha'.

    In parallel C is the sum of the capacitances. :meth:`wired` makes the circuit from its patches.

    Parameters
    ----------
    patches : array_like of shape (patches, 3)
        Rows x_1, x_2 (over the length) and Theta_k, N m per volt of the load; its sign is the polarity.
    capacitance : float
        C of the circuit, F.
    resistance : float
        R of the load, ohm.

    See Also
    --------
    snapbeam.PiezoelectricHarvester

    Examples
    --------
    >>> import snapbeam as sb
    >>> both = [[0.0, 0.25, 1e-5], [0.75, 1.0, 1e-5]]
    >>> harvester = sb.model.PiezoelectricPatches(patches=both, capacitance=120e-9, resistance=1e5)
    """

    patches: Any = quantity("1", "ends over the length and moment per volt of every patch", kind=object)
    capacitance: float = quantity("F", "capacitance of the piezoelectric layers", low=0.0, symbol="C")
    resistance: float = quantity("ohm", "load resistance", low=0.0, scope=RUN, symbol="R")
    name = "patches"

    def __post_init__(self) -> None:
        check_fields(self)
        rows = finite_array("patches", self.patches, 2).copy()
        if rows.shape[-1] != 3 or not len(rows) or not (rows[:, 0] < rows[:, 1]).all():
            raise InputError(f"patches = {shown(self.patches)}: must be rows of start < end and a moment per volt")
        within("patches", float(rows[:, :2].min()), 0.0, 1.0, closed="both")
        within("patches", float(rows[:, :2].max()), 0.0, 1.0, closed="both")
        object.__setattr__(self, "patches", tuple(map(tuple, rows.tolist())))  # rows of numbers, so that == compares

    @classmethod
    @checked
    def wired(
        cls, patches: Sequence[PiezoelectricHarvester], wiring: str = "parallel", *, resistance: float
    ) -> list[Harvester]:
        """Return the harvesters of a system with several patches on one load.

        In parallel all have the voltage of the load: theta = sum theta_k, C = sum C_k.  In series one current flows
        through all, C_k v_k' + theta_k . alpha' = -i, and v = sum v_k:

            1/C = sum 1/C_k,     theta = C sum theta_k/C_k,

        while the differences of the charges, which no current changes, are springs along the n - 1 rows of sum theta_k
        theta_k^T/C_k - theta theta^T/C. They follow the first harvester and lose nothing.

        Parameters
        ----------
        patches : sequence of PiezoelectricHarvester
            Patches, whose resistances are not used; the sign of the moment per volt is the polarity.
        wiring : {"parallel", "series"}
            Wiring of the patches.
        resistance : float
            Resistance of the load, ohm.

        Returns
        -------
        list of Harvester
            Harvesters for ``System(..., harvesters=...)``; the first has the load.

        Examples
        --------
        >>> import snapbeam as sb
        >>> left, right = (
        ...     sb.PiezoelectricHarvester(
        ...         moment_per_volt=1e-5, capacitance=60e-9, resistance=1.0, patch_start=x, patch_end=x + 0.2
        ...     )
        ...     for x in (0.0, 0.8)
        ... )
        >>> wired = sb.model.PiezoelectricPatches.wired([left, right], "series", resistance=1e5)
        >>> print([f"{1e9 * each.capacitance:.0f} nF" for each in wired])
        ['30 nF', '30 nF']
        """
        given = list(patches)
        if not given:
            raise InputError("patches = []: must be one patch or more")
        for number, each in enumerate(given):
            instance(f"patches[{number}]", each, PiezoelectricHarvester, "a PiezoelectricHarvester")
        rows = np.vstack([each._rows for each in given])
        each_capacitance = np.array([each.capacitance for each in given])
        if choice("wiring", wiring, WIRINGS) == "parallel":
            total = float(each_capacitance.sum())
            return [cls(patches=rows, capacitance=total, resistance=resistance)]
        total = float(1.0 / (1.0 / each_capacitance).sum())
        shares = np.sqrt(total / each_capacitance)  # a unit vector
        # the load's share, then those of a basis of what is normal to it
        weights = np.linalg.qr(np.column_stack((shares, np.eye(len(given)))))[0][:, : len(given)].T * shares
        weights[0] = shares**2
        return [
            (PatchImbalance if number else cls)(
                patches=np.column_stack((rows[:, :2], rows[:, 2] * own)), capacitance=total, resistance=resistance
            )
            for number, own in enumerate(weights)
        ]

    @property
    def _rows(self) -> _Array:
        return np.asarray(self.patches)


@dataclass(frozen=True, kw_only=True)
class PatchImbalance(PiezoelectricPatches):
    """Voltage by which patches in series differ, which no load discharges: a part of :meth:`PiezoelectricPatches.wired`."""

    name = "patch_imbalance"
    noun = "the imbalance of patches in series"

    def loss(self, resistance: _Array) -> _Array:
        """None."""
        return np.zeros_like(resistance)


@dataclass(frozen=True, kw_only=True)
class ElectromagneticHarvester(Harvester):
    """Magnet on the beam and coil on the frame, with a load resistor.

    The current i and the force f_c on the beam at x_c satisfy

        L_c i' = K w'(x_c) - (R + R_c) i,     f_c = -K i,

    with the velocity w' relative to the ends.  The mass of the magnet is neglected.

    Parameters
    ----------
    force_factor : float
        K, N/A or V s/m.
    resistance : float
        R of the load, ohm.
    coil_resistance, inductance : float
        R_c (ohm) and L_c (H) of the coil; without inductance the current follows the velocity.
    location : float
        x_c over the length.

    See Also
    --------
    snapbeam.PiezoelectricHarvester

    Examples
    --------
    >>> import snapbeam as sb
    >>> harvester = sb.ElectromagneticHarvester(force_factor=1.5, resistance=30.0, coil_resistance=10.0)
    """

    force_factor: float = quantity("N/A", "force of the coil per ampere", symbol="K")
    resistance: float = quantity("ohm", "load resistance", low=0.0, scope=RUN, symbol="R")
    coil_resistance: float = quantity(
        "ohm", "resistance of the coil", default=0.0, low=0.0, closed="left", symbol=r"R_\mathrm{c}"
    )
    inductance: float = quantity(
        "H", "inductance of the coil", default=0.0, low=0.0, closed="left", symbol=r"L_\mathrm{c}"
    )
    location: float = quantity(
        "1", "place of the coil over the length", default=0.5, low=0.0, high=1.0, short="coil_location"
    )
    name = "coil"

    def __post_init__(self) -> None:
        check_fields(self)

    def row(self, model: ReducedModel) -> _Array:
        """K times the shape at the coil."""
        return np.asarray(self.force_factor * model.shape_at(self.location))

    @property
    def inertia(self) -> float:
        """The inductance."""
        return self.inductance

    @property
    def unit(self) -> float:
        """The current is -z."""
        return -super().unit

    def loss(self, resistance: _Array) -> _Array:
        """R + R_c."""
        return np.asarray(resistance + self.coil_resistance)

    def share(self, resistance: _Array) -> _Array:
        """R/(R + R_c)."""
        return np.asarray(resistance / (resistance + self.coil_resistance))

    def volts(self, resistance: _Array) -> _Array:
        """-R i, i the current that z is the negative of."""
        return -resistance
