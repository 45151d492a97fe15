"""Methods as text for a paper: what was done, from the records alone, with numbered citations."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from creepkit.inverse.adequacy import LARGEST_SCATTER
from creepkit.inverse.information_criteria import CREDIBLE_WEIGHT, DECISIVE_WEIGHT
from creepkit.inverse.judging import SIGNIFICANCE
from creepkit.inverse.known_noise import FREEDOM_PER_FRAME
from creepkit.inverse.nuisance_parameters import nuisance_unit
from creepkit.inverse.observation_vector import LINEAR_COORDINATE_LENGTH
from creepkit.inverse.variance_components import NOISE_PRIOR_SD
from creepkit.inverse.working_noise import AUTOCORRELATION_CONFIDENCE
from creepkit.records import is_logarithmic, kind_and_start, output_unit
from creepkit.reports.blocks import number, plural, printable, sentence, typeset
from creepkit.reports.design import order_text
from creepkit.reports.identification import rate_estimated, rate_scatter_sentence
from creepkit.reports.methods_tests import (
    CITATIONS,
    MOST_NAMED,
    References,
    compared_tests,
    laws,
    listed,
    loading,
    models,
    of_all,
)

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.reports.contents import ReportContents
    from creepkit.reports.findings import GroupFindings


def identification_methods(
    contents: ReportContents, found: Sequence[GroupFindings], references: References
) -> list[list[str]]:
    """Paragraphs on tests and laws, models, estimation, and ranking and adequacy; none where nothing was identified."""
    if not found:
        return []
    alone = len(found) == 1
    ranked = [one for one in found if one.ranking is not None]
    return [
        [*compared_tests(found), *of_all(found, loading), *laws(found, references)],
        of_all(found, lambda one: models(one.fit)),
        [*of_all(found, lambda one: _estimation(one, contents, references, numbers=alone)), *_scatter(found)],
        [
            *of_all(ranked, lambda one: ranking_sentences(one, references, numbers=alone)),
            *adequacy_sentences(found, references),
        ],
    ]


# ---- search ----------------------------------------------------------------------------------------------------------


def _estimation(found: GroupFindings, contents: ReportContents, references: References, *, numbers: bool) -> list[str]:
    """How values and intervals were found; numbers : whether sizes of noise stand in it, as of one material alone."""
    fit = found.fit
    settings = fit.settings
    sentences = [
        _search(fit, contents, references),
        _agreement(fit) if numbers else "",
        "The bounds of the search are those of the table of symbols.",
        *_weights(fit, references),
        *_offsets(fit, numbers=numbers),
        *_autocorrelation(fit, numbers=numbers),
        _explicit_nuisances(fit),
        _noise_priors(fit, numbers=numbers),
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
    end = f", and refined by least squares in a trust region{references.cite('trust region')}."
    seed = f" (seed {settings.seed})"
    if how.startswith("multi-start"):
        return (
            f"Parameters were sought within their bounds from at most {plural(settings.starts, 'start')}, picked out of "
            f"at most {settings.sobol_points} points of a Sobol' sequence{references.cite('sobol')}{seed}{end}"
        )
    if "swarm" in how:
        return f"Parameters were sought within their bounds by a particle swarm{references.cite('swarm')}{seed}{end}"
    return f"Parameters were sought within their bounds{end}"


def _agreement(fit: Identification) -> str:
    """How many ends of the search agree, where the identification says so."""
    counts = [fit.provenance.get(name) for name in ("search_ends", "ends_at_best", "distinct_minima")]
    if not all(isinstance(one, int) for one in counts):
        return ""
    ends, best, distinct = counts
    if ends == 1:
        return "The search ended once, so that it does not show whether another minimum is lower."
    return (
        f"For the best law {best} of {ends} ends of the search are the best minimum, and {distinct} of them are "
        f"{'distinct local minima' if distinct != 1 else 'distinct'}."
    )


def _search_name(fit: Identification, contents: ReportContents) -> str:
    """Of the search, as the identification or the study states it; "" where that is not known."""
    stated: Any = fit.search_trace.search if fit.search_trace is not None else fit.provenance.get("search", "")
    part = contents.provenance.settings.get("identification")
    if not stated and isinstance(part, Mapping):
        stated = part.get("search", "")
    return str(stated).lower()


# ---- weights and noise -----------------------------------------------------------------------------------------------


def _weights(fit: Identification, references: References) -> list[str]:
    settings = fit.settings
    offsets = any(n.kind == "offset" for n in settings.nuisances)
    estimated = [*(["offsets of tests"] if offsets else []), *(["the scatter of rates"] if rate_estimated(fit) else [])]
    parts = listed(["white noise", "autocorrelated noise", *estimated])
    noise = f"The {parts} were estimated by restricted maximum likelihood{references.cite('reml')}; 95 % intervals"
    freedom = f"Satterthwaite's degrees of freedom{references.cite('satterthwaite')}"
    if settings.weights == "likelihood":
        return [
            f"{noise} follow from the whole covariance with {freedom}. Parameters have weak Gaussian priors, with the "
            "variance of a uniform distribution between their bounds."
        ]
    chen = references.cite("chen")
    minimised = "The sum of the relative squared errors of the outputs was minimised"
    if not isinstance(settings.weights, str):
        weights = ", ".join(f"{name.replace('_', ' ')} {number(value, 3)}" for name, value in settings.weights.items())
        values = f"{minimised}, with the weights {weights}."
    else:
        values = {
            "noise": "Values were found by least squares of readings of equal weight.",
            "equal": f"{minimised}, each output with equal weight.",
            "paper": f"{minimised}, with 0.99 of the weight on the amplitude{chen}.",
        }[settings.weights]
    return [
        values,
        f"{noise} are those of the covariance of this weighted estimate under that noise"
        f"{references.cite('weighted least squares')}, H⁻¹ (Jᵀ W C W J + P) H⁻¹ with H = Jᵀ W J + P, where J are the "
        "derivatives of the residuals, W the weights, C the covariance of the noise and P the precision of the priors, "
        f"with {freedom}.",
    ]


def _offsets(fit: Identification, *, numbers: bool) -> list[str]:
    """The prior of offsets of tests; numbers : whether an estimated standard deviation is stated."""
    offsets = [n for n in fit.settings.nuisances if n.kind == "offset"]
    if not offsets:
        return ["No offsets of tests were allowed."]
    given = [n for n in offsets if n.sd is not None]
    sizes = [
        f"{name.replace('_', ' ')} {number(one.offset, 2)} {output_unit(name)}".rstrip()
        for name, one in fit.noise_model.outputs.items()
        if one.offset > 0
    ]
    was = "as was given" if len(given) == len(offsets) else "estimated from the tests"
    stated = f" ({listed(sizes)})" if sizes and (numbers or given) else ""
    return [
        f"The offset of each output of a test has a Gaussian prior about zero, its standard deviation {was}{stated}."
    ]


def _autocorrelation(fit: Identification, *, numbers: bool) -> list[str]:
    """What is autocorrelated, and how; numbers : whether sizes and lengths are stated."""
    noise = fit.noise_model
    sentences = [
        "Autocorrelated parts have the covariance s² exp(-d / l) at a distance d, in ln t of outputs that are compared "
        f"by their logarithm and else in time over the duration of a test; those were kept by which the likelihood "
        f"gains more than by chance in {100 * AUTOCORRELATION_CONFIDENCE:g} % of cases."
    ]
    if numbers and noise.discrepancy > 0:
        logarithmic = any(is_logarithmic(name) for name in noise.outputs)
        length = noise.discrepancy_length / (1.0 if logarithmic else LINEAR_COORDINATE_LENGTH)
        sentences.append(
            f"What the law cannot follow has s = {number(noise.discrepancy, 3)} times the noise of a reading and l = "
            f"{number(length, 3)}."
        )
    return sentences


def _noise_priors(fit: Identification, *, numbers: bool) -> str:
    """The prior about noise that the tests state, where there is some."""
    stated = [
        f"{name.replace('_', ' ')} {number(one.stated, 3)}{f' {unit}' if (unit := output_unit(name)) else ''}"
        for name, one in fit.noise_model.outputs.items()
        if one.stated > 0
    ]
    if not stated:
        return ""
    return (
        f"The noise of a reading has a log-normal prior about the noise that the tests state"
        f"{f' ({listed(stated)})' if numbers else ''}, with a standard deviation of {number(NOISE_PRIOR_SD, 2)} of its "
        "logarithm."
    )


def _scatter(found: Sequence[GroupFindings]) -> list[str]:
    """How rates of tests scatter, with the range over all materials."""
    ends = [f(100 * one.fit.noise_model.rate for one in found) for f in (min, max)]
    counts = [f(len(one.fit.tests) for one in found) for f in (min, max)]
    percent = " to ".join(dict.fromkeys(number(end, 3) for end in ends))
    tests = plural(counts[0], "test") if counts[0] == counts[1] else f"{counts[0]} to {counts[1]} tests"
    return of_all(found, lambda one: [rate_scatter_sentence(one.fit, f"{percent} %", tests)])


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


# ---- comparison and adequacy -----------------------------------------------------------------------------------------


CRITERIA = {
    "bic": ("Bayesian information criterion", "K ln n"),
    "aicc": ("corrected information criterion of Akaike", "2 K + 2 K (K + 1) / (n - K - 1)"),
}
"""{criterion: its name, and its penalty for K parameters and n readings}."""


def ranking_sentences(found: GroupFindings, references: References, *, numbers: bool) -> list[str]:
    """How the laws of a material were compared; numbers : whether n is stated, as of one material alone."""
    ranking = found.ranking
    if ranking is None:
        return []
    if ranking.criterion in CRITERIA:
        name, penalty = CRITERIA[ranking.criterion]
        n = f" (n = {number(ranking.independent_frames, 4)})" if numbers and _known(ranking.independent_frames) else ""
        deviance = (
            "chi-square, under the covariance of the law that fits the tests best, plus the logarithm of the "
            "determinant that integrates nuisance parameters out"
        )
        criterion = (
            f"{name}{references.cite(ranking.criterion)}: {deviance}, plus {penalty} for K parameters that the tests "
            f"determine and n independent readings, as many as their autocorrelation leaves{n}"
        )
    else:
        criterion = "error of tests that were held out"
    return [
        f"The laws were compared by the {criterion}.",
        "The weight of a law is exp(-difference / 2) over the sum of all laws tried, and a law is credible with a "
        f"weight above {CREDIBLE_WEIGHT:g}. A law is called decisive where its weight is above {DECISIVE_WEIGHT:g}, it "
        "was among the laws asked for, it is not contradicted by the tests, and neither a share of another law nor an "
        "effect that was not modelled changes that.",
    ]


def _known(value: float) -> bool:
    return math.isfinite(value) and value > 0


def adequacy_sentences(found: Sequence[GroupFindings], references: References) -> list[str]:
    """How it was judged whether the tests contradict a law; none where it was not."""
    judged = [one.fit.adequacy for one in found if one.fit.adequacy is not None]
    if not judged:
        return []
    sources = {output.noise_source for one in judged for output in one.outputs}
    estimated = (
        " Noise that no test states is estimated from the third differences of neighbouring readings, with "
        f"{FREEDOM_PER_FRAME:g} degrees of freedom for each of them; chi-square over its degrees of freedom then has "
        "the F distribution for one test, and for several that of a scaled chi-square with the same mean and variance"
        f"{references.cite('satterthwaite')}."
        if "estimated" in sources
        else ""
    )
    freedom = (
        f" Here it has {number(judged[0].freedom, 4)} degrees of freedom."
        if len(judged) == 1 and _known(judged[0].freedom)
        else ""
    )
    several = " (the least of those of all outputs and of each one, times their number)"
    scatter = number(math.exp(LARGEST_SCATTER), 2)
    return [
        "A law is not contradicted by the tests where its chi-square, against noise that was stated or estimated "
        f"without the law, has a probability of at least {100 * SIGNIFICANCE:g} %"
        f"{several if any(len(one.outputs) > 1 for one in judged) else ''}, the rates of tests scatter by less than a "
        f"factor of {scatter}, and nothing else explains that scatter six times better: a stress exponent that "
        "changes with stress, an activation energy that changes with temperature, one test, or two groups of tests. "
        f"Degrees of freedom are the readings less the unknowns that they determine.{freedom}{estimated}"
    ]


# ---- other stages ----------------------------------------------------------------------------------------------------


def methods_text(contents: ReportContents, found: Sequence[GroupFindings]) -> str:
    """Paragraphs on identification, ranking and the other stages, then the references."""
    references = References()
    paragraphs = [
        _source_of_data(contents, references),
        *identification_methods(contents, found, references),
        *_stages(contents, references),
        _software(contents, found, references),
    ]
    text, cited = references.numbered(typeset("\n\n".join(" ".join(p) for p in paragraphs if p)))
    numbered = "\n".join(f"[{k}] {citation}" for k, citation in enumerate(cited, start=1))
    return f"{text}\n\n{numbered}".strip() + "\n"


def _source_of_data(contents: ReportContents, references: References) -> list[str]:
    """Where the data were published, if the study says so."""
    if not contents.data_citations:
        return []
    return [f"The measured data are those of{references.cite(*contents.data_citations)}."]


def _stages(contents: ReportContents, references: References) -> list[list[str]]:
    paragraphs: list[list[str]] = []
    if contents.exclusions:
        tests = {one.test for one in contents.exclusions}
        paragraphs.append(
            [
                f"Readings of {plural(len(tests), 'test')}, or whole tests, were left out for the reasons that the "
                "report lists."
            ]
        )
    if contents.temperature:
        paragraphs.append(
            [
                "Forms of temperature of the parameters were chosen by regression on isothermal estimates with their "
                f"covariances{references.cite('pysindy')}, over all combinations of forms."
            ]
        )
    for assessment in contents.rupture.values():
        methods = dict.fromkeys(one.fit.method for one in assessment.ranked)
        cited = [f"{name}{references.cite(name) if name in CITATIONS else ''}" for name in methods]
        ruptures = assessment.tests
        run_outs = int(ruptures.censored.sum())
        scattering = [label for label, names in ruptures.groups.items() if len(set(names)) > 1]
        how = [f"{plural(run_outs, 'run-out')} as censored times"] if run_outs else []
        how += [f"{listed([_plural_of(label) for label in scattering])} as random effects"] if scattering else []
        with_them = f", {listed(how)}," if how else ""
        were = "was" if len(ruptures) == 1 else "were"
        paragraphs.append([f"{plural(len(ruptures), 'rupture test')}{with_them} {were} assessed by {listed(cited)}."])
    if contents.forecasts:
        forecasts = contents.forecasts.values()
        level, draws = next(iter(forecasts)).level, max(one.draws for one in forecasts)
        drawn = f"; they come from {draws} draws in each test" if draws else ""
        paragraphs.append(
            [
                f"Forecasts have bands of {100 * level:g} % that contain the uncertainty of the parameters and of the "
                f"choice of the law, the scatter between tests, dimensions, noise and numerical error{drawn}."
            ]
        )
    if contents.design:
        by = order_text(next(iter(contents.design.values())))
        information = f"Expected information of further tests was computed{references.cite('lindley')}"
        paragraphs.append([f"{information}; they are listed {by}."])
    return paragraphs


def _plural_of(label: str) -> str:
    """Several of what a label names: heats, laboratories."""
    label = printable(label, 60)
    return f"{label[:-1]}ies" if label.endswith("y") else f"{label}s"


def _software(contents: ReportContents, found: Sequence[GroupFindings], references: References) -> list[str]:
    versions = dict(contents.provenance.versions)
    if not versions and found:
        versions = {"creepkit": str(found[0].fit.provenance.get("creepkit", ""))}
    named = listed(
        [
            f"{printable(name, 60)} {printable(version, 60)}{references.cite(name) if name == 'creepkit' else ''}"
            for name, version in versions.items()
            if version
        ]
    )
    seed = "" if contents.provenance.seed is None else f", seed {contents.provenance.seed}"
    return [sentence(f"The work was done with {named}{seed}")] if named else []
