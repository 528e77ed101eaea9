"""Places in memory: a row is eight numbers, one of each of the eight runs that are integrated side by side.

Addresses are the same for every number of modes, so that compiled code has them as constants.
"""

from __future__ import annotations

from collections import namedtuple
from functools import cache
from typing import Any

from snapbeam.solver.simd import WIDTH
from snapbeam.solver.splitting import TURNS

_named_tuple: Any = namedtuple


MOST = 16
"""Modes, at most."""
LEVELS = 23
"""Lengths of step that are prepared for each run, at most."""
FLOWS = 6
"""Distinct flows of a composition, at most."""

# Of each run:
(
    T, WITHIN, PERIOD, TICK, OUTPUT_INTERVAL, LIMIT, END, TICKS, LENGTH, KEY, WHOLE, LEVEL, PHASE0, PHASE, SINE, COSINE, WELL_SIGN,
    STRETCH, OFFSET, OMEGA, AMPLITUDE, REST_CONTACT, REST_CENTER, TIP_SPEED, STEP_TIME, STEP, COARSEST,
    COARSE_TICKS, MAX_HALVINGS, STEP_SUBINTERVALS, FLOW_KEY, SHORTEST_SUBINTERVAL, SUBINTERVALS, SUBINTERVAL, SAFE_GAP, SAFE_CENTER,
    ENERGY_TICK, STEPS_SINCE_START, ONSET, SIDE, DECIDE_REACH, DECIDE_ENERGY, DECIDE_CROSSINGS, CROSSINGS_LAST_QUARTER, STEPS, MAX_STEPS, W, WV, D,
    DV, C, CV, MIN_W, MAX_W, MIN_C, MAX_C, PEAK_WV, PEAK_CV, SQUARE_W, SQUARE_C, SQUARE_WV, SQUARE_CV,
    ENERGY_TIME, HIGH_TIME, ENERGY, HIGH_ENERGY, POWER, HIGH_POWER, CROSSING, IMPULSE, WORK, GROSS, DEEPEST, TEMP, TEMP1, TEMP2,
    TEMP3, GQ, QR,
) = range(0, 79 * WIDTH, WIDTH)  # fmt: skip

LAW = QR + WIDTH
"""Numbers of the law of contact, a row each, eight at most."""
TURN = LAW + 8 * WIDTH
"""Sine and then cosine of the drive's turn at each kick of the step at hand."""
STAGES = TURN + 2 * TURNS * WIDTH
"""Weights of the composition, plain numbers."""
COUPLING = STAGES + 3 * TURNS
"""G, row by row of MOST plain numbers."""
PAIRS = COUPLING + MOST * MOST
"""For each pair of a mode and a distinct flow, eight pairs a group: damped frequency, its damping, omega^2, weight."""
MODE = PAIRS + MOST * FLOWS * 4
"""The modes, one after the other."""
# Of each mode, plain numbers:
OMEGA_I, OMEGA_SQUARED, OMEGA_DAMPED, DAMPING, CENTER, SHIFT, HIGH, WELL = range(8)
# and rows.
Q, P, K, Q1, P1, K1, SEEN_WELL, CONTACT, SAMPLING_FLOW = (WIDTH * i for i in range(1, 10))
FLOW = SAMPLING_FLOW + 4 * WIDTH
"""a11 - 1, a12, a21, a22 - 1 of each distinct flow of the step at hand."""
MODE_ROWS = FLOW + FLOWS * 4 * WIDTH
TABLES = MODE + MOST * MODE_ROWS
"""Offset of the prepared steps of each run: one for each level, and one of variable length."""


def groups(modes: int, distinct: int) -> int:
    """Groups of eight pairs of a mode and a distinct flow."""
    return -(-modes * distinct // WIDTH)


def slot_size(modes: int, distinct: int) -> int:
    """Plain numbers of a prepared step: the flows of the pairs, group by group, and the turns of the drive."""
    return groups(modes, distinct) * 4 * WIDTH + 2 * TURNS


def sizes(modes: int, distinct: int, subintervals: int) -> tuple[int, int]:
    """Offset of the sample rows, and memory length, for a number of *subintervals* of a step."""
    sampling = TABLES + WIDTH * (LEVELS + 1) * slot_size(modes, distinct)
    return sampling, sampling + 4 * WIDTH * (subintervals + 1)


# Whole numbers: which of the eight lanes, a bit a lane.
(
    LIVE,  # hold a run
    TOUCHING,
    SHORTENED,  # take a step shortened to where the contact begins or ends
    EVENT,  # and do so at the end of the step at hand
    REFINING,  # locate the onset once more
    INSIDE,  # locate the maximum penetration of a contact, inside the present step
    PROBED,  # have done so
    ODD,  # take a step of a length that is not prepared
) = range(8)
RUNS = 16
"""The run of each lane."""


# How many modes there are and which of them are coupled, as a type: code is compiled for each.


@cache
def shape_of(blocks: tuple[int, ...], flows: int, body: int | None = None) -> Any:
    """An empty named tuple whose type stands for blocks of so many coupled modes and for so many flows of a step.

    *body* is the number of the mode of a striker with mass, in the order of the blocks.
    """
    name = "_".join(map(str, ("Modes", *blocks, "flows", flows, *(() if body is None else ("body", body)))))
    made: Any = _named_tuple(name, ())
    made.__module__, made.blocks, made.flows, made.body = __name__, blocks, flows, body
    globals()[name] = made
    return made()


def __getattr__(name: str) -> Any:
    """The type of a shape by its name, for compiled code that is read from the disk."""
    if name.startswith("Modes_"):
        sizes, _, numbers = name.removeprefix("Modes_").partition("_flows_")
        flows, _, body = numbers.partition("_body_")
        return type(shape_of(tuple(map(int, sizes.split("_"))), int(flows), int(body) if body else None))
    raise AttributeError(name)
