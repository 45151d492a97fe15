"""Settings of an identification, checked: all that a run can be repeated from.

Their defaults stand here alone: Python and the command line, identify, select, screen and discover take them from here.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from numbers import Integral
from typing import Any, Literal, Self

import numpy as np

from creepkit.checked_arguments import checked
from creepkit.errors import FitError, quoted, refuse_unknown
from creepkit.limits import SEED, SOBOL_POINTS, STARTS, Limits
from creepkit.options import Options, option
from creepkit.records import Nuisance, Predictor, dimension_named

Weights = Literal["automatic", "equal", "likelihood"]


UsualErrors = Literal["usual", "none"] | Mapping[str, float]


USUAL_ERRORS: Mapping[str, float] = {
    "temperature": 3.0,
    "load": 0.01,
    "dimensions": 1.0,
    "modulus": 0.02,
    "motion": 0.01,
}
"""One standard deviation of what tests are usually off by and nobody models.

temperature : K, by which ISO 204 permits a creep test to be off up to 600 °C (above, 4 or 5 K). load : a share, of a
machine of class 1 by ISO 7500-2. dimensions : times the tolerance that a specimen states, such as 2 % of the thickness
of a bulge. modulus : a share, by which values of one alloy by different methods differ. motion : of an imposed strain
or displacement, a share, of an extensometer of class 1 by ISO 9513.
"""


@checked
@dataclass(frozen=True)
class IdentificationSettings(Options, title="settings of an identification"):
    """What a run can be repeated from.

    starts : of the multi-start search, half of them where two parameters beside rates are sought, two for one;
    sobol_points : that are screened for them, a power of two is best; a quarter of them for two, an eighth for one.
    frames : that are compared in each history, with all their outputs. seed : of random draws.
    nuisances : what differs between tests; by default an offset of each output and test-to-test scatter of the rate,
        both estimated.
    weights : of the values; noise, intervals and ranking are by one likelihood, with white noise and autocorrelation of
        every output (see inverse.variance_components). "likelihood": the values too, under the usual errors. "equal":
        least squares of frames of equal weight, which describe tests best where no law explains them. "automatic",
        the default: "likelihood", but "equal" where a law misses the shape of curves (see inverse.identify.describing).
    further_laws : that select() tries at most where no candidate explains the tests: sums, and registered laws.
    suspect_frames : "exclude": frames that unload, fall or lie apart (see quality.exclude_suspect_frames) are left out
        when the public functions and commands are handed tests, and the notes of the result name them; or "keep".
    rupture_times : whether ends of tests without curves, rupture times and run-outs, are compared with the law: "auto":
        where its rate can rise at constant stress (see inverse.compared_tests), in a comparison of laws where that of
        any can; "use" or "ignore": with every law or with none. Curves that were followed to rupture are compared to
        it.
    usual_errors : of tests, which every interval includes where no nuisance stands for them: "usual" ones (see
        USUAL_ERRORS), {what: one standard deviation} of those that are named alone, or "none".
    """

    starts: int = option(8, "Starts of the search.", STARTS)
    sobol_points: int = option(64, "Points that are screened for the starts; 8 a start.", SOBOL_POINTS)
    frames: int = option(60, "Frames of each test that are compared.", Limits(2, 100_000))
    seed: int = option(0, "Seed of random draws.", SEED)
    nuisances: tuple[Nuisance, ...] = option(
        (Nuisance("offset"), Nuisance("rate")),
        "What differs between tests beside the default; rate=none leaves one out.",
        flag="nuisance",
        example="thickness=0.4935:0.027",
    )
    weights: Weights = option("automatic", "Of readings: by their likelihood, or all equal.")
    suspect_frames: Literal["exclude", "keep"] = option("exclude", "Frames that unload, fall or lie apart.")
    further_laws: int = option(6, "Laws that are tried at most where none explains the tests.", Limits(0, 1000))
    rupture_times: Literal["auto", "use", "ignore"] = option(
        "auto", "Rupture times and run-outs of tests without curves; auto: with laws that describe rupture."
    )
    usual_errors: UsualErrors = option(
        "usual",
        "Errors of tests that intervals include, one standard deviation; temperature in K, others shares.",
        example="temperature=3,load=0.01",
    )

    def __post_init__(self) -> None:
        _check_usual_errors(self.usual_errors)
        for nuisance in self.nuisances:
            _check_nuisance(nuisance)
        for first, second in combinations(self.nuisances, 2):
            same = (first.key, first.output) == (second.key, second.output)
            disjoint = first.tests and second.tests and not {*first.tests} & {*second.tests}
            if same and not disjoint:
                raise FitError(
                    f"nuisance '{first.key}' is given twice; give one, with the scope that matters most, or name the "
                    "tests of each by tests="
                )

    @property
    def by_likelihood(self) -> bool:
        """Whether laws can be compared by their likelihood under these weights."""
        return self.weights in ("automatic", "likelihood")

    def check_by_likelihood(self, verb: str) -> None:
        """Raise FitError where `verb`, such as select(), cannot compare laws under these weights."""
        if not self.by_likelihood:
            raise FitError(
                f"{verb} compares laws by their likelihood, found weights={self.weights!r}; leave weights out, or "
                "identify each law with them and rank() the results"
            )

    @property
    def included_errors(self) -> Mapping[str, float]:
        """{what: one standard deviation} of the errors that intervals include."""
        if isinstance(self.usual_errors, str):
            return USUAL_ERRORS if self.usual_errors == "usual" else {}
        return self.usual_errors

    def changed(self, changes: Mapping[str, Any], predictor: Predictor | Mapping[str, Predictor] | None = None) -> Self:
        """The settings with fields changed by name; None leaves a field as it is.

        A nuisance that is a name alone has its prior as usual; that of a length is the tolerance that its specimen, the
        predictor, states. With another number of starts the number of Sobol points follows, unless it is given too.
        """
        given = {name: value for name, value in changes.items() if value is not None}
        if "nuisances" in given:
            listed: Any = given["nuisances"]
            listed = [listed] if isinstance(listed, str | Nuisance) else listed
            if isinstance(listed, Iterable):
                listed = tuple(_nuisance_named(n, predictor) if isinstance(n, str) else n for n in listed)
            given["nuisances"] = listed
        if isinstance(given.get("starts"), Integral):  # eight points a start, a power of two, and at least 64
            points = max(64, 1 << (8 * max(int(given["starts"]), 1) - 1).bit_length())
            given.setdefault("sobol_points", points)
        return super().changed(given)


def _nuisance_named(kind: str, predictor: Predictor | Mapping[str, Predictor] | None) -> Nuisance:
    """The nuisance of this name; of a length with the tolerance of its specimen, the largest where several have it."""
    predictors = [*predictor.values()] if isinstance(predictor, Mapping) else [predictor]
    lengths = [length for p in predictors if (length := dimension_named(p, kind)) is not None]
    sd = max((length.tolerance * length.default for length in lengths), default=0.0)
    return Nuisance(kind, sd=sd) if sd > 0.0 else Nuisance(kind)


@checked
def default_nuisances(*further: Nuisance, without: Sequence[str] = ()) -> tuple[Nuisance, ...]:
    """The default nuisances of an identification and `further` ones: what the command line makes of --nuisance.

    A further nuisance of a default kind replaces it. without : kinds of the defaults to leave out, such as ["rate"].
    """
    usual = IdentificationSettings().nuisances
    known = [n.kind for n in usual]
    for kind in without:
        refuse_unknown(kind, known, FitError, f"'{kind}' is no default nuisance that could be left out")
    replaced = {*without, *(n.kind for n in further)}
    return (*(n for n in usual if n.kind not in replaced), *further)


LARGEST_USUAL_ERRORS = {"temperature": 50.0, "dimensions": 10.0, "load": 0.3, "modulus": 0.3, "motion": 0.3}


def _check_usual_errors(errors: UsualErrors) -> None:
    if isinstance(errors, str):
        if errors not in ("usual", "none"):
            raise FitError(f'usual_errors is "{errors}"; allowed are usual, none and such as {{"temperature": 3}}')
        return
    for name, size in errors.items():
        refuse_unknown(name, USUAL_ERRORS, FitError, f"usual_errors names '{name}', which is none of them")
        if not 0.0 <= size <= LARGEST_USUAL_ERRORS[name]:
            raise FitError(
                f"usual_errors: {name} is {size!r}; give a standard deviation from 0 to {LARGEST_USUAL_ERRORS[name]:g}"
            )


def _check_nuisance(nuisance: Nuisance) -> None:
    if not isinstance(nuisance, Nuisance):
        raise FitError(f"nuisances are names or such as Nuisance('thickness', sd=0.01), found {quoted(repr(nuisance))}")
    n, finite = nuisance, nuisance.sd is None or np.isfinite(nuisance.sd)
    if n.output and n.kind != "offset":
        raise FitError(f"nuisance '{n.kind}' acts on a whole test: it has no output, found output='{n.output}'")
    if n.tests and not n.is_simulated:
        raise FitError(f"nuisance '{n.kind}' belongs to every test; leave out tests=, which deviations alone can have")
    if not n.is_simulated:
        if n.mean != 0 or np.isfinite(n.bounds).any() or n.scope != "test" or not finite:
            raise FitError(
                f"nuisance {n} is not known to this identification: Nuisance('offset') and Nuisance('rate') are one "
                "for each test, about zero, with sd= a finite number or None to estimate it"
            )
        return
    if n.is_length and n.mean == 0 and n.scope == "test":  # the mean is then what each test states
        return
    if n.is_length and not (np.isfinite(n.mean) and n.mean > 0):
        raise FitError(
            f"nuisance '{n.kind}' is a length in mm and needs its prior mean, such as mean=0.4935; found {n.mean:g}"
        )
    if not n.bounds[0] <= n.mean <= n.bounds[1]:
        raise FitError(f"nuisance '{n.kind}': its mean {n.mean:g} lies outside its bounds {n.bounds}")
