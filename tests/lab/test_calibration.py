"""The beam from measured frequencies: the paper's case, hidden beams, what cannot be told."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snapbeam.lab.calibration import calibrate
from snapbeam.lab.plot.calibration import plot_calibration
from snapbeam.model.beam import Beam
from snapbeam.model.boundary_conditions import BoundaryConditions
from snapbeam.model.contact.hertz import HertzContact
from snapbeam.model.default_values import BEAM
from snapbeam.model.parameter_file import load_config
from snapbeam.model.reduced_model import ReducedModel
from snapbeam.uncertainty.measurements import ContactTest, Measurements, load_measurements
from snapbeam.util.validation import InputError

PAPER = Measurements(
    straight_frequencies=[80.0, 221.0],
    lower_well_frequencies=[81.3],
    upper_well_frequencies=[80.5],
    damping_ratio=[0.005],
    thickness=0.44e-3,
    buckling_level=0.5e-3,
)


def frequencies(beam: Beam, count: int = 2, modes: int = 12):
    return ReducedModel.from_beam(beam, modes).natural_frequencies[:count]


def measured(beam: Beam, rng: np.random.Generator | None = None, share: float = 0.003) -> Measurements:
    """Frequencies of a beam, with errors of a *share* of them where there is a generator."""
    values = {"straight_frequencies": frequencies(beam.replace(axial_load=0.0), 3)}
    values |= {"lower_well_frequencies": frequencies(beam), "upper_well_frequencies": frequencies(beam)}
    out = {}
    for name, freq in values.items():
        error = share * freq
        out[name] = freq + (error * rng.standard_normal(freq.size) if rng else 0.0)
        out[f"{name}_se"] = error
    return Measurements(**out)


def test_the_papers_numbers(tmp_path):
    found = calibrate(PAPER)
    assert found.values["thickness"] == pytest.approx(0.399e-3, abs=0.0005e-3)
    assert found.values["buckling_level"] == pytest.approx(0.331e-3, abs=0.0005e-3)
    assert 0.0008e-3 < found.standard_errors["buckling_level"] < 0.002e-3
    assert found.well_frequency == pytest.approx(80.9, abs=0.02)  # the mean of 81.3 and 80.5 Hz
    assert found.start_well_frequency == pytest.approx(81.853, abs=0.001)
    told = "\n".join(found.remarks)
    assert "0.335 mm" in told and "81.85 Hz" in told and "80.90 Hz" in told
    assert "0.44 mm measured (-9.4%)" in told and "0.5 mm measured (-33.8%)" in told
    assert any("unequal wells lie outside the symmetric model" in text for text in found.warnings)
    low, high = sorted(found.either_well)
    assert low < found.values["buckling_level"] < high
    assert found.damping_ratio == 0.005

    path = tmp_path / "beam.toml"
    found.write_config(path)
    config = load_config(path)
    assert config.model.beam is not None
    assert config.model.beam.buckling_level == pytest.approx(found.values["buckling_level"], rel=1e-12)
    assert np.all(np.asarray(config.model.damping_ratio) == 0.005) and config.model.modes == 32
    assert "unequal wells" in path.read_text(encoding="utf-8")


@pytest.mark.parametrize(("kind", "value"), [("midspan_amplitude", 1.2e-6), ("uniform_load", 11e-3)])
def test_two_wells_and_soft_ends_go_into_the_file(tmp_path, kind, value):
    """The file's own system has both measured frequencies; what was known of the ends is kept."""
    ends = BoundaryConditions(left_rotational_stiffness=40.0, right_rotational_stiffness=60.0)
    for beam in (BEAM, BEAM.replace(boundary=ends)):
        found = calibrate(PAPER, beam, modes=6, imperfection=kind)
        path = tmp_path / f"{kind}.toml"
        found.write_config(path)
        config = load_config(path)
        model = config.model
        assert model.well_frequencies[:, 0] == pytest.approx([81.3, 80.5], rel=1e-6)
        assert model.beam.boundary == beam.boundary
        assert abs(getattr(model.imperfection, kind)) == pytest.approx(value, rel=0.2)
        assert any(f"{kind} = " in text for text in found.remarks)
        assert ("[boundary]" in path.read_text(encoding="utf-8")) == (beam is not BEAM)
    one = dataclasses.replace(PAPER, upper_well_frequencies=())
    with pytest.raises(InputError, match="needs the first frequency about both wells; the upper one's"):
        calibrate(one, modes=4, imperfection=kind)


