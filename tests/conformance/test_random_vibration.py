"""Random vibration: its spectrum, the exact mean square of a linear oscillator, the Fokker-Planck density of two wells."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import chi2, chisquare, norm

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.model.base_excitation import rigid_mass
from snapbeam.model.drive.base import Scale
from snapbeam.model.drive.random_vibration import SPECTRA, mean_square
from snapbeam.model.drive.shock import GRAVITY
from snapbeam.solver.excitation import motion_of
from snapbeam.util.validation import InputError

SHAPE = [(20.0, 0.01), (50.0, 0.04), (100.0, 0.04), (200.0, 0.01)]


def density(points, f):
    """Straight lines on logarithmic axes."""
    return np.exp(np.interp(np.log(f), *np.log(np.array(points)).T))


@pytest.mark.parametrize(
    ("name", "stated"),
    [
        ("MIL-STD-810G 514.6C-1 vertical", 1.04),
        ("MIL-STD-810G 514.6C-1 transverse", 0.204),
        ("MIL-STD-810G 514.6C-1 longitudinal", 0.740),
        ("MIL-STD-810G 514.6E-1", 7.7),
        ("NAVMAT P-9492", 6.06),
    ],
)
def test_rms_of_a_standard(name: str, stated: float) -> None:
    """The closed form against quadrature of each segment, and against the value that the standard states."""
    points = SPECTRA[name]
    motion = sb.RecordedAcceleration.from_psd(name, duration_s=1.0)
    whole = sum(
        quad(lambda f: density(points, f), low, high, epsrel=1e-12)[0]
        for (low, _), (high, _) in itertools.pairwise(points)
    )
    assert motion.rms_g == pytest.approx(math.sqrt(whole), rel=1e-10)
    assert motion.rms_g == pytest.approx(stated, rel=6e-3)


def test_mean_square_of_a_part() -> None:
    falling = ((10.0, 0.1), (1000.0, 0.001))  # f g is constant: the logarithm
    assert mean_square(falling, 10.0, 1000.0) == pytest.approx(math.log(100.0), rel=1e-13)
    edges = np.array([0.0, 5.0, 15.0, 40.0, 999.0, 5000.0])
    parts = mean_square(falling, edges[:-1], edges[1:])
    np.testing.assert_allclose(parts, [0.0, math.log(1.5), math.log(8 / 3), math.log(999 / 40), math.log(1000 / 999)])


@pytest.mark.slow
def test_density_of_200_realisations() -> None:
    """Averages over lines 0.5 Hz wide, of 200 motions: 95 % of them lie in the interval of chi square."""
    seeds, length = 200, 3200
    total = np.zeros(length // 2 + 1)
    for seed in range(seeds):
        motion = sb.RecordedAcceleration.from_psd(SHAPE, duration_s=2.0, seed=seed)
        record = motion.record[:length] / GRAVITY
        window = np.hanning(length + 1)[:-1]
        scale = 2.0 / (motion.sampling_frequency * np.sum(window**2))
        total += scale * np.abs(np.fft.rfft(record * window)) ** 2
    frequency = np.fft.rfftfreq(length, 1.0 / motion.sampling_frequency)
    inside = (frequency > 22.0) & (frequency < 195.0)
    ratio = total[inside] / seeds / density(SHAPE, frequency[inside])
    low, high = chi2.ppf([0.025, 0.975], 2 * seeds) / (2 * seeds)
    share = np.mean((ratio > low) & (ratio < high))
    # 346 lines of which two neighbours are correlated: 95 % within 4 standard deviations of a share
    assert share == pytest.approx(0.95, abs=4.0 * math.sqrt(0.95 * 0.05 / 346 * 2.0))
    assert ratio.mean() == pytest.approx(1.0, abs=4.0 / math.sqrt(346 * seeds / 2.0))
    assert (total[frequency > 210.0] / seeds).max() < 1e-4 * total[inside].min() / seeds


def test_motion_of_a_striker_has_no_drift() -> None:
    """With a rise the displacement begins at rest and stays within the bound of its spectrum."""
    scale, columns = Scale(1e-3, 500.0), {"rms_g": np.array([1.0])}
    motion = sb.RecordedAcceleration.from_psd(SHAPE, duration_s=5.0, seed=4, ramp_up_s=0.2)
    times = np.arange(motion.record.size) / motion.sampling_frequency
    moved, speed, _ = motion_of(motion, scale, times[-1])(times)
    exact = GRAVITY * math.sqrt(
        quad(lambda f: density(SHAPE, f) / (2 * math.pi * f) ** 4, 20.0, 200.0, points=[50.0, 100.0])[0]
    )
    late = moved[moved.size // 4 :]
    assert late.std() == pytest.approx(exact, rel=0.15)
    assert abs(late.mean()) < 0.05 * exact
    assert abs(speed[0]) < 1e-3 * speed.std()
    assert np.abs(moved).max() * motion.gain(columns)[0] <= max(
        motion.bounds(columns, scale)[0][0], motion.mirrored_bounds(columns, scale)[0]
    )
    again = sb.RecordedAcceleration.from_psd(SHAPE, duration_s=5.0, seed=4, ramp_up_s=0.2)
    assert again == motion and np.array_equal(again.record, motion.record)
    assert not np.array_equal(sb.RecordedAcceleration.from_psd(SHAPE, duration_s=5.0, seed=5).record, motion.record)


def oscillator(frequency: float, damping: float, motion) -> sb.System:
    model = sb.ReducedModel.from_matrices(
        [[1.0]], [(2.0 * math.pi * frequency) ** 2], contact_shape=[1.0], base_shape=[1.0], damping_ratio=damping,
        length_scale=1e-3,
    )  # fmt: skip
    return sb.System(model, base_excitation=sb.BaseExcitation(motion=motion))


def exact_mean_square(points, frequency: float, damping: float) -> float:
    """Of the relative displacement of a linear oscillator on its base, m^2: quadrature of |H|^2 times the density."""

    def part(f):
        square = (frequency**2 - f**2) ** 2 + (2.0 * damping * frequency * f) ** 2
        return density(points, f) * GRAVITY**2 / (square * (2.0 * math.pi) ** 4)

    edges = sorted({f for f, _ in points} | {frequency * x for x in (0.8, 0.95, 1.0, 1.05, 1.2)})
    return sum(quad(part, a, b, epsrel=1e-10)[0] for a, b in itertools.pairwise(edges))


@pytest.mark.slow
def test_linear_oscillator_against_its_exact_mean_square() -> None:
    """The mean over 40 seeds lies within 4 of its standard errors, which are 4 %."""
    frequency, damping, seeds = 80.0, 0.05, 40
    motion = sb.RecordedAcceleration.from_psd(SHAPE, duration_s=1.3, rms_g=0.1)
    system = oscillator(frequency, damping, motion)
    exact = exact_mean_square(SHAPE, frequency, damping) * (0.1 / math.sqrt(mean_square(SHAPE, 0.0, 1e9))) ** 2
    times = np.linspace(0.3, 1.2, 360)  # exp(-2 zeta omega t) is 5e-4 at the first
    squares = []
    for seed in range(seeds):
        own = system.replace(**{"base_excitation.seed": seed})
        run = sb.simulate(own, sb.Integration(cycles=97), sample_times=times)
        squares.append(np.mean(run.dataset["modal_amplitude"].values[:, 0] ** 2))
    mean, error = np.mean(squares), np.std(squares, ddof=1) / math.sqrt(seeds)
    assert error < 0.08 * exact
    assert abs(mean - exact) < 4.0 * error


@pytest.mark.slow
def test_beam_within_one_well_against_its_exact_mean_square() -> None:
    """A buckled beam of one mode at small level: the mean over seeds within 4 standard errors and 0.5 % of nonlinearity."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1, damping_ratio=0.05)
    f, damping, seeds = model.reference_frequency, 0.05, 40
    points = [(0.2 * f, 1.0), (4.0 * f, 1.0)]
    at_rest = float(model.well_amplitude[0])
    motion = sb.RecordedAcceleration.from_psd(points, duration_s=70.0 / f, rms_g=0.05)
    system = sb.System(model, base_excitation=sb.BaseExcitation(motion=motion))
    factor = float(rigid_mass(model)[0] / model.mass[0, 0])
    unit = 0.05**2 / float(mean_square(points, 0.0, 1e9))
    exact = exact_mean_square(points, f, damping) * unit * factor**2
    times = np.linspace(15.0 / f, 68.0 / f, 800)
    squares = []
    for seed in range(seeds):
        own = system.replace(**{"base_excitation.seed": seed})
        run = sb.simulate(own, sb.Integration(cycles=69), sample_times=times)
        squares.append(np.mean((run.dataset["modal_amplitude"].values[:, 0] - at_rest) ** 2))
    mean, error = np.mean(squares), np.std(squares, ddof=1) / math.sqrt(seeds)
    assert abs(mean - exact) < 4.0 * error + 0.005 * exact


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"psd": "MIL-STD-810"}, "psd = 'MIL-STD-810': must be one of 'MIL-STD-810G 514.6C-1 vertical'"),
        ({"psd": [[20, 0.04]]}, "must be at least two pairs of frequency (Hz) and density (g^2/Hz)"),
        ({"psd": [[20, 0.04], [10, 0.04]]}, "psd: 10 Hz after 20 Hz: frequencies must increase"),
        ({"psd": [[20, 0.04], [200, 0.0]]}, "psd: (200.0, 0.0): both numbers must be greater than 0"),
        ({"psd": [[20, 0.04], ["200 m", 0.1]]}, "psd: '200 m': the unit 'm' does not fit; must be in Hz"),
        ({"psd": [[20, 0.04], [200, math.nan]]}, "psd: nan: must be a finite number in g^2/Hz"),
        ({"duration_s": 0.001}, "duration_s = 0.001 s: must be 0.01 to"),
        ({"ramp_up_s": 2.0}, "ramp_up_s = 2 s: must be less than duration_s = 1 s"),
        ({"rms_g": -1.0}, "rms_g = -1.0: must be"),
        ({"seed": -1}, "seed = -1: must be"),
    ],
)
def test_bad_values_are_refused(changes, said: str) -> None:
    good = {"psd": SHAPE, "duration_s": 1.0}
    with pytest.raises(InputError) as refused:
        sb.RecordedAcceleration.from_psd(**(good | changes))
    assert said in str(refused.value)


