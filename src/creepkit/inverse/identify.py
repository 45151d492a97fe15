"""identify: one law over all curves, stresses and temperatures, with intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.coordinates import Coordinates, Reference
from creepkit.inverse.covariance import (
    Scatter,
    effective_size,
    estimated,
    expected_effects,
    first_guess,
    log_likelihood,
    whitener,
)
from creepkit.inverse.frames import thinned
from creepkit.inverse.identification import Identification, Settings, TestMisfit
from creepkit.inverse.objective import Objective, Residuals
from creepkit.inverse.scales import frame_noise, log_scale_for
from creepkit.inverse.search import Box, Minimum, Progress, measured_log_rate, multistart, refine
from creepkit.inverse.uncertainty import estimates, laplace
from creepkit.language import CreepLaw, temperature
from creepkit.records import History, Nuisance, Predictor

LOSSES = ("linear", "soft_l1", "huber", "cauchy", "arctan")
NUISANCES = (Nuisance("offset"), Nuisance("rate"))
"""Unless told otherwise: a loading-strain offset for each curve, and test-to-test scatter of the rate, both estimated."""


def identify(
    law: CreepLaw,
    histories: Sequence[History],
    using: Predictor,
    *,
    nuisances: Sequence[Nuisance] = NUISANCES,
    settings: Settings | None = None,
    start: Floats | None = None,
    reference: Reference | None = None,
    progress: Progress | None = None,
) -> Identification:
    """Identify the parameters of `law` from `histories` by multi-start least squares, then by their likelihood.

    using : predictor, such as the specimen "uniaxial".
    nuisances : what differs between tests; sd=None estimates the spread from the data.
    start : conditioned coordinates to begin from instead of a global search (a refit).
    """
    settings = settings or Settings()
    _check(law, histories, settings)
    thin = [thinned(h, settings.frames) for h in histories]
    reference = reference or Reference.of(thin)
    coordinates = Coordinates(law, reference)
    objective = Objective(law, thin, using, coordinates, log_scale_for(thin, "strain"))
    box = Box.of(law, coordinates, measured_log_rate(objective))
    log_times = np.log(objective.times)
    noise = float(np.median([frame_noise(h, "strain") for h in histories]))
    scatter = first_guess(noise, len(thin), nuisances)
    if start is None:
        factor = whitener(objective.before_fit(), log_times, scatter)
        minima = multistart(
            objective, box, factor, starts=settings.starts, draws=settings.draws, seed=settings.seed,
            loss=settings.loss if settings.loss != "linear" else "soft_l1", progress=progress,
        )  # fmt: skip
        u = minima[0].u
    else:
        u = box.clip(np.asarray(start, float))
    best, residuals, scatter = _alternate(objective, box, log_times, u, scatter, nuisances, settings, progress)
    factor = whitener(residuals, log_times, scatter)
    covariance = laplace(residuals, factor, box)
    return Identification(
        law=law,
        estimates=estimates(law, coordinates, best.u, covariance),
        u=best.u,
        covariance=covariance,
        reference=reference,
        scatter=scatter,
        rms=_rms(objective, residuals),
        log_likelihood=log_likelihood(residuals, log_times, scatter),
        size=effective_size(residuals, log_times, scatter),
        misfits=tuple(_misfits(objective, residuals, expected_effects(residuals, log_times, scatter))),
        ranges=_ranges(thin),
        settings=settings,
        provenance=_provenance(law, objective),
        converged=best.converged,
        notes=_notes(law, objective, best),
        histories=tuple(histories),
        using=using,
    )


def _alternate(
    objective: Objective, box: Box, log_times: Floats, u: Floats, scatter: Scatter, nuisances: Sequence[Nuisance],
    settings: Settings, progress: Progress | None, rounds: int = 6,
) -> tuple[Minimum, Residuals, Scatter]:  # fmt: skip
    """Scatter given the law, law given the scatter, until the likelihood no longer grows."""
    residuals = objective.at(u)
    best, likelihood = Minimum(u, np.inf, False, 0), -np.inf
    for k in range(rounds):
        scatter = estimated(residuals, log_times, scatter, nuisances)
        factor = whitener(residuals, log_times, scatter)
        best = refine(objective, box, factor, best.u, loss=settings.loss)
        residuals = objective.at(best.u)
        now = log_likelihood(residuals, log_times, scatter)
        if progress is not None:
            progress("round", k + 1, rounds)
        if abs(now - likelihood) < 0.05:
            break
        likelihood = now
    return best, residuals, scatter


def refit(fit: Identification, histories: Sequence[History]) -> Identification:
    """The same law on other histories, starting where `fit` ended (for hold-out and resampling)."""
    if fit.using is None:
        raise FitError("cannot refit an identification that was loaded from a file without its specimen")
    settings = replace(fit.settings, starts=1)
    return identify(fit.law, histories, fit.using, settings=settings, start=fit.u, reference=fit.reference)


def _misfits(objective: Objective, residuals: Residuals, effects: tuple[Floats, Floats]) -> list[TestMisfit]:
    found = []
    offset, log_factor = effects
    for k, history in enumerate(objective.histories):
        r = _log_ratios(objective, residuals)[k]
        r = r[np.isfinite(r)]
        rms, bias = (float(np.sqrt(np.mean(r**2))), float(np.mean(r))) if r.size else (np.nan, np.nan)
        own = float(offset[k]), float(np.exp(log_factor[k]))
        found.append(TestMisfit(history.name, history.condition, int(r.size), rms, bias, *own))
    return found


def _log_ratios(objective: Objective, residuals: Residuals) -> Floats:
    """Compared difference where the measured strain is above the floor of the scale, NaN elsewhere."""
    above = objective.present & (objective.measured > 2 * objective.scale.floor)
    return np.where(above, residuals.values, np.nan)


def _rms(objective: Objective, residuals: Residuals) -> float:
    return float(np.sqrt(np.nanmean(_log_ratios(objective, residuals) ** 2)))


def _ranges(histories: Sequence[History]) -> dict[str, tuple[float, float]]:
    """What the fitted frames cover."""
    spread = {
        "stress": [v for h in histories for v in h.loading.program().values],
        "temperature": [v for h in histories for v in h.temperature_program().values],
        "strain": [v for h in histories for v in (0.0, float(h.outputs["strain"].max()))],
        "time": [v for h in histories for v in (float(h.times[0]), float(h.times[-1]))],
    }
    return {name: (float(min(values)), float(max(values))) for name, values in spread.items()}


def _provenance(law: CreepLaw, objective: Objective) -> dict[str, object]:
    import creepkit

    return {
        "creepkit": creepkit.__version__,
        "law": law.name,
        "fingerprint": law.fingerprint,
        "specimen": getattr(objective.using, "name", type(objective.using).__name__),
        "evaluations": objective.evaluations,
        "when": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def _notes(law: CreepLaw, objective: Objective, best: Minimum) -> tuple[str, ...]:
    notes = []
    if not best.converged:
        notes.append("the last refinement stopped at its cap of steps: raise settings.starts or look at the plot")
    warmth = {round(float(v), 1) for h in objective.histories for v in h.temperature_program().values}
    if len(warmth) > 1 and max(warmth) - min(warmth) > 5 and not law.uses(temperature):
        notes.append(f"the tests span {min(warmth):.0f} to {max(warmth):.0f} K and this law knows no temperature")
    stresses = {round(float(v), 3) for h in objective.histories for v in h.loading.program().values}
    if len(stresses) == 1:
        notes.append("all tests have one stress: the stress dependence is not determined by them")
    return tuple(notes)


def _check(law: CreepLaw, histories: Sequence[History], settings: Settings) -> None:
    if not histories:
        raise FitError(f"law '{law.name}': there are no histories to identify it from")
    if settings.loss not in LOSSES:
        raise FitError(f"loss '{settings.loss}' is not known; allowed are {', '.join(LOSSES)}")
    for history in histories:
        if int((history.used & (history.times > 0)).sum()) < 2:
            raise FitError(f"history '{history.name}' has fewer than two usable frames after time zero")
    frames = sum(int(h.used.sum()) for h in histories)
    if frames <= len(law.params):
        raise FitError(f"law '{law.name}' has {len(law.params)} parameters and the histories only {frames} frames")
