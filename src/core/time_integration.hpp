// Time integration over a load history: SDIRK2 with error control in the transformed time of each segment.
//
// The method has two stages, order 2, and is L-stable: Alexander (1977), SIAM J. Numer. Anal. 14, 1006. The embedded
// solution is the first stage's slope over the whole step; the difference of the two, taken through the tangent of
// equilibrium, is the estimated error of the displacements.
//
// A System has what `FiniteElements` has: assemble, error_forces, factorize, solve, correct, largest_correction ...
#pragma once

#include <math.h>

#include "load_segments.hpp"
#include "material_point.hpp"
#include "step_record.hpp"
#include "workspace.hpp"

namespace creepkit {

constexpr double GAMMA = 0.29289321881345248;  // 1 - sqrt(1/2)

struct Tableau {
    double a[STAGES][STAGES], c[STAGES], error[STAGES];
};

inline Tableau sdirk2() { return {{{GAMMA, 0.0}, {1.0 - GAMMA, GAMMA}}, {GAMMA, 1.0}, {-GAMMA, GAMMA}}; }

enum EquilibriumFlag { CONVERGED, NO_STRESS, UNSTABLE, TOO_FAR, TOO_MANY_PASSES, UNDEFINED };

// In the place of sensitivities where no derivatives are wanted.
struct NoSensitivities {
    template <class... Anything>
    bool differentiate(const Anything&...) {
        return true;
    }
};

// What all points share at a time of a segment.
inline StageConditions stage_at(const double* segment, double poisson, double time, double weight) {
    const double share = (time - segment[START]) / (segment[END] - segment[START]);
    const auto between = [&](int first, int last) { return segment[first] + share * (segment[last] - segment[first]); };
    const double modulus = between(MODULUS, END_MODULUS);
    return {weight, weight > 0.0 ? log(weight) : 0.0, time, between(START_TEMPERATURE, FINAL_TEMPERATURE),
            modulus / (3.0 * (1.0 - 2.0 * poisson)), modulus / (2.0 * (1.0 + poisson)), between(PRESSURE, END_PRESSURE)};
}

template <class System, class Sensitivities>
class TimeIntegration {
public:
    TimeIntegration(System& system, const PointLaw& law, const SimulationInput& input, const SolverSettings& settings,
                    StepRecord& record, Sensitivities& sensitivities)
        : system(system), law(law), input(input), settings(settings), record(record), sensitivities(sensitivities),
          tableau(sdirk2()) {}

    void take(Workspace& memory) {
        points.take(memory, system.point_count(), law.states);
        const int64_t count = system.displacement_count();
        displacement = memory.doubles(count);
        start = memory.doubles(count);
        before = memory.doubles(count);
        for (int i = 0; i < STAGES; ++i) stages[i] = memory.doubles(count);
    }

    Termination run() {
        for (int64_t s = 0; s < law.states; ++s)
            for (int64_t k = 0; k < points.count; ++k) {
                points.value[(EQUIVALENT_STRAIN + 1 + s) * points.count + k] = input.initial[s];
                points.state[s * points.count + k] = input.initial[s];
            }
        ended = {0, REACHED_END, 0.0};
        write_row(0.0, 0);
        double pressure = 0.0, modulus = 0.0, motion = 0.0;  // at the end of the segment before
        for (int64_t n = 0; n < input.segment_count && ended.code == REACHED_END; ++n) {
            const double* segment = input.segments + SEGMENT_COLUMNS * n;
            const bool stiffens = modulus != 0.0 && segment[MODULUS] != modulus;
            if (segment[PRESSURE] != pressure || segment[MOTION] != motion || stiffens) jump(segment, n, pressure, motion);
            if (ended.code == REACHED_END) integrate_segment(segment, n);
            pressure = segment[END_PRESSURE];
            modulus = segment[END_MODULUS];
            motion = segment[END_MOTION];
        }
        return ended;
    }

private:
    System& system;
    const PointLaw& law;
    const SimulationInput& input;
    const SolverSettings& settings;
    StepRecord& record;
    Sensitivities& sensitivities;
    const Tableau tableau;
    PointStates points;
    double *displacement = nullptr, *start = nullptr, *before = nullptr, *stages[STAGES] = {};
    Termination ended{};
    double largest_reaction = 0.0;             // N/rad, so far
    static constexpr double LEAST_SHARE = 0.01;  // of it, that errors of a reaction are measured by at least

    void copy(const double* from, double* to) const {
        memcpy(to, from, sizeof(double) * size_t(system.displacement_count()));
    }

    void end(int64_t code, double time) { ended = {ended.records, code, time}; }

