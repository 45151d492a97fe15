// The transformed time s in [0, 1] of a segment of a load program, in which creep strain is nearly a straight line:
// s = ((1 + y/tau)^beta - 1) / ((1 + L/tau)^beta - 1), or (y/L)^beta from a virgin state (tau = 0). See the core's
// time_transformation.hpp.
"use strict";

(function (creepkit) {
  const SMALLEST_EXPONENT = 0.05, LARGEST_POWER = 12.0, LONGEST_SHIFT = 1e6, SHORTEST_SHIFT = 1e-30;

  /** A transformation with what is constant over its segment worked out. */
  class SegmentClock {
    constructor(start, length, beta, tau) {
      Object.assign(this, { start, length, beta, tau });
      this.linear = beta === 1.0;
      this.reach = tau === 0.0 ? 0.0 : Math.expm1(beta * Math.log1p(length / tau));
      this.time = this.pace = 0.0;
    }

    static linear(start, length) {
      return new SegmentClock(start, length, 1.0, length);
    }

    static powerLaw(start, length, beta) {
      return new SegmentClock(start, length, Math.min(Math.max(beta, SMALLEST_EXPONENT), 1.0), 0.0);
    }

    /** From r = bend in p'' = r p' and its rate. */
    static shifted(start, length, bend, bendRate) {
      if (!(Number.isFinite(bend) && Number.isFinite(bendRate)) || bend >= 0.0 || bendRate <= 0.0) {
        return SegmentClock.linear(start, length);
      }
      const tau = -bend / bendRate;
      if (!(SHORTEST_SHIFT * length < tau && tau < LONGEST_SHIFT * length)) return SegmentClock.linear(start, length);
      const bound = LARGEST_POWER / Math.log1p(length / tau), free = 1.0 + bend * tau;
      const beta = free < -bound ? -bound : free > bound ? bound : free;
      return new SegmentClock(start, length, Math.abs(beta) < 1e-3 ? 1e-3 : beta, tau);
    }

    /** Set `time`, s, and `pace`, dt/ds, at position s > 0. */
    at(s) {
      const { start, length, beta, tau, reach } = this;
      if (this.linear) {
        this.time = start + length * s;
        this.pace = length;
      } else if (tau === 0.0) {
        const elapsed = length * Math.exp(Math.log(s) / beta);
        this.time = start + elapsed;
        this.pace = elapsed / (beta * s);
      } else {
        const growth = s * reach, elapsed = tau * Math.expm1(Math.log1p(growth) / beta);
        this.time = start + elapsed;
        this.pace = ((tau + elapsed) * reach) / (beta * (1.0 + growth));
      }
      return this;
    }

    /** Position of a time. */
    position(time) {
      const elapsed = time - this.start;
      if (elapsed <= 0.0) return 0.0;
      if (this.linear) return elapsed / this.length;
      if (this.tau === 0.0) return Math.exp(this.beta * Math.log(elapsed / this.length));
      return Math.expm1(this.beta * Math.log1p(elapsed / this.tau)) / this.reach;
    }
  }

  Object.assign(creepkit, { SegmentClock, SMALLEST_EXPONENT });
})(globalThis.creepkit);
