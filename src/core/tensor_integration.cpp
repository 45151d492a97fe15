// Adaptive integration of one material point under prescribed stresses and strains of its six components.
//
// Steps end at every output time, so that no dense output is needed but for the place where a limit is passed.
#include <math.h>
#include <stdint.h>

#include "comparison.hpp"
#include "event_location.hpp"
#include "export.hpp"
#include "step_control.hpp"
#include "tableaux.hpp"
#include "tensor_point.hpp"
#include "time_transformation.hpp"
#include "workspace.hpp"

namespace creepkit {

// The call, mirrored field by field by creepkit.integration.core_structures. S states, P parameters, T output times.
struct TensorIntegration {
    LawEntry update;  // of the law
    int64_t states, segment_count, output_count;
    const double* theta;     // (P,) internal parameters
    const double* initial;   // (S,) states at time zero
    const double* limits;    // (S,) values at which the point has failed, inf for none
    const int64_t* held;     // (6,) 1 where the strain is prescribed, 0 where the stress is
    const double* segments;  // (segment_count, 16) start, end, s; then the six imposed quantities and the temperature,
                             // each where the segment begins and where it ends
    const double* outputs;   // (T,) s, non-decreasing, none beyond the last segment
    double modulus, ratio;   // Young's modulus, MPa, and Poisson's ratio
    double beta;             // leading exponent of time
    IntegrationSettings settings;
    Tableau tableau;
    double* history;         // (T, 7 + S) out: vectors of the point at the output times reached
    int64_t reached, ending, steps;  // out: output times reached, code of event_location.hpp, accepted steps
    double end_time;                 // out: s
};

// The integration of a virgin point from time zero.
//
// V = 7 + S. value : (V,) now; slopes, trial_slopes : (stages, V) of the last accepted step and of the one tried;
// proposed : (V,) at its end; base, guess, answer : (V,) of a stage.
class TensorIntegrator {
public:
    TensorIntegrator(Workspace& memory, TensorIntegration& call)
        : call_(call),
          point_(memory, call.update, call.theta, call.states, call.modulus, call.ratio),
          size_(EQUIVALENT_STRAIN + 1 + call.states),
          value_(memory.doubles(size_)),
          slopes_(memory.doubles(call.tableau.stages * size_)),
          trial_slopes_(memory.doubles(call.tableau.stages * size_)),
          proposed_(memory.doubles(size_)),
          base_(memory.doubles(size_)),
          guess_(memory.doubles(size_)),
          answer_(memory.doubles(size_)) {}

    void run() {
        for (int64_t k = 0; k < COMPONENTS; ++k) point_.held[k] = call_.held[k] != 0;
        for (int64_t i = 0; i < call_.states; ++i) value_[EQUIVALENT_STRAIN + 1 + i] = call_.initial[i];
        call_.reached = call_.steps = 0;
        call_.ending = REACHED_END;
        call_.end_time = 0.0;
        record();
        for (int64_t k = 0; k < call_.segment_count && call_.ending == REACHED_END; ++k) {
            call_.ending = through(call_.segments + SEGMENT_COLUMNS * k);
        }
    }

private:
    static constexpr int64_t QUANTITIES = COMPONENTS + 1, SEGMENT_COLUMNS = 2 + 2 * QUANTITIES;
    static constexpr double SMALLEST_STEP = 1e-13, SMALLEST_FIRST_STEP = 1e-60;

    TensorIntegration& call_;
    TensorPoint point_;
    int64_t size_;
    double *value_, *slopes_, *trial_slopes_, *proposed_, *base_, *guess_, *answer_;
    int64_t attempts_ = 0;

    // Keep the vector for the output times that have come.
    void record() {
        for (; call_.reached < call_.output_count && call_.outputs[call_.reached] <= call_.end_time; ++call_.reached) {
            for (int64_t v = 0; v < size_; ++v) call_.history[call_.reached * size_ + v] = value_[v];
        }
    }

