// The structure as a layout holds it: linear modes, the tension that couples them, and the flows of the modes.
//
//   A(t): (q, p) -> (q, p)(t),   q'' + 2 sigma q' + omega^2 q = 0,   D^2 = omega^2 - sigma^2,
//
//   A = e^(-sigma t) [cos Dt + sigma sin(Dt)/D,   sin(Dt)/D;   -omega^2 sin(Dt)/D,   cos Dt - sigma sin(Dt)/D].
//
// The diagonal of A is stored less one: a slow mode hardly moves within a step.
#pragma once
#include "api.hpp"
#include "layout.hpp"

namespace SNAPBEAM_SET {
using snapbeam::Batch;
using snapbeam::Problem;
using snapbeam::Recorder;

// Compositions S(h) = B(b_0 h) A(a_0 h) B(b_1 h) ... A(a_(s-1) h) B(b_s h) of kicks B and flows A, symmetric, of Blanes and Moan,
// J. Comput. Appl. Math. 142 (2002) 313-330: SRKN_6^b of order 4 and SRKN_11^b of order 6 (Table 3; order 4 holds for kicks that
// depend on the velocity too, order 6 does not), and S_10 of order 6 (Table 2), which asks nothing of its parts.
constexpr int MOST_DISTINCT = 6;
struct Composition {
    int flows, distinct;
    double flow[MOST_DISTINCT], kick[MOST_DISTINCT];  // first halves
    SNAPBEAM_FN int which_flow(int i) const { return i < flows - 1 - i ? i : flows - 1 - i; }
    SNAPBEAM_FN double kick_weight(int i) const { return kick[i < flows - i ? i : flows - i]; }
};
SNAPBEAM_FN Composition composition_of(int number) {
    if (number == 1)
        return {11, 6,
                {0.123229775946271, 0.290553797799558, -0.127049212625417, -0.246331761062075, 0.357208872795928,
                 1 - 2 * (0.123229775946271 + 0.290553797799558 - 0.127049212625417 - 0.246331761062075 + 0.357208872795928)},
                {0.0414649985182624, 0.198128671918067, -0.0400061921041533, 0.0752539843015807, -0.0115113874206879,
                 0.5 - (0.0414649985182624 + 0.198128671918067 - 0.0400061921041533 + 0.0752539843015807 - 0.0115113874206879)}};
    if (number == 2)
        return {10, 5,
                {0.148816447901042, -0.132385865767784, 0.067307604692185, 0.432666402578175,
                 0.5 - (0.148816447901042 - 0.132385865767784 + 0.067307604692185 + 0.432666402578175), 0},
                {0.0502627644003922, 0.413514300428344, 0.0450798897943977, -0.188054853819569, 0.541960678450780,
                 1 - 2 * (0.0502627644003922 + 0.413514300428344 + 0.0450798897943977 - 0.188054853819569 + 0.541960678450780)}};
    return {6, 3,
            {0.245298957184271, 0.604872665711080, 0.5 - (0.245298957184271 + 0.604872665711080), 0, 0, 0},
            {0.0829844064174052, 0.396309801498368, -0.0390563049223486,
             1 - 2 * (0.0829844064174052 + 0.396309801498368 - 0.0390563049223486), 0, 0}};
}
// Parts of a kick in which the method of order four integrates forces of velocities, by the *decay* of these within the kick: one
// where they hardly change, then up to four, and more only where one of four would err more than the composition.
template <class Real> SNAPBEAM_FN Real kick_parts(int composition, Real decay) {
    const Real few = min(Real(composition ? 1000.0 : 160.0) * decay, Real(4.0)), many = Real(composition ? 16.0 : 8.0) * decay;
    return min(max(nearest(max(few, many) + Real(0.5)), Real(1.0)), Real(256.0));
}

template <bool FIRST, class A, class B> struct Either { typedef A Type; };
template <class A, class B> struct Either<false, A, B> { typedef B Type; };
template <class L> using Slopes = typename Either<(L::directions > 0), Pack<L::directions>, double>::Type;  // derivatives beside a plain number
constexpr int FEWEST_PARTS = 8, PARTS_PER_TURN = 12;

// The four numbers of the flow of a mode over a time.
template <class T> SNAPBEAM_CALLED void set_flow(T time, T sigma, T omega, T *a) {
    const T omega2 = omega * omega, square = fma(sigma, -sigma, omega2), damped = sqrt(max(square, T(1e-200)));
    const Turn<T> w = turn(time * damped);
    T over = w.sine / damped, cosine_less = w.cosine_less_one, less = decay_of(time * sigma);
    const auto creeping = square < T(0.0);
    if (any(creeping)) {  // overdamped: cosh and sinh in place of cos and sin
        const T rate = sqrt(max(-square, T(0.0))), half = sinh(T(0.5) * rate * time);
        over = select(creeping, sinh(rate * time) / rate, over);
        cosine_less = select(creeping, T(2.0) * half * half, cosine_less);
    }
    const T decay = less + T(1.0), ds = sigma * over;
    a[0] = fma(decay, cosine_less + ds, less);
    a[1] = decay * over;
    a[2] = -(omega2 * a[1]);
    a[3] = fma(decay, cosine_less - ds, less);
}

template <class L> struct Structure {
    typedef typename L::Coef Coef;
    const Problem *problem;
    Composition composition;
    int cells, padded;
    double fastest, growth;                        // greatest angular frequency, and rate at which a mode grows, 1/s
    Held<int, BLOCKS> first, count, mode_first, mode_count;  // of each block: cells and modes
    Held<int, CELLS> place;                                  // of each mode in the padded order
    typedef Held<typename L::Shared, CELLS> Row;
    Row omega, sigma, g, shift, far_force, center, high, beam, second;
    Held<Coef, CELLS * CELLS> G;
    typename L::Number gamma, center_rest, dividing_height, lift;
    bool changes;                                  // it has derivatives
    Held<Slopes<L>, 0, false> G_slopes;            // those of G

    SNAPBEAM_FN int size() const { return KNOWN ? CELLS : L::fixed ? L::fixed : cells; }

    void build(const Problem &p, Arena &arena, const snapbeam::Tangent *tangent = nullptr) {
        problem = &p;
        composition = composition_of(p.composition);
        cells = 0;
        for (int b = 0; b < p.blocks; ++b) cells += (p.block_sizes[b] + L::lanes - 1) / L::lanes;
        padded = cells * L::lanes;
        first.take(arena, p.blocks), count.take(arena, p.blocks);
        mode_first.take(arena, p.blocks), mode_count.take(arena, p.blocks), place.take(arena, p.modes);
        constexpr int ROWS = 9;  // the first STRUCTURE_ROWS may have derivatives
        Row *rows[ROWS] = {&omega, &sigma, &g, &shift, &far_force, &center, &second, &high, &beam};
        const double *given[ROWS] = {p.omega, p.sigma, p.g, p.shift, p.far_force, p.center, p.second, p.high, p.beam};
        for (Row *row : rows) row->take(arena, cells);
        G.take(arena, long(cells) * padded);
        gamma = typename L::Number(p.gamma), center_rest = typename L::Number(p.center_rest);
        dividing_height = typename L::Number(p.dividing_height), lift = typename L::Number(p.lift);
        changes = L::directions > 0 && tangent && tangent->structure;
        G_slopes.take(arena, changes ? long(cells) * cells : 0);
        if (!arena.base && !KNOWN) return;
        int cell = 0, mode = 0;
        for (int b = 0; b < p.blocks; ++b) {
            first[b] = cell, mode_first[b] = cell * L::lanes, mode_count[b] = p.block_sizes[b];
            count[b] = (p.block_sizes[b] + L::lanes - 1) / L::lanes;
            for (int i = 0; i < p.block_sizes[b]; ++i) place[mode++] = mode_first[b] + i;
            cell += count[b];
        }
        for (int i = 0; i < padded; ++i) {
            for (Row *row : rows) set_coefficient<L>(*row, i, 0.0);
            set_coefficient<L>(omega, i, 1.0);
            for (int j = 0; j < padded; ++j) set_coefficient<L>(G + long(j) * cells, i, 0.0);
        }
        fastest = growth = 0.0;
        for (int i = 0; i < p.modes; ++i) {
            const int at = place[i];
            for (int k = 0; k < ROWS; ++k)
                if (given[k]) set_coefficient<L>(*rows[k], at, given[k][i]);
            fastest = p.omega[i] > fastest ? p.omega[i] : fastest, growth = -p.sigma[i] > growth ? -p.sigma[i] : growth;
            for (int j = 0; j < p.modes; ++j) set_coefficient<L>(G + long(place[j]) * cells, at, p.G[long(i) * p.modes + j]);
        }
        if constexpr (L::directions > 0)
            if (changes) change(*tangent, rows);
    }
    // Derivatives of all that the structure has.
    void change(const snapbeam::Tangent &t, Row **rows) requires(L::directions > 0) {
        const int n = problem->modes;
        typename L::Number *scalars[] = {&gamma, &center_rest, &dividing_height, &lift};
        for (int k = 0; k < L::directions; ++k) {
            for (int x = 0; x < snapbeam::STRUCTURE_ROWS; ++x)
                for (int i = 0; i < n; ++i) (*rows[x])[place[i]].d.set(k, t.structure[(k * snapbeam::STRUCTURE_ROWS + x) * n + i]);
            for (int x = 0; x < snapbeam::STRUCTURE_SCALARS; ++x) scalars[x]->d.set(k, t.scalars[k * snapbeam::STRUCTURE_SCALARS + x]);
            for (int i = 0; i < n; ++i)
                for (int j = 0; j < n; ++j) G_slopes[long(place[i]) * cells + place[j]].set(k, t.G[(long(k) * n + i) * n + j]);
        }
    }
    // Parts in which a step of a run is followed inside: a flight step's, whatever the step.
    double parts(double flight_step) const {
        const double count = double(int(PARTS_PER_TURN * fastest * flight_step / 6.283185307179586) + 1);
        return count < FEWEST_PARTS ? FEWEST_PARTS : count;
    }
};

}  // namespace SNAPBEAM_SET
