"""Sweeps over any parameters: every point the run that it names, whatever it is computed with."""

from __future__ import annotations

import itertools

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
import xarray as xr

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.plot.map import plot_response_map
from snapbeam.plot.style import save_figure
from snapbeam.solver.statistics import STATISTICS
from snapbeam.util.validation import InputError, InputTypeError

ASKED = sb.Integration(cycles=3)
AXES = {
    "beam.buckling_level": [3e-4, 4e-4],
    "damping_ratio": [0.002, 0.01],
    "modes": [1, 4],
    "frequency_ratio": [0.8, 1.21, 1.6, 2.2],
}


@pytest.fixture(scope="module")
def system() -> sb.System:
    return sb.System(
        sb.ReducedModel.from_beam(default_values.BEAM, modes=2),
        contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.3))],
    )


@pytest.fixture(scope="module")
def whole(system) -> xr.Dataset:
    return sb.sweep(system, AXES, ASKED)


def assert_point_is_run(dataset: xr.Dataset, system: sb.System, integration: sb.Integration = ASKED) -> None:
    """A point of a map against simulate(), every statistic to the last bit."""
    outcome = sb.simulate(system, integration, sample_times=[0.0]).summary
    for name in STATISTICS:
        expected, over = outcome[name], STATISTICS[name].normalised_by
        if over and dataset[name].attrs["units"] != "1":  # b differs between the points
            length = system.scale.length
            expected *= length if over == "b" else length * 2.0 * np.pi * system.model.reference_frequency
        np.testing.assert_equal(dataset[name].item(), expected, err_msg=name)


# ---------------------------------------------------------------------- structure times drive


def test_labels(whole, system) -> None:
    assert whole.response_class.dims == ("beam_buckling_level", "damping_ratio", "modes", "frequency_ratio")
    assert whole.response_class.shape == (2, 2, 2, 4)
    for name, full in (("beam_buckling_level", "beam.buckling_level"), ("modes", "model.modes")):
        assert whole[name].attrs["parameter"] == full
    assert whole.beam_buckling_level.attrs["units"] == "m"
    # what goes with the structure stands beside it, and nowhere else
    for name in ("reference_frequency", "step", "length_scale"):
        assert whole[name].dims == ("beam_buckling_level", "damping_ratio", "modes")
        assert name not in whole.attrs
    assert not {"modes", "damping_ratio", "beam_buckling_level", "beam_axial_load"} & whole.attrs.keys()
    assert whole.attrs["beam_thickness"] == 0.4e-3
    assert whole.attrs["velocity_amplitude"] == 0.3
    assert float(whole.velocity_amplitude) == 0.3
    for i, level in enumerate(AXES["beam.buckling_level"]):
        other = system.replace(**{"beam.buckling_level": level, "model.damping_ratio": 0.01, "model.modes": 4})
        assert whole.reference_frequency.values[i, 1, 1] == other.model.reference_frequency
        assert whole.length_scale.values[i, 1, 1] == level


def test_every_point_is_its_run(whole, system) -> None:
    for at in itertools.product(range(2), range(2), range(2), range(4)):
        point = whole.isel(dict(zip(whole.response_class.dims, at, strict=True)))
        neighbour = system.replace(
            **{
                "beam.buckling_level": point.beam_buckling_level.item(),
                "model.damping_ratio": point.damping_ratio.item(),
                "model.modes": point.modes.item(),
                "drive.frequency_ratio": point.frequency_ratio.item(),
            }
        )
        assert_point_is_run(point, neighbour)
    assert len(np.unique(whole.response_class)) > 1


def test_axes_in_another_order_are_the_same_points(whole, system) -> None:
    names = ("frequency_ratio", "modes", "beam.buckling_level", "damping_ratio")
    other = sb.sweep(system, {name: AXES[name] for name in names}, ASKED)
    assert other.response_class.dims == ("frequency_ratio", "modes", "beam_buckling_level", "damping_ratio")
    for name in STATISTICS:
        np.testing.assert_array_equal(other[name].transpose(*whole.response_class.dims), whole[name], err_msg=name)


