// The nonlinear problem of one implicit stage of a material point: its statement, its unknown, and its derivatives.
//
// Unknown are the creep increment D and the states z at the end of the stage:
//
//     D = w f(sigma, p0 + D, t, T, z)                 z = z0 + w g(sigma, p0 + D, t, T, z)
//     sigma = (trial - k D) exp(load D)
//
// with w the weight of the stage in s, p0 and z0 the history, trial the stress in MPa without further creep, and k = 3G
// in a finite element, E in relaxation, 0 under prescribed stress. load = 1 is uniaxial tension under constant load, -1
// compression, else 0. The unknown of the iteration is x = ln[D / (1 - k D/trial)]: every x is an increment that leaves some stress.
//
// Some states of a bar may be back stresses X: components along the flow, as sigma is there, of what the law takes off
// the stress. The bar flows while the effective stress sigma - X is above zero, whatever sigma is, and then x = ln D.
//
// The derivatives of (D, z) follow from the implicit function theorem; the finite element solver takes its consistent
// tangent from them, the integration of a point its sensitivities to the parameters.
//
// S states and P parameters; a point is a law's input of one row, (6 + S,). Matrices are row-major.
#pragma once

#include <math.h>
#include <stdint.h>

#include "law.hpp"

namespace creepkit {

constexpr int MAX_STATES = 16;  // states of a law; callers refuse laws with more

// Flags of a stage: solved; the rate is not finite; no increment satisfies the equation; iterations used up.
enum StageFlag { SOLVED, NOT_FINITE, NO_SOLUTION, TOO_MANY };

// ln of a rate, 1/s, below which nothing creeps (a law whose terms are off, or a stress of zero).
constexpr double NO_RATE = -600.0;

// Largest principal and mean stress as straight lines in the equivalent stress: offset + slope sigma, MPa.
struct Axes {
    double principal, principal_slope, mean, mean_slope;
};

// Uniaxial tension: the largest principal stress is the stress, the mean stress a third of it.
constexpr Axes UNIAXIAL = {0.0, 1.0, 0.0, 1.0 / 3.0};

// Uniaxial compression: no principal stress is above zero.
constexpr Axes COMPRESSION = {0.0, 0.0, 0.0, -1.0 / 3.0};

inline const Axes& axes_of(double sign) { return sign < 0.0 ? COMPRESSION : UNIAXIAL; }

// Which states are back stresses: weights (S,), 1 of those, 0 of others; null where none is.
struct BackStresses {
    const double* weights = nullptr;

    bool any() const { return weights != nullptr; }
    double weight(int64_t state) const { return weights ? weights[state] : 0.0; }

    // Their sum among the states z (S,), MPa.
    double sum(const double* z, int64_t states) const {
        double total = 0.0;
        for (int64_t i = 0; weights && i < states; ++i) total += weights[i] * z[i];
        return total;
    }
};

// What a stage is solved for: trial stress and k in MPa, load 0, 1 or -1, weight w in s, strain p0 so far.
struct StageProblem {
    double trial, stiffness, load, weight, strain;
    BackStresses back = {};

