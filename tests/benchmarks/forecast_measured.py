"""Forecasts of measured tests, each from the identification of all others: Inconel 625, Alloy 617 and CMSX-6.

    python tests/benchmarks/forecast_measured.py [--data FOLDER] [--sets cmsx6 ...] [--quick] [--starts 2]
                                                 [--keep FOLDER] [--write]

Each law is identified from all tests of a set, then again without one test, which `ck.forecast` predicts at a level of
0.95. Whole curve: all frames inside the simultaneous band. Times: inside the 95 % interval; a stopped test counts as
inside where the upper end is later. "Law only" is the interval by the
parameters alone, without the scatter of tests, noise and tolerances.

Inconel 625: nine bulge tests by finite elements; thickness 0.4935 mm (0.027 mm), camera zero 12 um and the rate of each
test are nuisance parameters. Alloy 617, base metal: 80 tests, the folder of a record naming its laboratory; no heats
are named. CMSX-6: nine tests at 980 C, six ruptured.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from measured import Page, arguments, progress
from measured_creep import STRAIN_LIMIT
from proportions import share_with_interval

import creepkit as ck
from creepkit.forecasts.draws import SimulatedTest, crossing_times, law_draws, uncertain_quantities
from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import refit
from creepkit.inverse.reference_conditions import reference_temperature, usable_frames
from creepkit.quality.repeats import duplicate_tests
from creepkit.records import History

LEVEL = 0.95
DRAWS = 500
QUICK_TESTS = 2

Result = dict[str, Any]


@dataclass(frozen=True)
class Case:
    """A law and the tests that it is identified from; targets : of the times that are asked for."""

    set: str
    name: str
    law: ck.CreepLaw
    tests: Sequence[History]
    targets: dict[str, list[float]]
    using: Any = "uniaxial"
    nuisances: tuple[ck.Nuisance, ...] | None = None

    def identified(self, starts: int) -> Identification:
        """The law, from all tests."""
        further = {} if self.nuisances is None else {"nuisances": self.nuisances}
        return ck.identify(self.law, self.tests, using=self.using, starts=starts, **further)


def inconel_625(folder: Path) -> list[Case]:
    """Norton's law and n(t), for the time to 0.2 mm."""
    tests = ck.exclude_suspect_frames(ck.read_histories(folder / "dabi" / "in625"))
    arrhenius = ck.arrhenius(T_ref=1050.0)
    laws = {"Norton": ck.law("norton"), "n(t)": ck.law("drifting-exponent").fix(m=0)}
    rig = (ck.Nuisance("offset", sd=0.012), ck.Nuisance("thickness", mean=0.4935, sd=0.027), ck.Nuisance("rate"))
    return [
        Case("Inconel 625", name, law.times(arrhenius), tests, {"amplitude": [0.2]}, "bulge", rig)
        for name, law in laws.items()
    ]


def alloy_617(folder: Path) -> list[Case]:
    """Strain hardening to 5 % strain, and MPC Omega to rupture."""
    tests = [h for h in ck.read_histories(folder / "uniaxial" / "alloy617") if h.labels.get("product") == "Base"]
    duplicates = {other for _, other in duplicate_tests(tests)}
    tests = [h if h.end_known else h.replace(unruptured=True) for h in tests if h.name not in duplicates]
    tests = [h.replace(labels={**h.labels, "laboratory": Path(h.labels["file"]).parent.name}) for h in tests]
    T = reference_temperature(tests)
    early = [h.up_to("strain", STRAIN_LIMIT) for h in tests]
    early = [h for h in early if (h.used & (h.times > 0)).sum() >= 2]
    hardening = ck.law("strain-hardening").times(ck.arrhenius(T_ref=T))
    omega = ck.law("mpc-omega").fix(c=0).times(ck.arrhenius(T_ref=T)).with_temperature(Omega=ck.activated(T_ref=T))
    return [
        Case("Alloy 617, to 5 % strain", "strain hardening", hardening, early, {"strain": [0.01]}),
        Case("Alloy 617, to rupture", "MPC Omega", omega, tests, {"strain": [0.01]}, _bar()),
    ]


