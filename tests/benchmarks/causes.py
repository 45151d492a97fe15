"""Causes of disagreement: campaigns with a planted fault, and how often an identification names it.

    python tests/benchmarks/causes.py [--campaigns 20] [--write]

8 to 12 bars at three temperatures, rates scattering by 3, 8 or 15 %, strains in closed form, every second campaign
with primary creep: rate = r (1 + 10 exp(-e / 0.002)), r = A s^n exp(-Q/R T). Planted is one fault: a temperature 8 to
20 K or a load 10 or 15 % other than stated, a strain in another unit (10, 25.4, 100), two materials (a factor of 2 to
5), or r of sinh(s / 60 MPa)^4 fitted by a power law. "Named", in a verdict
(odds of 50) or a caution: the likeliest explanation is the planted one, with its test.
"""

from __future__ import annotations

from collections import Counter

import numpy as np
from measured import Page, arguments, binomial_interval, progress

import creepkit as ck
from creepkit.language.symbols import GAS_CONSTANT

SEED = 39
T_REF = 873.15
CONDITIONS = [
    (stress, T)
    for T, stresses in ((575, (110, 140, 170, 200)), (600, (95, 120, 150, 180)), (625, (80, 100, 125, 150)))
    for stress in stresses
]
HOUR = 3600.0
FAULTS = ("none", "temperature", "load", "unit", "two materials", "exponent")
EXPECTED = {"two materials": "two groups", "exponent": "stress exponent"}


def campaign(fault, number):
    """Tests with a fault, the names of the tests that it concerns, and the law to fit."""
    rng = np.random.default_rng([SEED, FAULTS.index(fault), number])
    count = int(rng.integers(8, 13))
    conditions = [CONDITIONS[k] for k in sorted(rng.choice(len(CONDITIONS), count, replace=False))]
    n, Q, primary = rng.uniform(4, 7), rng.uniform(3e5, 4.5e5), number % 2 == 0
    scatter = float(rng.choice([0.03, 0.08, 0.15]))
    concerned = rng.choice(
        count, max(count // 2 - int(rng.integers(0, 3)), 2) if fault == "two materials" else 1, False
    )
    concerned = set() if fault in ("none", "exponent") else {int(k) for k in concerned}
    kelvin = float(rng.uniform(8, 20) * rng.choice([-1, 1]))
    load = float(rng.choice([0.85, 0.9, 1.1, 1.15]))
    unit, factor = float(rng.choice([10.0, 25.4, 100.0])), float(rng.uniform(2, 5))
    tests = []
    for k, (stress, celsius) in enumerate(conditions):
        s, T = float(stress), celsius + 273.15
        if k in concerned and fault == "temperature":
            T += kelvin
        if k in concerned and fault == "load":
            s *= load
        shape = (np.sinh(s / 60) / np.sinh(2.0)) ** 4 if fault == "exponent" else (s / 120) ** n
        rate = 1e-5 / HOUR * shape * np.exp(-Q / GAS_CONSTANT * (1 / T - 1 / T_REF) + scatter * rng.standard_normal())
        rate *= factor if k in concerned and fault == "two materials" else 1.0
        times = np.linspace(0.0, min(3000 * HOUR, 0.05 / rate), 61)[1:]
        strain = rate * times
        if primary:
            strain = 0.002 * np.log(11.0 * np.exp(rate * times / 0.002) - 10.0)
        strain = strain + 1e-5 * rng.standard_normal(times.size)
        strain *= unit if k in concerned and fault == "unit" else 1.0
        loading = ck.constant_stress(float(stress), control="stress")
        tests.append(ck.History(f"test_{k + 1}", times, {"strain": strain}, loading, celsius + 273.15))
    law = ck.law("norton").times(ck.arrhenius(T_ref=T_REF))
    return tests, {tests[k].name for k in concerned}, law.with_primary() if primary else law


def named(fault, concerned, explanations):
    """Whether the likeliest explanation is the planted one."""
    if not explanations:
        return fault == "none"
    first = explanations[0]
    if fault in EXPECTED:
        if first.kind != EXPECTED[fault]:
            return False
        return fault == "exponent" or 2 * len(concerned & set(first.tests)) > max(len(concerned), len(first.tests))
    return first.kind == "one test" and set(first.tests) == concerned


def main():
    """Run all campaigns."""
    parser = arguments(__doc__)
    parser.add_argument("--campaigns", type=int, default=20)
    options = parser.parse_args()
    page = Page("causes", __doc__)
    page.table("fault", "campaigns", "named", "law contradicted", "nothing said", "others")
    for fault in FAULTS:
        counts = Counter()
        for number in range(options.campaigns):
            tests, concerned, law = campaign(fault, number)
            fit = ck.identify(law, tests, starts=2)
            adequacy = fit.adequacy
            mentioned = () if fault == "none" or adequacy.mentioned is None else (adequacy.mentioned,)
            found = adequacy.explanations or mentioned
            counts["contradicted"] += adequacy.rejects
            outcome = "named" if named(fault, concerned, found) else "other" if found else "nothing"
            counts[outcome] += 1
            said = str(found[0]) if found else "nothing"
            progress(f"{fault} {number + 1}: {outcome}: planted {sorted(concerned)}; {said}")
        low, high = binomial_interval(counts["named"], options.campaigns)
        share = f"{counts['named']} ({counts['named'] / options.campaigns:.2f} [{low:.2f}, {high:.2f}])"
        page.row(fault, options.campaigns, share, counts["contradicted"], counts["nothing"], counts["other"])
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
