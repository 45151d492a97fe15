// Whitening by the covariance of residuals, and their likelihood and restricted likelihood with gradient.
#include "noise_likelihood.hpp"

#include "export.hpp"

namespace creepkit {
namespace {

constexpr int64_t NOT_POSITIVE_DEFINITE = 1, NO_MEMORY = 2, BAD_COUNT = 3;

// Least pivot of a normal matrix of unit diagonal: below, rounding alone determines the combination of unknowns.
constexpr double LEAST_PIVOT = 1e-15;

bool has_valid_counts(const NoiseObservations& observations) {
    if (observations.tests < 0 || observations.outputs < 1) return false;
    if (observations.effects < 0 || observations.factors < 0) return false;
    if (observations.starts[0] != 0) return false;
    for (int64_t t = 0; t < observations.tests; ++t)
        if (observations.starts[t + 1] < observations.starts[t]) return false;
    for (int64_t i = 0; i < observations.count(); ++i)
        if (observations.output[i] < 0 || observations.output[i] >= observations.outputs) return false;
    return true;
}

int64_t longest_test(const NoiseObservations& observations) {
    int64_t longest = 0;
    for (int64_t t = 0; t < observations.tests; ++t) {
        const int64_t n = observations.starts[t + 1] - observations.starts[t];
        longest = n > longest ? n : longest;
    }
    return longest;
}

// C^-1 y of one test from its innovations, into innovation: the derivative of y'C^-1 y / 2 to y, backwards.
// derivative : (m, C) of the states, scratch.
void smooth(FilteredTest& test, int64_t n, double* derivative) {
    const int64_t m = test.states, C = test.columns;
    for (int64_t j = 0; j < m * C; ++j) derivative[j] = 0.0;
    for (int64_t i = n - 1; i >= 0; --i) {
        const double *z = test.loading + i * m, *phi = test.transition + i * m, *k = test.gain + i * m;
        double* v = test.innovation + i * C;
        for (int64_t c = 0; c < C; ++c) {
            double u = v[c] / test.variance[i];
            for (int64_t j = 0; j < m; ++j) u += k[j] * derivative[j * C + c];
            for (int64_t j = 0; j < m; ++j) derivative[j * C + c] = phi[j] * (derivative[j * C + c] - z[j] * u);
            v[c] = u;
        }
    }
}

// Lower Cholesky factor (n, n) in place; pivots are kept above LEAST_PIVOT of the diagonal.
void cholesky(double* a, int64_t n) {
    for (int64_t j = 0; j < n; ++j) {
        const double diagonal = a[j * n + j];
        double pivot = diagonal;
        for (int64_t l = 0; l < j; ++l) pivot -= a[j * n + l] * a[j * n + l];
        pivot = sqrt(fmax(pivot, fmax(LEAST_PIVOT * diagonal, 1e-300)));
        a[j * n + j] = pivot;
        for (int64_t i = j + 1; i < n; ++i) {
            double sum = a[i * n + j];
            for (int64_t l = 0; l < j; ++l) sum -= a[i * n + l] * a[j * n + l];
            a[i * n + j] = sum / pivot;
            a[j * n + i] = 0.0;
        }
    }
}

// Inverse (n, n) of a a' from its lower factor a, which becomes its own inverse.
void inverse_of_factor(double* a, int64_t n, double* inverse) {
    for (int64_t j = 0; j < n; ++j) {
        a[j * n + j] = 1.0 / a[j * n + j];
        for (int64_t i = j + 1; i < n; ++i) {
            double sum = 0.0;
            for (int64_t l = j; l < i; ++l) sum -= a[i * n + l] * a[l * n + j];
            a[i * n + j] = sum / a[i * n + i];
        }
    }
    for (int64_t i = 0; i < n; ++i)
        for (int64_t j = 0; j <= i; ++j) {
            double sum = 0.0;
            for (int64_t l = i; l < n; ++l) sum += a[l * n + i] * a[l * n + j];
            inverse[i * n + j] = inverse[j * n + i] = sum;
        }
}

// The linear problem in p unknowns: (y + X b)' C^-1 (y + X b) + sum of precision (prior_residual + b)^2 is least.
//
// normal : (p, p) X'C^-1 X, with precision its inverse covariance; covariance : (p, p) its inverse. gradient : (p,)
// X'C^-1 y; step : (p,) b. scale, factor : scratch.
struct LinearProblem {
    int64_t p;
    double *normal, *covariance, *gradient, *step, *scale, *factor;

