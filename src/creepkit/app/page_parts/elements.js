"use strict";
// Elements of HTML and SVG. Whatever comes from data goes in as text, never as markup.
(function (page) {
  const SVG = "http://www.w3.org/2000/svg";

  // element("label", { class: "row", for: id, onclick: f }, child, "text", ...)
  page.element = function (name, attributes = {}, ...children) {
    const made = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) {
      if (value === null || value === undefined || value === false) continue;
      if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
      else made.setAttribute(key, value === true ? "" : value);
    }
    made.append(...children.filter((child) => child !== null && child !== undefined));
    return made;
  };

  page.svg = function (name, attributes = {}, ...children) {
    const made = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) if (value !== null) made.setAttribute(key, value);
    made.append(...children);
    return made;
  };

  // Equations are MathML that creepkit printed from symbols; they are read as XML, where nothing runs.
  page.math = function (text) {
    const root = new DOMParser().parseFromString(text, "application/xml").documentElement;
    return root.localName === "math" ? document.importNode(root, true) : document.createTextNode("");
  };

  let count = 0;
  page.identifier = (stem) => `creepkit-${stem}-${++count}`;

  // The colour of a curve: the plan's own, or that of a test by its number.
  const COLOURS = 12; // of tests, in the style
  page.colour = (k) => (k === null ? "var(--plan)" : `var(--curve-${k % COLOURS})`);

  // The path of the symbol of a test with its middle at (u, v): the tests beyond the colours have other shapes.
  const SHAPES = [
    (u, v, r) => `M${u - r} ${v}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0`,
    (u, v, r) => `M${u - r} ${v - r}h${2 * r}v${2 * r}h${-2 * r}Z`,
    (u, v, r) => `M${u} ${v - 1.3 * r}l${1.3 * r} ${2.3 * r}h${-2.6 * r}Z`,
    (u, v, r) => `M${u} ${v - 1.4 * r}l${1.4 * r} ${1.4 * r}l${-1.4 * r} ${1.4 * r}l${-1.4 * r} ${-1.4 * r}Z`,
    (u, v, r) => `M${u} ${v + 1.3 * r}l${1.3 * r} ${-2.3 * r}h${-2.6 * r}Z`,
  ];
  page.symbol = (k, u, v, r) => SHAPES[Math.floor(k / COLOURS) % SHAPES.length](Number(u), Number(v), r);
})((globalThis.creepkitPage ??= {}));
