// The simulation of a finite element model, compiled once for each width of the processor's vectors.
#define CREEPKIT_JOIN_(a, b) a##b
#define CREEPKIT_JOIN(a, b) CREEPKIT_JOIN_(a, b)
// a namespace of its own for each width: no inline function compiled for one processor is linked in place of another
#define creepkit CREEPKIT_JOIN(creepkit_lanes_, CREEPKIT_LANES)

#include "../finite_element_sensitivities.hpp"
#include "../finite_elements.hpp"
#include "../sensitivities.hpp"
#include "../time_integration.hpp"

namespace creepkit {
namespace {

template <class Sensitivities>
Termination integrate(FiniteElements& system, const PointLaw& law, const SimulationInput& input,
                      const SolverSettings& settings, StepRecord& record, Sensitivities& sensitivities,
                      Workspace& memory) {
    TimeIntegration<FiniteElements, Sensitivities> integration(system, law, input, settings, record, sensitivities);
    const auto take = [&] {
        system.take(memory);
        integration.take(memory);
        if constexpr (!__is_same(Sensitivities, NoSensitivities)) sensitivities.take(memory, system, law);
    };
    take();
    if (!memory.allocate()) return {0, OUT_OF_MEMORY, 0.0};
    take();
    return integration.run();
}

}  // namespace
}  // namespace creepkit

// Simulate a body under its load history, with sensitivities unless `directions` is null.
extern "C" void CREEPKIT_JOIN(creepkit_simulate_, CREEPKIT_LANES)(
    const creepkit::FiniteElementModel* model, const creepkit::PointLaw* law, const creepkit::SimulationInput* input,
    const creepkit::SolverSettings* settings, creepkit::StepRecord* record,
    const creepkit::SensitivityDirections* directions, creepkit::SensitivityRecord* derivatives,
    creepkit::Termination* ended) {
    using namespace creepkit;
    Workspace memory;
    FiniteElements system(*model);
    if (directions) {
        StageSensitivities<FiniteElements> sensitivities(*law, *directions, *derivatives);
        *ended = integrate(system, *law, *input, *settings, *record, sensitivities, memory);
    } else {
        NoSensitivities none;
        *ended = integrate(system, *law, *input, *settings, *record, none, memory);
    }
}
