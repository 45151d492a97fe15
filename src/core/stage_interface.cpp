// Single stages and time transformations for Python: tests, and whoever wants to look at one.
#include <stdint.h>

#include "export.hpp"
#include "stage_problem.hpp"
#include "stage_solver.hpp"
#include "time_transformation.hpp"
#include "workspace.hpp"

namespace creepkit {

// A stage and the axes of its stress, as Python hands them over.
struct StageOfPython {
    StageProblem problem;
    Axes axes;
};

}  // namespace creepkit

using namespace creepkit;

// Flag of the stage; row (6 + S,) goes in and out, increment comes out. -1 when memory runs out.
CREEPKIT_API int64_t creepkit_solve_stage(LawEntry update, const double* theta, const StageOfPython* stage,
                                          const double* states, int64_t state_count, double* row, double guess,
                                          double tolerance, double* increment) {
    Workspace memory;
    memory.doubles((1 + state_count) * (7 + state_count));
    if (!memory.allocate()) return -1;
    double* out = memory.doubles((1 + state_count) * (7 + state_count));
    const StageSolution solution = solve_stage(update, theta, stage->axes, stage->problem, states, state_count, row,
                                               out, guess, tolerance);
    *increment = solution.increment;
    return solution.flag;
}

// Derivatives at a solution `row`, (6 + S,); entry is the law's sensitivity, or its update with no parameters.
//
// response : (1 + S, 7 + S + parameters). 1; 0 when the stage is singular, -1 when memory runs out.
CREEPKIT_API int64_t creepkit_differentiate_stage(LawEntry entry, const double* theta, const StageOfPython* stage,
                                                  const double* row, int64_t states, int64_t parameters,
                                                  double increment, double* response) {
    const int64_t size = 1 + states, width = POINT_SIZE + states, columns = INPUTS + states + parameters;
    Workspace memory;
    memory.doubles(size * (1 + width + parameters));
    memory.doubles(size * width);
    memory.doubles(size * size);
    if (!memory.allocate()) return -1;
    double* full = memory.doubles(size * (1 + width + parameters));
    double* gradient = memory.doubles(size * width);
    double* matrix = memory.doubles(size * size);
    entry(1, row, theta, full);
    if (parameters == 0) {
        gradient_of_update(full, stage->problem, increment, gradient, states);
    } else {
        gradient_of_sensitivity(full, stage->problem, increment, gradient, states);
    }
    const double* by_parameter = full + size + size * width;
    for (int64_t v = 0; v < size; ++v) {
        for (int64_t p = 0; p < parameters; ++p) {
            response[v * columns + INPUTS + states + p] = stage->problem.weight * by_parameter[v * parameters + p];
        }
    }
    return differentiate_stage(stage->axes, stage->problem, increment, row[STRESS], full + 1, gradient, matrix,
                               response, states, parameters);
}

// A time transformation at positions s, (count,) above 0, for Python: out (count, 7) is time, s, and ln(dt/ds) there,
// their derivatives to beta and then to tau, and the position of that time.
CREEPKIT_API void creepkit_transformed_times(const TimeTransformation* clock, int64_t count, const double* s,
                                             double* out) {
    const SegmentClock segment_clock(*clock);
    for (int64_t k = 0; k < count; ++k) {
        const TimeAndPace now = segment_clock.at(s[k]);
        const TransformationDerivatives moved = segment_clock.derivatives(s[k], now);
        const double row[7] = {now.time,
                               log(now.pace),
                               moved.by_beta.time,
                               moved.by_beta.log_pace,
                               moved.by_tau.time,
                               moved.by_tau.log_pace,
                               segment_clock.position(now.time)};
        for (int64_t j = 0; j < 7; ++j) out[7 * k + j] = row[j];
    }
}

// The transformation of a segment that begins after some creep, (4,) start, length, beta, tau, from r in p'' = r p' and
// the rate of r; and from a virgin state, with beta the leading exponent of time.
CREEPKIT_API void creepkit_shifted_power_law_time(double start, double length, double bend, double bend_rate,
                                                  TimeTransformation* clock) {
    *clock = shifted_power_law_time(start, length, bend, bend_rate);
}

CREEPKIT_API void creepkit_power_law_time(double start, double length, double beta, TimeTransformation* clock) {
    *clock = power_law_time(start, length, beta);
}
