"""Systems of any parts: axes, fields, views and statistics follow from what they have."""

from __future__ import annotations

import numpy as np
import pytest

import snapbeam as sb
from snapbeam import RunStatus
from snapbeam.explorer.maps import NOT_COMPUTED, compared, opened
from snapbeam.model.parameter_file import config_from_mapping

BEAM = {
    "length": 0.3, "thickness": 0.4e-3, "width": 20e-3, "density": 7850.0, "young_modulus": 200e9, "buckling_level": 0.7e-3,
}  # fmt: skip
PIEZO = {"type": "piezo", "moment_per_volt": -1.66e-4, "capacitance": 7.665e-7, "resistance": 1e4, "patch_end": 0.25}
ONE_MODE = {"model": {"modes": 1, "damping_ratio": 0.02}}
FILES = {
    "harvester": ONE_MODE | {
        "beam": BEAM, "harvester": PIEZO,
        "base_excitation": {"type": "acceleration_sine", "frequency_hz": 35.0, "amplitude_g": 1.0},
    },
    "two strikers": {
        "extends": "paper", "model": {"modes": 1}, "contact": [{}, {"location": 0.3, "gap": 2e-5, "side": "above"}],
    },
    "external force": {"beam": BEAM} | ONE_MODE | {
        "force": {"type": "harmonic_force", "frequency_ratio": 0.5, "amplitude": 0.05, "location": 0.4}
    },
    "noise": {"beam": BEAM} | ONE_MODE | {"axial_load": {"type": "noise_force", "low_ratio": 0.4, "high_ratio": 4.0, "rms": 2.0}},
    "burst": {"beam": BEAM} | ONE_MODE | {
        "force": {"type": "burst_force", "frequency_ratio": 0.9, "amplitude": 0.1, "duration_cycles": 6, "location": 0.4}
    },
    "sum": {"beam": BEAM} | ONE_MODE | {
        "axial_load": {
            "type": "harmonic_force+ramp_force", "frequency_ratio_1": 2.0, "amplitude_1": 0.5, "change_2": 1.0, "duration_2": 0.1,
        }
    },
    "axial load": {"beam": BEAM} | ONE_MODE | {"axial_load": {"type": "harmonic_force", "frequency_ratio": 2.0, "amplitude": 0.1}},
}  # fmt: skip
HOW = sb.Integration(cycles=5)


def system_of(name):
    """System of one of the files."""
    return config_from_mapping(FILES[name]).system


@pytest.mark.parametrize(
    ("name", "axes"),
    [
        ("harvester", ["base_excitation.frequency_ratio", "base_excitation.acceleration_amplitude"]),
        ("two strikers", ["drive.frequency_ratio", "drive.velocity_amplitude"]),
        ("external force", ["force.frequency_ratio", "force.amplitude"]),
        ("axial load", ["axial_load.frequency_ratio", "axial_load.amplitude"]),
        ("noise", ["axial_load.rms", "axial_load.high_ratio"]),
        ("burst", ["force.frequency_ratio", "force.amplitude"]),
        ("sum", ["axial_load.frequency_ratio_1", "axial_load.amplitude_1"]),
    ],
)
@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning", "ignore::snapbeam.DiagnosticWarning")
def test_any_system_opens_with_its_axes_fields_and_views(name, axes):
    pytest.importorskip("panel")
    from snapbeam.explorer.jobs import Token
    from snapbeam.explorer.page import Page, answer
    from snapbeam.explorer.shared import Shared

    shared = Shared(opened(system_of(name), integration=HOW))
    try:
        page = Page(shared, {})
        assert list(page.card.plane.names) == axes == list(page.fields)
        own = {name: shared.system.parameters[name] for name in axes}
        assert page.points[0].values == own, "opens with its own run"
        assert [float(field.value) for field in page.fields.values()] == pytest.approx(list(own.values()), rel=1e-5)
        middle = [float(np.mean(axis.span)) for axis in (page.card.plane.x, page.card.plane.y)]
        found = answer(page.card, page.card.point(*middle), page.card.system, HOW, Token())
        assert found.same and found.run.summary.status is RunStatus.OK
        for part in page.runs[0].parts:
            part.activate()
            part.show(found.run, 0.0, 5.0)
        waveform, energy, beam = (page.runs[0].parts[at] for at in (0, 4, 6))
        data, strikers = found.run.dataset, len(shared.system.contacts)
        assert len(waveform.further[0].data["x"]) == max(strikers - 1, 0)
        assert len(beam.meta.data["at"][0]) == strikers
        assert "energy balance" in energy.words.object
        if name == "harvester":
            below = list(waveform.below.options.values())
            assert below[:2] == ["voltage", "power_load"]
            assert max(waveform.force.data["y"]) == pytest.approx(float(data["voltage"].max()), rel=1e-6)
        if name == "two strikers":
            assert waveform.below.value == "striker_forces" and len(waveform.further[1].data["x"]) == 1
        sections = {field.partition(".")[0] for field in page.system_card().fields}
        assert {each.partition(".")[0] for each in axes} <= sections
        assert ("contact" in sections) == bool(strikers)
    finally:
        shared.close()


def test_a_map_of_a_harvester_equals_its_runs():
    system, axes = system_of("harvester"), {"harvester.resistance": np.geomspace(1e3, 1e6, 4)}
    for cycles in (5, 7):
        how = sb.Integration(cycles=cycles)
        found = sb.sweep(system, {"base_excitation.frequency_hz": np.linspace(20.0, 50.0, 4)} | axes, how)
        ratio = found["base_excitation_frequency_ratio"].values
        for at, frequency in enumerate(ratio):
            for column, resistance in enumerate(axes["harvester.resistance"]):
                own = system.replace(**{
                    "base_excitation.frequency_ratio": frequency, "harvester.resistance": resistance
                })  # fmt: skip
                held = {str(each): found[each].values[at, column] for each in found.data_vars}
                assert compared(held, sb.simulate(own, how).summary, "native")[1].startswith("bitwise identical")


def test_a_cell_that_is_not_computed_says_so():
    summary = sb.simulate(system_of("two strikers"), HOW).summary
    held = {"response_class": -1, "status": int(RunStatus.NOT_RUN), "peak_force": np.nan}
    assert compared(held, summary, "native") == (True, NOT_COMPUTED)


def test_a_system_without_two_parameters_is_refused():
    still = config_from_mapping({"beam": BEAM} | ONE_MODE).system
    with pytest.raises(sb.InputError, match="no two parameters"):
        opened(still)


def test_cells_of_an_unfinished_checkpoint_say_that_they_are_not_computed(tmp_path):
    pytest.importorskip("zarr")
    system, done = system_of("two strikers"), []
    axes = {"drive.frequency_ratio": np.linspace(0.8, 1.6, 12), "drive.velocity_amplitude": np.linspace(0.1, 0.3, 12)}

    def stop_early(*report):
        done.append(report)
        if len(done) > 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sb.sweep(system, axes, HOW, checkpoint=tmp_path / "half.map", progress=stop_early)
    source = opened(tmp_path / "half.map")
    status = source.variable("status").values
    assert (status == RunStatus.NOT_RUN).any()
    summary = sb.simulate(system, HOW).summary
    for at in np.argwhere(status == RunStatus.NOT_RUN)[:3]:
        held = source.point(dict(zip(source.dims, at.tolist(), strict=True)))
        assert compared(held, summary, "native") == (True, NOT_COMPUTED)