def cmsx_6(folder: Path) -> list[Case]:
    """Kachanov-Rabotnov and MPC Omega to rupture."""
    tests = ck.read_histories(folder / "uniaxial" / "cmsx6")
    laws = {
        "Kachanov-Rabotnov, primary": ck.law("kachanov-rabotnov").fix(alpha=0),
        "MPC Omega, Omega(stress)": ck.law("mpc-omega"),
    }
    return [Case("CMSX-6", name, law, tests, {"strain": [0.01]}, _bar()) for name, law in laws.items()]


def _bar() -> Any:
    """Strains within some 1e-3, far below the scatter."""
    return ck.specimen("uniaxial").replace(tolerance=1e-4)


SETS: dict[str, Callable[[Path], list[Case]]] = {"cmsx6": cmsx_6, "alloy617": alloy_617, "in625": inconel_625}


def forecast_of(case: Case, fit: Identification, history: History) -> Result:
    """What tables need of one held-out test, as plain numbers."""
    (one,) = ck.forecast(fit, history, level=LEVEL, targets=case.targets, draws=DRAWS).tests
    output = next(iter(one.outputs))
    times = [
        {
            "event": t.event.removeprefix("engineering ").removeprefix("logarithmic "),
            "value": t.value,
            "median": t.median,
            "interval": [t.low, t.high],
            "measured": t.measured,
            "censored": t.censored,
            "inside": t.inside,
        }
        for t in one.times
    ]
    law_only = law_only_of(case, fit, history, output)
    result: Result = {"test": history.name, "output": output, "times": times, "law only": law_only}
    if one.inside is not None:
        result |= {"whole": one.inside.whole, "share": one.inside.share}
    return result


def law_only_of(case: Case, fit: Identification, history: History, output: str) -> Result:
    """Intervals by the parameters alone: the share of frames inside, and times, in the order of a forecast."""
    rng = np.random.default_rng(0)
    predictor = fit.predictor
    assert predictor is not None
    draws = law_draws(fit, DRAWS, rng)
    centre = {d.kind: d.mean for d in uncertain_quantities(fit, history, predictor, {})}
    fixed = {kind: np.full((DRAWS, 1), value) for kind, value in centre.items()}
    drawn = SimulatedTest(fit, predictor, history, centre).drawn(draws.u, np.zeros((2, DRAWS)), fixed)
    values = drawn.of(output, history.times)
    ordered = np.sort(np.where(np.isfinite(values), values, np.inf), axis=0)
    low, high = (ordered[int(p * DRAWS)] for p in (0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL))
    used = usable_frames(history, output)
    measured = history.outputs[output][used]
    inside = (measured >= low[used]) & (measured <= high[used])
    crossings = {
        f"{name} {value:g}": crossing_times(drawn, name, np.full(DRAWS, value))
        for name, targets in case.targets.items()
        for value in targets
    }
    crossings["rupture"] = drawn.end_times
    intervals = {}
    for event, times in crossings.items():
        known = np.sort(times[~np.isnan(times)])
        intervals[event] = [float(known[int(p * known.size)]) for p in (0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL)]
    return {"share": float(inside.mean()), "whole": bool(inside.all()), "times": intervals}


def finished_results(case: Case, options: Any) -> list[Result]:
    """The results of all tests of a case; those that the file holds of an earlier run are kept."""
    stem = f"{case.set}_{case.name}".replace(" ", "_").replace(",", "").replace("(", "").replace(")", "")
    file = options.keep / f"{stem.replace('%', '')}.jsonl"
    file.parent.mkdir(parents=True, exist_ok=True)
    known = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
    rows = {row["test"]: row for row in known}
    held_out = list(case.tests)[: QUICK_TESTS if options.quick else None]
    fit = None
    with file.open("a") as out:
        for history in (h for h in held_out if h.name not in rows):
            start = time.process_time()
            fit = fit or case.identified(options.starts)
            fold = refit(fit, [h for h in case.tests if h is not history])
            row = forecast_of(case, fold, history) | {"cpu": time.process_time() - start}
            rows[history.name] = row
            print(json.dumps(row), file=out, flush=True)
            progress(f"{case.set}, {case.name}: {len(rows)} of {len(case.tests)}, {row['cpu']:.1f} CPU s")
    return [rows[h.name] for h in held_out]


