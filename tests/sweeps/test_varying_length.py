"""Maps along whose axes the length scale changes have displacements in metres; others have them over b."""

from __future__ import annotations

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values

INTEGRATION = sb.Integration(cycles=3)


def system_of(level: float = default_values.BEAM.buckling_level) -> sb.System:
    beam = default_values.BEAM.replace(buckling_level=level)
    model = sb.ReducedModel.from_beam(beam, modes=1, damping_ratio=0.03)
    shaker = sb.Shaker(frequency_ratio=0.9, velocity_amplitude=0.15)
    return sb.System(model, contacts=[sb.Contact(default_values.CONTACT, shaker.striker())])


def test_the_buckling_level_along_an_axis(tmp_path):
    levels = [2.2e-4, 3.9e-4]
    folder = tmp_path / "kept"
    found = sb.sweep(system_of(), {"beam.buckling_level": levels}, INTEGRATION, checkpoint=str(folder))
    name = "max_midspan_displacement"
    assert found[name].attrs["units"] == "m" and "over" not in found[name].attrs["long_name"]
    assert found["rms_velocity"].attrs["units"] == "m/s"
    for i, level in enumerate(levels):
        single = sb.sweep(system_of(level), {"drive.velocity_amplitude": [0.15]}, INTEGRATION)
        assert single[name].attrs["units"] == "1" and single[name].attrs["long_name"].endswith("over b")
        assert float(found[name][i]) == pytest.approx(level * float(single[name][0]), rel=1e-9)
        speed = 2.0 * np.pi * system_of(level).model.reference_frequency * level
        assert float(found["rms_velocity"][i]) == pytest.approx(speed * float(single["rms_velocity"][0]), rel=1e-9)


def test_a_damping_axis_keeps_b():
    found = sb.sweep(system_of(), {"model.damping_ratio": [0.02, 0.05]}, INTEGRATION)
    assert found["peak_displacement"].attrs["units"] == "1"
