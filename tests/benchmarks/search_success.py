"""How often a search ends at the best optimum known: planted bulge tests, one law each.

    python tests/benchmarks/search_success.py [--specimens 40] [--laws norton ...]
                                              [--searches default swarm cma] [--seed 0] [--write]

Each specimen is one 12 h test (8 to 10 MPa after 4 h, 48 frames, white noise of 1.5 um on D_amp, 0.02 mm on S_d, 0.02
on S_p) of a law drawn from PRIORS, simulated and identified through the same predictor, so that nothing but the search
can fail. Rates are stated at 120 MPa, a strain of 0.01 and 1e4 s; tests that burst or creep by less than 20 um are
drawn again.

An identification has succeeded if its -2 ln L lies within 2 of the lowest one found: by 30 starts from 256 draws, each
of whose different minima is refined by itself, and by the searches of the table. Columns: share that succeeded with its
95 % interval (Wilson), the largest difference in -2 ln L, predicted candidates and CPU time of an identification
(medians). The goal is 0.99 for the default search. The row "planted" gives where least squares from the planted values
end: it counts specimens in which that is no more than 2 below the lowest, so that no optimum was missed by all.
"""

import time
from dataclasses import dataclass, field

import numpy as np
from measured import Page, arguments
from proportions import share_with_interval

import creepkit as ck
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.identify import identify
from creepkit.inverse.reference_conditions import ReferencePoint
from creepkit.inverse.search.derivative_free import CmaEs, ParticleSwarm
from creepkit.inverse.search.multistart import MultiStart, distinct
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.starting_estimate import StartingEstimate

REFERENCE = ReferencePoint(stress=120.0, strain=0.01, time=1e4, temperature=1000.0)
RATE = (-7.3, -5.7)
"""log10 of the rate at the reference point, 1/s: some 0.1 to 1 mm of creep in 12 h."""
PRIORS = {
    "norton": {"n": (1.5, 7)},
    "strain-hardening": {"n": (2, 6), "m": (-0.7, -0.2)},
    "time-hardening": {"n": (2, 6), "m": (-0.7, -0.2)},
    "hyperbolic-sine": {"local exponent": (4, 8), "stress/B": (0.5, 4)},
    "drifting-exponent": {"n_0": (3, 6), "n_inf": (3, 6), "C": (0, 3), "tau_d": (2000, 15000), "tau_r": (1000, 10000)},
}
SEARCHES = {"default": None, "swarm": ParticleSwarm(), "cma": CmaEs()}
THOROUGH = MultiStart(starts=30, draws=256)
TIMES = np.arange(900.0, 43201.0, 900.0)
LOADING, ELASTIC = ck.PressureJump(P1=8, P2=10, Tj=14400), ck.Elastic(E=150e3)
SD = {"amplitude": 1.5e-3, "width": 0.02, "shape": 0.02}
LEAST_CREEP = 0.02
"""mm."""
TOLERANCE = 2.0
"""In -2 ln L."""
REFINED_MINIMA = 8
"""Minima of the thorough search that are refined by themselves, at most."""


@dataclass
class RecordedMinima:
    """A search that records the different minima it found."""

    search: object
    starts: list = field(default_factory=list)

    def minima(self, cost_function, progress=None):
        result = self.search.minima(cost_function, progress)
        self.starts = [m.x for m in distinct(result.minima, cost_function.bounds, max_count=REFINED_MINIMA)]
        return result


def law_of(name):
    law = ck.law(name)
    return law.fix(m=0) if name == "drifting-exponent" else law


def drawn_values(law, name, rng):
    """Values of a law from its prior, or None where they lie outside the law's bounds."""
    given = {key: rng.uniform(*ends) for key, ends in PRIORS[name].items()}
    if name == "hyperbolic-sine":
        x = given["stress/B"]
        given = {"n": given["local exponent"] * np.tanh(x) / x, "B": REFERENCE.stress / x}
    given["A"] = 1.0  # its place is taken by the rate
    coordinates = Coordinates(law, REFERENCE)
    u = np.array([p.to_internal(given[n]) for n, p in law.table.items()], float)
    u[list(coordinates.term_rates)] = np.log(10.0) * rng.uniform(*RATE)
    values = coordinates.values(u)
    fits = all(p.bounds[0] <= values[n] <= p.bounds[1] for n, p in law.table.items())
    return values if fits else None


