"""What the tests say of a law: whether they reject it, what it leaves, what would explain that, and which law is best.

The engine finds kinds and numbers (inverse.adequacy, inverse.explanation, inverse.selection.ranking); sentences have no
full stop.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from creepkit.inverse.adequacy import UNDETECTED_SCATTER
from creepkit.inverse.evidence import DECISIVE_WEIGHT
from creepkit.inverse.explanation import VERDICT_ODDS
from creepkit.inverse.known_noise import FREEDOM_PER_FRAME, LEAST_NOISE_FREEDOM
from creepkit.inverse.observation_vector import MINIMUM_RATE_OUTPUT, SINGLE_VALUES
from creepkit.records import is_logarithmic, output_unit
from creepkit.records.units import celsius_text, time_text
from creepkit.reports.blocks import first_of
from creepkit.reports.remarks import challenge_text, nuisance_text

if TYPE_CHECKING:
    from creepkit.inverse.adequacy import Adequacy, LargestDeviation
    from creepkit.inverse.explanation import Explanation
    from creepkit.inverse.selection.ranking import Ranking
    from creepkit.inverse.single_values import ContradictingValues

IMPLAUSIBLE_CHI_SQUARE = 0.05
"""Reduced chi-square below which the noise that was stated is questioned: 4.5 times what the frames show."""


NOTEWORTHY_EXPECTATION, NOTEWORTHY_RATIO = 1.05, 1.25
"""Mean reduced chi-square of a right law from which on it is said beside the one that was found; and mean of predicted
over measured beyond which that is what contradicts, rather than a trend."""


SMALLEST_SHOWN_P_VALUE, LARGEST_SHOWN_ODDS = 1e-12, 13.8
"""p-values below, and ln of odds above, are shown as such."""


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


MOST_NAMED, MOST_IN_A_HEADLINE, MOST_WITHOUT_NOISE = 6, 2, 4
"""Tests in a sentence, in a headline, and of those whose noise is not known."""


# ---- numbers ---------------------------------------------------------------------------------------------------------


def p_value_text(p: float) -> str:
    """A probability as "p = 0.028"."""
    if p <= SMALLEST_SHOWN_P_VALUE:
        return f"p < {SMALLEST_SHOWN_P_VALUE:g}"
    return f"p = {p:.{2 if p >= 1e-3 else 1}g}"


def noises_text(noises: float) -> str:
    """Multiples of a noise to two digits, without a power of ten."""
    return f"{float(f'{noises:.2g}'):g}" if np.isfinite(noises) and noises < 1e5 else f"{noises:.2g}"


def odds_text(log_odds: float) -> str:
    """Odds as a factor: "30 times"; log_odds : their ln."""
    more = " or more" if log_odds > LARGEST_SHOWN_ODDS else ""
    return f"{float(f'{np.exp(min(log_odds, LARGEST_SHOWN_ODDS)):.1g}'):,.0f} times{more}"


def _amount(value: float, output: str) -> str:
    """So much of an output, strains in per cent."""
    percent = is_logarithmic(output)
    return f"{(100.0 if percent else 1.0) * value:.2g} {'%' if percent else output_unit(output)}".strip()


# ---- one cause -------------------------------------------------------------------------------------------------------


def cause_headline(one: Explanation) -> str:
    """What the rates of tests show, in a few words."""
    if one.kind == "one test":
        return f"{_tests(one)} {'do' if len(one.tests) > 1 else 'does'} not agree with the others"
    if one.kind == "two groups":
        few = first_of(one.tests, MOST_IN_A_HEADLINE)
        return _stated_groups(one) or f"tests are of two groups: {few} creep {np.exp(one.size):.2g} times as fast"
    low, high = one.ends
    if one.is_of_curves:
        return f"the {one.kind} is {low:.2g} by the shape of the curves and {high:.2g} by the rates of the tests"
    said = f"the {one.kind} {'rises' if high > low else 'falls'} from"
    if one.kind == "stress exponent":
        return f"{said} {low:.2g} at {one.at[0]:.4g} MPa to {high:.2g} at {one.at[1]:.4g} MPa"
    first, last = (celsius_text(T, T) for T in one.at)
    return f"{said} {low / 1e3:.3g} kJ/mol at {first} to {high / 1e3:.3g} kJ/mol at {last}"


def cause_sentence(one: Explanation) -> str:
    """What it is: of tests by how much, and which errors would make it."""
    if one.is_of_law:
        return cause_headline(one) + ", more than this law lets it" * (not one.is_of_curves)
    speed = f"{np.exp(one.size):.3g} times as fast"
    if one.kind == "two groups":
        named = first_of(one.tests, MOST_NAMED)
        if one.label:
            return f"{_stated_groups(one)} at equal conditions ({one.label}: {named})"
        return f"tests ({named}) creep {speed} as the others at equal conditions: are they of one material?"
    texts = [f"{name} = {v:.4g} [{low:.4g}, {high:.4g}]" for name, (v, low, high) in one.without.items()]
    without = f"; without it {', '.join(texts)}" if texts else ""
    if len(one.tests) > 1:
        factors = " and ".join(f"{factor:.3g}" for factor in one.factors)
        return f"{_tests(one)} creep {factors} times as fast as the others say{without}"
    errors = _errors(one)
    cause = f"; it would agree with them {errors}" if errors else ""
    near = f" (or '{one.near[0]}' is to blame)" if one.near else ""
    return f"{_tests(one)} ({one.condition}) creeps {speed} as the others say{near}{cause}{without}"


def cause_caution(one: Explanation) -> str:
    """Of tests their size, as a rate and as what would make it, else that it is no verdict."""
    if one.kind != "one test":
        return f"{cause_headline(one)}: {np.exp(one.odds):.2g} times likelier than scatter, too little for a verdict"
    factors = " and ".join(f"{factor:.2g}" for factor in one.factors or (float(np.exp(one.size)),))
    verb = "creep" if len(one.tests) > 1 else "creeps"
    found = f"{' and '.join(one.tests)} {verb} {factors} times as fast as the others lead to expect"
    return f"{found}; {_kelvin(one)} would do it" if _may_be_temperature(one) else found


def cause_next_step(one: Explanation) -> str:
    """What to do about it where it lies in the tests."""
    if one.label:
        key, _, value = one.label.partition(" ")
        return f'identify each {key} apart (group_by = "{key}" in a study, or --only "{key}={value}")'
    if one.kind == "one test" and one.odds < VERDICT_ODDS:
        return f"check the {'temperature' if _may_be_temperature(one) else 'record'} of {one.tests[0]}"
    if one.kind == "two groups":
        few = first_of(one.tests, MOST_IN_A_HEADLINE)
        return f"look how {few} differ (material, heat, rig), then identify each group apart"
    return f"check {_tests(one)} again (label, unit, thermocouple), then identify without"


def _may_be_temperature(one: Explanation) -> bool:
    """Whether an error of temperature of a usual size would make it."""
    return abs(one.errors.get("temperature", np.inf)) <= LARGEST_KELVIN


def _kelvin(one: Explanation) -> str:
    kelvin = one.errors["temperature"]
    return f"{abs(kelvin):.2g} K {'less' if kelvin < 0 else 'more'} than stated"


def _stated_groups(one: Explanation) -> str:
    """How one group that the tests state creeps beside the other, the faster first; "" of others."""
    if not one.label:
        return ""
    factor, first, other = float(np.exp(one.size)), one.label, one.beside or "the others"
    if factor < 1.0 and one.beside:
        factor, first, other = 1.0 / factor, other, first
    return f"{first} creeps {factor:.2g} times as fast as {other}" + ("" if one.beside else " do")


def _tests(one: Explanation) -> str:
    names = " and ".join(f"'{name}'" for name in one.tests)
    return f"tests {names}" if len(one.tests) > 1 else f"test {names}"


def _errors(one: Explanation) -> str:
    """With which errors of what is stated the test would agree, units first."""
    load, units, others = one.errors.get("load", np.inf), list[str](), list[str]()
    for quantity, known in UNIT_FACTORS.items():
        ratio = one.errors.get(quantity, 0.0)
        factor = max(ratio, 1.0 / ratio) if ratio > 0 else 1.0
        text = f"if its {quantity} were {factor:.3g} times {'smaller' if ratio < 1 else 'larger'}"
        near = [f"{unit:g}" for unit in known if abs(np.log(factor / unit)) < ROUND_TOLERANCE]
        units += [f"{text} (nearly {near[0]}: a unit?)"] if near else []
        others += [text] if factor > LARGEST_LOAD and not near else []
    likely = list[str]()
    if _may_be_temperature(one):
        actual = one.temperature + one.errors["temperature"]
        likely.append(f"at {celsius_text(actual, actual)}, {_kelvin(one)}")
    if 1.0 / LARGEST_LOAD <= load <= LARGEST_LOAD:
        likely.append(f"at a load {abs(100 * (load - 1)):.2g} % {'lower' if load < 1 else 'higher'}")
    return " or ".join([*units, *likely] or others)


# ---- one law ---------------------------------------------------------------------------------------------------------


def adequacy_text(found: Adequacy) -> str:
    """One sentence, to follow "the law": whether the tests reject it, with what is left and where."""
    if found.unpredicted and found.verdict == "cannot be judged":
        named = f"test '{found.unpredicted[0]}'{first_of(found.unpredicted[1:], 0)}"
        return f"cannot be judged: it does not predict every reading of {named}"
    if found.verdict == "cannot be judged":
        return f"cannot be judged: {how_to_state_noise(found.not_judged, found.few_frames)}"
    if found.explains:
        source = " and ".join(dict.fromkeys(o.noise_source for o in found.outputs))
        slow = "; what is left is autocorrelated, noise or the law's own" * bool(np.isfinite(found.correlation))
        scatter = f" (rates of tests scatter by {scatter_text(found.rate_scatter)})" if found.rate_scatter > 0 else ""
        doubt = " (far larger than what the readings show: check its unit)"
        scatter += doubt if found.chi_square < IMPLAUSIBLE_CHI_SQUARE else ""
        said = f"is not rejected by the tests at their {source} noise{qualification(found)}{scatter}"
        return f"{said}: {_chi_square(found)}, {_p_value(found)}{slow}"
    if found.contradicting is not None and not found.outputs:
        return f"is rejected by the tests: {contradiction_text(found.contradicting)}"
    parts = [
        f"{_amount(o.discrepancy, o.output)} of {o.output} ({noises_text(o.discrepancy_in_noises)} times its "
        f"{o.noise_source} noise)"
        for o in sorted(found.outputs, key=lambda o: -o.discrepancy_in_noises)
        if o.discrepancy > 0
    ]
    if (found.scatters_too_much or (found.remedies and not parts)) and not found.explanations:
        parts.append(f"rates of tests that scatter by a factor of {np.exp(found.rate_scatter):.2g}")
    if found.contradicting is not None:
        parts.append(contradiction_text(found.contradicting))
    if found.explanations and not parts:
        curves = f"; curves agree with the noise ({_p_value(found)})" if found.outputs else ""
        return f"is rejected by the rates of the tests: {explanation_text(found)}{curves}"
    where = f". Most in {_largest(found.largest)}" if found.largest is not None else ""
    if found.remedies and not found.explanations:
        effects = " or with ".join(one.description for one in found.remedies)
        where += f". It would explain them with {effects}, which nobody modelled"
    rest = f"leaves {' and '.join(parts) or 'more than noise'} unexplained: {_chi_square(found)}, {_p_value(found)}"
    beside = f"; {'of its rates, ' * (not found.is_explained)}{explanation_text(found)}" if found.explanations else ""
    return f"{rest}{where}{beside}"


def verdict_text(found: Adequacy | None) -> str:
    """The verdict in few words, with the p-value, or what is left in noises; "?" where nothing can be judged."""
    if found is None or found.verdict == "cannot be judged":
        return "?"
    if found.explains:
        large = f", but only with a large {found.implausible[0].kind}" if found.implausible else ""
        return f"not rejected ({p_value_text(found.p_value)}){large}"
    if found.contradicting is not None:
        return "rejected: rates contradict rupture times"
    noises = found.discrepancy_in_noises
    if found.explanations and (found.lies_in_tests or not noises > 0):
        return f"rejected: {cause_headline(found.explanations[0])}"
    return f"rejected: {f'leaves {noises_text(noises)} noises' if noises > 0 else 'rates of tests are not followed'}"


def explanation_text(found: Adequacy) -> str:
    """The likeliest explanation of the rates of tests, those of other tests, and by how much it beats the next."""
    if not found.explanations:
        return ""
    first, *rivals = found.explanations
    if not rivals:
        return cause_sentence(first)
    ahead = first.odds - rivals[0].odds
    said = f"{odds_text(ahead)} less likely" if ahead > np.log(3.0) else "about as likely"
    return f"{cause_sentence(first)}; {said}: {cause_headline(rivals[0])}"


def qualification(found: Adequacy) -> str:
    """What follows "not rejected" where the law takes nuisances of implausible size; "" where it does not."""
    if not found.implausible:
        return ""
    more = len(found.implausible) - 1
    others = f" (and {more} more such nuisance{'s' * (more > 1)})" if more else ""
    return f", but only with {nuisance_text(found.implausible[0])}{others}"


def contradiction_text(found: ContradictingValues) -> str:
    """That minimum rates and rupture times are not of one law of this kind."""
    judged = f"{found.tests} tests that scatter by a factor of {found.scatter:.3g}, {p_value_text(found.p_value)}"
    means = f"{found.rate_ratio:.2g} of minimum rates and {found.time_ratio:.2g} of rupture times"
    product = abs(np.log(found.rate_ratio * found.time_ratio))
    trend = ", and their ratio changes with stress or temperature" * bool(product <= np.log(NOTEWORTHY_RATIO))
    return (
        "minimum creep rates and rupture times contradict one another by this law: predicted over measured is "
        f"{means} in the mean{trend} ({judged})"
    )


def _largest(one: LargestDeviation) -> str:
    rms = f" (rms {_amount(one.rms, one.output)})" if one.rms > 0 else ""
    return (
        f"{one.output} of '{one.test}'{rms} about {time_text(one.time)}, where it lies "
        f"{_amount(abs(one.deviation), one.output)} {'above' if one.deviation > 0 else 'below'} what was measured"
    )


def _chi_square(found: Adequacy) -> str:
    remarks = [f"critical value {found.critical_chi_square:.3g}"] if found.critical_chi_square > 0 else []
    if found.expected_chi_square > NOTEWORTHY_EXPECTATION:
        expected = f"expected {found.expected_chi_square:.3g} for a correct law"
        remarks.append(f"{expected}, as the noise itself is estimated")
    said = f" ({'; '.join(remarks)})" if remarks else ""
    return f"reduced chi-square {found.chi_square:.3g} with {found.freedom:.0f} degrees of freedom{said}"


def _p_value(found: Adequacy) -> str:
    """The p-value; where it is the least of several times their number, how many and that one itself."""
    count = len(found.outputs) + 1
    if count == 2:
        return p_value_text(found.p_value)
    known = not np.isnan(found.smallest_p_value)
    smallest = f"smallest {p_value_text(found.smallest_p_value)}, " if known else ""
    return f"{smallest}{p_value_text(found.p_value)} adjusted for {count} comparisons (Bonferroni)"


def scatter_text(scatter: float) -> str:
    """One standard deviation of ln rate between tests, in per cent; whether an estimate of it found none."""
    return "too little to detect" if 0.0 < scatter <= UNDETECTED_SCATTER else f"{noises_text(100 * scatter)} %"


def how_to_state_noise(outputs: Sequence[str], few_frames: Sequence[tuple[str, int]] = ()) -> str:
    """Why nothing was known of the noise of these outputs, and where to state it.

    few_frames : tests that have too few frames to show it, each with how many.
    """
    frames = [name for name in outputs if name not in SINGLE_VALUES]
    if frames or not outputs:
        named = first_of([f"'{name}' ({count})" for name, count in few_frames], MOST_WITHOUT_NOISE, " tests")
        return (
            f"no noise is stated, and too few readings{f' of {named}' if named else ''} show it: noise that is "
            f"estimated from fewer than {LEAST_NOISE_FREEDOM / FREEDOM_PER_FRAME:.0f} readings of a test cannot judge "
            f"whether a law explains it (state it in a column such as {[*frames, 'strain'][0]}_sd, in Python as "
            "standard_deviation)"
        )
    if MINIMUM_RATE_OUTPUT in outputs:
        return (
            "no noise of the minimum rates is stated, and scatter between tests was estimated from them. State it in a "
            "column such as minimum_rate_sd_1/s, in Python as minimum_rate_sd"
        )
    return "rupture times alone show no noise beside the scatter between tests, which was estimated from them"


# ---- several laws ----------------------------------------------------------------------------------------------------


def unmet_text(ranking: Ranking, condition: str) -> str:
    """Why a condition of a decisive answer is not met."""
    if condition == "adequacy":
        return _of_best(ranking)
    if condition == "challenges" and ranking.challenges is not None:
        return "; and ".join(challenge_text(one) for one in ranking.challenges if one.refutes)
    return {
        "alternatives": f"only {ranking.best.law.name} was fitted",
        "convergence": "the search for its values did not converge",
        "weight": f"its weight is not above {DECISIVE_WEIGHT:g}",
        "asked": "it is none of the laws asked for",
        "challenges": "what else the tests allow was not examined",
    }[condition]


def ranking_verdict(ranking: Ranking) -> str:
    """One sentence: what is known of the law, of how many tried, and what keeps it from being decisive."""
    unmet, best, same = ranking.unmet, ranking.best.law.name, same_functions(ranking)
    if "alternatives" in unmet:
        return f"{unmet_text(ranking, 'alternatives')}; {_of_best(ranking)}"
    same = f"; {same}" if same else ""
    if not unmet:
        allowed = "".join(f"; but {challenge_text(challenge)}" for challenge in ranking.challenges or ())
        return f"decisive: {best}, of {len(ranking.laws)} laws tried; {_of_best(ranking)}{same}{allowed}"
    return f"not decisive: {_reason(ranking)}{same}"


def same_functions(ranking: Ranking) -> str:
    """Which laws the best one stands for, in a clause; "" where none."""
    names = [ranked.fit.law.name for ranked in ranking.laws if ranked.same_as == ranking.best.law.name]
    has = "with its values is" if len(names) == 1 else "with their values are"
    return f"{' and '.join(names)} {has} the same function over the tests" if names else ""


def _of_best(ranking: Ranking) -> str:
    """What the tests say of the best law, in words that begin with "it"."""
    found = ranking.adequacy
    return "whether the tests reject it is not known" if found is None else f"it {adequacy_text(found)}"


def _reason(ranking: Ranking) -> str:
    """Why a ranking of several laws is not decisive."""
    names, best, unmet = [r.fit.law.name for r in ranking.credible], ranking.best.law.name, ranking.unmet
    tried = f"of {len(ranking.laws)} laws tried"
    lost = f"; {unmet_text(ranking, 'convergence')}" if "convergence" in unmet else ""
    adequacy, weight = ranking.adequacy, f"weight {ranking.laws[0].weight:.2f} of the laws tried{lost}"
    named = unmet_text(ranking, "challenges") if "challenges" in unmet and ranking.challenges else ""
    if adequacy is not None and adequacy.rejects:
        if adequacy.lies_in_tests:
            first = cause_headline(adequacy.explanations[0])
            return f"{tried} {best} is best ({weight}), but {first}: {explanation_text(adequacy)}"
        others = "" if len(names) == 1 else f", not told apart from {' and '.join(names[1:])}"
        remedied = [(r.fit.law.name, a.remedies) for r in ranking.laws if (a := r.fit.adequacy) and a.remedies]
        if remedied and not named and not adequacy.remedies:
            law, remedies = remedied[0]
            effects = " or ".join(one.description for one in remedies)
            others += f"; with {effects}, which nobody modelled, {law} would explain them"
        none = f"none {tried} explains the tests{f' as they are stated; {named}' if named else ''}"
        return f"{none}. The best, {best} ({weight}{others}), {adequacy_text(adequacy)}"
    if "asked" in unmet and adequacy is not None and adequacy.explains:
        more = len(ranking.further)
        asked = len(ranking.laws) - more
        found = f"of {more} more that were tried, {best} is not rejected by them ({weight})"
        none = f"none of the {asked} laws asked for explains" if asked > 1 else "the law asked for does not explain"
        return f"{none} the tests; {found}: plan tests that can refute it"
    if len(names) > 1:
        found = f"{f'{named}; ' if named else ''}the best is {best}: {_of_best(ranking)}{lost}"
        return f"{tried} these tests cannot tell apart {' and '.join(names)}; {found}"
    if named and ranking.singled_out and adequacy is not None:
        explains = f"is not rejected by the tests{qualification(adequacy)}"
        return f"{tried} {best} has nearly all the weight ({weight}); it {explains}; but {named}"
    others_unmet = [unmet_text(ranking, one) for one in unmet if one not in ("convergence", "adequacy")]
    return f"{tried} {best} is best ({weight}); {'; '.join([_of_best(ranking), *others_unmet])}"
