"use strict";
// How far predictions lie from measured tests: root mean square, and its ratio to the noise.
(function (page) {
  // {output: {rms, ratio, frames, squares}} of one test; predicted: {output: values at its frames}
  page.misfit = function (test, predicted) {
    const result = {};
    for (const [name, measured] of Object.entries(test.outputs)) {
      const values = predicted[name];
      if (values === undefined) continue;
      const offset = test.offset[name] ?? 0, noise = test.noise[name] ?? null;
      let sum = 0, frames = 0, lost = 0;
      measured.forEach((value, k) => {
        if (value === null) return;
        if (values[k] === null || values[k] === undefined) { lost++; return; }
        sum += (values[k] + offset - value) ** 2;
        frames++;
      });
      const rms = frames ? Math.sqrt(sum / frames) : null;
      result[name] = { rms, frames, lost, ratio: rms === null || !noise ? null : rms / noise, squares: noise ? sum / noise ** 2 : null };
    }
    return result;
  };

  // {output: rms over all frames} of several tests.
  page.together = function (misfits) {
    const sums = {};
    for (const [name, one] of misfits.flatMap((misfit) => Object.entries(misfit)).filter(([, one]) => one.frames)) {
      const [squares, frames] = sums[name] ?? [0, 0];
      sums[name] = [squares + one.frames * one.rms ** 2, frames + one.frames];
    }
    return Object.fromEntries(Object.entries(sums).map(([name, [squares, frames]]) => [name, Math.sqrt(squares / frames)]));
  };

  // The rms of residuals over their noise, of all outputs of all tests; null where no noise is known.
  page.weighted = function (misfits) {
    const known = misfits.flatMap((misfit) => Object.values(misfit)).filter((one) => one.squares !== null);
    const total = (what) => known.reduce((sum, one) => sum + one[what], 0);
    return total("frames") ? Math.sqrt(total("squares") / total("frames")) : null;
  };
})((globalThis.creepkitPage ??= {}));
