"use strict";
// The deformed section of a body of revolution over its contour at rest.
(function (page) {
  const { element, svg } = page;
  const HIGHEST = 320, MARGIN = 6; // pixels

  page.section = function () {
    const drawing = svg("svg", { role: "img", class: "section" });
    const moment = element("input", { type: "range", min: 0, max: 7, step: 1, value: 7, "aria-label": "time of the section" });
    const words = element("output", { class: "readout" });
    const title = element("figcaption", {}, element("h3", {}, element("span", { class: "name" }, "Deformed section")));
    const legend = element("div", { class: "legend" }, "dashed: at rest; true to scale");
    const panel = element("figure", { class: "panel" }, title, drawing, legend, element("label", { class: "row" }, "time ", moment, words));
    let shown = null, width = 0;

    // data : {times, at(k): r and z of the nodes in mm at a time or, without one, at rest; contour: nodes from axis to axis}
    function draw(data) {
      shown = data;
      moment.max = data.times.length - 1;
      const k = Math.min(Number(moment.value), data.times.length - 1), rest = data.at(null), moved = data.at(k);
      if (width === 0) width = Math.max(200, panel.clientWidth - 20);
      const heights = data.contour.flatMap((n) => [rest[2 * n + 1], moved[2 * n + 1]]), top = Math.max(...heights);
      const reach = Math.max(...data.contour.flatMap((n) => [rest[2 * n], moved[2 * n]])), tall = top - Math.min(...heights);
      const size = Math.min((width - 10) / (2 * reach), HIGHEST / (tall || 1));
      const contour = (places, style) => {
        const point = (n, side) => `${(width / 2 + side * size * places[2 * n]).toFixed(1)} ${(MARGIN + size * (top - places[2 * n + 1])).toFixed(1)}`;
        const around = [...data.contour.map((n) => point(n, 1)), ...data.contour.toReversed().map((n) => point(n, -1))];
        return svg("path", { class: style, d: `M${around.join("L")}Z` });
      };
      drawing.replaceChildren(contour(moved, "moved"), contour(rest, "rest"));
      drawing.setAttribute("viewBox", `0 0 ${width} ${(tall * size + 2 * MARGIN).toFixed(0)}`);
      drawing.setAttribute("aria-label", `Deformed section at ${page.duration(data.times[k])}`);
      words.textContent = page.duration(data.times[k]);
    }

    moment.addEventListener("input", () => shown && draw(shown));
    new ResizeObserver(() => {
      width = 0;
      if (shown) draw(shown);
    }).observe(panel);
    return { panel, draw };
  };
})((globalThis.creepkitPage ??= {}));
