// Piecewise linear programs of time, their segments, times of output, and Young's modulus over temperature.
"use strict";

(function (creepkit) {
  /** A program: a number that is held, or pairs [time in s, value] joined by straight lines, two at one time a jump. */
  function program(given, what) {
    const pairs = typeof given === "number" ? [[0, given]] : given;
    if (!Array.isArray(pairs) || !pairs.length) throw new RangeError(`${what} must be a number or pairs [time, value]`);
    const times = pairs.map((pair) => Number(pair[0])), values = pairs.map((pair) => Number(pair[1]));
    if (!pairs.flat().every((one) => Number.isFinite(Number(one)))) throw new RangeError(`${what} must be finite numbers`);
    if (times[0] !== 0 || times.some((t, k) => t < times[k - 1])) {
      throw new RangeError(`the times of ${what} must start at 0 and never decrease`);
    }
    return { times, values };
  }

  /** Pairs of a program from steps [[start, value], ...]; ramp : s, in which each is reached from that before, or 0. */
  function steps(given, ramp = 0) {
    return given.flatMap(([start, value], k) => {
      const before = k > 0 ? given[k - 1][1] : ramp > 0 ? 0 : null;
      return [...(before === null ? [] : [[start, before]]), [start + ramp, value]];
    });
  }

  /** Value of a program at a time, or as the time is approached from before; the last one beyond the end. */
  function valueAt({ times, values }, time, before = false) {
    const found = times.findIndex((t) => (before ? t >= time : t > time)), next = found < 0 ? times.length : found;
    const k = Math.max(next - 1, 0), after = Math.min(next, times.length - 1), width = times[after] - times[k];
    return values[k] + (width > 0 ? Math.min((time - times[k]) / width, 1) : 0) * (values[after] - values[k]);
  }

  /** Programs merged into segments [start, end, values of the first at both, of the second at both, ...]. */
  function segments(programs, end) {
    const times = [...new Set([0, end, ...programs.flatMap((p) => p.times)])].filter((t) => t <= end);
    const marks = times.sort((a, b) => a - b);
    const ends = (k) => programs.flatMap((p) => [valueAt(p, marks[k]), valueAt(p, marks[k + 1], true)]);
    return marks.slice(1).map((stop, k) => [marks[k], stop, ...ends(k)]);
  }

  /** Output times as an array: finite, from 0 on, never falling. */
  function outputTimes(given) {
    const times = Array.from(given, Number);
    if (times.length === 0 || times.some((t, k) => !(t >= 0) || !Number.isFinite(t) || t < times[k - 1])) {
      throw new RangeError("output times must be finite, at or after 0 s, and must not decrease");
    }
    return times;
  }

  function temperatureOf(law, given) {
    if (given !== undefined && given !== null) return program(given, "the temperature");
    const needed = law.law.variables.includes("temperature");
    if (needed) throw new RangeError("the law depends on temperature: give one, in K");
    return program(creepkit.constants.room_temperature, "the temperature");
  }

  /** Young's modulus at a temperature: a number, or pairs [K, MPa] joined by straight lines, the last ones going on. */
  function modulusAt({ modulus }, temperature) {
    if (typeof modulus === "number") return modulus;
    if (modulus.length < 2 || temperature <= modulus[0][0]) return modulus[0][1];
    const above = modulus.findIndex((pair) => pair[0] >= temperature), k = above < 0 ? modulus.length - 1 : above;
    const [low, high] = [modulus[k - 1], modulus[k]];
    const share = above < 0 ? 1.0 : (temperature - low[0]) / (high[0] - low[0]);
    return low[1] + share * (high[1] - low[1]);
  }

  Object.assign(creepkit, { program, steps, valueAt, segments, outputTimes, temperatureOf, modulusAt });
})(globalThis.creepkit);
