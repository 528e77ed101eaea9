"""The striker's drive as a clock of the frames: what is wrong with their times is named, and good ones are not doubted."""

import numpy as np
import pytest

from snapbeam.lab.tracking.drive_clock import drive_clock


def rows(rng, count=400, noise=0.03):
    """Rows of a striker [px] that rests, starts and moves on, and its motion as a function of the frame."""
    frequency, size, phase = rng.uniform(0.018, 0.05), rng.uniform(3.0, 8.0), rng.uniform(-3.0, 3.0)

    def moved(at):
        turn = 2.0 * np.pi * frequency * (at - 40.0)
        sine = np.sin(turn + phase) - np.sin(phase) + 0.02 * np.sin(2.0 * turn)
        return 60.0 + size * np.where(at > 40.0, sine, 0.0)

    return moved, moved(np.arange(float(count))) + noise * rng.standard_normal(count)


def spoiled(rng, kind):
    """Rows with one thing wrong."""
    moved, values = rows(rng)
    at = np.arange(400.0)
    k = int(rng.integers(180, 260))
    k += int(np.argmax(np.abs(np.diff(values[k : k + 90]))))  # where it moves fast
    if kind == "time_jump":
        at[k:] += rng.uniform(2.0, 8.0)
        values = moved(at) + 0.03 * rng.standard_normal(400)
    elif kind == "knocked":
        values[k:] += rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 5.0)
    elif kind == "scattered":
        values = moved(at + 0.4 * rng.standard_normal(400)) + 0.03 * rng.standard_normal(400)
    return values


def test_good_rows_are_not_doubted():
    assert not any(drive_clock(rows(np.random.default_rng((1, k)))[1]) for k in range(60))


@pytest.mark.parametrize("kind", ["time_jump", "knocked", "scattered"])
def test_wrong_times_and_a_knock_are_named(kind):
    told = [[name for name, _ in drive_clock(spoiled(np.random.default_rng((2, k)), kind))] for k in range(20)]
    assert sum(bool(names) for names in told) >= 19, told
    assert sum(names == [kind] for names in told) >= 17, told
