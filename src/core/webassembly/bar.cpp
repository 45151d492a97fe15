// A bar, one history in one call.
#include "../point_integration.hpp"
#include "../workspace.hpp"
#include "law.hpp"

using namespace creepkit;

// Integrate a material point; see batch_integration.cpp for what the arrays hold.
//
// of_states : (2, states) initial values and limits. controls : stiffness, MPa, and load, 0 or 1.
// settings  : of IntegrationSettings, in its order. sizes : stages, degree, error order of the tableau; tableau : a, c,
//             error, dense.
// strain    : (times,) and values : (times, states), in: NaN. ended : (4,) out: code, time s, steps accepted, rejected.
// 0; or 1 when memory runs out, 2 when a count is out of range.
CREEPKIT_PAGE_API int32_t creepkit_page_bar(int32_t states, double beta, const double* of_states,
                                            const double* controls, int32_t segment_count, const double* segments,
                                            int32_t time_count, const double* times, const double* settings,
                                            const int32_t* sizes, const double* tableau, double* strain,
                                            double* values, double* ended) {
    const int64_t stages = sizes[0];
    const double *c = tableau + stages * stages, *error = c + stages;
    const Tableau method = {stages, sizes[1], sizes[2], tableau, c, error, error + stages};
    if (!method.valid()) return 2;
    Workspace memory;
    StepWorkspace(memory, states, 0, stages);
    if (!memory.allocate()) return 1;
    StepWorkspace work(memory, states, 0, stages);
    const IntegrationSettings given = {settings[0], settings[1], settings[2], settings[3], settings[4],
                                       int64_t(settings[5])};
    const Candidate candidate = {{page_law, nullptr, nullptr}, beta, {given.strain_limit, of_states, of_states + states}};
    const PointTest test = {{controls[0], controls[1], UNIAXIAL}, segment_count, time_count, segments, times};
    const PointRecord record = {strain, values, nullptr, {}, nullptr};
    const SlopePredictor predictor(method);
    const IntegrationProgress progress = PointIntegration{candidate, test, record, given, method, predictor, work}.run();
    ended[0] = double(progress.code);
    ended[1] = progress.time;
    ended[2] = double(progress.steps);
    ended[3] = double(progress.rejected);
    return 0;
}
