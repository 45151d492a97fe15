"""Simulation counts: how many simulations an identification of one planted dimple costs, by stage.

    python tests/benchmarks/simulation_counts.py [--dimples 0 1 2 3 4 5] [--before FOLDER] [--write]

The tests are those of law_recovery.py: select() of the four single laws of Table 1 with the modulus free, and
identify() of Garofalo's hyperbolic sine alone with its default settings; answers are printed, as a user would.
A simulation is one candidate in one test; one with sensitivities counts 2.5. "FE" are those of finite elements, "finer"
those of the mesh of half the element size, which corrects them, "reduced" those of the reduced-order model, "coarse"
those of that model at the tolerance of a global search. "Equivalents" is the CPU time of all of them over that of one
simulation by finite elements of the same test; "CPU" is that of the whole work, algebra and statistics included, over
the same. Kernels are compiled, and the reduced-order model is trained, before.
"""

import json
import os
import sys
import time
import warnings
from collections import defaultdict
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import planted_bulge_tests as planted
from measured import Page, arguments, progress

import creepkit as ck
from creepkit.specimens.bulge.reduced_order_model import BulgeReducedOrderModel
from creepkit.specimens.bulge.specimen import Bulge

SENSITIVITIES = 2.5
"""Of a simulation with derivatives, in simulations."""
KINDS = ("FE", "finer", "reduced", "coarse")
STAGES = {
    "screening of starts": ("screened_starts", "check_predicted"),
    "search": ("batched_levenberg_marquardt", "initial_search"),
    "importance sampling": ("with_samples",),
    "challenges": ("challenges_of",),
    "profile": ("profile_likelihood", "profile"),
    "correction of the defect": ("correct_defect",),
    "unmodelled effects": ("perturbations",),
    "adequacy and scatter of rates": ("RateExplanations", "at_own_rates", "adequacy_with_remedies", "rate_scatter"),
    "test table": ("_result",),
    "refinement": ("estimate_iteratively",),
    "shift of the correction": ("_best_estimate",),
}
"""Stages and functions in which a simulation belongs to them: the first that is found on the stack."""


class SimulationCounter:
    """Counts what Bulge and its reduced-order model predict within the context, {(stage, kind): simulations}."""

    def __init__(self):
        self.counts = defaultdict(float)
        self.seconds = defaultdict(float)

    def __enter__(self):
        self.originals = Bulge.predict, BulgeReducedOrderModel.predict
        Bulge.predict = self._counted(Bulge.predict, lambda p: "finer" if p.refinement > 1.0 else "FE")
        BulgeReducedOrderModel.predict = self._counted(
            BulgeReducedOrderModel.predict, lambda p: "coarse" if p.searching else "reduced"
        )
        return self

    def __exit__(self, *_):
        Bulge.predict, BulgeReducedOrderModel.predict = self.originals

    def _counted(self, predict, kind_of):
        def counted(predictor, law, theta, histories, *, nuisances=None, sensitivities=False):
            kind, candidates = kind_of(predictor), max(len(theta), *(len(v) for v in (nuisances or {}).values()), 1)
            weight = candidates * len(histories) * (SENSITIVITIES if sensitivities else 1.0)
            stage = stage_of_stack()
            self.counts[stage, kind] += weight
            start = time.process_time()
            prediction = predict(predictor, law, theta, histories, nuisances=nuisances, sensitivities=sensitivities)
            self.seconds[stage] += time.process_time() - start
            return prediction

        return counted

    def total(self, kind):
        """Simulations of a kind."""
        return sum(count for (_, of), count in self.counts.items() if of == kind)


def stage_of_stack():
    """The stage that the functions on the stack belong to."""
    names, frame = set(), sys._getframe(2)
    while frame is not None:
        names.add(frame.f_code.co_name)
        frame = frame.f_back
    return next((stage for stage, functions in STAGES.items() if names.intersection(functions)), "other")


def counted(work):
    """The result of work(), its counter, and its CPU time in s."""
    with SimulationCounter() as counter, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        start = time.process_time()
        result = work()
        seconds = time.process_time() - start
    return result, counter, seconds


def seconds_of_one(dimple, specimen):
    """CPU time of one simulation by finite elements, s: the least of five."""
    times, law = [], specimen.law
    theta = law.to_internal(specimen.values)
    for _ in range(5):
        start = time.process_time()
        dimple.predict(law, theta, specimen.tests)
        times.append(time.process_time() - start)
    return min(times)


def measured_dimple(k):
    """Answers and counts of one planted dimple, as plain data."""
    dimple = ck.specimen("bulge").replace(threads=1)
    design = planted.DESIGNS["jump"]
    specimen = planted.specimen(k, planted.SINGLE, design, dimple)
    _ = dimple.reduced_order_model().error  # trained before anything is counted
    for law in planted.SINGLE:  # compiles its kernels, with derivatives
        theta = ck.law(law).to_internal(drawn_of(law))
        for predictor in (dimple, dimple.reduced_order_model()):
            for sensitivities in (False, True):
                predictor.predict(ck.law(law), theta, specimen.tests, sensitivities=sensitivities)
    one = seconds_of_one(dimple, specimen)

    def selected():
        ranking = ck.select(planted.SINGLE, specimen.tests, dimple, nuisances=design.nuisances, seed=k)
        return ranking, str(ranking)

    def identified():
        fit = ck.identify("hyperbolic-sine", specimen.tests, dimple, seed=k)
        return fit, str(fit)

    rows = {}
    for name, work in (("select", selected), ("identify", identified)):
        (result, _), counter, seconds = counted(work)
        rows[name] = {
            "counts": [[stage, kind, count] for (stage, kind), count in counter.counts.items()],
            "equivalents": {stage: spent / one for stage, spent in counter.seconds.items()},
            "cpu": seconds / one,
            "answer": answer_of_ranking(result) if name == "select" else values_of(result),
        }
        progress(
            f"  {specimen.name} {name}: {seconds / one:.0f} simulations of {1e3 * one:.0f} ms; "
            + ", ".join(f"{kind} {counter.total(kind):.0f}" for kind in KINDS)
        )
    return {"k": k, "truth": specimen.law.name, **rows}


