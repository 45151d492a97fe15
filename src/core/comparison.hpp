// Comparisons whose answer to NaN is stated, and which compile to one instruction.
#pragma once

#include <math.h>

namespace creepkit {

// The larger, the smaller of two numbers; the first when the second is NaN.
inline double larger(double a, double b) { return b > a ? b : a; }
inline double smaller(double a, double b) { return b < a ? b : a; }

// The larger of two errors; NaN when one of them is.
inline double worse(double a, double b) { return isnan(a) || b <= a ? a : b; }

}  // namespace creepkit
