"""Design of experiments: what a proposed test is expected to tell, and what it tells once it is planted and made.

    python tests/benchmarks/design_of_experiments.py [--bars 60] [--dimples 40] [--law-bars 120] [--laws 100]
                                                     [--shares half equal] [--jobs 1] [--keep FOLDER] [--write]

Precision: a planted law is identified, the next test for the rate at a stress of service is asked of ck.design(),
planted, made, and all tests are identified again. "Predicted over realised" is the standard deviation of ln rate that
was expected over the one that the new identification states; "deviation" that of its estimate from the truth in units
of the predicted one, root mean square. Bars: three creep curves; "scatter": five, whose rates scatter by 10 %; dimples:
2 h of 8, then 10 MPa with one dimple, modulus unknown by 10 %.

The law: one of the four single laws of Table 1 is planted. "Standard" is 8, then 10 MPa for 12 h, with one dimple or
three. Designed campaigns begin with 2 h ("first") and go on with what ck.design() proposes for half of the standard
hours, unless the verdict is decisive already. "Singled out" has more than 0.95 of the weight and explains the tests;
"decisive" stands every challenge too. Norton's law is a special case of the others: it is singled out where their
values make them that law over the tests.
"""

import json
import multiprocessing
import os
import time
import warnings
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import planted_bulge_tests as planted
from design_tables import print_arms, print_expectations, print_precision
from measured import Page, arguments, progress

import creepkit as ck
from creepkit.errors import CreepkitError, FitWarning
from creepkit.experiments.rig import frame_times, rigs_of
from creepkit.inverse.uncertainty.laplace_approximation import NORMAL_QUANTILE

SERVICE = {"bars": 40.0, "scatter": 40.0, "dimples": 60.0}
"""MPa, of the rate that is wanted: below the tests."""
BAR_NOISE, BAR_END = 2e-5, 3.6e5
BAR_STRESSES = {"bars": (60.0, 80.0, 100.0), "scatter": (60.0, 70.0, 80.0, 90.0, 100.0)}
SCATTER = {"bars": 0.0, "scatter": 0.1}
BAR_LAWS = ("norton", "strain-hardening", "time-hardening")
LAW_BAR_STRESSES, LAW_BAR_NOISE = (70.0, 80.0, 90.0), 1e-4
FIRST_RUN = ck.PressureJump(P1=8, P2=10, Tj=2400)
FIRST_END, STANDARD_END, FRAME_INTERVAL = 7200.0, 43200.0, 300.0
THICKNESSES = (0.44, 0.50, 0.58)
STANDARD_HOURS = 13.0
"""12 h and 1 h to set it up."""
STANDARD = {"standard, one dimple": (0.50,), "standard, three dimples": THICKNESSES}
SHARES = {"half": 0.5, "equal": 1.0}
"""Of the hours of the standard test."""


# ---- planted tests ---------------------------------------------------------------------------------------------------


def drawn_bar_law(name, rng):
    """Values that reach a strain of 0.3 to 3 % at 80 MPa in the time of a test."""
    strain, n = 10.0 ** rng.uniform(-2.5, -1.5), rng.uniform(3.0, 6.0)
    if name == "norton":
        return {"A": strain / BAR_END / 80.0**n, "n": n}
    if name == "hyperbolic-sine":
        B = 80.0 / rng.uniform(1.0, 4.0)
        n = rng.uniform(1.0, 3.0)
        return {"A": strain / BAR_END / float(np.sinh(80.0 / B)) ** n, "n": n, "B": B}
    m = rng.uniform(-0.6, -0.2)
    if name == "strain-hardening":
        return {"A": strain ** (1 - m) / (1 - m) / BAR_END / 80.0**n, "n": n, "m": m}
    return {"A": strain * (1 + m) / BAR_END ** (1 + m) / 80.0**n, "n": n, "m": m}


def made_bar(law, values, history, scatter, rng, sd=BAR_NOISE):
    """A planned or blank bar with what is measured of it; sd : of its noise."""
    own = {**values, "A": values["A"] * float(np.exp(scatter * rng.standard_normal()))}
    run = ck.simulate(law, "uniaxial", own, loading=history.loading, times=history.times, temperature=1000.0)
    noise = sd * rng.standard_normal(history.times.size)
    stated = {"strain": np.full(history.times.size, sd)}
    return history.replace(outputs={"strain": run.outputs["strain"] + noise}, standard_deviation=stated)


