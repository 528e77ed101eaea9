// One step: kicks by the nonlinear forces and exact flows of the linear modes.
//
//   q' = p,   p' = -omega^2 q - 2 sigma p + k(q, t) + sum_j r_j f_j,
//   k = along_g g + along_r Gq,   along_g = P(t) - gamma q.Gq,   along_r = P(t) - gamma (2 g.q + q.Gq),
//
//   S(h) = B(b_0 h) A(a_0 h) B(b_1 h) ... A(a_(s-1) h) B(b_s h),   A: flow of the modes,   B: kick, in which q does not change.
//
// P is the change of the axial load.  Forces that depend on velocities change within a kick.  Along their rows
//
//   v_i' = a_i + sum_j M_ij f_j(x_j, v_j),   a_i = r_i.k + sum over the other forces,   M_ij = r_i.r_j,
//
// an equation for these velocities alone: the classical method of Runge and Kutta in parts of the kick that resolve the damping.
// One after the other such forces would leave an error of first order in h.  One alone that is linear in v, f = f_e + B y with
// y' = -(a + M f) and x = M B t, is exact:
//
//   y(t) = y_0 e^(-x) - (a + M f_e) t phi_1(x),   phi_1 = (1 - e^(-x))/x,   phi_2 = (1 - phi_1)/x,   phi_3 = (1/2 - phi_2)/x.
//
// A circuit, z' = -v - lam z, is a force z that stays as it is in a kick.  Free modes carry it along as z = -along_q.q - along_p.p,
//
//   along_q = t omega^2/D,   along_p = t lam/D,   D = lam^2 - 2 sigma lam + omega^2,   t its row;
//
// what differs from that dies away by e^(-lam t), so that z after a flow is exact too.  What it loses, lam z^2, kicks add up.
//
// Where it is faster than the step it follows the beam: other accelerations k move it away from there by y, y' = along_p.k - lam y,
// which is along_p.k/lam if they change little within 1/lam.  So, with v and a by along_p,
//
//   f = g (x - v),   x = a/lam - along_q.q,   g = 1/(1 - along_p.t/lam).
//
// In a step f misses the impulse g (y_0 - y_1)/lam, exactly.  By what z differs from f at the first kick it has died away soon, so
// that kick gets g (z - f)/lam, and the last one the rest, which q has not seen before.  At the end y lags by y'/lam.
//
// Whether a contact is closed, and whether a lossy one presses, is fixed for a whole step (events.hpp finds where that changes).
#pragma once
#include "laws.hpp"
#include "signals.hpp"

