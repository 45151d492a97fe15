"use strict";
// Predictions within the page, by the runtime that comes with a page that stands alone: same answers as the server's.
(function (page) {
  const FRAMES = 120, RATE_STRESSES = 60;

  page.predicts = (data, specimen) => specimen.runtime !== null && globalThis.creepkit !== undefined;

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
    creep: (law, values, test) => {
      const run = creepkit.simulateCreep(law, values, test);
      return { outputs: { [test.output]: plain(run.strain) }, run };
    },
    relaxation: (law, values, test) => {
      const run = creepkit.simulateRelaxation(law, values, { ...test, strain: test.stress });
      return { outputs: { [test.output]: plain(run.stress) }, run };
    },
  };

  function predicted(law, values, specimen, test) {
    const { outputs, run } = KINDS[specimen.runtime](law, values, { ...test, output: specimen.outputs[0].name });
    const ended = run.status !== "complete";
    return { times: plain(run.times), outputs, ended: ended ? run.reason || run.status : "", end: ended ? run.endTime : null };
  }

  function ofProgram(law, values, data, program) {
    const specimen = data.specimens.find((one) => one.name === program.specimen);
    const elastic = specimen.modulus.needed ? { modulus: program.modulus } : undefined;
    return predicted(law, values, specimen, { times: plannedTimes(program), stress: creepkit.steps(program.steps, program.ramp), temperature: program.temperature, control: program.control, elastic });
  }

  function ofTest(law, values, data, k) {
    const test = data.tests[k], specimen = data.specimens.find((one) => one.name === test.specimen);
    if (specimen === undefined) return { test: k, outputs: {}, ended: "", end: null };
    const pairs = ([times, numbers]) => times.map((t, i) => [t, numbers[i]]);
    const elastic = (test.includes_elastic || specimen.modulus.needed) && test.modulus !== null ? { modulus: test.modulus } : undefined;
    const made = predicted(law, values, specimen, { times: test.times, stress: pairs(test.program), temperature: pairs(test.temperature_program), control: test.control, elastic, strainMeasure: test.measure });
    return { test: k, ...made };
  }

  page.predict = function (data, question) {
    const law = lawOf(data, question.law), { values } = question;
    const answer = { tests: question.tests.map((k) => ofTest(law, values, data, k)) };
    if (question.program !== null) answer.program = ofProgram(law, values, data, question.program);
    const point = data.laws[question.law].rate_point, [low, high] = point.stress;
    const stresses = Array.from({ length: RATE_STRESSES }, (_, k) => low * (high / low) ** (k / (RATE_STRESSES - 1)));
    const { rate } = creepkit.rateCurve(law, values, { stresses, strain: point.strain, time: point.time, temperature: question.rate_temperature });
    answer.rate = { stress: stresses, log_rate: Array.from(rate, (v) => (v > 0 && Number.isFinite(v) ? Math.log10(v) : null)) };
    return answer;
  };
})((globalThis.creepkitPage ??= {}));
