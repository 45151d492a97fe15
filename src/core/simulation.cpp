// The simulation of a body for the vectors that this processor has; see lanes/simulation.cpp for its arguments.
#include "export.hpp"
#include "processor.hpp"

using Simulate = void(const void*, const void*, const void*, const void*, void*, const void*, void*, void*);
using Assemble = int64_t(const void*, const void*, const void*, const double*, const double*, double*, double*);

extern "C" {
Simulate creepkit_simulate_2;
Assemble creepkit_assemble_2;
#if defined(CREEPKIT_HAS_X86_LANES)
Simulate creepkit_simulate_4, creepkit_simulate_8;
Assemble creepkit_assemble_4, creepkit_assemble_8;
#endif
}

namespace {

template <class Function>
Function* for_this_processor(Function* two, [[maybe_unused]] Function* four, [[maybe_unused]] Function* eight) {
    const int64_t lanes = creepkit::chosen_lanes();
    return lanes == 8 ? eight : lanes == 4 ? four : two;
}

}  // namespace

#if defined(CREEPKIT_HAS_X86_LANES)
#define CREEPKIT_FOR_THIS_PROCESSOR(name) for_this_processor(name##_2, name##_4, name##_8)
#else
#define CREEPKIT_FOR_THIS_PROCESSOR(name) for_this_processor(name##_2, name##_2, name##_2)
#endif

CREEPKIT_API void creepkit_simulate(const void* model, const void* law, const void* input, const void* settings,
                                    void* record, const void* directions, void* derivatives, void* ended) {
    CREEPKIT_FOR_THIS_PROCESSOR(creepkit_simulate)(model, law, input, settings, record, directions, derivatives, ended);
}

CREEPKIT_API int64_t creepkit_assemble(const void* model, const void* law, const void* stage, const double* history,
                                       const double* displacement, double* residual, double* tangent) {
    return CREEPKIT_FOR_THIS_PROCESSOR(creepkit_assemble)(model, law, stage, history, displacement, residual, tangent);
}
