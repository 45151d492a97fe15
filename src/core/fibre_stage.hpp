// One implicit stage of a model of fibres: uniaxial material points that share a few generalised strains.
//
//     sigma = sum_l load_l(t) (stress_l + E strain_l) + E (modes u - c),        u = projection c
//
// with c the signed creep strain of the fibres and E the modulus, MPa. Given the loads, everything but creep is linear,
// so a section under a force and a moment has two modes, its axial strain and curvature by creep, and one whose strains
// are prescribed has none. A fibre creeps by the law's rate at |sigma|, in the direction of its stress; the law sees the
// length p of the path of its creep strain. Newton's method in u rests on the tangents of the fibres' own stages.
//
// m fibres, r modes, L loads, S states, P parameters, A lengths and other inputs, C = P + A columns of sensitivities.
// A fibre has U = 2 + S unknowns: c, p, then the states.
#pragma once

#include <math.h>
#include <stdint.h>

#include "comparison.hpp"
#include "runge_kutta_step.hpp"
#include "stage_problem.hpp"
#include "stage_solver.hpp"
#include "workspace.hpp"

namespace creepkit {

constexpr int64_t MAX_LOADS = 8;

// stress, strain : (L, m) stress in MPa, and strain, of each fibre for a unit of each load
// modes : (m, r); projection : (r, m); observed : (rows, m), what is recorded of c
// *_change : (A, ...) their derivatives to the inputs; offsets : (A, 2) K, and relative change of the modulus, per unit
struct FibreModel {
    int64_t fibres, modes, loads, rows, inputs;
    const double *stress, *strain, *mode_strains, *projection, *observed;
    const double *stress_change, *strain_change, *mode_change, *projection_change, *offsets;
};

// A stretch of the programs: (2 + 2 (L + 2),) start, end, s, then every load, temperature and modulus at both.
struct FibreSegment {
    const double* row;
    int64_t loads;

    double start() const { return row[0]; }
    double end() const { return row[1]; }
    double rate(int64_t k) const { return (row[3 + 2 * k] - row[2 + 2 * k]) / (row[1] - row[0]); }
    double at(int64_t k, double time) const { return row[2 + 2 * k] + rate(k) * (time - row[0]); }
    double temperature(double time) const { return at(loads, time); }
    double modulus(double time) const { return at(loads + 1, time); }
};

// What all fibres of a stage have in common: weight, s, temperature, K, modulus, MPa, and the loads.
struct FibreStage {
    double time, weight, share, temperature, modulus, load[MAX_LOADS];
};

// Working arrays.
//
// value, new_value : (m, U); change, new_change : (m, U, C)
// slopes, past_slopes : (stages, m, U); start_slopes : (m, U); slope_changes : (stages, m, U, C)
// base : (m, U) and base_change (m, U, C) history of a stage; rows : (m, 6 + S) law's input of each fibre
// increment, sign, stress, tangent : (m,) D, direction and size of the stress of a stage, dD/dtrial
// state_tangent : (m, S); u, past_u, last, jacobian, right : modes; the rest is room for the law
struct FibreWorkspace {
    int64_t fibres, states, parameters, columns, stages, modes, unknowns, width;
    double *value, *new_value, *change, *new_change, *slopes, *past_slopes, *start_slopes, *slope_changes;
    double *base, *base_change, *rows, *increment, *sign, *stress, *tangent, *state_tangent;
    double *stage_u, *u, *last, *jacobian, *right, *out, *full, *gradient, *matrix, *response;
    double *observed, *observed_slopes, *observed_change, *observed_slope_changes, *rates;
    FibreStage* stage;

