"""The rigs of a design, and what its expectations take for granted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from creepkit.errors import FitError
from creepkit.experiments.candidate_tests import CandidateTest
from creepkit.experiments.rig import Rig, rigs_of
from creepkit.inverse.composite_predictor import predictor_for
from creepkit.inverse.identification import Identification
from creepkit.inverse.noise_model import MINIMUM_TESTS
from creepkit.language import temperature
from creepkit.records import dimensions_of
from creepkit.records.units import time_text


def rigs_for(fit: Identification, rig: Rig | Sequence[Rig] | None) -> tuple[Rig, ...]:
    """The rigs given, or those that the tests suggest; FitError for one of another specimen."""
    assert fit.predictor is not None
    if rig is None:
        return rigs_of(fit.histories, fit.predictor)
    rigs = (rig,) if isinstance(rig, Rig) else tuple(rig)
    if not rigs:
        raise FitError("rig= takes a ck.Rig, or several in a list; found none")
    known = dict.fromkeys(h.specimen for h in fit.histories)
    for one in rigs:
        if one.specimen not in known:
            raise FitError(
                f"the rig tests specimen '{one.specimen}', but the law was identified from tests of "
                f"{' and '.join(repr(name) for name in known)}"
            )
        check_dimensions(one, fit)
    return rigs


def check_dimensions(rig: Rig, fit: Identification) -> None:
    """FitError for a dimension that the test pieces of a rig do not have."""
    assert fit.predictor is not None
    history = next(h for h in fit.histories if h.specimen == rig.specimen)
    predictor = predictor_for(fit.predictor, history)
    known = [d.name for d in dimensions_of(predictor)]
    for name in rig.dimensions:
        if name not in history.geometry and name not in known:
            listed = f"; it has {', '.join(known)}" if known else ""
            raise FitError(f"a test piece of '{rig.specimen}' has no dimension '{name}'{listed}")


def edges_of(chosen: CandidateTest, considered: Sequence[CandidateTest], rigs: Mapping[str, Rig]) -> list[str]:
    """Where the first run of a plan lies at an edge of what was considered, one sentence each."""
    rig = rigs.get(chosen.histories[0].specimen)
    durations = [c.duration for c in considered]
    if rig is None or len(durations) < 3:
        return []
    notes = []
    if chosen.duration <= 1.001 * min(durations) and min(durations) < 0.999 * max(durations):
        notes.append(
            f"it is as short as any test that was considered ({time_text(min(durations))}, for frames each "
            f"{time_text(rig.frame_interval)}): more frequent frames may make a shorter one better"
        )
    levels = chosen.histories[0].loading.program().values
    levels = levels[levels > 0]
    if levels.max() >= 0.999 * rig.levels[1] > rig.levels[0]:
        notes.append(f"it takes the rig to the greatest load that it was said to reach ({rig.levels[1]:.3g})")
    return notes


def notes_of(laws: Sequence[Identification], rigs: Sequence[Rig]) -> tuple[str, ...]:
    """What an expectation takes for granted."""
    notes = []
    if any(len(rig.temperatures) > 1 for rig in rigs) and not all(fit.law.uses(temperature) for fit in laws):
        names = ", ".join(fit.law.name for fit in laws if not fit.law.uses(temperature))
        notes.append(f"the temperatures of the rig were not varied: {names} says nothing of temperature")
    scatters = any(n.kind == "rate" and n.sd is None for n in laws[0].settings.nuisances)
    if scatters and len(laws[0].histories) < MINIMUM_TESTS and laws[0].noise_model.rate == 0.0:
        notes.append(
            f"fewer than {MINIMUM_TESTS} tests do not show by how much the rate scatters from test to test; it is "
            'taken as none: give Nuisance("rate", sd=...) where it is known'
        )
    if laws[0].noise_model.rate > 0 and any(rig.tests_per_run > 1 for rig in rigs):
        notes.append(
            "the rates of test pieces in one run are taken to scatter like those of tests one by one: where the oven "
            "scatters, several of them tell less"
        )
    if any(fit.settings.weights != "likelihood" for fit in laws):
        notes.append(
            'values were found with other weights than weights="likelihood", by which expectations are worked out: '
            "intervals after further tests may differ from what is expected here by a factor of two"
        )
    for fit in laws:
        if fit.adequacy is not None and fit.adequacy.rejects:
            notes.append(
                f"{fit.law.name} does not explain the tests that were made: what a test is expected to tell holds for "
                "laws that do; find one first"
            )
    return tuple(notes)
