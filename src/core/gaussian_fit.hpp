// Least squares fit of a generalised Gaussian to profiles, with the exact derivatives of the result to the data.
//
//     D exp(-q),    q = (r/S)^p (|cos a|^p + |sin a|^p)
//
// at the points (r, a) of a polar grid, by Newton's method in x = (D, ln S, ln p), damped as Levenberg and Marquardt do
// where the sum of squares is not convex. Lengths r and S are shares of the window, so that ln(r/window) is known once.
#pragma once

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "vectors.hpp"
#include "workspace.hpp"

namespace creepkit {

// Where profiles are sampled: at `radii` radii and `angles` angles, each with a logarithm and a weight. `size` is the
// number of radii rounded up to whole vectors, the weights of those beyond being zero.
struct PolarGrid {
    int64_t radii, angles, size;
    const double* log_radius;  // (size,) ln(r / window); -700 on the axis
    const double* radial;      // (size,) their weights
    const double* log_cosine;  // (angles,) ln |cos a|
    const double* log_sine;    // (angles,) ln |sin a|
    const double* angular;     // (angles,) their weights
};

// What became of a frame: fitted; no displacement to fit; no fit that deserves the name.
enum FrameState : int64_t { FITTED, AT_REST, FAILED };

namespace gaussian {

constexpr double FARTHEST = 6.0;        // exp(-exp(6)) = 1e-175 is nothing, and its products with q still are numbers
constexpr double AT_REST_BELOW = 1e-9;  // mm; cameras see displacements of some 1e-3, solvers resolve some 1e-12
constexpr double SMALLEST_WIDTH = 0.02, LARGEST_WIDTH = 20.0;  // S / window of a result; and its p: beyond them
constexpr double SMALLEST_SHAPE = 0.25, LARGEST_SHAPE = 40.0;  // a profile shows an edge or its middle alone
constexpr double UNEXPLAINED = 0.2;  // share of squares that a fit leaves less of: noise of D/4 leaves as much
constexpr double CLEAR = 0.03;       // share below which a minimum is the one: plates leave 0.001, noise of D/10 0.03
constexpr int ITERATIONS = 60;
constexpr double LONGEST_STEP = 0.5;
constexpr double CONVERGED = 1e-7;  // Newton squares it: the step taken last leaves 1e-13 or so

// (S / window, or 0 for where the profile has fallen to D/e; p): where fits start that no frame before them warms.
constexpr int STARTS = 6;
constexpr double START[STARTS][2] = {{0.0, 2.0}, {0.0, 4.0}, {0.0, 1.2}, {0.25, 2.0}, {0.5, 2.0}, {1.0, 2.0}};

// Half the sum of squares at one place, and its first and second derivatives to x, of these the upper half.
// diagonal: of the part of `matrix` that knows no residuals, as in the Gauss-Newton method; never negative.
struct NormalEquations {
    double squares, slope[3], matrix[3][3], diagonal[3];
};

// g = |cos a|^p + |sin a|^p of an angle, and the first and second derivative of ln g to p.
struct AngularFactor {
    double g, first, second;
};

inline AngularFactor angular_factor(const PolarGrid& grid, double p, int64_t j) {
    const double lc = grid.log_cosine[j], ls = grid.log_sine[j];
    const double cosine = exp(p * lc), sine = exp(p * ls), g = cosine + sine;
    const double first = (cosine * lc + sine * ls) / g;
    return {g, first, (cosine * lc * lc + sine * ls * ls) / g - first * first};
}

// q at the distance `far` = ln(r/S).
inline Vector exponent(Vector far, double p, double g) {
    const Vector farthest = splat(FARTHEST), power = p * far;
    return g * exponential(power > farthest ? farthest : power);
}

// D of the least squares at given ln S and ln p; D is linear. y: (size,) the profile.
inline double best_amplitude(const PolarGrid& grid, const double* y, const double* x) {
    const double p = exp(x[2]);
    Vector product{}, square{};
    for (int64_t j = 0; j < grid.angles; ++j) {
        const double g = angular_factor(grid, p, j).g;
        for (int64_t i = 0; i < grid.size; i += LANES) {
            const Vector m = exponential(-exponent(load(grid.log_radius + i) - x[1], p, g));
            const Vector weighted = grid.angular[j] * load(grid.radial + i) * m;
            product += weighted * load(y + i);
            square += weighted * m;
        }
    }
    return sum(product) / sum(square);
}

// Half the sum of squares at x, and its derivatives. y: (size,) the profile.
inline void sum_up(const PolarGrid& grid, const double* y, const double* x, NormalEquations& normal) {
    const double D = x[0], p = exp(x[2]);
    Vector squares{}, slope[3]{}, diagonal[3]{}, m01{}, m02{}, m11{}, m12{}, m22{};
    for (int64_t j = 0; j < grid.angles; ++j) {
        const AngularFactor angle = angular_factor(grid, p, j);
        for (int64_t i = 0; i < grid.size; i += LANES) {
            const Vector weight = grid.angular[j] * load(grid.radial + i), far = load(grid.log_radius + i) - x[1];
            const Vector q = exponent(far, p, angle.g), m = exponential(-q);
            const Vector residual = D * m - load(y + i), left = weight * residual;
            const Vector steep = p * (far + angle.first);  // d ln q / d ln p
            const Vector fq = D * m * q, fs = fq * p, fp = -fq * steep;
            squares += left * residual;
            slope[0] += left * m;
            slope[1] += left * fs;
            slope[2] += left * fp;
            diagonal[0] += weight * m * m;
            diagonal[1] += weight * fs * fs;
            diagonal[2] += weight * fp * fp;
            m01 += weight * m * fs + left * m * q * p;
            m02 += weight * m * fp - left * m * q * steep;
            m11 += left * fq * (q - 1.0) * p * p;
            m12 += weight * fs * fp + left * fq * (p - (q - 1.0) * p * steep);
            m22 += left * fq * ((q - 1.0) * steep * steep - p * p * angle.second - steep);
        }
    }
    normal.squares = 0.5 * sum(squares);
    for (int v = 0; v < 3; ++v) normal.slope[v] = sum(slope[v]), normal.diagonal[v] = sum(diagonal[v]);
    normal.matrix[0][0] = normal.diagonal[0], normal.matrix[0][1] = sum(m01), normal.matrix[0][2] = sum(m02);
    normal.matrix[1][1] = sum(m11) + normal.diagonal[1], normal.matrix[1][2] = sum(m12);
    normal.matrix[2][2] = sum(m22) + normal.diagonal[2];
}

// Solution of (matrix + damping diagonal) solution = right by Cholesky's method; false where the damped matrix is not
// positive definite.
inline bool solve_damped(const NormalEquations& normal, const double* right, double damping, double* solution) {
    double lower[3][3];
    for (int a = 0; a < 3; ++a) {
        for (int b = 0; b <= a; ++b) {
            double total = normal.matrix[b][a] + (a == b ? damping * normal.diagonal[a] : 0.0);
            for (int c = 0; c < b; ++c) total -= lower[a][c] * lower[b][c];
            if (a > b) {
                lower[a][b] = total / lower[b][b];
            } else if (total > 1e-13 * normal.diagonal[a]) {
                lower[a][a] = sqrt(total);
            } else {
                return false;
            }
        }
        solution[a] = right[a];
        for (int c = 0; c < a; ++c) solution[a] -= lower[a][c] * solution[c];
        solution[a] /= lower[a][a];
    }
    for (int a = 2; a >= 0; --a) {
        for (int c = a + 1; c < 3; ++c) solution[a] -= lower[c][a] * solution[c];
        solution[a] /= lower[a][a];
    }
    return true;
}

// Derivatives (3, size) of x to the profile, `normal` being that of the result x.
inline void derivatives_to_profile(const PolarGrid& grid, const double* x, const NormalEquations& normal,
                                   double* derivatives) {
    double inverse[3][3];
    for (int v = 0; v < 3; ++v) {
        const double unit[3] = {v == 0 ? 1.0 : 0.0, v == 1 ? 1.0 : 0.0, v == 2 ? 1.0 : 0.0};
        solve_damped(normal, unit, 0.0, inverse[v]);
    }
    memset(derivatives, 0, sizeof(double) * size_t(3 * grid.size));
    const double p = exp(x[2]);
    for (int64_t j = 0; j < grid.angles; ++j) {
        const AngularFactor angle = angular_factor(grid, p, j);
        for (int64_t i = 0; i < grid.size; i += LANES) {
            const Vector far = load(grid.log_radius + i) - x[1], q = exponent(far, p, angle.g);
            const Vector weight = grid.angular[j] * load(grid.radial + i) * exponential(-q), fq = x[0] * q * p;
            for (int v = 0; v < 3; ++v) {
                double* to = derivatives + v * grid.size + i;
                store(to, load(to) + weight * (inverse[v][0] +
                                               fq * (inverse[v][1] - inverse[v][2] * (far + angle.first))));
            }
        }
    }
}

// Half the weighted sum of squares of a profile itself.
inline double half_square(const PolarGrid& grid, const double* y) {
    double along = 0.0, around = 0.0;
    for (int64_t i = 0; i < grid.radii; ++i) along += grid.radial[i] * y[i] * y[i];
    for (int64_t j = 0; j < grid.angles; ++j) around += grid.angular[j];
    return 0.5 * along * around;
}

// ln(r / window) of the place where a profile has fallen to 1/e of its largest value.
inline double fallen(const PolarGrid& grid, const double* y) {
    int64_t peak = 0;
    for (int64_t i = 1; i < grid.radii; ++i)
        if (fabs(y[i]) > fabs(y[peak])) peak = i;
    for (int64_t i = peak + 1; i < grid.radii; ++i)
        if (y[i] * y[peak] < y[peak] * y[peak] * exp(-1.0)) return grid.log_radius[i];
    return 0.0;
}

// Minimise from ln S and ln p in x; true when a strict minimum was reached that the grid can see. `normal` is that of
// x.
inline bool descend(const PolarGrid& grid, const double* y, double* x, NormalEquations& normal) {
    double step[3], trial[3];
    x[0] = best_amplitude(grid, y, x);
    sum_up(grid, y, x, normal);
    double squares = normal.squares, damping = 0.0;
    for (int iteration = 0; iteration < ITERATIONS; ++iteration) {
        if (!solve_damped(normal, normal.slope, damping, step)) {
            damping = fmax(4.0 * damping, 1e-3);
            continue;
        }
        const double longest = fmax(fabs(step[1]), fabs(step[2]));
        const double shrink = longest > LONGEST_STEP ? LONGEST_STEP / longest : 1.0;
        for (int v = 0; v < 3; ++v) trial[v] = x[v] - shrink * step[v];
        const NormalEquations before = normal;
        sum_up(grid, y, trial, normal);
        const bool close = damping == 0.0 && longest < CONVERGED && fabs(step[0]) < CONVERGED;
        if (close || normal.squares <= squares) {
            memcpy(x, trial, sizeof trial);
            squares = normal.squares;
            damping = damping < 1e-5 ? 0.0 : 0.1 * damping;
        } else {
            damping = fmax(4.0 * damping, 1e-3);
            normal = before;
        }
        if (close) {
            const bool inside = log(SMALLEST_WIDTH) < x[1] && x[1] < log(LARGEST_WIDTH) && log(SMALLEST_SHAPE) < x[2] &&
                                x[2] < log(LARGEST_SHAPE);
            return inside && solve_damped(normal, normal.slope, 0.0, step);
        }
    }
    return false;
}

// Fit one profile y (size,), largest value 1; x and `normal` are the result. The first clear fit is taken, started
// from `last`, the result before it (ln S is NaN: none), or else at the starts; of noisy ones, the best of all.
inline bool fit(const PolarGrid& grid, const double* y, const double* last, double* x, NormalEquations& normal) {
    const double whole = half_square(grid, y);
    double least = UNEXPLAINED * whole, trial[3];
    bool found = false;
    for (int k = -1; k < STARTS; ++k) {
        if (k < 0) {
            memcpy(trial, last, sizeof trial);
        } else {
            trial[1] = START[k][0] > 0.0 ? log(START[k][0]) : fallen(grid, y);
            trial[2] = log(START[k][1]);
        }
        NormalEquations attempt;
        if (!isfinite(trial[1]) || !descend(grid, y, trial, attempt) || !(attempt.squares < least)) continue;
        memcpy(x, trial, sizeof trial);
        normal = attempt;
        least = attempt.squares;
        found = true;
        if (least < CLEAR * whole) break;
    }
    return found;
}

}  // namespace gaussian

// Working memory of `fit_frames`.
struct FitWorkspace {
    double *log_radius, *radial, *profile;  // (size,)
    double* derivatives;                    // (3, size)
};

inline FitWorkspace fit_workspace(Workspace& memory, int64_t radii) {
    const int64_t size = whole_vectors(radii);
    return {memory.doubles(size), memory.doubles(size), memory.doubles(size), memory.doubles(3 * size)};
}

// Fit every frame of samples (frames, radii), in mm.
//
// counts: radii, angles. places: (2 radii + 3 angles,) one after another ln(r / window) and the weights of the radii,
// ln |cos a|, ln |sin a| and the weights of the angles. fits: (frames, 3) becomes D in mm, S / window and p, or NaN;
// each frame starts from the last one fitted. states: (frames,) becomes a FrameState. derivatives: (frames, 3, radii)
// becomes those of `fits` to `samples`, NaN where nothing was fitted; null: they are left out.
inline void fit_frames(const int64_t* counts, const double* places, const FitWorkspace& work, int64_t frames,
                       const double* samples, double* fits, int64_t* states, double* derivatives) {
    const int64_t radii = counts[0], angles = counts[1];
    const double* around = places + 2 * radii;
    memcpy(work.log_radius, places, sizeof(double) * size_t(radii));
    memcpy(work.radial, places + radii, sizeof(double) * size_t(radii));
    const PolarGrid grid{radii,       angles, whole_vectors(radii),   work.log_radius,    work.radial,
                         around, around + angles, around + 2 * angles};
    double x[3], last[3] = {0.0, NAN, 0.0};
    gaussian::NormalEquations normal;
    for (int64_t k = 0; k < frames; ++k) {
        const double* profile = samples + k * radii;
        double* result = fits + 3 * k;
        double total = 0.0, scale = 0.0;
        for (int64_t i = 0; i < radii; ++i) {
            total += fabs(profile[i]);
            scale = fmax(scale, fabs(profile[i]));
        }
        result[0] = result[1] = result[2] = NAN;
        states[k] = !isfinite(total) ? FAILED : scale > gaussian::AT_REST_BELOW ? FITTED : AT_REST;
        if (states[k] == FITTED) {
            for (int64_t i = 0; i < radii; ++i) work.profile[i] = profile[i] / scale;
            if (!gaussian::fit(grid, work.profile, last, x, normal)) states[k] = FAILED;
        }
        double* to_samples = derivatives ? derivatives + 3 * k * radii : nullptr;
        if (states[k] != FITTED) {
            for (int64_t i = 0; to_samples && i < 3 * radii; ++i) to_samples[i] = NAN;
            continue;
        }
        memcpy(last, x, sizeof last);
        result[0] = scale * x[0], result[1] = exp(x[1]), result[2] = exp(x[2]);
        if (!to_samples) continue;
        gaussian::derivatives_to_profile(grid, x, normal, work.derivatives);
        const double factor[3] = {1.0, result[1] / scale, result[2] / scale};
        for (int v = 0; v < 3; ++v)
            for (int64_t i = 0; i < radii; ++i)
                to_samples[v * radii + i] = factor[v] * work.derivatives[v * grid.size + i];
    }
}

}  // namespace creepkit
