"""The stages of a study's tables: quality, rupture, identification, temperature, forecasts, designs and exports."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import creepkit as ck
from creepkit.discovery.discover import DiscoveryOptions, isothermal_tests
from creepkit.errors import CreepkitError, StudyError
from creepkit.exporters.exporting import ExportOptions
from creepkit.files.record_codec import record_to_json
from creepkit.files.writing import hashed_stem
from creepkit.forecasts.planned_tests import ForecastOptions
from creepkit.inverse.candidate_laws import SearchOptions
from creepkit.inverse.kept_fits import history_digest
from creepkit.inverse.predictor_documents import predictor_fingerprint
from creepkit.inverse.reference_conditions import ISOTHERMAL_RANGE
from creepkit.inverse.settings import IdentificationSettings
from creepkit.language import elastic_of, temperature
from creepkit.law_search.search import LawSearchOptions
from creepkit.options import values_of_table
from creepkit.quality import DataQuality
from creepkit.records import ZERO_CELSIUS, History, Nuisance, known_specimens
from creepkit.registry import default_registry, kinds
from creepkit.reports.answer import strengths_line
from creepkit.reports.contents import ExportedFile
from creepkit.studies import arguments
from creepkit.studies.arguments import check_forecast, planned_test
from creepkit.studies.candidates import by_likelihood, ranked_candidates
from creepkit.studies.execution import STAGE_KINDS, NothingToMake, Results, Stage, StageKind, Tick, stage_name
from creepkit.studies.inputs import StudyInputs, TestGroup
from creepkit.studies.study_file import KeyPath, StudyFile

if TYPE_CHECKING:
    from creepkit.experiments.planned_design import Design
    from creepkit.forecasts.forecast import Forecast
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection.ranking import Ranking
    from creepkit.language import CreepLaw
    from creepkit.rupture_assessment.assessment import RuptureAssessment


@dataclass(frozen=True)
class StageInputs:
    """What stages are made from: the study file and its tests, and what several of them need.

    priors : nuisance parameters of single tests, which say how well lengths and temperatures are known.
    """

    file: StudyFile
    inputs: StudyInputs
    priors: Sequence[Nuisance] = ()

    def groups_of(self, place: KeyPath, name: str | None) -> list[TestGroup]:
        """The group of a name, or all."""
        groups = {group.name: group for group in self.inputs.groups}
        self.file.check_name((*place, "group"), "group", name, groups)
        return [*groups.values()] if name is None else [groups[name]]

    def needed(self, place: KeyPath, table: StageKind, group: TestGroup) -> str:
        """The name of a stage that the table at `place` needs; StudyError where the study has not its table."""
        if getattr(self.file.model, table) is None:
            raise self.file.error(place, f"needs the table [{table}], which the study has not")
        return stage_name(table, group.name)

    @cached_property
    def using(self) -> Any:
        """What predicts the tests; None for the specimens that they name."""
        return arguments.predictor_of(self.file)

    @property
    def using_fingerprint(self) -> str | None:
        """Of what predicts the tests."""
        return None if self.using is None else predictor_fingerprint(self.using)

    def settings(self, group: TestGroup, laws: Sequence[CreepLaw] = ()) -> IdentificationSettings:
        """Of the identifications of a group, of these laws."""
        everywhere = [history.name for history in self.inputs.histories]
        warm = any(law.uses(temperature) for law in laws)
        return arguments.settings_of_group(self.file, group.histories, everywhere, self.priors, warm=warm)

    def laws(self, group: TestGroup) -> list[tuple[CreepLaw, CreepLaw]]:
        """Pairs of a candidate at one temperature, and as it is fitted to a group."""
        laws, changes = arguments.laws_of(self.file), arguments.law_changes(self.file)
        with self.file.at("identification"):
            fitted = changes.applied(laws, group.histories)
            return list(zip(arguments.isothermal_laws(changes, laws), fitted, strict=True))


def _digests(histories: Sequence[History]) -> list[str]:
    return [history_digest(history) for history in histories]


def stages_of(study: StageInputs) -> list[Stage]:
    """The stages of the tables that a study has, in the order in which they are made; none without tests.

    Those of cameras and records give the tests themselves (see cameras); the report is made at the end.
    """
    model, made = study.file.model, {}
    if not study.inputs.groups:  # of cameras whose stages failed
        return []
    if model.data.check_quality:
        made["quality"] = [_quality_stage(study)]
    for kind, make in OF_EACH_GROUP.items():
        part = getattr(model, kind)
        groups = [] if part is None else study.groups_of((kind,), getattr(part, "group", None))
        made[kind] = [make(study, group) for group in groups]
    made["forecast"] = [_forecast_stage(study, k) for k in range(len(model.forecast))]
    made["export"] = [
        _export_stage(study, k, group)
        for k, part in enumerate(model.export)
        for group in study.groups_of(("export", k), part.group)
    ]
    return [stage for kind in STAGE_KINDS for stage in made.get(kind, ())]


def _quality_stage(study: StageInputs) -> Stage:
    framed = [history for history in study.inputs.measured if history.outputs]

    def make(results: Results, tick: Tick) -> DataQuality:
        return ck.check_data_quality(framed)

    return Stage("quality", "", _digests(framed), make, DataQuality)


# ---- strengths -------------------------------------------------------------------------------------------------------


def _rupture_stage(study: StageInputs, group: TestGroup) -> Stage:
    """The assessment of the rupture times of a group."""
    from creepkit.rupture_assessment.assessment import RuptureAssessment, RuptureQuestion, RuptureSettings

    part, tests = study.file.model.rupture, list(group.histories)
    assert part is not None
    with study.file.at("rupture"):
        settings = ck.RuptureSettings(seed=study.file.model.study.seed)
        settings = settings.changed(values_of_table(RuptureSettings, part))
    how = values_of_table(RuptureQuestion, part)
    if part.tensile_strengths:
        how["tensile_strength"] = {o.temperature_C + ZERO_CELSIUS: o.strength_MPa for o in part.tensile_strengths}

    def make(results: Results, tick: Tick) -> RuptureAssessment:
        return ck.rupture(tests, settings=settings, **how)

    described = [part.model_dump(), record_to_json(asdict(settings)), _digests(tests)]
    return Stage("rupture", group.name, described, make, RuptureAssessment, answer=strengths_line)


# ---- laws ----------------------------------------------------------------------------------------------------------


def _identification_stage(study: StageInputs, group: TestGroup) -> Stage:
    """The identification of the laws of a group, and their ranking."""
    from creepkit.inverse.selection.ranking import Ranking

    model, using = study.file.model, study.using
    part, selection = model.identification, model.selection
    assert part is not None
    laws, tests = [fitted for _, fitted in study.laws(group)], list(group.histories)
    settings = study.settings(group, laws)
    how = {} if selection is None else values_of_table(SearchOptions, selection)
    asked = SearchOptions().changed({**values_of_table(SearchOptions, part), **how})
    if selection is not None and not by_likelihood(asked, settings):
        what = "compares laws by their likelihood: leave out weights and penalty"
        raise study.file.error(("selection",), what)

    sought = None if model.law_search is None else values_of_table(LawSearchOptions, model.law_search)

    def make(results: Results, tick: Tick) -> Ranking:
        watched = [one for one in tests if "extraction" in one.labels and one.elastic is None]  # by cameras
        known = {name: one.conditions for name, one in known_specimens().items()}
        needing = [one.name for one in watched if "modulus" in known[one.specimen]]
        if needing:
            where = "modulus [GPa] of the table of alloys, or modulus_GPa of [[camera]]"
            raise StudyError(f"Young's modulus of {', '.join(needing[:30])} is not stated; write {where}")
        candidates = {law.fingerprint: law for law in laws}
        if sought is not None:
            searched = ck.search_laws(tests, using, settings=settings, progress=tick, **sought).ranking.laws
            candidates = {one.fit.law.fingerprint: one.fit.law for one in searched} | candidates
        compared, among = selection is not None, [*candidates.values()]
        return ranked_candidates(among, tests, using, asked, settings, compared=compared, progress=tick)

    described = {
        "laws": [[law.name, law.fingerprint, [[n, *p.bounds, p.off] for n, p in law.table.items()]] for law in laws],
        "settings": record_to_json(asdict(settings)),
        "how": [record_to_json(asdict(asked)), None if selection is None else selection.model_dump(), sought],
        "using": study.using_fingerprint,
        "tests": _digests(tests),
    }
    idle = " and ".join(arguments.idle_fixes(study.file))
    remark = f"fix {idle} = 0 holds of laws without {idle}, too: it changes none" if idle else ""
    return Stage("identification", group.name, described, make, Ranking, predictor=using, remark=remark)


def _temperature_stage(study: StageInputs, group: TestGroup) -> Stage:
    """The forms of temperature of the law of a group."""
    from creepkit.discovery.temperature_law import temperature_law_to_json

    part, using, tests, law = study.file.model.temperature, study.using, list(group.histories), None
    assert part is not None
    options = values_of_table(DiscoveryOptions, part)
    if part.law is not None:
        with study.file.at("temperature", "law"):
            law = ck.law(part.law)
    elif study.file.model.identification is None:
        raise study.file.error(("temperature",), "needs a law: give law, or the table [identification]")
    need = "" if law is not None else study.needed(("temperature",), "identification", group)
    usual = study.settings(group)

    def make(results: Results, tick: Tick) -> Any:
        chosen, fit = (law, None) if law is not None else _best_candidate(study, results[need], group)
        if chosen.uses(temperature):
            raise NothingToMake(f"law '{chosen.name}' says itself how it depends on temperature: no form is sought")
        settings = usual if fit is None else fit.settings
        # One law has one set of values: those of its identification, with what the study bounds and fixes.
        found = ck.temperature_study(chosen, tests, using, settings=settings, joint_fit=fit, progress=tick, **options)
        if found.temperature_law is None:
            raise StudyError(found.notes[-1])
        return found

    def document(found: Any) -> Any:
        """The temperature law as `creepkit discover --to` writes it; None of a plugin's law that cannot be stored."""
        with suppress(CreepkitError):
            return temperature_law_to_json(found.temperature_law)
        return None

    law_fingerprint = None if law is None else law.fingerprint
    described = [part.model_dump(), record_to_json(asdict(usual)), study.using_fingerprint, law_fingerprint]

    remark = isothermal_tests(tests, options.get("within", ISOTHERMAL_RANGE))[1]
    described, needs = [*described, _digests(tests)], (need,) if need else ()
    return Stage("temperature", group.name, described, make, None, needs, document=document, remark=remark)


