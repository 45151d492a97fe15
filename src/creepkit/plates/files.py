"""The answer for one alloy as a JSON file: whole or absent, strict on reading, nothing in it is evaluated."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from creepkit.errors import FitError
from creepkit.inverse.confirm import Confirmation
from creepkit.inverse.files import LARGEST, from_json, to_json
from creepkit.inverse.identification import Identification
from creepkit.inverse.writing import write_text
from creepkit.plates.answer import AlloyAnswer, Weighed


class WeighedPart(BaseModel):
    """One identified law."""

    model_config = ConfigDict(extra="forbid")
    fit: dict[str, Any]
    excess: float
    weight: float


class Document(BaseModel):
    """What must stand in the file, and nothing else may. NaN and infinity stand there as words."""

    model_config = ConfigDict(extra="forbid", ser_json_inf_nan="strings")
    kind: Literal["creepkit alloy"] = "creepkit alloy"
    version: Literal[1] = 1
    alloy: str
    fingerprint: str
    laws: list[WeighedPart]
    failed: dict[str, str]
    verdict: str
    equivalents: list[str]
    reason: str
    dense: dict[str, Any] | None
    sparse: dict[str, Any] | None
    confirmation: Confirmation | None
    predicted: dict[str, dict[str, list[float]]]
    notes: list[str]
    seconds: float


def save(answer: AlloyAnswer, path: Path) -> Path:
    """Write the answer; the file is whole or absent."""
    return write_text(_document(answer).model_dump_json(indent=1) + "\n", path)


def load(path: Path) -> AlloyAnswer:
    """Read an answer; FitError, in one sentence, for a file that is none."""
    try:
        if path.stat().st_size > LARGEST:
            raise FitError(f"{path}: larger than {LARGEST // 1_000_000} MB, which no answer for an alloy is")
        found = Document.model_validate_json(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise FitError(f"{path}: cannot be read ({error.strerror})") from None
    except (ValidationError, UnicodeDecodeError) as error:
        told = "text" if isinstance(error, UnicodeDecodeError) else error.errors()[0]["msg"].lower()
        raise FitError(f"{path}: not the answer for an alloy ({told}); remove it, and it is worked out again") from None
    source = str(path)
    return AlloyAnswer(
        alloy=found.alloy,
        fingerprint=found.fingerprint,
        laws=tuple(Weighed(from_json(w.fit, source), w.excess, w.weight) for w in found.laws),
        failed=found.failed,
        verdict=found.verdict,
        equivalents=tuple(found.equivalents),
        reason=found.reason,
        dense=_fit(found.dense, source),
        sparse=_fit(found.sparse, source),
        confirmation=found.confirmation,
        predicted={t: {name: np.array(row) for name, row in rows.items()} for t, rows in found.predicted.items()},
        notes=tuple(found.notes),
        seconds=found.seconds,
    )


def _document(answer: AlloyAnswer) -> Document:
    return Document(
        alloy=answer.alloy,
        fingerprint=answer.fingerprint,
        laws=[WeighedPart(fit=to_json(w.fit), excess=w.excess, weight=w.weight) for w in answer.laws],
        failed=dict(answer.failed),
        verdict=answer.verdict,
        equivalents=list(answer.equivalents),
        reason=answer.reason,
        dense=None if answer.dense is None else to_json(answer.dense),
        sparse=None if answer.sparse is None else to_json(answer.sparse),
        confirmation=answer.confirmation,
        predicted={t: {name: row.tolist() for name, row in rows.items()} for t, rows in answer.predicted.items()},
        notes=list(answer.notes),
        seconds=answer.seconds,
    )


def _fit(data: dict[str, Any] | None, source: str) -> Identification | None:
    return None if data is None else from_json(data, source)