def test_units_of_break_points() -> None:
    si = 0.04 * GRAVITY**2
    given = [["0.02 kHz", f"{si!r} m^2/s^3"], ["200 Hz", "0.04 g^2/Hz"]]
    found = sb.RecordedAcceleration.from_psd(given, duration_s=1.0).psd
    np.testing.assert_allclose(found, [(20.0, 0.04), (200.0, 0.04)], rtol=1e-14)
    with pytest.raises(InputError, match="the random vibration lasts 1 s"):
        sb.simulate(
            oscillator(80.0, 0.05, sb.RecordedAcceleration.from_psd(SHAPE, duration_s=1.0)), sb.Integration(cycles=90)
        )


@pytest.mark.slow
def test_two_wells_against_fokker_planck() -> None:
    """States of one mode under broad-band noise, 600 of them 20 periods apart, against exp(-H/D) by chi square.

    For x'' + 2 zeta omega x' + dU/dx = xi of one-sided density S the stationary density is exp(-(x'^2/2 + U)/D) with
    D = S/(8 zeta omega).
    """
    damping, seeds, cycles, top = 0.1, 20, 640, 12.0
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=1, damping_ratio=damping)
    f, omega, mass = (model.reference_frequency, 2.0 * math.pi * model.reference_frequency, float(model.mass[0, 0]))
    well = abs(float(model.well_amplitude[0]))
    factor = float(rigid_mass(model)[0] / mass)
    # U = omega^2/(8 w^2) (x^2 - w^2)^2 has the frequency omega in both wells; its barrier is omega^2 w^2/8
    wanted = omega**2 * well**2 / 8.0 / 1.5  # D: the barrier over 1.5
    points = [(0.02 * f, 1.0), (top * f, 1.0)]
    one_sided = 8.0 * damping * omega * wanted / factor**2
    rms = math.sqrt(one_sided * (top - 0.02) * f) / GRAVITY
    motion = sb.RecordedAcceleration.from_psd(points, duration_s=(cycles + 1) / f, rms_g=rms)
    system = sb.System(model, base_excitation=sb.BaseExcitation(motion=motion))
    times, found = np.arange(60, cycles + 1, 20) / f, []
    for seed in range(seeds):
        own = system.replace(**{"base_excitation.seed": seed})
        data = sb.simulate(own, sb.Integration(cycles=cycles), sample_times=times).dataset
        found.append([data[name].values[:, 0] for name in ("modal_amplitude", "modal_velocity")])
    x, v = np.concatenate(found, axis=1)
    assert x.size == 600
    grid = np.linspace(-3.0 * well, 3.0 * well, 20001)
    weight = np.exp(-(omega**2) / (8.0 * well**2) * (grid**2 - well**2) ** 2 / wanted)
    share = np.cumsum(weight) / weight.sum()
    bins = 12
    placed = np.histogram(np.interp(x, grid, share), bins, (0.0, 1.0))[0]
    assert chisquare(placed).pvalue > 1e-3
    speeds = np.histogram(norm.cdf(v / math.sqrt(wanted)), bins, (0.0, 1.0))[0]
    assert chisquare(speeds).pvalue > 1e-3


