"""Methods as text for a paper: what was done, from the records alone, with numbered citations.

Numbers that differ from material to material stand in the tables of the page.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import sympy

from creepkit.inverse.evidence import CREDIBLE_WEIGHT, DECISIVE_WEIGHT
from creepkit.inverse.known_noise import FREEDOM_PER_FRAME
from creepkit.inverse.observation_vector import FLOOR_NOISES, FLOOR_SHARE, MINIMUM_RATE_OUTPUT, RUPTURE_OUTPUT
from creepkit.inverse.output_transforms import LogTransform
from creepkit.inverse.variance_components import LARGEST_RATE_SCATTER, NOISE_PRIOR_SD
from creepkit.inverse.working_noise import AUTOCORRELATION_CONFIDENCE
from creepkit.language.printing import arrhenius_exponent
from creepkit.limits import SIGNIFICANCE
from creepkit.records.loading import held_of
from creepkit.reports.blocks import ends, listed, number, plural, printable, sentence, typeset
from creepkit.reports.compared_values import compared_observations, reading_counts
from creepkit.reports.identification import rate_scatter_sentence
from creepkit.reports.law_names import title_in_sentence

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.language import CreepLaw
    from creepkit.records import History
    from creepkit.reports.contents import ReportContents, ReportGroup


CITATIONS = {
    "sobol": "I. M. Sobol' (1967), USSR Comput. Math. Math. Phys. 7(4), 86-112",
    "trust region": "M. A. Branch, T. F. Coleman, Y. Li (1999), SIAM J. Sci. Comput. 21(1), 1-23",
    "weighted least squares": "G. A. F. Seber, C. J. Wild (1989), Nonlinear Regression, Wiley, New York",
    "reml": "H. D. Patterson, R. Thompson (1971), Biometrika 58, 545-554",
    "satterthwaite": "F. E. Satterthwaite (1946), Biometrics Bull. 2, 110-114",
    "evidence": "D. J. C. MacKay (1992), Neural Comput. 4, 415-447",
    "larson-miller": "F. R. Larson, J. Miller (1952), Trans. ASME 74, 765",
    "orr-sherby-dorn": "R. L. Orr, O. D. Sherby, J. E. Dorn (1954), Trans. ASM 46, 113",
    "manson-haferd": "S. S. Manson, A. M. Haferd (1953), NACA TN 2890",
    "wilshire": "B. Wilshire, A. J. Battenbough (2007), Mater. Sci. Eng. A 443, 156",
    "monkman-grant": "F. C. Monkman, N. J. Grant (1956), Proc. ASTM 56, 593",
    "lindley": "D. V. Lindley (1956), Ann. Math. Stat. 27, 986-1005",
    "creepkit": f"The authors of creepkit, creepkit (software), version {version('creepkit')}, licence Apache-2.0",
}
"""{key: citation} of methods, and of creepkit as CITATION.cff has it; those of laws stand in the laws."""


class References:
    """Citations of a text, numbered in the order in which they are made."""

    def __init__(self) -> None:
        self.texts: dict[str, int] = {}

    def cite(self, *citations: str) -> str:
        """Numbers in brackets, after a space, of citations or keys of CITATIONS; "" for none."""
        texts = [CITATIONS.get(c, printable(c, 400)) for c in citations]
        numbers = sorted({self.texts.setdefault(text, len(self.texts) + 1) for text in texts})
        return f" [{', '.join(map(str, numbers))}]" if numbers else ""


def methods_text(contents: ReportContents) -> str:
    """Paragraphs on tests and laws, models, estimation, comparison and the other stages, then the references."""
    references = References()
    cite = references.cite
    source = f"The measured data are those of{cite(*contents.data_citations)}." if contents.data_citations else ""
    found = contents.identified
    fits = [one.fit for one in found]
    paragraphs: list[Iterable[str]] = [[source]]
    if found:
        paragraphs += [
            [*_tests(fits), *_each(fits, _loading), *_laws(found, cite)],
            _each(fits, _models),
            [*_each(fits, lambda fit: _estimation(fit, cite)), *_each(found, _sparsity)],
            [*_each(found, lambda one: _comparison(one, cite)), *_adequacy(fits, cite)],
        ]
    paragraphs += [*_stages(contents, cite), _software(contents, cite)]
    texts = [" ".join(filter(None, one)) for one in paragraphs]
    numbered = "\n".join(f"[{k}] {text}" for text, k in references.texts.items())
    return f"{typeset(chr(10).join(f'{text}{chr(10)}' for text in texts if text))}\n{numbered}".strip() + "\n"


def _each(found: Iterable[Any], sentences_of: Callable[[Any], Iterable[str]]) -> list[str]:
    """The sentences on all materials, each once."""
    return [*dict.fromkeys(text for one in found for text in sentences_of(one))]


# ---- tests, laws and models ------------------------------------------------------------------------------------------


def _tests(fits: Sequence[Identification]) -> Iterator[str]:
    """How many tests and readings there are, and in what quantity these are compared."""
    counts = [reading_counts(fit.histories, fit.settings.frames) for fit in fits]
    measured, fitted = (sum(values) for values in zip(*((c.measured, c.fitted) for c in counts), strict=True))
    materials = f" of {plural(len(fits), 'material')}" if len(fits) > 1 else ""
    readings = f": {fitted} of {plural(measured, 'reading')} were fitted" if measured else ""
    yield f"Creep laws were identified from {plural(sum(len(one.tests) for one in fits), 'test')}{materials}{readings}."
    compared = _each(fits, _transforms)
    if compared:
        yield f"Compared were {listed(compared)}."
    if any("arsinh" in text for text in compared):
        yield f"The floor f is {100 * FLOOR_SHARE:g} % of the median end value, at least {FLOOR_NOISES:g} noises."
    if any(one is not None and one.followed_to_rupture.any() for one in map(compared_observations, fits)):
        yield "Readings to rupture, or of a rising rate, have orthogonal residuals √2 |a b| / √(a² + b²), signed as a."
        yield "There a is predicted less measured transformed strain, b ln of the measured over the predicted time."
        yield "Tests stopped before rupture count only where they lasted longer than predicted."


def _transforms(fit: Identification) -> Iterator[str]:
    observations, linear = compared_observations(fit), list[str]()
    for output, transform in (
        () if observations is None else zip(observations.outputs, observations.transforms, strict=True)
    ):
        name = output.replace("_", " ")
        if output in (RUPTURE_OUTPUT, MINIMUM_RATE_OUTPUT):
            yield f"{'rupture times' if output == RUPTURE_OUTPUT else 'minimum creep rates'} by their logarithms"
        elif isinstance(transform, LogTransform):
            yield f"{name} ε as arsinh(ε / 2f), a logarithm above f"
        else:
            linear.append(name)
    if linear:
        yield f"{listed(linear)} over the standard deviation of a reading"


def _loading(fit: Identification) -> Iterator[str]:
    """What was held in uniaxial tests, what their strains are, and the elastic data that were used."""
    controls = {held_of(h.loading) for h in fit.histories if h.loading.quantity == "stress"}
    held = {"load": "Loads were held, so that the true stress grows with strain.", "stress": "True stresses were held."}
    yield from (text for control, text in held.items() if control in controls)
    strains = {(h.strain_measure, h.includes_elastic) for h in fit.histories if "strain" in h.outputs}
    for measure, elastic in sorted(strains):
        yield f"Strains are {measure} and {'contain' if elastic else 'do not contain'} the elastic strain on loading."
    known = [h.elastic.at(h.mean_temperature) for h in fit.histories if h.elastic is not None]
    if known:
        moduli, ratios = ends([1e-3 * float(one.E) for one in known]), ends([float(one.nu) for one in known])
        yield f"Young's modulus is {moduli} GPa and Poisson's ratio {ratios} in {plural(len(known), 'test')}."


def laws_of(found: Sequence[ReportGroup]) -> dict[str, CreepLaw]:
    """{name: law} of all that were fitted, in the order in which their equations are numbered."""
    return {one.law.name: one.law for group in found for one in group.fits}


def _laws(found: Sequence[ReportGroup], cite: Callable[..., str]) -> Iterator[str]:
    """The laws by their titles and the numbers of their equations, with what they cite, and their T_ref."""
    named = [
        f"the {title_in_sentence(law)}, Eq. ({k}){cite(*law.references)}"
        for k, law in enumerate(laws_of(found).values(), start=1)
    ]
    yield f"The law was {named[0]}." if len(named) == 1 else f"The laws tried were {'; '.join(named)}."
    rates = [
        rate for one in found for rate in (*one.fit.law.terms.values(), *(s.rate for s in one.fit.law.states.values()))
    ]
    exponents = (part for rate in rates for e in rate.atoms(sympy.exp) for part in sympy.Add.make_args(e.args[0]))
    factors = {one.T_ref for one in map(arrhenius_exponent, exponents) if one is not None} - {math.inf}
    if factors:
        shown = listed([f"{number(T, 6)} K" for T in sorted(factors)])
        yield f"Rate coefficients of laws with an activation energy are those at T_ref = {shown}."


def _models(fit: Identification) -> Iterator[str]:
    """By what the tests were predicted: the specimen's own words on it, the surrogate, and the reduced-order model."""
    predictor, name = fit.predictor, printable(str(fit.provenance.get("specimen", "")), 80)
    surrogate = predictor is not None and predictor.specimen is not predictor and not predictor.parts
    yield f"The tests were predicted by {'a surrogate' if surrogate else 'the model'} of the specimen '{name}'."
    if predictor is None:
        return
    tests: dict[str, list[History]] = {}
    pieces = {}
    for history in fit.histories:
        own = predictor.specimen.for_history(history)
        pieces[own.label] = own
        tests.setdefault(own.label, []).append(history)
    yield from (sentence(text) for label, piece in pieces.items() if (text := piece.model_text(tests[label])))
    if predictor.reduced_order_model() is not None:
        yield "The global search used the reduced-order model of these finite elements."


