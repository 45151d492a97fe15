"""Subsets of the terms of a sum: a coefficient in {0} U [bounds] as a choice of its own, not as a very small number.

A term that is off has its rate at the bottom of the box, 1e-5 of the measured rate, where it moves nothing; what else
only it depends on rests in the middle of its bounds, so that an absent term meets no wall and no penalty.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.errors import FitError, nearest

if TYPE_CHECKING:
    from creepkit.inverse.search.landscape import Landscape
    from creepkit.language import CreepLaw

ANY = "any"
"""In place of names: every term may be switched off."""
FLIPS = 0.5
"""Switches that a candidate flips by chance in each draw, on average: enough to leave a wrong subset, not to drift."""
AT_BOTTOM = 0.5
"""In ln of a rate: so near the bottom of the box it is at it."""


@dataclass(frozen=True)
class Switches:
    """Which terms may be off, and what that means for u.

    terms : names of those that may; rates : (terms,) positions of their rates; own : (terms, parameters) which
    coordinates mean nothing while a term is off; rest : (parameters,) where those then are; always : whether some term
    stays on anyhow.
    Masks are (..., terms), true where a term is on.
    """

    terms: tuple[str, ...]
    rates: Ints
    own: Bools
    rest: Floats
    always: bool

    @classmethod
    def of(cls, landscape: Landscape, off: str | Sequence[str]) -> Switches:
        """Those of a landscape; off : names of terms, or "any"."""
        law, rates = landscape.objective.law, landscape.objective.coordinates.rates
        positions = {label: [law.names.index(n) for n in law.only(label).names] for label in law.terms}
        known = {label: [k for k in own if k in rates] for label, own in positions.items()}
        chosen = _chosen(law, known, off)
        own = np.zeros((len(chosen), landscape.box.low.size), bool)
        for row, label in zip(own, chosen, strict=True):
            others = {k for other, own_of in positions.items() if other != label for k in own_of}
            row[[k for k in positions[label] if k not in others]] = True
        rest = landscape.box.middle
        rest[list(rates)] = landscape.box.low[list(rates)]
        tuned = np.array([known[label][0] for label in chosen], np.int64)
        return cls(chosen, tuned, own, rest, len(chosen) < len(law.terms))

    def sent(self, u: Floats, on: Bools) -> Floats:
        """u (..., parameters) with the coordinates of terms that are off at rest."""
        return np.where(self.live(on), u, self.rest)

    def live(self, on: Bools) -> Bools:
        """(..., parameters) which coordinates mean something; on : (..., terms)."""
        return np.asarray(~(~on[..., None] & self.own).any(axis=-2))

    def held(self, on: Bools) -> dict[int, float]:
        """{position: value} of the coordinates at rest, of one mask (terms,)."""
        return {int(k): float(self.rest[k]) for k in np.flatnonzero(~self.live(on))}

    def names_off(self, u: Floats) -> tuple[str, ...]:
        """The terms that are off at u (parameters,): switched off, or driven to the bottom, which is the same."""
        bottom = u[self.rates] <= self.rest[self.rates] + AT_BOTTOM
        return tuple(term for term, is_off in zip(self.terms, bottom, strict=True) if is_off)

    def drawn(self, count: int, rng: np.random.Generator) -> Bools:
        """(count, terms) masks to begin from: all on in the first, every subset as likely as another in the rest."""
        on = rng.random((count, len(self.terms))) < 0.5
        on[:1] = True
        return self._lit(on, rng)

    def inherited(self, own: Bools, common: Bools, rng: np.random.Generator) -> Bools:
        """(candidates, terms) masks of the next draw: each switch from a candidate's own best mask (candidates, terms)
        or from the common one (terms,), as a coin falls; and now and then it flips.
        """
        if not self.terms:
            return own
        taken = np.where(rng.random(own.shape) < 0.5, own, common)
        flipped = rng.random(own.shape) < FLIPS / len(self.terms)
        return self._lit(taken ^ flipped, rng)

    def _lit(self, on: Bools, rng: np.random.Generator) -> Bools:
        """A sum of nothing is no law: a mask without any term gets one, at random."""
        dark = np.flatnonzero(~on.any(axis=1)) if self.terms and not self.always else np.zeros(0, int)
        on[dark, rng.integers(max(len(self.terms), 1), size=dark.size)] = True
        return on


def _chosen(law: CreepLaw, known: dict[str, list[int]], off: str | Sequence[str]) -> tuple[str, ...]:
    """The names meant by `off`, checked."""
    if off == ANY:
        return tuple(label for label, rate in known.items() if rate) if len(known) > 1 else ()
    names = (off,) if isinstance(off, str) else tuple(off)
    for name in names:
        if name not in known:
            raise FitError(f"law '{law.name}' has no term '{name}' to switch off; {nearest(name, known)}")
        if len(known) == 1:
            raise FitError(f"law '{law.name}' has one term, '{name}', which cannot be switched off")
        if not known[name]:
            raise FitError(f"term '{name}' of law '{law.name}' has no coefficient of its own that could be zero")
    return tuple(dict.fromkeys(names))
