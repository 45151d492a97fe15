"""Stages of a study: what each makes from the tests and from other stages, and all that its result depends on."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, get_args

from creepkit.errors import CreepkitError, StudyError
from creepkit.inverse.fingerprints import predictor_fingerprint
from creepkit.inverse.kept_fits import history_digest
from creepkit.inverse.reference_conditions import ISOTHERMAL_RANGE, with_arrhenius
from creepkit.quality import DataQuality
from creepkit.records import ZERO_CELSIUS, History, Predictor
from creepkit.reports.contents import ExportedFile
from creepkit.studies import arguments
from creepkit.studies.inputs import StudyInputs, TestGroup, resolve_paths
from creepkit.studies.planned_tests import check_forecast, planned_test
from creepkit.studies.study_file import StudyFile

if TYPE_CHECKING:
    from pathlib import Path

    from creepkit.inverse.selection.ranking import Ranking
    from creepkit.inverse.settings import IdentificationSettings
    from creepkit.language import CreepLaw

StageKind = Literal[
    "extraction",
    "record",
    "quality",
    "identification",
    "temperature",
    "rupture",
    "forecast",
    "design",
    "export",
    "report",
]


STAGE_KINDS: tuple[StageKind, ...] = get_args(StageKind)
"""In the order in which they are made; `creepkit run --only` takes these names."""


Tick = Callable[[str, int, int], None]


Results = Mapping[str, Any]
"""{name of a stage: its result}."""


@dataclass(frozen=True)
class Stage:
    """One stage.

    name : of its result. kind : what it makes. group : of the tests that it is about, "" for all.
    settings : JSON-able data of all that decides the result beside what it `needs`, names of other stages.
    make : from the results of these, with something to report progress to. record : class of the result, by which a
        file is read; None where the result is made again from identifications that are kept.
    document : what of a result that no record can be read from is written down, as JSON-able data.
    predictor : of identifications that its file holds. file : that an export is written to, "" for other stages.
    remark : what is known beforehand that the result leaves out of account, "" where nothing is.
    """

    name: str
    kind: StageKind
    group: str
    settings: Any
    make: Callable[[Results, Tick], Any]
    needs: tuple[str, ...] = ()
    record: Any = None
    document: Callable[[Any], Any] | None = None
    predictor: Predictor | None = field(default=None, repr=False)
    file: str = ""
    remark: str = ""


def stage_name(kind: StageKind, group: str = "") -> str:
    """The name of a stage of which each group has one."""
    return f"{kind} of {group}" if group else kind


@dataclass(frozen=True)
class Stages:
    """All stages of a study of given tests. root : see resolve_paths."""

    file: StudyFile
    inputs: StudyInputs
    root: Path | None = None

    def all(self) -> list[Stage]:
        """In the order in which they are made; those of a table that the study has not are missing."""
        if not self.inputs.groups:  # of cameras whose stages failed
            return []
        model = self.file.model
        stages = [self._quality()] if model.data.check_quality else []
        for kind, stage_of in (
            ("identification", self._identification),
            ("temperature", self._temperature),
            ("rupture", self._rupture),
        ):
            if getattr(model, kind) is not None:
                stages += [stage_of(group) for group in self.inputs.groups]
        stages += [self._forecast(k) for k in range(len(model.forecast))]
        if model.design is not None:
            stages += [self._design(group) for group in self._groups_of(("design",), model.design.group)]
        for k, part in enumerate(model.export):
            stages += [self._export(k, group) for group in self._groups_of(("export", k), part.group)]
        return stages

    # ---- what several stages need ------------------------------------------------------------------------------------

    def _groups_of(self, place: tuple[str | int, ...], name: str | None) -> list[TestGroup]:
        """The group of a name, or all."""
        if name is None:
            return list(self.inputs.groups)
        found = [group for group in self.inputs.groups if group.name == name]
        if not found:
            names = " and ".join(f"'{group.name}'" for group in self.inputs.groups)
            raise self.file.error((*place, "group"), f"there is no group '{name}' of tests; there are {names}")
        return found

    def _needed(self, place: tuple[str | int, ...], table: StageKind, group: TestGroup) -> str:
        if getattr(self.file.model, table) is None:
            raise self.file.error(place, f"needs the table [{table}], which the study has not")
        return stage_name(table, group.name)

    def _digests(self, histories: Sequence[History]) -> list[str]:
        return [history_digest(history) for history in histories]

    @property
    def _settings(self) -> IdentificationSettings:
        return arguments.settings_of(self.file)

    def _laws(self, group: TestGroup) -> list[tuple[CreepLaw, CreepLaw]]:
        """Pairs of a candidate as it is named, and as it is fitted to a group."""
        part = self.file.model.identification
        assert part is not None
        named = arguments.laws_of(self.file)
        if part.temperature == "none":
            return [(law, law) for law in named]
        return [(law, with_arrhenius(law, group.histories)) for law in named]

    # ---- stages ------------------------------------------------------------------------------------------------------

    def _quality(self) -> Stage:
        import creepkit as ck

        framed = [history for history in self.inputs.measured if history.outputs]

        def make(results: Results, tick: Tick) -> DataQuality:
            return ck.check_data_quality(framed)

        return Stage("quality", "quality", "", self._digests(framed), make, record=DataQuality)

    def _identification(self, group: TestGroup) -> Stage:
        import creepkit as ck
        from creepkit.inverse.selection.ranking import Ranking
        from creepkit.studies.identification import identified_laws, search_of

        model = self.file.model
        part, using, settings = model.identification, arguments.predictor_of(self.file, self.root), self._settings
        assert part is not None
        laws = [fitted for _, fitted in self._laws(group)]
        search, penalty = search_of(part)
        by_likelihood = part.weights in (None, "likelihood") and part.loss in (None, "linear")
        by_likelihood = by_likelihood and search is None and penalty is None
        selection = model.selection
        if selection is not None and not by_likelihood:
            raise self.file.error(
                ("selection",), "compares laws by their likelihood: leave out weights, loss, search and penalty"
            )

        def make(results: Results, tick: Tick) -> Ranking:
            tests = list(group.histories)
            if by_likelihood and (len(laws) > 1 or selection is not None):
                how: dict[str, Any] = {} if selection is None else {"by": selection.by, "sums": selection.sums}
                return ck.select(laws, tests, using, settings=settings, progress=tick, **how)
            return identified_laws(laws, tests, using, settings, (search, penalty), tick)

        described = {
            "laws": [
                [law.name, law.fingerprint, repr([(n, p.bounds, p.off) for n, p in law.table.items()])] for law in laws
            ],
            "settings": repr(settings),
            "how": [repr(search), repr(penalty), None if selection is None else selection.model_dump()],
            "using": None if using is None else predictor_fingerprint(using),
            "tests": self._digests(group.histories),
        }
        name = stage_name("identification", group.name)
        return Stage(name, "identification", group.name, described, make, record=Ranking, predictor=using)

    def _temperature(self, group: TestGroup) -> Stage:
        import creepkit as ck
        from creepkit.discovery.discover import isothermal_tests

        part, using, settings = (
            self.file.model.temperature,
            arguments.predictor_of(self.file, self.root),
            self._settings,
        )
        assert part is not None
        place = ("temperature",)
        law = None
        if part.law is not None:
            with self.file.at("temperature", "law"):
                law = ck.law(part.law)
        elif self.file.model.identification is None:
            raise self.file.error(place, "needs a law: give law, or the table [identification]")
        need = "" if law is not None else self._needed(place, "identification", group)
        within = ISOTHERMAL_RANGE if part.within_K is None else part.within_K

        def make(results: Results, tick: Tick) -> Any:
            chosen = law if law is not None else self._law_without_temperature(results[need], group)
            options: dict[str, Any] = {"forms": part.forms or None, "prior": part.prior_odds or None}
            options = {name: value for name, value in options.items() if value is not None}
            if part.parameters is not None:
                options["parameters"] = part.parameters
            study = ck.temperature_study(
                chosen,
                list(group.histories),
                using,
                moduli=part.moduli,
                within=within,
                settings=settings,
                progress=tick,
                **options,
            )
            if study.temperature_law is None:
                raise StudyError(study.notes[-1])
            return study

        described = [
            part.model_dump(),
            repr(settings),
            None if using is None else predictor_fingerprint(using),
            None if law is None else law.fingerprint,
            self._digests(group.histories),
        ]
        needs = (need,) if need else ()
        name = stage_name("temperature", group.name)
        remark = isothermal_tests(group.histories, within)[1]
        return Stage(
            name, "temperature", group.name, described, make, needs, document=_temperature_document, remark=remark
        )

    def _law_without_temperature(self, ranking: Ranking, group: TestGroup) -> CreepLaw:
        """The candidate that is best; where another law was found to be, the best of the candidates."""
        named = {fitted.name: law for law, fitted in self._laws(group)}
        return next(
            (named[one.fit.law.name] for one in ranking.laws if one.fit.law.name in named), next(iter(named.values()))
        )

    def _rupture(self, group: TestGroup) -> Stage:
        import creepkit as ck
        from creepkit.rupture_assessment.assessment import RuptureAssessment

        part = self.file.model.rupture
        assert part is not None
        changes = {name: getattr(part, name) for name in ("distribution", "criterion", "level")}
        changes = {name: value for name, value in changes.items() if value is not None}
        if part.degrees is not None:
            changes["degrees"] = tuple(part.degrees)
        with self.file.at("rupture"):
            settings = ck.RuptureSettings(fixed=part.fixed, seed=self.file.model.study.seed, **changes)
        how: dict[str, Any] = {} if part.times_h is None else {"hours": part.times_h}
        if part.temperatures_C is not None:
            how["temperatures"] = [T + ZERO_CELSIUS for T in part.temperatures_C]
        if part.tensile_strengths:
            how["tensile_strength"] = {s.temperature_C + ZERO_CELSIUS: s.strength_MPa for s in part.tensile_strengths}

        def make(results: Results, tick: Tick) -> RuptureAssessment:
            return ck.rupture(list(group.histories), part.methods, settings=settings, **how)

        described = [part.model_dump(), repr(settings), self._digests(group.histories)]
        name = stage_name("rupture", group.name)
        return Stage(name, "rupture", group.name, described, make, record=RuptureAssessment)

    def _forecast(self, number: int) -> Stage:
        import creepkit as ck
        from creepkit.forecasts.forecast import Forecast

        part, place = self.file.model.forecast[number], ("forecast", number)
        check_forecast(self.file, number)
        groups = self._groups_of(place, part.group)
        if len(groups) > 1:
            names = " or ".join(f"'{group.name}'" for group in groups)
            raise self.file.error(place, f"there are several groups of tests; say by group which one: {names}")
        need = self._needed(place, "identification", groups[0])
        measured: list[History] = []
        if part.tests:
            paths = resolve_paths(self.file, (*place, "tests"), part.tests, self.root)
            with self.file.at(*place, "tests"):
                measured = ck.read_histories(paths)
        how: dict[str, Any] = {"level": part.level, "draws": part.draws}
        if part.targets:
            how["targets"] = arguments.numbers_by_output(self.file, (*place, "targets"), part.targets)
        if part.tolerances:
            how["tolerances"] = arguments.tolerances_of(self.file, number)
        how = {name: value for name, value in how.items() if value is not None}

        def make(results: Results, tick: Tick) -> Forecast:
            ranking: Ranking = results[need]
            tests = measured
            if not tests:
                low, high = ranking.best.ranges["temperature"]
                usual = 0.5 * (low + high) if high - low <= ISOTHERMAL_RANGE else None
                tests = [planned_test(self.file, number, usual)]
            return ck.forecast(ranking, tests, progress=tick, **how)

        described = [part.model_dump(), self._digests(measured)]
        return Stage(f"forecast of {part.name}", "forecast", groups[0].name, described, make, (need,), Forecast)

    def _design(self, group: TestGroup) -> Stage:
        import creepkit as ck
        from creepkit.experiments.planned_design import Design
        from creepkit.experiments.rig import rigs_of

        part = self.file.model.design
        assert part is not None
        need = self._needed(("design",), "identification", group)
        goal = arguments.goal_of(self.file)
        seed = self.file.model.study.seed

        def make(results: Results, tick: Tick) -> Design:
            best = results[need].best
            rigs = arguments.rigs_of_study(self.file, rigs_of(best.histories, best.predictor), best.predictor)
            return ck.design(results[need], rig=rigs, goal=goal, budget=part.budget_h, seed=seed, progress=tick)

        name = stage_name("design", group.name)
        return Stage(name, "design", group.name, [part.model_dump(), seed], make, (need,), Design)

    def _export(self, number: int, group: TestGroup) -> Stage:
        import creepkit as ck
        from creepkit.files.file_names import hashed_stem

        part, place = self.file.model.export[number], ("export", number)
        table: StageKind = "temperature" if part.law == "temperature" else "identification"
        need = self._needed(place, table, group)
        exporters = ck.available("exporters")
        with self.file.at(*place, "target"):
            from creepkit.registry import default_registry

            exporter = default_registry().exporter(part.target)
        several = len(self._groups_of(place, part.group)) > 1
        file = part.file or f"law{exporter.suffix}"
        if several:
            stem, dot, suffix = file.rpartition(".")
            file = f"{stem or suffix}_{hashed_stem(group.name)}{dot}{suffix if stem else ''}"
        units = {"stress": part.stress_unit, "time": part.time_unit}
        with self.file.at(*place):
            ck.Units(**units)
        elastic = None if part.modulus_GPa is None else ck.Elastic(1e3 * part.modulus_GPa, part.poisson)
        temperature = None if part.temperature_C is None else part.temperature_C + ZERO_CELSIUS

        def make(results: Results, tick: Tick) -> ExportedFile:
            source = results[need]
            law = source.temperature_law if part.law == "temperature" else source  # a ranking gives its verdict along
            record = ck.law_with_values(law, elastic=elastic, name=part.name or "")
            return ExportedFile(file, part.target, ck.export(record, part.target, units=units, temperature=temperature))

        assert part.target in exporters
        name = f"export {number + 1}{f' of {group.name}' if group.name else ''}: {part.target}"
        described = [part.model_dump(), file]
        return Stage(name, "export", group.name, described, make, (need,), ExportedFile, file=file)


def _temperature_document(result: Any) -> Any:
    """The temperature law of a study of temperature, as `creepkit discover --to` writes it."""
    from creepkit.discovery.temperature_law import temperature_law_to_json

    try:
        return temperature_law_to_json(result.temperature_law)
    except CreepkitError:  # of a plugin's law, which cannot be stored
        return None


def needed_stages(stages: Sequence[Stage], kinds: Sequence[str]) -> set[str]:
    """Names of the stages of some kinds, and of all that these need."""
    by_name = {stage.name: stage for stage in stages}

    def with_needs(stage: Stage) -> Iterator[str]:
        yield stage.name
        for name in stage.needs:
            yield from with_needs(by_name[name])

    return {name for stage in stages if stage.kind in kinds for name in with_needs(stage)}
