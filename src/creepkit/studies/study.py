"""Study: a study file carried out; its result holds the ordinary records of every stage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from creepkit.checked_arguments import checked
from creepkit.errors import StudyError, refuse_unknown
from creepkit.files.reading import read_bytes, sha256_of
from creepkit.files.writing import check_target, write_bytes, write_text
from creepkit.reports.attachments import problem_of_names, read_attachments
from creepkit.reports.contents import versions_of
from creepkit.studies import arguments
from creepkit.studies.arguments import check_forecast
from creepkit.studies.cameras import StudyCamera, cameras_of, flagged_frames
from creepkit.studies.execution import (
    STAGE_KINDS,
    Execution,
    Stage,
    StageRecord,
    failure_text,
    needed_stages,
    running_alone,
)
from creepkit.studies.inputs import DATA_FILE, InputFile, input_files, read_inputs
from creepkit.studies.kept_results import ResultFolder, key_of
from creepkit.studies.result import CARRIED_FOLDER, PACKAGES, StudyResult
from creepkit.studies.stages import StageInputs, export_name, stages_of
from creepkit.studies.study_file import KeyPath, StudyFile, read_study_file

if TYPE_CHECKING:
    from creepkit.jobs.progress import ProgressCallback
    from creepkit.reports.contents import ReportContents


@checked
@dataclass(frozen=True, repr=False)
class Study:
    """A study file that was read and checked: its path, text and tables."""

    file: StudyFile

    @classmethod
    def load(cls, path: str | Path, *, root: str | Path | None = None) -> Study:
        """Read a study file and check what can be checked before data are read.

        root : folder of the data that a report carried, as 'creepkit run report.html' extracts them.
        StudyError, in one sentence with file and line, says what is wrong with the file.
        """
        study = cls(read_study_file(Path(path), None if root is None else Path(root)))
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
        from creepkit.rupture_assessment.methods import METHODS, MINIMUM_RATE

        file, model = self.file, self.file.model
        file.check_name(("data", "reader"), "reader", model.data.reader, ck.available("readers"))
        arguments.predictor_of(file)
        arguments.settings_of(file)
        if model.identification is not None:
            arguments.laws_of(file)
        arguments.check_temperature(file)
        methods = set(METHODS) - {MINIMUM_RATE.name}
        for k, name in enumerate((model.rupture and model.rupture.methods) or []):
            file.check_name(("rupture", "methods", k), "method", name, methods)
        for k, part in enumerate(model.forecast):
            check_forecast(file, k)
            if part.name in [one.name for one in model.forecast[:k]]:
                raise file.error(("forecast", k, "name"), f"two forecasts are called '{part.name}'; rename one of them")
        if model.design is not None:
            arguments.goal_of(file)
        self._check_outputs([export_name(file, k) for k in range(len(model.export))])

    def _check_outputs(self, exports: Sequence[str]) -> None:
        """StudyError for data files that there are not, and for files that would replace data or be written twice."""
        file, model = self.file, self.file.model
        data = [*self.paths, *(path for camera in self.cameras for path in camera.all_files)]
        places: list[tuple[KeyPath, str]] = [(("export", k, "file"), name) for k, name in enumerate(exports)]
        places += [] if model.report is None else [(("report", "file"), model.report.file)]
        taken = {one.casefold() for one in (file.path.name, f"{file.path.stem}.results")}
        for key, name in places:
            among_data = any(fnmatchcase(name, pattern.removeprefix("./")) for pattern in model.data.files)
            if problem_of_names([name]) or "/" in name:
                raise file.error(key, f"'{name}' must be a plain name of a file, such as report.html")
            if name.casefold() in taken:
                what = "is a file of the study itself, or written by another table already; give file = another name"
                raise file.error(key, f"'{name}' {what}")
            if among_data or file.path.parent / name in data:
                what = "would be among the data files; give file = another name, or name those more exactly"
                raise file.error(key, f"'{name}' {what}")
            taken.add(name.casefold())

    @cached_property
    def cameras(self) -> list[StudyCamera]:
        """The cameras of the study."""
        return cameras_of(self.file)

    @cached_property
    def paths(self) -> list[Path]:
        """Files and folders of the tests."""
        return self.file.paths(("data", "files"), self.file.model.data.files)

    def run(
        self,
        *,
        to: str | Path | None = None,
        only: str | Sequence[str] | None = None,
        again: bool = False,
        progress: ProgressCallback | None = None,
    ) -> StudyResult:
        """Carry out the study; what was made before from the same inputs is read, not made again.

        to : folder for results, exports and report; by default that of the study file.
        only : kinds of stages, such as "identification", which are carried out with those that they need.
        again : make everything again.
        progress : called as progress(task, done, total, note). Files of the names of exports and report that creepkit
        did not write are replaced within `with ck.overwriting():` alone.

        A stage that fails leaves the others; `failures` of the result, and the report, say what is missing. Raises
        StudyError for an unknown stage, for files that cannot be read or written, and for a study that is running.
        """
        kinds = STAGE_KINDS if only is None else [only] if isinstance(only, str) else list(only)
        for kind in kinds:
            refuse_unknown(kind, STAGE_KINDS, StudyError, f"there is no stage '{kind}'")
        folder = self.path.parent if to is None else Path(to)
        kept = ResultFolder(folder / f"{self.path.stem}.results")
        with running_alone(kept.folder):
            if again:
                kept.clear()
            run = _Run(self, folder, kept, progress or (lambda task, done, total, note: None))
            return run.result(kinds)

    def report_contents(self) -> ReportContents:
        """What ck.report(study) shows: the study is carried out, or read where nothing changed."""
        return self.run().report_contents()


@dataclass(frozen=True)
class _Run:
    """One run of a study, whose results are `kept`; exports and report are written to `folder`."""

    study: Study
    folder: Path
    kept: ResultFolder
    progress: ProgressCallback

    def result(self, kinds: Sequence[str]) -> StudyResult:
        file, cameras = self.study.file, self.study.cameras
        self.progress("reading", 0, 1, "")
        files = self.input_files()
        execution = Execution(self.kept, self.progress)
        watched = [stage for camera in cameras for stage in camera.stages(files)]
        execution.run(watched, [stage.name for stage in watched])  # whatever is asked for is made of their tests
        tests = [test for camera in cameras for test in camera.histories(execution.results)]
        priors = tuple(prior for camera in cameras for prior in camera.priors(tests))
        inputs = read_inputs(file, self.study.paths, tests, complete=not execution.failures)
        self.progress("reading", 1, 1, f"{len(inputs.histories)} tests in {len(files)} files")
        stages, execution.histories = stages_of(StageInputs(file, inputs, priors)), inputs.histories
        wanted = needed_stages(stages, kinds)
        self.check_exports([stage for stage in stages if stage.name in wanted])
        execution.run(stages, wanted, read_others="report" in kinds)
        of_cameras = [test for camera in cameras for test in camera.tests(execution.results)]
        extractions = {name: one for name, one, _ in of_cameras}
        failed = [one for camera in cameras for one in camera.failed(execution.results)]
        result = StudyResult(
            file,
            inputs,
            tuple(files),
            (*flagged_frames(extractions), *failed, *inputs.exclusions),
            tuple(execution.records),
            results=execution.results,
            extractions=extractions,
            imposed={name: under for name, _, under in of_cameras if under is not None},
            documents=execution.documents,
            folder=self.kept.identified,
        )
        self.kept.write_identified(result.identified)
        for stage in stages:
            if stage.file and stage.name in execution.results:
                write_text(execution.results[stage.name].text, self.folder / stage.file, StudyError)
        asked = file.model.report is not None and "report" in kinds
        return self.with_page(result, file.model.report.file) if asked and file.model.report else result

    def input_files(self) -> list[InputFile]:
        """All data files, those of cameras and forecasts included, without what the study itself writes."""
        file, model = self.study.file, self.study.file.model
        outputs = [*(one.file for one in model.export), model.report and model.report.file]
        own = [self.study.path, *(self.folder / name for name in outputs if name)]
        paths = [*self.study.paths, *(path for camera in self.study.cameras for path in camera.all_files)]
        for k, part in enumerate(model.forecast):
            paths += file.paths(("forecast", k, "tests"), part.tests)
        predictor = arguments.predictor_path(file)
        return input_files(file, [*paths, *([] if predictor is None else [predictor])], own)

    def check_exports(self, stages: Sequence[Stage]) -> None:
        """StudyError, before all the work, for exports that could not be written."""
        for stage in stages:
            if stage.file:
                check_target(self.folder / stage.file, StudyError)

    def with_page(self, result: StudyResult, name: str) -> StudyResult:
        """The result with its report written, unless the same one is there; one that cannot be is a failed stage."""
        from creepkit.reports import html

        path = self.folder / name
        shown = [(one.name, one.sentence) for one in result.stages if one.state in ("failed", "left out")]
        made_from = [[one.name, one.sha256] for one in result.files], [[one.name, one.key] for one in result.stages]
        key = key_of([self.study.file.text, versions_of(PACKAGES), *made_from, shown, name])
        state, sentence = "kept", ""
        if not path.is_file() or self.kept.load("report", key) != sha256_of(path, DATA_FILE):
            self.progress("report", 0, 1, "")
            try:
                write_text(html.report_html(result.report_contents()), path, StudyError)
                self.kept.save("report", key, sha256_of(path, DATA_FILE))
                state = "made"
                self.progress("report", 1, 1, str(path))
            except Exception as error:  # what was found is there without a page
                state, sentence = "failed", failure_text(error)
        record = StageRecord("report", "report", "", state, key, sentence)  # type: ignore[arg-type]
        return replace(result, stages=(*result.stages, record), report=None if state == "failed" else path)


# ---- back from a report ----------------------------------------------------------------------------------------------


STUDY_NAME, INPUTS = "study.toml", f"{CARRIED_FOLDER}/"


def study_of_report(report: Path, folder: Path) -> Study:
    """Write what a report carries to a folder, and read its study; files that are there already must be the same."""
    files = read_attachments(report)
    if STUDY_NAME not in files:
        raise StudyError(f"{report}: carries no {STUDY_NAME}; give a report that 'creepkit run study.toml' wrote")
    for name in files:
        if name != STUDY_NAME and not name.startswith(INPUTS):
            raise StudyError(
                f"{report}: carries '{name}', and a report carries {STUDY_NAME} and data below {INPUTS} alone; "
                "use the report as creepkit wrote it"
            )
    for name, content in files.items():
        path = folder / name
        if path.exists() and read_bytes(path, DATA_FILE) != content:
            raise StudyError(f"{path}: is there already, and differs from what {report} carries; give --to FOLDER")
        if not path.exists():
            try:
                path.parent.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                what = f"cannot be made ({error.strerror}); name another folder by --to"
                raise StudyError(f"{path.parent}: {what}") from None
            write_bytes(content, path, StudyError)
    inputs = folder / CARRIED_FOLDER
    if not inputs.is_dir():
        raise StudyError(
            f"{report}: carries hashes of its data alone; the study is in {folder / STUDY_NAME}: "
            f"put the data files that the report lists into {inputs}, and run the report again"
        )
    return Study.load(folder / STUDY_NAME, root=inputs)
