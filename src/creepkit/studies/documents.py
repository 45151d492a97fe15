"""Results of stages as files of a folder, each with the hash of all that it was made from; and how they are read."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, get_type_hints

from creepkit.errors import StudyError
from creepkit.extraction.extraction import Extraction
from creepkit.extraction.noise import NoiseEstimate
from creepkit.files.file_names import hashed_stem
from creepkit.files.json_documents import (
    DocumentFormat,
    canonical_json,
    check_heading,
    check_keys,
    read_json,
    write_json,
)
from creepkit.files.reading import FileKind
from creepkit.files.record_codec import ANY_NUMBER, RecordCodec, RecordError, ValueCodec
from creepkit.files.writing import is_foreign, is_listed, temporary_files, write_bytes, written_files
from creepkit.inverse.fingerprints import short_hash
from creepkit.inverse.identification import Identification
from creepkit.inverse.identification_document import LAW_CODEC
from creepkit.inverse.kept_fits import code_fingerprint, history_digest, kept_from_json, kept_to_json
from creepkit.language import CreepLaw, Elastic
from creepkit.records import (
    History,
    Loading,
    PointLoading,
    Predictor,
    PressureJump,
    Program,
    RecordedLoading,
    StrainSteps,
    StressSteps,
)
from creepkit.reports.contents import ExportedFile

FITS_FOLDER, IDENTIFIED_FOLDER = "fits", "identified"


STAGE_RESULT = DocumentFormat(
    "creepkit-stage-result",
    2,
    FileKind("a result of a stage", StudyError, "remove it: it is made again", maximum_bytes=500_000_000),
    remedy="remove it: it is made again",
)


OUTPUTS = "outputs"
"""Under which names of files that a study has written are kept, whatever code wrote them."""


LOADINGS: Mapping[str, type[Any]] = {
    one.__name__: one for one in (StressSteps, StrainSteps, PressureJump, RecordedLoading, PointLoading)
}
"""Kinds of loading of planned tests, by the name that files give them."""


PLAIN = RecordCodec(default_range=ANY_NUMBER)


HISTORY_FIELDS: Mapping[str, Any] = {
    "name": str,
    "times": list[float],
    "specimen": str,
    "geometry": dict[str, float],
    "alloy": str,
    "labels": dict[str, str],
    "operator": str,
    "strain_measure": str,
    "includes_elastic": bool,
}
"""What a file holds of a planned test as it is; its loading, temperature and modulus are written apart."""


@dataclass(frozen=True)
class ResultCodec:
    """How results of stages are written and read.

    histories : the tests of the study, which are stored by name and hash; planned tests are stored whole.
    predictor : of identifications whose file does not give one, such as a surrogate.
    """

    histories: Sequence[History]
    predictor: Predictor | None = None

    @property
    def codec(self) -> RecordCodec:
        """Of all records that stages make."""
        by_name = {history.name: history for history in self.histories}
        digests = {name: history_digest(history) for name, history in by_name.items()}

        def to_json(history: History) -> Any:
            if digests.get(history.name) == history_digest(history):
                return {"test": history.name}
            return planned_to_json(history)

        def from_json(data: Any, source: str) -> History:
            if isinstance(data, dict) and [*data] == ["test"] and data["test"] in by_name:
                return by_name[data["test"]]
            return planned_from_json(data)

        def fit_from_json(data: Any, source: str) -> Identification:
            fit = kept_from_json(data, source)
            names = [one.name for one in fit.tests]
            if not all(name in by_name for name in names):
                raise StudyError("its tests are not those of the study")
            tests = tuple(by_name[name] for name in names)
            return replace(fit, histories=tests, predictor=fit.predictor or self.predictor)

        values: dict[Any, ValueCodec] = {
            NoiseEstimate: ValueCodec(_noise_to_json, _noise_from_json),
            CreepLaw: LAW_CODEC,
            History: ValueCodec(to_json, from_json),
            Identification: ValueCodec(kept_to_json, fit_from_json),
        }
        from creepkit.inverse.selection.challenges import Challenge

        omitted: dict[type, tuple[str, ...]] = {Extraction: ("history",)}
        return RecordCodec(omitted, values=values, names={"Challenge": Challenge}, default_range=ANY_NUMBER)


def _noise_to_json(noise: NoiseEstimate) -> dict[str, Any]:
    """Noise with its correlations as a list, for their names are pairs."""
    data = {f.name: PLAIN.to_json(getattr(noise, f.name)) for f in fields(noise) if f.name != "correlation"}
    return {**data, "correlation": [[*pair, value] for pair, value in noise.correlation.items()]}


def _noise_from_json(data: Any, source: str) -> NoiseEstimate:
    hints = get_type_hints(NoiseEstimate)
    problem = "it is no object" if not isinstance(data, dict) else check_keys(data, tuple(hints), "noise")
    if problem:
        raise RecordError(f"noise cannot be read: {problem}")
    values = {n: PLAIN.from_json(hint, data[n], n) for n, hint in hints.items() if n != "correlation"}
    pairs = PLAIN.from_json(list[tuple[str, str, float]], data["correlation"], "correlation")
    return NoiseEstimate(**values, correlation={(a, b): value for a, b, value in pairs})


def planned_to_json(history: History) -> dict[str, Any]:
    """A planned test; RecordError for one with outputs, or of a loading that is not creepkit's."""
    kind = type(history.loading).__name__
    if history.outputs or LOADINGS.get(kind) is not type(history.loading):
        raise RecordError(f"test '{history.name}' cannot be stored")
    elastic = history.elastic
    if elastic is not None and not isinstance(elastic.E, float):
        raise RecordError(f"test '{history.name}' has a modulus that depends on temperature")
    return {
        **{name: PLAIN.to_json(getattr(history, name)) for name in HISTORY_FIELDS},
        "loading": {"kind": kind, **PLAIN.to_json(history.loading)},
        "temperature": PLAIN.to_json(history.temperature_program()),
        "elastic": None if elastic is None else [elastic.E, elastic.nu],
    }


