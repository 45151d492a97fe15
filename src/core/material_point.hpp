// The material points of a finite element: Hencky elasticity, von Mises creep by the Cauchy stress, for the eight points of
// one call of the law.
//
// w = (E33 - tr E/3, E11 - E22, 2 E12) less the creep components of the same form is the elastic deviator, and
// e^2 = w1^2 + (w2^2 + w3^2)/3. The trial stress 3G e/J and the creep increment D give the von Mises stress
// 3G (e - D)/J of the Cauchy stress, J = det F, at which the law is evaluated: the stage problem of stage_problem.hpp.
// Creep flows along w/e.
#pragma once

#include "kinematics.hpp"
#include "law.hpp"
#include "stage_problem.hpp"
#include "stage_solver.hpp"

namespace creepkit {

constexpr int CREEP_COMPONENTS = 3, EQUIVALENT_STRAIN = 3, STAGES = 2;

// What all points of a stage share: weight gamma h dt/ds in s (0 for a purely elastic change) and its logarithm, time
// s, temperature K, bulk and shear modulus MPa, pressure MPa.
struct StageConditions {
    double weight, log_weight, time, temperature, bulk, shear, pressure;
};

// A law with its parameters (internal values) and its number of states S.
struct PointLaw {
    LawEntry update, sensitivity;
    const double* theta;
    int64_t parameters, states;
};

// The state of all points. An array of several quantities has one after the other, `count` numbers each; count is a
// multiple of eight, the last points may be copies of no weight. V = 3 + 1 + S.
//
// value : (V, count) creep components, equivalent creep strain, states, at the start of the step.
// base : (V, count) history of the stage. increments : (count,) D. states : (S, count) at the end of the stage.
// slopes : (STAGES, V, count) d value/ds. mises : (count,) von Mises stress of the Cauchy stress, MPa.
// directions : (3, count) w/e. deviator : (6, count) derivatives of the stress components y that are conjugate to w,
//     from the last tangent: 11, 22, 33, 12, 13, 23. trials : (count,) trial stress at which D was found last, MPa
//     (negative: none in this stage). by_trial : (count,) dD/d(trial stress) of the last tangent.
// shifted : whether D follows more than the trial stress: internal variables, largest principal or mean stress.
struct PointStates {
    int64_t count, states, values;
    bool shifted;
    double *value, *base, *increments, *state, *slopes, *mises, *directions, *deviator, *trials, *by_trial;

    template <class Memory>
    void take(Memory& memory, int64_t points, int64_t state_count) {
        count = points;
        states = state_count;
        shifted = states > 0;
        values = EQUIVALENT_STRAIN + 1 + state_count;
        value = memory.doubles(values * count);
        base = memory.doubles(values * count);
        increments = memory.doubles(count);
        state = memory.doubles(states * count);
        slopes = memory.doubles(STAGES * values * count);
        mises = memory.doubles(count);
        directions = memory.doubles(CREEP_COMPONENTS * count);
        deviator = memory.doubles(6 * count);
        trials = memory.doubles(count);
        by_trial = memory.doubles(count);
    }
};

// The elastic predictor: w, its size e and 1/e (0 where it is 0), tr E, 3G/J and mean Cauchy stress in MPa, and the
// largest principal value of the unit deviator over its von Mises stress.
struct ElasticPredictor {
    Vector hoop, difference, shear, equivalent, inverse, trace, stiffness, mean, top;
};

// Derivatives of D to the trial stress, and to shifts of the largest principal and of the mean stress.
struct CreepDerivatives {
    Vector by_trial, by_principal, by_mean;