    void take(Workspace& memory, int64_t unknowns) {
        p = unknowns;
        normal = memory.doubles(p * p);
        covariance = memory.doubles(p * p);
        gradient = memory.doubles(p);
        step = memory.doubles(p);
        scale = memory.doubles(p);
        factor = memory.doubles(p * p);
    }

    // Solve; returns ln of the determinant of the normal matrix with priors.
    double solve(const double* precision, const double* prior_residual) {
        double log_determinant = 0.0;
        for (int64_t a = 0; a < p; ++a) normal[a * p + a] += precision[a];
        for (int64_t a = 0; a < p; ++a) scale[a] = 1.0 / sqrt(fmax(normal[a * p + a], 1e-300));
        for (int64_t a = 0; a < p; ++a)
            for (int64_t b = 0; b < p; ++b) factor[a * p + b] = normal[a * p + b] * scale[a] * scale[b];
        cholesky(factor, p);
        for (int64_t a = 0; a < p; ++a) log_determinant += 2.0 * log(factor[a * p + a] / scale[a]);
        inverse_of_factor(factor, p, covariance);
        for (int64_t a = 0; a < p; ++a)
            for (int64_t b = 0; b < p; ++b) covariance[a * p + b] *= scale[a] * scale[b];
        for (int64_t a = 0; a < p; ++a) {
            step[a] = 0.0;
            for (int64_t b = 0; b < p; ++b)
                step[a] -= covariance[a * p + b] * (gradient[b] + precision[b] * prior_residual[b]);
        }
        return log_determinant;
    }
};

// The columns of values (n, 1 + unknowns) that matter to a test: the first, and those of unknowns that it depends on.
int64_t columns_of_test(const double* values, int64_t n, int64_t width, int64_t* columns) {
    int64_t count = 0;
    columns[count++] = 0;
    for (int64_t column = 1; column < width; ++column)
        for (int64_t i = 0; i < n; ++i)
            if (values[i * width + column] != 0.0) {
                columns[count++] = column;
                break;
            }
    return count;
}

// Scratch of the pass backwards, of at most C columns and m states.
struct Backwards {
    double *mix, *information, *weighted, *derivative, *innovation, *state, *smoothed;

