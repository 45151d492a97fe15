"""select: which of several laws the histories speak for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from creepkit.errors import CreepkitError, FitError
from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import identify
from creepkit.inverse.search.refining import Progress
from creepkit.inverse.selection.candidates import sums_of_two
from creepkit.inverse.selection.holding_out import hold_out_scores
from creepkit.inverse.selection.ranking import Criterion, Ranking, rank, ranked
from creepkit.inverse.settings import Settings
from creepkit.language import CreepLaw
from creepkit.records import History, Predictor

FRAMES = 60
"""Frames of a history that are looked at, unless settings say otherwise."""
BEYOND_NOISE = 2.0
"""Drift that the best single law leaves in its first output, in units of the noise there, from which sums are tried."""


def select(
    candidates: Sequence[CreepLaw],
    histories: Sequence[History],
    using: Predictor | Mapping[str, Predictor],
    *,
    settings: Settings | None = None,
    through: Predictor | None = None,
    sums: bool | None = False,
    by: Criterion = "bic",
    progress: Progress | None = None,
) -> Ranking:
    """Identify every candidate from the same histories by likelihood, and rank them.

    sums : also sums of two candidates: True, False, or None where the best single law leaves more than noise.
    by : "bic", "aicc", or "hold-out" (the last 30 % of each history predicted from a refit to the first 70 %).
    A law that cannot be identified is named in `failed`; FitError if none can.
    """
    settings = replace(settings or Settings(frames=FRAMES), weights="likelihood")
    if not candidates:
        raise FitError("there are no candidate laws; give at least one, such as ck.law('norton')")
    failed: dict[str, str] = {}
    fits = _identified(list(candidates), histories, using, settings, through, progress, failed)
    if fits and (sums or (sums is None and _leaves_more_than_noise(rank(fits).best))):
        pairs = sums_of_two([fit.law for fit in fits])
        fits += _identified(pairs, histories, using, settings, through, progress, failed)
    if not fits:
        name, reason = next(iter(failed.items()))
        raise FitError(f"none of the {len(failed)} laws could be identified; {name}: {reason}")
    if by == "hold-out":
        scores = hold_out_scores(fits)
        return ranked(fits, np.array(scores), by, size=float("nan"), failed=failed)
    return rank(fits, by, failed)


def _identified(
    laws: Sequence[CreepLaw], histories: Sequence[History], using: Predictor | Mapping[str, Predictor],
    settings: Settings, through: Predictor | None, progress: Progress | None, failed: dict[str, str],
) -> list[Identification]:  # fmt: skip
    found = []
    for k, law in enumerate(laws):
        try:
            found.append(identify(law, histories, using, settings=settings, through=through))
        except CreepkitError as error:
            failed[law.name] = str(error)
        if progress is not None:
            progress("law", k + 1, len(laws))
    return found


def _leaves_more_than_noise(fit: Identification) -> bool:
    """Whether the law leaves something in its first output that wanders by more than the noise."""
    assert fit.linear is not None
    name = next(iter(fit.scatter.outputs))
    sizes, entries = fit.scatter[name], fit.linear.residuals
    slope = float(np.median(np.abs(entries.slopes[entries.present & (entries.output == 0)])))
    return sizes.drift > BEYOND_NOISE * sizes.noise * slope
