// A mesh of axisymmetric eight-node elements with four points each, as Python prepares it once.
//
// Lengths are mm. Elements come in pairs, whose eight points lie side by side; an odd last one is followed by a copy of
// it without weight. Displacements are (2 nodes,) numbers, u_r and u_z of each node in turn. Displacements that must be
// equal, such as u_z of all nodes of a gripped face, share one equation: its force is the sum of theirs. A rigid circle is
// two nodes without elements, its centre and a point of it; it is coupled to any node, so that its equation borders the
// band.
#pragma once

#include <stdint.h>

namespace creepkit {

struct FiniteElementModel {
    int64_t elements;        // even, the copy included
    int64_t nodes;
    int64_t size;            // number of equations
    int64_t half_bandwidth;  // of the tangent
    int64_t pressed_sides;
    int64_t observed_displacements;
    int64_t controlled;            // equation whose displacement is the motion; -1: none
    int64_t dead_forces;           // `size`, or 0 where the load does not act by dead forces
    int64_t contact_sides;         // sides that may touch a rigid circle
    int64_t bordered;              // equation, the last, of a circle that is free to move along the axis; -1: none
    const double* coordinates;     // (nodes, 2) r and z at rest
    const double* by_radius;       // (elements, 4, 8) derivatives of the shape functions to r, 1/mm
    const double* by_height;       // (elements, 4, 8) to z
    const double* over_radius;     // (elements, 4, 8) shape functions over the radius of the point, 1/mm
    const double* weights;         // (elements, 4) area of a point times its radius, mm^3
    const double* points_first;    // (elements/2, 8 nodes, 3, 8 points) by_radius, by_height, over_radius
    const int64_t* connectivity;   // (elements, 8)
    const int64_t* equations;      // (2 nodes,) number of an equation, -1 where the displacement is prescribed
    const int64_t* tied;           // (elements,) whether displacements of an element share an equation
    const int64_t* places;         // (elements, 3, 8, 8) of the blocks rr, rz, zz in the lower triangle in tiles
    const int64_t* pressed;        // (sides, 3) nodes of a side under pressure, the solid to its left
    const int64_t* pressed_places; // (sides, 3, 3, 3) of its blocks rr, rz, zz
    const int64_t* observed;       // (observed,) which of the displacements are observed
    const double* dead;            // (dead forces,) N/rad on each equation for a unit of the load
    const int64_t* contacts;       // (contact sides, 5) nodes of the side, of the circle's centre and of a point of it
    const double* contact_laws;    // (contact sides, 2) stiffness MPa/mm, smoothing mm
};

}  // namespace creepkit
