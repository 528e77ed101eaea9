"""Several patches on one load, against the equations of every patch, and constants from data sheets."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import snapbeam as sb
from snapbeam.util.validation import InputError, InputTypeError

BEAM = sb.Beam(length=0.3, thickness=0.4e-3, width=0.02, density=7850.0, young_modulus=200e9, buckling_level=0.7e-3)
MODEL = sb.ReducedModel.from_beam(BEAM, modes=3, damping_ratio=0.02)
LOAD = 2e4


def patches() -> list[sb.PiezoelectricHarvester]:
    rows = ((0.0, 0.22, 1.5e-4, 5e-7), (0.4, 0.55, -1.1e-4, 3e-7), (0.8, 1.0, 0.7e-4, 8e-7))
    return [
        sb.PiezoelectricHarvester(moment_per_volt=moment, capacitance=c, resistance=1.0, patch_start=a, patch_end=b)
        for a, b, moment, c in rows
    ]


def linear_response(wiring: str, time: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Voltage of the load of the linearised beam, from the charges of every patch."""
    system = sb.System(MODEL)
    well = system.potential.wells[0]
    stiffness = system.potential.in_modes(system.potential.tangent(well.amplitude))
    modes, n = MODEL.linear_modes, MODEL.modes
    damping = modes.T @ MODEL.damping_matrix @ modes
    theta = np.array([modes.T @ each.row(MODEL) for each in patches()])
    c = np.array([each.capacitance for each in patches()])

    def slope(_: float, y: np.ndarray) -> np.ndarray:
        q, p, v = y[:n], y[n : 2 * n], y[2 * n :]
        if wiring == "series":
            dv = (-v.sum() / LOAD - theta @ p) / c
        else:  # one voltage of all
            dv = np.full(3, (-v[0] / LOAD - theta.sum(0) @ p) / c.sum())
        return np.concatenate((p, theta.T @ v - stiffness @ q - damping @ p, dv))

    done = solve_ivp(slope, (0.0, time[-1]), np.concatenate((np.zeros(n), start, np.zeros(3))), t_eval=time,
                     method="DOP853", rtol=1e-11, atol=1e-14)  # fmt: skip
    return done.y[2 * n :].sum(0) if wiring == "series" else done.y[2 * n]


@pytest.mark.parametrize("wiring", ["parallel", "series"])
def test_a_run_has_the_voltage_of_the_separate_patches(wiring) -> None:
    system = sb.System(MODEL, harvesters=sb.model.PiezoelectricPatches.wired(patches(), wiring, resistance=LOAD))
    speed = 1e-8 * np.array([1.0, -0.6, 0.3])  # small: linear
    well = system.potential.wells[0]
    state = sb.State(amplitude=well.amplitude, velocity=MODEL.linear_modes @ speed)
    run = sb.simulate(system.replace(initial_state=state), sb.Integration(cycles=4))
    found = run.dataset.voltage.values
    assert found == pytest.approx(linear_response(wiring, run.dataset.time.values, speed), abs=5e-6 * abs(found).max())


def test_frequencies_are_those_of_the_separate_patches() -> None:
    series = sb.System(MODEL, harvesters=sb.model.PiezoelectricPatches.wired(patches(), "series", resistance=LOAD))
    opened, short = series.circuit_frequencies()
    separate = sb.System(MODEL, harvesters=patches())
    assert opened == pytest.approx(separate.circuit_frequencies()[0], rel=1e-12)  # no charge flows
    # shorted: v_1 + v_2 + v_3 = 0 leaves the stiffness of the charge that flows out
    theta = np.array([MODEL.linear_modes.T @ each.row(MODEL) for each in patches()])
    c = np.array([each.capacitance for each in patches()])
    potential = series.potential
    well = potential.wells[0]
    stiffness = potential.in_modes(potential.tangent(well.amplitude)) + (theta / c[:, None]).T @ theta
    flowing = (theta / c[:, None]).sum(0)
    stiffness = stiffness - np.outer(flowing, flowing) / (1.0 / c).sum()
    assert short == pytest.approx(np.sqrt(np.linalg.eigvalsh(stiffness)) / (2.0 * np.pi), rel=1e-10)


def test_equal_patches_side_by_side_are_one(tmp_path) -> None:
    halves = [
        sb.PiezoelectricHarvester(moment_per_volt=1e-4, capacitance=2e-7, resistance=1.0, patch_start=a, patch_end=b)
        for a, b in ((0.0, 0.1), (0.1, 0.2))
    ]
    whole = sb.PiezoelectricHarvester(moment_per_volt=1e-4, capacitance=4e-7, resistance=LOAD, patch_end=0.2)
    (both,) = sb.model.PiezoelectricPatches.wired(halves, resistance=LOAD)
    assert both.row(MODEL) == pytest.approx(whole.row(MODEL))
    assert both.capacitance == pytest.approx(whole.capacitance)
    # a file keeps them, also those in series
    file = tmp_path / "series.toml"
    series = sb.System(MODEL, harvesters=sb.model.PiezoelectricPatches.wired(halves, "series", resistance=LOAD))
    series.save(file)
    again = sb.System.load(file)
    assert again.poles() == pytest.approx(series.poles())
    assert again.replace(**{"harvester.resistance": 5.0}).harvester.resistance == 5.0


