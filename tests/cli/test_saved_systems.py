"""Commands on the files that ``System.save`` writes, of every kind of system."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import snapbeam as sb
from snapbeam.cli.app import app
from snapbeam.cli.console import open_result
from snapbeam.model.parameter_file import load_config

BEAM = sb.Beam(length=0.3, thickness=0.4e-3, width=0.02, density=7850.0, young_modulus=200e9, buckling_level=0.5e-3)
PLAIN = sb.ReducedModel.from_beam(BEAM, modes=2, damping_ratio=0.02)
UNEVEN = sb.ReducedModel.from_beam(
    BEAM, 3, [0.02, 0.03, 0.03], imperfection=sb.Imperfection(midspan_amplitude=2e-5, antisymmetric_amplitude=5e-6)
)
LAW = sb.HertzContact(stiffness=1e8)
SHAKEN = sb.BaseExcitation(motion=sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.05))
STOP = sb.Striker(drive=sb.FixedStop(), side="above", gap=2e-4, location=0.5)
SOFT = sb.KelvinVoigt(linear_stiffness=2e4, linear_damping=0.3)


def matrices(**more) -> sb.ReducedModel:
    return sb.ReducedModel.from_matrices(
        np.diag([0.02, 0.03]), [[40.0, -10.0], [-10.0, 90.0]], contact_shape=[1.0, 0.4], base_shape=[0.02, 0.01],
        nonlinear_stiffness=2e7, elongation_matrix=np.eye(2), length_scale=1e-3, **more,
    )  # fmt: skip


def wired(wiring: str) -> list[sb.model.PiezoelectricPatches]:
    rows = ((0.0, 0.22, 1.5e-4, 5e-7), (0.8, 1.0, 0.7e-4, 8e-7))
    patches = [
        sb.PiezoelectricHarvester(moment_per_volt=m, capacitance=c, resistance=1.0, patch_start=a, patch_end=b)
        for a, b, m, c in rows
    ]
    return sb.model.PiezoelectricPatches.wired(patches, wiring, resistance=2e4)


COIL = sb.ElectromagneticHarvester(force_factor=0.2, resistance=10.0, inductance=1e-2, location=0.3)
SYSTEMS = {
    "matrices": sb.System(matrices(damping_ratio=0.01), base_excitation=SHAKEN, contacts=[sb.Contact(LAW, STOP)]),
    "matrix of dampers, load": sb.System(
        matrices(damping=[[0.02, 0.0], [0.0, 0.03]], transverse_force=[1e-3, 0.0]), base_excitation=SHAKEN
    ),
    "matrices with wells": sb.System(
        sb.ReducedModel.from_matrices(
            [[0.02]], [[-40.0]], contact_shape=[1.0], base_shape=[1.0], nonlinear_stiffness=2e7, elongation_matrix=[[1.0]],
            well_amplitude=[-np.sqrt(40.0 / 2e7)], length_scale=1e-3, damping_ratio=0.02,
        ),
        base_excitation=SHAKEN, initial_well="upper",
    ),
    "unequal wells": sb.System(UNEVEN, base_excitation=SHAKEN, initial_well="upper"),
    "patches in series": sb.System(PLAIN, base_excitation=SHAKEN, harvesters=wired("series")),
    "contacts, harvesters, labels": sb.System(
        PLAIN,
        contacts=[sb.Contact(LAW, STOP, "upper stop, no. 1"), sb.Contact(SOFT, sb.Striker(
            drive=sb.FixedStop(), side="below", gap=3e-4, location=0.4), "lower.stop")],
        forces=[sb.ExternalForce(history=sb.HarmonicForce(frequency_ratio=0.8, amplitude=0.02), location=0.4, label="coil 'A'")],
        base_excitation=SHAKEN, harvesters=[*wired("parallel"), COIL],
    ),
    "random base": sb.System(
        PLAIN, contacts=[sb.Contact(LAW, STOP)],
        base_excitation=sb.BaseExcitation(motion=sb.RecordedAcceleration.from_psd([[5.0, 1e-3], [50.0, 1e-3]], duration_s=4.0, seed=3)),
    ),
    "initial state": sb.System(
        PLAIN, contacts=[sb.Contact(LAW, sb.Shaker(frequency_ratio=1.1, velocity_amplitude=0.1, location=0.4))],
        initial_state=sb.State(amplitude=[-1e-4, 2e-6], velocity=[0.0, 0.01], striker_position=-1e-4, phase=0.3),
    ),
}  # fmt: skip

AXIS = {"initial state": "drive.velocity_amplitude=0.05,0.1", "random base": "base_excitation.rms_g=0.1,0.2"}
SHORT = ["--cycles", "4"]


@pytest.fixture(params=SYSTEMS, name="kind")
def _kind(request) -> str:
    return str(request.param)


@pytest.fixture(name="saved")
def _saved(kind, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    SYSTEMS[kind].save("system.toml")
    return "system.toml"


def done(*command: str) -> str:
    result = CliRunner().invoke(app, list(command))
    assert result.exit_code == 0, result.output
    return result.output


def test_a_file_describes_the_system_that_was_saved(kind, saved) -> None:
    assert sb.System.load(saved) == SYSTEMS[kind]
    assert load_config(saved).system == SYSTEMS[kind]


@pytest.mark.sampled(4)
def test_commands_of_runs(kind, saved) -> None:
    done("simulate", "-c", saved, *SHORT, "-o", "run.nc")
    run = sb.simulate(SYSTEMS[kind], sb.Integration(cycles=4))
    assert open_result("run.nc").midspan_displacement.values == pytest.approx(run.dataset.midspan_displacement.values)
    done("info", "run.nc")
    axis = AXIS.get(kind, "base_excitation.acceleration_amplitude=0.02,0.05")
    done("map", "-c", saved, *SHORT, "--sweep", axis, "-o", "map.nc")
    printed = done("simulate", "-c", saved, "--print-config")
    Path("whole.toml").write_text(printed, encoding="utf-8")
    assert load_config("whole.toml").system == SYSTEMS[kind]
    done("simulate", "--from", "run.nc", "-o", "again.nc")
    assert open_result("again.nc").midspan_displacement.values == pytest.approx(run.dataset.midspan_displacement.values)
    name, _, values = axis.partition("=")
    done("threshold", "-c", saved, *SHORT, "--parameter", name, "--values", values)


@pytest.mark.sampled(4)
def test_commands_at_rest(kind, saved) -> None:
    done("equilibria", "-c", saved)
    done("frequencies", "-c", saved)
    done("schematic", "-c", saved, "-o", "schematic.png")


def test_what_a_structure_by_matrices_is_told(tmp_path) -> None:
    """Its force acts on the contact point, not at a part of a length; it is not animated, which is said before the run."""
    file = str(tmp_path / "cell.toml")
    SYSTEMS["matrices with wells"].save(file)
    said = done("equilibria", "-c", file, "--force-displacement")
    assert "force at the contact point, from" in said and "of the length" not in said
    refused = CliRunner().invoke(
        app, ["simulate", "-c", file, "-o", str(tmp_path / "run.nc"), "--animate", str(tmp_path / "a.gif")]
    )
    assert refused.exit_code == 2 and "has no shape that moves" in refused.output and not (tmp_path / "run.nc").exists()
