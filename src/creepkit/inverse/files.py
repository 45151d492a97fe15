"""Identifications as JSON files: strict on reading, nothing in them is evaluated, half-written files never appear."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from creepkit.errors import FitError
from creepkit.inverse.coordinates import Reference
from creepkit.inverse.covariance import Scatter
from creepkit.inverse.identification import Identification, Settings, TestMisfit
from creepkit.inverse.uncertainty import Estimate
from creepkit.language.tree import law_from_json, law_to_json
from creepkit.records import Nuisance

KIND = "creepkit identification"
LARGEST = 50_000_000
"""Bytes; no identification is near it, and a reader must not swallow what it cannot hold."""


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class _Estimate(_Strict):
    name: str
    value: float
    low: float
    high: float
    unit: str
    verdict: Literal["determined", "at its bound", "not determined"]


class _Reference(_Strict):
    stress: float = Field(gt=0)
    strain: float = Field(gt=0)
    time: float = Field(gt=0)
    temperature: float = Field(gt=0)


class _Scatter(_Strict):
    noise: float = Field(ge=0)
    misfit: float = Field(ge=0)
    offset: float = Field(ge=0)
    rate: float = Field(ge=0)
    drift: float = Field(ge=0)
    reach: float = Field(gt=0)


class _Test(_Strict):
    name: str
    condition: str
    frames: int = Field(ge=0)
    rms: float | None
    bias: float | None
    offset: float
    rate_factor: float


class _Nuisance(_Strict):
    kind: Literal["offset", "rate"]
    sd: float | None = Field(gt=0)


class _Settings(_Strict):
    starts: int = Field(ge=1)
    draws: int = Field(ge=1)
    frames: int = Field(ge=2)
    seed: int
    loss: str
    nuisances: list[_Nuisance]


class _Document(_Strict):
    kind: Literal["creepkit identification"]
    version: Literal[1]
    law: dict[str, Any]
    estimates: list[_Estimate]
    u: list[float]
    covariance: list[list[float]]
    reference: _Reference
    scatter: _Scatter
    rms: float
    log_likelihood: float
    size: float = Field(gt=0)
    freedom: float = Field(gt=0)
    tests: list[_Test]
    ranges: dict[str, tuple[float, float]]
    settings: _Settings
    provenance: dict[str, str | int | float | list[str]]
    converged: bool
    notes: list[str]


def to_json(fit: Identification) -> dict[str, Any]:
    """The identification as JSON-able data."""
    return {
        "kind": KIND,
        "version": 1,
        "law": law_to_json(fit.law),
        "estimates": [vars(e) for e in fit.estimates],
        "u": fit.u.tolist(),
        "covariance": fit.covariance.tolist(),
        "reference": vars(fit.reference),
        "scatter": fit.scatter.to_dict(),
        "rms": fit.rms,
        "log_likelihood": fit.log_likelihood,
        "size": fit.size,
        "freedom": fit.freedom,
        "tests": [{k: None if v != v else v for k, v in vars(m).items()} for m in fit.misfits],
        "ranges": {name: list(ends) for name, ends in fit.ranges.items()},
        "settings": {**vars(fit.settings), "nuisances": [{"kind": n.kind, "sd": n.sd} for n in fit.settings.nuisances]},
        "provenance": dict(fit.provenance),
        "converged": fit.converged,
        "notes": list(fit.notes),
    }


def save(fit: Identification, path: Path) -> Path:
    """Write to a temporary name, then rename: a file is whole or absent."""
    text = json.dumps(to_json(fit), indent=1, allow_nan=False) + "\n"
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        temporary.write_text(text, encoding="utf-8")
        os.replace(temporary, path)
    except OSError as error:
        raise FitError(f"{path}: cannot be written ({error.strerror}); choose a file in a folder that exists") from None
    finally:
        temporary.unlink(missing_ok=True)
    return path


def load(path: str | Path) -> Identification:
    """Read an identification; its law is rebuilt from data and its fingerprint checked."""
    path = Path(path)
    try:
        if path.stat().st_size > LARGEST:
            raise FitError(f"{path}: larger than {LARGEST // 1_000_000} MB, which no identification is")
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise FitError(f"{path}: cannot be read ({error.strerror})") from None
    except (UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
        where = f", line {error.lineno}" if isinstance(error, json.JSONDecodeError) else ""
        raise FitError(f"{path}{where}: not JSON text; give a file that Identification.save wrote") from None
    return from_json(data, str(path))


def from_json(data: Any, source: str = "identification") -> Identification:
    """Rebuild an identification from JSON data, or say in one sentence what is wrong with it."""
    try:
        document = _Document.model_validate(data)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"]) or "the document"
        raise FitError(
            f"{source}: {place}: {first['msg'].lower()}; it is not an identification of this version"
        ) from None
    law = law_from_json(document.law, source)
    size = len(law.params)
    names, rows = tuple(e.name for e in document.estimates), document.covariance
    square = len(rows) == size and all(len(row) == size for row in rows)
    if names != law.names or len(document.u) != size or not square:
        raise FitError(f"{source}: estimates, u and covariance do not belong to the {size} parameters of the law")
    return Identification(
        law=law,
        estimates=tuple(Estimate(**e.model_dump()) for e in document.estimates),
        u=np.array(document.u),
        covariance=np.array(rows, float).reshape(size, size),
        reference=Reference(**document.reference.model_dump()),
        scatter=Scatter(**document.scatter.model_dump()),
        rms=document.rms,
        log_likelihood=document.log_likelihood,
        size=document.size,
        freedom=document.freedom,
        misfits=tuple(_test(t) for t in document.tests),
        ranges=document.ranges,
        settings=_settings(document.settings),
        provenance=document.provenance,
        converged=document.converged,
        notes=tuple(document.notes),
    )


def _settings(s: _Settings) -> Settings:
    nuisances = tuple(Nuisance(n.kind, sd=n.sd) for n in s.nuisances)
    return Settings(**{**s.model_dump(), "nuisances": nuisances})


def _test(t: _Test) -> TestMisfit:
    rms, bias = (float("nan") if v is None else v for v in (t.rms, t.bias))
    return TestMisfit(t.name, t.condition, t.frames, rms, bias, t.offset, t.rate_factor)
