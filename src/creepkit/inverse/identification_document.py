"""Identifications as JSON documents: strict schema, reading and writing."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from creepkit.errors import FitError
from creepkit.files.writing import write_text_atomically
from creepkit.inverse.goodness_of_fit import OutputErrors, OutputFit, RuptureComparison, TestFit
from creepkit.inverse.identification import Identification, IdentificationSettings
from creepkit.inverse.noise_model import NoiseModel, OutputNoise
from creepkit.inverse.nuisance_parameters import NuisanceEstimate
from creepkit.inverse.reference_conditions import ReferencePoint
from creepkit.inverse.sparsity.result import Sparsity
from creepkit.inverse.uncertainty.laplace_approximation import Estimate
from creepkit.language.law_codec import law_from_json, law_to_json
from creepkit.records import Nuisance
from creepkit.records.prediction import NuisanceKind

KIND = "creepkit identification"


VERSION = 4
"""Version 1 knew one output, strain, and no explicit nuisances; version 2 did not know how tests ended; version 3 had
exponents in the place of local exponents among its coordinates, and no sparsity."""


class StrictSchema(BaseModel):
    """What no part of a file may have: unknown fields, or numbers without end."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class EstimateSchema(StrictSchema):
    """One parameter."""

    name: str
    value: float
    low: float
    high: float
    unit: str
    verdict: Literal["determined", "at its bound", "not determined"]


class ReferencePointSchema(StrictSchema):
    """The point of the coordinates."""

    stress: float = Field(gt=0)
    strain: float = Field(gt=0)
    time: float = Field(gt=0)
    temperature: float = Field(gt=0)


class OutputNoiseSchema(StrictSchema):
    """Scatter of one output."""

    noise: float = Field(ge=0)
    misfit: float = Field(ge=0)
    offset: float = Field(ge=0)
    drift: float = Field(ge=0)
    correlation_length: float = Field(gt=0)


class NoiseModelSchema(StrictSchema):
    """Scatter of all outputs, and of the rate."""

    rate: float = Field(ge=0)
    outputs: dict[str, OutputNoiseSchema]


class OutputErrorsSchema(StrictSchema):
    """Errors of one output."""

    frames: int = Field(ge=0)
    relative_squared_error: float | None
    mean_squared_error: float | None
    mean_absolute_error: float | None
    relative_rms_error: float | None
    chi_square: float | None


class OutputFitSchema(StrictSchema):
    """One output of one test."""

    output: str
    errors: OutputErrorsSchema
    offset: float
    noise: float = Field(ge=0)


class RuptureSchema(StrictSchema):
    """The end of one test."""

    measured: float = Field(gt=0)
    censored: bool
    predicted: float | Literal["inf"]
    low: float | Literal["inf"]
    high: float | Literal["inf"]


class TestFitSchema(StrictSchema):
    """One test."""

    name: str
    condition: str
    frames: int = Field(ge=0)
    log_strain_rms: float | None
    log_strain_bias: float | None
    rate_factor: float
    weight: float = Field(gt=0)
    outputs: list[OutputFitSchema]
    rupture: RuptureSchema | None


class NuisanceSchema(StrictSchema):
    """One nuisance, as it was asked for; bounds without end are null."""

    kind: NuisanceKind
    scope: Literal["test", "alloy", "all"]
    output: str
    mean: float
    sd: float | Literal["inf"] | None
    bounds: tuple[float | None, float | None]


class NuisanceEstimateSchema(StrictSchema):
    """What was found of one unknown."""

    kind: NuisanceKind
    scope: Literal["test", "alloy", "all"]
    owner: str
    value: float
    sd: float = Field(ge=0)
    prior_mean: float
    prior_sd: float | Literal["inf"]


class SettingsSchema(StrictSchema):
    """What the run can be repeated from."""

    starts: int = Field(ge=1)
    sobol_points: int = Field(ge=1)
    frames: int = Field(ge=2)
    seed: int
    loss: str
    nuisances: list[NuisanceSchema]
    weights: Literal["noise", "likelihood", "equal", "paper"] | dict[str, float]
    test_loss: str


