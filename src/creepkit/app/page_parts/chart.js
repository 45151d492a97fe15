"use strict";
// A chart in SVG: curves and measured points over a linear or logarithmic axis, redrawn as a whole.
(function (page) {
  const { element, svg } = page;
  const MARGIN = { left: 66, right: 14, top: 10, bottom: 44 };
  const LONGEST_MARGIN = 1.25; // of an axis of times, up to its next number
  const SMALLEST = { width: 200, height: 110 }, USUAL = { width: 520, height: 220 }; // of a drawing
  const LETTER = 7; // pixels of one in a label

  // options: title, x and y {label, short, logarithmic, choice}, whole: whether all of a logarithmic axis is shown;
  // short : the label of an axis that has no place for more
  page.chart = function (options) {
    const drawing = svg("svg", { role: "img", class: "chart" });
    const readout = element("output", { class: "readout" });
    const heading = element("h3", {}, element("span", { class: "name" }, options.title));
    const switches = element("span", { class: "switches" });
    const panel = element("figure", { class: "panel" }, element("figcaption", {}, heading, switches), drawing, readout);
    const axes = { x: { ...options.x }, y: { ...options.y } };
    let shown = { series: [] };
    let scales = null;

    for (const [key, words] of [["x", "log x"], ["y", "log y"]]) {
      if (!axes[key].choice) continue;
      const button = element("button", { type: "button", class: "small", "aria-pressed": String(axes[key].logarithmic) }, words);
      button.addEventListener("click", () => {
        axes[key].logarithmic = !axes[key].logarithmic;
        button.setAttribute("aria-pressed", String(axes[key].logarithmic));
        draw(shown);
      });
      switches.append(button);
    }

    function extent(key, series) {
      const { logarithmic } = axes[key];
      let low = Infinity, high = -Infinity;
      for (const one of series) {
        for (const value of one[key]) {
          if (value === null || (logarithmic && value <= 0)) continue;
          if (value < low) low = value;
          if (value > high) high = value;
        }
      }
      return [low, high];
    }

    // The end of a linear axis of times: the next number, where that is near.
    function lastTick(low, high) {
      const ticks = page.ticks(low, high, false, (width - MARGIN.left - MARGIN.right) / 85);
      const step = ticks.length > 1 ? ticks[1] - ticks[0] : 0, next = ticks.at(-1) + step;
      return next <= LONGEST_MARGIN * high ? Math.max(next, high) : high;
    }

    // What was measured and planned fills the panel; curves that leave it far behind do not shrink it.
    function rangeOf(key, series) {
      const { logarithmic } = axes[key];
      const leading = series.filter((one) => one.kind === "points" || one.style === "plan");
      let [low, high] = extent(key, leading.length ? leading : series);
      if (leading.length && key === "y") {
        const [least, most] = extent(key, series), reach = high - low;
        low = Math.max(Math.min(low, least), logarithmic ? low / 3 : low - 0.5 * reach);
        high = Math.min(Math.max(high, most), logarithmic ? high * 3 : high + 0.5 * reach);
      }
      if (!(low <= high)) return logarithmic ? [1, 10] : [0, 1];
      if (logarithmic) {
        if (!options.whole) low = Math.max(low, high * (key === "y" ? 1e-6 : 1e-4));
        if (high / low < 1.3) return [low / 1.5, high * 1.5];
        return key === "x" ? [low / 1.05, high * 1.05] : [10 ** (Math.floor(Math.log10(low) * 4) / 4), 10 ** (Math.ceil(Math.log10(high) * 4) / 4)];
      }
      if (key === "x") return [Math.min(0, low), lastTick(Math.min(0, low), 1.02 * high || 1)]; // symbols at the last time stay whole
      const reach = high - low;
      if (reach === 0) return [Math.min(0, low * 0.9), (high || 1) * 1.1];
      if (low > 0 && reach > 0.35 * high) low = 0; // from zero, unless that would hide what changes
      // to a twelfth of the size, so that the axis rests while a curve moves a little
      const step = 10 ** Math.floor(Math.log10(high - low)) / 4;
      return [low === 0 ? 0 : Math.floor((low - 0.04 * reach) / step) * step, Math.ceil((high + 0.04 * reach) / step) * step];
    }

    const still = svg("g"), inside = svg("svg", { overflow: "hidden" }), fixed = svg("g"), moving = svg("g");
    inside.append(fixed, moving);
    drawing.append(still, inside);
    let stillKey = "", width = 0, height = 0;

    // Asked for when the panel changes, not for each curve: every question makes the browser lay out the page anew.
    function measure() {
      const before = [width, height], frame = drawing.getBoundingClientRect();
      // one that is not shown keeps its size
      width = Math.max(SMALLEST.width, Math.round(frame.width) || width || USUAL.width);
      height = Math.max(SMALLEST.height, Math.round(frame.height) || height || USUAL.height);
      return width !== before[0] || height !== before[1];
    }

    function draw(content) {
      shown = content;
      if (width === 0) measure();
      const { series } = content;
      const x = page.scale(...rangeOf("x", series), axes.x.logarithmic);
      const y = page.scale(...rangeOf("y", series), axes.y.logarithmic);
      const inner = { width: width - MARGIN.left - MARGIN.right, height: height - MARGIN.top - MARGIN.bottom };
      scales = { x, y, inner };
      const places = (one) => {
        const found = [];
        for (let k = 0; k < one.x.length; k++) {
          const [u, v] = [one.x[k], one.y[k]];
          const missing = u === null || v === null || (x.logarithmic && u <= 0) || (y.logarithmic && v <= 0);
          // far outside is outside as well, and drawn as a short number
          found.push(missing ? null : [(inner.width * x.share(u)).toFixed(1), (inner.height * (1 - Math.min(Math.max(y.share(v), -9), 9))).toFixed(1)]);
        }
        return found;
      };
      const points = series.filter((one) => one.kind === "points");
      const key = [width, height, x.low, x.high, x.logarithmic, y.low, y.high, y.logarithmic, content.xLabel, ...points.map((one) => one.name)].join(" ");
      if (key !== stillKey) {
        stillKey = key;
        drawAxes(x, y, inner, width, content.xLabel ?? axes.x.label);
        fixed.replaceChildren(...points.map((one) => symbols(one, places(one))));
      }
      moving.replaceChildren(...series.filter((one) => one.kind !== "points").map((one) => line(one, places(one))));
      drawing.setAttribute("aria-label", `${options.title}. ${content.summary ?? ""}`);
    }

    function drawAxes(x, y, inner, width, label) {
      const parts = [];
      for (const value of page.ticks(x.low, x.high, x.logarithmic, inner.width / 85)) {
        const at = (MARGIN.left + inner.width * x.share(value)).toFixed(1);
        parts.push(svg("line", { class: "grid", x1: at, x2: at, y1: MARGIN.top, y2: MARGIN.top + inner.height }));
        parts.push(svg("text", { class: "tick", x: at, y: height - MARGIN.bottom + 17, "text-anchor": "middle" }, page.format(value, 3)));
      }
      for (const value of page.ticks(y.low, y.high, y.logarithmic, Math.min(5, inner.height / 30))) {
        const at = (MARGIN.top + inner.height * (1 - y.share(value))).toFixed(1);
        parts.push(svg("line", { class: "grid", x1: MARGIN.left, x2: width - MARGIN.right, y1: at, y2: at }));
        parts.push(svg("text", { class: "tick", x: MARGIN.left - 7, y: Number(at) + 4, "text-anchor": "end" }, page.format(value, 3)));
      }
      parts.push(svg("text", { class: "axis", x: MARGIN.left + inner.width / 2, y: height - 8, "text-anchor": "middle" }, label));
      parts.push(svg("text", { class: "axis", transform: `translate(14 ${MARGIN.top + inner.height / 2}) rotate(-90)`, "text-anchor": "middle" }, axes.y.label.length * LETTER > inner.height + MARGIN.top ? axes.y.short ?? axes.y.label : axes.y.label));
      still.replaceChildren(...parts);
      for (const [name, value] of Object.entries({ x: MARGIN.left, y: MARGIN.top, ...inner })) inside.setAttribute(name, value);
      drawing.setAttribute("viewBox", `0 0 ${width} ${height}`);
    }

    function line(one, places) {
      let path = "", pen = "M";
      for (const place of places) {
        if (place === null) { pen = "M"; continue; }
        path += `${pen}${place[0]} ${place[1]}`;
        pen = "L";
      }
      const drawn = svg("path", { class: `line ${one.style ?? ""}`, d: path });
      drawn.style.stroke = one.colour;
      return drawn;
    }

    function symbols(one, places) {
      // every symbol in one path: hundreds of frames cost as much as one
      const r = one.large ? 5 : 2.6;
      const path = places.filter((place) => place !== null).map(([u, v]) => page.symbol(one.name, u, v, r)).join("");
      const drawn = svg("path", { class: `points ${one.style ?? ""}`, d: path });
      drawn.style.stroke = drawn.style.fill = one.colour;
      return drawn;
    }

    drawing.addEventListener("pointermove", (event) => {
      if (scales === null) return;
      const frame = drawing.getBoundingClientRect();
      const u = (event.clientX - frame.left - MARGIN.left) / scales.inner.width;
      const v = 1 - (event.clientY - frame.top - MARGIN.top) / scales.inner.height;
      const outside = u < 0 || u > 1 || v < 0 || v > 1;
      readout.textContent = outside ? "" : `${page.format(scales.x.value(u), 3)}, ${page.format(scales.y.value(v), 3)}`;
    });
    drawing.addEventListener("pointerleave", () => (readout.textContent = ""));
    new ResizeObserver(() => { if (measure()) draw(shown); }).observe(panel);
    return { panel, draw, heading };
  };
})((globalThis.creepkitPage ??= {}));
