// Functions that are compiled once for each width of vectors, and the choice among them.
//
// A source in lanes/ gives a function the name LANE_FUNCTION(name): name_2, name_4 or name_8, with C linkage. Its
// caller declares and chooses them with
//
//     CREEPKIT_LANE_FUNCTIONS(name, result type, (parameters))
//     ... CHOOSE_LANE_FUNCTION(name)(arguments)
//
// Inline functions are compiled with each width's instructions too, and the linker must not take one for another:
// within lanes/ the namespace `creepkit` is therefore `creepkit_lanes_2` and so on, by a definition in CMakeLists.txt.
#pragma once

#include "processor.hpp"

#define CREEPKIT_JOINED(name, lanes) name##_##lanes
#define CREEPKIT_JOIN(name, lanes) CREEPKIT_JOINED(name, lanes)
#define LANE_FUNCTION(name) CREEPKIT_JOIN(name, CREEPKIT_LANES)

#if defined(CREEPKIT_HAS_X86_LANES)
#define CREEPKIT_LANE_FUNCTIONS(name, result, parameters) \
    extern "C" result name##_2 parameters;                \
    extern "C" result name##_4 parameters;                \
    extern "C" result name##_8 parameters
#define CHOOSE_LANE_FUNCTION(name) \
    (creepkit::chosen_lanes() == 8 ? name##_8 : creepkit::chosen_lanes() == 4 ? name##_4 : name##_2)
#else
#define CREEPKIT_LANE_FUNCTIONS(name, result, parameters) extern "C" result name##_2 parameters
#define CHOOSE_LANE_FUNCTION(name) (name##_2)
#endif