def test_parts_stores_and_threads(whole, system, tmp_path) -> None:
    """Cut into tasks that split structures, on other threads, in a store, resumed, written in blocks."""
    part = sb.sweep(system, AXES | {"modes": [4], "frequency_ratio": AXES["frequency_ratio"][1:]}, ASKED)
    for name in STATISTICS:
        np.testing.assert_array_equal(
            part[name], whole[name].isel(modes=[1], frequency_ratio=slice(1, None)), err_msg=name
        )
    options = sb.CheckpointOptions(tmp_path / "store", points_per_task=5)
    stored = sb.sweep(system, AXES, ASKED.replace(threads=1), checkpoint=options, output=tmp_path / "map.nc")
    xr.testing.assert_equal(stored.load(), whole)
    report = sb.SweepReport()
    again = sb.sweep(system, AXES, ASKED, checkpoint=sb.CheckpointOptions(tmp_path / "store", report=report))
    xr.testing.assert_equal(again, whole)
    assert (report.tasks, report.resumed, report.computed) == (7, 7, 0)
    with pytest.raises(InputError, match=r"points\.model\.modes: \[1, 4\] in the checkpoint, \[1, 3\] requested"):
        sb.sweep(system, AXES | {"modes": [1, 3]}, ASKED, checkpoint=tmp_path / "store")
    with pytest.raises(InputError, match=r"system\.beam\.thickness: 0\.0004 in the checkpoint, 0\.00041 requested"):
        sb.sweep(system.replace(**{"beam.thickness": 4.1e-4}), AXES, ASKED, checkpoint=tmp_path / "store")


def test_the_file_is_the_map(whole, system, tmp_path) -> None:
    """Blocks of a map whose structure is counted outermost lie where xarray would write them."""
    names = ("frequency_ratio", "beam.buckling_level", "modes")
    axes = {name: AXES[name] for name in names} | {"contact.side": ["below", "above"]}
    memory = sb.sweep(system, axes, ASKED)
    file = sb.sweep(system, axes, ASKED, output=tmp_path / "a.nc").load()
    memory.to_netcdf(tmp_path / "b.nc", engine="h5netcdf")
    expected = xr.load_dataset(tmp_path / "b.nc", engine="h5netcdf")
    varying = ("created", "parameter_hash", "command")
    assert {k: v for k, v in file.attrs.items() if k not in varying} == {
        k: v for k, v in expected.attrs.items() if k not in varying
    }
    expected.attrs = file.attrs
    xr.testing.assert_identical(file, expected)


@pytest.mark.slow
def test_on_a_cluster(whole, system, tmp_path) -> None:
    pytest.importorskip("distributed")
    there = sb.sweep(
        system, AXES, ASKED, checkpoint=sb.CheckpointOptions(tmp_path / "store", points_per_task=9), cluster="local:2"
    )
    xr.testing.assert_equal(there, whole)


def test_drawn_with_right_labels(system, tmp_path) -> None:
    """Words, symbol and unit of the table stand along the axes; whole numbers and words side by side."""
    levels = np.linspace(3e-4, 4.5e-4, 5)
    cases = {
        "level": (
            {"beam.buckling_level": levels, "velocity_amplitude": np.linspace(0.05, 0.5, 6)},
            "Height of the buckled beam at its centre\n$b$ (µm)", "Velocity amplitude $V$",
        ),
        "modes": (
            {"modes": [1, 2, 4], "frequency_ratio": np.linspace(0.5, 2.0, 6)},
            "Number of modes $N$", r"Excitation frequency $\\Omega$",
        ),
        "contact": (
            {"contact.stiffness": np.geomspace(1e7, 1e9, 4), "contact.side": ["below", "above"]},
            "Contact stiffness $k_c$ (N/m$^{1.5}$)", "Side that the striker pushes from",
        ),
    }  # fmt: skip
    for name, (axes, across, upward) in cases.items():
        ds = sb.sweep(system, axes, ASKED)
        ax = plot_response_map(ds)
        assert {ax.get_xlabel(), ax.get_ylabel()} == {across, upward.replace("\\\\", "\\")}, name
        if name == "modes":
            shown = ax.get_xticklabels() if ax.get_xlabel() == across else ax.get_yticklabels()
            assert [text.get_text() for text in shown] == ["1", "2", "4"]
        if name == "contact":
            assert "below" in {text.get_text() for text in (*ax.get_xticklabels(), *ax.get_yticklabels())}
        assert save_figure(ax.figure, tmp_path / f"{name}.png").stat().st_size > 10_000
        plt.close("all")


# ---------------------------------------------------------------------- one axis of every kind


