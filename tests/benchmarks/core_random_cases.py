"""Random laws and loads through the compiled core: every case must end in a status, none in a crash.

    python tests/benchmarks/core_random_cases.py [--cases 100000] [--laws 100] [--seed 1] [--write]

A law is a sum of one to three products of factors of the literature and awkward ones (powers, sinh, exp, log,
thresholds, damage, oscillation), with none to two internal states; parameters are drawn in and beyond their bounds. A
load is a program of one to six points of stress or, in a dimple, of pressure and modulus, and of temperature, with
jumps and with values that no test has. A tenth of the cases are dimples on a coarse mesh, the others bars under
stress, constant load or relaxation; a third is differentiated. A process runs the cases of one law. "Lost" counts
laws whose process ended before its cases; "untrue" counts results that contradict their status: a complete test with
a value that is not finite, or a result that changes when it is calculated alone instead of among others.
"""

import collections
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import sympy
from measured import Page, arguments, progress

from creepkit import kernels
from creepkit.errors import CreepkitError, LawError
from creepkit.fem.finite_element_model import finite_element_model
from creepkit.fem.simulation import LoadHistory, sensitivity_directions, simulate
from creepkit.fem.solver import SolverSettings
from creepkit.integration import IntegrationSettings, PointTest, integrate
from creepkit.language import CreepLaw, Param, State, parameters, strain, stress, temperature
from creepkit.language import time as clock
from creepkit.records import Program, Status
from creepkit.specimens.bulge.geometry import DimpleGeometry

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
BATCH = 20
TIMES = np.array([0.0, 1.0, 60.0, 3600.0, 7200.0])


def random_law(rng: np.random.Generator) -> CreepLaw:
    """A law that the language accepts."""
    while True:
        states = W[: rng.integers(3)]
        usable = [f for f in STATE_FACTORS if f.free_symbols & set(W) <= set(states)]
        terms = {}
        for i in range(rng.integers(1, 4)):
            factors = rng.choice(len(FACTORS), rng.integers(1, 4), replace=False)
            terms[f"term {i}"] = A * sympy.Mul(*(FACTORS[j] for j in factors))
            if usable and rng.random() < 0.7:
                terms[f"term {i}"] *= usable[rng.integers(len(usable))]
        rates = [r for r in STATE_RATES if r.free_symbols & set(W) <= set(states)]
        evolving = {
            w: State(0.0, rates[rng.integers(len(rates))], limit=None if rng.random() < 0.5 else 0.9) for w in states
        }
        used = set().union(*(e.free_symbols for e in (*terms.values(), *(one.rate for one in evolving.values()))))
        try:
            return CreepLaw("random", terms, {p: PARAMS[p] for p in PARAMS if p in used}, states=evolving)
        except LawError:
            continue


def random_theta(rng: np.random.Generator, law: CreepLaw) -> np.ndarray:
    """Internal parameters, some beyond their bounds."""
    low, high = law.internal_bounds
    theta = low + (high - low) * rng.uniform(-0.2, 1.2, len(law.names))
    return np.where(rng.random(theta.size) < 0.02, rng.choice([0.0, 1e3, -1e3, 700.0, 1e-300], theta.size), theta)


def random_program(rng: np.random.Generator, low: float, high: float) -> Program:
    """Values between two numbers, a few far away, over up to 7200 s; times may repeat."""
    points = int(rng.integers(1, 7))
    times = np.sort(np.concatenate([[0.0], rng.uniform(0, 7200, points - 1)]))
    if points > 2 and rng.random() < 0.5:
        times[1] = times[2]
    values = rng.uniform(low, high, points)
    return Program(times, np.where(rng.random(points) < 0.03, 30 * high, values))


