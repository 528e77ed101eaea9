"""A store grows along its axes: what it holds stays, only new points are run, and all is as if computed at once."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from small_map import setup_of, swept
from typer.testing import CliRunner

import snapbeam as sb
from snapbeam.cli.app import app
from snapbeam.sweeps.checkpoint.store import layers_of
from snapbeam.sweeps.compute import SweepReport
from snapbeam.sweeps.tasks import PointWork

LONGER = {
    "frequency_ratio": np.sort(np.append(np.linspace(0.4, 2.0, 5), [0.2, 1.0])),  # one before, one between
    "velocity_amplitude": np.append(np.linspace(0.05, 0.6, 4), [0.7, 0.8]),  # two after
}


def same(left, right):
    """Whether two maps hold the same numbers, bit for bit, over the same points."""
    assert left.sizes == right.sizes
    for name, item in right.data_vars.items():
        np.testing.assert_array_equal(left[name].values, item.values, err_msg=name)
    for name in right.coords:
        np.testing.assert_array_equal(left[name].values, right[name].values, err_msg=name)


def test_a_longer_map_takes_what_the_store_holds(tmp_path, small):
    path = tmp_path / "store"
    swept(**small, path=path, points_per_task=6)
    ledger = (path / "tasks.jsonl").read_bytes()
    data = {file: file.read_bytes() for file in (path / "runs.zarr" / "base").rglob("c.*")}
    report = SweepReport()
    grown = swept(**(small | LONGER), path=path, report=report)
    assert report.runs == 42 - 20, "only what the store had not was run"
    assert not report.damaged and not report.failed
    same(grown, swept(**(small | LONGER)))
    assert (path / "tasks.jsonl").read_bytes().startswith(ledger), "nothing of before was written again"
    assert {file: file.read_bytes() for file in data} == data
    same(sb.read_checkpoint(path), grown)

    again = SweepReport()
    same(swept(**(small | LONGER), path=path, report=again), grown)
    assert again.runs == 0

    wider = small | LONGER | {"velocity_amplitude": np.append(LONGER["velocity_amplitude"], 0.9)}
    once_more = SweepReport()
    third = swept(**wider, path=path, report=once_more)
    assert once_more.runs == 7
    same(third, swept(**wider))
    same(sb.read_checkpoint(path), third)


def test_layers_hold_each_point_once(small):
    chain = [small, small | {"frequency_ratio": LONGER["frequency_ratio"]}, small | LONGER]
    works = [PointWork(setup_of(**each)) for each in chain]
    earlier = [{"points": work.setup.points.describe(), "axes": list(work.setup.points.names)} for work in works[:-1]]
    layers = layers_of(works[-1], earlier, 6)
    assert [layer.stage.name for layer in layers] == ["base", "more-1", "more-2"]
    places = np.concatenate([layer.places for layer in layers])
    np.testing.assert_array_equal(np.sort(places), np.arange(42))
    grid = works[-1].setup.points
    for layer in layers:
        held, now = layer.stage.points.take(np.arange(layer.stage.points.size)), grid.take(layer.places)
        which = np.arange(layer.stage.size) if layer.stage.which is None else layer.stage.which
        for name, values in now.items():
            np.testing.assert_array_equal(held[name][which], values)


def test_a_map_that_is_stopped_while_it_grows_goes_on(tmp_path, small):
    path = tmp_path / "store"
    swept(**small, path=path, points_per_task=6)

    def stop(done, total):
        if done > 6:  # the first task is kept by then
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        swept(**(small | LONGER), path=path, progress=stop)
    half = sb.read_checkpoint(path)
    assert 20 < half.attrs["points_done"] < 42 and half.attrs["points_total"] == 42
    report = SweepReport()
    same(swept(**(small | LONGER), path=path, report=report), swept(**(small | LONGER)))
    assert 0 < report.runs < 22


@pytest.mark.parametrize("layer", ["base", "more-1"])
def test_damage_in_any_layer_is_found_and_repaired(tmp_path, small, layer):
    path = tmp_path / "store"
    swept(**small, path=path, points_per_task=6)
    grown = swept(**(small | LONGER), path=path)
    file = sorted((path / "runs.zarr" / layer / "numbers").rglob("c.*"))[1]
    held = bytearray(file.read_bytes())
    held[len(held) // 2] ^= 0x10
    file.write_bytes(bytes(held))
    report = SweepReport()
    same(swept(**(small | LONGER), path=path, check_checkpoint=True, report=report), grown)
    assert [stage for stage, _ in report.damaged] == [layer]


def test_values_that_rounding_alone_tells_apart_are_those_of_the_store(tmp_path, small):
    path, told, report = tmp_path / "store", [], SweepReport()
    first = small | {"velocity_amplitude": np.linspace(0.1, 0.3, 3)}
    swept(**first, path=path)
    asked = np.linspace(0.1, 0.5, 5)
    assert (asked[:3] != first["velocity_amplitude"]).any(), "else this tries nothing"
    grown = swept(**(small | {"velocity_amplitude": asked}), path=path, note=told.append, report=report)
    assert report.runs == 10
    assert any("differ from those of the checkpoint only by rounding" in words for words in told)
    np.testing.assert_array_equal(grown["velocity_amplitude"][:3], first["velocity_amplitude"])
    exact = np.append(first["velocity_amplitude"], asked[3:])
    same(grown, swept(**(small | {"velocity_amplitude": exact})))


def test_axes_in_another_order_and_of_other_structures_grow_too(tmp_path, model, contact):
    system = sb.System(model, contacts=[sb.Contact(contact, sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.3))])
    short = {"velocity_amplitude": [0.1, 0.4], "modes": [1, 3]}
    longer = {"modes": [1, 2, 3], "velocity_amplitude": [0.1, 0.25, 0.4]}
    how = sb.Integration(cycles=3)
    sb.sweep(system, short, how, checkpoint=tmp_path / "store")
    grown = sb.sweep(system, longer, how, checkpoint=tmp_path / "store")
    assert grown["response_class"].dims == ("modes", "velocity_amplitude")
    same(grown, sb.sweep(system, longer, how))
    same(sb.read_checkpoint(tmp_path / "store"), grown)


def test_repeats_of_a_point_do_not_depend_on_where_it_stands(tmp_path, small):
    few = small | {"replicates": sb.Replicates(2, perturbation_rms=1e-4)}
    swept(**few, path=tmp_path / "store")
    grown = swept(**(few | LONGER), path=tmp_path / "store")
    same(grown, swept(**(few | LONGER)))


def test_what_cannot_grow_is_refused_with_what_to_do(tmp_path, small):
    path = tmp_path / "store"
    swept(**small, path=path)
    before = {file: file.read_bytes() for file in path.rglob("*") if file.is_file()}
    with pytest.raises(
        sb.InputError,
        match=r"cannot be continued.*Request the 3 cycles of the checkpoint, or give another folder for 6",
    ):
        swept(**(small | {"cycles": 6}), path=path)
    with pytest.raises(
        sb.InputError, match=r"2 of its 4 values of drive.velocity_amplitude are not among the requested values"
    ):
        swept(**(small | {"velocity_amplitude": np.array([0.05, 0.1, 0.6])}), path=path)
    with pytest.raises(sb.InputError, match="location"):
        swept(**(small | LONGER | {"location": np.array([0.3, 0.4])}), path=path)
    with pytest.raises(sb.InputError, match="contains a sweep with other parameters"):
        swept(**(small | LONGER), path=path, check_checkpoint=True)
    assert {file: file.read_bytes() for file in path.rglob("*") if file.is_file()} == before

    refined = tmp_path / "refined"
    swept(**small, path=refined, refine_levels=1)
    with pytest.raises(sb.InputError, match="contains a refined sweep"):
        swept(**(small | LONGER), path=refined)


def test_a_map_that_has_grown_is_refined_as_any_other(tmp_path, small):
    path = tmp_path / "store"
    swept(**small, path=path)
    wide = small | {"velocity_amplitude": np.linspace(0.05, 0.6, 7)}
    swept(**wide, path=path)
    same(swept(**wide, path=path, refine_levels=1), swept(**wide, refine_levels=1))


@pytest.mark.slow
def test_the_command_grows_a_store_by_its_name_and_an_axis(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    common = ["--modes", "1", "--cycles", "3", "--frequency-ratio", "0.6:1.4:5"]
    runner = CliRunner()

    def run(*arguments):
        done = runner.invoke(app, ["map", *arguments], env={"COLUMNS": "300"})
        assert done.exit_code == 0, done.output
        return done.output

    run(*common, "--velocity-amplitude", "0.1:0.3:3", "--checkpoint", "s.map", "-o", "a.nc")
    said = run("--velocity-amplitude", "0.1:0.5:5", "--checkpoint", "s.map", "-o", "b.nc")
    assert "10 runs" in said or "10 of" in said or "10 remain" in said, said
    run(*common, "--velocity-amplitude", "0.1,0.2,0.3,0.4,0.5", "-o", "fresh.nc")  # 0.1:0.5:5 gives 0.3 + 4e-17
    with xr.open_dataset("b.nc") as grown, xr.open_dataset("fresh.nc") as fresh:
        for name in fresh.data_vars:
            np.testing.assert_array_equal(grown[name].values, fresh[name].values, err_msg=name)
    resumed = run("--checkpoint", "s.map", "-o", "c.nc")  # by its name alone: as it is now
    with xr.open_dataset("c.nc") as again:
        assert again.sizes["velocity_amplitude"] == 5, resumed
    refused = runner.invoke(
        app, ["map", "--checkpoint", "s.map", "--cycles", "6", "-o", "d.nc"], env={"COLUMNS": "300"}
    )
    assert refused.exit_code == 2 and "cannot be continued" in refused.output
