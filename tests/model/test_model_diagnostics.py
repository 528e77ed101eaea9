"""What is doubtful about a system: found once, said once, with the figures."""

from __future__ import annotations

import dataclasses
import warnings

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.solver.assemble import plans_of, run_columns
from snapbeam.util import diagnostics

SHAKER = sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.1)


@pytest.fixture(autouse=True)
def nothing_told(monkeypatch):
    monkeypatch.setattr(diagnostics, "_told", set())


def system(beam: sb.Beam = default_values.BEAM, modes: int = 1, **drive) -> sb.System:
    model = sb.ReducedModel.from_beam(beam, modes)
    given = {"frequency_ratio": 1.2, "velocity_amplitude": 0.1} | drive
    return sb.System(model, contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(**given))])


def codes(of: sb.System) -> list[str]:
    return [diagnostic.code for diagnostic in of.diagnostics()]


def deep(level: float) -> sb.Beam:
    """Buckled by *level* radii of gyration."""
    return default_values.BEAM.replace(buckling_level=level * default_values.BEAM.radius_of_gyration)


def test_the_papers_own_system_is_beyond_doubt() -> None:
    for modes in (1, 32):
        assert codes(system(modes=modes)) == []


@pytest.mark.parametrize(
    ("record", "drifts"),
    [
        ("sine", False),
        ("sine with an offset", True),
        ("noise with an offset", True),
        ("noise", False),
        ("half-sine shock", False),
        ("constant", True),
    ],
)
def test_an_offset_of_a_recorded_acceleration_is_told(record: str, drifts: bool) -> None:
    times = np.arange(20_001) / 1e4
    noise = np.random.default_rng(1).normal(size=times.size)
    noise -= np.polynomial.Polynomial.fit(times, noise, 1)(times)
    pulse = np.where(times < 0.005, 50.0 * np.sin(np.pi * times / 0.005), 0.0)
    sine = 0.3 * np.sin(2.0 * np.pi * 80.3 * times)
    acceleration = {
        "sine": sine,
        "sine with an offset": sine + 0.01,
        "noise with an offset": 0.01 * noise - 0.01,
        "noise": 1e-3 * noise,
        "half-sine shock": pulse,
        "constant": np.full(times.size, 0.01),
    }[record]
    model = sb.ReducedModel.from_beam(default_values.BEAM, 1)
    motion = sb.RecordedAcceleration.from_g(acceleration, 1e4)
    shaken = sb.System(model, base_excitation=sb.BaseExcitation(motion=motion))
    found = [each for each in shaken.diagnostics() if each.code == "drifting-record"]
    assert len(found) == drifts
    if drifts:
        offset = np.median(motion.record)
        assert found[0].numbers["drift"] == pytest.approx(abs(offset) * 2.0**2 / 8.0, rel=0.2)
        # the way out that the message gives
        mended = dataclasses.replace(motion, record=motion.record - offset)
        mended = sb.System(model, base_excitation=sb.BaseExcitation(motion=mended))
        assert "drifting-record" not in codes(mended)


@pytest.mark.parametrize(
    ("changes", "code", "words"),
    [
        ({"density": 7.8}, "implausible-size", r"beam\.density = 7\.8 kg/m\^3.*is it given in g/cm\^3\?"),
        ({"length": 161.0}, "implausible-size", r"beam\.length = 161 m.*is it given in mm\?"),
        ({"young_modulus": 200.0}, "implausible-size", r"young_modulus = 200 Pa.*is it given in GPa\?"),
        ({"width": 0.2}, "implausible-size", r"width = 0\.2 m is not less than beam\.length = 0\.161 m"),
        ({"buckling_level": 0.03}, "not-shallow", "slope of 0.59: the model takes the displacement as small"),
        ({"thickness": 0.03, "buckling_level": 1e-3}, "not-slender", "thickness is 0.19 of the length"),
    ],
)
def test_beams(changes, code: str, words: str) -> None:
    import re

    found = {diagnostic.code: diagnostic for diagnostic in system(default_values.BEAM.replace(**changes)).diagnostics()}
    assert re.search(words, found[code].message), found[code].message


def test_a_first_mode_that_a_striker_at_the_centre_cannot_excite() -> None:
    """Above b/r = 6.21 the lowest mode about a well is antisymmetric."""
    assert "first-mode-antisymmetric" not in codes(system(deep(6.20), modes=32))
    assert "first-mode-antisymmetric" in codes(system(deep(6.22), modes=32))
    (found,) = [f for f in system(deep(6.3), modes=4).diagnostics() if f.code == "first-mode-antisymmetric"]
    model = sb.ReducedModel.from_beam(deep(6.3), 4)
    assert found.numbers["symmetric_frequencies"] == pytest.approx(
        float(model.natural_frequencies[model.parity > 0][0])
    )
    assert found.numbers["symmetric_frequencies"] > model.reference_frequency
    assert "set model.reference_frequency" in found.message
    # what it advises settles it
    advised = system(deep(6.3), modes=4).replace(
        **{"model.reference_frequency": found.numbers["symmetric_frequencies"]}
    )
    assert codes(advised) == []
    # one mode is the symmetric one
    assert codes(system(deep(6.3), modes=1)) == []


