// Numbers: a double, or a pack of W doubles with masks, with the same operations.
//
// Every operation of a lane of a pack is the operation of a double, in the same order, so that a run has the same bits alone and
// among others.  For that, the compiler contracts no products and sums (-ffp-contract=off); fma(a, b, c) = a b + c is written
// out: one rounding where the processor has it.
//
// Everything is in a namespace of its own for each instruction set (SNAPBEAM_SET), since the same templates are compiled several
// times with different flags and the linker must not mix them.  Kernels use no part of the standard library but <math.h>.
#pragma once

#if defined(__CUDACC_RTC__)  // NVRTC brings the functions of <math.h>, and no headers
#define INFINITY __longlong_as_double(0x7ff0000000000000)
#define NAN __longlong_as_double(0x7ff8000000000000)
#define __builtin_memcpy memcpy
#else
#include <math.h>
#endif

#ifndef SNAPBEAM_SET
#define SNAPBEAM_SET plain
#define SNAPBEAM_WIDTH 1
#endif
#if defined(__CUDACC_RTC__)
#define SNAPBEAM_FN __forceinline__
#define SNAPBEAM_RARE __noinline__
#define SNAPBEAM_SELDOM __noinline__
#define SNAPBEAM_CALLED __noinline__
#define SNAPBEAM_LOOP _Pragma("unroll 1")
#elif (defined(__GNUC__) || defined(__clang__)) && !defined(SNAPBEAM_CHECKED)  // sanitizers compile what is inlined for an hour
#define SNAPBEAM_FN inline __attribute__((always_inline))
#define SNAPBEAM_RARE __attribute__((noinline))
#define SNAPBEAM_SELDOM
#define SNAPBEAM_CALLED SNAPBEAM_FN
#define SNAPBEAM_LOOP
#else
#define SNAPBEAM_FN inline
#define SNAPBEAM_RARE
#define SNAPBEAM_SELDOM
#define SNAPBEAM_CALLED SNAPBEAM_FN
#define SNAPBEAM_LOOP
#endif
#if defined(__AVX512F__) || defined(__AVX2__)
#include <immintrin.h>
#endif

