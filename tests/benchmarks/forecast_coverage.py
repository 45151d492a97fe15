"""Coverage of forecasts over planted campaigns: whole curves inside their bands, and times inside their intervals.

    python tests/benchmarks/forecast_coverage.py [--rows NAME ...] [--campaigns 100] [--dimples 40] [--quick]
                                                 [--jobs 2] [--keep FOLDER] [--write]

Each campaign plants an alloy, makes tests of it, identifies the planted law from them and forecasts one further test.
Bars have noise of 5e-5, a loading strain of 1e-4 and a factor on all rates of each test, whose standard deviation
stands in the row; lives scatter further by the second number. Dimples are made on a finer mesh, 8 then 10 MPa, with a
thickness known to 2 % and a modulus to 10 %.

Curves: the share of tests whose whole measured curve lies inside the simultaneous 95 % band, the mean share of frames
inside the pointwise band; of dimples, the amplitude. Times: the share inside the 95 % interval, the mean half width of
ln t, and its ratio to that of an oracle that knows the law, the scatter and the noise. The goal is a coverage of 0.90
to 0.98.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import time
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import planted_bulge_tests as dimples
import planted_creep_tests as bars
from measured import Page, arguments, progress
from proportions import share_with_interval

import creepkit as ck
from creepkit.errors import CreepkitError

LEVEL = 0.95
STARTS = 2
"""Of each search: the planted laws have one minimum."""
QUICK = {"bar": 6, "dimple": 2}
"""Campaigns of a row in the quick form."""


@dataclass(frozen=True)
class Row:
    """One row of the tables.

    law : planted and identified; "" stands for the four single laws of dimples in turn. tests : that are identified.
    rate, damage : standard deviations of ln of a test's own factors. heats : number of heats, with `between` the
    standard deviation of ln of their factors; known : whether the further test is of one of them.
    """

    title: str
    law: str
    tests: int
    rate: float = 0.0
    damage: float = 0.0
    heats: int = 0
    between: float = 0.0
    known: bool = False
    states_noise: bool = True
    isothermal: bool = False
    weights: str = "equal"
    correlated: tuple[float, float] | None = None

    @property
    def kind(self) -> str:
        """What the tests are made of."""
        return "bar" if self.law else "dimple"

    @property
    def nuisances(self) -> tuple[ck.Nuisance, ...]:
        """Those of a fit of dimples."""
        own = (dimples.MODULUS, ck.Nuisance("thickness", sd=0.02 * dimples.NOMINAL))
        return (*own, ck.Nuisance("offset"), ck.Nuisance("rate")) if self.rate else own


def _hardening(tests: int, rate: float, **further: object) -> Row:
    return Row(f"strain hardening, {tests} tests, {rate:g}", bars.HARDENING, tests, rate, **further)


def _heats(known: bool) -> Row:
    title = (
        f"strain hardening, 4 heats of 3 tests, 0.15 between and 0.05 within; {'a known' if known else 'a new'} heat"
    )
    return Row(title, bars.HARDENING, 12, 0.05, heats=4, between=0.15, known=known)


def _rupture(law: str, tests: int, rate: float, damage: float, **further: object) -> Row:
    name = "Kachanov-Rabotnov" if law == bars.KACHANOV else "MPC Omega"
    by_likelihood = ", by likelihood" if further.get("weights") == "likelihood" else ""
    title = f"{name}, {tests} tests, {rate:g} and {damage:g}{by_likelihood}"
    return Row(title, law, tests, rate, damage, **further)


def _dimples(title: str, tests: int, **further: object) -> Row:
    return Row(f"{tests} dimples{title}", "", tests, **further)


ROWS = {
    "sh-3-0.03": _hardening(3, 0.03),
    "sh-3-0.2": _hardening(3, 0.2),
    "sh-6-0.1": _hardening(6, 0.1),
    "sh-12-0.1": _hardening(12, 0.1),
    "norton": Row("Norton, 6 tests, 0.1, noise estimated", "norton", 6, 0.1, states_noise=False),
    "heat-known": _heats(known=True),
    "heat-new": _heats(known=False),
    "kr-4-small": _rupture(bars.KACHANOV, 4, 0.03, 0.03, isothermal=True),
    "kr-7": _rupture(bars.KACHANOV, 7, 0.1, 0.05, isothermal=True),
    "omega-8": _rupture(bars.OMEGA, 8, 0.15, 0.08),
    "dimples-2": _dimples("", 2),
    "dimples-3": _dimples("", 3),
    "dimples-4": _dimples("", 4),
    "dimples-3-rate": _dimples(", rates scatter by 0.1", 3, rate=0.1),
    "dimples-3-correlated": _dimples(", AR(1) noise of D_amp (0.9, 5 um)", 3, correlated=(0.9, 5e-3)),
}


# ---- bars ----------------------------------------------------------------------------------------------------


def drawn(row: Row, sd: float, count: int, rng: np.random.Generator) -> np.ndarray:
    """(count,) ln factors of standard deviation sd."""
    return sd * rng.standard_normal(count)


def bar_campaign(row: Row, rng: np.random.Generator):
    """The tests that are identified, the further one, the alloy, and the oracle's half widths by event."""
    alloy = bars.drawn_alloy(row.law, rng)
    conditions = bars.ISOTHERMAL if row.isothermal else bars.CONDITIONS
    own, damage = drawn(row, row.rate, row.tests + 1, rng), drawn(row, row.damage, row.tests + 1, rng)
    heat_of, labels = np.zeros(row.tests + 1, int), [{}] * (row.tests + 1)
    if row.heats:
        heat_of = np.arange(row.tests + 1) * row.heats // row.tests
        heat_of[-1] = rng.integers(row.heats) if row.known else row.heats
        own = own + (row.between * rng.standard_normal(row.heats + 1))[heat_of]
        labels = [{"heat": f"heat {k}"} for k in heat_of]
    tests = [
        bars.planted_bar(
            f"test {k}",
            alloy,
            conditions[k % len(conditions)],
            bars.Factors(own[k], damage[k]),
            rng,
            states_noise=row.states_noise,
            stopped=k == 4,
            labels=labels[k],
        )
        for k in range(row.tests)
    ]
    condition = rng.uniform(45, 65), bars.T_REF if row.isothermal else rng.uniform(980, 1020)
    factors = bars.Factors(own[-1], damage[-1])
    further = bars.planted_bar(
        "further", alloy, condition, factors, rng, states_noise=row.states_noise, labels=labels[-1]
    )
    unknown_heat = 0.0 if row.known else row.between

    def factors_of_oracle(count, rng):
        rate = drawn(row, row.rate, count, rng) + unknown_heat * rng.standard_normal(count)
        return rate, drawn(row, row.damage, count, rng)

    events = {"strain 0.01": 0.01, **({"rupture": None} if further.rupture_time else {})}
    oracle = {
        event: bars.oracle_half_width(alloy, condition, factors_of_oracle, target, rng)
        for event, target in events.items()
    }
    return tests, further, alloy.law, oracle


