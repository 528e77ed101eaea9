"""First reference: extrapolation of the modified midpoint rule (order 16) in long double, with located events.

Gragg, Bulirsch and Stoer: with the step numbers 2, 4, ..., 16 the values at the end of a step of length h have errors in
even powers of h/n, which Aitken and Neville's table removes.  An event is located by Newton's method on the length of
the step itself, so that its time has the accuracy of a step.  NumPy's longdouble has 64 bits of mantissa on x86; elsewhere
it may be a double, and the agreement in references.toml is then looser.
"""

from typing import Any, NamedTuple

import numpy as np

from impact20 import Case

Real = np.longdouble
COLUMNS = 8
TOLERANCE = Real("1e-16")
SLOW = Real("1e-9")
"""Speed of impact at which chatter is complete."""


class Outcome(NamedTuple):
    """Output values and what happened on the way."""

    values: Any
    impacts: int
    last_impact: float
    evaluations: int


class Motion:
    """One case in long double; `closed` says which contacts carry a force, `stuck` that the first one holds the mass."""

    def __init__(self, case: Case) -> None:
        def real(value: Any) -> Any:
            return None if value is None else np.asarray(value, dtype=Real)

        self.case, self.n = case, len(case.stiffness)
        self.k, self.c = real(case.stiffness), real(case.damping)
        self.g, self.gg = real(case.gradient), real(case.coupling)
        self.gamma = Real(case.gamma)
        self.load, self.harmonic, self.pulse = real(case.load), real(case.harmonic), real(case.pulse)
        self.rows = [real(tip.row) for tip in case.tips]
        self.closed = [False] * len(case.tips)
        self.leaving = [False] * len(case.tips)
        """A dashpot let go while the penetration was still positive."""
        self.evaluations = 0
        self.pulsing = case.pulse is not None

    def tip_motion(self, j: int, t: Any) -> tuple[Any, Any, Any]:
        """Displacement, velocity and acceleration of tip j."""
        tip = self.case.tips[j]
        a, w = Real(tip.amplitude), Real(tip.frequency)
        s, c = np.sin(w * t + Real(tip.phase)), np.cos(w * t + Real(tip.phase))
        return a * s, a * w * c, -a * w * w * s

    def approach(self, j: int, t: Any, u: Any) -> tuple[Any, Any]:
        """Penetration of contact j and its rate."""
        y, dy, _ = self.tip_motion(j, t)
        n = self.n
        return y - Real(self.case.tips[j].gap) - self.rows[j] @ u[:n], dy - self.rows[j] @ u[n : 2 * n]

    def pressing(self, j: int, t: Any, u: Any) -> Any:
        """Second derivative of the penetration without the contact's own force."""
        return self.tip_motion(j, t)[2] - self.rows[j] @ self.slope(t, u)[self.n : 2 * self.n]

    def law(self, j: int, d: Any, rate: Any) -> Any:
        """Force of contact j."""
        tip = self.case.tips[j]
        if tip.law == "kelvin_voigt":
            return Real(tip.stiffness) * d + Real(tip.damping) * rate
        d = max(d, Real(0))
        power = d if tip.exponent == 1.0 else d * np.sqrt(d) if tip.exponent == 1.5 else d ** Real(tip.exponent)
        return Real(tip.stiffness) * power * (1 + Real(tip.factor) * rate)

    def slope(self, t: Any, u: Any) -> Any:
        """Derivative of the state."""
        self.evaluations += 1
        case, n = self.case, self.n
        x, v = u[:n], u[n : 2 * n]
        a = -self.k * x - self.c * v
        if self.gg is not None:
            r = self.gg @ x
            along = x @ r
            if self.g is None:
                a = a - self.gamma * along * r
            else:
                a = a - self.gamma * (along * self.g + (2 * (self.g @ x) + along) * r)
        if self.load is not None:
            a = a + self.load
        if self.harmonic is not None:
            a = a + self.harmonic * np.sin(Real(case.frequency) * t + Real(case.phase))
        if self.pulsing:
            a = a + self.pulse * np.sin(PI * t / Real(case.pulse_duration))
        if case.truss is not None:
            a = a - Real(case.truss[0]) * x * (1 - Real(case.truss[1]) / np.sqrt(1 + x * x))
        for j, shut in enumerate(self.closed):
            if shut:
                a = a + self.rows[j] * self.law(j, *self.approach(j, t, u))
        if case.circuit is None:
            return np.concatenate((v, a))
        theta, rate = Real(case.circuit[0]), Real(case.circuit[1])
        a = a - theta * u[2 * n]
        return np.concatenate((v, a, [theta * v[0] - rate * u[2 * n]]))

    def indicator(self, j: int, t: Any, u: Any) -> Any:
        """Positive while the state of contact j lasts."""
        d, rate = self.approach(j, t, u)
        if not self.closed[j]:
            return Real(1) if self.leaving[j] else -d
        return self.law(j, d, rate) if self.case.tips[j].law == "kelvin_voigt" else d


