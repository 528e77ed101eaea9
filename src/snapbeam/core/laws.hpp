// Laws: the physics of a scalar force, once, for a number of any type.
//
// Of a contact, x is the penetration d > 0 and y its rate; of any other force, displacement u and velocity v along its row.  P
// are the numbers of the law.  A law has
//
//   numbers                how many it has
//   force(x, y, P)         force along the row: of a contact on the beam, away from the striker
//   potential(x, P)        energy stored, J; the elastic part of the force is its derivative (of a contact), or minus that
//   stiffness(x, P)        magnitude of the derivative of the elastic force by x, at most a bound of it; in any interval of its
//                          range the largest at an end
//   damping(x, y, P)       derivative of the force by d' or -v, exact if it is affine, else a bound of it for speeds up to |y|
//   pressing(x, y, P)      of a lossy contact: what has the sign of the force, smooth down to x = 0
//   low(P), high(P)        displacements between which it is valid (of a force)
//   loss(x, y, f, P)       power lost by the force f (of a force)
//   reversal(P)            speed scale over which a force reverses with the sign of y: v_0 of tanh(y/v_0), 0 of |y| y; else infinite
//
// affine: the force is linear in y;  contact: it acts while the contact is closed;  lossy: the force depends on y;  timed: the force
// is the channel's signal;  state(P): place among the numbers of a state of the law's own, or -1;  rough: bounds may be largest anywhere.
//
// A circuit has a state z that changes with time, its x.  A contact with memory has one that stays as it is until
// the contact turns back from beyond yield(P); then it grows to grown(x, P), and so does what x is measured from.  An impulsive
// contact lasts no time, or is held together by the force that this takes (impact.hpp).
#pragma once
#include "dual.hpp"

