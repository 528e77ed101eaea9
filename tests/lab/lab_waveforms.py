"""Motions of beam and shaker known in closed form, for rendering."""

from __future__ import annotations

import numpy as np

BUCKLING_LEVEL = 0.335e-3
PIXEL = 24e-6
FRAME_RATE = 5_000.0


def impacts(count=8, contact_frames=4.3, flight_frames=60.0, gap_px=9.0, pixel=PIXEL, rate=FRAME_RATE):
    """A sine of the shaker, with the beam touching it for a while and flying off in parabolas in between.

    Returns time, beam and shaker displacement [m], and the onset and closing speed [px/frame] of each contact
    after the first.
    """
    contact, flight = contact_frames / rate, flight_frames / rate
    period = contact + flight
    duration = count * period + 0.5 * contact
    time = np.arange(round(duration * rate * 40)) / (rate * 40)
    shaker = -BUCKLING_LEVEL + 0.12e-3 * np.sin(2.0 * np.pi * time / (2.7 * period))
    phase = np.mod(time, period) - contact
    share = np.clip(phase / flight, 0.0, 1.0)
    beam = shaker + 4.0 * gap_px * pixel * share * (1.0 - share)
    onsets = period * np.arange(1, count + 1)
    return time, beam, shaker, onsets[onsets < duration - 0.2 * contact], 4.0 * gap_px / flight_frames


def rms(values):
    return float(np.sqrt(np.nanmean(np.square(values))))


def errors_px(tracked, truth, name, pixel=PIXEL):
    """Tracked less true displacement in pixels, in frames that were not spoiled on purpose."""
    miss = (tracked[name].values - truth[name].values) / (pixel * 1e3)
    return miss[truth["disturbed"].values == 0]
