"""Measurements of a beam, and their file format: the input of a calibration."""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

from snapbeam.util.input_files import read_toml
from snapbeam.util.validation import InputError, InputTypeError, choice, file_path, positive, shown

HERTZ_TIME = 2.943275  # contact time over d/v for a force k d^1.5: 2 int_0^1 dx/sqrt(1 - x^2.5)


@dataclass(frozen=True, kw_only=True)
class ContactTest:
    """One collision of the shaker's tip: closing speed, and two of duration, peak force, effective mass.

    For a force k d^1.5 between bodies of effective mass m that close at v (Hertz): maximum penetration d = (5 m v^2/(4
    k))^0.4, peak force k d^1.5, duration 2.943 d/v. The bodies are rigid but for the contact: test on a block or a
    heavy clamp.

    Parameters
    ----------
    closing_speed : float
        Closing speed v, m/s.
    duration : float, optional
        Duration, s.
    peak_force : float, optional
        Peak force, N.
    effective_mass : float, optional
        1/(1/m_1 + 1/m_2), kg.
    relative_error : float
        Relative standard error of each of the two.

    Examples
    --------
    >>> from snapbeam import lab
    >>> test = lab.ContactTest(closing_speed=0.1, duration=5e-4, peak_force=4.0)  # m/s, s, N
    >>> measured = lab.Measurements(contact=[test])
    """

    closing_speed: float
    duration: float | None = None
    peak_force: float | None = None
    effective_mass: float | None = None
    relative_error: float = 0.05

    def __post_init__(self) -> None:
        positive("closing_speed", self.closing_speed, "m/s")
        positive("relative_error", self.relative_error)
        names = ("duration", "peak_force", "effective_mass")
        given = [name for name in names if getattr(self, name) is not None]
        for name in given:
            positive(name, getattr(self, name))
        if len(given) != 2:
            raise InputError(f"contact test with {', '.join(given) or 'nothing'}: must have two of {', '.join(names)}")

    def stiffness(self) -> tuple[float, float]:
        """Contact stiffness [N/m^1.5] and its standard error."""
        v, t, f, m = self.closing_speed, self.duration, self.peak_force, self.effective_mass
        if t is not None:
            depth = t * v / HERTZ_TIME
            if f is not None:
                stiffness, power = f / depth**1.5, math.hypot(1.0, 1.5)
            else:
                assert m is not None
                stiffness, power = 1.25 * m * v * v / depth**2.5, math.hypot(1.0, 2.5)
        else:
            assert f is not None and m is not None
            depth = 1.25 * m * v * v / f
            stiffness, power = f / depth**1.5, math.hypot(2.5, 1.5)
        return stiffness, stiffness * power * self.relative_error


