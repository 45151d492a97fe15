"""Results of stages as files of a folder, each with the hash of all that it was made from; and how they are read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from creepkit.errors import CreepkitError, StudyError
from creepkit.extraction.extraction import Extraction
from creepkit.files.json_documents import DocumentFormat, canonical_json, check_heading, read_json, write_json
from creepkit.files.reading import FileKind
from creepkit.files.record_codec import RecordCodec, RecordError, ValueCodec
from creepkit.files.writing import hashed_stem, write_text
from creepkit.inverse.identification import Identification
from creepkit.inverse.identification_document import LAW_CODEC
from creepkit.inverse.kept_fits import code_fingerprint, history_digest, kept_from_json, kept_to_json
from creepkit.inverse.predictor_documents import short_hash
from creepkit.language import CreepLaw, Elastic
from creepkit.limits import ANY_NUMBER
from creepkit.records import (
    History,
    Loading,
    PointLoading,
    Predictor,
    PressureJump,
    RecordedLoading,
    StrainSteps,
    StressSteps,
)
from creepkit.reports.contents import ExportedFile

REMEDY = "remove it: it is made again"
STAGE_RESULT = DocumentFormat(
    "creepkit-stage-result",
    3,
    FileKind("a result of a stage", StudyError, REMEDY, maximum_bytes=500_000_000),
    remedy=REMEDY,
)


LOADINGS: Mapping[str, type[Any]] = {
    one.__name__: one for one in (StressSteps, StrainSteps, PressureJump, RecordedLoading, PointLoading)
}
"""Kinds of loading of tests, by the name that files give them."""


PLAIN = RecordCodec(default_range=ANY_NUMBER)


def _loading_to_json(loading: Loading) -> dict[str, Any]:
    kind = type(loading).__name__
    if LOADINGS.get(kind) is not type(loading):
        raise RecordError(f"a loading of the kind {kind} cannot be stored")
    return {"kind": kind, **PLAIN.to_json(loading)}


def _loading_from_json(data: Any, source: str) -> Loading:
    kind = LOADINGS.get(str(data.get("kind"))) if isinstance(data, dict) else None
    if kind is None:
        raise RecordError("its kind of loading is not known")
    loading: Loading = PLAIN.from_json(kind, {name: value for name, value in data.items() if name != "kind"})
    return loading


LOADING: dict[Any, ValueCodec] = {Loading: ValueCodec(_loading_to_json, _loading_from_json)}
HISTORY = RecordCodec(values=LOADING, names={"Elastic": Elastic}, default_range=ANY_NUMBER)


def codec_of(histories: Sequence[History], predictor: Predictor | None = None) -> RecordCodec:
    """How results of stages are written and read.

    histories : the tests of the study, which are stored by name; others, such as planned ones, are stored whole.
    predictor : of identifications whose file does not give one, such as a surrogate.
    """
    from creepkit.inverse.selection.challenges import Challenge

    by_name = {history.name: history for history in histories}
    digests = {name: history_digest(history) for name, history in by_name.items()}

    def to_json(history: History) -> Any:
        if digests.get(history.name) == history_digest(history):
            return {"test": history.name}
        return {f.name: _history_value(history, f.name) for f in fields(History)}

    def from_json(data: Any, source: str) -> History:
        if isinstance(data, dict) and [*data] == ["test"] and data["test"] in by_name:
            return by_name[data["test"]]
        return HISTORY.from_json(History, data)

    def fit_from_json(data: Any, source: str) -> Identification:
        fit = kept_from_json(data, source)
        names = [one.name for one in fit.tests]
        if not all(name in by_name for name in names):
            raise StudyError("its tests are not those of the study")
        tests = tuple(by_name[name] for name in names)
        return replace(fit, histories=tests, predictor=fit.predictor or predictor)

    values: dict[Any, ValueCodec] = {
        CreepLaw: LAW_CODEC,
        History: ValueCodec(to_json, from_json),
        Identification: ValueCodec(kept_to_json, fit_from_json),
    }
    return RecordCodec(
        {Extraction: ("history",)}, values=values, names={"Challenge": Challenge}, default_range=ANY_NUMBER
    )


def _history_value(history: History, name: str) -> Any:
    return _loading_to_json(history.loading) if name == "loading" else PLAIN.to_json(getattr(history, name))


def key_of(parts: Any) -> str:
    """Hash of all that decides a result."""
    return short_hash(canonical_json(parts))


@dataclass(frozen=True)
class ResultFolder:
    """The folder in which results of stages are kept, one file each. It is the study's own: what lies there goes."""

    folder: Path

    @property
    def fits(self) -> Path:
        """Folder of single identifications, see creepkit.inverse.kept_fits."""
        return self.folder / "fits"

    @property
    def identified(self) -> Path:
        """Folder of the identifications and rankings as other commands read them."""
        return self.folder / "identified"

    def path(self, stage: str) -> Path:
        """The file of a stage."""
        return self.folder / f"{hashed_stem(stage)}.json"

    def clear(self) -> None:
        """Remove all results, so that they are made again."""
        for path in (*self.folder.glob("*.json"), *self.fits.glob("*.json")):
            path.unlink(missing_ok=True)

    def load(self, stage: str, key: str) -> Any:
        """The data of a stage; None where there are none, damaged ones, or those of another key or other code."""
        path = self.path(stage)
        with suppress(CreepkitError):
            content = check_heading(read_json(path, STAGE_RESULT.kind), str(path), STAGE_RESULT)
            is_wanted = (content.get("stage"), content.get("key")) == (stage, f"{key} {code_fingerprint()}")
            return content.get("result") if is_wanted else None
        return None

    def save(self, stage: str, key: str, result: Any) -> None:
        """Write the data of a stage, whole or not at all."""
        content = {**STAGE_RESULT.heading, "stage": stage, "key": f"{key} {code_fingerprint()}", "result": result}
        write_json(content, self.path(stage), STAGE_RESULT.kind, force=True)

    def write_identified(self, files: Sequence[ExportedFile]) -> None:
        """Write identifications and rankings, and remove those of an earlier run that there are no longer."""
        if files:
            self.identified.mkdir(parents=True, exist_ok=True)
        for one in files:
            write_text(one.text, self.identified / one.name, StudyError, force=True)
        for path in set(self.identified.glob("*.json")) - {self.identified / one.name for one in files}:
            path.unlink(missing_ok=True)
