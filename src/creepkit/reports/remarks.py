"""What limits the trust in an identification, and what its tests may hide, in words: remarks beside its verdict.

The engine finds kinds and numbers (inverse.nuisance_plausibility, inverse.nuisance_parameters, inverse.
defect_correction, inverse.selection.challenges); sentences have no full stop.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from creepkit.inverse.nuisance_parameters import DRIFT, OFFSET, Perturbation, beyond_intervals
from creepkit.inverse.uncertainty.laplace_approximation import cut_intervals
from creepkit.records import output_unit

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
        yield "the search ended once: whether another minimum is lower was not examined (raise starts)"
    yield from map(implausible_text, fit.adequacy.implausible if fit.adequacy is not None else ())
    for name, bound in cut_intervals(fit.law, fit.estimates).items():
        yield (
            f"the interval of {name} ends at its bound, {bound:.4g}, and not by the tests: intervals of rates and of "
            "the local exponent do not know this bound and may reach beyond it"
        )
    if fit.numerical_error is not None:
        yield numerical_error_text(fit.numerical_error)


def numerical_error_text(found: NumericalError) -> str:
    """What the predictor was wrong by, and what it would have done to the values."""
    sizes = ", ".join(f"{size:.2g} {output_unit(name)}".strip() + f" in {name}" for name, size in found.size.items())
    incomplete = f"; {', '.join(found.incomplete)} could not be corrected" if found.incomplete else ""
    return (
        f"at the optimum {found.predictor} differs from {found.refined} by {sizes} (rms); at most {found.noises:.2g} "
        f"noises. This is corrected, and would have moved values by up to {found.shift:.2g} of their standard "
        f"deviations{incomplete}{'' if found.settled else '; a further correction may move them again'}"
    )


# ---- nuisances -------------------------------------------------------------------------------------------------------


def nuisance_text(one: ImplausibleNuisance) -> str:
    """Such as "an offset of 0.095 mm in amplitude of 'D1', 24 % of its largest value"."""
    where = f"in {one.output} of '{one.owner}'" if one.output else f"in '{one.owner}'"
    return f"{_article(one.kind)} {one.kind} of {_amount(one.value, one.unit)} {where}{_share(one)}"


def implausible_text(one: ImplausibleNuisance) -> str:
    """How far it lies from what it stands for."""
    size = {
        "stated": "the standard deviation that was stated for it",
        "noise": "the noise of a frame",
        "usual": f"a usual {one.kind}",
    }[one.size_source]
    return (
        f"the {one.kind}{f' of {one.output}' if one.output else ''} of '{one.owner}' is "
        f"{_amount(one.value, one.unit)}{_share(one)}, {one.standard_deviations:.2g} times {size} "
        f"({_amount(one.size, one.unit)}): it stands for more than its name says, look at the test or try another law"
    )


def _share(one: ImplausibleNuisance) -> str:
    if not np.isfinite(one.share):
        return ""
    return f", {100 * one.share:.2g} % {'of its largest value' if one.output else 'from its nominal length'}"


def _amount(value: float, unit: str) -> str:
    return f"{value:.2g} {unit}".strip()


def _article(noun: str) -> str:
    return "an" if noun[0] in "aeiou" else "a"


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
    alone, energy = one.tests == 1, ""
    each = "the test" if alone else f"each of {one.tests} tests"
    if np.isfinite(one.per_kelvin):
        whence = "assumed" if one.assumed else "by the law"
        energy = f" ({100 * float(np.expm1(one.per_kelvin)):.2g} % a kelvin, {whence})"
    if one.kind == DRIFT:
        drift = "a linear drift of" if alone else "independent linear drifts of the temperature,"
        cause = f"{drift} {one.size:.2g} K over {each}"
    else:
        kind, what = ("offset", _output(one.kind)) if one.kind.startswith(OFFSET) else ("error", one.kind)
        cause = f"{f'an {kind}' if alone else f'independent {kind}s'} of {one.amount} in the {what} of {each}"
    return f"by {change_text(one.rate_change)}{'' if alone else ' (one standard deviation)'} with {cause}{energy}"


def _not_included(perturbations: Sequence[Perturbation]) -> tuple[str, ...]:
    """On what intervals do not include, with what it would do to the rate; none where that is little."""
    told = [perturbation_text(p) for p in beyond_intervals(perturbations) if p.rate_change > NOTEWORTHY_CHANGE]
    return (f"the intervals do not include what would move the rate amid the tests: {'; '.join(told)}",) if told else ()


def _output(kind: str) -> str:
    return kind.removeprefix(OFFSET).replace("_", " ")


# ---- challenges ------------------------------------------------------------------------------------------------------


def challenge_text(one: Challenge) -> str:
    """What the tests allow beside the best law, to follow "but"."""
    if one.kind == "unmodelled effect" and one.laws:
        sizes = " or with ".join(map(_size_text, one.sizes))
        beside = f" (weight {one.weights[1]:.2f})" if one.weights else ""
        return f"with {sizes} {' or '.join(one.laws)} would explain them{beside}"
    if one.kind == "unmodelled effect":
        (own, others), (usual,) = one.weights, one.sizes
        effect = Perturbation(usual.kind, usual.size, usual.unit).description
        return f"{effect}, which was not modelled, would leave it a weight of {own:.2f} ({one.other}: {others:.2f})"
    altered = f"a sum with {one.other}" if one.kind == "sum" else one.subject
    if one.excess is None:
        return f"whether {altered} explains them as well could not be examined"
    if one.kind == "sum":
        altered = f"a share of {100 * one.size:.0f} % of the rate by {one.other}"
    else:
        altered = f"{altered} of {one.size:.3g} MPa"
    difference = f"its chi-square is {abs(one.excess):.1f} {'higher' if one.excess > 0 else 'lower'}"
    if one.fits_better:
        return f"{altered} fits better ({difference})"
    if abs(one.excess) < SMALLEST_SHOWN:
        return f"{altered} explains them as well (its chi-square is the same)"
    return f"{altered} {'is not excluded' if one.excess > 0 else 'explains them as well'} ({difference})"


def _size_text(one: PerturbationSize) -> str:
    """A perturbation with the size at which a law explains the tests."""
    where = "the test" if one.tests == 1 else f"each of the {one.tests} tests"
    if one.unit == "%":
        share = f"{abs(one.size):.2g} %"
        if one.differs:
            return f"independent errors of up to {share} in the {one.kind} of {where}"
        side, where = "smaller" if one.size < 0 else "larger", f" in {where}" if one.tests > 1 else ""
        return f"a {one.kind} {share} {side}{where}"
    amount = f"{'up to ' if one.differs else ''}{one.size:{'' if one.differs else '+'}.2g} {one.unit}".strip()
    if one.kind == DRIFT:
        return f"{'independent drifts' if one.differs else 'a drift'} of the temperature of {amount} over {where}"
    return f"{'independent offsets' if one.differs else 'an offset'} of {amount} in the {_output(one.kind)} of {where}"
