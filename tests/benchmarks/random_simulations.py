"""Random laws and loads through every specimen: an answer or a stated reason, never a crash or NaN marked complete.

    python tests/benchmarks/random_simulations.py [--cases 100000] [--laws 200] [--seed 1] [--specimens NAME ...]
                                                  [--jobs 2] [--law SEED] [--write]

Half of the laws are sums of products of factors (powers, sinh, exp, log, thresholds, damage, oscillation); the others
are random trees of operations. Parameters are drawn in and beyond their bounds. Tests are of every registered specimen,
with jumps and values that no test has, and sometimes impossible dimensions. A third of the predictions is
differentiated. "lost" counts laws whose process ended before its cases.

An answer is a prediction whose status agrees with its values. "refused" counts sentences of creepkit, "laws refused"
laws that it did not take. Faults: "untrue", a complete row with a value that is not finite, an end beyond the test or a
result that changes when it is calculated alone instead of among others; "unexplained", a test that ended early without
a word; "traceback", any error but one of creepkit in one line; "hang", more than 60 s of CPU.
"""

import collections
import json
import os
import signal
import subprocess
import sys
import time
import traceback
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import sympy
from measured import Page, arguments, progress

from creepkit.errors import CreepkitError, LawError
from creepkit.language import CreepLaw, Elastic, Param, State, parameters, strain, stress, temperature
from creepkit.language import time as clock
from creepkit.records import (
    History,
    PointLoading,
    Program,
    RecordedLoading,
    Specimen,
    Status,
    dimensions_of,
    loads_of,
    typical_history,
)
from creepkit.registry import default_registry
from creepkit.specimens.run import Run, run_from_outputs

A, B, n, m, k, s = parameters("A B n m k s")
W = [sympy.Symbol(name, real=True) for name in ("w", "x")]
PARAMS = {
    A: Param("rate coefficient", unit="1/s", bounds=(1e-40, 1e-5), scale="log"),
    B: Param("stress", unit="MPa", bounds=(1, 1e3), scale="log"),
    n: Param("stress exponent", bounds=(1, 8)),
    m: Param("exponent", bounds=(-0.9, 0.9)),
    k: Param("number", bounds=(-5, 5)),
    s: Param("threshold", unit="MPa", bounds=(0, 300)),
}
FACTORS = (
    stress**n, sympy.sinh(stress / B) ** n, clock**m, strain**m, sympy.exp(-30e3 / temperature),
    sympy.Max(stress - s, 0) ** n, sympy.exp(k * strain), 1 + strain / (strain + sympy.Rational(1, 100)),
    sympy.log(1 + stress / B), sympy.Abs(k) * stress, 2 + sympy.cos(clock / 100), sympy.exp(stress / B),
    sympy.sqrt(stress + s), 1 / (1 + clock),
)  # fmt: skip
STATE_FACTORS = ((1 - W[0]) ** (-n), sympy.exp(-W[1]), 1 + W[0], sympy.Max(1 - W[1], 0) ** m, 1 / (1 + W[1] ** 2))
STATE_RATES = (A * stress**n / (1 - W[0]) ** n, A * stress * (1 - W[1]), -k * W[1] / 100, A * sympy.exp(W[0]), k / 1000)
FUNCTIONS = (sympy.exp, sympy.log, sympy.sqrt, sympy.sinh, sympy.cosh, sympy.tanh, sympy.sin, sympy.cos, sympy.Abs)
TWO = (sympy.Add, sympy.Mul, sympy.Max, sympy.Min)
CPU_SECONDS, DURATION, DEEPEST = 60.0, 7200.0, 4
FAULTS = ("untrue", "unexplained", "traceback", "warning", "hang")


class Hang(BaseException):
    """A prediction took more CPU time than allowed."""


def random_tree(rng: np.random.Generator, leaves: list[sympy.Expr], depth: int) -> sympy.Expr:
    """An expression of at most so many levels."""
    if depth == 0 or rng.random() < 0.2:
        if rng.random() < 0.15:
            return sympy.Rational(int(rng.integers(-3, 4)), int(rng.integers(1, 4)))
        return leaves[rng.integers(len(leaves))]
    first = random_tree(rng, leaves, depth - 1)
    kind = rng.random()
    if kind < 0.3:
        return FUNCTIONS[rng.integers(len(FUNCTIONS))](first)
    second = random_tree(rng, leaves, depth - 1)
    if kind < 0.75:
        try:
            return TWO[rng.integers(len(TWO))](first, second)
        except ValueError:  # the larger of complex numbers, which sympy itself refuses
            return first
    if kind < 0.87:
        return first / second
    return first**second


