"use strict";
// The page: controls at one side, panels at the other; every input is answered, every answer is drawn.
(function (page) {
  const { element } = page;
  const LONGEST_LABEL = 22; // letters beside an axis
  const MOST_SHOWN = 12; // tests that are shown at first
  const PERCENT_PER_HOUR = 3.6e5; // of 1/s
  const DECADES = 100; // of the last time over the first, from which axes are logarithmic
  page.latencies = []; // ms from an input to the frame after its curves were drawn

  const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);

  // What a law without temperature cannot do, where tests at several temperatures are shown.
  page.temperatureWarning = function (data, state) {
    const shown = data.tests.filter((_, k) => state.tests[k]).map((test) => test.temperature);
    return Math.max(...shown) - Math.min(...shown) > data.same_temperature ? data.laws[state.law].warning : "";
  };

  page.start = function (root) {
    const data = JSON.parse(root.querySelector(".creepkit-page-data").textContent);
    const state = { law: 0, temperature: data.temperature, end: data.laws[0].end, tests: data.tests.map((_, k) => k < MOST_SHOWN), planned: data.tests.length === 0 };
    const status = element("p", { class: "status", role: "status" });
    const problem = element("p", { class: "problem", role: "alert", hidden: true });
    const warning = element("p", { class: "warning", role: "note", hidden: true });
    const panels = element("div", { class: "panels" });
    const chosen = element("select", { "aria-label": "plot that is shown", onchange: offerPanels });
    let inputAt = null, charts = new Map(), outputs = new Map(), rates = null, section = null, last = null, timer = null, before = null, settled = true;

    data.specimens = data.specimens.filter(page.predicts);

    const laws = page.lawControls(data, state, { onInput: changed, onRelease: released, onLaw });
    const planned = page.testControls(data, state, { onInput: plannedChanged, onRelease: released, onSpecimen });
    const tests = page.testList(data, state, { onInput: () => changed(null), onRelease: released, onRepeat });
    const show = element("input", { type: "checkbox", id: page.identifier("planned"), onchange: () => { state.planned = show.checked; onSpecimen(); } });
    show.checked = state.planned;
    const showRow = element("div", { class: "check" }, show, element("label", { for: show.id }, "show the planned test"));
    if (data.tests.length) planned.group.insertBefore(showRow, planned.group.children[1]);

    root.replaceChildren(
      element("header", {}, element(root.classList.contains("embedded") ? "p" : "h2", { class: "title" }, data.title), status),
      problem,
      warning,
      element("div", { class: "columns" },
        element("form", { class: "controls", onsubmit: (event) => event.preventDefault() }, laws.group, data.tests.length ? tests.group : null, planned.group, page.copies(() => ({ state, law: data.laws[state.law] }))),
        panels),
    );
    laws.use(0);
    planned.use(0);
    onSpecimen();

    // ---- what a person does ------------------------------------------------------------------------------------

    function onLaw(position) {
      state.law = position;
      laws.use(position);
      planned.build();
      changed(null);
      released();
    }

    function onSpecimen() {
      before = null;
      makePanels();
      changed(null);
      released();
    }

    function onRepeat(k) {
      const test = data.tests[k];
      planned.use(data.specimens.findIndex((one) => one.name === test.specimen), page.programOf(test));
      state.planned = show.checked = true;
      onSpecimen();
    }

    function plannedChanged(event) {
      if (!state.planned) { state.planned = show.checked = true; makePanels(); }
      changed(event);
    }

    // The curves as they were before a slider began to move stay, in grey, until the next one does.
    function changed(event) {
      if (settled && event !== null) { before = last; settled = false; }
      inputAt = event === null ? null : performance.now();
      root.dataset.exact = "false";
      answer(false);
    }

    function released() {
      settled = true;
      clearTimeout(timer);
      timer = setTimeout(() => answer(true), 120);
    }

    function answer(exact) {
      try {
        draw({ exact, ...page.predict(data, { ...question(), exact }) });
      } catch (error) {
        complain(String(error.message ?? error));
      }
    }

    function question() {
      const { specimen, load, steps, ramp, control, end, temperature, modulus } = state;
      const program = { specimen: specimen.name, load: load.name, steps, control, ramp: load.control ? 0 : ramp, end, temperature, modulus: specimen.modulus.needed ? modulus : null };
      const shown = data.tests.map((_, k) => k).filter((k) => state.tests[k]);
      return { law: state.law, values: state.values, program: state.planned ? program : null, tests: shown, rate_temperature: temperature };
    }

    // Which strain is drawn: that of each measured test as it was measured, of a planned one the logarithmic.
    function strainKind() {
      const measured = new Set(data.tests.filter((test, k) => state.tests[k] && "strain" in test.outputs).map((test) => test.measure));
      const kinds = [...new Set([...measured, ...(state.planned || measured.size === 0 ? ["logarithmic"] : [])])];
      return kinds.length === 1 ? kinds[0] : `of tests as measured (${[...measured].join(", ")}), planned logarithmic`;
    }

    // Whether the shown tests follow an output over decades of time.
    function overDecades(name) {
      return data.tests.some((test, k) => state.tests[k] && test.outputs[name] && test.times.at(-1) > DECADES * test.times.find((t) => t > 0));
    }

    // ---- panels ------------------------------------------------------------------------------------------------

    function makePanels() {
      const names = new Set(data.tests.filter((_, k) => state.tests[k]).map((test) => test.specimen));
      if (state.planned || names.size === 0) names.add(state.specimen.name);
      outputs = new Map(data.specimens.filter((one) => names.has(one.name)).flatMap((one) => one.outputs.map((output) => [output.name, output])));
      // the title names it in full
      const label = (output) => (output.title.length > LONGEST_LABEL ? output.unit : output.unit ? `${output.title}, ${output.unit}` : output.title);
      charts = new Map([...outputs].map(([name, output]) => [name, page.chart({ title: capital(output.title), x: { label: "time", logarithmic: overDecades(name), choice: true }, y: { label: label(output), short: output.unit || output.title, logarithmic: output.factor > 1 && overDecades(name), choice: true } })]));
      charts.get("strain")?.heading.append(element("span", { class: "help" }, ` ${strainKind()}`));
      const point = data.laws[state.law].rate_point;
      rates = page.chart({ title: "Creep rate against stress", whole: true, x: { label: "stress, MPa", logarithmic: true }, y: { label: "creep rate, %/h", short: "%/h", logarithmic: true } });
      rates.heading.append(element("span", { class: "help" }, ` at strain ${page.format(point.strain, 2)}, ${page.duration(point.time)}${data.tests.some((test) => test.minimum_rate !== null) ? "; points: measured minimum rates, grey lines: the law at their temperatures" : ""}`));
      section = page.section();
      section.panel.hidden = true;
      panels.replaceChildren(element("span", { class: "chooser" }, chosen), ...[...charts.values()].map((chart) => chart.panel), section.panel, rates.panel);
      offerPanels();
    }

    // A narrow screen has room for one panel beside the controls: which, is chosen.
    function offerPanels() {
      const all = [...panels.querySelectorAll(".panel:not([hidden])")], titles = all.map((panel) => panel.querySelector(".name").textContent);
      const kept = Math.max(0, titles.indexOf(chosen.options[chosen.selectedIndex]?.textContent));
      chosen.replaceChildren(...titles.map((title, k) => element("option", { value: k }, title)));
      chosen.selectedIndex = kept;
      all.forEach((panel, k) => panel.classList.toggle("chosen", k === kept));
    }

    function draw(answer) {
      const started = inputAt;
      const failed = (answer.tests ?? []).find((one) => one.problem);
      problem.hidden = !failed;
      if (failed) complain(`${data.tests[failed.test].name}: ${failed.problem}`);
      const shown = (answer.tests ?? []).filter((one) => state.tests[one.test]);
      const ends = [...shown.map((one) => data.tests[one.test].times.at(-1)), ...(answer.program ? [state.end] : [])];
      const unit = page.timeUnit(Math.max(...ends, 1e-30));
      const scaled = (values, factor) => values.map((v) => (v === null ? null : v * factor)), inUnit = (times) => scaled(times, 1 / unit.size);
      for (const [name, chart] of charts) {
        const series = [], { factor, unit: shownUnit } = outputs.get(name);
        for (const one of shown) {
          const test = data.tests[one.test], colour = page.colour(one.test), offset = test.offset[name] ?? 0, x = inUnit(test.times);
          if (test.outputs[name]) series.push({ kind: "points", name: one.test, x, y: scaled(test.outputs[name], factor), colour });
          if (one.outputs[name]) series.push({ kind: "line", x, y: one.outputs[name].map((v) => (v === null ? null : (v + offset) * factor)), colour });
        }
        if (before?.program?.outputs[name] && answer.program) series.push({ kind: "line", style: "before", x: inUnit(before.program.times), y: scaled(before.program.outputs[name], factor), colour: "var(--soft)" });
        if (answer.program?.outputs[name]) series.push({ kind: "line", style: "plan", x: inUnit(answer.program.times), y: scaled(answer.program.outputs[name], factor), colour: page.colour(null) });
        const planned = answer.program?.outputs[name]?.filter((v) => v !== null).at(-1);
        chart.draw({ series, xLabel: `time, ${unit.name}`, summary: planned === undefined ? `${shown.length} measured tests.` : `The planned test ends at ${page.format(planned * factor)} ${shownUnit}.` });
      }
      warning.textContent = shown.length ? page.temperatureWarning(data, state) : "";
      warning.hidden = warning.textContent === "";
      drawRates(answer.rate, answer.other_rates ?? []);
      if (answer.program?.section) {
        if (section.panel.hidden) {
          section.panel.hidden = false;
          offerPanels();
        }
        section.draw(answer.program.section);
      }
      const misfits = new Map(shown.map((one) => [one.test, page.misfit(data.tests[one.test], one.outputs)]));
      if (data.tests.length) tests.show(misfits);
      say(answer);
      last = answer;
      if (started !== null) {
        inputAt = null;
        requestAnimationFrame(() => requestAnimationFrame(() => {
          page.latencies.push(performance.now() - started);
          if (page.latencies.length > 5000) page.latencies.shift();
        }));
      }
    }

    function drawRates(rate, others) {
      if (!rate) return;
      const colour = page.colour(null);
      const drawn = (rate, style, colour) => ({ kind: "line", style, x: rate.stress, y: rate.log_rate.map((v) => (v === null ? null : PERCENT_PER_HOUR * 10 ** v)), colour });
      const series = [...(before?.rate ? [drawn(before.rate, "before", "var(--soft)")] : []), ...others.map((one) => drawn(one, "", "var(--soft)")), drawn(rate, "plan", colour)];
      data.tests.forEach((test, k) => {
        if (state.tests[k] && test.minimum_rate !== null && test.load === "stress") series.push({ kind: "points", name: k, large: true, x: [test.program[1].at(-1)], y: [PERCENT_PER_HOUR * test.minimum_rate], colour: page.colour(k) });
      });
      rates.draw({ series, summary: rate.problem ?? "" });
    }

    function say(answer) {
      const coarse = !answer.exact && state.planned && state.specimen.runtime === "dimple";
      const how = coarse ? "Reduced-order model in few modes; all modes when you let go. " : "";
      const ended = answer.program?.ended ? `The planned test ended after ${page.duration(answer.program.end)}: ${answer.program.ended}.` : "";
      status.textContent = how + ended;
      root.dataset.exact = String(answer.exact);
    }

    function complain(sentence) {
      problem.textContent = sentence;
      problem.hidden = false;
    }

  };

  async function startAll() {
    await globalThis.creepkit.ready;
    for (const root of document.querySelectorAll(".creepkit-page:not([data-started])")) {
      root.dataset.started = "";
      page.start(root);
    }
  }
  if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", startAll);
  else startAll();
})((globalThis.creepkitPage ??= {}));