# ---- estimation ------------------------------------------------------------------------------------------------------


def _estimation(fit: Identification, cite: Callable[..., str]) -> Iterator[str]:
    """How the optimum was sought, what was weighted how, and what intervals are made of."""
    settings, noise = fit.settings, fit.noise_model
    region = f"by least squares in a trust region{cite('trust region')}"
    yield f"Parameters were sought within the bounds of the table of symbols {region}."
    if "search_ends" in fit.provenance:
        points = f"at most {settings.sobol_points} points of a Sobol' sequence{cite('sobol')}"
        yield f"Up to {plural(settings.starts, 'start')} were picked out of {points} (seed {settings.seed})."
    if settings.weights == "equal":
        yield "Values were found by least squares of readings of equal weight."
    components = "White and autocorrelated noise, offsets and the scatter of rates"
    yield f"{components} were estimated by restricted maximum likelihood{cite('reml')}."
    freedom = f"Satterthwaite's degrees of freedom{cite('satterthwaite')}"
    if settings.weights == "likelihood":
        yield f"95 % intervals follow from the whole covariance with {freedom}."
        yield "Parameters have weak Gaussian priors, with the variance of a uniform distribution between their bounds."
    else:
        weighted = f"this weighted estimate{cite('weighted least squares')}, H⁻¹ (Jᵀ W C W J + P) H⁻¹"
        yield f"95 % intervals follow from the covariance of {weighted}. There H = Jᵀ W J + P, with {freedom}."
        yield "J are derivatives of residuals, W weights, C the covariance of the noise, P the precision of the priors."
    if nuisances := list(dict.fromkeys(one.kind for one in settings.nuisances)):
        yield f"Nuisance parameters of the tests with Gaussian priors are {listed(nuisances)}."
    yield rate_scatter_sentence(fit)
    chance = f"{100 * AUTOCORRELATION_CONFIDENCE:g} % of cases"
    yield "Autocorrelated parts have the covariance s² exp(-d / l), d in ln t of logarithms, else in relative time."
    yield f"Those were kept by which the likelihood gains more than by chance in {chance}."
    if any(one.stated > 0 for one in noise.outputs.values()):
        yield (
            "The noise of a reading has a log-normal prior about the noise that its test states, with a standard "
            f"deviation of {number(NOISE_PRIOR_SD, 2)} of its logarithm."
        )
    if fit.numerical_error is not None:
        yield "Numerical errors of predictions were corrected at the optimum; a tenth of them stays in the covariance."


