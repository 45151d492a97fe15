"""identify: one law over all curves, stresses and temperatures, with intervals."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from importlib.metadata import version

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.checks import check_bounds, check_histories, check_strains
from creepkit.inverse.coordinates import Coordinates, Reference
from creepkit.inverse.covariance import (
    ASSUMED_RATE,
    Scatter,
    effective_size,
    estimated,
    expected_effects,
    full_guess,
    log_likelihood,
    whitener,
    working_guess,
)
from creepkit.inverse.frames import thinned
from creepkit.inverse.identification import Identification, Settings, TestMisfit
from creepkit.inverse.objective import Objective, Residuals
from creepkit.inverse.scales import frame_noise, log_scale_for
from creepkit.inverse.search import (
    Box,
    Fences,
    Minimum,
    Progress,
    from_single_terms,
    measured_log_rate,
    multistart,
    refine,
)
from creepkit.inverse.uncertainty import estimates, laplace, quantile
from creepkit.language import CreepLaw, temperature
from creepkit.records import History, Nuisance, Predictor

ROUNDS = 8
"""At most as often are the sizes of scatter and the values found from one another; three rounds usually do."""
FEW_TESTS = 3
"""Below this many tests the scatter between them cannot be seen, and is assumed."""


@dataclass(frozen=True)
class _Fitted:
    """Where values and working scatter agree: the optimum, its residuals, and the likelihood."""

    minimum: Minimum
    residuals: Residuals
    working: Scatter
    likelihood: float


def identify(
    law: CreepLaw,
    histories: Sequence[History],
    using: Predictor,
    *,
    settings: Settings | None = None,
    start: Floats | None = None,
    reference: Reference | None = None,
    progress: Progress | None = None,
) -> Identification:
    """Identify the parameters of `law` from `histories` by multi-start least squares, then by their likelihood.

    using : predictor, such as the specimen that study.specimen("uniaxial") returns.
    start : conditioned coordinates to begin from instead of a global search; a refit takes two rounds at most.
    """
    settings = settings or Settings()
    check_histories(law, histories)
    thin = [thinned(h, settings.frames) for h in histories]
    coordinates = Coordinates(law, reference or Reference.of(thin))
    objective = Objective(law, thin, using, coordinates, log_scale_for(thin, "strain"))
    check_strains(objective)
    box = Box.of(law, coordinates, measured_log_rate(objective))
    noise = float(np.median([frame_noise(h, "strain") for h in histories]))
    working = working_guess(noise, objective.scale.floor, settings.nuisances)
    if start is None:
        starts, rounds = _searched(objective, box, working, settings, progress), ROUNDS
    else:
        starts, rounds = [box.clip(np.asarray(start, float))], 2
    ends = [_alternate(objective, box, u, working, settings, progress, rounds) for u in starts]
    best = max(ends, key=lambda end: end.likelihood)
    check_bounds(objective, best.minimum.u)
    return _answer(objective, box, best, settings, histories)


def _answer(
    objective: Objective, box: Box, best: _Fitted, settings: Settings, histories: Sequence[History]
) -> Identification:
    """Scatter, intervals and misfits at the optimum."""
    law, coordinates, residuals = objective.law, objective.coordinates, best.residuals
    log_times, u, known = np.log(objective.times), best.minimum.u, _with_known_rate(settings.nuisances, len(histories))
    scatter = estimated(residuals, log_times, full_guess(best.working, known), known)
    given = any(n.kind == "rate" and n.sd is not None for n in known)
    posterior, freedom = laplace(residuals, log_times, best.working, scatter, box, rate_known=given)
    misfits = tuple(_misfits(objective, residuals, expected_effects(residuals, log_times, scatter)))
    return Identification(
        law=law,
        estimates=estimates(law, coordinates, u, posterior, quantile(freedom)),
        u=u,
        covariance=posterior,
        reference=coordinates.reference,
        scatter=scatter,
        rms=_pooled(misfits),
        log_likelihood=best.likelihood,
        size=effective_size(residuals, log_times, scatter),
        freedom=freedom,
        misfits=misfits,
        ranges=_ranges(objective.histories),
        settings=settings,
        provenance=_provenance(objective, settings),
        converged=best.minimum.converged,
        notes=_notes(objective, best.minimum, settings),
        histories=tuple(histories),
        using=objective.using,
    )


def _with_known_rate(nuisances: Sequence[Nuisance], tests: int) -> tuple[Nuisance, ...]:
    """The nuisances, with the scatter between tests assumed where too few tests could show it."""
    if tests >= FEW_TESTS:
        return tuple(nuisances)
    return tuple(replace(n, sd=ASSUMED_RATE) if n.kind == "rate" and n.sd is None else n for n in nuisances)


def _searched(
    objective: Objective, box: Box, working: Scatter, settings: Settings, progress: Progress | None
) -> list[Floats]:
    """Global search with a covariance that is broad and fixed, and a loss that no single curve can capture.

    The best minima that differ, or for a sum the best one and its best term: a sum must not end worse than its terms.
    Their likelihoods decide, since the covariance is not yet known here.
    """
    factor = whitener(objective.before_fit(), np.log(objective.times), working)
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


def _alternate(
    objective: Objective, box: Box, u: Floats, working: Scatter, settings: Settings, progress: Progress | None,
    rounds: int,
) -> _Fitted:  # fmt: skip
    """Working scatter given the law, law given the scatter, until the likelihood no longer grows; the best round."""
    log_times = np.log(objective.times)
    residuals, best = objective.at(u), None
    for k in range(rounds):
        working = estimated(residuals, log_times, working, settings.nuisances)
        factor = whitener(residuals, log_times, working)
        minimum = refine(objective, box, factor, u, loss=settings.loss, steps=40, tolerance=1e-8)
        u, residuals = minimum.u, objective.at(minimum.u)
        now = _Fitted(minimum, residuals, working, log_likelihood(residuals, log_times, working))
        if progress is not None:
            progress("round", k + 1, rounds)
        gain = np.inf if best is None else now.likelihood - best.likelihood
        best = now if best is None or gain > 0 else best
        if abs(gain) < 0.02:
            break
    assert best is not None
    return best


def refit(fit: Identification, histories: Sequence[History]) -> Identification:
    """The same law on other histories, starting where `fit` ended (for hold-out and resampling)."""
    if fit.using is None:
        raise FitError("cannot refit an identification that was loaded from a file without its specimen")
    return identify(fit.law, histories, fit.using, settings=fit.settings, start=fit.u, reference=fit.reference)


def _misfits(objective: Objective, residuals: Residuals, effects: tuple[Floats, Floats]) -> list[TestMisfit]:
    found = []
    offset, log_factor = effects
    ratios = _log_ratios(objective, residuals, offset)
    for k, history in enumerate(objective.histories):
        r = ratios[k][np.isfinite(ratios[k])]
        rms, bias = (float(np.sqrt(np.mean(r**2))), float(np.mean(r))) if r.size else (np.nan, np.nan)
        own = float(offset[k]), float(np.exp(log_factor[k]))
        found.append(TestMisfit(history.name, history.condition, int(r.size), rms, bias, *own))
    return found


def _log_ratios(objective: Objective, residuals: Residuals, offset: Floats) -> Floats:
    """ln((predicted + the test's offset) / measured) where the measured strain is above twice the floor, else NaN."""
    scale = objective.scale
    predicted = scale.backward(residuals.values + objective.compared) + offset[:, None]
    above = objective.present & (objective.measured > 2 * scale.floor)
    measured = np.where(above, objective.measured, 1.0)
    return np.where(above, np.log(np.maximum(predicted, scale.floor) / measured), np.nan)


def _pooled(misfits: Sequence[TestMisfit]) -> float:
    """Root mean square over the frames of all tests."""
    frames = np.array([m.frames for m in misfits], float)
    squares = np.array([m.rms**2 if m.frames else 0.0 for m in misfits])
    return float(np.sqrt((frames * squares).sum() / frames.sum()))


def _ranges(histories: Sequence[History]) -> dict[str, tuple[float, float]]:
    """What the fitted frames cover."""
    spread = {
        "stress": [v for h in histories for v in h.loading.program().values],
        "temperature": [v for h in histories for v in h.temperature_program().values],
        "strain": [v for h in histories for v in (0.0, float(h.outputs["strain"].max()))],
        "time": [v for h in histories for v in (float(h.times[0]), float(h.times[-1]))],
    }
    return {name: (float(min(values)), float(max(values))) for name, values in spread.items()}


def _provenance(objective: Objective, settings: Settings) -> dict[str, str | int]:
    law = objective.law
    return {
        "creepkit": version("creepkit"),
        "law": law.name,
        "fingerprint": law.fingerprint,
        "specimen": getattr(objective.using, "name", type(objective.using).__name__),
        "evaluations": objective.evaluations,
        "data": _digest(objective, settings),
        "when": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def _digest(objective: Objective, settings: Settings) -> str:
    """What was compared, and how: identifications that share it can be ranked against one another."""
    digest = hashlib.sha256()
    for array in (objective.measured, objective.times, objective.present):
        digest.update(np.ascontiguousarray(array).tobytes())
    names = [h.name for h in objective.histories]
    digest.update(repr((names, objective.scale, settings.loss, settings.nuisances)).encode())
    return digest.hexdigest()[:16]


def _notes(objective: Objective, best: Minimum, settings: Settings) -> tuple[str, ...]:
    notes, law, tests = [], objective.law, objective.histories
    if not best.converged:
        notes.append("the last refinement stopped at its cap of steps: raise starts or look at the plot")
    warmth = {round(float(v), 1) for h in tests for v in h.temperature_program().values}
    if max(warmth) - min(warmth) > 5 and not law.uses(temperature):
        notes.append(f"the tests span {min(warmth):.0f} to {max(warmth):.0f} K and this law knows no temperature")
    stresses = {round(float(v), 3) for h in tests for v in h.loading.program().values}
    if len(stresses) == 1:
        notes.append("all tests have one stress: the stress dependence is not determined by them")
    if len(tests) < FEW_TESTS and any(n.kind == "rate" and n.sd is None for n in settings.nuisances):
        notes.append(f"fewer than {FEW_TESTS} tests: their rates are assumed to scatter by {100 * ASSUMED_RATE:.0f} %")
    if float(objective.measured.max()) > 0.5:
        notes.append("strains above 0.5 were fitted: a column in percent must say so, as strain_pct")
    if (Fences(objective).violations(best.u) > 1e-3).any():
        notes.append("a constraint of the law does not hold over the tests at these values")
    return tuple(notes)
