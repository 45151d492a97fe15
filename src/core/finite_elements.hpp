// Out-of-balance forces and tangent of a mesh, and the estimate of a step's error in its displacements.
//
// This is a system that the time integration of time_integration.hpp drives; the reduced-order model is another.
#pragma once

#include "banded_matrix.hpp"
#include "contact.hpp"
#include "finite_element_model.hpp"
#include "material_point.hpp"
#include "pressure.hpp"
#include "workspace.hpp"

namespace creepkit {

// What the points of vector v of a pair of elements have of numbers of the two elements.
CREEPKIT_INLINE Vector of_elements(int v, double first, double second) {
    if constexpr (LANES < EIGHT) return splat(v * LANES < 4 ? first : second);
    Mask upper{};
    for (int k = 4; k < LANES; ++k) upper[k] = -1;
    return select(upper, splat(second), splat(first));
}

class FiniteElementSensitivities;

class FiniteElements {
public:
    using SensitivityMemory = FiniteElementSensitivities;

    explicit FiniteElements(const FiniteElementModel& model)
        : model(model), shape(model.size, model.half_bandwidth), quadrature(side_quadrature()) {}

    const FiniteElementModel& model;
    BandShape shape;
    const SideQuadrature quadrature;
    double *tangent = nullptr, *residual = nullptr;  // the lower triangle in tiles, one place behind it; (shape.rows(),)

    void take(Workspace& memory) {
        shape.take(memory, false);
        if (shape.first) set_envelope();
        tangent = memory.doubles(shape.numbers() + 1);
        residual = memory.doubles(shape.rows());
        controlled_row = memory.doubles(model.controlled >= 0 ? model.size : 0);
        depths = memory.doubles(3 * model.contact_sides);
        border = memory.doubles(model.bordered >= 0 ? shape.rows() : 0);
        border_solution = memory.doubles(model.bordered >= 0 ? shape.rows() : 0);
    }

    int64_t point_count() const { return 4 * model.elements; }
    int64_t displacement_count() const { return 2 * model.nodes; }
    // Observed displacements, and the force that the controlled one needs.
    int64_t observed_count() const { return model.observed_displacements + (model.controlled >= 0 ? 1 : 0); }
    double reaction() const { return controlled_force; }

    // What the error forces, of which `residual` has the displacements, change that force by; N/rad.
    double reaction_error() const {
        double total = controlled_error;
        for (int64_t k = 0; model.controlled >= 0 && k < model.size; ++k) total -= controlled_row[k] * residual[k];
        return fabs(total);
    }

    // Deformation gradient of the points of a vector, of which `point` is the first.
    CREEPKIT_INLINE void deform(int64_t point, const double* u, Kinematics& at) const {
        const int64_t pair = point / EIGHT, v = point % EIGHT / LANES;
        const int64_t *one = model.connectivity + 16 * pair, *other = one + EIGHT;
        const double* shapes = model.points_first + pair * 3 * EIGHT * EIGHT + v * LANES;
        at.f11 = at.f22 = at.f33 = splat(1.0);
        at.f12 = at.f21 = Vector{};
        for (int a = 0; a < EIGHT; ++a) {
            const Vector u_r = of_elements(int(v), u[2 * one[a]], u[2 * other[a]]);
            const Vector u_z = of_elements(int(v), u[2 * one[a] + 1], u[2 * other[a] + 1]);
            const double* at_node = shapes + 3 * EIGHT * a;
            const Vector by_r = load(at_node), by_z = load(at_node + EIGHT), over_r = load(at_node + 2 * EIGHT);
            at.f11 += by_r * u_r;
            at.f12 += by_z * u_r;
            at.f33 += over_r * u_r;
            at.f21 += by_r * u_z;
            at.f22 += by_z * u_z;
        }
    }

    // What a reduced-order model does to stresses, or changes of them, of eight points: nothing.
    CREEPKIT_INLINE void apply_factors(int64_t, double*, int) const {}

