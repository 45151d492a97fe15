// The simulation of a finite element model, compiled once for each width of the processor's vectors.
#include "../finite_element_sensitivities.hpp"
#include "../finite_elements.hpp"
#include "../lane_functions.hpp"
#include "../run_simulation.hpp"

// Simulate a body under its load history, with sensitivities unless `directions` is null.
extern "C" void LANE_FUNCTION(creepkit_simulate)(
    const creepkit::FiniteElementModel* model, const creepkit::PointLaw* law, const creepkit::SimulationInput* input,
    const creepkit::SolverSettings* settings, creepkit::StepRecord* record,
    const creepkit::SensitivityDirections* directions, creepkit::SensitivityRecord* derivatives,
    creepkit::Termination* ended) {
    creepkit::FiniteElements system(*model);
    *ended = creepkit::simulate(system, *law, *input, *settings, *record, directions, derivatives);
}

// Out-of-balance forces (size,) and, unless null, the tangent made symmetric (size, size), of given displacements.
//
// history : (points, 4 + S) creep components, equivalent creep strain and states at the start of the stage. Returns a
// PointFlag, or -1 when there is no memory.
extern "C" int64_t LANE_FUNCTION(creepkit_assemble)(
    const creepkit::FiniteElementModel* model, const creepkit::PointLaw* law, const creepkit::StageConditions* stage,
    const double* history, const double* displacement, double* residual, double* tangent) {
    using namespace creepkit;
    Workspace memory;
    FiniteElements system(*model);
    PointStates points;
    const auto take = [&] {
        system.take(memory);
        points.take(memory, system.point_count(), law->states);
    };
    take();
    if (!memory.allocate()) return -1;
    take();
    for (int64_t k = 0; k < points.count; ++k) {
        points.trials[k] = -1.0;
        for (int64_t v = 0; v < points.values; ++v) points.base[v * points.count + k] = history[k * points.values + v];
        for (int64_t i = 0; i < points.states; ++i)
            points.state[i * points.count + k] = history[k * points.values + EQUIVALENT_STRAIN + 1 + i];
    }
    const PointFlag flag = system.assemble<true>(*law, *stage, displacement, points, 1e-9);
    if (flag != POINTS_SOLVED) return flag;
    memcpy(residual, system.residual, sizeof(double) * size_t(model->size));
    for (int64_t i = 0; tangent && i < model->size; ++i)
        for (int64_t j = 0; j <= i; ++j) {
            const bool inside = system.shape.first[i / EIGHT] <= j / EIGHT;
            tangent[i * model->size + j] = tangent[j * model->size + i] =
                inside ? system.tangent[system.shape.place(i, j)] : 0.0;
        }
    if (tangent && model->bordered >= 0) system.copy_border(tangent);
    return flag;
}
