"""Laws and time-temperature methods predict the same long rupture tests: Alloy 617 and CMSX-6.

    python tests/benchmarks/rupture_methods.py [--data FOLDER] [--sets cmsx6 ...] [--laws NAME ...] [--starts 2]
                                               [--keep FOLDER] [--write]

Everything is fitted to the tests that ended before a third of the longest test of the set, and predicts the time to
rupture of the others, with a 95 % band of a single test. "Time-temperature methods" see stress, temperature, how each
test ended, and its laboratory; "average" is `ck.rupture` with its defaults, the others are the best degree of each
method. Their bands are those of a test in a new laboratory. With "laboratories not told apart" the scatter between
laboratories counts as scatter between tests. Laws with tertiary creep see the whole curves: `ck.identify`, then
`fit.rupture_time`. They know no laboratories: their bands hold the scatter between all tests fitted, each taken for
independent of the others, as those of the methods do where laboratories are not told apart. Monkman-Grant's relation
by its rate law sees minimum rates of the fitted tests; "by own rates" it is also given those of the predicted tests,
which nobody knows before a test has run for a while. In "with the others as run-outs" the predicted tests count among
the fitted ones, as run-outs at a third of the longest test: what a laboratory would know at that time.

Errors are log10(measured / predicted median) of the predicted tests that broke: their mean, their root mean square,
and the largest. Inside counts the tests within the 95 % band; a run-out is inside where the upper end is later. So few
tests, of which some share a laboratory, cannot tell a band that is right from one that is too wide: bands of normal
errors that are right have half widths of about 1.96 rms errors. The half width is the median over tests of log10(upper
end / median).

Alloy 617 is base metal, 750 to 1000 °C, in air and helium, the folder of a record being its laboratory; no heats are
named. Its first laboratory does not say how its tests ended: they count as run-outs at their last frame. A test that is
there twice counts once. Minimum rates are those of the index of the data. Its tensile strength is not in the data, so
Wilshire's method is not among them. CMSX-6 is at 980 °C, so the methods are one, a polynomial of log stress at one
temperature.
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

SMALL_CHANGES = (
    "That loading strain is recognised in 7 of the fitted tests is not why this law predicts long lives too short. "
    "Without a primary stage (m = 0) it fits the curves best where phi is at its bound, 30, and damage hardly speeds "
    "creep up: most tests then break by their loss of section alone, as with Norton's law, and the few that damage "
    "breaks leave B, chi and Q_B badly determined. Least squares, in which a rupture time weighs as much as a curve, "
    "and the likelihood, by which the best round is chosen, then differ; the rounds end before they agree, and which "
    "solution comes out is decided by trifles, such as a change of every strain by a millionth. The band of a single "
    "test is wide enough, the median is not to be relied on: a law whose fit says that it has not converged, and that "
    "phi is not determined, is no basis of an extrapolation. With phi given the likelihood is lower and damage is "
    "determined up to about phi = 6."
)
"""What the table of small changes shows."""


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


def by_methods(fitted, predicted, own_rates=True, settings=None):
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
        if own_rates and len(known) == len(predicted):
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


def changed_slightly(tests):
    """{name: tests}: the same tests, but for what should make no difference to a law that they determine."""

    def disturbed(tests, seed):
        draw = np.random.default_rng(seed)
        return [
            h.replace(outputs={"strain": h.outputs["strain"] * (1 + 1e-6 * draw.standard_normal(h.times.size))})
            for h in tests
        ]

    without = [h.replace(includes_elastic=False, used=_with_first_frames(h)) for h in tests]
    name = f"loading strain of {sum(h.includes_elastic for h in tests)} tests not recognised"
    changed = "strains changed by 1e-6 of themselves"
    return {
        "as read": tests,
        f"as read, {changed}": disturbed(tests, 0),
        name: without,
        **{f"{name}, {changed}, seed {seed}": disturbed(without, seed) for seed in (0, 1)},
    }


def _with_first_frames(h):
    """(frames,) used ones, with those before the end of loading where that was recognised."""
    return h.used | (h.includes_elastic & (np.arange(h.used.size) < np.argmax(h.used)))


def small_changes(page, fitted, predicted, options):
    """How much the identified damage of Kachanov and Rabotnov, and the lives it predicts, owe to trifles."""
    page.heading("Kachanov-Rabotnov under small changes")
    page.paragraph(SMALL_CHANGES)
    page.table(
        "tests, and phi", "log-likelihood", "converged", "phi", "chi", "Q_B, kJ/mol", "95 %", "mean error", "rms"
    )
    bar = ck.specimen("uniaxial").replace(tolerance=1e-4)
    law = catalogue(fitted)["Kachanov-Rabotnov"]
    bare = [h.replace(minimum_rate=None) for h in fitted]
    cases = {name: (law, tests) for name, tests in changed_slightly(bare).items()}
    cases |= {f"as read, phi = {phi} given": (law.fix(phi=phi), bare) for phi in (3, 6, 10, 20)}
    for name, (given, tests) in cases.items():
        fit = ck.identify(given, tests, bar, starts=options.starts)
        stresses, temperatures = [stress_of(h) for h in predicted], [h.mean_temperature for h in predicted]
        times = np.array(fit.rupture_time(np.array(stresses), np.array(temperatures))).T
        page.row(
            name,
            f"{fit.log_likelihood:.1f}",
            "yes" if fit.converged else "no",
            f"{fit.values.get('phi', np.nan):.3g}".replace("nan", "given"),
            f"{fit.values['chi']:.2f}",
            f"{fit.values['Q_B'] / 1e3:.0f}",
            *errors(times, predicted)[:2],
        )
        progress(name)


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
    as_run_outs = [
        ck.History(
            h.name,
            [SHARE * longest],
            {},
            h.loading,
            h.temperature,
            labels=h.labels,
            alloy=h.alloy,
            unruptured=True,
            minimum_rate=h.minimum_rate,
        )
        for h in predicted
    ]
    page.table("predicted by", "mean error", "rms error", "largest error", "inside", "half width", "CPU time, s")
    for name, values in rows.items():
        page.row(name, *errors(values, predicted), "")
    if assessment.tests.groups:
        page.row("average, laboratories not told apart", *errors(pooled["average"], predicted), "")
    more, _ = by_methods([*fitted, *as_run_outs], predicted, own_rates=False)
    for name, values in more.items():
        page.row(f"{name}, with the others as run-outs", *errors(values, predicted), "")
    for name in catalogue(fitted) if options.laws is None else options.laws:
        try:
            values, cpu = by_law(name, title, fitted, predicted, options)
        except ck.errors.FitError as error:
            page.paragraph(f"{name}: no identification: {error}.")
            continue
        page.row(f"law: {name}", *errors(values, predicted), f"{cpu:.0f}")
        progress(f"{title}, {name}: {cpu:.0f} CPU s")
    page.paragraph("The assessment of the fitted tests, without the others as run-outs:")
    page.code(str(assessment))
    if any(h.includes_elastic for h in fitted):
        small_changes(page, fitted, predicted, options)


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
