"""Which law? Planted laws, identified and ranked: the tables of the README on law recovery and on intervals.

    python tests/benchmarks/law_recovery.py [--design jump ...] [--specimens 200] [--using bulge|net] [--sums]

Designs, laws, priors and noise: tests/benchmarks/planted.py. Each specimen's tests are given to select() with the four
single laws (--sums: two-term laws are planted, and sums of two are candidates beside the singles). Printed, with
Clopper-Pearson 95 % intervals: share of strictly right answers; with laws that the ranking calls equivalent merged;
with hyperbolic-sine and norton merged; truth in the set of laws above 5 %, and its mean size; share of decisive answers
and how many of them are right; wrong and decisive; the confusion matrix. Then coverage of 95 % intervals for the log
rate at .6, 1 and 1.4 times 120 MPa and the local exponent at 120 MPa: of the true law, of the mixture of laws; and the
width of the former over the Fisher bound (scatter known, from the exact Jacobian at the truth).

Finished specimens are kept in --rows: killed and started again, none is done twice.
"""

import argparse
import json
import multiprocessing
import os
import sys
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import planted

import creepkit as ck
from creepkit.cli import set_numba_cache
from creepkit.inverse.noise_model import NoiseModel, OutputNoise, covariance
from creepkit.inverse.problem import least_squares_problem
from creepkit.inverse.selection.discrimination import equivalent_laws
from creepkit.inverse.uncertainty.model_averaging import ModelAverage
from creepkit.inverse.variance_components import scaled_inverse

PAIRS = (("norton", "strain-hardening"), ("norton", "time-hardening"), ("hyperbolic-sine", "time-hardening"),
         ("hyperbolic-sine", "strain-hardening"))  # fmt: skip
LEVELS = (0.6, 1.0, 1.4)


def specimen_result(job):
    """Everything that the tables need of one specimen."""
    k, design_name, names, using_name, sums = job
    set_numba_cache()
    design = planted.DESIGNS[design_name]
    dimple = ck.specimen("bulge").replace(threads=1)
    using = dimple if using_name == "bulge" else ck.surrogate("dimple")
    one = planted.specimen(k, names, design, dimple)
    began = time.process_time()
    ranking = ck.select(planted.SINGLE, one.tests, using, nuisances=design.nuisances, sums=sums, seed=k)
    cost = time.process_time() - began
    return {"k": k, **summary(one, design, ranking, cost)}


def summary(one, design, ranking, cost):
    """Plain numbers of one specimen."""
    truth = one.law.fingerprint
    laws = [r.fit.law.fingerprint for r in ranking.laws]
    position = laws.index(truth) if truth in laws else -1
    same = {truth}
    for pair in equivalent_laws(ranking):
        mates = {pair.first, pair.second}
        if one.law.name in mates:
            same |= {r.fit.law.fingerprint for r in ranking.laws if r.fit.law.name in mates}
    row = {
        "truth": one.law.name, "answer": ranking.best.law.name, "strict": laws[0] == truth, "merged": laws[0] in same,
        "set": [r.fit.law.name for r in ranking.credible], "in set": bool(truth in laws[: len(ranking.credible)]),
        "decisive": ranking.decisive, "cost": cost, "cover": [], "cover mixture": [], "width": [],
        "gap": float(ranking.laws[position].excess) if position >= 0 else np.nan,
    }  # fmt: skip
    if position >= 0:
        fit = ranking.laws[position].fit
        row["cover"], row["width"] = coverage(one, design, fit)
        row["cover mixture"] = covered_by_mixture(one, ranking, fit)
    return row


def quantities(fit, of):
    """(value, low, high) of the four quantities, rates in ln."""
    r = fit.reference
    at = {"strain": r.strain, "time": r.time}
    found = [np.log(np.ravel(of.rate(planted.SIGMA * level, **at))) for level in LEVELS]
    return [*found, np.ravel(of.local_exponent(planted.SIGMA, **at))]


def true_quantities(one, fit):
    """The same of the planted values."""
    u = fit.coordinates.u(one.law.to_internal(one.values)[0])
    return [q[0] for q in quantities(fit, replace(fit, u=u))], u


def coverage(one, design, fit):
    """Which intervals of the true law hold the truth, and their half widths over 1.96 Fisher standard deviations."""
    truth, u = true_quantities(one, fit)
    found = quantities(fit, fit)
    bound = fisher(fit, u, design)
    best = quantities(fit, replace(fit, u=u, covariance=bound, freedom=1e9))
    hits = [bool(low <= t <= high) for t, (_, low, high) in zip(truth, found, strict=True)]
    widths = [(f[2] - f[1]) / max(b[2] - b[1], 1e-12) for f, b in zip(found, best, strict=True)]
    return hits, [float(w) for w in widths]


