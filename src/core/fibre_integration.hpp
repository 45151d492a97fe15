// Adaptive integration of a model of fibres over its programs, with dense output and sensitivities.
#pragma once

#include <math.h>
#include <stdint.h>

#include "event_location.hpp"
#include "fibre_sensitivities.hpp"
#include "point_integration.hpp"
#include "step_control.hpp"

namespace creepkit {

// segments : (segment_count, 2 + 2 (L + 2)); times : (time_count,) s; follows_stress : whether what is recorded is a
// stress, as under prescribed strains, and errors are small beside the elastic strains.
struct FibreTest {
    int64_t segment_count, time_count;
    const double *segments, *times;
    bool follows_stress;
};

// recorded : (times, rows) of observed c; jacobian : (times, rows, C) or null.
struct FibreRecord {
    double *recorded, *jacobian;
};

struct FibreIntegration {
    const Candidate& candidate;
    const FibreModel& model;
    const FibreTest& test;
    const FibreRecord& record;
    const IntegrationSettings& settings;
    const Tableau& tableau;
    const SlopePredictor& predictor;
    FibreWorkspace& work;

    IntegrationProgress run() const {
        IntegrationProgress progress = {start(), 0, 0, 0, REACHED_END, 0.0};
        const int64_t width = 2 + 2 * (model.loads + 2);
        for (int64_t k = 0; k < test.segment_count && progress.code == REACHED_END; ++k) {
            through({test.segments + width * k, model.loads}, progress);
        }
        return progress;
    }

private:
    int64_t start() const {
        for (int64_t n = 0; n < work.size(); ++n) {
            const int64_t v = n % work.unknowns;
            work.value[n] = v < 2 ? 0.0 : candidate.limits.initial[v - 2];
        }
        for (int64_t n = 0; n < work.size() * work.columns; ++n) work.change[n] = 0.0;
        int64_t done = 0;
        for (; done < test.time_count && test.times[done] <= 0.0; ++done) {
            for (int64_t o = 0; o < model.rows; ++o) record.recorded[done * model.rows + o] = 0.0;
            for (int64_t n = 0; record.jacobian && n < model.rows * work.columns; ++n) {
                record.jacobian[done * model.rows * work.columns + n] = 0.0;
            }
        }
        return done;
    }

    // Largest of one unknown over the fibres, in size.
    double largest(const double* values, int64_t v) const {
        double most = 0.0;
        for (int64_t i = 0; i < model.fibres; ++i) most = larger(most, fabs(values[i * work.unknowns + v]));
        return most;
    }

