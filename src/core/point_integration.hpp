// Adaptive integration of one material point over a load program, with dense output and sensitivities.
#pragma once

#include <math.h>
#include <stdint.h>

#include "comparison.hpp"
#include "event_location.hpp"
#include "runge_kutta_step.hpp"
#include "step_control.hpp"

namespace creepkit {

constexpr double SMALLEST_STEP = 1e-13;        // of the position
constexpr double SMALLEST_FIRST_STEP = 1e-60;
constexpr double ROUNDING = 1e-12;             // of what creep took of a stress, below which none is left
constexpr double NEGLIGIBLE = 0.01;            // share of the tolerance within which a time need not be known better

// Share of a step's tolerance that the increment of a stage may err by. The weights of the methods add up the errors of
// the stages some thirty times at most.
constexpr double NEGLIGIBLE_STAGE_ERROR = 1e-3;
constexpr double LOOSEST_STAGES = 1e-2;  // as if the tolerance of a step were at most this

// One candidate's numbers: the law with its parameters; beta, the leading exponent of time; its limits.
struct Candidate {
    LawCall law;
    double beta;
    TerminationLimits limits;
};

// What a point goes through.
//
// segments : (segment_count, 6) start, end, driving stress at both, temperature at both; a stress that is prescribed
//     keeps its sign within each
// times    : (time_count,) s, non-decreasing, none beyond the last segment
struct PointTest {
    StressControl drive;
    int64_t segment_count, time_count;
    const double *segments, *times;
};

// What is recorded of it: strain (times,), of a bar the axial creep strain, left as it is after the end; jacobian
// (times, P), values (times, S) and path (times,), the equivalent creep strain, or null to do without.
struct PointRecord {
    double *strain, *values, *jacobian;
    LevelEvents arrivals;
    double* path;
};

// done, reached : output times filled, levels reached; steps, rejected : how many; code, time : its end, s.
struct IntegrationProgress {
    int64_t done, reached, steps, rejected;
    Ending code;
    double time;
};

// The integration of one history: what stays the same all along.
struct PointIntegration {
    const Candidate& candidate;
    const PointTest& test;
    const PointRecord& record;
    const IntegrationSettings& settings;
    const Tableau& tableau;
    const SlopePredictor& predictor;
    StepWorkspace& work;

    // Integrate from time zero, up to the end reached.
    IntegrationProgress run() const {
        IntegrationProgress progress = {start(), 0, 0, 0, REACHED_END, 0.0};
        for (int64_t k = 0; k < test.segment_count && progress.code == REACHED_END; ++k) {
            Segment segment(test.segments + 6 * k);
            double from = segment.start;
            do {
                segment = segment.from(from);
                const Segment part = turned(segment);
                from = through(part, test.drive.along(work.sign), progress);
            } while (from < segment.end && progress.code == REACHED_END);
        }
        return progress;
    }

private:
    // Return to a virgin state; fill the outputs at time zero and return their number.
    int64_t start() const {
        for (int64_t v = 0; v < work.unknowns(); ++v) work.value[v] = v > 0 ? candidate.limits.initial[v - 1] : 0.0;
        for (int64_t k = 0; k < work.unknowns() * work.parameters; ++k) work.change[k] = 0.0;
        for (int64_t p = 0; p < work.parameters; ++p) work.offset_change[p] = 0.0;
        work.sign = 1.0;
        work.offset = 0.0;
        int64_t done = 0;
        for (; done < test.time_count && test.times[done] <= 0.0; ++done) {
            record.strain[done] = 0.0;
            if (record.path) record.path[done] = 0.0;
            for (int64_t v = 1; record.values && v < work.unknowns(); ++v) {
                record.values[done * (work.unknowns() - 1) + v - 1] = candidate.limits.initial[v - 1];
            }
            for (int64_t p = 0; record.jacobian && p < work.parameters; ++p) {
                record.jacobian[done * work.parameters + p] = 0.0;
            }
        }
        return done;
    }

