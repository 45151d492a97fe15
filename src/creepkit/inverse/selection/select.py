"""select: several laws are identified from the same histories and ranked.

Candidates are laws and sums of two of them. Where curves contradict a law, it is tried with the true stress held in
place of the load, or the reverse: a bar thins as it creeps, its true stress under a constant load grows with
exp(strain), and a rate s^n with exp(n strain), by 16 % at n = 5 and a strain of 3 %. Which of the two a rig held is
seldom written down.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np

from creepkit.errors import CreepkitError, FitError, LawError
from creepkit.inverse.adequacy import Remedy
from creepkit.inverse.candidates import candidates
from creepkit.inverse.compared_tests import common_rupture_times, testable_laws
from creepkit.inverse.composite_predictor import through_for_law
from creepkit.inverse.explanation import VERDICT_ODDS
from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import describing, identify, sampled_where_needed
from creepkit.inverse.reference_conditions import with_arrhenius
from creepkit.inverse.search.local_refinement import IterationCallback
from creepkit.inverse.search.multistart import StartingEstimate
from creepkit.inverse.selection.ranking import Ranking, rank
from creepkit.inverse.settings import IdentificationSettings
from creepkit.language import CreepLaw, strain, temperature, time
from creepkit.language.algebra import fixed_values
from creepkit.records import History, Predictor, is_logarithmic
from creepkit.records.loading import held_otherwise
from creepkit.registry import default_registry, kinds

ALIKE = 2.0
"""Of the log-likelihood, by which a search that converged may end below another."""


def sums_of_two(laws: Sequence[CreepLaw]) -> list[CreepLaw]:
    """Sums of every two of the laws, such as primary and steady creep of Norton's law beside strain hardening.

    A law with a back stress flows along a stress of its own, and is in no sum.
    """
    return [a + b for a, b in combinations(_distinct_laws(laws), 2) if not (a.back_stresses or b.back_stresses)]


def _distinct_laws(laws: Sequence[CreepLaw]) -> list[CreepLaw]:
    by_fingerprint: dict[str, CreepLaw] = {}
    for law in laws:
        by_fingerprint.setdefault(law.fingerprint, law)
    return list(by_fingerprint.values())


def select(
    candidates: Sequence[CreepLaw],
    histories: Sequence[History],
    using: Predictor | Mapping[str, Predictor],
    *,
    settings: IdentificationSettings | None = None,
    through: Predictor | None = None,
    sums: bool | None = None,
    progress: IterationCallback | None = None,
) -> Ranking:
    """Identify every candidate from the same histories by likelihood, and rank them; see identify.describing.

    sums : also sums of two candidates: True, False, or None for sums of the best law where it does not explain the
        tests to their noise, and then richer registered laws, at most settings.further_laws of both together.
    A law that cannot be identified is named in `failed`; FitError if none can. The search of a best law that did not
    converge is repeated.
    """
    asked = settings or IdentificationSettings()
    settings = replace(asked, weights="likelihood")
    if not candidates:
        raise FitError("there are no candidate laws; give at least one, such as ck.law('norton')")
    settings = common_rupture_times(candidates, settings)
    failed: dict[str, str] = {}
    fits = _identify_all(list(candidates), histories, using, settings, through, progress, failed)
    tried_further: tuple[str, ...] = ()
    if fits and sums:
        pairs = sums_of_two([fit.law for fit in fits])
        fits += _identify_all(pairs, histories, using, settings, through, progress, failed, "sum")
    elif fits and sums is None:
        ranking = rank(fits, challenge=False)
        best = with_hold_tried(ranking.best)
        fits = [best if fit is ranking.best else fit for fit in fits]
        ranking = replace(ranking, laws=(replace(ranking.laws[0], fit=best), *ranking.laws[1:]))
        richer = _richer_laws(ranking, histories)[: settings.further_laws]
        fits += _identify_all(richer, histories, using, settings, through, progress, failed, "further law")
        tried_further = tuple(law.name for law in richer if law.name not in failed)
    if not fits:
        name, reason = next(iter(failed.items()))
        raise FitError(f"none of the {len(failed)} laws could be identified; {name}: {reason}")
    ranking = rank(fits, failed, further=tried_further)
    if not ranking.best.converged:
        best = _repeated(ranking.best, using, settings, through)
        fits = [best if fit is ranking.best else fit for fit in fits]
        ranking = rank(fits, failed, further=tried_further)
    shown = {id(one) for one in (ranking.laws[0], *ranking.credible)}
    laws = [replace(one, fit=as_shown(one.fit, asked, through)) if id(one) in shown else one for one in ranking.laws]
    return replace(ranking, laws=tuple(laws), further=tried_further)


def _repeated(fit: Identification, using: Any, settings: IdentificationSettings, through: Any) -> Identification:
    """An identification that did not converge, from its end and then by twice the starts, until the likeliest does."""
    best, through = fit, through_for_law(through, fit.law)
    for start, starts in ((StartingEstimate.from_identification(fit), settings.starts), (None, 2 * settings.starts)):
        more = {"settings": replace(settings, starts=starts), "start": start, "through": through}
        with suppress(CreepkitError):
            best = max(
                (best, identify(fit.law, fit.histories, using, **more)),
                key=lambda one: one.log_likelihood + ALIKE * one.converged,
            )
        if best.converged:
            break
    return best


def as_shown(fit: Identification, asked: IdentificationSettings, through: Predictor | None) -> Identification:
    """What is shown of a law that may be the one: values that describe the tests, and samples where they are needed."""
    fit = describing(fit) if asked.weights != "likelihood" else fit
    return with_hold_tried(sampled_where_needed(fit, through))


def _richer_laws(ranking: Ranking, histories: Sequence[History]) -> list[CreepLaw]:
    """What is tried where no candidate explains the tests: laws that suit them, sums of the best one, then others.

    A best law with damage is tried with primary creep first.

    Nothing where a candidate would explain them with errors as large as usual that are not modelled, or but for one
    test or for two groups of tests: that is the simpler explanation.
    """
    adequacies = [ranked.fit.adequacy for ranked in ranking.laws]
    if any(a is None or a.verdict != "leaves a discrepancy" or a.lies_in_tests for a in adequacies):
        return []
    if any(remedy.is_usual for adequacy in adequacies if adequacy is not None for remedy in adequacy.remedies):
        return []
    laws = [ranked.fit.law for ranked in ranking.laws]
    tried = {law.fingerprint for law in laws}
    suited = [_with_temperature_of(laws, law, histories) for law in (candidates(histories) if histories else [])]
    with suppress(LawError):  # of one with primary creep of its own
        suited += [laws[0].with_primary()] * bool(laws[0].states)
    sums = [
        laws[0] + other
        for other in laws[1:]
        if not ((laws[0].states and other.states) or laws[0].back_stresses or other.back_stresses)
    ]  # a piece breaks once, and flows along one effective stress
    free = {name for law in laws for name in law.names}
    fixed = {name: value for law in laws for name, value in fixed_values(law).items() if name not in free}
    suited = [_with_fixed(law, fixed) for law in suited]
    others = [_with_fixed(law, fixed) for law in _registered_laws(laws, histories)]
    richer = _distinct_laws([*suited, *sums, *others])
    return testable_laws([law for law in richer if law.fingerprint not in tried], histories)


def _with_fixed(law: CreepLaw, fixed: Mapping[str, float]) -> CreepLaw:
    """The law with what is fixed in those that were tried fixed in it too; a coefficient is each law's own."""
    table = law.table
    same = [name for name in fixed if name in table and table[name].scale == "linear"]
    return law.fix(**{name: fixed[name] for name in same if table[name].within_bounds(fixed[name])})