    // The time transformation of a segment, from the fibre that creeps fastest; fills start_slopes, NaN where unknown.
    TimeTransformation choose_clock(const FibreSegment& segment) const {
        const int64_t U = work.unknowns, S = work.states;
        const double length = segment.end() - segment.start();
        for (int64_t n = 0; n < work.size(); ++n) work.start_slopes[n] = NAN;
        if (largest(work.value, 1) < ZERO_STRAIN && candidate.beta < 1.0) {
            return power_law_time(segment.start(), length, candidate.beta);
        }
        const TimeTransformation plain = linear_time(segment.start(), length);
        const FibreStage now = fibre_stage(model, segment, segment.start(), 0.0, 0.0);
        project(model, work.value, U, work.u);
        int64_t fastest = -1;
        for (int64_t i = 0; i < model.fibres; ++i) {
            evaluate(now, i);
            const double rate = work.out[0] < 600.0 ? exp(work.out[0]) : NAN;
            if (!(rate >= 0.0)) return plain;
            work.rates[i] = work.stress[i] < 0.0 ? -rate : rate;
            if (work.stress[i] != 0.0 && (fastest < 0 || rate > fabs(work.rates[fastest]))) fastest = i;
            work.start_slopes[i * U] = work.rates[i];
            work.start_slopes[i * U + 1] = fabs(work.rates[i]);
            for (int64_t j = 0; j < S; ++j) work.start_slopes[i * U + 2 + j] = work.out[1 + j];
        }
        if (fastest < 0 || work.rates[fastest] == 0.0) return plain;
        evaluate(now, fastest);
        // the fibre as a point of its own: what it loses by its own creep and the others', and what the loads add
        const double sign = work.stress[fastest] < 0.0 ? -1.0 : 1.0, rate = fabs(work.rates[fastest]);
        project(model, work.rates, 1, work.u);
        double shed = work.rates[fastest], driven = 0.0;
        for (int64_t r = 0; r < model.modes; ++r) shed -= model.mode_strains[fastest * model.modes + r] * work.u[r];
        for (int64_t l = 0; l < model.loads; ++l) {
            const int64_t at = l * model.fibres + fastest;
            driven += segment.rate(l) * (model.stress[at] + now.modulus * model.strain[at]);
        }
        const double stiffness = larger(0.0, now.modulus * shed / work.rates[fastest]);
        const double heated = segment.temperature(segment.end());
        const double row[6] = {segment.start(), segment.end(), 0.0, sign * driven * length, now.temperature, heated};
        const CurveBend curve = curve_bend({stiffness, 0.0, axes_of(sign)}, Segment(row), BackStresses{}, rate,
                                           work.rows + fastest * work.width, work.out, 1 + S);
        return shifted_power_law_time(segment.start(), length, curve.bend, curve.rate);
    }

    // Stress, law's row and output of fibre i where a segment begins, with work.u from the creep so far.
    void evaluate(const FibreStage& now, int64_t i) const {
        const double* value = work.value + i * work.unknowns;
        const double stress = elastic_stress(model, now, i, work.u) - now.modulus * value[0];
        double* row = work.rows + i * work.width;
        row[TIME] = now.time;
        row[TEMPERATURE] = now.temperature;
        for (int64_t j = 0; j < work.states; ++j) row[POINT_SIZE + j] = value[2 + j];
        write_point(row, axes_of(stress), fabs(stress), larger(0.0, value[1]));
        candidate.law.update(1, row, candidate.law.theta, work.out);
        work.stress[i] = stress;
        if (stress == 0.0) work.out[0] = -INFINITY;
    }

    void through(const FibreSegment& segment, IntegrationProgress& progress) const {
        const SegmentClock clock(choose_clock(segment));
        const double pace = clock.at(1e-12).pace;
        for (int64_t n = 0; n < work.size(); ++n) work.start_slopes[n] *= pace;
        const bool outputs = progress.done < test.time_count, virgin = clock.transformation.tau == 0.0;
        const double first = outputs ? smaller(1.0, clock.position(test.times[progress.done])) : 1.0;
        double s = 0.0, h = smaller(settings.first, first);
        bool growing = true, near = false;
        FirstStepControl first_step;
        AcceptedStep before = {0.0, 1.0};
        const auto end = [&](Ending code, double place) {
            progress.code = code;
            progress.time = place > 0.0 ? clock.at(place).time : segment.start();
        };
        while (s < 1.0) {
            h = bounded_step(s, h, settings.longest);
            if (progress.steps + progress.rejected >= most_steps(settings, test.segment_count)) return end(TOO_MANY_STEPS, s);
            if (!(h >= SMALLEST_STEP * s && h >= SMALLEST_FIRST_STEP)) return end(why_small(near, s), s);
            const double error = attempt(segment, clock, s, h, first, before);
            if (!(error <= 1.0)) {
                h *= s == 0.0 && virgin ? first_step.factor(h, error) : step_factor(tableau, error, false);
                growing = false;
                ++progress.rejected;
                continue;
            }
            ++progress.steps;
            double share = 1.0;
            Ending code = limit_reached(work.new_value);
            if (code != REACHED_END) {
                share = limit_crossing(h);
            } else {
                const TimeAndPace now = clock.at(s + h);
                const double log_pace = now.time > 0.0 ? now.pace / now.time : INFINITY;
                near = approaching(log_pace, TERMINATION_MARGIN);
                if (approaching(log_pace, NEGLIGIBLE * settings.rtol)) code = STATE_LIMIT;
            }
            fill(clock, s, h, share, progress);
            if (code != REACHED_END) return end(code, s + share * h);
            accept();
            s = h == 1.0 - s ? 1.0 : s + h;
            double longer = step_factor(tableau, error, growing);
            if (!growing) longer *= predictive_step_factor(tableau, before, h, error);
            before = {h, error};
            h *= longer;
            growing = true;
        }
        progress.time = segment.end();
    }

