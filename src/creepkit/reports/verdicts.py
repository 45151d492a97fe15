"""What the tests say of a law: whether they reject it, what it leaves, what would explain that, and which law is best.

The engine finds kinds and numbers (inverse.adequacy, inverse.explanation, inverse.selection.ranking), and
creepkit.reports.words has the sentences, without a full stop.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.inverse.adequacy import UNDETECTED_SCATTER
from creepkit.inverse.evidence import DECISIVE_WEIGHT
from creepkit.inverse.explanation import VERDICT_ODDS
from creepkit.inverse.known_noise import FREEDOM_PER_FRAME, LEAST_NOISE_FREEDOM
from creepkit.inverse.nuisance_parameters import DRIFT, OFFSET, Perturbation, beyond_intervals
from creepkit.inverse.observation_vector import MINIMUM_RATE_OUTPUT, SINGLE_VALUES
from creepkit.inverse.uncertainty.laplace_approximation import cut_intervals
from creepkit.records import output_unit
from creepkit.reports import words
from creepkit.reports.blocks import first_of
from creepkit.reports.wording import amount_text, first_kind, noises_text, say
from creepkit.reports.words import CHALLENGES, PERTURBATIONS, REMARKS, SIZES

if TYPE_CHECKING:
    from creepkit.inverse.adequacy import Adequacy, LargestDeviation
    from creepkit.inverse.defect_correction import NumericalError
    from creepkit.inverse.explanation import Explanation
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.nuisance_plausibility import ImplausibleNuisance
    from creepkit.inverse.selection.challenges import Challenge, PerturbationSize
    from creepkit.inverse.selection.ranking import Ranking
    from creepkit.inverse.single_values import ContradictingValues


IMPLAUSIBLE_CHI_SQUARE = 0.05
"""Reduced chi-square below which the noise that was stated is questioned: 4.5 times what the frames show."""


NOTEWORTHY_EXPECTATION, NOTEWORTHY_RATIO = 1.05, 1.25
"""Mean reduced chi-square of a right law from which on it is said beside the one that was found; and mean of predicted
over measured beyond which that is what contradicts, rather than a trend."""


LARGEST_KELVIN, LARGEST_LOAD = 40.0, 1.3
"""By which a temperature and a load are mistaken; beyond it is another error."""


UNIT_FACTORS = {
    "strain": (10.0, 100.0, 1000.0, 25.4),
    "load": (6.895, 9.807, 10.0, 1000.0),
    "time": (24.0, 60.0, 3600.0),
}
"""Between units that are taken for one another: percent, per mille and one, inches and mm; ksi, kgf/mm2, bar and GPa
beside MPa; days, hours, minutes and seconds."""


ROUND_TOLERANCE = 0.2
"""Of ln: rates scatter."""


MOST_WITHOUT_NOISE = 4
"""Tests that are named of those whose noise is not known."""


# ---- one cause -------------------------------------------------------------------------------------------------------


def cause_headline(one: Explanation) -> str:
    """What the rates of tests show, in a few words."""
    return say(words.CAUSES[_cause_kind(one)], **_of_cause(one))


def cause_sentence(one: Explanation) -> str:
    """What it is: of tests by how much, and which errors would make it."""
    texts = [f"{name} = {v:.4g} [{low:.4g}, {high:.4g}]" for name, (v, low, high) in one.without.items()]
    known = {"cause": cause_headline(one), "without": ", ".join(texts), "errors": _errors(one)}
    kind = _cause_kind(one)
    return say(
        words.CAUSES_AT_LENGTH.get("changes" if kind == one.kind != "one test" else kind, "{cause}"),
        **known,
        **_of_cause(one),
    )


def cause_caution(one: Explanation) -> str:
    """Of tests their size, as a rate and as what would make it, else that it is no verdict."""
    sizes = " and ".join(f"{factor:.2g}" for factor in one.factors or (np.exp(one.size),))
    kelvin = _kelvin(one) if _may_be_temperature(one) else ""
    text = words.CAUSE_CAUTIONS[_cause_kind(one) if one.kind == "one test" else "others"]
    return say(text, one=one, cause=cause_headline(one), odds=np.exp(one.odds), sizes=sizes, kelvin=kelvin)


def cause_next_step(one: Explanation) -> str:
    """What to do about it where it lies in the tests."""
    key, _, value = one.label.partition(" ")
    kind = _cause_kind(one)
    if one.kind == "one test" and one.odds < VERDICT_ODDS:
        kind = "temperature" if _may_be_temperature(one) else "record"
    return say(words.NEXT[f"check {kind}"], one=one, key=key, value=value)


def _cause_kind(one: Explanation) -> str:
    """Which of words.CAUSES it is."""
    if one.is_of_law:
        return "curves" if one.is_of_curves else one.kind
    if one.kind == "two groups":
        return "stated groups" if one.label else "groups"
    return "tests" if len(one.tests) > 1 else "one test"


def _of_cause(one: Explanation) -> dict[str, Any]:
    """What sentences on it are made of."""
    (low, high), (start, end), factor = one.ends, one.at, float(np.exp(one.size))
    first, other = one.label, one.beside or "the others do"
    if one.beside and factor < 1.0:
        factor, first, other = 1.0 / factor, other, first
    values = {"low": low, "high": high, "start": start, "end": end, "rises": "rises" if high > low else "falls"}
    values |= {"size": abs(one.size), "faster": "faster" if one.size > 0 else "less fast"}
    return {"one": one, **values, "factor": factor, "first": first, "other": other, "near": [*one.near, ""][0]}


def _may_be_temperature(one: Explanation) -> bool:
    """Whether an error of temperature of a usual size would make it."""
    return abs(one.errors.get("temperature", np.inf)) <= LARGEST_KELVIN


def _kelvin(one: Explanation) -> str:
    kelvin = one.errors["temperature"]
    return say(words.ERRORS["kelvin"], kelvin=abs(kelvin), less="less" if kelvin < 0 else "more")


def _errors(one: Explanation) -> str:
    """With which errors of what is stated the test would agree, units first."""
    load, units, others, likely = one.errors.get("load", np.inf), list[str](), list[str](), list[str]()
    for quantity, known in UNIT_FACTORS.items():
        ratio = one.errors.get(quantity, 0.0)
        factor = max(ratio, 1.0 / ratio) if ratio > 0 else 1.0
        unit = next((unit for unit in known if abs(np.log(factor / unit)) < ROUND_TOLERANCE), 0.0)
        smaller = "smaller" if ratio < 1 else "larger"
        if unit or factor > LARGEST_LOAD:
            text = say(words.ERRORS["factor"], quantity=quantity, factor=factor, smaller=smaller, unit=unit)
            (units if unit else others).append(text)
    if _may_be_temperature(one):
        actual = one.temperature + one.errors["temperature"]
        likely.append(say(words.ERRORS["temperature"], actual=actual, kelvin=_kelvin(one)))
    if 1.0 / LARGEST_LOAD <= load <= LARGEST_LOAD:
        likely.append(say(words.ERRORS["load"], change=abs(load - 1), lower="lower" if load < 1 else "higher"))
    return " or ".join([*units, *likely] or others)


# ---- one law ---------------------------------------------------------------------------------------------------------


def adequacy_text(found: Adequacy) -> str:
    """One sentence, to follow "the law": whether the tests reject it, with what is left and where."""
    parts, p, contradicting = _parts(found), _p_value(found), found.contradicting
    kind, cause = _verdict_kind(found, parts), explanation_text(found)
    if cause and kind == "leaves" and not found.is_explained:
        cause = say(words.OF_VERDICTS["rates"], cause=cause)
    return say(
        words.VERDICTS[kind],
        found=found,
        why=how_to_state_noise(found.not_judged, found.few_frames),
        sources=[*dict.fromkeys(one.noise_source for one in found.outputs)],
        qualified=qualification(found),
        scatter=scatter_text(found.rate_scatter) if found.rate_scatter > 0 else "",
        doubt=words.OF_VERDICTS["doubt"] * (found.chi_square < IMPLAUSIBLE_CHI_SQUARE),
        slow=words.OF_VERDICTS["slow"] * bool(np.isfinite(found.correlation)),
        chi_square=_chi_square(found),
        p=p,
        curves=p * bool(found.outputs),
        contradiction="" if contradicting is None else contradiction_text(contradicting),
        parts=" and ".join(parts) or words.OF_VERDICTS["noise"],
        largest="" if found.largest is None else _largest(found.largest),
        remedies=() if found.explanations else [one.description for one in found.remedies],
        cause=cause,
    )


def _verdict_kind(found: Adequacy, parts: Sequence[str]) -> str:
    """Which of words.VERDICTS is said of a law; parts : what it leaves."""
    if found.verdict == "cannot be judged":
        return "unpredicted" if found.unpredicted else "not judged"
    if found.explains:
        return "explains"
    if found.contradicting is not None and not found.outputs:
        return "values"
    return "rates" if found.explanations and not parts else "leaves"


def _parts(found: Adequacy) -> list[str]:
    """What a law leaves unexplained, the largest in noises first."""
    left = sorted((o for o in found.outputs if o.discrepancy > 0), key=lambda o: -o.discrepancy_in_noises)
    parts = [say(words.OF_VERDICTS["part"], one=o, amount=amount_text(o.discrepancy, o.output)) for o in left]
    if (found.scatters_too_much or (found.remedies and not parts)) and not found.explanations:
        parts.append(say(words.OF_VERDICTS["scatter"], factor=np.exp(found.rate_scatter)))
    return [*parts, *([] if found.contradicting is None else [contradiction_text(found.contradicting)])]


def verdict_text(found: Adequacy | None) -> str:
    """The verdict in few words, with the p-value, or what is left in noises; "?" where nothing can be judged."""
    if found is None or found.verdict == "cannot be judged":
        return "?"
    kind = first_kind(
        {
            "explains": found.explains,
            "values": found.contradicting is not None,
            "cause": found.explanations and (found.lies_in_tests or not found.discrepancy_in_noises > 0),
            "leaves": found.discrepancy_in_noises > 0,
            "rates": True,
        }
    )
    nuisance = "".join(one.kind for one in found.implausible[:1])
    return say(words.SHORT_VERDICTS[kind], found=found, cause=_cause(found), nuisance=nuisance)


def _cause(found: Adequacy) -> str:
    return "".join(map(cause_headline, found.explanations[:1]))


def explanation_text(found: Adequacy) -> str:
    """The likeliest explanation of the rates of tests, those of other tests, and by how much it beats the next."""
    if len(found.explanations) < 2:
        return "".join(map(cause_sentence, found.explanations))
    first, second = found.explanations[:2]
    kind = "beside" if first.odds - second.odds > np.log(3.0) else "as likely"
    known = {"cause": cause_sentence(first), "other": cause_headline(second)}
    return say(words.CAUSES_AT_LENGTH[kind], odds=first.odds - second.odds, **known)


def qualification(found: Adequacy) -> str:
    """What follows "not rejected" where the law takes nuisances of implausible size; "" where it does not."""
    nuisances = [*map(nuisance_text, found.implausible)]
    return say(words.OF_VERDICTS["qualified"], nuisance=nuisances[0], more=len(nuisances) - 1) if nuisances else ""


def contradiction_text(found: ContradictingValues) -> str:
    """That minimum rates and rupture times are not of one law of this kind."""
    product = abs(np.log(found.rate_ratio * found.time_ratio))
    trend = words.OF_VERDICTS["trend"] * bool(product <= np.log(NOTEWORTHY_RATIO))
    return say(words.OF_VERDICTS["contradiction"], one=found, trend=trend)


def _largest(one: LargestDeviation) -> str:
    rms = amount_text(one.rms, one.output) if one.rms > 0 else ""
    amount, above = amount_text(abs(one.deviation), one.output), "above" if one.deviation > 0 else "below"
    return say(words.OF_VERDICTS["largest"], one=one, rms=rms, amount=amount, above=above)


def _chi_square(found: Adequacy) -> str:
    expected = found.expected_chi_square if found.expected_chi_square > NOTEWORTHY_EXPECTATION else 0.0
    return say(words.OF_VERDICTS["chi-square"], found=found, expected=expected)


def _p_value(found: Adequacy) -> str:
    """The p-value; where it is the least of several times their number, how many and that one itself."""
    p, count = say("{found.p_value:p}", found=found), len(found.outputs) + 1
    return p if count == 2 else say(words.OF_VERDICTS["adjusted"], found=found, p=p, count=count)


def scatter_text(scatter: float) -> str:
    """One standard deviation of ln rate between tests, in per cent; whether an estimate of it found none."""
    return "too little to detect" if 0.0 < scatter <= UNDETECTED_SCATTER else f"{noises_text(100 * scatter)} %"


def how_to_state_noise(outputs: Sequence[str], few_frames: Sequence[tuple[str, int]] = ()) -> str:
    """Why nothing was known of the noise of these outputs, and where to state it.

    few_frames : tests that have too few frames to show it, each with how many.
    """
    frames = [name for name in outputs if name not in SINGLE_VALUES]
    tests = first_of([f"'{name}' ({count})" for name, count in few_frames], MOST_WITHOUT_NOISE, " tests")
    kind = "frames" if frames or not outputs else "rates" if MINIMUM_RATE_OUTPUT in outputs else "ruptures"
    fewest = LEAST_NOISE_FREEDOM / FREEDOM_PER_FRAME
    return say(words.NOISE_UNKNOWN[kind], tests=tests, fewest=fewest, column=[*frames, "strain"][0])


# ---- several laws ----------------------------------------------------------------------------------------------------


def unmet_text(ranking: Ranking, condition: str) -> str:
    """Why a condition of a decisive answer is not met."""
    if condition == "adequacy":
        return _of_best(ranking)
    if condition == "challenges" and ranking.challenges is not None:
        return "; and ".join(_refuted(ranking))
    return say(words.UNMET[condition], best=ranking.best.law.name, decisive=DECISIVE_WEIGHT)


def _refuted(ranking: Ranking) -> list[str]:
    return [challenge_text(one) for one in ranking.challenges or () if one.refutes]


def ranking_verdict(ranking: Ranking) -> str:
    """One sentence: what is known of the law, of how many tried, and what keeps it from being decisive."""
    unmet, kind = ranking.unmet, "not decisive" if ranking.unmet else "decisive"
    kind = "alone" if "alternatives" in unmet else kind
    return say(
        words.CHOICES[kind],
        **{"best": ranking.best.law.name, "count": len(ranking.laws), "verdict": _of_best(ranking)},
        alone=unmet_text(ranking, "alternatives"),
        reason=_reason(ranking) if kind == "not decisive" else "",
        same=same_functions(ranking),
        allowed=[*map(challenge_text, ranking.challenges or ())],
    )


def same_functions(ranking: Ranking) -> str:
    """Which laws the best one stands for, in a clause; "" where none."""
    names = [ranked.fit.law.name for ranked in ranking.laws if ranked.same_as == ranking.best.law.name]
    return say(words.CHOICES["same" if len(names) == 1 else "several same"], names=names) if names else ""


def _of_best(ranking: Ranking) -> str:
    """What the tests say of the best law, in words that begin with "it"."""
    found = ranking.adequacy
    return words.CAUTIONS["unknown"] if found is None else f"it {adequacy_text(found)}"


def _reason(ranking: Ranking) -> str:
    """Why a ranking of several laws is not decisive."""
    names, adequacy, unmet = [r.fit.law.name for r in ranking.credible], ranking.adequacy, ranking.unmet
    refuted, own = _refuted(ranking) if "challenges" in unmet else [], () if adequacy is None else adequacy.remedies
    kind = first_kind(
        {
            "in tests": adequacy is not None and adequacy.rejects and adequacy.lies_in_tests,
            "none": adequacy is not None and adequacy.rejects,
            "asked": "asked" in unmet and adequacy is not None and adequacy.explains,
            "apart": len(names) > 1,
            "challenged": refuted and ranking.singled_out,
            "best": True,
        }
    )
    found = {
        r.fit.law.name: [o.description for o in a.remedies]
        for r in ranking.laws
        if (a := r.fit.adequacy) and a.remedies and not (kind == "asked" and r.fit.law.name in ranking.further)
    }
    remedied = "" if kind == "none" and (own or refuted) else next(iter(found), "")
    asked, lost = len(ranking.laws) - len(ranking.further), words.UNMET["convergence"] * ("convergence" in unmet)
    others = [unmet_text(ranking, one) for one in unmet if one not in ("convergence", "adequacy")]
    texts = {"explanation": explanation_text, "qualified": qualification, "cause": _cause}
    of_adequacy = {name: "" if adequacy is None else text(adequacy) for name, text in texts.items()}
    return say(
        words.CHOICES[kind],
        **{"best": ranking.best.law.name, "count": len(ranking.laws), "verdict": _of_best(ranking), "lost": lost},
        weight=say(words.CHOICES["weight"], weight=ranking.laws[0].weight, lost=lost),
        **{"refuted": refuted, "unmet": "; ".join(others), "names": names, "others": names[1:]},
        **{"remedied": remedied, "remedies": found.get(remedied, ()), "further": len(ranking.further)},
        **of_adequacy,
        none=say(words.CHOICES["none asked" if asked > 1 else "one asked"], asked=asked),
    )


NOTEWORTHY_CHANGE = 0.01
"""Of the rate, from which on a perturbation is named."""


LARGEST_PER_CENT = 0.4
"""Of ln rate, from which on its change is given as a factor."""


SMALLEST_SHOWN = 0.05
"""Difference of two chi-squares below which they are shown as the same."""


def remarks(fit: Identification, *, perturbations: bool = True) -> tuple[str, ...]:
    """All of an identification; perturbations : whether also of what its intervals do not include."""
    return (*fit.notes, *_of_numbers(fit), *(_not_included(fit.unmodelled) if perturbations else ()))


def _of_numbers(fit: Identification) -> Iterator[str]:
    if fit.provenance.get("search_ends") == 1:
        yield REMARKS["one search"]
    for one in fit.adequacy.implausible if fit.adequacy is not None else ():
        yield nuisance_text(one, "implausible")
    for name, bound in cut_intervals(fit.law, fit.estimates).items():
        yield say(REMARKS["cut"], name=name, bound=bound)
    if fit.numerical_error is not None:
        yield numerical_error_text(fit.numerical_error)


def numerical_error_text(found: NumericalError) -> str:
    """What the predictor was wrong by, and what it would have done to the values."""
    sizes = ", ".join(f"{_amount(size, output_unit(name))} in {name}" for name, size in found.size.items())
    return say(REMARKS["numerical"], one=found, sizes=sizes, unsettled="" if found.settled else REMARKS["unsettled"])


# ---- nuisances -------------------------------------------------------------------------------------------------------


def nuisance_text(one: ImplausibleNuisance, kind: str = "nuisance") -> str:
    """Such as "an offset of 0.095 mm in amplitude of 'D1', 24 % of its largest value"; kind : of REMARKS."""
    share = say(REMARKS["of value" if one.output else "of length"], one=one) if np.isfinite(one.share) else ""
    size, expected = _amount(one.size, one.unit), say(REMARKS[one.size_source], one=one)
    return say(REMARKS[kind], share=share, expected=expected, size=size, **nuisance_values(one))


def nuisance_values(one: ImplausibleNuisance) -> dict[str, Any]:
    """What texts on it are made of."""
    return {"one": one, "article": "an" if one.kind[0] in "aeiou" else "a", "amount": _amount(one.value, one.unit)}


def _amount(value: float, unit: str) -> str:
    return f"{value:.2g} {unit}".strip()


# ---- perturbations ---------------------------------------------------------------------------------------------------


def change_text(change: float) -> str:
    """Of ln of the rate: in per cent, a large one as a factor."""
    return f"a factor of {np.exp(change):.2g}" if change >= LARGEST_PER_CENT else f"{100 * change:.2g} %"


def combined_change_text(perturbations: Sequence[Perturbation]) -> str:
    """The root sum of squares of the changes of the rate by those that are not included; "" where there are none."""
    changes = [one.rate_change for one in beyond_intervals(perturbations)]
    return change_text(float(np.linalg.norm(changes))) if changes else ""


def test_change_text(one: Perturbation) -> str:
    """By how much a drift changes the rate of a test at its end; "" of all else."""
    return change_text(abs(one.per_kelvin) * one.size) if np.isfinite(one.per_kelvin) else ""


def perturbation_text(one: Perturbation) -> str:
    """By how much the rate amid the tests would move with what, to follow "would move"."""
    several, kind = one.tests > 1, "drift" if one.kind == DRIFT else "error"
    error = "offset" if one.kind.startswith(OFFSET) else "error"
    cause = say(PERTURBATIONS[kind + "s" * several], one=one, error=error, what=_read(one.kind))
    known = {"whence": "assumed" if one.assumed else "by the law", "deviation": " (one standard deviation)" * several}
    energy = np.expm1(one.per_kelvin)
    return say(PERTURBATIONS["moves"], change=change_text(one.rate_change), cause=cause, energy=energy, **known)


def _not_included(perturbations: Sequence[Perturbation]) -> tuple[str, ...]:
    """On what intervals do not include, with what it would do to the rate; none where that is little."""
    told = [perturbation_text(p) for p in beyond_intervals(perturbations) if p.rate_change > NOTEWORTHY_CHANGE]
    return (PERTURBATIONS["not included"].format(effects="; ".join(told)),) if told else ()


def _read(kind: str) -> str:
    return kind.removeprefix(OFFSET).replace("_", " ") if kind.startswith(OFFSET) else kind


# ---- challenges ------------------------------------------------------------------------------------------------------


def challenge_text(one: Challenge) -> str:
    """What the tests allow beside the best law, to follow "but"."""
    if one.kind == "unmodelled effect":
        own, weight = one.weights or (np.nan, np.nan)
        usual, sizes = one.sizes[0], [*map(_size_text, one.sizes)]
        effect = Perturbation(usual.kind, usual.size, usual.unit).description
        kind = "remedy" if one.laws else "effect"
        return say(CHALLENGES[kind], one=one, sizes=sizes, effect=effect, own=own, weight=weight)
    if one.excess is None:
        return say(
            CHALLENGES["unknown"], altered=say(CHALLENGES["unknown sum"], one=one) if one.kind == "sum" else one.subject
        )
    is_same = abs(one.excess) < SMALLEST_SHOWN
    kind = "better" if one.fits_better else "higher" if one.excess > 0 and not is_same else "lower"
    side, difference = ("the same", np.nan) if is_same else ("higher" if one.excess > 0 else "lower", abs(one.excess))
    return say(CHALLENGES[kind], altered=say(CHALLENGES[one.kind], one=one), difference=difference, side=side)


def _size_text(one: PerturbationSize) -> str:
    """A perturbation with the size at which a law explains the tests."""
    each = f"each of the {one.tests} tests" * (one.tests > 1)
    kind = "length" if one.unit == "%" else "drift" if one.kind == DRIFT else "offset"
    amount = f"{abs(one.size) if one.differs else one.size:{'' if one.differs else '+'}.2g} {one.unit}".strip()
    of = {"what": _read(one.kind), "each": each, "where": each or "the test", "amount": amount}
    smaller = "smaller" if one.size < 0 else "larger"
    return say(SIZES[kind + "s" * one.differs], size=abs(one.size), smaller=smaller, **of)