def sum_of_products(rng: np.random.Generator, states: list[sympy.Symbol]) -> dict[str, sympy.Expr]:
    """Terms of factors that laws of the literature have."""
    usable = [f for f in STATE_FACTORS if f.free_symbols & set(W) <= set(states)]
    terms = {}
    for i in range(rng.integers(1, 4)):
        factors = rng.choice(len(FACTORS), rng.integers(1, 4), replace=False)
        terms[f"term {i}"] = A * sympy.Mul(*(FACTORS[j] for j in factors))
        if usable and rng.random() < 0.7:
            terms[f"term {i}"] *= usable[rng.integers(len(usable))]
    return terms


def trees(rng: np.random.Generator, states: list[sympy.Symbol]) -> dict[str, sympy.Expr]:
    """Terms that nobody has written down."""
    leaves = [stress, strain, clock, temperature, B, n, m, k, s, *states]
    return {f"term {i}": A * random_tree(rng, leaves, DEEPEST) for i in range(rng.integers(1, 3))}


def random_law(rng: np.random.Generator, counts: collections.Counter[str]) -> CreepLaw:
    """A law that the language accepts; what it refuses is counted."""
    while True:
        states = W[: rng.integers(3)]
        of_trees = rng.random() < 0.5
        terms = (trees if of_trees else sum_of_products)(rng, states)
        rates = [r for r in STATE_RATES if r.free_symbols & set(W) <= set(states)]
        evolving = {
            w: State(0.0, rates[rng.integers(len(rates))], limit=None if rng.random() < 0.5 else 0.9) for w in states
        }
        used = set().union(*(e.free_symbols for e in (*terms.values(), *(one.rate for one in evolving.values()))))
        try:
            law = CreepLaw("random", terms, {p: PARAMS[p] for p in PARAMS if p in used}, states=evolving)
        except LawError as error:
            counts["laws refused"] += 1
            counts["traceback"] += not one_line(error)
            continue
        counts["laws of trees"] += of_trees
        return law


def one_line(error: CreepkitError) -> bool:
    """Whether a refusal is one sentence that a person can read."""
    text = str(error)
    return bool(text.strip()) and "\n" not in text and "Traceback" not in text and len(text) < 2000


def random_theta(rng: np.random.Generator, law: CreepLaw, candidates: int) -> np.ndarray:
    """Internal parameters (candidates, parameters), some beyond their bounds."""
    low, high = law.internal_bounds
    theta = low + (high - low) * rng.uniform(-0.2, 1.2, (candidates, len(law.names)))
    far = rng.choice([0.0, 1e3, -1e3, 700.0, 1e-300], theta.shape)
    return np.where(rng.random(theta.shape) < 0.02, far, theta)


def random_program(rng: np.random.Generator, low: float, high: float, far: float = 30.0) -> Program:
    """Values between two numbers, a few far away; times may repeat."""
    points = int(rng.integers(1, 7))
    times = np.sort(np.concatenate([[0.0], rng.uniform(0, DURATION, points - 1)]))
    if points > 2 and rng.random() < 0.5:
        times[1] = times[2]
    values = rng.uniform(low, high, points)
    return Program(times, np.where(rng.random(points) < 0.03, far * high, values))