    // Blocks rr, rz, zz and, unless SYMMETRIC, zr of the tangent of an element whose points are the four lanes from
    // `first` on, by rows; A carries the weights.
    template <bool SYMMETRIC>
    CREEPKIT_INLINE void element_blocks(int64_t element, int first, const double A[25][EIGHT],
                                        double blocks[4][TILE]) const {
        const double *by_r = model.by_radius + 4 * element * EIGHT, *by_z = model.by_height + 4 * element * EIGHT;
        const double* over_r = model.over_radius + 4 * element * EIGHT;
        for (int v = 0; v < EIGHT; v += LANES) {
            Vector of_r[4][5], of_z[4][5];  // what u_r and u_z of the nodes change of P at the points
            CREEPKIT_UNROLL for (int g = 0; g < 4; ++g) {
                const int lane = first + g, row = EIGHT * g + v;
                const Vector x = load(by_r + row), y = load(by_z + row), h = load(over_r + row);
                CREEPKIT_UNROLL for (int i = 0; i < 5; ++i) {
                    of_r[g][i] = A[5 * i][lane] * x + A[5 * i + 1][lane] * y + A[5 * i + 4][lane] * h;
                    of_z[g][i] = A[5 * i + 2][lane] * x + A[5 * i + 3][lane] * y;
                }
            }
            for (int a = 0; a < EIGHT; ++a) {
                Vector rr{}, rz{}, zz{}, zr{};
                CREEPKIT_UNROLL for (int g = 0; g < 4; ++g) {
                    const double x = by_r[EIGHT * g + a], y = by_z[EIGHT * g + a], h = over_r[EIGHT * g + a];
                    const Vector *r = of_r[g], *z = of_z[g];
                    rr = rr + x * r[0] + y * r[1] + h * r[4];  // in this order each is one instruction
                    rz = rz + x * z[0] + y * z[1] + h * z[4];
                    zz = zz + x * z[2] + y * z[3];
                    if (!SYMMETRIC) zr = zr + x * r[2] + y * r[3];
                }
                const Vector found[4] = {rr, rz, zz, zr};
                CREEPKIT_UNROLL for (int i = 0; i < (SYMMETRIC ? 3 : 4); ++i) store(blocks[i] + EIGHT * a + v, found[i]);
            }
        }
    }

    // Out-of-balance forces into `residual`; if STIFF the tangent, made symmetric, into `tangent`.
    template <bool STIFF>
    PointFlag assemble(const PointLaw& law, const StageConditions& stage, const double* u, PointStates& points,
                       double tolerance) {
        clear(residual, shape.rows());
        if (STIFF) shape.clear(tangent);
        alignas(64) double P[5][EIGHT], A[25][EIGHT];
        for (int64_t first = 0; first < points.count; first += EIGHT) {
            Kinematics at[VECTORS];
            for (int v = 0; v < VECTORS; ++v) deform(first + v * LANES, u, at[v]);
            const PointFlag flag =
                update_points<STIFF>(law, stage, points, first, at, model.weights + first, tolerance, P[0], A[0]);
            if (flag != POINTS_SOLVED) return flag;
            for (int half = 0; half < 2; ++half) {
                add_forces(first / 4 + half, 4 * half, P);
                if (STIFF) add_stiffness(first / 4 + half, 4 * half, A);
            }
        }
        press<STIFF>(stage.pressure, u);
        for (int64_t k = 0; k < model.dead_forces; ++k) residual[k] -= stage.pressure * model.dead[k];
        if (model.contact_sides > 0) touch<STIFF>(u);
        if (model.controlled >= 0) hold_controlled<STIFF>();
        return POINTS_SOLVED;
    }

    // Out-of-balance forces of a change of all creep strains by the sum of weights_i slopes_i, into `residual`.
    void error_forces(const double* u, const PointStates& points, const double weights[STAGES]) {
        clear(residual, shape.rows());
        alignas(64) double P[5][EIGHT];
        for (int64_t first = 0; first < points.count; first += EIGHT) {
            for (int v = 0; v < VECTORS; ++v) {
                const int64_t k = first + v * LANES;
                Kinematics at;
                Vector stress[5];
                deform(k, u, at);
                if (!set_strains(at)) continue;  // never: the stage has just converged here
                stress_of_creep_change(points, k, at, weights, stress);
                for (int i = 0; i < 5; ++i) store(P[i] + v * LANES, stress[i] * load(model.weights + k));
            }
            for (int half = 0; half < 2; ++half) add_forces(first / 4 + half, 4 * half, P);
        }
        if (model.controlled < 0) return;
        controlled_error = residual[model.controlled];
        residual[model.controlled] = 0.0;
    }

