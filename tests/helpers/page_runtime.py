"""The runtime of the page in node, with laws at values at which they creep visibly."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import creepkit as ck
from creepkit.app.documents import law_data
from creepkit.app.runtime_files import runtime_script
from creepkit.errors import SolveError
from creepkit.kernels.log_form import log_form
from creepkit.language import CreepLaw
from creepkit.records import Program
from helpers.javascript import run_in_node

RUN = """
import vm from "node:vm";
vm.runInThisContext(await readFile("runtime.js", "utf8"));
await creepkit.ready;
async function main({ cases, data, then }) {
  return cases.map(([source, call, values, options]) => {
    try {
      const given = data === null ? [options] : [data, options];
      const found = creepkit[call](vm.runInThisContext(source), values, ...given);
      return then ? { ...found, ...vm.runInThisContext(then)(found) } : found;
    } catch (error) {
      return String(error);
    }
  });
}
"""


Case = tuple[CreepLaw, str, dict[str, float], dict[str, Any]]
"""A law, a function of the runtime, {parameter: value}, options."""


def in_page(folder: Path, cases: Sequence[Case], data: Any = None, then: str = "") -> Any:
    """Results of cases, all in one process; those of mistakes are texts.

    data : of the reduced-order model. then : a function of a result, in JavaScript, whose fields are added to it.
    """
    given = [[law_data(law)["source"], call, values, options] for law, call, values, options in cases]
    return run_in_node(folder, RUN, {"cases": given, "data": data, "then": then}, {"runtime.js": runtime_script()})


def values_that_creep(
    law: CreepLaw, stress: float, goal: float = 0.02, duration: float = 1e5, T: float = 1073.0
) -> dict[str, float]:
    """The middle of the bounds, every term multiplied so that the strain at `duration`, s, is about `goal`."""
    values = law.center()
    if "s_0" in values:  # a threshold, below which nothing creeps
        values["s_0"] = 0.5 * stress
    coefficients = {law.names[positions[0]] for positions in log_form(law).coefficients if positions}
    coefficients |= {n for n, p in law.table.items() if p.scale == "log" and p.unit == "1/s"}  # of states too
    for _ in range(40):
        loading = ck.constant_stress(stress)
        try:
            run = ck.simulate(law, "uniaxial", values, loading=loading, times=[duration], temperature=T)
            found = float(run.outputs["strain"][-1])
        except SolveError:  # burst before
            found = 10.0
        if 0.2 * goal < found < 5 * goal or not coefficients:
            break
        factor = float(np.clip((goal / max(found, 1e-30)) ** 0.7, 1e-8, 1e8))
        values |= {n: min(values[n] * factor, 1e40) for n in coefficients}
    return values


def pairs(program: Program) -> list[list[float]]:
    """A program as the runtime takes it."""
    return [list(pair) for pair in zip(program.times.tolist(), program.values.tolist(), strict=True)]
