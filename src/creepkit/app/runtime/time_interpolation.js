// Interpolation in time between the accepted steps of a simulation, as the core's time_interpolation.hpp: in each segment
// of the load a cubic spline with not-a-knot ends in ln(1 + (y / 20 s)^beta).
"use strict";

(function (creepkit) {
  const OFFSET = 20.0, SHORT_LAST_STEP = 0.2;

  /** Slopes (knots, columns) of the not-a-knot splines through values[knot][column] at places x. */
  function notAKnotSlopes(x, values, columns) {
    const knots = x.length, last = knots - 1, h = x.slice(1).map((place, i) => place - x[i]);
    const slopes = values.map(() => new Float64Array(columns)), pivot = new Float64Array(knots);
    const d = (i, c) => (values[i + 1][c] - values[i][c]) / h[i];
    for (let c = 0; c < columns; c += 1) {
      const s = (i) => slopes[i][c];
      const set = (i, value) => (slopes[i][c] = value);
      if (knots === 2) {
        set(0, d(0, c));
        set(1, d(0, c));
        continue;
      }
      if (knots === 3) {
        const bend = (d(1, c) - d(0, c)) / (x[2] - x[0]);
        set(0, d(0, c) - bend * h[0]);
        set(1, d(0, c) + bend * h[0]);
        set(2, d(1, c) + bend * h[1]);
        continue;
      }
      const first = x[2] - x[0], final = x[last] - x[last - 2];
      set(0, ((h[0] + 2.0 * first) * h[1] * d(0, c) + h[0] * h[0] * d(1, c)) / first);
      set(last, (h[last - 1] * h[last - 1] * d(last - 2, c) +
        (2.0 * final + h[last - 1]) * h[last - 2] * d(last - 1, c)) / final);
      for (let i = 1; i < last; i += 1) {
        const down = i > 1 ? h[i] / pivot[i - 1] : 1.0;
        const diagonal = i === 1 ? h[0] + h[1] : i === last - 1 ? h[i - 1] + h[i] : 2.0 * (h[i - 1] + h[i]);
        pivot[i] = i === 1 ? diagonal : diagonal - down * h[i - 2];
        let right = 3.0 * (h[i] * d(i - 1, c) + h[i - 1] * d(i, c));
        if (i === last - 1) right -= s(last);
        set(i, right - down * s(i - 1));
      }
      for (let i = last - 1; i > 0; i -= 1) {
        const above = i < last - 1 ? h[i - 1] * s(i + 1) : 0.0;
        set(i, (s(i) - above) / pivot[i]);
      }
      set(0, (s(0) - first * s(1)) / h[1]);
      set(last, (s(last) - final * s(last - 1)) / h[last - 2]);
    }
    return slopes;
  }

  /** The accepted steps of a run: {times, segments} of each step, the segments of its load, the law's beta. */
  class TimeInterpolation {
    constructor(times, segments, load, beta) {
      const reached = load.slice(0, segments[segments.length - 1] + 1);
      this.times = times;
      this.end = times[times.length - 1] * (1.0 + 1e-12);
      this.pieces = reached.map((segment, n) => {
        const mine = segments.map((m, i) => (m === n ? i : -1)).filter((i) => i >= 0);
        const atStart = mine.filter((i) => times[i] === segment.start);
        const first = atStart.length > 0 ? atStart[atStart.length - 1] : mine[0] - 1;
        const young = (segment.start === 0.0 ? segment.first[0] !== 0.0 : segment.start <= OFFSET) && beta < 1.0;
        return {
          start: segment.start, origin: young ? 0.0 : segment.start, first, last: mine[mine.length - 1],
          exponent: young ? Math.max(beta, creepkit.SMALLEST_EXPONENT) : 1.0,
        };
      });
    }

    place(piece, time) {
      const elapsed = Math.max(time - piece.origin, 0.0);
      if (piece.last - piece.first === 1) return elapsed; // a ramp: elastic, so straight
      const share = elapsed / OFFSET;
      return Math.log1p(piece.exponent === 1.0 ? share : Math.pow(share, piece.exponent));
    }

    /** The knots of a piece, without the last but one where a short last step, cut off by the end, follows it. */
    knots(piece, values, columns) {
      const rows = [];
      for (let i = piece.first; i <= piece.last; i += 1) rows.push(i);
      const x = rows.map((i) => this.place(piece, this.times[i])), count = x.length;
      if (count > 3 && !(x[count - 1] - x[count - 2] > SHORT_LAST_STEP * (x[count - 2] - x[count - 3]))) {
        x.splice(count - 2, 1);
        rows.splice(count - 2, 1);
      }
      const y = rows.map((i) => values[i]);
      return { x, y, slopes: x.length > 1 ? notAKnotSlopes(x, y, columns) : null };
    }

    /** Values (steps, columns) at other times, (times, columns); NaN after the last step. */
    interpolate(values, times) {
      const columns = values[0].length;
      let fitted = null, spline = null;
      return times.map((time) => {
        if (!(time <= this.end)) return new Float64Array(columns).fill(NaN);
        let n = 0;
        while (n + 1 < this.pieces.length && this.pieces[n + 1].start < time) n += 1;
        const piece = this.pieces[n];
        if (piece !== fitted) {
          spline = this.knots(piece, values, columns);
          fitted = piece;
        }
        return evaluate(spline, this.place(piece, time), columns);
      });
    }
  }

  function evaluate({ x, y, slopes }, place, columns) {
    if (slopes === null) return Float64Array.from(y[0]);
    let low = 0, high = x.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (place < x[middle]) high = middle;
      else low = middle;
    }
    const h = x[low + 1] - x[low], u = place - x[low];
    return Float64Array.from({ length: columns }, (_, c) => {
      const difference = (y[low + 1][c] - y[low][c]) / h, s = slopes[low][c];
      const third = (s + slopes[low + 1][c] - 2.0 * difference) / h;
      return y[low][c] + u * (s + u * ((difference - s) / h - third + u * (third / h)));
    });
  }

  creepkit.TimeInterpolation = TimeInterpolation;
})(globalThis.creepkit);
