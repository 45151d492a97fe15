// Which interface a library has, so that a stale one is noticed.
#include "export.hpp"

CREEPKIT_API int64_t creepkit_core_version() { return 11; }
