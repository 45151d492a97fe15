// Prediction of a test by a recurrent network of a law (surrogates/network_evaluation.py): its frames, and between them
// straight lines in time. Its arrays come packed from creepkit.app.network_data.network_data.
"use strict";

(function (creepkit) {
  const unpackedNetworks = new WeakMap();

  function unpacked(data) {
    if (!unpackedNetworks.has(data)) {
      const arrays = (given) => Object.fromEntries(Object.entries(given).map(([name, packed]) => [name, creepkit.decode(packed)]));
      unpackedNetworks.set(data, { layers: data.layers.map(arrays), ...arrays(data.arrays) });
    }
    return unpackedNetworks.get(data);
  }

  /** out += values times weights (inputs, out.length), from row `first` of the weights on. */
  function addProduct(out, values, weights, first) {
    const width = out.length;
    for (let i = 0; i < values.length; i += 1) {
      const value = values[i];
      for (let j = 0, w = (first + i) * width; j < width; j += 1, w += 1) out[j] += value * weights[w];
    }
  }

  function standardised(values, mean, deviation) {
    return Float64Array.from(values, (value, k) => (Number.isNaN(value) ? 0.0 : (value - mean[k]) / deviation[k]));
  }

  /** The next h of a GRU from W_in x + b_in; weights of sigmoid gates are halved. */
  function gruStep(layer, inputs, state) {
    const { h } = state, hidden = h.length, back = Float64Array.from(layer.hiddenBias);
    addProduct(back, h, layer.hiddenWeights, 0);
    for (let k = 0; k < hidden; k += 1) {
      const r = 0.5 + 0.5 * Math.tanh(inputs[k] + back[k]);
      const z = 0.5 + 0.5 * Math.tanh(inputs[hidden + k] + back[hidden + k]);
      const n = Math.tanh(inputs[2 * hidden + k] + r * back[2 * hidden + k]);
      h[k] = n + z * (h[k] - n);
    }
  }

  function lstmStep(layer, inputs, state) {
    const { h, c } = state, hidden = h.length, pre = Float64Array.from(inputs, (value, j) => value + layer.hiddenBias[j]);
    addProduct(pre, h, layer.hiddenWeights, 0);
    const gate = (part, k) => 0.5 + 0.5 * Math.tanh(pre[part * hidden + k]);
    for (let k = 0; k < hidden; k += 1) {
      c[k] = gate(1, k) * c[k] + gate(0, k) * Math.tanh(pre[2 * hidden + k]);
      h[k] = gate(3, k) * Math.tanh(c[k]);
    }
  }

  /** Outputs of all frames in physical units, (frames, outputs). */
  function evaluate(data, constants, series) {
    const arrays = unpacked(data), { layers } = arrays, step = data.cell === "gru" ? gruStep : lstmStep;
    const fixed = standardised(constants, arrays.constantMean, arrays.constantDeviation);
    const constantPart = Float64Array.from(layers[0].inputBias);
    addProduct(constantPart, fixed, layers[0].inputWeights, 0);
    const states = layers.map(() => ({ h: new Float64Array(data.hidden), c: new Float64Array(data.hidden) }));
    return series.map((row) => {
      let inputs = constantPart.slice();
      addProduct(inputs, standardised(row, arrays.seriesMean, arrays.seriesDeviation), layers[0].inputWeights, fixed.length);
      layers.forEach((layer, k) => {
        if (k > 0) {
          inputs = Float64Array.from(layer.inputBias);
          addProduct(inputs, states[k - 1].h, layer.inputWeights, 0);
        }
        step(layer, inputs, states[k]);
      });
      const out = Float64Array.from(arrays.headBias);
      addProduct(out, states[states.length - 1].h, arrays.headWeights, 0);
      out.forEach((value, k) => (out[k] = value * arrays.targetDeviation[k] + arrays.targetMean[k]));
      if (data.logarithm) out[0] = Math.exp(Math.min(out[0], data.most)) - data.floor;
      return out;
    });
  }

  /** Columns that stand for the parameters: log10 on a log scale, NaN where a coefficient is off, and whether it is. */
  function lawColumns(data, values) {
    const columns = data.parameters.map(({ scale }, k) => {
      if (scale !== "log") return values[k];
      return values[k] > 0.0 ? Math.log10(values[k]) : NaN;
    });
    const off = data.parameters.flatMap((p, k) => (p.switchable ? [values[k] > 0.0 ? 0.0 : 1.0] : []));
    return [...columns, ...off];
  }

  /** Inputs at the frames: the load, its mean since the frame before, log10 of 1 s + the time and + the step. */
  function seriesRows(names, load, frames) {
    const pieces = creepkit.segments([load], Math.max(frames[frames.length - 1], 1e-300));
    const integral = (time) => pieces.reduce((total, [start, end, first, last]) => {
      const reach = Math.min(time, end) - start;
      if (!(reach > 0.0)) return total;
      return total + reach * (first + (0.5 * (last - first) * reach) / (end - start));
    }, 0.0);
    let before = 0.0, held = 0.0;
    return frames.map((time) => {
      const now = integral(time), step = time - before;
      const values = {
        load: creepkit.valueAt(load, time),
        mean_load: step > 0.0 ? (now - held) / step : creepkit.valueAt(load, time),
        time: Math.log10(1.0 + time),
        step: Math.log10(1.0 + step),
      };
      before = time;
      held = now;
      return names.map((name) => values[name]);
    });
  }

  /** Predict a test by the network of its law; see app/__init__.py for options and result. */
  function predictByNetwork(module, parameters, data, options) {
    const law = creepkit.bindLaw(module, parameters), times = creepkit.outputTimes(options.times);
    if (law.law.parameters.map((p) => p.name).join() !== data.parameters.map((p) => p.name).join()) {
      throw new RangeError(`the network was trained for the law ${data.law}`);
    }
    const load = creepkit.program(options.load, "the load"), given = options.constants || {};
    const constants = data.constants.map((name) => {
      const value = Object.prototype.hasOwnProperty.call(given, name) ? given[name] : data.defaults[name];
      if (typeof value !== "number") throw new RangeError(`the network needs a number for ${name} among the constants`);
      return value;
    });
    const end = times[times.length - 1];
    const frames = data.grid.relative ? data.grid.values.map((share) => share * end)
      : data.grid.values.filter((time, k) => k === 0 || data.grid.values[k - 1] < end * (1 - data.grid.rounding));
    const rows = evaluate(data, [...lawColumns(data, law.values), ...constants], seriesRows(data.series, load, frames));
    const outputs = data.outputs.map((name, k) => [name, Float64Array.from(times, (time) => between(frames, rows, time, k))]);
    return { times, outputs: Object.fromEntries(outputs), ...creepkit.ending("bar", 0, end) };
  }

  /** Linear in time between frames, constant before the first and beyond the last. */
  function between(frames, rows, time, k) {
    const after = frames.findIndex((frame) => frame >= time);
    if (after < 0) return rows[rows.length - 1][k];
    if (after === 0) return rows[0][k];
    const share = (time - frames[after - 1]) / (frames[after] - frames[after - 1]);
    return (1.0 - share) * rows[after - 1][k] + share * rows[after][k];
  }

  creepkit.predictByNetwork = predictByNetwork;
})(globalThis.creepkit);
