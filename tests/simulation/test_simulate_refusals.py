"""What a run refuses, and the words it does it in."""

from __future__ import annotations

import math
from typing import Any

import pytest

import snapbeam as sb
from snapbeam.model import default_values

BUCKLED = sb.ReducedModel.from_beam(default_values.BEAM, 2)
STRAIGHT = sb.ReducedModel.from_beam(default_values.STRAIGHT_BEAM, 2)
SHAKER = sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.18)


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"model": STRAIGHT}, sb.InputError, r"needs a buckled beam: axial_load = 0 N must exceed .* 24.3685 N"),
        ({"model": default_values.BEAM}, sb.InputTypeError, r"model = Beam\(.*: must be a ReducedModel"),
        ({"contacts": SHAKER}, sb.InputTypeError, r"contacts = Shaker\(.*: must be a list or tuple"),
        ({"contacts": []}, sb.InputError, r"contacts = \[\]: .* needs an initial_state"),
        ({"contacts": [SHAKER]}, sb.InputTypeError, r"contacts\[0\] = Shaker\(.*: must be a Contact\(law, striker\)"),
        ({"cycles": 0}, sb.InputError, r"cycles = 0: must be an integer in \[1, 10000000\]"),
        ({"cycles": -3}, sb.InputError, "cycles = -3: must be an integer"),
        ({"cycles": 1.5}, sb.InputError, "cycles = 1.5: must be an integer"),
        ({"cycles": "200"}, sb.InputTypeError, "cycles = '200': must be an integer .* not str"),
        ({"cycles": math.inf}, sb.InputError, "cycles = inf: must be an integer"),
        ({"step": 0.0}, sb.InputError, "step = 0.0: must be a finite number greater than 0 s"),
        ({"step": math.nan}, sb.InputError, "step = nan: must be a finite number greater than 0 s"),
        ({"step": "1e-6"}, sb.InputTypeError, "step = '1e-6': must be .* not str"),
        ({"accuracy": "best"}, sb.InputError, "accuracy = 'best': must be one of 'standard', 'reference'"),
        ({"engine": "abacus"}, sb.InputError, "engine = 'abacus': must be one of 'auto', 'native'"),
        ({"sample_times": []}, sb.InputError, r"sample_times = \[\]: must contain at least one time"),
        ({"sample_times": [0.0, 0.0]}, sb.InputError, "sample_times: must be strictly increasing"),
        ({"sample_times": [-1.0, 0.0]}, sb.InputError, "from -1 to 0 s: must lie within the run, 0 to"),
        ({"sample_times": [0.0, 9.0]}, sb.InputError, "from 0 to 9 s: must lie within the run, 0 to"),
        ({"sample_times": [math.nan]}, sb.InputError, r"sample_times\[0\] = .*nan.*: must be finite"),
        ({"sample_times": ["soon"]}, sb.InputTypeError, "sample_times = .*: must be an array of numbers"),
    ],
)
def test_refusals(changes: dict[str, Any], error: type[Exception], message: str) -> None:
    given: dict[str, Any] = {
        "model": BUCKLED,
        "contacts": [sb.Contact(default_values.CONTACT, SHAKER)],
        "cycles": 1,
        **changes,
    }
    system = {name: given.pop(name) for name in ("model", "contacts")}
    times = given.pop("sample_times", None)
    with pytest.raises(error, match=message):
        sb.simulate(sb.System(**system), sb.Integration(**given), sample_times=times)


SYSTEM = sb.System(BUCKLED, contacts=[sb.Contact(default_values.CONTACT, SHAKER)])


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: sb.simulate(SYSTEM, 200), sb.InputTypeError, "integration = 200: must be an Integration"),
        (lambda: sb.simulate(BUCKLED), sb.InputTypeError, "system = .*: must be a System"),
        (
            lambda: sb.simulate(sb.System(BUCKLED)),
            sb.InputError,
            r"contacts = \[\]: without a striker the beam needs an initial_state",
        ),
        (
            lambda: sb.simulate(SYSTEM, sb.Integration(cycles=10**6)),
            sb.InputError,
            r"\d+ samples of 2 modes would take .* GiB, the limit is 4 GiB: give fewer sample_times or cycles",
        ),
        (
            lambda: sb.simulate(SYSTEM, sb.Integration(cycles=10**7)),
            sb.InputError,
            "a run of 2e\\+09 samples is too long to record: give sample_times, or fewer cycles",
        ),
    ],
)
def test_refusals_of_systems(call, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        call()


@pytest.mark.parametrize("ratio", [0.3, 3.0])
def test_a_step_that_does_not_resolve_a_period_is_refused(ratio: float) -> None:
    """A quarter of a cycle and of the first period is the longest: no class is told of a run that saw nothing."""
    system = SYSTEM.replace(**{"drive.frequency_ratio": ratio})
    longest = 0.25 / (BUCKLED.reference_frequency * max(ratio, 1.0))
    words = "a cycle of excitation" if ratio > 1.0 else "a period of the first mode"
    for door in (
        sb.simulate,
        lambda system, integration: sb.sweep(system, {"velocity_amplitude": [0.1, 0.2]}, integration),
    ):
        with pytest.raises(sb.InputError, match=r"step = 1 s: does not resolve .*must be at most .*a quarter of it"):
            door(system, sb.Integration(cycles=5, step=1.0))
        with pytest.raises(sb.InputError, match=f"does not resolve {words}"):
            door(system, sb.Integration(cycles=5, step=1.01 * longest))
        door(system, sb.Integration(cycles=1, step=0.99 * longest))
