"use strict";
// A number with a slider: a field to type it, a range to drag it, marks of what is known of it.
(function (page) {
  const { element } = page;
  const POSITIONS = 2000; // of a slider

  // options: label (node or text), name, help, unit, low, high, value, log, onInput(value), onRelease(value),
  // factor: how many of creepkit's units one of the shown unit is
  page.slider = function (options) {
    const factor = options.factor ?? 1;
    const id = page.identifier("slider");
    const field = element("input", { type: "text", inputmode: "decimal", id: `${id}-field`, size: 10, autocomplete: "off", spellcheck: "false", "aria-label": `${options.name}${options.unit ? ", " + options.unit : ""}` });
    const range = element("input", { type: "range", min: 0, max: POSITIONS, step: 1, id, "aria-label": options.name });
    const interval = element("span", { class: "interval", hidden: true });
    const optimum = element("span", { class: "optimum", hidden: true });
    const likely = element("span", { class: "likely", hidden: true });
    const low = element("span", { class: "bound" }), high = element("span", { class: "bound" });
    const marks = element("div", { class: "marks", "aria-hidden": "true" }, interval, optimum, likely);
    const row = element(
      "div", { class: "slider" },
      element("label", { for: `${id}-field`, title: options.help ?? "" }, options.label ?? options.name, options.help ? element("span", { class: "help" }, options.help) : null),
      element("span", { class: "value" }, field, element("span", { class: "unit" }, options.unit ?? "")),
      element("div", { class: "track" }, range, marks),
      element("div", { class: "bounds", "aria-hidden": "true" }, low, high),
    );
    let scale, value;

    function window_(from, to) {
      scale = page.scale(from, to, options.log);
      const digits = page.digitsBetween(from, to);
      low.textContent = page.format(from / factor, digits);
      high.textContent = page.format(to / factor, digits);
      show();
    }

    function show(keepField = false) {
      if (value === undefined) return;
      const share = options.log && value <= 0 ? 0 : scale.share(value);
      range.value = Math.round(Math.min(Math.max(share, 0), 1) * POSITIONS);
      range.setAttribute("aria-valuetext", `${page.format(value / factor)} ${options.unit ?? ""}`);
      if (!keepField) field.value = page.plain(value / factor, 5);
      field.classList.remove("wrong");
      place(interval, marked.interval);
      place(optimum, marked.optimum === undefined ? undefined : [marked.optimum, marked.optimum]);
      place(likely, marked.likely === undefined ? undefined : [marked.likely, marked.likely]);
    }

    const marked = {};
    function place(mark, ends) {
      mark.hidden = ends === undefined;
      if (mark.hidden) return;
      const [from, to] = ends.map((end) => Math.min(Math.max(options.log && end <= 0 ? 0 : scale.share(end), 0), 1));
      mark.style.left = `${100 * from}%`;
      mark.style.width = `${100 * (to - from)}%`;
    }

    range.addEventListener("input", (event) => {
      value = scale.value(range.value / POSITIONS);
      show();
      options.onInput?.(value, event);
    });
    range.addEventListener("change", () => options.onRelease?.(value));
    field.addEventListener("input", (event) => {
      const typed = Number(field.value.replace(",", ".").replace("\u2212", "-"));
      const allowed = field.value.trim() !== "" && Number.isFinite(typed) && (options.accepts?.(typed * factor) ?? true);
      field.classList.toggle("wrong", !allowed);
      field.setAttribute("aria-invalid", String(!allowed));
      if (!allowed) return;
      value = typed * factor;
      show(true);
      options.onInput?.(value, event);
      options.onRelease?.(value);
    });
    field.addEventListener("change", () => show());
    value = options.value;
    window_(options.low, options.high);
    return {
      row, range, field,
      get value() { return value; },
      set(next) { value = next; show(); },
      window: window_,
      mark(marks_) { Object.assign(marked, marks_); show(true); },
    };
  };

  // A choice among titles; `onChange` gets the position.
  page.choice = function (name, titles, onChange) {
    const id = page.identifier("choice");
    const select = element("select", { id }, ...titles.map((title, k) => element("option", { value: k }, title)));
    select.addEventListener("change", () => onChange(Number(select.value)));
    return { row: element("div", { class: "choice" }, element("label", { for: id }, name), select), select };
  };
})((globalThis.creepkitPage ??= {}));
