"""Recovery of planted temperature forms: sets of forms, the best combination, and the interval of Q.

    python tests/benchmarks/temperature_forms.py [--specimens 200] [--through surrogate|uniaxial] [--design NAME ...]
                                                 [--frames 24] [--max-forms 3] [--no-refit] [--write]

A specimen is one set of tests at nine temperatures, 973 to 1083 K, of a Norton law. Designs: `constant` (Arrhenius, n
constant), `linear` (Arrhenius, n linear in T) and `inverse` (Arrhenius, n linear in 1/T). Priors, seed 625: n at 1033 K
uniform in 3 to 6, its decrease over the 110 K uniform in 0.3 to 1.5, Q uniform in 350 to 480 kJ/mol, ln of the rate at
the reference stress and 1033 K within 0.5 of one that deflects the dimple well. `surrogate`: one bulge test a
temperature, 8 then 10 MPa for 12 h, 48 frames, through the reduced-order model; noise 1.5 um on D_amp, 0.02 mm on S_d,
0.02 on S_p. `uniaxial`: three creep tests a temperature at 60, 90 and 120 MPa to about 2 %, noise 2e-5 of strain, rates
that scatter by 3 % from test to test.

Every parameter may take all registered forms. Columns: share of specimens whose planted forms of A and of n are both in
the reported sets, with its 95 % interval (Clopper and Pearson); mean number of forms in the sets of A and of n; share
with the best combination right; share with Q inside its 95 % interval; once from the estimates at each temperature and
once after refitting to the tests. The goal is 0.95 of each share.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from measured import Page, arguments, progress
from proportions import share_with_interval

import creepkit as ck
from creepkit.discovery.discover import discover, group_by_temperature
from creepkit.discovery.refitting import refit
from creepkit.discovery.temperature_law import TemperatureLaw
from creepkit.inverse.identification import IdentificationSettings
from creepkit.inverse.identify import identify

SEED, T_REF = 625, 1033.15
TEMPERATURES = np.linspace(973.15, 1083.15, 9)
SD = {"amplitude": 1.5e-3, "width": 0.02, "shape": 0.02}
STRESS = {"surrogate": 100.0, "uniaxial": 90.0}
LOG_RATE = {"surrogate": np.log(7e-7), "uniaxial": np.log(2e-7)}
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
    n, decrease, Q = rng.uniform(3.0, 6.0), rng.uniform(0.3, 1.5), rng.uniform(350e3, 480e3)
    A = float(np.exp(LOG_RATE[through] + rng.uniform(-0.5, 0.5) - n * np.log(STRESS[through])))
    values, slope = {"A": A, "n": n, "Q": Q}, -decrease / np.ptp(TEMPERATURES)
    law = BASE
    if design == "linear":
        law, values["n_T"] = law.with_temperature(n=ck.linear(T_REF)), slope
    elif design == "inverse":
        law, values["n_I"] = law.with_temperature(n=ck.inverse_temperature(T_REF)), -slope * T_REF**2 / 1000.0
    law = law.times(ck.arrhenius(T_REF))
    tests = (bulge_tests if through == "surrogate" else uniaxial_tests)(law, values, rng, model)
    return Planted(law, values, {"A": "arrhenius", "n": design}, tests)


def bulge_tests(
    law: ck.CreepLaw, values: dict[str, float], rng: np.random.Generator, model: object
) -> list[ck.History]:
    """One noisy bulge test a temperature; one that bursts ends there."""
    tests = []
    for T in TEMPERATURES:
        run = ck.simulate(
            law,
            model,
            values,
            loading=ck.PressureJump(8.0, 10.0, 14400.0),
            times=np.arange(900.0, 43201.0, 900.0),
            temperature=float(T),
            elastic=ck.Elastic(E=180e3 - 100.0 * (T - 273.15)),
            name=f"{T:.0f} K",
        )
        noisy = {name: value + SD[name] * rng.normal(size=value.size) for name, value in run.outputs.items()}
        known = {name: np.full(run.times.size, SD[name]) for name in noisy}
        tests.append(run.replace(outputs=noisy, standard_deviation=known))
    return tests


def uniaxial_tests(
    law: ck.CreepLaw, values: dict[str, float], rng: np.random.Generator, model: object
) -> list[ck.History]:
    """Three noisy creep tests a temperature."""
    kernel, tests = ck.lower(law, "numpy"), []
    for T in TEMPERATURES:
        for stress in (60.0, 90.0, 120.0):
            rate = float(kernel.rate(values, stress=stress, temperature=T))
            run = ck.simulate(
                law,
                model,
                values | {"A": values["A"] * float(np.exp(0.03 * rng.normal()))},
                loading=ck.constant_stress(stress, "stress"),
                times=np.geomspace(0.01, 1.0, 24) * 0.02 / rate,
                temperature=float(T),
                name=f"{T:.0f} K, {stress:.0f} MPa",
            )
            strain = run.outputs["strain"] + 2e-5 * rng.normal(size=run.times.size)
            tests.append(run.replace(outputs={"strain": strain}))
    return tests


@dataclass(frozen=True)
class Recovery:
    """What was recovered of one specimen.

    in_sets : whether the planted forms are in the reported sets; sizes : of the sets of A and of n; best : whether the
    best combination is the planted one; covered : whether the interval of Q holds the planted value.
    """

    in_sets: bool
    sizes: tuple[int, int]
    best: bool
    covered: bool

    @classmethod
    def of(cls, result: TemperatureLaw, truth: Planted) -> Recovery:
        names = {p: [form.name for form in forms] for p, forms in result.plausible_forms.items()}
        in_sets = all(truth.forms[p] in names[p] for p in truth.forms)
        with_q = [e for e in result.estimates if e.name == "Q"]
        covered = bool(with_q) and with_q[0].low <= truth.values["Q"] <= with_q[0].high
        return cls(in_sets, (len(names["A"]), len(names["n"])), result.forms == truth.forms, covered)


def cells(rows: list[Recovery]) -> list[object]:
    """One row of the table, but for its head."""
    of_A, of_n = np.mean([one.sizes for one in rows], axis=0)
    in_sets, best, covered = (
        share_with_interval([getattr(o, x) for o in rows]) for x in ("in_sets", "best", "covered")
    )
    return [len(rows), in_sets, f"{of_A:.1f}", f"{of_n:.1f}", best, covered]


HEADS = (
    "specimens",
    "planted forms in the sets",
    "forms of A",
    "forms of n",
    "best is planted",
    "Q inside its interval",
)


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--specimens", type=int, default=200, help="of each design")
    parser.add_argument("--through", choices=("surrogate", "uniaxial"), default="surrogate")
    parser.add_argument("--design", nargs="*", default=["constant", "linear", "inverse"])
    parser.add_argument("--frames", type=int, default=24)
    parser.add_argument("--max-forms", type=int, default=3, help="forms of one parameter that are refitted")
    parser.add_argument("--no-refit", action="store_true")
    options = parser.parse_args()
    bulge = options.through == "surrogate"
    model = ck.surrogate("dimple") if bulge else ck.specimen("uniaxial")
    nuisances = () if bulge else (ck.Nuisance("rate", sd=0.03),)
    settings = IdentificationSettings(starts=2, sobol_points=64, frames=options.frames, nuisances=nuisances)
    refitting = dict(max_forms=options.max_forms, settings=settings, search_again=False)
    page = Page(f"temperature_forms_{options.through}", __doc__)
    page.table("design", "forms chosen by", *HEADS)
    notes, start = [], time.monotonic()
    for design in options.design:
        by_estimates, by_tests = [], []
        for k in range(options.specimens):
            truth = planted(design, options.through, k, model)
            fits = [identify(BASE, group, model, settings=settings) for group in group_by_temperature(truth.tests)]
            result = discover(fits)
            by_estimates.append(Recovery.of(result, truth))
            if not options.no_refit:
                result = refit(result, truth.tests, model, **refitting)
                by_tests.append(Recovery.of(result, truth))
            notes += result.notes
            seconds = time.monotonic() - start
            progress(f"{design} {k + 1} of {options.specimens}, {seconds:.0f} s: {result.forms}")
        page.row(design, "estimates", *cells(by_estimates))
        if by_tests:
            page.row(design, "tests", *cells(by_tests))
    for note in dict.fromkeys(notes):
        page.paragraph(f"Note: {note}.")
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
