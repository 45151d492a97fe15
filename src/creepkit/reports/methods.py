"""Methods as text for a paper: what was done, from the records alone, with numbered citations.

Numbers that differ from material to material stand in the tables of the page.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import sympy

from creepkit.inverse.adequacy import UNDETECTED_SCATTER
from creepkit.inverse.evidence import CREDIBLE_WEIGHT, DECISIVE_WEIGHT
from creepkit.inverse.known_noise import FREEDOM_PER_FRAME
from creepkit.inverse.noise_model import MINIMUM_TESTS
from creepkit.inverse.observation_vector import (
    FLOOR_NOISES,
    FLOOR_SHARE,
    MINIMUM_RATE_OUTPUT,
    RUPTURE_OUTPUT,
    ObservationVector,
)
from creepkit.inverse.output_transforms import LogTransform
from creepkit.inverse.variance_components import LARGEST_RATE_SCATTER, NOISE_PRIOR_SD
from creepkit.inverse.working_noise import AUTOCORRELATION_CONFIDENCE
from creepkit.language.printing import arrhenius_exponent
from creepkit.limits import SIGNIFICANCE
from creepkit.records.loading import held_of
from creepkit.reports.blocks import ends, listed, number, plural, printable, sentence, typeset
from creepkit.reports.compared_values import compared_observations, reading_counts
from creepkit.reports.law_names import title_in_sentence
from creepkit.reports.wording import first_kind, say
from creepkit.reports.words_of_methods import METHODS

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
    """Citations of a text, numbered in the order in which they are made; a key of CITATIONS as an index cites it."""

    def __init__(self) -> None:
        self.texts: dict[str, int] = {}

    def cite(self, *citations: str) -> str:
        """Numbers in brackets, after a space, of citations or keys of CITATIONS; "" for none."""
        texts = [CITATIONS.get(c, printable(c, 400)) for c in citations]
        numbers = sorted({self.texts.setdefault(text, len(self.texts) + 1) for text in texts})
        return f" [{', '.join(map(str, numbers))}]" if numbers else ""

    __getitem__ = cite

    def said(self, kind: str, **values: Any) -> str:
        """A sentence of METHODS."""
        return sentence(say(METHODS[kind], cite=self, **values))


def methods_text(contents: ReportContents) -> str:
    """Paragraphs on tests and laws, models, estimation, comparison and the other stages, then the references."""
    references = References()
    found = contents.identified
    fits = [one.fit for one in found]
    sources = references.cite(*contents.data_citations)
    paragraphs: list[Iterable[str]] = [[references.said("source", sources=sources)] if sources else []]
    if found:
        paragraphs += [
            [*_tests(fits, references), *_each(fits, references, _loading), *_laws(found, references)],
            _each(fits, references, _models),
            [*_each(fits, references, _estimation), *_each(found, references, _sparsity)],
            [*_each(found, references, _comparison), *_adequacy(fits, references)],
        ]
    paragraphs += [*([one] for one in _stages(contents, references)), _software(contents, references)]
    texts = [" ".join(one) for one in paragraphs]
    numbered = "\n".join(f"[{k}] {text}" for text, k in references.texts.items())
    return f"{typeset(chr(10).join(f'{text}{chr(10)}' for text in texts if text))}\n{numbered}".strip() + "\n"


def _each(
    found: Iterable[Any], references: References, sentences_of: Callable[[Any, References], Iterable[str]]
) -> list[str]:
    """The sentences on all materials, each once."""
    return [*dict.fromkeys(text for one in found for text in sentences_of(one, references))]


# ---- tests, laws and models ------------------------------------------------------------------------------------------


def _tests(fits: Sequence[Identification], references: References) -> Iterator[str]:
    """How many tests and readings there are, and in what quantity these are compared."""
    counts = [reading_counts(fit.histories, fit.settings.frames) for fit in fits]
    readings, fitted = plural(sum(one.measured for one in counts), "reading"), sum(one.fitted for one in counts)
    materials = plural(len(fits), "material") if len(fits) > 1 else ""
    tests = plural(sum(len(one.tests) for one in fits), "test")
    yield references.said("tests", tests=tests, materials=materials, fitted=fitted, readings=readings)
    observations = [one for one in map(compared_observations, fits) if one is not None]
    outputs = dict.fromkeys(text for one in observations for text in _transforms(one))
    if outputs:
        yield references.said("compared", outputs=listed([*outputs]))
    if any(isinstance(transform, LogTransform) for one in observations for transform in one.transforms):
        yield references.said("floor", share=FLOOR_SHARE, noises=FLOOR_NOISES)
    if any(one.followed_to_rupture.any() for one in observations):
        yield references.said("to rupture")


def _transforms(observations: ObservationVector) -> Iterator[str]:
    single, linear = {RUPTURE_OUTPUT: "of ruptures", MINIMUM_RATE_OUTPUT: "of rates"}, list[str]()
    for output, transform in zip(observations.outputs, observations.transforms, strict=True):
        logarithmic, name = isinstance(transform, LogTransform), output.replace("_", " ")
        if output in single or logarithmic:
            yield say(METHODS[single.get(output, "of logarithms")], output=name)
        else:
            linear.append(name)
    if linear:
        yield say(METHODS["of readings"], outputs=listed(linear))


def _loading(fit: Identification, references: References) -> Iterator[str]:
    """What was held in uniaxial tests, what their strains are, and the elastic data that were used."""
    controls = {held_of(h.loading) for h in fit.histories if h.loading.quantity == "stress"}
    yield from map(references.said, (one for one in ("load", "stress") if one in controls))
    strains = {(h.strain_measure, h.includes_elastic) for h in fit.histories if "strain" in h.outputs}
    for measure, elastic in sorted(strains):
        yield references.said("with elastic" if elastic else "without elastic", measure=measure)
    known = [h.elastic.at(h.mean_temperature) for h in fit.histories if h.elastic is not None]
    if known:
        moduli, ratios = ends([1e-3 * float(one.E) for one in known]), ends([float(one.nu) for one in known])
        yield references.said("elastic", moduli=moduli, ratios=ratios, tests=plural(len(known), "test"))


def laws_of(found: Sequence[ReportGroup]) -> dict[str, CreepLaw]:
    """{name: law} of all that were fitted, in the order in which their equations are numbered."""
    return {one.law.name: one.law for group in found for one in group.fits}


def _laws(found: Sequence[ReportGroup], references: References) -> Iterator[str]:
    """The laws by their titles and the numbers of their equations, with what they cite, and their T_ref."""
    laws = laws_of(found)
    if len(laws) > 1:
        yield references.said("laws", count=len(laws))
    for k, law in enumerate(laws.values(), start=1):
        sources, kind = references.cite(*law.references), "of laws" if len(laws) > 1 else "law"
        yield references.said(kind, title=title_in_sentence(law), number=k, sources=sources)
    rates = [
        rate for one in found for rate in (*one.fit.law.terms.values(), *(s.rate for s in one.fit.law.states.values()))
    ]
    exponents = (part for rate in rates for e in rate.atoms(sympy.exp) for part in sympy.Add.make_args(e.args[0]))
    factors = {one.T_ref for one in map(arrhenius_exponent, exponents) if one is not None} - {math.inf}
    if factors:
        yield references.said("T_ref", temperatures=listed([f"{number(T, 6)} K" for T in sorted(factors)]))


def _models(fit: Identification, references: References) -> Iterator[str]:
    """By what the tests were predicted: the specimen's own words on it, the surrogate, and the reduced-order model."""
    predictor, name = fit.predictor, printable(str(fit.provenance.get("specimen", "")), 80)
    surrogate = predictor is not None and predictor.specimen is not predictor and not predictor.parts
    yield references.said("surrogate" if surrogate else "model", name=name)
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
        yield references.said("reduced order")


