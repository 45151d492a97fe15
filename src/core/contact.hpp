// Frictionless contact of sides of three nodes with a rigid circle of the section: a sphere on the axis, or a ring.
//
// The gap g of a point x of the side is |x - c| - R. Contact has the potential W = integral of phi(g) r dl over the side
// as it is at rest, with the pressure p = -phi'(g): nothing for g > s, stiffness (s - g)^2/(4 s) for |g| < s, and
// stiffness (-g) below, so that p and its slope are continuous. A potential has a symmetric tangent, and the force on the
// circle is minus the sum of those on the nodes. Three Gauss points a side; penalty method as in P. Wriggers,
// Computational Contact Mechanics, 2006.
#pragma once

#include <math.h>

#include "finite_element_model.hpp"
#include "pressure.hpp"

namespace creepkit {

constexpr int CONTACT_UNKNOWNS = 7;  // u_r of the three nodes, u_z of the three nodes, u_z of the circle

// A side in contact: its forces on the unknowns, N/rad, their tangent and their changes with what moves the geometry.
class ContactSide {
public:
    ContactSide(const FiniteElementModel& model, const SideQuadrature& quadrature, int64_t side, const double* u)
        : quadrature(quadrature) {
        const int64_t* row = model.contacts + 5 * side;
        stiffness = model.contact_laws[2 * side];
        smoothing = model.contact_laws[2 * side + 1];
        for (int i = 0; i < 2; ++i) {
            centre[i] = model.coordinates[2 * row[3] + i] + u[2 * row[3] + i];
            const double reach = model.coordinates[2 * row[4] + i] - model.coordinates[2 * row[3] + i];
            direction[i] = reach;
            for (int a = 0; a < 3; ++a) {
                rest[i][a] = model.coordinates[2 * row[a] + i];
                now[i][a] = rest[i][a] + u[2 * row[a] + i];
                numbers[3 * i + a] = 2 * row[a] + i;
            }
        }
        numbers[6] = 2 * row[3] + 1;
        radius = sqrt(direction[0] * direction[0] + direction[1] * direction[1]);
        for (int i = 0; i < 2; ++i) direction[i] /= radius;
        circle = row[3];
        edge = row[4];
    }

    int64_t numbers[CONTACT_UNKNOWNS];  // which displacements the unknowns are
    double force[CONTACT_UNKNOWNS], tangent[CONTACT_UNKNOWNS][CONTACT_UNKNOWNS];

    // Fill `force` and, if STIFF, `tangent`; false where nothing touches.
    template <bool STIFF>
    bool assemble() {
        clear();
        bool touches = false;
        for (int g = 0; g < 3; ++g) {
            const Point p = point(g);
            if (p.pressure == 0.0) continue;
            touches = true;
            for (int i = 0; i < CONTACT_UNKNOWNS; ++i) {
                force[i] -= p.weight * p.pressure * p.normal[component(i)] * share(g, i);
                if (!STIFF) continue;
                for (int j = 0; j < CONTACT_UNKNOWNS; ++j)
                    tangent[i][j] += p.weight * p.curvature(component(i), component(j)) * share(g, i) * share(g, j);
            }
        }
        return touches;
    }

    // Depth at the Gauss points, (3,) mm, below zero where there is a gap.
    void penetrations(double* depths) const {
        for (int g = 0; g < 3; ++g) {
            double away[2];
            for (int i = 0; i < 2; ++i) {
                away[i] = -centre[i];
                for (int a = 0; a < 3; ++a) away[i] += quadrature.values[g][a] * now[i][a];
            }
            depths[g] = radius - sqrt(away[0] * away[0] + away[1] * away[1]);
        }
    }

    // Change of `force` with a velocity (2 nodes,) of all nodes, at fixed displacements; after assemble<true>.
    void change(const double* velocity, double changes[CONTACT_UNKNOWNS]) const {
        double grows = 0.0;  // of the radius
        for (int i = 0; i < 2; ++i)
            grows += direction[i] * (velocity[2 * edge + i] - velocity[2 * circle + i]);
        for (int i = 0; i < CONTACT_UNKNOWNS; ++i) {
            changes[i] = 0.0;
            for (int j = 0; j < CONTACT_UNKNOWNS; ++j) changes[i] += tangent[i][j] * velocity[numbers[j]];
        }
        for (int g = 0; g < 3; ++g) {
            const Point p = point(g);
            if (p.pressure == 0.0) continue;
            double moved[2] = {}, stretched[2] = {};
            for (int i = 0; i < 2; ++i)
                for (int a = 0; a < 3; ++a) {
                    moved[i] += quadrature.values[g][a] * velocity[numbers[3 * i + a]];
                    stretched[i] += quadrature.slopes[g][a] * velocity[numbers[3 * i + a]];
                }
            const double wider = moved[0] / p.radius + (p.slope[0] * stretched[0] + p.slope[1] * stretched[1]) /
                                                           (p.slope[0] * p.slope[0] + p.slope[1] * p.slope[1]);
            // u_r of the circle is held, but its centre may move at rest
            const double sideways = -velocity[2 * circle];
            for (int i = 0; i < CONTACT_UNKNOWNS; ++i) {
                const int c = component(i);
                const double along = -wider * p.pressure * p.normal[c] - p.stiffness * grows * p.normal[c] +
                                     sideways * p.curvature(c, 0);
                changes[i] += p.weight * along * share(g, i);
            }
        }
    }

private:
    struct Point {
        double weight, radius, pressure, stiffness, distance;  // weight mm^2, with the radius at rest
        double normal[2], slope[2];

        // Second derivative of phi to the place of the point.
        double curvature(int i, int j) const {
            const double both = normal[i] * normal[j];
            return stiffness * both - pressure / distance * ((i == j ? 1.0 : 0.0) - both);
        }
    };

    const SideQuadrature& quadrature;
    double stiffness, smoothing, radius, centre[2], direction[2], rest[2][3], now[2][3];
    int64_t circle, edge;

    static int component(int unknown) { return unknown < 3 ? 0 : 1; }

    // Derivative of a component of x - c at Gauss point g to an unknown.
    double share(int g, int unknown) const { return unknown < 6 ? quadrature.values[g][unknown % 3] : -1.0; }

    void clear() {
        for (int i = 0; i < CONTACT_UNKNOWNS; ++i) {
            force[i] = 0.0;
            for (int j = 0; j < CONTACT_UNKNOWNS; ++j) tangent[i][j] = 0.0;
        }
    }

    Point point(int g) const {
        Point p{};
        double away[2];
        for (int i = 0; i < 2; ++i) {
            away[i] = -centre[i];
            for (int a = 0; a < 3; ++a) {
                away[i] += quadrature.values[g][a] * now[i][a];
                p.slope[i] += quadrature.slopes[g][a] * rest[i][a];
                if (i == 0) p.radius += quadrature.values[g][a] * rest[0][a];
            }
        }
        p.distance = sqrt(away[0] * away[0] + away[1] * away[1]);
        const double gap = p.distance - radius;
        if (!(gap < smoothing) || p.distance == 0.0) return p;
        const double in = smoothing - gap;
        const bool near = gap > -smoothing;
        p.pressure = near ? stiffness * in * in / (4.0 * smoothing) : -stiffness * gap;
        p.stiffness = near ? stiffness * in / (2.0 * smoothing) : stiffness;
        p.weight = quadrature.weights[g] * p.radius * sqrt(p.slope[0] * p.slope[0] + p.slope[1] * p.slope[1]);
        for (int i = 0; i < 2; ++i) p.normal[i] = away[i] / p.distance;
        return p;
    }
};

}  // namespace creepkit
