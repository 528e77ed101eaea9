"""The well that runs begin in: named by the user or by the first contact, and told."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import tomli_w

import snapbeam as sb
from snapbeam.model.parameter_file import Config, config_from_mapping, load_config
from snapbeam.simulation.simulate import attributes_of
from snapbeam.solver.step_size import Plan

BEAM = sb.Beam(length=0.041, thickness=2.6e-4, width=4e-3, density=2.7e3, young_modulus=6.9e10, buckling_level=3.1e-4)
MODEL = sb.ReducedModel.from_beam(BEAM, modes=3, damping_ratio=0.02)
BASE = sb.BaseExcitation(motion=sb.AccelerationSine(frequency_ratio=0.7, acceleration_amplitude=0.05))
UNEVEN = sb.ReducedModel.from_beam(
    BEAM, modes=3, damping_ratio=0.02, imperfection=sb.Imperfection(midspan_amplitude=6e-6)
)


def stopped(side, model=MODEL, **more):
    stop = sb.Striker(drive=sb.FixedStop(), location=0.4, side=side, gap=2e-5)
    return sb.System(model, contacts=[sb.Contact(sb.HertzContact(1e8), stop)], base_excitation=BASE, **more)


@pytest.mark.parametrize(("side", "well"), [*itertools.product(("below", "above"), ("lower", "upper", 0, 1))])
def test_well_is_the_named_one_whatever_the_stop(side, well):
    system = stopped(side, initial_well=well)
    number = well if isinstance(well, int) else ("lower", "upper").index(well)
    assert system.start_state.amplitude.tolist() == system.potential.wells[number].amplitude.tolist()
    assert system.start_well == ("lower", "upper")[number]
    assert repr(well) in system.initial_well_text
    assert system.rest_state.amplitude.tolist() == stopped(side).rest_state.amplitude.tolist()  # of the gap
    assert sb.System.from_mapping(system.to_mapping()) == system != stopped(side)


def test_reason_is_told_where_no_well_is_named():
    assert stopped("below").initial_well_text == "lower well (contact on side 'below')"
    assert stopped("above").initial_well_text == "upper well (contact on side 'above')"
    assert stopped("below", UNEVEN).start_well == "lower"
    free = sb.System(UNEVEN, base_excitation=BASE)
    assert free.initial_well_text == "upper well (as fabricated)"
    assert sb.System(MODEL, base_excitation=BASE).initial_well_text == "lower well (default)"


def test_start_follows_the_well_when_the_structure_changes():
    system = stopped("below", UNEVEN, initial_well="upper")
    thicker = system.replace(**{"beam.buckling_level": 4.4e-4})
    assert thicker.start_state.amplitude.tolist() == thicker.potential.wells[1].amplitude.tolist()
    pushed = system.replace(**{"initial_state.velocity[2]": 0.3})
    assert pushed.initial_well is None
    assert pushed.initial_state.amplitude.tolist() == system.start_state.amplitude.tolist()
    back = pushed.replace(initial_well="lower")
    assert back.initial_state is None
    assert back.start_well == "lower"
    assert pushed.replace(**{"initial_state.initial_well": 0}) == back.replace(initial_well=0)


@pytest.mark.parametrize("well", ["middle", "Upper", -1, 1.0, True, 2, "2"])
def test_other_wells_are_refused_by_name(well):
    with pytest.raises(sb.InputError, match=r"initial_well = .*(lower|1)"):
        stopped("below", initial_well=well).start_state  # noqa: B018


def test_one_well_has_no_lower_and_upper():
    load = BEAM.replace(buckling_level=2e-5)
    single = sb.ReducedModel.from_beam(load, modes=3, imperfection=sb.Imperfection(point_load=0.5))
    assert not single.is_bistable
    with pytest.raises(sb.InputError, match=r"initial_well = 'upper': the system has 1 well; must be 0"):
        sb.System(single, base_excitation=BASE, initial_well="upper").start_state  # noqa: B018
    assert sb.System(single, base_excitation=BASE, initial_well=0).start_well == "only"


def test_both_starts_are_refused():
    start = sb.State(amplitude=MODEL.well_amplitude)
    with pytest.raises(sb.InputError, match="initial_well, initial_state: give one of the two"):
        stopped("below", initial_state=start, initial_well="lower")


def test_states_and_poles_take_a_well():
    system = sb.System(UNEVEN, base_excitation=BASE)
    lower, upper = system.potential.wells
    assert sb.State(amplitude=upper).amplitude.tolist() == upper.amplitude.tolist()
    for name, well in (("lower", lower), ("upper", upper), (0, lower), (1, upper)):
        assert np.array_equal(system.poles(name), system.poles(well))
    assert not np.allclose(abs(system.poles("lower")), abs(system.poles("upper")), rtol=1e-6)
    assert np.array_equal(system.poles(), system.poles("upper"))  # as fabricated
    with pytest.raises(sb.InputError, match=r"3: the system has 2 wells"):
        system.poles(3)


def test_parameter_file_names_the_well(tmp_path):
    sections = {
        "extends": "paper",
        "model": {"modes": 2},
        "contact": {"gap": 1e-5},
        "base_excitation": {"type": "acceleration_sine", "frequency_ratio": 0.9, "acceleration_amplitude": 0.1},
        "initial_state": {"initial_well": "upper", "velocity[1]": 0.04},
    }  # fmt: skip
    file = tmp_path / "stop.toml"
    file.write_text(tomli_w.dumps(sections))
    config = load_config(file)
    system = config.system
    assert system.start_well == "upper"
    assert system.initial_state.velocity[0] != 0.0
    assert config_from_mapping(config.whole().to_mapping()).system == system
    del sections["initial_state"]["velocity[1]"]
    for well in ("upper", 1, "1"):
        sections["initial_state"]["initial_well"] = well
        named = config_from_mapping(sections).system
        assert named.start_well == "upper"
        named.save(tmp_path / "saved.toml")
        assert sb.System.load(tmp_path / "saved.toml") == named
    with pytest.raises(sb.InputError, match=r"\[initial_state\] initial_well = 'top': must be 'lower', 'upper'"):
        Config({}), config_from_mapping({"initial_state": {"initial_well": "top"}})


def test_every_result_names_the_well():
    plan = Plan(order=4, step=1e-6, contact=5e-7, halvings=1)
    for well in ("lower", "upper"):
        system = stopped("below", initial_well=well)
        attrs = attributes_of("", system, sb.Integration(), plan, {})
        assert attrs["initial_well"] == well
        assert attrs["initial_well_reason"] == f"initial_well = {well!r}"


def test_a_stop_that_a_run_begins_inside_of_is_told() -> None:
    """The gap of the stop below is that to the upper well, from which the first stop pushes away; the run begins in the other."""
    beam = sb.Beam(length=0.2, thickness=5e-4, width=0.01, density=7850.0, young_modulus=2e11, buckling_level=4e-4)
    law = sb.KelvinVoigt(linear_stiffness=2e4, linear_damping=0.5)
    stops = [
        sb.Contact(law, sb.Striker(drive=sb.FixedStop(), side=side, gap=gap, location=0.5))
        for side, gap in (("above", 1e-3), ("below", 5e-4))
    ]
    system = sb.System(sb.ReducedModel.from_beam(beam, modes=1), contacts=stops, initial_well="lower")
    (found,) = (each for each in system.diagnostics() if each.code == "begins-inside")
    assert found.numbers["depth"] == pytest.approx(2 * 4e-4 - 5e-4) and "contact.2" in found.message
    assert not any(each.code == "begins-inside" for each in system.replace(initial_well=None).diagnostics())
