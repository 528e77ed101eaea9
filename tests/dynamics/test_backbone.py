"""Backbone curves: elliptic integrals, harmonic balance, energy, a stop, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.special import ellipk

import snapbeam as sb
from snapbeam.dynamics.backbone import _vanishing
from snapbeam.model import default_values
from snapbeam.util.validation import InputError

ONE = sb.ReducedModel.from_beam(default_values.BEAM, modes=1)
TWO = sb.ReducedModel.from_beam(default_values.BEAM, modes=2)
THREE = sb.ReducedModel.from_beam(default_values.BEAM, modes=3)


def farthest(curve) -> np.ndarray:
    """Greatest amplitude of the one buckling mode, m^0.5."""
    height = np.maximum(np.abs(curve.min_midspan), np.abs(curve.max_midspan)).values
    return height * ONE.length_scale / abs(ONE.midspan_shape[0])


@pytest.mark.slow
def test_one_mode_about_a_well_is_an_elliptic_integral() -> None:
    curve = sb.dynamics.backbone_curve(sb.System(ONE), lowest_frequency_ratio=0.4)
    assert curve.attrs["end"] == "lowest_frequency_ratio"
    mass, g, square = ONE.mass[0, 0], ONE.nonlinear_stiffness, -ONE.stiffness[0] / ONE.nonlinear_stiffness
    outer = farthest(curve)
    period = 2.0 * ellipk(2.0 - 2.0 * square / outer**2) / (outer * np.sqrt(g / (2.0 * mass)))
    np.testing.assert_allclose(curve.frequency * period, 1.0, rtol=0.0, atol=1e-8)
    assert curve.stable.all()
    np.testing.assert_allclose(curve.participation, 1.0, rtol=1e-12)


@pytest.mark.slow
def test_one_mode_across_both_wells() -> None:
    curve = sb.dynamics.backbone_curve(sb.System(ONE), well="both", amplitude_limit=2.5)
    assert curve.attrs["end"] == "amplitude_limit"
    mass, g, k = ONE.mass[0, 0], ONE.nonlinear_stiffness, -ONE.stiffness[0]
    outer = farthest(curve)
    period = 4.0 * ellipk(g * outer**2 / (2.0 * (g * outer**2 - k))) / np.sqrt((g * outer**2 - k) / mass)
    np.testing.assert_allclose(curve.frequency * period, 1.0, rtol=0.0, atol=1e-8)
    assert float(curve.energy.min()) > ONE.saddle_energy - ONE.well_energy
    assert (np.diff(curve.energy) > 0.0).all()
    np.testing.assert_allclose(curve.min_midspan, -curve.max_midspan, rtol=0.0, atol=1e-8)


def balanced(model: sb.ReducedModel, amplitude: np.ndarray, frequency: float, harmonics: int = 24):
    """Cosine coefficients and frequency that satisfy the equations of motion at 4 points a harmonic, from a guess."""
    n, count = model.modes, 4 * harmonics
    phase = np.pi * (np.arange(count) + 0.5) / count
    order = np.arange(harmonics + 1)
    table = np.cos(np.outer(phase, order))
    inverse = np.linalg.inv(model.mass)
    unit = model.length_scale / abs(model.midspan_shape[0])
    begun = amplitude / unit

    def residual(x):
        omega, a = x[-1] * frequency * 2.0 * np.pi, x[:-1].reshape(harmonics + 1, n)
        alpha, speeding = unit * table @ a, -unit * omega**2 * table @ (order[:, None] ** 2 * a)
        force = -alpha * model.stiffness - model.nonlinear_stiffness * np.sum(alpha**2, axis=1)[:, None] * alpha
        off = (speeding - force @ inverse) / (unit * (2.0 * np.pi * frequency) ** 2)
        return np.concatenate((off.ravel(), a.sum(axis=0)[:1] - begun[:1]))

    guess = np.zeros((harmonics + 1, n))
    guess[0] = model.well_amplitude / unit
    guess[1] = begun - guess[0]
    found = least_squares(residual, np.append(guess, 1.0), xtol=1e-15, ftol=1e-15, gtol=1e-15)
    assert np.abs(found.fun).max() < 1e-9
    a = found.x[:-1].reshape(harmonics + 1, n)
    return unit * a.sum(axis=0), found.x[-1] * frequency


@pytest.mark.slow
def test_three_modes_against_harmonic_balance() -> None:
    curve = sb.dynamics.backbone_curve(sb.System(THREE), amplitude_limit=0.5)
    for at in (3, 7, curve.sizes["point"] - 1):
        point = curve.isel(point=at)
        begun, frequency = balanced(THREE, point.initial_amplitude.values, float(point.frequency))
        assert frequency == pytest.approx(float(point.frequency), rel=1e-8)
        unit = THREE.length_scale / abs(THREE.midspan_shape[0])
        np.testing.assert_allclose(begun, point.initial_amplitude, rtol=0.0, atol=1e-7 * unit)


@pytest.mark.slow
@pytest.mark.parametrize("mode", [1, 2, 3])
def test_it_begins_at_the_natural_frequencies(mode: int) -> None:
    curve = sb.dynamics.backbone_curve(sb.System(THREE), mode=mode, max_points=6)
    assert float(curve.frequency[0]) == pytest.approx(THREE.natural_frequencies[mode - 1], rel=1e-5)
    assert float(curve.participation[0, mode - 1]) > 0.999


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "well", "mode", "end"),
    [
        (THREE, "upper", 2, "the turning points meet"),
        (THREE, "lower", 2, "the turning points meet"),
        (THREE, "upper", 3, "at another equilibrium"),
        (TWO, "upper", 2, "at another equilibrium"),
    ],
)
def test_no_motion_comes_twice(model: sb.ReducedModel, well: str, mode: int, end: str) -> None:
    """The curve ends where the same motions would follow, from their other turning points."""
    curve = sb.dynamics.backbone_curve(sb.System(model), well=well, mode=mode)
    assert curve.attrs["end"].startswith(end) and 20 < curve.sizes["point"] < 60
    # each motion turns back where no other one of the curve begins
    begun = curve.initial_amplitude.values
    mirrored = begun * np.where(np.arange(model.modes) % 2, -1.0, 1.0)
    if end.startswith("the turning"):
        steps = np.linalg.norm(np.diff(begun, axis=0), axis=1).max()
        apart = np.linalg.norm(mirrored[:-2, None] - begun[None], axis=2)[5:, 5:]
        assert apart.min() > 0.1 * steps


def test_a_curve_that_passes_the_equilibrium_ends_there() -> None:
    """Chords that miss zero, pass it, and pass it where nothing but rounding is left."""
    assert _vanishing(np.array([0.1, 0.0]), np.array([0.1, -0.1])) is None
    assert _vanishing(np.array([0.1, 0.001]), np.array([-0.3, -0.002])) == pytest.approx(0.25, abs=1e-2)
    assert _vanishing(np.array([1e-3, 0.0]), np.array([2e-2, 0.0])) is None
    assert _vanishing(np.array([1e-12, 0.0]), np.array([-1e-12, 0.0])) is None


@pytest.mark.slow
@pytest.mark.parametrize("side", ["below", "above"])
def test_with_a_stop_the_solver_comes_back(side: str) -> None:
    """Motion about a well against a stop: after a period :func:`snapbeam.simulate` is where it began."""
    free = sb.ReducedModel.from_beam(default_values.BEAM, modes=1, damping_ratio=0.0)
    stop = sb.Striker(drive=sb.FixedStop(), gap=5e-5, side=side)
    system = sb.System(free, contacts=[sb.Contact(sb.HertzContact(1e6), stop)])
    well = "lower" if side == "below" else "upper"
    curve = sb.dynamics.backbone_curve(system, well=well, amplitude_limit=0.6, max_points=60)
    alone = sb.dynamics.backbone_curve(sb.System(free), well=well, amplitude_limit=0.6, max_points=60)
    assert float(curve.frequency[-1]) > float(alone.frequency[-1])  # a stop stiffens
    point = curve.isel(point=-1)
    state = sb.State(amplitude=point.initial_amplitude.values, velocity=np.zeros(1), phase=0.0)
    period = 1.0 / float(point.frequency)
    cycles = int(np.ceil(period * free.reference_frequency))
    run = sb.simulate(
        system.replace(initial_state=state),
        sb.Integration(cycles=cycles, accuracy="reference"),
        sample_times=np.array([0.5 * period, period]),
    )
    heights = run.dataset["midspan_displacement"].values
    ends = sorted((float(point.min_midspan), float(point.max_midspan)))
    np.testing.assert_allclose(sorted(heights), ends, rtol=0.0, atol=1e-6)


@pytest.mark.slow
def test_a_linear_spring_makes_another_twin_well() -> None:
    """A spring at mid-span is an elliptic integral as the beam alone, with its stiffness taken from that of the hill."""
    spring = sb.LocalSpring(stiffness=150.0, location=0.5)
    curve = sb.dynamics.backbone_curve(sb.System(ONE, forces=[spring]), lowest_frequency_ratio=0.75)
    shape = float(ONE.shape_at(0.5)[0])
    mass, g = ONE.mass[0, 0], ONE.nonlinear_stiffness
    hill = -ONE.stiffness[0] - 150.0 * shape**2
    assert hill > 0.0 and hill < 0.95 * -ONE.stiffness[0]
    outer = farthest(curve)
    period = 2.0 * ellipk(2.0 - 2.0 * hill / (g * outer**2)) / (outer * np.sqrt(g / (2.0 * mass)))
    np.testing.assert_allclose(curve.frequency * period, 1.0, rtol=0.0, atol=1e-8)
    energy = 0.25 * g * (curve.initial_amplitude.values[:, 0] ** 2 - hill / g) ** 2
    np.testing.assert_allclose(curve.energy, energy, rtol=1e-6)


@pytest.mark.parametrize("modes", [1, 3])
def test_open_circuits_stiffen_by_layers_and_not_by_a_coil(modes: int) -> None:
    """Small motions have the frequencies of the poles of the system with loads of no current."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=modes, damping_ratio=0.0)
    layers = sb.PiezoelectricHarvester(moment_per_volt=2e-5, capacitance=60e-9, resistance=1e5)
    coil = sb.ElectromagneticHarvester(force_factor=1.5, resistance=30.0, inductance=1e-3)
    system = sb.System(model, harvesters=[layers, coil])
    curve = sb.dynamics.backbone_curve(system, max_points=3)
    open_ = system.replace(**{"harvester.resistance": 1e12, "harvester.2.resistance": 1e6})
    poles = open_.poles("lower")
    expected = np.sort(poles.imag[poles.imag > 1e-6 * np.abs(poles.imag).max()])[:modes] / (2.0 * np.pi)
    np.testing.assert_allclose(curve.attrs["natural_frequencies"], expected, rtol=1e-6)
    assert curve.attrs["natural_frequencies"][0] > 1.001 * model.natural_frequencies[0]
    assert float(curve.frequency[0]) == pytest.approx(curve.attrs["natural_frequencies"][0], rel=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("further", [False, True])
def test_a_striker_on_its_suspension_comes_back(further: bool) -> None:
    """Beam and striker with mass, and a stop above: after a period :func:`snapbeam.simulate` is where both began."""
    free = sb.ReducedModel.from_beam(default_values.BEAM, modes=1, damping_ratio=0.0)
    body = sb.Striker(drive=sb.FixedStop(), gap=2e-5, mass=2e-3, suspension_stiffness=900.0)
    contacts = [sb.Contact(sb.HertzContact(1e6), body)]
    if further:
        stop = sb.Striker(drive=sb.FixedStop(), gap=4e-5, side="above", location=0.4)
        contacts.append(sb.Contact(sb.HertzContact(1e6), stop))
    system = sb.System(free, contacts=contacts)
    curve = sb.dynamics.backbone_curve(system, amplitude_limit=0.5, max_points=12)
    assert curve.sizes["mode"] == 2 and curve.sizes["striker"] == 1
    point = curve.isel(point=-1)
    shift = float(point.initial_shift[0])
    shifts = np.array([shift, 0.0]) if further else np.array(shift)
    state = sb.State(
        amplitude=point.initial_amplitude.values, velocity=np.zeros(1), phase=0.0, striker_shift=shifts, striker_rate=0.0 * shifts
    )  # fmt: skip
    period = 1.0 / float(point.frequency)
    run = sb.simulate(
        system.replace(initial_state=state),
        sb.Integration(cycles=int(np.ceil(period * free.reference_frequency)), accuracy="reference"),
        sample_times=np.array([0.0, 0.5 * period, period]),
    )
    heights = run.dataset["midspan_displacement"].values
    assert run.summary.impacts > 0
    assert heights[2] == pytest.approx(heights[0], abs=1e-6)
    ends = sorted((float(point.min_midspan), float(point.max_midspan)))
    np.testing.assert_allclose(sorted(heights[:2]), ends, rtol=0.0, atol=1e-5)


def test_refusals() -> None:
    shaken = sb.System(
        ONE, contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.1))]
    )
    with pytest.raises(InputError, match="system with drive: a backbone curve is of free motion"):
        sb.dynamics.backbone_curve(shaken)
    load = sb.AxialLoadModulation(motion=sb.HarmonicForce(frequency_ratio=2.0, amplitude=1.0))
    with pytest.raises(InputError, match="axial_load: a backbone curve is of free motion"):
        sb.dynamics.backbone_curve(sb.System(ONE, axial_load=load))
    with pytest.raises(InputError, match="well = 'middle'"):
        sb.dynamics.backbone_curve(sb.System(ONE), well="middle")
    with pytest.raises(InputError, match="mode = 2"):
        sb.dynamics.backbone_curve(sb.System(ONE), mode=2)
    lossy = sb.System(ONE, contacts=[sb.Contact(sb.HuntCrossley(1e8, 0.5), sb.Striker(drive=sb.FixedStop()))])
    with pytest.raises(InputError, match="loses energy"):
        sb.dynamics.backbone_curve(lossy)
    flying = sb.Striker(drive=sb.FixedStop(), mass=1e-3)
    with pytest.raises(InputError, match="contact 1: nothing holds its striker"):
        sb.dynamics.backbone_curve(sb.System(ONE, contacts=[sb.Contact(default_values.CONTACT, flying)]))
    with pytest.raises(InputError, match="must be System"):
        sb.dynamics.backbone_curve(default_values.BEAM)


@pytest.mark.sampled(2)
@pytest.mark.parametrize("well", ["lower", "both"])
def test_the_progress_is_of_all_work(well, monkeypatch):
    """Every point is measured before the next is reported, so that nothing long follows the last report."""
    from snapbeam.dynamics import backbone

    happened = []
    for name in ("half", "waveform"):
        computed = getattr(backbone._Structure, name)

        def noted(self, *arguments, name=name, computed=computed):
            happened.append(name)
            return computed(self, *arguments)

        monkeypatch.setattr(backbone._Structure, name, noted)
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1)
    curve = sb.dynamics.backbone_curve(
        sb.System(model), well=well, max_points=9, progress=lambda done, total: happened.append((done, total))
    )
    told = [each for each in happened if isinstance(each, tuple)]
    assert [total for _, total in told] == [9] * len(told)
    assert [done for done, _ in told] == sorted(done for done, _ in told)
    assert curve.sizes["point"] - 2 <= told[-1][0] <= curve.sizes["point"]
    assert happened[happened.index(told[-1]) :].count("waveform") <= 1
