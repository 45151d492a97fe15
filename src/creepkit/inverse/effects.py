"""Explicit nuisances: what is unknown about tests and changes their simulation, as further unknowns of the fit.

The fit looks for x = (u, e): conditioned coordinates of the law, then one number for each test, alloy or all tests
of each explicit nuisance. Their priors are residuals (e - mean) / sd beside those of the data.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.errors import FitError
from creepkit.inverse.residuals import Residuals
from creepkit.inverse.together import offers, predictor_of
from creepkit.records import ABSOLUTE, EXPLICIT, History, Nuisance, Predictor

SPREAD = {"thickness": 0.03, "window": 0.3, "modulus": 0.05, "temperature": 5.0}
"""Where the estimate of an unknown spread begins: mm, mm, relative, K."""
LIMITS = {"thickness": (0.3, 3.0), "window": (0.3, 3.0), "modulus": (-0.7, 2.0), "temperature": (-150.0, 150.0)}
"""Where an unknown may go at most; thickness and window as multiples of their mean."""
LEAST = 1e-3
"""Of the first spread: below this an estimated spread is zero."""


@dataclass(frozen=True, eq=False)
class Unknowns:
    """The unknowns e of explicit nuisances.

    nuisances, members : of each unknown, its nuisance and whose it is (a test, an alloy, or "all").
    place : {kind: (tests,)} which unknown is a test's own, -1 where its predictor does not know the kind.
    mean, sd, low, high : (unknowns,) prior and limits; sd may be infinite.
    held : whether they stay at their means, as in a global search.
    """

    nuisances: tuple[Nuisance, ...]
    members: tuple[str, ...]
    place: Mapping[str, Ints]
    mean: Floats
    sd: Floats
    low: Floats
    high: Floats
    held: bool = False

    @classmethod
    def of(cls, nuisances: Sequence[Nuisance], histories: Sequence[History], using: Predictor) -> Unknowns:
        """One unknown for each test, alloy or all tests that a kind is known to matter for."""
        owners: list[tuple[Nuisance, str]] = []
        place: dict[str, Ints] = {}
        for nuisance in (n for n in nuisances if n.kind in EXPLICIT):
            known = [offers(predictor_of(using, h), nuisance.kind) for h in histories]
            if not any(known):
                raise FitError(
                    f"nuisance '{nuisance.kind}' means nothing to the predictor of these histories; leave it out"
                )
            members = [member_of(nuisance, h) for h in histories]
            mine = list(dict.fromkeys(m for m, k in zip(members, known, strict=True) if k))
            first = len(owners)
            place[nuisance.kind] = np.array(
                [first + mine.index(m) if k else -1 for m, k in zip(members, known, strict=True)], np.int64
            )
            if nuisance.sd is None and len(mine) < 2:
                raise FitError(
                    f"nuisance '{nuisance.kind}': a spread cannot be estimated from a single unknown; give its sd="
                )
            owners += [(nuisance, member) for member in mine]
        kinds, by_name = [n for n, _ in owners], {h.name: h for h in histories}
        means = [prior_mean(n, by_name.get(member), using) for n, member in owners]
        ends = [_limits(n, mean) for n, mean in zip(kinds, means, strict=True)]
        return cls(
            tuple(kinds), tuple(m for _, m in owners), place, np.array(means, float),
            np.array([SPREAD[n.kind] if n.sd is None else n.sd for n in kinds], float),
            np.array([low for low, _ in ends], float), np.array([high for _, high in ends], float),
        )  # fmt: skip

    @property
    def size(self) -> int:
        """How many a fit looks for."""
        return 0 if self.held else self.mean.size

    @property
    def precision(self) -> Floats:
        """(unknowns,) of the priors."""
        return 1.0 / self.sd[: self.size] ** 2

    def effects(self, e: Floats) -> dict[str, Floats]:
        """{kind: (1, tests)} as predictors take them."""
        values = self.mean if self.held else e
        return {kind: values[np.maximum(own, 0)][None] for kind, own in self.place.items()}

    def columns(self, slopes: Mapping[str, Floats]) -> Floats:
        """Derivatives to each unknown, (tests, entries, unknowns), from those to each test's own effects."""
        out = np.zeros((*next(iter(slopes.values())).shape, self.size))
        for kind, own in self.place.items():
            for test, unknown in enumerate(own):
                if unknown >= 0:
                    out[test, :, unknown] = slopes[kind][test]
        return out

    def integrated(self, residuals: Residuals, e: Floats) -> Residuals:
        """The residuals that tests would leave at their prior means, with the priors as part of the scatter.

        To first order. At its estimate an unknown has taken up what scatter between tests it can, so that the size of
        that scatter cannot be read off the residuals there. Unknowns that tests share stay as estimated.
        """
        own = [k for k, n in enumerate(self.nuisances) if n.scope == "test" and np.isfinite(self.sd[k])]
        if not own or residuals.jacobian is None:
            return residuals
        slopes = residuals.jacobian[..., -self.size :][..., own]
        values = residuals.values - slopes @ (e - self.mean)[own]
        return replace(residuals, values=values, known=slopes * self.sd[own])

    def with_spread(self, e: Floats, variance: Floats) -> Unknowns:
        """The spreads to be estimated, as the unknowns show them: mean of (e - mean)^2 and their own variance."""
        sd = self.sd.copy()
        for nuisance in dict.fromkeys(self.nuisances):
            if nuisance.sd is None:
                mine = np.array([n is nuisance for n in self.nuisances])
                spread = np.sqrt(np.mean((e - self.mean)[mine] ** 2 + variance[mine]))
                sd[mine] = max(float(spread), LEAST * SPREAD[nuisance.kind])
        return replace(self, sd=sd)


def member_of(nuisance: Nuisance, history: History) -> str:
    """Whose unknown it is that a history has."""
    return {"test": history.name, "alloy": history.alloy, "all": "all"}[nuisance.scope]


def prior_mean(nuisance: Nuisance, history: History | None, using: Predictor) -> float:
    """The prior mean of a test's unknown; a thickness without one of its own is about what the test is stated to have.

    mm for lengths; the geometry of the history takes precedence over that of the specimen.
    """
    if nuisance.kind != "thickness" or nuisance.mean > 0 or history is None:
        return nuisance.mean
    made = predictor_of(using, history)
    geometry = getattr(getattr(made, "specimen", made), "geometry", None)
    stated = history.geometry.get("apex_thickness", getattr(geometry, "apex_thickness", None))
    if stated is None:
        told = f"nuisance 'thickness' has no mean, and test '{history.name}' states no apex_thickness"
        raise FitError(f"{told}; give mean=")
    return float(stated)


def _limits(nuisance: Nuisance, mean: float) -> tuple[float, float]:
    low, high = LIMITS[nuisance.kind]
    if nuisance.kind in ABSOLUTE:
        low, high = low * mean, high * mean
    return max(low, nuisance.bounds[0]), min(high, nuisance.bounds[1])
