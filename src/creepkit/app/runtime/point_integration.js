// Adaptive integration of one material point over a load program, step by step as the core's point_integration.hpp:
// SDIRK4 in the transformed time of each segment, so that t^-0.95 costs no more than a straight line, and an end where a
// limit is reached or the rate diverges.
"use strict";

(function (creepkit) {
  const { STAGES, A, C, ERROR, ERROR_ORDER, guessedSlope, DenseOutput } = creepkit.sdirk4;
  const { StageSolver, SegmentClock } = creepkit;
  const { STRAIN, TIME, TEMPERATURE, POINT } = creepkit.point;

  const SETTINGS = Object.freeze({
    rtol: 1e-5, smallest: 1e-7, strainLimit: 1.0, maxSteps: 2000, first: 0.02, longest: 0.2,
  });
  const SMALLEST_STEP = 1e-13, SMALLEST_FIRST_STEP = 1e-60, NEGLIGIBLE = 0.01;
  const NEGLIGIBLE_STAGE_ERROR = 1e-3, LOOSEST_STAGES = 1e-2, FIRST_SLOPE = 1e-6;
  const STEP_SAFETY = 0.9, LEAST_STEP_FACTOR = 0.1, MOST_STEP_FACTOR = 8.0, INITIAL_ERROR_FACTOR = 10.0;
  const ZERO_STRAIN = 1e-25, TERMINATION_MARGIN = 1e-7;

  const larger = (a, b) => (b > a ? b : a);
  const smaller = (a, b) => (b < a ? b : a);
  const worse = (a, b) => (Number.isNaN(a) || b <= a ? a : b);

  /** Factor on the step after an error; a step that follows a rejection does not grow. */
  function stepFactor(error, growing) {
    if (!Number.isFinite(error)) return LEAST_STEP_FACTOR;
    const factor = STEP_SAFETY * Math.pow(larger(error, 1e-12), -1.0 / (ERROR_ORDER + 1));
    const most = growing ? MOST_STEP_FACTOR : 1.0;
    return factor < LEAST_STEP_FACTOR ? LEAST_STEP_FACTOR : factor > most ? most : factor;
  }

  /** The first step from a virgin state, where the error falls about as the step itself. */
  class FirstStepControl {
    constructor() {
      this.length = this.error = 0.0;
    }

    factor(h, error) {
      if (!Number.isFinite(error)) return LEAST_STEP_FACTOR;
      let order = 1.0;
      if (this.length > 0.0) order = Math.log(this.error / error) / Math.log(this.length / h);
      order = order > 0.25 ? smaller(4.0, order) : 0.25;
      this.length = h;
      this.error = error;
      return larger(1e-4, STEP_SAFETY * Math.pow(error, -1.0 / order));
    }
  }

  /** Factor, at most one, on the step after one that had to be tried again (Gustafsson 1994). */
  function predictiveStepFactor(before, h, error) {
    if (!(before.length > 0.0)) return 1.0;
    const ratio = Math.pow(larger(before.error, 1e-12) / larger(error, 1e-12), 1.0 / (ERROR_ORDER + 1));
    const factor = (ratio * h) / before.length;
    return factor < LEAST_STEP_FACTOR ? LEAST_STEP_FACTOR : factor > 1.0 ? 1.0 : factor;
  }

  /** One integration. test : {segments, times, stiffness, load}; segments of [driving stress MPa, temperature K]. */
  class PointIntegration {
    constructor(law, test, settings = {}) {
      this.law = law;
      this.test = test;
      this.settings = { ...SETTINGS, ...settings };
      this.solver = new StageSolver(law);
      const size = 1 + law.states;
      this.size = size;
      this.value = new Float64Array(size);
      this.newValue = new Float64Array(size);
      this.slopes = new Float64Array(STAGES * size);
      this.pastSlopes = new Float64Array(STAGES * size);
      this.base = new Float64Array(law.states);
      this.strain = new Float64Array(test.times.length).fill(NaN);
      this.states = law.names.map(() => new Float64Array(test.times.length).fill(NaN));
      this.done = this.steps = this.rejected = 0;
      this.code = "complete";
      this.time = 0.0;
    }

    run() {
      const { law, test } = this;
      law.initial.forEach((z, k) => (this.value[1 + k] = z));
      for (; this.done < test.times.length && test.times[this.done] <= 0.0; this.done += 1) {
        this.strain[this.done] = 0.0;
        law.initial.forEach((z, k) => (this.states[k][this.done] = z));
      }
      for (const segment of test.segments) {
        if (this.code === "complete") this.through(segment);
      }
      return this;
    }

    lastSlope(v) {
      return this.slopes[(STAGES - 1) * this.size + v];
    }

    dense(h, v) {
      return new DenseOutput(this.value[v], h, this.slopes, this.size, v);
    }

    /** Integrate over one segment in its transformed time s, from 0 to 1. */
    through(segment) {
      const { settings, test } = this;
      this.open(segment);
      const clock = this.clock, outputs = this.done < test.times.length;
      const first = outputs ? smaller(1.0, clock.position(test.times[this.done])) : 1.0;
      let s = 0.0, h = smaller(settings.first, first);
      let slope = this.startRate > 0.0 ? this.startRate * clock.at(1e-12).pace : NaN;
      let growing = true, before = { length: 0.0, error: 1.0 }, near = -1;
      const fromVirgin = clock.tau === 0.0, firstStep = new FirstStepControl();
      const end = (code, place) => {
        this.code = code;
        this.time = place > 0.0 ? clock.at(place).time : segment.start;
      };
      while (s < 1.0) {
        const longest = smaller(h, settings.longest);
        h = s + 1.001 * longest > 1.0 ? 1.0 - s : longest;
        if (this.steps + this.rejected >= settings.maxSteps) return end("too_many_steps", s);
        if (!(h >= SMALLEST_STEP * s && h >= SMALLEST_FIRST_STEP)) {
          const diverged = slope * larger(s, 1e-6) > settings.strainLimit;
          return end(near > 0 ? "state_limit" : diverged ? "diverged" : "small_step", s);
        }
        const error = this.attempt(s, h, slope, first, before);
        if (!(error <= 1.0)) {
          h *= s === 0.0 && fromVirgin ? firstStep.factor(h, error) : stepFactor(error, false);
          growing = false;
          this.rejected += 1;
          continue;
        }
        this.steps += 1;
        let code = this.limitReached(), share = 1.0;
        if (code !== "complete") {
          share = this.limitCrossing(h);
        } else {
          clock.at(s + h);
          const pace = clock.time > 0.0 ? clock.pace / clock.time : Infinity;
          const ended = this.approachingLimit(pace, NEGLIGIBLE * settings.rtol);
          code = ended < 0 ? "complete" : ended > 0 ? "state_limit" : "diverged";
          near = this.approachingLimit(pace, TERMINATION_MARGIN);
        }
        this.fill(s, h, share);
        if (code !== "complete") return end(code, s + share * h);
        this.value.set(this.newValue);
        this.pastSlopes.set(this.slopes);
        slope = this.lastSlope(0);
        s = h === 1.0 - s ? 1.0 : s + h;
        let factor = stepFactor(error, growing);
        if (!growing) factor *= predictiveStepFactor(before, h, error);
        before = { length: h, error };
        h *= factor;
        growing = true;
      }
      this.time = segment.end;
    }

    /** The straight lines of a segment, its time transformation, and the rate at its start (0: not known). */
    open(segment) {
      const { law, test, solver, value } = this, length = segment.end - segment.start;
      const [stress, temperature] = segment.first, strain = value[0];
      this.segment = segment;
      this.stress = stress;
      this.temperature = temperature;
      this.stressRate = (segment.last[0] - stress) / length;
      this.temperatureRate = (segment.last[1] - temperature) / length;
      this.startRate = 0.0;
      if (strain < ZERO_STRAIN && law.beta < 1.0) {
        this.clock = SegmentClock.powerLaw(segment.start, length, law.beta);
        return;
      }
      this.clock = SegmentClock.linear(segment.start, length);
      const now = (stress - test.stiffness * strain) * Math.exp(test.load * strain);
      if (!(now > 0.0)) return;
      const { row, out } = solver;
      row[TIME] = segment.start;
      row[TEMPERATURE] = temperature;
      for (let v = 1; v < this.size; v += 1) row[POINT + v - 1] = value[v];
      solver.evaluate(now, strain);
      const rate = Math.exp(smaller(600.0, out[0]));
      if (Number.isNaN(out[0]) || !(rate > 0.0)) return;
      const { bend, bendRate } = this.curveBend(now, rate);
      this.clock = SegmentClock.shifted(segment.start, length, bend, bendRate);
      this.startRate = rate;
    }

    /** r in p'' = r p' and its rate, if ln f kept its logarithmic slopes to time, strain and stress. */
    curveBend(stress, rate) {
      const { solver, test, size } = this, { row, out } = solver;
      const byStress = solver.byStress(size), strain = row[STRAIN], time = row[TIME], aging = out[size + TIME];
      const hardening = strain > 0.0 ? rate * out[size + STRAIN] : 0.0;
      const thinning = rate * test.load * stress * byStress, relaxing = -rate * test.stiffness * byStress;
      let driven = byStress * this.stressRate * Math.exp(test.load * strain);
      driven += out[size + TEMPERATURE] * this.temperatureRate;
      for (let v = 1; v < size; v += 1) driven += out[size + POINT + v - 1] * out[v];
      const bend = aging + hardening + thinning + relaxing + driven;
      let bendRate = thinning * bend + relaxing * (bend + (test.stiffness * rate) / stress);
      if (time > 0.0) bendRate -= aging / time;
      if (strain > 0.0) bendRate += hardening * (bend - rate / strain);
      return { bend, bendRate };
    }

    /** Try a step; its error over what is allowed, infinite when a stage has no solution. */
    attempt(s, h, slope, first, before) {
      const { settings, test } = this;
      const small = test.stiffness > 0.0 ? 0.0 : this.value[0] + settings.smallest;
      const negligible = NEGLIGIBLE_STAGE_ERROR * smaller(LOOSEST_STAGES, settings.rtol) * small;
      const tolerance = smaller(Math.sqrt(1e-3 * settings.rtol), 1e-3);
      if (!this.advance(s, h, slope, before.length, tolerance, negligible)) return Infinity;
      const caution = s === 0.0 && this.clock.tau === 0.0 ? INITIAL_ERROR_FACTOR : 1.0;
      return caution * this.stepError(h, larger(1.0, first / (s + h)), slope);
    }

    /** Solve all stages from position s to s + h. */
    advance(s, h, slope, lastLength, tolerance, negligible) {
      const { solver, size, slopes, pastSlopes, value, newValue, test, clock, base } = this, { row } = solver;
      const length = lastLength / h;
      for (let i = 0; i < STAGES; i += 1) {
        const sum = (v) => {
          let total = 0.0;
          for (let j = 0; j < i; j += 1) total += A[i][j] * slopes[j * size + v];
          return value[v] + h * total;
        };
        const start = sum(0), strain = start > 0.0 ? start : 0.0, share = A[i][i] * h;
        clock.at(s + C[i] * h);
        const elapsed = clock.time - this.segment.start;
        const driving = this.stress + this.stressRate * elapsed - test.stiffness * strain;
        const trial = test.load !== 0.0 ? driving * Math.exp(test.load * strain) : driving;
        row[TIME] = clock.time;
        row[TEMPERATURE] = this.temperature + this.temperatureRate * elapsed;
        solver.setProblem(trial, test.stiffness, test.load, share * clock.pace, strain);
        let guess = guessedSlope(i, slope, slopes, pastSlopes, size, 0, length);
        if (!(guess > 0.0)) guess = i > 0 ? slopes[(i - 1) * size] : FIRST_SLOPE;
        for (let v = 1; v < size; v += 1) {
          base[v - 1] = sum(v);
          const known = lastLength > 0.0 ? pastSlopes[(STAGES - 1) * size + v] : NaN;
          const guessed = guessedSlope(i, known, slopes, pastSlopes, size, v, length);
          row[POINT + v - 1] = base[v - 1] + (Number.isFinite(guessed) ? share * guessed : 0.0);
        }
        if (!solver.solve(base, share * guess, tolerance, negligible)) return false;
        slopes[i * size] = solver.increment / share;
        newValue[0] = start + solver.increment;
        for (let v = 1; v < size; v += 1) {
          newValue[v] = row[POINT + v - 1];
          slopes[i * size + v] = (newValue[v] - base[v - 1]) / share;
        }
      }
      return true;
    }

    localError(h, v) {
      let total = 0.0;
      for (let i = 0; i < STAGES; i += 1) total += ERROR[i] * this.slopes[i * this.size + v];
      return Math.abs(h * total);
    }

    /** Largest local error of the step and of its dense output over what is allowed. */
    stepError(h, ahead, slope) {
      const { value, newValue, settings, test } = this;
      if (newValue[0] < value[0]) return Infinity;
      let reach = newValue[0] * ahead;
      if (test.stiffness > 0.0) {
        const stress = this.segment.last[0] - test.stiffness * newValue[0];
        reach = smaller(reach, Math.abs(stress) / test.stiffness);
      }
      let worst = this.localError(h, 0);
      if (!Number.isNaN(slope)) {
        const hermite = 0.5 * (value[0] + newValue[0] + 0.25 * h * (slope - this.lastSlope(0)));
        worst = worse(worst, Math.abs(this.dense(h, 0).at(0.5) - hermite));
      }
      worst /= settings.rtol * (reach + settings.smallest);
      for (let v = 1; v < this.size; v += 1) {
        const state = larger(Math.abs(value[v]), Math.abs(newValue[v])) + settings.smallest;
        worst = worse(worst, this.localError(h, v) / (settings.rtol * state));
      }
      return Number.isFinite(worst) ? worst : Infinity;
    }

    // ---- ends ----------------------------------------------------------------------------------------------------

    statePassed(k, value) {
      const { initial, limits } = this.law;
      if (!Number.isFinite(limits[k])) return false;
      return limits[k] > initial[k] ? value >= limits[k] : value <= limits[k];
    }

    limitReached() {
      for (let k = 0; k < this.law.states; k += 1) {
        if (this.statePassed(k, this.newValue[1 + k])) return "state_limit";
      }
      return this.newValue[0] >= this.settings.strainLimit ? "strain_limit" : "complete";
    }

    /** Which unknown, growing ever faster, will pass its limit within the share `margin` of the time; -1 is none. */
    approachingLimit(pace, margin) {
      for (let v = 0; v < this.size; v += 1) {
        const limit = v > 0 ? this.law.limits[v - 1] : this.settings.strainLimit, slope = this.lastSlope(v);
        const gap = limit - this.newValue[v];
        const faster = slope * gap > 0.0 && Math.abs(slope) > Math.abs(this.slopes[v]);
        if (Number.isFinite(limit) && faster && Math.abs(gap) * pace < margin * Math.abs(slope)) return v;
      }
      return -1;
    }

    /** Share of the step at which the first limit is passed. */
    limitCrossing(h) {
      const outputs = Array.from(this.value, (_, v) => this.dense(h, v));
      let low = 0.0, high = 1.0;
      for (let k = 0; k < 60; k += 1) {
        const middle = 0.5 * (low + high);
        const beyond = outputs.some((output, v) =>
          v === 0 ? output.at(middle) >= this.settings.strainLimit : this.statePassed(v - 1, output.at(middle)));
        if (beyond) high = middle;
        else low = middle;
      }
      return high;
    }

    /** Write the outputs that lie within the step, up to its `share`. */
    fill(s, h, share) {
      const { times } = this.test;
      if (this.done >= times.length) return;
      const outputs = Array.from(this.value, (_, v) => this.dense(h, v));
      for (; this.done < times.length; this.done += 1) {
        const x = (this.clock.position(times[this.done]) - s) / h;
        if (x > share * (1.0 + 1e-10)) break;
        const place = x < 0.0 ? 0.0 : x > 1.0 ? 1.0 : x;
        this.strain[this.done] = outputs[0].at(place);
        for (let v = 1; v < this.size; v += 1) this.states[v - 1][this.done] = outputs[v].at(place);
      }
    }
  }

  creepkit.PointIntegration = PointIntegration;
})(globalThis.creepkit);