def _registered_laws(tried: Sequence[CreepLaw], histories: Sequence[History]) -> list[CreepLaw]:
    """Registered laws without a temperature of their own; first those that depend on what none of the tried laws does.

    A law counts as such where it has internal variables, or uses strain and time in a way that none of them does.
    Within each kind those with the fewest parameters come first.
    """

    def memory(law: CreepLaw) -> tuple[bool, bool, bool]:
        return law.uses(strain), law.uses(time), bool(law.states)

    known = {memory(law) for law in tried}
    laws = [law for law in default_registry().values(kinds.LAWS) if not law.uses(temperature)]
    laws = [_with_temperature_of(tried, law, histories) for law in laws]
    return sorted(laws, key=lambda law: (memory(law) in known, len(law.params), law.name))


def _with_temperature_of(tried: Sequence[CreepLaw], law: CreepLaw, histories: Sequence[History]) -> CreepLaw:
    """The law with an Arrhenius factor where those that were tried have one."""
    return with_arrhenius(law, histories) if any(one.uses(temperature) for one in tried) else law


def _identify_all(
    laws: Sequence[CreepLaw],
    histories: Sequence[History],
    using: Predictor | Mapping[str, Predictor],
    settings: IdentificationSettings,
    through: Predictor | None,
    progress: IterationCallback | None,
    failed: dict[str, str],
    kind: str = "law",
) -> list[Identification]:
    """The laws that can be identified; of the others `failed` says why.

    kind : what they are, for the progress: "law 3 of 8: Garofalo's hyperbolic sine".
    """
    fits = []
    for k, law in enumerate(laws):
        task = f"{kind} {k + 1} of {len(laws)}: {law.title or law.name}"
        if progress is not None:
            progress(task, k, len(laws))
        try:
            fits.append(identify(law, histories, using, settings=settings, through=through_for_law(through, law)))
        except CreepkitError as error:
            failed[law.name] = str(error)
        if progress is not None:
            progress(task, k + 1, len(laws))
    return fits