    Ending why_small(bool near, double s) const {
        if (near) return STATE_LIMIT;
        return largest(work.start_slopes, 1) * larger(s, 1e-6) > settings.strain_limit ? DIVERGED : STEP_TOO_SMALL;
    }

    // Solve all stages of a step; false where one has no solution.
    bool advance(const FibreSegment& segment, const SegmentClock& clock, double s, double h,
                 const AcceptedStep& before) const {
        const int64_t U = work.unknowns, size = work.size();
        const FibreTolerance tolerance = {newton_tolerance(settings),
                                          test.follows_stress ? 0.0
                                                              : NEGLIGIBLE_STAGE_ERROR *
                                                                    smaller(LOOSEST_STAGES, settings.rtol) *
                                                                    (largest(work.value, 1) + settings.smallest)};
        for (int64_t k = 0; k < tableau.stages; ++k) {
            const TimeAndPace now = clock.at(s + tableau.c[k] * h);
            const double share = tableau.diagonal(k) * h;
            work.stage[k] = fibre_stage(model, segment, now.time, share * now.pace, share);
            double* guessed = work.new_value;
            for (int64_t n = 0; n < size; ++n) {
                double total = 0.0;
                for (int64_t j = 0; j < k; ++j) total += tableau.a[k * tableau.stages + j] * work.slopes[j * size + n];
                work.base[n] = work.value[n] + h * total;
                double guess = predictor.slope(k, work.start_slopes[n], work.slopes + n, size, work.past_slopes + n,
                                               before.length / h);
                if (!isfinite(guess)) guess = k > 0 ? work.slopes[(k - 1) * size + n] : 0.0;
                guessed[n] = work.base[n] + share * guess;
            }
            project(model, guessed, U, work.u);
            for (int64_t i = 0; i < model.fibres; ++i) {
                work.increment[i] = larger(1e-12, fabs(guessed[i * U] - work.base[i * U]));
                for (int64_t j = 0; j < work.states; ++j) {
                    work.rows[i * work.width + POINT_SIZE + j] = guessed[i * U + 2 + j];
                }
            }
            if (!solve_fibres(candidate.law, model, work.stage[k], work, tolerance)) return false;
            double* slopes = work.slopes + k * size;
            for (int64_t i = 0; i < model.fibres; ++i) {
                slopes[i * U] = work.sign[i] * work.increment[i] / share;
                slopes[i * U + 1] = work.increment[i] / share;
                for (int64_t j = 0; j < work.states; ++j) {
                    const double state = work.rows[i * work.width + POINT_SIZE + j];
                    slopes[i * U + 2 + j] = (state - work.base[i * U + 2 + j]) / share;
                }
            }
            if (record.jacobian && !differentiate_fibre_stage(candidate.law, model, tableau, work, h, k)) return false;
        }
        for (int64_t n = 0; n < size; ++n) {
            work.new_value[n] = work.base[n] + tableau.diagonal(tableau.stages - 1) * h * last(n);
        }
        return true;
    }

    double last(int64_t n) const { return work.slopes[(tableau.stages - 1) * work.size() + n]; }