    CREEPKIT_INLINE bool shifted() const {
        const Vector zero{};
        return any((by_principal < zero) | (by_principal > zero) | (by_mean < zero) | (by_mean > zero));
    }
};

// base : (3, stride) creep components of these points.
CREEPKIT_INLINE ElasticPredictor elastic_predictor(const StageConditions& stage, const Kinematics& at,
                                                   const double* base, int64_t stride) {
    ElasticPredictor p;
    p.trace = at.strain[SUM] + at.strain[HOOP];
    p.hoop = at.strain[HOOP] - p.trace * (1.0 / 3.0) - load(base);
    p.difference = at.strain[DIFFERENCE] - load(base + stride);
    p.shear = at.strain[SHEAR] - load(base + 2 * stride);
    const Vector radius2 = p.difference * p.difference + p.shear * p.shear;
    p.equivalent = square_root(p.hoop * p.hoop + radius2 * (1.0 / 3.0));
    p.inverse = select(p.equivalent > Vector{}, 1.0 / p.equivalent, Vector{});
    p.stiffness = 3.0 * stage.shear * at.inverse_volume;
    p.mean = stage.bulk * p.trace * at.inverse_volume;
    p.top = larger(2.0 * p.hoop, square_root(radius2) - p.hoop) * p.inverse * (1.0 / 3.0);
    return p;
}

// The log-conjugate stress.
CREEPKIT_INLINE void log_stress(const StageConditions& stage, const ElasticPredictor& p, Vector increment,
                                Vector stress[4]) {
    const Vector left = 1.0 - increment * p.inverse, pressure = stage.bulk * p.trace, shear = stage.shear * left;
    const Vector hoop = shear * p.hoop;
    stress[SUM] = pressure - hoop;
    stress[DIFFERENCE] = shear * p.difference;
    stress[HOOP] = pressure + 2.0 * hoop;
    stress[SHEAR] = shear * p.shear;
}

// Derivatives (4,) of what depends on trial, largest principal and mean stress to w (three) and to tr E.
//
// The largest principal Cauchy stress is the mean plus top times the von Mises stress.
CREEPKIT_INLINE void strain_derivatives(const StageConditions& stage, const ElasticPredictor& p, Vector increment,
                                        const CreepDerivatives& by, Vector follow[4]) {
    const Vector stress = p.stiffness * (p.equivalent - increment), along = by.by_trial * p.stiffness * p.inverse;
    follow[0] = along * p.hoop;
    follow[1] = along * p.difference * (1.0 / 3.0);
    follow[2] = along * p.shear * (1.0 / 3.0);
    follow[3] = -(by.by_trial * stress);
    if (!by.shifted()) return;
    const Vector zero{};
    const Vector radius = square_root(p.difference * p.difference + p.shear * p.shear);
    const Vector turned = by.by_principal * stress * p.inverse * (1.0 / 3.0);
    const Vector shrink = by.by_principal * stress * p.top * p.inverse * p.inverse;
    const Mask hoop_is_largest = 2.0 * p.hoop > radius - p.hoop;
    const Vector over_radius = select(radius > zero, 1.0 / radius, zero);
    follow[0] += select(hoop_is_largest, 2.0 * turned, -turned) - shrink * p.hoop;
    follow[1] += select(hoop_is_largest, zero, turned * p.difference * over_radius) - shrink * p.difference * (1.0 / 3.0);
    follow[2] += select(hoop_is_largest, zero, turned * p.shear * over_radius) - shrink * p.shear * (1.0 / 3.0);
    follow[3] += (by.by_mean + by.by_principal) * (p.stiffness * (stage.bulk / (3.0 * stage.shear)) - p.mean);
}

// Consistent tangent dT/dE, exact or its symmetric part, and the derivatives dy/dw of the stresses conjugate to w.
//
// follow : derivatives of D to w and to tr E. y_i = 3G (1 - D/e) g_i w_i is conjugate to w_i, g = (1, 1/3, 1/3), and
// dy_i = 3G (1 - D/e) g_i dw_i + g_i w_i (v_j dw_j + v_t dtr).
template <bool SYMMETRIC>
CREEPKIT_INLINE void tangent_moduli(const StageConditions& stage, const ElasticPredictor& p, Vector increment,
                                    const Vector follow[4], Vector moduli[4][4], Vector by_w[3][3]) {
    const double shear3 = 3.0 * stage.shear, third = 1.0 / 3.0, bulk = stage.bulk;
    const Vector left = 1.0 - increment * p.inverse, factor = shear3 * p.inverse;
    const Vector d[3] = {p.hoop, p.difference * third, p.shear * third};
    const Vector bend = factor * increment * p.inverse * p.inverse, vt = -(factor * follow[3]);
    const Vector stiffness[3] = {shear3 * left, stage.shear * left, stage.shear * left};
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) by_w[i][j] = d[i] * (bend * d[j] - factor * follow[j]);
        by_w[i][i] += stiffness[i];
    }
    if (SYMMETRIC)
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < i; ++j) by_w[i][j] = by_w[j][i] = 0.5 * (by_w[i][j] + by_w[j][i]);
    const Vector t0 = d[0] * vt, t1 = d[1] * vt, t2 = d[2] * vt;
    // w1 changes by -1/3 with E11 + E22 and by 2/3 with E33; the trace by one with both
    const Vector s = t0 - third * by_w[0][0], h = t0 + 2.0 * third * by_w[0][0];
    moduli[SUM][SUM] = bulk - third * s;
    moduli[SUM][HOOP] = bulk - third * h;
    moduli[HOOP][SUM] = bulk + 2.0 * third * s;
    moduli[HOOP][HOOP] = bulk + 2.0 * third * h;
    moduli[SUM][DIFFERENCE] = -third * by_w[0][1];
    moduli[HOOP][DIFFERENCE] = 2.0 * third * by_w[0][1];
    moduli[SUM][SHEAR] = -third * by_w[0][2];
    moduli[HOOP][SHEAR] = 2.0 * third * by_w[0][2];
    moduli[DIFFERENCE][SUM] = t1 - third * by_w[1][0];
    moduli[DIFFERENCE][HOOP] = t1 + 2.0 * third * by_w[1][0];
    moduli[SHEAR][SUM] = t2 - third * by_w[2][0];
    moduli[SHEAR][HOOP] = t2 + 2.0 * third * by_w[2][0];
    moduli[DIFFERENCE][DIFFERENCE] = by_w[1][1];
    moduli[DIFFERENCE][SHEAR] = by_w[1][2];
    moduli[SHEAR][DIFFERENCE] = by_w[2][1];
    moduli[SHEAR][SHEAR] = by_w[2][2];
    if (SYMMETRIC)
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < i; ++j) moduli[i][j] = moduli[j][i] = 0.5 * (moduli[i][j] + moduli[j][i]);
}

