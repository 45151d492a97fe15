// The transformed time s in [0, 1] of a segment of the load program, in which creep strain is nearly a straight line.
//
//     s = ((1 + y/tau)^beta - 1) / ((1 + L/tau)^beta - 1),   y time since the segment began, L its length;
//     s = (y/L)^beta for a segment that begins without creep strain (tau = 0).
#pragma once

#include <math.h>

namespace creepkit {

constexpr double SMALLEST_EXPONENT = 0.05;  // exponents of time are not taken below this: t^m with m = -0.95

// start and length of the segment, s; beta, and tau in s (0: from a virgin state).
struct TimeTransformation {
    double start, length, beta, tau;
};

// A time, s, and ln(dt/ds) there.
struct TransformedTime {
    double time, log_pace;
};

// Time and pace at position s > 0.
inline TransformedTime transformed_time(const TimeTransformation& clock, double s) {
    if (clock.tau == 0.0) {
        const double logarithm = log(s) / clock.beta;
        return {clock.start + clock.length * exp(logarithm), log(clock.length / clock.beta) + logarithm - log(s)};
    }
    const double reach = expm1(clock.beta * log1p(clock.length / clock.tau));
    const double grown = log1p(s * reach), power = grown / clock.beta;
    return {clock.start + clock.tau * expm1(power), log(clock.tau * reach / clock.beta) + power - grown};
}

// Position of a time in the segment.
inline double position(const TimeTransformation& clock, double time) {
    const double elapsed = time - clock.start;
    if (elapsed <= 0.0) return 0.0;
    if (clock.tau == 0.0) return pow(elapsed / clock.length, clock.beta);
    const double reach = expm1(clock.beta * log1p(clock.length / clock.tau));
    return expm1(clock.beta * log1p(elapsed / clock.tau)) / reach;
}

// Plain time: s proportional to it.
inline TimeTransformation linear_time(double start, double length) { return {start, length, 1.0, length}; }

// Of a segment that begins without creep strain; beta is the leading exponent of time.
inline TimeTransformation power_law_time(double start, double length, double beta) {
    return {start, length, fmin(fmax(beta, SMALLEST_EXPONENT), 1.0), 0.0};
}

}  // namespace creepkit
