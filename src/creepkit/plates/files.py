"""The answer for one alloy as a JSON file: whole or absent, strict on reading, nothing in it is evaluated."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from creepkit.errors import FitError
from creepkit.inverse.confirm import Confirmation
from creepkit.inverse.files import MAXIMUM_BYTES, identification_from_json, identification_to_json
from creepkit.inverse.identification import Identification
from creepkit.inverse.writing import write_text_atomically
from creepkit.plates.answer import AlloyResult, WeightedLaw


class WeightedLawDocument(BaseModel):
    """One identified law."""

    model_config = ConfigDict(extra="forbid")
    fit: dict[str, Any]
    bic_difference: float
    weight: float


class AlloyResultDocument(BaseModel):
    """What must stand in the file, and nothing else may. NaN and infinity stand there as words."""

    model_config = ConfigDict(extra="forbid", ser_json_inf_nan="strings")
    kind: Literal["creepkit alloy"] = "creepkit alloy"
    version: Literal[1] = 1
    alloy: str
    fingerprint: str
    laws: list[WeightedLawDocument]
    failed_laws: dict[str, str]
    verdict: str
    equivalents: list[str]
    failure: str
    dense_fit: dict[str, Any] | None
    sparse_fit: dict[str, Any] | None
    confirmation: Confirmation | None
    predicted: dict[str, dict[str, list[float]]]
    notes: list[str]
    cpu_seconds: float


def write_result(result: AlloyResult, path: Path) -> Path:
    """Write the answer; the file is whole or absent."""
    return write_text_atomically(_result_document(result).model_dump_json(indent=1) + "\n", path)


def read_result(path: Path) -> AlloyResult:
    """Read an answer; FitError, in one sentence, for a file that is none."""
    try:
        if path.stat().st_size > MAXIMUM_BYTES:
            raise FitError(f"{path}: larger than {MAXIMUM_BYTES // 1_000_000} MB, which no answer for an alloy is")
        document = AlloyResultDocument.model_validate_json(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise FitError(f"{path}: cannot be read ({error.strerror})") from None
    except (ValidationError, UnicodeDecodeError) as error:
        problem = "text" if isinstance(error, UnicodeDecodeError) else error.errors()[0]["msg"].lower()
        raise FitError(f"{path}: not the answer for an alloy ({problem}); remove it, and it is worked out again") from None
    source = str(path)
    return AlloyResult(
        alloy=document.alloy,
        fingerprint=document.fingerprint,
        laws=tuple(WeightedLaw(identification_from_json(w.fit, source), w.bic_difference, w.weight) for w in document.laws),
        failed_laws=document.failed_laws,
        verdict=document.verdict,
        equivalents=tuple(document.equivalents),
        failure=document.failure,
        dense_fit=_optional_identification(document.dense_fit, source),
        sparse_fit=_optional_identification(document.sparse_fit, source),
        confirmation=document.confirmation,
        predicted={t: {name: np.array(row) for name, row in rows.items()} for t, rows in document.predicted.items()},
        notes=tuple(document.notes),
        cpu_seconds=document.cpu_seconds,
    )


def _result_document(result: AlloyResult) -> AlloyResultDocument:
    return AlloyResultDocument(
        alloy=result.alloy,
        fingerprint=result.fingerprint,
        laws=[WeightedLawDocument(fit=identification_to_json(w.fit), bic_difference=w.bic_difference, weight=w.weight) for w in result.laws],
        failed_laws=dict(result.failed_laws),
        verdict=result.verdict,
        equivalents=list(result.equivalents),
        failure=result.failure,
        dense_fit=None if result.dense_fit is None else identification_to_json(result.dense_fit),
        sparse_fit=None if result.sparse_fit is None else identification_to_json(result.sparse_fit),
        confirmation=result.confirmation,
        predicted={t: {name: row.tolist() for name, row in rows.items()} for t, rows in result.predicted.items()},
        notes=list(result.notes),
        cpu_seconds=result.cpu_seconds,
    )


def _optional_identification(data: dict[str, Any] | None, source: str) -> Identification | None:
    return None if data is None else identification_from_json(data, source)