SINGLE = {
    "beam.thickness": [3.5e-4, 4.5e-4],
    "beam.axial_load": [35.0, 40.0],
    "model.reference_frequency": [80.0, 90.0],
    "contact.stiffness": [1e7, 4e8],
    "contact.location": [0.25, 0.45],
    "contact.gap": [-1e-5, 0.0, 2e-5],
    "contact.side": ["below", "above"],
    "drive.phase": [0.0, 1.5],
    "drive.velocity_amplitude": [0.0, 0.3],
    "initial_state.amplitude[1]": [-1.0, 0.5],
    "initial_state.velocity[2]": [0.0, 0.3],
    "initial_state.striker_position": [-4e-4, -3.35e-4],
    "integration.cycles": [2, 5],
    "integration.accuracy": ["standard", "reference"],
    "integration.early_termination": [False, True],
    "integration.high_frequency_ratio": [1.5, 5.0],
}


@pytest.mark.parametrize("name", SINGLE)
def test_an_axis_over(name: str, system) -> None:
    ds = sb.sweep(system, {name: SINGLE[name]}, ASKED)
    (dim,) = ds.response_class.dims
    for i, value in enumerate(SINGLE[name]):
        if name.startswith("integration."):
            assert_point_is_run(ds.isel({dim: i}), system, ASKED.replace(**{name.removeprefix("integration."): value}))
        else:
            assert_point_is_run(ds.isel({dim: i}), system.replace(**{name: value}))


@pytest.mark.slow
def test_restitution(system) -> None:
    one = system.replace(**{"model.modes": 1}).replace(**{"contact.law": sb.Restitution(0.5)})
    ds = sb.sweep(one, {"restitution_coefficient": [0.0, 0.4, 0.9], "damping_ratio": [0.001, 0.01]}, ASKED)
    for i, j in itertools.product(range(3), range(2)):
        changed = one.replace(
            **{
                "contact.coefficient": ds.restitution_coefficient[i].item(),
                "model.damping_ratio": ds.damping_ratio[j].item(),
            }
        )
        assert_point_is_run(ds.isel(restitution_coefficient=i, damping_ratio=j), changed)


@pytest.mark.slow
def test_recorded_drives(system) -> None:
    t = np.arange(900) / 20_000.0
    record = sb.Striker(
        drive=sb.RecordedMotion(
            displacement=3e-5 * np.sin(600.0 * t),
            velocity=0.018 * np.cos(600.0 * t),
            sampling_frequency=20_000.0,
            frequency=95.0,
        )
    )
    shaken = system.replace(**{"contact.striker": record})
    ds = sb.sweep(shaken, {"location": [0.3, 0.5], "modes": [1, 2]}, sb.Integration())
    assert ds.attrs["cycles"] == pytest.approx(record.drive.duration * 95.0)
    for i, j in itertools.product(range(2), range(2)):
        changed = shaken.replace(**{"contact.location": ds.location[i].item(), "model.modes": ds.modes[j].item()})
        assert_point_is_run(ds.isel(location=i, modes=j), changed, sb.Integration())


def test_starts_of_a_free_beam(system) -> None:
    """From both wells and over the barrier: a point does not depend on those beside it."""
    free = sb.System(system.model)
    axes = {"initial_state.amplitude[1]": [-1.0, 0.2, 1.0], "initial_state.velocity[1]": [0.0, 0.7, 1.9]}
    ds = sb.sweep(free, axes, ASKED)
    for i, j in itertools.product(range(3), range(3)):
        begun = free.replace(**{name: values[k] for (name, values), k in zip(axes.items(), (i, j), strict=True)})
        assert_point_is_run(ds.isel(initial_state_amplitude_1=i, initial_state_velocity_1=j), begun)
    alone = sb.sweep(free, {name: values[1:] for name, values in axes.items()}, ASKED)
    for name in STATISTICS:
        np.testing.assert_array_equal(alone[name], ds[name][1:, 1:], err_msg=name)


