// What a simulation is asked for and what it leaves: settings, the accepted steps, and how it ended.
#pragma once

#include <stdint.h>

namespace creepkit {

// Codes of an ending; whatever it is, the history so far is kept.
enum Ending {
    REACHED_END,
    DEFLECTION_LIMIT,
    STRAIN_LIMIT,
    STATE_LIMIT,
    LIMIT_LOAD,
    LOST_CONVERGENCE,
    TOO_MANY_STEPS,
    LAW_FAILED,
    SINGULAR_TANGENT,
    OUT_OF_MEMORY
};

// How accurately, and how far, to simulate.
struct SolverSettings {
    double tolerance;         // estimated error of a step's displacements over (0.01 mm + the largest of them)
    double newton;            // last correction of equilibrium over the same
    double first;             // s, the first step after a change of load
    double growth;            // the time since then may grow by this factor in a step (and by `first`)
    double deflection_limit;  // mm, observed displacement at which the body has burst
    double strain_limit;      // creep strain at which a point has burst
    int64_t max_steps;        // cap on steps, accepted and rejected
    double least;             // mm, below which the size of displacements does not count in an error
};

// The body's load history and the law's states.
struct SimulationInput {
    double beta;             // exponent of the time transformation
    double poisson;          // Poisson's ratio
    int64_t segment_count;
    const double* segments;  // (segments, 10), see SegmentColumn
    const double* pattern;   // displacement of held nodes for a unit of motion, mm
    const double* initial;   // (S,) states at time zero
    const double* limits;    // (S,) at which a point has failed; infinite: none
    int64_t script_steps;
    const double* script;    // (steps, 2) positions of another simulation, to make the very same steps
};

// Accepted steps; row 0 is the body at rest. Null pointers: not wanted.
struct StepRecord {
    int64_t rows;           // capacity
    double* times;          // (rows,) s
    int64_t* segments;      // (rows,)
    double* displacements;  // (rows, displacements)
    double* values;         // (rows, points, V) creep components, equivalent creep strain, states
    double* mises;          // (rows, points) MPa
    double* places;         // (rows, 2) where a step began and its length, in its transformed time
    int64_t* counts;        // (4,) accepted and rejected steps, equilibrium passes with and without a new tangent
    int64_t points;         // written of each row of `values` and `mises`
    double* reactions;      // (rows,) N/rad, force of the controlled displacement
};

// Number of records, Ending, time s.
struct Termination {
    int64_t records, code;
    double time;
};

}  // namespace creepkit
