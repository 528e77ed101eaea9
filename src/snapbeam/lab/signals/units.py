"""Units of measured signals: into SI, and the sensitivities of sensors."""

from __future__ import annotations

import re

import numpy as np

from snapbeam.core.validate import InputError, InputTypeError, shown

__all__ = ["KNOWN_UNITS", "parse_sensitivity", "si_unit"]

_PREFIX = {"": 1.0, "k": 1e3, "c": 1e-2, "m": 1e-3, "u": 1e-6, "n": 1e-9}
_GRAVITY = 9.80665  # m/s^2, standard acceleration of free fall
_INCH = 0.0254  # m
_TO_SI: dict[str, tuple[float, str]] = {
    **{f"{p}m": (s, "m") for p, s in _PREFIX.items()},
    **{f"{p}m/s": (s, "m/s") for p, s in _PREFIX.items()},
    **{f"{p}m/s^2": (s, "m/s^2") for p, s in _PREFIX.items()},
    **{f"{p}N": (s, "N") for p, s in _PREFIX.items()},
    **{f"{p}V": (s, "V") for p, s in _PREFIX.items()},
    **{f"{p}s": (s, "s") for p, s in _PREFIX.items()},
    **{f"{p}Hz": (s, "Hz") for p, s in _PREFIX.items()},
    **{f"{p}Pa": (s, "Pa") for p, s in _PREFIX.items()},
    "g": (_GRAVITY, "m/s^2"),
    "g_n": (_GRAVITY, "m/s^2"),
    "in": (_INCH, "m"),
    "in/s": (_INCH, "m/s"),
    "ips": (_INCH, "m/s"),
    "in/s^2": (_INCH, "m/s^2"),
    "FS": (1.0, "FS"),
    "1": (1.0, "1"),
    "b": (1.0, "b"),
}
for _odd in ("cs", "ks", "cV", "cHz", "cPa", "cN"):
    _TO_SI.pop(_odd)
_WORDS = {
    "second": "s", "seconds": "s", "millisecond": "ms", "milliseconds": "ms", "volt": "V", "volts": "V",
    "millivolts": "mV", "inch": "in", "inches": "in", "hertz": "Hz", "pascal": "Pa", "newton": "N",
    "meter": "m", "metre": "m",
}  # fmt: skip
KNOWN_UNITS = (
    "m, m/s, m/s^2, N, V, s, Hz or Pa with a prefix k, c, m, u or n, g, in, in/s, in/s^2, or FS (fraction of full "
    "scale)"
)


def si_unit(name: str, unit: str) -> tuple[float, str]:
    """Return the factor and the SI unit for *unit*, such as ``(1e-3, "m/s")`` for ``"mm/s"``.

    Known are m, m/s, m/s^2, N, V, s, Hz and Pa with the prefixes k, c, m, u (or µ), n; g, the standard
    acceleration of free fall; in, in/s, in/s^2; and FS, the fraction of full scale of a sound file.

    Raises
    ------
    InputError
        If the unit is unknown; *name* says whose unit it is.
    """
    if not isinstance(unit, str):
        where = f"unit of {name}" if isinstance(name, str) else "unit"
        raise InputTypeError(
            f"{where} = {shown(unit)}: must be text such as 'mm/s', not {type(unit).__name__}"
        )
    word = unit.strip().replace("\u03bc", "u").replace("\u00b5", "u").replace(" ", "").replace("*", "")
    word = _WORDS.get(word.lower(), word)
    word = word.replace("sec", "s").replace("²", "^2").replace("/s/s", "/s^2").replace("/s2", "/s^2")
    word = re.sub(r"s\^?-1$", "/s", re.sub(r"s\^?-2$", "/s^2", word)).replace("//", "/")
    if word not in _TO_SI:
        raise InputError(
            f"unit of {name if isinstance(name, str) else 'a signal'} = {shown(unit)}: must be {KNOWN_UNITS}"
        )
    return _TO_SI[word]


def parse_sensitivity(name: str, text: str) -> tuple[float, str, str]:
    """Read a sensitivity: return the factor, the SI unit, and V or FS.

    Either what a volt (or full scale) stands for, ``"125 mm/s/V"``, or the volts that a sensor gives,
    ``"100 mV/g"``, ``"50 mV/Pa"``, ``"10 mV/(m/s^2)"``.

    Raises
    ------
    InputError
        If *text* is neither.
    """
    found = re.fullmatch(r"\s*([-+0-9.eE]+)\s*(\S.*)", text) if isinstance(text, str) else None
    try:
        number = float(found[1]) if found else float("nan")
    except ValueError:
        number = float("nan")
    if found is None or not np.isfinite(number) or number == 0.0:
        raise InputError(f"{name} = {text!r}: must read like '125 mm/s/V', '100 mV/g' or '0.5 m/s/FS'")
    rest = found[2].replace(" ", "")
    per = re.fullmatch(r"(.+)/(V|mV|FS)", rest)
    if per is not None:
        factor, unit = si_unit(name, per[1].strip("()"))
        per_factor, base = si_unit(name, per[2])
        return number * factor / per_factor, unit, base
    gives = re.fullmatch(r"(u|m|)V/(.+)", rest)
    if gives is None:
        raise InputError(f"{name} = {text!r}: must read like '125 mm/s/V', '100 mV/g' or '0.5 m/s/FS'")
    volts, _ = si_unit(name, f"{gives[1]}V")
    factor, unit = si_unit(name, gives[2].strip("()"))
    return factor / (number * volts), unit, "V"
