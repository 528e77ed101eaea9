// Boost.odeint over the flat array of flat.py: dense-output Dormand-Prince with events, Fehlberg 7(8) through contacts.
#include <boost/numeric/odeint.hpp>
#include <boost/version.hpp>
#include <cmath>
#include <exception>
#include <vector>

namespace odeint = boost::numeric::odeint;
typedef std::vector<double> State;

struct Numbers {
    double *p;
    int n, contacts;
    explicit Numbers(double *given) : p(given), n(int(given[0])), contacts(int(given[1])) {}
    double *vector(int i) const { return p + 16 + i * n; }
    double *cubic() const { return p + 16 + 7 * n; }
    double *contact(int j) const { return cubic() + (p[3] != 0 ? n * n : 0) + j * (10 + n); }
};

static long evaluations = 0;

struct Motion {
    Numbers a;
    void penetration(const double *c, const double *u, double t, double &d, double &rate) const {
        d = c[7] * std::sin(c[8] * t + c[9]) - c[6];
        rate = c[7] * c[8] * std::cos(c[8] * t + c[9]);
        double depth = 0, speed = 0;
        for (int i = 0; i < a.n; i++) depth += c[10 + i] * u[i], speed += c[10 + i] * u[a.n + i];
        d -= depth, rate -= speed;
    }
    double indicator(int j, const State &u, double t) const {
        const double *c = a.contact(j);
        double d, rate;
        penetration(c, u.data(), t, d, rate);
        if (c[0] == 0) return -d;
        return c[0] == 1 && c[1] == 2 ? c[2] * d + c[5] * rate : d;
    }
    void operator()(const State &state, State &derivative, double t) const {
        evaluations++;
        const int n = a.n;
        const double *p = a.p, *x = state.data(), *v = x + n;
        double *dx = derivative.data(), *dv = dx + n;
        const double drive = p[14] != 0 ? std::sin(p[5] * t + p[6]) : 0;
        const double shock = p[13] != 0 && t < p[7] ? std::sin(M_PI * t / p[7]) : 0;
        const double *c = a.vector(0), *k = a.vector(1), *load = a.vector(2), *h = a.vector(3), *pulse = a.vector(4);
        for (int i = 0; i < n; i++) {
            dx[i] = v[i];
            dv[i] = load[i] - k[i] * x[i] - c[i] * v[i] + drive * h[i] + shock * pulse[i];
        }
        if (p[3] != 0) {
            const double *g = a.vector(5), *matrix = a.cubic();
            double *r = a.vector(6), along = 0, gx = 0;
            for (int i = 0; i < n; i++) {
                double sum = 0;
                for (int j = 0; j < n; j++) sum += matrix[i * n + j] * x[j];
                r[i] = sum, along += sum * x[i], gx += g[i] * x[i];
            }
            for (int i = 0; i < n; i++) dv[i] -= p[2] * (along * g[i] + (2 * gx + along) * r[i]);
        }
        if (p[8] != 0) dv[0] -= p[8] * x[0] * (1 - p[9] / std::sqrt(1 + x[0] * x[0]));
        if (p[12] != 0) {
            dv[0] -= p[10] * x[2 * n];
            dx[2 * n] = p[10] * v[0] - p[11] * x[2 * n];
        }
        for (int j = 0; j < a.contacts; j++) {
            const double *b = a.contact(j);
            if (b[0] == 0 || b[0] == 3 || b[1] == 3) continue;
            double d, rate, f = 0;
            penetration(b, x, t, d, rate);
            if (b[1] == 2) {
                if (b[0] == 1 || d > 0) f = b[2] * d + b[5] * rate;
            } else if (d > 0) {
                f = b[2] * (1 + b[4] * rate) * (b[3] == 1 ? d : b[3] == 1.5 ? d * std::sqrt(d) : std::pow(d, b[3]));
            }
            if (b[0] == 2 && f < 0) f = 0;
            for (int i = 0; i < n; i++) dv[i] += f * b[10 + i];
        }
    }
};

extern "C" const char *version() { return BOOST_LIB_VERSION; }
extern "C" long counted() { return evaluations; }

// Through the contacts: states at all times. Returns 0, or 1 if it failed.
extern "C" int through(double *p, const double *start, int size, const double *when, int count, int method,
                       double tolerance, double *out) {
    Motion motion{Numbers(p)};
    State u(start, start + size);
    std::vector<double> times(when, when + count);
    auto keep = [&](const State &x, double) { for (double value : x) *out++ = value; };
    evaluations = 0;
    try {
        if (method == 0)
            odeint::integrate_times(odeint::make_dense_output(tolerance * 0.1, tolerance, odeint::runge_kutta_dopri5<State>()),
                                    motion, u, times.begin(), times.end(), 1e-4, keep);
        else
            odeint::integrate_times(odeint::make_controlled(tolerance * 0.1, tolerance, odeint::runge_kutta_fehlberg78<State>()),
                                    motion, u, times.begin(), times.end(), 1e-4, keep);
    } catch (const std::exception &) {
        return 1;
    }
    return 0;
}

// One segment: from t to end or to the first event. Returns the contact, -1 without, -2 if it failed.
extern "C" int segment(double *p, double *state, int size, double *t, double end, const double *times, int count,
                       double tolerance, double longest, double *out, int *reached) {
    const int places = 8;
    Motion motion{Numbers(p)};
    State u(state, state + size), middle(size);
    *reached = 0;
    if (*t >= end) return -1;
    try {
        auto stepper = odeint::make_dense_output(tolerance * 0.1, tolerance, longest, odeint::runge_kutta_dopri5<State>());
        stepper.initialize(u, *t, std::min(1e-3, end - *t));
        while (true) {
            const auto span = stepper.do_step(motion);
            const double last = std::min(span.second, end);
            int hit = -1;
            double low = span.first, high = last;
            for (int i = 1; i <= places && hit < 0; i++) {
                const double at = span.first + (last - span.first) * i / places;
                stepper.calc_state(at, middle);
                for (int j = 0; j < motion.a.contacts; j++)
                    if (motion.indicator(j, middle, at) < 0) {
                        stepper.calc_state(low, middle);
                        // A contact that has just begun may stand below 0 by rounding and rises from there.
                        if (motion.indicator(j, middle, low) < 0 && i == 1 && span.first == *t) {
                            stepper.calc_state(at, middle);
                            if (motion.indicator(j, middle, at) > -1e-13) continue;
                        }
                        hit = j, high = at;
                        break;
                    }
                if (hit < 0) low = at;
            }
            double stop = last;
            if (hit >= 0) {
                for (int i = 0; i < 100 && high - low > 1e-16 * (1 + high); i++) {
                    const double at = 0.5 * (low + high);
                    stepper.calc_state(at, middle);
                    (motion.indicator(hit, middle, at) < 0 ? high : low) = at;
                }
                stop = high;
            }
            while (*reached < count && times[*reached] <= stop) {
                stepper.calc_state(times[*reached], middle);
                for (double value : middle) *out++ = value;
                ++*reached;
            }
            if (hit >= 0 || stop >= end) {
                stepper.calc_state(stop, middle);
                std::copy(middle.begin(), middle.end(), state);
                *t = stop;
                return hit;
            }
        }
    } catch (const std::exception &) {
        return -2;
    }
}