def test_drives_that_look_like_another_unit() -> None:
    assert codes(system(frequency_ratio=100.0)) == ["ratio-like-hertz"]
    assert "is it given in Hz?" in system(frequency_ratio=100.0).diagnostics()[0].message
    assert codes(system(velocity_amplitude=31.0)) == ["amplitude-like-speed"]
    assert codes(system(frequency_ratio=19.9, velocity_amplitude=19.9)) == []


def told(call) -> list[str]:
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        call()
    return [str(each.message) for each in seen if issubclass(each.category, sb.DiagnosticWarning)]


def test_told_once_and_where_the_caller_stands() -> None:
    odd = system(default_values.BEAM.replace(density=7.8))
    asked = sb.Integration(cycles=1)

    def run() -> None:
        sb.simulate(odd, asked, sample_times=[0.0])

    with pytest.warns(sb.DiagnosticWarning, match=r"beam\.density = 7\.8") as seen:
        run()
    assert [str(each.message) for each in seen] == [odd.diagnostics()[0].message]
    assert seen[0].filename == __file__
    assert told(run) == []
    assert told(lambda: sb.sweep(odd, {"frequency_ratio": [1.0, 1.1]}, asked)) == []
    other = odd.replace(**{"beam.density": 7.7})
    assert len(told(lambda: sb.sweep(other, {"frequency_ratio": [1.0, 1.1]}, asked))) == 1
    assert told(lambda: sb.simulate(other, asked, sample_times=[0.0])) == []


def test_axes_are_doubted_too() -> None:
    """A sweep of frequencies given in Hz, and of a level at whose end the first mode is antisymmetric."""
    asked = sb.Integration(cycles=1)
    said = told(lambda: sb.sweep(system(), {"frequency_ratio": [50.0, 100.0]}, asked))
    assert len(said) == 2 and all("is it given in Hz?" in each for each in said)
    levels = default_values.BEAM.radius_of_gyration * np.array([3.0, 6.3])
    said = told(lambda: sb.sweep(system(modes=2), {"beam.buckling_level": levels}, asked))
    assert len(said) == 1 and "antisymmetric" in said[0]


def test_a_coupling_that_no_material_has_is_doubted():
    """Layers of PZT on the paper's beam are in order; the same capacitance with forty times their moment is not."""
    beam = default_values.BEAM
    layers = sb.PiezoelectricHarvester.from_material(
        stress_constant=-16.6, permittivity=25.55e-9, layer_thickness=0.2e-3, layer_width=15e-3, beam=beam,
        resistance=1e4,
    )  # fmt: skip

    def codes(harvester):
        system = sb.System(
            sb.ReducedModel.from_beam(beam, 2),
            harvesters=[harvester],
            base_excitation=sb.BaseExcitation(motion=sb.Sine(frequency_ratio=1.0, velocity_amplitude=0.1)),
        )
        return {each.code: each for each in system.diagnostics()}

    assert "unphysical-coupling" not in codes(layers)
    strong = dataclasses.replace(layers, moment_per_volt=40.0 * layers.moment_per_volt)
    doubt = codes(strong)["unphysical-coupling"]
    most = doubt.numbers["greatest_moment_per_volt"]
    assert "unphysical-coupling" in codes(dataclasses.replace(layers, moment_per_volt=1.001 * most))
    assert "unphysical-coupling" not in codes(dataclasses.replace(layers, moment_per_volt=0.999 * most))
    assert doubt.numbers["coupling"] == pytest.approx(
        strong.moment_per_volt**2 * 0.25 * beam.length / (strong.capacitance * beam.bending_stiffness)
    )


def test_a_circuit_does_not_shorten_the_steps():
    """Time constants of 3e-7 s, a 600th of the beam's step, and of 3e-3 s."""
    beam = default_values.BEAM

    def steps(resistance):
        layers = sb.PiezoelectricHarvester.from_material(
            stress_constant=-16.6, permittivity=25.55e-9, layer_thickness=0.1e-3, layer_width=beam.width, beam=beam,
            resistance=resistance, patch_end=0.25, wiring="parallel",
        )  # fmt: skip
        contacts = [sb.Contact(default_values.CONTACT, SHAKER)]
        struck = sb.System(sb.ReducedModel.from_beam(beam, 4), contacts=contacts, harvesters=[layers])
        return plans_of(struck, sb.Integration(cycles=1), run_columns(struck, {}))[0].step

    assert steps(1e4) == steps(1.0)