def _best_candidate(study: StageInputs, ranking: Ranking, group: TestGroup) -> tuple[CreepLaw, Identification | None]:
    """The candidate that is best, without temperature, and its identification from all tests of the group.

    Where another law was found to be the best, it is the best of the candidates; None where none was identified.
    """
    named = {fitted.name: law for law, fitted in study.laws(group)}
    fit = next((one.fit for one in ranking.laws if one.fit.law.name in named), None)
    return (next(iter(named.values())) if fit is None else named[fit.law.name]), fit


# ---- what follows from laws ------------------------------------------------------------------------------------------


def _forecast_stage(study: StageInputs, number: int) -> Stage:
    """The forecast of this number in the study file."""
    from creepkit.forecasts.forecast import Forecast

    file, place, measured = study.file, ("forecast", number), list[History]()
    part = file.model.forecast[number]
    check_forecast(file, number)
    groups = study.groups_of(place, part.group)
    if len(groups) > 1:
        names = " or ".join(f"'{group.name}'" for group in groups)
        raise file.error(place, f"there are several groups of tests; say by group which one: {names}")
    need = study.needed(place, "identification", groups[0])
    if part.tests:
        paths = file.paths((*place, "tests"), part.tests)
        with file.at(*place, "tests"):
            measured = ck.read_histories(paths)
    targets, tolerances = arguments.targets_of(file, number), arguments.tolerances_of(file, number)
    how = values_of_table(ForecastOptions, part) | ({"targets": targets} if targets else {})

    def make(results: Results, tick: Tick) -> Forecast:
        ranking: Ranking = results[need]
        low, high = ranking.best.ranges["temperature"]
        usual = 0.5 * (low + high) if high - low <= ISOTHERMAL_RANGE else None
        tests = measured or [planned_test(file, number, usual)]
        return ck.forecast(ranking, tests, tolerances=tolerances or None, progress=tick, **how)

    name, described = f"forecast of {part.name}", [part.model_dump(), _digests(measured)]
    return Stage("forecast", groups[0].name, described, make, Forecast, (need,), name=name)