    // Try a step; its error over what is allowed, infinite when a stage has no solution.
    double attempt(const FibreSegment& segment, const SegmentClock& clock, double s, double h, double first,
                   const AcceptedStep& before) const {
        if (!advance(segment, clock, s, h, before)) return INFINITY;
        const int64_t U = work.unknowns, size = work.size(), C = work.columns;
        const double ahead = larger(1.0, first / (s + h));
        const double caution = s == 0.0 && clock.transformation.tau == 0.0 ? INITIAL_ERROR_FACTOR : 1.0;
        double reach = largest(work.new_value, 1) * ahead, stress = 0.0;
        if (test.follows_stress) {
            for (int64_t i = 0; i < model.fibres; ++i) stress = larger(stress, fabs(work.stress[i]));
            reach = smaller(reach, stress / work.stage[tableau.stages - 1].modulus);
        }
        const double allowed = settings.rtol * (reach + settings.smallest);
        double worst = 0.0;
        for (int64_t n = 0; n < size; ++n) {
            const int64_t v = n % U;
            double total = 0.0;
            for (int64_t j = 0; j < tableau.stages; ++j) total += tableau.error[j] * work.slopes[j * size + n];
            if (v >= 2) {
                const double scale = larger(largest(work.value, v), largest(work.new_value, v)) + settings.smallest;
                worst = worse(worst, fabs(h * total) / (settings.rtol * scale));
                continue;
            }
            if (v == 1 && work.new_value[n] < work.value[n] - allowed) return INFINITY;
            worst = worse(worst, fabs(h * total) / allowed);
            if (v == 1 || isnan(work.start_slopes[n])) continue;
            const double middle =
                0.5 * (work.value[n] + work.new_value[n] + 0.25 * h * (work.start_slopes[n] - last(n)));
            const DenseOutput dense(tableau, work.value[n], h, work.slopes + n, size);
            worst = worse(worst, fabs(dense.at(0.5) - middle) / allowed);
        }
        if (record.jacobian && worst <= 1.0) {
            const double slack = SENSITIVITY_SLACK * allowed / settings.rtol;
            for (int64_t q = 0; q < C; ++q) {
                double most = slack, error = 0.0;
                for (int64_t i = 0; i < model.fibres; ++i) {
                    double total = 0.0, end = 0.0;
                    for (int64_t j = 0; j < tableau.stages; ++j) {
                        const double slope = work.slope_changes[(j * size + i * U) * C + q];
                        total += tableau.error[j] * slope;
                        end += tableau.a[(tableau.stages - 1) * tableau.stages + j] * slope;
                    }
                    error = worse(error, fabs(h * total));
                    most = larger(most, fabs(work.change[i * U * C + q] + h * end));
                }
                worst = worse(worst, error / (settings.rtol * most));
            }
        }
        return isfinite(worst) ? caution * worst : INFINITY;
    }

    void accept() const {
        const int64_t size = work.size();
        for (int64_t n = 0; n < size; ++n) {
            work.value[n] = work.new_value[n];
            work.start_slopes[n] = last(n);
        }
        for (int64_t n = 0; n < tableau.stages * size; ++n) work.past_slopes[n] = work.slopes[n];
        for (int64_t j = 0; record.jacobian && j < tableau.stages; ++j) {
            const double weight = h_weight(j);
            const double* changes = work.slope_changes + j * size * work.columns;
            for (int64_t n = 0; n < size * work.columns; ++n) work.change[n] += weight * changes[n];
        }
    }

    // Weight of stage j in the step that was solved last.
    double h_weight(int64_t j) const {
        const double h = work.stage[tableau.stages - 1].share / tableau.diagonal(tableau.stages - 1);
        return h * tableau.a[(tableau.stages - 1) * tableau.stages + j];
    }

    Ending limit_reached(const double* values) const {
        for (int64_t i = 0; i < model.fibres; ++i) {
            const double* own = values + i * work.unknowns;
            for (int64_t j = 0; j < work.states; ++j) {
                if (candidate.limits.state_passed(j, own[2 + j])) return STATE_LIMIT;
            }
            if (own[1] >= candidate.limits.strain) return STRAIN_LIMIT;
        }
        return REACHED_END;
    }