    // The rate of a bar's back stress where it does not flow, MPa/s along the flow.
    double recovery(const Segment& segment) const {
        if (!work.back.any()) return 0.0;
        work.row[TIME] = segment.start;
        work.row[TEMPERATURE] = segment.temperature;
        for (int64_t v = 1; v < work.unknowns(); ++v) work.row[POINT_SIZE + v - 1] = work.value[v];
        write_point(work.row, test.drive.along(work.sign).axes, work.back_stress(work.value), work.value[0]);
        candidate.law.update(1, work.row, candidate.law.theta, work.out);
        return work.back_stress(work.out);
    }

    // Make what is along the flow so in the opposite direction.
    void reverse() const {
        for (int64_t i = 0; i < work.states; ++i) {
            if (work.back.weight(i) == 0.0) continue;
            work.value[1 + i] = -work.value[1 + i];
            for (int64_t p = 0; p < work.parameters; ++p) work.change[(1 + i) * work.parameters + p] *= -1.0;
        }
        work.offset += 2.0 * work.sign * work.value[0];
        for (int64_t p = 0; p < work.parameters; ++p) work.offset_change[p] += 2.0 * work.sign * work.change[p];
        work.sign = -work.sign;
    }

    // A segment by the size of a bar's stress, in the direction that it has from its start on.
    Segment turned(const Segment& segment) const {
        const StressControl& drive = test.drive;
        if (!drive.of_bar()) return segment;
        const double creep = work.offset + work.sign * work.value[0], growth = exp(drive.load * creep);
        const double back = work.back_stress(work.value);
        const double rounding = ROUNDING * (drive.stiffness * work.value[0] + fabs(back));
        const double now = (segment.stress - drive.stiffness * creep) * growth - work.sign * back;
        const double ahead = fabs(now) > rounding ? now : segment.stress_rate * growth - work.sign * recovery(segment);
        if (ahead * work.sign < 0.0) reverse();
        return segment.directed(work.sign * exp(drive.load * work.offset), drive.stiffness * work.offset);
    }