def made_dimple(alloy, history, dimple, rng):
    """A planned dimple with what is measured of it, up to where it bursts; None where it has no frame."""
    law, values, elastic = alloy
    finer = dimple.replace(apex_thickness=history.geometry["apex_thickness"], **planted.FINE)
    run = ck.simulate(law, finer, values, elastic=elastic, loading=history.loading, times=history.times)
    count = int(np.isfinite(run.outputs["amplitude"]).sum())
    if count < 5:
        return None
    times = history.times[:count]
    outputs = {name: run.outputs[name][:count] + sd * rng.standard_normal(count) for name, sd in planted.NOISE.items()}
    sd = {name: np.full(count, value) for name, value in planted.NOISE.items()}
    return history.replace(times=times, outputs=outputs, standard_deviation=sd)


def blank_dimple(name, thickness, loading, end):
    """A dimple to be tested, with the frames of a planned test."""
    return ck.History(
        name=name,
        times=frame_times(end, FRAME_INTERVAL),
        outputs={},
        loading=loading,
        temperature=293.15,
        specimen="bulge",
        elastic=ck.Elastic(E=150e3),
        geometry={"apex_thickness": thickness},
    )


def drawn_alloy(k, dimple):
    """Law, values and elastic data of planted alloy k: one whose standard test is informative."""
    specimen = planted.specimen(k, planted.SINGLE, planted.DESIGNS["jump"], dimple)
    rng = np.random.default_rng([7, k])
    modulus = 150e3 * (1.0 + 0.1 * np.clip(rng.standard_normal(), -2, 2))
    return (specimen.law, specimen.values, ck.Elastic(E=modulus)), rng


# ---- precision -------------------------------------------------------------------------------------------------------


def precision_campaign(job):
    """One planted campaign of the precision of a rate."""
    kind, k = job
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FitWarning)
        try:
            return {"k": k, **(dimple_precision(k) if kind == "dimples" else bar_precision(kind, k))}
        except CreepkitError as error:
            return {"k": k, "failed": str(error)}


def bar_precision(kind, k):
    rng = np.random.default_rng([11, k, len(BAR_STRESSES[kind])])
    law = ck.law(BAR_LAWS[k % len(BAR_LAWS)])
    values, scatter = drawn_bar_law(law.name, rng), SCATTER[kind]
    times = np.geomspace(1e-2, 1.0, 40) * BAR_END
    blanks = [
        ck.History(f"bar {j}", times, {}, ck.constant_stress(s, "stress"), 1000.0)
        for j, s in enumerate(BAR_STRESSES[kind])
    ]
    tests = [made_bar(law, values, blank, scatter, rng) for blank in blanks]
    nuisances = [ck.Nuisance("rate")] if scatter else []
    settings = {"weights": "likelihood", "nuisances": nuisances}
    fit = ck.identify(law, tests, "uniaxial", **settings)
    rig = replace(rigs_of(fit.histories, fit.predictor)[0], levels=(50.0, 110.0), longest_hours=100.0)
    start = time.process_time()
    design = ck.design(fit, rig=rig, goal=ck.rate_at(SERVICE[kind]))
    cpu = time.process_time() - start
    made = [made_bar(law, values, h.replace(name="new"), scatter, rng) for h in design.best.histories]
    after = ck.identify(law, [*tests, *made], "uniaxial", **settings)
    truth = true_log_rate(after, values, SERVICE[kind])
    return precision_row(law.name, design, fit, after, truth, SERVICE[kind], cpu)


def dimple_precision(k):
    dimple = ck.specimen("bulge").replace(threads=1)
    alloy, rng = drawn_alloy(k, dimple)
    law, values, _ = alloy
    first = made_dimple(alloy, blank_dimple("first", 0.5, FIRST_RUN, FIRST_END), dimple, rng)
    settings = {"weights": "likelihood", "nuisances": [planted.MODULUS]}
    fit = ck.identify(law, [first], dimple, **settings)
    rig = replace(rigs_of(fit.histories, dimple)[0], levels=(4.0, 14.0), longest_hours=12.0, largest_output=0.8)
    start = time.process_time()
    design = ck.design(fit, rig=rig, goal=ck.rate_at(SERVICE["dimples"]))
    cpu = time.process_time() - start
    made = [made_dimple(alloy, h.replace(name=f"new {j}"), dimple, rng) for j, h in enumerate(design.best.histories)]
    after = ck.identify(law, [first, *made], dimple, **settings)
    truth = true_log_rate(after, values, SERVICE["dimples"])
    return precision_row(law.name, design, fit, after, truth, SERVICE["dimples"], cpu)