def test_a_basin_of_attraction(system, tmp_path) -> None:
    """Starts of a struck beam as both axes of a picture: the well it ends in."""
    calm = system.replace(**{"drive.velocity_amplitude": 0.02, "model.damping_ratio": 0.05})
    axes = {
        "initial_state.amplitude[1]": np.linspace(-1.5, 1.5, 13), "initial_state.velocity[1]": np.linspace(-1.0, 1.0, 9),
        "initial_state.striker_position": [-5e-4],
    }  # fmt: skip
    ds = sb.sweep(calm, axes, sb.Integration(cycles=40))
    wells = ds.final_well.squeeze().values
    assert set(np.unique(wells)) == {-1, 1}
    at_rest = ds.sel(initial_state_velocity_1=0.0).squeeze()
    near = abs(abs(at_rest.initial_state_amplitude_1) - 1.0) < 0.3
    assert near.sum() == 6
    assert (at_rest.final_well[near] == np.sign(at_rest.initial_state_amplitude_1[near])).all(), "each in its own well"
    ax = plot_response_map(ds)
    assert "start" in ax.get_xlabel() and "start" in ax.get_ylabel()
    assert ax.get_xlim()[0] < -1.0, "negative amplitudes are shown"
    save_figure(ax.figure, tmp_path / "basin.png")
    plt.close("all")


# ---------------------------------------------------------------------- lists


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    rng = np.random.default_rng(4)
    return pd.DataFrame(
        {
            "frequency_ratio": rng.uniform(0.5, 3.0, 12),
            "modes": rng.choice([1, 3], 12),
            "beam.thickness": rng.choice([3.5e-4, 4e-4], 12),
            "location": rng.uniform(0.3, 0.6, 12),
            "who": [f"test {i}" for i in range(12)],
        }
    )


def test_a_list_point_for_point(table, system, tmp_path) -> None:
    """In any order, structures mixed: each point is its run; kept, resumed and exported like a grid."""
    ds = sb.sweep(system, table, ASKED)
    assert ds.response_class.dims == ("point",)
    assert ds.who.values.tolist() == table.who.tolist()
    for i in range(12):
        row = table.iloc[i]
        changed = system.replace(
            **{
                "drive.frequency_ratio": float(row.frequency_ratio), "model.modes": int(row.modes),
                "beam.thickness": float(row["beam.thickness"]), "contact.location": float(row.location),
            }
        )  # fmt: skip
        assert_point_is_run(ds.isel(point=i), changed)
        assert float(ds.reference_frequency[i]) == changed.model.reference_frequency
    assert not {"modes", "reference_frequency", "beam_thickness", "location", "frequency_ratio"} & ds.attrs.keys()
    turned = sb.sweep(system, table.iloc[::-1], ASKED)
    for name in STATISTICS:
        np.testing.assert_array_equal(turned[name][::-1], ds[name], err_msg=name)
    as_dataset = sb.sweep(system, xr.Dataset({str(n): ("test", table[n].to_numpy()) for n in table}), ASKED)
    for name in STATISTICS:
        np.testing.assert_array_equal(as_dataset[name], ds[name], err_msg=name)
    stored = sb.sweep(
        system,
        table,
        ASKED,
        checkpoint=sb.CheckpointOptions(tmp_path / "store", points_per_task=5),
        output=tmp_path / "list.nc",
    ).load()
    xr.testing.assert_equal(stored.drop_vars("who"), ds.drop_vars("who"))
    assert stored.who.values.tolist() == table.who.tolist()


def test_points_that_differ_in_structure_alone(system) -> None:
    """Nothing of scope run is named: the system's own striker strikes, twice alike where a point is repeated."""
    ds = sb.sweep(system, pd.DataFrame({"modes": [2, 1, 2]}), ASKED)
    for i, modes in enumerate((2, 1, 2)):
        assert_point_is_run(ds.isel(point=i), system.replace(**{"model.modes": modes}))
    free = sb.System(system.model, initial_state=sb.State(amplitude=0.5 * system.model.well_amplitude))
    ds = sb.sweep(free, {"damping_ratio": [0.001, 0.1]}, ASKED)
    for i, ratio in enumerate((0.001, 0.1)):
        assert_point_is_run(ds.isel(damping_ratio=i), free.replace(**{"model.damping_ratio": ratio}))


# ---------------------------------------------------------------------- refusals


@pytest.mark.parametrize(
    ("name", "values", "vary"),
    [
        ("contact.stiffness", [1e8, 1e12], True),
        ("frequency_ratio", [1.1, 1.3], False),
        ("damping_ratio", [0.005, 0.5], True),
    ],
)
def test_a_step_is_stated_only_where_all_points_have_it(name: str, values: list[float], vary: bool, system) -> None:
    """Those of a stiffer contact are shorter, whatever kind of parameter it is."""
    found = sb.sweep(system, {name: values}, sb.Integration(cycles=1)).attrs
    for each in ("step", "longest_contact_step", "shortest_contact_step"):
        assert (each not in found) == vary, each


