"""identify: one law over all tests, stresses and temperatures, with intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.alternation import EXPENSIVE, Effort, Fitted, alternate, free
from creepkit.inverse.checks import check_bounds, check_growth, check_histories
from creepkit.inverse.coordinates import Coordinates, Reference
from creepkit.inverse.covariance import effective_size, expected_effects, whitener
from creepkit.inverse.effects import Unknowns
from creepkit.inverse.entries import Entries
from creepkit.inverse.findings import NuisanceEstimate
from creepkit.inverse.frames import thinned
from creepkit.inverse.identification import Identification
from creepkit.inverse.life import check_effects
from creepkit.inverse.misfits import misfits, pooled_errors, pooled_rms
from creepkit.inverse.nominal import measured_log_pace, measured_log_rate
from creepkit.inverse.objective import Objective
from creepkit.inverse.provenance import FEW_TESTS, notes, of_domain, provenance, ranges
from creepkit.inverse.rupture import rupture_misfits
from creepkit.inverse.scatter import ASSUMED_RATE, full_guess
from creepkit.inverse.search import Box, Minimum, Progress, from_single_terms, multistart
from creepkit.inverse.settings import Settings
from creepkit.inverse.sizes import estimated
from creepkit.inverse.together import Together, predict, screening_of
from creepkit.inverse.uncertainty import estimates, laplace, quantile
from creepkit.inverse.weighting import Weighting, pulling
from creepkit.language import CreepLaw
from creepkit.records import History, Nuisance, Predictor

REFIT_ROUNDS = 2


def identify(
    law: CreepLaw,
    histories: Sequence[History],
    using: Predictor | Mapping[str, Predictor],
    *,
    settings: Settings | None = None,
    start: Floats | None = None,
    known: Sequence[NuisanceEstimate] = (),
    reference: Reference | None = None,
    progress: Progress | None = None,
) -> Identification:
    """Identify the parameters of `law` from `histories` by multi-start least squares, then by their likelihood.

    using : predictor, such as the specimen that study.specimen("uniaxial") returns, or {specimen: predictor} where
        histories are of several. One that offers screening() is searched with that stand-in and then refined.
    start : conditioned coordinates to begin from instead of a global search; a refit takes two rounds at most.
    known : explicit nuisances as they were found before, to begin from.
    """
    settings = settings or Settings()
    if isinstance(using, Mapping):
        using = Together(dict(using))
    check_histories(law, histories, using)
    thin = [thinned(h, settings.frames) for h in histories]
    coordinates, entries = Coordinates(law, reference or Reference.of(thin, using)), Entries.of(thin, using, histories)
    unknowns = Unknowns.of(settings.nuisances, thin, using)
    objective = Objective(law, thin, using, coordinates, entries, unknowns)
    check_growth(objective)
    check_effects([n.kind for n in unknowns.nuisances], entries, thin, using)
    box = Box.of(law, coordinates, measured_log_rate(thin, using), measured_log_pace(thin))
    weighting = Weighting(settings, entries)
    stand_in = screening_of(using)
    effort = Effort() if stand_in is None else EXPENSIVE
    screened = 0
    if start is None:
        search = objective.asking(stand_in or using, law, coordinates)
        starts = _searched(search, box, weighting, progress)
        screened = search.evaluations
    else:
        starts, effort = [box.clip(np.asarray(start, float))], replace(effort, rounds=REFIT_ROUNDS)
    wide, before, ends = box.beside(unknowns), {(n.kind, n.member): n.value for n in known}, []
    for u in starts:
        objective.unknowns = unknowns
        ends.append(alternate(objective, wide, free(unknowns, u, before), weighting, effort, progress))
    best = max(ends, key=lambda end: end.likelihood)
    objective.unknowns = best.unknowns
    check_bounds(objective, best.minimum.u[: len(law.params)])
    return _answer(objective, box, best, weighting, histories, screened)


def _answer(
    objective: Objective, box: Box, best: Fitted, weighting: Weighting, histories: Sequence[History], screened: int
) -> Identification:
    """Scatter, intervals and misfits at the optimum."""
    law, coordinates, residuals, settings = objective.law, objective.coordinates, best.residuals, weighting.settings
    size, x, known = len(law.params), best.minimum.u, _with_known_rate(settings.nuisances, len(histories))
    u = x[:size]
    at_means = best.unknowns.integrated(residuals, x[size:])
    scatter = estimated(at_means, full_guess(weighting.measured(best.working), known), known)
    given = any(n.kind == "rate" and n.sd is not None for n in known)
    wide = box.beside(best.unknowns)
    pull = pulling(best.working, objective.entries)
    posterior, freedom = laplace(residuals, pull, scatter, wide, best.unknowns, rate_known=given)
    found = predict(
        objective.using, law, coordinates.values(u), list(histories), effects=best.unknowns.effects(x[size:])
    )
    inner = posterior[:size, :size]
    ends = rupture_misfits(coordinates, u, inner, scatter, quantile(freedom), histories, objective.using)
    tests = misfits(objective, residuals, expected_effects(residuals, scatter), histories, found, ends)
    own = _nuisances(best.unknowns, x[size:], np.sqrt(np.diag(posterior))[size:])
    return Identification(
        law=law,
        estimates=estimates(law, coordinates, u, inner, quantile(freedom)),
        u=u,
        covariance=inner,
        reference=coordinates.reference,
        scatter=scatter,
        rms=pooled_rms(tests),
        log_likelihood=best.likelihood,
        size=effective_size(residuals, scatter),
        freedom=freedom,
        misfits=tests,
        ranges=ranges(objective),
        settings=settings,
        provenance=provenance(objective, settings, screened),
        errors=pooled_errors(histories, found, tests),
        nuisances=own,
        converged=best.minimum.converged,
        notes=(*notes(objective, best, settings, tests, own), *of_domain(found, histories)),
        histories=tuple(histories),
        using=objective.using,
    )


def _nuisances(unknowns: Unknowns, e: Floats, sd: Floats) -> tuple[NuisanceEstimate, ...]:
    return tuple(
        NuisanceEstimate(n.kind, n.scope, member, float(value), float(s), n.mean, float(spread))
        for n, member, value, s, spread in zip(unknowns.nuisances, unknowns.members, e, sd, unknowns.sd, strict=True)
    )


def _with_known_rate(nuisances: Sequence[Nuisance], tests: int) -> tuple[Nuisance, ...]:
    """The nuisances, with the scatter between tests assumed where too few tests could show it."""
    if tests >= FEW_TESTS:
        return tuple(nuisances)
    return tuple(replace(n, sd=ASSUMED_RATE) if n.kind == "rate" and n.sd is None else n for n in nuisances)


def _searched(objective: Objective, box: Box, weighting: Weighting, progress: Progress | None) -> list[Floats]:
    """Global search with a covariance that is broad and fixed, and a loss that no single curve can capture.

    The best minima that differ, or for a sum the best one and its best term: a sum must not end worse than its terms.
    Their likelihoods decide, since the covariance is not yet known here.
    """
    settings, guess = weighting.settings, pulling(weighting.guess(), objective.entries)
    factor = whitener(objective.before_fit(), guess)
    loss = "soft_l1" if settings.loss == "linear" else settings.loss
    few, half = max(2, settings.starts // 3), settings.draws // 2
    singles = from_single_terms(objective, box, factor, starts=few, draws=half, seed=settings.seed, loss=loss)
    minima = multistart(
        objective, box, factor, starts=settings.starts, draws=settings.draws, seed=settings.seed, loss=loss,
        progress=progress, extra=singles,
    )  # fmt: skip
    return [minima[0].u, singles[0]] if singles else _distinct(minima, box)


def _distinct(minima: Sequence[Minimum], box: Box, most: int = 2, near: float = 0.02) -> list[Floats]:
    """The best minima, at most two, that differ by more than 2 % of the box in some coordinate."""
    kept: list[Floats] = []
    for minimum in minima:
        if all((np.abs(minimum.u - u) > near * box.width).any() for u in kept):
            kept.append(minimum.u)
    return kept[:most]


def refit(fit: Identification, histories: Sequence[History]) -> Identification:
    """The same law on other histories, starting where `fit` ended (for hold-out and resampling)."""
    if fit.using is None:
        raise FitError("cannot refit an identification that was loaded from a file without its specimen")
    return identify(
        fit.law, histories, fit.using, settings=fit.settings, start=fit.u, known=fit.nuisances, reference=fit.reference
    )
