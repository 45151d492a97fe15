"""Samples of what creepkit keeps to go on later: surrogates, rupture assessments, results of stages, locks, reports."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from file_samples.documents import STUDY, document, written
from file_samples.histories import CREEP
from file_samples.results import FORMATS
from file_samples.samples import ReaderSample

import creepkit as ck
from creepkit.api.saved import load
from creepkit.errors import StudyError
from creepkit.files.json_documents import json_text
from creepkit.files.reading import read_bytes
from creepkit.files.safetensors_files import HEADER_KEY
from creepkit.files.writing import write_bytes
from creepkit.inverse.kept_fits import KEPT_FIT, FitFolder, kept_to_json
from creepkit.inverse.selection.ranking import RankedLaw, Ranking
from creepkit.reports.attachments import embed
from creepkit.reports.contents import Attachment
from creepkit.screening.results import AlloyResult, read_result, write_result
from creepkit.studies.execution import Execution, Stage
from creepkit.studies.kept_results import ResultFolder
from creepkit.studies.study import study_of_report
from creepkit.surrogates.surrogate import SURROGATE, load_surrogate
from helpers.paths import ROOT

MADE = ROOT / "tests" / "data" / "mutated"
HASH = "0123456789abcdef" * 4


def read_kept_fit(path: Path) -> Any:
    """The identification of a file that a study keeps; StudyError where it would be made again."""
    folder = FitFolder(path.parent / "fits")
    folder.folder.mkdir(exist_ok=True)
    write_bytes(path.read_bytes(), folder.path("key"), StudyError, force=True)
    fit = folder.load("key", (), ck.specimen("uniaxial"))
    if fit is None:
        raise StudyError(f"{path}: would be made again")
    return fit


class StageResult:
    """Reads a kept result of a stage as a run of its study does: StudyError where it would be made again."""

    def __init__(self) -> None:
        self.tests = ck.read_histories([FORMATS / "1073K_60MPa.csv", FORMATS / "1073K_90MPa.csv"])

    def content(self) -> bytes:
        """A file of such a result."""
        ranking = ck.rank([load(FORMATS / "identification.json").with_histories(self.tests)])
        with tempfile.TemporaryDirectory() as name:
            folder = ResultFolder(Path(name))
            Execution(folder, histories=self.tests).run([self._making(ranking)], ["identification"])
            return folder.path("identification").read_bytes()

    def __call__(self, path: Path) -> Ranking:
        """The ranking, of a file that is as it was written for all that the list of files says."""

        def made_again(results: Any, tick: Any) -> Ranking:
            raise StudyError(f"{path}: would be made again")

        folder = ResultFolder(path.parent)
        write_bytes(path.read_bytes(), folder.path("identification"), StudyError, force=True)
        run = Execution(folder, histories=self.tests)
        run.run([self._making(made_again)], ["identification"])
        if run.failures:
            raise StudyError(run.failures[0].sentence)
        found: Ranking = run.results["identification"]
        return found

    def _making(self, made: Any) -> Stage:
        make = made if callable(made) else lambda results, tick: made
        settings = {"laws": ["norton"]}
        return Stage("identification", "", settings, make, Ranking)


def read_header(path: Path) -> Any:
    """The surrogate whose header is a file of text, over sound weights."""
    from safetensors import safe_open
    from safetensors.numpy import save

    with safe_open(MADE / "surrogate.safetensors", framework="numpy") as file:
        arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 (a handle, not a mapping)
    target = path.with_suffix(".safetensors")
    text = read_bytes(path, SURROGATE.kind).decode("utf-8", "replace")
    target.write_bytes(save(arrays, metadata={HEADER_KEY: text}))
    return load_surrogate(target)


def header() -> bytes:
    """The header of a surrogate, indented so that its keys stand on lines."""
    from safetensors import safe_open

    with safe_open(MADE / "surrogate.safetensors", framework="numpy") as file:
        return json.dumps(json.loads(file.metadata()[HEADER_KEY]), indent=1).encode()


def run_report(path: Path) -> Any:
    """The study, written to a new folder as `creepkit run report.html` does."""
    with tempfile.TemporaryDirectory(dir=path.parent) as folder:
        return study_of_report(path, Path(folder) / "study").file.model


def samples() -> Iterator[ReaderSample]:
    """The samples of kept files."""
    yield document("rupture assessment", "x.json", (MADE / "rupture.json").read_bytes(), load, '"ranked" "tests"')
    surrogate = document("surrogate", "x.safetensors", (MADE / "surrogate.safetensors").read_bytes(), load_surrogate)
    yield ReaderSample(**{**surrogate.__dict__, "repeated": ()})
    yield document("surrogate header", "x.json", header(), read_header, '"recipe" "metadata" "kind" "format"')
    fit = load(FORMATS / "identification.json")
    kept = json_text({**KEPT_FIT.heading, **kept_to_json(fit)}).encode()
    yield document("kept fit", "x.json", kept, read_kept_fit, '"linearised" "identification"')
    result = AlloyResult("A", laws=(RankedLaw(fit, 0.0, 1.0),))
    alloy = written(lambda path: write_result(result, path), "x.json")
    yield document("alloy result", "x.json", alloy, read_result, '"laws" "verdict" "weight"')
    stage = StageResult()
    yield document("stage result", "x.json", stage.content(), stage, '"weight" "stage"')
    files = {"study.toml": STUDY.encode(), "inputs/a.csv": CREEP.encode()}
    yield document("report of a run", "x.html", report(files), run_report)


def report(files: Mapping[str, bytes]) -> bytes:
    """A page that carries files."""
    attached = [Attachment(name, content) for name, content in files.items()]
    return f"<!doctype html><html><body>{embed(attached)}</body></html>".encode()
