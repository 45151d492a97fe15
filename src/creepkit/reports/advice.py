"""What to mind of an identification, the most serious first, and what to do next: a law to try, or a test to make."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.inverse.history_checks import LENGTHS_BY_DEFAULT
from creepkit.inverse.nuisance_parameters import beyond_intervals
from creepkit.inverse.observation_vector import MINIMUM_RATE_OUTPUT, RUPTURE_OUTPUT
from creepkit.inverse.reference_conditions import spans_temperatures
from creepkit.inverse.uncertainty.correlation import LOOSE
from creepkit.inverse.uncertainty.laplace_approximation import NORMAL_QUANTILE
from creepkit.language import temperature
from creepkit.records import SECONDS_PER_HOUR, is_logarithmic, output_unit
from creepkit.records.held_levels import held_temperatures
from creepkit.records.units import celsius_text, time_text
from creepkit.reports.blocks import named, number
from creepkit.reports.description import rejected
from creepkit.reports.verdicts import (
    cause_caution,
    cause_headline,
    cause_next_step,
    challenge_text,
    combined_change_text,
    nuisance_text,
    test_change_text,
    unmet_text,
)
from creepkit.reports.wording import first_kind, say
from creepkit.reports.words import CAUTIONS, NEXT, REASONS, TRY

if TYPE_CHECKING:
    from creepkit.inverse.adequacy import Adequacy
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection.challenges import Challenge
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
    tests = [one for one in fit.notes if one.startswith(LENGTHS_BY_DEFAULT)]
    # of which tests of several temperatures would be groups
    tests += [_temperatures(fit)] if _is_without_temperature(fit) else _of_tests(fit)
    of_law = [*tests, *_held([fit]), *choice[:1], *_contradictions(fit), *choice[1:], *_precision(fit)]
    return list(dict.fromkeys([*of_law, *(_held(others) if rejected(fit) else ()), *_data(quality)]))


def _of_tests(fit: Identification) -> Iterator[str]:
    """Tests that do not agree with all others, with the error that would make it."""
    found = fit.adequacy.explanations[:1] if fit.adequacy is not None else ()
    yield from (
        cause_caution(one) if one.kind == "one test" else cause_headline(one) for one in found if not one.is_of_law
    )


def _is_without_temperature(fit: Identification) -> bool:
    """Whether tests at several temperatures were identified by a law that knows none."""
    return bool(fit.histories) and spans_temperatures(fit.histories) and not fit.law.uses(temperature)


def _temperatures(fit: Identification) -> str:
    low, high = fit.ranges["temperature"]
    return say(CAUTIONS["no temperature"], low=low, high=high)


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
    of = {verdict: [e.name for e in fit.estimates if e.verdict == verdict] for verdict in LOOSE}
    names, others = (named(one, "parameter") * bool(one) for one in of.values())
    if names or others:
        yield say(CAUTIONS["not determined" if names else "hardly determined"], by=by, names=names, others=others)
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


# ---- what to do next -------------------------------------------------------------------------------------------------


def next_step(fit: Identification, ranking: Ranking | None = None, searched: Sequence[str] = ()) -> str:
    """What to do now, in one sentence without a full stop. searched : names of laws that a search of laws tried."""
    adequacy, weak = fit.adequacy, [e.name for e in fit.estimates if e.verdict in LOOSE]
    laws = [fit] if ranking is None else [one.fit for one in ranking.laws]
    in_tests = None if adequacy is None else adequacy.in_tests
    remedies = () if adequacy is None else adequacy.remedies
    unjudged = () if adequacy is None or adequacy.verdict != "cannot be judged" else adequacy.not_judged or ("strain",)
    column = [*(one for one in unjudged if one != RUPTURE_OUTPUT), ""][0]
    law, lacks = (law_to_try(fit, [*(one.law.name for one in laws), *searched]) if rejected(fit) else None) or ("", "")
    rival, challenge = _rivals(ranking)
    is_without = _is_without_temperature(fit)
    kind = first_kind(
        {
            "temperature": is_without,
            "search": not fit.converged and not (adequacy is not None and adequacy.lies_in_tests),
            "check": in_tests,
            "remedy": remedies,
            "law": law,
            "within": rejected(fit) and (searched or (len(laws) > 1 and not are_bars(fit))),
            "laws": rejected(fit) and len(laws) == 1,
            "search laws": rejected(fit),
            "noise": column,
            "separate": rival,
            CHALLENGED[challenge.kind] if challenge else "": challenge,
            "determine": weak,
            "use": True,
        }
    )
    if kind == "check" and in_tests is not None:
        return cause_next_step(in_tests)
    values = _test_values(fit, rival, lowest=kind == "threshold") if kind in TESTS else {}
    kind += " otherwise" * (kind in TESTS and kind != "use" and not values["stress"])
    values |= {"starts": 2 * fit.settings.starts, "names": named(weak, "parameter") * bool(weak)}
    values |= {"remedy": "".join(one.description for one in remedies[:1]), "law": law, "why": TRY.get(lacks, "")}
    second = challenge.subject if challenge else rival.law.name if rival else ""
    column += f"_sd{'_1/s' * (column == MINIMUM_RATE_OUTPUT)}"
    return say(NEXT[kind], column=column, first=fit.law.name, second=second, **values)


TESTS = ("separate", "threshold", "determine", "use")
"""Kinds of NEXT that name a test to make."""


CHALLENGED = {"unmodelled effect": "measure", "sum": "separate otherwise", "threshold": "threshold"}
"""{kind of a challenge: what to do about it}."""


def _rivals(ranking: Ranking | None) -> tuple[Identification | None, Challenge | None]:
    """Of a choice that is not decisive the next credible law, or else what the tests allow beside the best."""
    if ranking is None or len(ranking.laws) < 2 or ranking.decisive:
        return None, None
    others = [one.fit for one in ranking.credible[1:]]
    return (others[0], None) if others else (None, [*(ranking.challenges or ()), None][0])


def law_to_try(fit: Identification, tried: Sequence[str]) -> tuple[str, str] | None:
    """The first law that was not tried of those that have what this one lacks, and why; None where that is not known.

    tried : names of laws that were compared, without their factors of temperature.
    """
    adequacy, kind = fit.adequacy, ""
    known = {fit.law.name, *tried}
    if adequacy is None:
        return None
    if adequacy.is_explained and adequacy.explanations[0].kind == "stress exponent":
        low, high = adequacy.explanations[0].ends
        kind = "" if adequacy.explanations[0].is_of_curves else f"exponent {'rises' if high > low else 'falls'}"
    elif adequacy.misses_shape() and adequacy.largest is not None:
        test = next((one for one in fit.histories if one.name == adequacy.largest.test), None)
        late = test is not None and adequacy.largest.time > LATE * float(test.times[-1])
        kind = "" if test is None or "strain" not in test.outputs else "late" if late else "early"
    stem = fit.law.name.partition("*")[0]
    for law in (one.format(law=stem) for one in LACKING.get(kind, ())):
        if not any(name == law or name.startswith((f"{law}*", f"{law}(", f"{law}[")) for name in known):
            return law, kind
    return None


LATE = 0.5
"""Of the duration of a test, from which on a misfit is that of its end."""


LACKING = {
    "exponent rises": ("hyperbolic-sine", "double-power"),
    "exponent falls": ("threshold-stress",),
    "early": ("{law}*primary", "strain-hardening", "time-hardening", "theta-projection"),
    "late": ("mpc-omega", "kachanov-rabotnov", "sinh-damage", "liu-murakami", "theta-projection"),
}
"""{what a law lacks: laws that have it, the simplest first}."""


def _test_values(fit: Identification, other: Identification | None, *, lowest: bool) -> dict[str, Any]:
    """The test to make by its stress, temperature and duration, see further_test; "" where there is none."""
    found = further_test(fit, other, lowest=lowest)
    if found is None:
        return {"stress": "", "celsius": "", "hours": "", "factor": np.nan}
    stress, T, hours, factor = found
    shown, duration = f"{stress:.2g}" if stress < 100 else f"{stress:.0f}", f"{float(f'{hours:.2g}'):g}"
    return {"stress": shown, "celsius": celsius_text(T, digits=0), "hours": duration, "factor": factor}


def further_test(
    fit: Identification, other: Identification | None, *, lowest: bool = False
) -> tuple[float, float, float, float] | None:
    """The bar under a constant load that tells most: stress, MPa, temperature, K, duration, h, and a factor.

    It is the one whose rate the law knows least (a test there lowers the determinant of the covariance most), or where
    the rates of two laws differ most over what is known of both; the factor is the half width of its 95 % interval, or
    that between the laws. It takes no longer than LONGER times the longest test until the strain of the reference
    point. None of tests other than bars, and where the laws differ by less than SEPARATE standard deviations. lowest :
    it is that of the lowest stress, and of these the shortest.
    """
    if not are_bars(fit):
        return None
    low, high = fit.ranges["stress"]
    kelvin = sorted({-round(T, 1) for one in fit.histories for T in held_temperatures(one)})
    stresses = np.geomspace(BEYOND[0] * low, BEYOND[1] * high, 16)
    stress, T = (one.ravel() for one in np.meshgrid(stresses, np.negative(kelvin)))  # of one stress the shortest first
    rate, *ends = fit.rate(stress, T, warn=False)
    hours = fit.reference.strain / rate / SECONDS_PER_HOUR
    longest = max(float(one.times[-1]) for one in fit.histories) / SECONDS_PER_HOUR
    possible = np.isfinite(hours) & (hours < LONGER * longest) & (hours > longest / SHORTER)
    spread = np.log(ends[1] / ends[0]) / (2 * NORMAL_QUANTILE)
    value, factor = spread, np.exp(NORMAL_QUANTILE * spread)
    if other is not None:
        theirs, *theirs_ends = other.rate(stress, T, warn=False)
        apart = np.abs(np.log(rate / theirs))
        scatter = fit.noise_model.rate**2 + (np.log(theirs_ends[1] / theirs_ends[0]) / (2 * NORMAL_QUANTILE)) ** 2
        value, factor = apart / np.sqrt(spread**2 + scatter + LEAST_SCATTER**2), np.exp(apart)
    value = 1.0 / stress if lowest else value
    value = np.where(possible & np.isfinite(value), value, -1.0)
    k = int(np.argmax(value))
    if value[k] < (0.0 if other is None else SEPARATE):
        return None
    return float(stress[k]), float(T[k]), float(hours[k]), float(factor[k])


def are_bars(fit: Identification) -> bool:
    """Whether all tests are creep curves of bars."""
    return bool(fit.histories) and all(
        "strain" in one.outputs and one.loading.quantity == "stress" for one in fit.histories
    )


BEYOND, LONGER, SHORTER = (0.8, 1.25), 3.0, 100.0
"""Of the stresses tested, and of the longest test: how far a test that is proposed lies beyond."""


SEPARATE, LEAST_SCATTER = 2.0, 0.03
"""Standard deviations by which a test tells laws apart, and of ln rate between tests at the least."""