def fisher(fit, u, design):
    """Covariance of u under the true scatter, from the exact Jacobian at the true values."""
    opened = least_squares_problem(fit)
    x = np.concatenate([u, opened.x[len(u) :]])
    residuals = opened.residual_function.evaluate(x)
    noise = dict(planted.NOISE)
    sizes = {name: OutputNoise(sd) for name, sd in noise.items()}
    if design.correlated:
        coefficient, sd = design.correlated
        scale = opened.residual_function.observations.transforms[0].size
        reach = -5.0 / 48 / np.log(coefficient)
        sizes["amplitude"] = OutputNoise(1e-6, drift=sd / scale, correlation_length=reach)
    weights = np.linalg.inv(
        covariance(replace(residuals, loudness=np.ones_like(residuals.relative_noise)), NoiseModel(sizes))
    )
    own = np.einsum("tep,tef,tfq->pq", residuals.jacobian, weights, residuals.jacobian, optimize=True)
    wide = opened.bounds.width[: len(u)]
    prior = np.concatenate([12.0 / wide**2, opened.residual_function.nuisance_parameters.precision])
    return scaled_inverse(own + np.diag(prior))[: len(u), : len(u)]


def covered_by_mixture(one, ranking, fit):
    """Which intervals of the mixture over laws hold the truth."""
    truth, _ = true_quantities(one, fit)
    found = quantities(fit, ModelAverage.from_ranking(ranking))
    return [bool(low <= t <= high) for t, (_, low, high) in zip(truth, found, strict=True)]


def table(title, rows):
    """Print one design."""
    n = len(rows)
    print(f"\n## {title}: {n} specimens, {np.mean([r['cost'] for r in rows]):.2f} CPU-s each")
    hs_pl = [r["strict"] or {r["truth"], r["answer"]} <= {"norton", "hyperbolic-sine"} for r in rows]
    decisive = [r for r in rows if r["decisive"]]
    right = sum(r["strict"] for r in decisive)
    for label, hits, of in (
        ("strict", sum(r["strict"] for r in rows), n), ("equivalents merged", sum(r["merged"] for r in rows), n),
        ("hyperbolic-sine and norton merged", sum(hs_pl), n), ("truth in the set", sum(r["in set"] for r in rows), n),
        ("decisive", len(decisive), n), ("decisive and right, of these", right, len(decisive)),
        ("decisive and wrong", len(decisive) - right, n),
    ):  # fmt: skip
        print(f"| {label} | {planted.interval(hits, of)} |")
    print(f"| mean size of the set | {np.mean([len(r['set']) for r in rows]):.2f} |")
    for key in ("cover", "cover mixture"):
        all_hits = np.array([r[key] for r in rows if r[key]])
        each = " / ".join(f"{v:.2f}" for v in all_hits.mean(axis=0))
        print(f"| {key}: .6, 1, 1.4 s0, n_loc | {each}; all {planted.interval(int(all_hits.sum()), all_hits.size)} |")
    widths = np.array([r["width"] for r in rows if r["width"]])
    print(f"| width over Fisher bound, medians | {' / '.join(f'{v:.2f}' for v in np.median(widths, axis=0))} |")
    answers = sorted({r["answer"] for r in rows})
    print("truth \\ answer: " + ", ".join(answers))
    for name in sorted({r["truth"] for r in rows}):
        count = Counter(r["answer"] for r in rows if r["truth"] == name)
        print(f"  {name:40} " + " ".join(f"{count[a]:4d}" for a in answers))


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--design", nargs="*", default=["jump"], choices=list(planted.DESIGNS))
    options.add_argument("--specimens", type=int, default=200)
    options.add_argument("--first", type=int, default=0)
    options.add_argument("--using", default="bulge", choices=["bulge", "net"])
    options.add_argument("--sums", action="store_true")
    options.add_argument("--jobs", type=int, default=2)
    options.add_argument("--rows", default="build/law_recovery", help="folder in which finished specimens are kept")
    given = options.parse_args()
    names = PAIRS if given.sums else planted.SINGLE
    for design in given.design:
        numbers = range(given.first, given.first + given.specimens)
        jobs = [(k, design, names, given.using, given.sums) for k in numbers]
        rows = kept(Path(given.rows), jobs, given.jobs)
        title = planted.DESIGNS[design].title + (", two-term laws" if given.sums else "")
        table(f"{title} ({given.using})", rows)


def kept(folder, jobs, processes):
    """The rows of all jobs; what a folder holds of an earlier run, which may have been killed, is not done again."""
    folder.mkdir(parents=True, exist_ok=True)
    _, design, _, using, sums = jobs[0]
    file = folder / f"{design}_{using}{'_sums' if sums else ''}.jsonl"
    known = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    found = {row["k"]: row for row in known}
    todo = [job for job in jobs if job[0] not in found]
    context = multiprocessing.get_context("spawn")
    with context.Pool(processes, maxtasksperchild=20) as pool, file.open("a") as out:
        for done, row in enumerate(pool.imap_unordered(specimen_result, todo)):
            found[row["k"]] = row
            print(json.dumps(row), file=out, flush=True)
            if not row["strict"]:
                print(f"  {row['truth']} {row['k']} -> {row['set']}, behind by {row['gap']:.1f}", flush=True)
            if (done + 1) % 20 == 0:
                print(f"  {done + 1} of {len(todo)}", file=sys.stderr, flush=True)
    return [found[job[0]] for job in jobs]


if __name__ == "__main__":
    main()
