// Banded matrices in tiles of 8 x 8, and their factors: Cholesky for the tangent made symmetric, LU for the exact one.
//
// A tile of the lower half is stored by columns, one of the upper half by rows. Block column j has the tiles of the
// block rows j, j + 1 ... j + diagonals - 1; block row j of the upper half likewise. Rows beyond `size` are those of the
// unit matrix. Factors are made block column by block column, within the envelope (the tiles from the first that is not
// zero in their row on), each tile in registers while the products of all those before are taken off it.
#pragma once

#include "vectors.hpp"
#include "workspace.hpp"

namespace creepkit {

constexpr int TILE = EIGHT * EIGHT;

struct BandShape {
    int64_t size, blocks, diagonals;
    int64_t *first = nullptr, *last = nullptr;  // (blocks,) of the envelope: first tile of each row, last of each column

    // half_bandwidth : largest distance of a number from the diagonal.
    BandShape(int64_t size, int64_t half_bandwidth)
        : size(size), blocks((size + EIGHT - 1) / EIGHT), diagonals((half_bandwidth + EIGHT - 1) / EIGHT + 1) {}

    // Memory of the envelope, which has the whole band of a full matrix, else the diagonal alone at first.
    void take(Workspace& memory, bool full) {
        first = memory.array<int64_t>(blocks);
        last = memory.array<int64_t>(blocks);
        for (int64_t i = 0; first && i < blocks; ++i) first[i] = full ? 0 : i, last[i] = blocks - 1;
    }
    // Put K[row, column], row >= column, into the envelope.
    void include(int64_t row, int64_t column) {
        if (column / EIGHT < first[row / EIGHT]) first[row / EIGHT] = column / EIGHT;
    }
    // All is included. No row may begin before the one above, so that columns have no gaps.
    void close_envelope() {
        for (int64_t i = blocks - 1; i > 0; --i)
            if (first[i] < first[i - 1]) first[i - 1] = first[i];
        for (int64_t i = 0, j = 0; i < blocks; ++i)
            for (; j < blocks && (i + 1 == blocks || first[i + 1] > j); ++j) last[j] = i;
    }

    int64_t numbers() const { return (blocks + diagonals) * diagonals * TILE; }      // of a triangle
    int64_t rows() const { return (blocks + diagonals) * EIGHT; }                    // of a right-hand side
    int64_t tile(int64_t j, int64_t d) const { return (j * diagonals + d) * TILE; }  // place of tile (j + d, j)
    int64_t below(int64_t j) const { return last[j] - j; }                           // tiles under the diagonal one

    // Place of K[row, column], row >= column, in the lower triangle; of K[column, row] in the upper one.
    int64_t place(int64_t row, int64_t column) const {
        return tile(column / EIGHT, row / EIGHT - column / EIGHT) + (column % EIGHT) * EIGHT + row % EIGHT;
    }