    void take(Workspace& memory, int64_t m, int64_t C) {
        mix = memory.doubles(C * C);
        information = memory.doubles(m * m);
        weighted = memory.doubles(m);
        derivative = memory.doubles(m * C);
        innovation = memory.doubles(C);
        state = memory.doubles(m * C);
        smoothed = memory.doubles(C);
    }
};

// out (rows, C) = in (rows, C) times the lower triangle of mix (C, C).
void mixed(const double* in, const double* mix, int64_t rows, int64_t C, double* out) {
    for (int64_t j = 0; j < rows; ++j, in += C, out += C) {
        for (int64_t c = 0; c < C; ++c) out[c] = 0.0;
        for (int64_t b = 0; b < C; ++b)
            for (int64_t c = 0; c <= b; ++c) out[c] += in[b] * mix[b * C + c];
    }
}

// Adds the derivatives to the logarithms of the components that one test gives, backwards over its n observations.
//
// With y the columns of values times `mix`, that of (ln|C| + sum of y'C^-1 y) / 2 with y fixed. Information N and
// derivatives r belong to the states before an observation: dP changes it by tr((N - r r') dP) / 2, da by r'da.
void add_gradient(const NoiseObservations& observations, const NoiseStates& model, int64_t first, int64_t n,
                  const FilteredTest& test, Backwards& scratch, double* gradient) {
    const int64_t m = test.states, C = test.columns;
    double *N = scratch.information, *h = scratch.weighted, *r = scratch.derivative, *u = scratch.smoothed;
    for (int64_t j = 0; j < m * m; ++j) N[j] = 0.0;
    for (int64_t j = 0; j < m * C; ++j) r[j] = 0.0;
    for (int64_t i = n - 1; i >= 0; --i) {
        const double *z = test.loading + i * m, *phi = test.transition + i * m, *q = test.added + i * m;
        const double *P = test.covariance + i * m * m, *k = test.gain + i * m;
        const double inverse_variance = 1.0 / test.variance[i];
        mixed(test.innovation + i * C, scratch.mix, 1, C, scratch.innovation);
        mixed(test.state + i * m * C, scratch.mix, m, C, scratch.state);
        for (int64_t c = 0; c < C; ++c) u[c] = scratch.innovation[c] * inverse_variance;
        double inverse_diagonal = inverse_variance;  // of C^-1
        for (int64_t j = 0; j < m; ++j) {
            h[j] = 0.0;
            for (int64_t l = 0; l < m; ++l) h[j] += N[j * m + l] * k[l];
            inverse_diagonal += k[j] * h[j];
            for (int64_t c = 0; c < C; ++c) u[c] += k[j] * r[j * C + c];
        }
        for (int64_t j = 0; j < m; ++j) {
            for (int64_t l = 0; l < m; ++l) N[j * m + l] += inverse_diagonal * z[j] * z[l] - z[j] * h[l] - h[j] * z[l];
            for (int64_t c = 0; c < C; ++c) r[j * C + c] -= z[j] * u[c];
        }
        double by_white = inverse_diagonal;  // twice the derivative to the white variance
        for (int64_t c = 0; c < C; ++c) by_white -= u[c] * u[c];

        const double* known = observations.of(first + i);
        const int64_t output = observations.output[first + i];
        const double* own = model.components + OUTPUT_COMPONENTS * output;
        double* own_gradient = gradient + OUTPUT_COMPONENTS * output;
        const double noise = own[NOISE] * known[WHITE_LOADING];
        own_gradient[NOISE] += by_white * NoiseStates::own_share(observations, known) * noise * noise;
        own_gradient[MISFIT] += by_white * own[MISFIT] * own[MISFIT];
        for (int64_t j = 0; j < m; ++j) {
            const NoiseState& state = model.states[j];
            if (state.size < 0 || NoiseStates::is_of_another(state, output)) continue;
            if (state.is_factor) {
                // Its size is that of the output it is seen in: by the loading z itself, the covariance of the state
                // with C^-1 less C^-1 y y'C^-1 at this observation, before it was seen: P (z D - N k) less that of y.
                double by_loading = 0.0;
                for (int64_t l = 0; l < m; ++l) {
                    double weight = inverse_diagonal * z[l] - h[l];
                    for (int64_t c = 0; c < C; ++c) weight += u[c] * r[l * C + c];
                    by_loading += P[j * m + l] * weight;
                }
                for (int64_t c = 0; c < C; ++c) by_loading -= u[c] * scratch.state[j * C + c];
                own_gradient[NOISE] += z[j] * by_loading;
                continue;
            }
            // A size acts as a variance of the state and of what transitions add to it would, and on the jitter.
            double by_variance = N[j * m + j];
            for (int64_t c = 0; c < C; ++c) by_variance -= r[j * C + c] * r[j * C + c];
            gradient[model.size_position(state, output)] +=
                q[j] * by_variance + RELATIVE_JITTER * by_white * z[j] * z[j];
            if (state.length < 0 || phi[j] == 0.0) continue;
            double by_transition = -by_variance;
            for (int64_t l = 0; l < m; ++l) {
                double by_covariance = N[j * m + l];
                for (int64_t c = 0; c < C; ++c) by_covariance -= r[j * C + c] * r[l * C + c];
                by_transition += by_covariance * P[j * m + l];
            }
            for (int64_t c = 0; c < C; ++c) by_transition += r[j * C + c] * scratch.state[j * C + c];
            const int64_t length = model.length_position(state, output);
            gradient[length] += by_transition * known[LAG] / model.components[length];
        }
        for (int64_t j = 0; j < m; ++j) {
            for (int64_t l = 0; l < m; ++l) N[j * m + l] *= phi[j] * phi[l];
            for (int64_t c = 0; c < C; ++c) r[j * C + c] *= phi[j];
        }
    }
}

// The memory of a likelihood: filtered tests, columns of each, the linear problem, scratch.
struct LikelihoodMemory {
    FilteredTest* filtered;
    LinearProblem linear;
    Backwards backwards;

