// The simulation of a reduced-order model, without derivatives.
#include "../reduced_order_model.hpp"
#include "../run_simulation.hpp"
#include "law.hpp"

using namespace creepkit;

// Simulate a body. counts : modes, points, side points, observed, limited, measured of ReducedOrderModel, then states,
// segments, rows of the record. arrays of the model in its order, but for points_first, which is written here.
// of_law    : beta, Poisson's ratio. settings : of SolverSettings, in its order.
// rows      : times (rows,), numbers of segments (rows,), coordinates (rows, R), places (rows, 2). ended : (5,) out: rows written, code,
//             time s, accepted and rejected steps. 0, or 1 when memory runs out.
CREEPKIT_PAGE_API int32_t creepkit_page_simulate(const int32_t* counts, const double* gradients, double* points_first,
                                                 const double* weights, const double* factors, const double* sides,
                                                 const double* side_modes, const double* surface,
                                                 const double* measures, const double* of_law,
                                                 const double* of_states, const double* segments,
                                                 const double* settings, double* times, int64_t* numbers,
                                                 double* coordinates, double* places, double* ended) {
    const int64_t modes = counts[0], points = counts[1], states = counts[6], width = (modes + 7) / 8 * 8;
    for (int64_t k = 0; k < points; ++k)
        for (int64_t part = 0; part < 5; ++part)
            for (int64_t i = 0; i < modes; ++i)
                points_first[((k / 8 * modes + i) * 5 + part) * 8 + k % 8] = gradients[(k * 5 + part) * width + i];
    const ReducedOrderModel model = {modes, points, counts[2], counts[3], counts[4], counts[5], gradients,
                                     points_first, weights, factors, sides, side_modes, surface, measures};
    const PointLaw law = {page_law, nullptr, nullptr, 0, states};
    const SimulationInput input = {of_law[0], of_law[1], counts[7], segments, nullptr, of_states, of_states + states,
                                   0, nullptr};
    const SolverSettings given = {settings[0], settings[1], settings[2], settings[3], settings[4], settings[5],
                                  int64_t(settings[6]), settings[7]};
    int64_t passes[4] = {};
    StepRecord record = {counts[8], times, numbers, coordinates, nullptr, nullptr, places, passes, points, nullptr};
    ReducedOrderSystem system(model);
    NoSensitivities none;
    const Termination end = integrate(system, law, input, given, record, none);
    ended[0] = double(end.records);
    ended[1] = double(end.code);
    ended[2] = end.time;
    ended[3] = double(passes[0]);
    ended[4] = double(passes[1]);
    return end.code == OUT_OF_MEMORY;
}
