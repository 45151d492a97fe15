// One Runge-Kutta step of a material point, its error estimate and its sensitivities to the parameters.
//
// Sensitivities are the exact derivatives of the discrete scheme at fixed positions in the transformed time, which may
// itself depend on the parameters.
//
// V = 1 + S unknowns: creep strain, then the states. P parameters.
#pragma once

#include <math.h>
#include <stdint.h>

#include "comparison.hpp"
#include "stage_problem.hpp"
#include "stage_solver.hpp"
#include "tableaux.hpp"
#include "time_transformation.hpp"
#include "workspace.hpp"

namespace creepkit {

// How stress follows strain: sigma = (driving stress - stiffness p) exp(load p); MPa, and load 0 or 1.
struct StressControl {
    double stiffness, load;
    Axes axes;

    // Whether it is of a bar, whose stress has a sign.
    bool of_bar() const {
        return axes.principal == 0.0 && axes.mean == 0.0 &&
               (axes.mean_slope == UNIAXIAL.mean_slope ? axes.principal_slope == 1.0
                                                       : axes.mean_slope == COMPRESSION.mean_slope);
    }

    // The same of the size of a stress that has a sign: p shortens what is pressed.
    StressControl along(double sign) const { return sign < 0.0 ? StressControl{stiffness, -load, COMPRESSION} : *this; }
};

// A stretch of the load program: start and end, s; driving stress, MPa, and temperature, K, straight lines in time.
struct Segment {
    double start, end, stress, temperature, end_stress, stress_rate, temperature_rate;

    // row : start, end, stress at both, temperature at both.
    explicit Segment(const double* row)
        : start(row[0]),
          end(row[1]),
          stress(row[2]),
          temperature(row[4]),
          end_stress(row[3]),
          stress_rate((row[3] - row[2]) / (row[1] - row[0])),
          temperature_rate((row[5] - row[4]) / (row[1] - row[0])) {}

    double stress_at(double time) const { return stress + stress_rate * (time - start); }

    // What is left of it from a time on.
    Segment from(double time) const {
        Segment rest = *this;
        rest.start = time;
        rest.stress = stress_at(time);
        rest.temperature = temperature + temperature_rate * (time - start);
        return rest;
    }

    // With factor (driving stress - shift) in the place of the driving stress.
    Segment directed(double factor, double shift) const {
        Segment turned = *this;
        turned.stress = factor * (stress - shift);
        turned.end_stress = factor * (end_stress - shift);
        turned.stress_rate = factor * stress_rate;
        return turned;
    }
};

// The law's update and sensitivity entries, and one candidate's internal parameters (P,).
struct LawCall {
    LawEntry update, sensitivity;
    const double* theta;
};

// Working arrays of one point.
//
// sign, offset, offset_change : direction of the stress of a bar, whose axial creep strain is offset + sign p; (P,) its
//     derivatives to the parameters
// value, change         : (V,), (V, P) at the start of the step, and derivatives to the parameters
// new_value, new_change : at its end
// slopes, slope_changes : (stages, V), (stages, V, P) d/ds at the stages
// base, base_change     : (stages, V), (V, P) history of the stages, and of the stage at hand
// problems, times       : (stages,) what each stage was solved for, and when, s
// past_slopes           : (stages, V) of the step before
// row, out, full        : input and outputs of the law
// gradient, matrix, response : for differentiate_stage
// clock_change          : (2, P) of beta and tau
// nudged, nudged_value  : (P,), (V,) for differences
// back                  : which states are back stresses, components along the flow, as is the stress of a bar then
struct StepWorkspace {
    int64_t states, parameters, stages;
    double *value, *change, *new_value, *new_change, *slopes, *slope_changes, *base, *base_change;
    double *past_slopes, *row, *out, *full, *gradient, *matrix, *response;
    double *clock_change, *nudged, *nudged_value, *offset_change;
    double sign = 1.0, offset = 0.0;
    BackStresses back;
    TimeAndPace* times;
    StageProblem* problems;

