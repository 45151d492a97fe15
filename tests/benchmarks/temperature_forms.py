"""Planted forms of temperature: how often the right one is in the reported set, how large the set, and Q's interval.

    python tests/benchmarks/temperature_forms.py [--specimens 200] [--through dimple|uniaxial] [--design NAME ...]
                                                 [--frames 24] [--most 3] [--no-refit]

A specimen is one set of tests at nine temperatures, 973 to 1083 K, of a Norton law. Designs: `constant` (Arrhenius, n
constant), `linear` (Arrhenius, n linear in T) and `inverse` (Arrhenius, n linear in 1/T), each in its share of the
specimens. Priors, seed 625: n at 1033 K uniform in 3 to 6, its fall over the 110 K uniform in .3 to 1.5, Q uniform in
350 to 480 kJ/mol, ln of the rate at the reference stress and 1033 K within .5 of one that deflects the dimple well.

dimple   : one bulge test a temperature, 8 then 10 MPa for 12 h, 48 frames, through the surrogate that comes with the
           package; noise 1.5 um on D_amp, .02 mm on S_d, .02 on S_p.
uniaxial : three creep tests a temperature at 60, 90 and 120 MPa to about 2 %, noise 2e-5 of strain, rates that
           scatter by 3 % from test to test.

Every parameter may take all registered forms. Columns: share of specimens whose right forms of A and of n are both in
the reported sets, with its 95 % binomial (Clopper-Pearson) interval; mean number of forms in the sets of A and of n;
share with the best combination right; share with Q inside its 95 % interval; once by the estimates alone and once after
refitting to the tests. Goal: .95 of each share.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass

import numpy as np
from scipy.stats import beta

import creepkit as ck
from creepkit.cli import set_numba_cache
from creepkit.discovery.discover import discover, group_by_temperature
from creepkit.discovery.refitting import refit
from creepkit.discovery.temperature_law import TemperatureLaw
from creepkit.inverse.identification import IdentificationSettings
from creepkit.inverse.identify import identify

SEED, T_REF = 625, 1033.15
NINE = np.linspace(973.15, 1083.15, 9)
SD = {"amplitude": 1.5e-3, "width": 0.02, "shape": 0.02}
STRESS, LOG_RATE = {"dimple": 100.0, "uniaxial": 90.0}, {"dimple": np.log(7e-7), "uniaxial": np.log(2e-7)}
BASE = ck.law("norton")


@dataclass(frozen=True)
class Planted:
    """The truth of one specimen."""

    law: ck.CreepLaw
    values: dict[str, float]
    forms: dict[str, str]
    tests: list[ck.History]


def planted(design: str, through: str, seed: int, model: object) -> Planted:
    """Draw a law and its nine temperatures' tests."""
    rng = np.random.default_rng([SEED, seed])
    n, fall, Q = rng.uniform(3.0, 6.0), rng.uniform(0.3, 1.5), rng.uniform(350e3, 480e3)
    A = float(np.exp(LOG_RATE[through] + rng.uniform(-0.5, 0.5) - n * np.log(STRESS[through])))
    values, slope = {"A": A, "n": n, "Q": Q}, -fall / np.ptp(NINE)
    law = BASE
    if design == "linear":
        law, values["n_T"] = law.with_temperature(n=ck.linear(T_REF)), slope
    elif design == "inverse":
        law, values["n_I"] = law.with_temperature(n=ck.inverse_temperature(T_REF)), -slope * T_REF**2 / 1000.0
    law = law.times(ck.arrhenius(T_REF))
    tests = dimples(law, values, rng, model) if through == "dimple" else bars(law, values, rng, model)
    return Planted(law, values, {"A": "arrhenius", "n": design}, tests)


def dimples(law: ck.CreepLaw, values: dict[str, float], rng: np.random.Generator, model: object) -> list[ck.History]:
    """One noisy bulge test a temperature; one that bursts ends there."""
    tests = []
    for T in NINE:
        run = ck.simulate(
            law, model, values, loading=ck.PressureJump(8.0, 10.0, 14400.0), times=np.arange(900.0, 43201.0, 900.0),
            temperature=float(T), elastic=ck.Elastic(E=180e3 - 100.0 * (T - 273.15)), name=f"{T:.0f} K",
        )  # fmt: skip
        noisy = {name: value + SD[name] * rng.normal(size=value.size) for name, value in run.outputs.items()}
        known = {name: np.full(run.times.size, SD[name]) for name in noisy}
        tests.append(run.replace(outputs=noisy, standard_deviation=known))
    return tests


