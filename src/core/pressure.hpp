// Follower pressure on sides of three nodes: its nodal forces and their derivatives.
//
// A unit pressure pushes with f = integral of (-dz/dx, dr/dx) r N dx along a side, x in [-1, 1], in the deformed state;
// three Gauss points integrate it exactly.
#pragma once

#include <math.h>

namespace creepkit {

struct SideQuadrature {
    double values[3][3], slopes[3][3], weights[3];  // [Gauss point][first, middle, last node]
};

inline SideQuadrature side_quadrature() {
    SideQuadrature q;
    const double spread = sqrt(0.6), places[3] = {-spread, 0.0, spread}, weights[3] = {5.0 / 9.0, 8.0 / 9.0, 5.0 / 9.0};
    for (int g = 0; g < 3; ++g) {
        const double x = places[g];
        const double values[3] = {0.5 * x * (x - 1.0), 1.0 - x * x, 0.5 * x * (x + 1.0)};
        const double slopes[3] = {x - 0.5, -2.0 * x, x + 0.5};
        for (int a = 0; a < 3; ++a) {
            q.values[g][a] = values[a];
            q.slopes[g][a] = slopes[a];
        }
        q.weights[g] = weights[g];
    }
    return q;
}

// Force (2, 3) of a unit pressure on a side whose nodes are now at r (3,) and z (3,), mm.
inline void side_force(const SideQuadrature& q, const double* r, const double* z, double force[2][3]) {
    for (int a = 0; a < 3; ++a) force[0][a] = force[1][a] = 0.0;
    for (int g = 0; g < 3; ++g) {
        double radius = 0.0, dr = 0.0, dz = 0.0;
        for (int a = 0; a < 3; ++a) {
            radius += q.values[g][a] * r[a];
            dr += q.slopes[g][a] * r[a];
            dz += q.slopes[g][a] * z[a];
        }
        const double weight = q.weights[g] * radius;
        for (int a = 0; a < 3; ++a) {
            force[0][a] -= weight * dz * q.values[g][a];
            force[1][a] += weight * dr * q.values[g][a];
        }
    }
}

// Derivatives [4][3][3] of that force: f_r to r, f_r to z, f_z to r, f_z to z.
inline void side_stiffness(const SideQuadrature& q, const double* r, const double* z, double stiffness[4][3][3]) {
    for (int i = 0; i < 4; ++i)
        for (int a = 0; a < 3; ++a)
            for (int b = 0; b < 3; ++b) stiffness[i][a][b] = 0.0;
    for (int g = 0; g < 3; ++g) {
        double radius = 0.0, dr = 0.0, dz = 0.0;
        for (int a = 0; a < 3; ++a) {
            radius += q.values[g][a] * r[a];
            dr += q.slopes[g][a] * r[a];
            dz += q.slopes[g][a] * z[a];
        }
        for (int a = 0; a < 3; ++a) {
            const double share = q.weights[g] * q.values[g][a];
            for (int b = 0; b < 3; ++b) {
                stiffness[0][a][b] -= share * dz * q.values[g][b];
                stiffness[1][a][b] -= share * radius * q.slopes[g][b];
                stiffness[2][a][b] += share * (radius * q.slopes[g][b] + dr * q.values[g][b]);
            }
        }
    }
}

}  // namespace creepkit
