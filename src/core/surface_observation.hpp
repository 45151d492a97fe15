// What is observed of a surface: amplitude D in mm, width S in mm and shape p of a generalised Gaussian fitted to its
// profile within a window.
#pragma once

#include <math.h>
#include <stdint.h>

#include "gaussian_fit.hpp"
#include "lane_functions.hpp"
#include "time_interpolation.hpp"
#include "workspace.hpp"

CREEPKIT_LANE_FUNCTIONS(creepkit_fit_frames, bool,
                        (const int64_t* counts, const double* places, int64_t frames, const double* samples,
                         double* fits, int64_t* states, double* derivatives));

namespace creepkit {

constexpr int OBSERVED = 3;  // D, S, p

// What observes a surface. counts: (3,) radii and angles of the grid, nodes of the surface. places: of the grid, as
// `fit_frames` takes them. interpolation: (radii, nodes) from displacements of the nodes to those at the radii; few in
// a row are not zero. window: mm.
struct SurfaceObservation {
    const int64_t* counts;
    const double *places, *interpolation;
    double window;

    int64_t radii() const { return counts[0]; }
    int64_t nodes() const { return counts[2]; }
    bool is_valid() const { return counts[0] > 0 && counts[1] > 0 && counts[2] > 0; }
};

// Working memory to observe so many frames.
struct ObservationWorkspace {
    double* samples;              // (frames, radii) mm
    int64_t *states, *row_begin;  // (frames,); (radii,) the first node that a radius depends on
    int64_t* row_end;             // (radii,) the one after its last
    double* to_radii;             // (frames, 3, radii) derivatives of what is observed
    double* to_nodes;             // (3, nodes) those of one frame
};

inline ObservationWorkspace observation_workspace(Workspace& memory, const SurfaceObservation& surface, int64_t frames,
                                                  bool derivatives) {
    const int64_t radii = surface.radii();
    return {memory.doubles(frames * radii),
            memory.array<int64_t>(frames),
            memory.array<int64_t>(radii),
            memory.array<int64_t>(radii),
            memory.doubles(derivatives ? frames * OBSERVED * radii : 0),
            memory.doubles(derivatives ? OBSERVED * surface.nodes() : 0)};
}

// Displacements at the radii, work.samples (frames, radii), from those of the nodes, profiles (frames, nodes), all mm.
// A frame with a node that is not finite is NaN at all radii.
inline void sample_profiles(const SurfaceObservation& surface, int64_t frames, const double* profiles,
                            const ObservationWorkspace& work) {
    const int64_t radii = surface.radii(), nodes = surface.nodes();
    for (int64_t i = 0; i < radii; ++i) {
        const double* row = surface.interpolation + i * nodes;
        int64_t begin = 0, end = nodes;
        while (begin < end && row[begin] == 0.0) ++begin;
        while (end > begin && row[end - 1] == 0.0) --end;
        work.row_begin[i] = begin, work.row_end[i] = end;
    }
    for (int64_t k = 0; k < frames; ++k) {
        const double* profile = profiles + k * nodes;
        double total = 0.0;
        for (int64_t j = 0; j < nodes; ++j) total += fabs(profile[j]);
        for (int64_t i = 0; i < radii; ++i) {
            double sum = isfinite(total) ? 0.0 : NAN;
            for (int64_t j = work.row_begin[i]; j < work.row_end[i]; ++j)
                sum += surface.interpolation[i * nodes + j] * profile[j];
            work.samples[k * radii + i] = sum;
        }
    }
}

// Give frames at rest no amplitude and the shape of the next frame that was fitted, else of the last one; and D the
// derivatives that it has there (they do not change with the size of a profile), S and p none, which are zeros.
inline void fill_frames_at_rest(int64_t frames, int64_t radii, const int64_t* states, double* outputs,
                                double* to_radii) {
    int64_t source = -1;
    for (int64_t k = 0; k < frames; ++k)
        if (states[k] == FITTED) source = k;  // the last one
    for (int64_t k = frames - 1; k >= 0; --k) {
        if (states[k] == FITTED) source = k;
        if (states[k] != AT_REST) continue;
        outputs[OBSERVED * k] = 0.0;
        if (source < 0) continue;
        outputs[OBSERVED * k + 1] = outputs[OBSERVED * source + 1];
        outputs[OBSERVED * k + 2] = outputs[OBSERVED * source + 2];
        if (!to_radii) continue;
        double* row = to_radii + OBSERVED * k * radii;
        memcpy(row, to_radii + OBSERVED * source * radii, sizeof(double) * size_t(radii));
        for (int64_t i = radii; i < OBSERVED * radii; ++i) row[i] = 0.0;
    }
}

// Observe profiles (frames, nodes), mm: outputs (frames, 3), and their derivatives to_radii (frames, 3, radii) to the
// displacements at the radii; null: they are left out. NaN where a profile has no fit. Returns INTERPOLATED or
// NO_MEMORY.
inline int64_t observe_profiles(const SurfaceObservation& surface, int64_t frames, const double* profiles,
                             const ObservationWorkspace& work, double* outputs, double* to_radii) {
    const int64_t radii = surface.radii();
    sample_profiles(surface, frames, profiles, work);
    if (!CHOOSE_LANE_FUNCTION(creepkit_fit_frames)(surface.counts, surface.places, frames, work.samples, outputs,
                                                   work.states, to_radii))
        return NO_MEMORY;
    for (int64_t k = 0; k < frames; ++k) {
        outputs[OBSERVED * k + 1] *= surface.window;
        if (!to_radii) continue;
        double* width = to_radii + (OBSERVED * k + 1) * radii;
        for (int64_t i = 0; i < radii; ++i) width[i] *= surface.window;
    }
    fill_frames_at_rest(frames, radii, work.states, outputs, to_radii);
    return INTERPOLATED;
}

// Derivatives out (frames, 3, columns) of what is observed, from those of the profiles, changes (frames, nodes,
// columns), and work.to_radii. At the first frame, at rest, those of S and p are the second frame's, their limit.
inline void observe_changes(const SurfaceObservation& surface, int64_t frames, int64_t columns, const double* changes,
                            const ObservationWorkspace& work, double* out) {
    const int64_t radii = surface.radii(), nodes = surface.nodes();
    memset(out, 0, sizeof(double) * size_t(frames * OBSERVED * columns));
    for (int64_t k = 0; k < frames; ++k) {
        memset(work.to_nodes, 0, sizeof(double) * size_t(OBSERVED * nodes));
        for (int v = 0; v < OBSERVED; ++v) {
            const double* to_radii = work.to_radii + (OBSERVED * k + v) * radii;
            double *to_nodes = work.to_nodes + v * nodes, *target = out + (OBSERVED * k + v) * columns;
            for (int64_t i = 0; i < radii; ++i)
                for (int64_t j = work.row_begin[i]; j < work.row_end[i]; ++j)
                    to_nodes[j] += to_radii[i] * surface.interpolation[i * nodes + j];
            for (int64_t j = 0; j < nodes; ++j)
                for (int64_t c = 0; c < columns; ++c) target[c] += to_nodes[j] * changes[(k * nodes + j) * columns + c];
        }
    }
    for (int64_t c = columns; c < OBSERVED * columns; ++c) out[c] = frames > 1 ? out[OBSERVED * columns + c] : 0.0;
}

// Working memory to observe the accepted steps of a simulation and interpolate between them.
struct TimedObservationWorkspace {
    ObservationWorkspace observation;
    SplineWorkspace spline;
    double *outputs, *changes;  // (steps, 3); (steps, 3, columns)
};

inline TimedObservationWorkspace timed_observation_workspace(Workspace& memory, const SurfaceObservation& surface,
                                                             int64_t steps, int64_t columns) {
    return {observation_workspace(memory, surface, steps, columns > 0),
            spline_workspace(memory, steps, OBSERVED * (columns > 1 ? columns : 1)),
            memory.doubles(steps * OBSERVED), memory.doubles(steps * OBSERVED * columns)};
}

// What is observed at any times: profiles (steps, nodes), mm, are those of the accepted steps; outputs (count, 3) and,
// with columns > 0, derivatives (count, 3, columns), from those of the profiles, changes (steps, nodes, columns). NaN
// after the last step.
inline int64_t observe_at_times(const SurfaceObservation& surface, const AcceptedSteps& record, const double* profiles,
                                int64_t columns, const double* changes, int64_t count, const double* times,
                                const TimedObservationWorkspace& work, double* outputs, double* derivatives) {
    double* to_radii = columns > 0 ? work.observation.to_radii : nullptr;
    int64_t error = observe_profiles(surface, record.steps, profiles, work.observation, work.outputs, to_radii);
    if (error != INTERPOLATED) return error;
    error = interpolate_in_time(record, work.spline, OBSERVED, work.outputs, count, times, outputs);
    if (error != INTERPOLATED || columns == 0) return error;
    observe_changes(surface, record.steps, columns, changes, work.observation, work.changes);
    return interpolate_in_time(record, work.spline, OBSERVED * columns, work.changes, count, times, derivatives);
}

}  // namespace creepkit
