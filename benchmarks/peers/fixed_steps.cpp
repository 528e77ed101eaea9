// Fixed steps for the paper's beam alone, as one would write them by hand: exact flows of the linear modes and kicks by
// tension and contact, order 4 (Blanes and Moan 2002), no events and no statistics.  The number of modes is a constant of
// the compiler, and the symmetric and the antisymmetric modes are two blocks of the tension matrix.
#include <cmath>

static const double FLOW[6] = {0.245298957184271,        0.604872665711080, 0.5 - 0.245298957184271 - 0.604872665711080,
                               0.5 - 0.245298957184271 - 0.604872665711080, 0.604872665711080, 0.245298957184271};
static const double HALF[3] = {0.0829844064174052, 0.396309801498368, -0.0390563049223486};
static const double KICK[7] = {HALF[0], HALF[1], HALF[2], 1.0 - 2.0 * (HALF[0] + HALF[1] + HALF[2]), HALF[2], HALF[1], HALF[0]};

template <int B>
struct RowOf { typedef double type __attribute__((vector_size(8 * B))); };
template <>
struct RowOf<1> { typedef double type; };
template <int B>
using Row = typename RowOf<B>::type;

struct Beam {
    const double *omega, *decay, *tension, *well, *contact;  // of each mode; tension: blocks, by columns
    double gamma, stiffness;
};

struct Run {
    double offset, amplitude, omega, period;  // gap at rest with its sign, m; stroke, m; rad/s; s
};

static void flow_matrix(double omega, double decay, double t, double *out) {
    double damped = std::sqrt(omega * omega - decay * decay), e = std::exp(-decay * t);
    double c = e * std::cos(damped * t), s = e * std::sin(damped * t) / damped;
    out[0] = c + decay * s, out[1] = s, out[2] = -omega * omega * s, out[3] = c - decay * s;
}

// One run; B modes in each of two blocks, or one block of one mode.
template <int B, int BLOCKS>
static void one_run(const Beam &beam, const Run &run, int per_cycle, int cycles, int every, double *out) {
    constexpr int N = B * BLOCKS;
    alignas(64) double G[BLOCKS][B][B], g[N], c[N], q[N] = {}, p[N] = {}, k[N], r[N];
    alignas(64) double a11[3][N], a12[3][N], a21[3][N], a22[3][N];
    double h = run.period / per_cycle, sine[7], cosine[7], fraction = 0.0;
    for (int i = 0; i < N; i++) g[i] = beam.well[i], c[i] = beam.contact[i];
    for (int i = 0; i < BLOCKS * B * B; i++) (&G[0][0][0])[i] = beam.tension[i];
    for (int s = 0; s < 7; s++) {
        if (s > 0) fraction += FLOW[s - 1];
        sine[s] = std::sin(run.omega * h * fraction), cosine[s] = std::cos(run.omega * h * fraction);
        for (int i = 0; i < N && s < 3; i++) {
            double m[4];
            flow_matrix(beam.omega[i], beam.decay[i], FLOW[s] * h, m);
            a11[s][i] = m[0], a12[s][i] = m[1], a21[s][i] = m[2], a22[s][i] = m[3];
        }
    }
    auto push = [&](double w) {  // k: all accelerations but the linear modes'
        double cq = 0.0, gq = 0.0, qr = 0.0;
        for (int b = 0; b < BLOCKS; b++) {
            Row<B> sum = {}, odd = {};
            for (int j = 0; j < B; j++) {
                const Row<B> &column = *(const Row<B> *)G[b][j];
                if (j % 2) odd += column * q[b * B + j]; else sum += column * q[b * B + j];
            }
            *(Row<B> *)(r + b * B) = sum + odd;
        }
        for (int i = 0; i < N; i++) cq += c[i] * q[i], gq += g[i] * q[i], qr += r[i] * q[i];
        double d = run.offset + w - cq, f = d > 0.0 ? beam.stiffness * d * std::sqrt(d) : 0.0;
        double along_g = -beam.gamma * qr, along_r = -beam.gamma * (2.0 * gq + qr);
        for (int i = 0; i < N; i++) k[i] = along_g * g[i] + along_r * r[i] + f * c[i];
    };
    push(0.0);
    long steps = (long)per_cycle * cycles;
    for (long n = 0; n < steps; n++) {
        double at = run.omega * h * (n % per_cycle), s0 = std::sin(at), c0 = std::cos(at);
        for (int s = 0; s < 7; s++) {
            if (s > 0) push(run.amplitude * (s0 * cosine[s] + c0 * sine[s]));
            double weight = KICK[s] * h;
            for (int i = 0; i < N; i++) p[i] += weight * k[i];
            if (s == 6) break;
            int f = s < 3 ? s : 5 - s;
            for (int i = 0; i < N; i++) {
                double u = q[i];
                q[i] = a11[f][i] * u + a12[f][i] * p[i], p[i] = a21[f][i] * u + a22[f][i] * p[i];
            }
        }
        if (out && (n + 1) % every == 0) {
            double cq = 0.0;
            for (int i = 0; i < N; i++) cq += c[i] * q[i];
            *out++ = cq;
        }
    }
}

