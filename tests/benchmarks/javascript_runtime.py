"""Laws in JavaScript and the runtime of the page: accuracy against 50 digits and the core, processor time and size.

    python tests/benchmarks/javascript_runtime.py [--points 128] [--write]

Needs node. Kernels: the largest relative difference of the rate, of rates of internal variables and of all derivatives
to the point from 50-digit arithmetic, at Sobol points of the full bounds and of the ranges of creep tests; where a
result cancels, up to what the last bits of the inputs make.

Simulations: values of a law are the middle of its bounds, its rates multiplied so that a bar creeps by about 2 % (for
dimples 1 %) at 100 MPa. The bar is under steps of stress with heating, the relaxation test under two steps of strain,
the dimple under a jump of pressure; compared are strain, stress, and amplitude, width and shape with those of
`uniaxial` and `relaxation` and of `ck.surrogate("dimple")`, relatively, up to the earlier end.

Processor times are those of one prediction in node after 20 others, in ms; "fast" is the coarse model while dragging.
Medians and largest numbers are those over all registered laws.
"""

import json
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from measured import Page, arguments, progress

import creepkit as ck
from creepkit.app.documents import law_data
from creepkit.app.models import rom_data
from creepkit.app.runtime_files import core_code, runtime_script
from creepkit.exporters.javascript import JavaScriptExporter, script_safe_json
from creepkit.kernels.multiprecision import MultiprecisionLaw
from creepkit.language import CreepLaw
from creepkit.records import LawWithValues, Program, RecordedLoading
from creepkit.registry import default_registry
from creepkit.testing import LawSamples, draw_samples
from creepkit.testing.parity import MultiprecisionReference

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from helpers.export_cases import Case
from helpers.javascript import run_in_node
from helpers.page_runtime import pairs, values_that_creep

TIMES = [0.0, 1.0, 60.0, 900.0, 7200.0, 1.4e4, 1.6e4, 3e4, 4.32e4]
TEMPERATURE = 1073.0
HEATED = Program(np.array([0.0, 2e4, 2.2e4]), np.array([1063.0, 1063.0, 1083.0]))
STEPS = RecordedLoading(Program.steps([(0.0, 90.0), (1.5e4, 120.0), (3e4, 60.0)]), "stress", "stress")
STRAINS = ck.StrainSteps(((0.0, 8e-4), (1.5e4, 1.2e-3)), ramp=60.0)
JUMP = ck.PressureJump(P1=7.0, P2=8.5, Tj=14400.0)
ELASTIC = ck.Elastic(150e3)

PROGRAM = """
import vm from "node:vm";
vm.runInThisContext(await readFile("runtime.js", "utf8"));
await creepkit.ready;
const WARM = 20, TIMED = 20;
function timed(call) {
  for (let k = 0; k < WARM; k += 1) call();
  const start = process.cpuUsage().user;
  for (let k = 0; k < TIMED; k += 1) call();
  return (process.cpuUsage().user - start) / (1e3 * TIMED);
}
function kernelRows(law, points, sets) {
  const size = 1 + law.law.states.length, width = points[0].length;
  return points.map((point, k) => {
    const rates = new Float64Array(size), update = new Float64Array(size * (1 + width)), own = law.kernel(sets[k]);
    own.rates(point, rates);
    own.update(point, update);
    return { rates, update };
  });
}
async function main({ rom, laws }) {
  return laws.map(({ source, points, sets, bar, relaxation, dimple }) => {
    const law = vm.runInThisContext(source);
    const creep = (o) => creepkit.simulateCreep(law, bar.values, o);
    const bulge = (o) => creepkit.simulateDimple(law, dimple.values, rom, o);
    const fast = { ...dimple.options, fast: true };
    return {
      kernel: kernelRows(law, points, sets),
      creep: creep(bar.options), relaxation: creepkit.simulateRelaxation(law, bar.values, relaxation),
      dimple: bulge(dimple.options), fast: bulge(fast),
      times: [timed(() => creep(bar.options)), timed(() => bulge(dimple.options)), timed(() => bulge(fast))],
    };
  });
}
"""


def judged(law: CreepLaw, count: int) -> Case:
    """The law at Sobol points, with own values at each, in 50 digits."""
    drawn = draw_samples(law, count, seed=5)
    sets = [{n: p.from_internal(t) for (n, p), t in zip(law.table.items(), row, strict=True)} for row in drawn.theta]
    again = np.array([[p.to_internal(values[n]) for n, p in law.table.items()] for values in sets])
    samples = LawSamples(drawn.points, again.reshape(len(sets), -1))
    return Case(law, samples, sets, MultiprecisionReference(MultiprecisionLaw(law), samples))


def options(**more: Any) -> dict[str, Any]:
    return {"times": TIMES, "elastic": {"modulus": 150e3, "poisson": 0.3}, **more}