    // Zeros in the envelope of a triangle, and at the place behind it.
    void clear(double* triangle) const {
        for (int64_t j = 0; j < blocks; ++j)
            memset(triangle + tile(j, 0), 0, sizeof(double) * size_t((below(j) + 1) * TILE));
        triangle[numbers()] = 0.0;
    }
};

CREEPKIT_INLINE void set_unit_rows(const BandShape& shape, double* lower) {
    for (int64_t i = shape.size; i < shape.blocks * EIGHT; ++i) lower[shape.place(i, i)] = 1.0;
}

// Target (8 x 8, by columns) += or -= the sum over k of left_k right_k^T, columns of eight numbers: `groups` times
// `count` of them, which lie `stride` apart, and the groups `step`.
//
// Of the target as much is summed at once as leaves room in 16 registers (32 of AVX-512): eight accumulators, so many
// that the processor need not wait for one addition before it begins the next into the same register.
template <bool SUBTRACT>
CREEPKIT_INLINE void add_products(double* target, const double* left, const double* right, int64_t stride,
                                  int64_t count, int64_t groups = 1, int64_t step = 0) {
    constexpr int DOWN = LANES == 8 ? 1 : 2, ACROSS = LANES == 8 ? 8 : 4;
    for (int row = 0; row < EIGHT; row += DOWN * LANES)
        for (int column = 0; column < EIGHT; column += ACROSS) {
            double* block = target + EIGHT * column + row;
            Vector sums[ACROSS][DOWN];
            CREEPKIT_UNROLL for (int q = 0; q < ACROSS; ++q)
                CREEPKIT_UNROLL for (int d = 0; d < DOWN; ++d) sums[q][d] = load(block + EIGHT * q + LANES * d);
            for (int64_t group = 0; group < groups; ++group) {
                const double *one = left + row + group * step, *other = right + column + group * step;
                CREEPKIT_UNROLL for (int64_t k = 0; k < count; ++k, one += stride, other += stride) {
                    Vector part[DOWN];
                    CREEPKIT_UNROLL for (int d = 0; d < DOWN; ++d) part[d] = load(one + LANES * d);
                    CREEPKIT_UNROLL for (int q = 0; q < ACROSS; ++q)
                        CREEPKIT_UNROLL for (int d = 0; d < DOWN; ++d)
                            sums[q][d] = SUBTRACT ? sums[q][d] - other[q] * part[d] : sums[q][d] + other[q] * part[d];
                }
            }
            CREEPKIT_UNROLL for (int q = 0; q < ACROSS; ++q)
                CREEPKIT_UNROLL for (int d = 0; d < DOWN; ++d) store(block + EIGHT * q + LANES * d, sums[q][d]);
        }
}

// Take off a tile of block column j, or of block row j of the upper triangle, what the block columns m before hold of the
// product of factors: left_m right_m^T for m = j - 1, j - 2 ..., `terms` of them; left and right : those of m = j - 1.
inline void subtract_products(const BandShape& shape, double* target, const double* left, const double* right,
                              int64_t terms) {
    if (terms > 0) add_products<true>(target, left, right, EIGHT, EIGHT, terms, -(shape.diagonals - 1) * TILE);
}

// Columns x of a tile, so many rows as a vector holds, from x U = tile for the upper triangle U of the diagonal tile:
// factor[8 k + q] is U[k, q] in its row k, or L[q, k] in a column of L = U^T; inverse[q] = 1 / U[q, q].
CREEPKIT_INLINE void solve_columns(double* tile, const double* factor, const double* inverse) {
    for (int v = 0; v < EIGHT; v += LANES) {
        Vector x[EIGHT];
        CREEPKIT_UNROLL for (int q = 0; q < EIGHT; ++q) {
            x[q] = load(tile + EIGHT * q + v);
            CREEPKIT_UNROLL for (int k = 0; k < q; ++k) x[q] -= factor[EIGHT * k + q] * x[k];
            if (inverse) x[q] = x[q] * inverse[q];
            store(tile + EIGHT * q + v, x[q]);
        }
    }
}

// Vector v of eight numbers, with zeros in place of all but the numbers `first` to `last`.
CREEPKIT_INLINE Vector part_of(Vector values, int v, int first, int last) {
    Mask wanted{};
    CREEPKIT_UNROLL for (int k = 0; k < LANES; ++k) wanted[k] = first <= v * LANES + k && v * LANES + k <= last ? -1 : 0;
    return select(wanted, values, Vector{});
}

// Inverse of the Cholesky factor L of a diagonal tile in its place, by Gauss and Jordan; false when the tile is not
// positive definite. It is written into both halves: tile[8 c + r] and tile[8 r + c] are L^-1 [r, c], r >= c.
//
// Square roots are taken last, so that the next column waits for a division alone.
CREEPKIT_INLINE bool invert_factor(double* tile) {
    Vector columns[EIGHT][VECTORS], inverses[EIGHT][VECTORS];
    alignas(64) double roots[EIGHT];
    bool positive = true;
    CREEPKIT_UNROLL for (int q = 0; q < EIGHT; ++q)
        CREEPKIT_UNROLL for (int v = q / LANES; v < VECTORS; ++v) columns[q][v] = load(tile + EIGHT * q + LANES * v);
    CREEPKIT_UNROLL for (int q = 0; q < EIGHT; ++q) {
        const double pivot = columns[q][q / LANES][q % LANES], reciprocal = 1.0 / pivot;
        positive = positive && pivot > 0.0;
        roots[q] = __builtin_sqrt(reciprocal);
        CREEPKIT_UNROLL for (int r = q + 1; r < EIGHT; ++r)
            CREEPKIT_UNROLL for (int v = r / LANES; v < VECTORS; ++v)
                columns[r][v] -= columns[q][r / LANES][r % LANES] * (reciprocal * columns[q][v]);
        CREEPKIT_UNROLL for (int v = q / LANES; v < VECTORS; ++v) {
            const Vector factor = part_of(reciprocal * columns[q][v], v, q + 1, EIGHT);
            CREEPKIT_UNROLL for (int c = 0; c < q; ++c) inverses[c][v] -= inverses[c][q / LANES][q % LANES] * factor;
            inverses[q][v] = -factor;
        }
        inverses[q][q / LANES][q % LANES] = 1.0;
    }
    CREEPKIT_UNROLL for (int c = 0; c < EIGHT; ++c) {
        CREEPKIT_UNROLL for (int v = c / LANES; v < VECTORS; ++v)
            store(tile + EIGHT * c + LANES * v, load(roots + LANES * v) * inverses[c][v]);
        CREEPKIT_UNROLL for (int r = 0; r < c; ++r) tile[EIGHT * c + r] = tile[EIGHT * r + c];
    }
    return positive;
}

// Tile times the transpose of the inverse that `invert_factor` wrote.
CREEPKIT_INLINE void multiply_by_inverse(double* tile, const double* inverse) {
    for (int v = 0; v < EIGHT; v += LANES) {
        Vector x[EIGHT];
        CREEPKIT_UNROLL for (int q = 0; q < EIGHT; ++q) x[q] = load(tile + EIGHT * q + v);
        CREEPKIT_UNROLL for (int q = 0; q < EIGHT; ++q) {
            Vector total = inverse[q] * x[0];
            CREEPKIT_UNROLL for (int k = 1; k <= q; ++k) total += inverse[EIGHT * k + q] * x[k];
            store(tile + EIGHT * q + v, total);
        }
    }
}

// LU factors of a diagonal tile in place, the diagonal of U as reciprocals and those in `inverse` too, without pivoting;
// false when a pivot vanishes.
CREEPKIT_INLINE bool factorize_general_tile(double* tile, double inverse[EIGHT]) {
    Vector columns[EIGHT][VECTORS];
    bool regular = true;
    CREEPKIT_UNROLL for (int q = 0; q < EIGHT; ++q)
        CREEPKIT_UNROLL for (int v = 0; v < VECTORS; ++v) columns[q][v] = load(tile + EIGHT * q + LANES * v);
    CREEPKIT_UNROLL for (int q = 0; q < EIGHT; ++q) {
        const double pivot = columns[q][q / LANES][q % LANES];
        regular = regular && __builtin_fabs(pivot) > 0.0;
        inverse[q] = 1.0 / pivot;
        Vector below[VECTORS];  // column q of L
        CREEPKIT_UNROLL for (int v = q / LANES; v < VECTORS; ++v) {
            below[v] = part_of(columns[q][v] * inverse[q], v, q + 1, EIGHT);
            columns[q][v] = part_of(columns[q][v], v, 0, q) + below[v];
        }
        CREEPKIT_UNROLL for (int c = q + 1; c < EIGHT; ++c)
            CREEPKIT_UNROLL for (int v = q / LANES; v < VECTORS; ++v)
                columns[c][v] -= columns[c][q / LANES][q % LANES] * below[v];
        CREEPKIT_UNROLL for (int v = 0; v < VECTORS; ++v) store(tile + EIGHT * q + LANES * v, columns[q][v]);
        tile[EIGHT * q + q] = inverse[q];
    }
    return regular;
}

// Cholesky factor of the lower triangle in place, with the inverses of its diagonal tiles; false when it is not positive
// definite.
inline bool factorize_symmetric(const BandShape& shape, double* lower) {
    set_unit_rows(shape, lower);
    for (int64_t j = 0; j < shape.blocks; ++j) {
        double* diagonal = lower + shape.tile(j, 0);
        const double* before = lower + shape.tile(j - 1, 1);
        subtract_products(shape, diagonal, before, before, j - shape.first[j]);
        if (!invert_factor(diagonal)) return false;
        const int64_t below = shape.below(j);
        for (int64_t d = 1; d <= below; ++d) {
            subtract_products(shape, diagonal + TILE * d, before + TILE * d, before, j - shape.first[j + d]);
            multiply_by_inverse(diagonal + TILE * d, diagonal);
        }
    }
    return true;
}

// Overwrite x, (rows(),), by the solution.
inline void solve_symmetric(const BandShape& shape, const double* lower, double* x) {
    for (int64_t i = shape.size; i < shape.blocks * EIGHT; ++i) x[i] = 0.0;
    for (int64_t j = 0; j < shape.blocks; ++j) {
        const double* diagonal = lower + shape.tile(j, 0);
        double *part = x + EIGHT * j, z[EIGHT];
        Vector sums[2][VECTORS] = {};  // two: one would wait for each addition
        CREEPKIT_UNROLL for (int c = 0; c < EIGHT; ++c)
            CREEPKIT_UNROLL for (int v = c / LANES; v < VECTORS; ++v)
                sums[c % 2][v] += part[c] * part_of(load(diagonal + EIGHT * c + LANES * v), v, c, EIGHT);
        CREEPKIT_UNROLL for (int v = 0; v < VECTORS; ++v) store(z + LANES * v, sums[0][v] + sums[1][v]);
        memcpy(part, z, sizeof z);
        const int64_t below = shape.below(j);
        for (int64_t d = 1; d <= below; ++d)
            CREEPKIT_UNROLL for (int v = 0; v < EIGHT; v += LANES) {
                const double* column = diagonal + TILE * d + v;
                Vector even = load(part + EIGHT * d + v), odd{};
                CREEPKIT_UNROLL for (int q = 0; q < EIGHT; q += 2) {
                    even -= z[q] * load(column + EIGHT * q);
                    odd -= z[q + 1] * load(column + EIGHT * (q + 1));
                }
                store(part + EIGHT * d + v, even + odd);
            }
    }
    for (int64_t j = shape.blocks - 1; j >= 0; --j) {
        const double* diagonal = lower + shape.tile(j, 0);
        double* part = x + EIGHT * j;
        Vector products[EIGHT] = {}, sums[2][VECTORS] = {};
        const int64_t below = shape.below(j);
        for (int64_t d = 1; d <= below; ++d)
            CREEPKIT_UNROLL for (int v = 0; v < EIGHT; v += LANES) {
                const Vector under = load(part + EIGHT * d + v);
                CREEPKIT_UNROLL for (int q = 0; q < EIGHT; ++q)
                    products[q] += under * load(diagonal + TILE * d + EIGHT * q + v);
            }
        CREEPKIT_UNROLL for (int r = 0; r < EIGHT; ++r) {
            const double right = part[r] - sum(products[r]);
            CREEPKIT_UNROLL for (int v = 0; v <= r / LANES; ++v)
                sums[r % 2][v] += right * part_of(load(diagonal + EIGHT * r + LANES * v), v, 0, r);
        }
        CREEPKIT_UNROLL for (int v = 0; v < VECTORS; ++v) store(part + LANES * v, sums[0][v] + sums[1][v]);
    }
}

// LU factors in place without pivoting, the diagonal of U as reciprocals; false when a pivot vanishes.
//
// lower : as above, its diagonal tiles whole. upper : tiles (j, j + d), d >= 1, by rows (those of d = 0 are not used).
inline bool factorize_general(const BandShape& shape, double* lower, double* upper) {
    set_unit_rows(shape, lower);
    for (int64_t j = 0; j < shape.blocks; ++j) {
        double *diagonal = lower + shape.tile(j, 0), *right = upper + shape.tile(j, 0);
        const double *lower_before = lower + shape.tile(j - 1, 1), *upper_before = upper + shape.tile(j - 1, 1);
        subtract_products(shape, diagonal, lower_before, upper_before, j - shape.first[j]);  // L[j, m] U[m, j]
        double inverse[EIGHT], transposed[TILE];
        if (!factorize_general_tile(diagonal, inverse)) return false;
        for (int q = 0; q < EIGHT; ++q)
            for (int r = 0; r < EIGHT; ++r) transposed[EIGHT * r + q] = diagonal[EIGHT * q + r];
        const int64_t below = shape.below(j);
        for (int64_t d = 1; d <= below; ++d) {
            double *under = diagonal + TILE * d, *beside = right + TILE * d;
            const int64_t terms = j - shape.first[j + d];
            subtract_products(shape, under, lower_before + TILE * d, upper_before, terms);
            subtract_products(shape, beside, upper_before + TILE * d, lower_before, terms);
            solve_columns(under, transposed, inverse);  // columns of the tile below, by U of the diagonal tile
            solve_columns(beside, diagonal, nullptr);   // rows of the tile beside, by L
        }
    }
    return true;
}

// Overwrite x, (rows(), columns), by the solutions; columns fill whole vectors.
inline void solve_general(const BandShape& shape, const double* lower, const double* upper, double* x,
                          int64_t columns) {
    for (int64_t first = 0; first < columns; first += LANES) {
        for (int64_t j = 0; j < shape.blocks; ++j) {
            const double* diagonal = lower + shape.tile(j, 0);
            double* part = x + first + EIGHT * j * columns;
            Vector z[EIGHT];
            CREEPKIT_UNROLL for (int q = 0; q < EIGHT; ++q) {
                z[q] = load(part + q * columns);
                CREEPKIT_UNROLL for (int k = 0; k < q; ++k) z[q] -= diagonal[EIGHT * k + q] * z[k];
                store(part + q * columns, z[q]);
            }
            const int64_t below = shape.below(j);
            for (int64_t d = 1; d <= below; ++d) {
                const double* tile = diagonal + TILE * d;
                double* under = part + EIGHT * d * columns;
                for (int q = 0; q < EIGHT; ++q) {
                    Vector row = load(under + q * columns);
                    CREEPKIT_UNROLL for (int k = 0; k < EIGHT; ++k) row -= tile[EIGHT * k + q] * z[k];
                    store(under + q * columns, row);
                }
            }
        }
        for (int64_t j = shape.blocks - 1; j >= 0; --j) {
            const double *diagonal = lower + shape.tile(j, 0), *right = upper + shape.tile(j, 0);
            double* part = x + first + EIGHT * j * columns;
            Vector z[EIGHT];
            CREEPKIT_UNROLL for (int q = 0; q < EIGHT; ++q) z[q] = load(part + q * columns);
            const int64_t below = shape.below(j);
            for (int64_t d = 1; d <= below; ++d) {
                const double *tile = right + TILE * d, *under = part + EIGHT * d * columns;
                for (int k = 0; k < EIGHT; ++k) {
                    const Vector row = load(under + k * columns);
                    CREEPKIT_UNROLL for (int q = 0; q < EIGHT; ++q) z[q] -= tile[EIGHT * q + k] * row;
                }
            }
            CREEPKIT_UNROLL for (int q = EIGHT - 1; q >= 0; --q) {
                CREEPKIT_UNROLL for (int k = EIGHT - 1; k > q; --k) z[q] -= diagonal[EIGHT * k + q] * z[k];
                z[q] = z[q] * diagonal[EIGHT * q + q];
                store(part + q * columns, z[q]);
            }
        }
    }
}

}  // namespace creepkit
