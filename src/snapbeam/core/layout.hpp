// Layouts: what a number, a cell of a row of modes and a coefficient are, and how a row is summed.  Nothing else knows.
//
//                 Number        Cell          Coef          Shared
//   RunLanes      W runs        W runs        double        double        W runs side by side, a cell a mode
//   ModeLanes     double        W modes       W modes       W modes       one run, its modes side by side
//   Thread        double        double        double        double        one run; a lane of RunLanes has the same bits
//   Tangents      Dual          Dual          double        Dual          one run with derivatives (dual.hpp)
//
// Coef and Shared are of what all runs share.  Number, Cell and Shared may carry derivatives; Real and Plain are the same without them.  Tables, bounds, times and counters are Real.
// FIXED is a number of cells that the compiler knows, of two blocks of equal size if it is more than 1; 0: it does not.
// *together* runs (or packs of them) take turns, a stage each, so that the processor always has work that does not wait.
#pragma once
#include "dual.hpp"

namespace SNAPBEAM_SET {

template <int W> struct RunLanes {
    typedef Pack<W> Number;
    typedef Pack<W> Real;
    typedef Pack<W> Cell;
    typedef Pack<W> Plain;
    typedef double Coef;
    typedef double Shared;
    typedef Mask<W> Marks;
    static constexpr int runs = W, lanes = 1, fixed = 0, together = 1, directions = 0;
    static SNAPBEAM_FN Number total(Cell x) { return x; }
    static SNAPBEAM_FN void totals(Cell a, Cell b, Number &of_a, Number &of_b) { of_a = a, of_b = b; }
    static SNAPBEAM_FN Cell mode(const Cell *row, int i) { return row[i]; }
};

template <int W, int FIXED = 0> struct ModeLanes {
    typedef double Number;
    typedef double Real;
    typedef Pack<W> Cell;
    typedef Pack<W> Plain;
    typedef Pack<W> Coef;
    typedef Pack<W> Shared;
    typedef bool Marks;
    static constexpr int runs = 1, lanes = W, fixed = FIXED, together = 2, directions = 0;
    template <int N> static SNAPBEAM_FN double sum(const Pack<N> &x) {
        if constexpr (N == 2) return x.v[0] + x.v[1];
        else {
            Pack<N / 2> half[2];
            __builtin_memcpy(half, &x, sizeof x);
            return sum(half[0] + half[1]);
        }
    }
    static SNAPBEAM_FN double total(Cell x) { return sum(x); }
    static SNAPBEAM_FN void totals(Cell a, Cell b, double &of_a, double &of_b) {
#if defined(__AVX512F__)
        if constexpr (W == 8) {
            const __m512d x = (__m512d)a.v, y = (__m512d)b.v;
            const __m512d pairs = _mm512_add_pd(_mm512_unpacklo_pd(x, y), _mm512_unpackhi_pd(x, y));
            const __m256d half = _mm256_add_pd(_mm512_castpd512_pd256(pairs), _mm512_extractf64x4_pd(pairs, 1));
            const __m128d both = _mm_add_pd(_mm256_castpd256_pd128(half), _mm256_extractf128_pd(half, 1));
            of_a = both[0], of_b = both[1];
            return;
        }
#endif
        of_a = total(a), of_b = total(b);
    }
    static SNAPBEAM_FN double mode(const Cell *row, int i) { return reinterpret_cast<const double *>(row)[i]; }
};

// A kernel for one structure knows how many there are of each (GPU); else the numbers are 0, and arrays lie in an arena.
#if defined(SNAPBEAM_CELLS)
constexpr int CELLS = SNAPBEAM_CELLS, BLOCKS = SNAPBEAM_BLOCKS, CHANNELS = SNAPBEAM_CHANNELS, KNOWN_SIGNALS = SNAPBEAM_SIGNALS;
constexpr int LAW_NUMBERS = SNAPBEAM_LAW_NUMBERS, LEVELS = SNAPBEAM_LEVELS, DISTINCT_FLOWS = SNAPBEAM_DISTINCT_FLOWS;
constexpr bool KNOWN = true, RECORDS = false;
#else
constexpr int CELLS = 0, BLOCKS = 0, CHANNELS = 0, KNOWN_SIGNALS = 0, LAW_NUMBERS = 0, LEVELS = 0, DISTINCT_FLOWS = 0;
constexpr bool KNOWN = false, RECORDS = true;
#endif

template <int FIXED = 0> struct Thread {
    typedef double Number;
    typedef double Real;
    typedef double Cell;
    typedef double Plain;
    typedef double Coef;
    typedef double Shared;
    typedef bool Marks;
    static constexpr int runs = 1, lanes = 1, fixed = FIXED, together = 1, directions = 0;
    static SNAPBEAM_FN double total(double x) { return x; }
    static SNAPBEAM_FN void totals(double a, double b, double &of_a, double &of_b) { of_a = a, of_b = b; }
    static SNAPBEAM_FN double mode(const double *row, int i) { return row[i]; }
};

// Memory of a thread: laid out twice by the same text, first to measure it (base null), then to use it.
struct Arena {
    char *base;
    long used;
    template <class T> T *take(long count) {
        used = (used + 63) / 64 * 64;
        T *at = base ? reinterpret_cast<T *>(base + used) : nullptr;
        used += count * long(sizeof(T));
        return at;
    }
};

// An array of a length that the compiler knows, or in an arena.
template <class T, int LENGTH, bool INSIDE = KNOWN> struct Held {
    T at[LENGTH > 0 ? LENGTH : 1];
    SNAPBEAM_FN operator T *() { return at; }
    SNAPBEAM_FN operator const T *() const { return at; }
    SNAPBEAM_FN void take(Arena &, long) {}
    SNAPBEAM_FN void swap(Held &other) {
        for (int i = 0; i < LENGTH; ++i) {
            const T kept = at[i];
            at[i] = other.at[i], other.at[i] = kept;
        }
    }
};
template <class T, int LENGTH> struct Held<T, LENGTH, false> {
    T *at;
    SNAPBEAM_FN operator T *() const { return at; }
    void take(Arena &arena, long length) { at = arena.take<T>(length); }
    SNAPBEAM_FN void swap(Held &other) {
        T *const kept = at;
        at = other.at, other.at = kept;
    }
};

// One mode of one run within rows of cells, as numbers: mode i of run l.
template <class L> SNAPBEAM_FN double element(const typename L::Cell *row, int i, int l) {
    if constexpr (L::lanes > 1) return row[i / L::lanes].v[i % L::lanes];
    else return lane(row[i], l);
}
template <class L, class Row> SNAPBEAM_FN void set_element(Row &row, int i, int l, double x) {
    if constexpr (L::lanes > 1) set_lane(row[i / L::lanes], i % L::lanes, x);
    else set_lane(row[i], l, x);
}
// Mode i of a row of coefficients.
template <class L, class Row> SNAPBEAM_FN void set_coefficient(Row &&row, int i, double x) {
    if constexpr (L::lanes > 1) set_lane(row[i / L::lanes], i % L::lanes, x);
    else row[i] = x;
}

}  // namespace SNAPBEAM_SET
