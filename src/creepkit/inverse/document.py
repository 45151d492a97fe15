"""The format of identification files: what must stand in them, and nothing else may."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from creepkit.records.prediction import Kind

KIND = "creepkit identification"
VERSION = 4
"""Version 1 knew one output, strain, and no explicit nuisances; version 2 did not know how tests ended; version 3 had
exponents in the place of local exponents among its coordinates, and no sparsity."""


class Strict(BaseModel):
    """What no part of a file may have: unknown fields, or numbers without end."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class EstimatePart(Strict):
    """One parameter."""

    name: str
    value: float
    low: float
    high: float
    unit: str
    verdict: Literal["determined", "at its bound", "not determined"]


class ReferencePart(Strict):
    """The point of the coordinates."""

    stress: float = Field(gt=0)
    strain: float = Field(gt=0)
    time: float = Field(gt=0)
    temperature: float = Field(gt=0)


class OutputScatterPart(Strict):
    """Scatter of one output."""

    noise: float = Field(ge=0)
    misfit: float = Field(ge=0)
    offset: float = Field(ge=0)
    drift: float = Field(ge=0)
    reach: float = Field(gt=0)


class ScatterPart(Strict):
    """Scatter of all outputs, and of the rate."""

    rate: float = Field(ge=0)
    outputs: dict[str, OutputScatterPart]


class ErrorsPart(Strict):
    """Errors of one output."""

    frames: int = Field(ge=0)
    rse: float | None
    mse: float | None
    mae: float | None
    relative: float | None
    chi_square: float | None


class OutputPart(Strict):
    """One output of one test."""

    output: str
    errors: ErrorsPart
    offset: float
    noise: float = Field(ge=0)


class RupturePart(Strict):
    """The end of one test."""

    measured: float = Field(gt=0)
    stopped: bool
    predicted: float | Literal["inf"]
    low: float | Literal["inf"]
    high: float | Literal["inf"]


class TestPart(Strict):
    """One test."""

    name: str
    condition: str
    frames: int = Field(ge=0)
    rms: float | None
    bias: float | None
    rate_factor: float
    weight: float = Field(gt=0)
    outputs: list[OutputPart]
    rupture: RupturePart | None


class NuisancePart(Strict):
    """One nuisance, as it was asked for; bounds without end are null."""

    kind: Kind
    scope: Literal["test", "alloy", "all"]
    output: str
    mean: float
    sd: float | Literal["inf"] | None
    bounds: tuple[float | None, float | None]


class NuisanceEstimatePart(Strict):
    """What was found of one unknown."""

    kind: Kind
    scope: Literal["test", "alloy", "all"]
    member: str
    value: float
    sd: float = Field(ge=0)
    mean: float
    spread: float | Literal["inf"]


class SettingsPart(Strict):
    """What the run can be repeated from."""

    starts: int = Field(ge=1)
    draws: int = Field(ge=1)
    frames: int = Field(ge=2)
    seed: int
    loss: str
    nuisances: list[NuisancePart]
    weights: Literal["noise", "likelihood", "equal", "paper"] | dict[str, float]
    test_loss: str


class MisfitPart(Strict):
    """How well a sum, or what was left of it, fits."""

    chi_square: float
    parameters: int = Field(ge=0)
    bic: float
    errors: dict[str, ErrorsPart]


class SparsityPart(Strict):
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
    whole: MisfitPart
    reduced: MisfitPart
    frames: int = Field(ge=0)


class Document(Strict):
    """The file."""

    kind: Literal["creepkit identification"]
    version: Literal[4]
    law: dict[str, Any]
    estimates: list[EstimatePart]
    u: list[float]
    covariance: list[list[float]]
    reference: ReferencePart
    scatter: ScatterPart
    rms: float | None
    log_likelihood: float
    size: float = Field(gt=0)
    freedom: float = Field(gt=0)
    tests: list[TestPart]
    errors: dict[str, ErrorsPart]
    nuisances: list[NuisanceEstimatePart]
    ranges: dict[str, tuple[float, float]]
    settings: SettingsPart
    provenance: dict[str, str | int | float | list[str]]
    converged: bool
    notes: list[str]
    sparsity: SparsityPart | None = None
