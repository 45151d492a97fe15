// The linear equations of a stage's sensitivities in a reduced-order model: exact tangent, right-hand sides, solution.
#pragma once

#include "reduced_order_model.hpp"
#include "sensitivities.hpp"

namespace creepkit {

// Of the directions that move the nodes this needs, in `velocities`, (G, side points, 3) changes of r, dr/dx and dz/dx
// of the sides at rest, mm.
class ReducedOrderSensitivities {
public:
    void take(Workspace& memory, const ReducedOrderSystem& system, int64_t padded) {
        matrix = memory.doubles(2 * system.shape.numbers() + 1);
        right = memory.doubles(system.shape.rows() * padded);
        products = memory.doubles(5 * EIGHT * system.width);
        count = system.shape.rows() * padded;
    }

    void clear(const ReducedOrderSystem& system) {
        system.shape.clear(matrix);
        system.shape.clear(matrix + system.shape.numbers());
        memset(right, 0, sizeof(double) * size_t(count));
    }

    // Add the tangent A (25, 8 points), which carries the weights, of eight points.
    void add_tangent(const ReducedOrderSystem& system, int64_t block, const double A[25][EIGHT]) {
        system.tangent_products(block, A, products);
        add_matrix(system, system.model.gradients + block * EIGHT * 5 * system.width, products, 5 * EIGHT);
    }

    // Subtract the forces of the stresses (8 points, 5, padded), which carry the weights.
    void subtract_forces(const ReducedOrderSystem& system, int64_t block, const double* stresses, int64_t padded) {
        const double* gradients = system.model.gradients + block * EIGHT * 5 * system.width;
        for (int64_t i = 0; i < system.model.modes; ++i)
            for (int64_t c = 0; c < padded; c += LANES) {
                Vector total = load(right + i * padded + c);
                for (int k = 0; k < 5 * EIGHT; ++k)
                    total -= gradients[k * system.width + i] * load(stresses + k * padded + c);
                store(right + i * padded + c, total);
            }
    }

    // The pressure's exact load stiffness, and its forces in the columns that change it or move the surface.
    void press(const ReducedOrderSystem& system, double pressure, const double* q,
               const SensitivityDirections& directions, const double* inputs, int64_t parameters, int64_t padded) {
        const ReducedOrderModel& model = system.model;
        const int64_t width = system.width;
        double* pair = products;  // (2, R) rows of the stiffness
        for (int64_t k = 0; k < model.side_points; ++k) {
            const SidePoint at = system.side_point(k, q);
            const double weight = model.sides[4 * k], *modes = model.side_modes + 4 * k * width;
            for (int64_t i = 0; i < width; i += LANES) {
                const Vector r = load(modes + i);
                store(pair + i, pressure * weight * (at.dz * r + at.radius * load(modes + 3 * width + i)));
                store(pair + width + i, -pressure * weight * (at.dr * r + at.radius * load(modes + 2 * width + i)));
            }
            add_matrix(system, modes, pair, 2);
            const auto push = [&](int64_t column, double radial, double axial) {
                for (int64_t i = 0; i < model.modes; ++i)
                    right[i * padded + parameters + column] +=
                        weight * (radial * modes[i] + axial * modes[width + i]);
            };
            for (int64_t d = 0; d < directions.directions; ++d) {
                const double change = inputs[BY_PRESSURE * directions.directions + d];
                push(d, -change * at.radius * at.dz, change * at.radius * at.dr);
            }
            for (int64_t g = 0; g < directions.geometries; ++g) {
                const double* v = directions.velocities + (g * model.side_points + k) * 3;
                push(directions.directions + g, -pressure * (v[0] * at.dz + at.radius * v[2]),
                     pressure * (v[0] * at.dr + at.radius * v[1]));
            }
        }
    }

    // The solutions, left in the right-hand sides; false when the tangent is singular.
    bool solve(const ReducedOrderSystem& system, int64_t padded) {
        double* upper = matrix + system.shape.numbers();
        if (!factorize_general(system.shape, matrix, upper)) return false;
        solve_general(system.shape, matrix, upper, right, padded);
        return true;
    }

    // Changes (8 points, 5, padded) of the deformation gradient of eight points.
    void gradient_changes(const ReducedOrderSystem& system, int64_t block, double* gradients, int64_t padded) const {
        const double* modes = system.model.gradients + block * EIGHT * 5 * system.width;
        for (int k = 0; k < 5 * EIGHT; ++k)
            for (int64_t c = 0; c < padded; c += LANES) {
                Vector total{};
                for (int64_t i = 0; i < system.model.modes; ++i)
                    total += modes[k * system.width + i] * load(right + i * padded + c);
                store(gradients + k * padded + c, total);
            }
    }

    // Changes (observed, columns) of u_z of the observed nodes.
    void write_surface(const ReducedOrderSystem& system, double* surface, int64_t columns, int64_t padded) const {
        for (int64_t k = 0; k < system.model.observed; ++k)
            for (int64_t c = 0; c < columns; ++c) {
                double total = 0.0;
                for (int64_t i = 0; i < system.model.modes; ++i)
                    total += system.model.surface[k * system.width + i] * right[i * padded + c];
                surface[k * columns + c] = total;
            }
    }

private:
    double *matrix = nullptr, *right = nullptr, *products = nullptr;  // lower, upper triangle; (rows, padded); (40, R)
    int64_t count = 0;

    // Add the sum over k of columns_k rows_k^T, each (count, R).
    void add_matrix(const ReducedOrderSystem& system, const double* columns, const double* rows, int64_t terms) {
        const BandShape& shape = system.shape;
        for (int64_t one = 0; one < shape.blocks; ++one)
            for (int64_t other = one; other < shape.blocks; ++other) {
                const int64_t place = shape.tile(one, other - one);
                add_products<false>(matrix + place, columns + EIGHT * other, rows + EIGHT * one, system.width, terms);
                if (other > one)  // above the diagonal a tile lies by rows
                    add_products<false>(matrix + shape.numbers() + place, rows + EIGHT * other, columns + EIGHT * one,
                                 system.width, terms);
            }
    }
};

}  // namespace creepkit
