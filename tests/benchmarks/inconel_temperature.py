"""How the parameters of n(t) depend on temperature in Inconel 625, and whether forms predict better than Arrhenius.

    python tests/benchmarks/inconel_temperature.py [FOLDER] [--through dimple|bulge] [--most 2] [--frames 16] [--each]
                                                   [--nested] [--no-finite-elements]

FOLDER (../shared/data/dabi/in625) holds nine bulge tests between 716 and 811 C. What is suspect about them is marked
unused; the zero of each camera (sd 12 um) and each dimple's apex thickness (.4935 mm, sd .027 mm, as measured on 25
dimples) are unknown, and whole tests weigh by how far they lie from the others. The law is Eq. (1) with m = 0. The
amplitude alone is fitted: measured widths and shapes come from Eq. (7) in a window that nobody states, and lie a tenth
off those simulated.

1. Each temperature alone, then forms for A, n_0, n_inf, C, tau_d, tau_r by regression on these estimates: constant,
   linear, activated for each, and for A Arrhenius or a power of T.
2. The forms put back into the law and refitted to the nine tests, ranked by BIC under one covariance.
3. Leave one test out: every test predicted at nominal thickness from the eight others, by plain Arrhenius (all other
   parameters constant) and by the discovered forms (--each: and by each parameter's form alone); through the surrogate,
   then through finite elements. The forms were chosen from all nine tests, which favours them; --nested chooses them
   anew without the test that is held out.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import creepkit as ck
from creepkit.cli import set_numba_cache
from creepkit.discovery.discover import discover, group_by_temperature
from creepkit.discovery.forms import law_with_forms
from creepkit.discovery.refitting import refit
from creepkit.errors import CreepkitError
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.cross_validation import (
    CrossValidation,
    cross_validate,
    prediction_errors,
)
from creepkit.inverse.identification import Identification, IdentificationSettings
from creepkit.inverse.identify import StartingEstimate, identify

LAW = ck.law("drifting-exponent").fix(m=0)
THICKNESS = ck.Nuisance("thickness", mean=0.4935, sd=0.027)
OWN = (ck.Nuisance("offset", sd=0.012), THICKNESS)
ALONE = IdentificationSettings(starts=2, nuisances=OWN)
SETTINGS = IdentificationSettings(starts=2, nuisances=OWN, test_loss="student", weights="likelihood")
FORMS = dict.fromkeys(LAW.names, ("constant", "linear", "activated")) | {"A": ("arrhenius", "logarithmic")}


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("folder", nargs="?", type=Path, default=Path("../shared/data/dabi/in625"))
    options.add_argument("--through", choices=("dimple", "bulge"), default="dimple")
    options.add_argument("--most", type=int, default=2, help="forms of one parameter that are refitted")
    options.add_argument("--frames", type=int, default=16)
    options.add_argument("--each", action="store_true", help="hold tests out for each parameter's form alone as well")
    options.add_argument("--nested", action="store_true", help="choose the forms anew in every fold")
    options.add_argument("--no-finite-elements", action="store_true")
    options.add_argument("--plot", type=Path, default=None)
    given = options.parse_args()
    set_numba_cache()
    began = time.monotonic()
    tests = amplitudes(ck.exclude_suspect_frames(ck.read_histories(given.folder)))
    using = ck.surrogate("dimple") if given.through == "dimple" else ck.specimen("bulge")

    joint = replace(SETTINGS, frames=given.frames)
    alone = each_alone(tests, using, replace(ALONE, frames=given.frames))
    trend = discover(alone, forms=FORMS)
    print(f"\nby the estimates alone\n{trend}\n", flush=True)
    trend = refit(trend, tests, using, max_forms=given.most, settings=joint, progress=told)
    print(
        f"\nby the nine tests, through {given.through}, after {time.monotonic() - began:.0f} s\n{trend}\n", flush=True
    )
    if given.plot:
        trend.plot(given.plot)

    laws = {"plain Arrhenius": plain(trend), "discovered": trend.fit}
    if given.each:
        laws |= one_at_a_time(trend, tests, using, joint)
    table(f"through {given.through}", {name: (fit, held_out(fit, tests)) for name, fit in laws.items()}, tests)
    if given.nested:
        nested(alone, tests, using, given.most, joint)
    if not given.no_finite_elements and given.through != "bulge":
        dimple = ck.specimen("bulge")
        exact = {name: again(laws[name], tests, dimple) for name in ("plain Arrhenius", "discovered")}
        table("through finite elements", {n: (fit, held_out(fit, tests)) for n, fit in exact.items()}, tests)
    print(f"\n{time.monotonic() - began:.0f} s")


def told(task: str, done: int, total: int) -> None:
    print(f"  {task} {done} of {total}", flush=True)


def amplitudes(tests: list[ck.History]) -> list[ck.History]:
    """The tests with their amplitude alone."""
    return [h.replace(outputs={"amplitude": h.outputs["amplitude"]}) for h in tests]


def each_alone(tests: list[ck.History], using: object, settings: IdentificationSettings) -> list[Identification]:
    """One identification a temperature, with what it says."""
    fits = []
    print("| T, K | tests | " + " | ".join(LAW.names) + " |\n|" + "-|" * (2 + len(LAW.names)))
    for group in group_by_temperature(tests):
        fit = identify(LAW, group, using, settings=settings)
        fits.append(fit)
        row = " | ".join(f"{e.value:.3g} [{e.low:.2g}, {e.high:.2g}]" for e in fit.estimates)
        print(f"| {fit.reference.temperature:.0f} | {len(group)} | {row} |", flush=True)
    return fits


def plain(trend: object) -> Identification:
    """The identification with Arrhenius of the rate and every other parameter constant, of those refitted."""
    wanted = {name: "arrhenius" if name == "A" else "constant" for name in LAW.names}
    return next(one.fit for one in trend.candidates if one.forms == wanted)


def one_at_a_time(
    trend: object, tests: list[ck.History], using: object, settings: IdentificationSettings
) -> dict[str, Identification]:
    """Arrhenius and the discovered form of one other parameter, for each that is not constant."""
    base, found = plain(trend), {}
    for library in trend.candidates[0].libraries:
        if library.parameter == "A" or library.name == "constant":
            continue
        factor = next(o for o in trend.combinations.with_form("A", "arrhenius").libraries if o.parameter == "A")
        law = law_with_forms(LAW, [factor, library])
        theta = law_theta(law, base)
        start = StartingEstimate(Coordinates(law, base.reference).u(theta), reference=base.reference)
        name = f"Arrhenius, {library.parameter}: {library.name}"
        found[name] = identify(law, tests, using, settings=settings, start=start)
    return found


def law_theta(law: ck.CreepLaw, base: Identification) -> np.ndarray:
    """Internal values of a law with more forms: those of the plain one, and forms that do nothing yet."""
    known = dict(zip(base.law.names, base.coordinates.theta(base.u), strict=True))
    return np.array([known.get(name, p.to_internal(p.off or p.center)) for name, p in law.table.items()])


def again(fit: Identification, tests: list[ck.History], using: object) -> Identification:
    """The same law through another predictor, beginning where the first ended."""
    start = StartingEstimate.from_identification(fit)
    return identify(fit.law, tests, using, settings=fit.settings, start=start)


def held_out(fit: Identification, tests: list[ck.History]) -> CrossValidation:
    return cross_validate(fit, tests)


def table(how: str, found: dict[str, tuple[Identification, CrossValidation]], tests: list[ck.History]) -> None:
    """Misfit, BIC's ingredients, and the errors of amplitude of held-out tests."""
    names = [h.name.removeprefix("test_") for h in tests]
    print(f"\n{how}: relative squared error of the amplitude; fitted, then held out (pooled, without test 12, each)")
    print("| law | numbers | -2 ln L | fitted | held out | without 12 | median | " + " | ".join(names) + " |")
    print("|" + "-|" * (7 + len(names)))
    for name, (fit, held) in found.items():
        kept = replace(held, folds=tuple(f for f in held.folds if not f.held_out[0].name.endswith("12")))
        own = [errors["amplitude"].relative_squared_error for errors in held.errors.values()]
        print(
            f"| {name} | {len(fit.law.params)} | {-2 * fit.log_likelihood:.1f} | "
            f"{fit.errors['amplitude'].relative_squared_error:.2g} | "
            f"{held.pooled_error('amplitude'):.3g} | {kept.pooled_error('amplitude'):.3g} | "
            f"{np.median(own):.2g} | " + " | ".join(f"{v:.2g}" for v in own) + " |",
            flush=True,
        )
    verdict(found)