enum PointFlag { POINTS_SOLVED, INVERTED, POINT_FAILED, RATE_UNDEFINED };

// What one point alone needs of the elastic predictors of eight.
struct PointPredictor {
    double equivalent, stiffness, mean, top;

    PointPredictor(const ElasticPredictor predictors[VECTORS], int point) {
        const ElasticPredictor& p = predictors[point / LANES];
        const int lane = point % LANES;
        equivalent = p.equivalent[lane], stiffness = p.stiffness[lane], mean = p.mean[lane], top = p.top[lane];
    }
};

// Point k by the solver for any guess and any law; writes D, the states and the law's output there.
//
// out : (1 + S) (7 + S) numbers of the last evaluation.
inline PointFlag solve_point(const PointLaw& law, const StageConditions& stage, const PointPredictor& p,
                             PointStates& points, int64_t k, double tolerance, double* out) {
    double row[POINT_SIZE + MAX_STATES], history[MAX_STATES];
    row[TIME] = stage.time;
    row[TEMPERATURE] = stage.temperature;
    for (int64_t i = 0; i < law.states; ++i) {
        row[POINT_SIZE + i] = points.state[i * points.count + k];
        history[i] = points.base[(EQUIVALENT_STRAIN + 1 + i) * points.count + k];
    }
    const Axes axes = {p.mean, p.top, p.mean, 0.0};
    const StageProblem problem = {p.stiffness * p.equivalent, p.stiffness, 0.0, stage.weight,
                                  points.base[EQUIVALENT_STRAIN * points.count + k]};
    double guess = points.increments[k];
    if (!(guess > 0.0)) guess = 1e-6 * p.equivalent;
    const StageSolution solution = solve_stage(law.update, law.theta, axes, problem, history, law.states, row, out,
                                               guess, tolerance);
    if (solution.flag != SOLVED) return solution.flag == NOT_FINITE ? RATE_UNDEFINED : POINT_FAILED;
    points.increments[k] = solution.increment;
    for (int64_t i = 0; i < law.states; ++i) points.state[i * points.count + k] = row[POINT_SIZE + i];
    return POINTS_SOLVED;
}

// The unknown of Newton's method at the points of a vector, D over the equivalent strain of the predictor, and what
// does not change in its course; of points at rest, where that is zero, it is one.
struct CreepIteration {
    Vector equivalent, trial, strain, guess, share;
    Mask resting;

