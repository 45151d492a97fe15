// Values of the accepted steps at other times, for Python.
#include "time_interpolation.hpp"

#include "export.hpp"

// values: (steps, columns). asked: (count,) s. out: (count, columns). Returns an InterpolationError.
CREEPKIT_API int64_t creepkit_interpolate_in_time(int64_t steps, int64_t segments, const double* times,
                                                  const double* starts, const int64_t* rows, const double* origins,
                                                  const double* exponents, int64_t columns, const double* values,
                                                  int64_t count, const double* asked, double* out) {
    using namespace creepkit;
    if (steps < 1 || segments < 1 || columns < 0 || count < 0) return BAD_COUNTS;
    Workspace memory;
    spline_workspace(memory, steps, columns);
    if (!memory.allocate()) return NO_MEMORY;
    const SplineWorkspace spline = spline_workspace(memory, steps, columns);
    return interpolate_in_time({steps, segments, times, starts, rows, origins, exponents}, spline, columns, values,
                               count, asked, out);
}