def true_log_rate(fit, values, stress):
    """ln rate of the planted values at the strain and time at which the fit states it."""
    u = fit.coordinates.u(fit.law.to_internal(values)[0])
    return float(np.log(replace(fit, u=u, samples=None).rate(stress)[0]))


def log_rate_and_sd(fit, stress):
    """ln rate and its standard deviation by an identification."""
    rate, low, high = (float(v) for v in fit.rate(stress))
    quantile = NORMAL_QUANTILE
    return np.log(rate), np.log(high / low) / (2.0 * quantile)


def precision_row(name, design, before, after, truth, stress, cpu):
    estimate, realised = log_rate_and_sd(after, stress)
    e = design.best.expectation
    return {
        "law": name,
        "test": design.best.description,
        "before": log_rate_and_sd(before, stress)[1],
        "predicted": e.sd,
        "realised": realised,
        "deviation": float(estimate - truth) / e.sd,
        "cpu": cpu,
    }


# ---- the law ---------------------------------------------------------------------------------------------------------


def law_bar_campaign(job):
    """One planted alloy: three bars, the test that is proposed for the law, and what it tells."""
    _, k = job
    rng = np.random.default_rng([13, k])
    law = ck.law(planted.SINGLE[k % len(planted.SINGLE)])
    values = drawn_bar_law(law.name, rng)
    times = np.linspace(0.025, 1.0, 40) * BAR_END

    def made(histories):
        return [made_bar(law, values, h, 0.0, rng, LAW_BAR_NOISE) for h in histories]

    def select(tests):
        return ck.select(planted.SINGLE, tests, "uniaxial", nuisances=[], seed=k, further_laws=0)

    blanks = [
        ck.History(f"bar {j}", times, {}, ck.constant_stress(s, "stress"), 1000.0)
        for j, s in enumerate(LAW_BAR_STRESSES)
    ]
    try:
        tests = made(blanks)
        ranking = select(tests)
        row = {"k": k, "truth": law.name, "cpu": [], "directions": [], "first": verdict_row(ranking, law, 0.0)}
        if len(ranking.credible) < 2:
            return row
        rig = replace(rigs_of(tests, ranking.best.predictor)[0], levels=(50.0, 110.0), longest_hours=100.0)
        start = time.process_time()
        design = ck.design(ranking, rig=rig, goal="law", seed=k)
        row["cpu"].append(time.process_time() - start)
        new = made([h.replace(name=f"new {j}") for j, h in enumerate(design.best.histories)])
        after = select([*tests, *new])
        expected = design.best.expectation
        row["bars"] = {**verdict_row(after, law, design.best.hours), "probability": float(expected.probability)}
        row["directions"] = met_directions("bars", expected, after, law)
        return row
    except CreepkitError as error:
        return {"k": k, "failed": str(error)}


def met_directions(name, expected, after, law):
    """[name, alternative, current, expected, met] of chi-squares against the planted law."""
    chi = {r.fit.law.name: r.chi_square for r in after.laws}
    return [
        [name, c.alternative_law, c.current, c.expected, chi[c.alternative_law] - chi[law.name]]
        for c in expected.chi_squares
        if c.reference_law == law.name and {law.name, c.alternative_law} <= set(chi)
    ]


def law_campaign(job):
    """One planted alloy: standard tests, and designed campaigns."""
    _, k, shares = job
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FitWarning)
        try:
            return planted_law(k, shares)
        except CreepkitError as error:
            return {"k": k, "failed": str(error)}


def planted_law(k, shares):
    """The verdicts of all campaigns of one planted alloy."""
    dimple = ck.specimen("bulge").replace(threads=1)
    alloy, rng = drawn_alloy(k, dimple)
    row = {"k": k, "truth": alloy[0].name, "cpu": [], "directions": []}

    def made(name, thicknesses, loading, end):
        blanks = [blank_dimple(f"{name} {j}", t, loading, end) for j, t in enumerate(thicknesses)]
        return [made_dimple(alloy, blank, dimple, rng) for blank in blanks]

    for name, thicknesses in STANDARD.items():
        tests = [test for test in made(name, thicknesses, planted.JUMP, STANDARD_END) if test is not None]
        row[name] = verdict_row(selected(tests, dimple, k), alloy[0], STANDARD_HOURS)
    first = made("first", THICKNESSES, FIRST_RUN, FIRST_END)
    if any(test is None for test in first):
        return {"k": k, "failed": "a dimple of the first run bursts at once"}
    ranking = selected(first, dimple, k)
    row["first"] = verdict_row(ranking, alloy[0], FIRST_END / 3600.0 + 1.0)
    for name in shares:
        row[name] = row["first"]
        if not ranking.decisive:
            row[name] = designed_row(name, (alloy, first, ranking, dimple, k), SHARES[name], rng, row)
    return row


