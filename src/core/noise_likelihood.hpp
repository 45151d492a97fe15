// The covariance of the residuals of one test as a state-space model, and its Kalman filter: linear in observations.
//
// An observation i of output o has the error
//
//     drift_o x1(t_i) + D u_i x2(t_i) + offset_o s_i x3 + rate d_i x4 + life b_i x5 + sum_k e_ik x_k
//     + white noise of variance W_i,  W_i = (noise_o w_i)^2 + misfit_o^2 + jitter,
//
// where all x have unit variance. x1 and x2 are Ornstein-Uhlenbeck processes with correlation exp(-lag / length), drawn
// anew for each output, as is the offset x3; x4, x5 and the random effects x_k are one for the whole test. Each is a state
// of the model, with the transition phi = exp(-lag / length) (1: constant, 0: drawn anew) and the variance 1 - phi^2 of
// what the transition adds. White noise of one output may be correlated with that of others in the same frame: it is then
//
//     noise_o w_i (sum_k l_ik f_k + sqrt(1 - sum_k l_ik^2) of its own),
//
// with factors f_k of unit variance that are drawn anew for each frame. The observations of a test are then in the order
// of its frames, and each output has states of its own. The innovations v of the filter and their variances S are those of the Cholesky factor
// L of the covariance C, in the order of the observations: L^-1 y = v / sqrt(S), ln|C| = sum of ln S.
//
// Durbin & Koopman (2012), Time Series Analysis by State Space Methods, chapters 4 and 7; Koopman & Shephard (1992),
// Exact score for time series models in state space form, Biometrika 79, 823-826.
#pragma once

#include <math.h>
#include <stdint.h>

#include "workspace.hpp"

namespace creepkit {

// Added to variances, so that a covariance stays positive definite: absolute, and relative to correlated variances.
constexpr double ABSOLUTE_JITTER = 1e-10, RELATIVE_JITTER = 1e-9;

// Columns of what is known of an observation: lag to the previous one of its output (negative: it is the first), w, s,
// u, d, b, then e; where there are factors, whether the observation is the first of its frame (1 or 0), then l.
enum Loading { LAG, WHITE_LOADING, OFFSET_LOADING, DISCREPANCY_LOADING, RATE_LOADING, LIFE_LOADING, FIRST_EFFECT };

// Components of one output; behind those of all outputs the shared ones.
enum OutputComponent { NOISE, MISFIT, OFFSET, DRIFT, CORRELATION_LENGTH, OUTPUT_COMPONENTS };
enum SharedComponent { RATE, LIFE, DISCREPANCY, DISCREPANCY_LENGTH, SHARED_COMPONENTS };

// Observations of all tests, those of a test by output and in order of time, or with factors by frame.
//
// starts : (tests + 1,) first observation of each test. output : (observations,) position of its output. loadings :
// (observations, 6 + effects), with factors (observations, 7 + effects + factors), see Loading.
struct NoiseObservations {
    int64_t tests, outputs, effects, factors;
    const int64_t* starts;
    const int64_t* output;
    const double* loadings;

