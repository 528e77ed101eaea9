// Boost.odeint's adaptive steppers over a right-hand side that is handed in by its address.

#include <boost/numeric/odeint.hpp>
#include <boost/version.hpp>
#include <exception>
#include <vector>

namespace odeint = boost::numeric::odeint;

typedef std::vector<double> State;
typedef void (*Slope)(double, double *, double *, double *);

struct System {
    Slope slope;
    double *data;
    void operator()(const State &x, State &dxdt, double t) const {
        slope(t, const_cast<double *>(x.data()), dxdt.data(), data);
    }
};

struct Keep {
    double *out;
    void operator()(const State &x, double) {
        for (double value : x) *out++ = value;
    }
};

template <class Stepper>
static void run(Stepper stepper, System system, State &x, const std::vector<double> &times, double *out) {
    const double first = 1e-6;
    if (out == nullptr)
        odeint::integrate_adaptive(stepper, system, x, times.front(), times.back(), first);
    else
        odeint::integrate_times(stepper, system, x, times.begin(), times.end(), first, Keep{out});
}

extern "C" const char *version() { return BOOST_LIB_VERSION; }

// Integrate from times[0] on; out holds the states at all times, or is null. Returns 0, or 1 if it failed.
extern "C" int solve(int method, Slope slope, double *data, const double *start, int size, const double *when,
                     int count, double tolerance, double *out) {
    State x(start, start + size);
    std::vector<double> times(when, when + count);
    System system{slope, data};
    try {
        if (method == 0)
            run(odeint::make_dense_output(tolerance, tolerance, odeint::runge_kutta_dopri5<State>()), system, x,
                times, out);
        else if (method == 1)
            run(odeint::make_controlled(tolerance, tolerance, odeint::runge_kutta_fehlberg78<State>()), system, x,
                times, out);
        else
            run(odeint::bulirsch_stoer<State>(tolerance, tolerance), system, x, times, out);
    } catch (const std::exception &) {
        return 1;
    }
    return 0;
}