def bars(law: ck.CreepLaw, values: dict[str, float], rng: np.random.Generator, model: object) -> list[ck.History]:
    """Three noisy creep tests a temperature."""
    kernel, tests = ck.lower(law, "numpy"), []
    for T in NINE:
        for stress in (60.0, 90.0, 120.0):
            rate = float(kernel.rate(values, stress=stress, temperature=T))
            own = values | {"A": values["A"] * float(np.exp(0.03 * rng.normal()))}
            run = ck.simulate(law, model, own, loading=ck.constant_stress(stress, "stress"),
                              times=np.geomspace(0.01, 1.0, 24) * 0.02 / rate, temperature=float(T),
                              name=f"{T:.0f} K, {stress:.0f} MPa")  # fmt: skip
            strain = run.outputs["strain"] + 2e-5 * rng.normal(size=run.times.size)
            tests.append(run.replace(outputs={"strain": strain}))
    return tests


@dataclass(frozen=True)
class Outcome:
    """What one specimen's answer was worth."""

    inside: bool
    sizes: tuple[int, int]
    best: bool
    covered: bool

    @classmethod
    def of(cls, trend: TemperatureLaw, truth: Planted) -> Outcome:
        names = {p: [form.name for form in own] for p, own in trend.plausible_forms.items()}
        right = all(truth.forms[p] in names[p] for p in truth.forms)
        with_q = [e for e in trend.estimates if e.name == "Q"]
        covered = bool(with_q) and with_q[0].low <= truth.values["Q"] <= with_q[0].high
        return cls(right, (len(names["A"]), len(names["n"])), trend.forms == truth.forms, covered)


def share(yes: list[bool]) -> str:
    """A share with its 95 % Clopper-Pearson interval."""
    k, n = sum(yes), len(yes)
    low = beta.ppf(0.025, k, n - k + 1) if k else 0.0
    high = beta.ppf(0.975, k + 1, n - k) if k < n else 1.0
    return f"{k / n:.3f} [{low:.3f}, {high:.3f}]"


def row(label: str, found: list[Outcome]) -> str:
    a, n = np.mean([one.sizes for one in found], axis=0)
    return (
        f"| {label} | {len(found)} | {share([o.inside for o in found])} | {a:.1f} | {n:.1f} | "
        f"{share([o.best for o in found])} | {share([o.covered for o in found])} |"
    )


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--specimens", type=int, default=200, help="of each design")
    options.add_argument("--through", choices=("dimple", "uniaxial"), default="dimple")
    options.add_argument("--design", nargs="*", default=["constant", "linear", "inverse"])
    options.add_argument("--frames", type=int, default=24)
    options.add_argument("--most", type=int, default=3, help="forms of one parameter that are refitted")
    options.add_argument("--no-refit", action="store_true")
    given = options.parse_args()
    set_numba_cache()
    model = ck.surrogate("dimple") if given.through == "dimple" else ck.specimen("uniaxial")
    nuisances = () if given.through == "dimple" else (ck.Nuisance("rate", sd=0.03),)
    settings = IdentificationSettings(starts=2, sobol_points=64, frames=given.frames, nuisances=nuisances)
    rows, began = [], time.monotonic()
    for design in given.design:
        points, tests, failed = [], [], []
        for k in range(given.specimens):
            truth = planted(design, given.through, k, model)
            fits = [identify(BASE, group, model, settings=settings) for group in group_by_temperature(truth.tests)]
            trend = discover(fits)
            points.append(Outcome.of(trend, truth))
            if not given.no_refit:
                trend = refit(trend, truth.tests, model, max_forms=given.most, settings=settings, search_again=False)
                tests.append(Outcome.of(trend, truth))
            failed += trend.notes
            last = (tests or points)[-1]
            print(f"{design} {k + 1} of {given.specimens}, {time.monotonic() - began:.0f} s: {trend.forms} {last}",
                  flush=True)  # fmt: skip
        rows.append(row(f"{design}, by the estimates", points))
        if tests:
            rows.append(row(f"{design}, by the tests", tests))
        print(*(f"  note: {note}" for note in dict.fromkeys(failed)), sep="\n")
    print(f"\n{given.through}, nine temperatures, {NINE[0]:.0f} to {NINE[-1]:.0f} K")
    print("| design | specimens | right forms in the sets | forms of A | forms of n | best is right | Q inside |")
    print("|-|-|-|-|-|-|-|", *rows, sep="\n")


if __name__ == "__main__":
    main()
