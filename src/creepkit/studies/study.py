"""Study: a study file carried out; its result holds the ordinary records of every stage."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from creepkit.checked_arguments import checked
from creepkit.errors import StudyError, nearest
from creepkit.files.writing import check_target, is_foreign, made_from
from creepkit.reports.attachments import problem_of_name, same_name
from creepkit.studies import arguments
from creepkit.studies.camera_stages import CameraStages
from creepkit.studies.cameras import CameraFiles, StudyCameras
from creepkit.studies.documents import ResultFolder
from creepkit.studies.execution import Execution, running_alone
from creepkit.studies.inputs import InputFile, input_files, read_inputs, resolve_paths
from creepkit.studies.lock import changed_results, differences, lock_if_any, lock_of, write_lock
from creepkit.studies.planned_tests import check_forecast
from creepkit.studies.report_stage import lock_path_of, write_own, write_page
from creepkit.studies.result import StudyResult
from creepkit.studies.stage import STAGE_KINDS, Stage, needed_stages
from creepkit.studies.stage_inputs import StageInputs
from creepkit.studies.stages import stages_of
from creepkit.studies.study_file import StudyFile, read_study_file

if TYPE_CHECKING:
    from creepkit.jobs.shard_progress import ProgressCallback
    from creepkit.reports.contents import ReportContents


@checked
@dataclass(frozen=True, repr=False)
class Study:
    """A study file that was read and checked.

    file : its path, text and model. root : folder of the data that a report carried; None for those beside the file.
    """

    file: StudyFile
    root: Path | None = None

    @classmethod
    def load(cls, path: str | Path, *, root: str | Path | None = None) -> Study:
        """Read a study file and check what can be checked before data are read.

        root : folder of the data that a report carried, as 'creepkit run report.html' extracts them.
        StudyError, in one sentence with file and line, says what is wrong with the file.
        """
        study = cls(read_study_file(Path(path)), None if root is None else Path(root))
        study.check()
        return study

    def __repr__(self) -> str:
        """Title, file, and the tables that it has."""
        tables = ", ".join(sorted(self.file.model.model_fields_set - {"study"}))
        return f"Study '{self.file.model.study.title}' ({self.path}): {tables or 'nothing'}"

    @property
    def path(self) -> Path:
        """The study file."""
        return self.file.path

    def check(self) -> None:
        """StudyError for names of laws, readers, specimens, targets and files that there are not."""
        import creepkit as ck

        file, model = self.file, self.file.model
        readers = ck.available("readers")
        if model.data.reader is not None and model.data.reader not in readers:
            raise file.error(
                ("data", "reader"), f"there is no reader '{model.data.reader}'; {nearest(model.data.reader, readers)}"
            )
        arguments.predictor_of(file, self.root)
        arguments.settings_of(file)
        if model.identification is not None:
            arguments.laws_of(file)
        if model.temperature is not None and model.temperature.law is not None:
            with file.at("temperature", "law"):
                ck.law(model.temperature.law)
        arguments.check_names(file)
        for k, part in enumerate(model.forecast):
            check_forecast(file, k)
            names = [one.name for one in model.forecast[:k]]
            if part.name in names:
                raise file.error(("forecast", k, "name"), f"two forecasts are called '{part.name}'; rename one of them")
        if model.design is not None:
            arguments.goal_of(file)
        exporters = ck.available("exporters")
        for k, export in enumerate(model.export):
            if export.target not in exporters:
                raise file.error(
                    ("export", k, "target"),
                    f"there is no target '{export.target}'; {nearest(export.target, exporters)}",
                )
        self.cameras.check()
        self._check_outputs()

    def _check_outputs(self) -> None:
        """StudyError for data files that there are not, and for files that would replace data or be written twice."""
        import creepkit as ck

        file, model = self.file, self.file.model
        data = [*self.paths, *(path for camera in self.camera_files for path in camera.all)]
        places: list[tuple[tuple[str | int, ...], str]] = [
            (("export", k, "file"), one.file or f"law{ck.available('exporters')[one.target].suffix}")
            for k, one in enumerate(model.export)
        ]
        places += [] if model.report is None else [(("report", "file"), model.report.file)]
        names: list[str] = []
        for key, name in places:
            _check_output(file, key, name)
            if same_name(name) in names:
                raise file.error(key, f"'{name}' is written by another table already; give file = another name")
            names.append(same_name(name))
            read = any(fnmatchcase(name, pattern.removeprefix("./")) for pattern in model.data.files)
            if read or file.path.parent / name in data:
                raise file.error(
                    key, f"'{name}' would be among the data files; give file = another name, or name those more exactly"
                )

    @property
    def cameras(self) -> StudyCameras:
        """The cameras of the study."""
        return StudyCameras(self.file, self.root)

    @cached_property
    def camera_files(self) -> list[CameraFiles]:
        """Files of each camera."""
        return self.cameras.files()

    @cached_property
    def paths(self) -> list[Path]:
        """Files and folders of the tests."""
        return resolve_paths(self.file, ("data", "files"), self.file.model.data.files, self.root)

    def run(
        self,
        *,
        to: str | Path | None = None,
        only: str | Sequence[str] | None = None,
        force: bool = False,
        locked: bool = False,
        prune: bool = False,
        progress: ProgressCallback | None = None,
    ) -> StudyResult:
        """Carry out the study; what was made before from the same inputs is read, not made again.

        to : folder for results, lock, exports and report; by default that of the study file.
        only : kinds of stages, such as "identification", which are carried out with those that they need.
        force : make everything again, and overwrite files of the names of exports and report. locked : StudyError where
        anything differs from the study.lock that is there. prune : remove kept identifications that no stage of the
        study, as it is now, rests on.
        progress : called as progress(task, done, total, note).

        A stage that fails leaves the others; `failures` of the result, and the report, say what is missing. Raises
        StudyError for an unknown stage, for files that cannot be read or written, and for a study that is running.
        """
        kinds = STAGE_KINDS if only is None else [only] if isinstance(only, str) else list(only)
        for kind in kinds:
            if kind not in STAGE_KINDS:
                raise StudyError(f"there is no stage '{kind}'; {nearest(str(kind), STAGE_KINDS)}")
        folder = self.path.parent if to is None else Path(to)
        kept = ResultFolder(folder / f"{self.path.stem}.results", overwrite=force)
        with running_alone(kept.folder):
            kept.clear(everything=force)
            with made_from(self.path):
                result = self._run(folder, kept, kinds, locked, progress)
            return replace(result, pruned=kept.prune_fits(result.asked)) if prune else result

    def report_contents(self) -> ReportContents:
        """What ck.report(study) shows: the study is carried out, or read where nothing changed."""
        return self.run().report_contents()

    def _run(
        self, folder: Path, kept: ResultFolder, kinds: Sequence[str], locked: bool, progress: ProgressCallback | None
    ) -> StudyResult:
        lock_path = lock_path_of(self.file, folder)
        before = lock_if_any(lock_path)
        if progress is not None:
            progress("reading", 0, 1, "")
        files = self._input_files(folder, kept, lock_path)
        now = lock_of(self.file, self._hash, files, [])
        changes = [] if before is None else differences(before, now)
        if locked and (before is None or changes):
            what = changes[0] if changes else "there is no lock"
            raise StudyError(f"{lock_path}: the study cannot be repeated exactly: {what}; leave --locked out")
        execution = Execution(kept, (), progress, stated={} if before is None else before["stages"], locked=locked)
        cameras = CameraStages(self.cameras)
        watched = cameras.stages(self.camera_files, files)
        execution.run(watched, [stage.name for stage in watched])  # whatever is asked for is made of their tests
        complete = not execution.failures
        inputs = read_inputs(self.file, self.paths, cameras.histories(execution.results), complete=complete)
        if progress is not None:
            progress("reading", 1, 1, f"{len(inputs.histories)} tests in {len(files)} files")
        stages = stages_of(StageInputs(self.file, inputs, self.root))
        self._check_exports(stages, folder, files)
        execution.histories = inputs.histories
        wanted = needed_stages(stages, kinds)
        for stage in stages:
            if stage.file and stage.name in wanted:  # now, not after all the work
                check_target(folder / stage.file, StudyError, force=kept.overwrite)
        execution.run(stages, wanted, read_others="report" in kinds)
        if before is not None:
            changes += changed_results(before, execution.records)
        if locked and changes:
            raise StudyError(f"{lock_path}: the study cannot be repeated exactly: {changes[0]}; leave --locked out")
        write_lock(lock_of(self.file, self._hash, files, execution.records, before), lock_path)
        result = StudyResult(
            self.file.model.study.title,
            inputs.groups,
            (*cameras.flagged(execution.results), *inputs.exclusions),
            tuple(execution.records),
            tuple(files),
            tuple(changes),
            measured=inputs.measured,
            results=execution.results,
            file=self.file,
            lock_path=lock_path,
            asked=frozenset(execution.asked),
            extractions=cameras.extractions(execution.results),
            imposed=cameras.imposed(execution.results),
            documents=dict(execution.documents),
        )
        kept.write_identified(result.identified)
        for stage in stages:
            if stage.file and stage.name in execution.results:  # by the name in the study file, not that of a result
                write_own(kept, folder / stage.file, execution.results[stage.name].text)
        if self.file.model.report is None or "report" not in kinds:
            return result
        return write_page(self.file, result, folder, kept, progress)

    def _check_exports(self, stages: Sequence[Stage], folder: Path, files: Sequence[InputFile]) -> None:
        """StudyError for exports, one for each group, that would replace a file of the study or each other."""
        report = self.file.model.report
        names = [] if report is None else [same_name(report.file)]
        read = {one.path.resolve() for one in files}
        if report is not None and (folder / report.file).resolve() in read:
            raise StudyError(
                f"{self.path}: the report would be written to '{folder / report.file}', which is a data file; "
                "give [report] file = another name, or another folder"
            )
        for stage in stages:
            if not stage.file:
                continue
            if same_name(stage.file) in names or (folder / stage.file).resolve() in read:
                raise StudyError(
                    f"{self.path}: {stage.name} would write '{stage.file}', which is a data file or is written "
                    "already; give file = another name"
                )
            names.append(same_name(stage.file))

    @cached_property
    def _hash(self) -> str:
        return hashlib.sha256(self.file.text.encode()).hexdigest()

    def _input_files(self, folder: Path, kept: ResultFolder, lock_path: Path) -> list[InputFile]:
        """All data files, those of forecasts included, without what the study itself writes."""
        model = self.file.model
        own = [self.path, kept.folder, lock_path]
        outputs = [folder / one.file for one in model.export if one.file is not None]
        outputs += [] if model.report is None else [folder / model.report.file]
        outputs += [folder / name for name in kept.outputs]
        own += [path for path in outputs if not is_foreign(path)]  # what somebody else wrote there may be data
        paths = [*self.paths, *(path for camera in self.camera_files for path in camera.all)]
        for k, part in enumerate(model.forecast):
            paths += resolve_paths(self.file, ("forecast", k, "tests"), part.tests, self.root) if part.tests else []
        predictor = arguments.predictor_path(self.file, self.root)
        paths += [] if predictor is None else [predictor]
        return input_files(self.file, paths, self.root, own)


def _check_output(file: StudyFile, key: tuple[str | int, ...], name: str) -> None:
    """StudyError for a file that would lie outside the folder of the study, or over what the study is."""
    if problem_of_name(name) or "/" in name or ":" in name:
        raise file.error(key, f"'{name}' must be a plain name of a file, such as report.html")
    own = (file.path.name, f"{file.path.stem}.lock", f"{file.path.stem}.results")
    if same_name(name) in [same_name(one) for one in own]:
        raise file.error(key, f"'{name}' is a file of the study itself; choose another name")
