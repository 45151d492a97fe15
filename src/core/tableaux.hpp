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

// Guesses of the slope at a stage from those known before it: at the stages of the step before, at the start of the
// step, and at the stages before. A polynomial goes through the slopes at the POINTS places nearest to the stage.
class SlopePredictor {
public:
    // start : slope where the step begins, NaN when there is none.
    // before : slopes of the step before, `stride` apart, whose length was `length` times that of this one, or 0.
    SlopePredictor(const Tableau& tableau, double start, const double* before, double length, int64_t stride)
        : tableau_(tableau) {
        if (!isnan(start)) add(0.0, start);
        for (int64_t i = 0; length > 0.0 && i < tableau.stages - 1; ++i) {
            add((tableau.c[i] - 1.0) * length, before[i * stride]);
        }
    }

    // The slope that stage i has turned out to have.
    void add_stage(int64_t i, double slope) { add(tableau_.c[i], slope); }

    // The guess at stage i, NaN when nothing is known.
    double slope(int64_t i) const {
        const double at = tableau_.c[i];
        int64_t chosen[POINTS];
        int64_t count = 0;
        for (; count < POINTS && count < known_; ++count) {
            double least = INFINITY;
            for (int64_t j = 0; j < known_; ++j) {
                bool taken = false;
                for (int64_t k = 0; k < count; ++k) taken = taken || chosen[k] == j;
                const double distance = fabs(places_[j] - at);
                if (!taken && distance < least) {
                    least = distance;
                    chosen[count] = j;
                }
            }
        }
        double total = count > 0 ? 0.0 : NAN;
        for (int64_t k = 0; k < count; ++k) {
            double weight = 1.0;
            for (int64_t j = 0; j < count; ++j) {
                if (j != k) weight *= (at - places_[chosen[j]]) / (places_[chosen[k]] - places_[chosen[j]]);
            }
            total += weight * slopes_[chosen[k]];
        }
        return total;
    }

private:
    static constexpr int64_t POINTS = 3;
    const Tableau& tableau_;
    int64_t known_ = 0;
    double places_[2 * MAX_STAGES + 1], slopes_[2 * MAX_STAGES + 1];

    void add(double place, double slope) {
        places_[known_] = place;
        slopes_[known_++] = slope;
    }
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
