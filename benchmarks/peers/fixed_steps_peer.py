"""A C++ program of fixed steps for the paper's beam alone: splitting of order 4, without events and without statistics.

Its tolerance is the longest step, s; a step is a whole part of a twentieth of the excitation's period.
"""

from __future__ import annotations

import ctypes
import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.cases import CONTACT, Case
from benchmarks.peers import Method, Solver
from benchmarks.peers.compiled import library
from benchmarks.peers.equations import equations_of
from snapbeam.solver.structure import structure_of

__all__ = ["METHODS", "Program"]

_Array = NDArray[np.float64]
_INSTANTS = 20  # a cycle, at which e5 is measured
_LANES = 32


class _Beam(ctypes.Structure):
    _fields_ = [
        *((name, ctypes.c_void_p) for name in ("omega", "decay", "tension", "well", "contact")),
        *((name, ctypes.c_double) for name in ("gamma", "stiffness")),
    ]


class _Run(ctypes.Structure):
    _fields_ = [(name, ctypes.c_double) for name in ("offset", "amplitude", "omega", "period")]


_LIBRARY = library(Path(__file__).with_name("fixed_steps.cpp"), "-std=c++17", "-ffast-math")


class Program:
    """The numbers of a beam and of its runs, as the program reads them."""

    def __init__(self, cases: list[Case], step: float) -> None:
        case = cases[0]
        structure = structure_of(case.model, "below")
        first = np.flatnonzero(structure.coupling[0])
        order = np.concatenate((first, np.setdiff1d(np.arange(case.modes), first)))
        blocks = np.split(order, 2) if case.modes > 1 else [order]
        contact = case.model.linear_modes.T @ case.model.shape_at(case.location)
        self._arrays = (
            structure.omega[order],
            (structure.damping_ratio * structure.omega)[order],
            np.concatenate([structure.coupling[np.ix_(rows, rows)].ravel() for rows in blocks]),
            structure.well[order],
            contact[order],
        )
        self.beam = _Beam(
            *(each.ctypes.data for each in self._arrays), structure.nonlinear_stiffness, CONTACT.stiffness
        )
        self.modes, self.scale = case.modes, case.model.length_scale
        self.runs = [_Run(0.0, equations_of(each).amplitude, equations_of(each).drive, each.period) for each in cases]
        self.steps = [_INSTANTS * math.ceil(each.period / (_INSTANTS * step)) for each in cases]

    def sample(self, i: int, cycles: int) -> _Array:
        """Displacement of the contact point from rest, in b, at all instants."""
        out = np.zeros(cycles * _INSTANTS + 1)
        _LIBRARY.integrate(
            self.modes, ctypes.byref(self.beam), ctypes.byref(self.runs[i]), self.steps[i], cycles,
            self.steps[i] // _INSTANTS, ctypes.c_void_p(out[1:].ctypes.data),
        )  # fmt: skip
        return out / self.scale

    def advance(self, cycles: int) -> None:
        """Integrate all runs: those of one mode side by side, else one after the other."""
        beam = ctypes.byref(self.beam)
        if self.modes > 1:
            for run, steps in zip(self.runs, self.steps, strict=True):
                _LIBRARY.integrate(self.modes, beam, ctypes.byref(run), steps, cycles, 1, None)
            return
        for i in range(0, len(self.runs), _LANES):
            runs = (_Run * _LANES)(*self.runs[i : i + _LANES])
            _LIBRARY.integrate_many(beam, runs, (ctypes.c_int * _LANES)(*self.steps[i : i + _LANES]), cycles)


def _prepare(case: Case, step: float) -> Solver:
    program = Program([case], step)

    def sample(times: _Array) -> _Array:
        return program.sample(0, round((times.size - 1) / _INSTANTS))

    return Solver(sample, lambda end: program.advance(math.ceil(end / case.period)))


METHODS = (
    Method(
        "C++, fixed steps, order 4",
        (64e-6, 48e-6, 32e-6, 24e-6, 16e-6, 12e-6, 8e-6, 4e-6),
        _prepare,
        "-O3 -march=native -ffast-math",
    ),
)
