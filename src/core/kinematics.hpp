// Logarithmic strain of the points in a vector, its derivatives to the deformation gradient, and the tangent dP/dF.
//
// Axisymmetric: F has F11, F12, F21, F22 and F33 = 1 + u_r/r; C = F'F. With m, e the half sum and half difference of
// C11 and C22 and c = C12, Hencky's strain ln(C)/2 has the components
//     SUM = E11 + E22 = ln(F11 F22 - F12 F21),   HOOP = E33 = ln F33,
//     DIFFERENCE = E11 - E22 = b e,   SHEAR = 2 E12 = b c,   b = phi(y)/m,   y = (e^2 + c^2)/m^2,
// with phi(y) = artanh(sqrt y)/sqrt y, which is smooth at y = 0 where the principal stretches are equal.
// alpha = (C11/2, C22/2, C12, F33) is what strains are differentiated to: derivatives to it are second Piola-Kirchhoff
// stresses (and P33).
#pragma once

#include "vectors.hpp"

namespace creepkit {

enum StrainComponent { SUM, DIFFERENCE, HOOP, SHEAR };

struct Kinematics {
    Vector f11, f12, f21, f22, f33;  // deformation gradient
    Vector volume, inverse_volume;   // det F, and one over it
    Vector strain[4];
    Vector by_sum[3], by_difference[3], by_shear[3];  // derivatives of three strains to C11/2, C22/2, C12
    Vector by_hoop;                                   // of E33 to F33
    Vector m, e, c, det, b_m, b_q, b_mm, b_mq, b_qq;  // for second derivatives; b_q is to q = (e^2 + c^2)/2
};

// phi(y) with its first and second derivatives: its series below y = 0.05, where 14 terms leave out less than 1e-17
// (and 7 below 0.004), else its closed form.
template <int TERMS>
CREEPKIT_INLINE void phi_series(Vector y, Vector& value, Vector& first, Vector& second) {
    Vector a{}, b{}, d{};
#pragma GCC unroll 16
    for (int k = TERMS - 1; k > 1; --k) {
        const double coefficient = 1.0 / (2 * k + 1);
        a = a * y + coefficient;
        b = b * y + k * coefficient;
        d = d * y + k * (k - 1) * coefficient;
    }
    value = (a * y + 1.0 / 3.0) * y + 1.0;
    first = b * y + 1.0 / 3.0;
    second = d;
}

CREEPKIT_INLINE void phi_of(Vector y, Vector& value, Vector& first, Vector& second) {
    if (!any(y > splat(0.004))) return phi_series<7>(y, value, first, second);
    phi_series<14>(y, value, first, second);
    const Mask large = y > splat(0.05);
    if (!any(large)) return;
    const Vector z = larger(y, splat(0.04)), root = square_root(z);
    const Vector closed = 0.5 * logarithm((1.0 + root) / (1.0 - root)) / root, inverse = 1.0 / (1.0 - z);
    const Vector slope = 0.5 * (inverse - closed) / z;
    value = select(large, closed, value);
    first = select(large, slope, first);
    second = select(large, 0.5 * (inverse * inverse - 3.0 * slope) / z, second);
}

// Strains and their derivatives from f11 ... f33, which are set; false when a point is turned inside out.
CREEPKIT_INLINE bool set_strains(Kinematics& at) {
    const Vector c11 = at.f11 * at.f11 + at.f21 * at.f21, c22 = at.f12 * at.f12 + at.f22 * at.f22;
    const Vector c = at.f11 * at.f12 + at.f21 * at.f22, m = 0.5 * (c11 + c22), e = 0.5 * (c11 - c22);
    const Vector area = at.f11 * at.f22 - at.f12 * at.f21;
    if (any(~((area > Vector{}) & (at.f33 > Vector{})))) return false;
    const Vector both = area * at.f33, all = 1.0 / (both * m);  // one division for three numbers
    const Vector inverse = all * both, square = inverse * inverse, cube = square * inverse;
    at.volume = both;
    at.inverse_volume = all * m;
    at.by_hoop = at.inverse_volume * area;
    const Vector over_area = at.inverse_volume * at.f33, det = over_area * over_area;
    const Vector y = (e * e + c * c) * square;
    Vector phi, phi1, phi2;
    phi_of(y, phi, phi1, phi2);
    const Vector b = phi * inverse;
    // With q = (e^2 + c^2)/2: dy/dm = -2 y/m, dy/dq = 2/m^2.
    at.b_m = -(phi + 2.0 * y * phi1) * square;
    at.b_q = 2.0 * phi1 * cube;
    at.b_mm = (2.0 * phi + 10.0 * y * phi1 + 4.0 * y * y * phi2) * cube;
    at.b_mq = -(6.0 * phi1 + 4.0 * y * phi2) * cube * inverse;
    at.b_qq = 4.0 * phi2 * cube * square;
    const Vector a_m = m * det, a_e = -(e * det), a_c = -(c * det);
    const Vector d_m = at.b_m * e, d_e = b + at.b_q * e * e, d_c = at.b_q * c * e;
    const Vector x_m = at.b_m * c, x_e = d_c, x_c = b + at.b_q * c * c;
    at.strain[SUM] = logarithm(area);
    at.strain[DIFFERENCE] = b * e;
    at.strain[HOOP] = logarithm(at.f33);
    at.strain[SHEAR] = b * c;
    at.by_sum[0] = a_m + a_e;
    at.by_sum[1] = a_m - a_e;
    at.by_sum[2] = a_c;
    at.by_difference[0] = d_m + d_e;
    at.by_difference[1] = d_m - d_e;
    at.by_difference[2] = d_c;
    at.by_shear[0] = x_m + x_e;
    at.by_shear[1] = x_m - x_e;
    at.by_shear[2] = x_c;
    at.m = m;
    at.e = e;
    at.c = c;
    at.det = det;
    return true;
}

// Derivatives to alpha of what has the derivatives `weights` to the strains: for stresses S11, S22, S12 and P33.
CREEPKIT_INLINE void to_alpha(const Kinematics& at, const Vector weights[4], Vector result[4]) {
    for (int i = 0; i < 3; ++i)
        result[i] = weights[SUM] * at.by_sum[i] + weights[DIFFERENCE] * at.by_difference[i] +
                    weights[SHEAR] * at.by_shear[i];
    result[3] = weights[HOOP] * at.by_hoop;
}

// Derivatives to F of what has the derivatives `by_alpha`.
CREEPKIT_INLINE void to_gradient(const Kinematics& at, const Vector by_alpha[4], Vector result[5]) {
    result[0] = at.f11 * by_alpha[0] + at.f12 * by_alpha[2];
    result[1] = at.f12 * by_alpha[1] + at.f11 * by_alpha[2];
    result[2] = at.f21 * by_alpha[0] + at.f22 * by_alpha[2];
    result[3] = at.f22 * by_alpha[1] + at.f21 * by_alpha[2];
    result[4] = by_alpha[3];
}

// First Piola-Kirchhoff stress from the log-conjugate one.
CREEPKIT_INLINE void piola_stress(const Kinematics& at, const Vector stress[4], Vector P[5]) {
    Vector second[4];
    to_alpha(at, stress, second);
    to_gradient(at, second, P);
}

// A = dP/dF, (5, 5), times `weight`, from the moduli dT/dE, which need not be symmetric, and the log-conjugate stress T;
// written in rows of eight numbers, of which the points of the vector are the first.
CREEPKIT_INLINE void piola_tangent(const Kinematics& at, const Vector moduli[4][4], const Vector stress[4],
                                   Vector weight, double* tangent) {
    Vector rows[4][4];  // derivatives of the four stresses to alpha
    for (int i = 0; i < 4; ++i) to_alpha(at, moduli[i], rows[i]);
    // second derivatives of the strains, weighted by the stresses
    const Vector along = stress[SUM], x = stress[DIFFERENCE], y = stress[SHEAR], m = at.m, e = at.e, c = at.c;
    const Vector det = at.det, twice = 2.0 * along * det * det, work = x * e + y * c;
    const Vector mm = along * det - twice * m * m + at.b_mm * work;
    const Vector me = twice * m * e + at.b_mq * e * work + at.b_m * x;
    const Vector mc = twice * m * c + at.b_mq * c * work + at.b_m * y;
    const Vector ee = -(along * det) - twice * e * e + (at.b_qq * e * e + at.b_q) * work + 2.0 * at.b_q * e * x;
    const Vector cc = -(along * det) - twice * c * c + (at.b_qq * c * c + at.b_q) * work + 2.0 * at.b_q * c * y;
    const Vector ec = -(twice * e * c) + at.b_qq * e * c * work + at.b_q * (e * y + c * x);
    Vector by_alpha[4][4];
    for (int j = 0; j < 4; ++j) {
        for (int i = 0; i < 3; ++i)
            by_alpha[i][j] =
                at.by_sum[i] * rows[SUM][j] + at.by_difference[i] * rows[DIFFERENCE][j] + at.by_shear[i] * rows[SHEAR][j];
        by_alpha[3][j] = at.by_hoop * rows[HOOP][j];
    }
    by_alpha[0][0] += mm + 2.0 * me + ee;
    by_alpha[1][1] += mm - 2.0 * me + ee;
    by_alpha[0][1] += mm - ee;
    by_alpha[1][0] += mm - ee;
    by_alpha[0][2] += mc + ec;
    by_alpha[2][0] += mc + ec;
    by_alpha[1][2] += mc - ec;
    by_alpha[2][1] += mc - ec;
    by_alpha[2][2] += cc;
    by_alpha[3][3] -= stress[HOOP] * at.by_hoop * at.by_hoop;
    Vector columns[4][5], A[25];
    for (int i = 0; i < 4; ++i) to_gradient(at, by_alpha[i], columns[i]);
    for (int j = 0; j < 5; ++j) {
        A[j] = at.f11 * columns[0][j] + at.f12 * columns[2][j];
        A[5 + j] = at.f12 * columns[1][j] + at.f11 * columns[2][j];
        A[10 + j] = at.f21 * columns[0][j] + at.f22 * columns[2][j];
        A[15 + j] = at.f22 * columns[1][j] + at.f21 * columns[2][j];
        A[20 + j] = columns[3][j];
    }
    Vector second[4];
    to_alpha(at, stress, second);
    A[0] += second[0];
    A[12] += second[0];
    A[6] += second[1];
    A[18] += second[1];
    A[1] += second[2];
    A[5] += second[2];
    A[13] += second[2];
    A[17] += second[2];
    for (int i = 0; i < 25; ++i) store(tangent + EIGHT * i, A[i] * weight);
}

}  // namespace creepkit
