"""The numbers of a case in one array, as compiled right-hand sides read them.

Header of 16 numbers, then damping, stiffness, load, harmonic, pulse, gradient and scratch (n each), G (n n, if any), and
for each contact 10 numbers and its row.  The first number of a contact is its state: 0 open, 1 closed (located by
events), 2 automatic (the force is max(0, f) for d > 0), 3 without force, the penetration still positive.
"""

import numpy as np

from impact20 import Array, Case

HEADER, VECTORS, CONTACT = 16, 7, 10
LAWS = {"power": 0, "hunt_crossley": 1, "kelvin_voigt": 2, "restitution": 3}


def pack(case: Case) -> Array:
    """Pack a case, its contacts open and its pulse on."""
    n = len(case.stiffness)
    zeros = np.zeros(n)
    head = np.zeros(HEADER)
    head[:8] = n, len(case.tips), case.gamma, case.coupling is not None, case.gradient is not None, case.frequency, case.phase, case.pulse_duration  # fmt: skip
    head[8:10] = case.truss or (0.0, 0.0)
    head[10:12] = case.circuit or (0.0, 0.0)
    head[12] = case.circuit is not None
    head[13] = case.pulse is not None
    head[14] = case.harmonic is not None
    given = (case.damping, case.stiffness, case.load, case.harmonic, case.pulse, case.gradient, zeros)
    parts = [head, *[zeros if each is None else each for each in given]]
    if case.coupling is not None:
        parts.append(case.coupling.ravel())
    for tip in case.tips:
        numbers = [0.0, LAWS[tip.law], tip.stiffness, tip.exponent, tip.factor, tip.damping, tip.gap, tip.amplitude, tip.frequency, tip.phase]  # fmt: skip
        parts += [np.array(numbers), tip.row]
    return np.concatenate(parts)


def contact_offset(case: Case, j: int) -> int:
    """Place of the state of contact j."""
    n = len(case.stiffness)
    start = HEADER + VECTORS * n + (n * n if case.coupling is not None else 0)
    return start + j * (CONTACT + n)


def set_states(case: Case, packed: Array, states: tuple[int, ...], pulse: bool) -> None:
    """Write the states of the contacts and whether the pulse is on."""
    for j, state in enumerate(states):
        packed[contact_offset(case, j)] = state
    packed[13] = pulse


def initial_state(case: Case) -> Array:
    """Displacements, velocities and the circuit."""
    return np.concatenate((case.start, case.speed, [0.0] if case.circuit else []))
