"use strict";
// A chart in SVG: curves and measured points over a linear or logarithmic axis, redrawn as a whole.
(function (page) {
  const { element, svg } = page;
  const MARGIN = { left: 66, right: 14, top: 10, bottom: 44 };
  const HEIGHT = 270;

  // options: title, x and y {label, logarithmic, choice}, note
  page.chart = function (options) {
    const drawing = svg("svg", { role: "img", height: HEIGHT, class: "chart" });
    const readout = element("output", { class: "readout" });
    const heading = element("h3", {}, options.title);
    const switches = element("span", { class: "switches" });
    const panel = element("figure", { class: "panel" }, element("figcaption", {}, heading, switches), drawing, readout);
    const axes = { x: { ...options.x }, y: { ...options.y } };
    let shown = { series: [], keep: [] };
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

    function rangeOf(key, series) {
      const { logarithmic } = axes[key];
      let low = Infinity, high = -Infinity;
      for (const one of series) {
        if (one.faint || one.ignoreRange) continue;
        for (const value of one[key]) {
          if (value === null || (logarithmic && value <= 0)) continue;
          if (value < low) low = value;
          if (value > high) high = value;
        }
      }
      if (!(low <= high)) return logarithmic ? [1, 10] : [0, 1];
      if (logarithmic) {
        if (key === "y") low = Math.max(low, high * 1e-6);
        if (key === "x") low = Math.max(low, high * 1e-4);
        return high / low < 1.3 ? [low / 1.5, high * 1.5] : key === "y" ? [low / 1.2, high * 1.2] : [low, high];
      }
      if (key === "x") return [Math.min(0, low), high || 1];
      const reach = high - low;
      // from zero, unless that would hide what changes
      if (low > 0 && reach > 0.35 * high) low = 0;
      else if (reach === 0) return [Math.min(0, low * 0.9), (high || 1) * 1.1];
      else low = low === 0 ? 0 : low - 0.08 * reach;
      return [low, high + 0.08 * reach];
    }

    function draw(content) {
      shown = content;
      const width = Math.max(260, panel.clientWidth - 20 || 520);
      const { series } = content;
      const x = page.scale(...rangeOf("x", series), axes.x.logarithmic);
      const y = page.scale(...rangeOf("y", series), axes.y.logarithmic);
      const inner = { width: width - MARGIN.left - MARGIN.right, height: HEIGHT - MARGIN.top - MARGIN.bottom };
      const placeX = (value) => MARGIN.left + inner.width * x.share(value);
      const placeY = (value) => MARGIN.top + inner.height * (1 - y.share(value));
      scales = { x, y, inner };
      const parts = [];
      for (const value of page.ticks(x.low, x.high, x.logarithmic, inner.width / 85)) {
        const at = placeX(value).toFixed(1);
        parts.push(svg("line", { class: "grid", x1: at, x2: at, y1: MARGIN.top, y2: MARGIN.top + inner.height }));
        parts.push(svg("text", { class: "tick", x: at, y: HEIGHT - MARGIN.bottom + 17, "text-anchor": "middle" }, page.format(value, 3)));
      }
      for (const value of page.ticks(y.low, y.high, y.logarithmic, 5)) {
        const at = placeY(value).toFixed(1);
        parts.push(svg("line", { class: "grid", x1: MARGIN.left, x2: width - MARGIN.right, y1: at, y2: at }));
        parts.push(svg("text", { class: "tick", x: MARGIN.left - 7, y: Number(at) + 4, "text-anchor": "end" }, page.format(value, 3)));
      }
      parts.push(svg("text", { class: "axis", x: MARGIN.left + inner.width / 2, y: HEIGHT - 8, "text-anchor": "middle" }, content.xLabel ?? axes.x.label));
      parts.push(svg("text", { class: "axis", transform: `translate(14 ${MARGIN.top + inner.height / 2}) rotate(-90)`, "text-anchor": "middle" }, axes.y.label));
      const inside = svg("svg", { x: MARGIN.left, y: MARGIN.top, width: inner.width, height: inner.height, overflow: "hidden" });
      const shift = (value, origin) => (value - origin).toFixed(1);
      for (const one of series) {
        const places = [];
        for (let k = 0; k < one.x.length; k++) {
          const [u, v] = [one.x[k], one.y[k]];
          const missing = u === null || v === null || (x.logarithmic && u <= 0) || (y.logarithmic && v <= 0);
          places.push(missing ? null : [shift(placeX(u), MARGIN.left), shift(placeY(v), MARGIN.top)]);
        }
        inside.append(one.kind === "points" ? points(one, places) : line(one, places));
      }
      drawing.replaceChildren(...parts, inside);
      drawing.setAttribute("width", width);
      drawing.setAttribute("viewBox", `0 0 ${width} ${HEIGHT}`);
      drawing.setAttribute("aria-label", `${options.title}. ${content.summary ?? ""}`);
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

    function points(one, places) {
      // every symbol in one path: hundreds of frames cost as much as one
      const r = one.large ? 5 : 2.6;
      const path = places.filter((place) => place !== null).map(([u, v]) => `M${u - r} ${v}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0`).join("");
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
    new ResizeObserver(() => draw(shown)).observe(panel);
    return { panel, draw, heading };
  };
})((globalThis.creepkitPage ??= {}));
