// The bulge test of a dimple by its reduced-order model: amplitude, width, shape over time, and the deformed section.
"use strict";

(function (creepkit) {
  const BLOCK = 8, OFFSET = 20.0; // s; as in the core's time_interpolation.hpp
  const models = new WeakMap(); // models in the core's memory by their data and number of modes

  /** A model in the core's memory, with its leading `modes`; it stays there. */
  function modelOf(data, modes) {
    if (!models.has(data)) models.set(data, {});
    return (models.get(data)[modes] ??= placedModel(data, modes));
  }

  function placedModel(data, modes) {
    const array = {};
    for (const [name, packed] of Object.entries(data.arrays)) array[name] = creepkit.decode(packed);
    const { weights, factors, sides, measures, top } = array, points = weights.length, measured = measures.length / data.modes;
    const all = Math.ceil(data.modes / BLOCK) * BLOCK, width = Math.ceil(modes / BLOCK) * BLOCK;
    const [gradients, sideModes, surface] = [array.gradients, array.side_modes, array.surface]
      .map((values) => values.filter((_, k) => k % all < width));
    const counts = [modes, points, sides.length / 4, top.length, data.limited, measured];
    const leading = measures.slice(0, modes * measured);
    const arrays = [gradients, 5 * points * modes, weights, factors, sides, sideModes, surface, leading];
    return { ...array, surface, counts, width, modeCount: modes,
      placed: arrays.map((values) => creepkit.placed(values)) };
  }

  /** The accepted steps of a run as the core interpolates between them; see fem/time_interpolation.py. */
  function timelineOf(times, numbers, rows, beta) {
    const reached = rows.slice(0, numbers.at(-1) + 1), starts = reached.map(([start]) => start);
    const young = reached.map(([start, , load]) => beta < 1.0 && (start === 0.0 ? load !== 0.0 : start <= OFFSET));
    const ends = starts.flatMap((start, n) => {
      const jump = times.findLastIndex((time, i) => numbers[i] === n && time === start);
      return [jump < 0 ? numbers.indexOf(n) - 1 : jump, numbers.lastIndexOf(n)].map(BigInt);
    });
    const origins = starts.map((start, n) => (young[n] ? 0.0 : start));
    const exponents = young.map((one) => (one ? Math.max(beta, creepkit.constants.body.smallest_exponent) : 1.0));
    return (put) => [BigInt(times.length), BigInt(starts.length), put(times), put(starts), put(ends, BigInt64Array),
      put(origins), put(exponents)];
  }

  /** Simulate a bulge test; see app/__init__.py for options and result. */
  function simulateDimple(module, parameters, data, options) {
    const law = creepkit.bindLaw(module, parameters), times = creepkit.outputTimes(options.times);
    const { elastic } = options;
    if (!elastic) throw new RangeError("a bulge test needs elastic data: elastic: {modulus: 150e3}, in MPa");
    const pressure = creepkit.program(options.pressure, "the pressure"), { search } = creepkit.constants.body;
    const temperature = creepkit.temperatureOf(law, options.temperature);
    if (pressure.values.some((value) => !(value >= 0.0)) || !pressure.values.some((value) => value > 0.0)) {
      throw new RangeError("the pressure must not be negative, and a bulge test needs one above zero");
    }
    if (!(times.at(-1) > 0.0)) {
      throw new RangeError("the last time is 0 s, where the load only begins; ask for a time after it");
    }
    const settings = { ...data.settings, ...(options.fast ? search.settings : {}) };
    if (options.maxSteps) settings.max_steps = options.maxSteps;
    const model = modelOf(data, options.fast ? Math.min(search.modes, data.modes) : data.modes);
    const modulus = { ...temperature, values: temperature.values.map((T) => creepkit.modulusAt(elastic, T)) };
    const motion = creepkit.program(0.0, "the motion"), programs = [pressure, temperature, modulus, motion];
    const rows = creepkit.segments(programs, times.at(-1)), beta = law.leadingExponent;
    return creepkit.withLaw(law, (put, call) => {
      const capacity = settings.max_steps + rows.length + 2, reached = put(capacity), places = put(2 * capacity);
      const numbers = put(capacity, BigInt64Array), steps = put(capacity * model.width), ended = put(5);
      const counts = put([...model.counts, law.states, rows.length, capacity], Int32Array);
      const failed = call("creepkit_page_simulate", counts, ...model.placed, put([beta, elastic.poisson ?? 0.3]),
        put([...law.initial, ...law.limits]), put(rows.flat()), put(Object.values(settings)), reached, numbers, steps,
        places, ended);
      if (failed) throw new RangeError("no memory is left for this simulation");
      const [count, code, time, accepted, rejected] = ended;
      const kept = [reached, numbers].map((values) => Array.from(values.subarray(0, count), Number));
      const coordinates = steps.slice(0, count * model.width), timeline = timelineOf(...kept, rows, beta);
      return { times, ...observed(model, data, times, timeline, coordinates), steps: accepted + rejected,
        ...creepkit.ending("body", code, time) };
    });
  }

  /** What is observed of a run at the times asked for, and where its nodes are at any time. */
  function observed(model, data, times, timeline, coordinates) {
    const { surface, width, top, places, modes } = model, nodes = top.length;
    const sum = (term) => {
      let total = 0.0;
      for (let i = 0; i < model.modeCount; i += 1) total += term(i);
      return total;
    };
    const profile = (at) => Array.from(top, (_, n) => sum((i) => surface[n * width + i] * coordinates[at + i]));
    const steps = Array.from({ length: coordinates.length / width }, (_, k) => profile(k * width));
    const outputs = creepkit.inCore((put, call) => {
      const out = put(3 * times.length), counts = put([...data.grid, nodes].map(BigInt), BigInt64Array);
      call("creepkit_observe_at_times", counts, put(model.grid), put(model.sampling), data.window, ...timeline(put),
        put(steps.flat()), 0n, 0, BigInt(times.length), put(times), out, 0);
      return out.slice();
    });
    const coordinatesAt = (time) => creepkit.inCore((put, call) => {
      const out = put(width), known = put(coordinates);
      call("creepkit_interpolate_in_time", ...timeline(put), BigInt(width), known, 1n, put([time]), out);
      return out.slice();
    });
    const column = (k) => outputs.filter((_, n) => n % 3 === k);
    return {
      outputs: { amplitude: column(0), width: column(1), shape: column(2) },
      contour: Array.from(model.contour),
      placesAt: (time) => {
        const q = coordinatesAt(time);
        return Array.from(places, (place, n) => place + sum((i) => q[i] * modes[i * places.length + n]));
      },
    };
  }

  creepkit.simulateDimple = simulateDimple;
})(globalThis.creepkit);
