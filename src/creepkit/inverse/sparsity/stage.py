"""A sum of terms before its data: one objective and one covariance, on which laws of some of its terms are compared.

All laws are judged by the covariance of the sum fitted without penalty, so that chi-squares can be subtracted. That
covariance knows how frames move together; each frame then counts as one in BIC.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.fences import Fences
from creepkit.inverse.identification import Identification
from creepkit.inverse.objective import Objective
from creepkit.inverse.problem import reopened
from creepkit.inverse.search.box import Box
from creepkit.inverse.search.landscape import Landscape
from creepkit.inverse.search.multistart import unequal
from creepkit.inverse.search.refining import Extra, Minimum, refine
from creepkit.inverse.settings import Settings
from creepkit.inverse.sparsity.contributions import Contributions
from creepkit.inverse.sparsity.penalised import Penalised, exponents_of
from creepkit.language import CreepLaw
from creepkit.records import Predictor

STEPS = 40
TOLERANCE = 1e-7
DRAWS = 64
"""Of what a term that is to be absent depends on, besides its rate."""


@dataclass(frozen=True, eq=False)
class Stage:
    """A law, its data and their covariance; unknowns are x = (u, e), e those of the tests.

    factor : (tests, entries, entries) Cholesky factors of the covariance.
    start : x from which it is known to fit well.
    """

    objective: Objective
    box: Box
    factor: Floats
    start: Floats
    settings: Settings

    @classmethod
    def of(cls, fit: Identification, through: Predictor | None = None) -> Stage:
        """The problem of an identification, opened again with the covariance that it found.

        through : a cheaper predictor by which terms are chosen.
        """
        opened = reopened(fit)
        o = opened.objective
        objective = Objective(o.law, o.histories, through or o.using, o.coordinates, o.entries, o.unknowns)
        return cls(objective, opened.box, opened.factor, opened.x, fit.settings)

    # ---- what it is ----------------------------------------------------------------------------------------------

    @property
    def law(self) -> CreepLaw:
        """The law of the objective."""
        return self.objective.law

    @property
    def size(self) -> int:
        """Number of parameters of the law; x goes on with the unknowns of tests."""
        return len(self.law.params)

    @property
    def frames(self) -> int:
        """Number of measured values."""
        return int(self.objective.entries.present.sum())

    @cached_property
    def contributions(self) -> Contributions:
        """Of the terms, over what the tests visit."""
        return Contributions.of(self.objective)

    def shares(self, x: Floats) -> dict[str, float]:
        """{term: contribution} at x."""
        return self.contributions.named(x[: self.size])

    # ---- fits -------------------------------------------------------------------------------------------------------

    def minimise(self, start: Floats, penalty: Extra | None = None, steps: int = STEPS) -> Minimum:
        """Least squares from x, penalty included."""
        return refine(self.objective, self.box, self.factor, start, steps=steps, tolerance=TOLERANCE, extra=penalty)

    def best(self, starts: Sequence[Floats]) -> Minimum:
        """The lowest of the minima from several x, without penalty."""
        return min((self.minimise(x) for x in starts), key=lambda minimum: minimum.cost)

    def misfit(self, x: Floats) -> float:
        """Half the chi-square at x, priors and walls included."""
        white = np.linalg.solve(self.factor, self.objective.at(x).values[..., None])[..., 0]
        walls = Fences(self.objective).values(x)
        return 0.5 * float((white[self.objective.entries.present] ** 2).sum() + (walls**2).sum())

    def criterion(self, minimum: Minimum) -> float:
        """BIC of a fit without penalty: chi-square, priors included, + K ln N."""
        return 2.0 * minimum.cost + self.fitted(minimum.u) * float(np.log(self.frames))

    def fitted(self, x: Floats) -> int:
        """How many parameters of the law move anything that was measured."""
        jacobian = self.objective.at(x).jacobian
        assert jacobian is not None
        return int((jacobian[self.objective.entries.present][:, : self.size] != 0).any(axis=0).sum())

    # ---- other laws on the same stage --------------------------------------------------------------------------------

    def with_law(self, law: CreepLaw) -> Stage:
        """A law of some of this one's parameters, by name, on the same data and covariance."""
        o, places = self.objective, self._places(law)
        objective = Objective(
            law, o.histories, o.using, Coordinates(law, o.coordinates.reference), o.entries, o.unknowns
        )
        box = Box(self.box.low[places], self.box.high[places])
        stage = replace(self, objective=objective, box=box, start=self.start[places])
        return replace(stage, start=stage.at_level(stage.start, self.total(self.start)))

    def moved(self, x: Floats) -> Stage:
        """The same, known to fit well at x."""
        return replace(self, start=x)

    def placed(self, law: CreepLaw, x: Floats) -> Floats:
        """x of a law of some of the terms as one of this law: the other terms as slow as the box allows.

        Their exponents that can be off are; all else of theirs is drawn so that they matter least, within the fences.
        """
        rates, places = list(self.objective.coordinates.rates), self._places(law)
        off = dict(exponents_of(self.law))
        idle = [k for k in range(self.size) if k not in (*places, *rates, *off)]
        whole = np.tile(np.concatenate([self.box.middle[: self.size], self.start[self.size :]]), (DRAWS, 1))
        unit = np.random.default_rng(0).random((DRAWS - 1, len(idle)))
        whole[1:, idle] = self.box.low[idle] + unit * self.box.width[idle]
        whole[:, list(off)] = list(off.values())
        whole[:, rates] = self.box.low[rates]
        whole[:, places] = x
        others = [k for k, label in enumerate(self.law.terms) if label not in law.terms]
        present = self.contributions.values(whole[:, : self.size])[:, others].sum(axis=1)
        fences = Fences(self.objective)
        walls = np.array([(fences.values(one) ** 2).sum() for one in whole])
        return np.asarray(whole[(present + walls).argmin()])

    def _places(self, law: CreepLaw) -> list[int]:
        own = [self.law.names.index(name) for name in law.names]
        return [*own, *range(self.size, self.start.size)]

    # ---- starts ------------------------------------------------------------------------------------------------------

    def total(self, x: Floats) -> float:
        """ln of the rate of all terms at the reference point."""
        rates = list(self.objective.coordinates.rates)
        return float(np.logaddexp.reduce(x[rates])) if rates else 0.0

    def at_level(self, x: Floats, level: float) -> Floats:
        """x with all rates moved by one factor, so that they add up to exp(level)."""
        moved, rates = np.array(x), list(self.objective.coordinates.rates)
        moved[rates] += level - self.total(x)
        return self.box.clip(moved)

    def shared(self, x: Floats, shares: Sequence[float] | Floats) -> Floats:
        """x with these shares of its rate at the reference point, in the order of coordinates.rates."""
        moved, rates = np.array(x), list(self.objective.coordinates.rates)
        moved[rates] = self.total(x) + np.log(shares)
        return self.box.clip(moved)

    def rotated(self, x: Floats) -> list[Floats]:
        """x with shares .7, .2, .1 and so on, each term leading once: equal shares are a stationary point."""
        count = len(self.objective.coordinates.rates)
        if count < 2:
            return []
        return [self.shared(x, np.roll(unequal(count), k)) for k in range(count)]

    def held(self, u: Floats) -> Floats:
        """x of conditioned coordinates, unknowns of tests as at the start."""
        return np.concatenate([u, self.start[self.size :]])

    def landscape(self, penalty: Penalised | None = None) -> Landscape:
        """What a global search sees: the same covariance, unknowns of tests as they are at the start."""
        o = self.objective
        held = replace(o.unknowns, mean=self.start[self.size :], held=True)
        objective = Objective(self.law, o.histories, o.using, o.coordinates, o.entries, held)
        box = Box(self.box.low[: self.size], self.box.high[: self.size])
        return Landscape(objective, box, self.factor, self.settings, penalty)
