"""The problem that a law and histories pose: what is compared, in which coordinates and bounds, with which scatter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.checks import check_growth, check_histories
from creepkit.inverse.coordinates import Coordinates, Reference
from creepkit.inverse.covariance import whitener
from creepkit.inverse.effects import Unknowns
from creepkit.inverse.entries import Entries
from creepkit.inverse.fences import Fences
from creepkit.inverse.frames import thinned
from creepkit.inverse.life import check_effects
from creepkit.inverse.nominal import measured_log_pace, measured_log_rate
from creepkit.inverse.objective import Objective
from creepkit.inverse.residuals import Residuals
from creepkit.inverse.scatter import Scatter
from creepkit.inverse.search.box import Box
from creepkit.inverse.search.landscape import Landscape
from creepkit.inverse.search.refining import Extra, Minimum, refine
from creepkit.inverse.settings import Settings
from creepkit.inverse.together import Together, errors_of
from creepkit.inverse.weighting import Weighting, pulling
from creepkit.language import CreepLaw
from creepkit.records import History, Predictor

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification


@dataclass(frozen=True, eq=False)
class Problem:
    """A law against histories.

    thin : the histories at the frames that are looked at; box : bounds of u; wide : of x = (u, e).
    """

    histories: tuple[History, ...]
    thin: tuple[History, ...]
    settings: Settings
    objective: Objective
    box: Box
    weighting: Weighting

    @classmethod
    def of(
        cls, law: CreepLaw, histories: Sequence[History], using: Predictor | Mapping[str, Predictor],
        settings: Settings, reference: Reference | None = None,
    ) -> Problem:  # fmt: skip
        """The checked problem; `reference` where the coordinates of another identification are to be kept."""
        using = Together(dict(using)) if isinstance(using, Mapping) else using
        check_histories(law, histories, using)
        thin = [thinned(h, settings.frames) for h in histories]
        coordinates = Coordinates(law, reference or Reference.of(thin, using))
        entries, unknowns = Entries.of(thin, using, histories), Unknowns.of(settings.nuisances, thin, using)
        objective = Objective(law, thin, using, coordinates, entries, unknowns)
        check_growth(objective)
        check_effects([n.kind for n in unknowns.nuisances], entries, thin, using)
        box = Box.of(law, coordinates, measured_log_rate(thin, using), measured_log_pace(thin))
        return cls(
            tuple(histories), tuple(thin), settings, objective, box, Weighting(settings, entries, errors_of(using))
        )

    @property
    def wide(self) -> Box:
        """The box of x = (u, e)."""
        return self.box.beside(self.objective.unknowns)

    def of_predictor(self, using: Predictor) -> Objective:
        """The same comparison of another predictor, with the unknowns of tests."""
        o = self.objective
        return Objective(o.law, o.histories, using, o.coordinates, o.entries, o.unknowns)

    def landscape(self, using: Predictor) -> Landscape:
        """What a global search sees: a covariance that is broad and fixed, and a loss that no single curve can capture.

        The likelihoods decide between minima, since the covariance is not yet known here.
        """
        o, settings = self.objective, self.settings
        guess = pulling(self.weighting.guess(), o.entries)
        factor = whitener(o.before_fit(), guess)
        loss = "soft_l1" if settings.loss == "linear" else settings.loss
        return Landscape(o.asking(using, o.law, o.coordinates), self.box, factor, settings, loss=loss)


@dataclass(frozen=True, eq=False)
class Opened:
    """An identification as a problem about its optimum.

    x : (u, e) at the optimum; box : its bounds; scatter, factor : of the covariance by which chi-squares are taken.
    residuals : at the optimum, with their Jacobian to x.
    """

    objective: Objective
    box: Box
    x: Floats
    scatter: Scatter
    factor: Floats
    residuals: Residuals

    @property
    def fences(self) -> Fences:
        """Walls and priors."""
        return Fences(self.objective)

    def white(self, x: Floats) -> Floats:
        """Residuals of the data over their scatter, then those of walls and priors, at x."""
        values = np.linalg.solve(self.factor, self.objective.at(x).values[..., None])[..., 0]
        return np.concatenate([values[self.objective.entries.present], self.fences.values(x)])

    def chi2(self, x: Floats) -> float:
        """Chi-square of data and priors at x."""
        return float((self.white(x) ** 2).sum())

    def minimise(
        self, start: Floats | None = None, held: Mapping[int, float] | None = None, extra: Extra | None = None
    ) -> Minimum:
        """Least squares from `start` (the optimum) with {position: value} of x held, and further residuals."""
        return refine(
            self.objective, self.box, self.factor, self.x if start is None else start, steps=25, tolerance=1e-7,
            held=held, extra=extra,
        )  # fmt: skip


def reopened(fit: Identification) -> Opened:
    """The problem of an identification, about its optimum, under the covariance that it found."""
    if fit.using is None or not fit.histories:
        raise FitError("this identification was loaded from a file: attach its histories and specimen with fit.on()")
    problem = Problem.of(fit.law, fit.histories, fit.using, fit.settings, fit.reference)
    found = {(n.kind, n.member): n for n in fit.nuisances}
    unknowns = problem.objective.unknowns
    own = [found[n.kind, m] for n, m in zip(unknowns.nuisances, unknowns.members, strict=True)]
    spread = np.array([n.spread for n in own], float)
    problem.objective.unknowns = replace(unknowns, sd=spread) if own else unknowns
    x = np.concatenate([fit.u, [n.value for n in own]])
    residuals = problem.objective.at(x).trusting(np.array([m.weight for m in fit.misfits]))
    factor = whitener(residuals, fit.scatter)
    return Opened(problem.objective, problem.wide, x, fit.scatter, factor, residuals)
