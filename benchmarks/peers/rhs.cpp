// The modal equations of a struck beam, for integrators that call a function by its address.
//
//   q'' = -omega^2 q - 2 sigma q' - gamma [(q.Gq) g + (2 g.q + q.Gq) Gq] + c f,   f = k d^(3/2),   d = A sin(w t) - c.q
//
// The state is (q/scale, q'/(scale rate)).  G has two blocks, those of the symmetric and the antisymmetric modes; each is padded to
// whole rows of eight numbers and stored by columns.
#include <cmath>

typedef double Eight __attribute__((vector_size(64), aligned(8)));
static const int MOST = 512;

struct Numbers {
    double sizes[2], scale, rate, gamma, stiffness, amplitude, drive;
};

static int padded(int size) { return (size + 7) / 8 * 8; }
static Eight at(const double *x) { return *reinterpret_cast<const Eight *>(x); }
static double total(Eight x) { return ((x[0] + x[4]) + (x[2] + x[6])) + ((x[1] + x[5]) + (x[3] + x[7])); }

template <int ROWS> static void product(const double *G, int height, int size, const double *q, double *r) {
    Eight sum[ROWS] = {};
    for (int j = 0; j < size; j++)
        for (int i = 0; i < ROWS; i++) sum[i] += at(G + j * height + 8 * i) * q[j];
    for (int i = 0; i < ROWS; i++) *reinterpret_cast<Eight *>(r + 8 * i) = sum[i];
}

extern "C" void slope(double t, const double *u, double *du, const double *data) {
    const Numbers &n = *reinterpret_cast<const Numbers *>(data);
    const int size[2] = {int(n.sizes[0]), int(n.sizes[1])}, N = size[0] + size[1];
    const int P = padded(size[0]) + padded(size[1]);
    const double *squared = data + sizeof(Numbers) / 8, *sigma = squared + P, *g = sigma + P, *c = g + P, *G = c + P;
    alignas(64) double q[MOST], r[MOST];
    Eight cq = {}, gq = {}, qr = {};
    for (int b = 0, row = 0, from = 0; b < 2; from += size[b], row += padded(size[b]), b++) {
        const int height = padded(size[b]);
        for (int i = 0; i < height; i++) q[row + i] = i < size[b] ? n.scale * u[from + i] : 0.0;
        int i = 0;
        for (; i + 16 <= height; i += 16) product<2>(G + i, height, size[b], q + row, r + row + i);
        if (i < height) product<1>(G + i, height, size[b], q + row, r + row + i);
        G += height * size[b];
    }
    for (int i = 0; i < P; i += 8) cq += at(c + i) * at(q + i), gq += at(g + i) * at(q + i), qr += at(r + i) * at(q + i);
    const double depth = n.amplitude * std::sin(n.drive * t) - total(cq), bend = total(qr);
    const double force = depth > 0.0 ? n.stiffness * depth * std::sqrt(depth) : 0.0;
    const double along_g = -n.gamma * bend, along_r = -n.gamma * (2.0 * total(gq) + bend), inverse = 1.0 / (n.scale * n.rate);
    for (int b = 0, row = 0, from = 0; b < 2; from += size[b], row += padded(size[b]), b++)
        for (int i = 0; i < size[b]; i++) {
            const int k = row + i;
            du[from + i] = n.rate * u[N + from + i];
            du[N + from + i] = inverse * (along_g * g[k] + along_r * r[k] + force * c[k] - squared[k] * q[k]) - 2.0 * sigma[k] * u[N + from + i];
        }
}
