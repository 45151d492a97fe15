// Interpolation in time between the accepted steps of a simulation.
//
// Within a segment of the load program, values are a cubic spline with not-a-knot ends in the variable ln(1 +
// ((t - origin) / 20 s)^beta), in which creep after a change of load is smooth; within a single step, a straight line.
// Splines: C. de Boor, A Practical Guide to Splines, 2001, chapter IV.
#pragma once

#include <math.h>
#include <stdint.h>

#include "workspace.hpp"

namespace creepkit {

constexpr double TIME_OFFSET = 20.0;      // s; twice the first step after a change of load
constexpr double SHORT_LAST_STEP = 0.2;   // a last step this much shorter than the one before does not count
constexpr double TIME_ROUNDING = 1e-12;   // share of the last time by which a time may lie after it

// The accepted steps, and the segments of the load program that they reach.
struct AcceptedSteps {
    int64_t steps, segments;
    const double* times;      // (steps,) s
    const double* starts;     // (segments,) s, increasing
    const int64_t* rows;      // (segments, 2) first and last step of each segment
    const double* origins;    // (segments,) s, zero of the time since the change of load
    const double* exponents;  // (segments,) beta
};

enum InterpolationError : int64_t { INTERPOLATED, BAD_COUNTS, NOT_INCREASING, NO_MEMORY };

// Working memory for splines of so many columns through so many knots at most.
struct SplineWorkspace {
    double *places, *lengths, *pivots;  // (knots,)
    int64_t* knots;                     // (knots,) their rows of `values`
    double* slopes;                     // (knots, columns) derivatives to the place
};

inline SplineWorkspace spline_workspace(Workspace& memory, int64_t knots, int64_t columns) {
    return {memory.doubles(knots), memory.doubles(knots), memory.doubles(knots), memory.array<int64_t>(knots),
            memory.doubles(knots * columns)};
}

// Derivatives `slopes` (knots, columns) of the not-a-knot splines through values (rows of `knots`, columns) at
// `places`.
//
// With h the lengths of the intervals and d the divided differences, s has to meet, between the ends,
//     h[i] s[i-1] + 2 (h[i-1] + h[i]) s[i] + h[i-1] s[i+1] = 3 (h[i] d[i-1] + h[i-1] d[i])
// and at the ends that the third derivative is continuous at the second knot and at the last but one. Each end's
// equation is first taken off its neighbour, which leaves a system with a dominant diagonal for the knots between.
inline void not_a_knot_slopes(const SplineWorkspace& spline, int64_t knots, int64_t columns, const double* values) {
    const double *x = spline.places, *h = spline.lengths;
    double *s = spline.slopes, *pivot = spline.pivots;
    const int64_t last = knots - 1;
    const auto row = [&](int64_t i) { return values + spline.knots[i] * columns; };
    const auto difference = [&](int64_t i, int64_t c) { return (row(i + 1)[c] - row(i)[c]) / h[i]; };
    if (knots == 2) {
        for (int64_t c = 0; c < columns; ++c) s[c] = s[columns + c] = difference(0, c);
        return;
    }
    if (knots == 3) {  // a parabola
        for (int64_t c = 0; c < columns; ++c) {
            const double before = difference(0, c), after = difference(1, c), bend = (after - before) / (x[2] - x[0]);
            s[c] = before - bend * h[0];
            s[columns + c] = before + bend * h[0];
            s[2 * columns + c] = after + bend * h[1];
        }
        return;
    }
    const double reach_first = x[2] - x[0], reach_last = x[last] - x[last - 2];
    for (int64_t c = 0; c < columns; ++c) {
        s[c] = ((h[0] + 2.0 * reach_first) * h[1] * difference(0, c) + h[0] * h[0] * difference(1, c)) / reach_first;
        s[last * columns + c] = (h[last - 1] * h[last - 1] * difference(last - 2, c) +
                                 (2.0 * reach_last + h[last - 1]) * h[last - 2] * difference(last - 1, c)) /
                                reach_last;
    }
    for (int64_t i = 1; i < last; ++i) {
        const double down = i > 1 ? h[i] / pivot[i - 1] : 1.0;
        pivot[i] = i == 1 ? h[0] + h[1] : (i == last - 1 ? h[i - 1] + h[i] : 2.0 * (h[i - 1] + h[i])) - down * h[i - 2];
        for (int64_t c = 0; c < columns; ++c) {
            double right = 3.0 * (h[i] * difference(i - 1, c) + h[i - 1] * difference(i, c));
            if (i == last - 1) right -= s[last * columns + c];
            s[i * columns + c] = right - down * s[(i - 1) * columns + c];
        }
    }
    for (int64_t i = last - 1; i > 0; --i)
        for (int64_t c = 0; c < columns; ++c) {
            const double above = i < last - 1 ? h[i - 1] * s[(i + 1) * columns + c] : 0.0;
            s[i * columns + c] = (s[i * columns + c] - above) / pivot[i];
        }
    for (int64_t c = 0; c < columns; ++c) {
        s[c] = (s[c] - reach_first * s[columns + c]) / h[1];
        s[last * columns + c] = (s[last * columns + c] - reach_last * s[(last - 1) * columns + c]) / h[last - 2];
    }
}

// What the values of a segment are smooth in, at a time.
inline double smooth_variable(const AcceptedSteps& record, int64_t segment, double time) {
    const double elapsed = fmax(time - record.origins[segment], 0.0);
    if (record.rows[2 * segment + 1] - record.rows[2 * segment] == 1) return elapsed;  // a ramp: elastic, so straight
    const double share = elapsed / TIME_OFFSET, beta = record.exponents[segment];
    return log1p(beta == 1.0 ? share : pow(share, beta));
}

// The knots of a segment into `spline`: all of its steps, less the last but one where a short last step, cut off by the
// end, would make a slope of its error. Returns their number, 0 when their places do not increase.
inline int64_t choose_knots(const AcceptedSteps& record, int64_t segment, const SplineWorkspace& spline) {
    const int64_t first = record.rows[2 * segment], last = record.rows[2 * segment + 1];
    int64_t knots = 0;
    for (int64_t i = first; i <= last; ++i) {
        spline.places[knots] = smooth_variable(record, segment, record.times[i]);
        spline.knots[knots++] = i;
    }
    if (knots > 3) {
        const double* end = spline.places + knots - 1;
        if (!(end[0] - end[-1] > SHORT_LAST_STEP * (end[-1] - end[-2]))) {
            spline.places[knots - 2] = spline.places[knots - 1];
            spline.knots[knots - 2] = spline.knots[knots - 1];
            --knots;
        }
    }
    for (int64_t i = 0; i + 1 < knots; ++i) {
        spline.lengths[i] = spline.places[i + 1] - spline.places[i];
        if (!(spline.lengths[i] > 0.0)) return 0;
    }
    return knots;
}

// Values (columns,) of the splines at a place, those through the end intervals beyond them.
inline void evaluate_splines(const SplineWorkspace& spline, int64_t knots, int64_t columns, const double* values,
                             double place, double* out) {
    int64_t low = 0, high = knots - 1;
    while (high - low > 1) {
        const int64_t middle = (low + high) / 2;
        (place < spline.places[middle] ? high : low) = middle;
    }
    const double* y = values + spline.knots[low] * columns;
    if (knots == 1) {
        for (int64_t c = 0; c < columns; ++c) out[c] = y[c];
        return;
    }
    const double *next = values + spline.knots[low + 1] * columns, *s = spline.slopes + low * columns;
    const double h = spline.lengths[low], u = place - spline.places[low];
    for (int64_t c = 0; c < columns; ++c) {
        const double difference = (next[c] - y[c]) / h, third = (s[c] + s[columns + c] - 2.0 * difference) / h;
        out[c] = y[c] + u * (s[c] + u * ((difference - s[c]) / h - third + u * (third / h)));
    }
}

// The segment that a time belongs to: at the time of a jump the one before it, at time zero the first.
inline int64_t segment_of(const AcceptedSteps& record, double time) {
    int64_t segment = 0;
    while (segment + 1 < record.segments && record.starts[segment + 1] < time) ++segment;
    return segment;
}

// Values (steps, columns) at other times, out (count, columns); NaN after the last step.
inline int64_t interpolate_in_time(const AcceptedSteps& record, const SplineWorkspace& spline, int64_t columns,
                                   const double* values, int64_t count, const double* times, double* out) {
    if (record.steps < 1 || record.segments < 1 || columns < 0 || count < 0) return BAD_COUNTS;
    for (int64_t n = 0; n < record.segments; ++n) {
        const int64_t first = record.rows[2 * n], last = record.rows[2 * n + 1];
        if (first < 0 || first > last || last >= record.steps) return BAD_COUNTS;
    }
    const double end = record.times[record.steps - 1] * (1.0 + TIME_ROUNDING);
    int64_t fitted = -1, knots = 0;  // the segment whose splines are in `spline`
    for (int64_t k = 0; k < count; ++k) {
        double* target = out + k * columns;
        if (!(times[k] <= end)) {
            for (int64_t c = 0; c < columns; ++c) target[c] = NAN;
            continue;
        }
        const int64_t segment = segment_of(record, times[k]);
        if (segment != fitted) {
            knots = choose_knots(record, segment, spline);
            if (knots == 0) return NOT_INCREASING;
            if (knots > 1) not_a_knot_slopes(spline, knots, columns, values);
            fitted = segment;
        }
        evaluate_splines(spline, knots, columns, values, smooth_variable(record, segment, times[k]), target);
    }
    return INTERPOLATED;
}

}  // namespace creepkit