    // Integrate over one segment in its transformed time s, from 0 to 1; the time up to which its stress has one sign.
    double through(const Segment& segment, const StressControl& drive, IntegrationProgress& progress) const {
        const LawCall& law = candidate.law;
        const SegmentStart beginning = choose_time_transformation(law.update, law.theta, candidate.beta, drive,
                                                                  segment, work.value, work);
        const SegmentClock clock(beginning.clock);
        const bool outputs = progress.done < test.time_count;
        if (record.jacobian) {
            const double due = outputs ? smaller(segment.end, test.times[progress.done]) : segment.end;
            differentiate_time_transformation(law.update, law.theta, candidate.beta, drive, segment,
                                              beginning.clock, due, work);
        }
        const double first = outputs ? smaller(1.0, clock.position(test.times[progress.done])) : 1.0;
        double s = 0.0, h = smaller(settings.first, first);
        double slope = beginning.rate > 0.0 ? beginning.rate * clock.at(1e-12).pace : NAN, steep = slope;
        bool growing = true;
        const bool from_virgin = clock.transformation.tau == 0.0;
        FirstStepControl first_step;
        AcceptedStep before = {0.0, 1.0};
        int64_t near = -1;  // the unknown that is about to pass its limit
        const auto end = [&](Ending code, double place) {
            progress.code = code;
            progress.time = place > 0.0 ? clock.at(place).time : segment.start;
            return progress.time;
        };
        while (s < 1.0) {
            h = bounded_step(s, h, settings.longest);
            if (progress.steps + progress.rejected >= most_steps(settings, test.segment_count)) return end(TOO_MANY_STEPS, s);
            if (!(h >= SMALLEST_STEP * s && h >= SMALLEST_FIRST_STEP)) {
                const Ending code = near > 0 ? STATE_LIMIT : why_small(s, slope);
                if (code != STEP_TOO_SMALL && record.jacobian) steep_end(clock, s, near > 0 ? near : 0, steep);
                return end(code, s);
            }
            const double error = attempt(segment, drive, clock, s, h, slope, first, before);
            if (!(error <= 1.0)) {
                h *= s == 0.0 && from_virgin ? first_step.factor(h, error) : step_factor(tableau, error, false);
                growing = false;
                ++progress.rejected;
                continue;
            }
            ++progress.steps;
            Ending code = limit_reached(candidate.limits, work);
            double share = 1.0;
            int64_t ended;  // the unknown at its limit
            if (code != REACHED_END) {
                share = limit_crossing(candidate.limits, tableau, work, h);
                ended = first_limit_passed(candidate.limits, tableau, work, h, share);
            } else {
                const TimeAndPace now = clock.at(s + h);
                const double pace = now.time > 0.0 ? now.pace / now.time : INFINITY;
                ended = approaching_limit(candidate.limits, work, pace, NEGLIGIBLE * settings.rtol);
                code = ended < 0 ? REACHED_END : ended > 0 ? STATE_LIMIT : DIVERGED;
                near = approaching_limit(candidate.limits, work, pace, TERMINATION_MARGIN);
                steep = work.last_slope(near > 0 ? near : 0);
            }
            const double rounding =
                ROUNDING * (drive.stiffness * work.new_value[0] + fabs(work.back_stress(work.new_value)));
            const bool turns = drive.of_bar() && (drive.stiffness > 0.0 || work.back.any()) &&
                               left(segment, drive, clock, s, h, share) < -rounding;
            if (turns) {
                share = turning(segment, drive, clock, s, h, share);
                code = REACHED_END;
            }
            fill(clock, s, h, share, progress);
            progress.reached = locate_levels(clock, tableau, work, s, h, share, record.arrivals, progress.reached);
            if (code != REACHED_END) {
                if (record.jacobian) {
                    log_time_sensitivity(clock, tableau, work, s, h, share, ended, record.arrivals.end_change);
                }
                return end(code, s + share * h);
            }
            if (turns) {
                stop(clock, s, h, share);
                return progress.time = clock.at(s + share * h).time;
            }
            accept();
            slope = work.last_slope(0);
            s = h == 1.0 - s ? 1.0 : s + h;
            double longer = step_factor(tableau, error, growing);
            if (!growing) longer *= predictive_step_factor(tableau, before, h, error);
            before = {h, error};
            h *= longer;
            growing = true;
        }
        return progress.time = segment.end;
    }

    // Try a step; return its error over what is allowed, infinite when a stage has no solution.
    double attempt(const Segment& segment, const StressControl& drive, const SegmentClock& clock, double s, double h,
                   double slope, double first, const AcceptedStep& before) const {
        // Under prescribed strain the stress counts as well: there Newton's tolerance alone decides.
        const double negligible = drive.stiffness > 0.0 && !work.back.any() ? 0.0 : work.value[0] + settings.smallest;
        const StepStart start = {slope, before.length, newton_tolerance(settings),
                                 NEGLIGIBLE_STAGE_ERROR * smaller(LOOSEST_STAGES, settings.rtol) * negligible};
        if (advance(candidate.law, drive, segment, clock, tableau, predictor, work, s, h, start) != SOLVED) {
            return INFINITY;
        }
        const double ahead = larger(1.0, first / (s + h));
        const double caution = s == 0.0 && clock.transformation.tau == 0.0 ? INITIAL_ERROR_FACTOR : 1.0;
        double error = caution * strain_error(tableau, drive, segment, work, settings, h, ahead, slope);
        if (error <= 1.0 && record.jacobian) {
            if (differentiate(candidate.law, drive, segment, clock, tableau, work, s, h) != SOLVED) {
                return INFINITY;
            }
            error = larger(error, caution * sensitivity_error(tableau, work, settings, h, ahead));
        }
        return error;
    }