def random_test(rng: np.random.Generator, specimen: Specimen) -> History:
    """A planned test: any of the loads, temperature and modulus, and sometimes other dimensions."""
    loads = loads_of(specimen)
    load = loads[rng.integers(len(loads))].name
    plan = typical_history(specimen, load, level=float(rng.uniform(0, 1)), frames=int(rng.integers(2, 9)), end=DURATION)
    value = float(np.max(plan.loading.program().values))
    program = random_program(rng, float(rng.choice([0.0, -0.2])) * value, 2.0 * value)
    if load == "components":
        names = rng.choice(["11", "22", "33", "12", "13", "23"], rng.integers(1, 4), replace=False)
        parts = {str(name): random_program(rng, -value, 2 * value) for name in names}
        held = {"33": Program.constant(0.0)} if "33" not in parts and rng.random() < 0.3 else {}
        loading: Any = PointLoading(stress=parts, strain=held)
    else:
        loading = RecordedLoading(program, load)
    lengths = [one for one in dimensions_of(specimen) if one.of_piece]
    geometry = {}
    if lengths and rng.random() < 0.2:
        one = lengths[rng.integers(len(lengths))]
        geometry = {one.name: float(one.default * rng.choice([0.5, 0.9, 1.1, 2.0, 0.0, -1.0, 1e-6, 1e6]))}
    return plan.replace(
        loading=loading,
        temperature=random_program(rng, 600.0, 1300.0, far=7.0),
        elastic=Elastic(float(rng.uniform(80e3, 200e3))),
        geometry={**plan.geometry, **geometry},
    )


def judge(prediction: Any, tests: list[History], counts: collections.Counter[str]) -> None:
    """Count how rows ended, and rows whose status their values contradict."""
    for test, plan in enumerate(tests):
        for candidate in range(prediction.status.shape[0]):
            status, end = Status(int(prediction.status[candidate, test])), prediction.end_times[candidate, test]
            values, last = prediction.of(test, candidate), plan.times[-1]
            counts[status.text] += 1
            finite = np.isfinite(values).all(axis=1)
            if status is Status.COMPLETE:
                counts["untrue"] += not finite.all()
            else:
                reached = plan.times <= end
                counts["untrue"] += not (0.0 <= end <= last) or bool(finite[~reached].any())
            if prediction.jacobian is not None and status is Status.COMPLETE:
                jacobian = prediction.jacobian[candidate, test, : plan.times.size]
                counts["derivatives not finite"] += not np.isfinite(jacobian).all()
    try:
        row, status = prediction.of(0), Status(int(prediction.status[0, 0]))
        end = float(prediction.end_times[0, 0])
        run = run_from_outputs(Run, tests[0], prediction.outputs, row, status, end, prediction.reason)
        counts["unexplained"] += run.status is not Status.COMPLETE and not run.reason.strip()
    except CreepkitError as error:
        counts["traceback"] += not one_line(error)


def run_prediction(
    rng: np.random.Generator, law: CreepLaw, specimen: Specimen, counts: collections.Counter[str], most: int
) -> int:
    """One prediction of up to `most` rows, and one of its rows again alone; the number of rows."""
    candidates, number = int(rng.integers(1, 4)), int(rng.integers(1, 4))
    candidates, number = (1, 1) if most < 9 else (candidates, number)
    theta, derivatives = random_theta(rng, law, candidates), bool(rng.random() < 0.33)
    try:
        tests = [random_test(rng, specimen).replace(name=f"test {i}") for i in range(number)]
        made = specimen.predict(law, theta, tests, sensitivities=derivatives)
    except CreepkitError as error:
        counts["refused"] += candidates * number
        counts["traceback"] += not one_line(error)
        return candidates * number
    judge(made, tests, counts)
    if candidates * number > 1:
        c, t = int(rng.integers(candidates)), int(rng.integers(number))
        alone = specimen.predict(law, theta[c : c + 1], [tests[t]], sensitivities=derivatives)
        same = np.array_equal(alone.of(0), made.of(t, c), equal_nan=True)
        counts["untrue"] += not same or alone.status[0, 0] != made.status[c, t]
    return candidates * number


def on_alarm(*_: Any) -> None:
    raise Hang


