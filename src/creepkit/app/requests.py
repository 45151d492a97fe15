"""What a page may ask of its server: strict models of JSON, numbers within limits, names but no paths."""

from __future__ import annotations

import json
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from creepkit.errors import CreepkitError, quoted
from creepkit.limits import HOTTEST

LARGEST_NUMBER = 1e60
"""In size; coefficients of laws reach 1e-40."""


Number = Annotated[float, Field(ge=-LARGEST_NUMBER, le=LARGEST_NUMBER, allow_inf_nan=False)]
Positive = Annotated[float, Field(ge=1.0 / LARGEST_NUMBER, le=LARGEST_NUMBER, allow_inf_nan=False)]
Name = Annotated[str, Field(min_length=1, max_length=100)]
Index = Annotated[int, Field(ge=0, le=10_000)]


class RequestError(CreepkitError):
    """A request that the server refuses; its message is one sentence for whoever wrote it."""


class _Strict(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


class ProgramRequest(_Strict):
    """A planned test: one load by steps, (start in s, value in its unit) each.

    control : of a stress. ramp : s, in which each value is reached. end : s. temperature : K. modulus : MPa.
    lengths : {dimension: mm} of the test piece.
    """

    specimen: Name
    load: Name
    steps: Annotated[list[tuple[Number, Number]], Field(min_length=1, max_length=50)]
    control: Literal["load", "stress"] = "load"
    ramp: Annotated[float, Field(ge=0.0, le=1e12)] = 0.0
    end: Positive
    temperature: Annotated[float, Field(gt=0.0, lt=HOTTEST)]
    modulus: Annotated[float, Field(gt=0.0, le=1e8)] | None = None
    lengths: Annotated[dict[Name, Positive], Field(max_length=50)] = Field(default_factory=dict)


class PredictRequest(_Strict):
    """Predict a planned test, measured tests, and the creep rate over stress, by one law with values.

    client, number : of the page and of its request; one with a smaller number than the latest of a page is dropped.
    law, tests : positions in the page's lists. values : {parameter: value}. exact : by the specimens themselves, not
    by their reduced-order models.
    """

    client: Annotated[str, Field(pattern=r"^[0-9a-f]{8,32}$")]
    number: Annotated[int, Field(ge=0, le=2**52)]
    law: Index
    values: Annotated[dict[Name, Number], Field(max_length=200)]
    program: ProgramRequest | None = None
    tests: Annotated[list[Index], Field(max_length=200)] = Field(default_factory=list)
    rate_temperature: Annotated[float, Field(gt=0.0, lt=HOTTEST)] | None = None
    exact: bool = False


def read_request(body: bytes) -> PredictRequest:
    """The request of a body of JSON; RequestError, in one sentence, for anything else."""
    try:
        data = json.loads(body.decode("utf-8"), parse_constant=_no_constant)
    except (ValueError, RecursionError) as error:
        raise RequestError(f"the request is no JSON in UTF-8: {' '.join(str(error).split())[:120]}") from None
    try:
        # of JSON, so that a list may stand for a pair, and still strict: "5" is no number
        return PredictRequest.model_validate_json(json.dumps(data))
    except (ValidationError, ValueError, RecursionError) as error:
        raise RequestError(_first_problem(error)) from None


def _no_constant(name: str) -> Any:
    raise ValueError(f"{name} is no number of JSON")


def _first_problem(error: Exception) -> str:
    """The first problem of a request, in one sentence."""
    if not isinstance(error, ValidationError):
        return "the request cannot be understood"
    first = error.errors(include_url=False, include_input=False, include_context=False)[0]
    place = quoted(".".join(str(part) for part in first["loc"]), 80) or "the request"
    return f"{place}: {quoted(first['msg'], 200)}"
