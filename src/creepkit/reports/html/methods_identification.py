"""What was done to identify laws, in sentences for a paper: each only where the records say that it was done."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from creepkit.inverse.adequacy import UNDETECTED_SCATTER
from creepkit.inverse.information_criteria import CREDIBLE_WEIGHT, DECISIVE_WEIGHT
from creepkit.inverse.noise_model import MINIMUM_TESTS
from creepkit.inverse.nuisance_plausibility import nuisance_unit
from creepkit.inverse.variance_components import NOISE_PRIOR_SD
from creepkit.language.printing import expression_text, state_equations
from creepkit.records import kind_and_start, output_unit
from creepkit.reports.html.citations import References, listed
from creepkit.reports.html.compared_values import compared_values, frame_counts
from creepkit.reports.html.elements import number, plural, printable
from creepkit.reports.html.law_names import title_in_sentence

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection.ranking import Ranking
    from creepkit.language import CreepLaw
    from creepkit.reports.contents import ReportContents
    from creepkit.reports.html.findings import GroupFindings

MOST_NAMED = 6
"""Materials that a sentence names; of more it says how many."""


def identification_methods(
    contents: ReportContents, found: Sequence[GroupFindings], references: References
) -> list[list[str]]:
    """Paragraphs on tests and laws, on estimation, and on ranking and adequacy; none where nothing was identified."""
    if not found:
        return []
    tests = [*_tests(found), *_by_material(found, _loading), *_laws(found, references)]
    estimation = _by_material(found, lambda one: _estimation(one, contents, references))
    ranking = _by_material(
        [one for one in found if one.ranking is not None],
        lambda one: [] if one.ranking is None else _ranking(one.ranking, one.fit, references),
    )
    return [tests, estimation, [*ranking, *_adequacy(found)]]


def _by_material(found: Sequence[GroupFindings], sentences_of: Any) -> list[str]:
    """The sentences on each material: once where all have the same, else after the names of their materials."""
    names: dict[tuple[str, ...], list[str]] = {}
    for one in found:
        names.setdefault(tuple(text for text in sentences_of(one) if text), []).append(printable(one.name, 80))
    if len(names) == 1:
        return [*next(iter(names))]
    return [
        " ".join([f"Of {listed(who) if len(who) <= MOST_NAMED else plural(len(who), 'material')}:", *sentences])
        for sentences, who in names.items()
        if sentences
    ]


# ---- tests and laws --------------------------------------------------------------------------------------------------


def _tests(found: Sequence[GroupFindings]) -> list[str]:
    """How many tests, frames and values, and in what quantity values are compared."""
    tests = sum(len(one.fit.tests) for one in found)
    materials = f" of {plural(len(found), 'material')}" if len(found) > 1 else ""
    compared = [compared_values(one.fit) for one in found]
    known = [one for one in compared if one is not None]
    if len(known) < len(found):
        return [f"Creep laws were identified from {plural(tests, 'test')}{materials}."]
    counts = [frame_counts(one.fit.histories, one.fit.settings.frames) for one in found]
    measured, fitted = sum(c.measured for c in counts), sum(c.fitted for c in counts)
    values = plural(sum(one.count for one in known), "value")
    if measured:
        frames = f"{fitted} of {plural(measured, 'reading')} were fitted, which makes {values} compared"
    else:
        frames = f"{values} were compared"
    transforms = {one.transforms for one in known}
    if len(transforms) == 1:
        how = f"Compared were {listed([*transforms.pop()])}."
    else:
        how = (
            "Strains ε were compared as arsinh(ε / 2f), which is ln(ε / f) well above the floor f, 1 % of the median "
            "final strain of a material and at least three times the noise of a reading; lengths linearly, divided by "
            "their standard deviation."
        )
    return [f"Creep laws were identified from {plural(tests, 'test')}{materials}: {frames}.", how]


def _loading(found: GroupFindings) -> list[str]:
    """What was held in uniaxial tests, and what their strains are."""
    uniaxial = [h for h in found.fit.histories if "strain" in h.outputs]
    sentences = []
    controls = {str(getattr(h.loading, "control", "")) for h in found.fit.histories} - {""}
    if len(controls) == 1:
        sentences.append(
            "Loads were held, so that the true stress grows with strain."
            if controls == {"load"}
            else "The true stress was held."
        )
    elif controls:
        sentences.append("In some tests loads were held, in others the true stress.")
    measures, elastic = {h.strain_measure for h in uniaxial}, {h.includes_elastic for h in uniaxial}
    if len(measures) == 1 and len(elastic) == 1:
        contains = "contain" if elastic == {True} else "do not contain"
        sentences.append(f"Strains are {measures.pop()} and {contains} the elastic strain on loading.")
    return sentences


def _laws(found: Sequence[GroupFindings], references: References) -> list[str]:
    """The laws by their titles and formulas, with what they cite."""
    laws = {one.law.name: one.law for group in found for one in group.fits}
    named = [f"{_formula(law)}{references.cite(*law.references)}" for law in laws.values()]
    if len(named) == 1:
        return [f"The law was the {named[0]}."]
    tried = "; ".join(named)
    letters = "ε̇ is the creep rate in 1/s, σ the stress in MPa, ε the strain, t the time in s, T the temperature in K"
    return [f"The laws tried were: {tried}. In them {letters}."]


def _formula(law: CreepLaw) -> str:
    rate = " + ".join(expression_text(term) for term in law.terms.values())
    states = "".join(f", {equation}" for equation in state_equations(law))
    equation = f"ε̇ = {rate}{states}".replace("**", "^")
    for word, letter in (("stress", "σ"), ("strain", "ε"), ("time", "t"), ("temperature", "T")):
        equation = equation.replace(word, letter)
    return f"{title_in_sentence(law)}, {printable(equation, 400)}"


# ---- estimation ------------------------------------------------------------------------------------------------------


def _estimation(found: GroupFindings, contents: ReportContents, references: References) -> list[str]:
    fit = found.fit
    settings = fit.settings
    specimen = str(fit.provenance.get("specimen", "")).strip()
    sentences = [
        f"The tests were predicted by the model of the specimen '{printable(specimen, 80)}'." if specimen else "",
        _search(fit, contents, references),
        _bounds(found),
        *_weights(fit, references),
        rate_scatter_sentence(fit),
        _explicit_nuisances(fit),
        _noise_priors(fit),
        _penalty(found),
    ]
    if settings.loss != "linear":
        sentences.append(f"Readings far off have less weight by the loss '{settings.loss}'.")
    if settings.test_loss == "student":
        sentences.append(
            f"Tests far from the others have less weight by Student's distribution{references.cite('student')}."
        )
    if fit.numerical_error is not None:
        sentences.append(
            "The numerical error of the predictions was corrected at the optimum (defect correction), and a tenth of "
            "it stays in the covariance."
        )
    return sentences


def _search(fit: Identification, contents: ReportContents, references: References) -> str:
    """How the optimum was sought, where that is known."""
    settings, how = fit.settings, _search_name(fit, contents)
    end = f", and refined by least squares with the Levenberg-Marquardt method{references.cite('levenberg')}."
    seed = f" (seed {settings.seed})"
    if how.startswith("multi-start"):
        return (
            f"Parameters were sought within their bounds from {plural(settings.starts, 'start')}, picked out of at "
            f"most {settings.sobol_points} points of a Sobol' sequence{references.cite('sobol')}{seed}{end}"
        )
    if "swarm" in how:
        return f"Parameters were sought within their bounds by a particle swarm{references.cite('swarm')}{seed}{end}"
    if how.startswith("cma-es"):
        return f"Parameters were sought within their bounds by CMA-ES{references.cite('cma-es')}{seed}{end}"
    return f"Parameters were sought within their bounds{end}"


def _bounds(found: GroupFindings) -> str:
    """Between which values each law's parameters were sought."""
    laws = {one.law.name: one.law for one in found.fits}
    parts = []
    for law in laws.values():
        ranges = [
            f"{name} {number(p.bounds[0], 3)} to {number(p.bounds[1], 3)}{'' if p.unit == '1' else f' {p.unit}'}"
            for name, p in law.table.items()
            if name in {e.name for one in found.fits if one.law.name == law.name for e in one.estimates}
        ]
        named = f"of the {title_in_sentence(law)} " if len(laws) > 1 else ""
        parts.append(f"{named}{listed(ranges)}")
    return f"The bounds of the search were {'; '.join(parts)}."


