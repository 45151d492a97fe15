"""Laws that the tests at hand cannot separate, found by what they predict and not by their names.

Two fitted laws are looked at in the plane of the data. With r_a and r_b their residuals on the same frames and C the
covariance of the best one,

    d2 = (r_a - r_b)' C^-1 (r_a - r_b)

is the chi-square between their predictions: if one of them is true, the other is expected to be worse by d2. Below
2 ln 19 = 5.9 no weight of .95 is to be expected even then: these tests do not tell the laws apart. A law that another
one becomes where a parameter takes its `off` value (m = 0) is equivalent too where the parameter's interval holds it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import LawError
from creepkit.inverse.identification import Identification
from creepkit.inverse.intervals.mixture import WeightedLaws
from creepkit.inverse.intervals.quantities import local_exponent
from creepkit.inverse.problem import least_squares_problem
from creepkit.inverse.selection.judging import under_common_covariance
from creepkit.language import CreepLaw, strain, time

DISTINGUISHABLE_CHI_SQUARE = 2.0 * float(np.log(0.95 / 0.05))
"""Chi-square between predictions from which on a test can be expected to decide."""
STRESS_POINTS = 21
"""Stresses at which local exponents are compared."""


@dataclass(frozen=True)
class EquivalentLaws:
    """Two laws that the tests cannot separate.

    first, second : their names, the better one first. chi_square : between their predictions on the tests.
    reduced : "m = 0" where the richer law becomes the other one so, and the tests allow it; else empty.
    sentence : for people.
    """

    first: str
    second: str
    chi_square: float
    reduction: str
    sentence: str

    def __str__(self) -> str:
        return self.sentence


def equivalent_laws(ranking: WeightedLaws) -> tuple[EquivalentLaws, ...]:
    """The pairs of a ranking's laws that its tests cannot separate, nearest predictions first."""
    fits = [r.fit for r in ranking.laws]
    whitened = _whitened_residuals(fits)
    pairs = []
    for a, b in combinations(range(len(fits)), 2):
        chi_square = float(((whitened[a] - whitened[b]) ** 2).sum())
        richer_law, reduction = _reduction_between(fits[a], fits[b])
        if chi_square < DISTINGUISHABLE_CHI_SQUARE or reduction:
            sentence = _equivalence_sentence(fits[a], fits[b], chi_square, richer_law, reduction)
            pairs.append(EquivalentLaws(fits[a].law.name, fits[b].law.name, chi_square, reduction, sentence))
    return tuple(sorted(pairs, key=lambda pair: pair.chi_square))


def _whitened_residuals(fits: Sequence[Identification]) -> Floats:
    """(laws, data) residuals of all laws at their optima over one scatter.

    Identifications by likelihood keep what that takes; others are predicted again, under the covariance of the first.
    """
    if all(fit.linearised is not None for fit in fits):
        return under_common_covariance(fits).whitened
    problems = [least_squares_problem(fit) for fit in fits]
    present = problems[0].residual_function.observations.present
    whitened = [np.linalg.solve(problems[0].covariance_factor, p.residuals.values[..., None])[..., 0][present] for p in problems]
    return np.array(whitened)


def _reduction_between(first: Identification, second: Identification) -> tuple[str, str]:
    """(name of the richer law, "m = 0") where one law with a parameter off is the other, within its interval."""
    for richer, simpler in ((first, second), (second, first)):
        for name, value, law in _laws_with_parameter_off(richer.law):
            if _is_same_function(law, simpler.law) and _interval_contains(richer, name, value):
                return richer.law.name, f"{name} = {value:g}"
    return "", ""


def _laws_with_parameter_off(law: CreepLaw) -> Iterator[tuple[str, float, CreepLaw]]:
    """(parameter, its off value, the law that is left) for every parameter that can be switched off."""
    for name, param in law.table.items():
        if param.off is None:
            continue
        try:
            yield name, param.off, law.fix(**{name: param.off})
        except LawError:  # nothing is left of the law
            continue


def _is_same_function(first: CreepLaw, second: CreepLaw) -> bool:
    """Whether two laws are the same function of point and parameters, whatever these are called."""
    return first.fingerprint.rpartition("-")[2] == second.fingerprint.rpartition("-")[2]


def _interval_contains(fit: Identification, name: str, value: float) -> bool:
    (estimate,) = (candidate for candidate in fit.estimates if candidate.name == name)
    tolerance = 1e-6 * (estimate.high - estimate.low)
    return estimate.low - tolerance <= value <= estimate.high + tolerance


def _equivalence_sentence(a: Identification, b: Identification, chi_square: float, richer_law: str, reduction: str) -> str:
    """What is the same, in what sense, and where."""
    names = f"{a.law.name} and {b.law.name}"
    parts = [f"{names} cannot be told apart by these tests: chi-square {chi_square:.2g} between their predictions"]
    if reduction:
        parts.append(f"{richer_law} with {reduction} is the other law, and the tests allow it")
    lowest, highest = a.ranges["stress"]
    constant_loads = all(_is_constant(h.loading.program().values) for h in a.histories)
    if highest <= 1.001 * lowest:
        parts.append(f"every test holds one stress, {lowest:.4g} MPa")
    elif not any(fit.law.uses(symbol) for fit in (a, b) for symbol in (strain, time)):
        parts.append(_exponent_sentence(a, b, lowest, highest))
    elif constant_loads and _differ_in_hardening(a.law, b.law):
        parts.append("no test changes its load, and hardening by strain and by time differ only after a change")
    return "; ".join(parts)


def _exponent_sentence(a: Identification, b: Identification, lowest: float, highest: float) -> str:
    grid = np.geomspace(lowest, highest, STRESS_POINTS)
    first_exponents, second_exponents = (local_exponent(fit.coordinates, grid)(fit.u) for fit in (a, b))
    ranges = [f"{float(exponents.min()):.2f} to {float(exponents.max()):.2f}" if np.ptp(exponents) > 0.005 else f"{float(exponents[0]):.2f}"
              for exponents in (first_exponents, second_exponents)]  # fmt: skip
    return (
        f"over {lowest:.4g} to {highest:.4g} MPa their local exponents are {ranges[0]} and {ranges[1]}, never more than "
        f"{float(np.abs(first_exponents - second_exponents).max()):.2g} apart"
    )


def _is_constant(levels: Floats) -> bool:
    """Whether a program holds one level, but for the ramp that reaches it."""
    return bool(np.ptp(levels[levels > 0]) <= 1e-3 * levels.max()) if (levels > 0).any() else True


def _differ_in_hardening(first: CreepLaw, second: CreepLaw) -> bool:
    """Whether one law hardens by its strain and the other by time."""
    hardening = [(law.uses(strain), law.uses(time)) for law in (first, second)]
    return hardening in ([(True, False), (False, True)], [(False, True), (True, False)])