    void take(Workspace& memory, const NoiseObservations& observations, int64_t m, int64_t p,
              const int64_t* column_counts) {
        filtered = memory.array<FilteredTest>(observations.tests);
        linear.take(memory, p);
        backwards.take(memory, m, p + 1);
        for (int64_t t = 0; t < observations.tests; ++t) {
            FilteredTest test;
            test.take(memory, observations.starts[t + 1] - observations.starts[t], m, column_counts[t], true);
            if (filtered) filtered[t] = test;
        }
    }
};

}  // namespace

// Whitens the values (observations, columns), in place: L^-1 y with C = L L', or, where `inverse`, C^-1 y.
//
// Observations as NoiseObservations has them; components : (5 outputs + 4,) see OutputComponent, SharedComponent.
// log_determinant : ln|C| over all tests. Returns 0; 1 where C is not positive definite, 2 without memory, 3 where
// counts contradict each other.
CREEPKIT_API int64_t creepkit_noise_whiten(int64_t tests, int64_t outputs, int64_t effects, int64_t factors,
                                           const int64_t* starts, const int64_t* output, const double* loadings,
                                           const double* components, int64_t columns, int64_t inverse, double* values,
                                           double* log_determinant) {
    const NoiseObservations observations{tests, outputs, effects, factors, starts, output, loadings};
    if (!has_valid_counts(observations) || columns < 0) return BAD_COUNT;
    const int64_t longest = longest_test(observations), most_states = observations.most_states();
    Workspace memory;
    NoiseState* states;
    FilteredTest test;
    double* derivative;
    for (int turn = 0; turn < 2; ++turn) {
        states = memory.array<NoiseState>(most_states);
        derivative = memory.doubles(most_states * columns);
        test.take(memory, longest, most_states, columns, false);
        if (turn == 0 && !memory.allocate()) return NO_MEMORY;
    }
    const NoiseStates model(observations, components, states);
    test.states = model.count;
    *log_determinant = 0.0;
    for (int64_t t = 0; t < tests; ++t) {
        const int64_t first = starts[t], n = starts[t + 1] - first;
        test.innovation = values + first * columns;
        if (!filter(observations, model, first, first + n, test, *log_determinant)) return NOT_POSITIVE_DEFINITE;
        if (inverse) {
            smooth(test, n, derivative);
            continue;
        }
        for (int64_t i = 0; i < n; ++i) {
            const double root = 1.0 / sqrt(test.variance[i]);
            for (int64_t c = 0; c < columns; ++c) test.innovation[i * columns + c] *= root;
        }
    }
    return 0;
}

// Minus the restricted log-likelihood, but for a constant, and its gradient to the logarithms of the components:
//
//     (ln|C| + ln|A| + least of (y + X b)'C^-1 (y + X b) + (e + b)'P (e + b)) / 2,   A = X'C^-1 X + P;
//
// without unknowns b it is the plain one. values : (observations, 1 + unknowns) y and X. precision, prior_residual :
// (unknowns,) the diagonal of P, and e. gradient : (5 outputs + 4,). The others, and what is returned, as above.
CREEPKIT_API int64_t creepkit_restricted_likelihood(int64_t tests, int64_t outputs, int64_t effects,
                                                    int64_t factors, const int64_t* starts, const int64_t* output,
                                                    const double* loadings, const double* components,
                                                    int64_t unknowns, const double* values, const double* precision,
                                                    const double* prior_residual,
                                                    double* value, double* gradient) {
    const NoiseObservations observations{tests, outputs, effects, factors, starts, output, loadings};
    if (!has_valid_counts(observations) || unknowns < 0) return BAD_COUNT;
    const int64_t p = unknowns, width = p + 1;
    Workspace lists;
    NoiseState* states;
    int64_t *columns, *column_counts;
    for (int turn = 0; turn < 2; ++turn) {
        states = lists.array<NoiseState>(observations.most_states());
        columns = lists.array<int64_t>(tests * width);
        column_counts = lists.array<int64_t>(tests);
        if (turn == 0 && !lists.allocate()) return NO_MEMORY;
    }
    const NoiseStates model(observations, components, states);
    for (int64_t t = 0; t < tests; ++t)
        column_counts[t] =
            columns_of_test(values + starts[t] * width, starts[t + 1] - starts[t], width, columns + t * width);
    Workspace memory;
    LikelihoodMemory work;
    work.take(memory, observations, model.count, p, column_counts);
    if (!memory.allocate()) return NO_MEMORY;
    work.take(memory, observations, model.count, p, column_counts);
    LinearProblem& linear = work.linear;

    double log_determinant = 0.0;
    for (int64_t t = 0; t < tests; ++t) {
        const int64_t n = starts[t + 1] - starts[t], C = column_counts[t], *own = columns + t * width;
        FilteredTest& test = work.filtered[t];
        for (int64_t i = 0; i < n; ++i)
            for (int64_t c = 0; c < C; ++c) test.innovation[i * C + c] = values[(starts[t] + i) * width + own[c]];
        if (!filter(observations, model, starts[t], starts[t + 1], test, log_determinant)) return NOT_POSITIVE_DEFINITE;
        for (int64_t i = 0; i < n; ++i) {
            const double* v = test.innovation + i * C;
            for (int64_t c = 1; c < C; ++c) {
                const int64_t a = own[c] - 1;
                const double weighted = v[c] / test.variance[i];
                for (int64_t d = 1; d <= c; ++d) linear.normal[a * p + own[d] - 1] += weighted * v[d];
                linear.gradient[a] += weighted * v[0];
            }
        }
    }
    for (int64_t a = 0; a < p; ++a)
        for (int64_t b = 0; b < a; ++b) linear.normal[b * p + a] = linear.normal[a * p + b];
    log_determinant += linear.solve(precision, prior_residual);

    double chi_square = 0.0;
    for (int64_t a = 0; a < p; ++a) {
        const double deviation = prior_residual[a] + linear.step[a];
        chi_square += precision[a] * deviation * deviation;
    }
    for (int64_t j = 0; j < OUTPUT_COMPONENTS * outputs + SHARED_COMPONENTS; ++j) gradient[j] = 0.0;
    for (int64_t t = 0; t < tests; ++t) {
        const int64_t n = starts[t + 1] - starts[t], C = column_counts[t], *own = columns + t * width;
        const FilteredTest& test = work.filtered[t];
        for (int64_t i = 0; i < n; ++i) {
            double remaining = test.innovation[i * C];
            for (int64_t c = 1; c < C; ++c) remaining += linear.step[own[c] - 1] * test.innovation[i * C + c];
            chi_square += remaining * remaining / test.variance[i];
        }
        // d ln|A| = -sum of y'C^-1 dC C^-1 y over y = X F with F F' = A^-1, of which this test sees some rows.
        const int64_t seen = C - 1;
        for (int64_t a = 0; a < seen; ++a)
            for (int64_t b = 0; b < seen; ++b)
                linear.factor[a * seen + b] = linear.covariance[(own[a + 1] - 1) * p + own[b + 1] - 1];
        cholesky(linear.factor, seen);
        double* mix = work.backwards.mix;
        mix[0] = 1.0;
        for (int64_t a = 0; a < seen; ++a) {
            mix[(a + 1) * C] = linear.step[own[a + 1] - 1];
            for (int64_t b = 0; b <= a; ++b) mix[(a + 1) * C + b + 1] = linear.factor[a * seen + b];
        }
        add_gradient(observations, model, starts[t], n, test, work.backwards, gradient);
    }
    *value = 0.5 * (log_determinant + chi_square);
    return 0;
}

}  // namespace creepkit
