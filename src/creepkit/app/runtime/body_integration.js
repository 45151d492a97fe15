// Time integration of a body over a load history, as the core's time_integration.hpp: SDIRK2 (Alexander 1977) with error
// control in a transformed time of each segment of [pressure MPa, temperature K, modulus MPa].
"use strict";

(function (creepkit) {
  const { SegmentClock, SMALLEST_EXPONENT, COMPONENTS, EQUIVALENT } = creepkit;
  const GAMMA = 1.0 - Math.sqrt(0.5), A10 = 1.0 - GAMMA, PLACES = [GAMMA, 1.0];
  const SMALLEST = 1e-9, LIMIT_WIDTH = 1e-3, MOST_OVERSHOOTS = 20, PASSES = 16, PATIENCE = 6;
  const LOOSE = 0.03, KEEP = 0.3;

  const SETTINGS = Object.freeze({
    tolerance: 1e-2, newton: 1e-5, first: 10.0, growth: 2.0, deflectionLimit: 3.0, strainLimit: 1.0, maxSteps: 1000,
    least: 0.01,
  });

  class BodyIntegration {
    constructor(model, law, loading, settings = {}) {
      this.law = law;
      this.loading = loading; // {segments, poisson}
      this.settings = { ...SETTINGS, ...settings };
      this.body = new creepkit.ReducedBody(model, law);
      this.points = this.body.points;
      const vector = () => new Float64Array(model.modes);
      this.q = vector();
      this.start = vector();
      this.before = vector();
      this.stages = [vector(), vector()];
      this.steps = { times: [], segments: [], coordinates: [], mises: [] };
      this.accepted = this.rejected = this.passes = 0;
      this.code = "complete";
      this.time = 0.0;
    }

    run() {
      let pressure = 0.0, modulus = 0.0;
      this.record(0.0, 0);
      this.loading.segments.every((segment, n) => {
        const stiffens = modulus !== 0.0 && segment.first[2] !== modulus;
        if (segment.first[0] !== pressure || stiffens) this.jump(segment, n, pressure);
        if (this.code === "complete") this.through(segment, n);
        pressure = segment.last[0];
        modulus = segment.last[2];
        return this.code === "complete";
      });
      return this;
    }

    end(code, time) {
      this.code = code;
      this.time = time;
    }

    record(time, segment) {
      this.steps.times.push(time);
      this.steps.segments.push(segment);
      this.steps.coordinates.push(this.q.slice());
      this.time = time;
    }

    /** What all points share at a time of a segment. */
    stageAt(segment, time, weight) {
      const share = (time - segment.start) / (segment.end - segment.start), { poisson } = this.loading;
      const between = (k) => segment.first[k] + share * (segment.last[k] - segment.first[k]);
      const modulus = between(2);
      return {
        weight, logWeight: weight > 0.0 ? Math.log(weight) : 0.0, time, temperature: between(1), pressure: between(0),
        bulk: modulus / (3.0 * (1.0 - 2.0 * poisson)), shear: modulus / (2.0 * (1.0 + poisson)),
      };
    }

    /** Bring q to equilibrium, corrections below `tolerance` in mm; what prevents it, or "". */
    solveEquilibrium(stage, tolerance, tight) {
      const { body, q } = this;
      let last = 0.0, size = 0.0;
      for (let pass = 0; pass < PASSES; pass += 1) {
        const stiff = pass === 0 || (pass > 1 && size > KEEP * last) || this.damped;
        const local = pass === 0 ? Math.max(tight, LOOSE) : tight;
        if (!body.assemble(stage, q, stiff, local)) return body.points.undefinedRate && pass < 2 ? "undefined" : "failed";
        this.passes += 1;
        if (stiff && !body.factorize()) return "failed";
        body.solve();
        last = size;
        size = body.largestCorrection();
        if (!Number.isFinite(size) || (pass > PATIENCE && size > last)) return "failed";
        const factor = size > 1.0 ? 1.0 / size : 1.0;
        this.damped = factor < 1.0;
        for (let i = 0; i < q.length; i += 1) q[i] -= factor * body.residual[i];
        if (size <= tolerance) return "";
      }
      return "failed";
    }

    /** The elastic change at a sudden change of load, in as many parts as it needs. */
    jump(segment, n, pressure) {
      const { q, start, body, points, settings } = this, stage = this.stageAt(segment, segment.start, 0.0);
      const target = stage.pressure;
      let done = 0.0, part = 1.0;
      start.set(q);
      points.base.set(points.value);
      for (let attempt = 0; attempt < 60; attempt += 1) {
        const now = Math.min(1.0, done + part);
        stage.pressure = pressure + now * (target - pressure);
        this.damped = false;
        const newton = settings.newton * (settings.least + body.largestDisplacement(q));
        if (this.solveEquilibrium(stage, newton, 1e-3) === "") {
          done = now;
          start.set(q);
          if (done < 1.0) continue;
          return this.record(segment.start, n);
        }
        q.set(start);
        part *= 0.25;
        if (part < 1e-5) break;
      }
      return this.end(Math.abs(target) > Math.abs(pressure) ? "limit_load" : "lost_convergence", segment.start);
    }

    transformation(segment) {
      const { beta } = this.law, { start } = segment, length = segment.end - start;
      if (beta >= 1.0 || (start === 0.0 && segment.first[0] === 0.0)) return SegmentClock.linear(start, length);
      if (start === 0.0) return SegmentClock.powerLaw(start, length, beta);
      return new SegmentClock(start, length, Math.max(beta, SMALLEST_EXPONENT), start);
    }

    /** Integrate over one segment in its transformed time s, from 0 to 1. */
    through(segment, n) {
      const { settings, body, q, start, before } = this, length = segment.end - segment.start;
      const clock = this.transformation(segment), begin = segment.start;
      let s = 0.0, elapsed = 0.0, h = clock.position(begin + Math.min(settings.first, length));
      let timeBefore = null, failures = 0, overshoots = 0;
      start.set(q);
      while (s < 1.0) {
        h = Math.min(h, clock.position(begin + Math.min(settings.growth * elapsed + settings.first, length)) - s);
        if (s + 1.0001 * h > 1.0) h = 1.0 - s;
        if (this.accepted + this.rejected >= settings.maxSteps) return this.end("too_many_steps", this.time);
        const { trouble, error } = this.attempt(segment, clock, s, h, failures === 0 ? timeBefore : null);
        if (trouble !== "" || !(error <= 1.0)) {
          q.set(start);
          this.rejected += 1;
          failures += 1;
          h *= trouble !== "" ? 0.25 : Math.max(0.2, 0.9 / Math.sqrt(error));
          if (failures > 12 || !(h >= SMALLEST * s)) {
            const rises = Math.abs(segment.last[0]) > Math.abs(segment.first[0]);
            return this.end(trouble === "undefined" ? "law_failed" : rises ? "limit_load" : "lost_convergence", this.time);
          }
          continue;
        }
        const risen = body.largestDisplacement(q), limit = settings.deflectionLimit;
        if (risen > limit * (1.0 + LIMIT_WIDTH) && overshoots < MOST_OVERSHOOTS) {
          const from = body.largestDisplacement(start);
          const share = (limit * (1.0 + 0.5 * LIMIT_WIDTH) - from) / (risen - from);
          q.set(start);
          this.rejected += 1;
          overshoots += 1;
          h *= Math.min(Math.max(share, 0.05), 0.95);
          continue;
        }
        failures = 0;
        this.accepted += 1;
        const worst = this.finishStep(h);
        timeBefore = begin + elapsed;
        before.set(start);
        s = h === 1.0 - s ? 1.0 : s + h;
        const time = s === 1.0 ? segment.end : clock.at(s).time;
        elapsed = time - begin;
        this.record(time, n);
        start.set(q);
        if (body.largestDisplacement(q) >= settings.deflectionLimit) return this.end("deflection_limit", time);
        if (worst >= settings.strainLimit) return this.end("strain_limit", time);
        if (this.stateHasFailed()) return this.end("state_limit", time);
        h *= Math.min(4.0, Math.max(0.3, 0.9 / Math.sqrt(Math.max(error, 1e-12))));
      }
    }

    /** Try one step from s; q ends where the last stage does. */
    attempt(segment, clock, s, h, timeBefore) {
      const { settings, body, points, q, start, stages } = this;
      const scale = settings.least + body.largestDisplacement(start), tight = Math.min(1e-3, Math.sqrt(settings.newton));
      const share = GAMMA * h;
      for (let i = 0; i < 2; i += 1) {
        clock.at(s + PLACES[i] * h);
        const stage = this.stageAt(segment, clock.time, share * clock.pace);
        points.base.set(points.value);
        if (i > 0) {
          for (let k = 0; k < points.base.length; k += 1) points.base[k] += h * A10 * points.slopes[0][k];
        }
        this.guessPoints(share, i);
        if (i > 0) {
          const ratio = PLACES[1] / PLACES[0];
          for (let k = 0; k < q.length; k += 1) q[k] = start[k] + ratio * (stages[0][k] - start[k]);
        } else if (timeBefore !== null) {
          const ratio = (PLACES[0] * h) / (s - clock.position(timeBefore));
          for (let k = 0; k < q.length; k += 1) q[k] = start[k] + ratio * (start[k] - this.before[k]);
        }
        this.damped = false;
        const trouble = this.solveEquilibrium(stage, settings.newton * scale, tight);
        if (trouble !== "") return { trouble, error: Infinity };
        this.setSlopes(share, i);
        stages[i].set(q);
      }
      body.errorForces(q, -h * GAMMA, h * GAMMA);
      body.solve();
      return { trouble: "", error: body.largestCorrection() / (settings.tolerance * scale) };
    }

    /** Guess increments and states of a stage from the stage, or the step, before. */
    guessPoints(share, i) {
      const { points } = this, { count } = points, slopes = points.slopes[i > 0 ? i - 1 : 1];
      for (let k = 0; k < count; k += 1) {
        const increment = slopes[EQUIVALENT * count + k] * share;
        points.increments[k] = increment > 0.0 ? increment : 1e-6;
        points.trials[k] = -1.0;
      }
      const first = (EQUIVALENT + 1) * count;
      for (let k = 0; k < points.state.length; k += 1) points.state[k] = points.base[first + k] + share * slopes[first + k];
    }

    setSlopes(share, i) {
      const { points } = this, { count } = points, slopes = points.slopes[i];
      for (let k = 0; k < count; k += 1) {
        const rate = points.increments[k] / share;
        for (let v = 0; v < COMPONENTS; v += 1) slopes[v * count + k] = rate * points.directions[v * count + k];
        slopes[EQUIVALENT * count + k] = rate;
      }
      const first = (EQUIVALENT + 1) * count;
      for (let k = 0; k < points.state.length; k += 1) slopes[first + k] = (points.state[k] - points.base[first + k]) / share;
    }

    /** Move the points to the end of the step; the largest equivalent creep strain. */
    finishStep(h) {
      const { points } = this, { count, value } = points, [one, two] = points.slopes;
      for (let k = 0; k < value.length; k += 1) value[k] += h * (A10 * one[k] + GAMMA * two[k]);
      let worst = 0.0;
      for (let k = 0; k < count; k += 1) worst = Math.max(worst, value[EQUIVALENT * count + k]);
      return worst;
    }

    stateHasFailed() {
      const { law, points } = this, { count, value } = points;
      return law.limits.some((limit, i) => {
        const states = value.subarray((EQUIVALENT + 1 + i) * count, (EQUIVALENT + 2 + i) * count);
        return states.some((z) => (limit > law.initial[i] ? z >= limit : z <= limit));
      });
    }
  }

  creepkit.BodyIntegration = BodyIntegration;
})(globalThis.creepkit);
