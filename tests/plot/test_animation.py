"""Animations: which instants they show, and files that play."""

from __future__ import annotations

import numpy as np
import pytest

from snapbeam.plot.animation import animate_run, frame_times
from snapbeam.util.validation import InputError

pytest.importorskip("imageio_ffmpeg")


def test_frames_dwell_on_the_hardest_impact(synthetic_run):
    even = frame_times(synthetic_run, (2.0, 4.0), duration=2.0, slow_motion=0.0, fps=10.0)
    np.testing.assert_allclose(even, np.linspace(0.02, 0.04, 20))
    times = frame_times(synthetic_run, (2.0, 4.0), duration=2.0, slow_motion=3.0, fps=10.0)
    # impacts last from 0.10 to 0.15 of a cycle of 10 ms, half as much again on either side
    for start in (0.02, 0.03):
        inside = (times > start + 0.7e-3) & (times < start + 1.8e-3)
        if inside.sum() > 2:
            break
    assert inside.sum() >= 28
    assert (np.diff(times) > 0.0).all() and times[0] == 0.02 and times[-1] == pytest.approx(0.04)


def test_a_measured_run_without_force_has_no_slow_motion(synthetic_run):
    measured = synthetic_run.drop_vars(["contact_force", "penetration_normalised"])
    assert frame_times(measured, duration=1.0, fps=10.0).size == 10


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".mp4", pytest.param(".gif", marks=pytest.mark.slow)])
def test_the_file_plays(tmp_path, synthetic_run, suffix):
    seen = []
    file = animate_run(
        synthetic_run, tmp_path / f"run{suffix}", (0.0, 2.0), duration=0.8, slow_motion=0.4, fps=10.0,
        progress=lambda done, total: seen.append((done, total)),
    )  # fmt: skip
    assert [path.name for path in tmp_path.iterdir()] == [file.name]
    count = frame_times(synthetic_run, (0.0, 2.0), duration=0.8, slow_motion=0.4, fps=10.0).size
    assert seen[-1] == (count, count)
    if suffix == ".gif":
        from PIL import Image

        with Image.open(file) as image:
            assert image.n_frames == count
    else:
        import imageio_ffmpeg

        assert imageio_ffmpeg.count_frames_and_secs(str(file))[0] == count


def test_refusals(tmp_path, synthetic_run):
    with pytest.raises(InputError, match=r"must end in \.mp4 or \.gif"):
        animate_run(synthetic_run, tmp_path / "run.avi")
    with pytest.raises(InputError, match="must hold at least two samples"):
        frame_times(synthetic_run, (20.0, 30.0))
    with pytest.raises(InputError, match="fps = 0"):
        frame_times(synthetic_run, fps=0.0)
