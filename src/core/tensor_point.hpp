// The implicit stage of one material point in six components, and its reduction to a scalar problem.
//
// Small strain, isotropic elasticity, creep along the deviator of stress. Tensors are vectors of the components 11, 22,
// 33, 12, 23, 13, with tensor shear strains (half of the engineering ones). What a point carries is its vector,
// (7 + S,): six creep strains, the equivalent creep strain, the S states.
//
// Backward Euler with the direction of the trial deviator is the radial return: the von Mises stress at the end of a
// stage solves the scalar problem of stage_problem.hpp with k = 3G, and creep is along the trial deviator. Simo and
// Hughes, Computational Inelasticity, section 3.3.
#pragma once

#include <math.h>
#include <stdint.h>

#include "comparison.hpp"
#include "stage_problem.hpp"
#include "stage_solver.hpp"
#include "workspace.hpp"

namespace creepkit {

constexpr int64_t COMPONENTS = 6, EQUIVALENT_STRAIN = 6;  // the second is a place in a point's vector

constexpr double UNIT_TENSOR[COMPONENTS] = {1.0, 1.0, 1.0, 0.0, 0.0, 0.0};

// How often a component occurs in the 3 x 3 tensor.
constexpr double COMPONENT_COUNTS[COMPONENTS] = {1.0, 1.0, 1.0, 2.0, 2.0, 2.0};

// The largest eigenvalue of a symmetric tensor; axis : (3,) its eigenvector of length 1. Jacobi's rotations.
inline double largest_principal(const double* tensor, double* axis) {
    constexpr int SWEEPS = 30;
    double a[3][3] = {
        {tensor[0], tensor[3], tensor[5]}, {tensor[3], tensor[1], tensor[4]}, {tensor[5], tensor[4], tensor[2]}};
    double vectors[3][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
    for (int sweep = 0; sweep < SWEEPS; ++sweep) {
        double off = 0.0, on = 0.0;
        for (int i = 0; i < 3; ++i) {
            on += fabs(a[i][i]);
            for (int j = 0; j < i; ++j) off += fabs(a[i][j]);
        }
        if (!(off > 1e-17 * on)) break;
        for (int p = 0; p < 2; ++p) {
            for (int q = p + 1; q < 3; ++q) {
                if (a[p][q] == 0.0) continue;
                const double ratio = 0.5 * (a[q][q] - a[p][p]) / a[p][q];
                const double t = (ratio >= 0.0 ? 1.0 : -1.0) / (fabs(ratio) + sqrt(1.0 + ratio * ratio));
                const double cosine = 1.0 / sqrt(1.0 + t * t), sine = t * cosine;
                for (int k = 0; k < 3; ++k) {
                    const double left = a[k][p], right = a[k][q];
                    a[k][p] = cosine * left - sine * right;
                    a[k][q] = sine * left + cosine * right;
                }
                for (int k = 0; k < 3; ++k) {
                    const double above = a[p][k], below = a[q][k];
                    a[p][k] = cosine * above - sine * below;
                    a[q][k] = sine * above + cosine * below;
                    const double left = vectors[k][p], right = vectors[k][q];
                    vectors[k][p] = cosine * left - sine * right;
                    vectors[k][q] = sine * left + cosine * right;
                }
                a[p][q] = a[q][p] = 0.0;
            }
        }
    }
    int best = 0;
    for (int i = 1; i < 3; ++i) {
        if (a[i][i] > a[best][best]) best = i;
    }
    for (int k = 0; k < 3; ++k) axis[k] = vectors[k][best];
    return a[best][best];
}

// The stress if nothing crept: mean stress, deviator, von Mises stress q, in MPa, and the axes it fixes.
//
// along : derivative of the deviator's largest principal stress to the deviator.
struct TrialStress {
    double mean, q, s[COMPONENTS], along[COMPONENTS];
    Axes axes;

    // Take a stress apart; q is not finite when the stress is not.
    explicit TrialStress(const double* stress) {
        mean = (stress[0] + stress[1] + stress[2]) / 3.0;
        double square = 0.0;
        for (int64_t k = 0; k < COMPONENTS; ++k) {
            s[k] = stress[k] - mean * UNIT_TENSOR[k];
            square += COMPONENT_COUNTS[k] * s[k] * s[k];
        }
        q = sqrt(1.5 * square);
        double axis[3] = {1.0, 0.0, 0.0};
        const double largest = isfinite(q) ? largest_principal(s, axis) : 0.0;
        const int rows[COMPONENTS] = {0, 1, 2, 0, 1, 0}, columns[COMPONENTS] = {0, 1, 2, 1, 2, 2};
        for (int64_t k = 0; k < COMPONENTS; ++k) along[k] = COMPONENT_COUNTS[k] * axis[rows[k]] * axis[columns[k]];
        axes = {mean, q > 0.0 ? largest / q : 0.0, mean, 0.0};
    }
};

// A material point with its working arrays.
struct TensorPoint {
    LawEntry update;
    const double* theta;
    int64_t states;
    double shear, bulk;            // moduli, MPa
    bool held[COMPONENTS];         // whether the strain is prescribed rather than the stress
    double *row, *out, *gradient, *matrix, *response;  // of the law and of its stage

    TensorPoint(Workspace& memory, LawEntry update, const double* theta, int64_t states, double modulus, double ratio)
        : update(update),
          theta(theta),
          states(states),
          shear(0.5 * modulus / (1.0 + ratio)),
          bulk(modulus / (3.0 * (1.0 - 2.0 * ratio))),
          held{} {
        const int64_t size = 1 + states, width = POINT_SIZE + states;
        row = memory.doubles(width);
        out = memory.doubles(size * (1 + width));
        gradient = memory.doubles(size * width);
        matrix = memory.doubles(size * size);
        response = memory.doubles(size * (INPUTS + states));
    }

    int64_t size() const { return EQUIVALENT_STRAIN + 1 + states; }

    // The von Mises stress at the end of the last stage, MPa.
    double equivalent_stress() const { return row[STRESS]; }

    // Entry of the elastic stiffness.
    double stiffness(int64_t i, int64_t j) const {
        const double deviator = (i == j ? 1.0 : 0.0) - UNIT_TENSOR[i] * UNIT_TENSOR[j] / 3.0;
        return bulk * UNIT_TENSOR[i] * UNIT_TENSOR[j] + 2.0 * shear * deviator;
    }

    // stress : (6,) of an elastic strain.
    void elastic_stress(const double* strain, const double* creep, double* stress) const {
        double elastic[COMPONENTS], trace = 0.0;
        for (int64_t k = 0; k < COMPONENTS; ++k) elastic[k] = strain[k] - creep[k];
        for (int64_t k = 0; k < 3; ++k) trace += elastic[k];
        for (int64_t k = 0; k < COMPONENTS; ++k) {
            stress[k] = 2.0 * shear * elastic[k] + (bulk - 2.0 * shear / 3.0) * trace * UNIT_TENSOR[k];
        }
    }

    // Add to the free components of `strain` what takes `residual`, (6,), off their stresses; tangent : (6, 6).
    bool correct_free_strains(const double* tangent, const double* residual, double* strain) const {
        int64_t free[COMPONENTS], count = 0;
        for (int64_t k = 0; k < COMPONENTS; ++k) {
            if (!held[k]) free[count++] = k;
        }
        double system[COMPONENTS * COMPONENTS], right[COMPONENTS];
        for (int64_t i = 0; i < count; ++i) {
            for (int64_t j = 0; j < count; ++j) system[i * count + j] = tangent[free[i] * COMPONENTS + free[j]];
            right[i] = residual[free[i]];
        }
        if (!solve_dense(system, right, count, 1)) return false;
        for (int64_t i = 0; i < count; ++i) strain[free[i]] -= right[i];
        return true;
    }

    // The strain when creep strains are known; `imposed` mixes stresses and strains.
    bool elastic_strain(const double* imposed, const double* creep, double* strain) const {
        double residual[COMPONENTS], tangent[COMPONENTS * COMPONENTS];
        for (int64_t k = 0; k < COMPONENTS; ++k) strain[k] = held[k] ? imposed[k] : 0.0;
        elastic_stress(strain, creep, residual);
        for (int64_t k = 0; k < COMPONENTS; ++k) residual[k] -= imposed[k];
        for (int64_t k = 0; k < COMPONENTS * COMPONENTS; ++k) tangent[k] = stiffness(k / COMPONENTS, k % COMPONENTS);
        return correct_free_strains(tangent, residual, strain);
    }

    // The vector at the end of a stage that starts from `base` with a weight in s; false when there is none.
    //
    // guess, vector : (7 + S,); imposed : (6,); time s, temperature K.
    bool solve_stage(const double* base, const double* guess, const double* imposed, double time, double temperature,
                     double weight, double* vector) {
        constexpr int ITERATIONS = 30;
        constexpr double BALANCE = 1e-9, NO_STRESS = 1e-12;  // relative, and MPa
        double strain[COMPONENTS], stress[COMPONENTS], residual[COMPONENTS], tangent[COMPONENTS * COMPONENTS];
        if (!elastic_strain(imposed, guess, strain)) return false;
        row[TIME] = time;
        row[TEMPERATURE] = temperature;
        for (int iteration = 0; iteration < ITERATIONS; ++iteration) {
            double elastic[COMPONENTS];
            elastic_stress(strain, base, elastic);
            const TrialStress trial(elastic);
            const StageProblem problem = problem_of(trial, base, weight);
            if (!creep(trial, problem, base, guess, vector, stress)) return false;
            double worst = 0.0, largest = 0.0;
            for (int64_t k = 0; k < COMPONENTS; ++k) {
                residual[k] = stress[k] - imposed[k];
                if (!held[k]) worst = worse(worst, fabs(residual[k]));
                largest = worse(largest, fabs(stress[k]));
            }
            if (worst <= BALANCE * largest + NO_STRESS) return true;
            if (!stress_tangent(trial, problem, vector[EQUIVALENT_STRAIN] - base[EQUIVALENT_STRAIN], tangent) ||
                !correct_free_strains(tangent, residual, strain)) {
                return false;
            }
        }
        return false;
    }

    // What follows from a strain, (6,), at the end of a stage whose time and temperature stand in the row: the vector,
    // the stress, and its consistent tangent to the strain, (6, 6); false when there is no solution.
    bool constitutive_response(const double* strain, const double* base, const double* guess, double weight,
                               double* vector, double* stress, double* tangent) {
        double elastic[COMPONENTS];
        elastic_stress(strain, base, elastic);
        const TrialStress trial(elastic);
        const StageProblem problem = problem_of(trial, base, weight);
        return creep(trial, problem, base, guess, vector, stress) &&
               stress_tangent(trial, problem, vector[EQUIVALENT_STRAIN] - base[EQUIVALENT_STRAIN], tangent);
    }

private:
    StageProblem problem_of(const TrialStress& trial, const double* base, double weight) const {
        const double strain = base[EQUIVALENT_STRAIN];
        return {trial.q, 3.0 * shear, 0.0, weight, strain > 0.0 ? strain : 0.0};
    }

    // What creep leaves of the deviator.
    double share_left(const TrialStress& trial) const { return trial.q > 0.0 ? row[STRESS] / trial.q : 1.0; }

    // The vector and the stress after the creep that a trial stress brings about; the row is left at the solution.
    bool creep(const TrialStress& trial, const StageProblem& problem, const double* base, const double* guess,
               double* vector, double* stress) {
        constexpr double LAST_CORRECTION = 1e-8, FIRST_INCREMENT = 1e-6;
        if (!isfinite(trial.q)) return false;
        const double expected = guess[EQUIVALENT_STRAIN] - base[EQUIVALENT_STRAIN];
        const double first = expected > 0.0 ? expected : FIRST_INCREMENT;
        for (int64_t i = 0; i < states; ++i) row[POINT_SIZE + i] = guess[EQUIVALENT_STRAIN + 1 + i];
        StageSolution answer = {0.0, TOO_MANY};
        if (states == 0 && trial.q > 0.0) {
            answer = solve_stage_near_guess(update, theta, trial.axes, problem, row, out, first, LAST_CORRECTION);
        }
        if (answer.flag != SOLVED) {
            answer = creepkit::solve_stage(update, theta, trial.axes, problem, base + EQUIVALENT_STRAIN + 1, states,
                                           row, out, first, LAST_CORRECTION);
        }
        if (answer.flag != SOLVED) return false;
        const double flow = trial.q > 0.0 ? 1.5 * answer.increment / trial.q : 0.0;
        const double left = share_left(trial);
        for (int64_t k = 0; k < COMPONENTS; ++k) {
            vector[k] = base[k] + flow * trial.s[k];
            stress[k] = trial.mean * UNIT_TENSOR[k] + left * trial.s[k];
        }
        vector[EQUIVALENT_STRAIN] = base[EQUIVALENT_STRAIN] + answer.increment;
        for (int64_t i = 0; i < states; ++i) vector[EQUIVALENT_STRAIN + 1 + i] = row[POINT_SIZE + i];
        return true;
    }

    // Derivative of stress to strain after `creep`, (6, 6); false when it has none.
    bool stress_tangent(const TrialStress& trial, const StageProblem& problem, double increment, double* tangent) {
        for (int64_t k = 0; k < COMPONENTS * COMPONENTS; ++k) tangent[k] = stiffness(k / COMPONENTS, k % COMPONENTS);
        if (trial.q == 0.0) return true;
        update(1, row, theta, out);
        gradient_of_update(out, problem, increment, gradient, states);
        if (!differentiate_stage(trial.axes, problem, increment, row[STRESS], out + 1, gradient, matrix, response,
                                 states, 0)) {
            return false;
        }
        for (int64_t k = 0; k < INPUTS + states; ++k) {
            if (!isfinite(response[k])) return false;
        }
        const double left = share_left(trial);
        for (int64_t j = 0; j < COMPONENTS; ++j) {
            const double by_q = 3.0 * shear * COMPONENT_COUNTS[j] * trial.s[j] / trial.q;
            const double by_mean = bulk * UNIT_TENSOR[j];
            const double by_slope = (2.0 * shear * (trial.along[j] - UNIT_TENSOR[j] / 3.0) -
                                     trial.axes.principal_slope * by_q) / trial.q;
            const double by_principal = by_mean + row[STRESS] * by_slope;
            const double by_increment =
                response[BY_TRIAL] * by_q + response[BY_PRINCIPAL] * by_principal + response[BY_MEAN] * by_mean;
            const double by_share = ((1.0 - left) * by_q - problem.stiffness * by_increment) / trial.q;
            for (int64_t i = 0; i < COMPONENTS; ++i) {
                const double deviator = (i == j ? 1.0 : 0.0) - UNIT_TENSOR[i] * UNIT_TENSOR[j] / 3.0;
                tangent[i * COMPONENTS + j] =
                    UNIT_TENSOR[i] * by_mean + 2.0 * shear * left * deviator + trial.s[i] * by_share;
            }
        }
        return true;
    }
};

}  // namespace creepkit