    // Write a row of the record.
    void write_row(double time, int64_t segment) {
        const int64_t row = ended.records, count = system.displacement_count();
        record.times[row] = time;
        record.segments[row] = segment;
        const double reaction = system.reaction();
        largest_reaction = fmax(largest_reaction, fabs(reaction));
        if (record.reactions) record.reactions[row] = reaction;
        if (record.displacements) copy(displacement, record.displacements + row * count);
        if (record.mises) memcpy(record.mises + row * record.points, points.mises, sizeof(double) * size_t(record.points));
        for (int64_t k = 0; record.values && k < record.points; ++k)
            for (int64_t v = 0; v < points.values; ++v)
                record.values[(row * record.points + k) * points.values + v] = points.value[v * points.count + k];
        ended = {row + 1, REACHED_END, time};
    }

    // Bring `displacement` to equilibrium, and the points to those displacements.
    //
    // tolerance : mm, of what a correction leaves, which is what the next one would be if corrections went on to fall as
    // the last two did. tight : tolerance of the points' own equations once near.
    EquilibriumFlag solve_equilibrium(const StageConditions& stage, double tolerance, double tight) {
        const int passes = system.touches() ? 40 : 16, patience = system.touches() ? 20 : 6;
        constexpr double LOOSE = 0.03;   // tolerance of the points' equations in the first pass
        constexpr double KEEP = 0.3;     // the tangent is kept while a correction is at most this share of the last
        constexpr double MOST = 3.0;     // times the tolerance, the last correction at most
        double last = INFINITY, size = INFINITY, factor = 1.0;
        for (int pass = 0; pass < passes; ++pass) {
            const bool stiff = pass == 0 || factor < 1.0 || (pass > 1 && size > KEEP * last);
            const double local = pass == 0 ? fmax(tight, LOOSE) : tight;
            const PointFlag flag =
                stiff ? system.template assemble<true>(law, stage, displacement, points, local)
                      : system.template assemble<false>(law, stage, displacement, points, local);
            if (flag != POINTS_SOLVED) return flag == RATE_UNDEFINED && pass < 2 ? UNDEFINED : NO_STRESS;
            record.counts[stiff ? 2 : 3] += 1;
            if (stiff && !system.factorize()) return UNSTABLE;
            system.solve();
            last = size;
            size = system.largest_correction();
            if (!isfinite(size) || (pass > patience && size > last)) return TOO_FAR;
            factor = system.correction_share(stage, displacement, size);
            system.correct(displacement, factor);
            const double ratio = size / last, left = ratio < KEEP ? size * ratio / (1.0 - ratio) : size;
            if ((size <= tolerance || (size <= MOST * tolerance && left <= tolerance)) && system.contact_settled())
                return settle_points(stage, tight);
        }
        return TOO_MANY_PASSES;
    }

    // Take the points to the displacements as they were corrected last: along the tangent, unless more than the trial stress
    // moves them or a force is asked for. Derivatives follow from what a point does at its strain, and err as values do.
    EquilibriumFlag settle_points(const StageConditions& stage, double tight) {
        if (points.shifted || system.reaction() != 0.0) {
            record.counts[3] += 1;
            return system.template assemble<false>(law, stage, displacement, points, tight) == POINTS_SOLVED ? CONVERGED
                                                                                                             : NO_STRESS;
        }
        for (int64_t k = 0; k < points.count; k += LANES) {
            Kinematics at;
            system.deform(k, displacement, at);
            if (!set_strains(at)) return NO_STRESS;
            move_points(points, k, elastic_predictor(stage, at, points.base + k, points.count));
        }
        return CONVERGED;
    }

    // The elastic change at a sudden change of load, in as many parts as it needs; recorded at the segment's start.
    void jump(const double* segment, int64_t n, double pressure, double motion) {
        double done = 0.0, part = 1.0;
        copy(displacement, start);
        memcpy(points.base, points.value, sizeof(double) * size_t(points.values * points.count));
        StageConditions stage = stage_at(segment, input.poisson, segment[START], 0.0);
        const double target = stage.pressure;
        for (int attempt = 0; attempt < 60; ++attempt) {
            const double now = fmin(1.0, done + part);
            stage.pressure = pressure + now * (target - pressure);
            system.prescribe(input.pattern, motion + now * (segment[MOTION] - motion), displacement);
            const double newton = settings.newton * (settings.least + system.largest_displacement(displacement));
            if (solve_equilibrium(stage, newton, 1e-3) == CONVERGED) {
                done = now;
                copy(displacement, start);
                if (system.touches()) part *= 4.0;  // the first part closes gaps; others may then be larger
                if (done < 1.0) continue;
                if (!sensitivities.differentiate(system, law, points, input, n, 0.0, 0.0, tableau, &displacement,
                                                 ended.records))
                    return end(SINGULAR_TANGENT, segment[START]);
                record.places[2 * ended.records] = record.places[2 * ended.records + 1] = 0.0;
                return write_row(segment[START], n);
            }
            copy(start, displacement);
            part *= 0.25;
            if (part < 1e-5) break;
        }
        end(fabs(target) > fabs(pressure) ? LIMIT_LOAD : LOST_CONVERGENCE, segment[START]);
    }

