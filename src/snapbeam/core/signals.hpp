// Signals: functions of time that move strikers and the base, load the beam and act as forces.
//
//   TONE     s(t) = mean + amplitude sin(rate t + phase)
//   PIECES   s(t) = gain sum_k c_ik x^k, x = t - begin_i in [0, begin_(i+1) - begin_i): polynomials of degree five, from a table
//   SWEEP    s(t) = size/w(t)^p sin(integral of w), w from first to last within a duration, linear in time or exponential; p = 0, 1, 2
//
// with t from the signal's own beginning.  A signal may have a window, another signal by which it is multiplied: a burst is a tone in
// a window of pieces.  A channel adds its signals with factors.  A signal is taken to the end of a step at once, and to the kicks
// inside only where it acts there.  Of a tone, sine and cosine advance by products that were formed once for the length of the step,
// and are taken from the time again every ANCHOR steps.  At a jump of a derivative a step ends, and its last kick sees the signal
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

// Where a signal is: sine and cosine of a tone; time (s), value and derivatives of the others.
template <class L> struct Moment {
    typename L::Number sine, cosine, now, value, slope, bend;
};

template <class L> struct Signal {
    typedef typename L::Number Number;
    typedef typename L::Real Real;
    typedef typename L::Marks Marks;
    int kind;
    const double *pieces;                                 // rows of PIECE_NUMBERS
    const snapbeam::Tangent *tangent;                     // and their derivatives; null: none
    Signal *window;                                       // null: none
    bool acts, formed;                                    // in the kicks of the step; advances over its flows are at hand
    Number p[snapbeam::SIGNAL_NUMBERS];                   // numbers, in the order of api.hpp
    Moment<L> at, begun, kept;                            // at the kick, at the beginning of the step, put aside
    Number ahead_sine[WHOLE + 1], ahead_cosine[WHOLE + 1];  // over each flow of the step and all of it; of others than tones times
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
        if (is_tone() && !windowed()) return abs(p[snapbeam::AMPLITUDE]) * min(square * square * Number(1.0 / 384.0), Number(2.5));
        return min(greatest_bend() * h * h * Number(1.0 / 16.0), Number(2.5) * greatest_value());
    }

    // Value and derivatives of others than tones at at.now.
    SNAPBEAM_CALLED void evaluate() {
        if constexpr (L::directions > 0) {
            evaluate(0, at.now, p, at.value, at.slope, at.bend);
        } else {
            for (int l = 0; l < L::runs; ++l) {
                double own[snapbeam::SIGNAL_NUMBERS], value, slope, bend;
                for (int k = 0; k <= snapbeam::POWER; ++k) own[k] = lane(p[k], l);
                evaluate(l, lane(at.now, l), own, value, slope, bend);
                set_lane(at.value, l, value), set_lane(at.slope, l, slope), set_lane(at.bend, l, bend);
            }
        }
    }
    template <class T> SNAPBEAM_FN void evaluate(int l, T t, const T *own, T &value, T &slope, T &bend) {
        if (kind == snapbeam::PIECES) of_pieces(l, t, own, value, slope, bend);
        else of_sweep(t, own, value, slope, bend);
    }
    template <class T> SNAPBEAM_FN void of_pieces(int l, T t, const T *own, T &value, T &slope, T &bend) {
        using namespace snapbeam;
        const long begins = long(lane(own[FIRST_PIECE], 0)) * PIECE_NUMBERS;
        const double *rows = pieces + begins, at = lane(t, 0);
        const int count = int(lane(own[PIECE_COUNT], 0));
        int &i = piece[l];
        if (i >= count) i = 0;
        while (i + 1 < count && at >= rows[(i + 1) * PIECE_NUMBERS]) ++i;
        while (i > 0 && at < rows[i * PIECE_NUMBERS]) --i;
        const auto number = [&](int k) {
            T found = T(rows[i * PIECE_NUMBERS + k]);
            if constexpr (L::directions > 0)
                for (int d = 0; tangent->pieces && d < L::directions; ++d) found.d.set(d, tangent->pieces[d * tangent->all_pieces + begins + i * PIECE_NUMBERS + k]);
            return found;
        };
        const T x = t - number(0), gain = own[GAIN];
        value = number(6), slope = bend = T(0.0);
        for (int k = 5; k >= 1; --k) bend = fma(bend, x, slope), slope = fma(slope, x, value), value = fma(value, x, number(k));
        value = gain * value, slope = gain * slope, bend = T(2.0) * gain * bend;
    }
    template <class T> SNAPBEAM_FN static void of_sweep(T t, const T *own, T &value, T &slope, T &bend) {
        using namespace snapbeam;
        const T first = own[FIRST_RATE], last = own[LAST_RATE], duration = own[DURATION], size = own[SIZE], s = min(t, duration);
        T now, angle, change, curve = T(0.0);
        if (lane(own[EXPONENTIAL], 0) != 0.0 && differ(last, first)) {
            const T grows = log(last / first) / duration;
            now = first * exp(grows * s), angle = (now - first) / grows, change = grows * now, curve = grows * change;
        } else {
            change = (last - first) / duration, now = first + change * s, angle = s * (first + T(0.5) * change * s);
        }
        angle = angle + last * (t - s);
        if (!(t < duration)) now = last, change = curve = T(0.0);
        const Turn<T> of = turn(angle - T(6.283185307179586 * ::floor(lane(angle, 0) / 6.283185307179586)));
        const double p = lane(own[POWER], 0);
        const T a = p == 0.0 ? size : p == 1.0 ? size / now : size / (now * now), falls = T(-p) * a * change / now;
        const T curves = T(p) * a * (T(p + 1.0) * change * change / (now * now) - curve / now);
        value = a * of.sine, slope = a * now * of.cosine + falls * of.sine;
        bend = (curves - a * now * now) * of.sine + (T(2.0) * falls * now + a * change) * of.cosine;
    }

    // The beginning of a step at *t* ticks: of a tone where it is anchored, of others where the step is a new one.
    SNAPBEAM_FN void begin(Marks anchored, Marks fresh, Real t, Real tick, Number late) {
        using namespace snapbeam;
        if (is_tone()) {
            if (!any(anchored)) return;
            const Real wrapped = select(value(p[PERIOD]) > Real(0.0), remainder(t, max(value(p[PERIOD]), Real(1.0))), t);
            Number angle = fma(p[RATE], Number(wrapped * tick), p[PHASE]);
            if constexpr (L::directions > 0) angle += fma(p[RATE], late, Number((t - wrapped) * tick) * (p[RATE] - Number(value(p[RATE]))));
            const Turn<Number> now = turn(angle);
            assign(anchored, begun.sine, now.sine), assign(anchored, begun.cosine, now.cosine);
        } else if (any(fresh)) {
            at.now = fma(Number(t), Number(tick), p[SHIFT]);
            if constexpr (L::directions > 0) at.now += late;
            evaluate();
            assign(fresh, begun.now, at.now), assign(fresh, begun.value, at.value), assign(fresh, begun.slope, at.slope), assign(fresh, begun.bend, at.bend);
        }
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
