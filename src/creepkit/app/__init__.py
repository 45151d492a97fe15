"""The interactive page: data packed for it, and the runtime that computes in it without a server.

The runtime is the core compiled for WebAssembly and plain scripts (`runtime_files.runtime_script()`) that put their
functions into one object, `globalThis.creepkit`; they may be called when the promise `creepkit.ready` is fulfilled. A
law comes to it as the JavaScript that `exporters.javascript` writes: in a page as an expression
(`documents.law_data(...)["source"]`), in node as the module itself. Units: MPa, mm, s, K.

    const law = <source>;                       // {law, rate, terms, stateRates, kernel}
    creepkit.simulateCreep(law, {n: 5}, {       // parameters by name; those left out keep the values of the source
      stress: 100,                              // a number, or pairs [[time, MPa], ...] joined by straight lines, two
                                                // pairs of one time being a jump; such pairs from steps:
                                                // creepkit.steps([[0, 80], [3600, 100]], ramp)
      times: [...],                             // s, at which results are wanted
      temperature: 1073,                        // K, a number or pairs; needed where law.law.variables has it
      control: "load" | "stress",               // constant load (default) or constant true stress
      elastic: {modulus: 150e3},                // optional: the strain then includes stress/E; or pairs [[K, MPa], ...]
      strainMeasure: "logarithmic" | "engineering",
      tolerance: 1e-5, strainLimit: 1, maxSteps: 2000,
    }) -> {times, strain, creepStrain, stress, rate: arrays (frames), NaN after the end;
           states: {name: array}; status: "complete" | "ruptured" | "not converged", endTime, ruptureTime | null,
           reason: words, steps}
    creepkit.simulateRelaxation(law, {}, {strain: program, elastic: {modulus}, times, temperature})
        -> {times, stress, creepStrain, rate, states, status, endTime, ruptureTime, reason, steps}
    creepkit.rateCurve(law, {}, {stresses: [...], strain, time, temperature, states: {}})
        -> {stresses, rate, terms: {name: array}}
    creepkit.simulateDimple(law, {}, rom, {     // rom : JSON.parse of models.rom_data(predictor), kept
      pressure: [[0, 0], [5, 8], [14400, 8], [14405, 10]],          // MPa, a program as above
      elastic: {modulus: 150e3, poisson: 0.3}, temperature: 1073, times: [...],
      fast: true,                               // 16 modes and longer steps, as in a global search: while dragging
      maxSteps: 1000,                           // with rejected ones; caps the cost of a dimple that bursts at once
    }) -> {times, outputs: {amplitude, width: mm, shape}, placesAt(time): r and z in mm of all nodes, one after another,
           contour: [numbers of the nodes of the outline, from axis to axis], status, endTime, ruptureTime, reason,
           steps}

Mistakes in what is given are RangeErrors of one sentence. Programs, stresses and ends are those of the specimens
`uniaxial`, `relaxation` and `bulge`.
"""
