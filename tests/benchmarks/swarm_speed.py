"""Cost of the particle swarm of the paper on one dimple, beside the default search and CMA-ES.

    python tests/benchmarks/swarm_speed.py [--particles 300] [--iterations 100] [--laws norton ...] [--repeats 1]
                                           [--write]

One 12 h test (8 to 10 MPa after 4 h, 48 frames with noise), simulated by finite elements, is identified through the
reduced-order model by each search in turn, in one process, compiled beforehand; the least of the repeats. Columns:
predicted candidates; wall and CPU time of the whole identification, and of its search alone (the refinement of its best
candidates included), both also as ratios to the default search (wall, CPU); -2 ln L above that of the default search.
The goal is 15 s of wall time for 300 particles and 100 iterations on two cores; the paper: 5 min on an RTX 5000 Ada.
"""

import time
from dataclasses import dataclass

import numpy as np
from measured import Page, arguments

import creepkit as ck
from creepkit.inverse.search.derivative_free import CmaEs, ParticleSwarm
from creepkit.inverse.search.multistart import MultiStart

LAWS = {
    "norton": {"A": 2e-16, "n": 4.5},
    "hyperbolic-sine": {"A": 3e-9, "n": 3.0, "B": 90.0},
    "drifting-exponent": {"A": 1.14e-15, "n_0": 4.43, "n_inf": 4.3, "C": 1.29, "tau_d": 7818.0, "tau_r": 4754.0},
    "combined": dict(A_1=1e-9, n_1=3.0, B=60.0, A_2=1e-14, n_2=4.0, m_1=-0.3, A_3=3e-12, n_3=3.0, m_2=-0.4),
}
TIMES = np.arange(900.0, 43201.0, 900.0)
LOADING, ELASTIC = ck.PressureJump(P1=8, P2=10, Tj=14400), ck.Elastic(E=150e3)
SD = {"amplitude": 1.5e-3, "width": 0.02, "shape": 0.02}
HEADS = (
    "law",
    "search",
    "candidates",
    "identification: wall s",
    "CPU s",
    "over default",
    "search alone: wall s",
    "CPU s",
    "over default",
    "-2 ln L above default",
)


@dataclass
class TimedSearch:
    """A search that measures its own time: (wall, CPU) seconds."""

    search: object
    spent: tuple[float, float] = (0.0, 0.0)

    def minima(self, cost_function, progress=None):
        start = clocks()
        result = self.search.minima(cost_function, progress)
        self.spent = since(start)
        return result


def clocks():
    return time.perf_counter(), time.process_time()


def since(start):
    return tuple(float(now - then) for now, then in zip(clocks(), start, strict=True))


def law_of(name):
    law = ck.law(name)
    return law.fix(m=0) if name == "drifting-exponent" else law


def simulated_test(name):
    run = ck.simulate(law_of(name), ck.specimen("bulge"), LAWS[name], elastic=ELASTIC, loading=LOADING, times=TIMES)
    rng = np.random.default_rng(0)
    noisy = {output: run.outputs[output] + sd * rng.standard_normal(TIMES.size) for output, sd in SD.items()}
    return ck.History(name, TIMES, noisy, LOADING, 293.15, specimen="bulge", elastic=ELASTIC)


def timed_identification(name, test, model, search, repeats):
    """The identification, and least (wall, CPU) of it and of its search."""
    whole, alone = [], []
    for _ in range(repeats):
        timed, start = TimedSearch(search), clocks()
        fit = ck.identify(law_of(name), [test], model, search=timed)
        whole.append(since(start))
        alone.append(timed.spent)
    return fit, np.min(whole, axis=0), np.min(alone, axis=0)


def main():
    parser = arguments(__doc__)
    parser.add_argument("--particles", type=int, default=300)
    parser.add_argument("--iterations", type=int, default=100)
    parser.add_argument("--laws", nargs="*", default=["norton", "drifting-exponent"], choices=list(LAWS))
    parser.add_argument("--repeats", type=int, default=1)
    options = parser.parse_args()
    model = ck.surrogate("dimple")
    searches = {
        "default": MultiStart(),
        f"swarm {options.particles} x {options.iterations}": ParticleSwarm(options.particles, options.iterations),
        "CMA-ES": CmaEs(),
    }
    page = Page("swarm_speed", __doc__)
    page.table(*HEADS)
    for name in options.laws:
        test = simulated_test(name)
        ck.identify(law_of(name), [test], model, starts=1)  # compiles
        default = None
        for which, search in searches.items():
            fit, whole, alone = timed_identification(name, test, model, search, options.repeats)
            default = default or (fit, whole, alone)
            cells = []
            for seconds, reference in ((whole, default[1]), (alone, default[2])):
                wall, cpu = seconds / reference
                cells += [f"{seconds[0]:.2f}", f"{seconds[1]:.2f}", f"{wall:.1f}, {cpu:.1f}"]
            above = -2 * (fit.log_likelihood - default[0].log_likelihood)
            page.row(name, which, fit.provenance["search_evaluations"], *cells, f"{above:+.2f}")
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
