// How many numbers of double the vectors hold that the core calculates with on this processor.
#pragma once

#include <stdint.h>

namespace creepkit {

// Of those that the core is compiled for, the most that the processor has: 8 with AVX-512 F, DQ and VL, 4 with AVX2 and
// FMA, else 2.
int64_t processor_lanes();

// Those of the processor, or the fewer that the environment variable CREEPKIT_LANES asks for: 2, 4 or 8.
int64_t chosen_lanes();

}  // namespace creepkit