def run_bars(rng: np.random.Generator, law: CreepLaw, counts: collections.Counter) -> None:
    """A batch of bars; one of them again on its own."""
    compiled, theta = kernels.lower(law, "compiled"), random_theta(rng, law)
    kinds = rng.integers(3, size=BATCH)
    tests = [
        PointTest(
            random_program(rng, 0.0 if kind else -50.0, 400.0), random_program(rng, 600.0, 1300.0), TIMES,
            stiffness=150e3 if kind == 2 else 0.0, constant_load=kind == 1, levels=np.array([1e-3, 1e-2]), until=1e4,
        )
        for kind in kinds
    ]  # fmt: skip
    jacobian, settings = bool(rng.random() < 0.33), IntegrationSettings(max_steps=2000)
    made = integrate(compiled, theta, tests, jacobian=jacobian, settings=settings)
    curves = made.strain.reshape(BATCH, TIMES.size)
    for status, curve in zip(made.status.ravel(), curves, strict=True):
        counts[Status(int(status)).name] += 1
        counts["untrue"] += status == Status.COMPLETE and not np.isfinite(curve).all()
    one = int(rng.integers(BATCH))
    alone = integrate(compiled, theta, [tests[one]], jacobian=jacobian, settings=settings)
    counts["untrue"] += not np.array_equal(alone.strain[0], curves[one], equal_nan=True)


def run_dimple(rng: np.random.Generator, law: CreepLaw, counts: collections.Counter, body) -> None:
    """One dimple of few elements, whose modulus, pressure and temperature vary."""
    load = LoadHistory(
        random_program(rng, -2.0, 12.0), random_program(rng, 600.0, 1300.0), random_program(rng, 80e3, 200e3), 7200.0
    )
    directions = sensitivity_directions(body, load) if rng.random() < 0.33 else None
    made = simulate(
        kernels.lower(law, "compiled"), random_theta(rng, law), body, load,
        settings=SolverSettings(max_steps=300), directions=directions,
    )  # fmt: skip
    counts[f"dimple {made.status.name}"] += 1
    finite = np.isfinite(made.displacements).all() and np.isfinite(made.mises).all()
    counts["untrue"] += not finite or (made.status is Status.COMPLETE) != (made.end_time == 7200.0)


def run_law(seed: int, cases: int) -> dict[str, int]:
    """All cases of one law; errors of creepkit are answers too."""
    rng = np.random.default_rng(seed)
    law = random_law(rng)
    body, counts = finite_element_model(DimpleGeometry().mesh(0.5)), collections.Counter()
    done = 0
    while done < cases:
        dimple = rng.random() < BATCH / 9 / (1 + BATCH / 9)
        try:
            run_dimple(rng, law, counts, body) if dimple else run_bars(rng, law, counts)
        except CreepkitError:
            counts["refused"] += 1 if dimple else BATCH
        done += 1 if dimple else BATCH
    return {**counts, "cases": done, "states": len(law.states)}


def main() -> None:
    """Run a process for each law, two at a time, and add their counts."""
    parser = arguments(__doc__)
    for name, default in (("cases", 100_000), ("laws", 100), ("seed", 1), ("law", -1)):
        parser.add_argument(f"--{name}", type=int, default=default)
    options = parser.parse_args()
    each = -(-options.cases // options.laws)
    if options.law >= 0:
        print(json.dumps(run_law(options.law, each), default=int))
        return
    page, totals, lost = Page("core_random_cases", __doc__), collections.Counter(), []
    waiting, running = [options.seed * 10_000 + i for i in range(options.laws)], {}
    started = os.times()
    while waiting or running:
        while waiting and len(running) < 2:
            seed = waiting.pop(0)
            command = [sys.executable, str(Path(__file__).resolve()), "--law", str(seed), "--cases", str(options.cases)]
            command += ["--laws", str(options.laws)]
            running[seed] = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        for seed, process in list(running.items()):
            if process.poll() is not None:
                output, errors = process.communicate()
                if process.returncode:
                    lost.append((seed, process.returncode, errors.strip().splitlines()[-1:]))
                else:
                    totals.update(json.loads(output))
                del running[seed]
                progress(f"{options.laws - len(waiting) - len(running)} of {options.laws} laws; lost: {lost}")
        time.sleep(0.05)
    ended = os.times()
    page.table("what", "cases")
    for name in ("cases", *sorted(set(totals) - {"cases", "states", "untrue"})):
        page.row(name, totals[name])
    page.row("untrue", totals["untrue"])
    page.row("laws, their states together", f"{options.laws}, {totals['states']}")
    page.row("laws lost", len(lost))
    page.row("CPU time, s", f"{ended.children_user + ended.children_system - started.children_user:.0f}")
    for seed, code, message in lost:
        page.paragraph(f"Law {seed} ended with exit status {code}: {' '.join(message)}")
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
