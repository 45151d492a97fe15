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

constexpr double LARGEST_POWER = 12.0;   // bound of |beta| ln(1 + L/tau): (1 + y/tau)^beta keeps ten digits next to 1
constexpr double LONGEST_SHIFT = 1e6;    // a shift so much longer than the segment bends nothing within it
constexpr double SHORTEST_SHIFT = 1e-30;  // nor can one so much shorter be told from none

// Of a segment that begins after some creep.
//
// With p'' = r p', a curve (1 + y/tau)^beta has r = (beta - 1)/(tau + y), so r = bend and its rate give beta and tau.
inline TimeTransformation shifted_power_law_time(double start, double length, double bend, double bend_rate) {
    if (!(isfinite(bend) && isfinite(bend_rate)) || bend >= 0.0 || bend_rate <= 0.0) return linear_time(start, length);
    const double tau = -bend / bend_rate;
    if (!(SHORTEST_SHIFT * length < tau && tau < LONGEST_SHIFT * length)) return linear_time(start, length);
    const double bound = LARGEST_POWER / log1p(length / tau), free = 1.0 + bend * tau;
    const double beta = free < -bound ? -bound : free > bound ? bound : free;
    return {start, length, fabs(beta) < 1e-3 ? 1e-3 : beta, tau};
}

// A time, s, dt/ds there, and ln((y + tau)/tau), or ln(y/L) from a virgin state, with y the time since the start; not
// worked out where time is linear.
struct TimeAndPace {
    double time, pace, log_growth;
};

// Derivatives of time and of ln(dt/ds) to beta and to tau at a fixed position.
struct TransformationDerivatives {
    TransformedTime by_beta, by_tau;
};

// A transformation with all that is constant over its segment worked out.
struct SegmentClock {
    TimeTransformation transformation;
    double log_reach, reach;  // ln(1 + L/tau) and (1 + L/tau)^beta - 1, where tau > 0
    bool linear;              // s is proportional to time

    explicit SegmentClock(const TimeTransformation& clock)
        : transformation(clock),
          log_reach(clock.tau == 0.0 ? 0.0 : log1p(clock.length / clock.tau)),
          reach(clock.tau == 0.0 ? 0.0 : expm1(clock.beta * log_reach)),
          linear(clock.beta == 1.0) {}

    // Time and pace at position s > 0, with one logarithm and one exponential.
    TimeAndPace at(double s) const {
        const TimeTransformation& clock = transformation;
        if (linear) return {clock.start + clock.length * s, clock.length, NAN};
        if (clock.tau == 0.0) {
            const double power = log(s) / clock.beta, elapsed = clock.length * exp(power);
            return {clock.start + elapsed, elapsed / (clock.beta * s), power};
        }
        const double growth = s * reach, power = log1p(growth) / clock.beta, elapsed = clock.tau * expm1(power);
        return {clock.start + elapsed, (clock.tau + elapsed) * reach / (clock.beta * (1.0 + growth)), power};
    }

    // Position of a time in the segment.
    double position(double time) const {
        const TimeTransformation& clock = transformation;
        const double elapsed = time - clock.start;
        if (elapsed <= 0.0) return 0.0;
        if (linear) return elapsed / clock.length;
        if (clock.tau == 0.0) return exp(clock.beta * log(elapsed / clock.length));
        return expm1(clock.beta * log1p(elapsed / clock.tau)) / reach;
    }

    // At the position s of a time.
    TransformationDerivatives derivatives(double s, const TimeAndPace& now) const {
        const double beta = transformation.beta, tau = transformation.tau, length = transformation.length;
        const double elapsed = now.time - transformation.start;
        const double power = !linear ? now.log_growth : tau == 0.0 ? log(s) : log1p(elapsed / tau);
        if (tau == 0.0) {
            const double slope = -power / beta;
            return {{elapsed * slope, slope - 1.0 / beta}, {0.0, 0.0}};
        }
        const double inner = 1.0 + s * reach, grown = tau + elapsed;
        // What goes through `reach`, which changes by `change`.
        const auto through = [&](double change) -> TransformedTime {
            const double rise = s * change / (beta * inner);
            return {grown * rise, rise + change / reach - s * change / inner};
        };
        const TransformedTime by_beta = through(log_reach * (1.0 + reach));
        const TransformedTime by_tau = through(-beta * (1.0 + reach) * length / (tau * (tau + length)));
        const double shrink = power / beta;
        return {{by_beta.time - grown * shrink, by_beta.log_pace - shrink - 1.0 / beta},
                {by_tau.time + elapsed / tau, by_tau.log_pace + 1.0 / tau}};
    }
};

}  // namespace creepkit
