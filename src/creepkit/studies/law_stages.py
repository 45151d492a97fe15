"""Stages that find laws: data quality, identification, and temperature; each with the numbers of it that are locked."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

import creepkit as ck
from creepkit.errors import CreepkitError, StudyError
from creepkit.files.record_codec import record_to_json
from creepkit.inverse.fingerprints import predictor_fingerprint
from creepkit.inverse.reference_conditions import ISOTHERMAL_RANGE
from creepkit.quality import DataQuality
from creepkit.studies import arguments
from creepkit.studies.identified_singly import identified_laws, search_of
from creepkit.studies.inputs import TestGroup
from creepkit.studies.stage import Results, Stage, Tick, no_numbers, stage_name
from creepkit.studies.stage_inputs import StageInputs

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection.ranking import Ranking
    from creepkit.language import CreepLaw


def quality_stage(study: StageInputs) -> Stage:
    """The check of data quality, of all tests with readings."""
    framed = [history for history in study.inputs.measured if history.outputs]

    def make(results: Results, tick: Tick) -> DataQuality:
        return ck.check_data_quality(framed)

    return Stage("quality", "quality", "", study.digests(framed), make, no_numbers, record=DataQuality)


def identification_stage(study: StageInputs, group: TestGroup) -> Stage:
    """The identification of the laws of a group, and their ranking."""
    from creepkit.inverse.selection.ranking import Ranking

    model = study.file.model
    part, using, settings = model.identification, arguments.predictor_of(study.file, study.root), study.settings
    assert part is not None
    laws = [fitted for _, fitted in study.laws(group)]
    search, penalty = search_of(part)
    by_likelihood = part.weights in (None, "likelihood") and part.loss in (None, "linear")
    by_likelihood = by_likelihood and search is None and penalty is None
    selection = model.selection
    if selection is not None and not by_likelihood:
        raise study.file.error(
            ("selection",), "compares laws by their likelihood: leave out weights, loss, search and penalty"
        )

    def make(results: Results, tick: Tick) -> Ranking:
        tests = list(group.histories)
        if by_likelihood and (len(laws) > 1 or selection is not None):
            how: dict[str, Any] = {} if selection is None else {"by": selection.by, "sums": selection.sums}
            return ck.select(laws, tests, using, settings=settings, progress=tick, **how)
        return identified_laws(laws, tests, using, settings, (search, penalty), tick)

    described = {
        "laws": [[law.name, law.fingerprint, [[n, *p.bounds, p.off] for n, p in law.table.items()]] for law in laws],
        "settings": record_to_json(asdict(settings)),
        "how": [part.search, part.penalty, None if selection is None else selection.model_dump()],
        "using": None if using is None else predictor_fingerprint(using),
        "tests": study.digests(group.histories),
    }
    name = stage_name("identification", group.name)
    return Stage(
        name, "identification", group.name, described, make, numbers_of_ranking, record=Ranking, predictor=using
    )


def numbers_of_ranking(ranking: Ranking) -> dict[str, Any]:
    """Weights and values of the laws."""
    return {
        "weights": {one.fit.law.name: one.weight for one in ranking.laws},
        "values": {one.fit.law.name: one.fit.values for one in ranking.laws},
    }


def temperature_stage(study: StageInputs, group: TestGroup) -> Stage:
    """The forms of temperature of the law of a group."""
    from creepkit.discovery.discover import isothermal_tests

    part, using, settings = (
        study.file.model.temperature,
        arguments.predictor_of(study.file, study.root),
        study.settings,
    )
    assert part is not None
    place = ("temperature",)
    within = ISOTHERMAL_RANGE if part.within_K is None else part.within_K
    law = None
    if part.law is not None:
        with study.file.at("temperature", "law"):
            law = ck.law(part.law)
    elif study.file.model.identification is None:
        raise study.file.error(place, "needs a law: give law, or the table [identification]")
    need = "" if law is not None else study.needed(place, "identification", group)

    def make(results: Results, tick: Tick) -> Any:
        chosen, fit = (law, None) if law is not None else _best_candidate(study, results[need], group)
        options: dict[str, Any] = {"forms": part.forms or None, "prior": part.prior_odds or None}
        options = {name: value for name, value in options.items() if value is not None}
        if part.parameters is not None:
            options["parameters"] = part.parameters
        found = ck.temperature_study(
            chosen,
            list(group.histories),
            using,
            moduli=part.moduli,
            within=within,
            settings=settings if fit is None else fit.settings,
            progress=tick,
            **options,
        )
        if found.temperature_law is None:
            raise StudyError(found.notes[-1])
        # One law has one set of values: those of its identification, with what the study bounds and fixes.
        return found if fit is None or part.moduli else replace(found, joint_fit=fit)

    described = [
        part.model_dump(),
        record_to_json(asdict(settings)),
        None if using is None else predictor_fingerprint(using),
        None if law is None else law.fingerprint,
        study.digests(group.histories),
    ]
    needs = (need,) if need else ()
    name = stage_name("temperature", group.name)
    return Stage(
        name,
        "temperature",
        group.name,
        described,
        make,
        _numbers_of_temperature,
        needs,
        document=_temperature_document,
        remark=isothermal_tests(group.histories, within)[1],
    )


def _best_candidate(study: StageInputs, ranking: Ranking, group: TestGroup) -> tuple[CreepLaw, Identification | None]:
    """The candidate that is best, without temperature, and its identification from all tests of the group.

    Where another law was found to be the best, it is the best of the candidates; None where none was identified.
    """
    named = {fitted.name: law for law, fitted in study.laws(group)}
    fit = next((one.fit for one in ranking.laws if one.fit.law.name in named), None)
    return (next(iter(named.values())) if fit is None else named[fit.law.name]), fit


def _numbers_of_temperature(study: Any) -> dict[str, Any]:
    """Forms and values of the temperature law."""
    return {"forms": study.temperature_law.forms, "values": study.temperature_law.values}


def _temperature_document(result: Any) -> Any:
    """The temperature law of a study of temperature, as `creepkit discover --to` writes it."""
    from creepkit.discovery.temperature_law import temperature_law_to_json

    try:
        return temperature_law_to_json(result.temperature_law)
    except CreepkitError:  # of a plugin's law, which cannot be stored
        return None