# ---- tables --------------------------------------------------------------------------------------------------


def law_only_inside(result: Result, one: Result) -> bool:
    """Whether a measured time is inside the interval by the parameters alone."""
    low, high = law_only_interval(result, one["event"])
    measured = one["measured"]
    return bool(measured <= high if one["censored"] else low <= measured <= high)


def law_only_interval(result: Result, event: str) -> list[float]:
    """Its ends, s; an event is named with its unit, there without."""
    intervals = result["law only"]["times"]
    return next(interval for name, interval in intervals.items() if event.startswith(name))


def measured_times(results: Sequence[Result], event: str) -> list[tuple[Result, Result]]:
    """(result, time) of the tests that an event was measured of."""
    return [(r, t) for r in results for t in r["times"] if t["event"] == event and t["inside"] is not None]


def half_width(interval: Sequence[float]) -> float:
    """As a factor; infinite where an end is."""
    low, high = interval
    return float(np.sqrt(high / low)) if np.isfinite(high) and low > 0 else float("inf")


def print_summary(page: Page, results: dict[tuple[str, str], list[Result]]) -> None:
    """One line for curves, and one for times, of each set and law."""
    page.table(
        "set",
        "law",
        "whole curves inside [95 % interval]",
        "frames inside the pointwise band",
        "frames inside, law only",
        "whole curves inside, law only",
    )
    for (name, law), rows in results.items():
        scored = [r for r in rows if "whole" in r]
        page.row(
            name,
            law,
            share_with_interval([r["whole"][r["output"]] for r in scored]),
            f"{np.mean([r['share'][r['output']] for r in scored]):.3f}",
            f"{np.mean([r['law only']['share'] for r in scored]):.3f}",
            f"{np.mean([r['law only']['whole'] for r in scored]):.3f}",
        )
    page.table(
        "set",
        "law",
        "time to",
        "tests (stopped)",
        "inside [95 % interval]",
        "median half width, as a factor",
        "sd of log10(measured / median)",
        "median of measured / median",
        "inside, law only",
        "median half width, law only",
    )
    for (name, law), rows in results.items():
        for event in dict.fromkeys(t["event"] for r in rows for t in r["times"]):
            pairs = measured_times(rows, event)
            if not pairs:
                continue
            ratios = [t["measured"] / t["median"] for _, t in pairs if not t["censored"] and np.isfinite(t["median"])]
            page.row(
                name,
                law,
                event,
                f"{len(pairs)} ({sum(t['censored'] for _, t in pairs)})",
                share_with_interval([t["inside"] for _, t in pairs]),
                f"{np.median([half_width(t['interval']) for _, t in pairs]):.2f}",
                f"{np.std(np.log10(ratios), ddof=1):.3f}" if len(ratios) > 1 else "-",
                f"{np.median(ratios):.2f}" if ratios else "-",
                f"{np.mean([law_only_inside(r, t) for r, t in pairs]):.3f}",
                f"{np.median([half_width(law_only_interval(r, event)) for r, _ in pairs]):.2f}",
            )


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--data", type=Path, default=Path("../shared/data"))
    parser.add_argument("--sets", nargs="*", default=list(SETS), choices=list(SETS))
    parser.add_argument("--quick", action="store_true", help="two tests of each set")
    parser.add_argument("--starts", type=int, default=2, help="of the search from all tests")
    parser.add_argument(
        "--keep", type=Path, default=Path("build/forecast_measured"), help="folder in which finished tests are kept"
    )
    options = parser.parse_args()
    cases = [case for name in options.sets for case in SETS[name](options.data)]
    results = {(case.set, case.name): finished_results(case, options) for case in cases}
    page = Page("forecast_measured", __doc__)
    print_summary(page, results)
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
