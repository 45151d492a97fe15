"""Speed of surrogates of the dimple, beside the finite element model and the paper's network: one 12 h jump test.

    python tests/benchmarks/surrogate_speed.py [--candidates 300] [--simulated 6] [--laws ...] [--surrogate FILE]

CPU time of a candidate: of RateNet its base alone (the one-degree-of-freedom march), with the features, with the
network, and with derivatives to all parameters and to the apex thickness; of the finite element model alike; of
ParameterGru (128 x 3) the bare network. Then wall time of all candidates at 289 times on all cores. Networks are not
trained, which costs the same, unless --surrogate says which. All is measured in one process, in turns; least of some.
The first run also compiles.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import torch

import creepkit as ck
from creepkit import kernels
from creepkit.records import History
from creepkit.sampling.conditions import TimeGrid
from creepkit.specimens.bulge.observation import OBSERVED
from creepkit.specimens.bulge.reduced_order.trajectories import (
    WITHOUT_FEATURES,
    TrajectoryOptions,
    simulate_trajectories,
)
from creepkit.specimens.bulge.specimen import Bulge
from creepkit.surrogates.applicability_domain import ApplicabilityDomain
from creepkit.surrogates.loading import load_surrogate
from creepkit.surrogates.parameter_network import ParameterModule
from creepkit.surrogates.rate_net import RateNet, RateSurrogate
from creepkit.surrogates.rate_network import RateModule, input_names
from creepkit.surrogates.recipe import SurrogateMetadata

LAWS = {
    "norton": {"A": 3e-15, "n": 3.5},
    "strain-hardening": {"A": 3e-16, "n": 3.0, "m": -0.5},
    "hyperbolic-sine": {"A": 3e-9, "n": 3.0, "B": 90.0},
    "combined": {
        "A_1": 1e-9, "n_1": 3.0, "B": 60.0, "A_2": 1e-14, "n_2": 4.0, "m_1": -0.3, "A_3": 3e-12, "n_3": 3.0, "m_2": -0.4
    },
}  # fmt: skip
END, EVERY = 43200.0, 150.0
TEST = History(
    "12 h jump", np.arange(0.0, END + 1, EVERY), {}, ck.PressureJump(8.0, 9.0, END / 2), 1000.0, specimen="bulge",
    elastic=ck.Elastic(E=150e3),
)  # fmt: skip
REPEATS = 7
GRU_INPUTS = (8, 1, len(OBSERVED))
"""Constants (some law's parameters and conditions), series and outputs."""


def main() -> None:
    """Print the tables."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--candidates", type=int, default=300)
    options.add_argument("--simulated", type=int, default=6)
    options.add_argument("--laws", nargs="*", default=list(LAWS))
    options.add_argument("--surrogate")
    asked = options.parse_args()
    torch.set_num_threads(1)
    print(f"one 12 h jump test, {TEST.times.size} times; CPU time of a candidate, ms")
    heads = ("law", "base", "+ features", "+ network", "+ slopes", "finite elements", "with slopes", "over RateNet")
    print("| " + " | ".join(heads) + " |\n|" + "-|" * len(heads))
    for name in asked.laws:
        print(row(name, asked.candidates, asked.simulated, asked.surrogate), flush=True)
    print(f"\n{asked.candidates} candidates, wall time on {len(os.sched_getaffinity(0))} cores, ms")
    print("| | features and network | base and features alone | GRU, 49 frames | GRU, 289 frames |\n|-|-|-|-|-|")
    for name in asked.laws:
        print(walls(name, asked.candidates, asked.surrogate), flush=True)


def row(name: str, count: int, simulated: int, file: str | None) -> str:
    """CPU times of one law."""
    law, surrogate, exact = ck.law(name), rate_surrogate(file, threads=1), Bulge(threads=1)
    compiled, many, few = kernels.lower(law, "numba"), scattered(name, count), scattered(name, simulated)
    theta, factors = law.to_internal(many), surrogate.recipe.factors
    thickness = {"thickness": np.full((1, 1), exact.geometry.apex_thickness)}
    some = {n: v[: max(1, count // 10)] for n, v in many.items()}
    spent = in_turns(
        (
            lambda: simulate_trajectories(
                exact, compiled, theta, [TEST], options=TrajectoryOptions(factors=WITHOUT_FEATURES)
            ),
            count,
        ),
        (
            lambda: simulate_trajectories(exact, compiled, theta, [TEST], options=TrajectoryOptions(factors=factors)),
            count,
        ),
        (lambda: surrogate.predict(law, law.to_internal(many), [TEST]), count),
        (
            lambda: surrogate.predict(law, law.to_internal(some), [TEST], sensitivities=True, nuisances=thickness),
            max(1, count // 10),
        ),
    )
    slow = in_turns(
        (lambda: exact.predict(law, law.to_internal(few), [TEST]), simulated),
        (lambda: exact.predict(law, law.to_internal(few), [TEST], sensitivities=True, nuisances=thickness), simulated),
        repeats=1,
    )
    ratios = f"{slow[0] / spent[2]:.0f}, {slow[1] / spent[3]:.0f}"
    cells = [*(f"{1e3 * s:.3f}" for s in spent), *(f"{1e3 * s:.1f}" for s in slow), ratios]
    return f"| {name} | " + " | ".join(cells) + " |"


def walls(name: str, count: int, file: str | None) -> str:
    """Wall times of one law on all cores."""
    law, surrogate, cores = ck.law(name), rate_surrogate(file), len(os.sched_getaffinity(0))
    compiled, many = kernels.lower(law, "numba"), scattered(name, count)
    theta, factors = law.to_internal(many), surrogate.recipe.factors
    spent = in_turns(
        (lambda: surrogate.predict(law, law.to_internal(many), [TEST]), 1),
        (
            lambda: simulate_trajectories(
                Bulge(), compiled, theta, [TEST], options=TrajectoryOptions(factors=factors, threads=cores)
            ),
            1,
        ),
        (gru(count, 49, cores), 1),
        (gru(count, TEST.times.size, cores), 1),
        clock=time.perf_counter,
    )
    return f"| {name} | " + " | ".join(f"{1e3 * s:.0f}" for s in spent) + " |"


def in_turns(
    *runs: tuple[Callable[[], Any], int], repeats: int = REPEATS, clock: Callable[[], float] = time.process_time
) -> list[float]:
    """Least time of each run over its number of candidates, s; the first turn, which may compile, does not count."""
    best = [np.inf] * len(runs)
    for turn in range(repeats + 1):
        for k, (run, count) in enumerate(runs):
            start = clock()
            run()
            if turn > 0:
                best[k] = min(best[k], (clock() - start) / count)
    return best


def scattered(name: str, count: int) -> dict[str, np.ndarray]:
    """Values of candidates about those of the law: coefficients by a factor of e^.5, the rest by 3 %."""
    rng, table = np.random.default_rng(1), ck.law(name).table
    return {
        n: v * np.exp(rng.normal(0.0, 0.5 if table[n].scale == "log" else 0.03, count)) for n, v in LAWS[name].items()
    }


def rate_surrogate(file: str | None, threads: int | None = None) -> RateSurrogate:
    """A RateNet with some domain, of random weights unless there is a file."""
    specimen = Bulge() if threads is None else Bulge(threads=threads)
    if file is not None:
        found = load_surrogate(file)
        if not isinstance(found, RateSurrogate):
            raise SystemExit(f"{file} holds a {found.recipe.kind}; give a rate-net")
        return found
    recipe = RateNet()
    known = input_names(recipe.factors.stress.size * recipe.factors.strain.size)
    own = [n for n in known if not n.startswith(("mean", "fading"))]
    domain = ApplicabilityDomain.from_rows(own, np.random.default_rng(0).normal(size=(500, len(own))))
    told = SurrogateMetadata(ck.law("norton"), specimen, OBSERVED, TimeGrid(TEST.times, False), (), (), domain=domain)
    return RateSurrogate(recipe, RateModule(len(known), recipe.hidden, recipe.layers), told)


def gru(count: int, frames: int, cores: int) -> Callable[[], None]:
    """A run of the paper's network, threads sharing the candidates."""
    module = ParameterModule(GRU_INPUTS, 128, 3, "gru", logarithm=False, corrects_base=False).eval()
    constants, series = torch.randn(count, GRU_INPUTS[0]), torch.randn(count, frames, GRU_INPUTS[1])

    def part(k: int) -> None:
        with torch.no_grad():
            module({"constants": constants[k::cores], "series": series[k::cores]})

    def run() -> None:
        with ThreadPoolExecutor(cores) as pool:
            list(pool.map(part, range(cores)))

    return run


if __name__ == "__main__":
    main()