namespace SNAPBEAM_SET {

// The one table of laws, by their numbers.
#define SNAPBEAM_EACH_LAW(LAW) \
    LAW(HERTZ, Hertz) LAW(POWER_LAW, PowerLaw) LAW(LAYERED_HERTZ, LayeredHertz) LAW(HUNT_CROSSLEY, HuntCrossley) \
    LAW(KELVIN_VOIGT, KelvinVoigt) LAW(LOCAL_SPRING, LocalSpring) LAW(ELECTROSTATIC, Electrostatic) LAW(MAGNETIC, Magnetic) \
    LAW(QUADRATIC_DAMPING, QuadraticDamping) LAW(COULOMB_FRICTION, CoulombFriction) LAW(LINEAR_DAMPING, LinearDamping) \
    LAW(EXTERNAL_FORCE, Timed) LAW(BASE, Timed) LAW(AXIAL_LOAD, Timed) LAW(CIRCUIT, Circuit) LAW(USER_CONTACT, UserContact) \
    LAW(USER_LOSSY_CONTACT, UserLossyContact) LAW(USER_FORCE, UserForce) LAW(USER_LOSSY_FORCE, UserLossyForce) \
    LAW(ELASTIC_PLASTIC, ElasticPlastic) LAW(RESTITUTION, Restitution) LAW(USER_MEMORY_CONTACT, UserMemoryContact)
#define SNAPBEAM_LAW(NUMBER, LAW) NUMBER,
enum LawNumber : int { SNAPBEAM_EACH_LAW(SNAPBEAM_LAW) LAWS };
#undef SNAPBEAM_LAW
constexpr bool of_user(int law) { return (law >= USER_CONTACT && law <= USER_LOSSY_FORCE) || law == USER_MEMORY_CONTACT; }
// Nodes and weights of Gauss's rule of four points on [0, 1].
constexpr double GAUSS_NODE[4] = {0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970262};
constexpr double GAUSS_SHARE[4] = {0.17392742256872692, 0.32607257743127307, 0.32607257743127307, 0.17392742256872692};

template <int NUMBERS, bool CONTACT> struct Law {
    static constexpr int numbers = NUMBERS;
    static int state(const double *) { return -1; }
    static constexpr bool contact = CONTACT, lossy = false, timed = false, affine = CONTACT, memory = false, impulsive = false, rough = false;
    template <class T> static SNAPBEAM_FN T damping(T, T, const T *) { return T(0.0); }
    template <class T> static SNAPBEAM_FN T pressing(T, T, const T *) { return T(1.0); }
    template <class T> static SNAPBEAM_FN T yield(const T *) { return T(INFINITY); }
    template <class T> static SNAPBEAM_FN T grown(T, const T *) { return T(0.0); }
    template <class T> static SNAPBEAM_FN T loss(T, T y, T f, const T *) { return -(f * y); }
    template <class T> static SNAPBEAM_FN T reversal(const T *) { return T(INFINITY); }
    template <class T> static SNAPBEAM_FN T low(const T *) { return T(-INFINITY); }
    template <class T> static SNAPBEAM_FN T high(const T *) { return T(INFINITY); }
};
template <int NUMBERS> using ContactLaw = Law<NUMBERS, true>;
template <int NUMBERS> struct ForceLaw : Law<NUMBERS, false> {  // a contact has no force, potential and stiffness by default
    template <class T> static SNAPBEAM_FN T force(T, T, const T *) { return T(0.0); }
    template <class T> static SNAPBEAM_FN T potential(T, const T *) { return T(0.0); }
    template <class T> static SNAPBEAM_FN T stiffness(T, const T *) { return T(0.0); }
};

struct Hertz : ContactLaw<1> {  // f = k d^(3/2)
    template <class T> static SNAPBEAM_FN T force(T d, T, const T *P) { return P[0] * d * sqrt(d); }
    template <class T> static SNAPBEAM_FN T potential(T d, const T *P) { return T(0.4) * P[0] * d * d * sqrt(d); }
    template <class T> static SNAPBEAM_FN T stiffness(T d, const T *P) { return T(1.5) * P[0] * sqrt(d); }
};
struct PowerLaw : ContactLaw<2> {  // f = f_1 (d / 1 um)^n
    template <class T> static SNAPBEAM_FN T force(T d, T, const T *P) { return P[0] * power(T(1e6) * d, P[1]); }
    template <class T> static SNAPBEAM_FN T potential(T d, const T *P) { return force(d, d, P) * d / (P[1] + T(1.0)); }
    template <class T> static SNAPBEAM_FN T stiffness(T d, const T *P) {
        return T(1e6) * P[0] * P[1] * exp((P[1] - T(1.0)) * log(max(T(1e6) * d, T(1e-300))));
    }
};
// Hertz's contact of stiffness k in series with a layer of stiffness k_l: d = (f/k)^(2/3) + (f/k_l)^(1/2).  With
// d_l = s^3 and c = (k_l/k)^(2/3), d = s^3 (1 + c s), solved by Newton's method from above.
struct LayeredHertz : ContactLaw<2> {
    template <class T> static SNAPBEAM_FN T of_layer(T d, const T *P) {
        const T c = power(P[1] / P[0], T(2.0 / 3.0)), positive = max(d, T(1e-300));
        T s = min(power(positive, T(1.0 / 3.0)), power(positive / c, T(0.25)));
        for (int i = 0; i < 7; ++i) s -= (s * s * s * (T(1.0) + c * s) - positive) / (s * s * (T(3.0) + T(4.0) * c * s));
        return select(d > T(0.0), s * s * s, T(0.0));
    }
    template <class T> static SNAPBEAM_FN T force(T d, T, const T *P) {
        const T layer = of_layer(d, P);
        return P[1] * layer * layer;
    }
    template <class T> static SNAPBEAM_FN T potential(T d, const T *P) {
        const T layer = of_layer(d, P);
        return P[1] * layer * layer * (T(0.4) * (d - layer) + layer * T(1.0 / 3.0));
    }
    template <class T> static SNAPBEAM_FN T stiffness(T d, const T *P) {
        const T layer = max(of_layer(d, P), T(1e-300));
        return P[1] * layer * layer / ((d - layer) * T(1.0 / 1.5) + T(0.5) * layer);
    }
};
struct HuntCrossley : Hertz {  // f = k d^(3/2) (1 + chi d')
    static constexpr int numbers = 2;
    static constexpr bool lossy = true;
    template <class T> static SNAPBEAM_FN T pressing(T, T y, const T *P) { return fma(P[1], y, T(1.0)); }
    template <class T> static SNAPBEAM_FN T force(T d, T y, const T *P) { return P[0] * d * sqrt(d) * fma(P[1], y, T(1.0)); }
    template <class T> static SNAPBEAM_FN T damping(T d, T, const T *P) { return P[1] * P[0] * d * sqrt(d); }
};
struct KelvinVoigt : ContactLaw<2> {  // f = k d + c d'
    static constexpr bool lossy = true;
    template <class T> static SNAPBEAM_FN T force(T d, T y, const T *P) { return fma(P[0], d, P[1] * y); }
    template <class T> static SNAPBEAM_FN T pressing(T d, T y, const T *P) { return force(d, y, P); }
    template <class T> static SNAPBEAM_FN T potential(T d, const T *P) { return T(0.5) * P[0] * d * d; }
    template <class T> static SNAPBEAM_FN T stiffness(T, const T *P) { return P[0]; }
    template <class T> static SNAPBEAM_FN T damping(T, T, const T *P) { return P[1]; }
};

// f = min[k_1 (d + D), k_2 d]; P: k_1, k_2, D.  What unloads from d_m beyond the yield leaves D = (d_m + D) (1 - k_1/k_2).
struct ElasticPlastic : ContactLaw<3> {
    static int state(const double *) { return 2; }
    static constexpr bool memory = true;
    // y > 0: it is known to yield, y < 0: it is known to be elastic, so that derivatives are right where both are equal
    template <class T> static SNAPBEAM_FN T force(T d, T y, const T *P) {
        const T yields = P[0] * (d + P[2]), elastic = P[1] * d;
        return select(y > T(0.0), yields, select(y < T(0.0), elastic, min(yields, elastic)));
    }
    template <class T> static SNAPBEAM_FN T yield(const T *P) {
        const T stiffer = P[1] - P[0];
        return select(stiffer > T(0.0), P[2] * P[0] / max(stiffer, T(1e-300)), T(INFINITY));
    }
    template <class T> static SNAPBEAM_FN T potential(T d, const T *P) {  // the integral of the force, with what unloading will not give back
        const T whole = d + P[2], first = T(0.5) * (P[0] * whole * whole - P[0] * P[1] * P[2] * P[2] / max(P[1] - P[0], T(1e-300)));
        return select(P[1] * d > P[0] * whole, first, T(0.5) * P[1] * d * d);
    }
    template <class T> static SNAPBEAM_FN T stiffness(T, const T *P) { return P[1]; }
    template <class T> static SNAPBEAM_FN T grown(T d, const T *P) { return max((d + P[2]) * (T(1.0) - P[0] / P[1]), P[2]); }
};
// Newton's law: the velocity of separation is e times that of approach.  P: e, then of the constraint that holds the contact
// together r.omega^2 r/(r.r)^2, the stiffness that it cancels along the row.
struct Restitution : ContactLaw<2> {
    static constexpr bool lossy = true, affine = false, impulsive = true;
    template <class T> static SNAPBEAM_FN T force(T, T, const T *) { return T(0.0); }
    template <class T> static SNAPBEAM_FN T potential(T, const T *) { return T(0.0); }
    template <class T> static SNAPBEAM_FN T stiffness(T, const T *P) { return P[1]; }
};

struct LocalSpring : ForceLaw<2> {  // f = -(k + k_3 u^2) u; one that softens is valid up to where its force is zero
    template <class T> static SNAPBEAM_FN T force(T u, T, const T *P) { return -(u * fma(P[1], u * u, P[0])); }
    template <class T> static SNAPBEAM_FN T potential(T u, const T *P) { return u * u * fma(T(0.25) * P[1], u * u, T(0.5) * P[0]); }
    template <class T> static SNAPBEAM_FN T stiffness(T u, const T *P) { return abs(P[0]) + T(3.0) * abs(P[1]) * u * u; }
    template <class T> static SNAPBEAM_FN T high(const T *P) {
        return select((P[0] > T(0.0)) & (P[1] < T(0.0)), sqrt(P[0] / max(-P[1], T(1e-300))), T(INFINITY));
    }
    template <class T> static SNAPBEAM_FN T low(const T *P) { return -high(P); }
};
// f = sign(g) a / (g - u)^2 towards a plate or magnet at g; P: a, g.
struct Magnetic : ForceLaw<2> {
    template <class T> static SNAPBEAM_FN T force(T u, T, const T *P) {
        const T away = P[1] - u;
        return select(P[1] > T(0.0), P[0], -P[0]) / (away * away);
    }
    template <class T> static SNAPBEAM_FN T potential(T u, const T *P) { return -(P[0] / abs(P[1] - u)); }
    template <class T> static SNAPBEAM_FN T stiffness(T u, const T *P) {
        const T away = abs(P[1] - u);
        return T(2.0) * abs(P[0]) / (away * away * away);
    }
    template <class T> static SNAPBEAM_FN T low(const T *P) { return select(P[1] > T(0.0), T(-INFINITY), P[1]); }
    template <class T> static SNAPBEAM_FN T high(const T *P) { return select(P[1] > T(0.0), P[1], T(INFINITY)); }
};
struct Electrostatic : ForceLaw<3> {  // the same with a = eps_0 A V^2 / 2; P: V, A, g
    template <class T> struct Pull {
        T P[2];
        SNAPBEAM_FN explicit Pull(const T *given) {
            P[0] = T(0.5 * 8.8541878188e-12) * given[1] * given[0] * given[0], P[1] = given[2];
        }
    };
    template <class T> static SNAPBEAM_FN T force(T u, T v, const T *P) { return Magnetic::force(u, v, Pull<T>(P).P); }
    template <class T> static SNAPBEAM_FN T potential(T u, const T *P) { return Magnetic::potential(u, Pull<T>(P).P); }
    template <class T> static SNAPBEAM_FN T stiffness(T u, const T *P) { return Magnetic::stiffness(u, Pull<T>(P).P); }
    template <class T> static SNAPBEAM_FN T low(const T *P) { return Magnetic::low(Pull<T>(P).P); }
    template <class T> static SNAPBEAM_FN T high(const T *P) { return Magnetic::high(Pull<T>(P).P); }
};
struct QuadraticDamping : ForceLaw<1> {  // f = -c |v| v
    static constexpr bool lossy = true;
    template <class T> static SNAPBEAM_FN T force(T, T v, const T *P) { return -(P[0] * abs(v) * v); }
    template <class T> static SNAPBEAM_FN T damping(T, T v, const T *P) { return T(2.0) * P[0] * abs(v); }
    template <class T> static SNAPBEAM_FN T reversal(const T *) { return T(0.0); }
};
struct CoulombFriction : ForceLaw<2> {  // f = -F tanh(v / v_0)
    static constexpr bool lossy = true;
    template <class T> static SNAPBEAM_FN T force(T, T v, const T *P) { return -(P[0] * tanh(v / P[1])); }
    template <class T> static SNAPBEAM_FN T damping(T, T, const T *P) { return P[0] / P[1]; }
    template <class T> static SNAPBEAM_FN T reversal(const T *P) { return P[1]; }
};
struct LinearDamping : ForceLaw<1> {  // f = -c v, as of a circuit without inertia
    static constexpr bool lossy = true, affine = true;
    template <class T> static SNAPBEAM_FN T force(T, T v, const T *P) { return -(P[0] * v); }
    template <class T> static SNAPBEAM_FN T damping(T, T, const T *P) { return P[0]; }
};
// A harvester's circuit: f = z, z' = -v - lam z, of which z^2/2 is the energy.  P: lam, then g where it follows the beam, so that
// f = g (x - v), and 0 elsewhere; z at last (step.hpp).
struct Circuit : ForceLaw<3> {
    static int state(const double *) { return 2; }
    static constexpr bool lossy = true, affine = true;
    template <class T> static SNAPBEAM_FN auto follows(const T *P) { return P[1] > T(0.0); }
    template <class T> static SNAPBEAM_FN T force(T x, T v, const T *P) { return select(follows(P), P[1] * (x - v), x); }
    template <class T> static SNAPBEAM_FN T loss(T, T, T f, const T *P) { return P[0] * f * f; }
    template <class T> static SNAPBEAM_FN T potential(T z, const T *) { return T(0.5) * z * z; }
    template <class T> static SNAPBEAM_FN T stiffness(T, const T *) { return T(1.0); }
    template <class T> static SNAPBEAM_FN T damping(T, T, const T *P) { return P[1]; }
};
struct Timed : ForceLaw<0> {  // the signal of the channel: a force, the acceleration of a base, or an axial load
    static constexpr bool timed = true;
};

// Laws of a user: functions of the host, called run by run.  Their addresses are the first numbers, bit for bit; null: none, as in a
// lane without a run.  Then the range, the step of differences (0: 1e-5 of x, or no elastic part), the speed scale of a reversal, and how many numbers follow.
struct User {
    enum Number : int { ELASTIC, ENERGY, SLOPE, LOSSY, DAMPING, YIELD, GROWN, LOW, HIGH, SPAN, REVERSAL, COUNT, OWN, MOST = OWN + 55 };
    typedef double (*Function)(double x, double y, const double *numbers);

