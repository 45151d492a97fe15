"""identify: one law over all curves, stresses and temperatures, with intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from importlib.metadata import version

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.coordinates import Coordinates, Reference
from creepkit.inverse.covariance import (
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

LOSSES = ("linear", "soft_l1", "huber", "cauchy", "arctan")
PUSH = 1.0
"""How far, in ln, data may push a coefficient beyond its bounds against the fence before that is an error."""
ROUNDS = 8
"""At most as often are the sizes of scatter and the values found from one another; three rounds usually do."""
NUISANCES = (Nuisance("offset"), Nuisance("rate"))
"""Unless told otherwise: a loading-strain offset of each curve and test-to-test scatter of the rate, both estimated."""


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
    start : conditioned coordinates to begin from instead of a global search; a refit takes two rounds at most.
    """
    settings = settings or Settings()
    _check(law, histories, settings, nuisances)
    thin = [thinned(h, settings.frames) for h in histories]
    reference = reference or Reference.of(thin)
    coordinates = Coordinates(law, reference)
    objective = Objective(law, thin, using, coordinates, log_scale_for(thin, "strain"))
    box = Box.of(law, coordinates, measured_log_rate(objective))
    log_times = np.log(objective.times)
    noise = float(np.median([frame_noise(h, "strain") for h in histories]))
    working = working_guess(noise, objective.scale.floor, nuisances)
    if start is None:
        candidates = _searched(objective, box, whitener(objective.before_fit(), log_times, working), settings, progress)
    else:
        candidates = [box.clip(np.asarray(start, float))]
    rounds = ROUNDS if start is None else 2
    ends = [
        _alternate(objective, box, log_times, u, working, nuisances, settings, progress, rounds) for u in candidates
    ]
    best, residuals, working = max(ends, key=lambda end: log_likelihood(end[1], log_times, end[2]))
    _check_bounds(law, coordinates, best.u)
    scatter = estimated(residuals, log_times, full_guess(working, len(thin), nuisances), nuisances)
    covariance, freedom = laplace(residuals, log_times, working, scatter, box)
    misfits = tuple(_misfits(objective, residuals, expected_effects(residuals, log_times, scatter)))
    return Identification(
        law=law,
        estimates=estimates(law, coordinates, best.u, covariance, quantile(freedom)),
        u=best.u,
        covariance=covariance,
        reference=reference,
        scatter=scatter,
        rms=_pooled(misfits),
        log_likelihood=log_likelihood(residuals, log_times, working),
        size=effective_size(residuals, log_times, scatter),
        freedom=freedom,
        misfits=misfits,
        ranges=_ranges(thin),
        settings=settings,
        provenance=_provenance(law, objective),
        converged=best.converged,
        notes=_notes(law, objective, best),
        histories=tuple(histories),
        using=using,
    )


def _searched(
    objective: Objective, box: Box, factor: Floats, settings: Settings, progress: Progress | None
) -> list[Floats]:
    """Global search with a covariance that is broad and fixed, and a loss that no single curve can capture.

    The few best minima that differ; their likelihoods decide, since the covariance is not yet known here.
    """
    loss = "soft_l1" if settings.loss == "linear" else settings.loss
    few = max(2, settings.starts // 3)
    singles = from_single_terms(
        objective, box, factor, starts=few, draws=settings.draws // 2, seed=settings.seed, loss=loss
    )
    minima = multistart(
        objective, box, factor, starts=settings.starts, draws=settings.draws, seed=settings.seed, loss=loss,
        progress=progress, extra=singles,
    )  # fmt: skip
    return _distinct(minima, box)


def _distinct(minima: Sequence[Minimum], box: Box, most: int = 2, near: float = 0.02) -> list[Floats]:
    """The best minima, at most two, that differ by more than 2 % of the box in some coordinate."""
    kept: list[Floats] = []
    for minimum in minima:
        if all((np.abs(minimum.u - u) > near * box.width).any() for u in kept):
            kept.append(minimum.u)
    return kept[:most]


def _alternate(
    objective: Objective, box: Box, log_times: Floats, u: Floats, working: Scatter, nuisances: Sequence[Nuisance],
    settings: Settings, progress: Progress | None, rounds: int,
) -> tuple[Minimum, Residuals, Scatter]:  # fmt: skip
    """Working scatter given the law, law given the scatter, until the likelihood no longer grows."""
    residuals = objective.at(u)
    best, likelihood = Minimum(u, np.inf, False, 0), -np.inf
    for k in range(rounds):
        working = estimated(residuals, log_times, working, nuisances)
        factor = whitener(residuals, log_times, working)
        best = refine(objective, box, factor, best.u, loss=settings.loss, steps=40, tolerance=1e-8)
        residuals = objective.at(best.u)
        now = log_likelihood(residuals, log_times, working)
        if progress is not None:
            progress("round", k + 1, rounds)
        if abs(now - likelihood) < 0.02:
            break
        likelihood = now
    return best, residuals, working


def refit(fit: Identification, histories: Sequence[History]) -> Identification:
    """The same law on other histories, starting where `fit` ended (for hold-out and resampling)."""
    if fit.using is None:
        raise FitError("cannot refit an identification that was loaded from a file without its specimen")
    settings = replace(fit.settings, starts=1)
    return identify(fit.law, histories, fit.using, settings=settings, start=fit.u, reference=fit.reference)


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
    """ln(predicted + the test's offset) - ln(measured) where the measured strain is above twice the floor, else NaN."""
    scale = objective.scale
    predicted = scale.backward(residuals.values + objective.compared)
    above = objective.present & (objective.measured > 2 * scale.floor)
    return np.where(above, scale.forward(predicted + offset[:, None]) - objective.compared, np.nan)


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


def _provenance(law: CreepLaw, objective: Objective) -> dict[str, object]:
    return {
        "creepkit": version("creepkit"),
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


def _check_bounds(law: CreepLaw, coordinates: Coordinates, u: Floats) -> None:
    """A coefficient that the data push through its bounds is an error: the answer would be the bound's, not theirs."""
    theta = coordinates.theta(u)
    for k in coordinates.rates:
        name, param = law.names[k], law.table[law.names[k]]
        low, high = (param.to_internal(b) for b in param.bounds)
        if not low - PUSH <= theta[k] <= high + PUSH:
            found = param.from_internal(float(theta[k]))
            raise FitError(
                f"law '{law.name}': the bounds exclude the data, which push {name} to {found:.3g} {param.unit} and it "
                f"may lie from {param.bounds[0]:g} to {param.bounds[1]:g}; widen its bounds or choose another law"
            )


def _check(law: CreepLaw, histories: Sequence[History], settings: Settings, nuisances: Sequence[Nuisance]) -> None:
    if not histories:
        raise FitError(f"law '{law.name}': there are no histories to identify it from")
    for nuisance in nuisances:
        if nuisance.kind not in ("offset", "rate") or nuisance.scope != "test":
            raise FitError(
                f"nuisance '{nuisance.kind}' for {nuisance.scope} is not known to this identification; "
                "allowed are 'offset' and 'rate', one for each test"
            )
    if settings.loss not in LOSSES:
        raise FitError(f"loss '{settings.loss}' is not known; allowed are {', '.join(LOSSES)}")
    for history in histories:
        if int((history.used & (history.times > 0)).sum()) < 2:
            raise FitError(f"history '{history.name}' has fewer than two usable frames after time zero")
    frames = sum(int(h.used.sum()) for h in histories)
    if frames <= len(law.params):
        raise FitError(f"law '{law.name}' has {len(law.params)} parameters and the histories only {frames} frames")