    // False when the tangent, its border included, is not positive definite.
    bool factorize() {
        if (!factorize_symmetric(shape, tangent)) return false;
        if (model.bordered < 0) return true;
        memcpy(border_solution, border, sizeof(double) * size_t(shape.rows()));
        solve_symmetric(shape, tangent, border_solution);
        if (border_stiffness == 0.0) {  // nothing touches the body: let its force move it until something does
            border_pivot = NEARLY_FREE;
            return true;
        }
        border_pivot = border_stiffness;
        for (int64_t k = 0; k < model.size; ++k) border_pivot -= border[k] * border_solution[k];
        return border_pivot > 0.0;
    }

    void solve() {
        solve_symmetric(shape, tangent, residual);  // with a unit row for the bordered equation
        if (model.bordered < 0) return;
        double last = residual[model.bordered];
        for (int64_t k = 0; k < model.size; ++k) last -= border[k] * residual[k];
        last /= border_pivot;
        for (int64_t k = 0; k < model.size; ++k) residual[k] -= last * border_solution[k];
        residual[model.bordered] = last;
    }

    // Write the bordered equation into a full matrix (size, size).
    void copy_border(double* matrix) const {
        const int64_t own = model.bordered;
        for (int64_t k = 0; k < model.size; ++k) {
            const double value = k == own ? border_stiffness : border[k];
            matrix[own * model.size + k] = matrix[k * model.size + own] = value;
        }
    }

    bool touches() const { return model.contact_sides > 0; }

    // Share of the correction in `residual` that is made, so that none is longer than 1 mm and no contact pressure rises
    // by more than a tenth of the bulk modulus: of a body that little touches as yet, corrections are far too long.
    double correction_share(const StageConditions& stage, double* u, double size) {
        constexpr double LONGEST = 1.0, PRESSURE_SHARE = 0.1;
        const double whole = size > LONGEST ? LONGEST / size : 1.0;
        if (model.contact_sides == 0) return whole;
        double share = whole, change = 0.0, largest = 0.0;  // MPa, of the pressures
        for (int64_t side = 0; side < model.contact_sides; ++side)
            ContactSide(model, quadrature, side, u).penetrations(depths + 3 * side);
        correct(u, whole);
        for (int64_t side = 0; side < model.contact_sides; ++side) {
            double after[3];
            ContactSide(model, quadrature, side, u).penetrations(after);
            const double longest = PRESSURE_SHARE * stage.bulk / model.contact_laws[2 * side];
            for (int g = 0; g < 3; ++g) {
                const double deeper = after[g] - fmax(depths[3 * side + g], 0.0);
                if (deeper > longest) share = fmin(share, whole * longest / deeper);
                const double stiffness = model.contact_laws[2 * side], first = fmax(depths[3 * side + g], 0.0);
                change = fmax(change, stiffness * fabs(fmax(after[g], 0.0) - first));
                largest = fmax(largest, stiffness * fmax(after[g], 0.0));
            }
        }
        correct(u, -whole);
        settled = change <= PRESSURE_ERROR * largest;
        return share;
    }

    // Whether the last correction changed contact pressures little, by a share of the largest.
    bool contact_settled() const { return settled; }

    // Largest displacement, mm, that the numbers in `residual` stand for; NaN or infinite where one is.
    double largest_correction() const {
        double worst = 0.0;
        for (int64_t k = 0; k < model.size; ++k) {
            const double size = fabs(residual[k]);
            if (!(size <= 1e300)) return size;
            if (size > worst) worst = size;
        }
        return worst;
    }

