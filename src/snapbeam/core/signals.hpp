// Signals: functions of time that move strikers and the base, load the beam and act as forces.
//
//   s(t) = mean + amplitude sin(rate t + phase)
//
// A constant has amplitude 0.  Within a step the angle advances by products of sines and cosines that were formed once for the
// length of the step.  A channel adds its signals with factors.
#pragma once
#include "structure.hpp"

namespace SNAPBEAM_SET {

template <class L> struct Signal {
    typedef typename L::Number Number;
    typedef typename L::Real Real;
    Number mean, amplitude, rate, phase;
    Real period;                                          // ticks, 0: none
    Number sine0, cosine0;                                // at the beginning of the step
    Number sine, cosine;                                  // at the kick
    Number kept_sine, kept_cosine;                        // at the end of the step, while its inside is followed
    Number ahead_sine[MOST_DISTINCT], ahead_cosine[MOST_DISTINCT];  // over each flow of the step

    SNAPBEAM_FN Number value_at() const { return fma(amplitude, sine, mean); }
    SNAPBEAM_FN Number slope() const { return amplitude * rate * cosine; }
    SNAPBEAM_FN Number acceleration() const { return -(amplitude * rate * rate * sine); }
    SNAPBEAM_FN Number acceleration_at_begin() const { return -(amplitude * rate * rate * sine0); }
    SNAPBEAM_FN Number greatest_slope() const { return abs(amplitude * rate); }

    // At a time of *t* ticks, and *late* seconds later.
    SNAPBEAM_FN void begin(Real t, Real tick) {
        const Real wrapped = select(period > Real(0.0), remainder(t, max(period, Real(1.0))), t);
        const Turn<Number> now = turn(Number(fma(rate, Number(wrapped * tick), phase)));
        sine0 = sine = now.sine, cosine0 = cosine = now.cosine;
    }
    SNAPBEAM_FN void set_length(const Composition &c, Number h) {
        for (int f = 0; f < c.distinct; ++f) {
            const Turn<Number> ahead = turn(Number(rate * h * Number(c.flow[f])));
            ahead_sine[f] = ahead.sine, ahead_cosine[f] = ahead.cosine;
        }
    }
    SNAPBEAM_FN void advance(Number by_sine, Number by_cosine) {
        const Number turned = fma(sine, by_cosine, cosine * by_sine);
        cosine = fma(cosine, by_cosine, -(sine * by_sine));
        sine = turned;
    }
};

}  // namespace SNAPBEAM_SET
