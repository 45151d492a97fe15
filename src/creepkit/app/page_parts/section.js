"use strict";
// The deformed section of a body of revolution, coloured by stress, over its outline at rest.
(function (page) {
  const { element, svg } = page;
  // viridis at nine places
  const COLOURS = [[68, 1, 84], [72, 40, 120], [62, 74, 137], [49, 104, 142], [38, 130, 142], [31, 158, 137], [53, 183, 121], [110, 206, 88], [253, 231, 37]];

  const SHADES = 24;

  function colourOf(share) {
    const place = Math.min(Math.max(share, 0), 1) * (COLOURS.length - 1), k = Math.min(Math.floor(place), COLOURS.length - 2);
    return `rgb(${COLOURS[k].map((low, i) => Math.round(low + (place - k) * (COLOURS[k + 1][i] - low))).join(",")})`;
  }

  page.section = function () {
    const drawing = svg("svg", { role: "img", class: "section" });
    const moment = element("input", { type: "range", min: 0, max: 7, step: 1, value: 7, "aria-label": "time of the section" });
    const words = element("output", { class: "readout" });
    const legend = element("div", { class: "legend" });
    const panel = element("figure", { class: "panel" }, element("figcaption", {}, element("h3", {}, element("span", { class: "name" }, "Deformed section"))), drawing, legend, element("label", { class: "row" }, "time ", moment, words));
    let shown = null, colours = null, width = 0;

    // Sides that belong to one element alone, but for the axis; those of one mesh are found once.
    let outlined = { text: "", sides: [] };
    function outlineSides(data) {
      const text = `${data.nodes.length} ${data.elements.length} ${data.nodes.slice(0, 8)}`;
      if (outlined.text === text) return outlined.sides;
      const count = new Map();
      for (const sides of data.elements) {
        for (let k = 0; k < 8; k += 2) {
          const [a, m, b] = [sides[k], sides[k + 1], sides[(k + 2) % 8]];
          const key = a < b ? `${a} ${b}` : `${b} ${a}`;
          count.set(key, count.has(key) ? null : [a, m, b]);
        }
      }
      outlined = { text, sides: [...count.values()].filter((side) => side !== null && !side.every((n) => Math.abs(data.nodes[2 * n]) < 1e-9)) };
      return outlined.sides;
    }
    const outlinePath = (data, place) => outlineSides(data).map((side) => "M" + side.map((n) => place(n).join(" ")).join("L")).join("");

    function draw(data) {
      shown = data;
      moment.max = data.times.length - 1;
      const k = Math.min(Number(moment.value), data.times.length - 1);
      // a reduced-order model says nothing of stresses: the colours stay as they were
      if (data.stress !== null) colours = data.stress;
      const moves = data.at(k), stress = colours?.[k]?.length === data.elements.length ? colours[k] : data.elements.map(() => 0);
      if (width === 0) width = Math.max(200, panel.clientWidth - 20);
      let reach = 0, top = -Infinity, bottom = Infinity;
      for (let n = 0; n < data.nodes.length / 2; n++) {
        reach = Math.max(reach, data.nodes[2 * n] + Math.max(0, moves[2 * n]));
        for (const z of [data.nodes[2 * n + 1], data.nodes[2 * n + 1] + moves[2 * n + 1]]) { top = Math.max(top, z); bottom = Math.min(bottom, z); }
      }
      let size = (width - 10) / (2 * reach);
      size = Math.min(size, 320 / (top - bottom || 1));
      const height = (top - bottom) * size + 12, middle = width / 2;
      const low = Math.min(...stress), high = Math.max(...stress);
      const pieces = [], lines = [];
      for (const side of [1, -1]) {
        const rest = (n) => [(middle + side * size * data.nodes[2 * n]).toFixed(1), (6 + size * (top - data.nodes[2 * n + 1])).toFixed(1)];
        const moved = (n) => [(middle + side * size * (data.nodes[2 * n] + moves[2 * n])).toFixed(1), (6 + size * (top - data.nodes[2 * n + 1] - moves[2 * n + 1])).toFixed(1)];
        data.elements.forEach((sides, e) => {
          const shade = colours === null ? 0 : Math.round(((stress[e] - low) / (high - low || 1)) * SHADES);
          pieces[shade] = (pieces[shade] ?? "") + "M" + sides.map((n) => moved(n).join(" ")).join("L") + "Z";
        });
        lines.push(svg("path", { class: "rest", d: outlinePath(data, rest) }), svg("path", { class: "moved", d: outlinePath(data, moved) }));
      }
      // elements of one shade as one path: fewer to draw while a slider moves
      const filled = Object.entries(pieces).map(([shade, d]) => {
        const piece = svg("path", { d });
        piece.style.fill = piece.style.stroke = colours === null ? "var(--band)" : colourOf(shade / SHADES);
        return piece;
      });
      drawing.replaceChildren(...filled, ...lines);
      drawing.setAttribute("viewBox", `0 0 ${width} ${height.toFixed(0)}`);
      drawing.setAttribute("aria-label", `Deformed section at ${page.duration(data.times[k])}` + (data.stress === null ? "" : `, von Mises stress ${page.format(low, 3)} to ${page.format(high, 3)} MPa`));
      legend.classList.toggle("waiting", data.stress === null && colours !== null);
      if (colours === null) legend.replaceChildren("dashed: at rest; true to scale");
      else legend.replaceChildren(`${page.format(low, 3)}`, element("span", { class: "colours", "aria-hidden": "true" }), `${page.format(high, 3)} MPa, von Mises; dashed: at rest; true to scale`);
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
