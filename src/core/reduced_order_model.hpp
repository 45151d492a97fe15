// A reduced-order model of an axisymmetric body: displacements as a sum of modes, integrals over few weighted points.
//
// The displacement of the mesh is Phi q with r modes Phi from a proper orthogonal decomposition of finite element
// solutions (Sirovich 1987, Quart. Appl. Math. 45, 561), and the balance of forces is that of finite elements in the
// space of the modes (Galerkin). Its integrals run over some of the points (empirical cubature: Hernandez, Caicedo and
// Ferrer 2017, Comput. Meth. Appl. Mech. Engng 313, 687), and the weight of a point is a matrix of the five components of
// its stress, so that it also stands for those about it whose stress differs. A point has the law, the history and the
// stress of a point of a finite element.
//
// R is r in whole vectors of eight numbers; what is added to r modes or to the points is zero or without weight.
#pragma once

#include "banded_matrix.hpp"
#include "material_point.hpp"
#include "workspace.hpp"

namespace creepkit {

// The model as Python prepares it for one mesh; lengths in mm, q in mm too where modes have no unit.
struct ReducedOrderModel {
    int64_t modes;                // r
    int64_t points;               // a multiple of eight
    int64_t side_points;          // Gauss points of the sides under pressure
    int64_t observed;             // nodes of the observed surface
    int64_t limited;              // displacements, of those measured, that the deflection limit is for
    int64_t measured;             // displacements that errors are measured by; both multiples of eight
    const double* gradients;      // (points, 5, R) of F11, F12, F21, F22, F33 to q, 1/mm
    const double* points_first;   // (points/8, r, 5, 8) the same
    const double* weights;        // (points,) area times radius, mm^3
    const double* factors;        // (points/8, 25, 8) by rows, matrix that the stress is multiplied by
    const double* sides;          // (side points, 4) Gauss weight; at rest r, dr/dx, dz/dx, mm, x in [-1, 1] on a side
    const double* side_modes;     // (side points, 4, R) of u_r, u_z, du_r/dx, du_z/dx to q
    const double* surface;        // (observed, R) u_z of the observed nodes to q
    const double* measures;       // (r, measured) displacements to q; those of the observed nodes, u_z, come first
};

class ReducedOrderSensitivities;

// A Gauss point of a side under pressure: its radius and its slopes in the deformed state, mm.
struct SidePoint {
    double radius, dr, dz;
};

// What `FiniteElements` is for a mesh; see time_integration.hpp.
class ReducedOrderSystem {
public:
    using SensitivityMemory = ReducedOrderSensitivities;

    explicit ReducedOrderSystem(const ReducedOrderModel& model)
        : model(model), shape(model.modes, model.modes - 1),
          width((model.modes + EIGHT - 1) / EIGHT * EIGHT) {}

    const ReducedOrderModel& model;
    BandShape shape;        // the whole matrix is the band
    const int64_t width;    // R
    double *tangent = nullptr, *residual = nullptr;  // lower triangle in tiles; (shape.rows(),)

    void take(Workspace& memory) {
        shape.take(memory, true);
        tangent = memory.doubles(shape.numbers() + 1);
        residual = memory.doubles(shape.rows());
        products = memory.doubles(5 * EIGHT * width);
        side_columns = memory.doubles(2 * model.side_points * width);
        side_rows = memory.doubles(2 * model.side_points * width);
    }

    int64_t point_count() const { return model.points; }
    int64_t displacement_count() const { return width; }
    int64_t observed_count() const { return model.observed; }
    double reaction() const { return 0.0; }
    double reaction_error() const { return 0.0; }
    bool touches() const { return false; }
    bool contact_settled() const { return true; }
    double correction_share(const StageConditions&, double*, double size) const { return size > 1.0 ? 1.0 / size : 1.0; }

    // Deformation gradient of the points of a vector, of which `point` is the first.
    CREEPKIT_INLINE void deform(int64_t point, const double* q, Kinematics& at) const {
        const double* by_mode = model.points_first + point / EIGHT * model.modes * 5 * EIGHT + point % EIGHT;
        at.f11 = at.f22 = at.f33 = splat(1.0);
        at.f12 = at.f21 = Vector{};
        for (int64_t i = 0; i < model.modes; ++i) {
            const double* at_mode = by_mode + 5 * EIGHT * i;
            at.f11 += q[i] * load(at_mode);
            at.f12 += q[i] * load(at_mode + EIGHT);
            at.f21 += q[i] * load(at_mode + 2 * EIGHT);
            at.f22 += q[i] * load(at_mode + 3 * EIGHT);
            at.f33 += q[i] * load(at_mode + 4 * EIGHT);
        }
    }