    CREEPKIT_INLINE void begin(const ElasticPredictor& p, const PointStates& points,
                               int64_t k) {
        const Vector zero{};
        resting = ~(p.equivalent > zero);
        equivalent = select(resting, splat(1.0), p.equivalent);
        trial = p.stiffness * equivalent;
        strain = load(points.base + EQUIVALENT_STRAIN * points.count + k);
        // first guess: the last increment, moved along the last tangent with the trial stress
        const Vector last = load(points.increments + k), before = load(points.trials + k);
        const Vector moved = last + load(points.by_trial + k) * (trial - before);
        guess = select((before >= zero) & (moved > zero), moved, last);
        guess = select(guess > zero, guess, 1e-6 * equivalent);
        share = smaller(guess / equivalent, splat(0.9999));
        share = select((share > splat(1e-280)) & ~resting, share, splat(1e-6));
    }
};

// Creep increments of eight points of a law without states, into points.increments, and the derivatives of D.
//
// Newton's method in ln[D/(1 - k D/trial)], on all eight side by side; if a point leaves its range or does not settle,
// each is solved alone.
inline PointFlag creep_increments(const PointLaw& law, const StageConditions& stage,
                                  const ElasticPredictor predictors[VECTORS], PointStates& points, int64_t k,
                                  double tolerance, CreepDerivatives by[VECTORS]) {
    constexpr int ITERATIONS = 12;
    constexpr double LONGEST = 3.0;  // correction of ln[D/(1 - k D/trial)]
    alignas(64) double x[POINT_SIZE * EIGHT], out[(1 + POINT_SIZE) * EIGHT];
    const Vector zero{};
    CreepIteration iterations[VECTORS];
    bool settled = true, regular = true;
    for (int v = 0; v < VECTORS; ++v) {
        iterations[v].begin(predictors[v], points, k + v * LANES);
        store(x + TIME * EIGHT + v * LANES, splat(stage.time));
        store(x + TEMPERATURE * EIGHT + v * LANES, splat(stage.temperature));
        store(x + MEAN_STRESS * EIGHT + v * LANES, predictors[v].mean);
        settled = settled && !any(~iterations[v].resting);
    }
    if (settled) memset(out, 0, sizeof out);
    for (int iteration = 0; iteration < ITERATIONS && regular && !settled; ++iteration) {
        for (int v = 0; v < VECTORS; ++v) {
            const CreepIteration& now = iterations[v];
            const Vector stress = now.trial * (1.0 - now.share);
            double* row = x + v * LANES;
            store(row + STRESS * EIGHT, stress);
            store(row + STRAIN * EIGHT, now.strain + now.equivalent * now.share);
            store(row + PRINCIPAL_STRESS * EIGHT, predictors[v].mean + predictors[v].top * stress);
        }
        law.update(EIGHT, x, law.theta, out);
        Mask strange{}, moving{};
        for (int v = 0; v < VECTORS; ++v) {
            CreepIteration& now = iterations[v];
            const double* row = out + v * LANES;
            const Vector left = 1.0 - now.share, stress = now.trial * left, increment = now.equivalent * now.share;
            const Vector by_stress = load(row + (1 + STRESS) * EIGHT) +
                                     predictors[v].top * load(row + (1 + PRINCIPAL_STRESS) * EIGHT);
            const Vector rate = load(row), residual = logarithm(increment) - stage.log_weight - rate;
            const Vector slope = left * (1.0 - increment * load(row + (1 + STRAIN) * EIGHT)) +
                                 now.share * stress * by_stress;
            Vector step = -(residual / slope);
            strange |= ~(now.resting | ((slope > zero) & (rate > splat(NO_RATE)) & (magnitude(step) < splat(1e3))));
            step = select(now.resting, zero, larger(splat(-LONGEST), smaller(splat(LONGEST), step)));
            const Vector grown = now.share * exponential(step);
            now.share = larger(splat(1e-290), smaller(splat(1.0 - 1e-9), grown / (left + grown)));
            moving |= magnitude(step) > splat(tolerance);
        }
        regular = !any(strange);
        settled = regular && !any(moving);
    }
    for (int v = 0; v < VECTORS; ++v) {
        const CreepIteration& now = iterations[v];
        store(points.increments + k + v * LANES,
              settled ? select(now.resting, zero, now.equivalent * now.share) : now.guess);
    }
    for (int point = 0; point < EIGHT && !settled; ++point) {
        double alone[1 + POINT_SIZE] = {};
        const PointPredictor p(predictors, point);
        if (!(p.equivalent > 0.0)) {
            points.increments[k + point] = 0.0;
        } else {
            const PointFlag flag = solve_point(law, stage, p, points, k + point, tolerance, alone);
            if (flag != POINTS_SOLVED) return flag;
        }
        for (int row = 0; row <= POINT_SIZE; ++row) out[row * EIGHT + point] = alone[row];
    }
    for (int v = 0; v < VECTORS; ++v) {
        const double* row = out + v * LANES;
        const Vector increment = load(points.increments + k + v * LANES);
        const Vector by_principal = load(row + (1 + PRINCIPAL_STRESS) * EIGHT);
        const Vector along = increment * (load(row + (1 + STRESS) * EIGHT) + predictors[v].top * by_principal);
        const Vector divisor = 1.0 / (1.0 + along * predictors[v].stiffness -
                                      increment * load(row + (1 + STRAIN) * EIGHT));
        const Mask creeps = increment > zero;
        by[v].by_trial = select(creeps, along * divisor, zero);
        by[v].by_principal = select(creeps, increment * by_principal * divisor, zero);
        by[v].by_mean = select(creeps, increment * load(row + (1 + MEAN_STRESS) * EIGHT) * divisor, zero);
    }
    return POINTS_SOLVED;
}