class FitStatisticsSchema(StrictSchema):
    """How well a sum, or what was left of it, fits."""

    chi_square: float
    parameters: int = Field(ge=0)
    bic: float
    errors: dict[str, OutputErrorsSchema]


class SparsitySchema(StrictSchema):
    """How a sum was reduced to the law."""

    law: str
    penalty: str
    strength: float | None
    kept: list[str]
    dropped: list[str]
    off: list[str]
    proposed: list[str]
    shares_without: dict[str, float]
    shares_with: dict[str, float]
    shares_after: dict[str, float]
    whole: FitStatisticsSchema
    reduced: FitStatisticsSchema
    frames: int = Field(ge=0)


class IdentificationSchema(StrictSchema):
    """The file."""

    kind: Literal["creepkit identification"]
    version: Literal[4]
    law: dict[str, Any]
    estimates: list[EstimateSchema]
    u: list[float]
    covariance: list[list[float]]
    reference: ReferencePointSchema
    noise_model: NoiseModelSchema
    rms: float | None
    log_likelihood: float
    effective_frames: float = Field(gt=0)
    freedom: float = Field(gt=0)
    tests: list[TestFitSchema]
    errors: dict[str, OutputErrorsSchema]
    nuisances: list[NuisanceEstimateSchema]
    ranges: dict[str, tuple[float, float]]
    settings: SettingsSchema
    provenance: dict[str, str | int | float | list[str]]
    converged: bool
    notes: list[str]
    sparsity: SparsitySchema | None = None


MAXIMUM_BYTES = 50_000_000
"""Bytes; no identification is near it, and a reader must not swallow what it cannot hold."""


def identification_to_json(fit: Identification) -> dict[str, Any]:
    """The identification as JSON-able data."""
    return {
        "kind": KIND,
        "version": VERSION,
        "law": law_to_json(fit.law),
        "estimates": [vars(e) for e in fit.estimates],
        "u": fit.u.tolist(),
        "covariance": fit.covariance.tolist(),
        "reference": vars(fit.reference),
        "noise_model": fit.noise_model.to_dict(),
        "rms": _json_number(fit.rms),
        "log_likelihood": fit.log_likelihood,
        "effective_frames": fit.effective_frames,
        "freedom": fit.freedom,
        "tests": [_json_test(m) for m in fit.tests],
        "errors": {name: _json_record(e) for name, e in fit.errors.items()},
        "nuisances": [_json_record(n) for n in fit.nuisances],
        "ranges": {name: list(ends) for name, ends in fit.ranges.items()},
        "settings": _json_settings(fit.settings),
        "provenance": dict(fit.provenance),
        "converged": fit.converged,
        "notes": list(fit.notes),
        "sparsity": None if fit.sparsity is None else _json_tree(fit.sparsity.to_dict()),
    }


def _json_tree(tree: Any) -> Any:
    """The same with every number as JSON can hold it."""
    if isinstance(tree, dict):
        return {key: _json_tree(value) for key, value in tree.items()}
    return _json_number(tree) if isinstance(tree, float) else tree


def _json_number(value: float) -> float | str | None:
    """What JSON can hold: null for what is not a number, "inf" for what has no end."""
    return None if value != value else "inf" if value == np.inf else value


def _json_record(record: Any) -> dict[str, Any]:
    return {k: _json_number(v) if isinstance(v, float) else v for k, v in vars(record).items()}


def _json_test(m: TestFit) -> dict[str, Any]:
    outputs = [{**_json_record(o), "errors": _json_record(o.errors)} for o in m.outputs]
    return {**_json_record(m), "outputs": outputs, "rupture": None if m.rupture is None else _json_record(m.rupture)}


def _json_settings(s: IdentificationSettings) -> dict[str, Any]:
    nuisances = [{**_json_record(n), "bounds": [v if np.isfinite(v) else None for v in n.bounds]} for n in s.nuisances]
    return {**vars(s), "nuisances": nuisances, "weights": s.weights if isinstance(s.weights, str) else dict(s.weights)}


def save_identification(fit: Identification, path: Path) -> Path:
    """Write the identification; the file is whole or absent."""
    return write_text_atomically(json.dumps(identification_to_json(fit), indent=1, allow_nan=False) + "\n", path)


