// Namespace of the runtime, piecewise linear programs of time, laws bound to values, packed arrays.
"use strict";

globalThis.creepkit = globalThis.creepkit || {};

(function (creepkit) {
  const ROOM_TEMPERATURE = 293.15; // K, where a law does not ask for a temperature

  /** How a simulation ended: `codes` in the order of the core, and in words. */
  const REASONS = Object.freeze({
    complete: "",
    strain_limit: "creep strain reached the strain limit",
    state_limit: "an internal variable reached its limit",
    diverged: "the creep rate diverged",
    small_step: "the time step became too small",
    too_many_steps: "the cap on steps was reached",
    deflection_limit: "the surface reached the deflection limit",
    limit_load: "no equilibrium with a larger load: limit load",
    lost_convergence: "equilibrium was lost while the load did not rise",
    law_failed: "the law gave no finite rate at a point",
  });

  const RUPTURES = new Set(["strain_limit", "state_limit", "diverged", "deflection_limit", "limit_load"]);

  /** What a result says of its end. */
  function ending(code, time) {
    const status = code === "complete" ? "complete" : RUPTURES.has(code) ? "ruptured" : "not converged";
    return { status, endTime: time, reason: REASONS[code], ruptureTime: status === "ruptured" ? time : null };
  }

  /** A program: a number that is held, or pairs [time in s, value] joined by straight lines, two at one time a jump. */
  function program(given, what) {
    const pairs = typeof given === "number" ? [[0, given]] : given;
    if (!Array.isArray(pairs) || pairs.length === 0) throw new RangeError(`${what} must be a number or pairs of time and value`);
    const times = pairs.map((pair) => Number(pair[0])), values = pairs.map((pair) => Number(pair[1]));
    if (![...times, ...values].every(Number.isFinite)) throw new RangeError(`${what} holds a number that is not finite`);
    if (times[0] !== 0 || times.some((t, k) => k > 0 && t < times[k - 1])) {
      throw new RangeError(`the times of ${what} must start at 0 and never decrease`);
    }
    return { times, values };
  }

  /** Pairs of a program from steps [[start, value], ...]; ramp : s, in which each is reached from the one before (or 0). */
  function steps(given, ramp = 0) {
    const pairs = [];
    given.forEach(([start, value], k) => {
      const before = k > 0 ? given[k - 1][1] : ramp > 0 ? 0 : null;
      if (before !== null) pairs.push([start, before]);
      pairs.push([start + ramp, value]);
    });
    return pairs;
  }

  /** Value of a program at a time: the later one at a jump, the last one beyond the end. */
  function valueAt(given, time) {
    const { times, values } = given;
    let low = 0, high = times.length; // the first time beyond
    while (low < high) {
      const middle = (low + high) >> 1;
      if (times[middle] <= time) low = middle + 1;
      else high = middle;
    }
    const k = Math.max(low - 1, 0), next = Math.min(k + 1, times.length - 1), width = times[next] - times[k];
    return values[k] + (width > 0 ? (time - times[k]) / width : 0) * (values[next] - values[k]);
  }

  /** Value of a program as a time is approached from below. */
  function valueBefore(given, time) {
    const { times, values } = given;
    let after = times.findIndex((t) => t >= time);
    if (after < 0) after = times.length;
    const before = Math.max(after - 1, 0);
    after = Math.min(after, times.length - 1);
    const width = times[after] - times[before];
    return values[before] + (width > 0 ? Math.min((time - times[before]) / width, 1) : 0) * (values[after] - values[before]);
  }

  /** Programs merged into segments [{start, end, first: [...], last: [...]}]: values of each at both ends. */
  function segments(programs, end) {
    const marks = [...new Set([0, end, ...programs.flatMap((p) => p.times)])].filter((t) => t <= end).sort((a, b) => a - b);
    return marks.slice(1).map((stop, k) => ({
      start: marks[k],
      end: stop,
      first: programs.map((p) => valueAt(p, marks[k])),
      last: programs.map((p) => valueBefore(p, stop)),
    }));
  }

  /** Output times as an array: finite, from 0 on, never falling. */
  function outputTimes(given) {
    const times = Array.from(given, Number);
    if (times.length === 0 || times.some((t, k) => !(t >= 0) || !Number.isFinite(t) || (k > 0 && t < times[k - 1]))) {
      throw new RangeError("output times must be finite, at or after 0 s, and must not decrease");
    }
    return times;
  }

  /** A law module with values of its parameters {name: value}; those not given are the module's own. */
  function bindLaw(module, parameters = {}) {
    const { law, kernel } = module;
    const known = law.parameters.map((p) => p.name);
    for (const name of Object.keys(parameters)) {
      if (!known.includes(name)) throw new RangeError(`the law has no parameter '${name}'; allowed are ${known.join(", ")}`);
    }
    const values = law.parameters.map((p) =>
      Object.prototype.hasOwnProperty.call(parameters, p.name) ? Number(parameters[p.name]) : p.value);
    const { rates, terms, update, leadingExponent } = kernel(values);
    return {
      law, values, rates, terms, update, beta: leadingExponent,
      names: law.states.map((s) => s.name),
      states: law.states.length,
      initial: law.states.map((s) => s.initial),
      limits: law.states.map((s) => (s.limit === null ? Infinity : s.limit)),
    };
  }

  /** Base64 of little-endian float32 or float64 as an array of numbers. */
  function decode(text, type) {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    if (type === "float64") return new Float64Array(bytes.buffer);
    if (type === "float32") return Float64Array.from(new Float32Array(bytes.buffer));
    return Array.from(new Int32Array(bytes.buffer));
  }

  Object.assign(creepkit, {
    ROOM_TEMPERATURE, ending, program, steps, valueAt, segments, outputTimes, bindLaw, decode,
  });
})(globalThis.creepkit);
