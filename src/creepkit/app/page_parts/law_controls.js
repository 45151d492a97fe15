"use strict";
// The law: its equations, a slider for every parameter, and what is known of them.
(function (page) {
  const { element } = page;
  const DECADES = 3; // to either side, of a slider that does not span all bounds

  const isLog = (p) => p.scale === "log";
  const internal = (p, value) => (isLog(p) ? Math.log(value) : value);
  const external = (p, value) => (isLog(p) ? Math.exp(value) : value);

  // handlers: onInput(event), onRelease(), onLaw(position)
  page.lawControls = function (data, state, handlers) {
    const equations = element("div", { class: "equations" });
    const list = element("div", { class: "sliders" });
    const known = element("div", { class: "known" });
    const follow = element("input", { type: "checkbox", id: page.identifier("follow") });
    const followRow = element("div", { class: "check" }, follow, element("label", { for: follow.id }, "the others follow to their likely values"));
    const reset = element("button", { type: "button", onclick: back });
    const whole = element("input", { type: "checkbox", id: page.identifier("whole"), onchange: windows });
    const wholeRow = element("div", { class: "check" }, whole, element("label", { for: whole.id }, "sliders span all of the bounds"));
    const titles = data.laws.map((law) => law.title + (law.weight === null ? "" : ` (weight ${page.format(law.weight, 2)})`));
    const choice = page.choice("Law", titles, handlers.onLaw);
    const group = element(
      "fieldset", {}, element("legend", {}, "Law"), data.laws.length > 1 ? choice.row : null, equations, list,
      element("div", { class: "buttons" }, reset), followRow, wholeRow, known,
    );
    let law, sliders;

    function use(position) {
      law = data.laws[position];
      equations.replaceChildren(...law.equations.map(page.math));
      state.values = Object.fromEntries(law.parameters.map((p) => [p.name, p.value]));
      sliders = law.parameters.map((p, k) =>
        page.slider({
          label: element("span", {}, page.math(p.symbol)), name: p.name, help: p.title, unit: p.unit, low: p.low, high: p.high, value: p.value, log: isLog(p),
          accepts: (value) => !isLog(p) || value > 0 || value === p.off,
          onInput: (value, event) => moved(k, value, event), onRelease: handlers.onRelease,
        }));
      list.replaceChildren(...sliders.map((slider) => slider.row));
      reset.textContent = law.parameters[0]?.interval === null ? "Back to the first values" : "Back to the optimum";
      followRow.hidden = law.covariance === null;
      known.replaceChildren(...law.undetermined.map((sentence) => element("p", {}, sentence[0].toUpperCase() + sentence.slice(1) + ".")));
      law.parameters.forEach((p, k) => {
        if (p.interval === null) return;
        const [low, high] = p.interval, digits = low === null || high === null ? 3 : page.digitsBetween(low, high);
        sliders[k].mark({ optimum: p.value, interval: low === null || high === null ? undefined : p.interval });
        sliders[k].row.append(element("div", { class: "estimate" }, `${page.format(p.value, digits + 1)}, 95 % from ${page.format(low, digits)} to ${page.format(high, digits)}` + (p.verdict === "determined" ? "" : `: ${p.verdict}`)));
      });
      windows();
    }

    function put(k, value) {
      state.values[law.parameters[k].name] = value;
      sliders[k].set(value);
    }

    // One slider was moved: the likely values of the others, given it, are marked, and taken where that is wanted.
    function moved(k, value, event) {
      const { parameters, covariance } = law;
      state.values[parameters[k].name] = value;
      if (covariance !== null && covariance[k][k] > 0 && (value > 0 || !isLog(parameters[k]))) {
        const shift = internal(parameters[k], value) - internal(parameters[k], parameters[k].value);
        parameters.forEach((p, j) => {
          if (j === k || !(p.value > 0 || !isLog(p))) return;
          const likely = external(p, internal(p, p.value) + (covariance[j][k] / covariance[k][k]) * shift);
          if (follow.checked) put(j, Math.min(Math.max(likely, p.low), p.high));
          sliders[j].mark({ likely });
        });
        sliders[k].mark({ likely: undefined });
      }
      handlers.onInput(event);
    }

    function windows() {
      law.parameters.forEach((p, k) => {
        let [low, high] = [p.low, p.high];
        if (!whole.checked && (p.value > 0 || !isLog(p))) {
          const [from, to] = p.interval ?? [null, null];
          const center = internal(p, p.value);
          let reach = isLog(p) ? DECADES * Math.LN10 : Infinity;
          if (from !== null && to !== null && to > from && (from > 0 || !isLog(p))) {
            reach = 2.5 * Math.max(internal(p, to) - center, center - internal(p, from));
          }
          [low, high] = [external(p, Math.max(internal(p, low), center - reach)), external(p, Math.min(internal(p, high), center + reach))];
          if (!(high > low)) [low, high] = [p.low, p.high];
        }
        sliders[k].window(low, high);
      });
    }

    function back() {
      law.parameters.forEach((p, k) => {
        put(k, p.value);
        sliders[k].mark({ likely: undefined });
      });
      handlers.onInput(null);
      handlers.onRelease();
    }

    return { group, use };
  };
})((globalThis.creepkitPage ??= {}));
