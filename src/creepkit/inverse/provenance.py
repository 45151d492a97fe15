"""What an identification says about itself: where it came from, what it covers, and what to be wary of."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.metadata import version

import numpy as np

from creepkit import registry
from creepkit.inverse.alternation import Fitted
from creepkit.inverse.fences import Fences
from creepkit.inverse.findings import NuisanceEstimate, TestMisfit
from creepkit.inverse.nominal import end_strain, stresses
from creepkit.inverse.objective import Objective
from creepkit.inverse.scales import usable
from creepkit.inverse.scatter import ASSUMED_RATE, FEW_TESTS
from creepkit.inverse.settings import Settings
from creepkit.language import temperature
from creepkit.records import History, Prediction, Status

DISTRUSTED = 0.5
"""Weight below which a test is named."""

USUAL_STRAIN, RUPTURE_STRAIN = 0.5, 2.0
"""Strains above these are worth a word: of a test whose end is not known, and of one that was followed to it."""


def ranges(objective: Objective) -> dict[str, tuple[float, float]]:
    """What the fitted frames cover."""
    tests = objective.histories
    spread = {
        "stress": [v for h in tests for v in stresses(h, objective.using)],
        "temperature": [v for h in tests for v in h.temperature_program().values],
        "strain": [0.0, *(end_strain(h, objective.using) for h in tests)],
        "time": [v for h in tests for v in (float(h.times[0]), float(h.times[-1]))],
    }
    return {name: (float(min(values)), float(max(values))) for name, values in spread.items()}


def provenance(objective: Objective, settings: Settings, screened: int) -> dict[str, str | int]:
    """Versions, fingerprints and counts; one evaluation is one candidate on all tests.

    screened : evaluations of the global search, by the stand-in where the predictor has one.
    """
    law = objective.law
    return {
        "creepkit": version("creepkit"),
        "law": law.name,
        "origin": registry.default().origin(law),
        "fingerprint": law.fingerprint,
        "specimen": getattr(objective.using, "name", type(objective.using).__name__),
        "evaluations": objective.evaluations,
        "search_evaluations": screened,
        "data": _digest(objective, settings),
        "when": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def _digest(objective: Objective, settings: Settings) -> str:
    """What was compared, and how: identifications that share it can be ranked against one another."""
    digest, entries = hashlib.sha256(), objective.entries
    for array in (entries.measured, entries.times, entries.present, entries.output):
        digest.update(np.ascontiguousarray(array).tobytes())
    names = [h.name for h in objective.histories]
    weights = settings.weights if isinstance(settings.weights, str) else sorted(settings.weights.items())
    how = (names, entries.outputs, entries.scales, settings.loss, settings.test_loss, weights, settings.nuisances)
    digest.update(repr(how).encode())
    return digest.hexdigest()[:16]


def notes(
    objective: Objective, best: Fitted, settings: Settings, tests: Sequence[TestMisfit],
    nuisances: Sequence[NuisanceEstimate],
) -> tuple[str, ...]:  # fmt: skip
    """What to be wary of, one sentence each."""
    found, law, histories = [], objective.law, objective.histories
    if not best.minimum.converged:
        found.append("the last refinement stopped at its cap of steps: raise starts or look at the plot")
    warmth = {round(float(v), 1) for h in histories for v in h.temperature_program().values}
    if max(warmth) - min(warmth) > 5 and not law.uses(temperature):
        found.append(f"the tests span {min(warmth):.0f} to {max(warmth):.0f} K and this law knows no temperature")
    levels = {round(float(v), 3) for h in histories for v in stresses(h, objective.using)}
    if len(levels) == 1 and all(h.loading.quantity == "stress" for h in histories):
        found.append("all tests have one stress: the stress dependence is not determined by them")
    if len(histories) < FEW_TESTS and any(n.kind == "rate" and n.sd is None for n in settings.nuisances):
        assumed = f"their rates are assumed to scatter by {100 * ASSUMED_RATE:.0f} %"
        unseen = "how their rates scatter cannot be seen, and intervals are those of these tests alone"
        found.append(f"fewer than {FEW_TESTS} tests: {unseen if settings.weights == 'likelihood' else assumed}")
    found += _of_large_strains(histories)
    if (Fences(objective).violations(best.minimum.u[: len(law.params)]) > 1e-3).any():
        found.append("a constraint of the law does not hold over the tests at these values")
    return (*found, *_of_tests(objective, tests, nuisances))


def of_domain(found: Prediction, histories: Sequence[History]) -> tuple[str, ...]:
    """The tests for which a surrogate speaks of what it was not trained on, in one sentence."""
    outside = [h.name for h, s in zip(histories, found.status[0], strict=True) if s == Status.OUTSIDE_DOMAIN]
    if not outside:
        return ()
    shown = f"'{outside[0]}'" + (f" and {len(outside) - 1} more" if len(outside) > 1 else "")
    told = "the answer lies outside the domain that the surrogate was trained in"
    return (f"{told}, in test {shown}: simulate it with the specimen itself",)


def _of_large_strains(histories: Sequence[History]) -> list[str]:
    """A column in percent that was taken for plain strain shows in its size."""
    for known, limit in ((False, USUAL_STRAIN), (True, RUPTURE_STRAIN)):
        tests = [h for h in histories if "strain" in h.outputs and h.ended == known]
        if any(h.outputs["strain"][usable(h, "strain")].max(initial=0.0) > limit for h in tests):
            return [f"strains above {limit:g} were fitted: a column in percent must say so, as strain_pct"]
    return []


def _of_tests(objective: Objective, tests: Sequence[TestMisfit], nuisances: Sequence[NuisanceEstimate]) -> list[str]:
    found = [
        f"test '{m.name}' is far from the others and weighs {m.weight:.2g} of one"
        for m in tests
        if m.weight < DISTRUSTED
    ]
    unknowns = objective.unknowns
    for n, low, high in zip(nuisances, unknowns.low, unknowns.high, strict=True):
        if min(n.value - low, high - n.value) < 1e-4 * (high - low):
            found.append(f"the {n.kind} of '{n.member}' lies at its bound, {n.value:.4g}")
    return found
