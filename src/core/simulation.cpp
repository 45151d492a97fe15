// The simulation of a body, in finite elements or in a reduced-order model, for the vectors that this processor has;
// see lanes/simulation.cpp for its arguments.
#include "export.hpp"
#include "processor.hpp"

using Simulate = void(const void*, const void*, const void*, const void*, void*, const void*, void*, void*);

extern "C" {
Simulate creepkit_simulate_2, creepkit_simulate_reduced_2;
#if defined(CREEPKIT_HAS_X86_LANES)
Simulate creepkit_simulate_4, creepkit_simulate_8, creepkit_simulate_reduced_4, creepkit_simulate_reduced_8;
#endif
}

CREEPKIT_API void creepkit_simulate(const void* model, const void* law, const void* input, const void* settings,
                                    void* record, const void* directions, void* derivatives, void* ended) {
    Simulate* simulate = creepkit_simulate_2;
#if defined(CREEPKIT_HAS_X86_LANES)
    const int64_t lanes = creepkit::chosen_lanes();
    simulate = lanes == 8 ? creepkit_simulate_8 : lanes == 4 ? creepkit_simulate_4 : creepkit_simulate_2;
#endif
    simulate(model, law, input, settings, record, directions, derivatives, ended);
}

CREEPKIT_API void creepkit_simulate_reduced(const void* model, const void* law, const void* input,
                                            const void* settings, void* record, const void* directions,
                                            void* derivatives, void* ended) {
    Simulate* simulate = creepkit_simulate_reduced_2;
#if defined(CREEPKIT_HAS_X86_LANES)
    const int64_t lanes = creepkit::chosen_lanes();
    simulate = lanes == 8   ? creepkit_simulate_reduced_8
               : lanes == 4 ? creepkit_simulate_reduced_4
                            : creepkit_simulate_reduced_2;
#endif
    simulate(model, law, input, settings, record, directions, derivatives, ended);
}