def test_a_structure_that_is_none_is_refused_before_any_run(system, monkeypatch) -> None:
    from snapbeam.sweeps.setup import SweepSetup

    monkeypatch.setattr(SweepSetup, "integrate", None)
    loaded = system.replace(**{"beam.axial_load": 30.0})
    with pytest.raises(
        InputError, match=r"at beam\.thickness = 0\.0005: a run needs a buckled beam: axial_load = 30 N"
    ):
        sb.sweep(loaded, {"beam.thickness": [4e-4, 5e-4], "frequency_ratio": [1.0, 1.2]}, ASKED)
    with pytest.raises(InputError, match=r"initial_state\.amplitude\[2\]: mode = 2: must be an integer in \[1, 1\]"):
        sb.sweep(system, pd.DataFrame({"modes": [2, 1], "initial_state.amplitude[2]": [0.1, 0.1]}), ASKED)


def test_parameters_that_are_only_in_order_together(system) -> None:
    """A thicker beam under a greater load; each change by itself would leave no buckled beam."""
    loaded = system.replace(**{"beam.axial_load": 30.0})
    for points in (
        {"beam.thickness": [5e-4], "beam.axial_load": [60.0, 70.0]},
        pd.DataFrame({"beam.thickness": [4e-4, 5e-4], "beam.axial_load": [30.0, 70.0]}),
    ):
        ds = sb.sweep(loaded, points, ASKED)
        assert (ds.status == sb.RunStatus.OK).all()
        assert (ds.length_scale > 0.0).all()
        last = ds.isel({str(name): -1 for name in ds.response_class.dims})
        both = {"beam.thickness": 5e-4, "beam.axial_load": 70.0}
        assert_point_is_run(last, loaded.replace(**both))
        assert float(last.length_scale) == loaded.replace(**both).scale.length


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda s: sb.sweep(s.model, {"location": [0.3]}), InputTypeError, "must be a System"),
        (lambda s: sb.sweep(s, {"location": [0.3]}, 200), InputTypeError, "integration = 200: must be an Integration"),
        (
            lambda s: sb.sweep(s, {"location": [0.3]}, sb.Integration(tolerance=1e-3)),
            InputError,
            "tolerance = 0.001: applies to single runs; for a sweep give step",
        ),
        (
            lambda s: sb.sweep(s, {"restitution_coefficient": [0.1, 0.2]}),
            InputError,
            r"contact\.coefficient: is not a parameter of this system; its parameters are beam\.length",
        ),
        (
            lambda s: sb.sweep(sb.System(s.model, initial_state=sb.State(amplitude=[0.0, 0.0])), {"location": [0.3]}),
            InputError,
            r"contact\.location: is not a parameter of this system",
        ),
        (
            lambda s: sb.sweep(sb.System(s.model), {"modes": [1, 2]}),
            InputError,
            r"contacts = \[\]: .* needs an initial_state",
        ),
        (
            lambda s: sb.sweep(s, {"beam.buckling_level": [3e-4], "beam.axial_load": [30.0]}),
            InputError,
            "give exactly one of the two",
        ),
        (
            lambda s: sb.sweep(s, {"initial_state.amplitude[9]": [0.0]}),
            InputError,
            r"mode = 9: must be an integer in \[1, 2\]",
        ),
        (lambda s: sb.sweep(s, {"location": [0.3]}, replicates="many"), InputTypeError, "replicates = 'many'"),
        (lambda s: sb.sweep(s, {"location": [0.3]}, checkpoint=3), InputTypeError, "checkpoint = 3: must be a folder"),
        (lambda s: sb.sweep(s, {"location": [0.3]}, cluster="local:2"), InputError, "cluster: needs a checkpoint"),
        (lambda s: sb.sweep(s, {"location": [0.3]}, refine_levels=-1), InputError, "refine_levels = -1"),
        (lambda s: sb.sweep(s, {"location": [0.3]}, output="map.csv"), InputError, r"must end in \.nc"),
        (
            lambda s: sb.sweep(s, {"location": [0.3]}, progress=3),
            InputTypeError,
            "progress = 3: must be True or callable",
        ),
    ],
)
def test_refusals(call, error, message: str, system) -> None:
    with pytest.raises(error, match=message):
        call(system)
