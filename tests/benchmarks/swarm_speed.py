"""What the paper's swarm costs on one dimple through the shipped surrogate, beside the default search.

    python tests/benchmarks/swarm_speed.py [--particles 300] [--iterations 100] [--laws norton ...] [--repeats 1]

One 12 h test (8 to 10 MPa after 4 h, 48 frames with noise), simulated by finite elements, is identified through
ck.surrogate("dimple") by each search in turn, in one process; least of the repeats, compiled beforehand. Columns:
candidates asked for; wall and CPU seconds of the whole identification, and of its search alone (refinements of its best
included); both over those of the default search; -2 ln L above that of the default. Goal: 15 s for 300 x 100 on two
cores. The paper: 5 min on an RTX 5000 Ada.
"""

import argparse
import time
from dataclasses import dataclass

import numpy as np

import creepkit as ck
from creepkit.cli import set_numba_cache
from creepkit.inverse.search.derivative_free import CmaEs, ParticleSwarm
from creepkit.inverse.search.multistart import MultiStart

LAWS = {
    "norton": {"A": 2e-16, "n": 4.5},
    "hyperbolic-sine": {"A": 3e-9, "n": 3.0, "B": 90.0},
    "drifting-exponent": {"A": 1.14e-15, "n_0": 4.43, "n_inf": 4.3, "C": 1.29, "tau_d": 7818.0, "tau_r": 4754.0},
    "combined": {
        "A_1": 1e-9, "n_1": 3.0, "B": 60.0, "A_2": 1e-14, "n_2": 4.0, "m_1": -0.3, "A_3": 3e-12, "n_3": 3.0, "m_2": -0.4
    },
}  # fmt: skip
TIMES = np.arange(900.0, 43201.0, 900.0)
LOADING, ELASTIC = ck.PressureJump(P1=8, P2=10, Tj=14400), ck.Elastic(E=150e3)
SD = {"amplitude": 1.5e-3, "width": 0.02, "shape": 0.02}
GOAL = 15.0
HEADS = (
    "law", "search", "candidates", "identification, s: wall", "CPU", "over default", "search alone, s: wall", "CPU",
    "over default", "-2 ln L",
)  # fmt: skip


@dataclass
class Timed:
    """A search that takes its own time: (wall, CPU) seconds."""

    search: object
    spent: tuple[float, float] = (0.0, 0.0)

    def minima(self, landscape, progress=None):
        began = clocks()
        found = self.search.minima(landscape, progress)
        self.spent = since(began)
        return found


def clocks():
    return time.perf_counter(), time.process_time()


def since(began):
    return tuple(float(now - then) for now, then in zip(clocks(), began, strict=True))


def law_of(name):
    law = ck.law(name)
    return law.fix(m=0) if name == "drifting-exponent" else law


def simulated(name):
    run = ck.simulate(law_of(name), ck.specimen("bulge"), LAWS[name], elastic=ELASTIC, loading=LOADING, times=TIMES)
    rng = np.random.default_rng(0)
    noisy = {output: run.outputs[output] + sd * rng.standard_normal(TIMES.size) for output, sd in SD.items()}
    return ck.History(name, TIMES, noisy, LOADING, 293.15, specimen="bulge", elastic=ELASTIC)


def measured(name, test, model, search, repeats):
    """The identification, and least (wall, CPU) of it and of its search."""
    whole, alone = [], []
    for _ in range(repeats):
        timed, began = Timed(search), clocks()
        fit = ck.identify(law_of(name), [test], model, search=timed)
        whole.append(since(began))
        alone.append(timed.spent)
    return fit, np.min(whole, axis=0), np.min(alone, axis=0)


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--particles", type=int, default=300)
    options.add_argument("--iterations", type=int, default=100)
    options.add_argument("--laws", nargs="*", default=["norton", "drifting-exponent"], choices=list(LAWS))
    options.add_argument("--repeats", type=int, default=1)
    given = options.parse_args()
    set_numba_cache()
    model, slowest = ck.surrogate("dimple"), 0.0
    size = f"{given.particles} x {given.iterations}"
    searches = {
        "default": MultiStart(),
        f"swarm {size}": ParticleSwarm(given.particles, given.iterations),
        "CMA-ES": CmaEs(),
    }
    print("| " + " | ".join(HEADS) + " |\n" + "|-" * len(HEADS) + "|")
    for name in given.laws:
        test = simulated(name)
        ck.identify(law_of(name), [test], model, starts=1)  # compiles
        base = None
        for which, search in searches.items():
            fit, whole, alone = measured(name, test, model, search, given.repeats)
            base = base or (fit, whole, alone)
            ratios = [f"{w:.1f}, {c:.1f}" for w, c in (whole / base[1], alone / base[2])]
            gap = -2 * (fit.log_likelihood - base[0].log_likelihood)
            times = [f"{t[0]:.2f} | {t[1]:.2f} | {ratio}" for t, ratio in zip((whole, alone), ratios, strict=True)]
            asked = fit.provenance["search_evaluations"]
            print(f"| {name} | {which} | {asked} | {times[0]} | {times[1]} | {gap:+.2f} |", flush=True)
            slowest = max(slowest, whole[0]) if which.startswith("swarm") else slowest
    print(f"slowest identification by the swarm: {slowest:.1f} s of wall time; goal {GOAL:.0f} s for 300 x 100")


if __name__ == "__main__":
    main()