@dataclass(frozen=True, kw_only=True)
class Measurements:
    """Measurements of one beam: frequencies, damping, geometry and contact tests.

    Frequencies are in the order of the modes. A standard error is one number or one for each; 0.5 % by default, with a
    diagnostic.

    Parameters
    ----------
    straight_frequencies : sequence of float
        Natural frequencies without axial load, Hz.
    lower_well_frequencies, upper_well_frequencies : sequence of float
        Natural frequencies about either well, Hz.
    straight_frequencies_se, lower_well_frequencies_se, upper_well_frequencies_se : float or sequence of float, optional
        Standard errors of these, Hz.
    lower_well_shape, upper_well_shape : sequence of str, optional
        "symmetric" or "antisymmetric" for each frequency about a well, to match the modes of that shape in their order;
        else all modes in their order, which changes at a buckling level of about 6 radii of gyration.
    damping_ratio : sequence of float
        Damping ratios from free decays.
    damping_ratio_se : float or sequence of float, optional
    thickness, buckling_level : float, optional
        Values by gauge, m, compared with the result.
    contact : sequence of ContactTest

    Examples
    --------
    >>> from snapbeam import lab
    >>> measured = lab.Measurements(lower_well_frequencies=[84.0], lower_well_frequencies_se=[0.2])  # Hz
    >>> measured.lower_well_frequencies
    (84.0,)
    """

    straight_frequencies: Sequence[float] = ()
    straight_frequencies_se: float | Sequence[float] | None = None
    lower_well_frequencies: Sequence[float] = ()
    lower_well_frequencies_se: float | Sequence[float] | None = None
    upper_well_frequencies: Sequence[float] = ()
    upper_well_frequencies_se: float | Sequence[float] | None = None
    lower_well_shape: Sequence[str] = ()
    upper_well_shape: Sequence[str] = ()
    damping_ratio: Sequence[float] = ()
    damping_ratio_se: float | Sequence[float] | None = None
    thickness: float | None = None
    buckling_level: float | None = None
    contact: Sequence[ContactTest] = ()

    def __post_init__(self) -> None:
        for name in ("straight_frequencies", "lower_well_frequencies", "upper_well_frequencies", "damping_ratio"):
            values = _numbers(name, getattr(self, name))
            object.__setattr__(self, name, values)
            errors = getattr(self, f"{name}_se")
            if errors is not None:
                listed = [errors] * len(values) if isinstance(errors, (int, float)) else errors
                checked = _numbers(f"{name}_se", listed)
                if len(checked) != len(values):
                    raise InputError(f"{name}_se: {len(checked)} value(s), {name} has {len(values)}")
                object.__setattr__(self, f"{name}_se", checked)
            if "freq" in name and any(b <= a for a, b in itertools.pairwise(values)):
                raise InputError(f"{name} = {list(values)}: must increase, one frequency a mode")
        for name in ("lower_well", "upper_well"):
            shapes = getattr(self, f"{name}_shape")
            if not isinstance(shapes, (list, tuple)):
                raise InputTypeError(f"{name}_shape = {shown(shapes)}: must be a list of words, one for each frequency")
            object.__setattr__(self, f"{name}_shape", tuple(shapes))
            for i, shape in enumerate(shapes):
                choice(f"{name}_shape[{i}]", shape, ("symmetric", "antisymmetric"))
            if shapes and len(shapes) != len(getattr(self, f"{name}_frequencies")):
                raise InputError(
                    f"{name}_shape: {len(shapes)} word(s), {name}_frequencies has {len(getattr(self, f'{name}_frequencies'))}"
                )
        if any(ratio >= 1.0 for ratio in self.damping_ratio):
            raise InputError(f"damping_ratio = {list(self.damping_ratio)}: must lie in (0, 1)")
        for name in ("thickness", "buckling_level"):
            if getattr(self, name) is not None:
                positive(name, getattr(self, name), "m")


def _numbers(name: str, values: Any) -> tuple[float, ...]:
    if isinstance(values, (int, float)) and not isinstance(values, bool):
        values = (values,)
    if isinstance(values, (str, bytes, Mapping)) or not isinstance(values, Iterable):
        raise InputTypeError(f"{name} = {shown(values)}: must be a list of numbers")
    try:
        given = tuple(values)
    except (TypeError, MemoryError):
        raise InputTypeError(f"{name} = {shown(values)}: must be a list of numbers") from None
    return tuple(positive(f"{name}[{i}]", value) for i, value in enumerate(given))


def load_measurements(path: str | os.PathLike[str]) -> tuple[Measurements, dict[str, Any]]:
    """Read measurements from a TOML file.

    The section ``[measured]`` has the names of :class:`Measurements`; each ``[[measured.contact]]`` is a
    :class:`ContactTest`.  A section ``[beam]`` as in a parameter file may give the nominal beam.

    Returns
    -------
    (Measurements, dict)
        The dictionary contains the other sections.

    Examples
    --------
    >>> from pathlib import Path
    >>> from snapbeam import lab
    >>> lines = ["[measured]", "lower_well_frequencies = [84.0]", "lower_well_frequencies_se = [0.2]"]
    >>> _ = Path("measured.toml").write_text(chr(10).join(lines))
    >>> measured, _ = lab.load_measurements("measured.toml")
    >>> measured.lower_well_frequencies
    (84.0,)
    """
    source = file_path("path", path)
    sections = read_toml("path", source)
    measured = sections.pop("measured", None)
    if not isinstance(measured, dict):
        raise InputError(f"{source}: has no section [measured]")
    known = [field.name for field in fields(Measurements)]
    for name in measured:
        if name not in known:
            raise InputError(f"{source}: [measured] {name}: unknown; must be among {', '.join(known)}")
    try:
        tests = measured.pop("contact", [])
        if not isinstance(tests, list) or not all(isinstance(test, dict) for test in tests):
            raise InputError("contact: must be a list of tables [[measured.contact]]")
        names = [field.name for field in fields(ContactTest)]
        for test in tests:
            if set(test) - set(names) or "closing_speed" not in test:
                raise InputError(f"contact = {test}: must have closing_speed and two of {', '.join(names[1:4])}")
        contact = tuple(ContactTest(**test) for test in tests)
        return Measurements(**measured, contact=contact), sections
    except InputError as error:
        raise InputError(f"{source}: [measured] {error}") from error
