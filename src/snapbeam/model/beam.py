"""The beam: geometry, material and how far it is compressed."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from functools import cache
from typing import Any

from snapbeam.model.boundary_conditions import CLAMPED, BoundaryConditions, Modes, modes_between
from snapbeam.model.buckling_modes import wavenumbers
from snapbeam.model.quantity import quantities, quantity
from snapbeam.util.validation import InputError, finite, instance, shown


class _Derived(float):
    """A number that followed from another one, and so was not given."""

    def __reduce__(self) -> tuple[Any, ...]:
        return _Derived, (float(self),)


@dataclass(frozen=True, kw_only=True)
class Beam:
    """An Euler-Bernoulli beam of rectangular section under axial compression, clamped at both ends by default.

    Exactly one of ``buckling_level`` and ``axial_load`` is given; the other follows from Eqs. (2)-(3),

        b^2 = 4 L^2 (P - P_cr) / (pi^2 E S),    P_cr = 4 pi^2 E I / L^2,

    and both can be read afterwards.

    Parameters
    ----------
    length : float
        Distance L between the clamps, m.
    thickness : float
        Thickness h in the direction of bending, m.
    width : float
        Width of the section, m.
    density : float
        Mass density rho, kg/m^3.
    young_modulus : float
        Young's modulus E, Pa.
    buckling_level : float
        Height b of the buckled beam at its centre, m, greater than 0; reads 0 under an ``axial_load`` that does not
        buckle the beam.
    axial_load : float
        Axial load P, N, compression positive; below the critical load the beam is straight.
    boundary : BoundaryConditions
        Boundary conditions, clamped and rigid by default. Others change the critical loads and, in the relation above,
        4 L^2/(pi^2 E S) to phi_1(L/2)^2/gamma.

    Raises
    ------
    InputError
        If a value is out of range, or ``buckling_level`` and ``axial_load`` are both given or both missing.

    See Also
    --------
    snapbeam.BoundaryConditions, snapbeam.Imperfection, snapbeam.ReducedModel

    Examples
    --------
    >>> import snapbeam as sb
    >>> beam = sb.Beam(
    ...     length=0.16, thickness=0.4e-3, width=4e-3, density=8000.0, young_modulus=200e9, buckling_level=0.5e-3
    ... )
    >>> f"{beam.axial_load:.1f} N"
    '14.3 N'
    """

    length: float = quantity(
        "m", "distance between the clamps", low=0.0, symbol="L", short="beam_length", plausible=(1e-6, 100.0, "mm")
    )
    thickness: float = quantity(
        "m", "thickness in the direction of bending", low=0.0, symbol="h", short="beam_thickness",
        plausible=(1e-9, 1.0, "mm"),
    )  # fmt: skip
    width: float = quantity("m", "width of the section", low=0.0, short="beam_width", plausible=(1e-9, 10.0, "mm"))
    density: float = quantity(
        "kg/m^3", "mass density", low=0.0, symbol=r"\rho", short="beam_density", plausible=(10.0, 3e4, "g/cm^3")
    )
    young_modulus: float = quantity(
        "Pa", "Young's modulus", low=0.0, symbol="E", short="beam_young_modulus", plausible=(1e3, 2e12, "GPa")
    )
    buckling_level: float = quantity(
        "m", "height of the buckled beam at its centre", default=None, low=0.0, symbol="b", optional=True,
        short="beam_buckling_level", plausible=(1e-12, 10.0, "mm"),
    )  # fmt: skip
    axial_load: float = quantity(
        "N", "axial load, compression positive", default=None, symbol="P", optional=True, short="beam_axial_load"
    )
    boundary: BoundaryConditions = CLAMPED
    _given: str = dataclasses.field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        instance("boundary", self.boundary, BoundaryConditions, "BoundaryConditions")
        level: float | None = self.buckling_level
        load: float | None = self.axial_load
        # what followed from the other in the beam that dataclasses.replace starts from is not given
        if isinstance(level, _Derived) and load is not None:
            level = None
        if isinstance(load, _Derived) and level is not None:
            load = None
        if (level is None) == (load is None):
            raise InputError(
                f"buckling_level = {shown(level)}, axial_load = {shown(load)}: "
                "give exactly one of the two, the other follows from it"
            )
        for name, item in _beam_quantities().items():
            if name not in ("buckling_level", "axial_load"):
                self._set(name, item.check(name, getattr(self, name)))
        try:
            level, load = self._completed(level, load)
        except (OverflowError, ZeroDivisionError):
            raise InputError(
                f"length = {self.length:g} m, buckling_level = {level!r}: a square is out of what a number holds"
            ) from None
        self._set("axial_load", load)
        self._set("buckling_level", level)

    def _completed(self, level: float | None, load: float | None) -> tuple[float, float]:
        """Buckling level and axial load, of which one is given: P - P_cr = stretch b^2."""
        stretch = self._stretch()
        if load is None:
            level = _beam_quantities()["buckling_level"].check("buckling_level", level)
            self._set("_given", "buckling_level")
            return level, _Derived(self.critical_load + stretch * level**2)
        load = finite("axial_load", load, "a finite number of N, compression positive")
        self._set("_given", "axial_load")
        return _Derived(math.sqrt(max(load - self.critical_load, 0.0) / stretch)), load

    def _stretch(self) -> float:
        if self.boundary.is_clamped:
            return math.pi**2 * self.young_modulus * self.area / (4.0 * self.length**2)
        return self.nonlinear_stiffness / float(self.buckling_modes(1).shape(0.5 * self.length)[0]) ** 2

    def _set(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    @property
    def given(self) -> str:
        """Name of the one of ``buckling_level`` and ``axial_load`` with which the beam was made."""
        return self._given

    def replace(self, **changes: float) -> Beam:
        """Return a beam with some parameters changed.

        Of ``buckling_level`` and ``axial_load`` the given one is unchanged, unless either is among the
        *changes*.
        """
        names = [field.name for field in dataclasses.fields(self) if field.init]
        for name in changes:
            if name not in names:
                raise InputError(f"{name}: is not a parameter of a beam; must be one of {', '.join(names)}")
        kept = {name: getattr(self, name) for name in names if name not in ("buckling_level", "axial_load")}
        if not {"buckling_level", "axial_load"} & set(changes):
            kept[self._given] = getattr(self, self._given)
        return Beam(**(kept | changes))

    def buckling_modes(self, count: int) -> Modes:
        """The first *count* buckling modes between the beam's ends."""
        return modes_between(self.boundary, self.length, self.bending_stiffness, count)

    @property
    def area(self) -> float:
        """Area S of the section, m^2."""
        return self.thickness * self.width

    @property
    def second_moment(self) -> float:
        """Second moment of area I = width h^3 / 12, m^4."""
        return self.width * self.thickness**3 / 12.0

    @property
    def radius_of_gyration(self) -> float:
        """Radius of gyration r = sqrt(I/S) of the section, m."""
        return self.thickness / math.sqrt(12.0)

    @property
    def mass_per_length(self) -> float:
        """Mass per length rho S, kg/m."""
        return self.density * self.area

    @property
    def bending_stiffness(self) -> float:
        """Bending stiffness E I, N m^2."""
        return self.young_modulus * self.second_moment

    @property
    def nonlinear_stiffness(self) -> float:
        """Stiffness gamma = E S / (2 L) of the midplane stretching, N/m (Eq. 15), less for supports that give way."""
        rigid = self.young_modulus * self.area / (2.0 * self.length)
        return (
            rigid
            if self.boundary.axial_support_stiffness is None
            else rigid / (1.0 + 2.0 * rigid / self.boundary.axial_support_stiffness)
        )

    @property
    def critical_load(self) -> float:
        """First critical load P_cr = E I k_1^2, N: 4 pi^2 E I / L^2 between clamps (Eq. 3)."""
        if self.boundary.is_elastic:
            return self.bending_stiffness * float(self.buckling_modes(1).wavenumber[0]) ** 2
        return self.bending_stiffness * (2.0 * math.pi / self.length) ** 2

    @property
    def second_critical_load(self) -> float:
        """Second critical load E I k_2^2, N, of the antisymmetric mode: 2.0457 P_cr between clamps."""
        if self.boundary.is_elastic:
            return self.bending_stiffness * float(self.buckling_modes(2).wavenumber[1]) ** 2
        return self.bending_stiffness * float(wavenumbers(2, self.length)[1]) ** 2

    @property
    def is_buckled(self) -> bool:
        """True if the axial load exceeds the critical load, so that the beam is bistable."""
        return self.buckling_level > 0.0


@cache
def _beam_quantities() -> dict[str, Any]:
    return quantities(Beam)