PI = Real("3.14159265358979323846264338327950288")


def step(motion: Motion, t: Any, u: Any, first: Any, h: Any) -> tuple[Any, Any]:
    """State after h and the difference of the last two columns of the table."""
    table: list[Any] = []
    for column in range(COLUMNS):
        n = 2 * (column + 1)
        part = h / n
        old, new = u, u + part * first
        for i in range(1, n):
            old, new = new, old + 2 * part * motion.slope(t + i * part, new)
        row = [(old + new + part * motion.slope(t + h, new)) / 2]
        for i in range(column):
            ratio = Real(n) / Real(2 * (column - i))
            row.append(row[i] + (row[i] - table[column - 1][i]) / (ratio * ratio - 1))
        table.append(row)
    return table[-1][-1], table[-1][-1] - table[-1][-2]


def _first_end(motion: Motion, t: Any, u: Any, h: Any, end: Any, first: Any) -> tuple[int, Any] | None:
    """The contact whose state ends first in the step and a bracket (low, high) of the time from t, or None.

    The indicators are taken on the cubic through both ends' values and slopes at 32 places, and the bracket's end is then
    checked by a step of that length.
    """
    last = motion.slope(t + h, end)
    places = 32
    for i in range(1, places + 1):
        s = Real(i) / places
        if i == places:
            middle = end
        else:
            q = s - 1
            middle = (1 + 2 * s) * q * q * u + s * q * q * h * first + s * s * (3 - 2 * s) * end + s * s * q * h * last
        for j in range(len(motion.closed)):
            if motion.indicator(j, t + s * h, middle) < 0:
                before = motion.indicator(j, t, u)
                # A contact that has just changed its state begins at 0, with rounding of either sign.
                if i == 1 and before <= 0 and abs(before) > 1e-9:
                    raise RuntimeError("the state of a contact began beyond its end")
                return j, s * h
    return None


def _locate(motion: Motion, t: Any, u: Any, first: Any, j: int, high: Any) -> tuple[Any, Any]:
    """Length of the step after which the indicator of contact j is 0, by bisection and secants."""
    low, below = Real(0), None
    value = motion.indicator(j, t + high, step(motion, t, u, first, high)[0])
    grow = 0
    while value >= 0 and grow < 8:  # the cubic was ahead of the motion
        high, grow = high * Real("1.02"), grow + 1
        value = motion.indicator(j, t + high, step(motion, t, u, first, high)[0])
    above = value
    s = high
    state = u
    for _ in range(200):
        if below is None:
            s = (low + high) / 2
        else:
            s = high - above * (high - low) / (above - below)
            if not low < s < high:
                s = (low + high) / 2
        state = step(motion, t, u, first, s)[0]
        value = motion.indicator(j, t + s, state)
        if value >= 0:
            low, below = s, value
            if above is not None and below is not None:
                above = above / 2 if _ % 3 == 2 else above
        else:
            high, above = s, value
            if below is not None:
                below = below / 2 if _ % 3 == 2 else below
        if abs(value) < Real("1e-24") or high - low < Real("1e-18") * max(t, Real(1)):
            break
    return s, state