    // Make the end of the step the start of the next.
    void accept() const {
        for (int64_t v = 0; v < work.unknowns(); ++v) work.value[v] = work.new_value[v];
        for (int64_t k = 0; k < work.stages * work.unknowns(); ++k) work.past_slopes[k] = work.slopes[k];
        if (!record.jacobian) return;
        for (int64_t k = 0; k < work.unknowns() * work.parameters; ++k) work.change[k] = work.new_change[k];
    }

    // What is left of a bar's (effective) stress at the share x of the step, MPa, below zero where it has another sign.
    double left(const Segment& segment, const StressControl& drive, const SegmentClock& clock, double s, double h,
                double x) const {
        const double creep = work.dense(tableau, h, 0).at(x);
        double stress = segment.stress_at(clock.at(s + x * h).time) - drive.stiffness * creep;
        if (!work.back.any()) return stress;
        if (drive.load != 0.0) stress *= exp(drive.load * creep);
        for (int64_t i = 0; i < work.states; ++i) stress -= work.back.weight(i) * work.dense(tableau, h, 1 + i).at(x);
        return stress;
    }

    // The share of the step, `high` at most, at which nothing is left of it.
    double turning(const Segment& segment, const StressControl& drive, const SegmentClock& clock, double s, double h,
                   double high) const {
        constexpr int BISECTIONS = 60;
        double low = 0.0;
        for (int k = 0; k < BISECTIONS; ++k) {
            const double middle = 0.5 * (low + high);
            (left(segment, drive, clock, s, h, middle) < 0.0 ? high : low) = middle;
        }
        return high;
    }

    // Make the share x of the step the start of what follows.
    void stop(const SegmentClock& clock, double s, double h, double x) const {
        for (int64_t v = 0; v < work.unknowns(); ++v) {
            work.new_value[v] = work.dense(tableau, h, v).at(x);
            if (!record.jacobian) continue;
            dense_sensitivity(clock, tableau, work, s, h, x, v, work.new_change + v * work.parameters);
        }
        accept();
    }

    // A step that shrinks to nothing while the rate would burst the point at once: the rate diverges.
    Ending why_small(double s, double slope) const {
        return slope * larger(s, 1e-6) > settings.strain_limit ? DIVERGED : STEP_TOO_SMALL;
    }

    // The derivative of the end where unknown v is vertical over time: a rate that diverges, a limit just ahead.
    void steep_end(const SegmentClock& clock, double s, int64_t v, double slope) const {
        const TimeAndPace now = clock.at(s);
        const double rate = slope * now.time / now.pace;
        for (int64_t p = 0; p < work.parameters; ++p) {
            record.arrivals.end_change[p] = -work.change[v * work.parameters + p] / rate;
        }
    }

    // Write the outputs that lie within the step, up to its `share`.
    void fill(const SegmentClock& clock, double s, double h, double share, IntegrationProgress& progress) const {
        if (progress.done >= test.time_count) return;
        const DenseOutput strain = work.dense(tableau, h, 0);
        for (; progress.done < test.time_count; ++progress.done) {
            double x = (clock.position(test.times[progress.done]) - s) / h;
            if (x > share * (1.0 + 1e-10)) break;
            x = x < 0.0 ? 0.0 : x > 1.0 ? 1.0 : x;
            record.strain[progress.done] = work.offset + work.sign * strain.at(x);
            if (record.path) record.path[progress.done] = strain.at(x);
            for (int64_t v = 1; record.values && v < work.unknowns(); ++v) {
                const double value = work.dense(tableau, h, v).at(x);
                const bool along = work.back.weight(v - 1) != 0.0;
                record.values[progress.done * work.states + v - 1] = along ? work.sign * value : value;
            }
            if (record.jacobian) {
                double* change = record.jacobian + progress.done * work.parameters;
                dense_sensitivity(clock, tableau, work, s, h, x, 0, change);
                for (int64_t p = 0; p < work.parameters; ++p) change[p] = work.offset_change[p] + work.sign * change[p];
            }
        }
    }
};

}  // namespace creepkit
