"""Trials of perturbations: whether the choice of a law rests on something that nobody measured.

Each unmodelled effect of the laws (see inverse.perturbations: a length known to its tolerance, an offset, a
furnace that drifts) is put into the linear problems of all of them, with its usual size as prior standard deviation,
and they are ranked again under one common covariance. In several tests it is tried twice: independently in each test,
and as one error of all tests. No simulation is needed.

An answer that singles a law out rests on the absence of an effect with which it no longer has nearly all the weight.
Where no law is singled out, the law of most evidence with an effect is named if it then explains the tests, and without
was not among the credible laws or did not explain them; with the size that the effect has in its linear problem.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.evidence import CREDIBLE_WEIGHT, DECISIVE_EXCESS, DECISIVE_WEIGHT, evidence_weights
from creepkit.inverse.identification import Identification
from creepkit.inverse.noise_model import NoiseModel
from creepkit.inverse.nuisance_parameters import prior_mean
from creepkit.inverse.perturbation import DRIFT, OFFSET, Perturbation
from creepkit.inverse.perturbations import sizes_of_effect
from creepkit.inverse.selection.discrimination import (
    CommonCovarianceFits,
    RatesOverTests,
    under_common_covariance,
    usual_errors,
)
from creepkit.records import Nuisance, is_length_nuisance

MOST_NAMED = 2
"""Perturbations, and laws that explain the tests with them, that a sentence names."""


@dataclass(frozen=True)
class Challenge:
    """Something that the tests allow, so that the law of most weight is not proved.

    kind : "sum" of the best law with another, a "threshold" stress of it, or an "unmodelled effect". subject : the name
        of the law that is allowed, or the effect.
    sentence : for people, to follow "but". refutes : whether the law is not decisive for it. A sum that explains the
        tests no better than by chance does not: it says how much of another law they allow.
    """

    kind: Literal["sum", "threshold", "unmodelled effect"]
    subject: str
    sentence: str
    refutes: bool = True

    def __str__(self) -> str:
        return self.sentence


Scope = Literal["test", "all"]


@dataclass(frozen=True, eq=False)
class Trial:
    """The laws with one perturbation. scope : whether it is independent in each test, or one of all tests.

    effects : it, by each law. scores : (laws,) -2 ln of the evidence. u : of each law (parameters,) coordinates
    where it fits best. noise_model : of the common covariance.
    """

    scope: Scope
    effects: tuple[Perturbation, ...]
    scores: Floats
    u: tuple[Floats, ...]
    noise_model: NoiseModel

    @classmethod
    def of(cls, fits: Sequence[Identification], effects: tuple[Perturbation, ...], scope: Scope) -> Trial:
        """That of some identifications by likelihood; effects : of each, the perturbation by its law."""
        common = _under_errors(fits, [replace(effect, common=scope == "all") for effect in effects])
        u = tuple(fit.u + step[: fit.u.size] for fit, step in zip(fits, common.steps, strict=True))
        return cls(scope, effects, common.scores, u, fits[common.reference_law].noise_model)

    @property
    def is_of_length(self) -> bool:
        """Whether it is the error of a length of the test pieces."""
        return is_length_nuisance(self.effects[0].kind) and not self.effects[0].kind.startswith(OFFSET)

    def description(self, fits: Sequence[Identification], law: int) -> str:
        """The perturbation with the size that it has in the linear problem of a law, by its position."""
        fit, common = fits[law], self.scope == "all"
        sizes = sizes_of_effect(fit.linear_problem, self.effects[law], self.noise_model, common=common)
        effect, tests, differ = self.effects[law], len(fit.tests), sizes.size > 1
        size = float(np.abs(sizes).max()) if differ else float(sizes[0])
        where = "the test" if tests == 1 else f"each of the {tests} tests"
        if self.is_of_length:
            predictor = fit.least_squares_problem.predictor
            nominal = float(np.median([prior_mean(Nuisance(effect.kind), h, predictor) for h in fit.histories]))
            share = f"{abs(100 * size * effect.size / nominal):.2g} %"
            if differ:
                return f"independent errors of up to {share} in the {effect.kind} of {where}"
            return f"a {effect.kind} {share} {'smaller' if size < 0 else 'larger'}{f' in {where}' if tests > 1 else ''}"
        amount, unit = f"{size * effect.size:{'' if differ else '+'}.2g}", effect.unit.removesuffix(" over a test")
        amount = f"{'up to ' if differ else ''}{amount} {unit}".strip()
        if effect.kind == DRIFT:
            return f"{'independent drifts' if differ else 'a drift'} of the temperature of {amount} over {where}"
        output = effect.kind.removeprefix(OFFSET).replace("_", " ")
        return f"{'independent offsets' if differ else 'an offset'} of {amount} in the {output} of {where}"


def _under_errors(fits: Sequence[Identification], tried: Sequence[Perturbation] = ()) -> CommonCovarianceFits:
    """Identifications under one covariance with the usual errors of tests.

    tried : a perturbation by each law, beside the usual errors of tests, and in the place of one of its kind.
    """
    errors = [usual_errors(fit) for fit in fits]
    if tried:
        errors = [[*(e for e in own if e.kind != new.kind), new] for own, new in zip(errors, tried, strict=True)]
    return under_common_covariance(fits, errors)


def _trials(fits: Sequence[Identification]) -> Iterator[Trial]:
    """Those of all perturbations that every law has, of which the first states its size.

    What intervals include of each test by itself is in the evidence already, and tried as one error of all.
    """
    by_kind = [{e.kind: e for e in fit.unmodelled if not e.common and e.residual_change.size} for fit in fits]
    for kind in by_kind[0]:
        effects = tuple(one[kind] for one in by_kind if kind in one)
        if len(effects) == len(fits):
            if not effects[0].included:
                yield Trial.of(fits, effects, "test")
            if len(fits[0].tests) > 1:
                yield Trial.of(fits, effects, "all")


def decisive_effects(fits: Sequence[Identification]) -> tuple[Challenge, ...]:
    """The perturbations, one by one, with which the first law no longer has nearly all the weight."""
    challenges: dict[str, tuple[float, Challenge]] = {}
    rates = RatesOverTests(fits)
    for trial in _trials(fits):
        own = evidence_weights(trial.scores)[1]
        weights = np.bincount(rates.standing(trial.u, trial.scores), own, len(fits))
        effect, weight = trial.effects[0], float(weights[0])
        if weight > DECISIVE_WEIGHT or weight >= challenges.get(effect.kind, (np.inf,))[0]:
            continue
        rival = 1 + int(np.argmax(weights[1:]))
        name, weight_of_rival = fits[rival].law.name, f"{weights[rival]:.2f}"
        sentence = (
            f"with {trial.description(fits, rival)} {name} would explain them (weight {weight_of_rival})"
            if _explains_with(fits[rival], trial.effects[rival])
            else f"{effect.description}, which was not modelled, would leave it a weight of {weight:.2f} "
            f"({name}: {weight_of_rival})"
        )
        challenges[effect.kind] = weight, Challenge("unmodelled effect", effect.kind, sentence)
    return tuple(challenge for _, challenge in challenges.values())


def explaining_effects(fits: Sequence[Identification], weights: Floats) -> tuple[Challenge, ...]:
    """The laws that a perturbation makes as likely as the best one, where no law is singled out.

    weights : (laws,) of the ranking, best first. Named is what explains the tests with a perturbation that raises its
    evidence, by more than chance does, to that of the best law as the tests are stated; that was not credible before,
    or none explains the tests; and beside which no simpler law, credible or not, has more evidence with it. What the
    best law alone would need stands in its adequacy.
    """
    trials = [*_trials(fits)]
    if not trials:
        return ()
    rejected = fits[0].adequacy is not None and fits[0].adequacy.rejects
    as_stated = _under_errors(fits).scores
    raised = [
        (float(trial.scores[law]), law, trial)
        for trial in trials
        for law, fit in enumerate(fits)
        if trial.scores[law] < as_stated[law] - DECISIVE_EXCESS
        and trial.scores[law] < as_stated.min() + DECISIVE_EXCESS
        and (rejected or not weights[law] > CREDIBLE_WEIGHT)
        and not any(trial.scores[k] < trial.scores[law] and len(f.u) <= len(fit.u) for k, f in enumerate(fits))
        and _explains_with(fit, trial.effects[law])
    ]
    if not raised:
        return ()
    score, _, best = min(raised, key=lambda one: one[0])
    laws = sorted((law for _, law, trial in raised if trial is best), key=lambda law: len(fits[law].u))
    if laws == [0]:
        return ()
    by_kind = {best.effects[0].kind: best}
    for other_score, law, trial in sorted(raised, key=lambda one: one[0]):
        if law == laws[0] and other_score < score + DECISIVE_EXCESS:
            by_kind.setdefault(trial.effects[0].kind, trial)
    texts = [trial.description(fits, laws[0]) for trial in by_kind.values()]
    names = " or ".join(fits[law].law.name for law in laws[:MOST_NAMED])
    sentence = f"with {' or with '.join(texts[:MOST_NAMED])} {names} would explain them"
    return (Challenge("unmodelled effect", best.effects[0].kind, sentence),)


def _explains_with(fit: Identification, effect: Perturbation) -> bool:
    """Whether a law explains the tests, with that perturbation where it does not without."""
    adequacy = fit.adequacy
    return adequacy is not None and (adequacy.explains or any(effect.kind in one for one in adequacy.remedies))
