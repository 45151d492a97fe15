// Derivatives of a step of a model of fibres with respect to the law's parameters and to its other inputs.
//
// They are the exact derivatives of the discrete scheme at fixed positions of its steps.
#pragma once

#include <math.h>
#include <stdint.h>

#include "fibre_stage.hpp"

namespace creepkit {

// Change of a fibre's trial stress with input `a`, what the modes gain apart.
inline double trial_change(const FibreModel& model, const FibreStage& now, int64_t i, int64_t a, const double* u,
                           double creep) {
    const int64_t m = model.fibres, L = model.loads, R = model.modes;
    double stress = 0.0, strain = 0.0, moved = 0.0;
    for (int64_t l = 0; l < L; ++l) {
        stress += now.load[l] * model.stress_change[(a * L + l) * m + i];
        moved += now.load[l] * model.strain_change[(a * L + l) * m + i];
        strain += now.load[l] * model.strain[l * m + i];
    }
    for (int64_t r = 0; r < R; ++r) {
        moved += u[r] * model.mode_change[(a * m + i) * R + r];
        strain += u[r] * model.mode_strains[i * R + r];
    }
    return stress + now.modulus * (moved + model.offsets[2 * a + 1] * (strain - creep));
}

// Derivatives (1 + S, C) of D and z of fibre i at fixed u into `result`; its tangents are in the workspace then.
inline bool differentiate_fibre(const LawCall& law, const FibreModel& model, const FibreStage& now,
                                FibreWorkspace& work, int64_t i, const double* u, double* result) {
    const int64_t S = work.states, P = work.parameters, C = work.columns, U = work.unknowns, law_size = 1 + S;
    const int64_t columns = INPUTS + S + P;
    const double *base = work.base + i * U, sign = work.sign[i], increment = work.increment[i];
    const double* base_change = work.base_change + i * U * C;
    double* row = work.rows + i * work.width;
    row[TIME] = now.time;
    row[TEMPERATURE] = now.temperature;
    const double stress = work.stress[i], trial = stress + now.modulus * increment;
    const StageProblem problem = {trial, now.modulus, 0.0, now.weight, larger(0.0, base[1])};
    write_point(row, axes_of(sign), stress, problem.strain + increment);
    law.sensitivity(1, row, law.theta, work.full);
    gradient_of_sensitivity(work.full, problem, increment, work.gradient, S);
    const double* by_parameter = work.full + law_size * (1 + work.width);
    for (int64_t v = 0; v < law_size; ++v) {
        double* response = work.response + v * columns + INPUTS + S;
        const bool moves = v > 0 || (stress > 0.0 && increment > 0.0);
        for (int64_t p = 0; p < P; ++p) response[p] = moves ? now.weight * by_parameter[v * P + p] : 0.0;
    }
    if (!differentiate_stage(axes_of(sign), problem, increment, stress, work.full + 1, work.gradient, work.matrix,
                             work.response, S, P)) {
        return false;
    }
    const double seen = base[1] >= 0.0 ? 1.0 : 0.0;
    for (int64_t v = 0; v < law_size; ++v) {
        const double* answer = work.response + v * columns;
        for (int64_t q = 0; q < C; ++q) {
            double total = seen * answer[BY_STRAIN] * base_change[C + q];
            total -= answer[BY_TRIAL] * sign * now.modulus * base_change[q];
            for (int64_t j = 0; j < S; ++j) total += answer[INPUTS + j] * base_change[(2 + j) * C + q];
            if (q < P) {
                total += answer[INPUTS + S + q];
            } else {
                const int64_t a = q - P;
                const double softer = now.modulus * model.offsets[2 * a + 1] * increment;
                total += answer[BY_TRIAL] * (sign * trial_change(model, now, i, a, u, base[0]) - softer);
                total += answer[BY_TEMPERATURE] * model.offsets[2 * a];
            }
            result[v * C + q] = total;
        }
    }
    work.tangent[i] = work.response[BY_TRIAL];
    for (int64_t j = 0; j < S; ++j) work.state_tangent[i * S + j] = work.response[(1 + j) * columns + BY_TRIAL];
    return true;
}

// Derivatives of u to every column into work.right (r, C), from those of the fibres at fixed u, (m, U, C).
inline bool differentiate_modes(const FibreModel& model, const FibreStage& now, FibreWorkspace& work,
                                const double* changes) {
    const int64_t C = work.columns, U = work.unknowns, P = work.parameters, m = model.fibres;
    for (int64_t r = 0; r < model.modes; ++r) {
        double* right = work.right + r * C;
        for (int64_t q = 0; q < C; ++q) right[q] = 0.0;
        for (int64_t i = 0; i < m; ++i) {
            const double weight = model.projection[r * m + i];
            const double creep = work.base[i * U] + work.sign[i] * work.increment[i];
            const double *own = changes + i * U * C, *before = work.base_change + i * U * C;
            for (int64_t q = 0; q < C; ++q) right[q] += weight * (before[q] + work.sign[i] * own[q]);
            for (int64_t a = 0; a < model.inputs; ++a) {
                right[P + a] += model.projection_change[(a * model.modes + r) * m + i] * creep;
            }
        }
    }
    mode_jacobian(model, now, work);
    return model.modes == 0 || solve_dense(work.jacobian, work.right, model.modes, C);
}

// Derivatives of the slopes of stage k, after its solution; work.base holds its history.
inline bool differentiate_fibre_stage(const LawCall& law, const FibreModel& model, const Tableau& tableau,
                                      FibreWorkspace& work, double h, int64_t k) {
    const int64_t C = work.columns, U = work.unknowns, S = work.states, size = work.size() * C;
    const FibreStage& now = work.stage[k];
    for (int64_t n = 0; n < size; ++n) work.base_change[n] = work.change[n];
    for (int64_t j = 0; j < k; ++j) {
        const double weight = h * tableau.a[k * tableau.stages + j];
        const double* earlier = work.slope_changes + j * size;
        for (int64_t n = 0; n < size; ++n) work.base_change[n] += weight * earlier[n];
    }
    double* changes = work.slope_changes + k * size;
    // D and the states go to the rows 1 .. 1 + S of a fibre first, and row 0, signed creep, follows from D at the end
    for (int64_t i = 0; i < model.fibres; ++i) {
        double* own = changes + i * U * C;
        if (!differentiate_fibre(law, model, now, work, i, work.u, own + C)) return false;
        for (int64_t q = 0; q < C; ++q) own[q] = own[C + q];
    }
    if (!differentiate_modes(model, now, work, changes)) return false;
    for (int64_t i = 0; i < model.fibres; ++i) {
        double* own = changes + i * U * C;
        const double *before = work.base_change + i * U * C, sign = work.sign[i];
        for (int64_t q = 0; q < C; ++q) {
            double strain = 0.0;
            for (int64_t r = 0; r < model.modes; ++r) {
                strain += model.mode_strains[i * model.modes + r] * work.right[r * C + q];
            }
            const double stress = sign * now.modulus * strain;
            const double increment = own[C + q] + work.tangent[i] * stress;
            own[q] = sign * increment / now.share;
            own[C + q] = increment / now.share;
            for (int64_t j = 0; j < S; ++j) {
                const int64_t at = (2 + j) * C + q;
                own[at] = (own[at] + work.state_tangent[i * S + j] * stress - before[at]) / now.share;
            }
        }
    }
    return true;
}

}  // namespace creepkit