    // Integrate over one segment in its transformed time s, from 0 to 1.
    Ending through(const double* segment) {
        const IntegrationSettings& settings = call_.settings;
        const double start = segment[0], finish = segment[1];
        // A transformation in which a virgin point creeps evenly, else plain time.
        const SegmentClock clock(value_[EQUIVALENT_STRAIN] > 0.0 ? linear_time(start, finish - start)
                                                                 : power_law_time(start, finish - start, call_.beta));
        const bool from_virgin = clock.transformation.tau == 0.0;
        double s = 0.0, h = settings.first;
        FirstStepControl first_step;
        while (s < 1.0) {
            const bool due = call_.reached < call_.output_count && call_.outputs[call_.reached] < finish;
            const double time = due ? call_.outputs[call_.reached] : finish, goal = due ? clock.position(time) : 1.0;
            h = smaller(h, settings.longest);
            const bool last = s + 1.001 * h > goal;
            const double step = last ? goal - s : h;
            if (attempts_ >= most_steps(settings, call_.segment_count)) return TOO_MANY_STEPS;
            if (!(step >= SMALLEST_STEP * s && step >= SMALLEST_FIRST_STEP)) return why_small(clock, s);
            ++attempts_;
            const double error = attempt(segment, clock, s, step);
            if (!(error <= 1.0)) {
                h = step * (s == 0.0 && from_virgin ? first_step.factor(step, error)
                                                    : step_factor(call_.tableau, error, false));
                continue;
            }
            const double grown = step * step_factor(call_.tableau, error, true);
            h = last ? larger(grown, h) : grown;
            for (int64_t k = 0; k < call_.tableau.stages * size_; ++k) slopes_[k] = trial_slopes_[k];
            const Ending code = limit_passed(proposed_);
            if (code != REACHED_END) {
                call_.end_time = clock.at(s + step * crossing(step)).time;
                return code;
            }
            s = last ? goal : s + step;
            for (int64_t v = 0; v < size_; ++v) value_[v] = proposed_[v];
            ++call_.steps;
            call_.end_time = last ? time : clock.at(s).time;
            record();
        }
        return REACHED_END;
    }

    // Try a step; return its error over what is allowed, infinite when a stage has no solution.
    double attempt(const double* segment, const SegmentClock& clock, double s, double h) {
        const Tableau& tableau = call_.tableau;
        const double* slope = s > 0.0 ? slopes_ + (tableau.stages - 1) * size_ : nullptr;
        for (int64_t i = 0; i < tableau.stages; ++i) {
            const TimeAndPace now = clock.at(s + tableau.c[i] * h);
            const double share = tableau.diagonal(i) * h;
            double imposed[QUANTITIES];
            for (int64_t k = 0; k < QUANTITIES; ++k) {
                const double first = segment[2 + 2 * k], last = segment[3 + 2 * k];
                imposed[k] = first + (now.time - segment[0]) / (segment[1] - segment[0]) * (last - first);
            }
            for (int64_t v = 0; v < size_; ++v) {
                double total = 0.0;
                for (int64_t j = 0; j < i; ++j) {
                    total += tableau.a[i * tableau.stages + j] * trial_slopes_[j * size_ + v];
                }
                base_[v] = value_[v] + h * total;
                guess_[v] = base_[v] + (slope ? share * slope[v] : 0.0);
            }
            const double weight = share * now.pace, temperature = imposed[COMPONENTS];
            if (!point_.solve_stage(base_, guess_, imposed, now.time, temperature, weight, answer_)) {
                return INFINITY;
            }
            for (int64_t v = 0; v < size_; ++v) trial_slopes_[i * size_ + v] = (answer_[v] - base_[v]) / share;
            slope = trial_slopes_ + i * size_;
        }
        const bool first = s == 0.0 && clock.transformation.tau == 0.0;
        return error_of_step(h) * (first ? INITIAL_ERROR_FACTOR : 1.0);
    }