def test_constants_of_a_data_sheet() -> None:
    size = {"layer_thickness": 1e-4, "layer_width": 0.02, "beam": BEAM, "resistance": 1.0}
    d31, modulus, stress_free = -190e-12, 61e9, 1.5e-8
    found = sb.PiezoelectricHarvester.from_material(
        strain_constant=d31, layer_modulus=modulus, permittivity=stress_free, **size
    )
    same = sb.PiezoelectricHarvester.from_material(
        stress_constant=d31 * modulus, permittivity=stress_free * (1.0 - d31**2 * modulus / stress_free), **size
    )
    assert found.moment_per_volt == pytest.approx(2 * d31 * modulus * 0.02 * 0.25e-3)
    assert vars(found) == pytest.approx(vars(same))
    for wrong in (
        {"strain_constant": d31}, {"layer_modulus": modulus}, {},
        {"stress_constant": 1.0, "strain_constant": d31, "layer_modulus": modulus},
        {"strain_constant": -1e-9, "layer_modulus": modulus},  # k_31 above 1
    ):  # fmt: skip
        with pytest.raises(InputError):
            sb.PiezoelectricHarvester.from_material(permittivity=stress_free, **wrong, **size)


def test_patches_that_are_none_are_refused() -> None:
    for rows in ([], [[0.2, 0.1, 1.0]], [[0.0, 0.5]], [[-0.1, 0.5, 1.0]], [[0.0, 1.5, 1.0]]):
        with pytest.raises(InputError, match="patches"):
            sb.model.PiezoelectricPatches(patches=rows, capacitance=1e-9, resistance=1.0)
    with pytest.raises(InputError, match="one patch"):
        sb.model.PiezoelectricPatches.wired([], resistance=1.0)
    with pytest.raises(InputTypeError, match=r"patches = -0\.0"):
        sb.model.PiezoelectricPatches.wired(-0.0, resistance=1.0)  # type: ignore[arg-type]


FILE = """
[beam]
length = "300 mm"
thickness = "0.4 mm"
width = "20 mm"
density = 7850
young_modulus = "200 GPa"
buckling_level = "0.7 mm"
[model]
modes = 3
damping_ratio = 0.02
[base_excitation]
type = "acceleration_sine"
frequency_hz = 35
amplitude_g = 1
[[harvester]]
type = "patches"
wiring = {wiring}
patches = [[0.0, 0.22, 1.5e-4], [0.4, 0.55, -1.1e-4], [0.8, 1.0, 0.7e-4]]
capacitance = {capacitance}
resistance = "20 kohm"
[[harvester]]
type = "coil"
force_factor = 0.2
resistance = 10
"""


@pytest.mark.parametrize("wiring", ["parallel", "series"])
def test_a_file_wires_patches(tmp_path, wiring) -> None:
    file = tmp_path / "wired.toml"
    file.write_text(FILE.format(wiring=f'"{wiring}"', capacitance='["500 nF", 3e-7, "0.8 uF"]'))
    system, expected = sb.System.load(file), sb.model.PiezoelectricPatches.wired(patches(), wiring, resistance=LOAD)
    first, coil, *rest = system.harvesters
    assert system == system.replace(harvesters=[expected[0], coil, *expected[1:]])
    assert [type(each) for each in (first, *rest)] == [type(each) for each in expected]
    assert system.get("harvester.2.force_factor") == 0.2
    system.save(tmp_path / "saved.toml")
    assert sb.System.load(tmp_path / "saved.toml") == system


@pytest.mark.parametrize(
    ("wiring", "capacitance", "message"),
    [('"star"', "[1e-7, 1e-7, 1e-7]", "must be parallel or series"), ('"series"', "1e-7", "list of numbers"),
     ('"series"', "[1e-7, 1e-7]", "one number for each row"), ('"series"', '["1 mm", 1e-7, 1e-7]', "in F")],
)  # fmt: skip
def test_a_file_that_wires_what_does_not_fit(tmp_path, wiring, capacitance, message) -> None:
    file = tmp_path / "wired.toml"
    file.write_text(FILE.format(wiring=wiring, capacitance=capacitance))
    with pytest.raises(InputError, match=message):
        sb.System.load(file)


def test_equal_descriptions_with_rows_are_equal_and_others_are_not() -> None:
    one, two = (sb.model.PiezoelectricPatches.wired(patches(), "series", resistance=LOAD) for _ in range(2))
    assert one == two and hash(one[0]) == hash(two[0])
    assert one != sb.model.PiezoelectricPatches.wired(patches()[::-1], "series", resistance=LOAD)
    same, again, other = (sb.LocalSpring(stiffness=1.0, shape=shape) for shape in ([1.0, 2.0], (1, 2), [1.0, 3.0]))
    assert same == again != other
