// Segments of the load history: what changes linearly in time between two of its breakpoints.
#pragma once

#include <math.h>

#include "time_transformation.hpp"

namespace creepkit {

// Columns of a segment: times s, pressures MPa (or the load that dead forces are for, in its unit), temperatures K,
// moduli E MPa, motion of held nodes, at both ends.
enum SegmentColumn {
    START,
    END,
    PRESSURE,
    END_PRESSURE,
    START_TEMPERATURE,
    FINAL_TEMPERATURE,
    MODULUS,
    END_MODULUS,
    MOTION,
    END_MOTION,
    SEGMENT_COLUMNS
};

// t^beta from time zero, for a law whose strain begins as t^beta; plain time while the load rises from nothing.
inline TimeTransformation segment_transformation(const double* segment, double beta) {
    const double start = segment[START], length = segment[END] - segment[START];
    if (beta >= 1.0 || (start == 0.0 && segment[PRESSURE] == 0.0 && segment[MOTION] == 0.0))
        return linear_time(start, length);
    if (start == 0.0) return power_law_time(start, length, beta);
    return {start, length, fmax(beta, SMALLEST_EXPONENT), start};
}

}  // namespace creepkit