def run_law(seed: int, cases: int, names: list[str]) -> dict[str, Any]:
    """All cases of one law, over all specimens in turn; faults with a line of what happened."""
    rng, counts = np.random.default_rng(seed), collections.Counter[str]()
    law = random_law(rng, counts)
    specimens = {name: found.value for name, found in default_registry().specimens().items()}
    signal.signal(signal.SIGPROF, on_alarm)
    warnings.simplefilter("error")
    done, details, turn = 0, [], int(rng.integers(len(names)))
    spent: collections.Counter[str] = collections.Counter()
    while done < cases:
        name, begin = names[turn % len(names)], time.process_time()
        turn += 1
        before = {fault: counts[fault] for fault in FAULTS}
        state, rows = rng.bit_generator.state["state"]["state"], 1
        try:
            signal.setitimer(signal.ITIMER_PROF, CPU_SECONDS)
            rows = run_prediction(rng, law, specimens[name], counts, cases - done)
            line = ""
        except Hang:
            counts["hang"] += 1
            line = "more than 60 s of CPU"
        except Warning as warning:
            counts["warning"] += 1
            line = last_lines(warning)
        except Exception as error:
            counts["traceback"] += 1
            line = last_lines(error)
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0.0)
        if any(counts[fault] > before[fault] for fault in FAULTS):
            details.append(
                f"{name}, law {seed}, state {state % 10**6}: {line or dict(counts - collections.Counter(before))}"
            )
        counts[f"of {name}"] += rows
        spent[name] += time.process_time() - begin
        done += rows
    return {
        "counts": {**counts, "cases": done, "internal variables": len(law.states)},
        "details": details[:5],
        "spent": spent,
        "law": str(law),
    }


def last_lines(error: BaseException) -> str:
    """The error and where it was raised."""
    frames = traceback.extract_tb(error.__traceback__)[-2:]
    where = ", ".join(f"{Path(frame.filename).name}:{frame.lineno}" for frame in frames)
    return f"{type(error).__name__}: {str(error)[:200]} ({where})"


def main() -> None:
    """Run a process for each law, some at a time, and add their counts."""
    parser = arguments(__doc__)
    for name, default in (("cases", 100_000), ("laws", 200), ("seed", 1), ("law", -1), ("jobs", 2)):
        parser.add_argument(f"--{name}", type=int, default=default)
    parser.add_argument("--specimens", nargs="+", default=sorted(default_registry().specimens()))
    options = parser.parse_args()
    each = -(-options.cases // options.laws)
    if options.law >= 0:
        print(json.dumps(run_law(options.law, each, options.specimens), default=int))
        return
    page, totals, lost, details = Page("random_simulations", __doc__), collections.Counter(), [], []
    waiting, running = [options.seed * 10_000 + i for i in range(options.laws)], {}
    started = os.times()
    while waiting or running:
        while waiting and len(running) < options.jobs:
            seed = waiting.pop(0)
            words = ["--law", seed, "--cases", options.cases, "--laws", options.laws, "--specimens", *options.specimens]
            command = [sys.executable, str(Path(__file__).resolve()), *map(str, words)]
            running[seed] = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        for seed, process in list(running.items()):
            if process.poll() is not None:
                output, errors = process.communicate()
                if process.returncode:
                    lost.append((seed, process.returncode, " ".join(errors.strip().splitlines()[-1:])))
                else:
                    result = json.loads(output)
                    totals.update(result["counts"])
                    details += result["details"]
                    for line in result["details"]:
                        progress(line)
                del running[seed]
                progress(f"{options.laws - len(waiting) - len(running)} of {options.laws} laws; {len(details)} faults")
        time.sleep(0.05)
    ended = os.times()
    write_tables(page, totals, options.laws, lost, ended.children_user + ended.children_system - started.children_user)
    for line in details:
        progress(line)
    if options.write:
        page.write()
    if lost or any(totals[fault] for fault in FAULTS):
        raise SystemExit("there were faults")


def write_tables(
    page: Page, totals: collections.Counter[str], laws: int, lost: list[tuple[int, int, str]], cpu_seconds: float
) -> None:
    """Print what was counted."""
    page.table("what", "tests")
    page.row("all", totals["cases"])
    for status in Status:
        page.row(status.text, totals[status.text])
    page.row("refused", totals["refused"])
    page.row("complete, with derivatives that are not finite", totals["derivatives not finite"])
    page.table("fault", "predictions")
    for fault in FAULTS:
        page.row(fault, totals[fault])
    page.row("laws lost", len(lost))
    page.table("laws", "number")
    page.row("run", laws)
    page.row("of them of trees", totals["laws of trees"])
    page.row("refused before", totals["laws refused"])
    page.row("internal variables of those run", totals["internal variables"])
    page.paragraph(f"CPU time: {cpu_seconds:.0f} s.")
    each = [count for name, count in totals.items() if name.startswith("of ")]
    page.paragraph(f"{len(each)} specimens, {min(each)} to {max(each)} tests each.")
    for seed, code, message in lost:
        page.paragraph(f"Law {seed} ended with exit status {code}: {message}")


if __name__ == "__main__":
    main()
