// Bars: creep under programs of stress or load and of temperature, relaxation under programs of total strain, and the
// rate against stress. Units: MPa, s, K; strains are numbers.
"use strict";

(function (creepkit) {
  const STEPS_PER_BREAKPOINT = 20, STRESS_TOLERANCE = 1e-3;

  function integrate(law, driving, temperature, times, stiffness, load, options) {
    const end = Math.max(times[times.length - 1], options.until || 0.0);
    const breaks = driving.times.length + temperature.times.length - 2;
    const test = { segments: creepkit.segments([driving, temperature], end), times, stiffness, load };
    const settings = { maxSteps: (options.maxSteps || 2000) + STEPS_PER_BREAKPOINT * breaks };
    if (options.tolerance) settings.rtol = options.tolerance;
    if (options.strainLimit) settings.strainLimit = options.strainLimit;
    return new creepkit.PointIntegration(law, test, settings).run();
  }

  function temperatureOf(law, given) {
    if (given !== undefined && given !== null) return creepkit.program(given, "the temperature");
    if (law.law.variables.includes("temperature")) throw new RangeError("the law depends on temperature: give one, in K");
    return creepkit.program(creepkit.ROOM_TEMPERATURE, "the temperature");
  }

  /** Young's modulus at a temperature: a number, or pairs [K, MPa] joined by straight lines. */
  function modulusAt(elastic, temperature) {
    const { modulus } = elastic;
    if (typeof modulus === "number") return modulus;
    if (modulus.length < 2 || temperature <= modulus[0][0]) return modulus[0][1];
    const k = Math.min(Math.max(modulus.findIndex((pair) => pair[0] >= temperature), 1), modulus.length - 1);
    const [low, high] = [modulus[k - 1], modulus[k]];
    const share = modulus[modulus.length - 1][0] < temperature ? 1.0 : (temperature - low[0]) / (high[0] - low[0]);
    return low[1] + share * (high[1] - low[1]);
  }

  /** Rates of creep at the frames; NaN where the rate of virgin material has no limit, as at time zero. */
  function ratesAlong(law, times, temperature, stress, strain, states) {
    const point = new Float64Array(6 + law.states), out = new Float64Array(1 + law.states);
    return Float64Array.from(times, (time, k) => {
      if (Number.isNaN(strain[k]) || (strain[k] === 0.0 && law.beta < 1.0)) return NaN;
      point.set([stress[k], strain[k], time, creepkit.valueAt(temperature, time), stress[k], stress[k] / 3.0]);
      states.forEach((values, i) => (point[6 + i] = values[k]));
      law.rates(point, out);
      return out[0];
    });
  }

  /** What creep and relaxation have in common: creep strain, its rate, states, and how the integration ended. */
  function alongRun(law, times, temperature, stress, run) {
    return {
      creepStrain: run.strain,
      rate: ratesAlong(law, times, temperature, stress, run.strain, run.states),
      states: Object.fromEntries(law.names.map((name, k) => [name, run.states[k]])),
      steps: run.steps + run.rejected,
      ...creepkit.ending(run.code, run.time),
    };
  }

  /** Creep of a bar under a program of nominal stress; see app/__init__.py for options and result. */
  function simulateCreep(module, parameters, options) {
    const law = creepkit.bindLaw(module, parameters), times = creepkit.outputTimes(options.times);
    const driving = creepkit.program(options.stress, "the stress"), temperature = temperatureOf(law, options.temperature);
    if (driving.values.some((value) => !(value >= 0.0))) throw new RangeError("a stress must not be negative");
    const load = (options.control || "load") === "load" ? 1.0 : 0.0;
    const run = integrate(law, driving, temperature, times, 0.0, load, options);
    const stress = Float64Array.from(times, (t, k) => creepkit.valueAt(driving, t) * Math.exp(load * run.strain[k]));
    const elastic = Float64Array.from(times, (t) => options.elastic
      ? creepkit.valueAt(driving, t) / modulusAt(options.elastic, creepkit.valueAt(temperature, t)) : 0.0);
    const engineering = options.strainMeasure === "engineering";
    return {
      times,
      strain: run.strain.map((creep, k) => (engineering ? Math.expm1(creep) : creep) + elastic[k]),
      stress,
      ...alongRun(law, times, temperature, stress, run),
    };
  }

  /** Relaxation of a bar under a program of total strain; needs options.elastic. */
  function simulateRelaxation(module, parameters, options) {
    const law = creepkit.bindLaw(module, parameters), times = creepkit.outputTimes(options.times);
    const total = creepkit.program(options.strain, "the total strain"), temperature = temperatureOf(law, options.temperature);
    if (!options.elastic) throw new RangeError("a relaxation test needs elastic data: elastic: {modulus: 150e3}, in MPa");
    const moduli = temperature.values.map((value) => modulusAt(options.elastic, value)), modulus = moduli[0];
    if (Math.max(...moduli) - Math.min(...moduli) > 1e-12 * modulus) {
      throw new RangeError("the modulus changes with the temperature of the test; a relaxation test takes one modulus");
    }
    const engineering = options.strainMeasure === "engineering";
    const values = total.values.map((value) => modulus * (engineering ? Math.log1p(value) : value));
    const driving = { times: total.times, values }, highest = Math.max(...values);
    const run = integrate(law, driving, temperature, times, modulus, 0.0, options);
    const stress = Float64Array.from(times, (t, k) => {
      const now = creepkit.valueAt(driving, t) - modulus * run.strain[k];
      return now < -STRESS_TOLERANCE * highest ? NaN : now;
    });
    return {
      times,
      stress,
      ...alongRun(law, times, temperature, stress, run),
    };
  }

  /** Rates of creep, in all and of each term, against stress at one strain, time, temperature and state. */
  function rateCurve(module, parameters, options) {
    const law = creepkit.bindLaw(module, parameters), stresses = Float64Array.from(options.stresses);
    const temperature = temperatureOf(law, options.temperature).values[0];
    const given = law.law.states.map((s, k) => (options.states && s.name in options.states ? options.states[s.name] : law.initial[k]));
    const point = new Float64Array([0, options.strain || 0, options.time || 0, temperature, 0, 0, ...given]);
    const out = new Float64Array(1 + law.states), parts = new Float64Array(law.law.terms.length);
    const rate = new Float64Array(stresses.length);
    const terms = law.law.terms.map(() => new Float64Array(stresses.length));
    stresses.forEach((stress, k) => {
      point[0] = point[4] = stress;
      point[5] = stress / 3.0;
      law.rates(point, out);
      law.terms(point, parts);
      rate[k] = out[0];
      parts.forEach((part, i) => (terms[i][k] = part));
    });
    return { stresses, rate, terms: Object.fromEntries(law.law.terms.map((name, i) => [name, terms[i]])) };
  }

  Object.assign(creepkit, { simulateCreep, simulateRelaxation, rateCurve, modulusAt, temperatureOf });
})(globalThis.creepkit);
