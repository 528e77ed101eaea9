// Signals: functions of time that move strikers and the base, load the beam and act as forces.
//
//   TONE     s(t) = mean + amplitude sin(rate t + phase)
//   PIECES   s(t) = gain sum_k c_ik x^k, x = t - begin_i in [0, begin_(i+1) - begin_i): polynomials of degree five, from a table
//   SWEEP    s(t) = size/w(t)^p sin(integral of w), w from first to last within a duration, linear in time or exponential; p = 0, 1, 2
//   TONES    the sum of many tones (PARTIALs, which are no signals of their own), by its power series about the middles of cells in
//            which the fastest turns by 2 rad:  c_0 = A sin, c_1 = A rate cos, c_(n+2) = -c_n rate^2/((n + 1)(n + 2))
//
// with t from the signal's own beginning.  A signal may have a window, another signal by which it is multiplied: a burst is a tone in
// a window of pieces.  A channel adds its signals with factors.  A signal is taken to the end of a step at once, and to the kicks
// inside only where it acts there.  Of a tone, sine and cosine advance by products that were formed once for the length of the step.
// Every ANCHOR steps a signal is taken from the time again.  At a jump of a derivative a step ends, and its last kick sees the signal
// just before.
#pragma once
#include "structure.hpp"

namespace SNAPBEAM_SET {

#if defined(SNAPBEAM_ONLY_TONES)  // as a kernel for one structure may know
constexpr bool ONLY_TONES = true;
#else
constexpr bool ONLY_TONES = false;
#endif
constexpr double ANCHOR = 64.0;
constexpr int WHOLE = MOST_DISTINCT;  // the whole step, among the flows
constexpr int SERIES = 18;  // coefficients of a sum of tones: 1/18! = 2e-16
constexpr double CELL = 2.0;  // by which the fastest turns, rad

// Where a signal is: sine and cosine of a tone; time (s), value and derivatives of the others.
template <class L> struct Moment {
    typename L::Number sine, cosine, now, value, slope, bend;
};

template <class L> struct Signal {
    typedef typename L::Number Number;
    typedef typename L::Real Real;
    typedef typename L::Marks Marks;
    typedef decltype(part(Number(0.0), 0)) One;           // a number of one run
    int kind;
    const double *pieces;                                 // rows of PIECE_NUMBERS
    const double *tones[L::runs];                         // of each run the partials, rows of SIGNAL_NUMBERS
    const snapbeam::Tangent *tangent;                     // derivatives of both; null: none
    long slopes, all;                                     // of the partials the first there, and all signals
    Signal *window;                                       // null: none
    bool acts, formed;                                    // in the kicks of the step; advances over its flows are at hand
    Number p[snapbeam::SIGNAL_NUMBERS];                   // numbers, in the order of api.hpp
    Moment<L> at, begun, kept;                            // at the kick, at the beginning of the step, put aside
    Number ahead_sine[WHOLE + 1], ahead_cosine[WHOLE + 1];  // over each flow of the step and all of it; of others than tones times
    // The polynomial at hand of others than tones and sweeps: it holds from low to high (s), or in the cell low of a sum of tones.
    Real low, high;
    Number origin, series[ONLY_TONES ? 1 : SERIES];
    int piece[L::runs];                                   // the piece at hand, at which the search begins

    SNAPBEAM_FN bool is_tone() const { return ONLY_TONES || kind == snapbeam::TONE; }
    SNAPBEAM_FN bool windowed() const { return !ONLY_TONES && window; }
    SNAPBEAM_FN Number own_value(const Moment<L> &m) const { return is_tone() ? fma(p[snapbeam::AMPLITUDE], m.sine, p[snapbeam::MEAN]) : m.value; }
    SNAPBEAM_FN Number own_slope(const Moment<L> &m) const { return is_tone() ? p[snapbeam::AMPLITUDE] * p[snapbeam::RATE] * m.cosine : m.slope; }
    SNAPBEAM_FN Number own_bend(const Moment<L> &m) const {
        return is_tone() ? -(p[snapbeam::AMPLITUDE] * p[snapbeam::RATE] * p[snapbeam::RATE] * m.sine) : m.bend;
    }
    SNAPBEAM_FN Number value_at() const { return windowed() ? window->own_value(window->at) * own_value(at) : own_value(at); }
    SNAPBEAM_FN Number slope() const {
        if (!windowed()) return own_slope(at);
        return fma(window->own_slope(window->at), own_value(at), window->own_value(window->at) * own_slope(at));
    }
    SNAPBEAM_FN Number acceleration() const { return acceleration_of(at, windowed() ? &window->at : nullptr); }
    SNAPBEAM_FN Number acceleration_at_begin() const { return acceleration_of(begun, windowed() ? &window->begun : nullptr); }
    SNAPBEAM_FN Number acceleration_of(const Moment<L> &m, const Moment<L> *w) const {
        if (!w) return own_bend(m);
        return fma(window->own_bend(*w), own_value(m), fma(Number(2.0) * window->own_slope(*w), own_slope(m), window->own_value(*w) * own_bend(m)));
    }
    // Bounds over all times.
    SNAPBEAM_FN Number greatest_value() const { return p[snapbeam::MOST_VALUE]; }
    SNAPBEAM_FN Number greatest_slope() const { return p[snapbeam::MOST_SLOPE]; }
    SNAPBEAM_FN Number greatest_bend() const { return p[snapbeam::MOST_BEND]; }
    // Error of the cubic through values and slopes at the ends of *h*.
    SNAPBEAM_FN Number doubt(Number h) const {
        const Number w = p[snapbeam::RATE] * h, square = w * w;
        const bool sum = !ONLY_TONES && kind == snapbeam::TONES;
        if ((is_tone() || sum) && !windowed()) return (sum ? greatest_value() : abs(p[snapbeam::AMPLITUDE])) * min(square * square * Number(1.0 / 384.0), Number(2.5));
        return min(greatest_bend() * h * h * Number(1.0 / 16.0), Number(2.5) * greatest_value());
    }

    // Value and derivatives of others than tones at at.now.
    SNAPBEAM_CALLED void evaluate() {
        if (kind == snapbeam::SWEEP) return of_sweep(at.now);
        const bool sum = kind == snapbeam::TONES;
        const Real now = value(at.now), cell = nearest(now * value(p[snapbeam::RATE]) * Real(1.0 / CELL));
        const Marks stale = sum ? differ(cell, low) : !((now >= low) & (now < high));
        if (any(stale))
            for (int l = 0; l < L::runs; ++l)
                if (lane(stale, l)) sum ? expand(l, lane(cell, l)) : take_piece(l, lane(now, l));
        const Number x = at.now - origin;
        int k = sum ? SERIES - 1 : 5;
        Number found = series[k], slope = Number(0.0), bend = slope;
        while (--k >= 0) bend = fma(bend, x, slope), slope = fma(slope, x, found), found = fma(found, x, series[k]);
        at.value = found, at.slope = slope, at.bend = Number(2.0) * bend;
    }
    SNAPBEAM_SELDOM void take_piece(int l, double now) {
        using namespace snapbeam;
        const long begins = long(lane(p[FIRST_PIECE], l)) * PIECE_NUMBERS;
        const double *rows = pieces + begins;
        const int count = int(lane(p[PIECE_COUNT], l));
        int &i = piece[l];
        if (i >= count) i = 0;
        while (i + 1 < count && now >= rows[(i + 1) * PIECE_NUMBERS]) ++i;
        while (i > 0 && now < rows[i * PIECE_NUMBERS]) --i;
        const auto number = [&](int k) {
            One found = One(rows[i * PIECE_NUMBERS + k]);
            if constexpr (L::directions > 0)
                for (int d = 0; tangent->pieces && d < L::directions; ++d) found.d.set(d, tangent->pieces[d * tangent->all_pieces + begins + i * PIECE_NUMBERS + k]);
            return found;
        };
        set_lane(low, l, i > 0 ? rows[i * PIECE_NUMBERS] : -INFINITY), set_lane(high, l, i + 1 < count ? rows[(i + 1) * PIECE_NUMBERS] : INFINITY);
        set_part(origin, l, number(0));
        for (int k = 0; k < 6; ++k) set_part(series[k], l, part(p[GAIN], l) * number(k + 1));
    }
    SNAPBEAM_SELDOM void expand(int l, double cell) {
        using namespace snapbeam;
        constexpr int W = L::directions > 0 ? 1 : SNAPBEAM_WIDTH;
        const double middle = CELL * cell / lane(p[RATE], l);
        const auto number = [&](int i, int k) {
            One found = One(tones[l][i * SIGNAL_NUMBERS + k]);
            if constexpr (L::directions > 0)
                for (int d = 0; d < L::directions; ++d) found.d.set(d, tangent->signals[(slopes + d * all + i) * SIGNAL_NUMBERS + k]);
            return found;
        };
        One sum[SERIES];
        for (One &x : sum) x = One(0.0);
        for (int from = 0, count = int(lane(p[TONE_COUNT], l)); from < count; from += W) {
            typename Either<(L::directions > 0), One, Wide>::Type angle(0.0);
            for (int i = from; i < from + W && i < count; ++i) set_part(angle, i - from, fma(number(i, RATE), One(middle), number(i, PHASE)));
            const auto at = turn(angle);
            for (int i = from; i < from + W && i < count; ++i) {
                const One size = number(i, AMPLITUDE), rate = number(i, RATE), falls = -(rate * rate);
                One even = size * part(at.sine, i - from), odd = size * rate * part(at.cosine, i - from);
                sum[0] += number(i, MEAN);
                for (int n = 0; n < SERIES; n += 2) {
                    sum[n] += even, sum[n + 1] += odd;
                    even *= falls * One(1.0 / ((n + 1) * (n + 2))), odd *= falls * One(1.0 / ((n + 2) * (n + 3)));
                }
            }
        }
        set_lane(low, l, cell), set_part(origin, l, One(middle));
        for (int k = 0; k < SERIES; ++k) set_part(series[k], l, sum[k]);
    }
    SNAPBEAM_FN void of_sweep(Number t) {
        using namespace snapbeam;
        const Number first = p[FIRST_RATE], last = p[LAST_RATE], duration = p[DURATION], size = p[SIZE], s = min(t, duration), zero = Number(0.0);
        const Marks over = !(t < duration), exponential = differ(p[EXPONENTIAL], zero) & differ(last, first);
        Number change = (last - first) / duration, now = first + change * s, angle = s * (first + Number(0.5) * change * s), curve = zero;
        if (any(exponential)) {
            const Number grows = log(last / first) / duration, faster = first * exp(grows * s);
            assign(exponential, angle, (faster - first) / grows), assign(exponential, change, grows * faster);
            assign(exponential, curve, grows * change), assign(exponential, now, faster);
        }
        angle = angle + last * (t - s);
        assign(over, now, last), assign(over, change, zero), assign(over, curve, zero);
        const Turn<Number> of = turn(angle);
        const Number n = p[POWER], a = size / select(n < Number(0.5), Number(1.0), select(n < Number(1.5), now, now * now)), falls = -n * a * change / now;
        const Number curves = n * a * ((n + Number(1.0)) * change * change / (now * now) - curve / now);
        at.value = a * of.sine, at.slope = a * now * of.cosine + falls * of.sine;
        at.bend = (curves - a * now * now) * of.sine + (Number(2.0) * falls * now + a * change) * of.cosine;
    }

    // The beginning of a step at *t* ticks, from the time itself.
    SNAPBEAM_FN void begin(Marks which, Real t, Real tick, Number late) {
        using namespace snapbeam;
        if (!any(which)) return;
        if (is_tone()) {
            const Real wrapped = select(value(p[PERIOD]) > Real(0.0), remainder(t, max(value(p[PERIOD]), Real(1.0))), t);
            Number angle = fma(p[RATE], Number(wrapped * tick), p[PHASE]);
            if constexpr (L::directions > 0) angle += fma(p[RATE], late, Number((t - wrapped) * tick) * (p[RATE] - Number(value(p[RATE]))));
            const Turn<Number> now = turn(angle);
            assign(which, at.sine, now.sine), assign(which, at.cosine, now.cosine);
        } else {
            Number now = fma(Number(t), Number(tick), p[SHIFT]);
            if constexpr (L::directions > 0) now += late;
            assign(which, at.now, now);
            evaluate();
        }
        go_on(which);
    }
    // The next step begins where the last one ended.
    SNAPBEAM_FN void go_on(Marks which) {
        assign(which, begun.sine, at.sine), assign(which, begun.cosine, at.cosine);
        if (is_tone()) return;
        assign(which, begun.now, at.now), assign(which, begun.value, at.value), assign(which, begun.slope, at.slope), assign(which, begun.bend, at.bend);
    }
    SNAPBEAM_FN void set_length(Number h) { ahead(WHOLE, h), formed = false; }
    SNAPBEAM_FN void act(const Composition &c, Number h) {
        act_alone(c, h);
        if (windowed()) window->act_alone(c, h);
    }
    SNAPBEAM_FN void act_alone(const Composition &c, Number h) {
        acts = true;
        SNAPBEAM_LOOP
        for (int f = 0; f < c.distinct && !formed; ++f) ahead(f, h * Number(c.flow[f]));
        formed = true;
    }
    SNAPBEAM_FN void ahead(int f, Number time) {
        if (is_tone()) {
            const Turn<Number> turned = turn(Number(p[snapbeam::RATE] * time));
            ahead_sine[f] = turned.sine, ahead_cosine[f] = turned.cosine;
        } else {
            ahead_sine[f] = time;
        }
    }
    SNAPBEAM_FN void advance(int f) { advance_from(at, f); }
    SNAPBEAM_FN void advance_from(const Moment<L> &from, int f) {
        if (is_tone()) {
            const Number turned = fma(from.sine, ahead_cosine[f], from.cosine * ahead_sine[f]);
            at.cosine = fma(from.cosine, ahead_cosine[f], -(from.sine * ahead_sine[f]));
            at.sine = turned;
        } else {
            at.now = from.now + ahead_sine[f];
            evaluate();
        }
    }
    SNAPBEAM_FN void copy(Moment<L> &to, const Moment<L> &from) const {
        to.sine = from.sine, to.cosine = from.cosine;
        if (!is_tone()) to.now = from.now, to.value = from.value, to.slope = from.slope, to.bend = from.bend;
    }
    // The derivatives are those of a time so much later.
    static SNAPBEAM_FN void move_in_time(Moment<L> &m, Number rate, Number later) requires(L::directions > 0) {
        const Number sine = m.sine;
        const double turned = rate.v;
        m.sine += Number(turned * m.cosine.v) * later, m.cosine -= Number(turned * sine.v) * later;
        m.now += later, m.value += Number(m.slope.v) * later, m.slope += Number(m.bend.v) * later;
    }
    SNAPBEAM_FN void move_in_time(Number later) requires(L::directions > 0) { move_in_time(at, p[snapbeam::RATE], later), move_in_time(begun, p[snapbeam::RATE], later); }
    // Just before a jump at the end of the step.
    SNAPBEAM_FN void before_jump(Marks jumps, Real end, Real tick, Number late) {
        if (is_tone()) return;
        Number now = fma(Number(end - Real(1.5)), Number(tick), p[snapbeam::SHIFT]);
        if constexpr (L::directions > 0) now += late;
        assign(jumps, at.now, now);
        evaluate();
    }
    template <class F> void visit(F number) {
        number(begun.sine), number(begun.cosine), number(begun.now), number(begun.value), number(begun.slope), number(begun.bend);
    }
};

}  // namespace SNAPBEAM_SET
