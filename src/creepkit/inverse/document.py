"""The format of identification files: what must stand in them, and nothing else may."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

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