def _sparsity(found: ReportGroup) -> Iterator[str]:
    """How terms of a sum were selected, where they were."""
    for sparse in [one.sparsity for one in found.fits if one.sparsity is not None][:1]:
        dropped = f"left out were {listed([*sparse.dropped_terms])}" if sparse.dropped_terms else "all terms stayed"
        selected = "were selected by the evidence for its subsets"
        yield f"The terms of the sum {printable(sparse.law, 120)} {selected}; {dropped}."


# ---- comparison and adequacy -----------------------------------------------------------------------------------------


def _comparison(found: ReportGroup, cite: Callable[..., str]) -> Iterator[str]:
    """How the laws of a material were compared."""
    if found.ranking is None:
        return
    yield f"The laws were compared by their evidence, by Laplace's method{cite('evidence')}."
    yield "Chi-square is that under the covariance of the best law, with nuisance parameters integrated out."
    yield "Each parameter costs 2 ln of the factor by which the tests narrow its bounds."
    yield f"The weight of a law is exp(-difference / 2) over the sum of all; it is credible above {CREDIBLE_WEIGHT:g}."
    yield f"It is decisive above {DECISIVE_WEIGHT:g} if it was asked for and the tests do not reject it."
    yield "Nor may a share of another law, or an effect that was not modelled, change that."