namespace SNAPBEAM_SET {

// The next number of a counter that threads share.
SNAPBEAM_FN int count(int *counter) {
#if defined(__CUDACC_RTC__)
    return atomicAdd(counter, 1);
#else
    return __atomic_fetch_add(counter, 1, __ATOMIC_RELAXED);
#endif
}

// --- packs and masks ----------------------------------------------------------------------------------------------------
template <int W> struct Mask;
template <int W> struct Pack;
template <class T> struct Bits { typedef long long Type; };  // integers of the same size
#if defined(__CUDACC_RTC__)  // a thread has one run
typedef double Wide;
#else  // vector types of GCC and Clang
typedef Pack<SNAPBEAM_WIDTH> Wide;
template <int W> struct Vectors {
    typedef double Reals __attribute__((vector_size(8 * W)));
    typedef long long Marks __attribute__((vector_size(8 * W)));
};
template <int W> struct Bits<Pack<W>> { typedef typename Vectors<W>::Marks Type; };
#define SNAPBEAM_BINARY(RESULT, NAME, FIELD, OPERATOR) \
    friend SNAPBEAM_FN RESULT NAME(Pack a, Pack b) { RESULT r; r.FIELD = a.v OPERATOR b.v; return r; }

template <int W> struct Mask {
    typename Vectors<W>::Marks m;
    SNAPBEAM_FN void set(int l, bool on) { m[l] = on ? -1 : 0; }
    friend SNAPBEAM_FN Mask operator&(Mask a, Mask b) { return {a.m & b.m}; }
    friend SNAPBEAM_FN Mask operator|(Mask a, Mask b) { return {a.m | b.m}; }
    friend SNAPBEAM_FN Mask operator!(Mask a) { return {~a.m}; }
};

#if defined(__AVX512F__)
template <> struct Mask<8> {  // in a mask register
    __mmask8 m;
    SNAPBEAM_FN void set(int l, bool on) { m = __mmask8((m & ~(1u << l)) | unsigned(on) << l); }
    friend SNAPBEAM_FN Mask operator&(Mask a, Mask b) { return {__mmask8(a.m & b.m)}; }
    friend SNAPBEAM_FN Mask operator|(Mask a, Mask b) { return {__mmask8(a.m | b.m)}; }
    friend SNAPBEAM_FN Mask operator!(Mask a) { return {__mmask8(~a.m)}; }
};
#define SNAPBEAM_COMPARE(NAME, OPERATOR, HOW)                                                                              \
    friend SNAPBEAM_FN Mask<W> NAME(Pack a, Pack b) {                                                                      \
        if constexpr (W == 8) return {_mm512_cmp_pd_mask((__m512d)a.v, (__m512d)b.v, HOW)};                                \
        else return {a.v OPERATOR b.v};                                                                                    \
    }
#else
#define SNAPBEAM_COMPARE(NAME, OPERATOR, HOW) SNAPBEAM_BINARY(Mask<W>, NAME, m, OPERATOR)
#endif

template <int W> struct Pack {
    typename Vectors<W>::Reals v;
    SNAPBEAM_FN Pack() = default;
    SNAPBEAM_FN Pack(double x) : v(x - typename Vectors<W>::Reals{}) {}
    friend SNAPBEAM_FN Pack operator-(Pack a) { a.v = -a.v; return a; }
    SNAPBEAM_FN void set(int l, double x) { v[l] = x; }
    SNAPBEAM_BINARY(Pack, operator+, v, +)
    SNAPBEAM_BINARY(Pack, operator-, v, -)
    SNAPBEAM_BINARY(Pack, operator*, v, *)
    SNAPBEAM_BINARY(Pack, operator/, v, /)
    SNAPBEAM_COMPARE(operator<, <, _CMP_LT_OQ)
    SNAPBEAM_COMPARE(operator>, >, _CMP_GT_OQ)
    SNAPBEAM_COMPARE(operator<=, <=, _CMP_LE_OQ)
    SNAPBEAM_COMPARE(operator>=, >=, _CMP_GE_OQ)
    SNAPBEAM_COMPARE(differ, !=, _CMP_NEQ_UQ)
    SNAPBEAM_FN Pack &operator+=(Pack b) { return *this = *this + b; }
    SNAPBEAM_FN Pack &operator-=(Pack b) { return *this = *this - b; }
    SNAPBEAM_FN Pack &operator*=(Pack b) { return *this = *this * b; }
};
#undef SNAPBEAM_BINARY
#undef SNAPBEAM_COMPARE
#endif

SNAPBEAM_FN bool differ(double a, double b) { return a != b; }

// --- choice -------------------------------------------------------------------------------------------------------------
SNAPBEAM_FN double select(bool m, double a, double b) { return m ? a : b; }
template <int W> SNAPBEAM_FN Pack<W> select(Mask<W> m, Pack<W> a, Pack<W> b) {
    Pack<W> r;
#if defined(__AVX512F__)
    if constexpr (W == 8) r.v = (typename Vectors<W>::Reals)_mm512_mask_blend_pd(m.m, (__m512d)b.v, (__m512d)a.v);
    else
#endif
        r.v = m.m ? a.v : b.v;
    return r;
}
template <int W> SNAPBEAM_FN Pack<W> select(bool m, Pack<W> a, Pack<W> b) { return m ? a : b; }
template <class M, class T> SNAPBEAM_FN void assign(M m, T &to, T from) { to = select(m, from, to); }

// --- masks as bits: which runs of a pack --------------------------------------------------------------------------------
SNAPBEAM_FN unsigned bits(bool m) { return m; }
template <int W> SNAPBEAM_FN unsigned bits(Mask<W> m) {
#if defined(__AVX2__)
    if constexpr (W == 4) return unsigned(_mm256_movemask_pd((__m256d)m.m));
#endif
    unsigned b = 0;
    for (int l = 0; l < W; ++l) b |= unsigned(m.m[l] != 0) << l;
    return b;
}
#if defined(__AVX512F__)
SNAPBEAM_FN unsigned bits(Mask<8> m) { return m.m; }
#endif
template <class M> SNAPBEAM_FN bool any(M m) { return bits(m) != 0; }
template <class M> struct FromBits;
template <> struct FromBits<bool> { static SNAPBEAM_FN bool of(unsigned b) { return b & 1u; } };
template <int W> struct FromBits<Mask<W>> {
    static SNAPBEAM_FN Mask<W> of(unsigned b) {
        Mask<W> m{};
        for (int l = 0; l < W; ++l) m.set(l, b >> l & 1u);
        return m;
    }
};

// --- one run of a pack --------------------------------------------------------------------------------------------------
SNAPBEAM_FN double lane(double x, int) { return x; }
template <int W> SNAPBEAM_FN double lane(const Pack<W> &x, int l) { return x.v[l]; }
SNAPBEAM_FN void set_lane(double &x, int, double y) { x = y; }
template <int W> SNAPBEAM_FN void set_lane(Pack<W> &x, int l, double y) { x.v[l] = y; }
SNAPBEAM_FN bool lane(bool m, int) { return m; }
template <int W> SNAPBEAM_FN bool lane(const Mask<W> &m, int l) { return bits(m) >> l & 1u; }
SNAPBEAM_FN void set_lane(bool &m, int, bool on) { m = on; }
template <int W> SNAPBEAM_FN void set_lane(Mask<W> &m, int l, bool on) { m.set(l, on); }

// The value of a number without its derivatives (numbers with derivatives overload it).
SNAPBEAM_FN double value(double x) { return x; }
template <int W> SNAPBEAM_FN Pack<W> value(Pack<W> x) { return x; }

// --- functions ----------------------------------------------------------------------------------------------------------
SNAPBEAM_FN double fma(double a, double b, double c) {
#if defined(__CUDACC_RTC__)
    return ::fma(a, b, c);
#elif defined(__FMA__) || defined(__ARM_FEATURE_FMA)
    return __builtin_fma(a, b, c);
#else
    return a * b + c;
#endif
}
template <int W> SNAPBEAM_FN Pack<W> fma(Pack<W> a, Pack<W> b, Pack<W> c) {
    Pack<W> r;
#if defined(__AVX512F__)
    if constexpr (W == 8) {
        r.v = (typename Vectors<W>::Reals)_mm512_fmadd_pd((__m512d)a.v, (__m512d)b.v, (__m512d)c.v);
        return r;
    }
#endif
#if defined(__AVX2__) && defined(__FMA__)
    if constexpr (W == 4) {
        r.v = (typename Vectors<W>::Reals)_mm256_fmadd_pd((__m256d)a.v, (__m256d)b.v, (__m256d)c.v);
        return r;
    }
#endif
    for (int l = 0; l < W; ++l) r.v[l] = fma(a.v[l], b.v[l], c.v[l]);
    return r;
}
// Products of what differs between the runs and what all share, as a row of modes has them.
template <int W> SNAPBEAM_FN Pack<W> fma(double a, Pack<W> b, Pack<W> c) { return fma(Pack<W>(a), b, c); }
template <int W> SNAPBEAM_FN Pack<W> fma(Pack<W> a, double b, Pack<W> c) { return fma(a, Pack<W>(b), c); }

// A function of the C library, run by run.
template <class F> SNAPBEAM_FN double each(double x, F f) { return f(x); }
template <int W, class F> SNAPBEAM_FN Pack<W> each(Pack<W> x, F f) {
    Pack<W> r;
    for (int l = 0; l < W; ++l) r.v[l] = f(x.v[l]);
    return r;
}
template <class T> SNAPBEAM_FN T max(T a, T b) { return select(a > b, a, b); }
template <class T> SNAPBEAM_FN T min(T a, T b) { return select(a < b, a, b); }
template <class T> SNAPBEAM_FN T abs(T a) { return select(a < T(0.0), -a, a); }
SNAPBEAM_FN double sqrt(double x) {
#if defined(__CUDACC_RTC__)
    return ::sqrt(x);
#else
    return __builtin_sqrt(x);
#endif
}
template <int W> SNAPBEAM_FN Pack<W> sqrt(Pack<W> x) {
#if defined(__AVX512F__)
    if constexpr (W == 8) {
        Pack<W> r;
        r.v = (typename Vectors<W>::Reals)_mm512_sqrt_pd((__m512d)x.v);
        return r;
    }
#endif
#if defined(__AVX2__)
    if constexpr (W == 4) {
        Pack<W> r;
        r.v = (typename Vectors<W>::Reals)_mm256_sqrt_pd((__m256d)x.v);
        return r;
    }
#endif
    return each(x, [](double y) { return sqrt(y); });
}
template <class T> SNAPBEAM_FN T sinh(T x) { return each(x, [](double y) { return ::sinh(y); }); }

// Nearest integer for |x| < 2^51; needs a compiler that does not reassociate.
template <class T> SNAPBEAM_FN T nearest(T x) {
    const double magic = 6755399441055744.0;
    return (x + T(magic)) - T(magic);
}
// Remainder x - y floor(x/y) of integers below 2^53, 0 <= x, 0 < y.
template <class T> SNAPBEAM_FN T remainder(T x, T y) {
    T r = fma(-nearest(x / y), y, x);
    r = select(r < T(0.0), r + y, r);
    return select(r >= y, r - y, r);
}

// c_0 + c_1 x + c_2 x^2 + ...
template <class T, int N> SNAPBEAM_FN T horner(T x, const double (&c)[N]) {
    T sum = T(c[N - 1]);
    for (int i = N - 2; i >= 0; --i) sum = fma(x, sum, T(c[i]));
    return sum;
}

template <class T> struct Turn { T sine, cosine, cosine_less_one; };

// Sine, cosine and cosine - 1 by argument reduction in three steps and Taylor polynomials; within 3e-16 for |x| < 1e5.
template <class T> SNAPBEAM_CALLED Turn<T> turn(T x) {
    const bool small = !any(abs(x) > T(0.75));  // as of most tones in a step
    const T k = nearest(x * T(0.6366197723675814));
    T r = x;
    if (!small) {
        r = fma(k, T(-1.5707963267341256), r);
        r = fma(k, T(-6.077100506303966e-11), r);
        r = fma(k, T(-2.0222662487959506e-21), r);
    }
    const T z = r * r;
    const T s = fma(z * r, horner(z, {-1.666666666666667e-01, 8.333333333333333e-03, -1.984126984126984e-04, 2.755731922398589e-06,
                                      -2.505210838544172e-08, 1.605904383682161e-10, -7.647163731819816e-13, 2.811457254345521e-15}), r);
    T c = horner(z, {-0.5, 4.166666666666666e-02, -1.388888888888889e-03, 2.480158730158730e-05, -2.755731922398589e-07,
                     2.087675698786810e-09, -1.147074559772973e-11, 4.779477332387385e-14});
    const T less = z * c;
    c = less + T(1.0);
    if (small) return {s, c, less};
    const T quadrant = k - T(4.0) * nearest(fma(k, T(0.25), T(-0.374)));
    const auto odd = (abs(quadrant - T(2.0)) < T(1.5)) & (abs(quadrant - T(2.0)) > T(0.5));
    T sine = select(odd, c, s), cosine = select(odd, s, c);
    sine = select(quadrant > T(1.5), -sine, sine);
    cosine = select(abs(quadrant - T(1.5)) < T(1.0), -cosine, cosine);
    return {sine, cosine, select(quadrant < T(0.5), less, cosine - T(1.0))};
}

// The bits of a number of one type as another.
template <class To, class From> SNAPBEAM_FN To same_bits(const From &x) {
    To to;
    __builtin_memcpy(&to, &x, sizeof to);
    return to;
}
constexpr double LN_2[2] = {0.693147180369123816490, 1.90821492927058770002e-10};  // and what it lacks
constexpr double TWO_52 = 4503599627370496.0;  // whose last bits count ones

// e^x = 2^k e^r, |r| <= ln(2)/2, by the Taylor polynomial; within 3e-16 of it.
template <class T> SNAPBEAM_FN T exp(T x) {
    const T k = nearest(min(max(x, T(-708.0)), T(709.78)) * T(1.4426950408889634)), r = fma(k, T(-LN_2[1]), fma(k, T(-LN_2[0]), x));
    const T e = horner(r, {1.0, 1.0, 0.5, 1.666666666666667e-01, 4.166666666666666e-02, 8.333333333333333e-03, 1.388888888888889e-03, 1.984126984126984e-04,
                           2.480158730158730e-05, 2.755731922398589e-06, 2.755731922398589e-07, 2.505210838544172e-08, 2.087675698786810e-09, 1.605904383682161e-10});
    const T half = same_bits<T>(same_bits<typename Bits<T>::Type>(k + T(TWO_52 + 1022.0)) << 52);  // 2^(k - 1)
    return select(x < T(-708.0), T(0.0), select(x > T(709.78), T(INFINITY), T(2.0) * (e * half)));
}
// ln x of normal x > 0: x = 2^k m, 2^(-1/2) < m <= 2^(1/2), ln m = 2 artanh s, s = (m - 1)/(m + 1).
template <class T> SNAPBEAM_FN T log(T x) {
    typedef typename Bits<T>::Type Integers;
    const Integers bits_of = same_bits<Integers>(x);
    T m = same_bits<T>((bits_of & 0x000fffffffffffffLL) | 0x3ff0000000000000LL), k = same_bits<T>((bits_of >> 52) | 0x4330000000000000LL) - T(TWO_52 + 1023.0);
    const auto large = m > T(1.4142135623730951);
    m = select(large, T(0.5) * m, m), k = select(large, k + T(1.0), k);
    const T s = (m - T(1.0)) / (m + T(1.0)), z = s * s;
    const T tail = z * horner(z, {2.0 / 3, 2.0 / 5, 2.0 / 7, 2.0 / 9, 2.0 / 11, 2.0 / 13, 2.0 / 15, 2.0 / 17, 2.0 / 19, 2.0 / 21});
    return fma(k, T(LN_2[0]), fma(s, T(2.0), fma(s, tail, k * T(LN_2[1]))));
}
template <class T> SNAPBEAM_FN T power(T x, T n) { return select(x > T(0.0), exp(n * log(max(x, T(1e-300)))), T(0.0)); }

// e^(-x) - 1 for any x, within 2e-14 of e^(-x).
template <class T> SNAPBEAM_FN T decay_of(T x) {
    const auto fast = abs(x) > T(4.0);
    const T y = x * T(-0.0625);
    T e = y * horner(y, {1.0, 0.5, 1.666666666666667e-01, 4.166666666666666e-02, 8.333333333333333e-03, 1.388888888888889e-03,
                         1.984126984126984e-04, 2.480158730158730e-05, 2.755731922398589e-06, 2.755731922398589e-07, 2.505210838544172e-08, 2.08767569878681e-09});
    for (int i = 0; i < 4; ++i) e = e * (e + T(2.0));
    return any(fast) ? select(fast, exp(-x) - T(1.0), e) : e;
}
template <class T> SNAPBEAM_FN T tanh(T x) {
    const T e = decay_of(T(2.0) * abs(x)), size = -(e / (T(2.0) + e));
    return select(x < T(0.0), -size, size);
}

// --- cubics -------------------------------------------------------------------------------------------------------------
// The cubic through values u and rates v at both ends of an interval of length h; coefficients of the fraction s of it.
template <class T> struct Cubic {
    T c0, c1, c2, c3;
    SNAPBEAM_FN Cubic(T u0, T v0, T u1, T v1, T h) : c0(u0), c1(v0 * h) {
        const T rise = u1 - u0, v = v1 * h;
        c2 = T(3.0) * rise - T(2.0) * c1 - v;
        c3 = c1 + v - T(2.0) * rise;
    }
    SNAPBEAM_FN T at(T s) const { return fma(s, fma(s, fma(s, c3, c2), c1), c0); }
    SNAPBEAM_FN T slope(T s) const { return fma(s, fma(s, T(3.0) * c3, T(2.0) * c2), c1); }
    // Where the slope falls through zero; of use only where it is positive at 0 and negative at 1.
    SNAPBEAM_FN T summit() const { return c1 / (sqrt(max(c2 * c2 - T(3.0) * c1 * c3, T(0.0))) - c2); }
};

// Maximum of a cubic: inside, where it rises at 0 and falls at 1, else at an end.
template <class T> SNAPBEAM_CALLED T crest(const Cubic<T> &u, T v0, T v1) {
    const auto turns = (v0 > T(0.0)) & (v1 < T(0.0));
    const T ends = max(u.c0, u.at(T(1.0)));
    if (!any(turns)) return ends;
    return max(ends, select(turns, u.at(u.summit()), ends));
}

// First fraction in (0, high] at which a cubic that is not positive at 0 and positive at high becomes positive, where it is *wanted*:
// Newton's method between bounds.  Events are corrected on the true motion afterwards.
template <class T, class M> SNAPBEAM_CALLED T root(const Cubic<T> &u, T high, M wanted) {
    T low = T(0.0), x = T(0.5) * high;
    SNAPBEAM_LOOP
    for (int i = 0; i < 8 && any(wanted); ++i) {
        const T y = u.at(x);
        const auto above = y > T(0.0);
        high = select(above, x, high), low = select(above, low, x);
        const T newton = x - y / u.slope(x), next = select((newton >= low) & (newton <= high), newton, T(0.5) * (low + high));  // at the root it is one of the bounds
        const T moved = abs(next - x);
        x = select(wanted, next, x), wanted = wanted & (moved > T(1e-13));
    }
    return x;
}

}  // namespace SNAPBEAM_SET
