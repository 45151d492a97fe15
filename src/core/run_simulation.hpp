// One simulation of a system: its memory, its time integration, its ending.
#pragma once

#include "sensitivities.hpp"
#include "time_integration.hpp"

namespace creepkit {

template <class System, class Sensitivities>
Termination integrate(System& system, const PointLaw& law, const SimulationInput& input, const SolverSettings& settings,
                      StepRecord& record, Sensitivities& sensitivities) {
    Workspace memory;
    TimeIntegration<System, Sensitivities> integration(system, law, input, settings, record, sensitivities);
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

// Simulate a system under its load history, with sensitivities unless `directions` is null.
template <class System>
Termination simulate(System& system, const PointLaw& law, const SimulationInput& input, const SolverSettings& settings,
                     StepRecord& record, const SensitivityDirections* directions, SensitivityRecord* derivatives) {
    if (directions) {
        StageSensitivities<System> sensitivities(law, *directions, *derivatives);
        return integrate(system, law, input, settings, record, sensitivities);
    }
    NoSensitivities none;
    return integrate(system, law, input, settings, record, none);
}

}  // namespace creepkit
