"""identify: one law over all tests, stresses and temperatures, with intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.alternation import EXPENSIVE, SKETCH, Effort, Fitted, alternate, free
from creepkit.inverse.checks import check_bounds
from creepkit.inverse.coordinates import Reference
from creepkit.inverse.covariance import effective_size, expected_effects, whitener
from creepkit.inverse.effects import Unknowns
from creepkit.inverse.findings import NuisanceEstimate
from creepkit.inverse.identification import Identification
from creepkit.inverse.misfits import misfits, pooled_errors, pooled_rms
from creepkit.inverse.problem import Problem
from creepkit.inverse.provenance import notes, of_domain, provenance, ranges
from creepkit.inverse.rupture import rupture_misfits
from creepkit.inverse.satterthwaite import restricted_laplace
from creepkit.inverse.scatter import ASSUMED_RATE, FEW_TESTS, Scatter, full_guess
from creepkit.inverse.search.landscape import Search
from creepkit.inverse.search.multistart import ALIKE, ALIKE_BY_STAND_IN, MultiStart, distinct
from creepkit.inverse.search.refining import Progress
from creepkit.inverse.settings import Settings
from creepkit.inverse.sizes import estimated
from creepkit.inverse.threads import single_threaded_algebra
from creepkit.inverse.together import predict, screening_of
from creepkit.inverse.uncertainty import estimates, laplace, quantile
from creepkit.inverse.weighting import pulling
from creepkit.language import CreepLaw
from creepkit.records import History, Nuisance, Predictor

if TYPE_CHECKING:
    from creepkit.inverse.search.trace import Trace

REFIT_ROUNDS = 2


def identify(
    law: CreepLaw,
    histories: Sequence[History],
    using: Predictor | Mapping[str, Predictor],
    *,
    settings: Settings | None = None,
    search: Search | None = None,
    through: Predictor | None = None,
    start: Floats | None = None,
    known: Sequence[NuisanceEstimate] = (),
    reference: Reference | None = None,
    progress: Progress | None = None,
) -> Identification:
    """Identify the parameters of `law` from `histories` by a global search, then by their likelihood.

    using : predictor, such as the specimen that study.specimen("uniaxial") returns, or {specimen: predictor} where
        histories are of several. One that offers screening() is searched with that stand-in and then refined.
    search : how to begin; by default least squares from several screened starts (MultiStart).
    through : a cheaper predictor, such as a surrogate, in which the search's minima are refined before `using` is
        asked: values and intervals are those of `using`.
    start : conditioned coordinates to begin from instead of a global search; a refit takes two rounds at most.
    known : explicit nuisances as they were found before, to begin from.
    """
    settings = settings or Settings()
    with single_threaded_algebra():
        problem = Problem.of(law, histories, using, settings, reference)
        if start is not None:
            begun = Begun([problem.box.clip(np.asarray(start, float))], 0, None)
        else:
            begun = _searched(problem, through, search or MultiStart(), progress)
        if begun.off:
            return _without_terms(problem, begun, progress)
        before = {(n.kind, n.member): n.value for n in known}
        ends = _refined(problem, begun, through, before, start is not None, progress)
        best = max(ends, key=lambda end: end.likelihood)
        problem.objective.unknowns = best.unknowns
        check_bounds(problem.objective, best.minimum.u[: len(law.params)], _force(best)[: len(law.params)])
        return _answer(problem, best, begun)


def _force(best: Fitted) -> Floats:
    """(unknowns,) derivative of half the chi-square of the data to x."""
    factor, r = whitener(best.residuals, best.working), best.residuals
    assert r.jacobian is not None
    white = np.linalg.solve(factor, np.concatenate([r.values[..., None], r.jacobian], axis=-1))
    return np.asarray(np.einsum("te,tep->p", white[..., 0], white[..., 1:]))


class Begun(NamedTuple):
    """Where a search left off: starts, candidates asked for, its trace, and terms that its best minimum is without."""

    starts: list[Floats]
    evaluations: int
    trace: Trace | None
    off: tuple[str, ...] = ()


def _without_terms(problem: Problem, begun: Begun, progress: Progress | None) -> Identification:
    """The answer for what the search left of a sum: a term that is off must not come back as a small one."""
    objective = problem.objective
    rest = objective.law.without(*begun.off)
    live = [objective.law.names.index(name) for name in rest.names]
    fit = identify(
        rest, problem.histories, objective.using, settings=problem.settings, start=begun.starts[0][live],
        reference=objective.coordinates.reference, progress=progress,
    )  # fmt: skip
    told = f"the search left out {' and '.join(begun.off)} of law '{objective.law.name}'"
    return replace(fit, trace=begun.trace, notes=(*fit.notes, told))


def _searched(problem: Problem, through: Predictor | None, search: Search, progress: Progress | None) -> Begun:
    """The best minima that differ, by the stand-in of the cheapest predictor."""
    first = through or problem.objective.using
    stand_in = screening_of(first)
    landscape = problem.landscape(stand_in or first)
    found = search.minima(landscape, progress)
    kept = distinct(found.minima, problem.box, alike=ALIKE if stand_in is None else ALIKE_BY_STAND_IN)
    return Begun([m.u for m in kept], landscape.objective.evaluations, found.trace, kept[0].off)


def _refined(
    problem: Problem, begun: Begun, through: Predictor | None, before: Mapping[tuple[str, str], float], again: bool,
    progress: Progress | None,
) -> list[Fitted]:  # fmt: skip
    """Where the starts lead, through the cheaper predictor first if there is one; its best end goes on."""
    objective, weighting, wide = problem.objective, problem.weighting, problem.wide
    dear = screening_of(objective.using) is not None
    xs, effort, working = [free(objective.unknowns, u, before) for u in begun.starts], Effort(), None
    if through is not None and not again:
        cheap = problem.of_predictor(through)
        ends = [alternate(cheap, wide, x, weighting, SKETCH, progress) for x in xs]
        best = max(ends, key=lambda end: end.likelihood)
        xs, working = [best.minimum.u], best.working
    if dear:
        effort = EXPENSIVE
    if again:
        effort = replace(effort, rounds=REFIT_ROUNDS)
    ends, unknowns = [], objective.unknowns
    for x in xs:
        objective.unknowns = unknowns
        ends.append(alternate(objective, wide, x, weighting, effort, progress, working))
    return ends


def _answer(problem: Problem, best: Fitted, begun: Begun) -> Identification:
    """Scatter, intervals and misfits at the optimum."""
    objective, settings, histories = problem.objective, problem.settings, problem.histories
    law, coordinates, residuals = objective.law, objective.coordinates, best.residuals
    size, x = len(law.params), best.minimum.u
    u = x[:size]
    scatter, posterior, freedom = _uncertainty(problem, best)
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
        provenance=provenance(objective, settings, begun.evaluations),
        errors=pooled_errors(histories, found, tests),
        nuisances=own,
        converged=best.minimum.converged,
        notes=(*notes(objective, best, settings, tests, own), *of_domain(found, histories)),
        histories=histories,
        using=objective.using,
        trace=begun.trace,
        linear=best.linear,
    )


def _uncertainty(problem: Problem, best: Fitted) -> tuple[Scatter, Floats, float]:
    """The whole scatter, the posterior covariance of x = (u, e), and its degrees of freedom."""
    settings, weighting = problem.settings, problem.weighting
    if best.linear is not None:
        stated = weighting.stated(best.working)
        return best.working, *restricted_laplace(best.linear, best.working, settings.nuisances, stated)
    size, known = len(problem.objective.law.params), _with_known_rate(settings.nuisances, len(problem.histories))
    at_means = best.unknowns.integrated(best.residuals, best.minimum.u[size:])
    scatter = estimated(at_means, full_guess(weighting.measured(best.working), known), known)
    given = any(n.kind == "rate" and n.sd is not None for n in known)
    wide = problem.box.beside(best.unknowns)
    pull = pulling(best.working, problem.objective.entries)
    return scatter, *laplace(best.residuals, pull, scatter, wide, best.unknowns, rate_known=given)


def _nuisances(unknowns: Unknowns, e: Floats, sd: Floats) -> tuple[NuisanceEstimate, ...]:
    return tuple(
        NuisanceEstimate(n.kind, n.scope, member, float(value), float(s), float(mean), float(spread))
        for n, member, value, s, mean, spread in zip(
            unknowns.nuisances, unknowns.members, e, sd, unknowns.mean, unknowns.sd, strict=True
        )
    )


def _with_known_rate(nuisances: Sequence[Nuisance], tests: int) -> tuple[Nuisance, ...]:
    """The nuisances, with the scatter between tests assumed where too few tests could show it."""
    if tests >= FEW_TESTS:
        return tuple(nuisances)
    return tuple(replace(n, sd=ASSUMED_RATE) if n.kind == "rate" and n.sd is None else n for n in nuisances)


def refit(fit: Identification, histories: Sequence[History]) -> Identification:
    """The same law on other histories, starting where `fit` ended (for hold-out and resampling)."""
    if fit.using is None:
        raise FitError("cannot refit an identification that was loaded from a file without its specimen")
    return identify(
        fit.law, histories, fit.using, settings=fit.settings, start=fit.u, known=fit.nuisances, reference=fit.reference
    )
