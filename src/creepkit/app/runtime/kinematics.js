// Logarithmic strain of a point of an axisymmetric body, its derivatives to the deformation gradient, and the tangent
// dP/dF; formulas and notation are those of the core's kinematics.hpp. F is (F11, F12, F21, F22, F33).
"use strict";

(function (creepkit) {
  const SUM = 0, DIFFERENCE = 1, HOOP = 2, SHEAR = 3;
  // places in the numbers of a point
  const VOLUME = 0, STRAIN = 1, BY_SUM = 5, BY_DIFFERENCE = 8, BY_SHEAR = 11, BY_HOOP = 14;
  const M = 15, E = 16, C = 17, B_M = 18, B_Q = 19, B_MM = 20, B_MQ = 21, B_QQ = 22, NUMBERS = 23;

  const phi = new Float64Array(3); // phi(y) = artanh(sqrt y)/sqrt y, and its two derivatives

  function setPhi(y) {
    if (y > 0.05) {
      const root = Math.sqrt(y), closed = (0.5 * Math.log((1.0 + root) / (1.0 - root))) / root, inverse = 1.0 / (1.0 - y);
      const slope = (0.5 * (inverse - closed)) / y;
      phi[0] = closed;
      phi[1] = slope;
      phi[2] = (0.5 * (inverse * inverse - 3.0 * slope)) / y;
      return;
    }
    let a = 0.0, b = 0.0, d = 0.0;
    for (let k = y > 0.004 ? 13 : 6; k > 1; k -= 1) {
      const coefficient = 1.0 / (2 * k + 1);
      a = a * y + coefficient;
      b = b * y + k * coefficient;
      d = d * y + k * (k - 1) * coefficient;
    }
    phi[0] = (a * y + 1.0 / 3.0) * y + 1.0;
    phi[1] = b * y + 1.0 / 3.0;
    phi[2] = d;
  }

  /** Strains and their derivatives into `at`; false where the point is turned inside out. */
  function setStrains(F, at) {
    const f11 = F[0], f12 = F[1], f21 = F[2], f22 = F[3], f33 = F[4];
    const c11 = f11 * f11 + f21 * f21, c22 = f12 * f12 + f22 * f22;
    const c = f11 * f12 + f21 * f22, m = 0.5 * (c11 + c22), e = 0.5 * (c11 - c22), area = f11 * f22 - f12 * f21;
    if (!(area > 0.0 && f33 > 0.0)) return false;
    const inverse = 1.0 / m, square = inverse * inverse, cube = square * inverse, y = (e * e + c * c) * square;
    setPhi(y);
    const p0 = phi[0], p1 = phi[1], p2 = phi[2], b = p0 * inverse;
    const bm = -(p0 + 2.0 * y * p1) * square, bq = 2.0 * p1 * cube;
    at[B_M] = bm;
    at[B_Q] = bq;
    at[B_MM] = (2.0 * p0 + 10.0 * y * p1 + 4.0 * y * y * p2) * cube;
    at[B_MQ] = -(6.0 * p1 + 4.0 * y * p2) * cube * inverse;
    at[B_QQ] = 4.0 * p2 * cube * square;
    const det = 1.0 / (area * area), am = m * det, ae = -(e * det), ac = -(c * det);
    const dm = bm * e, de = b + bq * e * e, dc = bq * c * e, xm = bm * c, xc = b + bq * c * c;
    at[VOLUME] = area * f33;
    at[STRAIN + SUM] = Math.log(area);
    at[STRAIN + DIFFERENCE] = b * e;
    at[STRAIN + HOOP] = Math.log(f33);
    at[STRAIN + SHEAR] = b * c;
    at[BY_SUM] = am + ae;
    at[BY_SUM + 1] = am - ae;
    at[BY_SUM + 2] = ac;
    at[BY_DIFFERENCE] = dm + de;
    at[BY_DIFFERENCE + 1] = dm - de;
    at[BY_DIFFERENCE + 2] = dc;
    at[BY_SHEAR] = xm + dc;
    at[BY_SHEAR + 1] = xm - dc;
    at[BY_SHEAR + 2] = xc;
    at[BY_HOOP] = 1.0 / f33;
    at[M] = m;
    at[E] = e;
    at[C] = c;
    return true;
  }

  const second = new Float64Array(4), rows = new Float64Array(16), byAlpha = new Float64Array(16), columns = new Float64Array(20);

  /** Derivatives to (C11/2, C22/2, C12, F33) of what has four derivatives, from `from` on, to the strains. */
  function toAlpha(at, weights, from, result, to) {
    const s = weights[from], d = weights[from + 1], x = weights[from + 3];
    for (let i = 0; i < 3; i += 1) {
      result[to + i] = s * at[BY_SUM + i] + d * at[BY_DIFFERENCE + i] + x * at[BY_SHEAR + i];
    }
    result[to + 3] = weights[from + 2] * at[BY_HOOP];
  }

  /** Derivatives to F of what has four derivatives, `step` apart from `from` on, to (C11/2, C22/2, C12, F33). */
  function toGradient(F, given, from, step, result, to) {
    const a = given[from], b = given[from + step], c = given[from + 2 * step];
    result[to] = F[0] * a + F[1] * c;
    result[to + 1] = F[1] * b + F[0] * c;
    result[to + 2] = F[2] * a + F[3] * c;
    result[to + 3] = F[3] * b + F[2] * c;
    result[to + 4] = given[from + 3 * step];
  }

  /** First Piola-Kirchhoff stress P (5,) from the log-conjugate one T (4,). */
  function piolaStress(F, at, T, P) {
    toAlpha(at, T, 0, second, 0);
    toGradient(F, second, 0, 1, P, 0);
  }

  /** A = dP/dF, (5, 5), from the moduli dT/dE (4, 4) and T. */
  function piolaTangent(F, at, moduli, T, A) {
    for (let i = 0; i < 4; i += 1) toAlpha(at, moduli, 4 * i, rows, 4 * i);
    const along = T[SUM], x = T[DIFFERENCE], y = T[SHEAR], m = at[M], e = at[E], c = at[C];
    const bm = at[B_M], bq = at[B_Q], bmq = at[B_MQ], bqq = at[B_QQ];
    const det = 1.0 / (m * m - e * e - c * c), twice = 2.0 * along * det * det, work = x * e + y * c;
    const mm = along * det - twice * m * m + at[B_MM] * work;
    const me = twice * m * e + bmq * e * work + bm * x;
    const mc = twice * m * c + bmq * c * work + bm * y;
    const ee = -(along * det) - twice * e * e + (bqq * e * e + bq) * work + 2.0 * bq * e * x;
    const cc = -(along * det) - twice * c * c + (bqq * c * c + bq) * work + 2.0 * bq * c * y;
    const ec = -(twice * e * c) + bqq * e * c * work + bq * (e * y + c * x);
    for (let j = 0; j < 4; j += 1) {
      for (let i = 0; i < 3; i += 1) {
        byAlpha[4 * i + j] = at[BY_SUM + i] * rows[j] + at[BY_DIFFERENCE + i] * rows[4 + j] + at[BY_SHEAR + i] * rows[12 + j];
      }
      byAlpha[12 + j] = at[BY_HOOP] * rows[8 + j];
    }
    byAlpha[0] += mm + 2.0 * me + ee;
    byAlpha[5] += mm - 2.0 * me + ee;
    byAlpha[1] += mm - ee;
    byAlpha[4] += mm - ee;
    byAlpha[2] += mc + ec;
    byAlpha[8] += mc + ec;
    byAlpha[6] += mc - ec;
    byAlpha[9] += mc - ec;
    byAlpha[10] += cc;
    byAlpha[15] -= T[HOOP] * at[BY_HOOP] * at[BY_HOOP];
    for (let i = 0; i < 4; i += 1) toGradient(F, byAlpha, 4 * i, 1, columns, 5 * i);
    for (let j = 0; j < 5; j += 1) {
      A[j] = F[0] * columns[j] + F[1] * columns[10 + j];
      A[5 + j] = F[1] * columns[5 + j] + F[0] * columns[10 + j];
      A[10 + j] = F[2] * columns[j] + F[3] * columns[10 + j];
      A[15 + j] = F[3] * columns[5 + j] + F[2] * columns[10 + j];
      A[20 + j] = columns[15 + j];
    }
    toAlpha(at, T, 0, second, 0);
    A[0] += second[0];
    A[12] += second[0];
    A[6] += second[1];
    A[18] += second[1];
    A[1] += second[2];
    A[5] += second[2];
    A[13] += second[2];
    A[17] += second[2];
  }

  creepkit.kinematics = { SUM, DIFFERENCE, HOOP, SHEAR, VOLUME, STRAIN, NUMBERS, setStrains, piolaStress, piolaTangent };
})(globalThis.creepkit);