    static Function function(int which, const double *P) {
        Function found;
        __builtin_memcpy(&found, P + which, sizeof found);
        return found;
    }
    // Where the law is not valid a function is not called.
    static double call(int which, double x, double y, const double *P) {
        const Function f = function(which, P);
        if (!f) return 0.0;
        return x > P[LOW] && x < P[HIGH] && y - y == 0.0 ? f(x, y, P + OWN) : NAN;
    }
    static double elastic(double x, double, const double *P) { return call(ELASTIC, x, 0.0, P); }
    static double energy(double x, double, const double *P) {
        if (function(ENERGY, P)) return call(ENERGY, x, 0.0, P);
        double sum = 0.0;  // x s^2: of a contact, whose force may begin with a root
        for (int part = 0; part < 6 && function(ELASTIC, P); ++part)
            for (int i = 0; i < 4; ++i) {
                const double s = (part + GAUSS_NODE[i]) / 6.0;
                sum += GAUSS_SHARE[i] / 6.0 * 2.0 * s * elastic(x * s * s, 0.0, P);
            }
        return x * sum;
    }
    static double bound(double x) { return x == x ? abs(x) : INFINITY; }
    static double slope(double x, double, const double *P) {
        if (function(SLOPE, P)) return bound(call(SLOPE, x, 0.0, P));
        if (!function(ELASTIC, P)) return 0.0;
        const double h = P[SPAN] > 0.0 ? min(P[SPAN], 0.1 * min(x - P[LOW], P[HIGH] - x)) : 1e-5 * x;
        return bound((elastic(x + h, 0.0, P) - elastic(x - h, 0.0, P)) / (2.0 * h));
    }
    static double whole(double x, double y, const double *P) { return elastic(x, y, P) + call(LOSSY, x, y, P); }
    static double coefficient(double x, double, const double *P) { return call(DAMPING, x, 0.0, P); }
    static double yield(double, double, const double *P) { return call(YIELD, 1.0, 0.0, P); }  // of no penetration
    static double grown(double x, double, const double *P) { return call(GROWN, x, 0.0, P); }
    static double greatest_damping(double x, double y, const double *P) {  // for speeds up to |y|
        double most = bound(call(DAMPING, x, 0.0, P));
        for (double part = 1.0; part > 0.05; part *= 0.25)
            most = max(most, max(bound(call(DAMPING, x, part * y, P)), bound(call(DAMPING, x, -part * y, P))));
        return most;
    }

