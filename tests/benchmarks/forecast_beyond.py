"""Forecasts a third below the lowest stress of the tests, by laws that are not the true one: coverage of intervals.

    python tests/benchmarks/forecast_beyond.py [--campaigns 25] [--truths NAME ...] [--write]

Bars in closed form: 6 to 12 tests at one or three temperatures; rates scatter by 3, 8 or 15 %; every second has primary
creep. The rate depends on stress as sinh(s / 60 MPa)^4, (s - s0)^4 above a threshold, the sum of two powers (2 and 8),
s^5 exp(s / 80 MPa), or a power, with which the law is right. Forecast is a test at two thirds of the lowest stress.
Columns: shares of times to a strain of 0.01, and of rates, inside their 95 % intervals, and half widths in ln.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from measured import Page, arguments, progress
from proportions import share_with_interval

import creepkit as ck
from creepkit.errors import CreepkitError
from creepkit.language.symbols import GAS_CONSTANT

T_REF, HOUR = 873.15, 3600.0
STRESSES = {575: (110, 140, 170, 200), 600: (95, 120, 150, 180), 625: (80, 100, 125, 150)}
ISOTHERMAL = (80, 100, 125, 150, 190)
TARGET, PRIMARY = 0.01, 0.002


def stress_function(truth, rng):
    """r over that at 120 MPa, of stress in MPa."""
    threshold, middle = rng.uniform(0.15, 0.4) * 80.0, rng.uniform(100.0, 150.0)
    forms = {
        "sinh": lambda s: np.sinh(s / 60.0) ** 4,
        "threshold": lambda s: (s - threshold) ** 4,
        "two powers": lambda s: (s / middle) ** 2 + (s / middle) ** 8,
        "exponential": lambda s: s**5 * np.exp(s / 80.0),
        "power": lambda s: s**5,
    }
    return lambda s: forms[truth](s) / forms[truth](120.0)


def curve(rate, times, primary):
    """Strains of a bar at a rate r, 1/s."""
    return PRIMARY * np.log(11.0 * np.exp(rate * times / PRIMARY) - 10.0) if primary else rate * times


def time_to(strain, rate, primary):
    """s, to a strain."""
    return PRIMARY / rate * np.log((np.exp(strain / PRIMARY) + 10.0) / 11.0) if primary else strain / rate


def campaign(truth, number):
    """Tests, the condition that is forecast, its own factor and law rate, and whether there is primary creep."""
    rng = np.random.default_rng([number, *map(ord, truth)])
    function, Q, primary = stress_function(truth, rng), rng.uniform(3e5, 4.5e5), number % 2 == 0
    scatter = float(rng.choice([0.03, 0.08, 0.15]))
    conditions = [(s, T) for T, stresses in STRESSES.items() for s in stresses]
    if number % 4 < 2:
        conditions = [(s, 600) for s in ISOTHERMAL for _ in range(2)][: int(rng.integers(6, 11))]
        conditions = conditions if len({s for s, _ in conditions}) > 3 else [(s, 600) for s in (*ISOTHERMAL, 80, 150)]
    else:
        kept = rng.choice(len(conditions), int(rng.integers(8, 13)), replace=False)
        conditions = [conditions[k] for k in sorted(kept)]

    def rate(stress, celsius):
        T = celsius + 273.15
        return 1e-5 / HOUR * function(stress) * np.exp(-Q / GAS_CONSTANT * (1.0 / T - 1.0 / T_REF))

    tests = []
    for k, (stress, celsius) in enumerate(conditions):
        own = rate(stress, celsius) * np.exp(scatter * rng.standard_normal())
        times = np.linspace(0.0, min(3000 * HOUR, 0.05 / own), 61)[1:]
        strain = curve(own, times, primary) + 1e-5 * rng.standard_normal(times.size)
        loading = ck.constant_stress(float(stress), control="stress")
        tests.append(ck.History(f"test {k + 1}", times, {"strain": strain}, loading, celsius + 273.15))
    asked = 2.0 / 3.0 * min(s for s, _ in conditions)
    return tests, asked, rate(asked, 600), float(np.exp(scatter * rng.standard_normal())), primary


def fitted_law(name, isothermal, primary):
    """The law that is identified."""
    law = ck.law(name) if isothermal else ck.law(name).times(ck.arrhenius(T_ref=T_REF))
    return law.with_primary() if primary else law


def judged(truth, name, number):
    """Whether the time is inside, with and without widening, the rate; half widths of ln; whether it is rejected."""
    tests, stress, rate, own, primary = campaign(truth, number)
    fit = ck.identify(fitted_law(name, number % 4 < 2, primary), tests, starts=2)
    plan = ck.History("plan", np.geomspace(1.0, 1e5, 30) * HOUR, {}, ck.constant_stress(stress, "stress"), T_REF)
    (time,) = [t for t in ck.forecast(fit, plan, targets={"strain": [TARGET]}, draws=1000).tests[0].times if t.output]
    measured = time_to(TARGET, rate * own, primary)
    value, low, high = (float(v) for v in fit.rate(stress, T_REF, strain=0.05, warn=False))
    return [
        time.low <= measured <= time.high,
        low <= rate <= high,
        0.5 * np.log(time.high / time.low),
        0.5 * np.log(high / low),
        fit.adequacy.rejects,
        np.log(measured / time.median),
        np.log(rate / value),
    ]


def main():
    """Run all campaigns."""
    parser = arguments(__doc__)
    parser.add_argument("--campaigns", type=int, default=25)
    truths = ("sinh", "threshold", "two powers", "exponential", "power")
    parser.add_argument("--truths", nargs="+", default=truths, choices=truths)
    options = parser.parse_args()
    page = Page("forecast_beyond", __doc__)
    page.table(
        "truth", "law", "campaigns (failed)", "contradicted", "time inside [95 % interval]", "half width of ln time",
        "rate inside", "half width of ln rate",
    )  # fmt: skip
    every = []
    for truth in options.truths:
        for name in ("norton", "hyperbolic-sine") if truth in ("two powers", "power") else ("norton",):
            rows, failed = [], 0
            for number in range(options.campaigns):
                try:
                    rows.append(judged(truth, name, number))
                    progress(f"{truth} {name} {number}: {np.round(np.array(rows[-1], float), 2)}")
                except CreepkitError as error:
                    failed += 1
                    progress(f"{truth} {number}: {error}")
            found = np.array(rows, float)
            every += rows if truth != "power" else []
            page.row(truth, name, f"{len(rows)} ({failed})", *cells(found))
    if len(options.truths) == len(truths):
        page.row("all but the power", "", len(every), *cells(np.array(every, float)))
    if options.write:
        page.write()


def cells(found):
    """Those of a row of the table."""
    return (
        f"{found[:, 4].mean():.2f}",
        share_with_interval(found[:, 0] > 0),
        f"{np.median(found[:, 2]):.2f}",
        f"{found[:, 1].mean():.2f}",
        f"{np.median(found[:, 3]):.2f}",
    )


if __name__ == "__main__":
    main()
