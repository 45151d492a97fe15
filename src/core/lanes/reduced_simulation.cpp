// The simulation of a reduced-order model, compiled once for each width of the processor's vectors.
#define CREEPKIT_JOIN_(a, b) a##b
#define CREEPKIT_JOIN(a, b) CREEPKIT_JOIN_(a, b)
// a namespace of its own for each width: no inline function compiled for one processor is linked in place of another
#define creepkit CREEPKIT_JOIN(creepkit_lanes_, CREEPKIT_LANES)

#include "../reduced_order_model.hpp"
#include "../reduced_order_sensitivities.hpp"
#include "../run_simulation.hpp"

// Simulate a body under its load history, with sensitivities unless `directions` is null.
extern "C" void CREEPKIT_JOIN(creepkit_simulate_reduced_, CREEPKIT_LANES)(
    const creepkit::ReducedOrderModel* model, const creepkit::PointLaw* law, const creepkit::SimulationInput* input,
    const creepkit::SolverSettings* settings, creepkit::StepRecord* record,
    const creepkit::SensitivityDirections* directions, creepkit::SensitivityRecord* derivatives,
    creepkit::Termination* ended) {
    creepkit::ReducedOrderSystem system(*model);
    *ended = creepkit::simulate(system, *law, *input, *settings, *record, directions, derivatives);
}
