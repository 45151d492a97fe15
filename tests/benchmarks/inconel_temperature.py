"""Inconel 625: do discovered temperature forms of n(t) predict better than plain Arrhenius?

    python tests/benchmarks/inconel_temperature.py [FOLDER] [--through surrogate|bulge] [--max-refits 8] [--frames 16]
                                                   [--no-finite-elements] [--write]

FOLDER (../shared/data/dabi/in625) holds nine bulge tests between 716 and 811 C. The law is Eq. (1) with m = 0; the
amplitude is fitted; nuisance parameters are the zero of each camera (12 um) and the apex thickness (0.4935 mm, standard
deviation 0.027 mm). Forms of each parameter are chosen from identifications at each temperature alone, then put back
into the law and refitted to the nine tests. Each test is then predicted at nominal thickness from the eight others.
Errors are relative squared errors of the amplitude. The forms were chosen from all nine tests, which favours them.
"""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from measured import Page, arguments, progress
from public_calls import cross_validated_tests

import creepkit as ck
from creepkit.discovery.discover import discover, group_by_temperature
from creepkit.discovery.temperature_law import TemperatureLaw, refit
from creepkit.inverse.cross_validation import CrossValidation
from creepkit.inverse.identification import Identification, IdentificationSettings
from creepkit.inverse.identify import identify
from creepkit.inverse.search.multistart import StartingEstimate

LAW = ck.law("drifting-exponent").fix(m=0)
THICKNESS = ck.Nuisance("thickness", mean=0.4935, sd=0.027)
NUISANCES = (ck.Nuisance("offset", sd=0.012), THICKNESS)
ONE_TEMPERATURE = IdentificationSettings(starts=2, nuisances=NUISANCES)
ALL_TESTS = replace(ONE_TEMPERATURE, weights="likelihood")
FORMS = dict.fromkeys(LAW.names, ("constant", "linear", "activated")) | {"A": ("arrhenius", "logarithmic")}


ATYPICAL = "12"
"""Ending of the name of a test that no law predicts; pooled errors are also given without it."""

CrossValidated = dict[str, tuple[Identification, CrossValidation]]


def amplitudes(tests: list[ck.History]) -> list[ck.History]:
    """The tests with their amplitude alone."""
    return [h.replace(outputs={"amplitude": h.outputs["amplitude"]}) for h in tests]


def identify_each(tests: list[ck.History], using: object, settings: IdentificationSettings) -> list[Identification]:
    """One identification a temperature."""
    fits = []
    for group in group_by_temperature(tests):
        fit = identify(LAW, group, using, settings=settings)
        fits.append(fit)
    return fits


def plain_arrhenius(result: TemperatureLaw) -> Identification:
    """The identification with Arrhenius of the rate and every other parameter constant, of those refitted."""
    wanted = {name: "arrhenius" if name == "A" else "constant" for name in LAW.names}
    return next(candidate.fit for candidate in result.candidates if candidate.forms == wanted)


def identify_again(fit: Identification, tests: list[ck.History], using: object) -> Identification:
    """The same law through another predictor, from where the first ended."""
    start = StartingEstimate.from_identification(fit)
    return identify(fit.law, tests, using, settings=fit.settings, start=start)


def cross_validation_table(page: Page, through: str, results: CrossValidated, tests: list[ck.History]) -> None:
    """Errors of the amplitude, of the fit and of held-out tests, and what they say of the discovered forms."""
    page.heading(f"Cross-validation {through}")
    heads = ("held out, pooled", f"without test {ATYPICAL}", "median")
    page.table("law", "parameters", "-2 ln L", "fitted", *heads)
    for name, (fit, held_out) in results.items():
        folds = tuple(fold for fold in held_out.folds if not fold.held_out[0].name.endswith(ATYPICAL))
        typical = replace(held_out, folds=folds)
        errors = errors_of(held_out)
        page.row(
            name,
            len(fit.law.params),
            f"{-2 * fit.log_likelihood:.1f}",
            f"{fit.errors['amplitude'].relative_squared_error:.2g}",
            f"{held_out.pooled_error('amplitude'):.3g}",
            f"{typical.pooled_error('amplitude'):.3g}",
            f"{np.median(errors):.2g}",
        )
    page.paragraph(verdict(results))


def errors_of(held_out: CrossValidation) -> np.ndarray:
    """Relative squared errors of the amplitude, (tests,)."""
    return np.array([errors["amplitude"].relative_squared_error for errors in held_out.errors.values()])


def verdict(results: CrossValidated) -> str:
    """Whether the discovered forms predict better than plain Arrhenius, test by test."""
    plain, discovered = (errors_of(results[name][1]) for name in ("plain Arrhenius", "discovered"))
    better, log_ratio = int((discovered < plain).sum()), np.log(discovered / plain)
    error = log_ratio.std(ddof=1) / np.sqrt(log_ratio.size)
    text = (
        f"The discovered forms predict {better} of {log_ratio.size} held-out tests better than plain Arrhenius; the "
        f"mean of ln(ratio of errors) is {log_ratio.mean():+.2f} +- {error:.2f} (one standard error). "
    )
    if abs(log_ratio.mean()) <= 2 * error:
        return text + "These nine tests do not show that forms predict better or worse than plain Arrhenius."
    return text + f"The forms predict {'better' if log_ratio.mean() < 0 else 'worse'} than plain Arrhenius."


def print_step(task: str, done: int, total: int) -> None:
    progress(f"  {task} {done} of {total}")


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=Path("../shared/data/dabi/in625"))
    parser.add_argument("--through", choices=("surrogate", "bulge"), default="surrogate")
    parser.add_argument("--max-refits", type=int, default=8, help="combinations of forms that are refitted")
    parser.add_argument("--frames", type=int, default=16)
    parser.add_argument("--no-finite-elements", action="store_true")
    options = parser.parse_args()
    start = time.monotonic()
    tests = amplitudes(ck.exclude_suspect_frames(ck.read_histories(options.folder)))
    by_surrogate = options.through == "surrogate"
    using = ck.surrogate("dimple") if by_surrogate else ck.specimen("bulge")
    through = "through the surrogate" if by_surrogate else "by finite elements"
    page = Page("inconel_temperature" if by_surrogate else "inconel_temperature_bulge", __doc__)

    settings = replace(ALL_TESTS, frames=options.frames)
    refitting = {"max_refits": options.max_refits, "settings": settings}
    alone = identify_each(tests, using, replace(ONE_TEMPERATURE, frames=options.frames))
    result = discover(alone, forms=FORMS)
    result = refit(result, tests, using, progress=print_step, **refitting)
    forms = ", ".join(f"{name}: {form}" for name, form in result.forms.items())
    page.paragraph(f"Discovered forms: {forms}.")

    fits = {"plain Arrhenius": plain_arrhenius(result), "discovered": result.fit}
    validated = {name: (fit, cross_validated_tests(fit, tests)) for name, fit in fits.items()}
    cross_validation_table(page, through, validated, tests)
    if by_surrogate and not options.no_finite_elements:
        dimple = ck.specimen("bulge")
        exact = {name: identify_again(fits[name], tests, dimple) for name in ("plain Arrhenius", "discovered")}
        validated = {name: (fit, cross_validated_tests(fit, tests)) for name, fit in exact.items()}
        cross_validation_table(page, "by finite elements", validated, tests)
    progress(f"{time.monotonic() - start:.0f} s")
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
