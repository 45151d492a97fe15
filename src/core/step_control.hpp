// Step control: error tolerances, step lengths, and the choice of the time transformation of a segment.
#pragma once

#include <math.h>
#include <stdint.h>

#include "comparison.hpp"
#include "runge_kutta_step.hpp"

namespace creepkit {

// How accurately, and how far, to integrate.
//
// rtol         : local error allowed in a step, relative to strain and to each state
// smallest     : strain below which the error is relative to this instead
// strain_limit : creep strain at which the point has burst
// first, longest : first and longest step, as shares of a segment (in its transformed time)
// max_steps    : cap on steps, accepted and rejected, of one history; see most_steps
struct IntegrationSettings {
    double rtol, smallest, strain_limit, first, longest;
    int64_t max_steps;
};

// Each further straight piece of a program takes some 7 steps of its own; a logged temperature has thousands of pieces.
constexpr int64_t STEPS_PER_PIECE = 20;

// Steps that one history may take, accepted and rejected: its own programs decide, not those of tests beside it.
inline int64_t most_steps(const IntegrationSettings& settings, int64_t pieces) {
    return settings.max_steps + STEPS_PER_PIECE * (pieces > 1 ? pieces - 1 : 0);
}

// Newton's last correction; its square, the error left, is a thousandth of the step's tolerance.
inline double newton_tolerance(const IntegrationSettings& settings) {
    const double tolerance = sqrt(1e-3 * settings.rtol);
    return tolerance < 1e-3 ? tolerance : 1e-3;
}

// Largest local error of the step and of its dense output over what is allowed.
//
// Infinite when creep strain falls, which it never does. Under prescribed strain the stress counts as well. The error of
// a back stress is relative to it and to the effective stress.
// ahead : the first output's position over that of the step's end: until then only the strain there matters.
// slope : dp/ds at the start of the step, NaN when not known; with it, Hermite's cubic checks the dense output.
inline double strain_error(const Tableau& tableau, const StressControl& drive, const Segment& segment,
                           const StepWorkspace& work, const IntegrationSettings& settings, double h, double ahead,
                           double slope) {
    if (work.new_value[0] < work.value[0]) return INFINITY;
    double reach = work.new_value[0] * ahead;
    if (drive.stiffness > 0.0) {
        const double stress = segment.end_stress - drive.stiffness * work.new_value[0];
        reach = smaller(reach, (fabs(stress) + fabs(work.back_stress(work.new_value))) / drive.stiffness);
    }
    double worst = local_error(tableau, work, h, 0);
    if (!isnan(slope)) {
        const double hermite =
            0.5 * (work.value[0] + work.new_value[0] + 0.25 * h * (slope - work.last_slope(0)));
        const double off = fabs(work.dense(tableau, h, 0).at(0.5) - hermite);
        worst = worse(worst, off);
    }
    worst /= settings.rtol * (reach + settings.smallest);
    const double effective = work.back.any() ? fabs(work.effective_stress(tableau, h)) : 0.0;
    for (int64_t v = 1; v < work.unknowns(); ++v) {
        double state = larger(fabs(work.value[v]), fabs(work.new_value[v])) + settings.smallest;
        state += effective * work.back.weight(v - 1);
        worst = worse(worst, local_error(tableau, work, h, v) / (settings.rtol * state));
    }
    return isfinite(worst) ? worst : INFINITY;
}

// Sensitivities are of the order of ten strains: d(strain)/d(exponent) = strain ln(stress).
constexpr double SENSITIVITY_SLACK = 10.0;

// Largest local error of the sensitivities of strain over what is allowed: of ten strains, or of themselves.
//
// Before a rupture they grow without end, for there strain is vertical over time.
inline double sensitivity_error(const Tableau& tableau, const StepWorkspace& work,
                                const IntegrationSettings& settings, double h, double ahead) {
    const int64_t stride = work.unknowns() * work.parameters;
    const double reach = SENSITIVITY_SLACK * (work.new_value[0] * ahead + settings.smallest);
    double worst = 0.0;
    for (int64_t p = 0; p < work.parameters; ++p) {
        double total = 0.0;
        for (int64_t i = 0; i < tableau.stages; ++i) total += tableau.error[i] * work.slope_changes[i * stride + p];
        worst = worse(worst, fabs(h * total) / (settings.rtol * larger(reach, fabs(work.new_change[p]))));
    }
    return isfinite(worst) ? worst : INFINITY;
}

constexpr double STEP_SAFETY = 0.9, LEAST_STEP_FACTOR = 0.1, MOST_STEP_FACTOR = 8.0;

// From a virgin state strain is a sum of broken powers of s, on which the first step is of order 1 and its error is up
// to 2.5 times the estimate; afterwards the estimate exceeds the error some twenty times.
constexpr double INITIAL_ERROR_FACTOR = 10.0;

// Factor on the step after an error; a step that follows a rejection does not grow.
inline double step_factor(const Tableau& tableau, double error, bool growing) {
    if (!isfinite(error)) return LEAST_STEP_FACTOR;
    const double factor = STEP_SAFETY * pow(larger(error, 1e-12), -1.0 / double(tableau.error_order + 1));
    const double most = growing ? MOST_STEP_FACTOR : 1.0;
    return factor < LEAST_STEP_FACTOR ? LEAST_STEP_FACTOR : factor > most ? most : factor;
}

// The first step from a virgin state: on a sum of broken powers of s the error falls about as the step itself.
//
// Each rejection tells with the one before what power of the step the error follows.
class FirstStepControl {
public:
    // Factor on the first step after an error.
    double factor(double h, double error) {
        if (!isfinite(error)) return LEAST_STEP_FACTOR;
        double order = 1.0;
        if (length_ > 0.0) order = log(error_ / error) / log(length_ / h);
        order = order > LEAST_ORDER ? smaller(MOST_ORDER, order) : LEAST_ORDER;
        length_ = h;
        error_ = error;
        return larger(LEAST_FACTOR, STEP_SAFETY * pow(error, -1.0 / order));
    }

private:
    static constexpr double LEAST_ORDER = 0.25, MOST_ORDER = 4.0, LEAST_FACTOR = 1e-4;
    double length_ = 0.0, error_ = 0.0;
};

// The last accepted step: its length (0: none yet), and its error over what was allowed.
struct AcceptedStep {
    double length, error;
};

// Factor, at most one, on the step after one that had to be tried again.
//
// On the way to a singularity every step must be shorter than the last. That goes on: predictive control, Gustafsson
// (1994), ACM Trans. Math. Softw. 20, 496.
inline double predictive_step_factor(const Tableau& tableau, const AcceptedStep& before, double h, double error) {
    if (!(before.length > 0.0)) return 1.0;
    const double ratio =
        pow(larger(before.error, 1e-12) / larger(error, 1e-12), 1.0 / double(tableau.error_order + 1));
    const double factor = ratio * h / before.length;
    return factor < LEAST_STEP_FACTOR ? LEAST_STEP_FACTOR : factor > 1.0 ? 1.0 : factor;
}

// The step, not too long, and ending at 1 rather than just before it.
inline double bounded_step(double s, double h, double longest) {
    const double step = smaller(h, longest);
    return s + 1.001 * step > 1.0 ? 1.0 - s : step;
}

constexpr double ZERO_STRAIN = 1e-25;  // creep strain below this is none
constexpr double NUDGE = 1e-6;         // relative change of a parameter for a difference

// The time transformation of a segment, and the rate at its start (0: not known).
struct SegmentStart {
    TimeTransformation clock;
    double rate;
};

// r in p'' = r p' and its rate, if ln f kept its logarithmic slopes to time, strain and stress.
struct CurveBend {
    double bend, rate;
};

// row, out : input and output of the law's update where the segment begins; rate : exp(out[0]).
inline CurveBend curve_bend(const StressControl& drive, const Segment& segment, const BackStresses& back, double rate,
                            const double* row, const double* out, int64_t size) {
    const double by_stress = stress_derivative(out, size, drive.axes);
    const double strain = row[STRAIN], time = row[TIME], aging = out[size + TIME];
    const double hardening = strain > 0.0 ? rate * out[size + STRAIN] : 0.0;
    const double thinning = rate * drive.load * row[STRESS] * by_stress;
    const double effective = row[STRESS] - back.sum(row + POINT_SIZE, size - 1);
    const double fall = drive.stiffness * rate + back.sum(out + 1, size - 1), relaxing = -fall * by_stress;
    double driven = by_stress * segment.stress_rate * exp(drive.load * strain);
    driven += out[size + TEMPERATURE] * segment.temperature_rate;
    for (int64_t v = 1; v < size; ++v) {
        if (back.weight(v - 1) == 0.0) driven += out[size + POINT_SIZE + v - 1] * out[v];
    }
    const double bend = aging + hardening + thinning + relaxing + driven;
    double bend_rate = thinning * bend + relaxing * (bend + fall / effective);
    if (time > 0.0) bend_rate -= aging / time;
    if (strain > 0.0) bend_rate += hardening * (bend - rate / strain);
    return {bend, bend_rate};
}

// theta : (P,); beta : leading exponent of time; value : (V,) strain and states where the segment begins.
inline SegmentStart choose_time_transformation(LawEntry update, const double* theta, double beta,
                                               const StressControl& drive, const Segment& segment,
                                               const double* value, StepWorkspace& work) {
    const double length = segment.end - segment.start, strain = value[0];
    if (strain < ZERO_STRAIN && beta < 1.0) return {power_law_time(segment.start, length, beta), 0.0};
    const double stress = (segment.stress - drive.stiffness * strain) * exp(drive.load * strain);
    if (!(stress - work.back_stress(value) > 0.0)) return {linear_time(segment.start, length), 0.0};
    double *row = work.row, *out = work.out;
    row[TIME] = segment.start;
    row[TEMPERATURE] = segment.temperature;
    for (int64_t v = 1; v < work.unknowns(); ++v) row[POINT_SIZE + v - 1] = value[v];
    write_point(row, drive.axes, stress, strain);
    update(1, row, theta, out);
    const double rate = exp(smaller(600.0, out[0]));
    if (isnan(out[0]) || !(rate > 0.0)) return {linear_time(segment.start, length), 0.0};
    const CurveBend curve = curve_bend(drive, segment, work.back, rate, row, out, work.unknowns());
    return {shifted_power_law_time(segment.start, length, curve.bend, curve.rate), rate};
}

// Exponent of time of the curve p ~ t^b that a virgin state follows about `time`, s.
inline double local_exponent(LawEntry update, const double* theta, double beta, const StressControl& drive,
                             const Segment& segment, double time, StepWorkspace& work) {
    constexpr int ITERATIONS = 30;
    double *row = work.row, *out = work.out;
    const int64_t size = work.unknowns();
    const double elapsed = time - segment.start, stress = segment.stress + segment.stress_rate * elapsed;
    row[TIME] = time;
    row[TEMPERATURE] = segment.temperature + segment.temperature_rate * elapsed;
    for (int64_t v = 1; v < size; ++v) row[POINT_SIZE + v - 1] = work.value[v];
    double log_strain = -7.0, exponent = beta;
    for (int iteration = 0; iteration < ITERATIONS; ++iteration) {
        write_point(row, drive.axes, stress, exp(log_strain));
        update(1, row, theta, out);
        const double softening = 1.0 - out[size + STRAIN] * row[STRAIN];
        exponent = (1.0 + elapsed * out[size + TIME]) / softening;
        const double step = (log(elapsed / beta) + out[0] - log_strain) / softening;
        if (!isfinite(step) || fabs(step) < 1e-10) break;
        const double next = log_strain + step;
        log_strain = next < -65.0 ? -65.0 : next > 0.0 ? 0.0 : next;
    }
    return exponent;
}

// Write into the workspace how the time transformation moves with each parameter, (2, P).
//
// first : s, the first output time. Any motion gives right sensitivities, since they are exact for a moving time
// transformation. This one, by differences, keeps them as smooth in s as the strain itself: it follows the exponent
// that prevails when the first output is due.
inline void differentiate_time_transformation(LawEntry update, const double* theta, double beta,
                                              const StressControl& drive, const Segment& segment,
                                              const TimeTransformation& clock, double first, StepWorkspace& work) {
    const int64_t count = work.parameters, size = work.unknowns();
    for (int64_t p = 0; p < 2 * count; ++p) work.clock_change[p] = 0.0;
    const bool from_virgin = clock.tau == 0.0;
    if (from_virgin && !(SMALLEST_EXPONENT < beta && beta < 1.0)) return;
    const double here = from_virgin ? local_exponent(update, theta, beta, drive, segment, first, work) : 0.0;
    double *nudged = work.nudged, *value = work.nudged_value;
    for (int64_t p = 0; p < count; ++p) nudged[p] = theta[p];
    for (int64_t p = 0; p < count; ++p) {
        if (!isfinite(theta[p])) continue;
        const double step = NUDGE * larger(1.0, fabs(theta[p]));
        nudged[p] = theta[p] + step;
        if (from_virgin) {
            const double change = (local_exponent(update, nudged, beta, drive, segment, first, work) - here) / step;
            work.clock_change[p] = isfinite(change) ? change : 0.0;
        } else {
            for (int64_t v = 0; v < size; ++v) value[v] = work.value[v] + step * work.change[v * count + p];
            const TimeTransformation moved =
                choose_time_transformation(update, nudged, beta, drive, segment, value, work).clock;
            if (moved.tau > 0.0 && moved.beta != 1.0 && clock.beta != 1.0) {
                work.clock_change[p] = (moved.beta - clock.beta) / step;
                work.clock_change[count + p] = (moved.tau - clock.tau) / step;
            }
        }
        nudged[p] = theta[p];
    }
}

}  // namespace creepkit
