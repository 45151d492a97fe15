// The simulation of a finite element model, compiled once for each width of the processor's vectors.
#define CREEPKIT_JOIN_(a, b) a##b
#define CREEPKIT_JOIN(a, b) CREEPKIT_JOIN_(a, b)
// a namespace of its own for each width: no inline function compiled for one processor is linked in place of another
#define creepkit CREEPKIT_JOIN(creepkit_lanes_, CREEPKIT_LANES)

#include "../finite_element_sensitivities.hpp"
#include "../finite_elements.hpp"
#include "../run_simulation.hpp"

// Simulate a body under its load history, with sensitivities unless `directions` is null.
extern "C" void CREEPKIT_JOIN(creepkit_simulate_, CREEPKIT_LANES)(
    const creepkit::FiniteElementModel* model, const creepkit::PointLaw* law, const creepkit::SimulationInput* input,
    const creepkit::SolverSettings* settings, creepkit::StepRecord* record,
    const creepkit::SensitivityDirections* directions, creepkit::SensitivityRecord* derivatives,
    creepkit::Termination* ended) {
    creepkit::FiniteElements system(*model);
    *ended = creepkit::simulate(system, *law, *input, *settings, *record, directions, derivatives);
}