def selected(tests, dimple, k):
    return ck.select(planted.SINGLE, tests, dimple, nuisances=[planted.MODULUS], seed=k, further_laws=0)


def designed_row(name, campaign, share, rng, row):
    """The verdict after the runs that are proposed for the rest of the hours."""
    alloy, first, ranking, dimple, k = campaign
    spent = FIRST_END / 3600.0 + 1.0
    rig = replace(
        rigs_of(first, dimple)[0],
        levels=(4.0, 14.0), longest_hours=12.0, tests_per_run=3, frame_interval=FRAME_INTERVAL, largest_output=0.8,
        dimensions={"apex_thickness": THICKNESSES},
    )  # fmt: skip
    start = time.process_time()
    design = ck.design(ranking, rig=rig, goal="law", budget=share * STANDARD_HOURS - spent, seed=k)
    row["cpu"].append(time.process_time() - start)
    planned = [h.replace(name=f"{name} {i}.{j}") for i, t in enumerate(design.plan) for j, h in enumerate(t.histories)]
    tests = [made_dimple(alloy, h, dimple, rng) for h in planned]
    after = selected([*first, *(test for test in tests if test is not None)], dimple, k)
    result = verdict_row(after, alloy[0], spent + sum(t.hours for t in design.plan))
    result["plan"] = [t.description for t in design.plan]
    if design.expected is not None:
        result["probability"] = float(design.expected.probability)
        row["directions"] += met_directions(name, design.expected, after, alloy[0])
    return result


def verdict_row(ranking, law, hours):
    right = ranking.best.law.fingerprint == law.fingerprint
    return {
        "right": right,
        "singled out": ranking.singled_out,
        "decisive": ranking.decisive,
        "weight": ranking.laws[0].weight,
        "hours": hours,
        "verdict": ranking.verdict,
    }


# ---- tables ----------------------------------------------------------------------------------------------------------


def finished_rows(file, campaign, jobs, processes):
    """The rows of all jobs; those that the file holds of an earlier run, which may have been killed, are kept."""
    file.parent.mkdir(parents=True, exist_ok=True)
    known = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    rows = {row["k"]: row for row in known}
    remaining = [job for job in jobs if job[1] not in rows]
    if remaining:
        with multiprocessing.get_context("spawn").Pool(processes, maxtasksperchild=20) as pool, file.open("a") as out:
            for done, row in enumerate(pool.imap_unordered(campaign, remaining), start=1):
                rows[row["k"]] = row
                print(json.dumps(row), file=out, flush=True)
                progress(f"  {file.stem}: {done} of {len(remaining)}")
    return [rows[job[1]] for job in jobs if "failed" not in rows[job[1]]]


def main():
    parser = arguments(__doc__)
    parser.add_argument("--bars", type=int, default=60, help="campaigns of bars, with and without scatter each")
    parser.add_argument("--dimples", type=int, default=40, help="campaigns of the precision of dimples")
    parser.add_argument("--law-bars", type=int, default=120, help="planted alloys of the part on the law by bars")
    parser.add_argument("--laws", type=int, default=100, help="planted alloys of the part on the law by dimples")
    parser.add_argument("--shares", nargs="*", default=list(SHARES), choices=list(SHARES), help="hours of designs")
    parser.add_argument("--jobs", type=int, default=1, help="worker processes")
    parser.add_argument("--keep", default="build/design_of_experiments", help="folder of finished campaigns")
    options = parser.parse_args()
    folder, counts = Path(options.keep), {"bars": options.bars, "scatter": options.bars, "dimples": options.dimples}
    rows_by_kind = {
        kind: finished_rows(
            folder / f"{kind}.jsonl", precision_campaign, [(kind, k) for k in range(count)], options.jobs
        )
        for kind, count in counts.items()
    }
    bars = [("law bars", k) for k in range(options.law_bars)]
    law_bars = finished_rows(folder / "law_bars.jsonl", law_bar_campaign, bars, options.jobs)
    jobs = [("law", k, options.shares) for k in range(options.laws)]
    laws = finished_rows(folder / "laws.jsonl", law_campaign, jobs, options.jobs)
    page = Page("design_of_experiments", __doc__)
    print_precision(page, rows_by_kind)
    if law_bars:
        page.heading("Which law it is, by bars")
        print_expectations(page, law_bars, ("bars",))
    if laws:
        print_arms(page, laws, STANDARD, options.shares)
        print_expectations(page, laws, options.shares)
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
