// Eight numbers side by side: eight points of two elements, eight nodes of an element, or eight columns of a matrix.
//
// They are kept in the vectors of the processor, CREEPKIT_LANES numbers each: 8 (AVX-512), 4 (AVX2) or 2 (SSE2, NEON),
// by the vector extensions that GCC and Clang share. A source that includes this header is compiled once for each
// width, in a namespace of its own, so that no function of one width is linked in place of another.
#pragma once

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "vectors.hpp"

#if defined(CREEPKIT_SANITIZED)  // checks of every operation would make the inlined code too long to compile
#define CREEPKIT_INLINE inline
#else
#define CREEPKIT_INLINE inline __attribute__((always_inline))
#endif

namespace creepkit {

constexpr int LANES = CREEPKIT_LANES, EIGHT = 8, VECTORS = EIGHT / LANES;

typedef int64_t Integers __attribute__((vector_size(8 * LANES)));

// Truth values of eight comparisons: all bits set where true.
struct Mask {
    Integers part[VECTORS];
};

struct Eight {
    Vector part[VECTORS];

    Eight() = default;
    CREEPKIT_INLINE Eight(double value) {
        for (int i = 0; i < VECTORS; ++i) part[i] = Vector{} + value;
    }
    CREEPKIT_INLINE double operator[](int k) const { return part[k / LANES][k % LANES]; }
    CREEPKIT_INLINE void set(int k, double value) { part[k / LANES][k % LANES] = value; }
};

CREEPKIT_INLINE Eight load(const double* from) {
    Eight r;
    memcpy(r.part, from, sizeof r.part);
    return r;
}

CREEPKIT_INLINE void store(double* to, const Eight& x) { memcpy(to, x.part, sizeof x.part); }

#define CREEPKIT_OPERATOR(sign)                                                                  \
    CREEPKIT_INLINE Eight operator sign(const Eight& a, const Eight& b) {                        \
        Eight r;                                                                                 \
        for (int i = 0; i < VECTORS; ++i) r.part[i] = a.part[i] sign b.part[i];                  \
        return r;                                                                                \
    }                                                                                            \
    CREEPKIT_INLINE Eight operator sign(const Eight& a, double b) {                              \
        Eight r;                                                                                 \
        for (int i = 0; i < VECTORS; ++i) r.part[i] = a.part[i] sign b;                          \
        return r;                                                                                \
    }                                                                                            \
    CREEPKIT_INLINE Eight operator sign(double a, const Eight& b) {                              \
        Eight r;                                                                                 \
        for (int i = 0; i < VECTORS; ++i) r.part[i] = a sign b.part[i];                          \
        return r;                                                                                \
    }
CREEPKIT_OPERATOR(+)
CREEPKIT_OPERATOR(-)
CREEPKIT_OPERATOR(*)
CREEPKIT_OPERATOR(/)
#undef CREEPKIT_OPERATOR

#define CREEPKIT_COMPARISON(sign)                                                                \
    CREEPKIT_INLINE Mask operator sign(const Eight& a, const Eight& b) {                         \
        Mask r;                                                                                  \
        for (int i = 0; i < VECTORS; ++i) r.part[i] = a.part[i] sign b.part[i];                  \
        return r;                                                                                \
    }
CREEPKIT_COMPARISON(<)
CREEPKIT_COMPARISON(>)
CREEPKIT_COMPARISON(<=)
CREEPKIT_COMPARISON(>=)
#undef CREEPKIT_COMPARISON

#define CREEPKIT_LOGICAL(sign)                                                                   \
    CREEPKIT_INLINE Mask operator sign(const Mask& a, const Mask& b) {                           \
        Mask r;                                                                                  \
        for (int i = 0; i < VECTORS; ++i) r.part[i] = a.part[i] sign b.part[i];                  \
        return r;                                                                                \
    }
CREEPKIT_LOGICAL(&)
CREEPKIT_LOGICAL(|)
#undef CREEPKIT_LOGICAL

CREEPKIT_INLINE Eight operator-(const Eight& a) { return 0.0 - a; }
CREEPKIT_INLINE Eight& operator+=(Eight& a, const Eight& b) { return a = a + b; }
CREEPKIT_INLINE Eight& operator-=(Eight& a, const Eight& b) { return a = a - b; }

CREEPKIT_INLINE Mask operator!(const Mask& a) {
    Mask r;
    for (int i = 0; i < VECTORS; ++i) r.part[i] = ~a.part[i];
    return r;
}

CREEPKIT_INLINE Eight select(const Mask& where, const Eight& a, const Eight& b) {
    Eight r;
    for (int i = 0; i < VECTORS; ++i) r.part[i] = where.part[i] ? a.part[i] : b.part[i];
    return r;
}

CREEPKIT_INLINE bool any(const Mask& a) {
    Integers sum = a.part[0];
    for (int i = 1; i < VECTORS; ++i) sum |= a.part[i];
    int64_t total = 0;
    for (int k = 0; k < LANES; ++k) total |= sum[k];
    return total != 0;
}

CREEPKIT_INLINE bool is_set(const Mask& a, int k) { return a.part[k / LANES][k % LANES] != 0; }

CREEPKIT_INLINE Eight larger(const Eight& a, const Eight& b) { return select(a > b, a, b); }
CREEPKIT_INLINE Eight smaller(const Eight& a, const Eight& b) { return select(a < b, a, b); }
CREEPKIT_INLINE Eight magnitude(const Eight& a) { return larger(a, -a); }

CREEPKIT_INLINE Eight square_root(const Eight& a) {
    Eight r;
    for (int i = 0; i < VECTORS; ++i)
        for (int k = 0; k < LANES; ++k) r.part[i][k] = __builtin_sqrt(a.part[i][k]);
    return r;
}

// The sum of all eight.
CREEPKIT_INLINE double sum(const Eight& a) {
    double total = 0.0;
    for (int k = 0; k < EIGHT; ++k) total += a[k];
    return total;
}

CREEPKIT_INLINE Eight exponential(const Eight& x) {
    Eight r;
    for (int i = 0; i < VECTORS; ++i) r.part[i] = exponential(x.part[i]);
    return r;
}

// ln(x), x > 0 and normal, by x = 2^k m, m in [sqrt(1/2), sqrt(2)], and ln m = 2 artanh((m - 1)/(m + 1)): 4e-16.
CREEPKIT_INLINE Eight logarithm(const Eight& argument) {
    const double coefficients[] = {2.0 / 17.0, 2.0 / 15.0, 2.0 / 13.0, 2.0 / 11.0, 2.0 / 9.0,
                                   2.0 / 7.0,  2.0 / 5.0,  2.0 / 3.0,  2.0};
    Eight result;
    for (int i = 0; i < VECTORS; ++i) {
        const Integers bits = (Integers)argument.part[i];
        // subtracting the bits of sqrt(1/2) puts the mantissa between sqrt(1/2) and sqrt(2)
        const Integers k = (bits - 0x3fe6a09e667f3bcdL) >> 52;
        const Vector m = (Vector)(bits - (k << 52));
        const Vector s = (m - 1.0) / (m + 1.0), z = s * s;
        Vector p = Vector{} + 2.0 / 19.0;
        for (double c : coefficients) p = p * z + c;
        // k as a double, through the bits of 1.5 2^52 + k
        const Vector number = (Vector)(k + 0x4338000000000000L) - 6755399441055744.0;
        result.part[i] = number * 0.6931471805599453 + p * s;
    }
    return result;
}

}  // namespace creepkit