LEAST_STRAIN, LARGE_SCATTER = 0.005, 0.2
"""Largest strain measured, from which on curves show what was held: the stress of a bar under load has grown by as
much; and scatter of ln rate between tests, from which on that may be what made it: a stress exponent that the bend of
curves sets leaves the rates of tests behind."""


HELD_INSTEAD = {
    "stress": "the true stress held in place of the load (control = stress)",
    "load": "the load held in place of the true stress (control = load)",
}
"""{what was held: the remedy}."""


def with_hold_tried(fit: Identification) -> Identification:
    """The identification, with what was held among the remedies where the law then explains its tests."""
    adequacy = fit.adequacy
    scatters = adequacy is not None and adequacy.rate_scatter > LARGE_SCATTER
    if adequacy is None or not (adequacy.misses_shape() or scatters) or adequacy.is_explained or fit.predictor is None:
        return fit
    if any(remedy.kind == "control" for remedy in adequacy.remedies):
        return fit  # tried before
    others = [held_otherwise(history.loading) for history in fit.histories]
    held = {other[1] for other in others if other is not None}
    if None in others or len(held) != 1 or max(map(_largest_strain, fit.histories)) < LEAST_STRAIN:
        return fit
    tests = [h.replace(loading=other[0]) for h, other in zip(fit.histories, others, strict=True) if other is not None]
    settings = replace(fit.settings, weights="likelihood")
    start = StartingEstimate.from_identification(fit, values_only=True)
    with suppress(CreepkitError):
        found = identify(fit.law, tests, fit.predictor, settings=settings, start=start)
        likelier = adequacy.rejects or found.log_likelihood > fit.log_likelihood + VERDICT_ODDS
        if found.adequacy is not None and found.adequacy.explains and likelier:
            remedies = (Remedy("control", HELD_INSTEAD[held.pop()]), *adequacy.remedies)
            return replace(fit, adequacy=replace(adequacy, remedies=remedies))
    return fit


def _largest_strain(history: History) -> float:
    values = [v[history.used] for name, v in history.outputs.items() if is_logarithmic(name)]
    return max((float(np.nanmax(v)) for v in values if np.isfinite(v).any()), default=0.0)
