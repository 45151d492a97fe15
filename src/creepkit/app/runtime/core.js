// The core of creepkit in WebAssembly: laws of JavaScript that it calls, arrays in its memory, how a simulation ended.
"use strict";

globalThis.creepkit ??= {};

(function (creepkit) {
  let core = null, bound = null, points = [], outputs = []; // the law that the core calls, and where its points are

  /** Base64 of little-endian numbers, or of bytes, as a typed array. */
  function decode({ data, type }) {
    const bytes = Uint8Array.from(atob(data), (c) => c.charCodeAt(0));
    const kinds = { float64: Float64Array, float32: Float32Array, int32: Int32Array };
    return type in kinds ? new kinds[type](bytes.buffer) : bytes;
  }

  /** Start the core from {type: "gzip", data}; `creepkit.ready` is fulfilled when simulations can be asked for. */
  creepkit.load = function (packed, constants) {
    creepkit.constants = constants;
    const law = (rows) => { for (let k = 0; k < rows; k += 1) bound.update(points[k], outputs[k]); };
    const unzipped = new Blob([decode(packed)]).stream().pipeThrough(new DecompressionStream("gzip"));
    creepkit.ready ??= new Response(unzipped).arrayBuffer()
      .then((code) => WebAssembly.instantiate(code, { page: { law } }))
      .then(({ instance }) => { core = instance.exports; core._initialize(); });
  };

  /** A copy of values in the core's memory, or so many zeros; it stays there. */
  function placed(values, Kind = Float64Array) {
    const count = typeof values === "number" ? values : values.length;
    const at = core.creepkit_page_zeros(count * Kind.BYTES_PER_ELEMENT);
    if (at === 0) throw new RangeError("no memory is left; ask for fewer times or simpler programs");
    const view = new Kind(core.memory.buffer, at, count);
    if (typeof values !== "number") view.set(values);
    return view;
  }

  /** What `use(put, call)` returns; what it puts into the core's memory is taken out again. */
  function inCore(use) {
    if (core === null) throw new RangeError("the core has not started; wait for it: await creepkit.ready");
    const before = core.creepkit_page_used();
    const address = (one) => (ArrayBuffer.isView(one) ? one.byteOffset : one);
    const call = (name, ...given) => core[name](...given.map(address));
    try {
      return use(placed, call);
    } finally {
      core.creepkit_page_release(before);
    }
  }

  /** A law module with values of its parameters {name: value}; those not given are the module's own. */
  function bindLaw(module, parameters = {}) {
    const { law, kernel } = module, known = law.parameters.map((p) => p.name);
    const wrong = Object.keys(parameters).find((name) => !known.includes(name));
    if (wrong) throw new RangeError(`the law has no parameter '${wrong}'; allowed are ${known.join(", ")}`);
    const given = { ...Object.fromEntries(law.parameters.map((p) => [p.name, p.value])), ...parameters };
    const values = known.map((name) => Number(given[name]));
    const initial = law.states.map((s) => s.initial), limits = law.states.map((s) => s.limit ?? Infinity);
    return { law, values, ...kernel(values), states: law.states.length, initial, limits };
  }

  /** The same as `inCore`, with a law for the core to call. */
  function withLaw(law, use) {
    return inCore((put, call) => {
      const width = 6 + law.states, columns = (1 + law.states) * (1 + width);
      const at = call("creepkit_page_points", law.states), out = call("creepkit_page_outputs");
      if (at === 0) throw new RangeError(`the law has ${law.states} internal variables, more than the core takes`);
      const view = (start, length, k) => new Float64Array(core.memory.buffer, start + 8 * k * length, length);
      const rows = (start, length) => Array.from({ length: 8 }, (_, k) => view(start, length, k));
      [bound, points, outputs] = [law, rows(at, width), rows(out, columns)];
      return use(put, call);
    });
  }

  /** What a result says of its end; kind : "bar" or "body". */
  function ending(kind, code, time) {
    const [reason, status] = creepkit.constants[kind].endings[code];
    return { status, endTime: time, reason, ruptureTime: status === "ruptured" ? time : null };
  }

  Object.assign(creepkit, { decode, placed, inCore, withLaw, bindLaw, ending });
})(globalThis.creepkit);
