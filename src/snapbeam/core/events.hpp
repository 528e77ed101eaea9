// Inside a step: bounds that exclude an event, and the motion between the ends of a step.
//
// Until *safe* an open contact cannot close: its gap is larger than what the largest speed covers.  In a time up to a horizon
//
//   |(r.q)'| <= MARGIN sum_i |r_i| (p_i^2 + omega_i^2 q_i^2)^(1/2) + horizon (|r.k| + sum_j |M_rj| |f_j|_max),
//
// the first term for the free motion of the modes, the second for every force that acts: one that depends on time alone by its
// amplitude, a force of position by its value and its stiffness, one of velocity by its damping.  Whenever a contact opens or closes,
// or while one is closed, nothing is trusted beyond the step.  A bound that is not finite excludes nothing.
//
// Where the bound excludes nothing, the cubic through both ends of the step serves if it stays away from zero by more than its
// error, |r_i| (omega_i h)^4/384 of the amplitude of each mode, at most 2.5 amplitudes.  Else the motion is followed with the
// flows of the modes, in parts much shorter than the period of the fastest mode, under accelerations that vary linearly between
// those of both ends.
#pragma once
#include "step.hpp"

namespace SNAPBEAM_SET {

constexpr double MARGIN = 1.25, TRUST = 8.0, NEVER = 1e300;
// The motion inside a step, part after part.
template <class L, class Cell = typename L::Plain, class Number = typename L::Real> struct Inside {
    typedef typename L::Real Real;
    typedef typename L::Plain Plain;
    Cell *q, *p, *a, *change, *flow;  // with derivatives or without
    Real parts, share;
    Number part, half;

    static constexpr int ROWS = 8;  // a flow has four
    SNAPBEAM_FN void begin(const Runs<L> &z, Cell *memory) {
        const Structure<L> &s = *z.s;
        const int n = s.size();
        q = memory, p = q + n, a = p + n, change = a + n, flow = change + n;
        parts = z.parts;
        SNAPBEAM_LOOP
        for (int i = 0; i < n; ++i) q[i] = as<Cell>(z.q[i]), p[i] = as<Cell>(z.p[i]), a[i] = as<Cell>(z.k[i]), change[i] = as<Cell>(z.k1[i]);
        for (int j = 0; j < z.channels; ++j) {
            const Channel<L> &c = z.channel[j];
            if (!c.active || c.law == AXIAL_LOAD) continue;
            const Cell first = Cell(as<Number>(c.first_f)), last = Cell(as<Number>(c.f));
            SNAPBEAM_LOOP
            for (int i = 0; i < n; ++i) a[i] = fma(first, as<Cell>(c.row[i]), a[i]), change[i] = fma(last, as<Cell>(c.row[i]), change[i]);
        }
        const Real per = Real(1.0) / parts;
        part = as<Number>(z.h) * per, half = Number(0.5) * part, share = Real(0.0);
        SNAPBEAM_LOOP
        for (int i = 0; i < n; ++i) {
            change[i] = Cell(per) * (change[i] - a[i]);
            set_flow(Cell(part), as<Cell>(s.sigma[i]), as<Cell>(s.omega[i]), flow + 4 * i);
        }
    }
    SNAPBEAM_FN void advance(const Structure<L> &s) {  // half a kick, a flow, half a kick
        const Cell first = Cell(half * share);
        share += Real(1.0);
        const Cell last = Cell(half * share), h = Cell(half);
        SNAPBEAM_LOOP
        for (int i = 0; i < s.size(); ++i) {
            const Cell x = q[i], y = fma(h, a[i], fma(first, change[i], p[i]));
            const Cell *f = flow + 4 * i;
            q[i] = x + fma(f[0], x, f[1] * y);
            p[i] = fma(h, a[i], fma(last, change[i], y + fma(f[3], y, f[2] * x)));
        }
    }
    // Acceleration along a row.
    template <class Row> SNAPBEAM_FN Number bend(const Structure<L> &s, const Row &row) const {
        Cell sum = Cell(0.0);
        SNAPBEAM_LOOP
        for (int i = 0; i < s.size(); ++i) {
            const Cell omega = as<Cell>(s.omega[i]), sigma = as<Cell>(s.sigma[i]);
            const Cell own = fma(Cell(share), change[i], a[i]) - omega * omega * q[i] - Cell(2.0) * sigma * p[i];
            sum = fma(as<Cell>(row[i]), own, sum);
        }
        return L::total(sum);
    }
};

// Acceleration along a row at the beginning (*last* false) or the end of a step.
template <class L, class Row, class Cell = typename L::Cell> SNAPBEAM_CALLED typename L::Number bend_at(const Runs<L> &z, const Row &row, bool last) {
    const Structure<L> &s = *z.s;
    const Cell *q = last ? z.q1 : z.q, *p = last ? z.p1 : z.p, *k = last ? z.k1 : z.k;
    Cell sum = Cell(0.0);
    SNAPBEAM_LOOP
    for (int i = 0; i < s.size(); ++i) {
        const Cell omega = Cell(s.omega[i]), sigma = Cell(s.sigma[i]);
        Cell own = k[i] - omega * omega * q[i] - Cell(2.0) * sigma * p[i];
        for (int j = 0; j < z.channels; ++j) {
            const Channel<L> &c = z.channel[j];
            if (c.active && c.law != AXIAL_LOAD) own = fma(Cell(last ? c.f : c.first_f), c.row[i], own);
        }
        sum = fma(Cell(row[i]), own, sum);
    }
    return L::total(sum);
}

// Bounds of (p^2 + omega^2 q^2)^(1/2) of the modes within a horizon (s), at most 1.09 times as large at its beginning: a + (2^(1/2) - 1) b,
// a >= b, times the growth of modes without damping but with its opposite.
template <class L> SNAPBEAM_FN void amplitudes(const Runs<L> &z, typename L::Plain *amplitude, typename L::Real horizon) {
    SNAPBEAM_LOOP
    for (int i = 0; i < z.s->size(); ++i) {
        const typename L::Plain oq = abs(value(z.s->omega[i]) * value(z.q[i])), p = abs(value(z.p[i]));
        amplitude[i] = fma(typename L::Plain(0.4142135623730952), min(oq, p), max(oq, p));
    }
    if (!(z.s->growth > 0.0)) return;
    const typename L::Plain most = typename L::Plain(exp(horizon * typename L::Real(z.s->growth)));
    for (int i = 0; i < z.s->size(); ++i) amplitude[i] = amplitude[i] * most;
}

// Bound of the sum of a channel's signals, of which *of* gives that of each.
template <class L, class F> SNAPBEAM_FN typename L::Real bound_of_signals(const Runs<L> &z, const Channel<L> &c, F of) {
    typename L::Real s = typename L::Real(0.0);
    SNAPBEAM_LOOP
    for (int i = 0; i < c.uses; ++i) s = fma(typename L::Real(c.factor[i] < 0.0 ? -c.factor[i] : c.factor[i]), value(of(z.signal[c.signal[i]])), s);
    return s;
}
// Largest acceleration along a row that forces may have within a horizon (s); *row_of* j gives r.r_j.
template <class L, class Row, class Product, class Real = typename L::Real, class Number = typename L::Number>
SNAPBEAM_FN Real largest_push(const Runs<L> &z, const Row &row, typename L::Real horizon, const typename L::Plain *amplitude, Product product) {
    const int n = z.s->size();
    Real push = max(abs(value(dot<L>(row, z.k, n))), abs(value(dot<L>(row, z.k1, n))));
    for (int j = 0; j < z.channels; ++j) {
        const Channel<L> &c = z.channel[j];
        if (!c.active) continue;
        Real most = max(abs(value(c.first_f)), abs(value(c.f)));
        if (c.timed) {
            most = bound_of_signals(z, c, [&](const Signal<L> &one) { return c.law == BASE ? one.greatest_bend() : one.greatest_value(); });
        } else if (!c.contact) {
            typename L::Plain sum = typename L::Plain(0.0);
            SNAPBEAM_LOOP
            for (int i = 0; i < n; ++i) sum = fma(abs(value(c.row[i])), amplitude[i], sum);
            const Real speed = L::total(sum);
            const Number x = c.x, reach = Number(Real(MARGIN) * speed * horizon);
            const Real damping = with_law(c.law, [&](auto law) {
                const auto at = [&](Number u) { return abs(law.damping(u, Number(speed), c.numbers())); };
                return value(law.rough ? most_within(law, x, reach, at) : at(x));
            });
            // where the range may be left, nothing is known
            const Real stiffness = with_law(c.law, [&](auto law) {
                const Number left = x - reach, right = x + reach;
                const Number known = most_within(law, x, reach, [&](Number u) { return law.stiffness(u, c.numbers()); });
                return value(select((left > law.low(c.numbers())) & (right < law.high(c.numbers())), known, Number(NEVER)));
            });
            most += speed * (stiffness * horizon + damping);
        } else {
            most = Real(2.0) * most;
        }
        if (c.law == AXIAL_LOAD) {  // along g and along Gq, as much as q is at most
            push += most * abs(value(dot<L>(row, z.s->g, n)));
            push += most * abs(value(dot<L>(row, z.r, n)));
        } else {
            push = fma(abs(product(j)), most, push);
        }
    }
    return push;
}

}  // namespace SNAPBEAM_SET