# ---- estimation ------------------------------------------------------------------------------------------------------


def _estimation(fit: Identification, references: References) -> Iterator[str]:
    """How the optimum was sought, what was weighted how, and what intervals are made of."""
    settings, kinds = fit.settings, list(dict.fromkeys(one.kind for one in fit.settings.nuisances))
    holds = {
        "region": True,
        "starts": "search_ends" in fit.provenance,
        "equal weights": settings.weights == "equal",
        "noise": True,
        "likelihood": settings.weights == "likelihood",
        "weighted": settings.weights != "likelihood",
        "nuisances": kinds,
        "": True,  # on the scatter of rates
        "lives": fit.noise_model.life > UNDETECTED_SCATTER,
        "autocorrelated": True,
        "stated noise": any(one.stated > 0 for one in fit.noise_model.outputs.values()),
        "numerical error": fit.numerical_error,
    }
    values = {"starts": plural(settings.starts, "start"), "points": settings.sobol_points, "seed": settings.seed}
    values |= {"kinds": listed(kinds), "chance": AUTOCORRELATION_CONFIDENCE, "sd": NOISE_PRIOR_SD}
    values |= {"lives": 100 * fit.noise_model.life}
    for kind in (kind for kind, true in holds.items() if true):
        yield references.said(kind, **values) if kind else rate_scatter_sentence(fit)