namespace SNAPBEAM_SET {

template <class L> struct Channel {
    typedef typename L::Number Number;
    typedef typename L::Real Real;
    LawOf law;
    int state;                   // place of a state of its own in P, or -1
    Flag<of_some_law([](auto law) { return law.contact; }), of_every_law([](auto law) { return law.contact; })> contact;
    Flag<of_some_law([](auto law) { return law.lossy; })> lossy;
    Flag<of_some_law([](auto law) { return law.timed; })> timed;
    Flag<of_some_law([](auto law) { return law.memory; })> memory;
    Flag<of_some_law([](auto law) { return law.impulsive; })> impulsive;
    Flag<known(CIRCUIT)> circuit;
    bool affine, harvests, active;
    int uses;                    // signals that it adds
    Held<int, KNOWN_SIGNALS> signal;
    Held<double, KNOWN_SIGNALS> factor;
    Held<typename L::Cell, CELLS> row;  // r, of the runs at hand
    Held<typename L::Cell, known(CIRCUIT) ? CELLS : 0> along_q, along_p;  // of a circuit
    Held<Number, known(CIRCUIT) ? CHANNELS : 0> along_M;  // products of along_p with the rows of all channels
    typename L::Marks follows;   // the circuit follows the beam in the step at hand
    Held<Number, LAW_NUMBERS> P;  // numbers of the law
    Held<Number, CHANNELS> M;    // products with the rows of all channels
    Number rest, offset;         // displacement in the first well; of a contact, penetration there with its signals at 0
    // at a kick: x and y of the law, force; force of the first kick; penetration and rate at both ends
    Number x, y, f, first_f, v;
    Number z;                    // of a circuit, the state at the kick at hand, at last at the end of the step
    Number apart, settled;       // of one that follows, at the first kick: f beside what free modes carry along, and z - f
    Number decay[MOST_DISTINCT]; // of it e^(-lam t) - 1 over each flow of the step
    Number early;                // of a lossy channel 2/w^2 times the integral of (w - t) f over a kick of w: f if it is constant
    Number d0, r0, d1, r1;
    Number tip, tip_slope;       // of a contact, its signals at the end of the step
    typename L::Marks closed, pressing;  // pressing: of one with memory, beyond its yield and deeper ever
    Real onset, safe;            // tick of the onset; time until which the contact cannot close, ticks
    Number begun;                // of the onset the derivatives, s
    // increments of the step, and sums of the run
    Number impulse, work, lost;
    Number own_impulse, deepest, hardest;
    Number sums[snapbeam::OF_CHANNEL];

    SNAPBEAM_FN const Number *numbers() const { return P; }
};

template <class L> struct Runs {
    typedef typename L::Number Number;
    typedef typename L::Real Real;
    typedef typename L::Cell Cell;
    typedef typename L::Plain Plain;
    const Structure<L> *s;
    int channels, signals;
    Channel<L> *channel;
    Signal<L> *signal;
    Held<Cell, CELLS> q, p, k, q1, p1, k1, r;  // state and acceleration by the tension at both ends; Gq at a kick
    const Plain *flows;                   // (distinct flows, cells, 4) of the step
    const Slopes<L> *flow_slopes;         // and their derivatives; null: none
    Number *block;                        // arrays of the velocity block
    int *late;                            // channels of it
    Real t, tick, sign;                   // sign: +1 about the first well, -1 about its mirror image
    Real ticks, parts;                    // length of the step; parts in which it is followed inside
    typename L::Marks jumping;            // the step ends at a jump of a signal
    Number h, drift;                      // s; drift has the value 0, and derivatives where the times of events have
    Cell next_gq;                         // cells of g.q after a flow
    Number gq, qr, along_g, along_r, dissipated;
    bool account;
    bool direct;                          // nothing acts but the tension: the first flow begins from q, p, k
};

constexpr int BLOCK_ARRAYS = 14;
constexpr double FOLLOWS = 8.0;  // decay of a circuit in a step, lam h, beyond which it follows the beam
constexpr double RESOLVED[3] = {3.0, 1.5, 1.5};  // and, of each composition, up to which a step is as long as wanted

template <class L, class X, class Y> SNAPBEAM_FN typename L::Cell dot_cells(const X &a, const Y &b, int n) {
    typename L::Cell s = a[0] * b[0];
    for (int i = 1; i < n; ++i) s = fma(a[i], b[i], s);
    return s;
}
template <class L, class X, class Y> SNAPBEAM_FN typename L::Number dot(const X &a, const Y &b, int n) { return L::total(dot_cells<L>(a, b, n)); }

// Rows at, ..., at + ROWS - 1 of r = Gq for columns of one block; returns their part of q.Gq.
template <int ROWS, class L>
SNAPBEAM_FN typename L::Cell product_rows(const Structure<L> &s, const typename L::Cell *q, typename L::Cell *r, int at, int from, int count) {
    typedef typename L::Cell Cell;
    constexpr int CHAINS = ROWS >= 4 ? 1 : ROWS == 2 ? 2 : 4;  // sums that do not wait for each other
    Cell sum[CHAINS][ROWS];
    for (auto &chain : sum)
        for (auto &x : chain) x = Cell(0.0);
    const typename L::Coef *G = s.G + long(from) * s.size() + at;
    int j = 0;
    for (; j + CHAINS <= count; j += CHAINS)
        for (int k = 0; k < CHAINS; ++k, G += s.size())
            for (int i = 0; i < ROWS; ++i) sum[k][i] = fma(G[i], Cell(L::mode(q, from + j + k)), sum[k][i]);
    for (; j < count; ++j, G += s.size())
        for (int i = 0; i < ROWS; ++i) sum[0][i] = fma(G[i], Cell(L::mode(q, from + j)), sum[0][i]);
    Cell along = Cell(0.0);
    for (int i = 0; i < ROWS; ++i) {
        for (int k = 1; k < CHAINS; ++k) sum[0][i] += sum[k][i];
        r[at + i] = sum[0][i];
        along = fma(sum[0][i], q[at + i], along);
    }
    return along;
}

template <class L, class F> SNAPBEAM_FN typename L::Number sum_of_signals(const Runs<L> &z, const Channel<L> &c, F of) {
    typename L::Number s = typename L::Number(0.0);
    SNAPBEAM_LOOP
    for (int i = 0; i < c.uses; ++i) s = fma(typename L::Number(c.factor[i]), of(z.signal[c.signal[i]]), s);
    return s;
}
// Sum of a channel's signals: displacement of a striker, force, load; acceleration of a base.
template <class L> SNAPBEAM_FN typename L::Number signal_of(const Runs<L> &z, const Channel<L> &c) {
    return sum_of_signals(z, c, [&](const Signal<L> &one) { return c.law == BASE ? one.acceleration() : one.value_at(); });
}
template <class L> SNAPBEAM_FN typename L::Number signal_slope(const Runs<L> &z, const Channel<L> &c) {
    return sum_of_signals(z, c, [](const Signal<L> &one) { return one.slope(); });
}
template <class L> SNAPBEAM_FN typename L::Number signal_bend(const Runs<L> &z, const Channel<L> &c) {
    return sum_of_signals(z, c, [](const Signal<L> &one) { return one.acceleration(); });
}
// Acceleration along a row by the linear modes.
template <class L, class Cell = typename L::Cell> SNAPBEAM_FN typename L::Number linear_acceleration(const Structure<L> &s, const typename L::Cell *row, const typename L::Cell *q, const typename L::Cell *p) {
    Cell sum = Cell(0.0);
    for (int i = 0; i < s.size(); ++i) sum = fma(-row[i], fma(Cell(s.omega[i] * s.omega[i]), q[i], Cell(Cell(2.0) * s.sigma[i]) * p[i]), sum);
    return L::total(sum);
}

// Tension at q, where the cells of g.q are known: r = Gq and the factors of the acceleration.
template <class L, class Number = typename L::Number> SNAPBEAM_FN void tension(Runs<L> &z, const typename L::Cell *q, typename L::Cell gq) {
    const Structure<L> &s = *z.s;
    typename L::Cell along = typename L::Cell(0.0);
    if constexpr (L::fixed == 1) {
        z.r[0] = s.G[0] * q[0];
        along = z.r[0] * q[0];
    } else {
        constexpr int HALF = L::fixed / 2;
        const int blocks = L::fixed ? 2 : s.problem->blocks;
        for (int b = 0; b < blocks; ++b) {
            int i = L::fixed ? b * HALF : s.first[b];
            const int end = i + (L::fixed ? HALF : s.count[b]);
            const int from = L::fixed ? b * HALF * L::lanes : s.mode_first[b], count = L::fixed ? HALF * L::lanes : s.mode_count[b];
            for (; i + 8 <= end; i += 8) along += product_rows<8, L>(s, q, z.r, i, from, count);
            for (; i + 4 <= end; i += 4) along += product_rows<4, L>(s, q, z.r, i, from, count);
            for (; i + 2 <= end; i += 2) along += product_rows<2, L>(s, q, z.r, i, from, count);
            if (i < end) along += product_rows<1, L>(s, q, z.r, i, from, count);
        }
    }
    if constexpr (L::directions > 0)
        for (int i = 0; s.changes && i < s.size(); ++i) {
            Slopes<L> of_r(0.0);
            for (int j = 0; j < s.size(); ++j) of_r = fma(s.G_slopes[long(i) * s.size() + j], Slopes<L>(q[j].v), of_r);
            z.r[i].d += of_r, along.d += of_r * Slopes<L>(q[i].v);
        }
    L::totals(along, gq, z.qr, z.gq);
    z.gq = z.sign * z.gq;
    const Number gamma = -s.gamma;
    z.along_g = gamma * z.qr, z.along_r = gamma * fma(Number(2.0), z.gq, z.qr);
    for (int j = 0; j < z.channels; ++j)
        if (z.channel[j].law == AXIAL_LOAD) {
            z.channel[j].f = signal_of(z, z.channel[j]);
            z.along_g += z.channel[j].f, z.along_r += z.channel[j].f;
        }
    z.along_g = z.along_g * z.sign;
}
template <class L, class Cell = typename L::Cell> SNAPBEAM_FN void acceleration_row(const Runs<L> &z, typename L::Cell *k) {
    const Structure<L> &s = *z.s;
    const Cell along_g = Cell(z.along_g), along_r = Cell(z.along_r);
    for (int i = 0; i < s.size(); ++i) k[i] = fma(along_g, s.g[i], along_r * z.r[i]);
    if (s.problem->far_force) {
        const Cell there = Cell(0.5 * (typename L::Number(1.0) - z.sign));
        for (int i = 0; i < s.size(); ++i) k[i] = fma(there, s.far_force[i], k[i]);
    }
}
// The same at any state, from nothing.
template <class L> SNAPBEAM_FN void tension_at(Runs<L> &z, const typename L::Cell *q, typename L::Cell *k) {
    tension(z, q, dot_cells<L>(z.s->g, q, z.s->size()));
    acceleration_row(z, k);
}

// Displacement along the row of a channel, from the straight structure, or of a contact from the first well; the state of a circuit.
template <class L> SNAPBEAM_FN typename L::Number along(const Runs<L> &z, const Channel<L> &c, const typename L::Cell *q) {
    if (c.circuit) return q == z.q1 ? c.z : c.P[c.state];
    const auto moved = dot<L>(c.row, q, z.s->size());
    return fma(c.contact ? z.sign - typename L::Real(1.0) : z.sign, c.rest, moved);
}
template <class L> SNAPBEAM_FN typename L::Number penetration(const Runs<L> &z, const Channel<L> &c, const typename L::Cell *q) {
    return c.offset + signal_of(z, c) - along(z, c, q);
}

// Runs in which a contact acts: it is closed, and a lossy one presses.
template <class L> SNAPBEAM_FN typename L::Marks acting(const Channel<L> &c) { return c.memory ? c.closed : c.closed & c.pressing; }
// A force that depends on no velocity, by which the others are pushed.
template <class L> SNAPBEAM_FN bool is_steady(const Channel<L> &c) { return c.active && (c.circuit || !c.lossy) && c.law != AXIAL_LOAD; }
template <class L> SNAPBEAM_FN typename L::Number steady_force(const Channel<L> &c) {
    return c.circuit ? select(c.follows, typename L::Number(0.0), c.z) : c.f;
}
// Runs in which the force of a channel changes within a kick.
template <class L> SNAPBEAM_FN typename L::Marks changing(const Channel<L> &c) {
    return c.circuit ? c.follows : c.contact ? c.closed : FromBits<typename L::Marks>::of(~0u);
}
// Force of a channel at x and y; of a contact only where it acts.
template <class L, class Number = typename L::Number>
SNAPBEAM_FN Number force_at(const Channel<L> &c, typename L::Number x, typename L::Number y) {
    const Number f = with_law(c.law, [&](auto law) { return law.force(c.contact ? max(x, Number(0.0)) : x, y, c.numbers()); });
    return c.contact ? select(acting(c), f, Number(0.0)) : f;
}

// Power lost by a force f at x and y, of a contact beyond that of its force at y = 0.
template <class L>
SNAPBEAM_FN typename L::Number power_lost(const Channel<L> &c, typename L::Number x, typename L::Number y, typename L::Number f, typename L::Number elastic) {
    return with_law(c.law, [&](auto law) {
        if constexpr (law.contact) return (f - elastic) * y;
        else return law.loss(x, y, f, c.numbers());
    });
}

// phi_1, phi_2, phi_3 for |x| <= 1, and psi(x) = int_0^1 (t phi_1(x t))^2 dt = sum_k (-x)^k (2^(k+2) - 2)/((k+2)! (k+3)) within 1e-8.
template <class T> struct Phi {
    T one, two, three, square;
    SNAPBEAM_FN explicit Phi(T x) {
        const T z = -x;
        T s = T(1.0 / 1307674368000.0);  // 1/15!
        for (int k = 14; k >= 3; --k) s = fma(s, z, T(RECIPROCAL_FACTORIAL[k]));
        three = s, two = fma(s, z, T(0.5)), one = fma(two, z, T(1.0)), square = T(0.0);
        for (int k = 12; k >= 0; --k) square = fma(square, z, T(((4 << k) - 2) * RECIPROCAL_FACTORIAL[k + 2] / (k + 3)));
    }
    static constexpr double RECIPROCAL_FACTORIAL[15] = {
        1.0, 1.0, 1.0 / 2, 1.0 / 6, 1.0 / 24, 1.0 / 120, 1.0 / 720, 1.0 / 5040, 1.0 / 40320, 1.0 / 362880, 1.0 / 3628800,
        1.0 / 39916800, 1.0 / 479001600, 1.0 / 6227020800.0, 1.0 / 87178291200.0};
};

// One force that is linear in the velocity, f = elastic + side B y, exactly; *a* and *v* along its row, where |M B w| <= 1.
template <class L, class Number = typename L::Number>
SNAPBEAM_FN void affine_kick(const Channel<L> &c, Number w, Number M, Number a, Number v, Number tip, Number elastic, Number B,
                             Number *impulse, Number *twice, Number *lost) {
    const Number side = c.contact ? Number(1.0) : Number(-1.0), y0 = c.contact ? tip - v : v, decay = M * B;
    const Number f0 = fma(side * B, y0, elastic);
    const Phi<Number> phi(decay * w);
    // f' = -B a - M B f, of a contact and of a force alike
    *impulse = w * fma(f0, phi.one, -(B * a * w * phi.two));
    *twice = w * w * fma(f0, phi.two, -(B * a * w * phi.three));
    // lost is B y^2, y' = -side (a + M elastic) - M B y, of a circuit P_0 f^2:  u = u_0 + u_0' t phi_1(M B t)
    const Number rate = c.circuit ? -(B * a) - decay * f0 : fma(-decay, y0, -side * fma(M, elastic, a)), u = c.circuit ? f0 : y0, each = rate * w;
    *lost = w * (c.circuit ? c.P[0] : B) * fma(u, fma(Number(2.0) * each, phi.two, u), each * each * phi.square);
}

// Product of what a channel sees with the row of channel j: the row itself, or along_p.
template <class L> SNAPBEAM_FN typename L::Number product_seen(const Channel<L> &c, int j) {
    return c.circuit ? select(c.follows, c.along_M[j], c.M[j]) : c.M[j];
}
// A circuit that follows the beam: its x and g, *a* and *v* by along_p; own is its channel.  Returns a/lam.
template <class L, class Number = typename L::Number> SNAPBEAM_FN Number follow(const Runs<L> &z, Channel<L> &c, int own, typename L::Number &a, typename L::Number &v) {
    const int n = z.s->size();
    Number by_p = dot<L>(c.along_p, z.k1, n);
    for (int j = 0; j < z.channels; ++j) {
        const Channel<L> &other = z.channel[j];
        if (is_steady(other)) by_p = fma(c.along_M[j], steady_force(other), by_p);
    }
    assign(c.follows, a, by_p), assign(c.follows, v, dot<L>(c.along_p, z.p1, n));
    const Number per = Number(1.0) / max(c.P[0], Number(1e-300));
    assign(c.follows, c.P[1], Number(1.0) / (Number(1.0) - c.along_M[own] * per));
    assign(c.follows, c.x, fma(by_p, per, -dot<L>(c.along_q, z.q1, n)));
    return per * by_p;
}

// The part in the force of such a circuit, channel i of the block, of the other forces of the velocity.
template <class L, class Number = typename L::Number> SNAPBEAM_FN Number pulled_along(const Runs<L> &z, const Channel<L> &c, const typename L::Number *f, int i, int count) {
    Number sum = Number(0.0);
    if (!c.circuit) return sum;
    for (int j = 0; j < count; ++j)
        if (j != i) sum = fma(c.along_M[z.late[j]], f[j], sum);
    return select(c.follows, c.P[1] / max(c.P[0], Number(1e-300)) * sum, Number(0.0));
}

// Forces that depend on velocities, together; the impulses of a kick of *w* seconds go into p.
template <class L, class Number = typename L::Number, class Real = typename L::Real> SNAPBEAM_FN void velocity_kick(Runs<L> &z, typename L::Number w, int count, bool first, bool last) {
    const Structure<L> &s = *z.s;
    const int n = s.size();
    Number *v = z.block, *a = v + z.channels, *y = a + z.channels, *slope = y + z.channels, *change = slope + z.channels;
    Number *f = change + z.channels, *impulse = f + z.channels, *lost = impulse + z.channels, *elastic = lost + z.channels;
    Number *tip = elastic + z.channels, *twice = tip + z.channels, *pushed = twice + z.channels, *wanted = pushed + z.channels, *linear = wanted + z.channels;
    int held = 0;
    bool following = false;
    Real decay = Real(0.0);
    for (int i = 0; i < count; ++i) {
        Channel<L> &c = z.channel[z.late[i]];
        v[i] = dot<L>(c.row, z.p1, n), a[i] = dot<L>(c.row, z.k1, n);
        for (int j = 0; j < z.channels; ++j) {
            const Channel<L> &other = z.channel[j];
            if (is_steady(other)) a[i] = fma(c.M[j], steady_force(other), a[i]);
        }
        if (c.circuit) {
            c.P[1] = Number(0.0), following = true;
            pushed[i] = follow(z, c, z.late[i], a[i], v[i]);
        }
        impulse[i] = lost[i] = twice[i] = f[i] = slope[i] = Number(0.0);
        if (c.impulsive) ++held, wanted[i] = signal_bend(z, c) - a[i] - linear_acceleration(s, c.row, z.q1, z.p1);
        tip[i] = c.contact ? signal_slope(z, c) : Number(0.0);
        elastic[i] = c.contact || c.affine ? force_at(c, c.x, Number(0.0)) : Number(0.0);
        const Number fastest = abs(v[i]) + abs(tip[i]) + abs(w * a[i]), x = c.contact ? max(c.x, Number(0.0)) : c.x;
        linear[i] = with_law(c.law, [&](auto law) { return law.damping(x, fastest, c.numbers()); });
        if (c.contact) linear[i] = select(acting(c), linear[i], Number(0.0));
        decay += value(product_seen(c, z.late[i]) * abs(linear[i]));
    }
    const auto push = [&](Number after) {  // at the velocities v + after slope
        for (int i = 0; i < count; ++i) {
            const Channel<L> &c = z.channel[z.late[i]];
            const Number own = fma(after, slope[i], v[i]);
            y[i] = c.contact ? tip[i] - own : own;
            f[i] = force_at(c, c.x, y[i]);
        }
        for (int sweep = 0;; ++sweep) {
            for (int i = 0; i < count; ++i) {
                const Channel<L> &c = z.channel[z.late[i]];
                if (c.circuit) f[i] = select(c.follows, force_at(c, c.x, y[i]), Number(0.0)) + pulled_along(z, c, f, i, count);
            }
            if (sweep >= (held > 1 ? 16 : following ? 2 * held : held)) break;
            for (int i = 0; i < count; ++i) {  // held together, each by the others
                const Channel<L> &c = z.channel[z.late[i]];
                if (!c.impulsive) continue;
                f[i] = wanted[i];
                for (int j = 0; j < count; ++j)
                    if (j != i) f[i] -= c.M[z.late[j]] * f[j];
                f[i] = select(acting(c), f[i] / c.M[z.late[i]], Number(0.0));
            }
        }
    };
    // f of a circuit beside what free modes carry along
    const auto apart = [&](int i) { return f[i] + v[i] - z.channel[z.late[i]].x + pushed[i]; };
    if (first && following) {
        push(Number(0.0));
        for (int i = 0; i < count; ++i) {
            Channel<L> &c = z.channel[z.late[i]];
            if (c.circuit) c.apart = apart(i), c.settled = c.z - f[i];
        }
    }
    // nothing changes, or one that is linear alone
    auto exact = FromBits<typename L::Marks>::of(~0u);
    for (int i = 0; i < count; ++i) exact = exact & (!changing(z.channel[z.late[i]]));
    for (int i = 0; i < count; ++i) {
        const Channel<L> &c = z.channel[z.late[i]];
        auto alone = changing(c) & (decay * abs(value(w)) <= Real(c.affine ? 1.0 : -1.0));
        for (int j = 0; j < count; ++j)
            if (j != i) alone = alone & (!changing(z.channel[z.late[j]]));
        if (!any(alone)) continue;
        Number own_impulse, own_twice, own_lost;
        affine_kick(c, w, product_seen(c, z.late[i]), a[i], v[i], tip[i], elastic[i], linear[i], &own_impulse, &own_twice, &own_lost);
        assign(alone, impulse[i], own_impulse), assign(alone, twice[i], own_twice), assign(alone, lost[i], own_lost);
        exact = exact | alone;
    }
    const Real parts = kick_parts(s.problem->composition, decay * abs(value(w)));
    const Number h = w / Number(parts);
    const double ahead[4] = {0.0, 0.5, 0.5, 1.0}, share[4] = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};
    for (int part = 0;; ++part) {
        const auto within = (Real(double(part)) < parts) & (!exact);
        if (!any(within)) break;
        const Number step = select(within, h, Number(0.0));
        for (int i = 0; i < count; ++i) change[i] = slope[i] = Number(0.0), twice[i] = fma(step, impulse[i], twice[i]);
        for (int stage = 0; stage < 4; ++stage) {
            push(Number(ahead[stage]) * step);
            const Number weight = Number(share[stage]) * step;
            for (int i = 0; i < count; ++i) {
                const Channel<L> &c = z.channel[z.late[i]];
                slope[i] = a[i];
                for (int j = 0; j < count; ++j) slope[i] = fma(product_seen(c, z.late[j]), f[j], slope[i]);
                change[i] = fma(weight, slope[i], change[i]);
                impulse[i] = fma(weight, f[i], impulse[i]);
                if (stage < 3) twice[i] = fma(step * step * Number(1.0 / 6.0), f[i], twice[i]);
                lost[i] = fma(weight, power_lost(c, c.x, y[i], f[i], elastic[i]), lost[i]);
            }
        }
        for (int i = 0; i < count; ++i) v[i] += change[i];
    }
    for (int i = 0; i < count; ++i)
        assign(exact, v[i], fma(product_seen(z.channel[z.late[i]], z.late[i]), impulse[i], fma(a[i], w, v[i]))), slope[i] = Number(0.0);
    if (last && following) push(Number(0.0));
    const Number rate = select(differ(w, Number(0.0)), Number(1.0) / w, Number(0.0));
    for (int i = 0; i < count; ++i) {
        Channel<L> &c = z.channel[z.late[i]];
        const typename L::Marks here = c.circuit ? c.follows : FromBits<typename L::Marks>::of(~0u);
        assign(here, c.f, impulse[i] * rate), assign(here, c.early, Number(2.0) * twice[i] * rate * rate);
        c.lost += lost[i];
        if (c.circuit) {
            const Number per = select(c.follows, c.P[1] / max(c.P[0], Number(1e-300)), Number(0.0));
            if (first) impulse[i] += per * c.settled, c.lost += c.P[1] * c.settled * (Number(2.0) * c.z - Number(1.5) * c.settled);
            if (last) {
                const Number change = apart(i) - c.apart, lag = change * per / z.h, missed = per * (lag - change);
                const Number late = per * (per * (change - c.settled - lag) - Number(0.5) * z.h * change);
                impulse[i] += missed, c.lost = fma(c.P[0] * missed, select(c.follows, c.z + f[i], Number(0.0)), c.lost);
                assign(c.follows, c.z, f[i] - lag - c.along_M[z.late[i]] * missed);
                for (int m = 0; m < n; ++m) z.q1[m] = fma(typename L::Cell(late), c.row[m], z.q1[m]);
            }
        }
        for (int m = 0; m < n; ++m) z.p1[m] = fma(typename L::Cell(impulse[i]), c.row[m], z.p1[m]);
    }
}