    int64_t count() const { return starts[tests]; }
    int64_t first_of_frame() const { return FIRST_EFFECT + effects; }
    int64_t columns() const { return first_of_frame() + (factors > 0 ? 1 + factors : 0); }
    const double* of(int64_t observation) const { return loadings + observation * columns(); }
    int64_t most_states() const { return (factors > 0 ? 3 * outputs : 3) + 2 + effects + factors; }
};

// One state: positions of its size and of its correlation length among the components, of those of an output where
// `of_output`, and its column of the loadings. Negative: a size of one, a constant, a loading of one. output : that it
// belongs to alone, negative for none. is_factor : of the white noise, drawn anew for each frame.
struct NoiseState {
    int64_t size, length, loading;
    bool of_output;
    int64_t output = -1;
    bool is_factor = false;
};

// The states that a noise model has, for given components (OUTPUT_COMPONENTS * outputs + SHARED_COMPONENTS,).
class NoiseStates {
public:
    NoiseStates(const NoiseObservations& observations, const double* components, NoiseState* states)
        : components(components), states(states) {
        const int64_t outputs = observations.outputs, shared = OUTPUT_COMPONENTS * outputs;
        bool drifts = false, offsets = false;
        for (int64_t o = 0; o < outputs; ++o) {
            drifts = drifts || components[OUTPUT_COMPONENTS * o + DRIFT] > 0.0;
            offsets = offsets || components[OUTPUT_COMPONENTS * o + OFFSET] > 0.0;
        }
        // Observations by output share the states of outputs, which are drawn anew for each.
        const bool shares = observations.factors == 0;
        for (int64_t o = 0; o < (shares ? 1 : outputs); ++o) {
            const int64_t own = shares ? -1 : o;
            if (drifts) states[count++] = {DRIFT, CORRELATION_LENGTH, -1, true, own};
            if (components[shared + DISCREPANCY] > 0.0)
                states[count++] = {shared + DISCREPANCY, shared + DISCREPANCY_LENGTH, DISCREPANCY_LOADING, false, own};
            if (offsets) states[count++] = {OFFSET, -1, OFFSET_LOADING, true, own};
        }
        if (components[shared + RATE] > 0.0) states[count++] = {shared + RATE, -1, RATE_LOADING, false};
        if (components[shared + LIFE] > 0.0) states[count++] = {shared + LIFE, -1, LIFE_LOADING, false};
        for (int64_t k = 0; k < observations.effects; ++k) states[count++] = {-1, -1, FIRST_EFFECT + k, false};
        for (int64_t k = 0; k < observations.factors; ++k)
            states[count++] = {NOISE, -1, observations.first_of_frame() + 1 + k, true, -1, true};
    }

    // Whether a state belongs to another output than this one.
    static bool is_of_another(const NoiseState& state, int64_t output) {
        return state.output >= 0 && state.output != output;
    }

    // The share of the white noise of an observation, a variance, that no factor has.
    static double own_share(const NoiseObservations& observations, const double* known) {
        double share = 1.0;
        for (int64_t k = 0; k < observations.factors; ++k) {
            const double l = known[observations.first_of_frame() + 1 + k];
            share -= l * l;
        }
        return share;
    }

    // Positions of the size and of the length of a state at an observation of this output.
    int64_t size_position(const NoiseState& state, int64_t output) const {
        return state.of_output ? OUTPUT_COMPONENTS * output + state.size : state.size;
    }
    int64_t length_position(const NoiseState& state, int64_t output) const {
        return state.of_output ? OUTPUT_COMPONENTS * output + state.length : state.length;
    }

    // What an observation is of the states, z (states,); the transition into it and the variance that it adds, phi and
    // q (states,). Returns the white variance W. first : of its test.
    double observe(const NoiseObservations& observations, int64_t i, bool first, double* z, double* phi,
                   double* q) const {
        const double* known = observations.of(i);
        const int64_t output = observations.output[i];
        const double* own = components + OUTPUT_COMPONENTS * output;
        double correlated = 0.0;
        for (int64_t j = 0; j < count; ++j) {
            const NoiseState& state = states[j];
            if (is_of_another(state, output)) {
                z[j] = 0.0;
                phi[j] = 1.0;
                q[j] = 0.0;
                continue;
            }
            const double size = state.size < 0 ? 1.0 : components[size_position(state, output)];
            if (state.is_factor) {
                const bool is_new = first || known[observations.first_of_frame()] > 0.0;
                z[j] = size * known[WHITE_LOADING] * known[state.loading];
                phi[j] = is_new ? 0.0 : 1.0;
                q[j] = is_new ? 1.0 : 0.0;
                continue;
            }
            z[j] = state.loading < 0 ? size : size * known[state.loading];
            correlated += z[j] * z[j];
            const bool once_an_output = state.of_output || state.length >= 0;  // and so drawn with its first datum
            if ((first && state.output < 0) || (once_an_output && known[LAG] < 0.0)) {
                phi[j] = 0.0;
                q[j] = 1.0;
            } else if (state.length >= 0) {
                const double change = expm1(-known[LAG] / components[length_position(state, output)]);
                phi[j] = 1.0 + change;
                q[j] = -change * (2.0 + change);
            } else {
                phi[j] = 1.0;
                q[j] = 0.0;
            }
        }
        const double noise = own[NOISE] * known[WHITE_LOADING], share = own_share(observations, known);
        return share * noise * noise + own[MISFIT] * own[MISFIT] + ABSOLUTE_JITTER + RELATIVE_JITTER * correlated;
    }

