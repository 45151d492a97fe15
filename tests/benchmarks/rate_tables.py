"""Laws from tables of minimum creep rates and rupture times: coverage, gain beside curves, and Alloy 617.

    python tests/benchmarks/rate_tables.py [--campaigns 200] [--data FOLDER] [--write]

Planted by closed forms: rates of a power law with Arrhenius' factor, 12 tests with 3 parameters; and a law of Kachanov
and Rabotnov, 10 tests with rate and rupture time or run-out, 4 parameters; a scatter of 10 % in rate and in life. The
table of curves gives the width of the interval of the stress exponent from three curves at 90 to 108 MPa, from seven
minimum rates at 55 to 120 MPa, and from both. Measured: a power law from minimum rates of Alloy 617 (smallest slope
over a tenth of the frames of a curve), by linear regression of the same, and from the frames around the minimum.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from measured import Page, arguments, progress

import creepkit as ck
from creepkit.laws.norton import NORTON
from creepkit.records import History, constant_stress

sys.path.insert(0, str(Path(__file__).parents[1]))
from helpers.literature_laws import EQUATIONS
from helpers.paths import SHARED
from helpers.rate_tables import GAS_CONSTANT, KACHANOV_VALUES, SCATTER, rate_table, whole_life_table

POWER_LAW = NORTON.times(ck.arrhenius(T_ref=1100.0))
PLANTED = {"n": 5.0, "Q": 4e5, "A": 1e-8 / 100.0**5}
KACHANOV = EQUATIONS["Kachanov-Rabotnov"].fix(r=KACHANOV_VALUES["r"])


def holds(fit, planted):
    """Whether the interval of each parameter holds its planted value."""
    return {e.name: e.low <= planted[e.name] <= e.high for e in fit.estimates}


def single_tests(fit, tests):
    """Share of the intervals of single tests that hold the rates of new tests at the same conditions."""
    pairs = zip(fit.tests, tests, strict=True)
    return float(np.mean([m.minimum_rate.low <= h.minimum_rate <= m.minimum_rate.high for m, h in pairs]))


def coverage(page, campaigns):
    """The table of coverage."""
    page.heading("Coverage of 95 % intervals")
    page.table("table", "quantity", "held, %", "campaigns")
    for name, law, planted, draw, count in (
        ("rates", POWER_LAW, PLANTED, rate_table, campaigns),
        ("rates and rupture times", KACHANOV, KACHANOV_VALUES, whole_life_table, campaigns // 4),
    ):
        rows, new = [], []
        for seed in range(count):
            fit = ck.identify(law, draw(np.random.default_rng(seed)), starts=1)
            rows.append(holds(fit, planted))
            new.append(single_tests(fit, draw(np.random.default_rng(10_000 + seed))))
            progress(f"{name}: {seed + 1} of {count}")
        for parameter in rows[0]:
            page.row(name, parameter, f"{100 * np.mean([row[parameter] for row in rows]):.1f}", count)
        page.row(name, "minimum rate of a new test", f"{100 * np.mean(new):.1f}", count)


def planted_curve(stress, rng):
    """A steady curve whose rate scatters as those of the tables do."""
    times = np.geomspace(1e3, 3e5, 20)
    strain = 1e-16 * stress**4 * np.exp(SCATTER * rng.standard_normal()) * times
    strain = strain + 2e-6 * rng.standard_normal(times.size)
    return History(f"curve {stress:g}", times, {"strain": strain}, constant_stress(stress, "stress"), 1000.0)


def gain(page, campaigns):
    """The table of interval widths."""
    page.heading("Curves with and without minimum rates")
    page.table("tests", "median width of the interval of n", "held, %", "campaigns")
    widths, held = {}, {}
    for seed in range(campaigns):
        rng = np.random.default_rng(seed)
        curves = [planted_curve(s, rng) for s in (90.0, 100.0, 108.0)]
        rates = whole_life_table(rng, lives=False)[:7]
        for name, tests in (("3 curves", curves), ("7 rates", rates), ("3 curves and 7 rates", curves + rates)):
            exponent = next(e for e in ck.identify(NORTON, tests, starts=1).estimates if e.name == "n")
            widths.setdefault(name, []).append(exponent.high - exponent.low)
            held.setdefault(name, []).append(exponent.low <= 4.0 <= exponent.high)
        progress(f"gain: {seed + 1} of {campaigns}")
    for name in widths:
        page.row(name, f"{np.median(widths[name]):.2f}", f"{100 * np.mean(held[name]):.0f}", campaigns)


def steady_range(history):
    """Minimum rate, 1/s, and (frames,) which are where the slope is within 20 % of it; None without a minimum."""
    used = np.flatnonzero(history.used & (history.times > 0) & np.isfinite(history.outputs["strain"]))
    if used.size < 40:
        return None
    t, y, width = history.times[used], history.outputs["strain"][used], max(used.size // 10, 5)
    slopes = np.array([np.polyfit(t[k : k + width], y[k : k + width], 1)[0] for k in range(used.size - width + 1)])
    lowest = int(np.argmin(slopes))
    if slopes[lowest] <= 0 or lowest == 0:
        return None
    steady = np.zeros(history.times.size, bool)
    for k in np.flatnonzero((slopes > 0) & (slopes < 1.2 * slopes[lowest])):
        if (np.diff([k, lowest]) == 0).all() or (
            slopes[min(k, lowest) : max(k, lowest) + 1] < 1.2 * slopes[lowest]
        ).all():
            steady[used[k : k + width]] = True
    return float(slopes[lowest]), steady


def alloy_617(page, data):
    """The table of what three ways say of one power law."""
    page.heading("Minimum rates of Alloy 617")
    curves = [h for h in ck.read_histories(data / "uniaxial" / "alloy617") if h.mean_temperature > 1000.0]
    ranges = {h.name: steady_range(h) for h in curves}
    kept = [h for h in curves if ranges[h.name] is not None]
    table = [
        h.replace(times=h.times[-1:], outputs={}, standard_deviation={}, minimum_rate=ranges[h.name][0]) for h in kept
    ]
    steady = [h.replace(used=ranges[h.name][1], rupture_time=None, unruptured=False) for h in kept]
    page.paragraph(f"{len(kept)} of {len(curves)} curves above 1000 K have a minimum inside.")
    page.table("from", "n", "95 %", "Q, kJ/mol", "95 %", "scatter between tests, %")
    for name, tests in (("the table of minimum rates", table), ("frames around the minimum", steady)):
        fit = ck.identify(POWER_LAW, tests, starts=2, suspect_frames="keep")
        n, Q = ({e.name: e for e in fit.estimates}[key] for key in ("n", "Q"))
        page.row(
            name,
            f"{n.value:.3f}",
            f"{n.low:.2f} to {n.high:.2f}",
            f"{Q.value / 1e3:.1f}",
            f"{Q.low / 1e3:.0f} to {Q.high / 1e3:.0f}",
            f"{100 * fit.noise_model.rate:.0f}",
        )
    design = np.array(
        [
            [1.0, np.log(h.loading.program().values[0]), -(1 / h.mean_temperature - 1 / 1100.0) / GAS_CONSTANT]
            for h in table
        ]
    )
    solution = np.linalg.lstsq(design, np.log([h.minimum_rate for h in table]), rcond=None)[0]
    page.row("linear regression of the table", f"{solution[1]:.3f}", "", f"{solution[2] / 1e3:.1f}", "", "")


def main():
    parser = arguments(__doc__)
    parser.add_argument("--campaigns", type=int, default=200)
    parser.add_argument("--data", type=Path, default=SHARED, help="folder of shared data")
    options = parser.parse_args()
    page = Page("rate_tables", __doc__)
    alloy_617(page, options.data)
    gain(page, options.campaigns // 4)
    coverage(page, options.campaigns)
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