    // u less `factor` times the correction in `residual`.
    void correct(double* u, double factor) const {
        for (int64_t k = 0; k < 2 * model.nodes; ++k)
            if (model.equations[k] >= 0) u[k] -= factor * residual[model.equations[k]];
    }

    // Largest of the observed displacements, or of all if none is observed, mm.
    double largest_displacement(const double* u) const {
        const int64_t count = model.observed_displacements;
        double worst = 0.0;
        for (int64_t k = 0; k < count; ++k) worst = fmax(worst, fabs(u[model.observed[k]]));
        for (int64_t k = 0; count == 0 && k < 2 * model.nodes; ++k) worst = fmax(worst, fabs(u[k]));
        return worst;
    }

    // Put held nodes where the motion takes them; pattern : (2 nodes,) mm for a unit of motion.
    void prescribe(const double* pattern, double motion, double* u) const {
        for (int64_t k = 0; k < 2 * model.nodes; ++k)
            if (model.equations[k] < 0 || model.equations[k] == model.controlled) u[k] = motion * pattern[k];
    }

private:
    double controlled_force = 0.0;  // N/rad, that the controlled displacement needed when forces were last assembled
    double controlled_error = 0.0;  // N/rad, of it, at fixed displacements
    double* controlled_row = nullptr;  // (size,) its row of the tangent, without the diagonal

    double* depths = nullptr;                    // (contact sides, 3) mm
    bool settled = true;
    static constexpr double PRESSURE_ERROR = 0.03;
    static constexpr double NEARLY_FREE = 1e-3;  // N/(rad mm); corrections are cut
    double *border = nullptr, *border_solution = nullptr;  // (rows,) column of the bordered equation; K^-1 times it
    double border_stiffness = 0.0, border_pivot = 0.0;     // N/(rad mm), its diagonal; less border K^-1 border

    // All equations of an element are coupled.
    void set_envelope() {
        for (int64_t e = 0; e < model.elements; ++e) {
            const int64_t* nodes = model.connectivity + EIGHT * e;
            for (int i = 0; i < 2 * EIGHT; ++i)
                for (int j = 0; j < 2 * EIGHT; ++j) {
                    const int64_t row = model.equations[2 * nodes[i / 2] + i % 2];
                    const int64_t column = model.equations[2 * nodes[j / 2] + j % 2];
                    if (column >= 0 && row >= column) shape.include(row, column);
                }
        }
        shape.close_envelope();
    }

    // Add the forces of contact and, if STIFF, their tangent; that of the bordered equation stays beside the band.
    template <bool STIFF>
    void touch(const double* u) {
        if (STIFF && model.bordered >= 0) {
            clear(border, shape.rows());
            border_stiffness = 0.0;
            tangent[shape.place(model.bordered, model.bordered)] = 1.0;
        }
        for (int64_t side = 0; side < model.contact_sides; ++side) {
            ContactSide contact(model, quadrature, side, u);
            if (!contact.template assemble<STIFF>()) continue;
            for (int i = 0; i < CONTACT_UNKNOWNS; ++i) {
                const int64_t row = model.equations[contact.numbers[i]];
                if (row < 0) continue;
                residual[row] += contact.force[i];
                for (int j = 0; STIFF && j < CONTACT_UNKNOWNS; ++j) {
                    const int64_t column = model.equations[contact.numbers[j]];
                    if (column < 0 || column > row) continue;
                    const double value = contact.tangent[i][j];
                    if (row != model.bordered) {
                        tangent[shape.place(row, column)] += value;
                    } else {
                        (column == row ? border_stiffness : border[column]) += value;
                    }
                }
            }
        }
    }

    // Keep the force of the controlled displacement and make its equation that of no correction.
    template <bool STIFF>
    void hold_controlled() {
        const int64_t own = model.controlled;
        controlled_force = residual[own];
        residual[own] = 0.0;
        if (!STIFF) return;
        for (int64_t k = 0; k < model.size; ++k) {
            const int64_t row = k > own ? k : own, column = k > own ? own : k;
            const bool inside = shape.first[row / EIGHT] <= column / EIGHT;
            controlled_row[k] = inside && k != own ? tangent[shape.place(row, column)] : 0.0;
            if (inside) tangent[shape.place(row, column)] = k == own ? 1.0 : 0.0;
        }
    }