    StepWorkspace(Workspace& memory, int64_t states, int64_t parameters, int64_t stages)
        : states(states), parameters(parameters), stages(stages) {
        const int64_t size = 1 + states, width = POINT_SIZE + states;
        value = memory.doubles(size);
        change = memory.doubles(size * parameters);
        new_value = memory.doubles(size);
        new_change = memory.doubles(size * parameters);
        slopes = memory.doubles(stages * size);
        slope_changes = memory.doubles(stages * size * parameters);
        base = memory.doubles(stages * size);
        base_change = memory.doubles(size * parameters);
        times = memory.array<TimeAndPace>(stages);
        past_slopes = memory.doubles(stages * size);
        row = memory.doubles(width);
        out = memory.doubles(size * (1 + width));
        full = memory.doubles(size * (1 + width + parameters));
        gradient = memory.doubles(size * width);
        matrix = memory.doubles(size * size);
        response = memory.doubles(size * (INPUTS + states + parameters));
        clock_change = memory.doubles(2 * parameters);
        nudged = memory.doubles(parameters);
        nudged_value = memory.doubles(size);
        offset_change = memory.doubles(parameters);
        problems = memory.array<StageProblem>(stages);
    }

    int64_t unknowns() const { return 1 + states; }
    double back_stress(const double* values) const { return back.sum(values + 1, states); }
    double effective_stress(const Tableau& tableau, double h) const {  // at the end of a step
        const double increment = tableau.diagonal(stages - 1) * h * last_slope(0);
        return problems[stages - 1].effective_stress(increment, new_value + 1, states);
    }
    double last_slope(int64_t v) const { return slopes[(stages - 1) * unknowns() + v]; }
    DenseOutput dense(const Tableau& tableau, double h, int64_t v) const {
        return DenseOutput(tableau, value[v], h, slopes + v, unknowns());
    }
};

// History, time, temperature and problem of stage i.
//
// Where strain starts as a high power of s, weights below zero can make its history negative: laws never see that.
inline StageProblem set_stage(const StressControl& drive, const Segment& segment, const SegmentClock& clock,
                              const Tableau& tableau, StepWorkspace& work, double s, double h, int64_t i) {
    const int64_t size = work.unknowns();
    double* base = work.base + i * size;
    for (int64_t v = 0; v < size; ++v) {
        double total = 0.0;
        for (int64_t j = 0; j < i; ++j) total += tableau.a[i * tableau.stages + j] * work.slopes[j * size + v];
        base[v] = work.value[v] + h * total;
    }
    const TimeAndPace now = clock.at(s + tableau.c[i] * h);
    const double elapsed = now.time - segment.start, strain = base[0] > 0.0 ? base[0] : 0.0;
    const double left = segment.stress + segment.stress_rate * elapsed - drive.stiffness * strain;
    const bool clipped = drive.of_bar() && !work.back.any();  // below zero by rounding, or about to turn
    const double driving = clipped ? larger(0.0, left) : left;
    work.times[i] = now;
    work.row[TIME] = now.time;
    work.row[TEMPERATURE] = segment.temperature + segment.temperature_rate * elapsed;
    const double trial = drive.load != 0.0 ? driving * exp(drive.load * strain) : driving;
    return work.problems[i] = {trial, drive.stiffness, drive.load, tableau.diagonal(i) * h * now.pace, strain,
                               work.back};
}

// What the stages of a step are guessed from, and how well they are to be solved.
//
// slope  : dp/ds where the step begins, NaN where it is not known
// length : of the step before, 0 if there is none
// tolerance, negligible : see stage_solver.hpp
struct StepStart {
    double slope, length, tolerance, negligible;
};

// Solve all stages from position s to s + h. Returns the flag of a stage.
inline int64_t advance(const LawCall& law, const StressControl& drive, const Segment& segment,
                       const SegmentClock& clock, const Tableau& tableau, const SlopePredictor& predictor,
                       StepWorkspace& work, double s, double h, const StepStart& start) {
    constexpr double FIRST_SLOPE = 1e-6;
    const int64_t size = work.unknowns();
    for (int64_t i = 0; i < tableau.stages; ++i) {
        const StageProblem problem = set_stage(drive, segment, clock, tableau, work, s, h, i);
        const double share = tableau.diagonal(i) * h;
        const double *base = work.base + i * size, *before = i > 0 ? work.slopes + (i - 1) * size : nullptr;
        double* slopes = work.slopes + i * size;
        double guess = predictor.slope(i, start.slope, work.slopes, size, work.past_slopes, start.length / h);
        if (!(guess > 0.0)) guess = before ? before[0] : FIRST_SLOPE;
        for (int64_t v = 1; v < size; ++v) {
            const double first = start.length > 0.0 ? work.past_slopes[(work.stages - 1) * size + v] : NAN;
            const double state_slope =
                predictor.slope(i, first, work.slopes + v, size, work.past_slopes + v, start.length / h);
            work.row[POINT_SIZE + v - 1] = base[v] + (isfinite(state_slope) ? share * state_slope : 0.0);
        }
        StageSolution answer = {0.0, TOO_MANY};
        if (size == 1 && problem.trial > 0.0) {
            answer = solve_stage_near_guess(law.update, law.theta, drive.axes, problem, work.row, work.out,
                                            share * guess, start.tolerance, start.negligible);
        }
        if (answer.flag != SOLVED) {
            answer = solve_stage(law.update, law.theta, drive.axes, problem, base + 1, work.states, work.row, work.out,
                                 share * guess, start.tolerance, start.negligible);
        }
        if (answer.flag != SOLVED) return answer.flag;
        slopes[0] = answer.increment / share;
        work.new_value[0] = base[0] + answer.increment;
        for (int64_t v = 1; v < size; ++v) {
            work.new_value[v] = work.row[POINT_SIZE + v - 1];
            slopes[v] = (work.new_value[v] - base[v]) / share;
        }
    }
    return SOLVED;
}

// Chain the response of stage i to the changes of its history and of its time transformation.
inline void chain_stage_response(const StressControl& drive, const Segment& segment, const SegmentClock& clock,
                                 const Tableau& tableau, StepWorkspace& work, double s, double h, int64_t i) {
    const int64_t size = work.unknowns(), count = work.parameters, columns = INPUTS + work.states + count;
    for (int64_t k = 0; k < size * count; ++k) work.base_change[k] = work.change[k];
    for (int64_t j = 0; j < i; ++j) {
        const double weight = h * tableau.a[i * tableau.stages + j];
        const double* changes = work.slope_changes + j * size * count;
        for (int64_t k = 0; k < size * count; ++k) work.base_change[k] += weight * changes[k];
    }
    const StageProblem& problem = work.problems[i];
    const TransformationDerivatives moved = clock.derivatives(s + tableau.c[i] * h, work.times[i]);
    const double growth = drive.load != 0.0 ? exp(drive.load * problem.strain) : 1.0;
    const double trial_by_strain = drive.load * problem.trial - drive.stiffness * growth;
    const double trial_by_time = segment.stress_rate * growth, share = tableau.diagonal(i) * h;
    const double seen = work.base[i * size] >= 0.0 ? 1.0 : 0.0;  // whether the law saw the history of strain
    const double trial_by_offset = fabs(drive.load) * problem.trial - work.sign * drive.stiffness;
    for (int64_t v = 0; v < size; ++v) {
        const double *answer = work.response + v * columns, *by_parameter = answer + INPUTS + work.states;
        double* result = work.slope_changes + (i * size + v) * count;
        const double by_strain = seen * (answer[BY_TRIAL] * trial_by_strain + answer[BY_STRAIN]);
        const double by_time = answer[BY_TRIAL] * trial_by_time + answer[BY_TIME] +
                               answer[BY_TEMPERATURE] * segment.temperature_rate;
        const double by_beta = by_time * moved.by_beta.time + answer[BY_LOG_WEIGHT] * moved.by_beta.log_pace;
        const double by_tau = by_time * moved.by_tau.time + answer[BY_LOG_WEIGHT] * moved.by_tau.log_pace;
        for (int64_t p = 0; p < count; ++p) {
            double total = by_parameter[p] + by_strain * work.base_change[p];
            total += by_beta * work.clock_change[p] + by_tau * work.clock_change[count + p];
            for (int64_t z = 1; z < size; ++z) total += answer[INPUTS + z - 1] * work.base_change[z * count + p];
            if (v > 0) total -= work.base_change[v * count + p];
            result[p] = total / share;
        }
        for (int64_t p = 0; p < count && work.offset != 0.0; ++p) {
            result[p] += answer[BY_TRIAL] * trial_by_offset * work.offset_change[p] / share;
        }
    }
}

// Derivatives of the slopes and of the new value with respect to the parameters, after `advance`.
inline int64_t differentiate(const LawCall& law, const StressControl& drive, const Segment& segment,
                             const SegmentClock& clock, const Tableau& tableau, StepWorkspace& work, double s,
                             double h) {
    const int64_t size = work.unknowns(), count = work.parameters, columns = INPUTS + work.states + count;
    for (int64_t i = 0; i < tableau.stages; ++i) {
        const StageProblem& problem = work.problems[i];
        const double share = tableau.diagonal(i) * h, increment = share * work.slopes[i * size];
        const double time = work.times[i].time;
        work.row[TIME] = time;
        work.row[TEMPERATURE] = segment.temperature + segment.temperature_rate * (time - segment.start);
        for (int64_t v = 1; v < size; ++v) {
            work.row[POINT_SIZE + v - 1] = work.base[i * size + v] + share * work.slopes[i * size + v];
        }
        const double growth = drive.load != 0.0 ? exp(drive.load * increment) : 1.0;
        const double stress = (problem.trial - problem.stiffness * increment) * growth;
        write_point(work.row, drive.axes, stress, problem.strain + increment);
        law.sensitivity(1, work.row, law.theta, work.full);
        gradient_of_sensitivity(work.full, problem, increment, work.gradient, work.states);
        const double* by_parameter = work.full + size + size * (POINT_SIZE + work.states);
        const bool flows = stress > problem.back.sum(work.row + POINT_SIZE, work.states);
        for (int64_t v = 0; v < size; ++v) {
            double* response = work.response + v * columns + INPUTS + work.states;
            const bool moves = flows || v > 0;
            for (int64_t p = 0; p < count; ++p) {
                response[p] = moves ? problem.weight * by_parameter[v * count + p] : 0.0;
            }
        }
        if (!differentiate_stage(drive.axes, problem, increment, stress, work.full + 1, work.gradient, work.matrix,
                                 work.response, work.states, count)) {
            return NO_SOLUTION;
        }
        chain_stage_response(drive, segment, clock, tableau, work, s, h, i);
    }
    for (int64_t k = 0; k < size * count; ++k) work.new_change[k] = work.change[k];
    for (int64_t i = 0; i < tableau.stages; ++i) {
        const double weight = h * tableau.a[(tableau.stages - 1) * tableau.stages + i];
        const double* changes = work.slope_changes + i * size * count;
        for (int64_t k = 0; k < size * count; ++k) work.new_change[k] += weight * changes[k];
    }
    return SOLVED;
}

// Estimated local error of unknown v.
inline double local_error(const Tableau& tableau, const StepWorkspace& work, double h, int64_t v) {
    double total = 0.0;
    for (int64_t i = 0; i < tableau.stages; ++i) total += tableau.error[i] * work.slopes[i * work.unknowns() + v];
    return fabs(h * total);
}

// Derivatives of unknown v at a fixed time, at the share x of the step, to the parameters, into `change` (P,).
inline void dense_sensitivity(const SegmentClock& clock, const Tableau& tableau, const StepWorkspace& work, double s,
                              double h, double x, int64_t v, double* change) {
    const int64_t size = work.unknowns(), count = work.parameters;
    const double slope = work.dense(tableau, h, v).slope(x), place = s + x * h;
    for (int64_t p = 0; p < count; ++p) change[p] = work.change[v * count + p];
    for (int64_t i = 0; i < tableau.stages; ++i) {
        const double weight = h * dense_weight(tableau, i, x);
        const double* changes = work.slope_changes + (i * size + v) * count;
        for (int64_t p = 0; p < count; ++p) change[p] += weight * changes[p];
    }
    const TimeAndPace now = clock.at(place);
    const TransformationDerivatives moved = clock.derivatives(place, now);
    const double rate = slope / now.pace;
    const double by_beta = rate * moved.by_beta.time, by_tau = rate * moved.by_tau.time;
    for (int64_t p = 0; p < count; ++p) {
        change[p] -= by_beta * work.clock_change[p] + by_tau * work.clock_change[count + p];
    }
}

}  // namespace creepkit
