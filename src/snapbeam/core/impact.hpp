// Impacts that last no time, and contacts that are held together.
//
// Newton's law: where the gap closes at the rate r > 0, an impulse J = (1 + e) r/M along the row, M = r.r of all modes, leaves the
// rate -e r; (1 - e^2) r^2/(2 M) is lost.  Impacts that follow each other ever faster (chatter) form a geometric series of flights; by
// the acceleration a that presses the two together, the next one is e^2 r^2/(2 a) high, and all take 2 e r/[a (1 - e)].  Once both
// are too small to be resolved, the contact is held together: what comes after does not depend on how the chatter ended.
//
// Held together, the tip prescribes displacement and velocity along the row.  The force that this takes,
//
//   f = [w'' - r.(k - omega^2 q - 2 sigma p) - sum_j M_j f_j]/M,
//
// acts in the kicks as any other (step.hpp); what a step leaves of the gap and its rate is taken away along the row.  Where it would
// have to pull, the contact opens.
#pragma once

namespace SNAPBEAM_SET {

constexpr double SOON = 0.05, NO_HEIGHT = 1e-4;  // rest of a chatter over the shortest period; heights over LOWEST that are none

// Force of a channel at a state; of one that is held together that of the last kick.
template <class L> typename L::Number force_of(const Runs<L> &z, const Channel<L> &c, const typename L::Cell *q, const typename L::Cell *p) {
    if (c.law == AXIAL_LOAD || (c.contact && !any(acting(c)))) return typename L::Number(0.0);
    if (c.timed) return signal_of(z, c);
    if (c.impulsive) return select(acting(c), c.f, typename L::Number(0.0));
    const auto x = c.contact ? penetration(z, c, q) : along(z, c, q), v = dot<L>(c.row, p, z.s->size());
    return c.circuit ? x : force_at(c, x, c.contact ? signal_slope(z, c) - v : v);
}
// Acceleration along the row of a channel at a state; that by channel *without* is left out.
template <class L>
typename L::Number acceleration_along(const Runs<L> &z, const Channel<L> &c, const typename L::Cell *q, const typename L::Cell *p, const typename L::Cell *k, int without) {
    typename L::Number a = dot<L>(c.row, k, z.s->size()) + linear_acceleration(*z.s, c.row, q, p);
    for (int j = 0; j < z.channels; ++j)
        if (j != without) a = fma(c.M[j], force_of(z, z.channel[j], q, p), a);
    return a;
}
// Force that holds a contact together at a state, times M: what its row lacks of the acceleration of the tip.
template <class L>
typename L::Number pressed_by(const Runs<L> &z, const Channel<L> &c, const typename L::Cell *q, const typename L::Cell *p, const typename L::Cell *k) {
    return signal_bend(z, c) - acceleration_along(z, c, q, p, k, int(&c - z.channel));
}

// The derivatives of the state become those of a state so much later.
template <int K> void move_in_time(Group<Tangents<K>> &runs, Dual<K> later) {
    typedef Tangents<K> L;
    Runs<L> &z = runs.z;
    const Structure<L> &s = *z.s;
    double *rate = reinterpret_cast<double *>(static_cast<Dual<K> *>(runs.scratch));
    runs.totals.move_in_time(z, later);
    for (int i = 0; i < s.size(); ++i) rate[i] = z.k[i].v - s.omega[i].v * s.omega[i].v * z.q[i].v - 2.0 * s.sigma[i].v * z.p[i].v;
    for (int j = 0; j < z.channels; ++j) {
        Channel<L> &c = z.channel[j];
        const double f = force_of(z, c, z.q, z.p).v;
        for (int i = 0; i < s.size(); ++i) rate[i] += c.row[i].v * f;
        if (c.circuit) c.P[c.state] -= Dual<K>(dot<L>(c.row, z.p, s.size()).v + c.P[0].v * c.P[c.state].v) * later;
    }
    for (int i = 0; i < s.size(); ++i) z.q[i] += Dual<K>(z.p[i].v) * later, z.p[i] += Dual<K>(rate[i]) * later;
    for (int i = 0; i < z.signals; ++i) z.signal[i].move_in_time(later);
    z.drift += later;
    tension_at(z, z.q, z.k);
    runs.totals.look_again(z, !(z.t < runs.end));
}

// Impacts of contact *number*, where its gap closes at the rate r0.
template <class L> void hit(Group<L> &runs, int number, typename L::Marks on) {
    typedef typename L::Number Number;
    typedef typename L::Real Real;
    using namespace snapbeam;
    Runs<L> &z = runs.z;
    Channel<L> &c = z.channel[number];
    const int n = z.s->size();
    const Number zero = Number(0.0), M = c.M[number], tip = signal_slope(z, c);
    // the tick is later than the zero of the gap: the rate was another one there, and the beam has gone on with its new velocity; not
    // where it grazes, so that the rate changes its sign in between
    const Number after = c.d0 / c.r0, late = select(on & (abs(value(after)) <= z.tick), after, zero);
    const Number r = c.r0 - late * pressed_by(z, c, z.q, z.p, z.k);
    const Number away = c.P[0] * r, bounce = select(on, (r + away) / M, zero);
    for (int i = 0; i < n; ++i) z.p[i] = fma(typename L::Cell(bounce), c.row[i], z.p[i]), z.q[i] = fma(typename L::Cell(bounce * late), c.row[i], z.q[i]);
    const Number pressed = pressed_by(z, c, z.q, z.p, z.k);
    const Number height = Number(0.5) * away * away / max(pressed, Number(1e-300)), lasts = Number(2.0) * away / max(pressed * (Number(1.0) - c.P[0]), Number(1e-300));
    const Real soon = Real(6.283185307179586 * SOON / runs.s->fastest);
    auto stays = on & (value(pressed) > Real(0.0)) & (value(c.P[0]) < Real(1.0));
    stays = stays & ((value(height) <= Real(NO_HEIGHT) * runs.lowest) | ((value(height) <= runs.lowest) & (value(lasts) <= soon)));
    const auto lands = stays & (!(value(c.P[0]) > Real(0.0)));  // without a rebound impact and held contact are one
    const Number stop = select(stays, -away / M, zero), impulse = bounce + stop;
    for (int i = 0; i < n; ++i) z.p[i] = fma(typename L::Cell(stop), c.row[i], z.p[i]);
    const Number work = impulse * tip, left = select(stays, zero, away);
    c.sums[WORK] += work, c.sums[GROSS_WORK] += abs(work);
    c.sums[LOST] += select(on, Number(0.5) * (r * r - left * left) / M, zero);
    const auto counts = on & (!lands);
    c.sums[IMPACTS] += select(counts, Number(1.0), zero), c.sums[IMPULSE] += select(counts, impulse, zero);
    assign(lands, c.own_impulse, impulse);
    if (runs.recorder() && any(counts)) {
        Recorder &to = *runs.batch->recorder;
        double *row = to.impact_rows + to.marks[2]++ * OF_IMPACT;
        row[IMPACT_CHANNEL] = number, row[IMPACT_ONSET] = lane(z.t, 0) * lane(z.tick, 0), row[IMPACT_DURATION] = 0.0;
        row[IMPACT_FORCE] = NAN, row[IMPACT_IMPULSE] = lane(value(impulse), 0);
    }
    assign(on, c.d0, -left * late), assign(on, c.r0, -left), assign(on, c.safe, z.t);
    for (int j = 0; j < z.channels; ++j) {  // rates of the other ones; what was held together there may part
        Channel<L> &other = z.channel[j];
        if (!other.contact || j == number) continue;
        const Number change = c.M[j] * impulse;
        other.r0 -= change, other.r1 -= change;
        const auto parts = on & other.closed & FromBits<typename L::Marks>::of(other.impulsive ? ~0u : 0u) & (change > zero);
        if (any(parts)) runs.close_impact(other, j, parts), other.closed = other.closed & (!parts), other.pressing = other.closed;
    }
    assign(stays, c.onset, z.t);
    if constexpr (L::directions > 0) assign(stays, c.begun, z.drift);
    c.closed = c.closed | stays, c.pressing = c.closed;
    c.f = select(stays, pressed_by(z, c, z.q, z.p, z.k) / M, c.f);
}

// After impacts: rates of all contacts and circuits, and what is observed.
template <class L> void jumped_velocity(Group<L> &runs, typename L::Marks which) {
    typedef typename L::Real Real;
    using namespace snapbeam;
    Runs<L> &z = runs.z;
    const int n = z.s->size();
    for (int i = 0; runs.recorder() && i < n; ++i) z.p1[i] = z.p[i];  // what is recorded at the end of the step
    for (int j = 0; j < z.channels; ++j) {
        Channel<L> &c = z.channel[j];
        if (c.circuit) assign(which, c.r0, -fma(c.P[0], c.P[c.state], dot<L>(c.row, z.p, n)));
        if (!c.contact) continue;
        if (!c.impulsive) assign(which, c.r0, signal_slope(z, c) - dot<L>(c.row, z.p, n));
        assign(which, c.safe, z.t);
    }
    auto &totals = runs.totals;
    assign(which, totals.point.v, dot<L>(totals.row, z.p, n)), assign(which, totals.center.v, dot<L>(z.s->center, z.p, n));
    assign(which, totals.sum[PEAK_VELOCITY], max(totals.sum[PEAK_VELOCITY], abs(totals.point.v)));
    assign(which, totals.sum[PEAK_CENTER_VELOCITY], max(totals.sum[PEAK_CENTER_VELOCITY], abs(totals.center.v)));
    assign(which, runs.energy, value(totals.energy(z, true, true)));
    totals.enter_well(z, which);
}

// A step in which a contact is held together: what it leaves of the gap and its rate is taken away.
template <class L> void hold_together(Group<L> &runs, Channel<L> &c) {
    typedef typename L::Number Number;
    typedef typename L::Cell Cell;
    Runs<L> &z = runs.z;
    if (!c.impulsive || !any(c.closed)) return;
    c.d1 = penetration(z, c, z.q1), c.r1 = signal_slope(z, c) - dot<L>(c.row, z.p1, z.s->size());
    Number M = dot<L>(c.row, c.row, z.s->size());
    M = select(M > Number(0.0), M, Number(1.0));  // lanes that have never run
    const auto held = acting(c);
    const Number zero = Number(0.0), move = select(held, c.d1 / M, zero), push = select(held, c.r1 / M, zero);
    // what this does to the energy of the beam is work of the striker or loss
    const Number pulled = dot<L>(c.row, z.k1, z.s->size()) + linear_acceleration(*z.s, c.row, z.q1, z.p1);
    c.impulse += push, c.work = fma(push, signal_slope(z, c), c.work), c.lost += Number(0.5) * push * c.r1 + move * pulled;
    for (int i = 0; i < z.s->size(); ++i) z.q1[i] = fma(Cell(move), c.row[i], z.q1[i]), z.p1[i] = fma(Cell(push), c.row[i], z.p1[i]);
    assign(held, c.d1, Number(0.0)), assign(held, c.r1, Number(0.0));
}

}  // namespace SNAPBEAM_SET