def solve(case: Case) -> Outcome:
    """Integrate a case."""
    motion = Motion(case)
    n, t = motion.n, Real(0)
    u = np.concatenate((case.start, case.speed, [0.0] if case.circuit else [])).astype(Real)
    output = np.asarray(case.output, dtype=Real)
    times = [Real(case.horizon) * (i + 1) / case.samples for i in range(case.samples)]
    stops = sorted({*times, *([Real(case.pulse_duration)] if motion.pulsing else [])})
    scale = np.concatenate((np.full(2 * n, max(1e-3, float(np.abs(u).max()))), [1.0] if case.circuit else []))
    for j in range(len(motion.closed)):
        d, rate = motion.approach(j, t, u)
        if case.tips[j].law != "restitution":
            motion.closed[j] = bool(d > 0 or (d == 0 and rate > 0))
    values, impacts, last = {}, sum(motion.closed), 0.0
    h = Real(case.horizon) / 1000
    at = 0
    while at < len(stops):
        room = stops[at] - t
        short = room <= h * Real("1.0000001")
        h_now = room if short else h
        first = motion.slope(t, u)
        end, difference = step(motion, t, u, first, h_now)
        error = np.max(np.abs(difference) / scale)
        # The last two columns differ by the error of order 14.
        factor = Real("0.8") * (TOLERANCE / max(error, Real("1e-30"))) ** (Real(1) / 15)
        if error > TOLERANCE * 4 and h_now > Real("1e-9"):
            h = h_now * min(max(factor, Real("0.2")), Real("0.9"))
            continue
        scale = np.maximum(scale, np.abs(end).astype(float))
        found = _first_end(motion, t, u, h_now, end, first) if motion.closed else None
        if found is None:
            t, u = (stops[at] if short else t + h_now), end
            motion.leaving = [left and motion.approach(j, t, u)[0] > 0 for j, left in enumerate(motion.leaving)]
            if short:
                if stops[at] in times:
                    values[stops[at]] = output @ u[:n]
                if motion.pulsing and t >= Real(case.pulse_duration):
                    motion.pulsing = False
                at += 1
            if not short or factor < 1:
                h = h_now * min(max(factor, Real("0.3")), Real("2"))
            continue
        j, high = found
        span, u = _locate(motion, t, u, first, j, high)
        t = t + span
        tip = case.tips[j]
        if tip.law != "restitution":
            motion.closed[j] = not motion.closed[j]
            motion.leaving[j] = not motion.closed[j] and tip.law == "kelvin_voigt"
            if motion.closed[j]:
                impacts, last = impacts + 1, float(t)
            h = min(h, max(span, Real("1e-4") * h))
            continue
        speed = motion.approach(j, t, u)[1]
        impacts, last = impacts + 1, float(t)
        row = motion.rows[j]
        u = u.copy()
        if speed > SLOW or motion.pressing(j, t, u) <= 0:
            u[n : 2 * n] += row * (1 + Real(tip.coefficient)) * speed / (row @ row)
            # The mass stands on the stop: rounding must not leave it beyond.
            u[:n] += row * motion.approach(j, t, u)[0] / (row @ row)
            continue
        # Sustained contact of one mass: it moves with the tip until nothing presses it any more.
        piece = (2 * PI / Real(max(case.frequency, tip.frequency, 0.01))) / 400

        def held(when: Any, j: int = j) -> Any:
            y, dy, _ = motion.tip_motion(j, when)
            x = (y - Real(case.tips[j].gap)) / motion.rows[j][0]
            return np.array([x, dy / motion.rows[j][0]], dtype=Real)

        while at < len(stops):
            until = min(t + piece, stops[at])
            if motion.pressing(j, until, held(until)) < 0:
                low, high = t, until
                for _ in range(80):
                    middle = (low + high) / 2
                    low, high = (middle, high) if motion.pressing(j, middle, held(middle)) >= 0 else (low, middle)
                t, u = high, held(high)
                break
            t = until
            if t == stops[at]:
                values[stops[at]] = output @ held(t)[:1]
                at += 1
        h = Real(case.horizon) / 1000
    return Outcome(
        np.array([float(values[when]) for when in times]), impacts, last, motion.evaluations
    )  # fmt: skip