    FibreWorkspace(Workspace& memory, const FibreModel& model, int64_t states, int64_t parameters, int64_t stages,
                   bool sensitivities)
        : fibres(model.fibres),
          states(states),
          parameters(sensitivities ? parameters : 0),
          columns(sensitivities ? parameters + model.inputs : 0),
          stages(stages),
          modes(model.modes),
          unknowns(2 + states),
          width(POINT_SIZE + states) {
        const int64_t size = fibres * unknowns, law = 1 + states;
        value = memory.doubles(size);
        new_value = memory.doubles(size);
        change = memory.doubles(size * columns);
        new_change = memory.doubles(size * columns);
        slopes = memory.doubles(stages * size);
        past_slopes = memory.doubles(stages * size);
        start_slopes = memory.doubles(size);
        slope_changes = memory.doubles(stages * size * columns);
        base = memory.doubles(size);
        base_change = memory.doubles(size * columns);
        rows = memory.doubles(fibres * width);
        increment = memory.doubles(fibres);
        sign = memory.doubles(fibres);
        stress = memory.doubles(fibres);
        tangent = memory.doubles(fibres);
        state_tangent = memory.doubles(fibres * states);
        stage_u = memory.doubles(stages * modes);
        u = memory.doubles(modes);
        last = memory.doubles(modes);
        jacobian = memory.doubles(modes * modes);
        right = memory.doubles(modes * larger_count(1, columns));
        out = memory.doubles(law * (1 + width));
        full = memory.doubles(law * (1 + width + parameters));
        gradient = memory.doubles(law * width);
        matrix = memory.doubles(law * law);
        response = memory.doubles(law * (INPUTS + states + parameters));
        observed = memory.doubles(model.rows);
        observed_slopes = memory.doubles(stages * model.rows);
        observed_change = memory.doubles(model.rows * columns);
        observed_slope_changes = memory.doubles(stages * model.rows * columns);
        rates = memory.doubles(fibres);
        stage = memory.array<FibreStage>(stages);
    }

