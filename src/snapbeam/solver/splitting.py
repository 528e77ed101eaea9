"""Compositions of kicks and exact linear flows: the coefficients, as data.

A step h is  B(b_0 h) A(a_0 h) B(b_1 h) ... A(a_s h) B(b_s h):  A is the exact flow of the damped linear
modes, B a kick by the forces that depend on position alone (tension, contact).  Both tables are
Runge-Kutta-Nystrom splittings of Blanes and Moan, J. Comput. Appl. Math. 142 (2002) 313-330, Table 3:
SRKN_6^b of order 4 and SRKN_11^b of order 6.  Their orders here are measured in the tests.

A kick that depends on the velocity, as of a contact that loses energy, breaks what the second of them is built on; its
place is taken by S_10 of order 6 of the same paper, Table 2, which asks nothing of its parts.  The first is symmetric,
and the conditions of order 4 are then the general ones.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

TURNS = 16
"""Room for one number per kick, a multiple of the lanes' width."""


class Stages(NamedTuple):
    """A composition as it stands in memory: plain numbers, since passing arrays costs time."""

    flows: int
    """Flows of a step; there is one kick more."""
    flow: int
    """Memory offset of the flow weights."""
    kick: int
    elapsed: int


def in_memory(order: int, at: int, general: bool = False) -> tuple[Stages, NDArray[np.float64]]:
    """The composition of *order*, and the numbers that it needs in memory from *at* on."""
    composition = (GENERAL if general else COMPOSITIONS)[order]
    numbers = np.zeros(3 * TURNS)
    for i, weights in enumerate((composition.flow, composition.kick, composition.elapsed)):
        numbers[i * TURNS : i * TURNS + weights.size] = weights
    return Stages(composition.flow.size, at, at + TURNS, at + 2 * TURNS), numbers


def slot_length(order: int, size: int) -> int:
    """Length in memory of what one length of step needs, with rows of *size*."""
    return (COMPOSITIONS[order].flow.size + 1) // 2 * 4 * size + 2 * TURNS


class Composition(NamedTuple):
    """One splitting: *flow* (S,) and *kick* (S + 1,) weights, palindromic, each summing to one."""

    flow: NDArray[np.float64]
    kick: NDArray[np.float64]
    elapsed: NDArray[np.float64]
    """Fraction of the step that has passed at each kick, padded with zeros to TURNS."""
    distinct: NDArray[np.int64]
    """Which of the distinct flow lengths each flow is, shape (S,): the flows are palindromic."""


def _palindromic(flow_half: list[float], kick_half: list[float], stages: int) -> Composition:
    flow, kick = np.empty(stages), np.empty(stages + 1)
    for i, weight in enumerate(flow_half):
        flow[i] = flow[stages - 1 - i] = weight
    for i, weight in enumerate(kick_half):
        kick[i] = kick[stages - i] = weight
    distinct = np.minimum(np.arange(stages), stages - 1 - np.arange(stages))
    elapsed = np.zeros(TURNS)
    elapsed[1 : stages + 1] = np.cumsum(flow)
    elapsed[stages] = 1.0
    return Composition(flow, kick, elapsed, distinct.astype(np.int64))


def _fourth() -> Composition:
    a = [0.245298957184271, 0.604872665711080]
    b = [0.0829844064174052, 0.396309801498368, -0.0390563049223486]
    return _palindromic([*a, 0.5 - sum(a)], [*b, 1.0 - 2.0 * sum(b)], 6)


def _sixth() -> Composition:
    a = [0.123229775946271, 0.290553797799558, -0.127049212625417, -0.246331761062075, 0.357208872795928]
    b = [0.0414649985182624, 0.198128671918067, -0.0400061921041533, 0.0752539843015807, -0.0115113874206879]
    return _palindromic([*a, 1.0 - 2.0 * sum(a)], [*b, 0.5 - sum(b)], 11)


def _general_sixth() -> Composition:
    a = [0.0502627644003922, 0.413514300428344, 0.0450798897943977, -0.188054853819569, 0.541960678450780]
    b = [0.148816447901042, -0.132385865767784, 0.067307604692185, 0.432666402578175]
    return _palindromic([*b, 0.5 - sum(b)], [*a, 1.0 - 2.0 * sum(a)], 10)


COMPOSITIONS = {4: _fourth(), 6: _sixth()}
"""Compositions for kicks that depend on position only, by order."""
GENERAL = {4: COMPOSITIONS[4], 6: _general_sixth()}
"""Compositions for kicks that may also depend on velocity, by order."""