@pytest.mark.slow
@given(st.floats(0.2e-3, 1.0e-3), st.floats(0.4, 3.0), st.floats(0.1, 0.3), st.floats(0.8, 1.25), st.floats(0.8, 1.25))
@settings(max_examples=12, deadline=None, derandomize=True)
def test_a_hidden_beam_is_found_exactly_without_noise(thickness, level, length, off, away):
    hidden = Beam(
        length=length, thickness=thickness, width=15e-3, density=7800.0, young_modulus=200e9,
        buckling_level=level * thickness,
    )  # fmt: skip
    start = hidden.replace(thickness=off * thickness, buckling_level=away * level * thickness)
    found = calibrate(measured(hidden), start, modes=12)
    assert found.values["thickness"] == pytest.approx(hidden.thickness, rel=1e-6)
    assert found.values["buckling_level"] == pytest.approx(hidden.buckling_level, rel=1e-5)
    assert found.scatter == 1.0 and not found.undetermined


@pytest.mark.slow
def test_uncertainties_cover_hidden_beams():
    hidden = BEAM.replace(thickness=0.42e-3, buckling_level=0.4e-3)
    rng = np.random.default_rng(4)
    inside = []
    for _ in range(20):
        found = calibrate(measured(hidden, rng), modes=12)
        inside.append(
            [
                abs(found.values[name] - getattr(hidden, name)) < 2.0 * found.standard_errors[name]
                for name in ("thickness", "buckling_level")
            ]
        )
    assert (np.mean(inside, axis=0) >= 0.9).all()


@pytest.mark.parametrize(
    ("fit", "words"),
    [
        (("thickness", "young_modulus", "buckling_level"), "thickness, young_modulus and buckling_level"),
        (("young_modulus", "density"), "young_modulus and density"),
    ],
)
def test_what_data_cannot_tell_apart_is_said(fit, words):
    found = calibrate(PAPER, fit=fit, modes=12)
    assert found.undetermined == fit
    assert not found.standard_errors
    assert any(f"cannot tell {words} apart" in text for text in found.warnings)
    assert np.isfinite(list(found.values.values())).all()


def test_parameters_that_hardly_part_are_warned_of():
    """Length and thickness act alike but for the pull of b."""
    data = Measurements(straight_frequencies=[80.0], lower_well_frequencies=[81.0, 159.0], straight_frequencies_se=0.4)
    found = calibrate(data, fit=("thickness", "length", "buckling_level"), modes=12)
    assert found.undetermined or any("hardly" in text or "known to" in text for text in found.warnings)


def test_only_a_straight_beam_or_only_wells():
    straight = calibrate(Measurements(straight_frequencies=[80.0, 221.0]), modes=12)
    assert list(straight.values) == ["thickness"] and straight.well_frequency is None
    wells = calibrate(Measurements(lower_well_frequencies=[81.0]), modes=12)
    assert list(wells.values) == ["buckling_level"]
    assert any("nothing is left to check" in text for text in wells.warnings)
    nothing = calibrate(Measurements(damping_ratio=[0.004, 0.007], damping_ratio_se=[0.0002, 0.0002]))
    assert nothing.values == {} and nothing.damping_ratio == pytest.approx(0.0055)
    assert nothing.damping_ratio_se > 0.001  # their scatter, not their errors
    assert any("one for every mode" in text for text in nothing.warnings)