def rate_scatter_sentence(fit: Identification) -> str:
    """How much the creep rates of single tests scatter, and whether that was estimated, given, assumed or left out."""
    rates = [n for n in fit.settings.nuisances if n.kind == "rate" and not n.is_simulated]
    kinds = {
        "no scatter": not rates,
        "given scatter": any(one.sd is not None for one in rates[:1]),
        "unknown scatter": len(fit.tests) < MINIMUM_TESTS,
        "undetected scatter": fit.noise_model.rate <= UNDETECTED_SCATTER,
        "scatter": True,
    }
    values = {"scatter": 100 * fit.noise_model.rate, "tests": plural(len(fit.tests), "test")}
    return References().said(first_kind(kinds), **values)


def _sparsity(found: ReportGroup, references: References) -> Iterator[str]:
    """How terms of a sum were selected, where they were."""
    for sparse in [one.sparsity for one in found.fits if one.sparsity is not None][:1]:
        dropped = say(METHODS["dropped" if sparse.dropped_terms else "all kept"], names=listed([*sparse.dropped_terms]))
        yield references.said("terms", law=printable(sparse.law, 120), dropped=dropped)


# ---- comparison and adequacy -----------------------------------------------------------------------------------------


def _comparison(found: ReportGroup, references: References) -> Iterator[str]:
    """How the laws of a material were compared."""
    if found.ranking is not None:
        yield references.said("comparison", credible=CREDIBLE_WEIGHT, decisive=DECISIVE_WEIGHT)


def _adequacy(fits: Sequence[Identification], references: References) -> Iterator[str]:
    """How it was judged whether the tests reject a law; none where it was not."""
    judged = [fit.adequacy.outputs for fit in fits if fit.adequacy is not None]
    holds = {
        "rejection": bool(judged),
        "several outputs": any(len(one) > 1 for one in judged),
        "rates": bool(judged),
        "estimated noise": any(output.noise_source == "estimated" for one in judged for output in one),
    }
    values = {"significance": SIGNIFICANCE, "factor": math.exp(LARGEST_RATE_SCATTER), "freedom": FREEDOM_PER_FRAME}
    yield from (references.said(kind, **values) for kind, true in holds.items() if true)


# ---- other stages ----------------------------------------------------------------------------------------------------


def _stages(contents: ReportContents, references: References) -> Iterator[str]:
    """A paragraph on each of the other stages."""
    if contents.exclusions:
        yield references.said("left out", tests=plural(len({one.test for one in contents.exclusions}), "test"))
    if contents.temperature:
        yield references.said("temperature")
    for assessment in contents.rupture.values():
        methods = dict.fromkeys(one.fit.method for one in assessment.ranked)
        cited = listed([f"{name}{references.cite(*{name} & {*CITATIONS})}" for name in methods])
        yield references.said("rupture", tests=plural(len(assessment.tests), "rupture test"), methods=cited)
    for forecast in [*contents.forecasts.values()][:1]:
        yield references.said("forecast", level=100 * forecast.level, draws=forecast.draws)
    for design in [*contents.design.values()][:1]:
        yield references.said("design", goal=design.goal)


def _software(contents: ReportContents, references: References) -> list[str]:
    """By which version; those of all packages stand where the page says how to repeat the work."""
    found = [str(one.fit.provenance.get("creepkit", "")) for one in contents.identified]
    known = printable(contents.provenance.versions.get("creepkit") or [*found, ""][0], 60)
    seed = "" if contents.provenance.seed is None else f", seed {contents.provenance.seed}"
    return [references.said("software", version=known, seed=seed)] if known else []
