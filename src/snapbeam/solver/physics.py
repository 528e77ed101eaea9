"""The physics, once: scalar functions that every engine compiles for itself.

The symbols are the paper's.  In modal coordinates about a well (``alpha = alpha_eq + V q``, ``p = q'``)

    q'' + 2 zeta omega q' + omega^2 q + gamma [(q.Gq) g + (2 g.q + q.Gq) Gq] = V^T phi(x_s) f

which is Eq. (11) of Rouleau et al. (2024) without approximation, both wells included: ``G = V^T V``,
``g = V^T alpha_eq``.  The functions below are its parts.  Those written with ``+``, ``-``, ``*`` and
:func:`~snapbeam.solver.simd.fma` alone take one number or a register of modes.
"""

from __future__ import annotations

from snapbeam.solver.compilation import inlined
from snapbeam.solver.simd import fma, select_less, vfloor

# pi/2 in three parts of 33 bits each, so that k * part is exact for |k| < 2^20.
_HALF_PI_1 = 1.5707963267341256
_HALF_PI_2 = 6.077100506303966e-11
_HALF_PI_3 = 2.0222662487959506e-21


@inlined
def tension_factors(gamma, gq, qr):
    """Factors of g and of r = Gq in the force of the midplane stretching.

    ``gq = g.q`` and ``qr = q.Gq``; the squared slopes of the beam are those of the well plus
    ``2 gq + qr``.
    """
    return -gamma * qr, -gamma * (2.0 * gq + qr)


@inlined
def tension_acceleration(along_g, along_r, g, r):
    """Modal acceleration by the change of midplane tension, beyond what the linear modes hold."""
    return fma(along_g, g, along_r * r)


@inlined
def tension_energy(gamma, gq, qr):
    """Potential energy beyond the quadratic part, gamma (gq qr + qr^2 / 4)."""
    return gamma * qr * (gq + 0.25 * qr)


@inlined
def mode_energy(omega, q, p):
    """Energy of linear modes, (p^2 + omega^2 q^2) / 2."""
    oq = omega * q
    return 0.5 * fma(p, p, oq * oq)


@inlined
def mode_power(damping, k, c, force, p):
    """Rate of change of the energy of linear modes: by the acceleration *k*, a contact force along *c*, and damping."""
    return p * (fma(force, c, k) - (2.0 * damping) * p)


@inlined
def turned(own, own_less_one, across, other):
    """One row of the flow of a linear mode, its diagonal stored less one.

    Over a short step a slow mode hardly moves: its flow is nearly the identity, and rounded as such it would
    be off by the same bit at every step, a false damping or frequency of 1e-11.
    """
    return own + fma(own_less_one, own, across * other)


@inlined
def rotation(damping, omega_squared, sine_over, cosine_less_one, decay_less_one):
    """The exact flow of a damped linear mode over a time.

    With sigma = zeta omega, omega_d = omega sqrt(1 - zeta^2), ``sine_over`` = sin(omega_d t)/omega_d,
    ``cosine_less_one`` = cos(omega_d t) - 1 and ``decay_less_one`` = exp(-sigma t) - 1, returns the rows
    (a11 - 1, a12, a21, a22 - 1) of (q, p)(t) = A (q, p)(0).
    """
    ds, decayed = damping * sine_over, 1.0 + decay_less_one
    a11 = fma(decayed, cosine_less_one + ds, decay_less_one)
    a12 = decayed * sine_over
    a21 = (0.0 - omega_squared) * a12
    a22 = fma(decayed, cosine_less_one - ds, decay_less_one)
    return a11, a12, a21, a22


@inlined
def sincos(x):
    """Sine and cosine from additions and multiplications alone; see :func:`sincos_cosm1`."""
    sine, cosine, _ = sincos_cosm1(x)
    return sine, cosine


@inlined
def sincos_cosm1(x):
    """Sine, cosine and cosine - 1 from additions and multiplications alone, the same in lanes and in scalars.

    Argument reduction in three steps and Taylor polynomials on [-pi/4, pi/4]; within 3e-16 for
    |x| < 1e5.
    """
    k = vfloor(fma(x, 0.6366197723675814, 0.5))
    r = fma(k, -_HALF_PI_1, x)
    r = fma(k, -_HALF_PI_2, r)
    r = fma(k, -_HALF_PI_3, r)
    z = r * r
    s = fma(z, 2.811457254345521e-15, -7.647163731819816e-13)
    s = fma(z, s, 1.605904383682161e-10)
    s = fma(z, s, -2.505210838544172e-08)
    s = fma(z, s, 2.755731922398589e-06)
    s = fma(z, s, -1.984126984126984e-04)
    s = fma(z, s, 8.333333333333333e-03)
    s = fma(z, s, -1.666666666666667e-01)
    s = fma(z * r, s, r)
    c = fma(z, 4.779477332387385e-14, -1.147074559772973e-11)
    c = fma(z, c, 2.087675698786810e-09)
    c = fma(z, c, -2.755731922398589e-07)
    c = fma(z, c, 2.480158730158730e-05)
    c = fma(z, c, -1.388888888888889e-03)
    c = fma(z, c, 4.166666666666666e-02)
    c = fma(z, c, -0.5)
    c_less_one = z * c
    c = fma(z, c, 1.0)
    quadrant = k - 4.0 * vfloor(0.25 * k)
    odd = quadrant - 2.0 * vfloor(0.5 * quadrant)
    sine = select_less(odd, 0.5, s, c)
    cosine = select_less(odd, 0.5, c, s)
    middle = quadrant - 1.5
    sine = sine * select_less(middle, 0.0, 1.0, -1.0)
    cosine = cosine * select_less(middle * middle, 1.0, -1.0, 1.0)
    return sine, cosine, select_less(quadrant, 0.5, c_less_one, cosine - 1.0)


@inlined
def decay_less_one(x):
    """exp(-x) - 1 for |x| <= 4 from multiplications and additions alone, within 2e-14 of exp(-x)."""
    y = x * -0.0625
    e = fma(y, 2.08767569878681e-09, 2.505210838544172e-08)
    e = fma(y, e, 2.755731922398589e-07)
    e = fma(y, e, 2.755731922398589e-06)
    e = fma(y, e, 2.480158730158730e-05)
    e = fma(y, e, 1.984126984126984e-04)
    e = fma(y, e, 1.388888888888889e-03)
    e = fma(y, e, 8.333333333333333e-03)
    e = fma(y, e, 4.166666666666666e-02)
    e = fma(y, e, 1.666666666666667e-01)
    e = fma(y, e, 0.5)
    e = fma(y, e, 1.0)
    e = y * e
    e = e * (e + 2.0)
    e = e * (e + 2.0)
    e = e * (e + 2.0)
    return e * (e + 2.0)


@inlined
def shaker_motion(amplitude, omega, sine, cosine):
    """Displacement from the start and velocity of the shaker at a phase (Eq. 16).

    w_s(t) - w_s(0) = A sin(omega t) with A = V b omega_1 / omega.
    """
    return amplitude * sine, amplitude * omega * cosine