def test_interval_of_an_estimate_contains_the_density() -> None:
    """At 95 % of the frequencies of 20 motions; a record without a density has none in its estimate."""
    shares = []
    for seed in range(20):
        found = sb.RecordedAcceleration.from_psd(
            SHAPE, duration_s=8.0, seed=seed, ramp_up_s=0.5, rms_g=2.0
        ).estimated_psd()
        data = found.sel(frequency=slice(25.0, 190.0))
        shares.append(np.mean((data.psd_low < data.psd_target) & (data.psd_target < data.psd_high)))
        assert found.attrs["rms_g"] == pytest.approx(2.0, rel=0.1)
    # 20 times some 40 lines, neighbours correlated
    assert np.mean(shares) == pytest.approx(0.95, abs=4.0 * math.sqrt(0.95 * 0.05 / 800 * 2.0))
    record = sb.RecordedAcceleration.from_g(np.random.default_rng(1).standard_normal(4000), 1000.0)
    ax = sb.plot.plot_spectrum(record.estimated_psd())
    assert ax.get_xlabel() == "Frequency (Hz)" and "psd_target" not in record.estimated_psd()
    with pytest.raises(InputError, match="segments = 1: must be"):
        record.estimated_psd(1)


@pytest.mark.slow
def test_motion_of_a_striker_is_that_of_its_samples() -> None:
    """A tip that moves by a random vibration against the same samples as a record: impacts and displacements agree."""
    model = sb.ReducedModel.from_beam(default_values.BEAM, modes=2)
    motion = sb.RecordedAcceleration.from_psd([(40.0, 1e-3), (300.0, 1e-3)], duration_s=0.5, rms_g=3.0, ramp_up_s=0.1)
    times = np.arange(motion.record.size) / motion.sampling_frequency
    moved, speed, _ = motion_of(motion, Scale(1e-3, 500.0), times[-1])(times)
    record = sb.RecordedMotion(
        displacement=moved, velocity=speed, sampling_frequency=motion.sampling_frequency, frequency=80.0
    )
    found = []
    for drive in (motion, record):
        system = sb.System(model, contacts=[sb.Contact(default_values.CONTACT, sb.Striker(drive=drive, gap=2e-5))])
        run = sb.simulate(system, sb.Integration(cycles=20), sample_times=np.linspace(0.0, 0.15, 100))
        assert run.summary.impacts > 0
        found.append(run.dataset["striker_displacement"].values)
    np.testing.assert_allclose(found[0], found[1], rtol=0.0, atol=1e-3 * np.abs(found[1]).max())
