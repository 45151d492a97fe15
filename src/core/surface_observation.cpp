// What is observed of profiles, for Python.
#include "surface_observation.hpp"

#include "export.hpp"

using namespace creepkit;

// Observe profiles (frames, nodes), mm; the surface as SurfaceObservation describes it. outputs: (frames, 3) D mm, S
// mm, p. to_radii: (frames, 3, radii) their derivatives to the displacements at the radii of the grid; null: left out.
// Returns an InterpolationError.
CREEPKIT_API int64_t creepkit_observe(const int64_t* counts, const double* places, const double* interpolation,
                                      double window, int64_t frames, const double* profiles, double* outputs,
                                      double* to_radii) {
    const SurfaceObservation surface{counts, places, interpolation, window};
    if (!surface.is_valid() || frames < 0) return BAD_COUNTS;
    Workspace memory;
    observation_workspace(memory, surface, frames, false);
    if (!memory.allocate()) return NO_MEMORY;
    return observe_profiles(surface, frames, profiles, observation_workspace(memory, surface, frames, false), outputs,
                            to_radii);
}

// Observe profiles (steps, nodes), mm, of accepted steps, as `creepkit_interpolate_in_time` takes them, at the times
// asked (count,) s: outputs (count, 3) and, with columns > 0, derivatives (count, 3, columns) from those of the
// profiles, changes (steps, nodes, columns). Returns an InterpolationError.
CREEPKIT_API int64_t creepkit_observe_at_times(const int64_t* counts, const double* places, const double* interpolation,
                                               double window, int64_t steps, int64_t segments, const double* times,
                                               const double* starts, const int64_t* rows, const double* origins,
                                               const double* exponents, const double* profiles, int64_t columns,
                                               const double* changes, int64_t count, const double* asked,
                                               double* outputs, double* derivatives) {
    const SurfaceObservation surface{counts, places, interpolation, window};
    if (!surface.is_valid() || steps < 1 || segments < 1 || columns < 0 || count < 0) return BAD_COUNTS;
    Workspace memory;
    timed_observation_workspace(memory, surface, steps, columns);
    if (!memory.allocate()) return NO_MEMORY;
    const TimedObservationWorkspace work = timed_observation_workspace(memory, surface, steps, columns);
    return observe_at_times(surface, {steps, segments, times, starts, rows, origins, exponents}, profiles, columns,
                            changes, count, asked, work, outputs, derivatives);
}
