"""Correlation of estimates, and what the tests do not determine.

A and n of a power law are each known poorly and their combination, the rate in the middle of the tests, well: the
correlation says so. In the author's parameters (ln of a coefficient) it is often beyond 0.99; in the conditioned
coordinates (see inverse.coordinates), where the ln rate at the reference point stands for a coefficient and the local
exponent there for what only it shows, small.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.checked_arguments import checked
from creepkit.errors import FitError
from creepkit.inverse.identification import Identification
from creepkit.inverse.uncertainty.laplace_approximation import NOT_DETERMINED, POORLY_DETERMINED
from creepkit.records.presentable import Presentable
from creepkit.records.units import celsius_text

CoordinateSystem = Literal["author", "conditioned"]


LOOSE = (NOT_DETERMINED, POORLY_DETERMINED)
"""Verdicts on parameters of which other ones, or a combination, may be determined."""


STRONG_CORRELATION = 0.95
"""Correlation beyond which two parameters are determined only together."""


WELL_DETERMINED_SD = 0.1
"""Standard deviation of a combination, over that which its parameters' bounds alone would leave, that is well known."""


@dataclass(frozen=True, eq=False)
class Correlation(Presentable):
    """The correlation of estimates: matrix (parameters, parameters) -, and sd (parameters,) on the internal scale.

    names : as the matrix is to be read, "ln A" where the logarithm is meant, "ln rate" of a conditioned coefficient.
    """

    names: tuple[str, ...]
    matrix: Floats
    sd: Floats
    title: str = ""

    def __repr__(self) -> str:
        return f"<Correlation of {', '.join(self.names)}>"

    def between(self, first: str, second: str) -> float:
        """The correlation of two of the names."""
        for name in (first, second):
            if name not in self.names:
                raise FitError(f"there is no '{name}' in this correlation; it has {', '.join(self.names)}")
        return float(self.matrix[self.names.index(first), self.names.index(second)])

    shown_by = "identification.correlation_text"


@checked
def correlation(fit: Identification, coordinates: CoordinateSystem = "author") -> Correlation:
    """The correlation of a fit's estimates, in the author's parameters or in the conditioned coordinates."""
    covariance = fit.covariance if coordinates == "conditioned" else _covariance_of_parameters(fit)
    sd = np.sqrt(np.diag(covariance))
    matrix = covariance / np.outer(sd, sd)
    title = f"{fit.law.title or fit.law.name}, {coordinates} coordinates"
    return Correlation(_parameter_names(fit, coordinates), np.clip(0.5 * (matrix + matrix.T), -1.0, 1.0), sd, title)


def undetermined(fit: Identification) -> tuple[str, ...]:
    """What the tests do not or poorly determine, a sentence a group of parameters, and which combination they do.

    A parameter counts as such where the verdict of its estimate says so; those tied to it by a correlation of 0.95 or
    more belong to its group. Empty where every parameter is determined.
    """
    undetermined_indices = np.flatnonzero([one.verdict in LOOSE for one in fit.estimates])
    groups = _groups(fit, undetermined_indices)
    sentences = [_undetermined_sentence(fit, group) for group in groups]
    return (*sentences, _determined_sentence(fit)) if sentences else ()


def _covariance_of_parameters(fit: Identification) -> Floats:
    to_theta = fit.coordinates.jacobian(fit.u)
    return np.asarray(to_theta @ fit.covariance @ to_theta.T)


def _parameter_names(fit: Identification, coordinate_system: CoordinateSystem) -> tuple[str, ...]:
    """The parameters as they are correlated; in conditioned coordinates what replaces some of them."""
    names = [f"ln {n}" if p.scale == "log" else n for n, p in fit.law.table.items()]
    if coordinate_system == "author":
        return tuple(names)
    coordinates = fit.coordinates
    exponents = tuple(local.position for local in coordinates.exponents)
    for label, positions in (("ln rate", coordinates.coefficients), ("local exponent", exponents)):
        for k in positions:
            names[k] = label if len(positions) == 1 else f"{label} ({fit.law.names[k]})"
    return tuple(names)


def _bound_widths(fit: Identification) -> Floats:
    """(parameters,) of the bounds, on the internal scale."""
    return np.asarray(np.ptp(fit.law.internal_bounds, axis=0))


def _relative_widths(fit: Identification) -> Floats:
    """(parameters,) width of the interval over that of the bounds."""
    ends = [[fit.law.table[e.name].to_internal(v) for v in (e.low, e.high)] for e in fit.estimates]
    return np.asarray(np.ptp(np.array(ends, float), axis=1) / _bound_widths(fit))