    int64_t size() const { return fibres * unknowns; }

private:
    static int64_t larger_count(int64_t a, int64_t b) { return a > b ? a : b; }
};

// Stress of fibre i but for its own creep, MPa: of the loads, and of the modes.
inline double elastic_stress(const FibreModel& model, const FibreStage& now, int64_t i, const double* u) {
    double total = 0.0, strain = 0.0;
    for (int64_t l = 0; l < model.loads; ++l) {
        total += now.load[l] * model.stress[l * model.fibres + i];
        strain += now.load[l] * model.strain[l * model.fibres + i];
    }
    for (int64_t r = 0; r < model.modes; ++r) strain += model.mode_strains[i * model.modes + r] * u[r];
    return total + now.modulus * strain;
}

// u = projection c; creep : the first of the unknowns (m, U).
inline void project(const FibreModel& model, const double* creep, int64_t stride, double* u) {
    for (int64_t r = 0; r < model.modes; ++r) {
        u[r] = 0.0;
        for (int64_t i = 0; i < model.fibres; ++i) u[r] += model.projection[r * model.fibres + i] * creep[i * stride];
    }
}

// Common data of the stage at a time, with weight gamma h dt/ds.
inline FibreStage fibre_stage(const FibreModel& model, const FibreSegment& segment, double time, double weight,
                              double share) {
    FibreStage now = {time, weight, share, segment.temperature(time), segment.modulus(time), {}};
    for (int64_t l = 0; l < model.loads; ++l) now.load[l] = segment.at(l, time);
    return now;
}

// How well stages are solved: Newton's tolerance of ln D, and errors of D, strain, that need not be removed.
struct FibreTolerance {
    double newton, negligible;
};

// Solve the stage of fibre i for the trial stress without further creep, signed, MPa. Fills D, tangent, row, stress.
inline bool solve_fibre(const LawCall& law, const FibreStage& now, FibreWorkspace& work, int64_t i, double trial,
                        const FibreTolerance& tolerance) {
    const int64_t states = work.states, columns = INPUTS + states;
    const double *base = work.base + i * work.unknowns, sign = trial < 0.0 ? -1.0 : 1.0;
    double* row = work.rows + i * work.width;
    row[TIME] = now.time;
    row[TEMPERATURE] = now.temperature;
    const StageProblem problem = {fabs(trial), now.modulus, 0.0, now.weight, larger(0.0, base[1])};
    const Axes& axes = axes_of(sign);
    StageSolution answer = {0.0, TOO_MANY};
    const double guess = larger(work.increment[i], 1e-30);
    if (states == 0 && problem.trial > 0.0) {
        answer = solve_stage_near_guess(law.update, law.theta, axes, problem, row, work.out, guess, tolerance.newton,
                                        tolerance.negligible);
    }
    if (answer.flag != SOLVED) {
        answer = solve_stage(law.update, law.theta, axes, problem, base + 2, states, row, work.out, guess,
                             tolerance.newton, tolerance.negligible);
    }
    if (answer.flag != SOLVED) return false;
    work.increment[i] = answer.increment;
    work.sign[i] = sign;
    work.stress[i] = problem.trial - now.modulus * answer.increment;
    work.tangent[i] = 0.0;
    for (int64_t j = 0; j < states; ++j) work.state_tangent[i * states + j] = 0.0;
    if (!(answer.increment > 0.0)) return true;
    gradient_of_update(work.out, problem, answer.increment, work.gradient, states);
    if (!differentiate_stage(axes, problem, answer.increment, work.stress[i], work.out + 1, work.gradient,
                             work.matrix, work.response, states, 0)) {
        return false;
    }
    work.tangent[i] = work.response[BY_TRIAL];
    for (int64_t j = 0; j < states; ++j) {
        work.state_tangent[i * states + j] = work.response[(1 + j) * columns + BY_TRIAL];
    }
    return isfinite(work.tangent[i]);
}

// Jacobian (r, r) of u - projection c(u) from the tangents of the fibres.
inline void mode_jacobian(const FibreModel& model, const FibreStage& now, FibreWorkspace& work) {
    for (int64_t r = 0; r < model.modes; ++r) {
        for (int64_t q = 0; q < model.modes; ++q) {
            double total = r == q ? 1.0 : 0.0;
            for (int64_t i = 0; i < model.fibres; ++i) {
                total -= model.projection[r * model.fibres + i] * now.modulus * work.tangent[i] *
                         model.mode_strains[i * model.modes + q];
            }
            work.jacobian[r * model.modes + q] = total;
        }
    }
}

// Solve a stage for all fibres; work.base, guesses of the increments and of work.u, and of the states, are there.
inline bool solve_fibres(const LawCall& law, const FibreModel& model, const FibreStage& now, FibreWorkspace& work,
                         const FibreTolerance& tolerance) {
    constexpr int ITERATIONS = 25;
    const int64_t modes = model.modes, U = work.unknowns;
    double before = INFINITY;
    for (int iteration = 0; iteration < ITERATIONS; ++iteration) {
        double largest = 0.0;
        for (int64_t i = 0; i < model.fibres; ++i) {
            const double trial = elastic_stress(model, now, i, work.u) - now.modulus * work.base[i * U];
            if (!solve_fibre(law, now, work, i, trial, tolerance)) return false;
            largest = larger(largest, work.stress[i]);
        }
        if (modes == 0) return true;
        double size = 0.0;
        for (int64_t r = 0; r < modes; ++r) {
            double total = work.u[r];
            for (int64_t i = 0; i < model.fibres; ++i) {
                const double creep = work.base[i * U] + work.sign[i] * work.increment[i];
                total -= model.projection[r * model.fibres + i] * creep;
            }
            work.right[r] = -total;
            size += total * total;
        }
        if (!isfinite(size)) return false;
        if (size > 4.0 * before) {  // a correction that went too far is halved
            for (int64_t r = 0; r < modes; ++r) {
                work.last[r] *= 0.5;
                work.u[r] -= work.last[r];
            }
            continue;
        }
        before = size;
        mode_jacobian(model, now, work);
        if (!solve_dense(work.jacobian, work.right, modes, 1)) return false;
        double correction = 0.0;
        for (int64_t i = 0; i < model.fibres; ++i) {
            double strain = 0.0;
            for (int64_t r = 0; r < modes; ++r) strain += model.mode_strains[i * modes + r] * work.right[r];
            correction = larger(correction, fabs(strain));
        }
        for (int64_t r = 0; r < modes; ++r) work.u[r] += work.last[r] = work.right[r];
        if (!(now.modulus * correction <= tolerance.newton * largest || correction <= 1e-14)) continue;
        for (int64_t i = 0; i < model.fibres; ++i) {  // the last correction, to first order
            double stress = 0.0;
            for (int64_t r = 0; r < modes; ++r) stress += model.mode_strains[i * modes + r] * work.right[r];
            stress *= now.modulus * work.sign[i];
            const double more = work.tangent[i] * stress;
            work.stress[i] = larger(0.0, work.stress[i] + stress - now.modulus * more);
            work.increment[i] = larger(0.0, work.increment[i] + more);
            for (int64_t j = 0; j < work.states; ++j) {
                work.rows[i * work.width + POINT_SIZE + j] += work.state_tangent[i * work.states + j] * stress;
            }
        }
        return true;
    }
    return false;
}

}  // namespace creepkit
