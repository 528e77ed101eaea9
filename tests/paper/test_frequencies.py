"""Claims 1 and 11 of the paper: its natural frequencies, and the misprint in Eq. (A.2)."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.linalg

from snapbeam.model.default_values import BEAM, MODES, STRAIGHT_BEAM
from snapbeam.model.natural_frequencies import exact_natural_frequencies
from snapbeam.model.reduced_model import ReducedModel

# Hz, as printed in section 3.2 for N = 32
PRINTED = [81.8, 159.0, 380.0]


@pytest.mark.parametrize(
    ("modes", "expected"),
    [
        (1, ["83.933"]),
        (2, ["83.93", "160.58"]),
        (4, ["82.27", "159.63", "388.0", "665.6"]),
        (32, ["81.853", "159.268", "380.441"]),
    ],
)
def test_reduced_model(modes: int, expected: list[str]) -> None:
    natural_frequencies = ReducedModel.from_beam(BEAM, modes=modes).natural_frequencies
    for value, text in zip(natural_frequencies, expected, strict=False):
        assert f"{value:.{len(text.split('.')[1])}f}" == text


def test_thirty_two_modes() -> None:
    natural_frequencies = ReducedModel.from_beam(BEAM, modes=MODES).natural_frequencies
    assert natural_frequencies[:3] == pytest.approx(PRINTED, rel=2e-3)
    assert natural_frequencies[-1] == pytest.approx(37.73e3, rel=1e-4)


def test_straight_beam() -> None:
    """80 and 221 Hz, to which the thickness was fitted."""
    natural_frequencies = ReducedModel.from_beam(STRAIGHT_BEAM, modes=MODES).natural_frequencies
    assert natural_frequencies[:2] == pytest.approx([80.32, 221.42], abs=5e-3)
    assert exact_natural_frequencies(STRAIGHT_BEAM, 2) == pytest.approx([80.3221, 221.4110], abs=5e-5)
    assert np.round(natural_frequencies[:2]).tolist() == [80.0, 221.0]


def test_factor_two_of_the_appendix_is_a_misprint() -> None:
    """Eq. (A.2) as printed gives 82, 195 and 410 Hz, not the paper's own 81.8, 159 and 380 Hz."""
    model = ReducedModel.from_beam(BEAM, modes=MODES)
    square = model.nonlinear_stiffness * model.well_amplitude[0] ** 2

    def frequencies(factor: float) -> np.ndarray:
        tangent = model.stiffness + factor * square
        tangent[0] = model.stiffness[0] + 3.0 * square
        return np.sqrt(scipy.linalg.eigvalsh(np.diag(tangent), model.mass)) / (2.0 * math.pi)

    assert frequencies(1.0)[:10] == pytest.approx(model.natural_frequencies[:10], rel=1e-9)
    as_printed = frequencies(2.0)[:3]
    assert as_printed == pytest.approx([82.12, 194.61, 409.88], abs=5e-3)
    assert (np.abs(as_printed / PRINTED - 1.0)[1:] > 0.07).all()


# symmetric roots by buckling level b/r, scaled by sqrt(EI/(rho S L^4))
SYMMETRIC = {
    1: [8.03495, 103.76828, 280.59453],
    2: [15.92789, 104.64043, 280.71352],
    4: [30.70673, 108.33222, 281.20076],
    6: [43.20826, 115.06851, 282.05463],
    8: [52.68282, 125.15995, 283.34435],
    20: [70.40951, 210.82827, 311.11765],
}
ANTISYMMETRIC = [44.36270, 182.11782, 398.78569]


@pytest.mark.parametrize("level", SYMMETRIC)
def test_exact_frequencies_of_the_buckled_beam(level: float) -> None:
    """Nayfeh's problem, to every digit of the table."""
    unit = math.sqrt(BEAM.bending_stiffness / BEAM.mass_per_length) / BEAM.length**2 / (2.0 * math.pi)
    exact = exact_natural_frequencies(BEAM.replace(buckling_level=level * BEAM.radius_of_gyration), 6) / unit
    table = np.sort(SYMMETRIC[level] + ANTISYMMETRIC)
    np.testing.assert_allclose(exact, table, rtol=0.0, atol=5.1e-6)


def test_first_ten_modes_within_seven_hundredths_of_a_percent() -> None:
    """Fig. A.9 and its text: all frequencies below 4 kHz within 0.07 %."""
    exact = exact_natural_frequencies(BEAM, 10)
    hertz = [81.852, 159.266, 380.416, 653.820, 1008.423, 1431.677, 1927.476, 2493.596, 3131.116, 3839.317]
    np.testing.assert_allclose(exact, hertz, rtol=0.0, atol=5.1e-4)
    excess = ReducedModel.from_beam(BEAM, modes=MODES).natural_frequencies[:10] / exact - 1.0
    assert (excess > 0.0).all()
    # the ninth is the worst, a little above the tenth
    assert excess[8:] == pytest.approx([0.0663e-2, 0.0655e-2], abs=0.00005e-2)
    assert excess.max() == excess[8] < 0.07e-2
