"""One law against what another one predicts, of the tests that were made and of planned ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.alternation import free
from creepkit.inverse.covariance import whitener
from creepkit.inverse.effects import Unknowns
from creepkit.inverse.entries import Entries
from creepkit.inverse.fences import Fences
from creepkit.inverse.frames import thinned
from creepkit.inverse.identification import Identification
from creepkit.inverse.nominal import measured_log_pace, measured_log_rate
from creepkit.inverse.objective import Objective
from creepkit.inverse.scales import usable
from creepkit.inverse.scatter import Scatter
from creepkit.inverse.search.box import Box
from creepkit.inverse.search.refining import refine
from creepkit.inverse.selection.designs import Design
from creepkit.inverse.together import outputs_of, predict, predictor_of, screening_of
from creepkit.records import History, Predictor

STEPS = 8
"""Of a full refit."""
LEAST_FRAMES = 5
"""A planned test with fewer frames before it bursts says nothing."""
WEAK = 0.03
"""Standard deviations of data per width of the bounds by which a Gauss-Newton step is held where nothing else does."""
REACH = 2.0
"""A planned test is followed until its growing output is so many times what was seen: beyond, other things happen."""
ROWS = ("output", "frame", "present", "leading", "measured", "times", "loudness", "whole", "censored")
"""Fields of entries with a row for each test."""


@dataclass(frozen=True, eq=False)
class Contest:
    """Law b against law a.

    made : how many tests were; plans : those that could be. histories : of both, in this order, with a's predictions
    for outputs. fit : of b. entries, scatter : by which they are compared, the scatter being that of a's fit.
    """

    made: int
    plans: tuple[Design, ...]
    histories: tuple[History, ...]
    using: Predictor
    fit: Identification
    entries: Entries
    scatter: Scatter

    @classmethod
    def of(cls, a: Identification, b: Identification, plans: Sequence[Design]) -> Contest:
        """Law b against what law a predicts; plans that burst at once are left out."""
        assert a.using is not None
        using, full = screening_of(a.using) or a.using, [_endless(h) for h in a.histories]
        made = [thinned(h, a.settings.frames) for h in full]
        base = Entries.of(made, using, full)
        every = [*made, *(_with_outputs(d.history, using, base) for d in plans)]
        told = _told(a, using, every, len(made), base)
        most = {name: _most(made, name) for name in base.outputs}
        kept = [(d, h) for d, h in zip(plans, (_cut(h, using, most) for h in told[len(made) :]), strict=True)
                if h.used.sum() >= LEAST_FRAMES]  # fmt: skip
        histories = (*told[: len(made)], *(h for _, h in kept))
        entries = replace(Entries.of(histories, using), scales=base.scales, noise=base.noise)
        scatter = Scatter({name: a.scatter[name] for name in base.outputs}, a.scatter.rate)
        return cls(len(made), tuple(d for d, _ in kept), histories, using, b, entries, scatter)

    def linear(self, chosen: Sequence[int]) -> float:
        """The chi-square left after one Gauss-Newton step, with the chosen plans."""
        objective, x, box, factor = self._posed(chosen)
        residuals, fences = objective.at(x), Fences(objective)
        assert residuals.jacobian is not None
        both = np.concatenate([residuals.values[..., None], residuals.jacobian], axis=-1)
        white = np.linalg.solve(factor, both)[residuals.present]
        rows = np.concatenate([white[:, 1:], fences.jacobian(x)])
        g = np.concatenate([white[:, 0], fences.values(x)])
        hold = np.diag(WEAK / box.width)
        step = np.linalg.lstsq(np.concatenate([rows, hold]), np.concatenate([-g, np.zeros(x.size)]), rcond=None)[0]
        return float(((g + rows @ step) ** 2).sum())

    def refitted(self, chosen: Sequence[int]) -> float:
        """The chi-square left after a full refit."""
        objective, x, box, factor = self._posed(chosen)
        return 2.0 * refine(objective, box, factor, x, steps=STEPS, tolerance=1e-5).cost

    def _posed(self, chosen: Sequence[int]) -> tuple[Objective, Floats, Box, Floats]:
        """The problem of law b with the chosen plans: objective, where to begin, bounds, and covariance factors."""
        own, b = [*range(self.made), *(self.made + k for k in chosen)], self.fit
        histories, made = [self.histories[k] for k in own], self.histories[: self.made]
        rows = {name: getattr(self.entries, name)[own] for name in ROWS}
        unknowns = _unknowns(b, histories, self.made, self.using)
        entries = replace(self.entries, **rows)
        objective = Objective(b.law, histories, self.using, b.coordinates, entries, unknowns)
        known = {(n.kind, n.member): n.value for n in b.nuisances}
        rate = measured_log_rate(made, self.using)
        box = Box.of(b.law, b.coordinates, rate, measured_log_pace(made)).beside(unknowns)
        x = box.clip(free(unknowns, b.u, known))
        factor = whitener(replace(objective.at(x), present=objective.entries.present), self.scatter)
        return objective, x, box, factor


def _endless(history: History) -> History:
    """A history compared at its frames alone: when it would break is not what is asked."""
    return replace(history, rupture_time=None, unruptured=False)


def _with_outputs(plan: History, using: Predictor, base: Entries) -> History:
    """A planned history with room for the outputs of those that were made, at their noise."""
    known = getattr(predictor_of(using, plan), "outputs", base.outputs)
    noise = {name: np.full(plan.times.size, base.noise[base.outputs.index(name)]) for name in known
             if name in base.outputs}  # fmt: skip
    return replace(_endless(plan), outputs={name: 0.0 * sd for name, sd in noise.items()}, standard_deviation=noise)


def _told(a: Identification, using: Predictor, every: Sequence[History], made: int, base: Entries) -> list[History]:
    """Histories with what law a predicts in the place of what was measured, at the noise of what was."""
    effects = a.effects(every)
    if "thickness" in effects:
        effects["thickness"] = effects["thickness"].copy()
        for k, own in _thicknesses(every, made):
            effects["thickness"][0, k] = own
    found = predict(using, a.law, a.values, every, effects=effects)
    answer = []
    for k, history in enumerate(every):
        outputs, sd = {}, {}
        for name in outputs_of(using, history):
            there = np.isfinite(history.outputs[name])
            outputs[name] = np.where(there, found.of(k)[:, found.outputs.index(name)], np.nan)
            typical = np.full(there.size, base.noise[base.outputs.index(name)])
            sd[name] = history.standard_deviation.get(name, typical)
        answer.append(replace(history, outputs=outputs, standard_deviation=sd))
    return answer


def _most(made: Sequence[History], name: str) -> float:
    """How far the growing output of a planned test is followed: as far again as the tests that were made."""
    seen = [h.outputs[name][usable(h, name)] for h in made if name in h.outputs]
    values = np.concatenate([*seen, np.zeros(1)])
    return float(values.min() + REACH * np.ptp(values))


def _cut(plan: History, using: Predictor, most: dict[str, float]) -> History:
    """A planned history with its frames before it bursts, and within reach, marked used."""
    first, *_ = outputs_of(using, plan)
    alive = np.isfinite(np.stack([*plan.outputs.values()])).all(axis=0)
    near = np.nan_to_num(plan.outputs[first]) <= most[first]
    return replace(plan, used=alive & near & (plan.times > 0))


def _thicknesses(histories: Sequence[History], made: int) -> list[tuple[int, float]]:
    """(position, mm) of the planned tests whose apex thickness is stated: it is what they are about."""
    return [(k, h.geometry["apex_thickness"]) for k, h in enumerate(histories)
            if k >= made and "apex_thickness" in h.geometry]  # fmt: skip


def _unknowns(fit: Identification, histories: Sequence[History], made: int, using: Predictor) -> Unknowns:
    """Those of the fit's nuisances, with the spreads that it found; planned thicknesses are known as well as others."""
    unknowns = Unknowns.of(fit.settings.nuisances, histories, using)
    if not unknowns.mean.size:
        return unknowns
    spread, mean = {n.kind: n.spread for n in fit.nuisances}, unknowns.mean.copy()
    for k, own in _thicknesses(histories, made) if "thickness" in unknowns.place else ():
        place = int(unknowns.place["thickness"][k])
        if place >= 0 and unknowns.nuisances[place].scope == "test":
            mean[place] = own
    return replace(unknowns, mean=mean, sd=np.array([spread[n.kind] for n in unknowns.nuisances], float))