def verdict(found: dict[str, tuple[Identification, CrossValidation]]) -> None:
    """Whether the discovered forms predict better than plain Arrhenius, test by test."""
    one, other = (
        np.array([e["amplitude"].relative_squared_error for e in found[n][1].errors.values()])
        for n in ("plain Arrhenius", "discovered")
    )
    better, gain = int((other < one).sum()), np.log(other / one)
    error = gain.std(ddof=1) / np.sqrt(gain.size)
    print(
        f"discovered forms predict {better} of {gain.size} held-out tests better than plain Arrhenius; mean ln of the "
        f"ratio of errors {gain.mean():+.2f} +- {error:.2f} (one standard error)"
    )
    if abs(gain.mean()) < 2 * error:
        print("verdict: these nine tests do not show that forms predict better or worse than plain Arrhenius")
    else:
        print(f"verdict: the forms predict {'better' if gain.mean() < 0 else 'worse'} than plain Arrhenius")


def nested(
    alone: list[Identification], tests: list[ck.History], using: object, most: int, settings: IdentificationSettings
) -> None:
    """Forms chosen without the test that is then predicted."""
    print("\nforms chosen anew without the test held out\n| test | forms | rse, amplitude |\n|-|-|-|")
    groups = group_by_temperature(tests)
    for held in tests:
        kept = [fit for fit, group in zip(alone, groups, strict=True) if held not in group]
        others = [h for h in tests if h is not held]
        try:
            trend = discover(kept, forms=FORMS)
            trend = refit(trend, others, using, max_forms=most, settings=settings, search_again=False)
        except CreepkitError as error:
            print(f"| {held.name} | {error} | |", flush=True)
            continue
        told_forms = ", ".join(f"{name}:{form}" for name, form in trend.forms.items() if form != "constant")
        error = prediction_errors(trend.fit, held)["amplitude"].relative_squared_error
        print(f"| {held.name} | {told_forms} | {error:.2g} |", flush=True)


if __name__ == "__main__":
    main()
