"""Headers of Photron high-speed recordings, read and checked.

A recording is two files of one name: a header (``.cih``, ``.cihx``) and the pixels (``.mraw``, frame after
frame, row by row, without any header of its own); or a header and numbered images.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from snapbeam.core.findings import Diagnostic
from snapbeam.core.validate import InputError, shown
from snapbeam.lab.camera.photron.fields import Fields, read_fields
from snapbeam.lab.camera.photron.timing import Timing, read_timing
from snapbeam.lab.plausibility.recording import KINDS

__all__ = ["CameraHeader", "check_pixels", "read_header"]

_LENGTH_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "nm": 1e-9}
_MAX_SIDE = 65536
_IMAGES = {"png": ".png", "tiff": ".tif", "tif": ".tif", "bmp": ".bmp", "jpeg": ".jpg", "jpg": ".jpg"}


@dataclass(frozen=True)
class CameraHeader:
    """What a .cih or .cihx header says about its recording.

    ``timing`` holds the rates and the exposure; ``pixel_size`` [m] is ``None`` where the header does not hold
    it, and ``scale_hint`` says what it holds instead.  ``stored_bits`` is the size of a pixel in the file and
    ``effective_bits`` how many of them carry the image, on the ``effective_side`` of the stored number;
    ``raw_colors`` says that the pixels may lie under a mosaic of colour filters.  ``image_suffix`` is that of
    the numbered images that hold the pixels, empty for a .mraw file.
    """

    path: Path
    width: int
    height: int
    frame_count: int
    timing: Timing
    pixel_size: float | None
    scale_hint: str
    stored_bits: int
    effective_bits: int
    effective_side: str
    raw_colors: bool
    image_suffix: str
    start_frame: int
    camera: str
    comment: str
    diagnostics: tuple[Diagnostic, ...]

    @property
    def mraw(self) -> Path:
        """The file with the pixels."""
        for suffix in (".mraw", ".MRAW", ".Mraw"):
            candidate = self.path.with_suffix(suffix)
            if candidate.exists():
                return candidate
        return self.path.with_suffix(".mraw")

    @property
    def max_value(self) -> int:
        """The largest value an effective pixel can take."""
        return int(2**self.effective_bits - 1)


def read_header(path: str | Path) -> CameraHeader:
    """Read and check a Photron header.

    Parameters
    ----------
    path
        A ``.cih`` or ``.cihx`` file.

    Raises
    ------
    InputError
        Naming the file and the field that is missing, malformed or not supported.
    """
    fields = read_fields(Path(path))
    kind = fields.text("format", "mraw").lower()
    if kind != "mraw" and kind not in _IMAGES:
        raise fields.error(
            "format",
            f"= {fields.text('format')!r}: must be MRaw, PNG, TIFF, BMP or JPEG; save it as one of these",
        )
    color = fields.text("color", "Mono").lower()
    if color not in ("mono", "raw"):
        raise fields.error(
            "color", f"= {fields.text('color')!r}: must be Mono or Raw; save the recording in grey levels"
        )
    stored, effective, side = _bits(fields, "" if kind == "mraw" else kind)
    frames = fields.integer("frame_count", 1, 2**40)
    timing = read_timing(fields, frames)
    header = CameraHeader(
        path=fields.path,
        width=fields.integer("width", 1, _MAX_SIDE),
        height=fields.integer("height", 1, _MAX_SIDE),
        frame_count=frames,
        timing=timing,
        pixel_size=_pixel_size(fields),
        scale_hint=_scale_hint(fields),
        stored_bits=stored,
        effective_bits=effective,
        effective_side=side,
        raw_colors=color == "raw",
        image_suffix=_IMAGES.get(kind, ""),
        start_frame=fields.integer("start", -(2**40), 2**40, default=0),
        camera=fields.text("camera", ""),
        comment=fields.text("comment", ""),
        diagnostics=(*timing.diagnostics, *_curve(fields)),
    )
    if stored == 12 and not header.image_suffix and header.width * header.height % 2:
        raise fields.error("width", f"= {header.width}: 12-bit frames hold an even number of pixels")
    return header


def _bits(fields: Fields, images: str) -> tuple[int, int, str]:
    """Stored bits, effective bits and their side.

    A camera of 12 bits saved in 8 keeps the upper ones, and says so: all 8 are effective.
    """
    stored = fields.integer("stored_bits", 1, 64)
    if stored not in (8, 12, 16):
        raise fields.error("stored_bits", f"= {stored}: must be 8, 12 or 16")
    side = fields.text("effective_side", "Lower").lower()
    if side not in ("lower", "higher"):
        raise fields.error("effective_side", f"= {shown(side)}: must be Lower or Higher")
    depth = fields.integer("effective_bits", 1, 16, default=stored)
    if depth > stored and side == "lower" and not images:
        raise fields.error(
            "effective_bits",
            f"= {depth}: the lower {stored} bits of {depth} were stored, so bright pixels wrap around to dark; "
            "save the upper bits, or all",
        )
    return stored, min(depth, stored), side


def _pixel_size(fields: Fields) -> float | None:
    """Metres per pixel from the calibration block, where its unit is a length."""
    unit = fields.text("unit", "").lower() if fields.xml else ""
    if unit not in _LENGTH_UNITS:
        return None
    size = fields.positive("pixel")
    return None if size is None else size * _LENGTH_UNITS[unit]


def _scale_hint(fields: Fields) -> str:
    """What a .cih header holds of the scale: a number whose unit it gives as a code that is not documented."""
    size = None if fields.xml else fields.number("scale")
    if size is None or size in (0.0, 1.0):
        return ""
    return f"its field 'Scale Pixel Size' is {size:g} in a unit that it does not name ({size:g}e-6 if um)"


def _curve(fields: Fields) -> tuple[Diagnostic, ...]:
    gamma, enhance = fields.number("gamma"), fields.number("edge_enhance")
    if (gamma is None or gamma == 1.0) and not enhance:
        return ()
    return (KINDS["curve"].found(gamma=1.0 if gamma is None else gamma, enhance=enhance or 0.0),)


def check_pixels(header: CameraHeader) -> None:
    """Refuse pixels whose file size is not what the header says."""
    mraw = header.mraw
    try:
        found = mraw.stat().st_size
    except OSError as error:
        raise InputError(f"{mraw}: cannot be read ({error.strerror})") from None
    expected = header.frame_count * header.width * header.height * header.stored_bits // 8
    if found != expected:
        state = "is truncated" if found < expected else "is larger than its header says"
        raise InputError(
            f"{mraw}: {state}: {found} bytes, but the fields width, height, total frame and bit depth of "
            f"{header.path.name} ({header.width} x {header.height} x {header.frame_count} at "
            f"{header.stored_bits} bits) ask for {expected}"
        )
