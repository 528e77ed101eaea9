// Statistics: what a run adds up over its steps.
//
// Two points are observed: the beam at the (first) striker, and its centre.  Between the ends of a step the cubic through values and
// rates gives extremes and crossings.  Modes that swing within a step make it wrong by at most
//
//   |r_i| h (omega_i h)^3/384 A_i of the displacement, A_i the amplitude of p_i, and by |r_i| (omega_i h)^5/13400 A_i of the velocity, a
//   quartic by its values, accelerations and mean,
//
// and 2.5/(omega_i) and 2.5 of the amplitude.  Where this may raise an extreme, the motion is followed inside the step (events.hpp).
//
//   integral of u^2 = h (u_0^2 + u_1^2)/2 + h^2 (u_0 v_0 - u_1 v_1)/6: over equal steps the corrections cancel, and modes that
//   swing fast within a step are averaged without bias;
//   integral of v^2 = h (m^2 + a^2/3 + 3 b^2/5), m = (u_1 - u_0)/h, a = (v_1 - v_0)/2, b = (v_0 + v_1)/2 - m: order four for any
//   factor of b^2, over many steps order six with 3/5.
#pragma once
#include "events.hpp"

namespace SNAPBEAM_SET {

template <class L> struct Totals {
    typedef typename L::Number Number;
    typedef typename L::Real Real;
    typedef typename L::Cell Cell;
    typedef typename L::Plain Plain;
    typedef typename L::Marks Marks;

    const Structure<L> *s;
    Held<Cell, CELLS> row;     // of the displacement observed
    bool shared;               // it is that of the first contact
    Number rest;
    struct { Number u, v; } point, center;  // value and rate of what is observed at the beginning of a step
    Number sum[snapbeam::STATISTICS];
    Real late, decide_energy, decide_reach, decide_crossings;
    Held<Plain, CELLS> swing_u, swing_v;  // weights of squared amplitudes, whose sums bound the errors of the cubics in a flight step
    Number modal_energy, high_energy;  // and those sums, where they were evaluated last
    Real most_u, most_v;
    Number length;             // of the last step, s
    Number later;              // of the beginning of the last quarter, s: 0, and derivatives where it moves

    void lay_out(const Structure<L> &structure, Arena &arena) {
        s = &structure;
        row.take(arena, s->cells), swing_u.take(arena, s->cells), swing_v.take(arena, s->cells);
    }
    template <class F> void visit(F number) {
        number(point.u), number(point.v), number(center.u), number(center.v);
        number(modal_energy), number(high_energy), number(most_u), number(most_v), number(length);
        for (Number &x : sum) number(x);
    }
    void load(const Batch &batch, int i, int l, const double *observed, double at_rest) {
        using namespace snapbeam;
        const double *run = batch.run + long(i) * RUN_NUMBERS;
        const double h = run[STEP] * run[TICK];
        for (int m = 0; m < s->problem->modes; ++m) {
            set_element<L>(row, s->place[m], l, observed[m]);
            double of_u, of_v;
            doubts_of_mode(h, s->problem->omega[m], of_u, of_v);
            const double at = observed[m] < 0.0 ? -observed[m] : observed[m], middle = s->problem->center[m] < 0.0 ? -s->problem->center[m] : s->problem->center[m];
            const double weight = 1.01 * double(s->problem->modes) * (at > middle ? at * at : middle * middle);
            set_element<L>(swing_u, s->place[m], l, weight * of_u * of_u), set_element<L>(swing_v, s->place[m], l, weight * of_v * of_v);
        }
        set_lane(rest, l, at_rest), set_lane(late, l, run[LAST_QUARTER]);
        set_lane(decide_energy, l, run[DECIDE_ENERGY]), set_lane(decide_reach, l, run[DECIDE_REACH]);
        set_lane(decide_crossings, l, run[DECIDE_CROSSINGS]);
        for (Number &x : sum) set_lane(x, l, 0.0);
        set_lane(length, l, 0.0);
        set_lane(sum[LAST_CROSSING], l, NAN), set_lane(sum[EARLY_STOP_TIME], l, NAN);
    }
    SNAPBEAM_FN Number height(const Runs<L> &z, const Cell *q) const { return fma(z.sign, rest, dot<L>(row, q, s->size())); }
    SNAPBEAM_FN Number center_height(const Runs<L> &z, const Cell *q) const {
        return fma(z.sign, s->center_rest, dot<L>(s->center, q, s->size()));
    }
    SNAPBEAM_SELDOM void start(Runs<L> &z, Marks which, Number energy_now) {
        using namespace snapbeam;
        const int n = s->size();
        assign(which, point.u, height(z, z.q)), assign(which, point.v, dot<L>(row, z.p, n));
        assign(which, center.u, center_height(z, z.q)), assign(which, center.v, dot<L>(s->center, z.p, n));
        assign(which, sum[MIN_DISPLACEMENT], point.u), assign(which, sum[MAX_DISPLACEMENT], point.u);
        assign(which, sum[MIN_CENTER], center.u), assign(which, sum[MAX_CENTER], center.u);
        assign(which, sum[PEAK_VELOCITY], abs(point.v)), assign(which, sum[PEAK_CENTER_VELOCITY], abs(center.v));
        const Real from = value(center.u) - Real(s->problem->dividing_height);
        assign(which, sum[SIDE], select(from > Real(0.0), Number(1.0), Number(-1.0)));
        assign(which, sum[FIRST_ENERGY], energy_now);
        enter_well(z, which);
    }

    // Energy of the state q, p; with what contacts store, or of the beam alone, without its strikers and local forces.
    SNAPBEAM_SELDOM Number energy(Runs<L> &z, bool contacts, bool beam = false) {
        const int n = s->size();
        Cell sum_of = Cell(0.0);
        SNAPBEAM_LOOP
        for (int i = 0; i < n; ++i) {
            const Cell own = Cell(beam ? s->beam[i] : typename L::Shared(1.0)), oq = s->omega[i] * z.q[i];
            sum_of = fma(own * z.p[i], z.p[i], fma(own * oq, oq, sum_of));
        }
        const Number gq = z.gq, qr = z.qr, along_g = z.along_g, along_r = z.along_r;
        tension(z, z.q, dot_cells<L>(s->g, z.q, n));
        Number all = fma(Number(0.5), L::total(sum_of), s->gamma * z.qr * fma(Number(0.25), z.qr, z.gq));
        z.gq = gq, z.qr = qr, z.along_g = along_g, z.along_r = along_r;
        const Number there = Number(Real(0.5) * (Real(1.0) - z.sign));
        if (s->problem->far_force) all += there * (s->lift - dot<L>(s->far_force, z.q, n));
        for (int j = 0; j < z.channels && !beam; ++j) {
            const Channel<L> &c = z.channel[j];
            if (c.timed || (c.contact && !contacts)) continue;
            const Number x = c.contact ? max(c.d0, Number(0.0)) : along(z, c, z.q);
            const Number stored = with_law(c.law, [&](auto law) { return law.potential(x, c.numbers()); });
            all += c.contact ? select(acting(c), stored, Number(0.0)) : stored;
        }
        return all;
    }

    // The well on whose side the centre is, as z.sign: until the next step begins, q may still be about the other one.
    SNAPBEAM_FN Real well(const Runs<L> &z) const {
        const Real first = Real(s->problem->center_rest > s->problem->dividing_height ? 1.0 : -1.0);
        return s->problem->shift ? first * value(sum[snapbeam::SIDE]) : z.sign;
    }
    // A well in mode i, as q.
    SNAPBEAM_FN Cell origin(const Runs<L> &z, Real well, int i) const {
        const Plain there = Plain(Real(0.5) * (Real(1.0) - well)), away = Plain(Real(0.5) * (z.sign - well));
        return fma(Cell(there), Cell(s->second[i]), Cell(away) * Cell(s->shift[i]));
    }
    // Energies of the modes of the beam about the nearest well and of the high ones, and the sums that bound the errors of the cubics:
    // by the inequality of Cauchy and Schwarz (sum_i c_i A_i)^2 <= N sum_i c_i^2 A_i^2.
    SNAPBEAM_SELDOM void modal(const Runs<L> &z, Number *found, Real *most) {
        Cell whole = Cell(0.0), high = Cell(0.0);
        Plain u = Plain(0.0), v = Plain(0.0);
        const Real near = well(z);
        const bool apart = s->problem->second || any(differ(near, z.sign));
        SNAPBEAM_LOOP
        for (int i = 0; i < s->size(); ++i) {
            const Cell p = z.p[i], oq = s->omega[i] * z.q[i], square = fma(p, p, oq * oq);
            u = fma(swing_u[i], value(square), u), v = fma(swing_v[i], value(square), v);
            if (!s->problem->high) continue;
            Cell own = square;
            if (apart) {
                const Cell from = s->omega[i] * (z.q[i] - origin(z, near, i));
                own = fma(p, p, from * from);
            }
            own = Cell(s->beam[i]) * own;
            whole += own, high = fma(Cell(s->high[i]), own, high);
        }
        L::totals(whole, high, found[0], found[1]), L::totals(u, v, most[0], most[1]);
        found[0] = Number(0.5) * found[0], found[1] = Number(0.5) * found[1];
    }
    // A step in which the centre is on the other side from a fraction of it *until* another: the energies there are about the other
    // well.  Their difference -sum_i omega_i^2 (b_i - a_i) (q_i - (a_i + b_i)/2), of a well b to a well a, is linear in q, and a cubic
    // in time.  From a step that ends on the other side (*once*) the rule of trapezoids gets the energy about the first well at its
    // end, and its correction h^2/12 by the rates there, which does not cancel where the wells change.
    SNAPBEAM_SELDOM void change_well(const Runs<L> &z, Marks found, Marks once, Number from, Number until) {
        using namespace snapbeam;
        const Real here = well(z);
        const Number h = z.h;
        Cell energy[4], high[4];  // at the beginning and its rate, at the end and its rate
        for (int k = 0; k < 4; ++k) energy[k] = high[k] = Cell(0.0);
        for (int i = 0; i < s->size(); ++i) {
            const Cell a = origin(z, here, i), b = origin(z, -here, i), middle = Cell(0.5) * (a + b);
            const Cell slope = Cell(s->beam[i]) * Cell(s->omega[i]) * Cell(s->omega[i]) * (a - b), high_slope = Cell(s->high[i]) * slope;
            const Cell at[] = {z.q[i] - middle, z.p[i], z.q1[i] - middle, z.p1[i]};
            for (int k = 0; k < 4; ++k) energy[k] = fma(slope, at[k], energy[k]), high[k] = fma(high_slope, at[k], high[k]);
        }
        Number e[4], high_e[4];
        for (int k = 0; k < 4; ++k) L::totals(energy[k], high[k], e[k], high_e[k]);
        sum[ENERGY_TIME] += select(found, of_other_well(e, once, from, until, h), Number(0.0));
        sum[HIGH_ENERGY_TIME] += select(found, of_other_well(high_e, once, from, until, h), Number(0.0));
    }
    SNAPBEAM_FN static Number of_other_well(const Number *e, Marks once, Number from, Number until, Number h) {
        const Cubic<Number> path(e[0], e[1], e[2], e[3], h);
        const auto integral = [&](Number x) {
            return x * fma(x, fma(x, fma(x, Number(0.25) * path.c3, Number(1.0 / 3.0) * path.c2), Number(0.5) * path.c1), path.c0);
        };
        return h * (integral(until) - integral(from) + select(once, Number(1.0 / 12.0) * h * e[3] - Number(0.5) * e[2], Number(0.0)));
    }
    SNAPBEAM_SELDOM void enter_well(const Runs<L> &z, Marks which) {
        Number now[2];
        Real most[2];
        modal(z, now, most);
        assign(which, modal_energy, now[0]), assign(which, high_energy, now[1]), assign(which, most_u, most[0]), assign(which, most_v, most[1]);
    }
    // By the rule of trapezoids with its correction h^2/12 (E_0' - E_1'), which cancels between steps of equal length.
    SNAPBEAM_SELDOM void correct(const Runs<L> &z, Marks which, Number h, bool last) {
        using namespace snapbeam;
        Cell whole = Cell(0.0), high = Cell(0.0);
        const Real near = well(z);
        for (int i = 0; i < s->size(); ++i) {
            const Cell p = z.p[i], omega = Cell(s->omega[i]);
            Cell own = z.k[i] - Cell(2.0) * Cell(s->sigma[i]) * p - omega * omega * origin(z, near, i);
            for (int j = 0; j < z.channels; ++j) {
                const Channel<L> &c = z.channel[j];
                if (c.active && c.law != AXIAL_LOAD) own = fma(Cell(last ? c.f : c.first_f), c.row[i], own);
            }
            own = Cell(s->beam[i]) * own * p;
            whole += own, high = fma(Cell(s->high[i]), own, high);
        }
        Number rate, high_rate;
        L::totals(whole, high, rate, high_rate);
        const Number weight = select(which, Number(1.0 / 12.0) * (h * h - length * length), Number(0.0));
        sum[ENERGY_TIME] = fma(weight, rate, sum[ENERGY_TIME]), sum[HIGH_ENERGY_TIME] = fma(weight, high_rate, sum[HIGH_ENERGY_TIME]);
        length = select(which, h, length);
    }
    void add_modes(const Runs<L> &z, Marks ok, Number h) {
        using namespace snapbeam;
        const Number half = select(ok, Number(0.5) * h, Number(0.0)), energy = modal_energy, high = high_energy;
        enter_well(z, ok);
        sum[ENERGY_TIME] = fma(half, energy + modal_energy, sum[ENERGY_TIME]), sum[HIGH_ENERGY_TIME] = fma(half, high + high_energy, sum[HIGH_ENERGY_TIME]);
    }

    // Bounds of a cubic on a step: where it turns inside, it exceeds its ends by at most 4/27 of their slopes.
    struct Reach {
        Number high, low;
        SNAPBEAM_FN Reach(Number u0, Number v0, Number u1, Number v1, Number h) {
            const Number bump = Number(0.1482) * h * (v0 - v1), zero = Number(0.0);
            high = max(u0, u1) + select((v0 > zero) & (v1 < zero), bump, zero), low = min(u0, u1) + select((v0 < zero) & (v1 > zero), bump, zero);
        }
    };
    SNAPBEAM_FN Reach widen(Marks ok, snapbeam::Statistic low, snapbeam::Statistic high, Number u0, Number v0, Number u1, Number v1, Number h) {
        const Reach reach(u0, v0, u1, v1, h);
        if (any(ok & ((reach.high > sum[high]) | (reach.low < sum[low])))) {
            const Cubic<Number> up(u0, v0, u1, v1, h), down(-u0, -v0, -u1, -v1, h);
            assign(ok, sum[high], max(sum[high], crest(up, v0, v1)));
            assign(ok, sum[low], min(sum[low], -crest(down, -v0, -v1)));
        }
        return reach;
    }
    // The rate of a cubic, a parabola with the mean m: v_0 + 2 a s - 6 b s (1 - s), a = (v_1 - v_0)/2, b = (v_0 + v_1)/2 - m.
    struct Rate {
        Number mean, a, b, most;  // most: the largest speed, at the ends or at the extreme inside, (v_0 + v_1)/2 - 3 b/2 - a^2/(6 b)
        SNAPBEAM_FN Rate(Number u0, Number v0, Number u1, Number v1, Number per) : mean((u1 - u0) * per), a(Number(0.5) * (v1 - v0)) {
            const Number middle = Number(0.5) * (v0 + v1);
            b = middle - mean, most = max(abs(v0), abs(v1));
            const auto inside = abs(a) < Number(3.0) * abs(b);
            const Number extreme = middle - fma(Number(1.5), b, a * a / (Number(6.0) * select(inside, b, Number(1.0))));
            most = select(inside, max(most, abs(extreme)), most);
        }
        SNAPBEAM_FN Number square(Number h) const { return h * fma(mean, mean, fma(Number(1.0 / 3.0) * a, a, Number(0.6) * b * b)); }
    };

    // Zero crossings of the centre, from values relative to the height that divides the wells.
    SNAPBEAM_FN void count_crossings(const Runs<L> &z, Marks ok, Number c0, Number v0, Number c1, Number v1) {
        using namespace snapbeam;
        const Number side = sum[SIDE], zero = Number(0.0), one = Number(1.0), h = z.h;
        const Marks once = ok & (side * c1 < zero);
        const Marks dips = ok & (!once) & (side * v0 < zero) & (side * v1 > zero);
        if (!any(once | dips)) return;
        const Cubic<Number> away(-side * c0, -side * v0, -side * c1, -side * v1, h);
        const Marks twice = dips & (crest(away, -side * v0, -side * v1) > zero);
        const Marks found = once | twice;
        if (!any(found)) return;
        Number share = root(away, one, once);
        if (any(twice)) {
            const Cubic<Number> back(-side * c1, side * v1, -side * c0, side * v0, h);  // from the end: its last crossing is the first
            assign(twice, share, one - root(back, min(back.summit(), one), twice));
        }
        const Number count = select(once, one, Number(2.0)), when = fma(share, h, Number(z.t * z.tick));
        sum[CROSSINGS] += select(found, count, zero);
        sum[LATE_CROSSINGS] += select(found & (value(when) > late * z.tick), count, zero);
        assign(found, sum[LAST_CROSSING], when);
        if (s->problem->high && s->problem->shift)
            change_well(z, found, once, select(once, share, root(away, min(away.summit(), one), twice)), select(once, one, share));
        assign(once, sum[SIDE], -side);
    }

    // What is missed at the end of a step that is followed inside, and varies slowly: c(x) = v x^2 (3 - 2 x) + lift x^2 (1 - x)^2 of the
    // rate at the fraction x of the step, with the integral u that the displacement lacks.
    struct Missed {
        Number u, v, h;
        SNAPBEAM_FN Number lift() const { return Number(30.0) * (u / h - Number(0.5) * v); }
        SNAPBEAM_FN void add(Real x, Number &to_u, Number &to_v, Number &to_a) const {
            const Number s = Number(x), rest = Number(1.0) - s, square = s * s, bump = s * rest;
            to_u += h * square * s * fma(v, Number(1.0) - Number(0.5) * s, lift() * (Number(1.0 / 3.0) - s * (Number(0.5) - Number(0.2) * s)));
            to_v += fma(v, square * (Number(3.0) - s - s), lift() * bump * bump);
            to_a += bump * fma(Number(6.0), v, Number(2.0) * lift() * (rest - s)) / h;
        }
    };
    // The extremes of what is observed, followed inside the step.
    SNAPBEAM_SELDOM void follow(const Runs<L> &z, Marks near, Number end_u, Number end_v, Number end_c, Number end_cv, Cell *memory) {
        using namespace snapbeam;
        const int n = s->size();
        const Number zero = Number(0.0), point_rest = z.sign * rest, center_rest = z.sign * s->center_rest;
        Missed of_point = {zero, zero, max(z.h, Number(1e-300))}, of_center = of_point;
        for (int pass = 0; pass < 2; ++pass) {
            Inside<L, Cell, Number> inside;
            inside.begin(z, memory);
            Number u = point.u, v = point.v, a = inside.bend(*s, row), c = center.u, cv = center.v, ca = inside.bend(*s, s->center);
            for (;;) {
                const Marks within = near & (inside.share < inside.parts);
                if (!any(within)) break;
                inside.advance(*s);
                const Number h = inside.part;
                Number u1 = point_rest + dot<L>(row, inside.q, n), v1 = dot<L>(row, inside.p, n), c1 = center_rest + dot<L>(s->center, inside.q, n), cv1 = dot<L>(s->center, inside.p, n);
                if (pass == 0) {
                    const Marks last = within & (!(inside.share < inside.parts));
                    assign(last, of_point.u, end_u - u1), assign(last, of_point.v, end_v - v1), assign(last, of_center.u, end_c - c1), assign(last, of_center.v, end_cv - cv1);
                    continue;
                }
                Number a1 = inside.bend(*s, row), ca1 = inside.bend(*s, s->center);
                of_point.add(inside.share / inside.parts, u1, v1, a1), of_center.add(inside.share / inside.parts, c1, cv1, ca1);
                widen(within, MIN_DISPLACEMENT, MAX_DISPLACEMENT, u, v, u1, v1, h), widen(within, MIN_CENTER, MAX_CENTER, c, cv, c1, cv1, h);
                speed_peak(within, PEAK_VELOCITY, u1 - u, v, a, v1, a1, h), speed_peak(within, PEAK_CENTER_VELOCITY, c1 - c, cv, ca, cv1, ca1, h);
                u = u1, v = v1, a = a1, c = c1, cv = cv1, ca = ca1;
            }
        }
    }
    // Largest speed: of the quartic through rates and accelerations at both ends that goes as far as was *moved*, the cubic and
    // lift s^2 (1 - s)^2, at the extreme of the cubic.
    static SNAPBEAM_CALLED Number speed_on(Number moved, Number v0, Number a0, Number v1, Number a1, Number h) {
        const Number side = select(a0 > Number(0.0), Number(1.0), Number(-1.0)), ends = max(abs(v0), abs(v1));
        const auto turns = side * a1 < Number(0.0);
        if (!any(turns)) return ends;
        const Cubic<Number> speed(side * v0, side * a0, side * v1, side * a1, h);
        const Number mean = fma(Number(0.5), v0 + v1, h * (a0 - a1) * Number(1.0 / 12.0)), lift = Number(30.0) * side * (moved / h - mean);
        const Number at = speed.summit(), bump = at * (Number(1.0) - at);
        return max(ends, select(turns, fma(lift * bump, bump, speed.at(at)), ends));
    }
    SNAPBEAM_FN void speed_peak(Marks which, snapbeam::Statistic k, Number moved, Number v0, Number a0, Number v1, Number a1, Number h) {
        assign(which, sum[k], max(sum[k], speed_on(moved, v0, a0, v1, a1, h)));
    }

    // Statistics of a user, before the step is added.
    SNAPBEAM_RARE void update(const Runs<L> &z, Marks ok, const Batch &batch, const int *run) const {
        using namespace snapbeam;
        const int n = s->size(), updates = s->problem->updates;
        const Channel<L> *first = z.channels && z.channel[0].contact ? z.channel : nullptr;
        const Number none = Number(-1e30), d0 = first ? first->d0 : none, d1 = first ? first->d1 : none;
        const Number u = height(z, z.q1), v = dot<L>(row, z.p1, n);
        const Number c = center_height(z, z.q1), cv = dot<L>(s->center, z.p1, n);
        const Number pairs[] = {point.u, u, point.v, v, center.u, c, center.v, cv, d0, d1};
        for (int l = 0; l < L::runs; ++l) {
            if (!lane(ok, l)) continue;
            double step[COMPLETED];
            step[COMPLETED_TIME] = lane(z.t, l) * lane(z.tick, l), step[COMPLETED_LENGTH] = lane(value(z.h), l);
            for (int i = 0; i < 10; ++i) step[COMPLETED_DISPLACEMENT + i] = lane(value(pairs[i]), l);
            step[COMPLETED_TOUCHING] = first && lane(first->closed, l) ? 1.0 : 0.0;
            for (int k = 0; k < updates; ++k) {
                double &held = batch.held[long(run[l]) * updates + k];
                held = reinterpret_cast<Update>(static_cast<decltype(sizeof 0)>(s->problem->update[k]))(held, step);
            }
        }
    }

    SNAPBEAM_FN Real so_far(snapbeam::Statistic k) const { return value(sum[k]); }
    SNAPBEAM_FN void add_step(Runs<L> &z, Marks ok, Plain *amplitude, Cell *memory) {
        using namespace snapbeam;
        const int n = s->size();
        const Number h = z.h, zero = Number(0.0);
        sum[STEPS] += select(ok, Number(1.0), zero);
        Number end_u, end_v;
        if (shared) {  // from its penetration
            const Channel<L> &c = z.channel[0];
            end_u = c.offset + c.tip - c.d1 + rest, end_v = c.tip_slope - c.r1;
        } else {
            end_u = height(z, z.q1), end_v = dot<L>(row, z.p1, n);
        }
        const Number end_c = center_height(z, z.q1), end_cv = dot<L>(s->center, z.p1, n);
        const Number u0 = point.u, v0 = point.v, u1 = end_u, v1 = end_v, c0 = center.u, cv0 = center.v, c1 = end_c, cv1 = end_cv;
        const Number level = s->dividing_height;
        const Marks changed = ok & differ(h, length);
        if (s->problem->high && any(changed)) correct(z, changed, h, false);
        count_crossings(z, ok, c0 - level, cv0, c1 - level, cv1);
        const Reach reach = widen(ok, MIN_DISPLACEMENT, MAX_DISPLACEMENT, u0, v0, u1, v1, h), center_reach = widen(ok, MIN_CENTER, MAX_CENTER, c0, cv0, c1, cv1, h);
        const Number per = select(h > zero, Number(1.0) / h, zero);
        const Rate rate(u0, v0, u1, v1, per), center_rate(c0, cv0, c1, cv1, per);
        Number speed = rate.most, center_speed = center_rate.most;
        const Real slack = Real(1e-4), wider = Real(1.05), bound_u = sqrt(most_u), bound_v = sqrt(most_v);
        const Real high = value(reach.high), low = value(reach.low), center_high = value(center_reach.high), center_low = value(center_reach.low);
        Marks near = ok & ((fma(wider, value(speed), bound_v) > so_far(PEAK_VELOCITY)) | (fma(wider, value(center_speed), bound_v) > so_far(PEAK_CENTER_VELOCITY)) |
                           (high + bound_u > so_far(MAX_DISPLACEMENT)) | (low - bound_u < so_far(MIN_DISPLACEMENT)) |
                           (center_high + bound_u > so_far(MAX_CENTER)) | (center_low - bound_u < so_far(MIN_CENTER)));
        if (any(near)) {
            const Marks asked = near;
            Real doubt, speed_doubt, center_doubt, center_speed_doubt;
            doubts(z, amplitude, doubt, speed_doubt, center_doubt, center_speed_doubt);
            const Marks higher = asked & ((fma(wider, value(speed), speed_doubt) > so_far(PEAK_VELOCITY)) | (fma(wider, value(center_speed), center_speed_doubt) > so_far(PEAK_CENTER_VELOCITY)));
            if (any(higher)) {  // with the accelerations at both ends the error of a speed is of fifth order
                assign(higher, speed, speed_on(u1 - u0, v0, bend_at(z, row, false), v1, bend_at(z, row, true), h));
                assign(higher, center_speed, speed_on(c1 - c0, cv0, bend_at(z, s->center, false), cv1, bend_at(z, s->center, true), h));
            }
            const Real span = so_far(MAX_DISPLACEMENT) - so_far(MIN_DISPLACEMENT), center_span = so_far(MAX_CENTER) - so_far(MIN_CENTER);
            near = (value(speed) + speed_doubt > so_far(PEAK_VELOCITY)) & (speed_doubt > slack * so_far(PEAK_VELOCITY));
            near = near | ((value(center_speed) + center_speed_doubt > so_far(PEAK_CENTER_VELOCITY)) & (center_speed_doubt > slack * so_far(PEAK_CENTER_VELOCITY)));
            near = near | ((doubt > slack * span) & ((high + doubt > so_far(MAX_DISPLACEMENT)) | (low - doubt < so_far(MIN_DISPLACEMENT))));
            near = near | ((center_doubt > slack * center_span) & ((center_high + center_doubt > so_far(MAX_CENTER)) | (center_low - center_doubt < so_far(MIN_CENTER))));
            near = near & asked;
        }
        assign(ok & (!near), sum[PEAK_VELOCITY], max(sum[PEAK_VELOCITY], speed));
        assign(ok & (!near), sum[PEAK_CENTER_VELOCITY], max(sum[PEAK_CENTER_VELOCITY], center_speed));
        if (any(near)) {
            follow(z, near, u1, v1, c1, cv1, memory);
            assign(near, sum[PEAK_VELOCITY], max(sum[PEAK_VELOCITY], abs(v1)));
            assign(near, sum[PEAK_CENTER_VELOCITY], max(sum[PEAK_CENTER_VELOCITY], abs(cv1)));
        }
        sum[SQUARE_DISPLACEMENT] += select(ok, square(u0, v0, u1, v1, h), zero), sum[SQUARE_CENTER] += select(ok, square(c0, cv0, c1, cv1, h), zero);
        sum[SQUARE_VELOCITY] += select(ok, rate.square(h), zero), sum[SQUARE_CENTER_VELOCITY] += select(ok, center_rate.square(h), zero);
        if (z.account) sum[DISSIPATED] += select(ok, z.dissipated, zero);
        for (int j = 0; j < z.channels; ++j) add_channel(z, z.channel[j], ok);
        assign(ok, point.u, end_u), assign(ok, point.v, end_v), assign(ok, center.u, end_c), assign(ok, center.v, end_cv);
    }
    SNAPBEAM_FN static Number square(Number u0, Number v0, Number u1, Number v1, Number h) {
        return fma(Number(0.5) * h, fma(u0, u0, u1 * u1), h * h * Number(1.0 / 6.0) * (u0 * v0 - u1 * v1));
    }
    // Errors of the cubics over a step of h, by the amplitude of a mode.
    template <class T> static SNAPBEAM_FN void doubts_of_mode(T h, T omega, T &of_u, T &of_v) {
        const T w = h * omega, w3 = w * w * w;
        of_u = h * min(w3 * T(1.0 / 384.0), T(2.5) / max(w, T(1.0))), of_v = min(w3 * w * w * T(1.0 / 13400.0), T(2.5));
    }
    // The same of the points observed, by the amplitudes of all modes.
    SNAPBEAM_FN void doubts(const Runs<L> &z, Plain *amplitude, Real &u, Real &v, Real &c, Real &cv) {
        u = v = c = cv = Real(0.0);
        const auto long_step = Real(s->fastest) * value(z.h) > Real(0.3);  // in a shorter one the errors are below 2e-5
        if (!any(long_step)) return;
        amplitudes(z, amplitude, value(z.h));
        Plain su = Plain(0.0), sv = Plain(0.0), sc = Plain(0.0), scv = Plain(0.0);
        const Plain h = Plain(value(z.h));
        SNAPBEAM_LOOP
        for (int i = 0; i < s->size(); ++i) {
            Plain of_u, of_v;
            doubts_of_mode(h, Plain(value(s->omega[i])), of_u, of_v);
            of_u *= amplitude[i], of_v *= amplitude[i];
            const Plain at = abs(value(row[i])), middle = abs(Plain(value(s->center[i])));
            su = fma(at, of_u, su), sv = fma(at, of_v, sv), sc = fma(middle, of_u, sc), scv = fma(middle, of_v, scv);
        }
        assign(long_step, u, L::total(su)), assign(long_step, v, L::total(sv));
        assign(long_step, c, L::total(sc)), assign(long_step, cv, L::total(scv));
    }

    SNAPBEAM_FN void add_channel(Runs<L> &z, Channel<L> &c, Marks ok) {
        using namespace snapbeam;
        const Number zero = Number(0.0);
        if (!c.active) return;
        Marks acts = ok;
        if (c.contact) {
            acts = ok & acting(c);
            deepen(z, c, acts);
            c.own_impulse += select(acts, c.impulse, zero);
        }
        c.sums[WORK] += select(acts, c.work, zero), c.sums[GROSS_WORK] += select(acts, abs(c.work), zero), c.sums[LOST] += select(acts, c.lost, zero);
        if (!c.harvests) return;
        Number most, before, after;  // at both ends what the power lost is P[0] times the square of
        if (c.circuit) {
            before = c.P[c.state], after = c.z;
            const Cubic<Number> up(before, c.r0, after, c.r1, z.h), down(-before, -c.r0, -after, -c.r1, z.h);
            most = max(max(abs(before), abs(after)), select(c.follows, zero, max(crest(up, c.r0, c.r1), crest(down, -c.r0, -c.r1))));
        } else {  // in proportion to a velocity
            before = dot<L>(c.row, z.p, s->size()), after = dot<L>(c.row, z.p1, s->size());
            Number speed = max(abs(before), abs(after));
            const Marks higher = acts & (Real(1.3) * value(speed) * value(c.P[0]) > value(c.sums[PEAK_FORCE]));
            if (any(higher)) assign(higher, speed, speed_on(dot<L>(c.row, z.q1, s->size()) - dot<L>(c.row, z.q, s->size()), before, bend_at(z, c.row, false), after, bend_at(z, c.row, true), z.h));
            most = c.P[0] * speed;
        }
        // of a step in which the last quarter begins, with a power that changes linearly
        const Number share = late_share(z), tilt = Number(0.5) * z.h * c.P[0] * (after * after - before * before);
        c.sums[LATE_LOST] += select(acts, share * fma(tilt, Number(1.0) - share, c.lost), zero);
        assign(acts, c.sums[PEAK_FORCE], max(c.sums[PEAK_FORCE], most));
    }

    // Part of the step in the last quarter of the run.
    SNAPBEAM_FN Number late_share(const Runs<L> &z) const {
        const Real raw = (z.t + z.ticks - late) / max(z.ticks, Real(1.0)), after = min(max(raw, Real(0.0)), Real(1.0));
        if constexpr (L::directions > 0)
            if (raw > 0.0 && raw <= 1.0) return Number(after) + (z.drift - later) / Number(value(z.h)) - Number(after) * (z.h / Number(value(z.h)) - Number(1.0));
        return Number(after);
    }

    // The sums become those of a time so much later, at the state in q, p; extremes that are taken there go along.
    void move_in_time(Runs<L> &z, Number by) requires(L::directions > 0) {
        using namespace snapbeam;
        const int n = s->size();
        const Number u = Number(value(point.u)), v = Number(value(point.v)), c = Number(value(center.u)), cv = Number(value(center.v));
        sum[SQUARE_DISPLACEMENT] += u * u * by, sum[SQUARE_VELOCITY] += v * v * by;
        sum[SQUARE_CENTER] += c * c * by, sum[SQUARE_CENTER_VELOCITY] += cv * cv * by;
        sum[ENERGY_TIME] += Number(value(modal_energy)) * by, sum[HIGH_ENERGY_TIME] += Number(value(high_energy)) * by;
        for (int i = 0; i < n && z.account; ++i) sum[DISSIPATED] += Number(2.0 * s->sigma[i].v * z.p[i].v * z.p[i].v) * by;
        for (int j = 0; j < z.channels; ++j) {
            Channel<L> &one = z.channel[j];
            if (one.contact && !one.closed) continue;
            const Number f = Number(value(one.law == AXIAL_LOAD ? signal_of(z, one) : force_of(z, one, z.q, z.p)));
            Number y = dot<L>(one.row, z.p, n), work = Number(0.0), lost = Number(0.0);
            if (one.contact) {
                y = signal_slope(z, one) - y, work = f * signal_slope(z, one);
                if (one.lossy && !one.impulsive) lost = (f - force_at(one, penetration(z, one, z.q), Number(0.0))) * y;
                one.own_impulse += f * by;
            } else if (one.timed) {
                if (one.law == AXIAL_LOAD) tension(z, z.q, dot_cells<L>(s->g, z.q, n)), y = fma(z.sign, dot<L>(s->g, z.p, n), dot<L>(z.r, z.p, n));
                work = f * y;
            } else if (one.circuit) {
                lost = one.P[0] * f * f;
            } else if (one.lossy) {
                lost = power_lost(one, along(z, one, z.q), y, f, f);
            }
            one.sums[WORK] += Number(value(work)) * by, one.sums[GROSS_WORK] += Number(abs(value(work))) * by, one.sums[LOST] += Number(value(lost)) * by;
            if (one.harvests && !(z.t < late)) one.sums[LATE_LOST] += Number(value(lost)) * by;
        }
    }
    // After the state has moved: what is observed, and at the end of the run what is largest there.
    void look_again(Runs<L> &z, bool at_end) requires(L::directions > 0) {
        using namespace snapbeam;
        const auto follow = [&](Number &to, Number moved) { to.d = moved.d; };
        const auto end = [&](Statistic k, Number x) { if (at_end && sum[k].v == x.v) sum[k].d = x.d; };
        follow(point.u, height(z, z.q)), follow(point.v, dot<L>(row, z.p, s->size()));
        follow(center.u, center_height(z, z.q)), follow(center.v, dot<L>(s->center, z.p, s->size()));
        end(MIN_DISPLACEMENT, point.u), end(MAX_DISPLACEMENT, point.u), end(MIN_CENTER, center.u), end(MAX_CENTER, center.u);
        end(PEAK_VELOCITY, abs(point.v)), end(PEAK_CENTER_VELOCITY, abs(center.v));
        for (int j = 0; j < z.channels; ++j) {
            Channel<L> &c = z.channel[j];
            if (!c.contact) continue;
            follow(c.d0, penetration(z, c, z.q)), follow(c.r0, signal_slope(z, c) - dot<L>(c.row, z.p, s->size()));
            c.d1.d = c.d0.d, c.r1.d = c.r0.d;
            if (!at_end || !c.closed || c.impulsive) continue;
            if (c.deepest.v == c.d0.v) c.deepest.d = c.d0.d;
            if (!c.lossy) continue;
            const Number f = force_at(c, max(c.d0, Number(0.0)), c.r0);
            if (c.hardest.v == f.v) c.hardest.d = f.d;
        }
        enter_well(z, true);
    }

    // Largest penetration and force of a contact so far.
    SNAPBEAM_FN void deepen(const Runs<L> &z, Channel<L> &c, Marks acts) {
        const Number zero = Number(0.0);
        if (c.impulsive) {  // the force that holds it together
            assign(acts, c.hardest, max(c.hardest, max(c.first_f, c.f))), assign(acts, c.deepest, c.hardest);
            return;
        }
        const Cubic<Number> depth(c.d0, c.r0, c.d1, c.r1, z.h);
        assign(acts, c.deepest, max(c.deepest, max(max(c.d0, c.d1), zero)));
        const auto turns = acts & (c.r0 > zero) & (c.r1 < zero);
        if (any(turns)) assign(turns, c.deepest, max(c.deepest, summit(z, c, turns)));
        if (!c.lossy || !any(acts)) return;
        // the parabola through the force at both ends and in the middle
        const Number half = Number(0.5), d = max(depth.at(half), zero), rate = depth.slope(half) / max(z.h, Number(1e-300));
        const Number f0 = force_at(c, max(c.d0, zero), c.r0), f1 = force_at(c, max(c.d1, zero), c.r1), fm = force_at(c, d, rate);
        const Number bend = f0 + f1 - Number(2.0) * fm, tilt = f1 - f0;
        const auto top = (bend < zero) & (abs(tilt) < Number(-2.0) * bend);
        const Number peak = max(max(f0, f1), select(top, fm - tilt * tilt / (Number(8.0) * bend), fm));
        assign(acts, c.hardest, max(c.hardest, peak));
    }

    // Largest penetration in a step in which it turns: where the rate, a cubic by its values and slopes, is zero.
    SNAPBEAM_SELDOM Number summit(const Runs<L> &z, const Channel<L> &c, Marks which) {
        Number a0 = -bend_at(z, c.row, false), a1 = signal_bend(z, c) - bend_at(z, c.row, true);
        a0 += sum_of_signals(z, c, [](const Signal<L> &one) { return one.acceleration_at_begin(); });
        const Cubic<Number> fall(-c.r0, -a0, -c.r1, -a1, z.h);
        const Number at = root(fall, Number(1.0), which);
        const Number mean = fma(at, fma(at, fma(at, Number(0.25) * fall.c3, Number(1.0 / 3.0) * fall.c2), Number(0.5) * fall.c1), fall.c0);
        return max(c.d0, Number(0.0)) - z.h * at * mean;
    }

    // Runs whose class is certain: too many crossings in the last quarter, or too little energy to leave the other well.
    SNAPBEAM_FN Marks decided(Runs<L> &z) {
        using namespace snapbeam;
        Marks found = (decide_crossings >= Real(0.0)) & (so_far(LATE_CROSSINGS) > decide_crossings);
        const Real steps = so_far(STEPS), sixteenth = nearest(steps * Real(1.0 / 16.0)) * Real(16.0);
        Marks asks = (decide_energy > Real(-1e300)) & (z.sign < Real(0.0)) & (!differ(steps, sixteenth));
        asks = asks & (value(point.u) > decide_reach) & (value(center.u) > Real(s->problem->dividing_height));
        for (int j = 0; j < z.channels; ++j)
            if (z.channel[j].contact) asks = asks & (!z.channel[j].closed);
        if (any(asks)) found = found | (asks & (value(energy(z, false)) < decide_energy));
        return found;
    }
    SNAPBEAM_SELDOM void finish(Runs<L> &z, Marks which) {
        using namespace snapbeam;
        if (s->problem->high) correct(z, which, Number(0.0), true);
        assign(which, sum[ENERGY], energy(z, true));
        assign(which, sum[DISPLACEMENT], point.u), assign(which, sum[CENTER], center.u);
    }
};

}  // namespace SNAPBEAM_SET
