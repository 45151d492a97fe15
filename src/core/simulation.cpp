// Simulations in finite elements and in reduced-order models, for the vectors that this processor has; the files of
// lanes/ describe the arguments.
#include "export.hpp"
#include "lane_functions.hpp"

CREEPKIT_LANE_FUNCTIONS(creepkit_simulate, void,
                        (const void*, const void*, const void*, const void*, void*, const void*, void*, void*));
CREEPKIT_LANE_FUNCTIONS(creepkit_simulate_reduced, void,
                        (const void*, const void*, const void*, const void*, void*, const void*, void*, void*));
CREEPKIT_LANE_FUNCTIONS(creepkit_assemble, int64_t,
                        (const void*, const void*, const void*, const double*, const double*, double*, double*));

CREEPKIT_LANE_FUNCTIONS(creepkit_repeat_part, int64_t,
                        (const void*, const void*, const void*, const double*, const double*, int64_t, int64_t));

CREEPKIT_API void creepkit_simulate(const void* model, const void* law, const void* input, const void* settings,
                                    void* record, const void* directions, void* derivatives, void* ended) {
    CHOOSE_LANE_FUNCTION(creepkit_simulate)(model, law, input, settings, record, directions, derivatives, ended);
}

CREEPKIT_API void creepkit_simulate_reduced(const void* model, const void* law, const void* input,
                                            const void* settings, void* record, const void* directions,
                                            void* derivatives, void* ended) {
    CHOOSE_LANE_FUNCTION(creepkit_simulate_reduced)
    (model, law, input, settings, record, directions, derivatives, ended);
}

CREEPKIT_API int64_t creepkit_assemble(const void* model, const void* law, const void* stage, const double* history,
                                       const double* displacement, double* residual, double* tangent) {
    return CHOOSE_LANE_FUNCTION(creepkit_assemble)(model, law, stage, history, displacement, residual, tangent);
}

CREEPKIT_API int64_t creepkit_repeat_part(const void* model, const void* law, const void* stage, const double* history,
                                          const double* displacement, int64_t part, int64_t repeats) {
    return CHOOSE_LANE_FUNCTION(creepkit_repeat_part)(model, law, stage, history, displacement, part, repeats);
}