    template <class F> static SNAPBEAM_RARE double each(double x, double y, const double *P, F f) { return f(x, y, P); }
    template <int W, class F> static SNAPBEAM_RARE Pack<W> each(const Pack<W> &x, const Pack<W> &y, const Pack<W> *P, F f) {
        Pack<W> found;
        for (int l = 0; l < W; ++l) {
            double own[MOST];
            for (int i = 0; i < OWN + int(lane(P[COUNT], l)); ++i) own[i] = lane(P[i], l);
            found.set(l, f(lane(x, l), lane(y, l), own));
        }
        return found;
    }
    // Derivatives by differences.
    template <int K, class F> static SNAPBEAM_RARE Dual<K> each(const Dual<K> &x, const Dual<K> &y, const Dual<K> *P, F f) {
        const int count = OWN + int(P[COUNT].v);
        double own[MOST], u = x.v, v = y.v;
        for (int i = 0; i < count; ++i) own[i] = P[i].v;
        Dual<K> found(f(u, v, own));
        const auto along = [&](double &at, const Pack<K> &d) {
            if (!any(differ(d, Pack<K>(0.0)))) return;
            const double kept = at, h = 1e-6 * max(abs(kept), 1e-9);
            at = kept + h;
            const double above = f(u, v, own);
            at = kept - h;
            found.d += Pack<K>((above - f(u, v, own)) / (2.0 * h)) * d;
            at = kept;
        };
        along(u, x.d), along(v, y.d);
        for (int i = OWN; i < count; ++i) along(own[i], P[i].d);
        return found;
    }
};
struct UserContact : ContactLaw<User::OWN> {
    static constexpr bool rough = true;
    template <class T> static SNAPBEAM_FN T pressed(T d) { return max(d, T(1e-30)); }
    template <class T> static SNAPBEAM_FN T force(T d, T, const T *P) { return User::each(pressed(d), T(0.0), P, User::elastic); }
    template <class T> static SNAPBEAM_FN T potential(T d, const T *P) { return User::each(pressed(d), T(0.0), P, User::energy); }
    template <class T> static SNAPBEAM_FN T stiffness(T d, const T *P) { return User::each(pressed(d), T(0.0), P, User::slope); }
};
struct UserLossyContact : UserContact {  // f = elastic + coefficient d'
    static constexpr bool lossy = true;
    template <class T> static SNAPBEAM_FN T coefficient(T d, const T *P) { return User::each(pressed(d), T(0.0), P, User::coefficient); }
    template <class T> static SNAPBEAM_FN T force(T d, T y, const T *P) { return fma(coefficient(d, P), y, UserContact::force(d, y, P)); }
    template <class T> static SNAPBEAM_FN T damping(T d, T, const T *P) { return coefficient(d, P); }
    template <class T> static SNAPBEAM_FN T pressing(T d, T y, const T *P) {  // as a velocity, nearly linear
        const T lossy = coefficient(d, P), size = abs(lossy);
        return select(size > T(0.0), fma(lossy, y, UserContact::force(d, y, P)) / size, T(1.0));
    }
};
struct UserMemoryContact : UserContact {  // its memory is the last of its numbers
    static constexpr bool memory = true;
    static int state(const double *P) { return User::OWN + int(P[User::COUNT]) - 1; }
    template <class T> static SNAPBEAM_FN T yield(const T *P) { return User::each(T(0.0), T(0.0), P, User::yield); }
    template <class T> static SNAPBEAM_FN T grown(T d, const T *P) { return User::each(d, T(0.0), P, User::grown); }
};
struct UserForce : ForceLaw<User::OWN> {
    static constexpr bool rough = true;
    template <class T> static SNAPBEAM_FN T force(T u, T, const T *P) { return User::each(u, T(0.0), P, User::elastic); }
    template <class T> static SNAPBEAM_FN T potential(T u, const T *P) { return User::each(u, T(0.0), P, User::energy); }
    template <class T> static SNAPBEAM_FN T stiffness(T u, const T *P) { return User::each(u, T(0.0), P, User::slope); }
    template <class T> static SNAPBEAM_FN T low(const T *P) { return P[User::LOW]; }
    template <class T> static SNAPBEAM_FN T high(const T *P) { return P[User::HIGH]; }
};
struct UserLossyForce : UserForce {
    static constexpr bool lossy = true;
    template <class T> static SNAPBEAM_FN T force(T u, T v, const T *P) { return User::each(u, v, P, User::whole); }
    template <class T> static SNAPBEAM_FN T damping(T u, T v, const T *P) { return User::each(u, v, P, User::greatest_damping); }
    template <class T> static SNAPBEAM_FN T reversal(const T *P) { return P[User::REVERSAL]; }
    template <class T> static SNAPBEAM_FN T loss(T u, T v, T f, const T *P) {
        return any(P[User::SPAN] > T(0.0)) ? (UserForce::force(u, v, P) - f) * v : -(f * v);
    }
};

// Largest bound of a law for x - reach to x + reach.
template <class Own, class T, class F> SNAPBEAM_FN T most_within(Own, T x, T reach, F bound) {
    T most = max(bound(x), max(bound(x - reach), bound(x + reach)));
    if constexpr (Own::rough)
        for (double part = 0.25; part < 1.0; part += 0.25) most = max(most, max(bound(x - T(part) * reach), bound(x + T(part) * reach)));
    return most;
}

// Calls function(law) of the law of a number.  A kernel for one structure knows its laws only.
#if !defined(SNAPBEAM_LAWS)
#define SNAPBEAM_LAWS ~0u
#endif
#define SNAPBEAM_LAW(NUMBER, LAW) case NUMBER: if constexpr ((SNAPBEAM_LAWS) >> NUMBER & 1u) return function(LAW()); break;
template <class F> constexpr SNAPBEAM_FN auto with_law(int number, F function) {
    switch (number) { SNAPBEAM_EACH_LAW(SNAPBEAM_LAW) }
    return function(Hertz());
}

// What a kernel knows of its laws: a property that none or all of them have is known without a look.
constexpr bool known(int law) { return (SNAPBEAM_LAWS) >> law & 1u; }
template <class F> constexpr int laws_with(F property) {
    int count = 0;
    for (int law = 0; law < LAWS; ++law) count += known(law) && with_law(law, property);
    return count;
}
template <class F> constexpr bool of_some_law(F property) { return laws_with(property) > 0; }
template <class F> constexpr bool of_every_law(F property) { return laws_with(property) == laws_with([](auto) { return true; }); }
template <bool POSSIBLE, bool CERTAIN = false> struct Flag {
    bool on;
    SNAPBEAM_FN operator bool() const { return CERTAIN || (POSSIBLE && on); }
    SNAPBEAM_FN Flag &operator=(bool value) { on = value; return *this; }
};
struct LawOf {
    int number;
    SNAPBEAM_FN operator int() const { return number; }
    SNAPBEAM_FN LawOf &operator=(int value) { number = value; return *this; }
    SNAPBEAM_FN bool operator==(LawNumber law) const { return known(law) && number == law; }
    SNAPBEAM_FN bool operator!=(LawNumber law) const { return !(*this == law); }
};

}  // namespace SNAPBEAM_SET
