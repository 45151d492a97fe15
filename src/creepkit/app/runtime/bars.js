// Bars: creep under programs of stress or load and of temperature, relaxation under programs of total strain, and the
// rate against stress. Units: MPa, s, K; strains are numbers.
"use strict";

(function (creepkit) {
  const STRESS_TOLERANCE = 1e-3;

  function integrate(law, driving, temperature, times, controls, options) {
    const { settings, tableau } = creepkit.constants.bar, given = { ...settings };
    const names = { maxSteps: "max_steps", tolerance: "rtol", strainLimit: "strain_limit" };
    for (const [option, name] of Object.entries(names)) if (options[option]) given[name] = options[option];
    const rows = creepkit.segments([driving, temperature], times.at(-1));
    return creepkit.withLaw(law, (put, call) => {
      const strain = put(times.length).fill(NaN), values = put(times.length * law.states).fill(NaN), ended = put(4);
      const failed = call("creepkit_page_bar", law.states, law.leadingExponent, put([...law.initial, ...law.limits]),
        put(controls), rows.length, put(rows.flat()), times.length, put(times), put(Object.values(given)),
        put(tableau.sizes, Int32Array), put(tableau.numbers), strain, values, ended);
      if (failed) throw new RangeError("no memory is left for this simulation");
      const states = law.law.states.map(({ name }, i) => [name, values.filter((_, k) => k % law.states === i)]);
      return { strain: strain.slice(), states: Object.fromEntries(states), steps: ended[2] + ended[3],
        ...creepkit.ending("bar", ended[0], ended[1]) };
    });
  }

  /** Rates of creep at the frames; NaN where the rate of virgin material has no limit, as at time zero. */
  function ratesAlong(law, times, temperature, stress, { strain, states }) {
    const out = new Float64Array(1 + law.states);
    return Float64Array.from(times, (time, k) => {
      if (Number.isNaN(strain[k]) || (strain[k] === 0.0 && law.leadingExponent < 1.0)) return NaN;
      const ofStates = Object.values(states).map((values) => values[k]);
      const T = creepkit.valueAt(temperature, time);
      law.rates([stress[k], strain[k], time, T, stress[k], stress[k] / 3.0, ...ofStates], out);
      return out[0];
    });
  }

  /** Creep of a bar under a program of nominal stress; see app/__init__.py for options and result. */
  function simulateCreep(module, parameters, options) {
    const law = creepkit.bindLaw(module, parameters), times = creepkit.outputTimes(options.times);
    const driving = creepkit.program(options.stress, "the stress");
    const temperature = creepkit.temperatureOf(law, options.temperature);
    if (driving.values.some((value) => !(value >= 0.0))) throw new RangeError("a stress must not be negative");
    const load = (options.control || "load") === "load" ? 1.0 : 0.0;
    const run = integrate(law, driving, temperature, times, [0.0, load], options);
    const stress = Float64Array.from(times, (t, k) => creepkit.valueAt(driving, t) * Math.exp(load * run.strain[k]));
    const elastic = Float64Array.from(times, (t) => options.elastic
      ? creepkit.valueAt(driving, t) / creepkit.modulusAt(options.elastic, creepkit.valueAt(temperature, t)) : 0.0);
    const engineering = options.strainMeasure === "engineering";
    const strain = run.strain.map((creep, k) => (engineering ? Math.expm1(creep) : creep) + elastic[k]);
    const rate = ratesAlong(law, times, temperature, stress, run);
    return { ...run, times, strain, creepStrain: run.strain, stress, rate };
  }

  /** Relaxation of a bar under a program of total strain; needs options.elastic. */
  function simulateRelaxation(module, parameters, options) {
    const law = creepkit.bindLaw(module, parameters), times = creepkit.outputTimes(options.times);
    const total = creepkit.program(options.strain, "the total strain"), { elastic } = options;
    const temperature = creepkit.temperatureOf(law, options.temperature);
    if (!elastic) throw new RangeError("a relaxation test needs elastic data: elastic: {modulus: 150e3}, in MPa");
    const moduli = temperature.values.map((value) => creepkit.modulusAt(elastic, value)), modulus = moduli[0];
    if (Math.max(...moduli) - Math.min(...moduli) > 1e-12 * modulus) {
      throw new RangeError("the modulus changes with the temperature of the test; a relaxation test takes one modulus");
    }
    const engineering = options.strainMeasure === "engineering";
    const values = total.values.map((value) => modulus * (engineering ? Math.log1p(value) : value));
    const driving = { times: total.times, values }, least = -STRESS_TOLERANCE * Math.max(...values);
    const run = integrate(law, driving, temperature, times, [modulus, 0.0], options);
    const held = Float64Array.from(times, (t, k) => creepkit.valueAt(driving, t) - modulus * run.strain[k]);
    const stress = held.map((now) => (now < least ? NaN : now));
    return { ...run, times, stress, creepStrain: run.strain, rate: ratesAlong(law, times, temperature, stress, run) };
  }

  /** Rates of creep, in all and of each term, against stress at one strain, time, temperature and state. */
  function rateCurve(module, parameters, options) {
    const law = creepkit.bindLaw(module, parameters), names = law.law.terms;
    const stresses = Float64Array.from(options.stresses);
    const temperature = creepkit.temperatureOf(law, options.temperature).values[0];
    const states = law.law.states.map(({ name }, k) => options.states?.[name] ?? law.initial[k]);
    const out = new Float64Array(1 + law.states), parts = new Float64Array(names.length);
    const rows = Array.from(stresses, (stress) => {
      const point = [stress, options.strain || 0, options.time || 0, temperature, stress, stress / 3.0, ...states];
      law.rates(point, out);
      law.terms(point, parts);
      return [out[0], ...parts];
    });
    const column = (k) => Float64Array.from(rows, (row) => row[k]);
    return { stresses, rate: column(0), terms: Object.fromEntries(names.map((name, k) => [name, column(1 + k)])) };
  }

  Object.assign(creepkit, { simulateCreep, simulateRelaxation, rateCurve });
})(globalThis.creepkit);
