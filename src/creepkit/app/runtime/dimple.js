// The bulge test of a dimple by its reduced-order model: amplitude, width and shape over time, and the deformed section.
"use strict";

(function (creepkit) {
  const models = new WeakMap(); // models in the core's memory by their data and number of modes
  const BLOCK = 8, OFFSET = 20.0; // s; as in the core's time_interpolation.hpp

  /** A model in the core's memory, with its leading `modes`; it stays there. */
  function modelOf(data, modes) {
    if (!models.has(data)) models.set(data, {});
    return (models.get(data)[modes] ??= placedModel(data, modes));
  }

  function placedModel(data, modes) {
    const array = Object.fromEntries(Object.entries(data.arrays).map(([name, packed]) => [name, creepkit.decode(packed)]));
    const all = Math.ceil(data.modes / BLOCK) * BLOCK, width = Math.ceil(modes / BLOCK) * BLOCK;
    const leading = (name) => array[name].filter((_, k) => k % all < width);
    const surface = leading("surface"), measured = array.measures.length / data.modes;
    const counts = [modes, array.weights.length, array.sides.length / 4, array.top.length, data.limited, measured];
    const placed = [leading("gradients"), 5 * array.weights.length * modes, array.weights, array.sides, leading("side_modes"), surface,
      array.measures.slice(0, modes * measured)].map((values) => creepkit.placed(values));
    return { ...array, surface, counts, placed, width, modes, nodeModes: array.modes };
  }

  /** The accepted steps of a run as the core interpolates between them; see fem/time_interpolation.py. */
  function timelineOf(times, numbers, rows, beta) {
    const reached = rows.slice(0, numbers.at(-1) + 1), starts = reached.map(([start]) => start);
    const young = reached.map(([start, , pressure]) => (start === 0.0 ? pressure !== 0.0 : start <= OFFSET) && beta < 1.0);
    const ends = starts.flatMap((start, n) => {
      const jump = times.findLastIndex((time, i) => numbers[i] === n && time === start);
      return [jump < 0 ? numbers.indexOf(n) - 1 : jump, numbers.lastIndexOf(n)].map(BigInt);
    });
    const exponents = young.map((one) => (one ? Math.max(beta, creepkit.constants.body.smallest_exponent) : 1.0));
    const origins = starts.map((start, n) => (young[n] ? 0.0 : start));
    return (put) => [BigInt(times.length), BigInt(starts.length), put(times), put(starts), put(ends, BigInt64Array), put(origins), put(exponents)];
  }

  /** Simulate a bulge test; see app/__init__.py for options and result. */
  function simulateDimple(module, parameters, data, options) {
    const law = creepkit.bindLaw(module, parameters), times = creepkit.outputTimes(options.times), { elastic } = options;
    if (!elastic) throw new RangeError("a bulge test needs elastic data: elastic: {modulus: 150e3}, in MPa");
    const pressure = creepkit.program(options.pressure, "the pressure");
    const temperature = creepkit.temperatureOf(law, options.temperature);
    if (pressure.values.some((value) => !(value >= 0.0)) || !pressure.values.some((value) => value > 0.0)) {
      throw new RangeError("the pressure must not be negative, and a bulge test needs one above zero");
    }
    if (!(times.at(-1) > 0.0)) throw new RangeError("the last time is 0 s, where the load only begins; ask for a time after it");
    const { search } = creepkit.constants.body, modes = options.fast ? Math.min(search.modes, data.modes) : data.modes;
    const settings = { ...data.settings, ...(options.fast ? search.settings : {}) };
    if (options.maxSteps) settings.max_steps = options.maxSteps;
    const modulus = { times: temperature.times, values: temperature.values.map((T) => creepkit.modulusAt(elastic, T)) };
    const still = creepkit.program(0.0, "the motion");
    const rows = creepkit.segments([pressure, temperature, modulus, still], times.at(-1));
    const model = modelOf(data, modes), capacity = settings.max_steps + rows.length + 2;
    return creepkit.withLaw(law, (put, call) => {
      const stepTimes = put(capacity), numbers = put(capacity, BigInt64Array), steps = put(capacity * model.width), ended = put(5);
      const code = call("creepkit_page_simulate", put([...model.counts, law.states, rows.length, capacity], Int32Array), ...model.placed,
        put([law.leadingExponent, elastic.poisson ?? 0.3]), put([...law.initial, ...law.limits]), put(rows.flat()),
        put(Object.values(settings)), stepTimes, numbers, steps, put(2 * capacity), ended);
      if (code !== 0) throw new RangeError("no memory is left for this simulation");
      const reached = ended[0], coordinates = steps.slice(0, reached * model.width);
      const timeline = timelineOf(Array.from(stepTimes.slice(0, reached)), Array.from(numbers.slice(0, reached), Number), rows, law.leadingExponent);
      return { times, ...observed(model, data, timeline, coordinates, times), steps: ended[3] + ended[4], ...creepkit.ending("body", ended[1], ended[2]) };
    });
  }

  function observed(model, data, timeline, coordinates, times) {
    const { surface, width, top, places, nodeModes } = model, nodes = top.length, reached = coordinates.length / width;
    const dot = (a, i, b, j) => { let total = 0.0; for (let k = 0; k < model.modes; k += 1) total += a[i + k] * b[j + k]; return total; };
    const profile = (q, at) => Float64Array.from(top, (_, node) => dot(surface, node * width, q, at));
    const profiles = Array.from({ length: reached }, (_, k) => Array.from(profile(coordinates, k * width))).flat();
    const outputs = creepkit.inCore((put, call) => {
      const out = put(3 * times.length), counts = put([...data.grid, nodes].map(BigInt), BigInt64Array);
      call("creepkit_observe_at_times", counts, put(model.grid), put(model.sampling), data.window, ...timeline(put),
        put(profiles), 0n, 0, BigInt(times.length), put(times), out, 0);
      return out.slice();
    });
    const coordinatesAt = (time) => creepkit.inCore((put, call) => {
      const out = put(width);
      call("creepkit_interpolate_in_time", ...timeline(put), BigInt(width), put(coordinates), 1n, put([time]), out);
      return out.slice();
    });
    const moved = (q, place, n) => { let total = place; for (let i = 0; i < model.modes; i += 1) total += q[i] * nodeModes[i * places.length + n]; return total; };
    const column = (k) => outputs.filter((_, n) => n % 3 === k);
    return {
      outputs: { amplitude: column(0), width: column(1), shape: column(2) },
      radii: Float64Array.from(top, (node) => places[2 * node]),
      profileAt: (time) => profile(coordinatesAt(time), 0),
      placesAt: (time) => { const q = coordinatesAt(time); return Array.from(places, (place, n) => moved(q, place, n)); },
    };
  }

  creepkit.simulateDimple = simulateDimple;
})(globalThis.creepkit);