// 32 runs of one mode side by side, a step of each at a time; each has its own length of step.  With four registers of
// eight numbers the waits for products and roots of one are filled by the others: 3.7 ns per run and step, 11 with one.
static double many_runs(const Beam &beam, const Run *runs, const int *per_cycle, int cycles) {
    constexpr int L = 32;
    typedef Row<L> V;
    V q = {}, p = {}, k = {}, h, amplitude, offset, left, s0 = {}, c0 = {}, a[3][4], sine[7], cosine[7];
    double g = beam.well[0], c = beam.contact[0], G = beam.tension[0];
    long most = 0;
    for (int i = 0; i < L; i++) {
        h[i] = runs[i].period / per_cycle[i], amplitude[i] = runs[i].amplitude, offset[i] = runs[i].offset;
        left[i] = (double)per_cycle[i] * cycles, c0[i] = 1.0;
        most = most < left[i] ? (long)left[i] : most;
        double fraction = 0.0;
        for (int s = 0; s < 7; s++) {
            if (s > 0) fraction += FLOW[s - 1];
            double turn = runs[i].omega * h[i] * fraction, m[4];
            sine[s][i] = std::sin(turn), cosine[s][i] = std::cos(turn);
            if (s == 3) continue;
            if (s < 3) flow_matrix(beam.omega[0], beam.decay[0], FLOW[s] * h[i], m);
            for (int j = 0; j < 4 && s < 3; j++) a[s][j][i] = m[j];
        }
    }
    for (long n = 0; n < most; n++) {
        V live = (double)n < left ? V{} + h : V{};  // a run that has ended stays where it is
        for (int s = 0; s < 7; s++) {
            if (s > 0) {
                V d = offset + amplitude * (s0 * cosine[s] + c0 * sine[s]) - c * q;
                d = d > 0.0 ? d : V{};
                alignas(64) double roots[L];
                for (int i = 0; i < L; i++) roots[i] = d[i];
                for (int i = 0; i < L; i++) roots[i] = std::sqrt(roots[i]);
                V root = *(V *)roots;
                V r = G * q, qr = r * q;
                k = -beam.gamma * (qr * g + (2.0 * g * q + qr) * r) + beam.stiffness * c * d * root;
            }
            p += KICK[s] * live * k;
            if (s == 6) break;
            int f = s < 3 ? s : 5 - s;
            V u = q;
            q = a[f][0] * u + a[f][1] * p, p = a[f][2] * u + a[f][3] * p;
        }
        V s1 = s0 * cosine[6] + c0 * sine[6], c1 = c0 * cosine[6] - s0 * sine[6];
        V scale = 1.5 - 0.5 * (s1 * s1 + c1 * c1);
        s0 = s1 * scale, c0 = c1 * scale;
    }
    double sum = 0.0;
    for (int i = 0; i < L; i++) sum += q[i];
    return sum;
}

extern "C" {
int integrate(int modes, const Beam *beam, const Run *run, int per_cycle, int cycles, int every, double *out) {
    switch (modes) {
        case 1: one_run<1, 1>(*beam, *run, per_cycle, cycles, every, out); return 0;
        case 8: one_run<4, 2>(*beam, *run, per_cycle, cycles, every, out); return 0;
        case 32: one_run<16, 2>(*beam, *run, per_cycle, cycles, every, out); return 0;
    }
    return 1;
}
double integrate_many(const Beam *beam, const Run *runs, const int *per_cycle, int cycles) {
    return many_runs(*beam, runs, per_cycle, cycles);
}
}
