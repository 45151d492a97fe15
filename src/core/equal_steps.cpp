// Integration in equal steps of plain time, without control of their error: what shows the order of a method.
#include <math.h>
#include <stdint.h>

#include "export.hpp"
#include "runge_kutta_step.hpp"
#include "workspace.hpp"

using namespace creepkit;

// A point under uniaxial stress, of a law without states, from `strain` at the start of a segment to its end.
//
// segment   : (6,) start, end, s; driving stress at both, MPa; temperature at both, K
// tolerance : of Newton's method in every stage
// share     : of the first step, where its dense output is asked for
// out       : (2,) strain at the end, and the dense output
// Flag of a stage that has no solution, else 0; -1 when memory runs out.
CREEPKIT_API int64_t creepkit_integrate_in_equal_steps(LawEntry update, const double* theta, const Tableau* tableau,
                                                       const double* segment, double strain, int64_t steps,
                                                       double tolerance, double share, double* out) {
    Workspace memory;
    StepWorkspace(memory, 0, 0, tableau->stages);
    if (!memory.allocate()) return -1;
    StepWorkspace work(memory, 0, 0, tableau->stages);
    const Segment load(segment);
    const SegmentClock clock(linear_time(load.start, load.end - load.start));
    const SlopePredictor predictor(*tableau);
    const StepStart start = {NAN, 0.0, tolerance, 0.0};
    const double h = 1.0 / double(steps);
    work.value[0] = strain;
    for (int64_t k = 0; k < steps; ++k) {
        const int64_t flag = advance({update, nullptr, theta}, {0.0, 0.0, UNIAXIAL}, load, clock, *tableau, predictor,
                                     work, double(k) * h, h, start);
        if (flag != SOLVED) return flag;
        if (k == 0) out[1] = work.dense(*tableau, h, 0).at(share);
        work.value[0] = work.new_value[0];
    }
    out[0] = work.value[0];
    return 0;
}