    // The effective stress after the increment D, with the states z, MPa.
    double effective_stress(double increment, const double* z, int64_t states) const {
        const double left = trial - stiffness * increment;
        return (load != 0.0 ? left * exp(load * increment) : left) - back.sum(z, states);
    }
};

// An iterate x in plain terms: D, ln D, stress in MPa, and d(ln D)/dx, d(sigma)/dx.
struct StageIterate {
    double increment, log_increment, stress, increment_slope, stress_slope;
};

// Turn the unknown x into increment and stress.
inline StageIterate increment_and_stress(const StageProblem& problem, double x) {
    const double amount = exp(x < 700.0 ? x : 700.0);
    if (problem.stiffness > 0.0 && problem.back.any()) {
        return {amount, x, problem.trial - problem.stiffness * amount, 1.0, -problem.stiffness * amount};
    }
    if (problem.stiffness > 0.0) {
        const double ratio = problem.stiffness * amount / problem.trial, elastic = 1.0 / (1.0 + ratio);
        const double stress = problem.trial * elastic;
        return {amount * elastic, x - log1p(ratio), stress, elastic, stress * (elastic - 1.0)};
    }
    const double stress =
        problem.load != 0.0 ? problem.trial * exp(problem.load * (amount < 700.0 ? amount : 700.0)) : problem.trial;
    return {amount, x, stress, 1.0, stress * (problem.load * amount)};
}

// The unknown x of a guessed increment, kept off the ends of its range.
inline double unknown_of_increment(const StageProblem& problem, double increment) {
    const double guess = increment > 1e-300 ? increment : 1e-300;
    if (problem.stiffness == 0.0 || problem.back.any()) return log(guess);
    const double share = problem.stiffness * guess / problem.trial;
    return share < 0.999 ? log(guess) - log1p(-share) : log(999.0 * problem.trial / problem.stiffness);
}

// Write stress and strain into a law's row; time, temperature and states are there already.
inline void write_point(double* row, const Axes& axes, double stress, double strain) {
    row[STRESS] = stress;
    row[STRAIN] = strain;
    row[PRINCIPAL_STRESS] = axes.principal + axes.principal_slope * stress;
    row[MEAN_STRESS] = axes.mean + axes.mean_slope * stress;
}

// Derivative to the equivalent stress, principal and mean stress following it; a gradient begins at `start`.
inline double stress_derivative(const double* slopes, int64_t start, const Axes& axes) {
    const double* along = slopes + start;
    return along[STRESS] + axes.principal_slope * along[PRINCIPAL_STRESS] + axes.mean_slope * along[MEAN_STRESS];
}

// Solve matrix x = right in place, x left in `right`; false when the matrix is singular.
//
// matrix : (size, size), destroyed; right : (size, columns). Gauss elimination with row pivoting.
inline bool solve_dense(double* matrix, double* right, int64_t size, int64_t columns) {
    const auto subtract = [](double* rows, int64_t width, int64_t i, double factor, int64_t k) {
        for (int64_t j = 0; j < width; ++j) rows[i * width + j] -= factor * rows[k * width + j];
    };
    const auto swap = [](double* rows, int64_t width, int64_t i, int64_t k) {
        for (int64_t j = 0; j < width; ++j) {
            const double kept = rows[i * width + j];
            rows[i * width + j] = rows[k * width + j];
            rows[k * width + j] = kept;
        }
    };
    for (int64_t k = 0; k < size; ++k) {
        int64_t best = k;
        for (int64_t i = k + 1; i < size; ++i) {
            if (fabs(matrix[i * size + k]) > fabs(matrix[best * size + k])) best = i;
        }
        const double pivot = matrix[best * size + k];
        if (!(fabs(pivot) > 0.0)) return false;
        if (best != k) {
            swap(matrix, size, best, k);
            swap(right, columns, best, k);
        }
        for (int64_t i = k + 1; i < size; ++i) {
            const double factor = matrix[i * size + k] / pivot;
            if (factor == 0.0) continue;
            subtract(matrix, size, i, factor, k);
            subtract(right, columns, i, factor, k);
        }
    }
    for (int64_t k = size - 1; k >= 0; --k) {
        for (int64_t i = k + 1; i < size; ++i) subtract(right, columns, k, matrix[k * size + i], i);
        for (int64_t j = 0; j < columns; ++j) right[k * columns + j] /= matrix[k * size + k];
    }
    return true;
}

// Columns of a response; those of the S initial states z0 and of the P parameters follow.
enum StageInput { BY_TRIAL, BY_STRAIN, BY_TIME, BY_TEMPERATURE, BY_LOG_WEIGHT, BY_PRINCIPAL, BY_MEAN, INPUTS };

// Derivatives of [w f, w g] with respect to a law's row, (1 + S, 6 + S), from the output of `update`.
inline void gradient_of_update(const double* out, const StageProblem& problem, double increment, double* gradient,
                               int64_t states) {
    const int64_t size = 1 + states, width = POINT_SIZE + states;
    for (int64_t i = 0; i < size; ++i) {
        const double factor = i == 0 ? increment : problem.weight;
        for (int64_t j = 0; j < width; ++j) {
            const double slope = out[size + i * width + j];
            gradient[i * width + j] = factor != 0.0 ? factor * slope : 0.0;
        }
    }
}

// The same from the output of `sensitivity`.
inline void gradient_of_sensitivity(const double* full, const StageProblem& problem, double increment,
                                    double* gradient, int64_t states) {
    const int64_t size = 1 + states, width = POINT_SIZE + states;
    for (int64_t i = 0; i < size; ++i) {
        const double factor = i == 0 && increment == 0.0 ? 0.0 : problem.weight;
        for (int64_t j = 0; j < width; ++j) {
            const double slope = full[size + i * width + j];
            gradient[i * width + j] = factor != 0.0 ? factor * slope : 0.0;
        }
    }
}

// Fill `response` with the derivatives of (D, z); false when the stage's equations are singular.
//
// state_rates : (S,) g at the solution; gradient : (1 + S, 6 + S) of [w f, w g].
// matrix : (1 + S, 1 + S), workspace.
// response : (1 + S, 7 + S + P); on entry its last P columns hold the derivatives of [w f, w g] to the parameters.
inline bool differentiate_stage(const Axes& axes, const StageProblem& problem, double increment, double stress,
                                const double* state_rates, const double* gradient, double* matrix, double* response,
                                int64_t states, int64_t parameters) {
    const int64_t size = 1 + states, width = POINT_SIZE + states, columns = INPUTS + states + parameters;
    const double growth = problem.load != 0.0 ? exp(problem.load * increment) : 1.0;
    const double by_increment = problem.load * stress - problem.stiffness * growth;
    for (int64_t i = 0; i < size; ++i) {
        const double* slopes = gradient + i * width;
        double *answer = response + i * columns, *equation = matrix + i * size;
        const double by_stress = stress_derivative(slopes, 0, axes);
        equation[0] = -slopes[STRAIN] - by_stress * by_increment;
        for (int64_t j = 1; j < size; ++j) {
            equation[j] = -slopes[POINT_SIZE + j - 1];
            answer[INPUTS + j - 1] = i == j ? 1.0 : 0.0;
        }
        equation[i] += 1.0;
        answer[BY_TRIAL] = by_stress * growth;
        answer[BY_STRAIN] = slopes[STRAIN];
        answer[BY_TIME] = slopes[TIME];
        answer[BY_TEMPERATURE] = slopes[TEMPERATURE];
        answer[BY_LOG_WEIGHT] = i == 0 ? increment : problem.weight * state_rates[i - 1];
        answer[BY_PRINCIPAL] = slopes[PRINCIPAL_STRESS];
        answer[BY_MEAN] = slopes[MEAN_STRESS];
    }
    return solve_dense(matrix, response, size, columns);
}

}  // namespace creepkit
