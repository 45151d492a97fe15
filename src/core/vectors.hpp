// Vectors of CREEPKIT_LANES numbers of double, as GCC and Clang both have them, and their exponential.
#pragma once

#include <stdint.h>
#include <string.h>

#if !defined(CREEPKIT_LANES)
#define CREEPKIT_LANES 2  // what every processor has
#endif

namespace creepkit {

typedef double Vector __attribute__((vector_size(8 * CREEPKIT_LANES)));
typedef uint64_t BitVector __attribute__((vector_size(8 * CREEPKIT_LANES)));

inline Vector load_vector(const double* from) {
    Vector v;
    memcpy(&v, from, sizeof v);
    return v;
}

inline void store(double* to, Vector v) { memcpy(to, &v, sizeof v); }

inline double sum(Vector v) {
    double total = 0.0;
    for (int i = 0; i < CREEPKIT_LANES; ++i) total += v[i];
    return total;
}

// Count rounded up to whole vectors.
inline int64_t padded(int64_t count) { return (count + CREEPKIT_LANES - 1) / CREEPKIT_LANES * CREEPKIT_LANES; }

// exp(x) within 2e-16 of itself, for x up to 700; below -708, where it is 3e-308, it stays what it is there. NaN is
// kept.
//
// x = k ln 2 + r with whole k and |r| < 0.35; Taylor's series of exp(r) to the 13th power leaves 4e-18; 2^k is written
// into the exponent of the number. ln 2 is taken off in two parts, of which the first times k has no rounding.
inline Vector exponential(Vector x) {
    constexpr double ROUNDING = 6755399441055744.0;  // 1.5 * 2^52: adding it rounds to whole numbers, in the low bits
    constexpr double LN2_HIGH = 6.93147180369123816490e-01, LN2_LOW = 1.90821492927058770002e-10;
    constexpr double LOG2_E = 1.44269504088896338700, LEAST = -708.0;
    const Vector floor = Vector{} + LEAST;
    x = x < floor ? floor : x;
    const Vector shifted = x * LOG2_E + ROUNDING, k = shifted - ROUNDING;
    const Vector r = (x - k * LN2_HIGH) - k * LN2_LOW;
    constexpr double INVERSE_FACTORIAL[] = {1.0 / 6227020800.0, 1.0 / 479001600.0, 1.0 / 39916800.0, 1.0 / 3628800.0,
                                            1.0 / 362880.0,     1.0 / 40320.0,     1.0 / 5040.0,     1.0 / 720.0,
                                            1.0 / 120.0,        1.0 / 24.0,        1.0 / 6.0,        1.0 / 2.0};
    Vector series = Vector{} + INVERSE_FACTORIAL[0];
    for (int i = 1; i < 12; ++i) series = series * r + INVERSE_FACTORIAL[i];
    series = 1.0 + (r + r * r * series);
    BitVector bits, power;
    memcpy(&power, &shifted, sizeof power);
    memcpy(&bits, &series, sizeof bits);
    bits += power << 52;
    memcpy(&series, &bits, sizeof series);
    return series;
}

}  // namespace creepkit
