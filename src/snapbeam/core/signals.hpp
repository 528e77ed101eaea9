// Signals: functions of time that move strikers and the base, load the beam and act as forces.
//
//   TONE     s(t) = mean + amplitude sin(rate t + phase)
//   PIECES   s(t) = gain sum_k c_ik x^k, x = t - begin_i in [0, begin_(i+1) - begin_i): polynomials of degree five, from a table
//   SWEEP    s(t) = speed/w(t) sin(integral of w), w from first to last within a duration, linear in time or exponential
//
// with t from the signal's own beginning.  A signal may have a window, another signal by which it is multiplied: a burst is a tone in
// a window of pieces.  A channel adds its signals with factors.  A signal is taken to the end of a step at once, and to the kicks
// inside only where it acts there.  Of a tone, sine and cosine advance by products that were formed once for the length of the step,
// and are taken from the time again every ANCHOR steps.  At a jump of a derivative a step ends, and its last kick sees the signal
// just before.
#pragma once
#include "structure.hpp"

namespace SNAPBEAM_SET {

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
    Signal *window;                                       // null: none
    bool acts, formed;                                    // in the kicks of the step; advances over its flows are at hand
    Number p[snapbeam::SIGNAL_NUMBERS];                   // numbers, in the order of api.hpp
    Moment<L> at, begun, kept;                            // at the kick, at the beginning of the step, put aside
    Number ahead_sine[WHOLE + 1], ahead_cosine[WHOLE + 1];  // over each flow of the step and all of it; of others than tones times
    int piece[L::runs];                                   // the piece at hand, at which the search begins