# ---- dimples -------------------------------------------------------------------------------------------------


def dimple_campaign(k: int, row: Row, rng: np.random.Generator):
    """As bar_campaign; the last of the specimen's tests is the further one. And the deflection that is asked for."""
    design = dimples.Design(
        row.title,
        thicknesses=(dimples.NOMINAL,) * (row.tests + 1),
        spread=0.02,
        correlated=row.correlated,
        rate=row.rate,
    )
    using = ck.specimen("bulge").replace(threads=1)
    specimen = dimples.specimen(k, dimples.SINGLE, design, using, seed=2027)
    elastic = ck.Elastic(E=specimen.modulus)
    curves = [
        ck.simulate(
            specimen.law,
            using.replace(apex_thickness=dimples.NOMINAL * (1 + step), **dimples.FINE),
            specimen.values,
            elastic=elastic,
            loading=dimples.JUMP,
            times=dimples.TIMES,
            temperature=293.15,
        ).outputs["amplitude"]
        for step in (0.0, -0.01, 0.01)
    ]
    target = float(curves[0][dimples.TIMES == 8 * 3600.0][0])
    thinner, thicker = (np.interp(target, c, np.log(dimples.TIMES)) for c in curves[1:])
    slope = float(thicker - thinner) / 0.02
    half_width = 1.96 * float(np.hypot(slope * 0.02, row.rate))
    return specimen.tests[:-1], specimen.tests[-1], specimen.law, {"deflection": half_width}, target


# ---- campaigns -----------------------------------------------------------------------------------------------


