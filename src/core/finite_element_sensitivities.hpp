// The linear equations of a stage's sensitivities in finite elements: exact tangent, right-hand sides, solution.
#pragma once

#include "finite_elements.hpp"
#include "sensitivities.hpp"

namespace creepkit {

class FiniteElementSensitivities {
public:
    void take(Workspace& memory, const FiniteElements& system, int64_t padded) {
        matrix = memory.doubles(2 * system.shape.numbers() + 1);
        right = memory.doubles(system.shape.rows() * padded);
        places = memory.array<int64_t>(system.model.elements * 4 * TILE);
        const bool controlled = system.model.controlled >= 0;
        controlled_row = memory.doubles(controlled ? system.shape.size : 0);
        controlled_right = memory.doubles(controlled ? padded : 0);
        border = memory.doubles(system.model.bordered >= 0 ? system.shape.rows() : 0);
        border_solution = memory.doubles(system.model.bordered >= 0 ? system.shape.rows() * LANES : 0);
        places_known = false;
    }

    void clear(const FiniteElements& system) {
        if (!places_known) set_places(system);
        system.shape.clear(matrix);
        system.shape.clear(matrix + system.shape.numbers());
        right_is_clear = false;
    }

    // Add the tangent A (25, 8 points), which carries the weights, of a pair of elements.
    void add_tangent(const FiniteElements& system, int64_t pair, const double A[25][EIGHT]) {
        alignas(64) double blocks[4][TILE];
        for (int half = 0; half < 2; ++half) {
            system.template element_blocks<false>(2 * pair + half, 4 * half, A, blocks);
            const int64_t* place = places + (2 * pair + half) * 4 * TILE;
            for (int k = 0; k < 4 * TILE; ++k) matrix[place[k]] += blocks[k / TILE][k % TILE];
        }
    }

    // Subtract the nodal forces of the stresses (8 points, 5, padded), which carry the weights, of a pair of elements.
    void subtract_forces(const FiniteElements& system, int64_t pair, const double* stresses, int64_t padded) {
        if (!right_is_clear) clear_right(system, padded);
        for (int half = 0; half < 2; ++half) {
            const int64_t element = 2 * pair + half;
            const int64_t* nodes = system.model.connectivity + EIGHT * element;
            for (int a = 0; a < EIGHT; ++a) {
                const int64_t r = system.model.equations[2 * nodes[a]], z = system.model.equations[2 * nodes[a] + 1];
                for (int64_t block = 0; block < padded; block += LANES) {
                    Vector radial{}, axial{};
                    for (int g = 0; g < 4; ++g) {
                        const int64_t row = (4 * element + g) * EIGHT + a;
                        const double* P = stresses + (4 * half + g) * 5 * padded + block;
                        const double x = system.model.by_radius[row], y = system.model.by_height[row];
                        const double h = system.model.over_radius[row];
                        radial = radial + x * load(P) + y * load(P + padded) + h * load(P + 4 * padded);
                        axial = axial + x * load(P + 2 * padded) + y * load(P + 3 * padded);
                    }
                    if (r >= 0) store(right + r * padded + block, load(right + r * padded + block) - radial);
                    if (z >= 0) store(right + z * padded + block, load(right + z * padded + block) - axial);
                }
            }
        }
    }

    // The exact load stiffness of pressure and contact, and their forces in the columns that change it or move the surface.
    void press(const FiniteElements& system, double pressure, const double* u, const SensitivityDirections& directions,
               const double* inputs, int64_t parameters, int64_t padded) {
        const FiniteElementModel& model = system.model;
        for (int64_t side = 0; side < model.pressed_sides; ++side) {
            const int64_t* nodes = model.pressed + 3 * side;
            double r[3], z[3], force[2][3], stiffness[4][3][3];
            for (int a = 0; a < 3; ++a) {
                r[a] = model.coordinates[2 * nodes[a]] + u[2 * nodes[a]];
                z[a] = model.coordinates[2 * nodes[a] + 1] + u[2 * nodes[a] + 1];
            }
            side_force(system.quadrature, r, z, force);
            side_stiffness(system.quadrature, r, z, stiffness);
            for (int a = 0; a < 3; ++a)
                for (int i = 0; i < 2; ++i) {
                    const int64_t row = model.equations[2 * nodes[a] + i];
                    if (row < 0) continue;
                    double* columns = right + row * padded + parameters;
                    for (int64_t d = 0; d < directions.directions; ++d)
                        columns[d] += inputs[BY_PRESSURE * directions.directions + d] * force[i][a];
                    for (int b = 0; b < 3; ++b)
                        for (int j = 0; j < 2; ++j) {
                            const double slope = pressure * stiffness[2 * i + j][a][b];
                            for (int64_t g = 0; g < directions.geometries; ++g)
                                columns[directions.directions + g] +=
                                    slope * directions.velocities[g * 2 * model.nodes + 2 * nodes[b] + j];
                            const int64_t column = model.equations[2 * nodes[b] + j];
                            if (column >= 0) matrix[place(system, row, column)] -= slope;
                        }
                }
        }
        for (int64_t row = 0; row < model.dead_forces; ++row) {
            double* columns = right + row * padded + parameters;
            for (int64_t d = 0; d < directions.directions; ++d)
                columns[d] += inputs[BY_PRESSURE * directions.directions + d] * model.dead[row];
            for (int64_t g = 0; g < directions.geometries; ++g)
                columns[directions.directions + g] += pressure * directions.forces[g * model.size + row];
        }
        if (model.contact_sides > 0) touch(system, u, directions, parameters, padded);
        if (model.controlled >= 0) hold_controlled(system, directions, inputs, parameters, padded);
    }