def _noise_priors(fit: Identification) -> str:
    """The prior about noise that the tests state, where there is some."""
    stated = [
        f"{name.replace('_', ' ')} {number(one.stated, 3)}{f' {unit}' if (unit := output_unit(name)) else ''}"
        for name, one in fit.noise_model.outputs.items()
        if one.stated > 0
    ]
    if not stated:
        return ""
    return (
        f"The noise of a reading has a log-normal prior about the noise that the tests state ({listed(stated)}), with "
        f"a standard deviation of {number(NOISE_PRIOR_SD, 2)} of its logarithm."
    )


def _search_name(fit: Identification, contents: ReportContents) -> str:
    """Of the search, as the identification or the study states it; "" where that is not known."""
    stated: Any = fit.search_trace.search if fit.search_trace is not None else fit.provenance.get("search", "")
    part = contents.provenance.settings.get("identification")
    if not stated and isinstance(part, Mapping):
        stated = part.get("search", "")
    return str(stated).lower()


def _weights(fit: Identification, references: References) -> list[str]:
    settings = fit.settings
    offsets = any(n.kind == "offset" for n in settings.nuisances)
    estimated = [
        *(["offsets of tests"] if offsets else []),
        *(["the scatter of rates"] if _rate_estimated(fit) else []),
    ]
    if settings.weights == "likelihood":
        parts = listed(["white noise", "autocorrelated noise", *estimated])
        return [
            f"The {parts} were estimated by restricted maximum likelihood{references.cite('reml')}; 95 % intervals "
            "follow from the whole covariance with Satterthwaite's degrees of freedom"
            f"{references.cite('satterthwaite')}. Beforehand parameters have weak Gaussian priors, with the variance "
            "of a uniform distribution between their bounds."
        ]
    if settings.weights == "noise":
        parts = listed(["noise", *estimated, "what the law cannot follow"])
        return [
            f"Readings have equal weights; {parts} were estimated as variance components, and 95 % intervals are those "
            f"of a sandwich covariance{references.cite('sandwich')} with Student's quantiles."
        ]
    if settings.weights == "equal":
        return ["The sum of the relative squared errors of the outputs was minimised, each output with equal weight."]
    if settings.weights == "paper":
        chen = references.cite("chen")
        return [f"The sum of the relative squared errors was minimised with 0.99 of the weight on the amplitude{chen}."]
    weights = ", ".join(f"{name.replace('_', ' ')} {number(value, 3)}" for name, value in settings.weights.items())
    return [f"The sum of the relative squared errors of the outputs was minimised, with the weights {weights}."]