    // Largest local error over what is allowed, and the vector at the end; under prescribed strain the elastic strain
    // counts as well.
    double error_of_step(double h) {
        const Tableau& tableau = call_.tableau;
        bool any_held = false;
        for (int64_t k = 0; k < COMPONENTS; ++k) any_held = any_held || point_.held[k];
        const double elastic = any_held ? point_.equivalent_stress() / (3.0 * point_.shear) : INFINITY;
        double creep = 0.0, worst = 0.0;
        for (int64_t v = size_ - 1; v >= 0; --v) {
            double total = 0.0, error = 0.0;
            for (int64_t i = 0; i < tableau.stages; ++i) {
                total += tableau.a[(tableau.stages - 1) * tableau.stages + i] * trial_slopes_[i * size_ + v];
                error += tableau.error[i] * trial_slopes_[i * size_ + v];
            }
            proposed_[v] = value_[v] + h * total;
            double reach = larger(fabs(value_[v]), fabs(proposed_[v]));
            if (v == EQUIVALENT_STRAIN) creep = reach;
            if (v <= EQUIVALENT_STRAIN) reach = smaller(elastic, creep);
            const double relative = fabs(h * error) / (call_.settings.rtol * (reach + call_.settings.smallest));
            worst = worse(worst, relative);
        }
        if (proposed_[EQUIVALENT_STRAIN] < value_[EQUIVALENT_STRAIN]) return INFINITY;
        return isfinite(worst) ? worst : INFINITY;
    }

    // STATE_LIMIT or STRAIN_LIMIT when a vector has passed one, else REACHED_END.
    Ending limit_passed(const double* vector) const {
        const TerminationLimits limits = {call_.settings.strain_limit, call_.initial, call_.limits};
        for (int64_t i = 0; i < call_.states; ++i) {
            if (limits.state_passed(i, vector[EQUIVALENT_STRAIN + 1 + i])) return STATE_LIMIT;
        }
        return vector[EQUIVALENT_STRAIN] >= limits.strain ? STRAIN_LIMIT : REACHED_END;
    }

    // Share of the step at which the first limit is passed, by bisection of the dense output.
    double crossing(double h) const {
        constexpr int BISECTIONS = 60;
        double low = 0.0, high = 1.0;
        for (int k = 0; k < BISECTIONS; ++k) {
            const double middle = 0.5 * (low + high);
            for (int64_t v = EQUIVALENT_STRAIN; v < size_; ++v) {
                answer_[v] = DenseOutput(call_.tableau, value_[v], h, slopes_ + v, size_).at(middle);
            }
            (limit_passed(answer_) != REACHED_END ? high : low) = middle;
        }
        return high;
    }

    // A step that shrinks to nothing: at a limit just ahead, or while the rate would burst the point at once.
    Ending why_small(const SegmentClock& clock, double s) const {
        if (s > 0.0 && limit_ahead(clock, s)) return STATE_LIMIT;
        const double rate = slopes_[(call_.tableau.stages - 1) * size_ + EQUIVALENT_STRAIN] * larger(s, 1e-6);
        return rate > call_.settings.strain_limit ? DIVERGED : STEP_TOO_SMALL;
    }

    // Whether a state that moves ever faster will pass its limit before the time has grown by TERMINATION_MARGIN of it.
    bool limit_ahead(const SegmentClock& clock, double s) const {
        const TimeAndPace now = clock.at(s);
        for (int64_t i = 0; i < call_.states; ++i) {
            const int64_t v = EQUIVALENT_STRAIN + 1 + i;
            const double first = slopes_[v], last = slopes_[(call_.tableau.stages - 1) * size_ + v];
            const double gap = call_.limits[i] - value_[v];
            const double reach = TERMINATION_MARGIN * fabs(last) * now.time / now.pace;
            if (last * gap > 0.0 && fabs(last) > fabs(first) && fabs(gap) < reach) return true;
        }
        return false;
    }
};

}  // namespace creepkit

using namespace creepkit;

// 0; or 1 when memory runs out, 2 when a count is out of range.
CREEPKIT_API int64_t creepkit_integrate_tensor_point(TensorIntegration* call) {
    if (!call->tableau.valid() || call->states < 0 || call->states > MAX_STATES) return 2;
    Workspace memory;
    TensorIntegrator(memory, *call);
    if (!memory.allocate()) return 1;
    TensorIntegrator(memory, *call).run();
    return 0;
}
