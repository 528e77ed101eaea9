"""Figures of measured responses compared with a map."""

import numpy as np

from snapbeam.lab.map_comparison import compare_measured_points
from snapbeam.lab.plot.comparison import plot_map_comparison
from snapbeam.sweeps.measured_points import MeasuredPoints
from snapbeam.util.status_codes import ResponseClass


def test_errors_stand_out_in_the_table_of_classes(synthetic_map):
    """An error of one in a hundred is redder than any agreement, and bold; agreements are grey."""
    rng = np.random.default_rng(1)
    i, j = rng.integers(0, 40, 300), rng.integers(0, 25, 300)
    kinds = synthetic_map["response_class"].values[i, j].astype(np.int8)
    kinds[np.flatnonzero(kinds == ResponseClass.INTRAWELL)[:2]] = ResponseClass.TRANSIENT_1
    ratio, velocity = (synthetic_map["frequency_ratio"].values[i], synthetic_map["velocity_amplitude"].values[j])
    points = MeasuredPoints(ratio, velocity, np.full(300, 1 / 2.1), kinds)
    result = compare_measured_points(points, synthetic_map)
    ax = plot_map_comparison(synthetic_map, points, result).axes[1]
    weights = {(int(t.get_position()[1]), int(t.get_position()[0])): t.get_fontweight() for t in ax.texts}
    images = [image.to_rgba(image.get_array()) for image in ax.images]
    for (row, column), count in np.ndenumerate(result.confusion):
        shown = [image[row, column] for image in images if image[row, column, 3] > 0.0]
        assert len(shown) == (count > 0)
        red, green, blue, _ = shown[0] if shown else np.ones(4)
        if count and row != column:
            assert red - max(green, blue) > 0.1 and weights[row, column] == "bold"
        else:
            assert red - min(green, blue) < 0.05 and weights[row, column] == "normal"
    assert result.confusion[1, 0] == 2