// The same for a law with states, one point after another.
inline PointFlag creep_increments_with_states(const PointLaw& law, const StageConditions& stage,
                                              const ElasticPredictor predictors[VECTORS], PointStates& points,
                                              int64_t k, double tolerance, CreepDerivatives by[VECTORS]) {
    double out[(1 + MAX_STATES) * (7 + MAX_STATES)], gradient[(1 + MAX_STATES) * (POINT_SIZE + MAX_STATES)];
    double matrix[(1 + MAX_STATES) * (1 + MAX_STATES)], response[(1 + MAX_STATES) * (INPUTS + MAX_STATES)];
    for (int lane = 0; lane < EIGHT; ++lane) {
        const int64_t point = k + lane;
        const PointPredictor p(predictors, lane);
        if (!(p.equivalent > 0.0)) {
            points.increments[point] = 0.0;
            continue;
        }
        const double trial = p.stiffness * p.equivalent;
        if (points.trials[point] >= 0.0) {
            const double guess = points.increments[point] + points.by_trial[point] * (trial - points.trials[point]);
            if (guess > 0.0) points.increments[point] = guess;
        }
        const PointFlag flag = solve_point(law, stage, p, points, point, tolerance, out);
        if (flag != POINTS_SOLVED) return flag;
        const double creep = points.increments[point];
        if (!(creep > 0.0)) continue;
        const Axes axes = {p.mean, p.top, p.mean, 0.0};
        const StageProblem problem = {trial, p.stiffness, 0.0, stage.weight, 0.0};
        gradient_of_update(out, problem, creep, gradient, law.states);
        if (!differentiate_stage(axes, problem, creep, trial - p.stiffness * creep, out + 1, gradient, matrix, response,
                                 law.states, 0))
            continue;
        CreepDerivatives& derivatives = by[lane / LANES];
        derivatives.by_trial[lane % LANES] = response[BY_TRIAL];
        derivatives.by_principal[lane % LANES] = response[BY_PRINCIPAL];
        derivatives.by_mean[lane % LANES] = response[BY_MEAN];
    }
    return POINTS_SOLVED;
}

// Keep what has become of the points of a vector by their increments.
CREEPKIT_INLINE void keep_points(PointStates& points, int64_t k, const ElasticPredictor& p, Vector trial,
                                 Vector increment) {
    store(points.trials + k, trial);
    store(points.mises + k, trial - p.stiffness * increment);
    store(points.directions + k, p.hoop * p.inverse);
    store(points.directions + points.count + k, p.difference * p.inverse);
    store(points.directions + 2 * points.count + k, p.shear * p.inverse);
}

// Move the points of a vector to another predictor, their increments with the trial stress along the last tangent.
CREEPKIT_INLINE void move_points(PointStates& points, int64_t k, const ElasticPredictor& p) {
    const Vector trial = p.stiffness * p.equivalent, last = load(points.increments + k);
    const Vector moved = last + load(points.by_trial + k) * (trial - load(points.trials + k));
    const Vector increment = select(moved > Vector{}, moved, last);
    store(points.increments + k, increment);
    keep_points(points, k, p, trial, increment);
}

