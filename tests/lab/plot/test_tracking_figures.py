"""Pictures of a tracked recording show what was measured."""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from lab_waveforms import BUCKLING_LEVEL, FRAME_RATE, PIXEL, impacts

from snapbeam import InputError
from snapbeam.lab.camera import open_recording
from snapbeam.lab.plot.tracking import annotated_video, found_edges, plot_frame, plot_tracking_quality
from snapbeam.lab.synthetic import SyntheticCamera, SyntheticStage, render_recording
from snapbeam.lab.tracking.track import track
from snapbeam.plot.style import save_figure


@pytest.fixture(scope="module", params=["below", "right"])
def tracked(request, tmp_path_factory):
    """An open recording, its tracked dataset and its truth."""
    side = request.param
    sign = 1.0 if side == "below" else -1.0
    time, beam, shaker, *_ = impacts(2)
    shape = (160, 64) if side == "below" else (64, 160)
    recording = render_recording(
        time, sign * beam, sign * shaker, glare_frames=[20], blank_frames=[30],
        camera=SyntheticCamera(frame_rate=FRAME_RATE, pixel_size=PIXEL, shape=shape),
        stage=SyntheticStage(shaker_width=0.8e-3, slope=0.03, side=side),
    )  # fmt: skip
    path = recording.write(tmp_path_factory.mktemp("lab") / "a.cihx")
    with open_recording(path) as read:
        rest = 1e-3 * float(recording.truth["displacement_mm"][0])
        yield read, track(read, buckling_level=BUCKLING_LEVEL, rest_displacement=rest, side=side), recording


@pytest.mark.slow
def test_edges_are_drawn_where_they_are(tracked):
    read, dataset, recording = tracked
    row = recording.truth.attrs["zero_row"]
    lift = abs(float(recording.truth["displacement_mm"][50])) * 1e-3 / PIXEL  # the beam hangs low
    middle = row + lift
    lines = {name: (rows, columns) for name, _, _, rows, columns in found_edges(dataset, 50, read.shape)}
    rows, columns = lines["beam, far edge"]
    along, across = (rows, columns) if dataset.attrs["side"] == "below" else (columns, rows)
    expected = middle - 0.2e-3 / PIXEL + 0.03 * (across - 31.5)
    np.testing.assert_allclose(along, expected, atol=0.15)
    assert {"shaker tip", "sticker", "beam, near edge (far edge + thickness)"} <= set(lines)


@pytest.mark.sampled(2)
def test_a_frame_and_its_flags(tracked, tmp_path):
    read, dataset, _ = tracked
    figure = plot_frame(read, dataset, 50)
    axes = figure.axes[0]
    assert "frame 50" in axes.get_title() and "measured" in axes.get_title()
    assert axes.get_xlabel() == "column (px)" and len(figure.legends[0].get_texts()) == 4
    assert "glare" in plot_frame(read, dataset, 20).axes[0].get_title()
    assert "dropped" in plot_frame(read, dataset, 30).axes[0].get_title()
    assert save_figure(figure, tmp_path / "frame.png").stat().st_size > 10_000
    for frame in (-1, 10_000):
        with pytest.raises(InputError, match="frame"):
            plot_frame(read, dataset, frame)
    plt.close("all")


@pytest.mark.sampled(2)
def test_the_quality_page_shows_displacement_error_and_flags(tracked):
    _, dataset, _ = tracked
    figure = plot_tracking_quality(dataset)
    top, middle, bottom = figure.axes
    np.testing.assert_array_equal(top.lines[0].get_ydata(), dataset["displacement_mm"])
    assert [label.get_text() for label in top.get_legend().get_texts()] == ["beam at the shaker", "shaker"]
    assert "px" in middle.get_ylabel() and bottom.get_xlabel() == "time (ms)"
    ticks = {text.get_text() for text in bottom.get_yticklabels()}
    assert {"glare: 1", "dropped: 1", "gap: 0"} <= ticks
    with pytest.raises(InputError, match="flags"):
        plot_tracking_quality(dataset.drop_vars("flags"))
    plt.close("all")


@pytest.mark.slow
def test_the_video_plays_and_carries_the_edges(tracked, tmp_path):
    pytest.importorskip("imageio_ffmpeg")
    import av

    read, dataset, _ = tracked
    calls = []
    path = annotated_video(read, dataset, tmp_path / "a.mp4", every=3, progress=lambda done, total: calls.append(done))
    with av.open(str(path)) as container:
        pictures = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    assert len(pictures) == (len(read) + 2) // 3 and calls[-1] == len(read)
    colour = pictures[17].astype(int)
    orange = (colour[..., 0] - colour[..., 2] > 80).sum()
    assert orange > 50
    assert (np.ptp(colour, axis=2) > 60).any()
    with pytest.raises(InputError, match="path"):
        annotated_video(read, dataset, tmp_path / "a.gif")
    with pytest.raises(InputError, match="dataset"):
        annotated_video(read, dataset.isel(time=slice(5)), tmp_path / "b.mp4")
    assert [one.name for one in tmp_path.iterdir()] == ["a.mp4"]
