// Vectors of CREEPKIT_LANES numbers of double, as many as a register of the processor holds: 8 (AVX-512), 4 (AVX2) or 2
// (SSE2, NEON), by the vector extensions that GCC and Clang share.
//
// A source that includes this header is compiled once for each width, in a namespace of its own, so that no function of
// one width is linked in place of another. No type is wider than a register: compilers would keep it in memory. What
// lies in memory by eights (points of two elements, nodes of an element, rows of a tile) is VECTORS vectors.
#pragma once

#include <stdint.h>
#include <string.h>

#if !defined(CREEPKIT_LANES)
#define CREEPKIT_LANES 2  // what every processor has
#endif

#if defined(CREEPKIT_SANITIZED)  // checks of every operation would make the inlined code too long to compile
#define CREEPKIT_INLINE inline
#else
#define CREEPKIT_INLINE inline __attribute__((always_inline))
#endif

// Before a loop of a known, small count over vectors: unrolled, they stay in registers.
#define CREEPKIT_UNROLL _Pragma("GCC unroll 8")

namespace creepkit {

constexpr int LANES = CREEPKIT_LANES, EIGHT = 8, VECTORS = EIGHT / LANES;

typedef double Vector __attribute__((vector_size(8 * LANES)));
typedef int64_t Mask __attribute__((vector_size(8 * LANES)));  // of comparisons: all bits set where true
typedef uint64_t BitVector __attribute__((vector_size(8 * LANES)));

// A number in all lanes; subtracting zero changes none, so that no instruction is left of it.
CREEPKIT_INLINE Vector splat(double value) { return value - Vector{}; }

CREEPKIT_INLINE Vector load(const double* from) {
    Vector v;
    memcpy(&v, from, sizeof v);
    return v;
}

CREEPKIT_INLINE void store(double* to, Vector v) { memcpy(to, &v, sizeof v); }

CREEPKIT_INLINE Vector select(Mask where, Vector a, Vector b) { return where ? a : b; }
CREEPKIT_INLINE Vector larger(Vector a, Vector b) { return a > b ? a : b; }
CREEPKIT_INLINE Vector smaller(Vector a, Vector b) { return a < b ? a : b; }
CREEPKIT_INLINE Vector magnitude(Vector a) { return larger(a, -a); }

CREEPKIT_INLINE bool any(Mask a) {
#if CREEPKIT_LANES == 4 && defined(__AVX2__)
    return __builtin_ia32_movmskpd256((Vector)a) != 0;
#else
    int64_t total = 0;
    CREEPKIT_UNROLL for (int k = 0; k < LANES; ++k) total |= a[k];
    return total != 0;
#endif
}

CREEPKIT_INLINE Vector square_root(Vector a) {
    Vector r;
    CREEPKIT_UNROLL for (int k = 0; k < LANES; ++k) r[k] = __builtin_sqrt(a[k]);
    return r;
}

CREEPKIT_INLINE double sum(Vector v) {
    CREEPKIT_UNROLL for (int half = LANES / 2; half > 0; half /= 2)
        CREEPKIT_UNROLL for (int k = 0; k < half; ++k) v[k] += v[k + half];
    return v[0];
}

// Count rounded up to whole vectors.
constexpr int64_t whole_vectors(int64_t count) { return (count + LANES - 1) / LANES * LANES; }

// exp(x) within 2e-16 of itself, for x up to 700; below -708, where it is 3e-308, it stays what it is there. NaN is
// kept.
//
// x = k ln 2 + r with whole k and |r| < 0.35; Taylor's series of exp(r) to the 13th power leaves 4e-18; 2^k is written
// into the exponent of the number. ln 2 is taken off in two parts, of which the first times k has no rounding.
CREEPKIT_INLINE Vector exponential(Vector x) {
    constexpr double ROUNDING = 6755399441055744.0;  // 1.5 * 2^52: adding it rounds to whole numbers, in the low bits
    constexpr double LN2_HIGH = 6.93147180369123816490e-01, LN2_LOW = 1.90821492927058770002e-10;
    constexpr double LOG2_E = 1.44269504088896338700, LEAST = -708.0;
    const Vector floor = splat(LEAST);
    x = x < floor ? floor : x;
    const Vector shifted = x * LOG2_E + ROUNDING, k = shifted - ROUNDING;
    const Vector r = (x - k * LN2_HIGH) - k * LN2_LOW;
    constexpr double INVERSE_FACTORIAL[] = {1.0 / 6227020800.0, 1.0 / 479001600.0, 1.0 / 39916800.0, 1.0 / 3628800.0,
                                            1.0 / 362880.0,     1.0 / 40320.0,     1.0 / 5040.0,     1.0 / 720.0,
                                            1.0 / 120.0,        1.0 / 24.0,        1.0 / 6.0,        1.0 / 2.0};
    Vector series = splat(INVERSE_FACTORIAL[0]);
    for (int i = 1; i < 12; ++i) series = series * r + INVERSE_FACTORIAL[i];
    series = 1.0 + (r + r * r * series);
    return (Vector)((BitVector)series + ((BitVector)shifted << 52));
}

// ln(x), x > 0 and normal, by x = 2^k m, m in [sqrt(1/2), sqrt(2)], and ln m = 2 artanh((m - 1)/(m + 1)): 4e-16.
CREEPKIT_INLINE Vector logarithm(Vector argument) {
    constexpr double COEFFICIENTS[] = {2.0 / 17.0, 2.0 / 15.0, 2.0 / 13.0, 2.0 / 11.0, 2.0 / 9.0,
                                       2.0 / 7.0,  2.0 / 5.0,  2.0 / 3.0,  2.0};
    constexpr uint64_t ONE = 0x3ff0000000000000, ROOT_OF_HALF = 0x3fe6a09e667f3bcd, BITS = 0x4338000000000000;
    const BitVector bits = (BitVector)argument;
    // subtracting the bits of sqrt(1/2) puts the mantissa between sqrt(1/2) and sqrt(2); this is k + 1023, never negative
    const BitVector k = (bits + (ONE - ROOT_OF_HALF)) >> 52;
    const Vector m = (Vector)(bits - (k << 52) + ONE);
    const Vector s = (m - 1.0) / (m + 1.0), z = s * s;
    Vector p = splat(2.0 / 19.0);
    for (int i = 0; i < 9; ++i) p = p * z + COEFFICIENTS[i];
    // as a double, through the bits of 1.5 2^52
    const Vector number = (Vector)(k + BITS) - (6755399441055744.0 + 1023.0);
    return number * 0.6931471805599453 + p * s;
}

}  // namespace creepkit
