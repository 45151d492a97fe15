"use strict";
// Predictions within the page, by the runtime that comes with a page that stands alone: same answers as the server's.
(function (page) {
  const FRAMES = 120, RATE_STRESSES = 60;

  // Whether a question can be answered here: of specimens that the runtime knows, of their own lengths, and without
  // what an identification says of single tests.
  page.answersAlone = function (data, { program, tests }) {
    const known = (name) => data.specimens.some((one) => one.name === name && page.predicts(data, one));
    if (program !== null && !(known(program.specimen) && Object.keys(program.lengths).length === 0)) return false;
    return tests.every((k) => known(data.tests[k].specimen) && !data.tests[k].nuisances && (data.tests[k].model !== null || data.specimens.find((one) => one.name === data.tests[k].specimen).runtime !== "dimple"));
  };

  page.predicts = (data, specimen) => specimen.network !== null || (specimen.runtime === "dimple" ? specimen.model !== null : specimen.runtime !== null) && globalThis.creepkit !== undefined;

  const lawOf = (data, position) => globalThis.creepkitLaws[data.laws[position].code];
  const plain = (values) => Array.from(values, (v) => (Number.isFinite(v) ? v : null));

  // Half of the frames spread over time and half over its logarithm, and the beginnings of steps.
  function plannedTimes(program) {
    const { end } = program, half = FRAMES / 2, times = new Set();
    for (let k = 0; k < half; k++) times.add(end * 1e-4 ** (1 - k / (half - 1))).add((end * (k + 1)) / half);
    for (const [start] of program.steps) if (start > 0 && start < end) times.add(start).add(start + 1e-6 * end);
    return [...times].filter((t) => t > 0 && t <= end).sort((a, b) => a - b);
  }

  const KINDS = {
    network: (law, values, test) => {
      const constants = { ...test.lengths, temperature: test.temperature, ...(test.elastic ?? {}) };
      if (typeof constants.temperature !== "number") constants.temperature = test.temperature.at(-1)[1];
      const run = creepkit.predictByNetwork(law, values, globalThis.creepkitModels[test.network], { load: test.stress, times: test.times, constants });
      return { outputs: Object.fromEntries(Object.entries(run.outputs).map(([name, column]) => [name, plain(column)])), run };
    },
    creep: (law, values, test) => {
      const run = creepkit.simulateCreep(law, values, test);
      return { outputs: { [test.output]: plain(run.strain) }, run };
    },
    dimple: (law, values, test) => {
      const model = globalThis.creepkitModels[test.model];
      const run = creepkit.simulateDimple(law, values, model, { ...test, pressure: test.stress });
      return { outputs: Object.fromEntries(Object.entries(run.outputs).map(([name, column]) => [name, plain(column)])), run, section: () => section(run, model) };
    },
    relaxation: (law, values, test) => {
      const run = creepkit.simulateRelaxation(law, values, { ...test, strain: test.stress });
      return { outputs: { [test.output]: plain(run.stress) }, run };
    },
  };

  // ---- the deformed section -----------------------------------------------------------------------------------------

  const SECTION_TIMES = 8, meshes = new WeakMap();

  function meshOf(model) {
    if (!meshes.has(model)) {
      const sides = creepkit.decode(model.arrays.elements), elements = [];
      // corners and middles of the sides in turn, as they are met around an element
      for (let e = 0; e < sides.length; e += 8) elements.push([0, 4, 1, 5, 2, 6, 3, 7].map((k) => sides[e + k]));
      meshes.set(model, { nodes: creepkit.decode(model.arrays.places), elements });
    }
    return meshes.get(model);
  }

  function section(run, model) {
    const { nodes, elements } = meshOf(model), last = run.status === "complete" ? run.times.at(-1) : run.endTime;
    const times = Array.from({ length: SECTION_TIMES }, (_, k) => (last * (k + 1)) / SECTION_TIMES);
    return { nodes, elements, times, at: (k) => run.placesAt(times[k]).map((place, n) => place - nodes[n]), stress: null };
  }

  // A network answers while a slider moves, and always for a specimen that the runtime does not know itself.
  function kindOf(specimen, test) {
    return specimen.network !== null && (test.fast || specimen.runtime === null) ? "network" : specimen.runtime;
  }

  function predicted(law, values, specimen, test) {
    const { outputs, run, section: drawn } = KINDS[kindOf(specimen, test)](law, values, { ...test, network: specimen.network, output: specimen.outputs[0].name });
    const ended = run.status !== "complete";
    const shape = test.planned && drawn ? { section: drawn() } : {};
    return { ...shape, times: plain(run.times), outputs, ended: ended ? run.reason || run.status : "", end: ended ? run.endTime : null };
  }

  function ofProgram(law, values, data, question) {
    const { program } = question;
    const specimen = data.specimens.find((one) => one.name === program.specimen);
    const elastic = specimen.modulus.needed ? { modulus: program.modulus } : undefined, { lengths } = program;
    return predicted(law, values, specimen, { planned: true, fast: !question.exact, model: specimen.model, times: plannedTimes(program), stress: creepkit.steps(program.steps, program.ramp), temperature: program.temperature, control: program.control, elastic, lengths });
  }

  function ofTest(law, values, data, k, exact) {
    const test = data.tests[k], specimen = data.specimens.find((one) => one.name === test.specimen);
    if (specimen === undefined || (specimen.runtime === "dimple" && test.model === null)) return { test: k, outputs: {}, ended: "", end: null };
    const pairs = ([times, numbers]) => times.map((t, i) => [t, numbers[i]]);
    const elastic = (test.includes_elastic || specimen.modulus.needed) && test.modulus !== null ? { modulus: test.modulus } : undefined;
    const made = predicted(law, values, specimen, { fast: !exact, model: test.model, times: test.times, stress: pairs(test.program), temperature: pairs(test.temperature_program), control: test.control, elastic, strainMeasure: test.measure, lengths: test.lengths });
    return { test: k, ...made };
  }

  // A test that cannot be predicted leaves the others as they are.
  function orProblem(k, predict) {
    try {
      return predict();
    } catch (error) {
      return { test: k, outputs: {}, ended: "", end: null, problem: String(error.message ?? error) };
    }
  }

  page.predict = function (data, question) {
    const law = lawOf(data, question.law), { values } = question;
    const answer = { tests: question.tests.map((k) => orProblem(k, () => ofTest(law, values, data, k, question.exact))) };
    if (question.program !== null) answer.program = ofProgram(law, values, data, question);
    const point = data.laws[question.law].rate_point, [low, high] = point.stress;
    const stresses = Array.from({ length: RATE_STRESSES }, (_, k) => low * (high / low) ** (k / (RATE_STRESSES - 1)));
    const { rate } = creepkit.rateCurve(law, values, { stresses, strain: point.strain, time: point.time, temperature: question.rate_temperature });
    answer.rate = { stress: stresses, log_rate: Array.from(rate, (v) => (v > 0 && Number.isFinite(v) ? Math.log10(v) : null)) };
    return answer;
  };
})((globalThis.creepkitPage ??= {}));
