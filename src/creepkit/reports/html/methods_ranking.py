"""How laws were compared, and how it was judged whether the tests contradict a law, in sentences for a paper."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from creepkit.inverse.adequacy import LARGEST_SCATTER
from creepkit.inverse.information_criteria import CREDIBLE_WEIGHT, DECISIVE_WEIGHT
from creepkit.inverse.judging import SIGNIFICANCE
from creepkit.inverse.known_noise import FREEDOM_PER_FRAME
from creepkit.reports.html.citations import References
from creepkit.reports.html.elements import number

if TYPE_CHECKING:
    from creepkit.reports.html.findings import GroupFindings

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
