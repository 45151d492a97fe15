// Singly diagonally implicit Runge-Kutta methods whose last stage is the end of the step.
//
// The numbers come from the caller (creepkit.integration.time_discretisation names their sources).
#pragma once

#include <math.h>
#include <stdint.h>

namespace creepkit {

constexpr int64_t MAX_STAGES = 8, MAX_DEGREE = 8;

// a     : (stages, stages) lower triangular, constant diagonal; its last row holds the weights
// c     : (stages,) places of the stages in the step
// error : (stages,) weights less the embedded weights: error = h sum error_i k_i
// dense : (stages, degree) b_i(x) = sum_q dense_iq x^(q+1), the weights up to the share x of the step
// error_order : of the embedded solution
struct Tableau {
    int64_t stages, degree, error_order;
    const double *a, *c, *error, *dense;

    bool valid() const { return stages >= 1 && stages <= MAX_STAGES && degree >= 1 && degree <= MAX_DEGREE; }
    double diagonal(int64_t i) const { return a[i * stages + i]; }
};

// The value at `place` of the parabola through three points.
inline double parabola(const double* places, const double* values, double place) {
    const double a = place - places[0], b = place - places[1], c = place - places[2];
    const double ab = places[0] - places[1], bc = places[1] - places[2], ca = places[2] - places[0];
    return -(values[0] * b * c * bc + values[1] * c * a * ca + values[2] * a * b * ab) / (ab * bc * ca);
}

// Guesses of the slope at a stage from those known before it.
//
// The first stage, and the second, follow the parabola through the start of the step and what is nearest to it before
// and after; from the third on the weights of the earlier stages and of the start are fixed.
class SlopePredictor {
public:
    explicit SlopePredictor(const Tableau& tableau) : tableau_(tableau) {
        const auto place = [&](int64_t j) { return j > 0 ? tableau.c[j - 1] : 0.0; };
        for (int64_t i = 2; i < tableau.stages; ++i) {
            int64_t chosen[3];
            for (int64_t n = 0; n < 3; ++n) {
                double least = INFINITY;
                for (int64_t j = 0; j <= i; ++j) {
                    const bool taken = (n > 0 && chosen[0] == j) || (n > 1 && chosen[1] == j);
                    const double distance = fabs(place(j) - tableau.c[i]);
                    if (taken || !(distance < least)) continue;
                    least = distance;
                    chosen[n] = j;
                }
            }
            const double places[3] = {place(chosen[0]), place(chosen[1]), place(chosen[2])};
            for (int64_t j = 0; j <= i; ++j) {
                const double unit[3] = {chosen[0] == j ? 1.0 : 0.0, chosen[1] == j ? 1.0 : 0.0,
                                        chosen[2] == j ? 1.0 : 0.0};
                weights_[i][j] = parabola(places, unit, tableau.c[i]);
            }
        }
        for (int64_t i = 0; i + 1 < tableau.stages; ++i) {
            if (last_ < 0 || tableau.c[i] > tableau.c[last_]) last_ = i;
        }
        for (int64_t i = 0; i + 1 < tableau.stages; ++i) {
            if (i != last_ && (next_ < 0 || tableau.c[i] > tableau.c[next_])) next_ = i;
        }
    }

    // The guess at stage i, NaN when nothing is known.
    //
    // start : slope where the step begins, NaN when there is none. slopes, before : of one unknown at the stages of this
    // step and of the one before, `stride` apart; the one before was `length` times as long, 0 when there is none.
    double slope(int64_t i, double start, const double* slopes, int64_t stride, const double* before,
                 double length) const {
        const double last = i > 0 ? slopes[(i - 1) * stride] : start;
        if (isnan(start)) return last;
        if (i >= 2) {
            double total = weights_[i][0] * start;
            for (int64_t j = 0; j < i; ++j) total += weights_[i][1 + j] * slopes[j * stride];
            return total;
        }
        if (!(length > 0.0) || last_ < 0 || (i == 0 && next_ < 0)) return last;
        const double past = (tableau_.c[last_] - 1.0) * length;
        if (i == 1) {
            const double places[3] = {tableau_.c[0], 0.0, past}, values[3] = {slopes[0], start, before[last_ * stride]};
            return parabola(places, values, tableau_.c[1]);
        }
        const double places[3] = {0.0, past, (tableau_.c[next_] - 1.0) * length};
        const double values[3] = {start, before[last_ * stride], before[next_ * stride]};
        return parabola(places, values, tableau_.c[0]);
    }

private:
    const Tableau& tableau_;
    double weights_[MAX_STAGES][1 + MAX_STAGES] = {};
    int64_t last_ = -1, next_ = -1;  // the two stages nearest to the end of a step, beside its last
};

// The dense output of one unknown over one step: value + h sum_q coefficients_q x^(q+1) at the share x of the step.
struct DenseOutput {
    double value, h, coefficients[MAX_DEGREE];
    int64_t degree;

    // value : at the start of the step; slopes : k_i of the unknown at every stage, `stride` apart.
    DenseOutput(const Tableau& tableau, double start, double step, const double* slopes, int64_t stride)
        : value(start), h(step), degree(tableau.degree) {
        for (int64_t q = 0; q < degree; ++q) {
            double total = 0.0;
            for (int64_t i = 0; i < tableau.stages; ++i) total += tableau.dense[i * degree + q] * slopes[i * stride];
            coefficients[q] = total;
        }
    }

    double at(double x) const {
        double total = 0.0;
        for (int64_t q = degree - 1; q >= 0; --q) total = (total + coefficients[q]) * x;
        return value + h * total;
    }

    // Derivative to the position, d/ds = 1/h d/dx.
    double slope(double x) const {
        double total = 0.0;
        for (int64_t q = degree - 1; q >= 0; --q) total = total * x + double(q + 1) * coefficients[q];
        return total;
    }
};

// Weight of stage i up to the share x of the step.
inline double dense_weight(const Tableau& tableau, int64_t i, double x) {
    double total = 0.0;
    for (int64_t q = tableau.degree - 1; q >= 0; --q) total = (total + tableau.dense[i * tableau.degree + q]) * x;
    return total;
}

}  // namespace creepkit
