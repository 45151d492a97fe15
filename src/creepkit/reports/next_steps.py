"""What to do after an identification: the law to try, or the test to make with its stress, temperature and duration."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from creepkit.inverse.observation_vector import MINIMUM_RATE_OUTPUT, RUPTURE_OUTPUT
from creepkit.inverse.uncertainty.laplace_approximation import NORMAL_QUANTILE, NOT_DETERMINED, POORLY_DETERMINED
from creepkit.records import SECONDS_PER_HOUR
from creepkit.records.held_levels import held_temperatures
from creepkit.records.units import celsius_text
from creepkit.reports.blocks import named
from creepkit.reports.description import rejected
from creepkit.reports.verdicts import cause_next_step
from creepkit.reports.wording import say
from creepkit.reports.words import NEXT, TRY

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection.ranking import Ranking


def next_step(fit: Identification, ranking: Ranking | None = None, searched: Sequence[str] = ()) -> str:
    """What to do now, in one sentence without a full stop. searched : names of laws that a search of laws tried."""
    adequacy, weak = fit.adequacy, [e.name for e in fit.estimates if e.verdict in (NOT_DETERMINED, POORLY_DETERMINED)]
    names, laws = named(weak, "parameter"), [] if ranking is None else [r.fit for r in ranking.laws]
    in_tests = None if adequacy is None else adequacy.in_tests
    if not fit.converged and not (adequacy is not None and adequacy.lies_in_tests):
        return say(NEXT["search"], starts=2 * fit.settings.starts, names=names * bool(weak))
    if in_tests is not None:
        return cause_next_step(in_tests)
    if adequacy is not None and adequacy.remedies:
        return NEXT["remedy"].format(remedy=adequacy.remedies[0].description)
    if rejected(fit):
        if further := law_to_try(fit, [*(one.law.name for one in laws), *searched]):
            return NEXT["law"].format(law=further[0], why=TRY[further[1]])
        kind = "laws" if len(laws) < 2 else "search laws" if are_bars(fit) else "within"
        return NEXT["within" if searched else kind]
    if adequacy is not None and adequacy.verdict == "cannot be judged" and adequacy.not_judged != (RUPTURE_OUTPUT,):
        stated = [one for one in adequacy.not_judged if one != RUPTURE_OUTPUT] or ["strain"]
        unit = "_1/s" if stated[0] == MINIMUM_RATE_OUTPUT else ""
        return NEXT["noise"].format(column=f"{stated[0]}_sd{unit}")
    if ranking is not None and len(laws) > 1 and not ranking.decisive:
        if len(ranking.credible) > 1:
            return _test_text("separate", fit, ranking.credible[1].fit)
        if ranking.challenges:
            first = ranking.challenges[0]
            if first.kind == "threshold":
                return _test_text("threshold", fit)
            kinds = {"unmodelled effect": "measure", "sum": "separate otherwise"}
            return NEXT[kinds[first.kind]].format(first=fit.law.name, second=first.subject, effect=first.subject)
    if weak:
        return _test_text("determine", fit, names=names)
    return "; ".join([NEXT["use"], *([_test_text("narrow", fit)] if further_test(fit, None) else [])])


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


def _test_text(kind: str, fit: Identification, other: Identification | None = None, names: str = "") -> str:
    """The test to make, by its stress, temperature and duration; in general where none of the kind is found."""
    found = further_test(fit, other, lowest=kind == "threshold")
    values: dict[str, str] = {"names": names, "first": fit.law.name, "second": other.law.name if other else ""}
    if found is not None:
        stress, T, hours, factor = found
        values |= {
            "stress": f"{stress:.2g}" if stress < 100 else f"{stress:.0f}",
            "hours": f"{float(f'{hours:.2g}'):g}",
        }
        values |= {"celsius": celsius_text(T, digits=0), "factor": f"{factor:.2g}"}
    return NEXT[kind if found else f"{kind} otherwise"].format(**values)


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
