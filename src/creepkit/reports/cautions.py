"""What to mind of an identification, the most serious first: what keeps the law from the tests, and they from it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from creepkit.inverse.history_checks import LENGTHS_BY_DEFAULT
from creepkit.inverse.nuisance_parameters import beyond_intervals
from creepkit.inverse.uncertainty.laplace_approximation import NOT_DETERMINED, POORLY_DETERMINED
from creepkit.records import is_logarithmic, output_unit
from creepkit.records.units import time_text
from creepkit.reports.blocks import named, number
from creepkit.reports.description import rejected
from creepkit.reports.remarks import challenge_text, combined_change_text, nuisance_text, test_change_text
from creepkit.reports.verdicts import cause_caution, cause_headline, unmet_text
from creepkit.reports.wording import say
from creepkit.reports.words import CAUTIONS, REASONS

if TYPE_CHECKING:
    from creepkit.inverse.adequacy import Adequacy
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection.ranking import Ranking
    from creepkit.language import Param
    from creepkit.quality.flags import DataQuality

AT_BOUND, WIDER_RATIO = 1e-3, 1e3
"""Of the width of a search: so near to its end a value is held there; and by what a bound of a logarithm is moved."""


NOTEWORTHY_EXPONENT = 0.15
"""Of the stress exponent, by which leaving out one test changes it, from which on this is said."""


def cautions(fit: Identification, ranking: Ranking | None = None, quality: DataQuality | None = None) -> list[str]:
    """What to mind, the most serious first, a sentence each without a full stop."""
    others = [one.fit for one in ranking.laws if one.fit is not fit] if ranking is not None else []
    choice = [*_choice(ranking)]  # whose first sentence stands on the first screen
    tests = [*(one for one in fit.notes if one.startswith(LENGTHS_BY_DEFAULT)), *_of_tests(fit)]
    of_law = [*tests, *_held([fit]), *choice[:1], *_contradictions(fit), *choice[1:], *_precision(fit)]
    return list(dict.fromkeys([*of_law, *(_held(others) if rejected(fit) else ()), *_data(quality)]))


def _of_tests(fit: Identification) -> Iterator[str]:
    """Tests that do not agree with all others, with the error that would make it."""
    found = fit.adequacy.explanations[:1] if fit.adequacy is not None else ()
    yield from (
        cause_caution(one) if one.kind == "one test" else cause_headline(one) for one in found if not one.is_of_law
    )


def _held(fits: Sequence[Identification]) -> Iterator[str]:
    """A law that a bound of the search keeps from the tests, and how to move it; what is physical is no such bound."""
    for one in fits:
        for name, param in one.law.table.items():
            low, high = (param.to_internal(end) for end in param.bounds)
            value = param.to_internal(one.values[name]) if name in one.values else math.nan
            free = [end not in (param.limits or ()) and end not in (0.0, param.off) for end in param.bounds]
            for at_upper, distance in ((False, value - low), (True, high - value)):
                if distance <= AT_BOUND * (high - low) and free[at_upper]:
                    yield _bound_text(one.law.name, name, param, at_upper=at_upper)
                    return


def _bound_text(law: str, name: str, param: Param, *, at_upper: bool) -> str:
    low, high = param.bounds
    bound = high if at_upper else low
    further = WIDER_RATIO if param.scale == "log" else 2.0
    if at_upper:
        high = high * further if high > 0 else high + (high - low)
    else:
        low = low / further if low > 0 else low - (high - low)
    wider = f"bounds = {{ {name} = [{number(low)}, {number(high)}] }}"
    end = "upper" if at_upper else "lower"
    return CAUTIONS["held"].format(law=law, name=name, value=number(bound), end=end, wider=wider)


RUNAWAY = 1.0
"""Strain above what was measured, from which on a law has broken before the test."""


def _contradictions(fit: Identification) -> Iterator[str]:
    """What keeps the law from describing the tests."""
    adequacy = fit.adequacy
    if not fit.converged:
        yield CAUTIONS["not converged"]
    if adequacy is None:
        yield CAUTIONS["unknown"]
        return
    if adequacy.unpredicted:
        yield CAUTIONS["unpredicted"].format(tests=named(adequacy.unpredicted, "test"))
    for k, reason in enumerate(_reasons(fit, adequacy)):
        yield reason if k else CAUTIONS["rejected"].format(reason=reason)
    if adequacy.mentioned is not None:
        yield cause_caution(adequacy.mentioned)
    if adequacy.remedies and not adequacy.explanations:
        yield CAUTIONS["remedy"].format(remedy=adequacy.remedies[0].description)
    yield from (CAUTIONS["implausible"].format(nuisance=nuisance_text(one)) for one in adequacy.implausible[:1])
    if adequacy.verdict == "cannot be judged" and not adequacy.unpredicted:
        yield CAUTIONS["noise unknown"]


def _reasons(fit: Identification, adequacy: Adequacy) -> list[str]:
    """Why the tests reject the law; none where they do not, or where what it misses lies in some of them."""
    if not adequacy.rejects or adequacy.lies_in_tests:
        return []
    found = [REASONS["two exponents"]] * (adequacy.contradicting is not None)
    if adequacy.is_explained:
        found.append(REASONS["cause"].format(cause=cause_headline(adequacy.explanations[0])))
    if adequacy.misses_shape() and adequacy.largest is not None:
        worst = adequacy.largest
        factor, unit = (100.0, "% (absolute)") if is_logarithmic(worst.output) else (1.0, output_unit(worst.output))
        what, amount = worst.output.replace("_", " "), f"{factor * abs(worst.deviation):.2g} {unit}".strip()
        side, at = "large" if worst.deviation > 0 else "small", time_text(worst.time)
        kind = "runs away" if is_logarithmic(worst.output) and worst.deviation > RUNAWAY else "worst"
        found.append(REASONS[kind].format(test=_test(fit, worst.test), what=what, amount=amount, side=side, time=at))
    return found or [REASONS["noise"]]


def _test(fit: Identification, name: str) -> str:
    """A test with its temperature and load."""
    condition = next((one.condition for one in fit.tests if one.name == name), "")
    return f"'{name}'" if not condition or condition in name else f"'{name}' ({condition})"


def _choice(ranking: Ranking | None) -> Iterator[str]:
    """What else the tests allow."""
    if ranking is None or len(ranking.laws) < 2 or ranking.adequacy is None:
        return
    others = [one.fit.law.name for one in ranking.credible[1:]]
    if others:
        yield CAUTIONS["undecided"].format(laws=named(others, "law"))
    same = f"{ranking.best.law.name} above "  # a threshold
    yield from (challenge_text(one).replace(same, "the same law above ") for one in (ranking.challenges or ())[:1])
    if not (others or ranking.challenges or ranking.adequacy.rejects):
        yield from (unmet_text(ranking, name) for name in ("weight", "challenges") if name in ranking.unmet)


def _precision(fit: Identification) -> Iterator[str]:
    """What the tests do not determine, and what intervals leave out."""
    by = "by this law the tests" if rejected(fit) else "the tests"
    for verdict, kind in ((NOT_DETERMINED, "not determined"), (POORLY_DETERMINED, "hardly determined")):
        names = [e.name for e in fit.estimates if e.verdict == verdict]
        if names:
            yield CAUTIONS[kind].format(by=by, names=named(names, "parameter"))
    exponent = float(fit.local_exponent(fit.tested_point.stress, warn=False)[0])
    far = max(fit.left_out, key=lambda one: abs(one.exponent - exponent), default=None)
    if far is not None and not rejected(fit) and abs(far.exponent - exponent) > NOTEWORTHY_EXPONENT * exponent:
        side = "larger" if far.exponent > exponent else "smaller"
        per_cent = f"{100 * abs(far.exponent / exponent - 1):.2g} %"
        yield CAUTIONS["one test"].format(test=_test(fit, far.test), change=per_cent, side=side)
    if change := combined_change_text(fit.unmodelled):
        left_out = beyond_intervals(fit.unmodelled)
        kinds = " and ".join(dict.fromkeys(one.description for one in left_out[:2]))
        alone = max((test_change_text(one) for one in left_out if one.tests > 1), default="")
        each = "each test" * (left_out[0].tests > 1)
        yield say(CAUTIONS["not included"], kinds=kinds, each=each, change=change, alone=alone)


def _data(quality: DataQuality | None) -> Iterator[str]:
    if quality is not None and quality.flags:
        tests = list(dict.fromkeys(name for flag in quality.flags for name in flag.tests))
        yield CAUTIONS["suspect"].format(tests=named(tests, "test"))
