// A law that is a function of JavaScript, as the core calls laws (law.hpp).
#pragma once

#include "../law.hpp"

#define CREEPKIT_PAGE_API extern "C" __attribute__((visibility("default")))

namespace creepkit {

// The update of the law at hand; `theta` is not read, for the function of JavaScript has its parameters.
int64_t page_law(int64_t rows, const double* x, const double* theta, double* out);

}  // namespace creepkit
