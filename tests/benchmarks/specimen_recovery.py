"""Norton's law recovered from planted tests of every specimen: coverage of 95 % intervals with a length as a nuisance.

    python tests/benchmarks/specimen_recovery.py [--sets 20] [--names tube plate ...] [--write]

Four test pieces of one kind are tested at 800 C over the middle of the range of loads that the specimen states, with 25
frames each. The length that the specimen knows least exactly differs from piece to piece by its tolerance, and no file
states it. The data come from a finer discretisation, with the noise that the specimen states. Columns: shares of sets
whose 95 % interval holds the planted exponent and the rate amid the tests; half width of the latter; share of all
lengths within their own 95 %; CPU seconds of a fit.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from measured import Page, arguments, progress

import creepkit as ck
from creepkit.records import outputs_of, typical_history

NAMES = (
    *("tube", "open-tube", "notched-bar", "plate-bulge", "dome-bulge"),
    *("three-point-bend", "four-point-bend", "cantilever-bend"),
)
LEVELS = (0.3, 0.45, 0.6, 0.75)
"""Of the range of the load, on a logarithm."""
END, FRAMES = 100 * 3600.0, 25
GROWTH = 150.0
"""Growth of the leading output over its noise."""


def finer(specimen: Any) -> Any:
    """The same test piece in another discretisation."""
    if hasattr(specimen, "refined"):
        return specimen.refined()
    return specimen.replace(fibres=2 * specimen.fibres + 1, stations=2 * specimen.stations + 1)


def planted_set(specimen: Any, rng: np.random.Generator) -> tuple[dict[str, float], list[ck.History], list[float]]:
    """Values, tests without their lengths, and the lengths, mm."""
    output = outputs_of(specimen)[0]
    length = max(specimen.dimensions, key=lambda d: d.tolerance)
    plans = [typical_history(specimen, level=level, frames=FRAMES, end=END) for level in LEVELS]
    plans = [plan.replace(times=np.geomspace(END / 200, END, FRAMES), name=f"test {k}") for k, plan in enumerate(plans)]
    stress = float(np.max(specimen.reference_stress(plans[1])))
    n, strain = rng.uniform(3.0, 7.0), GROWTH * output.noise / specimen.growth_per_strain(plans[1])
    values = {"A": strain / END / stress**n, "n": n}
    law, lengths, tests = ck.law("norton"), [], []
    for plan in plans:
        own = length.default * (1.0 + length.tolerance * rng.standard_normal())
        exact = finer(specimen).predict(law, law.to_internal(values), [plan.replace(geometry={length.name: own})])
        outputs = {
            str(o): exact.of(0)[:, k] + o.noise * rng.standard_normal(FRAMES)
            for k, o in enumerate(outputs_of(specimen))
        }
        sd = {str(o): np.full(FRAMES, o.noise) for o in outputs_of(specimen)}
        if exact.status[0, 0] == ck.Status.COMPLETE:
            tests.append(plan.replace(outputs=outputs, standard_deviation=sd))
            lengths.append(own)
    return values, tests, lengths


def recovered(specimen: Any, seed: int) -> dict[str, float]:
    """What one set gave; 1 for an interval that holds the truth."""
    values, tests, lengths = planted_set(specimen, np.random.default_rng(100 + seed))
    length = max(specimen.dimensions, key=lambda d: d.tolerance)
    nuisance = ck.Nuisance(length.name, sd=length.tolerance * length.default)
    start = time.process_time()
    fit = ck.identify("norton", tests, specimen, starts=2, nuisances=[nuisance], weights="likelihood", seed=seed)
    seconds = time.process_time() - start
    stress = float(np.exp(np.mean([np.log(np.max(specimen.reference_stress(t))) for t in tests])))
    rate, low, high = fit.rate(stress=stress, temperature=tests[0].mean_temperature)
    planted = values["A"] * stress ** values["n"]
    estimate = next(e for e in fit.estimates if e.name == "n")
    within = [abs(n.value - own) < 1.96 * n.sd for n, own in zip(fit.nuisances, lengths, strict=True)]
    return {
        "n": estimate.low <= values["n"] <= estimate.high,
        "rate": low <= planted <= high,
        "width": 100 * 0.5 * (high - low) / rate,
        "lengths": float(np.mean(within)),
        "seconds": seconds,
    }


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--sets", type=int, default=20)
    parser.add_argument("--names", nargs="+", default=list(NAMES))
    options = parser.parse_args()
    page = Page("specimen_recovery", __doc__)
    page.table("specimen", "length", "n inside", "rate inside", "half width of the rate, %", "lengths inside", "CPU s")
    for name in options.names:
        specimen = ck.specimen(name)
        rows = []
        for seed in range(options.sets):
            rows.append(recovered(specimen, seed))
            progress(f"{name}: {seed + 1} of {options.sets} sets, {rows[-1]}")
        mean = {key: np.mean([row[key] for row in rows]) for key in rows[0]}
        medians = [np.median([row[key] for row in rows]) for key in ("width", "seconds")]
        length = max(specimen.dimensions, key=lambda d: d.tolerance)
        cells = (f"{mean['n']:.2f}", f"{mean['rate']:.2f}", f"{medians[0]:.2g}", f"{mean['lengths']:.2f}")
        page.row(f"`{name}`", f"{length.name}, {100 * length.tolerance:g} %", *cells, f"{medians[1]:.2g}")
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