    // The solutions, left in the right-hand sides; false when the tangent is singular.
    bool solve(const FiniteElements& system, int64_t padded) {
        double* upper = matrix + system.shape.numbers();
        if (!factorize_general(system.shape, matrix, upper)) return false;
        if (system.model.bordered < 0) {
            solve_general(system.shape, matrix, upper, right, padded);
            return true;
        }
        return solve_bordered(system, upper, padded);
    }

    // Changes (8 points, 5, padded) of the deformation gradient of a pair of elements.
    void gradient_changes(const FiniteElements& system, int64_t pair, double* gradients, int64_t padded) const {
        for (int half = 0; half < 2; ++half) {
            const int64_t element = 2 * pair + half;
            const int64_t* nodes = system.model.connectivity + EIGHT * element;
            for (int64_t block = 0; block < padded; block += LANES) {
                Vector F[4][5];
                for (int g = 0; g < 4; ++g)
                    for (int c = 0; c < 5; ++c) F[g][c] = Vector{};
                for (int a = 0; a < EIGHT; ++a) {
                    const int64_t r = system.model.equations[2 * nodes[a]], z = system.model.equations[2 * nodes[a] + 1];
                    const Vector u = r >= 0 ? load(right + r * padded + block) : Vector{};
                    const Vector w = z >= 0 ? load(right + z * padded + block) : Vector{};
                    for (int g = 0; g < 4; ++g) {
                        const int64_t row = (4 * element + g) * EIGHT + a;
                        const double x = system.model.by_radius[row], y = system.model.by_height[row];
                        F[g][0] += x * u;
                        F[g][1] += y * u;
                        F[g][2] += x * w;
                        F[g][3] += y * w;
                        F[g][4] += system.model.over_radius[row] * u;
                    }
                }
                for (int g = 0; g < 4; ++g)
                    for (int c = 0; c < 5; ++c) store(gradients + ((4 * half + g) * 5 + c) * padded + block, F[g][c]);
            }
        }
    }

    // Changes (observed, columns) of the observed displacements, and of the force of the controlled one.
    void write_surface(const FiniteElements& system, double* surface, int64_t columns, int64_t padded) const {
        const int64_t count = system.model.observed_displacements;
        for (int64_t k = 0; k < count; ++k) {
            const int64_t equation = system.model.equations[system.model.observed[k]];
            for (int64_t c = 0; c < columns; ++c)
                surface[k * columns + c] = equation >= 0 ? right[equation * padded + c] : 0.0;
        }
        for (int64_t c = 0; system.model.controlled >= 0 && c < columns; ++c) {
            double total = -controlled_right[c];
            for (int64_t j = 0; j < system.model.size; ++j) total += controlled_row[j] * right[j * padded + c];
            surface[count * columns + c] = total;
        }
    }

private:
    double *matrix = nullptr, *right = nullptr;  // lower and upper triangle and one place behind; (rows, padded)
    int64_t* places = nullptr;                   // (elements, 4, 8, 8) of the blocks rr, rz, zz, zr of an element
    double *controlled_row = nullptr, *controlled_right = nullptr;  // (size,), (padded,) of the controlled equation
    double *border = nullptr, *border_solution = nullptr;  // (rows,) of the bordered equation, symmetric; (rows, LANES)
    double border_stiffness = 0.0;
    bool places_known = false, right_is_clear = false;

