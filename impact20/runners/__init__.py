"""Runners, one file per solver; each imports its solver only when it is asked for.

A runner is a module with

    PACKAGE = "name"                            # of the distribution, for its version
    def settings(case) -> list[dict]            # what is searched, from loose to tight within each method
    def prepare(case, setting) -> solve         # compiles what the solver compiles; raises CannotRun
    solve() -> Result                           # is timed when it runs the second time
    def solve_many(cases, setting) -> outputs   # if it can: cases that differ in the amplitude of the first tip

`REGISTER` lists them.  The README has a complete runner of 30 lines.
"""

from __future__ import annotations

import importlib
from typing import Any, NamedTuple

from impact20 import Array, Case

REGISTER = {
    "SciPy": "impact20.runners.scipy_runner",
    "SUNDIALS CVODE": "impact20.runners.sundials_runner",
    "Boost.odeint": "impact20.runners.boost_runner",
    "heyoka": "impact20.runners.heyoka_runner",
    "diffrax": "impact20.runners.diffrax_runner",
    "numbalsoda": "impact20.runners.numbalsoda_runner",
    "MuJoCo": "impact20.runners.mujoco_runner",
    "snapbeam": "impact20.runners.snapbeam_runner",
}


class CannotRun(Exception):
    """The solver cannot do a case; the message says why and stands in the table."""


class Result(NamedTuple):
    """What a run gives back."""

    values: Array
    """The output at the output times."""
    impacts: int | None = None
    """Number of contacts that began, if the solver tells."""
    evaluations: int | None = None
    """Right-hand sides, if the solver tells."""
    state: Array | None = None
    """Displacements and velocities at the horizon, if the solver tells: for the energy balance."""


def runner(name: str) -> Any:
    """Import a runner by its name; ImportError if its solver is not installed."""
    return importlib.import_module(REGISTER[name])


def tolerances(case: Case, method: str, values: tuple[float, ...], **more: Any) -> list[dict[str, Any]]:
    """Settings of one method over tolerances, from loose to tight."""
    del case
    return [{"method": method, "tolerance": value, **more} for value in values]


def has_restitution(case: Case) -> bool:
    """Tell whether a contact is a jump of the velocity."""
    return any(tip.law == "restitution" for tip in case.tips)
