"""Which tests were compared with which laws, and by which models, in sentences for a paper."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import sympy

from creepkit.inverse.reference_conditions import reference_temperature
from creepkit.language.printing import arrhenius_exponent
from creepkit.laws.paper import PAPER
from creepkit.reports.blocks import number, plural, printable, sentence
from creepkit.reports.compared_values import compared_values, frame_counts
from creepkit.reports.law_names import title_in_sentence

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.language import CreepLaw
    from creepkit.records import History
    from creepkit.reports.findings import GroupFindings


MOST_NAMED = 6
"""Nuisance parameters that a sentence names; of more it says their kinds."""


def of_all(found: Sequence[GroupFindings], sentences_of: Callable[[GroupFindings], Sequence[str]]) -> list[str]:
    """The sentences on all materials, each once."""
    return [*dict.fromkeys(text for one in found for text in sentences_of(one) if text)]


def laws_of(found: Sequence[GroupFindings]) -> dict[str, CreepLaw]:
    """{name: law} of all that were fitted, in the order in which their equations are numbered."""
    return {one.law.name: one.law for group in found for one in group.fits}


# ---- tests -----------------------------------------------------------------------------------------------------------


def compared_tests(found: Sequence[GroupFindings]) -> list[str]:
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
    kinds = dict.fromkeys(text for one in known for text in one.kinds_of_transforms)
    how = f"Compared were {listed([*(transforms.pop() if len(transforms) == 1 else kinds)])}."
    followed, run_outs = sum(one.followed for one in known), sum(one.run_outs for one in known)
    return [
        f"Creep laws were identified from {plural(tests, 'test')}{materials}: {frames}.",
        how,
        *([_orthogonal(followed, run_outs)] if followed else []),
    ]


def _orthogonal(followed: int, run_outs: int) -> str:
    """The residual of tests that are compared up to rupture."""
    stopped = (
        f" {plural(run_outs, 'test')} stopped before rupture count only where they lasted longer than predicted."
        if run_outs
        else ""
    )
    return (
        f"The readings of {plural(followed, 'test')} followed to the end have orthogonal residuals: with a, the "
        "difference of predicted and measured transformed strain at the time of a reading, and b, the difference of "
        "the logarithms of the measured time and of the time at which the measured strain is predicted, the residual "
        "is √2 |a b| / √(a² + b²) with the sign of a, a distance from the predicted curve over ln t; rupture times "
        f"have ln(measured / predicted).{stopped}"
    )


def loading(found: GroupFindings) -> list[str]:
    """What was held in uniaxial tests, what their strains are, and the elastic data that were used."""
    histories = found.fit.histories
    uniaxial = [h for h in histories if "strain" in h.outputs]
    sentences = []
    controls = {str(getattr(h.loading, "control", "")) for h in histories} - {""}
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
    return [*sentences, *_elastic(histories)]


def _elastic(histories: Sequence[History]) -> list[str]:
    """Young's modulus and Poisson's ratio of the tests that state them, at their mean temperatures."""
    known = [h.elastic.at(h.mean_temperature) for h in histories if h.elastic is not None]
    if not known:
        return []
    moduli = _range([1e-3 * float(one.E) for one in known])
    ratios = _range([float(one.nu) for one in known])
    return [f"Young's modulus is {moduli} GPa and Poisson's ratio {ratios} in {plural(len(known), 'test')}."]


def _range(values: Sequence[float]) -> str:
    low, high = number(min(values), 4), number(max(values), 4)
    return low if low == high else f"{low} to {high}"


# ---- models ----------------------------------------------------------------------------------------------------------


def models(fit: Identification) -> list[str]:
    """By what the tests were predicted: the specimen's own words on it, the surrogate, and the reduced-order model."""
    name = str(fit.provenance.get("specimen", "")).strip()
    sentences = [f"The tests were predicted by the model of the specimen '{printable(name, 80)}'." if name else ""]
    predictor = fit.predictor
    if predictor is None:
        return sentences
    specimen = predictor.specimen
    if specimen is not predictor and not predictor.parts:
        sentences[0] = f"The tests were predicted by a surrogate of the specimen '{printable(specimen.label)}'."
    tests: dict[str, tuple[Any, list[History]]] = {}
    for history in fit.histories:
        own = specimen.for_history(history)
        tests.setdefault(own.label, (own, []))[1].append(history)
    for piece, histories in tests.values():
        if text := piece.model_text(histories):
            sentences.append(sentence(text))
    if predictor.reduced_order_model() is not None:
        sentences.append("The global search used the reduced-order model of these finite elements.")
    return sentences


