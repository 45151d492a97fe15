// Parts of a simulation repeated, so that a benchmark can time each; compiled once for each width of vectors.
#include "../finite_elements.hpp"
#include "../lane_functions.hpp"

// Repeat one part: 0 assembly with tangent, 1 without, 2 factorisation (and the copy of the tangent that it needs), 3
// solution, 4 forces of the error estimate, 5 the copy alone.
//
// history : (points, 4 + S) at the start of the stage. Returns 0, or -1 when there is no memory or a point has no stress.
extern "C" int64_t LANE_FUNCTION(creepkit_repeat_part)(const creepkit::FiniteElementModel* model,
                                                       const creepkit::PointLaw* law,
                                                       const creepkit::StageConditions* stage, const double* history,
                                                       const double* displacement, int64_t part, int64_t repeats) {
    using namespace creepkit;
    Workspace memory;
    FiniteElements system(*model);
    PointStates points;
    double* tangent = nullptr;
    const int64_t numbers = system.shape.numbers() + 1;
    const auto take = [&] {
        system.take(memory);
        points.take(memory, system.point_count(), law->states);
        tangent = memory.doubles(numbers);
    };
    take();
    if (!memory.allocate()) return -1;
    take();
    for (int64_t k = 0; k < points.count; ++k)
        for (int64_t v = 0; v < points.values; ++v) points.base[v * points.count + k] = history[k * points.values + v];
    const double weights[STAGES] = {1e-3, -1e-3};
    if (system.assemble<true>(*law, *stage, displacement, points, 1e-3) != POINTS_SOLVED) return -1;
    memcpy(tangent, system.tangent, sizeof(double) * size_t(numbers));
    for (int64_t i = 0; i < repeats; ++i) {
        if (part == 0) system.assemble<true>(*law, *stage, displacement, points, 1e-3);
        if (part == 1) system.assemble<false>(*law, *stage, displacement, points, 1e-3);
        if (part == 2 || part == 5) memcpy(system.tangent, tangent, sizeof(double) * size_t(numbers));
        if (part == 2) system.factorize();
        if (part == 3) system.solve();
        if (part == 4) system.error_forces(displacement, points, weights);
    }
    return 0;
}
