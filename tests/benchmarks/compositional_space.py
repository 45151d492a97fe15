"""A planted compositional space: rates, exponents and laws over composition, and the alloy to make next.

    python tests/benchmarks/compositional_space.py [--alloys 50] [--repeats 50] [--seed 1] [--workers 2] [--write]

Alloys of Fe, Ni, Co and 5 to 30 at.% Cr, each one dimple under 8, then 10 MPa for 4 h at 800 C with noise as measured,
simulated on a finer mesh; true thicknesses are off by 2 % of those stated. Iron-rich alloys obey a hyperbolic sine, the
others a power law. ln of the rate at 100 MPa is a planted polynomial of the contents plus a scatter of 0.1; so is the
exponent, without scatter. Errors are of ln of the rate. "Of the planted function": root mean square of the identified
values less the planted function, the best that any regression could do. Repeats draw other compositions, with the
errors of this plate's values in any order; proposals are right where the best has a true rate within 10 % of the
lowest.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from measured import Page, arguments, progress
from proportions import share_with_interval

import creepkit as ck
from creepkit.composition.mapping import CompositionMap
from creepkit.composition.regression import CompositionRegression
from creepkit.records import History, output_named
from creepkit.screening.alloys import Compositions

ELEMENTS = ("Fe", "Ni", "Co", "Cr")
TIMES, TEMPERATURE = np.arange(120.0, 4 * 3600 + 1, 120.0), 1073.15
SCATTER, THICKNESS_SD, STRESS = 0.1, 0.02, 100.0


def planted_log_rate(x):
    """ln of the rate, 1/s, at 100 MPa; x : (..., elements)."""
    fe, ni, co, cr = np.moveaxis(x, -1, 0)
    return -14.2 * fe - 16.0 * ni - 15.4 * co - 17.5 * cr - 6.0 * ni * co - 4.0 * fe * ni + 9.0 * cr * ni


def planted_exponent(x):
    """Stress exponent at 100 MPa; x : (..., elements)."""
    return x @ np.array([5.0, 5.4, 4.6, 4.0])


def drawn_contents(rng, count):
    """(count, elements) atomic fractions."""
    chromium = rng.uniform(0.05, 0.3, count)
    return np.column_stack([rng.dirichlet([0.8] * 3, count) * (1.0 - chromium)[:, None], chromium])


def planted_plate(count, seed):
    """Tests, compositions (count, elements), names of laws, and ln of the true rates (count,)."""
    rng, tests, laws, rates = np.random.default_rng(seed), [], [], []
    contents = drawn_contents(rng, count)
    bulge = ck.specimen("bulge").replace(refinement=2.0, tolerance=1e-3, threads=1)
    for k, x in enumerate(contents):
        log_rate, n = planted_log_rate(x) + SCATTER * rng.normal(), planted_exponent(x)
        name = "hyperbolic-sine" if np.argmax(x) == 0 else "norton"
        values = {"A": np.exp(log_rate) / STRESS**n, "n": n}
        if name == "hyperbolic-sine":
            b = 70.0
            n = n * b / STRESS * np.tanh(STRESS / b)
            values = {"A": np.exp(log_rate) / np.sinh(STRESS / b) ** n, "n": n, "B": b}
        stated = round(float(rng.uniform(0.46, 0.52)), 3)
        true = stated * (1.0 + THICKNESS_SD * rng.normal())
        test = History(
            f"D{k + 1:02d}", TIMES, {}, ck.PressureJump(P1=8, P2=10, Tj=7200), TEMPERATURE, "bulge",
            ck.Elastic(E=150e3), alloy=f"A{k + 1:02d}", geometry={"apex_thickness": true},
        )  # fmt: skip
        law = ck.law(name)
        prediction = bulge.predict(law, law.to_internal(values), [test])
        exact = prediction.of(0)
        known = np.isfinite(exact).all(axis=1)
        noise = [output_named(one, "bulge").noise or 0.0 for one in prediction.outputs]
        outputs = {
            one: exact[known, j] + rng.normal(0, noise[j], known.sum()) for j, one in enumerate(prediction.outputs)
        }
        tests.append(replace(test, times=TIMES[known], outputs=outputs, geometry={"apex_thickness": stated}))
        laws.append(name)
        rates.append(log_rate)
        progress(f"simulated {k + 1} of {count}")
    return tests, contents, laws, np.array(rates)


def regression_row(page, title, regression, truth, of_alloys):
    """Left-out error over that of the planted function, and coverage."""
    error, ideal = regression.left_out_error, float(np.sqrt(np.mean((regression.values - truth) ** 2)))
    own = float(np.sqrt(np.mean((regression.values - of_alloys) ** 2)))
    shared = float(np.sqrt(np.mean((regression.shared[0] - of_alloys) ** 2)))
    inside = np.abs(regression.left_out[0] - of_alloys) <= 1.96 * regression.left_out[1]
    page.row(
        title,
        f"{error:.3f}",
        f"{ideal:.3f}",
        f"{error / ideal:.2f}",
        share_with_interval(inside),
        f"{own:.3f}",
        f"{shared:.3f}",
    )


def main():
    parser = arguments(__doc__)
    parser.add_argument("--alloys", type=int, default=50)
    parser.add_argument("--repeats", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--to", help="folder in which the results of alloys are kept, and the picture")
    options = parser.parse_args()
    tests, contents, laws, log_rates = planted_plate(options.alloys, options.seed)
    names = [test.alloy for test in tests]
    atomic = {name: dict(zip(ELEMENTS, 100 * x, strict=True)) for name, x in zip(names, contents, strict=True)}
    plate = ck.screen(
        tests, ["norton", "hyperbolic-sine"], compositions=Compositions(atomic), to=options.to,
        options=ck.ScreeningOptions(dense=None), workers=options.workers,
        progress=lambda task, done, total, note: progress(f"{done} of {total} ({note})"),
    )  # fmt: skip
    mapped = ck.composition_map(plate, stress=STRESS)
    position = [names.index(name) for name in mapped.alloys]
    contents, log_rates = contents[position], log_rates[position]
    page = Page("compositional_space", __doc__)
    print(mapped)
    if options.to:
        mapped.plot(Path(options.to) / "map.png")
    page.table(
        "plate", "left-out error", "of the planted function", "ratio", "true value inside 95 %", "error by own tests",
        "with the others",
    )  # fmt: skip
    regression_row(page, "ln of the rate", mapped.log_rate, planted_log_rate(contents), log_rates)
    exponents = planted_exponent(contents)
    regression_row(page, "stress exponent", mapped.stress_exponent, exponents, exponents)
    truth = np.array([mapped.laws.laws.index(laws[k]) for k in position])
    page.table("law of the alloys", "right [95 % interval]")
    page.row("by its own tests", share_with_interval(mapped.laws.weights.argmax(axis=1) == truth))
    page.row("with the other alloys", share_with_interval(mapped.laws.shared.argmax(axis=1) == truth))
    page.row("by the other alloys alone", share_with_interval(mapped.laws.left_out.argmax(axis=1) == truth))
    repeats_table(page, mapped, options)
    if options.write:
        page.write()


def repeats_table(page, mapped: CompositionMap, options):
    """Other plates with the errors of this one: ratio, coverage, and whether the best alloy is proposed."""
    ratios, inside, right = [], [], []
    for k in range(options.repeats):
        rng = np.random.default_rng([options.seed, k])
        x = drawn_contents(rng, options.alloys)
        sd = rng.choice(mapped.log_rate.sd, options.alloys)
        true = planted_log_rate(x) + SCATTER * rng.normal(size=len(x))
        values = true + sd * rng.normal(size=len(x))
        regression = CompositionRegression.of(ELEMENTS, x, values, sd)
        ratios.append(regression.left_out_error / np.sqrt(np.mean((values - planted_log_rate(x)) ** 2)))
        inside += [*(np.abs(regression.left_out[0] - true) <= 1.96 * regression.left_out[1])]
        again = replace(mapped, elements=ELEMENTS, contents=x, log_rate=regression)
        lowest = planted_log_rate(again._candidates(again._limits({}), seed=0)).min()
        proposals = again.propose(3)
        made = np.array([[one.composition[e] / 100 for e in ELEMENTS] for one in proposals])
        right.append(planted_log_rate(made).min() < lowest + np.log(1.1))
        progress(f"repeat {k + 1} of {options.repeats}")
    page.table(
        "repeats",
        "left-out error over that of the planted function: median, 90 %",
        "true value inside 95 %",
        "lowest rate among three proposals",
    )
    page.row(
        len(ratios),
        f"{np.median(ratios):.2f}, {np.quantile(ratios, 0.9):.2f}",
        share_with_interval(inside),
        share_with_interval(right),
    )


if __name__ == "__main__":
    main()
