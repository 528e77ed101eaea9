"""Truth values and powers of two, eight at a time, against the same one by one."""

from __future__ import annotations

import numpy as np
import pytest

from snapbeam.solver.compilation import compiled
from snapbeam.solver.simd import (
    bits,
    both,
    halvings,
    less,
    load,
    lowest,
    mask_of,
    pick,
    power_of_two,
    splat,
    store,
    vmax,
    vmin,
    vtrunc,
)
from snapbeam.solver.step_control import Clock, contact_halvings


@compiled
def _asked(a, b, out):
    x, y = load(a, 0), load(b, 0)
    mask = less(x, y)
    store(out, 0, pick(mask, x, y))
    store(out, 8, vmin(x, y))
    store(out, 16, vmax(x, y))
    store(out, 24, vtrunc(x))
    store(out, 32, pick(mask_of(0b10100101), splat(1.0), splat(0.0)))
    return bits(mask), bits(both(mask, mask_of(0b00001111))), lowest(0b101000)


def test_of_each_lane_what_is_true_of_its_numbers() -> None:
    generator = np.random.default_rng(5)
    a, b, out = 9.0 * generator.normal(size=8), 9.0 * generator.normal(size=8), np.empty(40)
    b[3] = a[3]
    a[5] = np.nan
    found, half, first = _asked(a, b, out)
    true = a < b
    assert found == sum(1 << i for i in range(8) if true[i])
    assert half == found & 15
    assert first == 3
    good = np.isfinite(a)
    np.testing.assert_array_equal(out[:8], np.where(true, a, b))
    np.testing.assert_array_equal(out[8:16][good], np.minimum(a, b)[good])
    np.testing.assert_array_equal(out[16:24][good], np.maximum(a, b)[good])
    np.testing.assert_array_equal(out[24:32], np.trunc(a))
    np.testing.assert_array_equal(out[32:], [1, 0, 1, 0, 0, 1, 0, 1])


@compiled
def _graded(length, want, out):
    level = halvings(load(length, 0), load(want, 0))
    store(out, 0, level)
    store(out, 8, power_of_two(0.0 - level))


@compiled
def _one_by_one(clock, want):
    # contact_halvings takes half of what has passed since the onset
    return contact_halvings(clock, 2.0 * want, 0.0, 1.0)


@pytest.mark.parametrize("seed", range(4))
def test_halvings_are_the_level_that_a_loop_finds(seed: int) -> None:
    generator = np.random.default_rng(seed)
    step, tick = 1 << 20, 10.0 ** generator.uniform(-12, -9)
    length = np.full(8, step * tick)
    want = length * 2.0 ** generator.uniform(-12.0, 3.0, 8)
    want[0], want[1], want[2] = 0.0, length[0] / 8.0, np.nextafter(length[0] / 8.0, 0.0)
    out = np.empty(16)
    _graded(length, want, out)
    clock = Clock(tick, step, 1, 1, 1, 1, 0, 18, 1, 0.0, 0.0, -1)
    expected = [_one_by_one(clock, float(each)) for each in want]
    np.testing.assert_array_equal(np.clip(out[:8], 0, 18), expected)
    assert out[1] == 3.0 and out[2] == 4.0
    np.testing.assert_array_equal(out[9:16], 2.0 ** -out[1:8])