    // Integrate over one segment in its transformed time s, from 0 to 1.
    void integrate_segment(const double* segment, int64_t n) {
        constexpr double SMALLEST = 1e-9;  // least step, as a share of the position it begins at
        constexpr double LIMIT_WIDTH = 1e-3;  // share of the deflection limit by which the last step may pass it
        constexpr int MOST_OVERSHOOTS = 20;
        const TimeTransformation clock = segment_transformation(segment, input.beta);
        const double begin = segment[START], length = segment[END] - segment[START];
        double s = 0.0, elapsed = 0.0, h = position(clock, begin + fmin(settings.first, length));
        double time_before = begin;    // where the step before began, for a straight line through it
        bool has_before = false;       // whether there is one in this segment
        int failures = 0, overshoots = 0;
        copy(displacement, start);
        while (s < 1.0) {
            h = fmin(h, position(clock, begin + fmin(settings.growth * elapsed + settings.first, length)) - s);
            if (s + 1.0001 * h > 1.0) h = 1.0 - s;
            const bool scripted = ended.records < input.script_steps;
            if (scripted) h = fmin(input.script[2 * ended.records + 1], 1.0 - s);
            if (record.counts[0] + record.counts[1] >= settings.max_steps || ended.records >= record.rows)
                return end(TOO_MANY_STEPS, ended.time);
            double error = 0.0;
            const EquilibriumFlag flag =
                attempt_step(segment, clock, s, h, has_before && failures == 0 ? &time_before : nullptr, error);
            if (flag != CONVERGED || !(error <= 1.0 || scripted)) {
                copy(start, displacement);
                record.counts[1] += 1;
                failures += 1;
                h *= flag != CONVERGED ? 0.25 : fmax(0.2, 0.9 / sqrt(error));
                if (failures > 12 || !(h >= SMALLEST * s)) {
                    const bool rises = fabs(segment[END_PRESSURE]) > fabs(segment[PRESSURE]);
                    return end(flag == UNDEFINED ? LAW_FAILED : rises ? LIMIT_LOAD : LOST_CONVERGENCE, ended.time);
                }
                continue;
            }
            const double risen = system.largest_displacement(displacement), limit = settings.deflection_limit;
            if (risen > limit * (1.0 + LIMIT_WIDTH) && !scripted && overshoots < MOST_OVERSHOOTS) {
                // the limit lies within the step: again, to where a straight line reaches it
                const double from = system.largest_displacement(start);
                const double share = (limit * (1.0 + 0.5 * LIMIT_WIDTH) - from) / (risen - from);
                copy(start, displacement);
                record.counts[1] += 1;
                overshoots += 1;
                h *= fmin(fmax(share, 0.05), 0.95);
                continue;
            }
            failures = 0;
            record.counts[0] += 1;
            if (!sensitivities.differentiate(system, law, points, input, n, s, h, tableau, stages, ended.records))
                return end(SINGULAR_TANGENT, ended.time);
            const double worst = finish_step(h);
            record.places[2 * ended.records] = s;
            record.places[2 * ended.records + 1] = h;
            time_before = begin + elapsed;
            has_before = true;
            copy(start, before);
            s = h == 1.0 - s ? 1.0 : s + h;
            const double time = s == 1.0 ? segment[END] : transformed_time(clock, s).time;
            elapsed = time - begin;
            write_row(time, n);
            copy(displacement, start);
            if (system.largest_displacement(displacement) >= settings.deflection_limit)
                return end(DEFLECTION_LIMIT, time);
            if (worst >= settings.strain_limit) return end(STRAIN_LIMIT, time);
            if (state_has_failed()) return end(STATE_LIMIT, time);
            h *= fmin(4.0, fmax(0.3, 0.9 / sqrt(fmax(error, 1e-12))));
        }
    }