def given_of(law: CreepLaw, case: Case) -> dict[str, Any]:
    values = values_that_creep(law, 100.0, duration=4e4)
    soft = values_that_creep(law, 100.0, goal=0.01, duration=4e4)
    stress = {"stress": pairs(STEPS.program()), "control": "stress", "temperature": pairs(HEATED)}
    strain = {"strain": pairs(STRAINS.program()), "temperature": TEMPERATURE}
    pressure = {"pressure": pairs(JUMP.program()), "temperature": TEMPERATURE}
    return {
        "source": law_data(law)["source"],
        "points": case.drawn.points.tolist(),
        "sets": [[*values.values()] for values in case.sets],
        "bar": {"values": values, "options": options(**stress)},
        "relaxation": options(**strain),
        "dimple": {"values": soft, "options": options(**pressure)},
    }


def kernel_difference(case: Case, found: list[dict[str, Any]]) -> float:
    rates, update = (np.array([each[part] for each in found], float) for part in ("rates", "update"))
    size, width = rates.shape[1], case.drawn.points.shape[1]
    slopes = update[:, size:].reshape(len(rates), size, width)
    with np.errstate(over="ignore", invalid="ignore"):
        slopes[:, 0] *= rates[:, :1]
    return case.worst(np.concatenate([rates[:, :, None], slopes], axis=2), update[:, 0])[1]


def largest(found: Any, exact: Any) -> float:
    """The largest relative difference up to the earlier end, where the exact number is not zero."""
    shown, truth = np.array(found, float)[: len(exact)], np.array(exact, float)
    matters = (truth != 0.0) & np.isfinite(shown)
    return float(np.max(np.abs(shown[matters] / truth[matters] - 1.0), initial=0.0))


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--points", type=int, default=128)
    chosen = parser.parse_args()
    page = Page("javascript_runtime", __doc__)
    model = ck.surrogate("dimple")
    rom = rom_data(model)
    laws = {name: entry.value for name, entry in default_registry().laws().items() if not entry.value.back_stresses}
    cases = {}
    for name, law in laws.items():
        cases[name] = judged(law, chosen.points)
        progress(f"{name}: {len(cases[name].sets)} points")
    given = {"rom": rom, "laws": [given_of(law, cases[name]) for name, law in laws.items()]}
    with tempfile.TemporaryDirectory() as folder:
        results = run_in_node(Path(folder), PROGRAM, given, {"runtime.js": runtime_script()})
    found = dict(zip(laws, results, strict=True))

    measured: dict[str, dict[str, float]] = {}
    for name, own in zip(laws, given["laws"], strict=True):
        law, told, values, soft = laws[name], found[name], own["bar"]["values"], own["dimple"]["values"]
        common: dict[str, Any] = {"times": TIMES, "elastic": ELASTIC}
        bar = ck.simulate(law, "uniaxial", values, loading=STEPS, temperature=HEATED, **common)
        held = ck.simulate(law, "relaxation", values, loading=STRAINS, temperature=TEMPERATURE, **common)
        dome = ck.simulate(law, model, soft, loading=JUMP, temperature=TEMPERATURE, **common)
        worst = {
            kind: max(largest(told[kind]["outputs"][output], dome.outputs[output]) for output in dome.outputs)
            for kind in ("dimple", "fast")
        }
        measured[name] = {
            "kernel, from 50 digits": kernel_difference(cases[name], told["kernel"]),
            "creep, from the core": largest(told["creep"]["strain"], bar.outputs["strain"]),
            "relaxation, from the core": largest(told["relaxation"]["stress"], held.outputs["stress"]),
            "dimple, from the core": worst["dimple"],
            "dimple, fast, from the core": worst["fast"],
            **dict(zip(("creep, ms", "dimple, ms", "dimple, fast, ms"), told["times"], strict=True)),
            "module, bytes": len(JavaScriptExporter().text(LawWithValues(law, law.center()))),
            "law in a page, bytes": len(script_safe_json(law_data(law))),
        }

    page.heading(f"The {len(laws)} laws")
    page.table("what", "median", "largest", "of the law")
    for what in next(iter(measured.values())):
        numbers = {name: row[what] for name, row in measured.items()}
        most = max(numbers, key=numbers.__getitem__)
        form = ".0f" if "bytes" in what else ".2f" if "ms" in what else ".1e"
        page.row(what, f"{np.median([*numbers.values()]):{form}}", f"{numbers[most]:{form}}", most)

    page.heading("Sizes")
    page.table("part", "bytes")
    page.row("core in WebAssembly", len(core_code()))
    page.row("runtime with the core, packed, as a page has it", len(runtime_script()))
    page.row(f"reduced-order model of {rom['modes']} modes", len(json.dumps(rom)))
    if chosen.write:
        page.write()


if __name__ == "__main__":
    main()
