// The law at hand: points go to JavaScript, up to eight at a time, through arrays that both know.
#include "law.hpp"

#include <math.h>

#include "../material_point.hpp"

// Read `rows` points of `page_points`, and write ln of the rate, rates of the states and their derivatives.
extern "C" __attribute__((import_module("page"), import_name("law"))) void page_law_in_javascript(int32_t rows);

namespace creepkit {

constexpr int WIDTH = POINT_SIZE + MAX_STATES, COLUMNS = (1 + MAX_STATES) * (1 + WIDTH);

static double points[LAW_ROWS * WIDTH], outputs[LAW_ROWS * COLUMNS];  // one point, one result after another
static int64_t states = 0;

int64_t page_law(int64_t rows, const double* x, const double*, double* out) {
    const int64_t width = POINT_SIZE + states, size = 1 + states, columns = size * (1 + width);
    for (int64_t row = 0; row < rows; ++row)
        for (int64_t k = 0; k < width; ++k) points[row * width + k] = x[k * rows + row];
    page_law_in_javascript(int32_t(rows));
    int64_t flags = 0;
    for (int64_t row = 0; row < rows; ++row)
        for (int64_t k = 0; k < columns; ++k) {
            const double value = out[k * rows + row] = outputs[row * columns + k];
            if (!isfinite(value)) flags |= k < size ? 1 : 2;
        }
    return flags;
}

}  // namespace creepkit

// Where JavaScript finds the points of a law with so many states; null where the core takes no law with so many.
CREEPKIT_PAGE_API double* creepkit_page_points(int32_t states) {
    using namespace creepkit;
    if (states < 0 || states > MAX_STATES) return nullptr;
    creepkit::states = states;
    return points;
}

CREEPKIT_PAGE_API double* creepkit_page_outputs() { return creepkit::outputs; }
