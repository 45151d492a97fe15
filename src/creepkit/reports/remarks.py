"""What limits the trust in an identification, and what its tests may hide: remarks beside its verdict.

The engine finds kinds and numbers (inverse.nuisance_plausibility, inverse.nuisance_parameters, inverse.
defect_correction, inverse.selection.challenges); creepkit.reports.words has the sentences.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from creepkit.inverse.nuisance_parameters import DRIFT, OFFSET, Perturbation, beyond_intervals
from creepkit.inverse.uncertainty.laplace_approximation import cut_intervals
from creepkit.records import output_unit
from creepkit.reports.wording import say
from creepkit.reports.words import CHALLENGES, PERTURBATIONS, REMARKS, SIZES

if TYPE_CHECKING:
    from creepkit.inverse.defect_correction import NumericalError
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.nuisance_plausibility import ImplausibleNuisance
    from creepkit.inverse.selection.challenges import Challenge, PerturbationSize

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
    amounts = {"amount": _amount(one.value, one.unit), "size": _amount(one.size, one.unit)}
    article, expected = "an" if one.kind[0] in "aeiou" else "a", say(REMARKS[one.size_source], one=one)
    return say(REMARKS[kind], one=one, share=share, article=article, expected=expected, **amounts)


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
    side = "higher" if one.excess > 0 else "lower"
    kind = "better" if one.fits_better else "same" if abs(one.excess) < SMALLEST_SHOWN else side
    return say(CHALLENGES[kind], altered=say(CHALLENGES[one.kind], one=one), difference=abs(one.excess), side=side)


def _size_text(one: PerturbationSize) -> str:
    """A perturbation with the size at which a law explains the tests."""
    each = f"each of the {one.tests} tests" * (one.tests > 1)
    kind = "length" if one.unit == "%" else "drift" if one.kind == DRIFT else "offset"
    amount = f"{abs(one.size) if one.differs else one.size:{'' if one.differs else '+'}.2g} {one.unit}".strip()
    of = {"what": _read(one.kind), "each": each, "where": each or "the test", "amount": amount}
    smaller = "smaller" if one.size < 0 else "larger"
    return say(SIZES[kind + "s" * one.differs], size=abs(one.size), smaller=smaller, **of)