    // Share of the step at which the first fibre passes a limit.
    double limit_crossing(double h) const {
        constexpr int BISECTIONS = 40;
        double low = 0.0, high = 1.0;
        for (int k = 0; k < BISECTIONS; ++k) {
            const double middle = 0.5 * (low + high);
            for (int64_t n = 0; n < work.size(); ++n) {
                work.base[n] = DenseOutput(tableau, work.value[n], h, work.slopes + n, work.size()).at(middle);
            }
            (limit_reached(work.base) != REACHED_END ? high : low) = middle;
        }
        return high;
    }

    // Whether a state, growing ever faster, passes its limit within the share `margin` of the time.
    bool approaching(double pace, double margin) const {
        const int64_t U = work.unknowns;
        for (int64_t i = 0; i < model.fibres; ++i) {
            for (int64_t j = 0; j < work.states; ++j) {
                const int64_t n = i * U + 2 + j;
                const double limit = candidate.limits.states[j], slope = last(n), gap = limit - work.new_value[n];
                const bool faster = slope * gap > 0.0 && fabs(slope) > fabs(work.slopes[n]);
                if (isfinite(limit) && faster && fabs(gap) * pace < margin * fabs(slope)) return true;
            }
        }
        return false;
    }

    // Write the outputs that lie within the step, up to its `share`.
    void fill(const SegmentClock& clock, double s, double h, double share, IntegrationProgress& progress) const {
        const int64_t O = model.rows, C = work.columns;
        bool gathered = false;
        for (; progress.done < test.time_count; ++progress.done) {
            double x = (clock.position(test.times[progress.done]) - s) / h;
            if (x > share * (1.0 + 1e-10)) break;
            x = x < 0.0 ? 0.0 : x > 1.0 ? 1.0 : x;
            if (!gathered) gather();
            gathered = true;
            double* values = record.recorded + progress.done * O;
            for (int64_t o = 0; o < O; ++o) values[o] = work.observed[o];
            double* changes = record.jacobian ? record.jacobian + progress.done * O * C : nullptr;
            for (int64_t n = 0; n < O * C && changes; ++n) changes[n] = work.observed_change[n];
            for (int64_t j = 0; j < tableau.stages; ++j) {
                const double weight = h * dense_weight(tableau, j, x);
                for (int64_t o = 0; o < O; ++o) values[o] += weight * work.observed_slopes[j * O + o];
                for (int64_t n = 0; n < O * C && changes; ++n) {
                    changes[n] += weight * work.observed_slope_changes[j * O * C + n];
                }
            }
        }
    }

    // What is recorded of c, at the start of the step and of its slopes, with the derivatives.
    void gather() const {
        const int64_t O = model.rows, C = work.columns, size = work.size();
        observe(work.value, work.change, work.observed, work.observed_change);
        for (int64_t j = 0; j < tableau.stages; ++j) {
            observe(work.slopes + j * size, work.slope_changes + j * size * C, work.observed_slopes + j * O,
                    work.observed_slope_changes + j * O * C);
        }
    }

    void observe(const double* values, const double* changes, double* seen, double* seen_changes) const {
        const int64_t C = work.columns, U = work.unknowns;
        for (int64_t o = 0; o < model.rows; ++o) {
            const double* weights = model.observed + o * model.fibres;
            seen[o] = 0.0;
            for (int64_t q = 0; q < C; ++q) seen_changes[o * C + q] = 0.0;
            for (int64_t i = 0; i < model.fibres; ++i) {
                if (weights[i] == 0.0) continue;
                seen[o] += weights[i] * values[i * U];
                const double* own = changes + i * U * C;
                for (int64_t q = 0; q < C; ++q) seen_changes[o * C + q] += weights[i] * own[q];
            }
        }
    }
};

}  // namespace creepkit