def load_identification(path: str | Path) -> Identification:
    """Read an identification; its law is rebuilt from data and its fingerprint checked."""
    path = Path(path)
    try:
        if path.stat().st_size > MAXIMUM_BYTES:
            raise FitError(f"{path}: larger than {MAXIMUM_BYTES // 1_000_000} MB, which no identification is")
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise FitError(f"{path}: cannot be read ({error.strerror})") from None
    except (UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
        where = f", line {error.lineno}" if isinstance(error, json.JSONDecodeError) else ""
        raise FitError(f"{path}{where}: not JSON text; give a file that Identification.save wrote") from None
    return identification_from_json(data, str(path))


def identification_from_json(data: Any, source: str = "identification") -> Identification:
    """Rebuild an identification from JSON data, or say in one sentence what is wrong with it."""
    if isinstance(data, dict) and data.get("kind") == KIND and data.get("version") in range(1, VERSION):
        old = data["version"]
        raise FitError(f"{source}: written by an earlier creepkit, in version {old} of the format; identify again")
    try:
        document = IdentificationSchema.model_validate(data)
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
        reference=ReferencePoint(**document.reference.model_dump()),
        noise_model=_read_noise_model(document.noise_model),
        rms=float("nan") if document.rms is None else document.rms,
        log_likelihood=document.log_likelihood,
        effective_frames=document.effective_frames,
        freedom=document.freedom,
        tests=tuple(_read_test(t) for t in document.tests),
        ranges=document.ranges,
        settings=_read_settings(document.settings),
        provenance=document.provenance,
        errors={name: _read_errors(e) for name, e in document.errors.items()},
        nuisances=tuple(
            NuisanceEstimate(**{**n.model_dump(), "spread": float(n.prior_sd)}) for n in document.nuisances
        ),
        converged=document.converged,
        notes=tuple(document.notes),
        sparsity=None if document.sparsity is None else _read_sparsity(document.sparsity),
    )


def _read_sparsity(part: SparsitySchema) -> Sparsity:
    values = part.model_dump()
    for name in ("whole", "reduced"):
        errors_by_output = getattr(part, name).errors
        values[name]["errors"] = {k: vars(_read_errors(e)) for k, e in errors_by_output.items()}
    return Sparsity.from_dict(values)


def _read_noise_model(s: NoiseModelSchema) -> NoiseModel:
    return NoiseModel({name: OutputNoise(**sizes.model_dump()) for name, sizes in s.outputs.items()}, s.rate)


def _read_settings(s: SettingsSchema) -> IdentificationSettings:
    nuisances = tuple(
        Nuisance(n.kind, n.scope, n.output, n.mean, None if n.sd is None else float(n.sd), _infinite_bounds(n.bounds))
        for n in s.nuisances
    )
    return IdentificationSettings(**{**s.model_dump(), "nuisances": nuisances})


def _infinite_bounds(bounds: tuple[float | None, float | None]) -> tuple[float, float]:
    return (-np.inf if bounds[0] is None else bounds[0]), (np.inf if bounds[1] is None else bounds[1])


def _read_test(t: TestFitSchema) -> TestFit:
    rms, bias = (float("nan") if v is None else v for v in (t.log_strain_rms, t.log_strain_bias))
    outputs = tuple(OutputFit(o.output, _read_errors(o.errors), o.offset, o.noise) for o in t.outputs)
    rupture = None if t.rupture is None else _read_rupture(t.rupture)
    return TestFit(t.name, t.condition, t.frames, rms, bias, t.rate_factor, t.weight, outputs, rupture)


def _read_rupture(r: RuptureSchema) -> RuptureComparison:
    return RuptureComparison(r.measured, r.censored, float(r.predicted), float(r.low), float(r.high))


def _read_errors(e: OutputErrorsSchema) -> OutputErrors:
    numbers = [
        float("nan") if v is None else v
        for v in (
            e.relative_squared_error,
            e.mean_squared_error,
            e.mean_absolute_error,
            e.relative_rms_error,
            e.chi_square,
        )
    ]
    return OutputErrors(e.frames, *numbers)
