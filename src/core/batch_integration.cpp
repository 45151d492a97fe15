// Integration of many candidates over many tests in one call.
#include <stdint.h>

#include "export.hpp"
#include "point_integration.hpp"
#include "workspace.hpp"

namespace creepkit {

// The call, mirrored field by field by creepkit.integration.batch_integration. C candidates, K tests, P parameters, S
// states, F output times of all tests together, L levels of all tests together; tests are laid end to end.
struct BatchIntegration {
    LawEntry update, sensitivity;  // of the law
    int64_t candidates, tests, parameters, states;
    int64_t with_sensitivities;      // whether derivatives to the parameters are wanted
    const double* theta;             // (C, P) internal parameters
    const double* beta;              // (C,) leading exponents of time
    const double* initial;           // (S,) states at time zero
    const double* limits;            // (S,) values at which the point has failed, inf for none
    const double* back_stresses;     // (S,) 1 of states that are back stresses of a bar, else 0; null where none is
    const double* stress_controls;   // (K, 2) stiffness, MPa, and load, 0 or 1
    const double* segments;          // (segments, 6) start, end, s; driving stress at both, MPa; temperature at both, K
    const int64_t* segment_offsets;  // (K + 1,)
    const double* times;             // (F,) s
    const int64_t* time_offsets;     // (K + 1,)
    const double* levels;            // (L,) creep strains
    const int64_t* level_offsets;    // (K + 1,)
    Axes axes;
    IntegrationSettings settings;
    Tableau tableau;
    double* strain;            // (C, F) in: NaN; of a bar axial creep strain
    double* path;              // (C, F) in: NaN; equivalent creep strain, null unless wanted
    double* values;            // (C, F, S) in: NaN; internal variables at the output times, null unless wanted
    double* jacobian;          // (C, F, P) in: NaN; this and the other derivatives null unless wanted
    int64_t* endings;          // (C, K) codes of event_location.hpp
    double* end_times;         // (C, K) s
    int64_t* steps;            // (C, K, 2) accepted and rejected
    double* end_jacobian;      // (C, K, P) in: NaN
    double* arrivals;          // (C, L) in: NaN
    double* arrival_slopes;    // (C, L) in: NaN
    double* arrival_jacobian;  // (C, L, P) in: NaN
};

enum BatchResult { BATCH_DONE, BATCH_OUT_OF_MEMORY, BATCH_NOT_VALID };

}  // namespace creepkit

using namespace creepkit;

// 0; or 1 when memory runs out, 2 when a count is out of range.
CREEPKIT_API int64_t creepkit_integrate_batch(const BatchIntegration* batch) {
    if (!batch->tableau.valid() || batch->states < 0 || batch->states > MAX_STATES || batch->parameters < 0) {
        return BATCH_NOT_VALID;
    }
    const int64_t P = batch->parameters, K = batch->tests;
    Workspace memory;
    StepWorkspace(memory, batch->states, P, batch->tableau.stages);
    if (!memory.allocate()) return BATCH_OUT_OF_MEMORY;
    StepWorkspace work(memory, batch->states, P, batch->tableau.stages);
    work.back = {batch->back_stresses};
    const int64_t F = batch->time_offsets[K], L = batch->level_offsets[K];
    const SlopePredictor predictor(batch->tableau);
    const bool exact = batch->with_sensitivities != 0;
    for (int64_t c = 0; c < batch->candidates; ++c) {
        const Candidate candidate = {{batch->update, batch->sensitivity, batch->theta + c * P},
                                     batch->beta[c],
                                     {batch->settings.strain_limit, batch->initial, batch->limits}};
        for (int64_t k = 0; k < K; ++k) {
            const int64_t time = batch->time_offsets[k], level = batch->level_offsets[k];
            const int64_t segment = batch->segment_offsets[k];
            const PointTest test = {{batch->stress_controls[2 * k], batch->stress_controls[2 * k + 1], batch->axes},
                                    batch->segment_offsets[k + 1] - segment,
                                    batch->time_offsets[k + 1] - time,
                                    batch->segments + 6 * segment,
                                    batch->times + time};
            const int64_t S = batch->states;
            const PointRecord record = {batch->strain + c * F + time,
                                        batch->values ? batch->values + (c * F + time) * S : nullptr,
                                        exact ? batch->jacobian + (c * F + time) * P : nullptr,
                                        {batch->level_offsets[k + 1] - level, batch->levels + level,
                                         batch->arrivals + c * L + level, batch->arrival_slopes + c * L + level,
                                         exact ? batch->arrival_jacobian + (c * L + level) * P : nullptr,
                                         exact ? batch->end_jacobian + (c * K + k) * P : nullptr},
                                        batch->path ? batch->path + c * F + time : nullptr};
            const PointIntegration integration = {candidate, test, record, batch->settings, batch->tableau,
                                                  predictor, work};
            const IntegrationProgress progress = integration.run();
            batch->endings[c * K + k] = progress.code;
            batch->end_times[c * K + k] = progress.time;
            batch->steps[(c * K + k) * 2] = progress.steps;
            batch->steps[(c * K + k) * 2 + 1] = progress.rejected;
        }
    }
    return BATCH_DONE;
}
