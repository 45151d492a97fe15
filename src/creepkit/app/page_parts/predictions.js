"use strict";
// Predictions by the runtime: of the planned test, of measured tests, of rates over stress.
(function (page) {
  const FRAMES = 120, RATE_STRESSES = 60, SECTION_TIMES = 8, ONE_TEMPERATURE = 2;
  const plain = (values) => Array.from(values, (v) => (Number.isFinite(v) ? v : null));
  
  page.predicts = ({ runtime, model }) => runtime !== "dimple" || model !== null;

  // Half of the frames spread over time and half over its logarithm, and the beginnings of steps.
  function plannedTimes({ end, steps }) {
    const half = FRAMES / 2, times = new Set();
    for (let k = 0; k < half; k++) times.add(end * 1e-4 ** (1 - k / (half - 1))).add((end * (k + 1)) / half);
    for (const [start] of steps) if (start > 0 && start < end) times.add(start).add(start + 1e-6 * end);
    return [...times].filter((t) => t > 0 && t <= end).sort((a, b) => a - b);
  }

  // {outputs: {name: values at the frames}, and how the run ended} of a test by a function of the runtime
  const KINDS = {
    creep: (law, values, test) => {
      const run = creepkit.simulateCreep(law, values, { ...test, stress: test.load });
      return { ...run, outputs: { [test.output]: run.strain } };
    },
    relaxation: (law, values, test) => {
      const run = creepkit.simulateRelaxation(law, values, { ...test, strain: test.load });
      return { ...run, outputs: { [test.output]: run.stress } };
    },
    dimple: (law, values, test) => creepkit.simulateDimple(law, values, globalThis.creepkitModels[test.model], { ...test, pressure: test.load }),
  };

  function section(run) {
    const last = run.status === "complete" ? run.times.at(-1) : run.endTime;
    const times = Array.from({ length: SECTION_TIMES }, (_, k) => (last * (k + 1)) / SECTION_TIMES);
    return { contour: run.contour, times, at: (k) => run.placesAt(k === null ? 0.0 : times[k]) };
  }

  function predicted(law, values, specimen, test) {
    const run = KINDS[specimen.runtime](law, values, { ...test, output: specimen.outputs[0].name });
    const outputs = Object.fromEntries(Object.entries(run.outputs).map(([name, column]) => [name, plain(column)]));
    const end = run.status === "complete" ? { ended: "", end: null } : { ended: run.reason, end: run.endTime };
    return { ...end, times: plain(run.times), outputs, section: test.planned && run.placesAt ? section(run) : undefined };
  }

  function ofProgram(law, values, data, { program, exact }) {
    const specimen = data.specimens.find((one) => one.name === program.specimen);
    const elastic = specimen.modulus.needed ? { modulus: program.modulus } : undefined, { model } = specimen;
    const load = creepkit.steps(program.steps, program.ramp);
    return predicted(law, values, specimen, { ...program, planned: true, fast: !exact, model, times: plannedTimes(program), load, elastic });
  }

  // A test that cannot be predicted leaves the others as they are.
  function ofTest(law, values, data, k, exact) {
    const test = data.tests[k], specimen = data.specimens.find((one) => one.name === test.specimen);
    const nothing = { test: k, outputs: {}, ended: "", end: null };
    if (specimen === undefined || !page.predicts({ ...specimen, model: test.model })) return nothing;
    const pairs = ([times, numbers]) => times.map((t, i) => [t, numbers[i]]);
    const elastic = (test.includes_elastic || specimen.modulus.needed) && test.modulus !== null ? { modulus: test.modulus } : undefined;
    const given = { ...test, fast: !exact, load: pairs(test.program), temperature: pairs(test.temperature_program), elastic, strainMeasure: test.measure };
    try {
      return { test: k, ...predicted(law, values, specimen, given) };
    } catch (error) {
      return { ...nothing, problem: String(error.message ?? error) };
    }
  }

  page.predict = function (data, question) {
    const { values, exact } = question, { code, rate_point: point } = data.laws[question.law], [low, high] = point.stress;
    const law = globalThis.creepkitLaws[code];
    const stresses = Array.from({ length: RATE_STRESSES }, (_, k) => low * (high / low) ** (k / (RATE_STRESSES - 1)));
    const rateAt = (temperature) => {
      const { rate } = creepkit.rateCurve(law, values, { ...point, stresses, temperature });
      return { stress: stresses, log_rate: Array.from(rate, (v) => (v > 0 && Number.isFinite(v) ? Math.log10(v) : null)) };
    };
    // measured rates are compared with those of the law at the temperatures of their tests
    const measured = question.tests.map((k) => data.tests[k]).filter((test) => test.minimum_rate !== null);
    const kelvin = new Set(measured.map((test) => Math.round(test.temperature_program[1][0])));
    return {
      tests: question.tests.map((k) => ofTest(law, values, data, k, exact)),
      program: question.program === null ? undefined : ofProgram(law, values, data, question),
      rate: rateAt(question.rate_temperature),
      other_rates: [...kelvin].filter((T) => Math.abs(T - question.rate_temperature) > ONE_TEMPERATURE).map(rateAt),
    };
  };
})((globalThis.creepkitPage ??= {}));