// Work of what depends on time alone: a force that is constant in the kick, times the mean velocity along its row.
template <class L, class Number = typename L::Number> SNAPBEAM_FN void timed_work(Runs<L> &z, Channel<L> &c, typename L::Number w) {
    const Structure<L> &s = *z.s;
    const int n = s.size();
    Number a = Number(0.0);
    if (c.law == AXIAL_LOAD) {
        a = z.sign * dot<L>(s.g, z.k1, n) + dot<L>(z.r, z.k1, n);
        for (int i = 0; i < z.channels; ++i) {
            const Channel<L> &other = z.channel[i];
            if (!other.active || other.law == AXIAL_LOAD) continue;
            a = fma(other.lossy ? other.early : other.f, z.sign * dot<L>(s.g, other.row, n) + dot<L>(z.r, other.row, n), a);
        }
    } else {
        a = dot<L>(c.row, z.k1, n);
        for (int i = 0; i < z.channels; ++i)
            if (z.channel[i].active && z.channel[i].law != AXIAL_LOAD) a = fma(c.M[i], z.channel[i].lossy ? z.channel[i].early : z.channel[i].f, a);
    }
    c.work += w * c.f * fma(Number(0.5) * w, a, c.v);
}

// Does a circuit, channel j, follow the beam where it decays by so much in a step?  Only if that slows the motion less than it decays.
template <class L> SNAPBEAM_FN typename L::Marks follows(const Channel<L> &c, int j, typename L::Number decay) {
    return (value(decay) > typename L::Real(FOLLOWS)) & (value(c.along_M[j]) < typename L::Real(0.5) * value(c.P[0]));
}

