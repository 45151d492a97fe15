"""Inconel 625 with the event at 8250 s as an unknown of the rig.

    python tests/benchmarks/inconel_event.py [FOLDER] [--starts 2] [--frames 16] [--no-finite-elements] [--write]

FOLDER (../shared/data/dabi/in625) holds nine bulge tests between 716 and 811 C. All slow down at the same time of their
clocks, 8250 s, within a frame and without an elastic jump. Here that is a step of temperature (prior 0 K, standard
deviation 30 K), one for tests 01 to 08 and one for tests 09, 11 and 12, beside the nuisance parameters of the other
pages: the zero of each camera (standard deviation 12 um) and the thickness of each dimple (0.4935 mm, standard
deviation 0.027 mm). Suspect frames are marked unused. Laws are multiplied by Arrhenius' factor about 1050 K.

By finite elements all three outputs are compared and whole tests are weighted by how far they lie from the others
(Student), as in the row "offset, thickness" of the page on Inconel 625, whose columns these are: the pooled loss of the
amplitude, its reduced chi-square, and the loss of each test about its own mean. Law selection and cross-validation are
those of the page on temperature forms: the amplitude alone, likelihood and Student loss of tests, through the
surrogate; a test that is held out is predicted at nominal thickness, with the step that the others of its group show.
Errors are relative squared errors of the amplitude.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from measured import Page, arguments, progress
from public_calls import cross_validated_tests

import creepkit as ck
from creepkit.cli import set_numba_cache
from creepkit.inverse.identification import Identification, IdentificationSettings
from creepkit.inverse.identify import identify
from creepkit.inverse.selection import rank

EVENT = 8250.0
"""s, on the clock of every test."""


STRONG = ("test_09", "test_11", "test_12")
"""Tests that slow down by a factor of about three, the others by 1.1 to 1.8."""


RIG = (ck.Nuisance("offset", sd=0.012), ck.Nuisance("thickness", mean=0.4935, sd=0.027))
ARRHENIUS = ck.arrhenius(T_ref=1050.0)
LAWS = {
    "n(t)": ck.law("drifting-exponent").fix(m=0).times(ARRHENIUS),
    "Norton": ck.law("norton").times(ARRHENIUS),
    "strain hardening": ck.law("strain-hardening").times(ARRHENIUS),
    "time hardening": ck.law("time-hardening").times(ARRHENIUS),
    "hyperbolic sine": ck.law("hyperbolic-sine").times(ARRHENIUS),
}


def event_of(tests: list[ck.History]) -> tuple[ck.Nuisance, ...]:
    """One step of temperature for each of the two groups of tests."""
    weak = tuple(h.name for h in tests if h.name not in STRONG)
    return tuple(ck.Nuisance("temperature step", "all", sd=30.0, start=EVENT, tests=g) for g in (weak, STRONG))


def steps_text(fit: Identification) -> list[str]:
    """The steps of temperature, K, of both groups."""
    steps = [n for n in fit.nuisances if n.kind == "temperature step"]
    return [f"{n.value:.1f} +- {n.sd:.1f}" for n in steps] or ["-", "-"]


def values_text(fit: Identification) -> str:
    """Values with 95 % intervals; those that lie at a bound, or are not determined, marked with *."""
    marks = ("" if e.verdict == "determined" else "*" for e in fit.estimates)
    return ", ".join(
        f"{e.name} {e.value:.3g} [{e.low:.3g}, {e.high:.3g}]{mark}"
        for e, mark in zip(fit.estimates, marks, strict=True)
    )


def misfit_row(page: Page, name: str, fit: Identification, tests: list[ck.History]) -> None:
    """The columns of the page on Inconel 625."""
    prediction, errors = fit.predict(), fit.errors["amplitude"]
    own = (
        ck.relative_squared_error([h.outputs["amplitude"][h.used]], [prediction.of(k)[h.used, 0]], about="test")
        for k, h in enumerate(tests)
    )
    losses = (f"{value:.2g}" for value in own)
    page.row(name, f"{errors.relative_squared_error:.3g}", f"{errors.chi_square:.3g}", *steps_text(fit), *losses)


def by_finite_elements(page: Page, tests: list[ck.History], starts: int) -> None:
    """Misfit and parameters of each law, without and with the event."""
    fits = {}
    for name, law in LAWS.items():
        for label, nuisances in (("", RIG), (", event", (*RIG, *event_of(tests)))):
            fits[name + label] = ck.identify(
                law, tests, using="bulge", starts=starts, nuisances=nuisances, test_loss="student"
            )
            progress(f"  {name}{label}: {fits[name + label].errors['amplitude'].relative_squared_error:.3g}")
            progress(f"  {values_text(fits[name + label])}; steps {steps_text(fits[name + label])}")
    page.heading("Misfit by finite elements")
    heads = ("law", "pooled loss", "reduced chi-square", "step of tests 01 to 08, K", "step of tests 09, 11, 12, K")
    page.table(*heads, *(f"test {h.name.removeprefix('test_')}" for h in tests))
    for name, fit in fits.items():
        misfit_row(page, name, fit, tests)
    page.heading("Parameters, with 95 % intervals")
    page.paragraph("A star marks what is not determined or lies at its bound. Units: 1/s, s, J/mol, MPa.")
    page.table("law", "values")
    for name, fit in fits.items():
        page.row(name, values_text(fit))


def by_surrogate(page: Page, tests: list[ck.History], settings: IdentificationSettings) -> None:
    """Law selection and held-out prediction, without and with the event."""
    using = ck.surrogate("dimple")
    amplitudes = [h.replace(outputs={"amplitude": h.outputs["amplitude"]}) for h in tests]
    for label, nuisances in (("without", RIG), ("with", (*RIG, *event_of(tests)))):
        own = replace(settings, nuisances=nuisances)
        fits = {name: identify(law, amplitudes, using, settings=own) for name, law in LAWS.items()}
        ranking = rank(list(fits.values()))
        names = {id(fit.law): name for name, fit in fits.items()}
        page.heading(f"Law selection and cross-validation {label} the event")
        page.paragraph(f"{ranking.verdict}")
        held_out_heads = (f"test {h.name.removeprefix('test_')}" for h in tests)
        heads = ("-2 ln L", "weight", "fitted", "steps, K", "held out, pooled", "median", *held_out_heads)
        page.table("law", "parameters", *heads)
        for entry in ranking.laws:
            fit, held_out = entry.fit, cross_validated_tests(entry.fit, amplitudes)
            errors = [e["amplitude"].relative_squared_error for e in held_out.errors.values()]
            page.row(
                names[id(fit.law)],
                len(fit.law.params),
                f"{-2 * fit.log_likelihood:.1f}",
                f"{entry.weight:.2g}",
                f"{fit.errors['amplitude'].relative_squared_error:.2g}",
                "; ".join(steps_text(fit)),
                f"{held_out.pooled_error('amplitude'):.3g}",
                f"{np.median(errors):.2g}",
                *(f"{error:.2g}" for error in errors),
            )


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=Path("../shared/data/dabi/in625"))
    parser.add_argument("--starts", type=int, default=2)
    parser.add_argument("--frames", type=int, default=16, help="of each test, through the surrogate")
    parser.add_argument("--no-finite-elements", action="store_true")
    options = parser.parse_args()
    set_numba_cache()
    tests = ck.exclude_suspect_frames(ck.read_histories(options.folder))
    page = Page("inconel_event", __doc__)
    settings = IdentificationSettings(
        starts=options.starts, frames=options.frames, test_loss="student", weights="likelihood"
    )
    by_surrogate(page, tests, settings)
    if not options.no_finite_elements:
        by_finite_elements(page, tests, options.starts)
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
