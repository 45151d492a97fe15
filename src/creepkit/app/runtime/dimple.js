// The bulge test of a dimple by its reduced-order model: amplitude, width and shape over time, and the deformed section.
"use strict";

(function (creepkit) {
  const models = new WeakMap(); // unpacked models by their data and number of modes
  const SEARCH = { modes: 16, settings: { tolerance: 4e-2, newton: 4e-5, growth: 4.0 } };

  function unpacked(data, modes) {
    if (!models.has(data)) models.set(data, new Map());
    const known = models.get(data);
    if (!known.has(modes)) known.set(modes, creepkit.unpackModel(data, modes));
    return known.get(modes);
  }

  function modulusProgram(elastic, temperature) {
    return { times: temperature.times, values: temperature.values.map((T) => creepkit.modulusAt(elastic, T)) };
  }

  /** Simulate a bulge test; see app/__init__.py for options and result. */
  function simulateDimple(module, parameters, data, options) {
    const law = creepkit.bindLaw(module, parameters), times = creepkit.outputTimes(options.times);
    if (!options.elastic) throw new RangeError("a bulge test needs elastic data: elastic: {modulus: 150e3}, in MPa");
    const pressure = creepkit.program(options.pressure, "the pressure");
    const temperature = creepkit.temperatureOf(law, options.temperature);
    if (pressure.values.some((value) => !(value >= 0.0)) || !pressure.values.some((value) => value > 0.0)) {
      throw new RangeError("the pressure must not be negative, and a bulge test needs one above zero");
    }
    const end = times[times.length - 1];
    if (!(end > 0.0)) throw new RangeError("the last time is 0 s, where the load only begins; ask for a time after it");
    const loading = {
      segments: creepkit.segments([pressure, temperature, modulusProgram(options.elastic, temperature)], end),
      poisson: options.elastic.poisson === undefined ? 0.3 : options.elastic.poisson,
    };
    const model = unpacked(data, options.fast ? SEARCH.modes : data.modes);
    const settings = { ...data.settings, ...(options.fast ? SEARCH.settings : {}) };
    if (options.maxSteps) settings.maxSteps = options.maxSteps;
    const run = new creepkit.BodyIntegration(model, law, loading, settings).run();
    return results(run, model, times, law);
  }

  function results(run, model, times, law) {
    const { steps } = run;
    const profiles = steps.coordinates.map((q) => Float64Array.from(model.observed, (row) => dot(row, q)));
    const timeline = new creepkit.TimeInterpolation(steps.times, steps.segments, run.loading.segments, law.beta);
    const observed = timeline.interpolate(creepkit.observeProfiles(model.observation, profiles), times);
    const column = (k) => Float64Array.from(observed, (row) => row[k]);
    const radii = Float64Array.from(model.top, (node) => model.places[2 * node]);
    return {
      times,
      outputs: { amplitude: column(0), width: column(1), shape: column(2) },
      radii,
      edges: model.edges,
      profileAt: (time) => timeline.interpolate(profiles, [time])[0],
      placesAt: (time) => places(model, timeline.interpolate(steps.coordinates, [time])[0]),
      steps: run.accepted + run.rejected,
      ...creepkit.ending(run.code, run.time),
    };
  }

  function dot(row, q) {
    let total = 0.0;
    for (let i = 0; i < q.length; i += 1) total += row[i] * q[i];
    return total;
  }

  /** Places of all nodes in the deformed state, (nodes, 2) as pairs r, z in mm. */
  function places(model, q) {
    return Array.from({ length: model.nodeCount }, (_, node) => [0, 1].map((axis) =>
      model.places[2 * node + axis] + dot(model.displacement(node, axis), q)));
  }

  creepkit.simulateDimple = simulateDimple;
})(globalThis.creepkit);