def test_contact_stiffness_from_collisions():
    """Two rigid bodies that collide by the contact law, integrated, give the stiffness back three ways."""
    contact, mass, speed = HertzContact(stiffness=4e8), 2e-3, 0.2
    step, depth, velocity, time, peak = 2e-8, 0.0, speed, 0.0, 0.0
    while depth >= 0.0:
        velocity -= step * 0.5 * contact.stiffness * depth**1.5 / mass
        depth += step * velocity
        force = contact.stiffness * max(depth, 0.0) ** 1.5
        velocity -= step * 0.5 * force / mass
        time, peak = time + step, max(peak, force)
    known = {"duration": time, "peak_force": peak, "effective_mass": mass}
    for left_out in known:
        pair = {name: value for name, value in known.items() if name != left_out}
        stiffness, error = ContactTest(closing_speed=speed, **pair).stiffness()
        assert stiffness == pytest.approx(4e8, rel=2e-3)
        assert 0.05 < error / stiffness < 0.15
    pair = ContactTest(closing_speed=speed, duration=time, peak_force=peak)
    found = calibrate(Measurements(contact=[pair, pair]), modes=4)
    assert found.contact_stiffness == pytest.approx(4e8, rel=2e-3)
    assert found.sections()["contact"]["stiffness"] == found.contact_stiffness


def test_a_file_of_measurements(tmp_path):
    path = tmp_path / "m.toml"
    path.write_text(
        "[measured]\nstraight_frequencies = [80.0, 221.0]\nstraight_frequencies_se = 0.4\nlower_well_frequencies = [81.3]\n"
        "[beam]\nlength = 0.161\n[[measured.contact]]\nclosing_speed = 0.1\nduration = 2e-4\n"
        "peak_force = 2.0\n",
        encoding="utf-8",
    )
    found, others = load_measurements(path)
    assert found.straight_frequencies == (80.0, 221.0) and found.straight_frequencies_se == (0.4, 0.4)
    assert others == {"beam": {"length": 0.161}} and found.contact[0].peak_force == 2.0
    for text, word in (
        ("[measured]\nstraigth_freq = [80.0]\n", "straigth_freq: unknown"),
        ("[measured]\nstraight_frequencies = ['80 Hz']\n", r"straight_frequencies\[0\]"),
        ("[measured]\nstraight_frequencies = [221.0, 80.0]\n", "must increase"),
        ("[measured]\nstraight_frequencies = [-80.0]\n", "greater than 0"),
        ("[measured]\nstraight_frequencies = [nan]\n", "finite"),
        (
            "[measured]\nstraight_frequencies = [80.0]\nstraight_frequencies_se = [1.0, 2.0]\n",
            "straight_frequencies_se",
        ),
        ("[measured]\ndamping_ratio = [5.0]\n", "damping_ratio"),
        ("[measured]\ncontact = 3\n", "list of tables"),
        ("[[measured.contact]]\nclosing_speed = 0.1\nduration = 1e-4\n", "two of"),
        ("[beam]\nlength = 0.161\n", r"no section \[measured\]"),
        ("measured = [", "no TOML"),
    ):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match=word) as caught:
            load_measurements(path)
        assert "m.toml" in str(caught.value)
    with pytest.raises(InputError, match="cannot be read"):
        load_measurements(tmp_path / "none.toml")


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: calibrate(PAPER, fit=("width",)), "fit"),
        (lambda: calibrate(PAPER, fit=("thickness", "thickness")), "different"),
        (lambda: calibrate(PAPER, fit="thickness"), "tuple"),
        (lambda: calibrate(PAPER, BEAM.replace(axial_load=0.0)), "straight"),
        (lambda: calibrate(Measurements(straight_frequencies=[80.0]), fit=("buckling_level",)), "about a well"),
        (lambda: calibrate(Measurements(damping_ratio=[0.01]), fit=("thickness",)), "no frequency"),
        (lambda: calibrate(PAPER, modes=1), "for a model of 1 modes"),
        (lambda: calibrate({"straight_frequencies": [80.0]}), "Measurements"),
    ],
)
def test_refusals(make, word):
    with pytest.raises(InputError, match=word):
        make()


def test_the_picture():
    import matplotlib.pyplot as plt

    figure = plot_calibration(calibrate(PAPER, modes=8))
    assert [ax.get_xlabel() for ax in figure.axes][1] == "Thickness (mm)"
    plt.close(figure)
