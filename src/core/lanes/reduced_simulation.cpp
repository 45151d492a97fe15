// The simulation of a reduced-order model, compiled once for each width of the processor's vectors.
#include "../lane_functions.hpp"
#include "../reduced_order_model.hpp"
#include "../reduced_order_sensitivities.hpp"
#include "../run_simulation.hpp"

// Simulate a body under its load history, with sensitivities unless `directions` is null.
extern "C" void LANE_FUNCTION(creepkit_simulate_reduced)(
    const creepkit::ReducedOrderModel* model, const creepkit::PointLaw* law, const creepkit::SimulationInput* input,
    const creepkit::SolverSettings* settings, creepkit::StepRecord* record,
    const creepkit::SensitivityDirections* directions, creepkit::SensitivityRecord* derivatives,
    creepkit::Termination* ended) {
    creepkit::ReducedOrderSystem system(*model);
    *ended = creepkit::simulate(system, *law, *input, *settings, *record, directions, derivatives);
}
