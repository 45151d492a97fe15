"""Speed of surrogates of the dimple, beside the finite element model and the paper's network: one 12 h jump test.

    python tests/benchmarks/surrogate_speed.py [--candidates 300] [--simulated 6] [--laws norton ...]
                                               [--surrogate FILE] [--write]

First table, CPU time of a candidate at 289 times: RateNet by its parts (the reduced-order model alone, with its
features, with the network), RateNet with sensitivities to all parameters and to the apex thickness, the finite element
model without and with the same sensitivities, and the ratios of finite elements to RateNet. Second table, wall time of
all candidates on all cores, and that of the bare network of ParameterGru (128 x 3, the paper's) at 49 and 289 frames.
Networks are not trained, which costs the same, unless --surrogate names one. All is measured in one process, in turns;
the least of some repeats. The first run also compiles.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import torch
from measured import Page, arguments
from public_calls import predict

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
    "combined": dict(A_1=1e-9, n_1=3.0, B=60.0, A_2=1e-14, n_2=4.0, m_1=-0.3, A_3=3e-12, n_3=3.0, m_2=-0.4),
}
END, EVERY = 43200.0, 150.0
TEST = History(
    name="12 h jump",
    times=np.arange(0.0, END + 1, EVERY),
    outputs={},
    loading=ck.PressureJump(8.0, 9.0, END / 2),
    temperature=1000.0,
    specimen="bulge",
    elastic=ck.Elastic(E=150e3),
)
REPEATS = 7
GRU_INPUTS = (8, 1, len(OBSERVED))
"""Constants (some law's parameters and conditions), series and outputs."""


CPU_HEADS = (
    "law",
    "reduced-order model, ms",
    "with features, ms",
    "RateNet, ms",
    "with sensitivities, ms",
    "finite elements, ms",
    "with sensitivities, ms",
    "finite elements over RateNet",
    "with sensitivities",
)
WALL_HEADS = ("law", "RateNet, ms", "reduced-order model and features, ms", "GRU, 49 frames, ms", "GRU, 289 frames, ms")


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--candidates", type=int, default=300)
    parser.add_argument("--simulated", type=int, default=6, help="candidates of the finite element model")
    parser.add_argument("--laws", nargs="*", default=list(LAWS))
    parser.add_argument("--surrogate", help="file of a RateNet")
    options = parser.parse_args()
    torch.set_num_threads(1)
    page = Page("surrogate_speed", __doc__)
    page.heading("CPU time of a candidate")
    page.table(*CPU_HEADS)
    for name in options.laws:
        page.row(name, *cpu_times(name, options.candidates, options.simulated, options.surrogate))
    page.heading(f"Wall time of {options.candidates} candidates on {len(os.sched_getaffinity(0))} cores")
    page.table(*WALL_HEADS)
    for name in options.laws:
        page.row(name, *wall_times(name, options.candidates, options.surrogate))
    if options.write:
        page.write()


def cpu_times(name: str, count: int, simulated: int, file: str | None) -> list[str]:
    """CPU times of one law, ms, and ratios."""
    law, surrogate, exact = ck.law(name), rate_surrogate(file, threads=1), Bulge(threads=1)
    kernel, many, few = kernels.lower(law, "numba"), scattered(name, count), scattered(name, simulated)
    theta, factors = law.to_internal(many), surrogate.recipe.factors
    thickness = {"thickness": np.full((1, 1), exact.geometry.apex_thickness)}
    some = {n: v[: max(1, count // 10)] for n, v in many.items()}
    spent = in_turns(
        (
            lambda: simulate_trajectories(
                exact,
                kernel,
                theta,
                [TEST],
                options=TrajectoryOptions(options=TrajectoryOptions(factors=WITHOUT_FEATURES)),
            ),
            count,
        ),
        (
            lambda: simulate_trajectories(exact, kernel, theta, [TEST], options=TrajectoryOptions(factors=factors)),
            count,
        ),
        (lambda: predict(surrogate, law, many, [TEST]), count),
        (lambda: predict(surrogate, law, some, [TEST], thickness, sensitivities=True), max(1, count // 10)),
    )
    finite_elements = in_turns(
        (lambda: predict(exact, law, few, [TEST]), simulated),
        (lambda: predict(exact, law, few, [TEST], thickness, sensitivities=True), simulated),
        repeats=1,
    )
    ratios = finite_elements[0] / spent[2], finite_elements[1] / spent[3]
    return [
        *(f"{1e3 * s:.3f}" for s in spent),
        *(f"{1e3 * s:.1f}" for s in finite_elements),
        *(f"{ratio:.0f}" for ratio in ratios),
    ]


def wall_times(name: str, count: int, file: str | None) -> list[str]:
    """Wall times of one law on all cores, ms."""
    law, surrogate, cores = ck.law(name), rate_surrogate(file), len(os.sched_getaffinity(0))
    kernel, many = kernels.lower(law, "numba"), scattered(name, count)
    theta, factors = law.to_internal(many), surrogate.recipe.factors
    spent = in_turns(
        (lambda: predict(surrogate, law, many, [TEST]), 1),
        (
            lambda: simulate_trajectories(
                Bulge(),
                kernel,
                theta,
                [TEST],
                options=TrajectoryOptions(options=TrajectoryOptions(factors=factors, threads=cores)),
            ),
            1,
        ),
        (gru(count, 49, cores), 1),
        (gru(count, TEST.times.size, cores), 1),
        clock=time.perf_counter,
    )
    return [f"{1e3 * s:.0f}" for s in spent]


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
    """Values of candidates about those of LAWS: a standard deviation of 0.5 in ln of coefficients, 3 % in the rest."""
    rng, table = np.random.default_rng(1), ck.law(name).table
    return {
        n: v * np.exp(rng.normal(0.0, 0.5 if table[n].scale == "log" else 0.03, count)) for n, v in LAWS[name].items()
    }


def rate_surrogate(file: str | None, threads: int | None = None) -> RateSurrogate:
    """A RateNet with some domain, of random weights unless there is a file."""
    specimen = Bulge() if threads is None else Bulge(threads=threads)
    if file is not None:
        surrogate = load_surrogate(file)
        if not isinstance(surrogate, RateSurrogate):
            raise SystemExit(f"{file} holds a {surrogate.recipe.kind}; give a rate-net")
        return surrogate
    recipe = RateNet()
    names = input_names(recipe.factors.stress.size * recipe.factors.strain.size)
    local = [n for n in names if not n.startswith(("mean", "fading"))]
    domain = ApplicabilityDomain.from_rows(local, np.random.default_rng(0).normal(size=(500, len(local))))
    grid = TimeGrid(TEST.times, False)
    metadata = SurrogateMetadata(ck.law("norton"), specimen, OBSERVED, grid, (), (), domain=domain)
    return RateSurrogate(recipe, RateModule(len(names), recipe.hidden, recipe.layers), metadata)


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
