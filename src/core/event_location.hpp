// Event location and termination: limits of strain and states, times at given strains, and their derivatives.
//
// A time t at which an unknown v takes a given value depends on the parameters as
// dt/dtheta = -(dv/dtheta at fixed t) / (dv/dt).
#pragma once

#include <math.h>
#include <stdint.h>

#include "runge_kutta_step.hpp"

namespace creepkit {

// Codes of an ending; whatever it is, the history so far is kept.
enum Ending { REACHED_END, STRAIN_LIMIT, STATE_LIMIT, DIVERGED, STEP_TOO_SMALL, TOO_MANY_STEPS };

// Fraction of the time passed, within which a limit ahead ends a simulation whose steps have shrunk to nothing.
constexpr double TERMINATION_MARGIN = 1e-7;

// Creep strain at which the point has burst; initial states and the values at which it has failed (inf: none), (S,).
struct TerminationLimits {
    double strain;
    const double *initial, *states;

    // Whether state i has passed its limit, coming from its initial value.
    bool state_passed(int64_t i, double value) const {
        if (!isfinite(states[i])) return false;
        return states[i] > initial[i] ? value >= states[i] : value <= states[i];
    }
};

// Creep strains to arrive at, and what becomes of them.
//
// levels        : (count,) increasing
// times, slopes : (count,) s, and dp/d(ln t) there; untouched where never reached
// changes       : (count, P) d(ln t)
// end_change    : (P,) d(ln t) of the end, where a limit was reached or the rate diverged; else untouched
// changes and end_change are null when derivatives are not wanted.
struct LevelEvents {
    int64_t count;
    const double* levels;
    double *times, *slopes, *changes, *end_change;
};

// Which unknown is at its limit at the share x of the step: 0 is strain, then the states.
inline int64_t first_limit_passed(const TerminationLimits& limits, const Tableau& tableau, const StepWorkspace& work,
                                  double h, double x) {
    for (int64_t i = 0; i < work.states; ++i) {
        if (limits.state_passed(i, work.dense(tableau, h, 1 + i).at(x))) return 1 + i;
    }
    return 0;
}

// STATE_LIMIT or STRAIN_LIMIT when the new value has passed one, else REACHED_END.
inline Ending limit_reached(const TerminationLimits& limits, const StepWorkspace& work) {
    for (int64_t i = 0; i < work.states; ++i) {
        if (limits.state_passed(i, work.new_value[1 + i])) return STATE_LIMIT;
    }
    return work.new_value[0] >= limits.strain ? STRAIN_LIMIT : REACHED_END;
}

// Which unknown, growing ever faster, will pass its limit within the share `margin` of the time; -1 is none.
//
// pace : d(ln t)/ds at the step's end. Where a rate diverges at the limit, the last millionth of a life takes as many
// steps as the rest of it.
inline int64_t approaching_limit(const TerminationLimits& limits, const StepWorkspace& work, double pace,
                                 double margin) {
    for (int64_t v = 0; v < work.unknowns(); ++v) {
        const double limit = v > 0 ? limits.states[v - 1] : limits.strain, slope = work.last_slope(v);
        const double gap = limit - work.new_value[v];
        const bool faster = slope * gap > 0.0 && fabs(slope) > fabs(work.slopes[v]);
        if (isfinite(limit) && faster && fabs(gap) * pace < margin * fabs(slope)) return v;
    }
    return -1;
}

// Share of the step at which the first limit is passed, by bisection of the dense output.
inline double limit_crossing(const TerminationLimits& limits, const Tableau& tableau, const StepWorkspace& work,
                             double h) {
    constexpr int BISECTIONS = 60;
    double low = 0.0, high = 1.0;
    for (int k = 0; k < BISECTIONS; ++k) {
        const double middle = 0.5 * (low + high);
        bool beyond = work.dense(tableau, h, 0).at(middle) >= limits.strain;
        for (int64_t i = 0; i < work.states && !beyond; ++i) {
            beyond = limits.state_passed(i, work.dense(tableau, h, 1 + i).at(middle));
        }
        (beyond ? high : low) = middle;
    }
    return high;
}

// dv/d(ln t) of an unknown at the share x of the step.
inline double log_time_rate(const SegmentClock& clock, const DenseOutput& unknown, double s, double x) {
    const TimeAndPace now = clock.at(s + x * unknown.h);
    return unknown.slope(x) * now.time / now.pace;
}

// Derivatives (P,), into `change`, of the ln of the time at which unknown v has the value it has at x.
inline void log_time_sensitivity(const SegmentClock& clock, const Tableau& tableau, const StepWorkspace& work,
                                 double s, double h, double x, int64_t v, double* change) {
    dense_sensitivity(clock, tableau, work, s, h, x, v, change);
    const double rate = log_time_rate(clock, work.dense(tableau, h, v), s, x);
    for (int64_t p = 0; p < work.parameters; ++p) change[p] = -change[p] / rate;
}

// Share of the step, from `low` to `high`, at which a dense output that is below the level at `low` and not at `high`
// reaches it: Newton's method, by bisection where it leaves the bracket.
inline double level_crossing(const DenseOutput& output, double level, double low, double high) {
    constexpr int ITERATIONS = 60;
    constexpr double SMALLEST = 1e-15;  // last correction, over the place
    double x = 0.5 * (low + high);
    for (int k = 0; k < ITERATIONS; ++k) {
        const double miss = output.at(x) - level;
        (miss < 0.0 ? low : high) = x;
        const double next = x - miss / (output.h * output.slope(x));
        if (fabs(next - x) <= SMALLEST * x || high - low <= SMALLEST * high) break;
        x = next > low && next < high ? next : 0.5 * (low + high);
    }
    return x;
}

// Write the times of the levels reached within the step, up to its `share`; returns how many levels are reached.
inline int64_t locate_levels(const SegmentClock& clock, const Tableau& tableau, const StepWorkspace& work, double s,
                             double h, double share, const LevelEvents& arrivals, int64_t reached) {
    if (reached >= arrivals.count) return reached;
    const DenseOutput strain = work.dense(tableau, h, 0);
    const double end = strain.at(share);
    double x = 0.0;
    for (; reached < arrivals.count && arrivals.levels[reached] <= end; ++reached) {
        x = level_crossing(strain, arrivals.levels[reached], x, share);
        arrivals.times[reached] = clock.at(s + x * h).time;
        arrivals.slopes[reached] = log_time_rate(clock, strain, s, x);
        if (arrivals.changes) {
            log_time_sensitivity(clock, tableau, work, s, h, x, 0, arrivals.changes + reached * work.parameters);
        }
    }
    return reached;
}

}  // namespace creepkit
