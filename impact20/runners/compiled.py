"""Right-hand side and event functions compiled by Numba, for the solvers that take a function."""

import math

from numba import njit

_FAST = {"contract", "reassoc", "nsz"}


@njit(error_model="numpy", fastmath=_FAST, cache=True)
def rhs(t, u, du, p):  # type: ignore[no-untyped-def]
    """Write the derivative of u; p is the array of `flat.pack`."""
    n, contacts = int(p[0]), int(p[1])
    damping, stiffness, load, harmonic = 16, 16 + n, 16 + 2 * n, 16 + 3 * n
    pulse, gradient, scratch = 16 + 4 * n, 16 + 5 * n, 16 + 6 * n
    drive = math.sin(p[5] * t + p[6]) if p[14] != 0.0 else 0.0
    shock = math.sin(math.pi * t / p[7]) if p[13] != 0.0 and t < p[7] else 0.0
    for i in range(n):
        du[i] = u[n + i]
        du[n + i] = (
            p[load + i] - p[stiffness + i] * u[i] - p[damping + i] * u[n + i]
            + drive * p[harmonic + i] + shock * p[pulse + i]
        )  # fmt: skip
    place = 16 + 7 * n
    if p[3] != 0.0:
        along, gx = 0.0, 0.0
        for i in range(n):
            total = 0.0
            for j in range(n):
                total += p[place + i * n + j] * u[j]
            p[scratch + i] = total
            along += total * u[i]
            gx += p[gradient + i] * u[i]
        first, second = p[2] * along, p[2] * (2.0 * gx + along)
        for i in range(n):
            du[n + i] -= first * p[gradient + i] + second * p[scratch + i]
        place += n * n
    if p[8] != 0.0:
        du[n] -= p[8] * u[0] * (1.0 - p[9] / math.sqrt(1.0 + u[0] * u[0]))
    if p[12] != 0.0:
        du[n] -= p[10] * u[2 * n]
        du[2 * n] = p[10] * u[n] - p[11] * u[2 * n]
    for _ in range(contacts):
        state, law, row = p[place], p[place + 1], place + 10
        if (state == 1.0 or state == 2.0) and law != 3.0:
            angle = p[place + 8] * t + p[place + 9]
            d = p[place + 7] * math.sin(angle) - p[place + 6]
            rate = p[place + 7] * p[place + 8] * math.cos(angle)
            for i in range(n):
                d -= p[row + i] * u[i]
                rate -= p[row + i] * u[n + i]
            f = 0.0
            if law == 2.0:
                if state == 1.0 or d > 0.0:
                    f = p[place + 2] * d + p[place + 5] * rate
            elif d > 0.0:
                f = d if p[place + 3] == 1.0 else d * math.sqrt(d) if p[place + 3] == 1.5 else d ** p[place + 3]
                f *= p[place + 2] * (1.0 + p[place + 4] * rate)
            if state == 2.0 and f < 0.0:
                f = 0.0
            for i in range(n):
                du[n + i] += f * p[row + i]
        place += 10 + n


@njit(error_model="numpy", cache=True)
def indicators(t, u, out, p):  # type: ignore[no-untyped-def]
    """Write for each contact what falls through 0 when its state ends."""
    n, contacts = int(p[0]), int(p[1])
    place = 16 + 7 * n + (n * n if p[3] != 0.0 else 0)
    for j in range(contacts):
        angle = p[place + 8] * t + p[place + 9]
        d = p[place + 7] * math.sin(angle) - p[place + 6]
        rate = p[place + 7] * p[place + 8] * math.cos(angle)
        for i in range(n):
            d -= p[place + 10 + i] * u[i]
            rate -= p[place + 10 + i] * u[n + i]
        if p[place] == 0.0:
            out[j] = -d
        elif p[place] == 1.0 and p[place + 1] == 2.0:
            out[j] = p[place + 2] * d + p[place + 5] * rate
        else:
            out[j] = d
        place += 10 + n