// The end of a flow that lasts longer; the values are those without.
template <class Cell> SNAPBEAM_FN void lengthen(Cell &q, Cell &p, Cell longer, Cell omega, Cell sigma) {
    const double rate = -omega.v * omega.v * q.v - 2.0 * sigma.v * p.v;
    q += Cell(p.v) * longer, p += Cell(rate) * longer;
}

// A flow after the kick by the tension, of the modes (MODES) and with them of some circuits.
template <class L> struct Flow {
    typedef typename L::Cell Cell;
    typedef typename L::Number Number;
    const typename L::Plain *flows;
    const Cell *from_q, *from_p, *from_k;
    Cell by_g, by_r, weight;
    bool first;
    int which;
    Number longer;  // derivatives of its time
    const Slopes<L> *slopes;  // and of its numbers; null: none

    template <int CIRCUITS, bool MODES> SNAPBEAM_FN void take(Runs<L> &z, Channel<L> *one, Channel<L> *other) const {
        const Structure<L> &s = *z.s;
        const int n = s.size();
        const typename L::Plain *a = flows;
        Channel<L> *const circuit[2] = {one, other};
        Cell lost_p = Cell(0.0), lost_q = Cell(0.0), gq = Cell(0.0), carried[2] = {Cell(0.0), Cell(0.0)}, moved[2] = {Cell(0.0), Cell(0.0)};
        for (int i = 0; i < n; ++i, a += 4) {
            const Cell q = from_q[i], p = first ? fma(weight, from_k[i], from_p[i]) : fma(by_g, s.g[i], fma(by_r, z.r[i], from_p[i]));
            Cell dq = fma(a[0], q, a[1] * p), dp = fma(a[3], p, a[2] * q), q1 = q + dq, p1 = p + dp;
            if constexpr (L::directions > 0) {  // of a flow that changes, or lasts longer
                if (slopes) {
                    const Slopes<L> *of = slopes + 4 * i, x = Slopes<L>(q.v), y = Slopes<L>(p.v);
                    q1.d += fma(of[0], x, of[1] * y), p1.d += fma(of[3], y, of[2] * x);
                }
                lengthen(q1, p1, longer, s.omega[i], s.sigma[i]);
                dq = q1 - q, dp = p1 - p;
            }
            for (int k = 0; k < CIRCUITS; ++k) {
                const Cell by_q = circuit[k]->along_q[i], by_p = circuit[k]->along_p[i];
                carried[k] = fma(by_q, q, fma(by_p, p, carried[k])), moved[k] = fma(by_q, dq, fma(by_p, dp, moved[k]));
            }
            if constexpr (MODES) {
                if (z.account) lost_p = fma(dp, p + p1, lost_p), lost_q = fma(s.omega[i] * dq, s.omega[i] * (q + q1), lost_q);
                gq = fma(s.g[i], q1, gq);
                z.q1[i] = q1, z.p1[i] = p1;
            }
        }
        for (int k = 0; k < CIRCUITS; ++k) {
            Channel<L> &c = *circuit[k];
            Number stood, went;
            L::totals(carried[k], moved[k], stood, went);
            assign(!c.follows, c.z, c.z + fma(c.decay[which], c.z + stood, -went));
        }
        if (!MODES) return;
        z.next_gq = gq;
        if (z.account) z.dissipated = fma(Number(-0.5), L::total(lost_p + lost_q), z.dissipated);  // of p^2 + omega^2 q^2
    }
};