    const double* components;
    NoiseState* states;
    int64_t count = 0;
};

// What the filter leaves of the observations of one test, with m states and C columns of values:
// loading, transition, added : (n, m) z, phi, q. covariance : (n, m, m) of the states before each observation, and
// state : (n, m, C) their expectations; gain : (n, m). variance : (n,) S of the innovations; innovation : (n, C).
// Without `keeps_states` covariance and state are those of the last observation alone, (m, m) and (m, C), and the
// caller gives the memory of the innovations.
struct FilteredTest {
    int64_t states, columns;
    bool keeps_states;
    double *loading, *transition, *added, *covariance, *gain, *variance, *state, *innovation;

    // Take the arrays for n observations.
    void take(Workspace& memory, int64_t n, int64_t m, int64_t C, bool keep) {
        states = m;
        columns = C;
        keeps_states = keep;
        const int64_t kept = keep ? n : 1;
        loading = memory.doubles(n * m);
        transition = memory.doubles(n * m);
        added = memory.doubles(n * m);
        covariance = memory.doubles(kept * m * m);
        gain = memory.doubles(n * m);
        variance = memory.doubles(n);
        state = memory.doubles(kept * m * C);
        innovation = keep ? memory.doubles(n * C) : nullptr;
    }
};

// The filter over the observations first to last - 1 of one test. innovation of `out` holds the values at entry and the
// innovations at return. Adds ln|C| to log_determinant; false where a variance is not positive.
inline bool filter(const NoiseObservations& observations, const NoiseStates& model, int64_t first, int64_t last,
                   FilteredTest& out, double& log_determinant) {
    const int64_t m = out.states, C = out.columns;
    for (int64_t i = 0; i < last - first; ++i) {
        double *z = out.loading + i * m, *phi = out.transition + i * m, *q = out.added + i * m;
        const int64_t place = out.keeps_states ? i : 0;
        double *P = out.covariance + place * m * m, *a = out.state + place * m * C, *k = out.gain + i * m;
        double* v = out.innovation + i * C;
        double S = model.observe(observations, first + i, i == 0, z, phi, q);
        if (i == 0) {
            for (int64_t j = 0; j < m * m; ++j) P[j] = 0.0;
            for (int64_t j = 0; j < m * C; ++j) a[j] = 0.0;
        } else {
            const double *P0 = out.keeps_states ? P - m * m : P, *a0 = out.keeps_states ? a - m * C : a;
            const double *k0 = k - m, *v0 = v - C, S0 = out.variance[i - 1];
            for (int64_t j = 0; j < m; ++j) {
                for (int64_t l = 0; l < m; ++l) P[j * m + l] = phi[j] * phi[l] * (P0[j * m + l] - S0 * k0[j] * k0[l]);
                for (int64_t c = 0; c < C; ++c) a[j * C + c] = phi[j] * (a0[j * C + c] + k0[j] * v0[c]);
            }
        }
        for (int64_t j = 0; j < m; ++j) P[j * m + j] += q[j];
        for (int64_t j = 0; j < m; ++j) {
            double covariance = 0.0;  // of state and observation
            for (int64_t l = 0; l < m; ++l) covariance += P[j * m + l] * z[l];
            k[j] = covariance;
            S += z[j] * covariance;
            for (int64_t c = 0; c < C; ++c) v[c] -= z[j] * a[j * C + c];
        }
        if (!(S > 0.0) || S > 1e300) return false;
        for (int64_t j = 0; j < m; ++j) k[j] /= S;
        out.variance[i] = S;
        log_determinant += log(S);
    }
    return true;
}

}  // namespace creepkit
