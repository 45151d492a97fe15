// A creep law as the core sees it: three C functions that creepkit.kernels compiles from the law's equations.
//
//     flags = entry(rows, x, theta, out)        rows is 1 or LAW_ROWS
//
// With S states and P parameters:
// x     : (6 + S, rows)  stress MPa, strain, time s, temperature K, largest principal and mean stress MPa, the states
// theta : (P,)           internal parameters, the natural logarithm where the scale is log; -inf switches a term off
// out   : (columns, rows)
//     rate         1 + S                      rate 1/s, then the rates of the states
//     update       (1 + S) (1 + 6 + S)        [ln rate, rates of the states], then their derivatives to x, row by row
//     sensitivity  (1 + S) (1 + 6 + S + P)    [rate, rates of the states], then derivatives to x, then to theta
// Flags add up: 1 a rate is not finite, 2 a derivative is not finite.
#pragma once

#include <stdint.h>

namespace creepkit {

using LawEntry = int64_t (*)(int64_t rows, const double* x, const double* theta, double* out);

constexpr int LAW_ROWS = 8;  // points of one call, beside single ones

enum LawInput { STRESS, STRAIN, TIME, TEMPERATURE, PRINCIPAL_STRESS, MEAN_STRESS, POINT_SIZE };

}  // namespace creepkit