template <class L, class Number = typename L::Number, class Real = typename L::Real> SNAPBEAM_FN void begin_step(Runs<L> &z) {
    z.dissipated = Number(0.0), z.direct = true;
    for (int i = 0; i < z.signals; ++i) z.signal[i].copy(z.signal[i].at, z.signal[i].begun), z.signal[i].acts = false;
    for (int j = 0; j < z.channels; ++j) {
        Channel<L> &c = z.channel[j];
        c.impulse = c.work = c.lost = Number(0.0), c.z = c.circuit ? c.P[c.state] : Number(0.0);
        if (c.circuit) c.follows = follows(c, j, c.P[0] * z.h);
        c.active = !c.contact || any(c.closed), z.direct &= !c.active;
        SNAPBEAM_LOOP
        for (int i = 0; c.active && i < c.uses; ++i) z.signal[c.signal[i]].act(z.s->composition, z.h);
        if (!(c.law == AXIAL_LOAD)) c.f = c.first_f = Number(0.0);
    }
    if (z.direct) return;
    for (int i = 0; i < z.s->size(); ++i) z.q1[i] = z.q[i], z.p1[i] = z.p[i], z.k1[i] = z.k[i];
}

template <class L, class Number = typename L::Number, class Cell = typename L::Cell> SNAPBEAM_FN void take_stage(Runs<L> &z, int stage) {
    const Structure<L> &s = *z.s;
    const int n = s.size();
    const bool last = stage == s.composition.flows;
    const Number w = Number(s.composition.kick_weight(stage)) * z.h;
    int late = 0;
    bool timed = false;
    for (int j = 0; j < z.channels; ++j) {
        const Channel<L> &c = z.channel[j];
        if (c.active && c.lossy && (!c.circuit || any(c.follows))) z.late[late++] = j;
        timed |= c.timed;
    }
    // Within a step the two factors of the acceleration serve, whatever the neighbours of a run need the row for.
    if (stage > 0) {
        tension(z, z.q1, z.next_gq);
        if (last || late || timed) acceleration_row(z, z.k1);
    }
    for (int j = 0; j < z.channels; ++j) {
        Channel<L> &c = z.channel[j];
        if (!c.active) continue;
        if (c.timed) {
            if (c.law == AXIAL_LOAD) {
                if (stage == 0) tension(z, z.q1, dot_cells<L>(s.g, z.q1, n));  // forms r
                c.v = fma(z.sign, dot<L>(s.g, z.p1, n), dot<L>(z.r, z.p1, n));
            } else {
                c.f = signal_of(z, c), c.v = dot<L>(c.row, z.p1, n);
            }
        } else {
            c.x = c.contact ? penetration(z, c, z.q1) : along(z, c, z.q1);
            if (!c.lossy) c.f = force_at(c, c.x, L::directions && c.memory ? select(c.pressing, Number(1.0), Number(-1.0)) : Number(0.0));
            if (c.circuit) c.f = c.early = steady_force(c), c.lost = fma(w * c.P[0] * c.f, c.f, c.lost);
        }
    }
    if (late) velocity_kick(z, w, late, stage == 0, last);
    for (int j = 0; j < z.channels; ++j) {
        Channel<L> &c = z.channel[j];
        if (!c.active) continue;
        if (stage == 0) c.first_f = c.f;
        if (c.timed) timed_work(z, c, w);
        if (c.contact) {
            const Number push = w * c.f;
            c.impulse += push, c.work = fma(push, signal_slope(z, c), c.work);
        }
    }
    for (int j = 0; j < z.channels; ++j) {
        Channel<L> &c = z.channel[j];
        if (!is_steady(c)) continue;
        const Cell push = Cell(w * steady_force(c));
        for (int i = 0; i < n; ++i) z.p1[i] = fma(push, c.row[i], z.p1[i]);
    }
    const Cell weight = Cell(w);
    if (last) {
        for (int i = 0; i < n; ++i) z.p1[i] = fma(weight, z.k1[i], z.p1[i]);
        return;
    }
    const int which = s.composition.which_flow(stage);
    const typename L::Plain *a = z.flows + long(which) * n * 4;
    const Cell by_g = Cell(w * z.along_g), by_r = Cell(w * z.along_r);
    if (stage && s.problem->far_force) {
        const Cell there = Cell(w * (Number(0.5) * (Number(1.0) - z.sign)));
        for (int i = 0; i < n; ++i) z.p1[i] = fma(there, s.far_force[i], z.p1[i]);
    }
    const bool direct = stage == 0 && z.direct;
    const Cell *from_q = direct ? z.q : z.q1, *from_p = direct ? z.p : z.p1, *from_k = direct ? z.k : z.k1;
    const Flow<L> flow = {a, from_q, from_p, from_k, by_g, by_r, weight, stage == 0, which, Number(s.composition.flow[which]) * (z.h - Number(value(z.h))), z.flow_slopes ? z.flow_slopes + long(which) * n * 4 : nullptr};
    int circuits = 0, first = z.channels, second = z.channels;
    for (int j = 0; j < z.channels; ++j)
        if (z.channel[j].circuit && circuits++ < 2) (circuits == 1 ? first : second) = j;
    for (int j = second + 1; j < z.channels; ++j)
        if (z.channel[j].circuit) flow.template take<1, false>(z, &z.channel[j], nullptr);
    if (!circuits) flow.template take<0, true>(z, nullptr, nullptr);
    else if (circuits == 1) flow.template take<1, true>(z, &z.channel[first], nullptr);
    else flow.template take<2, true>(z, &z.channel[first], &z.channel[second]);
    // the end of the step has the same bits whether a signal acts inside or not
    const bool ends = stage + 1 == s.composition.flows;
    for (int i = 0; i < z.signals; ++i) {
        Signal<L> &one = z.signal[i];
        if (ends) one.advance_from(one.begun, WHOLE);
        else if (one.acts) one.advance(which);
        if (ends && any(z.jumping)) one.before_jump(z.jumping, z.t + z.ticks, z.tick, z.drift);
    }
}

