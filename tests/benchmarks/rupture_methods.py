"""Laws and time-temperature methods predict the same long rupture tests: Alloy 617 and CMSX-6.

    python tests/benchmarks/rupture_methods.py [--data FOLDER] [--sets cmsx6 ...] [--laws NAME ...] [--starts 2]
                                               [--keep FOLDER] [--write]

Everything is fitted to the tests that ended before a third of the longest, and predicts the time to rupture of the
others, with a 95 % band of a single test. "Average" is `ck.rupture` with its defaults, other methods stand with their
best degree; their bands are those of a new laboratory. Laws see the whole curves and know no laboratories.
Monkman-Grant "by own rates" is also given the minimum rates of the predicted tests.

Errors are log10(measured / predicted median) of the predicted tests that broke; a run-out is inside where the upper end
is later; the half width is the median of log10(upper end / median). Bands of normal errors that are right have half
widths of 1.96 rms errors. Alloy 617 is base metal, 750 to 1000 °C, in air and helium.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import numpy as np
from measured import Page, arguments, progress
from whole_life import sets

import creepkit as ck
from creepkit.inverse.reference_conditions import reference_temperature, spans_temperatures
from creepkit.rupture_assessment.methods import Conditions
from creepkit.rupture_assessment.strength import mixed

SHARE = 1.0 / 3.0
"""Of the longest test: what ends before it is fitted."""

HOUR = 3600.0


def catalogue(histories):
    """{name: law with tertiary creep}: with temperature where the tests have several, each rate with its own energy."""
    laws = {
        "MPC Omega": ck.law("mpc-omega").fix(c=0),
        "MPC Omega, Omega(stress)": ck.law("mpc-omega"),
        "Kachanov-Rabotnov": ck.law("kachanov-rabotnov").fix(alpha=0, m=0),
        "Kachanov-Rabotnov, primary": ck.law("kachanov-rabotnov").fix(alpha=0),
        "Norton": ck.law("norton"),
    }
    if not spans_temperatures(histories):
        return laws
    T = reference_temperature(histories)
    laws = {name: law.times(ck.arrhenius(T_ref=T)) for name, law in laws.items()}
    return {
        name: law.with_temperature(Omega=ck.activated(T_ref=T)) if "Omega" in law.names else law
        for name, law in laws.items()
    }


def prepared(name, histories):
    """The tests with a laboratory and a minimum rate, where they are known."""
    if name == "cmsx6":
        return list(histories)
    tests = []
    for h in histories:
        labels = {**h.labels, "laboratory": h.name.split("/")[0]}
        rate = float(h.labels["min_rate_est_per_s"])
        tests.append(h.replace(labels=labels, minimum_rate=rate if rate > 0 else None))
    return tests


def end_of(h):
    """s, of a test, however it ended."""
    return h.rupture_time or float(h.times[-1])


def stress_of(h):
    return float(h.loading.program().values[-1])


def errors(predicted, tests):
    """Cells of a row: mean, rms and largest error of broken tests, tests inside their bands, width."""
    median, low, high = np.array(predicted).T
    measured = np.array([end_of(h) for h in tests])
    broken = np.array([h.rupture_time is not None for h in tests])
    error = np.log10(measured[broken] / median[broken])
    inside = np.where(broken, (low <= measured) & (measured <= high), measured <= high)
    return (
        f"{error.mean():+.3f}",
        f"{np.sqrt((error**2).mean()):.3f}",
        f"{error[np.abs(error).argmax()]:+.3f}",
        f"{inside.sum()} of {inside.size}",
        f"{np.median(np.log10(high / median)):.3f}",
    )


def by_methods(fitted, predicted, settings=None):
    """{name: [(median, low, high) s of each predicted test]}, and the verdict."""
    assessment = ck.rupture(fitted, hours=[1e4], settings=settings)
    names = ["average", *assessment.methods]
    rows = {
        name: [assessment.rupture_time(stress_of(h), h.mean_temperature, method=name) for h in predicted]
        for name in names
    }
    titles = {"average": "average"} | {name: assessment[name].name for name in assessment.methods}
    rows = {titles[name]: values for name, values in rows.items()}
    if assessment.relation is not None:
        rows["monkman-grant, rate law"] = [
            assessment.rupture_time(stress_of(h), h.mean_temperature, method="monkman-grant") for h in predicted
        ]
        known = [h for h in predicted if h.minimum_rate is not None]
        if len(known) == len(predicted):
            rates = np.array([h.minimum_rate for h in predicted])
            nothing = np.full(rates.shape, np.nan)
            times = mixed(assessment.models("monkman-grant"), Conditions(nothing, nothing, nothing, rates), "test")
            rows["monkman-grant, by own rates"] = [
                *zip(*(HOUR * 10.0 ** times.quantile(p) for p in (0.5, 0.025, 0.975)), strict=True)
            ]
    return rows, assessment


def by_law(name, title, fitted, predicted, options):
    """[(median, low, high)] of each predicted test by one law, and CPU s; kept in a file where asked."""
    kept = options.keep and options.keep / f"{title}_{name.replace(' ', '_')}.json"
    if kept and kept.is_file():
        return json.loads(kept.read_text())
    start = time.process_time()
    bar = ck.specimen("uniaxial").replace(tolerance=1e-4)
    bare = [h.replace(minimum_rate=None) for h in fitted]
    fit = ck.identify(catalogue(fitted)[name], bare, bar, starts=options.starts)
    stresses, temperatures = [stress_of(h) for h in predicted], [h.mean_temperature for h in predicted]
    times = np.array(fit.rupture_time(np.array(stresses), np.array(temperatures))).T.tolist()
    result = [times, time.process_time() - start]
    if kept:
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_text(json.dumps(result))
    return result


def table_of(page, title, histories, options):
    longest = max(end_of(h) for h in histories)
    fitted = [h for h in histories if end_of(h) < SHARE * longest]
    predicted = [h for h in histories if end_of(h) >= SHARE * longest]
    broken = [h for h in predicted if h.rupture_time is not None]
    page.heading(title)
    stops = [sum(h.rupture_time is None for h in group) for group in (fitted, predicted)]
    page.paragraph(
        f"Fitted: {len(fitted)} tests that ended before {SHARE * longest / HOUR:.0f} h, {stops[0]} of them run-outs. "
        f"Predicted: {len(predicted)} tests, {stops[1]} of them run-outs; those that broke lasted "
        f"{min(map(end_of, broken)) / HOUR:.0f} to {max(map(end_of, broken)) / HOUR:.0f} h."
    )
    rows, assessment = by_methods(fitted, predicted)
    pooled, _ = by_methods(fitted, predicted, settings=ck.RuptureSettings(random_effects=False))
    page.table("predicted by", "mean error", "rms error", "largest error", "inside", "half width", "CPU time, s")
    for name, values in rows.items():
        page.row(name, *errors(values, predicted), "")
    if assessment.tests.groups:
        page.row("average, laboratories not told apart", *errors(pooled["average"], predicted), "")
    for name in catalogue(fitted) if options.laws is None else options.laws:
        try:
            values, cpu = by_law(name, title, fitted, predicted, options)
        except ck.errors.FitError as error:
            page.paragraph(f"{name}: no identification: {error}.")
            continue
        page.row(f"law: {name}", *errors(values, predicted), f"{cpu:.0f}")
        progress(f"{title}, {name}: {cpu:.0f} CPU s")


def main():
    parser = arguments(__doc__)
    parser.add_argument("--data", type=Path, default=Path("../shared/data/uniaxial"))
    parser.add_argument("--sets", nargs="*", help="some of alloy617-base, cmsx6")
    parser.add_argument("--laws", nargs="*", help="some of them; by default all")
    parser.add_argument("--starts", type=int, default=2)
    parser.add_argument("--keep", type=Path)
    options = parser.parse_args()
    page = Page("rupture_methods", __doc__)
    for title, histories in sets(options.data).items():
        if not options.sets or title in options.sets:
            table_of(page, title, prepared(title, histories), options)
    if options.write:
        page.write()


if __name__ == "__main__":
    sys.exit(main())