# ---- laws ------------------------------------------------------------------------------------------------------------


def laws(found: Sequence[GroupFindings], references: References) -> list[str]:
    """The laws by their titles and the numbers of their equations, with what they cite, and their T_ref."""
    tried = laws_of(found)
    named = [
        f"the {title_in_sentence(law)}, Eq. ({k}){references.cite(*law.references)}"
        for k, law in enumerate(tried.values(), start=1)
    ]
    first = f"The law was {named[0]}." if len(named) == 1 else f"The laws tried were {'; '.join(named)}."
    return [first, *_reference_temperature(found)]


def _reference_temperature(found: Sequence[GroupFindings]) -> list[str]:
    """About which temperature Arrhenius factors are, and how that was chosen where it shows."""
    factors = {T for one in found for T in _reference_temperatures(one.fit.law)}
    if not factors:
        return []
    shown = listed([f"{number(T, 6)} K" for T in sorted(factors)])
    medians = {reference_temperature(one.fit.histories) for one in found if one.fit.histories}
    chosen = ", the median temperature of the tests rounded to 10 °C" if factors == medians else ""
    return [f"Rate coefficients of laws with an activation energy are those at T_ref = {shown}{chosen}."]


def _reference_temperatures(law: CreepLaw) -> Iterable[float]:
    rates = [*law.terms.values(), *(state.rate for state in law.states.values())]
    exponents = (part for rate in rates for e in rate.atoms(sympy.exp) for part in sympy.Add.make_args(e.args[0]))
    return (found.T_ref for found in map(arrhenius_exponent, exponents) if found is not None)


# ---- citations -------------------------------------------------------------------------------------------------------


CITATIONS = {
    "sobol": "I. M. Sobol' (1967), USSR Comput. Math. Math. Phys. 7(4), 86-112",
    "trust region": "M. A. Branch, T. F. Coleman, Y. Li (1999), SIAM J. Sci. Comput. 21(1), 1-23",
    "weighted least squares": "G. A. F. Seber, C. J. Wild (1989), Nonlinear Regression, Wiley, New York",
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
    "chen": f"{PAPER}, Eq. (S3)",
    "student": "K. L. Lange, R. J. A. Little, J. M. G. Taylor (1989), J. Am. Stat. Assoc. 84, 881-896",
    "swarm": "M. Clerc, J. Kennedy (2002), IEEE Trans. Evol. Comput. 6(1), 58-73",
    "pysindy": "B. M. de Silva et al. (2020), J. Open Source Softw. 5(49), 2104",
    "creepkit": f"The authors of creepkit, creepkit (software), version {version('creepkit')}, licence Apache-2.0",
}
"""{key: citation} of methods, and of creepkit as CITATION.cff has it; those of laws stand in the laws."""


_MARK = re.compile(r"⟦([0-9]+(?:,[0-9]+)*)⟧")
"""What stands for a citation until its number is known."""


class References:
    """Citations of a text, numbered in the order in which they stand in it."""

    def __init__(self) -> None:
        self._texts: dict[str, int] = {}

    def cite(self, *citations: str) -> str:
        """A mark, after a space, for citations or keys of CITATIONS, which `numbered` replaces; "" for none."""
        texts = [CITATIONS.get(c, printable(c, 400)) for c in citations]
        marks = dict.fromkeys(self._texts.setdefault(text, len(self._texts)) for text in texts)
        return f" ⟦{','.join(map(str, marks))}⟧" if marks else ""

    def numbered(self, text: str) -> tuple[str, list[str]]:
        """A text with ' [1, 2]' for its marks, in rising order, and its citations, the one of number 1 first."""
        order: dict[int, int] = {}

        def numbers(mark: re.Match[str]) -> str:
            cited = [int(one) for one in mark[1].split(",")]
            if max(cited) >= len(self._texts):  # brackets that stand in a name
                return mark[0]
            found = sorted(order.setdefault(one, len(order) + 1) for one in cited)
            return f"[{', '.join(map(str, found))}]"

        shown, texts = _MARK.sub(numbers, text), [*self._texts]
        return shown, [texts[one] for one in order]


def listed(words: Sequence[str]) -> str:
    """Words with commas, and 'and' before the last."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}" if words else "none"
