// SDIRK4: five stages, order 4 with embedded order 3, L-stable (Hairer and Wanner, Solving ODEs II, IV.6, (6.16-6.17)),
// its dense output of order 3, and guesses of the slope at a stage from those known before it.
"use strict";

(function (creepkit) {
  const STAGES = 5, DEGREE = 4, ERROR_ORDER = 3;
  const A = [
    [1 / 4, 0, 0, 0, 0],
    [1 / 2, 1 / 4, 0, 0, 0],
    [17 / 50, -1 / 25, 1 / 4, 0, 0],
    [371 / 1360, -137 / 2720, 15 / 544, 1 / 4, 0],
    [25 / 24, -49 / 48, 125 / 16, -85 / 12, 1 / 4],
  ];
  const C = A.map((row) => row.reduce((total, a) => total + a, 0));
  const EMBEDDED = [59 / 48, -17 / 96, 225 / 32, -85 / 12, 0.0];
  const ERROR = A[4].map((a, i) => a - EMBEDDED[i]);
  const DENSE = [
    [11 / 3, -463 / 72, 217 / 36, -20 / 9],
    [11 / 2, -385 / 16, 661 / 24, -10.0],
    [-125 / 18, 20125 / 432, -8875 / 216, 250 / 27],
    [0.0, -85 / 4, 85 / 6, 0.0],
    [-11 / 9, 557 / 108, -359 / 54, 80 / 27],
  ];

  /** The value at `place` of the parabola through three points. */
  function parabola(places, values, place) {
    const a = place - places[0], b = place - places[1], c = place - places[2];
    const ab = places[0] - places[1], bc = places[1] - places[2], ca = places[2] - places[0];
    return -(values[0] * b * c * bc + values[1] * c * a * ca + values[2] * a * b * ab) / (ab * bc * ca);
  }

  /** For stages from the third on: weights of the start and of the earlier stages, by the three nearest of them. */
  const WEIGHTS = C.map((place, i) => {
    if (i < 2) return null;
    const places = [0.0, ...C.slice(0, i)];
    const chosen = places.map((_, j) => j)
      .sort((j, k) => Math.abs(places[j] - place) - Math.abs(places[k] - place) || j - k).slice(0, 3);
    return places.map((_, j) => parabola(chosen.map((k) => places[k]), chosen.map((k) => (k === j ? 1.0 : 0.0)), place));
  });

  const ORDER = [0, 1, 2, 3].sort((i, k) => C[k] - C[i] || i - k);
  const LAST = ORDER[0], NEXT = ORDER[1]; // the two stages nearest to the end of a step, beside its last

  /** The guess at stage i of unknown v; slopes, before : (stages, size) of this step and of the one before, `length` times
   * as long (0: none); start : where the step begins, NaN where it is not known. */
  function guessedSlope(i, start, slopes, before, size, v, length) {
    const last = i > 0 ? slopes[(i - 1) * size + v] : start;
    if (Number.isNaN(start)) return last;
    if (i >= 2) {
      let total = WEIGHTS[i][0] * start;
      for (let j = 0; j < i; j += 1) total += WEIGHTS[i][1 + j] * slopes[j * size + v];
      return total;
    }
    if (!(length > 0.0)) return last;
    const past = (C[LAST] - 1.0) * length, then = before[LAST * size + v];
    if (i === 1) return parabola([C[0], 0.0, past], [slopes[v], start, then], C[1]);
    return parabola([0.0, past, (C[NEXT] - 1.0) * length], [start, then, before[NEXT * size + v]], C[0]);
  }

  /** Dense output of one unknown over a step: value + h sum_q coefficients_q x^(q+1) at the share x. */
  class DenseOutput {
    constructor(value, h, slopes, size, v) {
      this.value = value;
      this.h = h;
      this.coefficients = new Array(DEGREE).fill(0.0);
      for (let q = 0; q < DEGREE; q += 1) {
        for (let i = 0; i < STAGES; i += 1) this.coefficients[q] += DENSE[i][q] * slopes[i * size + v];
      }
    }

    at(x) {
      let total = 0.0;
      for (let q = DEGREE - 1; q >= 0; q -= 1) total = (total + this.coefficients[q]) * x;
      return this.value + this.h * total;
    }

    slope(x) {
      let total = 0.0;
      for (let q = DEGREE - 1; q >= 0; q -= 1) total = total * x + (q + 1) * this.coefficients[q];
      return total;
    }
  }

  creepkit.sdirk4 = { STAGES, A, C, ERROR, ERROR_ORDER, guessedSlope, DenseOutput };
})(globalThis.creepkit);
