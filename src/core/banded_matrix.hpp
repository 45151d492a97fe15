// Banded matrices in tiles of 8 x 8, and their factors: Cholesky for the tangent made symmetric, LU for the exact one.
//
// A tile of the lower half is stored by columns (a vector holds a column), one of the upper half by rows. Block column
// j has the tiles of the block rows j, j + 1 ... j + diagonals - 1; block row j of the upper half likewise. Rows beyond
// `size` are those of the unit matrix, and there are `diagonals` unused blocks behind, so that no loop needs to look
// for the end.
#pragma once

#include "lanes.hpp"

namespace creepkit {

constexpr int TILE = EIGHT * EIGHT;

struct BandShape {
    int64_t size, blocks, diagonals;

    // half_bandwidth : largest distance of a number from the diagonal.
    static BandShape of(int64_t size, int64_t half_bandwidth) {
        return {size, (size + EIGHT - 1) / EIGHT, (half_bandwidth + EIGHT - 1) / EIGHT + 1};
    }
    int64_t numbers() const { return (blocks + diagonals) * diagonals * TILE; }  // of a triangle
    int64_t rows() const { return (blocks + diagonals) * EIGHT; }                // of a right-hand side

    // Place of K[row, column], row >= column, in the lower triangle; of K[column, row] in the upper one.
    int64_t place(int64_t row, int64_t column) const {
        return ((column / EIGHT) * diagonals + row / EIGHT - column / EIGHT) * TILE + (column % EIGHT) * EIGHT +
               row % EIGHT;
    }
};

CREEPKIT_INLINE void set_unit_rows(const BandShape& shape, double* lower) {
    for (int64_t i = shape.size; i < shape.blocks * EIGHT; ++i) lower[shape.place(i, i)] = 1.0;
}

// Target -= left right, all tiles stored by columns, `right` being the transpose of a tile stored by columns.
CREEPKIT_INLINE void subtract_product(double* target, const double* left, const double* right) {
    Eight columns[EIGHT];
#pragma GCC unroll 8
    for (int q = 0; q < EIGHT; ++q) columns[q] = load(target + EIGHT * q);
#pragma GCC unroll 8
    for (int k = 0; k < EIGHT; ++k) {
        const Eight column = load(left + EIGHT * k);
#pragma GCC unroll 8
        for (int q = 0; q < EIGHT; ++q) columns[q] -= right[EIGHT * k + q] * column;
    }
#pragma GCC unroll 8
    for (int q = 0; q < EIGHT; ++q) store(target + EIGHT * q, columns[q]);
}

// Cholesky factor of the lower triangle in place, diagonals as reciprocals; false when not positive definite.
inline bool factorize_symmetric(const BandShape& shape, double* lower) {
    set_unit_rows(shape, lower);
    for (int64_t j = 0; j < shape.blocks; ++j) {
        double* diagonal = lower + j * shape.diagonals * TILE;
        double factor[EIGHT][EIGHT];  // factor[row][column]
        Eight columns[EIGHT];
#pragma GCC unroll 8
        for (int q = 0; q < EIGHT; ++q) columns[q] = load(diagonal + EIGHT * q);
#pragma GCC unroll 8
        for (int q = 0; q < EIGHT; ++q) {
            const double pivot = columns[q][q];
            if (!(pivot > 0.0)) return false;
            const double inverse = 1.0 / __builtin_sqrt(pivot);
            columns[q] = columns[q] * inverse;
            alignas(64) double column[EIGHT];
            store(column, columns[q]);
            for (int r = q; r < EIGHT; ++r) factor[r][q] = column[r];
            factor[q][q] = inverse;
#pragma GCC unroll 8
            for (int r = q + 1; r < EIGHT; ++r) columns[r] -= column[r] * columns[q];
        }
        for (int q = 0; q < EIGHT; ++q) {
            store(diagonal + EIGHT * q, columns[q]);
            diagonal[EIGHT * q + q] = factor[q][q];
        }
        const int64_t below = shape.blocks - 1 - j < shape.diagonals - 1 ? shape.blocks - 1 - j : shape.diagonals - 1;
        for (int64_t d = 1; d <= below; ++d) {
            double* tile = diagonal + TILE * d;
            Eight x[EIGHT];
#pragma GCC unroll 8
            for (int q = 0; q < EIGHT; ++q) x[q] = load(tile + EIGHT * q);
#pragma GCC unroll 8
            for (int q = 0; q < EIGHT; ++q) {
#pragma GCC unroll 8
                for (int k = 0; k < q; ++k) x[q] -= factor[q][k] * x[k];
                x[q] = x[q] * factor[q][q];
                store(tile + EIGHT * q, x[q]);
            }
        }
        for (int64_t c = 1; c <= below; ++c)
            for (int64_t d = c; d <= below; ++d)
                subtract_product(lower + ((j + c) * shape.diagonals + d - c) * TILE, diagonal + TILE * d,
                                 diagonal + TILE * c);
    }
    return true;
}

// Overwrite x, (rows(),), by the solution.
inline void solve_symmetric(const BandShape& shape, const double* lower, double* x) {
    for (int64_t i = shape.size; i < shape.rows(); ++i) x[i] = 0.0;
    for (int64_t j = 0; j < shape.blocks; ++j) {
        const double* diagonal = lower + j * shape.diagonals * TILE;
        double *part = x + EIGHT * j, z[EIGHT];
        Eight left = load(part);
#pragma GCC unroll 8
        for (int q = 0; q < EIGHT; ++q) {
            z[q] = left[q] * diagonal[EIGHT * q + q];
            left -= z[q] * load(diagonal + EIGHT * q);
        }
        memcpy(part, z, sizeof z);
        const int64_t below = shape.blocks - 1 - j < shape.diagonals - 1 ? shape.blocks - 1 - j : shape.diagonals - 1;
        for (int64_t d = 1; d <= below; ++d) {
            Eight under = load(part + EIGHT * d);
#pragma GCC unroll 8
            for (int q = 0; q < EIGHT; ++q) under -= z[q] * load(diagonal + TILE * d + EIGHT * q);
            store(part + EIGHT * d, under);
        }
    }
    for (int64_t j = shape.blocks - 1; j >= 0; --j) {
        const double* diagonal = lower + j * shape.diagonals * TILE;
        double *part = x + EIGHT * j, z[EIGHT];
        const int64_t below = shape.blocks - 1 - j < shape.diagonals - 1 ? shape.blocks - 1 - j : shape.diagonals - 1;
        Eight products[EIGHT];
        for (int q = 0; q < EIGHT; ++q) products[q] = Eight(0.0);
        for (int64_t d = 1; d <= below; ++d) {
            const Eight under = load(part + EIGHT * d);
#pragma GCC unroll 8
            for (int q = 0; q < EIGHT; ++q) products[q] += under * load(diagonal + TILE * d + EIGHT * q);
        }
        for (int q = 0; q < EIGHT; ++q) z[q] = part[q] - sum(products[q]);
        for (int q = EIGHT - 1; q >= 0; --q) {
            for (int k = q + 1; k < EIGHT; ++k) z[q] -= diagonal[EIGHT * q + k] * z[k];
            z[q] *= diagonal[EIGHT * q + q];
        }
        memcpy(part, z, sizeof z);
    }
}

// LU factors in place without pivoting, the diagonal of U as reciprocals; false when a pivot vanishes.
//
// lower : as above, its diagonal tiles whole. upper : tiles (j, j + d), d >= 1, by rows (those of d = 0 are not used).
inline bool factorize_general(const BandShape& shape, double* lower, double* upper) {
    set_unit_rows(shape, lower);
    for (int64_t j = 0; j < shape.blocks; ++j) {
        double *diagonal = lower + j * shape.diagonals * TILE, *right = upper + j * shape.diagonals * TILE;
        for (int q = 0; q < EIGHT; ++q) {  // diagonal[8 q + r] is K[r, q]
            const double pivot = diagonal[EIGHT * q + q];
            if (!(__builtin_fabs(pivot) > 0.0)) return false;
            const double inverse = 1.0 / pivot;
            diagonal[EIGHT * q + q] = inverse;
            for (int r = q + 1; r < EIGHT; ++r) diagonal[EIGHT * q + r] *= inverse;
            for (int c = q + 1; c < EIGHT; ++c)
                for (int r = q + 1; r < EIGHT; ++r)
                    diagonal[EIGHT * c + r] -= diagonal[EIGHT * q + r] * diagonal[EIGHT * c + q];
        }
        const int64_t below = shape.blocks - 1 - j < shape.diagonals - 1 ? shape.blocks - 1 - j : shape.diagonals - 1;
        for (int64_t d = 1; d <= below; ++d) {
            double *under = diagonal + TILE * d, *beside = right + TILE * d;
            Eight x[EIGHT], y[EIGHT];
#pragma GCC unroll 8
            for (int q = 0; q < EIGHT; ++q) {  // columns of the tile below, by U of the diagonal tile
                x[q] = load(under + EIGHT * q);
#pragma GCC unroll 8
                for (int k = 0; k < q; ++k) x[q] -= diagonal[EIGHT * q + k] * x[k];
                x[q] = x[q] * diagonal[EIGHT * q + q];
                store(under + EIGHT * q, x[q]);
            }
#pragma GCC unroll 8
            for (int q = 0; q < EIGHT; ++q) {  // rows of the tile beside, by L
                y[q] = load(beside + EIGHT * q);
#pragma GCC unroll 8
                for (int k = 0; k < q; ++k) y[q] -= diagonal[EIGHT * k + q] * y[k];
                store(beside + EIGHT * q, y[q]);
            }
        }
        for (int64_t c = 1; c <= below; ++c)
            for (int64_t d = 1; d <= below; ++d) {
                if (d >= c)  // a tile by columns: target[:, q] -= sum_k L[:, k] U[k, q]
                    subtract_product(lower + ((j + c) * shape.diagonals + d - c) * TILE, diagonal + TILE * d,
                                     right + TILE * c);
                else  // a tile by rows: target[q, :] -= sum_k L[q, k] U[k, :]
                    subtract_product(upper + ((j + d) * shape.diagonals + c - d) * TILE, right + TILE * c,
                                     diagonal + TILE * d);
            }
    }
    return true;
}

// Overwrite x, (rows(), columns), by the solutions; columns is a multiple of eight.
inline void solve_general(const BandShape& shape, const double* lower, const double* upper, double* x,
                          int64_t columns) {
    for (int64_t block = 0; block < columns; block += EIGHT) {
        double* first = x + block;
        for (int64_t j = 0; j < shape.blocks; ++j) {
            const double* diagonal = lower + j * shape.diagonals * TILE;
            double* part = first + EIGHT * j * columns;
            Eight z[EIGHT];
#pragma GCC unroll 8
            for (int q = 0; q < EIGHT; ++q) {
                z[q] = load(part + q * columns);
#pragma GCC unroll 8
                for (int k = 0; k < q; ++k) z[q] -= diagonal[EIGHT * k + q] * z[k];
                store(part + q * columns, z[q]);
            }
            const int64_t below =
                shape.blocks - 1 - j < shape.diagonals - 1 ? shape.blocks - 1 - j : shape.diagonals - 1;
            for (int64_t d = 1; d <= below; ++d) {
                const double* tile = diagonal + TILE * d;
                double* under = part + EIGHT * d * columns;
                for (int q = 0; q < EIGHT; ++q) {
                    Eight row = load(under + q * columns);
#pragma GCC unroll 8
                    for (int k = 0; k < EIGHT; ++k) row -= tile[EIGHT * k + q] * z[k];
                    store(under + q * columns, row);
                }
            }
        }
        for (int64_t j = shape.blocks - 1; j >= 0; --j) {
            const double *diagonal = lower + j * shape.diagonals * TILE, *right = upper + j * shape.diagonals * TILE;
            double* part = first + EIGHT * j * columns;
            const int64_t below =
                shape.blocks - 1 - j < shape.diagonals - 1 ? shape.blocks - 1 - j : shape.diagonals - 1;
            Eight z[EIGHT];
#pragma GCC unroll 8
            for (int q = 0; q < EIGHT; ++q) z[q] = load(part + q * columns);
            for (int64_t d = 1; d <= below; ++d) {
                const double* tile = right + TILE * d;
                const double* under = part + EIGHT * d * columns;
                for (int k = 0; k < EIGHT; ++k) {
                    const Eight row = load(under + k * columns);
#pragma GCC unroll 8
                    for (int q = 0; q < EIGHT; ++q) z[q] -= tile[EIGHT * q + k] * row;
                }
            }
#pragma GCC unroll 8
            for (int q = EIGHT - 1; q >= 0; --q) {
#pragma GCC unroll 8
                for (int k = EIGHT - 1; k > q; --k) z[q] -= diagonal[EIGHT * k + q] * z[k];
                z[q] = z[q] * diagonal[EIGHT * q + q];
                store(part + q * columns, z[q]);
            }
        }
    }
}

}  // namespace creepkit
