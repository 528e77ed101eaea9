"""Three rulers of a recording and the pixel size given: which of them is wrong, or that all agree."""

import camera_scenes
import numpy as np
import pytest

from snapbeam.lab.tracking.rulers import Ruler, compare_rulers
from snapbeam.util.diagnostics import Severity, diagnostics_of

TRUE = 20e-6
ERRORS = {"pixel_size": 0.0, "beam_thickness": 0.011, "tip_diameter": 0.01, "drive_amplitude": 0.003}


def rulers(names=tuple(ERRORS), **off):
    """Rulers that imply the true pixel size times the factors in *off*."""
    return [Ruler(name, TRUE * off.get(name, 1.0), ERRORS[name]) for name in names]


def test_rulers_within_their_errors_agree():
    rng = np.random.default_rng(1)
    for _ in range(200):
        drawn = {name: 1.0 + error * rng.standard_normal() for name, error in ERRORS.items()}
        assert compare_rulers(rulers(**drawn)) is None


@pytest.mark.parametrize("name", list(ERRORS))
@pytest.mark.parametrize(("off", "unit"), [(25.4, "inches"), (0.1, "ten"), (1.2, "")])
def test_the_ruler_that_disagrees_with_the_others_is_named(name, off, unit):
    severity, words, numbers = compare_rulers(rulers(**{name: off}))
    assert words.startswith(f"{name} (--{name.replace('_', '-')}) disagrees with ")
    assert numbers["ratio"] == pytest.approx(off, rel=0.02)
    assert (severity is Severity.ERROR) == bool(unit) and unit in words


def test_two_that_disagree_are_both_named():
    """Of two the recording cannot say which is wrong, nor where a third is too vague."""
    for off in (1.1, 0.985, 10.0):
        _, words, _ = compare_rulers(rulers(("pixel_size", "drive_amplitude"), drive_amplitude=off))
        assert words.startswith("pixel_size (--pixel-size) and drive_amplitude (--drive-amplitude) disagree")
    severity, words, _ = compare_rulers(rulers(pixel_size=1.017))
    assert severity is Severity.WARNING and "and drive_amplitude (--drive-amplitude) disagree" in words
    assert compare_rulers(rulers(("pixel_size", "beam_thickness"), pixel_size=1.015)) is None


def found(kind, seed, folder, **asked):
    """The diagnostics of a rendered scene about its scale, by code."""
    tracked, _ = camera_scenes.measured(kind, np.random.default_rng(seed), folder, **asked)
    return {one.code: one for one in diagnostics_of(tracked)}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "severity"),
    [
        ("three rulers", None),
        pytest.param("gauge out of plane", Severity.WARNING, marks=pytest.mark.slow),
        pytest.param("pixel size ten times off", Severity.ERROR, marks=pytest.mark.slow),
        pytest.param("pixel size in inches", Severity.ERROR, marks=pytest.mark.slow),
    ],
)
def test_the_pixel_size_of_a_rendered_scene(kind, severity, tmp_path):
    told = found(kind, 60, tmp_path)
    assert "camera.ruler_unseen" not in told
    assert (told["camera.rulers"].severity if "camera.rulers" in told else None) == severity
    if severity:
        assert "pixel_size (--pixel-size)" in told["camera.rulers"].message


@pytest.mark.slow
def test_a_ruler_that_is_not_seen_is_told(tmp_path):
    told = found("gauge", 61, tmp_path, drive_amplitude=1e-4)  # less than four cycles
    assert "drive_amplitude" in told["camera.ruler_unseen"].message