def _rate_estimated(fit: Identification) -> bool:
    """Whether the scatter of rates between tests was estimated from them."""
    rates = [n for n in fit.settings.nuisances if n.kind == "rate" and not n.is_simulated]
    return bool(rates) and rates[0].sd is None and len(fit.tests) >= MINIMUM_TESTS


def rate_scatter_sentence(fit: Identification) -> str:
    """How much the creep rates of single tests scatter, and whether that was estimated, given, assumed or left out."""
    rates = [n for n in fit.settings.nuisances if n.kind == "rate" and not n.is_simulated]
    if not rates:
        return "No scatter of creep rates between tests was allowed: every test follows the law's own rate."
    size = f"{number(100 * fit.noise_model.rate, 3)} % about the law (one standard deviation of their logarithm)"
    if rates[0].sd is not None:
        return f"The creep rates of single tests have a Gaussian prior: they scatter by {size}, as was given."
    if _rate_estimated(fit):
        if fit.noise_model.rate <= UNDETECTED_SCATTER:
            return "No scatter of the creep rates of single tests about the law was detected."
        return f"The creep rates of single tests scatter by {size}, as was estimated."
    cannot = f"{plural(len(fit.tests), 'test')} cannot show it"
    if fit.noise_model.rate == 0.0 or fit.settings.weights == "likelihood":
        return f"How the creep rates of single tests scatter is not known, for {cannot}: the intervals hold for these."
    return f"The creep rates of single tests were assumed to scatter by {size}, for {cannot}."


def _explicit_nuisances(fit: Identification) -> str:
    explicit = [n for n in fit.settings.nuisances if n.is_simulated]
    if not explicit:
        return ""
    priors = {(n.key, n.prior_mean, n.prior_sd) for n in fit.nuisances}
    named = [
        f"{key} {number(mean)} ± {number(sd, 2)} {nuisance_unit(kind_and_start(key)[0])}".rstrip()
        for key, mean, sd in sorted(priors)
    ]
    if not named or len(named) > MOST_NAMED:
        named = list(dict.fromkeys(n.kind for n in explicit))
    return f"Nuisance parameters with Gaussian priors (mean ± standard deviation) were {listed(named)}."


def _penalty(found: GroupFindings) -> str:
    """The penalty on terms of a sum, where one was used."""
    sparse = next((one.sparsity for one in found.fits if one.sparsity is not None), None)
    if sparse is None:
        return ""
    strength = "" if sparse.strength is None else f" of strength {number(sparse.strength, 3)}"
    dropped = f"; left out were {listed([*sparse.dropped_terms])}" if sparse.dropped_terms else "; all terms stayed"
    return (
        f"The terms of the sum {printable(sparse.law, 120)} were selected by the penalty {sparse.penalty}{strength} "
        f"and confirmed by BIC{dropped}."
    )


# ---- ranking ---------------------------------------------------------------------------------------------------------


def _ranking(ranking: Ranking, fit: Identification, references: References) -> list[str]:
    under = " under a common covariance" if fit.settings.weights == "likelihood" else ""
    return [
        f"The laws were compared{under} by the {_criterion(ranking.criterion, references)}; the weight of a law is "
        "exp(-difference / 2) over the sum of all laws tried, and a law is credible with a weight above "
        f"{CREDIBLE_WEIGHT:g}. A law is called decisive where its weight is above {DECISIVE_WEIGHT:g}, it was among "
        "the laws asked for, it explains the tests, and neither a share of another law nor an effect that was not "
        "modelled changes that."
    ]


def _criterion(name: str, references: References) -> str:
    criteria = {"bic": "Bayesian information criterion", "aicc": "corrected information criterion of Akaike"}
    if name in criteria:
        return f"{criteria[name]}{references.cite(name)} with the number of independent readings"
    return "error of tests that were held out"


def _adequacy(found: Sequence[GroupFindings]) -> list[str]:
    if all(one.fit.adequacy is None for one in found):
        return []
    return [
        "A law explains the tests where its chi-square, against noise that was stated or estimated from neighbouring "
        "readings and not from its own misfit, has a probability of at least 0.3 %."
    ]