    // The tangent of contact, and its forces in the columns that move the nodes.
    void touch(const FiniteElements& system, const double* u, const SensitivityDirections& directions,
               int64_t parameters, int64_t padded) {
        const FiniteElementModel& model = system.model;
        if (model.bordered >= 0) {
            memset(border, 0, sizeof(double) * size_t(system.shape.rows()));
            border_stiffness = 0.0;
            matrix[place(system, model.bordered, model.bordered)] = 1.0;
        }
        for (int64_t side = 0; side < model.contact_sides; ++side) {
            ContactSide contact(model, system.quadrature, side, u);
            if (!contact.template assemble<true>()) continue;
            for (int64_t g = 0; g < directions.geometries; ++g) {
                double changes[CONTACT_UNKNOWNS];
                contact.change(directions.velocities + g * 2 * model.nodes, changes);
                for (int i = 0; i < CONTACT_UNKNOWNS; ++i) {
                    const int64_t row = model.equations[contact.numbers[i]];
                    if (row >= 0) right[row * padded + parameters + directions.directions + g] -= changes[i];
                }
            }
            for (int i = 0; i < CONTACT_UNKNOWNS; ++i)
                for (int j = 0; j < CONTACT_UNKNOWNS; ++j) {
                    const int64_t row = model.equations[contact.numbers[i]], column = model.equations[contact.numbers[j]];
                    if (row < 0 || column < 0) continue;
                    const double value = contact.tangent[i][j];
                    if (row != model.bordered && column != model.bordered) {
                        matrix[place(system, row, column)] += value;
                    } else if (row == column) {
                        border_stiffness += value;
                    } else if (row == model.bordered) {
                        border[column] += value;
                    }
                }
        }
    }

    // As `solve`, with the equation that borders the band; the factors are made.
    bool solve_bordered(const FiniteElements& system, const double* upper, int64_t padded) {
        const int64_t last = system.model.bordered, size = system.model.size;
        memset(border_solution, 0, sizeof(double) * size_t(system.shape.rows() * LANES));
        for (int64_t k = 0; k < size; ++k) border_solution[k * LANES] = border[k];
        solve_general(system.shape, matrix, upper, border_solution, LANES);
        double pivot = border_stiffness;
        for (int64_t k = 0; k < size; ++k) pivot -= border[k] * border_solution[k * LANES];
        if (pivot == 0.0) return false;
        solve_general(system.shape, matrix, upper, right, padded);  // with a unit row for the bordered equation
        for (int64_t block = 0; block < padded; block += LANES) {
            Vector change = load(right + last * padded + block);
            for (int64_t k = 0; k < size; ++k) change -= border[k] * load(right + k * padded + block);
            change = change * (1.0 / pivot);
            for (int64_t k = 0; k < size; ++k) {
                double* row = right + k * padded + block;
                store(row, load(row) - border_solution[k * LANES] * change);
            }
            store(right + last * padded + block, change);
        }
        return true;
    }

    // Keep the equation of the controlled displacement, and put the change of the motion in its place.
    void hold_controlled(const FiniteElements& system, const SensitivityDirections& directions, const double* inputs,
                         int64_t parameters, int64_t padded) {
        const int64_t own = system.model.controlled;
        for (int64_t j = 0; j < system.model.size; ++j) {
            const int64_t row = j > own ? j : own, column = j > own ? own : j;
            const bool inside = system.shape.first[row / EIGHT] <= column / EIGHT;
            controlled_row[j] = inside ? matrix[place(system, own, j)] : 0.0;
            if (inside) matrix[place(system, own, j)] = j == own ? 1.0 : 0.0;
        }
        double* columns = right + own * padded;
        for (int64_t c = 0; c < padded; ++c) {
            controlled_right[c] = columns[c];
            columns[c] = 0.0;
        }
        for (int64_t d = 0; d < directions.directions; ++d)
            columns[parameters + d] = inputs[BY_MOTION * directions.directions + d];
    }

    void clear_right(const FiniteElements& system, int64_t padded) {
        memset(right, 0, sizeof(double) * size_t(system.shape.rows() * padded));
        right_is_clear = true;
    }

    static int64_t place(const FiniteElements& system, int64_t row, int64_t column) {
        const BandShape& shape = system.shape;
        const bool below = row / EIGHT >= column / EIGHT;  // diagonal tiles lie whole in the lower triangle
        return below ? shape.place(row, column) : shape.numbers() + shape.place(column, row);
    }

    void set_places(const FiniteElements& system) {
        const FiniteElementModel& model = system.model;
        const int64_t nowhere = 2 * system.shape.numbers();
        for (int64_t e = 0; e < model.elements; ++e)
            for (int block = 0; block < 4; ++block)
                for (int k = 0; k < TILE; ++k) {
                    const int64_t* nodes = model.connectivity + EIGHT * e;
                    const int64_t row = model.equations[2 * nodes[k / EIGHT] + (block > 1)];
                    const int64_t column = model.equations[2 * nodes[k % EIGHT] + (block == 1 || block == 2)];
                    places[(e * 4 + block) * TILE + k] = row >= 0 && column >= 0 ? place(system, row, column) : nowhere;
                }
        places_known = true;
    }
};

}  // namespace creepkit
