"use strict";
// The law: its equations, a slider for every parameter, what is known of them, and likely directions.
(function (page) {
  const { element } = page;
  const DECADES = 3; // to either side, of a slider that does not span all bounds

  const internal = (p, value) => (p.log ? Math.log(value) : value);
  const external = (p, value) => (p.log ? Math.exp(value) : value);

  // handlers: onInput(event), onRelease(), onLaw(position)
  page.lawControls = function (data, state, handlers) {
    const equations = element("div", { class: "equations" });
    const list = element("div", { class: "sliders" });
    const directions = element("div", { class: "sliders directions" });
    const known = element("div", { class: "known" });
    const follow = element("input", { type: "checkbox", id: page.identifier("follow") });
    const followRow = element("div", { class: "check" }, follow, element("label", { for: follow.id }, "the others follow to their likely values"));
    const reset = element("button", { type: "button", onclick: back });
    const whole = element("input", { type: "checkbox", id: page.identifier("whole"), onchange: windows });
    const wholeRow = element("div", { class: "check" }, whole, element("label", { for: whole.id }, "sliders span all of the bounds"));
    const titles = data.laws.map((law) => law.title + (law.weight === null ? "" : ` (weight ${page.format(law.weight, 2)})`));
    const choice = page.choice("Law", titles, handlers.onLaw);
    const group = element(
      "fieldset", {}, element("legend", {}, "Law"), data.laws.length > 1 ? choice.row : null, equations, list, directions,
      element("div", { class: "buttons" }, reset), followRow, wholeRow, known,
    );
    let law, sliders, shifts;

    function use(position) {
      law = data.laws[position];
      equations.replaceChildren(...law.equations.map(page.math));
      state.values = Object.fromEntries(law.parameters.map((p) => [p.name, p.value]));
      sliders = law.parameters.map((p, k) =>
        page.slider({
          label: element("span", {}, page.math(p.symbol)), name: p.name, help: p.meaning, unit: p.unit, low: p.low, high: p.high, value: p.value, log: p.log,
          accepts: (value) => !p.log || value > 0 || value === p.off,
          onInput: (value, event) => moved(k, value, event), onRelease: handlers.onRelease,
        }));
      list.replaceChildren(...sliders.map((slider) => slider.row));
      reset.textContent = law.fit === null ? "Back to the first values" : "Back to the optimum";
      followRow.hidden = !law.fit?.covariance;
      known.replaceChildren(...(law.fit?.undetermined ?? []).map((sentence) => element("p", {}, sentence + ".")));
      law.parameters.forEach((p, k) => {
        const e = law.fit?.estimates[p.name];
        if (e === undefined) return;
        sliders[k].mark({ optimum: e.value, interval: e.low === null || e.high === null ? undefined : [e.low, e.high] });
        sliders[k].row.append(element("div", { class: "estimate" }, `${page.format(e.value)}, 95 % from ${page.format(e.low, 3)} to ${page.format(e.high, 3)}` + (e.verdict === "determined" ? "" : `: ${e.verdict}`)));
      });
      shifts = (law.fit?.directions ?? []).map(() => 0);
      directions.replaceChildren(...(law.fit?.directions ?? []).map(directionSlider));
      windows();
    }

    const directionSliders = [];
    function directionSlider(direction, d) {
      const slider = page.slider({
        name: `likely direction ${d + 1}`, help: direction.words, unit: "sd", low: -3, high: 3, value: 0,
        onInput: (value, event) => {
          shifts[d] = value;
          law.parameters.forEach((p, k) => {
            const shift = law.fit.directions.reduce((sum, one, j) => sum + shifts[j] * one.step[k], 0);
            put(k, Math.min(Math.max(external(p, internal(p, p.value) + shift), p.low), p.high));
          });
          handlers.onInput(event);
        },
        onRelease: handlers.onRelease,
      });
      directionSliders[d] = slider;
      return slider.row;
    }

    function put(k, value) {
      state.values[law.parameters[k].name] = value;
      sliders[k].set(value);
    }

    // One slider was moved: the likely values of the others, given it, are marked, and taken where that is wanted.
    function moved(k, value, event) {
      const { parameters, fit } = law;
      state.values[parameters[k].name] = value;
      if (fit?.covariance && fit.covariance[k][k] > 0 && (value > 0 || !parameters[k].log)) {
        const shift = internal(parameters[k], value) - internal(parameters[k], parameters[k].value);
        parameters.forEach((p, j) => {
          if (j === k || !(p.value > 0 || !p.log)) return;
          const likely = external(p, internal(p, p.value) + (fit.covariance[j][k] / fit.covariance[k][k]) * shift);
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
        if (!whole.checked && (p.value > 0 || !p.log)) {
          const e = law.fit?.estimates[p.name];
          const center = internal(p, p.value);
          let reach = p.log ? DECADES * Math.LN10 : Infinity;
          if (e && e.low !== null && e.high !== null && e.high > e.low && (e.low > 0 || !p.log)) {
            reach = 2.5 * Math.max(internal(p, e.high) - center, center - internal(p, e.low));
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
      shifts.fill(0);
      directionSliders.forEach((slider) => slider.set(0));
      handlers.onInput(null);
      handlers.onRelease();
    }

    return { group, use };
  };
})((globalThis.creepkitPage ??= {}));