def _design_stage(study: StageInputs, group: TestGroup) -> Stage:
    """The further tests that are proposed for a group."""
    from creepkit.experiments.planned_design import Design
    from creepkit.experiments.rig import rigs_of

    part, seed = study.file.model.design, study.file.model.study.seed
    assert part is not None
    need = study.needed(("design",), "identification", group)
    asked = arguments.goal_of(study.file)

    def make(results: Results, tick: Tick) -> Design:
        best = results[need].best
        rigs = arguments.rigs_of_study(study.file, rigs_of(best.histories, best.predictor))
        return ck.design(results[need], rig=rigs, goal=asked.quantity, budget=asked.budget, seed=seed, progress=tick)

    return Stage("design", group.name, [part.model_dump(), seed], make, Design, (need,))


def export_name(file: StudyFile, number: int) -> str:
    """The file of the export of this number, by the study's name; StudyError for a target that there is not."""
    part, stem = file.model.export[number], file.path.stem
    of_study = "" if stem == "study" else f"{stem}_"  # of several studies in a folder
    with file.at("export", number, "target"):
        return part.file or f"{of_study}law{default_registry().one(kinds.EXPORTERS, part.target).suffix}"


def _export_stage(study: StageInputs, number: int, group: TestGroup) -> Stage:
    """The export of this number in the study file, for a group."""
    part, place = study.file.model.export[number], ("export", number)
    need = study.needed(place, "temperature" if part.law == "temperature" else "identification", group)
    file = export_name(study.file, number)
    if len(study.groups_of(place, part.group)) > 1:
        stem, dot, suffix = file.rpartition(".")
        file = f"{stem or suffix}_{hashed_stem(group.name)}{dot}{suffix if stem else ''}"
    with study.file.at(*place):
        options = ExportOptions().changed(values_of_table(ExportOptions, part))
        ck.Units(options.stress_unit, options.time_unit)
        elastic_of(options.modulus, options.poisson)

    def make(results: Results, tick: Tick) -> ExportedFile:
        source = results[need]
        law = source.temperature_law if part.law == "temperature" else source  # a ranking gives its verdict along
        return ExportedFile(file, part.target, options.text(law, part.target))

    name = f"export {number + 1}{f' of {group.name}' if group.name else ''}: {part.target}"
    described = [part.model_dump(), file]
    return Stage("export", group.name, described, make, ExportedFile, (need,), file=file, name=name)


OF_EACH_GROUP: Mapping[StageKind, Callable[[StageInputs, TestGroup], Stage]] = {
    "rupture": _rupture_stage,
    "identification": _identification_stage,
    "temperature": _temperature_stage,
    "design": _design_stage,
}
"""{kind: its stage} of tables that stand once in the file and hold for every group, or for the one that they name."""
