"""Law recovery: planted creep laws, identified from bulge tests and ranked.

    python tests/benchmarks/law_recovery.py [--design jump] [--specimens 200] [--using bulge|surrogate] [--sums]
                                            [--rows FOLDER] [--write]

Each specimen's tests are given to select() with the four single laws of Table 1 (--sums: two-term laws are planted, and
sums of two laws are candidates beside the single ones), through finite elements or the surrogate that ships. Designs,
laws, priors and noise are those of planted_bulge_tests.py; each design has a page of its own. Shares have 95 %
intervals by Clopper and Pearson. "Strict" counts answers that are the planted law; "equivalents merged" counts laws
that the ranking calls equivalent as one; "set of laws" holds those above 5 % of the weight; an answer is decisive above
95 %. Coverage is that of the 95 % intervals of the log rate at 0.6, 1 and 1.4 times 120 MPa and of the local exponent
at 120 MPa: of the planted law, and of the average over laws. The width of the former is given over the Fisher bound
(noise known, exact Jacobian at the planted values).

Finished specimens are kept in the folder of --rows: stopped and started again, none is identified twice.
"""

import json
import multiprocessing
import os
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import planted_bulge_tests as planted
from measured import Page, arguments, progress
from proportions import share_with_interval

import creepkit as ck
from creepkit.cli import set_numba_cache
from creepkit.inverse.noise_model import NoiseModel, OutputNoise, covariance
from creepkit.inverse.selection.discrimination import equivalent_laws
from creepkit.inverse.uncertainty.model_averaging import ModelAverage
from creepkit.inverse.variance_components import scaled_inverse

PAIRS = (
    ("norton", "strain-hardening"),
    ("norton", "time-hardening"),
    ("hyperbolic-sine", "time-hardening"),
    ("hyperbolic-sine", "strain-hardening"),
)
STRESS_LEVELS = (0.6, 1.0, 1.4)
"""Over 120 MPa."""
QUANTITIES = ("log rate at 72 MPa", "log rate at 120 MPa", "log rate at 168 MPa", "local exponent at 120 MPa")


def specimen_result(job):
    """All that the tables need of one specimen, as plain numbers."""
    k, design_name, laws, using_name, sums = job
    set_numba_cache()
    design = planted.DESIGNS[design_name]
    dimple = ck.specimen("bulge").replace(threads=1)
    using = dimple if using_name == "bulge" else ck.surrogate("dimple")
    specimen = planted.specimen(k, laws, design, dimple)
    start = time.process_time()
    ranking = ck.select(planted.SINGLE, specimen.tests, using, nuisances=design.nuisances, sums=sums, seed=k)
    cpu_seconds = time.process_time() - start
    return {"k": k, **summary(specimen, design, ranking, cpu_seconds)}


def summary(specimen, design, ranking, cpu_seconds):
    """The numbers of one specimen."""
    truth = specimen.law.fingerprint
    laws = [r.fit.law.fingerprint for r in ranking.laws]
    position = laws.index(truth) if truth in laws else -1
    equivalent = {truth}
    for pair in equivalent_laws(ranking):
        names = {pair.first, pair.second}
        if specimen.law.name in names:
            equivalent |= {r.fit.law.fingerprint for r in ranking.laws if r.fit.law.name in names}
    row = {
        "truth": specimen.law.name,
        "answer": ranking.best.law.name,
        "strict": laws[0] == truth,
        "merged": laws[0] in equivalent,
        "set": [r.fit.law.name for r in ranking.credible],
        "in set": bool(truth in laws[: len(ranking.credible)]),
        "decisive": ranking.decisive,
        "cpu": cpu_seconds,
        "coverage": [],
        "coverage of the average": [],
        "width": [],
        "excess": float(ranking.laws[position].excess) if position >= 0 else np.nan,
    }
    if position >= 0:
        fit = ranking.laws[position].fit
        row["coverage"], row["width"] = coverage(specimen, design, fit)
        row["coverage of the average"] = coverage_of_average(specimen, ranking, fit)
    return row


def quantities(fit, source):
    """(value, low, high) of the four quantities by a fit or an average of fits, rates as ln."""
    at = {"strain": fit.reference.strain, "time": fit.reference.time}
    log_rates = [np.log(np.ravel(source.rate(planted.SIGMA * level, **at))) for level in STRESS_LEVELS]
    return [*log_rates, np.ravel(source.local_exponent(planted.SIGMA, **at))]


def true_quantities(specimen, fit):
    """The four quantities of the planted values, and these values in the fit's coordinates."""
    u = fit.coordinates.u(specimen.law.to_internal(specimen.values)[0])
    return [q[0] for q in quantities(fit, replace(fit, u=u))], u


def coverage(specimen, design, fit):
    """Which intervals of the planted law hold the truth, and their widths over those of the Fisher bound."""
    truth, u = true_quantities(specimen, fit)
    intervals = quantities(fit, fit)
    bounds = quantities(fit, replace(fit, u=u, covariance=fisher_covariance(fit, u, design), freedom=1e9))
    hits = [bool(low <= t <= high) for t, (_, low, high) in zip(truth, intervals, strict=True)]
    widths = [(q[2] - q[1]) / max(b[2] - b[1], 1e-12) for q, b in zip(intervals, bounds, strict=True)]
    return hits, [float(w) for w in widths]


