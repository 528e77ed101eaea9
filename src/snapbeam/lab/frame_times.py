"""Time stamps of frames: which frames are missing, and the time between frames."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from snapbeam.lab.signals import grid_of
from snapbeam.util.validation import InputError, finite_array

_UNEVEN = 0.3  # of the time between frames by which a stamp may be off
_TIME_BLOCK = 1002  # kind of the block of a .cine file that holds a time for each frame


def numbers_of_stamps(
    path: Path, times: NDArray[np.float64], tick: float, step: float | None = None
) -> tuple[NDArray[np.int64], float]:
    """Number of each frame from its time stamp [s], from 0 on, and the time between frames [s].

    *tick* [s] is the unit in which the stamps count; *step* [s] is the time between frames as the file states it, to
    begin with.  Stamps that are coarser than the frames tell lost ones only by the total time.
    """
    times = finite_array(f"{path}: time stamps", times, 1)
    plain, steps = np.arange(times.size), np.diff(times)
    if times.size < 3:
        return plain, step or float(steps.sum())
    typical = float(np.median(steps))
    if (steps <= 0.0).any():
        if step is None or step > tick or (steps < -0.01 * tick).any():
            at = int(np.argmin(steps))
            raise InputError(
                f"{path}: the time stamp of frame {at + 1} is {times[at + 1]:.9g} s, that of frame {at} is {times[at]:.9g} s: "
                "must increase"
            )
        late = float((times - times[0] - plain * step).max())
        if late > 1.01 * tick:
            raise InputError(
                f"{path}: {times.size} frames at {1.0 / step:.6g} Hz end {late:.3g} s later by their time stamps: frames are "
                f"lost, and stamps of {tick:.3g} s do not tell where; save it as AVI or numbered images"
            )
        return plain, step
    stated = step is not None and abs(step - typical) <= max(1.01 * tick, 0.02 * typical)
    if step is None or not stated:
        step = float(steps[steps < 1.5 * typical + tick].mean())
    if stated and step < 2.5 * tick:  # where one more tick between stamps need not be a frame
        numbers = np.rint((times - times[0]) / step)
    else:
        numbers = np.concatenate([[0.0], np.cumsum(np.maximum(np.rint(steps / step), 1.0))])
    for _ in range(3):
        step, off = grid_of(times, numbers)
        numbers = np.rint(numbers + off)
        numbers -= numbers[0]
    gaps = np.diff(numbers)
    uneven = np.abs(steps - gaps * step)
    at = int(np.argmax(uneven))
    if (gaps < 1.0).any() or uneven[at] > max(1.01 * tick, _UNEVEN * step):
        raise InputError(
            f"{path}: its time stamps are uneven: {steps[at]:.6g} s between frames {at} and {at + 1}, {step:.6g} s between the "
            "others; record at an even frame rate, or save the frames as numbered images"
        )
    if numbers[-1] > 20 * times.size + 1000:
        at = int(np.argmax(gaps))
        raise InputError(
            f"{path}: its time stamps leap by {steps[at]:.6g} s after frame {at}, {gaps[at]:.0f} frames; too many frames "
            "would be missing, so save the parts one by one"
        )
    return numbers.astype(np.int64), step


def cine_times(path: Path, count: int) -> NDArray[np.float64] | None:
    """Time [s] of each frame of a .cine file, from its block of times; None if it has none.

    The format is that of Vision Research: blocks between the setup and the table of frames, each with its size, its kind
    and two spare bytes; a time is a fraction of a second in 32 bits and whole seconds in 32 bits.
    """
    with open(path, "rb") as file:
        head = file.read(36)
        setup, end = (int.from_bytes(head[k : k + 4], "little") for k in (28, 32))
        file.seek(setup + 142)
        at = setup + int.from_bytes(file.read(2), "little")
        while setup < at <= end - 8:
            file.seek(at)
            size, kind = int.from_bytes(file.read(4), "little"), int.from_bytes(file.read(2), "little")
            file.read(2)
            if kind == _TIME_BLOCK:
                if size != 8 + 8 * count or at + size > end:
                    raise InputError(f"{path}: has times of {(size - 8) / 8:g} frames and {count} frames")
                pairs = np.frombuffer(file.read(8 * count), "<u4").reshape(-1, 2).astype(np.int64)
                whole = (pairs[:, 1] - pairs[0, 1]).astype(np.float64)  # the fraction keeps its digits
                return whole + (pairs[:, 0] - pairs[0, 0]) / 2.0**32
            if size < 8:
                break
            at += size
    return None
