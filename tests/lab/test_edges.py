"""Sub-pixel edges: no bias, near the bound, and honest about what it did not find."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snapbeam.lab.tracking.edges import edge_profile, fit_edges, fit_line, masked_median, width_calibration
from snapbeam.lab.tracking.survey import noise_shape

OFFSETS = np.arange(13) - 6.0


def test_the_profile_is_the_mean_over_a_pixel_of_the_blurred_step():
    from scipy.integrate import quad
    from scipy.special import ndtr

    for offset in (-2.0, -0.3, 0.0, 0.8):
        mean, _ = quad(lambda v: ndtr(v / 0.7), offset - 0.5, offset + 0.5)
        assert edge_profile(np.array([offset]), 0.7)[0] == pytest.approx(mean, abs=1e-9)


@settings(max_examples=60, deadline=None)
@given(
    position=st.floats(-3.0, 3.0),
    width=st.floats(0.3, 2.0),
    base=st.floats(-100.0, 4000.0),
    contrast=st.floats(1.0, 4000.0),
    sign=st.sampled_from([-1.0, 1.0]),
)
def test_without_noise_the_edge_is_found_exactly(position, width, base, contrast, sign):
    window = base + sign * contrast * edge_profile(OFFSETS - position, width)
    fit = fit_edges(window[None], width, sign=sign, iterations=8)
    assert fit.position[0] == pytest.approx(position, abs=1e-4)
    assert fit.contrast[0] == pytest.approx(contrast, rel=1e-4)
    assert fit_edges(window[None], width, sign=-sign).position[0] != pytest.approx(position, abs=0.05)


@pytest.mark.parametrize("noise", [10 ** (-30 / 20), 10 ** (-15 / 20)])
def test_bias_and_scatter_in_noise(noise):
    rng = np.random.default_rng(3)
    truth = rng.uniform(-0.5, 0.5, 20_000)
    windows = edge_profile(OFFSETS - truth[:, None], 0.8) + noise * rng.standard_normal((20_000, 13))
    miss = fit_edges(windows, 0.8).position - truth
    bound = noise * np.sqrt(2.0 * np.sqrt(np.pi) * np.hypot(0.8, 12**-0.5))
    assert abs(np.nanmean(miss)) < 4.0 * bound / np.sqrt(truth.size) + 0.003
    assert np.nanstd(miss) < 1.3 * bound
    assert np.isnan(miss).mean() < 0.001


def test_a_window_without_an_edge_gives_no_position():
    flat = np.full((1, 13), 7.0)
    falling = -edge_profile(OFFSETS, 0.8)[None]
    assert np.isnan(fit_edges(flat, 0.8).position[0])
    assert np.isnan(fit_edges(falling, 0.8).position[0])


def test_width_is_recovered_through_the_calibration():
    table = width_calibration(0.8, 13)
    for width in (0.5, 0.8, 1.5, 3.0):
        apparent = fit_edges(edge_profile(OFFSETS - 0.2, width)[None], 0.8).width
        assert np.interp(apparent, *table)[0] == pytest.approx(width, rel=0.1)


def test_a_line_ignores_a_minority_of_bad_columns():
    x = np.arange(-10.0, 11.0)
    y = np.tile(5.0 + 0.1 * x, (2, 1))
    y[0, [2, 3, 17]] += 8.0
    value, error, slope, kept = fit_line(x, y, np.ones_like(y, bool), 1.5)
    np.testing.assert_allclose(value, 5.0, atol=1e-9)
    np.testing.assert_allclose(slope, 0.1, atol=1e-9)
    assert kept[0].sum() == 18 and kept[1].all() and (error < 1e-6).all()
    assert np.isnan(fit_line(x, y, np.zeros_like(y, bool), 1.5)[0]).all()


def test_masked_median_agrees_with_numpy():
    rng = np.random.default_rng(0)
    values, kept = rng.standard_normal((30, 9)), rng.random((30, 9)) < 0.6
    kept[0] = False
    expected = [np.median(row[use]) if use.any() else np.nan for row, use in zip(values, kept, strict=True)]
    np.testing.assert_allclose(masked_median(values, kept), expected)


def test_faint_light_that_lasts_shows_in_the_mean_thickness():
    """1.5 standard deviations, over 56 frames: told, and in the error; never in 200 records of noise alone."""
    from snapbeam.lab.tracking.measure import distortion

    rng, count = np.random.default_rng(5), 280
    plain = np.zeros(count)
    for _ in range(200):
        miss, odd = distortion(16.0 + 0.1 * rng.standard_normal(count), plain, plain + 1.3, 1.3, 0.0)
        # single frames beyond five robust deviations are as rare as they should be
        assert odd.sum() <= 1
    thickness = 16.0 + 0.1 * rng.standard_normal(count)
    thickness[40:96] += 0.15
    miss, odd = distortion(thickness, plain, plain + 1.3, 1.3, 0.0)
    assert odd[44:92].all() and not odd[170:].any()
    assert (miss[44:92] > 0.1).all()


def test_light_over_half_of_the_frames_does_not_hide_behind_the_scatter_that_it_makes():
    """Three standard deviations, over 70 of 150 frames: the scatter of all frames is twice that of the noise."""
    from snapbeam.lab.tracking.measure import distortion

    thickness = 16.0 + 0.035 * np.random.default_rng(5).standard_normal(150)
    thickness[40:110] += 0.1
    plain = np.zeros(150)
    miss, odd = distortion(thickness, plain, plain + 1.3, 1.3, 0.0)
    assert odd[44:106].all() and (miss[44:106] > 0.03).all()


def test_a_frame_whose_columns_agree_by_chance_is_not_surer_than_the_others():
    """Of 14 columns with a noise of 0.34 px none but outliers is left out, and no error is less than the usual one."""
    from snapbeam.lab.tracking.measure import pooled

    rng = np.random.default_rng(3)
    x = np.arange(14.0) - 6.5
    y = 0.34 * rng.standard_normal((40_000, 14))
    good = np.ones_like(y, bool)
    value, error, *_ = fit_line(x, y, good, 1.5, 0.3)
    assert np.abs(value / pooled(error)).max() < 5.0
    # without a word of the noise, lines are drawn through those few that agree
    freely, error_of_these, *_ = fit_line(x, y, good, 1.5)
    assert np.abs(freely).max() > np.abs(value).max()
    assert np.abs(freely / error_of_these).max() > 8.0


@pytest.mark.parametrize(("new", "fixed"), [(0.0, 0.0), (1.5, 0.0), (0.0, 1.5), (1.0, 1.0)])
def test_noise_of_whole_rows_is_measured_and_is_no_smoothing(new, fixed):
    rng = np.random.default_rng(4)
    frames = 100.0 + 4.0 * rng.standard_normal((8, 120, 80)) + fixed * rng.standard_normal((120, 1))
    frames[:, 40:60] += 60.0
    frames += new * rng.standard_normal((8, 120, 1))
    shape = noise_shape(frames)
    assert shape.rows == pytest.approx(np.hypot(new, fixed), abs=0.25)
    assert shape.fixed_rows == pytest.approx(np.hypot(fixed, new / np.sqrt(8.0)), abs=0.25)
    assert shape.along == shape.across == shape.in_time == 0.0
