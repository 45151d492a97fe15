// The fit of Gaussians, for one width of vectors.
#include "gaussian_fit.hpp"

#include "lane_functions.hpp"

// As `fit_frames`; false without memory.
extern "C" bool LANE_FUNCTION(creepkit_fit_frames)(const int64_t* counts, const double* places, int64_t frames,
                                                   const double* samples, double* fits, int64_t* states,
                                                   double* derivatives) {
    using namespace creepkit;
    Workspace memory;
    fit_workspace(memory, counts[0]);
    if (!memory.allocate()) return false;
    fit_frames(counts, places, fit_workspace(memory, counts[0]), frames, samples, fits, states, derivatives);
    return true;
}