def specimen(name, using, rng):
    """(true values, noisy history)."""
    law = law_of(name)
    while True:
        values = drawn_values(law, name, rng)
        if values is None:
            continue
        run = ck.simulate(law, using, values, elastic=ELASTIC, loading=LOADING, times=TIMES)
        amplitude = run.outputs["amplitude"]
        if np.isfinite(amplitude).all() and amplitude[-1] - amplitude[0] > LEAST_CREEP:
            break
    noisy = {output: run.outputs[output] + sd * rng.standard_normal(TIMES.size) for output, sd in SD.items()}
    test = ck.History(name, TIMES, noisy, LOADING, REFERENCE.temperature, specimen="bulge", elastic=ELASTIC)
    return values, test


def compare_searches(name, using, searches, rng, seed):
    """{search: (-2 ln L over the lowest, candidates, CPU seconds)} of one specimen."""
    law, (values, test), settings = law_of(name), specimen(name, using, rng), IdentificationSettings(seed=seed)
    rows = {}
    for which in searches:
        start = time.process_time()
        fit = identify(law, [test], using, settings=settings, search=SEARCHES[which])
        rows[which] = fit.log_likelihood, fit.provenance["search_evaluations"], time.process_time() - start
    thorough = RecordedMinima(THOROUGH)
    fits = [identify(law, [test], using, settings=settings, search=thorough)]

    def refined(u):
        return identify(law, [test], using, settings=settings, start=StartingEstimate(u, reference=fits[0].reference))

    fits += [refined(u) for u in thorough.starts]
    lowest = -2 * max([fit.log_likelihood for fit in fits] + [row[0] for row in rows.values()])
    theta = np.array([p.to_internal(values[n]) for n, p in law.table.items()], float)
    rows["planted"] = refined(fits[0].coordinates.u(theta)).log_likelihood, 0, np.nan
    return {which: (-2 * likelihood - lowest, *rest) for which, (likelihood, *rest) in rows.items()}


def successes(differences):
    """Share of differences in -2 ln L that are within the tolerance."""
    return share_with_interval([d <= TOLERANCE for d in differences], "wilson")


def main():
    parser = arguments(__doc__)
    parser.add_argument("--specimens", type=int, default=40, help="of each law")
    parser.add_argument("--laws", nargs="*", default=list(PRIORS), choices=list(PRIORS))
    parser.add_argument("--searches", nargs="*", default=list(SEARCHES), choices=list(SEARCHES))
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    using = ck.surrogate("dimple")
    page = Page("search_success", __doc__)
    page.paragraph(f"{options.specimens} specimens of each law, through the reduced-order model.")
    page.table(
        "law", "search", "within 2 of the best [95 % interval]", "largest difference", "candidates", "CPU time, s"
    )
    differences_of = {which: [] for which in options.searches}
    for name in options.laws:
        rng = np.random.default_rng([options.seed, list(PRIORS).index(name)])
        rows = [compare_searches(name, using, options.searches, rng, options.seed) for _ in range(options.specimens)]
        for which in options.searches:
            differences, candidates, seconds = np.array([row[which] for row in rows]).T
            differences_of[which].extend(differences)
            medians = f"{np.median(candidates):.0f}", f"{np.median(seconds):.2f}"
            page.row(name, which, successes(differences), f"{differences.max():.2f}", *medians)
        missed = -np.array([row["planted"][0] for row in rows])
        page.row(name, "planted", successes(missed), f"{missed.max():.2f}", "", "")
    for which, differences in differences_of.items():
        page.row("all", which, successes(differences), f"{max(differences):.2f}", "", "")
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
