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
  page.colour = (k) => (k === null ? "var(--plan)" : `var(--curve-${k % 8})`);
})((globalThis.creepkitPage ??= {}));