    // Multiply stresses (5, 8) of eight points, or changes (5, columns, 8) of them, by the points' matrices.
    CREEPKIT_INLINE void apply_factors(int64_t block, double* stresses, int columns) const {
        for (int v = 0; v < EIGHT; v += LANES) {
            const double* matrix = model.factors + block * 25 * EIGHT + v;
            for (int c = 0; c < columns; ++c) {
                Vector own[5];
                double* first = stresses + c * EIGHT + v;
                CREEPKIT_UNROLL for (int s = 0; s < 5; ++s) own[s] = load(first + s * columns * EIGHT);
                CREEPKIT_UNROLL for (int s = 0; s < 5; ++s) {
                    Vector total = load(matrix + 5 * s * EIGHT) * own[0];
                    CREEPKIT_UNROLL for (int t = 1; t < 5; ++t) total += load(matrix + (5 * s + t) * EIGHT) * own[t];
                    store(first + s * columns * EIGHT, total);
                }
            }
        }
    }

    // Out-of-balance forces into `residual`; if STIFF the tangent, made symmetric, into `tangent`.
    template <bool STIFF>
    PointFlag assemble(const PointLaw& law, const StageConditions& stage, const double* q, PointStates& points,
                       double tolerance) {
        clear();
        if (STIFF) shape.clear(tangent);
        alignas(64) double P[5][EIGHT], A[25][EIGHT];
        for (int64_t block = 0; block < model.points / EIGHT; ++block) {
            const int64_t first = EIGHT * block;
            Kinematics at[VECTORS];
            for (int v = 0; v < VECTORS; ++v) deform(first + v * LANES, q, at[v]);
            const PointFlag flag =
                update_points<STIFF>(law, stage, points, first, at, model.weights + first, tolerance, P[0], A[0]);
            if (flag != POINTS_SOLVED) return flag;
            apply_factors(block, P[0], 1);
            add_forces(block, P);
            if (!STIFF) continue;
            apply_factors(block, A[0], 5);
            make_symmetric(A);
            tangent_products(block, A, products);
            for (int64_t column = 0; column < shape.blocks; ++column)
                for (int64_t row = column; row < shape.blocks; ++row)
                    add_products<false>(tangent + shape.tile(column, row - column),
                                 model.gradients + block * EIGHT * 5 * width + EIGHT * row, products + EIGHT * column,
                                 width, 5 * EIGHT);
        }
        press<STIFF>(stage.pressure, q);
        return POINTS_SOLVED;
    }

    // Out-of-balance forces of a change of all creep strains by the sum of weights_i slopes_i, into `residual`.
    void error_forces(const double* q, const PointStates& points, const double weights[STAGES]) {
        clear();
        alignas(64) double P[5][EIGHT];
        for (int64_t block = 0; block < model.points / EIGHT; ++block) {
            for (int v = 0; v < VECTORS; ++v) {
                const int64_t k = EIGHT * block + v * LANES;
                Kinematics at;
                Vector stress[5];
                deform(k, q, at);
                if (!set_strains(at)) continue;  // never: the stage has just converged here
                stress_of_creep_change(points, k, at, weights, stress);
                for (int i = 0; i < 5; ++i) store(P[i] + v * LANES, stress[i] * load(model.weights + k));
            }
            apply_factors(block, P[0], 1);
            add_forces(block, P);
        }
    }

    bool factorize() { return factorize_symmetric(shape, tangent); }
    void solve() { solve_symmetric(shape, tangent, residual); }

    // Largest displacement, mm, that the numbers in `residual` stand for; NaN or infinite where one is.
    double largest_correction() const { return largest_of(residual, model.measured); }

    // q less `factor` times the correction in `residual`.
    void correct(double* q, double factor) const {
        for (int64_t i = 0; i < model.modes; ++i) q[i] -= factor * residual[i];
    }

    // Largest displacement of the observed surface, or of all that are measured if none is observed, mm.
    double largest_displacement(const double* q) const { return largest_of(q, model.limited); }

    // Held nodes do not move: all modes are zero there.
    void prescribe(const double*, double, double*) const {}

    SidePoint side_point(int64_t k, const double* q) const {
        const double *rest = model.sides + 4 * k, *modes = model.side_modes + 4 * k * width;
        Vector radius{}, dr{}, dz{};
        for (int64_t i = 0; i < width; i += LANES) {
            const Vector part = load(q + i);
            radius += part * load(modes + i);
            dr += part * load(modes + 2 * width + i);
            dz += part * load(modes + 3 * width + i);
        }
        return {rest[1] + sum(radius), rest[2] + sum(dr), rest[3] + sum(dz)};
    }