def _adequacy(fits: Sequence[Identification], cite: Callable[..., str]) -> Iterator[str]:
    """How it was judged whether the tests reject a law; none where it was not."""
    judged = [fit.adequacy for fit in fits if fit.adequacy is not None]
    if not judged:
        return
    noise = "noise that was stated or estimated without it"
    yield f"Tests reject a law whose chi-square against {noise} has a probability below {100 * SIGNIFICANCE:g} %."
    if any(len(one.outputs) > 1 for one in judged):
        yield "It is the least of those of all outputs and of each one, times their number."
    largest = number(math.exp(LARGEST_RATE_SCATTER), 2)
    yield f"They reject it, too, where rates of tests scatter by more than a factor of {largest}."
    yield "So do they where a changing exponent or energy, one test, or two groups explain scatter six times better."
    if any(output.noise_source == "estimated" for one in judged for output in one.outputs):
        freedom = f"{FREEDOM_PER_FRAME:g} degrees of freedom each"
        yield f"Noise that no test states is estimated from third differences of neighbouring readings, with {freedom}."
        distribution = f"an F distribution, or one of the mean and variance of several{cite('satterthwaite')}"
        yield f"Chi-square over its degrees of freedom then has {distribution}."


# ---- other stages ----------------------------------------------------------------------------------------------------


def _stages(contents: ReportContents, cite: Callable[..., str]) -> Iterator[list[str]]:
    """A paragraph on each of the other stages."""
    if contents.exclusions:
        tests = {one.test for one in contents.exclusions}
        yield [
            f"Readings of {plural(len(tests), 'test')}, or whole tests, were left out for the reasons in the report."
        ]
    if contents.temperature:
        how = "by regression on isothermal estimates with their covariances"
        yield [f"Forms of temperature of the parameters were chosen {how}, over all combinations of forms."]
    for assessment in contents.rupture.values():
        methods = dict.fromkeys(one.fit.method for one in assessment.ranked)
        cited = [f"{name}{cite(name) if name in CITATIONS else ''}" for name in methods]
        yield [
            f"{plural(len(assessment.tests), 'rupture test')}, run-outs as censored times and heats and laboratories "
            f"as random effects, were assessed by {listed(cited)}."
        ]
    for forecast in [*contents.forecasts.values()][:1]:
        yield [
            f"Bands of {100 * forecast.level:g} % contain the uncertainty of parameters and of the choice of the law.",
            "They contain the scatter between tests, dimensions, noise and numerical error as well.",
            f"They come from {forecast.draws} draws in each test." * bool(forecast.draws),
        ]
    for design in [*contents.design.values()][:1]:
        yield [f"Expected information of further tests about the {design.goal} was computed{cite('lindley')}."]


def _software(contents: ReportContents, cite: Callable[..., str]) -> list[str]:
    """By which version; those of all packages stand where the page says how to repeat the work."""
    found = [str(one.fit.provenance.get("creepkit", "")) for one in contents.identified]
    known = printable(contents.provenance.versions.get("creepkit") or [*found, ""][0], 60)
    seed = "" if contents.provenance.seed is None else f", seed {contents.provenance.seed}"
    return [f"The work was done with creepkit {known}{cite('creepkit')}{seed}."] if known else []
