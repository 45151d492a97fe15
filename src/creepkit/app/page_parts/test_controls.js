"use strict";
// The planned test: specimen, load program, temperature, end and modulus, as the specimen's record says.
(function (page) {
  const { element } = page;
  const ZERO_CELSIUS = 273.15;

  // handlers: onInput(event), onRelease(), onSpecimen()
  page.testControls = function (data, state, handlers) {
    const specimens = data.specimens;
    const body = element("div");
    const choice = page.choice("Specimen", specimens.map((one) => one.title), (k) => { use(k); handlers.onSpecimen(); });
    const group = element("fieldset", {}, element("legend", {}, "Planned test"), choice.row, body);
    const changed = { onInput: (event) => handlers.onInput(event), onRelease: () => handlers.onRelease() };

    function use(k, from = {}) {
      const specimen = specimens[k];
      choice.select.value = k;
      const load = specimen.loads.find((one) => one.name === (from.load ?? state.load?.name)) ?? specimen.loads[0];
      const same = state.specimen === specimen && state.load === load;
      Object.assign(state, {
        specimen, load,
        steps: from.steps ?? (same ? state.steps : [[0, load.value]]),
        ramp: load.ramp,
        control: from.control ?? "load",
        modulus: from.modulus ?? specimen.modulus.value,
      });
      if (from.temperature !== undefined) state.temperature = from.temperature;
      if (from.end !== undefined) state.end = from.end;
      build();
    }

    function build() {
      const { specimen, load } = state;
      const parts = [];
      if (specimen.loads.length > 1) {
        const loads = page.choice("Load", specimen.loads.map((one) => `${one.title}, ${one.unit}`), (k) => {
          state.load = null;
          use(specimens.indexOf(specimen), { load: specimen.loads[k].name });
          handlers.onSpecimen();
        });
        loads.select.value = specimen.loads.indexOf(load);
        parts.push(loads.row);
      }
      parts.push(program());
      if (load.control) {
        const controls = ["load", "stress"];
        const held = page.choice("Held in each step", ["load (engineering stress)", "true stress"], (k) => { state.control = controls[k]; handlers.onInput(null); handlers.onRelease(); });
        held.select.value = controls.indexOf(state.control);
        parts.push(held.row);
      } else {
        parts.push(page.slider({ name: "ramp", help: "in which each level is reached", unit: "s", low: 0, high: Math.max(60, 4 * load.ramp), value: state.ramp, accepts: (v) => v >= 0, ...changed, onInput: (v, event) => { state.ramp = v; handlers.onInput(event); } }).row);
      }
      const law = data.laws[state.law];
      if (law.variables.includes("temperature")) {
        const span = temperatureSpan();
        parts.push(page.slider({ name: "temperature", unit: "\u00b0C", low: span[0] - ZERO_CELSIUS, high: span[1] - ZERO_CELSIUS, value: state.temperature - ZERO_CELSIUS, accepts: (v) => v > -ZERO_CELSIUS && v < 9700, ...changed, onInput: (v, event) => { state.temperature = v + ZERO_CELSIUS; handlers.onInput(event); } }).row);
      }
      const unit = page.timeUnit(state.end);
      parts.push(page.slider({ name: "end of the test", unit: unit.name, factor: unit.size, log: true, low: state.end / 100, high: state.end * 100, value: state.end, accepts: (v) => v > 0, ...changed, onInput: (v, event) => { state.end = v; handlers.onInput(event); } }).row);
      if (specimen.modulus.needed) {
        const { low, high } = specimen.modulus;
        parts.push(page.slider({ name: "Young's modulus", unit: "GPa", factor: 1e3, log: true, low, high, value: state.modulus, accepts: (v) => v > 0, ...changed, onInput: (v, event) => { state.modulus = v; handlers.onInput(event); } }).row);
      }
      body.replaceChildren(...parts);
    }

    function temperatureSpan() {
      const known = data.tests.map((test) => test.temperature);
      const low = Math.min(data.temperature, ...known), high = Math.max(data.temperature, ...known);
      return [Math.max(200, low - 150), high + 150];
    }

    // The load by steps: a slider for each level, and when it begins.
    function program() {
      const { load } = state;
      const rows = element("div", { class: "steps" });
      const add = element("button", { type: "button", class: "small", onclick: () => {
        const [start, value] = state.steps.at(-1);
        state.steps = [...state.steps, [Math.max(start * 2, start + state.end / 4), value * 1.2]];
        fill();
        handlers.onInput(null);
        handlers.onRelease();
      } }, "Add a step");
      function fill() {
        const unit = page.timeUnit(state.end);
        const levels = state.steps.map(([, value]) => Math.abs(value)).concat(load.low, load.high);
        rows.replaceChildren(...state.steps.map(([start, value], k) => {
          const level = page.slider({ name: k === 0 ? load.title : `${load.title}, step ${k + 1}`, unit: load.unit, log: load.low > 0, low: Math.min(...levels.filter((v) => v > 0)), high: Math.max(...levels), value, accepts: (v) => v >= 0, ...changed, onInput: (v, event) => { state.steps = state.steps.map((step, j) => (j === k ? [step[0], v] : step)); handlers.onInput(event); } });
          if (k === 0) return level.row;
          const begin = page.slider({ name: `step ${k + 1} begins at`, unit: unit.name, factor: unit.size, low: 0, high: Math.max(state.end, start * 1.2), value: start, accepts: (v) => v > 0, ...changed, onInput: (v, event) => { state.steps = state.steps.map((step, j) => (j === k ? [Math.max(v, 1e-6 * state.end), step[1]] : step)); handlers.onInput(event); } });
          const remove = element("button", { type: "button", class: "small", "aria-label": `remove step ${k + 1}`, onclick: () => { state.steps = state.steps.filter((_, j) => j !== k); fill(); handlers.onInput(null); handlers.onRelease(); } }, "Remove");
          return element("div", { class: "step" }, begin.row, level.row, remove);
        }));
      }
      fill();
      return element("div", {}, rows, add);
    }

    return { group, use, build };
  };

  // The planned test that repeats a measured one; null where its program is not made of steps.
  page.programOf = function (test) {
    const [times, values] = test.program;
    const steps = [];
    for (let k = 0; k < times.length; k++) {
      const last = k === times.length - 1 || times[k + 1] > times[k];
      if (last && values[k] > 0 && (steps.length === 0 || values[k] !== steps.at(-1)[1])) steps.push([steps.length === 0 ? 0 : times[Math.max(0, values[k - 1] === steps.at(-1)[1] ? k - 1 : k)], values[k]]);
    }
    const end = test.times.at(-1);
    return steps.length && steps.length <= 50 ? { load: test.load, steps, control: test.control, temperature: test.temperature, modulus: test.modulus ?? undefined, end } : null;
  };
})((globalThis.creepkitPage ??= {}));
