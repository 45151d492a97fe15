// Which width of vectors the core uses on this processor.
#include "processor.hpp"

#include "export.hpp"

CREEPKIT_API int64_t creepkit_core_lanes() { return creepkit::chosen_lanes(); }