def drawn_of(name):
    """Values of a single law, as they are planted."""
    return planted.drawn_values(name, np.random.default_rng(0))


def answer_of_ranking(ranking):
    """Weights, verdict, and the values of all laws."""
    return {
        "best": ranking.best.law.name,
        "decisive": ranking.decisive,
        "verdict": ranking.verdict,
        "challenges": [[c.kind, c.subject, c.sentence] for c in ranking.challenges or ()],
        "weights": {r.fit.law.name: r.weight for r in ranking.laws},
        "fits": {r.fit.law.name: values_of(r.fit) for r in ranking.laws},
    }


def values_of(fit):
    """Coordinates, standard deviations, and intervals."""
    return {
        "u": fit.u.tolist(),
        "sd": np.sqrt(np.diag(fit.covariance)).tolist(),
        "chi_square": None if fit.adequacy is None else fit.adequacy.chi_square,
        "verdict": str(fit.adequacy),
        "samples": fit.samples is not None,
        "estimates": {e.name: [e.value, e.low, e.high] for e in fit.estimates},
    }


TITLES = {"select": "select() of four laws", "identify": "identify() of the hyperbolic sine"}


def print_tables(page, dimples, before):
    """Mean counts a dimple by stage, then the totals of each dimple; before : those of an earlier version."""
    for name, title in TITLES.items():
        page.heading(title)
        page.table("stage, mean of all dimples", *KINDS, "equivalents")
        for stage in (*STAGES, "other"):
            counts = [np.mean([simulations(d[name], kind, stage) for d in dimples]) for kind in KINDS]
            if any(counts):
                equivalents = np.mean([d[name]["equivalents"].get(stage, 0.0) for d in dimples])
                page.row(stage, *(f"{count:.0f}" for count in counts), f"{equivalents:.0f}")
        heads = (*KINDS, "equivalents", "CPU")
        page.table("planted dimple", *heads, *(f"before: {head}" for head in heads if before))
        for d in dimples:
            row = totals(d[name]) + [total for b in before if b["k"] == d["k"] for total in totals(b[name])]
            page.row(f"{d['truth']} {d['k']}", *(f"{number:.0f}" for number in row))
        rows = [totals(d[name]) for d in dimples], [totals(b[name]) for b in before]
        page.row("mean", *(f"{number:.0f}" for part in rows if part for number in np.mean(part, axis=0)))
    if before:
        page.heading("Answers")
        page.table("planted dimple", "best law, before", "largest change of a weight", "of a value, in its sd: select",
                   "identify")  # fmt: skip
        for d, b in [(d, b) for d in dimples for b in before if b["k"] == d["k"]]:
            new, old = d["select"]["answer"], b["select"]["answer"]
            change = max(abs(new["weights"].get(law, 0.0) - weight) for law, weight in old["weights"].items())
            moved = max(moved_values(new["fits"][law], old["fits"][law]) for law in old["fits"] if law in new["fits"])
            alone = moved_values(d["identify"]["answer"], b["identify"]["answer"])
            names = f"{new['best']}, {old['best']}"
            page.row(f"{d['truth']} {d['k']}", names, f"{change:.4f}", f"{moved:.3f}", f"{alone:.3f}")


def totals(measured):
    """Simulations by kind, equivalents and CPU."""
    return [*(simulations(measured, kind) for kind in KINDS), sum(measured["equivalents"].values()), measured["cpu"]]


def simulations(measured, kind, stage=None):
    """Simulations of a kind, in a stage or in all."""
    return sum(count for own, of, count in measured["counts"] if of == kind and stage in (None, own))


def moved_values(new, old):
    """Largest difference of coordinates, in standard deviations."""
    return float((np.abs(np.subtract(new["u"], old["u"])) / old["sd"]).max())


def kept(folder, k):
    """The file of a planted dimple in a folder."""
    return Path(folder) / f"{k}.json"


def main():
    parser = arguments(__doc__)
    parser.add_argument("--dimples", nargs="*", type=int, default=list(range(6)), help="numbers of planted dimples")
    parser.add_argument("--keep", default="build/simulation_counts", help="folder in which counts are kept")
    parser.add_argument("--before", help="folder in which an earlier version kept them")
    options = parser.parse_args()
    Path(options.keep).mkdir(parents=True, exist_ok=True)
    for k in options.dimples:
        if not kept(options.keep, k).exists():
            kept(options.keep, k).write_text(json.dumps(measured_dimple(k)))
    dimples = [json.loads(kept(options.keep, k).read_text()) for k in options.dimples]
    earlier = [kept(options.before, k) for k in options.dimples] if options.before else []
    page = Page("simulation_counts", __doc__)
    print_tables(page, dimples, [json.loads(file.read_text()) for file in earlier if file.exists()])
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
