// Integration of one model of fibres, and single steps of fibres of which the strains are given, for Python.
#include <stdint.h>

#include "export.hpp"
#include "fibre_integration.hpp"

namespace creepkit {

// The call, mirrored field by field by creepkit.integration.fibre_structures.
struct FibreCall {
    LawEntry update, sensitivity;
    int64_t states, parameters, with_sensitivities, follows_stress, segment_count, time_count;
    const double *theta, *initial, *limits, *segments, *times;
    double beta;
    FibreModel model;
    IntegrationSettings settings;
    Tableau tableau;
    double *recorded, *jacobian;  // (times, rows), (times, rows, P + A), in: NaN
    int64_t ending, steps, rejected;
    double end_time;
};

// Single steps, mirrored by the same: m fibres whose strains change in `length` s from `time` on.
struct FibreStep {
    LawEntry update;
    int64_t fibres, states;
    const double* theta;
    const double *strain, *creep, *path, *state;        // (m,), (m,), (m,), (m, S) total strain after, the rest before
    double time, length, temperature, modulus;          // time and temperature at the end of the step
    double *stress, *tangent, *new_creep, *new_path, *new_state;
};

enum FibreResult { FIBRES_DONE, FIBRES_OUT_OF_MEMORY, FIBRES_NOT_VALID };

}  // namespace creepkit

using namespace creepkit;

// 0; or 1 when memory runs out, 2 when a count is out of range.
CREEPKIT_API int64_t creepkit_integrate_fibres(FibreCall* call) {
    const FibreModel& model = call->model;
    const bool valid = call->tableau.valid() && call->states >= 0 && call->states <= MAX_STATES &&
                       call->parameters >= 0 && model.fibres >= 1 && model.modes >= 0 && model.loads >= 0 &&
                       model.loads <= MAX_LOADS && model.rows >= 0 && model.inputs >= 0;
    if (!valid) return FIBRES_NOT_VALID;
    const bool exact = call->with_sensitivities != 0;
    Workspace memory;
    FibreWorkspace(memory, model, call->states, call->parameters, call->tableau.stages, exact);
    if (!memory.allocate()) return FIBRES_OUT_OF_MEMORY;
    FibreWorkspace work(memory, model, call->states, call->parameters, call->tableau.stages, exact);
    const Candidate candidate = {{call->update, call->sensitivity, call->theta},
                                 call->beta,
                                 {call->settings.strain_limit, call->initial, call->limits}};
    const FibreTest test = {call->segment_count, call->time_count, call->segments, call->times,
                            call->follows_stress != 0};
    const FibreRecord record = {call->recorded, exact ? call->jacobian : nullptr};
    const SlopePredictor predictor(call->tableau);
    const FibreIntegration integration = {candidate, model, test, record, call->settings, call->tableau, predictor,
                                          work};
    const IntegrationProgress progress = integration.run();
    call->ending = progress.code;
    call->steps = progress.steps;
    call->rejected = progress.rejected;
    call->end_time = progress.time;
    return FIBRES_DONE;
}

// The number of fibres solved: all of them, or the index of the first without a solution; -1 when memory runs out.
CREEPKIT_API int64_t creepkit_step_fibres(const FibreStep* step) {
    FibreModel sized = {};
    sized.fibres = step->fibres;
    const int64_t S = step->states, U = 2 + S;
    Workspace memory;
    FibreWorkspace(memory, sized, S, 0, 1, false);
    if (!memory.allocate()) return -1;
    FibreWorkspace work(memory, sized, S, 0, 1, false);
    const LawCall law = {step->update, nullptr, step->theta};
    const FibreStage now = {step->time, step->length, 1.0, step->temperature, step->modulus, {}};
    for (int64_t i = 0; i < step->fibres; ++i) {
        double* base = work.base + i * U;
        base[0] = step->creep[i];
        base[1] = step->path[i];
        for (int64_t j = 0; j < S; ++j) {
            base[2 + j] = work.rows[i * work.width + POINT_SIZE + j] = step->state[i * S + j];
        }
        work.increment[i] = 1e-6;
        const double trial = step->modulus * (step->strain[i] - step->creep[i]);
        if (!solve_fibre(law, now, work, i, trial, {1e-8, 0.0})) return i;
        step->stress[i] = work.sign[i] * work.stress[i];
        step->tangent[i] = step->modulus * (1.0 - step->modulus * work.tangent[i]);
        step->new_creep[i] = base[0] + work.sign[i] * work.increment[i];
        step->new_path[i] = base[1] + work.increment[i];
        for (int64_t j = 0; j < S; ++j) step->new_state[i * S + j] = work.rows[i * work.width + POINT_SIZE + j];
    }
    return step->fibres;
}
