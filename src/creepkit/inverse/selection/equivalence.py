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
from creepkit.inverse.intervals.mixture import Laws
from creepkit.inverse.intervals.quantities import local_exponent
from creepkit.inverse.problem import reopened
from creepkit.inverse.selection.judging import judged
from creepkit.language import CreepLaw, strain, time

SEPARATED = 2.0 * float(np.log(0.95 / 0.05))
"""Chi-square between predictions from which on a test can be expected to decide."""
GRID = 21
"""Stresses at which local exponents are compared."""


@dataclass(frozen=True)
class Equivalence:
    """Two laws that the tests cannot separate.

    first, second : their names, the better one first. chi_square : between their predictions on the tests.
    reduced : "m = 0" where the richer law becomes the other one so, and the tests allow it; else empty.
    sentence : for people.
    """

    first: str
    second: str
    chi_square: float
    reduced: str
    sentence: str

    def __str__(self) -> str:
        return self.sentence


def equivalents(ranking: Laws) -> tuple[Equivalence, ...]:
    """The pairs of a ranking's laws that its tests cannot separate, nearest predictions first."""
    fits = [r.fit for r in ranking.laws]
    white = _white(fits)
    found = []
    for a, b in combinations(range(len(fits)), 2):
        d2 = float(((white[a] - white[b]) ** 2).sum())
        richer, reduced = _reduction(fits[a], fits[b])
        if d2 < SEPARATED or reduced:
            told = _sentence(fits[a], fits[b], d2, richer, reduced)
            found.append(Equivalence(fits[a].law.name, fits[b].law.name, d2, reduced, told))
    return tuple(sorted(found, key=lambda pair: pair.chi_square))


def _white(fits: Sequence[Identification]) -> Floats:
    """(laws, data) residuals of all laws at their optima over one scatter.

    Identifications by likelihood keep what that takes; others are predicted again, under the covariance of the first.
    """
    if all(fit.linear is not None for fit in fits):
        return judged(fits).white
    problems = [reopened(fit) for fit in fits]
    present = problems[0].objective.entries.present
    whole = [np.linalg.solve(problems[0].factor, p.residuals.values[..., None])[..., 0][present] for p in problems]
    return np.array(whole)


def _reduction(first: Identification, second: Identification) -> tuple[str, str]:
    """(name of the richer law, "m = 0") where one law with a parameter off is the other, within its interval."""
    for rich, plain in ((first, second), (second, first)):
        for name, value, law in _switched_off(rich.law):
            if _same(law, plain.law) and _within(rich, name, value):
                return rich.law.name, f"{name} = {value:g}"
    return "", ""


def _switched_off(law: CreepLaw) -> Iterator[tuple[str, float, CreepLaw]]:
    """(parameter, its off value, the law that is left) for every parameter that can be switched off."""
    for name, param in law.table.items():
        if param.off is None:
            continue
        try:
            yield name, param.off, law.fix(**{name: param.off})
        except LawError:  # nothing is left of the law
            continue


def _same(first: CreepLaw, second: CreepLaw) -> bool:
    """Whether two laws are the same function of point and parameters, whatever these are called."""
    return first.fingerprint.rpartition("-")[2] == second.fingerprint.rpartition("-")[2]


def _within(fit: Identification, name: str, value: float) -> bool:
    (own,) = (e for e in fit.estimates if e.name == name)
    room = 1e-6 * (own.high - own.low)
    return own.low - room <= value <= own.high + room


def _sentence(a: Identification, b: Identification, d2: float, richer: str, reduced: str) -> str:
    """What is the same, in what sense, and where."""
    names = f"{a.law.name} and {b.law.name}"
    parts = [f"{names} cannot be told apart by these tests: chi-square {d2:.2g} between their predictions"]
    if reduced:
        parts.append(f"{richer} with {reduced} is the other law, and the tests allow it")
    low, high = a.ranges["stress"]
    held = all(_constant(h.loading.program().values) for h in a.histories)
    if high <= 1.001 * low:
        parts.append(f"every test holds one stress, {low:.4g} MPa")
    elif not any(fit.law.uses(symbol) for fit in (a, b) for symbol in (strain, time)):
        parts.append(_of_exponents(a, b, low, high))
    elif held and _hardens_otherwise(a.law, b.law):
        parts.append("no test changes its load, and hardening by strain and by time differ only after a change")
    return "; ".join(parts)


def _of_exponents(a: Identification, b: Identification, low: float, high: float) -> str:
    grid = np.geomspace(low, high, GRID)
    ours, theirs = (local_exponent(fit.coordinates, grid)(fit.u) for fit in (a, b))
    spread = [f"{float(n.min()):.2f} to {float(n.max()):.2f}" if np.ptp(n) > 0.005 else f"{float(n[0]):.2f}"
              for n in (ours, theirs)]  # fmt: skip
    return (
        f"over {low:.4g} to {high:.4g} MPa their local exponents are {spread[0]} and {spread[1]}, never more than "
        f"{float(np.abs(ours - theirs).max()):.2g} apart"
    )


def _constant(levels: Floats) -> bool:
    """Whether a program holds one level, but for the ramp that reaches it."""
    return bool(np.ptp(levels[levels > 0]) <= 1e-3 * levels.max()) if (levels > 0).any() else True


def _hardens_otherwise(first: CreepLaw, second: CreepLaw) -> bool:
    """Whether one law hardens by its strain and the other by time."""
    own = [(law.uses(strain), law.uses(time)) for law in (first, second)]
    return own in ([(True, False), (False, True)], [(False, True), (True, False)])