    // Try one step from `s`; the displacement ends where the last stage does. error : over what is allowed.
    EquilibriumFlag attempt_step(const double* segment, const TimeTransformation& clock, double s, double h,
                                 const double* time_before, double& error) {
        const double scale = settings.least + system.largest_displacement(start), tight = fmin(1e-3, sqrt(settings.newton));
        for (int i = 0; i < STAGES; ++i) {
            const TransformedTime now = transformed_time(clock, s + tableau.c[i] * h);
            const double share = tableau.a[i][i] * h;
            const StageConditions stage = stage_at(segment, input.poisson, now.time, share * exp(now.log_pace));
            set_stage_history(h, i);
            guess_points(share, i);
            guess_displacements(clock, s, h, i, time_before);
            const double motion = segment[MOTION] + (segment[END_MOTION] - segment[MOTION]) *
                                                        ((now.time - clock.start) / clock.length);
            system.prescribe(input.pattern, motion, displacement);
            const EquilibriumFlag flag = solve_equilibrium(stage, settings.newton * scale, tight);
            if (flag != CONVERGED) return flag;
            set_slopes(share, i);
            copy(displacement, stages[i]);
        }
        const double weights[STAGES] = {h * tableau.error[0], h * tableau.error[1]};
        system.error_forces(displacement, points, weights);
        system.solve();
        error = system.largest_correction() / (settings.tolerance * scale);
        if (largest_reaction > 0.0) {
            const double force = fabs(system.reaction()) + LEAST_SHARE * largest_reaction;
            error = fmax(error, system.reaction_error() / (settings.tolerance * force));
        }
        return CONVERGED;
    }

    // Write the history of stage `i`.
    void set_stage_history(double h, int i) {
        const int64_t count = points.values * points.count;
        memcpy(points.base, points.value, sizeof(double) * size_t(count));
        for (int j = 0; j < i; ++j)
            for (int64_t k = 0; k < count; ++k) points.base[k] += h * tableau.a[i][j] * points.slopes[j * count + k];
    }

    // Guess increments and states of stage `i` from the stage (or the step) before.
    void guess_points(double share, int i) {
        const double* slopes = points.slopes + (i > 0 ? i - 1 : STAGES - 1) * points.values * points.count;
        for (int64_t k = 0; k < points.count; ++k) {
            const double increment = slopes[EQUIVALENT_STRAIN * points.count + k] * share;
            points.increments[k] = increment > 0.0 ? increment : 1e-6;
            points.trials[k] = -1.0;
        }
        const int64_t first = (EQUIVALENT_STRAIN + 1) * points.count;
        for (int64_t k = 0; k < points.states * points.count; ++k)
            points.state[k] = points.base[first + k] + share * slopes[first + k];
    }

    // Guess the displacements of stage `i` along a straight line through what was found last.
    void guess_displacements(const TimeTransformation& clock, double s, double h, int i, const double* time_before) {
        const int64_t count = system.displacement_count();
        if (i > 0) {
            const double ratio = tableau.c[i] / tableau.c[i - 1];
            for (int64_t k = 0; k < count; ++k) displacement[k] = start[k] + ratio * (stages[i - 1][k] - start[k]);
        } else if (time_before) {
            const double ratio = tableau.c[0] * h / (s - position(clock, *time_before));
            for (int64_t k = 0; k < count; ++k) displacement[k] = start[k] + ratio * (start[k] - before[k]);
        }
    }

    // Write the slopes of stage `i` from its increments; share : gamma h.
    void set_slopes(double share, int i) {
        const double inverse = 1.0 / share;
        const int64_t count = points.count;
        double* slopes = points.slopes + i * points.values * count;
        for (int64_t k = 0; k < count; ++k) {
            const double rate = points.increments[k] * inverse;
            for (int v = 0; v < CREEP_COMPONENTS; ++v) slopes[v * count + k] = rate * points.directions[v * count + k];
            slopes[EQUIVALENT_STRAIN * count + k] = rate;
        }
        const int64_t first = (EQUIVALENT_STRAIN + 1) * count;
        for (int64_t k = 0; k < points.states * count; ++k)
            slopes[first + k] = (points.state[k] - points.base[first + k]) * inverse;
    }

    // Move the points to the end of the step; return the largest equivalent creep strain.
    double finish_step(double h) {
        const int64_t count = points.values * points.count;
        for (int64_t k = 0; k < count; ++k)
            points.value[k] += h * (tableau.a[STAGES - 1][0] * points.slopes[k] +
                                    tableau.a[STAGES - 1][1] * points.slopes[count + k]);
        double worst = 0.0;
        for (int64_t k = 0; k < points.count; ++k)
            worst = fmax(worst, points.value[EQUIVALENT_STRAIN * points.count + k]);
        return worst;
    }

    // Whether a state of any point has passed its limit.
    bool state_has_failed() const {
        for (int64_t i = 0; i < law.states; ++i) {
            const bool up = input.limits[i] > input.initial[i];
            for (int64_t k = 0; k < points.count; ++k) {
                const double value = points.value[(EQUIVALENT_STRAIN + 1 + i) * points.count + k];
                if (up ? value >= input.limits[i] : value <= input.limits[i]) return true;
            }
        }
        return false;
    }
};

}  // namespace creepkit
