"""The interactive page: data packed for it, and the runtime that computes in it without a server.

The runtime is plain scripts (`runtime_files.runtime_script()`, or one by one in the order of RUNTIME_FILES) that put
their functions into one object, `globalThis.creepkit`. A law comes to it as the JavaScript that `exporters.javascript`
writes: in a page as an expression (`model_data.law_data(...)["source"]`), in node as the module itself. Units: MPa, mm,
s, K.

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
    creepkit.simulateDimple(law, {}, rom, {     // rom : JSON.parse of reduced_model_data.rom_data(predictor), kept
      pressure: [[0, 0], [5, 8], [14400, 8], [14405, 10]],          // MPa, a program as above
      elastic: {modulus: 150e3, poisson: 0.3}, temperature: 1073, times: [...],
      fast: true,                               // 16 modes and longer steps, as in a global search: while dragging
      maxSteps: 1000,                           // with rejected ones; caps the cost of a dimple that bursts at once
    }) -> {times, outputs: {amplitude, width: mm, shape}, radii: mm, profileAt(time): u_z mm of the top at those radii,
           placesAt(time): [[r, z], ...] mm of the nodes, edges: [[first, middle, last node], ...] of the outline,
           status, endTime, ruptureTime, reason, steps}
    creepkit.predictByNetwork(law, {}, network, {  // network : of network_data.network_data(surrogate)
      load: program, times: [...], constants: {modulus: 150e3, temperature: 1073, ...},  // those of network.constants
    }) -> {times, outputs: {name: array}, status, endTime, ruptureTime, reason}; of bars the logarithmic creep strain

Mistakes in what is given are RangeErrors of one sentence. Programs, stresses and ends are those of the specimens
`uniaxial`, `relaxation` and `bulge`, and the integrators are those of the core, step by step.
"""
