"""Methods as text for a paper: what was done, from the records alone, with numbered citations, versions and seeds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from creepkit.reports.html.elements import plural, printable, sentence

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.reports.contents import ReportContents
    from creepkit.reports.html.findings import GroupFindings

CITATIONS = {
    "sobol": "I. M. Sobol' (1967), USSR Comput. Math. Math. Phys. 7(4), 86-112",
    "levenberg": "K. Levenberg (1944), Q. Appl. Math. 2, 164-168; D. W. Marquardt (1963), J. SIAM 11, 431-441",
    "sandwich": "H. White (1980), Econometrica 48, 817-838",
    "reml": "H. D. Patterson, R. Thompson (1971), Biometrika 58, 545-554",
    "satterthwaite": "F. E. Satterthwaite (1946), Biometrics Bull. 2, 110-114",
    "bic": "G. Schwarz (1978), Ann. Stat. 6, 461-464",
    "aicc": "C. M. Hurvich, C.-L. Tsai (1989), Biometrika 76, 297-307",
    "larson-miller": "F. R. Larson, J. Miller (1952), Trans. ASME 74, 765",
    "orr-sherby-dorn": "R. L. Orr, O. D. Sherby, J. E. Dorn (1954), Trans. ASM 46, 113",
    "manson-haferd": "S. S. Manson, A. M. Haferd (1953), NACA TN 2890",
    "wilshire": "B. Wilshire, A. J. Battenbough (2007), Mater. Sci. Eng. A 443, 156",
    "monkman-grant": "F. C. Monkman, N. J. Grant (1956), Proc. ASTM 56, 593",
    "lindley": "D. V. Lindley (1956), Ann. Math. Stat. 27, 986-1005",
    "pysindy": "B. M. de Silva et al. (2020), J. Open Source Softw. 5(49), 2104",
}
"""{key: citation} of methods; those of laws stand in the laws."""


class References:
    """Citations in the order of their first mention."""

    def __init__(self) -> None:
        self.listed: list[str] = []

    def cite(self, *citations: str) -> str:
        """' [1, 2]' for citations, or keys of CITATIONS; '' for none."""
        for citation in (CITATIONS.get(c, printable(c, 400)) for c in citations):
            if citation not in self.listed:
                self.listed.append(citation)
        numbers = [self.listed.index(CITATIONS.get(c, printable(c, 400))) + 1 for c in citations]
        return f" [{', '.join(map(str, numbers))}]" if numbers else ""


def methods_text(contents: ReportContents, found: Sequence[GroupFindings]) -> str:
    """Paragraphs on identification, ranking and the other stages, then the references."""
    references = References()
    paragraphs = [*_identification(found, references), *_stages(contents, references), _software(contents, found)]
    listed = [f"[{k}] {citation}" for k, citation in enumerate(references.listed, start=1)]
    return "\n\n".join([*(" ".join(p) for p in paragraphs if p), "\n".join(listed)]).strip() + "\n"


def _identification(found: Sequence[GroupFindings], references: References) -> list[list[str]]:
    if not found:
        return []
    fit = found[0].fit
    tests = sum(len(one.fit.tests) for one in found)
    frames = sum(test.frames for one in found for test in one.fit.tests)
    laws = {one.law.name: one.law for group in found for one in _fits(group)}
    named = [f"{printable(name, 80)}{references.cite(*law.references)}" for name, law in laws.items()]
    materials = f" of {plural(len(found), 'material')}" if len(found) > 1 else ""
    sentences = [
        f"Creep laws were identified from {plural(tests, 'test')}{materials} with {plural(frames, 'compared value')}.",
        f"{'The law was' if len(named) == 1 else 'The laws tried were'} {_listed(named)}.",
        *_estimation(fit, references),
    ]
    ranking = next((one.ranking for one in found if one.ranking is not None), None)
    if ranking is not None:
        sentences.append(
            "The laws were compared under a common covariance by the "
            + _criterion(ranking.criterion, references)
            + "; weights are exp(-difference / 2) over their sum."
        )
    sentences.append(
        "A law explains the tests where its chi-square, against noise that was stated or estimated from neighbouring "
        "frames and not from its own misfit, has a probability of at least 0.3 %."
    )
    return [sentences]


def _criterion(name: str, references: References) -> str:
    if name == "bic":
        return f"Bayesian information criterion{references.cite('bic')} over independent frames"
    if name == "aicc":
        return f"corrected information criterion of Akaike{references.cite('aicc')} over independent frames"
    return "error of tests that were held out"


def _fits(found: GroupFindings) -> list[Identification]:
    return [found.fit] if found.ranking is None else [one.fit for one in found.ranking.laws]


def _estimation(fit: Identification, references: References) -> list[str]:
    settings = fit.settings
    specimen = str(fit.provenance.get("specimen", "")).strip()
    sentences = [
        f"The tests were predicted by the model of the specimen '{printable(specimen, 80)}'." if specimen else "",
        f"Parameters were sought by bounded least squares from {plural(settings.starts, 'start')} out of "
        f"{settings.sobol_points} points of a Sobol' sequence{references.cite('sobol')} (seed {settings.seed}), "
        f"refined by the Levenberg-Marquardt method{references.cite('levenberg')}.",
    ]
    if settings.weights == "likelihood":
        sentences.append(
            "White noise, autocorrelated noise, offsets of tests and the scatter of rates between tests were estimated "
            f"by restricted maximum likelihood{references.cite('reml')}; 95 % intervals follow from the whole "
            f"covariance with Satterthwaite's degrees of freedom{references.cite('satterthwaite')}."
        )
    elif settings.weights == "noise":
        sentences.append(
            "Frames have equal weights; noise, offsets of tests, the scatter of rates between tests and what the law "
            "cannot follow were estimated as variance components, and 95 % intervals are those of a sandwich "
            f"covariance{references.cite('sandwich')} with Student's quantiles."
        )
    else:
        sentences.append("The sum of weighted relative squared errors of the outputs was minimised.")
    explicit = [n.kind for n in settings.nuisances if n.is_simulated]
    if explicit:
        names = list(dict.fromkeys(explicit))
        sentences.append(f"Nuisance parameters with Gaussian priors were {_listed(names)}.")
    if fit.numerical_error is not None:
        sentences.append(
            "The numerical error of the predictions was corrected at the optimum (defect correction), and a tenth of "
            "it stays in the covariance."
        )
    return [text for text in sentences if text]


def _stages(contents: ReportContents, references: References) -> list[list[str]]:
    paragraphs: list[list[str]] = []
    if contents.exclusions:
        tests = {one.test for one in contents.exclusions}
        paragraphs.append(
            [
                f"Frames of {plural(len(tests), 'test')}, or whole tests, were left out for the reasons that the "
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
        paragraphs.append(
            [
                f"{plural(len(assessment.tests), 'rupture test')}, run-outs as censored times and heats as random "
                f"effects, were assessed by {_listed(cited)}."
            ]
        )
    if contents.forecasts:
        level = next(iter(contents.forecasts.values())).level
        paragraphs.append(
            [
                f"Forecasts have bands of {100 * level:g} % that contain the uncertainty of the parameters and of the "
                "choice of the law, the scatter between tests, dimensions, noise and numerical error."
            ]
        )
    if contents.design:
        paragraphs.append(
            [
                f"Further tests were ranked by their expected information{references.cite('lindley')} for each hour of "
                "the oven."
            ]
        )
    return paragraphs


def _software(contents: ReportContents, found: Sequence[GroupFindings]) -> list[str]:
    versions = dict(contents.provenance.versions)
    if not versions and found:
        versions = {"creepkit": str(found[0].fit.provenance.get("creepkit", ""))}
    named = _listed(
        [f"{printable(name, 60)} {printable(version, 60)}" for name, version in versions.items() if version]
    )
    seed = "" if contents.provenance.seed is None else f", seed {contents.provenance.seed}"
    return [sentence(f"The work was done with {named}{seed}")] if named else []


def _listed(words: Sequence[str]) -> str:
    """Words with commas, and 'and' before the last."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}" if words else "none"