// The whole step from q, p, k to q1, p1, k1; rows of a length that the compiler knows stay in registers.
template <class L> SNAPBEAM_FN void take_step(Runs<L> &outer) {
    const int flows = outer.s->composition.flows;
    if constexpr (L::fixed > 0 && L::together == 1) {
        typedef typename L::Cell Cell;
        constexpr int N = L::fixed;
        Runs<L> z = outer;
        Held<Cell, N, true> q, p, k, r;
        if constexpr (!KNOWN) z.q1.at = q, z.p1.at = p, z.k1.at = k, z.r.at = r;
        for (int i = 0; i < N; ++i) z.q1[i] = z.p1[i] = z.k1[i] = z.r[i] = Cell(0.0);
        begin_step(z);
        SNAPBEAM_LOOP
        for (int stage = 0; stage <= flows; ++stage) take_stage(z, stage);
        for (int i = 0; i < N; ++i) outer.q1[i] = z.q1[i], outer.p1[i] = z.p1[i], outer.k1[i] = z.k1[i], outer.r[i] = z.r[i];
        outer.gq = z.gq, outer.qr = z.qr, outer.dissipated = z.dissipated;
    } else {
        begin_step(outer);
        SNAPBEAM_LOOP
        for (int stage = 0; stage <= flows; ++stage) take_stage(outer, stage);
    }
}

}  // namespace SNAPBEAM_SET
