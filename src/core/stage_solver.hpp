// Newton's method for the implicit stage of one material point, without and with internal variables.
//
// The problem and its unknown x are those of stage_problem.hpp. A law is called with one row at a time:
// theta : (P,); states : (S,) z0, S at most MAX_STATES;
// row   : (6 + S,) in: time and temperature of the stage, and a guess of the states; out: the solution;
// out   : ((1 + S)(7 + S),) room for the law's output;
// guess : of the increment, any positive number will do;
// tolerance : on the last Newton correction of ln D (and of the states, relative); the error left is its square.
#pragma once

#include <math.h>
#include <stdint.h>

#include "law.hpp"
#include "stage_problem.hpp"

namespace creepkit {

// The increment D of creep strain, and a StageFlag; D is 0 unless solved.
struct StageSolution {
    double increment;
    int64_t flag;
};

// Bound of the error of D that a Newton correction of `step` leaves, relative to D.
//
// That error is curvature/2 step^2 with the curvature of ln D - ln w - ln f in x. Strain, where it enters at all, is
// taken to enter as powers and sums of powers with exponents up to some four, stress as a power.
inline double error_left(const StageIterate& now, const StageProblem& problem, double by_strain, double by_stress,
                         double slope, double step) {
    const double share = now.increment / (problem.strain + now.increment);
    const double curvature = 4.0 * fabs(by_strain) + (by_strain != 0.0 ? share * share : 0.0) + 2.0 * fabs(by_stress) +
                             now.increment_slope * (1.0 - now.increment_slope);
    return curvature / slope * step * step;
}

// Newton's method in x, bracketed: it cannot fail where the rate falls with strain and rises with stress.
//
// negligible : error of D that need not be removed, beside the tolerance.
inline StageSolution solve_scalar_stage(LawEntry update, const double* theta, const Axes& axes,
                                        const StageProblem& problem, double* row, double* out, double guess,
                                        double tolerance, double negligible = 0.0) {
    constexpr int ITERATIONS = 80;
    constexpr double SMALL = 0.3;  // corrections so small let `error_left` be trusted
    double x = unknown_of_increment(problem, guess), low = -INFINITY, high = INFINITY, before = INFINITY;
    const double log_weight = log(problem.weight);
    for (int iteration = 0; iteration < ITERATIONS; ++iteration) {
        StageIterate now = increment_and_stress(problem, x);
        write_point(row, axes, now.stress, problem.strain + now.increment);
        update(1, row, theta, out);
        const bool nothing = out[0] < NO_RATE;
        if (nothing && now.stress > 0.99 * problem.trial) {
            write_point(row, axes, problem.trial, problem.strain);
            return {0.0, SOLVED};
        }
        const double residual = nothing ? INFINITY : now.log_increment - log_weight - out[0];
        if (!isfinite(residual) && !nothing) return {0.0, NOT_FINITE};
        // d(ln D - ln w - ln f)/dx: between 1 and the stress exponent for a hardening law under prescribed strain
        const double by_strain = nothing ? 0.0 : now.increment * now.increment_slope * out[1 + STRAIN];
        const double by_stress = nothing ? 0.0 : now.stress_slope * stress_derivative(out, 1, axes);
        const double slope = nothing ? 1.0 : now.increment_slope - by_strain - by_stress;
        (residual > 0.0 ? high : low) = x;
        const bool closed = isfinite(low) && isfinite(high);
        if (!(slope > 0.0) && !closed) return {0.0, NO_SOLUTION};
        double step = slope > 0.0 ? -residual / slope : INFINITY;
        if (fabs(step) <= tolerance ||
            (fabs(step) < SMALL &&
             now.increment * error_left(now, problem, by_strain, by_stress, slope, step) < negligible)) {
            now = increment_and_stress(problem, x + step);
            write_point(row, axes, now.stress, problem.strain + now.increment);
            return {now.increment, SOLVED};
        }
        if (!(low < x + step && x + step < high) || fabs(step) > 0.5 * before) {
            // Bisect a closed bracket; in an open one Newton's step is kept, but not beyond 60 in ln D.
            step = closed ? 0.5 * (low + high) - x : (step < -60.0 ? -60.0 : step > 60.0 ? 60.0 : step);
        }
        before = fabs(step);
        x += step;
    }
    return {0.0, TOO_MANY};
}

// As `solve_stage`, for a law without states and a trial stress above zero, from a good guess: no bracket and half of
// the logarithms.
//
// TOO_MANY when the guess was not good enough. Finite elements and integrators ask for little else, nearly always from
// next to the answer. negligible : error of D that need not be removed, beside the tolerance.
inline StageSolution solve_stage_near_guess(LawEntry update, const double* theta, const Axes& axes,
                                            const StageProblem& problem, double* row, double* out, double guess,
                                            double tolerance, double negligible = 0.0) {
    constexpr int ITERATIONS = 4;
    constexpr double SMALL = 0.3;  // corrections so small let `error_left` be trusted
    const bool relaxes = problem.stiffness > 0.0;
    double increment = guess, share = relaxes ? problem.stiffness * increment / problem.trial : 0.0;
    for (int iteration = 0; iteration < ITERATIONS; ++iteration) {
        if (!(relaxes ? 1e-280 < share && share < 0.9999 : 1e-280 < increment && increment < 1e3)) break;
        const double elastic = 1.0 - share;
        double stress = problem.trial * elastic;
        if (problem.load != 0.0) stress *= exp(problem.load * increment);
        write_point(row, axes, stress, problem.strain + increment);
        update(1, row, theta, out);
        if (!(out[0] >= NO_RATE)) break;
        const double residual = log(increment / problem.weight) - out[0];
        const double stress_slope = problem.load != 0.0 ? problem.load * increment : -share;
        const double by_strain = increment * elastic * out[1 + STRAIN];
        const double by_stress = stress * stress_slope * stress_derivative(out, 1, axes);
        const double slope = elastic - by_strain - by_stress, step = -residual / slope;
        if (!(slope > 0.0 && fabs(step) < 1.0)) break;
        const StageIterate now = {increment, 0.0, stress, elastic, stress * stress_slope};
        const double left = increment * error_left(now, problem, by_strain, by_stress, slope, step);
        const bool enough = fabs(step) <= tolerance || (fabs(step) < SMALL && left < negligible);
        if (relaxes) {
            const double ratio = share / elastic * exp(step);
            share = ratio / (1.0 + ratio);
            increment = problem.trial / problem.stiffness * share;
        } else {
            increment *= exp(step);
        }
        if (enough) {
            stress = problem.trial * (1.0 - share);
            if (problem.load != 0.0) stress *= exp(problem.load * increment);
            write_point(row, axes, stress, problem.strain + increment);
            return {increment, SOLVED};
        }
    }
    return {0.0, TOO_MANY};
}

// Jacobian and minus the residual of [ln D - ln w - ln f, z - z0 - w g] in (x, z), at a law's `row` and `out`.
//
// matrix : (1 + S, 1 + S); right : (1 + S,). creeps : whether there is an increment to solve for.
inline void stage_newton_system(const Axes& axes, const StageProblem& problem, const double* states,
                                int64_t state_count, const double* row, const double* out, const StageIterate& now,
                                bool creeps, double* matrix, double* right) {
    const int64_t size = 1 + state_count, width = POINT_SIZE + state_count;
    for (int64_t i = 0; i < size; ++i) {
        const int64_t start = size + i * width;
        const double factor = i > 0 ? problem.weight : creeps ? 1.0 : 0.0;
        const double by_strain = now.increment * now.increment_slope * out[start + STRAIN];
        const double by_stress = now.stress_slope * stress_derivative(out, start, axes);
        matrix[i * size] = creeps ? -factor * (by_strain + by_stress) : 0.0;
        for (int64_t j = 1; j < size; ++j) {
            matrix[i * size + j] = factor > 0.0 ? -factor * out[start + POINT_SIZE + j - 1] : 0.0;
        }
        matrix[i * size + i] += i > 0 || !creeps ? 1.0 : now.increment_slope;
        if (i > 0) right[i] = states[i - 1] + problem.weight * out[i] - row[POINT_SIZE + i - 1];
    }
    right[0] = creeps ? log(problem.weight) + out[0] - now.log_increment : 0.0;
}

// Damped Newton's method in (x, z) for laws with internal variables.
inline StageSolution solve_stage_with_states(LawEntry update, const double* theta, const Axes& axes,
                                             const StageProblem& problem, const double* states, int64_t state_count,
                                             double* row, double* out, double guess, double tolerance) {
    constexpr int ITERATIONS = 80, MOST_HALVINGS = 12;
    constexpr double LONGEST_CORRECTION = 5.0;
    if (!(problem.trial >= 0.0) || state_count > MAX_STATES) return {0.0, NO_SOLUTION};
    const int64_t size = 1 + state_count;
    double matrix[(1 + MAX_STATES) * (1 + MAX_STATES)], step[1 + MAX_STATES], last[1 + MAX_STATES] = {};
    bool creeps = problem.trial > 0.0;
    double x = creeps ? unknown_of_increment(problem, guess) : 0.0;
    int halvings = 0;
    for (int iteration = 0; iteration < ITERATIONS; ++iteration) {
        StageIterate now = creeps ? increment_and_stress(problem, x) : StageIterate{};
        write_point(row, axes, now.stress, problem.strain + now.increment);
        update(1, row, theta, out);
        creeps = creeps && !(out[0] < NO_RATE);
        double sum = 0.0;  // finite if all that Newton's method needs of the law is
        for (int64_t i = creeps ? 0 : 1; i < size; ++i) sum += out[i];
        if (!isfinite(sum)) {
            if (++halvings > MOST_HALVINGS) return {0.0, NOT_FINITE};
            for (int64_t i = 1; i < size; ++i) row[POINT_SIZE + i - 1] -= 0.5 * last[i];
            x -= 0.5 * last[0];
            for (int64_t i = 0; i < size; ++i) last[i] *= 0.5;
            continue;
        }
        stage_newton_system(axes, problem, states, state_count, row, out, now, creeps, matrix, step);
        if (!solve_dense(matrix, step, size, 1)) return {0.0, NO_SOLUTION};
        const double damping = fmin(1.0, LONGEST_CORRECTION / fmax(fabs(step[0]), 1e-300));
        for (int64_t i = 0; i < size; ++i) last[i] = damping * step[i];
        for (int64_t i = 1; i < size; ++i) row[POINT_SIZE + i - 1] += last[i];
        x += last[0];
        halvings = 0;
        bool small = !(fabs(last[0]) > tolerance);
        for (int64_t i = 1; i < size && small; ++i) {
            small = !(fabs(last[i]) > tolerance * fmax(fabs(row[POINT_SIZE + i - 1]), 1e-12));
        }
        if (small) {
            if (creeps) now = increment_and_stress(problem, x);
            write_point(row, axes, now.stress, problem.strain + now.increment);
            return {now.increment, SOLVED};
        }
    }
    return {0.0, TOO_MANY};
}

constexpr double NO_STRESS_LEFT = 1e-13;  // of a back stress: an effective stress below it is rounding

// Whether an increment D leaves a bar some effective stress, with the states in a law's `row`.
inline bool leaves_stress(const StageProblem& problem, double increment, const double* row, int64_t state_count) {
    const double* z = row + POINT_SIZE;
    const double rounding = NO_STRESS_LEFT * fabs(problem.back.sum(z, state_count));
    return problem.effective_stress(increment, z, state_count) > rounding;
}

// ln of an increment, the guess or less, that leaves some; NaN where none does.
inline double unknown_that_leaves_stress(const StageProblem& problem, double guess, const double* row,
                                         int64_t state_count) {
    if (!leaves_stress(problem, 0.0, row, state_count)) return NAN;
    double x = unknown_of_increment(problem, fmin(guess, 1.0));
    while (!leaves_stress(problem, exp(x), row, state_count)) x -= 1.0;
    return x;
}

// The share, `most` at most, of a correction of (ln D, z) that leaves a tenth of the effective stress.
inline double share_that_leaves_stress(const StageProblem& problem, double x, const double* step, const double* row,
                                       int64_t state_count, double most) {
    constexpr double LEAST_LEFT = 0.1, LEAST_SHARE = 1e-18;
    const double *z = row + POINT_SIZE, least = LEAST_LEFT * problem.effective_stress(exp(x), z, state_count);
    double moved[MAX_STATES], share = most;
    for (; share > LEAST_SHARE; share *= 0.5) {
        for (int64_t i = 0; i < state_count; ++i) moved[i] = z[i] + share * step[1 + i];
        if (problem.effective_stress(exp(x + share * step[0]), moved, state_count) >= least) break;
    }
    return share;
}

// Damped Newton's method in (ln D, z) for a bar with a back stress, which flows while some effective stress is left.
//
// Where none is, the states move alone, and what they then leave may flow. negligible : error of D that need not be
// removed, for an effective stress far below the back stress has few digits.
inline StageSolution solve_stage_with_back_stress(LawEntry update, const double* theta, const Axes& axes,
                                                  const StageProblem& problem, const double* states,
                                                  int64_t state_count, double* row, double* out, double guess,
                                                  double tolerance, double negligible) {
    constexpr int ITERATIONS = 100;
    constexpr double LONGEST_CORRECTION = 5.0, SMALL = 0.3;
    if (state_count > MAX_STATES) return {0.0, NO_SOLUTION};
    const int64_t size = 1 + state_count;
    double matrix[(1 + MAX_STATES) * (1 + MAX_STATES)], step[1 + MAX_STATES];
    double x = unknown_that_leaves_stress(problem, guess, row, state_count);
    bool flowed = !isnan(x);
    for (int iteration = 0; iteration < ITERATIONS; ++iteration) {
        const bool flows = !isnan(x);
        const StageIterate now =
            flows ? increment_and_stress(problem, x) : StageIterate{0.0, 0.0, problem.trial, 0.0, 0.0};
        write_point(row, axes, now.stress, problem.strain + now.increment);
        update(1, row, theta, out);
        if (flows && out[0] < NO_RATE) {
            x = NAN;
            continue;
        }
        stage_newton_system(axes, problem, states, state_count, row, out, now, flows, matrix, step);
        if (!solve_dense(matrix, step, size, 1)) return {0.0, NO_SOLUTION};
        double share = fmin(1.0, LONGEST_CORRECTION / fmax(fabs(step[0]), 1e-300));
        if (flows) share = share_that_leaves_stress(problem, x, step, row, state_count, share);
        bool small = !(fabs(step[0]) > tolerance) ||
                     (fabs(step[0]) < SMALL && now.increment * fabs(step[0]) < negligible);
        double sum = 0.0;
        for (int64_t i = 1; i < size; ++i) {
            double& z = row[POINT_SIZE + i - 1];
            z += share * step[i];
            sum += z;
            small = small && !(fabs(step[i]) > tolerance * fmax(fabs(z), 1e-12));
        }
        if (!isfinite(sum + step[0])) return {0.0, NOT_FINITE};
        x += share * step[0];
        if (flows && !leaves_stress(problem, exp(x), row, state_count)) {
            x = NAN;
            continue;
        }
        if (!small) continue;
        const double increment = flows ? exp(x) : 0.0;
        write_point(row, axes, problem.effective_stress(increment, row, 0), problem.strain + increment);
        if (flows || out[0] < NO_RATE || !leaves_stress(problem, 0.0, row, state_count)) return {increment, SOLVED};
        if (flowed) return {0.0, NO_SOLUTION};
        flowed = true;
        x = unknown_that_leaves_stress(problem, guess, row, state_count);
    }
    return {0.0, TOO_MANY};
}

// Solve a stage.
inline StageSolution solve_stage(LawEntry update, const double* theta, const Axes& axes, const StageProblem& problem,
                                 const double* states, int64_t state_count, double* row, double* out, double guess,
                                 double tolerance, double negligible = 0.0) {
    if (problem.back.any()) {
        return solve_stage_with_back_stress(update, theta, axes, problem, states, state_count, row, out, guess,
                                            tolerance, negligible);
    }
    if (state_count > 0) {
        return solve_stage_with_states(update, theta, axes, problem, states, state_count, row, out, guess, tolerance);
    }
    if (!(problem.trial > 0.0)) {
        write_point(row, axes, 0.0, problem.strain);
        return {0.0, problem.trial == 0.0 ? SOLVED : NO_SOLUTION};
    }
    return solve_scalar_stage(update, theta, axes, problem, row, out, guess, tolerance, negligible);
}

}  // namespace creepkit