def _groups(fit: Identification, undetermined_indices: Ints) -> list[list[int]]:
    """Undetermined parameters with all that are correlated with them, joined where they share one."""
    is_correlated = np.abs(correlation(fit).matrix) > STRONG_CORRELATION
    groups: list[set[int]] = []
    for k in undetermined_indices:
        members = {int(k), *(int(j) for j in np.flatnonzero(is_correlated[k]))}
        overlapping = [g for g in groups if g & members]
        groups = [g for g in groups if not g & members] + [members.union(*overlapping)]
    return [sorted(group) for group in groups]


def _undetermined_sentence(fit: Identification, group: list[int]) -> str:
    names = [fit.law.names[k] for k in group]
    if len(group) == 1:
        estimate, param = fit.estimates[group[0]], fit.law.table[names[0]]
        of_bounds = f"fills {100 * float(_relative_widths(fit)[group[0]]):.0f} % of its bounds"
        width = f"spans a factor of {estimate.high / estimate.low:.2g}" if param.scale == "log" else of_bounds
        interval = f"its interval [{estimate.low:.3g}, {estimate.high:.3g}] {width}"
        return f"the parameter {names[0]} ({param.meaning}) is {estimate.verdict}: {interval}"
    loose = [name for k, name in zip(group, names, strict=True) if fit.estimates[k].verdict in LOOSE]
    tied = [name for name in names if name not in loose]
    several = len(loose) > 1
    sentence = f"the parameter{'s' * several} {_listed(loose)} {'are' if several else 'is'} not determined singly"
    if tied:
        sentence += (
            f"; {_listed(tied)} {'are' if len(tied) > 1 else 'is'} tied to {'them' if several else 'it'} by a "
            f"correlation of {STRONG_CORRELATION:g} or more, which the interval{'s' * (len(tied) > 1)} stated "
            f"allow{'s' * (len(tied) == 1)} for"
        )
    combination = _best_determined_combination(fit, group)
    whose = "the combination of all of these," if tied else "their combination"
    return f"{sentence}; {whose} {combination}{',' * bool(tied)} is" if combination else sentence


def _listed(names: Sequence[str]) -> str:
    return f"{', '.join(names[:-1])} and {names[-1]}" if len(names) > 1 else names[0]


def _best_determined_combination(fit: Identification, group: list[int]) -> str:
    """The combination of a group that is known best, against what its bounds leave; empty where none is known well.

    In parameters over the width of their bounds it is the eigenvector of the covariance of least eigenvalue.
    """
    widths = _bound_widths(fit)[group]
    covariance = _covariance_of_parameters(fit)[np.ix_(group, group)] / np.outer(widths, widths)
    values, vectors = np.linalg.eigh(covariance)
    if np.sqrt(max(values[0], 0.0)) > WELL_DETERMINED_SD / np.sqrt(12.0):
        return ""
    weights = vectors[:, 0] / widths
    weights /= weights[np.abs(weights * widths).argmax()]
    theta = fit.coordinates.theta(fit.u)[group]
    sd = float(np.sqrt(weights @ (covariance * np.outer(widths, widths)) @ weights))
    names = [_parameter_names(fit, "author")[k] for k in group]
    return f"{_combination_text(weights, names)} = {float(weights @ theta):.4g} +- {sd:.2g}"


def _combination_text(weights: Floats, names: list[str]) -> str:
    """The combination in words, that of weight one first."""
    first, *others = sorted(range(weights.size), key=lambda k: bool(abs(weights[k] - 1.0) > 1e-12))
    parts = [f"{'+' if weights[k] > 0 else '-'} {abs(weights[k]):.3g} {names[k]}" for k in others]
    return " ".join([names[first], *parts])


def _determined_sentence(fit: Identification) -> str:
    """The rate and the local exponent in the middle of the tests, with what is known of them."""
    reference = fit.reference
    rate, rate_low, rate_high = (float(v) for v in fit.rate(reference.stress, warn=False))
    exponent, exponent_low, exponent_high = (float(v) for v in fit.local_exponent(reference.stress, warn=False))
    return (
        f"what the tests see at {reference.stress:.4g} MPa, {celsius_text(reference.temperature)}: the local "
        f"exponent is {exponent:.3g} [{exponent_low:.3g}, {exponent_high:.3g}], "
        f"the rate {rate:.3g} [{rate_low:.3g}, {rate_high:.3g}] 1/s"
    )