def fisher_covariance(fit, u, design):
    """Covariance of u under the noise that was planted, from the exact Jacobian at the planted values."""
    problem = fit.least_squares_problem
    x = np.concatenate([u, fit.x[len(u) :]])
    residuals = problem.residuals(x)
    outputs = {name: OutputNoise(sd) for name, sd in planted.NOISE.items()}
    if design.correlated:
        coefficient, sd = design.correlated
        scale = problem.observations.transforms[0].scale
        correlation_length = -5.0 / 48 / np.log(coefficient)
        outputs["amplitude"] = OutputNoise(1e-6, drift=sd / scale, correlation_length=correlation_length)
    known = replace(residuals, relative_noise=np.ones_like(residuals.relative_noise))
    weights = np.linalg.inv(covariance(known, NoiseModel(outputs)))
    information = np.einsum("tep,tef,tfq->pq", residuals.jacobian, weights, residuals.jacobian, optimize=True)
    width = problem.bounds.width[: len(u)]
    prior = np.concatenate([12.0 / width**2, problem.nuisance_parameters.precision])
    return scaled_inverse(information + np.diag(prior))[: len(u), : len(u)]


def coverage_of_average(specimen, ranking, fit):
    """Which intervals of the average over laws hold the truth."""
    truth, _ = true_quantities(specimen, fit)
    intervals = quantities(fit, ModelAverage.from_ranking(ranking))
    return [bool(low <= t <= high) for t, (_, low, high) in zip(truth, intervals, strict=True)]


def print_tables(page, title, rows):
    """The tables of one design."""
    page.paragraph(f"Design: {title}. {len(rows)} specimens, {np.mean([r['cpu'] for r in rows]):.2f} CPU s each.")
    sinh_is_power = [r["strict"] or {r["truth"], r["answer"]} <= {"norton", "hyperbolic-sine"} for r in rows]
    decisive = [r for r in rows if r["decisive"]]
    shares = {
        "answer is the planted law (strict)": [r["strict"] for r in rows],
        "the same, equivalents merged": [r["merged"] for r in rows],
        "the same, hyperbolic sine and Norton merged": sinh_is_power,
        "planted law in the set of laws": [r["in set"] for r in rows],
        "decisive": [r["decisive"] for r in rows],
        "right, of the decisive ones": [r["strict"] for r in decisive],
        "decisive and wrong": [r["decisive"] and not r["strict"] for r in rows],
    }
    page.table("quantity", "share [95 % interval]", "specimens")
    for label, hits in shares.items():
        page.row(label, share_with_interval(hits), len(hits))
    page.paragraph(f"Mean size of the set of laws: {np.mean([len(r['set']) for r in rows]):.2f}.")
    page.table("coverage of 95 % intervals", *QUANTITIES, "all [95 % interval]")
    for label, key in (("planted law", "coverage"), ("average over laws", "coverage of the average")):
        hits = np.array([r[key] for r in rows if r[key]])
        page.row(label, *(f"{share:.2f}" for share in hits.mean(axis=0)), share_with_interval(hits.ravel()))
    page.table("width of intervals over the Fisher bound", *QUANTITIES)
    widths = np.array([r["width"] for r in rows if r["width"]])
    page.row("median", *(f"{width:.2f}" for width in np.median(widths, axis=0)))
    answers = sorted({r["answer"] for r in rows})
    page.table("planted law (rows), answer (columns): specimens", *answers)
    for name in sorted({r["truth"] for r in rows}):
        count = Counter(r["answer"] for r in rows if r["truth"] == name)
        page.row(name, *(count[answer] for answer in answers))


def main():
    parser = arguments(__doc__)
    parser.add_argument("--design", nargs="*", default=["jump"], choices=list(planted.DESIGNS))
    parser.add_argument("--specimens", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, help="number of the first specimen")
    parser.add_argument("--using", default="bulge", choices=["bulge", "surrogate"])
    parser.add_argument("--sums", action="store_true")
    parser.add_argument("--jobs", type=int, default=2, help="worker processes")
    parser.add_argument("--rows", default="build/law_recovery", help="folder in which finished specimens are kept")
    options = parser.parse_args()
    laws = PAIRS if options.sums else planted.SINGLE
    for design in options.design:
        numbers = range(options.first, options.first + options.specimens)
        jobs = [(k, design, laws, options.using, options.sums) for k in numbers]
        variant = f"{design}{'_sums' if options.sums else ''}{'_surrogate' if options.using == 'surrogate' else ''}"
        rows = finished_rows(Path(options.rows) / f"{variant}.jsonl", jobs, options.jobs)
        page = Page(f"law_recovery_{variant}", __doc__)
        title = planted.DESIGNS[design].title + (", two-term laws" if options.sums else "")
        through = "finite elements" if options.using == "bulge" else "the surrogate"
        print_tables(page, f"{title}; through {through}", rows)
        if options.write:
            page.write()


def finished_rows(file, jobs, processes):
    """The rows of all jobs; those that the file holds of an earlier run, which may have been killed, are kept."""
    file.parent.mkdir(parents=True, exist_ok=True)
    known = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    rows = {row["k"]: row for row in known}
    remaining = [job for job in jobs if job[0] not in rows]
    context = multiprocessing.get_context("spawn")
    with context.Pool(processes, maxtasksperchild=20) as pool, file.open("a") as out:
        for done, row in enumerate(pool.imap_unordered(specimen_result, remaining), start=1):
            rows[row["k"]] = row
            print(json.dumps(row), file=out, flush=True)
            if not row["strict"]:
                progress(f"  {row['truth']} {row['k']}: set of laws {row['set']}, behind by {row['excess']:.1f}")
            if done % 20 == 0:
                progress(f"  {done} of {len(remaining)}")
    return [rows[job[0]] for job in jobs]


if __name__ == "__main__":
    main()
