// Dual numbers: a value and its derivatives along K directions, with the operations of a number.
//
//   x = (v, d),   f(x) = (f(v), f'(v) d),   comparisons and choices by the value.
//
// A direction is a change of the initial state, of the numbers of signals and laws, and of the structure, whose large arrays (G, flows)
// are plain numbers with slopes of their own, if it changes; what depends on none stays a plain number.
// The time of an event moves with them: where the gap d is zero with the rate r, a step that ends there is taken once more with a
// length h that has the derivative h' = -d'/r.  Until no contact is closed the state is that at times that move, by *drift*; then, and
// where a signal jumps or a state is handed out, it is taken back to times that do not.  Jumps of forces and velocities are so
// accounted for (saltation).
#pragma once
#include "number.hpp"

namespace SNAPBEAM_SET {

template <int K> struct Dual {
    double v;
    Pack<K> d;
    SNAPBEAM_FN Dual() = default;
    SNAPBEAM_FN Dual(double x) : v(x), d(0.0) {}
    SNAPBEAM_FN Dual(double x, Pack<K> slopes) : v(x), d(slopes) {}
    friend SNAPBEAM_FN Dual operator+(const Dual &a, const Dual &b) { return {a.v + b.v, a.d + b.d}; }
    friend SNAPBEAM_FN Dual operator-(const Dual &a, const Dual &b) { return {a.v - b.v, a.d - b.d}; }
    friend SNAPBEAM_FN Dual operator-(const Dual &a) { return {-a.v, -a.d}; }
    friend SNAPBEAM_FN Dual operator*(const Dual &a, const Dual &b) { return {a.v * b.v, fma(a.v, b.d, b.v * a.d)}; }
    friend SNAPBEAM_FN Dual operator/(const Dual &a, const Dual &b) {
        const double q = a.v / b.v;
        return {q, (a.d - q * b.d) / b.v};
    }
    // with plain numbers
    friend SNAPBEAM_FN Dual operator*(double a, const Dual &b) { return {a * b.v, Pack<K>(a) * b.d}; }
    friend SNAPBEAM_FN Dual operator*(const Dual &a, double b) { return {a.v * b, a.d * Pack<K>(b)}; }
    friend SNAPBEAM_FN bool operator<(const Dual &a, const Dual &b) { return a.v < b.v; }
    friend SNAPBEAM_FN bool operator>(const Dual &a, const Dual &b) { return a.v > b.v; }
    friend SNAPBEAM_FN bool operator<=(const Dual &a, const Dual &b) { return a.v <= b.v; }
    friend SNAPBEAM_FN bool operator>=(const Dual &a, const Dual &b) { return a.v >= b.v; }
    friend SNAPBEAM_FN bool differ(const Dual &a, const Dual &b) { return a.v != b.v; }
    SNAPBEAM_FN Dual &operator+=(const Dual &b) { return *this = *this + b; }
    SNAPBEAM_FN Dual &operator-=(const Dual &b) { return *this = *this - b; }
    SNAPBEAM_FN Dual &operator*=(const Dual &b) { return *this = *this * b; }
};

template <int K> SNAPBEAM_FN double value(const Dual<K> &x) { return x.v; }
template <int K> SNAPBEAM_FN double lane(const Dual<K> &x, int) { return x.v; }
template <int K> SNAPBEAM_FN void set_lane(Dual<K> &x, int, double y) { x = Dual<K>(y); }
template <int K> SNAPBEAM_FN Dual<K> select(bool m, const Dual<K> &a, const Dual<K> &b) { return m ? a : b; }

template <int K> SNAPBEAM_FN Dual<K> fma(const Dual<K> &a, const Dual<K> &b, const Dual<K> &c) {
    return {fma(a.v, b.v, c.v), fma(Pack<K>(a.v), b.d, fma(Pack<K>(b.v), a.d, c.d))};
}
template <int K> SNAPBEAM_FN Dual<K> fma(double a, const Dual<K> &b, const Dual<K> &c) { return {fma(a, b.v, c.v), fma(Pack<K>(a), b.d, c.d)}; }
template <int K> SNAPBEAM_FN Dual<K> fma(const Dual<K> &a, double b, const Dual<K> &c) { return fma(b, a, c); }
template <int K> SNAPBEAM_FN Dual<K> min(const Dual<K> &a, const Dual<K> &b) { return b.v < a.v ? b : a; }  // of equal ones the first
template <int K> SNAPBEAM_FN Dual<K> max(const Dual<K> &a, const Dual<K> &b) { return b.v > a.v ? b : a; }
template <int K> SNAPBEAM_FN Dual<K> abs(const Dual<K> &x) { return x.v < 0.0 ? -x : x; }
template <int K> SNAPBEAM_FN Dual<K> sqrt(const Dual<K> &x) {  // slope 0 at 0: forces d^(3/2) have none there
    const double root = sqrt(x.v);
    return {root, Pack<K>(root > 0.0 ? 0.5 / root : 0.0) * x.d};
}
template <int K> SNAPBEAM_FN Dual<K> exp(const Dual<K> &x) { const double y = exp(x.v); return {y, Pack<K>(y) * x.d}; }
template <int K> SNAPBEAM_FN Dual<K> log(const Dual<K> &x) { return {log(x.v), Pack<K>(1.0 / x.v) * x.d}; }
template <int K> SNAPBEAM_FN Dual<K> decay_of(const Dual<K> &x) {
    const double less = decay_of(x.v);
    return {less, Pack<K>(-1.0 - less) * x.d};
}
template <int K> SNAPBEAM_FN Dual<K> tanh(const Dual<K> &x) { const double y = tanh(x.v); return {y, Pack<K>(1.0 - y * y) * x.d}; }
template <int K> SNAPBEAM_FN Dual<K> sinh(const Dual<K> &x) { const double y = ::sinh(x.v); return {y, Pack<K>(sqrt(1.0 + y * y)) * x.d}; }
template <int K> SNAPBEAM_FN Turn<Dual<K>> turn(const Dual<K> &x) {
    const Turn<double> w = turn(x.v);
    return {{w.sine, Pack<K>(w.cosine) * x.d}, {w.cosine, Pack<K>(-w.sine) * x.d}, {w.cosine_less_one, Pack<K>(-w.sine) * x.d}};
}

// A number as one of type T, without its derivatives if T has none.
template <class T, class X> SNAPBEAM_FN T as(const X &x) {
    if constexpr (requires(T with) { with.d; }) return T(x);
    else return T(value(x));
}
// A number of one run, with its derivatives if it has any.
template <class T> SNAPBEAM_FN auto part(const T &x, int l) {
    if constexpr (requires { x.d; }) return x;
    else return lane(x, l);
}
template <class T, class X> SNAPBEAM_FN void set_part(T &to, int l, const X &x) {
    if constexpr (requires { to.d; }) to = x;
    else set_lane(to, l, x);
}
// The root of a cubic moves with it.
template <int K> SNAPBEAM_FN Dual<K> root(const Cubic<Dual<K>> &u, const Dual<K> &high, bool wanted) {
    Cubic<double> plain(0.0, 0.0, 0.0, 0.0, 0.0);
    plain.c0 = u.c0.v, plain.c1 = u.c1.v, plain.c2 = u.c2.v, plain.c3 = u.c3.v;
    const double x = root(plain, high.v, wanted);
    return {x, Pack<K>(-1.0 / plain.slope(x)) * u.at(Dual<K>(x)).d};
}

// The layout of one run with K directions.
template <int K> struct Tangents {
    typedef Dual<K> Number;
    typedef double Real;
    typedef Dual<K> Cell;
    typedef double Plain;
    typedef double Coef;
    typedef Dual<K> Shared;
    typedef bool Marks;
    static constexpr int runs = 1, lanes = 1, fixed = 0, together = 1, directions = K;
    template <class X> static SNAPBEAM_FN X total(const X &x) { return x; }
    template <class X> static SNAPBEAM_FN void totals(const X &a, const X &b, X &of_a, X &of_b) { of_a = a, of_b = b; }
    static SNAPBEAM_FN Dual<K> mode(const Dual<K> *row, int i) { return row[i]; }
};

}  // namespace SNAPBEAM_SET
