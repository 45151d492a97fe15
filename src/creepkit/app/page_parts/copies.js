"use strict";
// Values as text to take along: JSON, LaTeX and a command line.
(function (page) {
  const { element } = page;

  function asJson(state, law) {
    return JSON.stringify({ law: law.name, values: state.values }, null, 1);
  }

  function latexNumber(value) {
    const [mantissa, exponent] = page.plain(value).split("e");
    return exponent === undefined ? mantissa : `${mantissa} \\times 10^{${Number(exponent)}}`;
  }

  function asLatex(state, law) {
    const unit = (parameter) => (parameter.latex_unit ? "\\," + parameter.latex_unit : "");
    const values = law.parameters.map((p) => `${p.latex} &= ${latexNumber(state.values[p.name])}${unit(p)}`);
    return ["\\begin{align}", [...law.latex.map((row) => row.replace(" = ", " &= ")), ...values].join(" \\\\\n"), "\\end{align}"].join("\n");
  }

  const quoted = (word) => (/^[\w.=:+/-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`);

  function asCommand(state, law) {
    const words = ["creepkit", "simulate", law.name];
    for (const [name, value] of Object.entries(state.values)) words.push("--set", `${name}=${page.plain(value, 8)}`);
    words.push("--specimen", state.specimen.name);
    const option = "--" + state.load.name.replaceAll("_", "-");
    state.steps.forEach(([start, value], k) => words.push(option, k === 0 ? page.plain(value) : `${page.plain(start)}:${page.plain(value)}`));
    if (state.load.control) words.push("--control", state.control);
    else if (state.ramp !== state.load.ramp) words.push("--ramp", page.plain(state.ramp));
    words.push("--end-h", page.plain(state.end / 3600));
    if (law.variables.includes("temperature")) words.push("--temperature-c", page.plain(state.temperature - 273.15, 8));
    if (state.specimen.modulus.needed) words.push("--modulus-gpa", page.plain(state.modulus / 1e3));
    return words.map(quoted).join(" ");
  }

  async function toClipboard(area) {
    try {
      await navigator.clipboard.writeText(area.value);
    } catch {
      area.select(); // a page without the right to the clipboard leaves the text selected
      document.execCommand?.("copy");
    }
  }

  page.copies = function (read) {
    const area = element("textarea", { readonly: true, rows: 4, "aria-label": "text to copy", hidden: true, spellcheck: "false" });
    const said = element("span", { class: "said", role: "status" });
    const button = (words, text) =>
      element("button", {
        type: "button",
        onclick: async () => {
          const { state, law } = read();
          area.hidden = false;
          area.value = text(state, law);
          await toClipboard(area);
          said.textContent = `${words} copied`;
        },
      }, words);
    return element(
      "fieldset", {}, element("legend", {}, "Copy the values"),
      element("div", { class: "buttons" }, button("JSON", asJson), button("LaTeX", asLatex), button("Command line", asCommand), said), area,
    );
  };
})((globalThis.creepkitPage ??= {}));