    static void clear(double* values, int64_t count) { memset(values, 0, sizeof(double) * size_t(count)); }

    // Nodal forces of an element whose points are the four lanes from `first` on; P carries the weights.
    CREEPKIT_INLINE void add_forces(int64_t element, int first, const double P[5][EIGHT]) {
        alignas(64) double radial[EIGHT], axial[EIGHT];
        for (int v = 0; v < EIGHT; v += LANES) {
            Vector along_r{}, along_z{};
            CREEPKIT_UNROLL for (int g = 0; g < 4; ++g) {
                const int64_t row = (4 * element + g) * EIGHT + v;
                const int lane = first + g;
                const Vector x = load(model.by_radius + row), y = load(model.by_height + row);
                along_r = along_r + x * P[0][lane] + y * P[1][lane] + load(model.over_radius + row) * P[4][lane];
                along_z = along_z + x * P[2][lane] + y * P[3][lane];
            }
            store(radial + v, along_r);
            store(axial + v, along_z);
        }
        const int64_t* nodes = model.connectivity + EIGHT * element;
        for (int a = 0; a < EIGHT; ++a) {
            const int64_t r = model.equations[2 * nodes[a]], z = model.equations[2 * nodes[a] + 1];
            if (r >= 0) residual[r] += radial[a];
            if (z >= 0) residual[z] += axial[a];
        }
    }

    // An element's tangent into that of the body; A carries the weights.
    CREEPKIT_INLINE void add_stiffness(int64_t element, int first, const double A[25][EIGHT]) {
        alignas(64) double blocks[4][TILE];
        element_blocks<true>(element, first, A, blocks);
        // the other half of rr and zz is the same, but of displacements that share an equation both are on the diagonal
        const bool tied = model.tied[element] != 0;
        const int64_t* places = model.places + 3 * TILE * element;
        for (int a = 0; a < EIGHT; ++a)
            for (int b = tied ? 0 : a; b < EIGHT; ++b) {
                tangent[places[EIGHT * a + b]] += blocks[0][EIGHT * a + b];
                tangent[places[2 * TILE + EIGHT * a + b]] += blocks[2][EIGHT * a + b];
            }
        for (int k = 0; k < TILE; ++k) tangent[places[TILE + k]] += blocks[1][k];
    }

    // Take the pressure's force off the internal one, and its stiffness (made symmetric) off the tangent.
    template <bool STIFF>
    void press(double pressure, const double* u) {
        if (pressure == 0.0) return;
        for (int64_t side = 0; side < model.pressed_sides; ++side) {
            const int64_t* nodes = model.pressed + 3 * side;
            double r[3], z[3], force[2][3];
            for (int a = 0; a < 3; ++a) {
                r[a] = model.coordinates[2 * nodes[a]] + u[2 * nodes[a]];
                z[a] = model.coordinates[2 * nodes[a] + 1] + u[2 * nodes[a] + 1];
            }
            side_force(quadrature, r, z, force);
            for (int a = 0; a < 3; ++a)
                for (int i = 0; i < 2; ++i) {
                    const int64_t equation = model.equations[2 * nodes[a] + i];
                    if (equation >= 0) residual[equation] -= pressure * force[i][a];
                }
            if (!STIFF) continue;
            double k[4][3][3];
            side_stiffness(quadrature, r, z, k);
            const int64_t* places = model.pressed_places + 27 * side;
            for (int a = 0; a < 3; ++a) {
                for (int b = a; b < 3; ++b) tangent[places[3 * a + b]] -= 0.5 * pressure * (k[0][a][b] + k[0][b][a]);
                for (int b = 0; b < 3; ++b)
                    tangent[places[9 + 3 * a + b]] -= 0.5 * pressure * (k[1][a][b] + k[2][b][a]);
            }
        }
    }
};

}  // namespace creepkit
