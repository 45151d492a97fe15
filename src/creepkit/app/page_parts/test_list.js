"use strict";
// Measured tests: which are shown, their colours, and how far the curves lie from them.
(function (page) {
  const { element, svg } = page;

  // handlers: onInput(), onRelease(), onRepeat(k)
  page.testList = function (data, state, handlers) {
    const total = element("p", { class: "total", "aria-live": "polite" });
    const judged = element("p", { class: "help" });
    const table = element("table", {}, element("thead", {}, element("tr", {}, ...["", "test", "rms misfit", "over noise"].map((words) => element("th", { scope: "col" }, words)))));
    const body = element("tbody");
    table.append(body);
    const rows = data.tests.map((test, k) => {
      const shown = element("input", { type: "checkbox", "aria-label": `show ${test.name}`, onchange: () => { state.tests[k] = shown.checked; handlers.onInput(); handlers.onRelease(); } });
      shown.checked = state.tests[k];
      const swatch = svg("svg", { class: "swatch", "aria-hidden": "true", viewBox: "-6 -6 12 12" }, svg("path", { d: page.symbol(k, 0, 0, 4) }));
      swatch.style.fill = page.colour(k);
      const repeat = page.programOf(test) === null ? null : element("button", { type: "button", class: "small", title: "plan this test: its load, temperature and end", onclick: () => handlers.onRepeat(k) }, "plan");
      const rms = element("td", { class: "number" }), ratio = element("td", { class: "number" });
      body.append(element("tr", {}, element("td", {}, shown, swatch), element("th", { scope: "row" }, test.name, element("span", { class: "help" }, test.condition), test.note ? element("span", { class: "help" }, test.note) : null, repeat), rms, ratio));
      return { shown, rms, ratio };
    });
    const all = element("button", { type: "button", class: "small", onclick: () => set(true) }, "show all");
    const none = element("button", { type: "button", class: "small", onclick: () => set(false) }, "show none");
    const group = element("fieldset", {}, element("legend", {}, "Measured tests"), total, judged, element("div", { class: "buttons" }, all, none), element("div", { class: "scroll", tabindex: "0", role: "group", "aria-label": "Measured tests" }, table));

    function set(wanted) {
      state.tests.fill(wanted);
      rows.forEach((row) => (row.shown.checked = wanted));
      handlers.onInput();
      handlers.onRelease();
    }

    const units = Object.fromEntries(data.specimens.flatMap((one) => one.outputs.map((output) => [output.name, output])));
    const amount = (name, value) => `${page.format(value * units[name].factor, 2)} ${units[name].unit}`.trim();
    function show(misfits) {
      data.tests.forEach((test, k) => {
        const entries = Object.entries(misfits.get(k) ?? {});
        const lines = (write) => (state.tests[k] ? entries.map((entry) => element("div", {}, write(entry))) : []);
        rows[k].rms.replaceChildren(...lines(([name, one]) => `${entries.length > 1 || !units[name].unit ? units[name].title + " " : ""}${amount(name, one.rms)}`));
        rows[k].ratio.replaceChildren(...lines(([, one]) => (one.ratio === null ? "\u2013" : page.format(one.ratio, 2))));
      });
      const shown = [...misfits].filter(([k]) => state.tests[k]).map(([, misfit]) => misfit);
      const weighted = page.weighted(shown);
      const lost = shown.flatMap((misfit) => Object.values(misfit)).reduce((sum, one) => sum + one.lost, 0);
      const apart = Object.entries(page.together(shown)).map(([name, rms]) => `${units[name].title} ${amount(name, rms)}`).join(", ");
      total.textContent = shown.length === 0 ? "No test is shown." : weighted === null ? `Off by ${apart} (rms).` : `Off by ${apart} (rms). These curves lie ${page.format(weighted, 3)} times the noise of a frame (rms) from ${shown.length} ${shown.length === 1 ? "test" : "tests"}, with the same rate for all tests${lost ? `; ${lost} frames lie beyond the end of a curve` : ""}.`;
      judged.textContent = data.laws[state.law].judged;
    }
    return { group, show };
  };
})((globalThis.creepkitPage ??= {}));