def campaign_result(job: tuple[int, str]) -> dict:
    """All that the tables need of one campaign, as plain numbers."""
    k, name = job
    row = ROWS[name]
    rng = np.random.default_rng([2026, k, *name.encode()])
    settings: dict = {"seed": k, "weights": row.weights, "starts": STARTS}
    targets = None
    if row.kind == "bar":
        tests, further, law, oracle = bar_campaign(row, rng)
    else:
        tests, further, law, oracle, target = dimple_campaign(k, row, rng)
        settings |= {"using": ck.specimen("bulge").replace(threads=1), "nuisances": row.nuisances}
        targets = {"amplitude": [target]}
    start = time.process_time()
    try:
        fit = ck.identify(law, tests, **settings)
        forecast = ck.forecast(fit, further, level=LEVEL, targets=targets)
    except CreepkitError as error:
        return {"k": k, "law": law.name, "failed": str(error)}
    cpu = time.process_time() - start
    (one,) = forecast.tests
    times = {}
    for t in one.times:
        event = {"amplitude": "deflection", "": "rupture"}.get(t.output, f"{t.output} {t.target:g}")
        if event in oracle and t.inside is not None and t.low > 0:
            half_width = 0.5 * float(np.log(t.high / t.low))
            times[event] = {"inside": bool(t.inside), "half width": half_width, "oracle": oracle[event]}
            times[event] |= {"error": float(np.log(t.measured / t.median))}
    assert one.inside is not None
    return {
        "k": k,
        "law": law.name,
        "whole": one.inside.whole,
        "share": one.inside.share,
        "times": times,
        "rate": fit.noise_model.rate,
        "cpu": cpu,
    }


def finished_rows(file: Path, jobs: list[tuple[int, str]], pool) -> list[dict]:
    """The rows of all jobs; those that the file holds of an earlier run, which may have been killed, are kept."""
    file.parent.mkdir(parents=True, exist_ok=True)
    known = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    rows = {row["k"]: row for row in known}
    remaining = [job for job in jobs if job[0] not in rows]
    with file.open("a") as out:
        for row in pool.imap_unordered(campaign_result, remaining):
            rows[row["k"]] = row
            print(json.dumps(row), file=out, flush=True)
    done = [rows[job[0]] for job in jobs]
    whole = [hit for r in done if "whole" in r for hit in list(r["whole"].values())[:1]]
    progress(f"{file.stem}: {len(done)} campaigns, {share_with_interval(whole)} of the curves inside")
    return done


# ---- tables --------------------------------------------------------------------------------------------------


def print_table(page: Page, results: dict[str, list[dict]]) -> None:
    """Coverage of curves and of one time of each row: to rupture, a deflection or a strain."""
    page.table(
        "campaign",
        "campaigns (failed)",
        "whole curve inside [95 % interval]",
        "frames inside",
        "time to",
        "inside [95 % interval]",
        "half width",
        "over an oracle's",
    )
    for name, rows in results.items():
        done = [r for r in rows if "whole" in r]
        output = next(iter(done[0]["whole"]))
        event = [event for r in done for event in r["times"]][-1]
        times = [r["times"][event] for r in done if event in r["times"]]
        finite = [t for t in times if np.isfinite(t["half width"])]
        width, oracle = (float(np.mean([t[key] for t in finite])) for key in ("half width", "oracle"))
        page.row(
            ROWS[name].title,
            f"{len(done)} ({len(rows) - len(done)})",
            share_with_interval([r["whole"][output] for r in done]),
            f"{np.mean([r['share'][output] for r in done]):.3f}",
            event,
            share_with_interval([t["inside"] for t in times]),
            f"{width:.3f}" + (f" ({len(times) - len(finite)} infinite)" if len(finite) < len(times) else ""),
            f"{width / oracle:.2f}",
        )


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--rows", nargs="*", default=list(ROWS), choices=list(ROWS))
    parser.add_argument("--campaigns", type=int, default=100, help="of each row of bars")
    parser.add_argument("--dimples", type=int, default=40, help="campaigns of each row of dimples")
    parser.add_argument("--quick", action="store_true", help="a few campaigns of each row")
    parser.add_argument("--jobs", type=int, default=2, help="worker processes")
    parser.add_argument("--keep", default="build/forecast_coverage", help="folder in which finished campaigns are kept")
    options = parser.parse_args()
    counts = QUICK if options.quick else {"bar": options.campaigns, "dimple": options.dimples}
    results = {}
    with multiprocessing.get_context("spawn").Pool(options.jobs, maxtasksperchild=40) as pool:
        for name in options.rows:
            jobs = [(k, name) for k in range(counts[ROWS[name].kind])]
            results[name] = finished_rows(Path(options.keep) / f"{name}.jsonl", jobs, pool)
    page = Page("forecast_coverage", __doc__)
    print_table(page, results)
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