// Stress P of the points of a vector and, if STIFF, A = dP/dF (symmetric), both times `weight`, into eights of numbers;
// keeps what the states of the points become, whose increments are known.
template <bool STIFF>
CREEPKIT_INLINE void finish_points(const StageConditions& stage, PointStates& points, int64_t k, const Kinematics& at,
                                   const ElasticPredictor& p, const CreepDerivatives& by, Vector weight, double* P,
                                   double* A) {
    const Vector increment = load(points.increments + k);
    keep_points(points, k, p, p.stiffness * p.equivalent, increment);
    Vector stress[4], piola[5];
    log_stress(stage, p, increment, stress);
    piola_stress(at, stress, piola);
    CREEPKIT_UNROLL for (int i = 0; i < 5; ++i) store(P + EIGHT * i, piola[i] * weight);
    if (!STIFF) return;
    points.shifted = points.shifted || by.shifted();
    store(points.by_trial + k, by.by_trial);
    Vector follow[4], moduli[4][4], by_w[3][3];
    strain_derivatives(stage, p, increment, by, follow);
    tangent_moduli<true>(stage, p, increment, follow, moduli, by_w);
    double* kept = points.deviator + k;
    store(kept, 1.5 * (moduli[HOOP][HOOP] - moduli[HOOP][SUM]));
    store(kept + points.count, moduli[DIFFERENCE][DIFFERENCE]);
    store(kept + 2 * points.count, moduli[SHEAR][SHEAR]);
    store(kept + 3 * points.count, moduli[DIFFERENCE][HOOP] - moduli[DIFFERENCE][SUM]);
    store(kept + 4 * points.count, moduli[SHEAR][HOOP] - moduli[SHEAR][SUM]);
    store(kept + 5 * points.count, moduli[DIFFERENCE][SHEAR]);
    piola_tangent(at, moduli, stress, weight, A);
}

// From the deformation gradient of eight points to P (5, 8) and, if STIFF, to A = dP/dF (25, 8) (symmetric), both times
// the points' weights (8,); keeps what their states become. at : with f11 ... f33 set. tolerance : on the last Newton
// correction of ln D; the error left is its square.
template <bool STIFF>
CREEPKIT_INLINE PointFlag update_points(const PointLaw& law, const StageConditions& stage, PointStates& points,
                                        int64_t k, Kinematics at[VECTORS], const double* weights, double tolerance,
                                        double* P, double* A) {
    ElasticPredictor predictors[VECTORS];
    CreepDerivatives by[VECTORS] = {};
    for (int v = 0; v < VECTORS; ++v) {
        if (!set_strains(at[v])) return INVERTED;
        predictors[v] = elastic_predictor(stage, at[v], points.base + k + v * LANES, points.count);
    }
    if (stage.weight > 0.0) {
        const PointFlag flag = law.states == 0
                                   ? creep_increments(law, stage, predictors, points, k, tolerance, by)
                                   : creep_increments_with_states(law, stage, predictors, points, k, tolerance, by);
        if (flag != POINTS_SOLVED) return flag;
    } else {
        for (int v = 0; v < VECTORS; ++v) store(points.increments + k + v * LANES, Vector{});
    }
    for (int v = 0; v < VECTORS; ++v)
        finish_points<STIFF>(stage, points, k + v * LANES, at[v], predictors[v], by[v], load(weights + v * LANES),
                             P + v * LANES, A + v * LANES);
    return POINTS_SOLVED;
}

// Stress P of the points of a vector for a change of their creep strains by the sum of weights_i slopes_i, through the
// tangent of the stage, which damps what the stage would damp. at : with strains set.
CREEPKIT_INLINE void stress_of_creep_change(const PointStates& points, int64_t k, const Kinematics& at,
                                            const double weights[STAGES], Vector P[5]) {
    const int64_t stride = points.values * points.count;
    Vector change[CREEP_COMPONENTS], kept[6];
    for (int v = 0; v < CREEP_COMPONENTS; ++v)
        change[v] = weights[0] * load(points.slopes + v * points.count + k) +
                    weights[1] * load(points.slopes + stride + v * points.count + k);
    for (int i = 0; i < 6; ++i) kept[i] = load(points.deviator + i * points.count + k);
    const Vector first = kept[0] * change[0] + kept[3] * change[1] + kept[4] * change[2];
    const Vector stress[4] = {first * (1.0 / 3.0), -(kept[3] * change[0] + kept[1] * change[1] + kept[5] * change[2]),
                              first * (-2.0 / 3.0), -(kept[4] * change[0] + kept[5] * change[1] + kept[2] * change[2])};
    piola_stress(at, stress, P);
}

}  // namespace creepkit
