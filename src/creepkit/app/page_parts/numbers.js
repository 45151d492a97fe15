"use strict";
// Numbers as people read them, scales of sliders and axes, and units of time.
(function (page) {
  const SUPERSCRIPTS = { "-": "\u207b", 0: "\u2070", 1: "\u00b9", 2: "\u00b2", 3: "\u00b3", 4: "\u2074", 5: "\u2075", 6: "\u2076", 7: "\u2077", 8: "\u2078", 9: "\u2079" };
  const MINUS = "\u2212";

  page.superscript = (exponent) => [...String(exponent)].map((c) => SUPERSCRIPTS[c]).join("");

  // A number to be read: 0.0123, 12300, 1.23·10⁻¹⁶.
  page.format = function (value, digits = 4) {
    if (value === null || value === undefined || !Number.isFinite(value)) return "\u2013";
    if (value === 0) return "0";
    const size = Math.abs(value);
    if (size >= 1e-3 && size < 1e5) return String(Number(value.toPrecision(digits))).replace("-", MINUS);
    const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
    const head = String(Number(mantissa)).replace("-", MINUS);
    const power = "10" + page.superscript(Number(exponent));
    return head === "1" ? power : `${head}\u00b7${power}`;
  };

  // Digits by which two numbers and those between them are told apart, at least three.
  page.digitsBetween = function (low, high) {
    const size = Math.max(Math.abs(low), Math.abs(high)), apart = Math.abs(high - low);
    return apart > 0 && Number.isFinite(size / apart) ? Math.min(Math.max(3, Math.ceil(Math.log10(size / apart)) + 2), 12) : 3;
  };

  // A number to be typed and copied: 1.23e-16.
  page.plain = function (value, digits = 6) {
    if (value === 0) return "0";
    const size = Math.abs(value);
    return size >= 1e-3 && size < 1e6 ? String(Number(value.toPrecision(digits))) : value.toExponential(digits - 1).replace(/\.?0*e/, "e");
  };

  // A scale from values to shares 0 to 1, and back.
  page.scale = function (low, high, logarithmic) {
    const [to, from] = logarithmic ? [Math.log, Math.exp] : [(v) => v, (v) => v];
    const start = to(low), width = to(high) - start || 1;
    return {
      low, high, logarithmic,
      share: (value) => (to(Math.max(value, logarithmic ? Number.MIN_VALUE : -Infinity)) - start) / width,
      value: (share) => from(start + share * width),
    };
  };

  const STEPS = [1, 2, 2.5, 5, 10];
  // Places of about `count` ticks.
  page.ticks = function (low, high, logarithmic, count = 5) {
    if (logarithmic) {
      const first = Math.ceil(Math.log10(low) - 1e-9), last = Math.floor(Math.log10(high) + 1e-9);
      const every = Math.max(1, Math.ceil((last - first) / count));
      const powers = [];
      for (let k = first; k <= last; k += every) powers.push(10 ** k);
      if (powers.length > 2) return powers;
      const all = [];
      for (let k = first - 1; k <= last; k++) for (const m of [1, 2, 5]) all.push(Number(`${m}e${k}`));
      const inside = all.filter((v) => v >= low * (1 - 1e-9) && v <= high * (1 + 1e-9));
      return inside.length > 1 ? inside : page.ticks(low, high, false, count);
    }
    const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough));
    const step = power * STEPS.find((s) => s * power >= rough * 0.999);
    const places = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high * (1 + 1e-12) + 1e-9 * step; k++) places.push(Number((k * step).toPrecision(12)));
    return places;
  };

  const UNITS = [[200, "s", 1], [3600, "min", 60], [3.6e7, "h", 3600], [Infinity, "years", 31557600]];
  // The unit in which a duration is read most easily.
  page.timeUnit = function (seconds) {
    const [, name, size] = UNITS.find(([most]) => seconds < most) ?? UNITS[0];
    return { name, size };
  };

  page.duration = function (seconds) {
    const unit = page.timeUnit(seconds);
    return `${page.format(seconds / unit.size, 3)} ${unit.name}`;
  };
})((globalThis.creepkitPage ??= {}));