    // Tangent times gradients of eight points, (8, 5, R), from A (25, 8), which carries the weights.
    CREEPKIT_INLINE void tangent_products(int64_t block, const double A[25][EIGHT], double* result) const {
        const double* gradients = model.gradients + block * EIGHT * 5 * width;
        for (int64_t i = 0; i < width; i += LANES)
            for (int lane = 0; lane < EIGHT; ++lane) {
                const double* G = gradients + lane * 5 * width + i;
                Vector g[5];
                for (int t = 0; t < 5; ++t) g[t] = load(G + t * width);
                for (int s = 0; s < 5; ++s)
                    store(result + (lane * 5 + s) * width + i,
                          A[5 * s][lane] * g[0] + A[5 * s + 1][lane] * g[1] + A[5 * s + 2][lane] * g[2] +
                              A[5 * s + 3][lane] * g[3] + A[5 * s + 4][lane] * g[4]);
            }
    }

private:
    double *products = nullptr, *side_columns = nullptr, *side_rows = nullptr;  // (8, 5, R); (side points, 2, R) each

    // Largest of the first `count` measured displacements, mm; NaN or infinite where one is.
    double largest_of(const double* q, int64_t count) const {
        Vector worst{}, unusual{};
        for (int64_t k = 0; k < count; k += LANES) {
            Vector value{};
            for (int64_t i = 0; i < model.modes; ++i) value += q[i] * load(model.measures + i * model.measured + k);
            worst = larger(worst, magnitude(value));
            unusual += value - value;  // 0, or NaN where a value is NaN or infinite
        }
        double result = 0.0;
        for (int lane = 0; lane < LANES; ++lane) result = fmax(result, worst[lane]);
        return result + sum(unusual);
    }

    // The symmetric part of matrices (5, 5, 8).
    CREEPKIT_INLINE static void make_symmetric(double A[25][EIGHT]) {
        for (int i = 0; i < 5; ++i)
            for (int j = 0; j < i; ++j)
                for (int v = 0; v < EIGHT; v += LANES) {
                    const Vector mean = 0.5 * (load(A[5 * i + j] + v) + load(A[5 * j + i] + v));
                    store(A[5 * i + j] + v, mean);
                    store(A[5 * j + i] + v, mean);
                }
    }

    void clear() { memset(residual, 0, sizeof(double) * size_t(shape.rows())); }

    // Forces of the stresses of eight points, which carry the weights.
    CREEPKIT_INLINE void add_forces(int64_t block, const double P[5][EIGHT]) {
        const double* gradients = model.gradients + block * EIGHT * 5 * width;
        for (int64_t i = 0; i < width; i += LANES) {
            Vector total = load(residual + i);
            for (int lane = 0; lane < EIGHT; ++lane)
                for (int s = 0; s < 5; ++s) total += P[s][lane] * load(gradients + (lane * 5 + s) * width + i);
            store(residual + i, total);
        }
    }

    // Take the pressure's force off the internal one, and its stiffness off the tangent.
    //
    // A unit pressure pushes with the integral of (-dz/dx, dr/dx) r N dx, see pressure.hpp: with the change of the volume
    // behind it, the integral of -r^2 dz/2, where the sides end at the axis or where they are held. The stiffness is that
    // of the volume, two products of rows a side point; what a free end adds is left to the iterations.
    template <bool STIFF>
    void press(double pressure, const double* q) {
        if (pressure == 0.0) return;
        for (int64_t k = 0; k < model.side_points; ++k) {
            const SidePoint at = side_point(k, q);
            const double weight = pressure * model.sides[4 * k], *modes = model.side_modes + 4 * k * width;
            double *columns = side_columns + 2 * k * width, *rows = side_rows + 2 * k * width;
            for (int64_t i = 0; i < width; i += LANES) {
                const Vector r = load(modes + i), z = load(modes + width + i);
                store(residual + i, load(residual + i) + weight * at.radius * (at.dz * r - at.dr * z));
                if (!STIFF) continue;
                const Vector slope = weight * (0.5 * at.dz * r + at.radius * load(modes + 3 * width + i));
                store(columns + i, r);
                store(columns + width + i, slope);
                store(rows + i, slope);
                store(rows + width + i, r);
            }
        }
        if (!STIFF) return;
        for (int64_t column = 0; column < shape.blocks; ++column)
            for (int64_t row = column; row < shape.blocks; ++row)
                add_products<false>(tangent + shape.tile(column, row - column), side_columns + EIGHT * row,
                             side_rows + EIGHT * column, width, 2 * model.side_points);
    }
};

}  // namespace creepkit
