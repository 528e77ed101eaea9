"""Numbers read off maps that are known point by point."""

from __future__ import annotations

import numpy as np
import pytest

from snapbeam.sweeps.threshold import compare_maps, interwell_threshold, threshold_notch
from snapbeam.util.status_codes import ResponseClass, RunStatus
from snapbeam.util.validation import InputError


def test_threshold_of_a_known_map(synthetic_map):
    x, step = synthetic_map.frequency_ratio.values, 0.64 / 24
    exact = 0.10 + 0.06 * x - 0.09 * np.exp(-(((x - 1.2) / 0.3) ** 2))
    found = interwell_threshold(synthetic_map)
    low = x > 0.8  # below it the formula has continuous responses above another line
    assert ((found - exact)[low] >= 0.0).all() and ((found - exact)[low] <= step * 1.0001).all()
    notch = threshold_notch(x, found, step, (0.8, 2.2))
    assert abs(notch.position - 1.2) <= 0.5 * (notch.high - notch.low) + 0.1
    assert notch.low <= 1.2 <= notch.high
    with pytest.raises(InputError, match="must contain a point"):
        threshold_notch(x, found, step, (7.0, 8.0))


def test_no_threshold_where_nothing_snaps(synthetic_map):
    calm = synthetic_map.copy(deep=True)
    calm.response_class[0] = ResponseClass.INTRAWELL
    assert np.isnan(interwell_threshold(calm)[0])


def test_a_failed_run_below_leaves_the_threshold_open(synthetic_map):
    found = interwell_threshold(synthetic_map)
    failed = synthetic_map.copy(deep=True)
    failed.response_class[4, 0] = ResponseClass.UNKNOWN  # below the threshold
    failed.response_class[6, -1] = ResponseClass.UNKNOWN  # above it
    expected = found.copy()
    expected[4] = np.nan
    np.testing.assert_array_equal(interwell_threshold(failed), expected)
    status = np.where(failed.response_class == ResponseClass.UNKNOWN, RunStatus.NOT_RUN, RunStatus.OK)
    never_started = failed.assign(status=(failed.response_class.dims, status))
    np.testing.assert_array_equal(interwell_threshold(never_started), found)


def test_comparing_maps(synthetic_map):
    same = compare_maps(synthetic_map, synthetic_map)
    assert (same.changed, same.snapped, same.share, same.threshold) == (0.0, 0.0, 0.0, 1.0)
    other = synthetic_map.copy(deep=True)
    other.response_class[5, 3] = ResponseClass.CONTINUOUS
    assert compare_maps(synthetic_map, other).changed == pytest.approx(1 / 999), "one is unknown"
    failed = synthetic_map.copy(deep=True)
    failed.response_class[:, 20] = ResponseClass.UNKNOWN
    found = compare_maps(synthetic_map, failed)
    assert (found.changed, found.snapped, found.share) == (0.0, 0.0, 0.0)
    assert found.unknown == pytest.approx(0.041), "40 points, and one that is unknown in both maps"
    with pytest.raises(InputError, match="must have the same grid"):
        compare_maps(synthetic_map, other.isel(frequency_ratio=slice(5)))