def planned_from_json(data: Any) -> History:
    """The planned test that `planned_to_json` wrote; RecordError or another error of creepkit for other data."""
    names = (*HISTORY_FIELDS, "loading", "temperature", "elastic")
    problem = "it is no object" if not isinstance(data, dict) else check_keys(data, names, "test")
    kind = LOADINGS.get(str(data["loading"].get("kind"))) if not problem and isinstance(data["loading"], dict) else None
    if problem or kind is None:
        raise RecordError(f"a planned test cannot be read: {problem or 'its loading is not known'}")
    fields = {name: PLAIN.from_json(hint, data[name], name) for name, hint in HISTORY_FIELDS.items()}
    loading: Loading = PLAIN.from_json(kind, {k: v for k, v in data["loading"].items() if k != "kind"}, "loading")
    program = PLAIN.from_json(Program, data["temperature"], "temperature")
    elastic = None if data["elastic"] is None else PLAIN.from_json(list[float], data["elastic"], "elastic")
    constant = bool((program.values == program.values[0]).all())
    return History(
        **fields,
        outputs={},
        loading=loading,
        temperature=float(program.values[0]) if constant else program,
        elastic=None if elastic is None else Elastic(*elastic),
    )


def key_of(parts: Mapping[str, Any]) -> str:
    """Hash of all that decides a result."""
    return short_hash(canonical_json(parts))


def digest_of_result(data: Any) -> str:
    """Hash of what is kept of a result: the same wherever and whenever it is made, of the same numbers."""
    parts = ("numbers", "record", "document")
    return short_hash(canonical_json(_timeless({name: data[name] for name in parts if name in data})))


def _timeless(data: Any) -> Any:
    """Data without the times at which identifications were made."""
    if isinstance(data, Mapping):
        items = ((name, _timeless(item)) for name, item in data.items())
        return {n: {k: v for k, v in i.items() if k != "when"} if n == "provenance" else i for n, i in items}
    return [_timeless(item) for item in data] if isinstance(data, list | tuple) else data


@dataclass(frozen=True)
class ResultFolder:
    """The folder in which results of stages are kept, one file each.

    What is written there is listed with its hash (see files.writing): what something else wrote or changed is neither
    read nor removed.

    overwrite : whether files beside the study that it has not written may be replaced.
    """

    folder: Path
    overwrite: bool = False

    @property
    def fits(self) -> Path:
        """Folder of single identifications, see creepkit.inverse.kept_fits."""
        return self.folder / FITS_FOLDER

    @property
    def identified(self) -> Path:
        """Folder of the identifications and rankings as other commands read them."""
        return self.folder / IDENTIFIED_FOLDER

    def write_identified(self, files: Sequence[ExportedFile]) -> None:
        """Write identifications and rankings, and remove those of an earlier run that there are no longer."""
        if files:
            self.identified.mkdir(parents=True, exist_ok=True)
        for one in files:
            write_bytes(one.text.encode(), self.identified / one.name, StudyError, force=True)
        for path in set(written_files(self.identified, "*.json")) - {self.identified / one.name for one in files}:
            path.unlink(missing_ok=True)

    def path(self, stage: str) -> Path:
        """The file of a stage."""
        return self.folder / f"{hashed_stem(stage)}.json"

    def clear(self, *, everything: bool) -> None:
        """Remove files that a process left half written when it died, or all results. No other process may write."""
        for folder in (self.folder, self.fits, self.identified):
            for path in (*temporary_files(folder), *(written_files(folder, "*.json") if everything else ())):
                path.unlink(missing_ok=True)

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of exports and reports that the study has written beside it, or began to; they are no data."""
        found = self._load(OUTPUTS, OUTPUTS)
        return tuple(name for name in found if isinstance(name, str)) if isinstance(found, list | dict) else ()

    def add_output(self, name: str) -> None:
        """Note the name of a file that is written beside the study."""
        if name not in self.outputs:
            self._save(OUTPUTS, OUTPUTS, [*self.outputs, name])

    def prune_fits(self, asked: Collection[str]) -> int:
        """Remove the identifications but those of these keys; how many were removed."""
        gone = [path for path in written_files(self.fits, "*.json") if path.stem not in asked]
        for path in gone:
            path.unlink(missing_ok=True)
        return len(gone)

    def is_altered(self, stage: str, *, readable: bool) -> bool:
        """Whether the file of a stage is not as it was written. readable : whether it can be read for all that."""
        path = self.path(stage)
        return is_foreign(path) and (readable or is_listed(path))

    def load(self, stage: str, key: str) -> Any:
        """The data of a stage; None where there are none, of another key, or made by other code of this package."""
        return self._load(stage, f"{key} {code_fingerprint()}")

    def save(self, stage: str, key: str, result: Any) -> None:
        """Write the data of a stage, whole or not at all."""
        self._save(stage, f"{key} {code_fingerprint()}", result)

    def _load(self, stage: str, key: str) -> Any:
        try:
            content = check_heading(read_json(self.path(stage), STAGE_RESULT.kind), str(self.path(stage)), STAGE_RESULT)
        except StudyError:
            return None
        if check_keys(content, ("stage", "key", "result"), "result") or content["key"] != key:
            return None
        return content["result"]

    def _save(self, stage: str, key: str, result: Any) -> None:
        self.folder.mkdir(parents=True, exist_ok=True)
        content = {**STAGE_RESULT.heading, "stage": stage, "key": key, "result": result}
        write_json(content, self.path(stage), STAGE_RESULT.kind, force=True)
