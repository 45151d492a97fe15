// Pressure on one side, for the tests.
#include "pressure.hpp"

#include "export.hpp"

// Force (2, 3) of a unit pressure on a side whose nodes are at ends (2, 3), r and z in mm, and its derivatives
// (4, 3, 3): f_r to r, f_r to z, f_z to r, f_z to z.
CREEPKIT_API void creepkit_side_pressure(const double* ends, double* force, double* stiffness) {
    using namespace creepkit;
    const SideQuadrature quadrature = side_quadrature();
    side_force(quadrature, ends, ends + 3, reinterpret_cast<double(*)[3]>(force));
    side_stiffness(quadrature, ends, ends + 3, reinterpret_cast<double(*)[3][3]>(stiffness));
}