    SNAPBEAM_FN bool is_tone() const { return kind == snapbeam::TONE; }
    SNAPBEAM_FN Number own_value(const Moment<L> &m) const { return is_tone() ? fma(p[snapbeam::AMPLITUDE], m.sine, p[snapbeam::MEAN]) : m.value; }
    SNAPBEAM_FN Number own_slope(const Moment<L> &m) const { return is_tone() ? p[snapbeam::AMPLITUDE] * p[snapbeam::RATE] * m.cosine : m.slope; }
    SNAPBEAM_FN Number own_bend(const Moment<L> &m) const {
        return is_tone() ? -(p[snapbeam::AMPLITUDE] * p[snapbeam::RATE] * p[snapbeam::RATE] * m.sine) : m.bend;
    }
    SNAPBEAM_FN Number value_at() const { return window ? window->own_value(window->at) * own_value(at) : own_value(at); }
    SNAPBEAM_FN Number slope() const {
        if (!window) return own_slope(at);
        return fma(window->own_slope(window->at), own_value(at), window->own_value(window->at) * own_slope(at));
    }
    SNAPBEAM_FN Number acceleration() const { return acceleration_of(at, window ? &window->at : nullptr); }
    SNAPBEAM_FN Number acceleration_at_begin() const { return acceleration_of(begun, window ? &window->begun : nullptr); }
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
        if (is_tone() && !window) return abs(p[snapbeam::AMPLITUDE]) * min(square * square * Number(1.0 / 384.0), Number(2.5));
        return min(greatest_bend() * h * h * Number(1.0 / 16.0), Number(2.5) * greatest_value());
    }

    // Value and derivatives of others than tones at at.now.
    SNAPBEAM_FN void evaluate() {
        for (int l = 0; l < L::runs; ++l) {
            double found[3];
            if (kind == snapbeam::PIECES) of_pieces(l, lane(at.now, l), found);
            else of_sweep(l, lane(at.now, l), found);
            set_lane(at.value, l, found[0]), set_lane(at.slope, l, found[1]), set_lane(at.bend, l, found[2]);
        }
    }
    SNAPBEAM_FN void of_pieces(int l, double t, double *found) {
        using namespace snapbeam;
        const double *rows = pieces + long(lane(p[FIRST_PIECE], l)) * PIECE_NUMBERS, gain = lane(p[GAIN], l);
        const int count = int(lane(p[PIECE_COUNT], l));
        int &i = piece[l];
        if (i >= count) i = 0;
        while (i + 1 < count && t >= rows[(i + 1) * PIECE_NUMBERS]) ++i;
        while (i > 0 && t < rows[i * PIECE_NUMBERS]) --i;
        const double *c = rows + i * PIECE_NUMBERS + 1, x = t - c[-1];
        double value = c[5], slope = 0.0, bend = 0.0;
        for (int k = 4; k >= 0; --k) bend = fma(bend, x, slope), slope = fma(slope, x, value), value = fma(value, x, c[k]);
        found[0] = gain * value, found[1] = gain * slope, found[2] = 2.0 * gain * bend;
    }
    SNAPBEAM_FN void of_sweep(int l, double t, double *found) const {
        using namespace snapbeam;
        const double first = lane(p[FIRST_RATE], l), last = lane(p[LAST_RATE], l), duration = lane(p[DURATION], l), speed = lane(p[SPEED], l);
        const double s = t < duration ? t : duration;
        double now, angle, change, bend = 0.0;
        if (lane(p[EXPONENTIAL], l) != 0.0 && last != first) {
            const double grows = ::log(last / first) / duration;
            now = first * ::exp(grows * s), angle = (now - first) / grows, change = grows * now, bend = grows * change;
        } else {
            change = (last - first) / duration, now = first + change * s, angle = s * (first + 0.5 * change * s);
        }
        angle += last * (t - s);
        if (!(t < duration)) now = last, change = bend = 0.0;
        const Turn<double> of = turn(angle - 6.283185307179586 * ::floor(angle / 6.283185307179586));
        const double a = speed / now, falls = -a * change / now, curves = a * (2.0 * change * change / (now * now) - bend / now);
        found[0] = a * of.sine, found[1] = speed * of.cosine + falls * of.sine;
        found[2] = (curves - a * now * now) * of.sine + (2.0 * falls * now + a * change) * of.cosine;
    }

    // The beginning of a step at *t* ticks: of a tone where it is anchored, of others where the step is a new one.
    SNAPBEAM_FN void begin(Marks anchored, Marks fresh, Real t, Real tick) {
        using namespace snapbeam;
        if (is_tone()) {
            if (!any(anchored)) return;
            const Real wrapped = select(value(p[PERIOD]) > Real(0.0), remainder(t, max(value(p[PERIOD]), Real(1.0))), t);
            const Turn<Number> now = turn(Number(fma(p[RATE], Number(wrapped * tick), p[PHASE])));
            assign(anchored, begun.sine, now.sine), assign(anchored, begun.cosine, now.cosine);
        } else if (any(fresh)) {
            at.now = fma(Number(t), Number(tick), p[SHIFT]);
            evaluate();
            assign(fresh, begun.now, at.now), assign(fresh, begun.value, at.value), assign(fresh, begun.slope, at.slope), assign(fresh, begun.bend, at.bend);
        }
    }
    SNAPBEAM_FN void set_length(Number h) { ahead(WHOLE, h), formed = false; }
    SNAPBEAM_FN void act(const Composition &c, Number h) {
        acts = true;
        for (int f = 0; f < c.distinct && !formed; ++f) ahead(f, h * Number(c.flow[f]));
        formed = true;
        if (window) window->act(c, h);
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
    // Just before a jump at the end of the step.
    SNAPBEAM_FN void before_jump(Marks jumps, Real end, Real tick) {
        if (is_tone()) return;
        assign(jumps, at.now, fma(Number(end - Real(1.5)), Number(tick), p[snapbeam::SHIFT]));
        evaluate();
    }
    template <class F> void visit(F number) {
        number(begun.sine), number(begun.cosine), number(begun.now), number(begun.value), number(begun.slope), number(begun.bend);
    }
};

}  // namespace SNAPBEAM_SET
