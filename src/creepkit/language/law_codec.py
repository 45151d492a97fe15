"""Laws as JSON and back: a file is validated against models, rebuilt node by node, and its fingerprint compared."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any, Literal, TypeVar

import sympy
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from creepkit.errors import LawError
from creepkit.language.expression_trees import condition_from_tree, expression_from_tree, expression_to_tree
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT_VARIABLES, Param, ParameterScale, State

__all__ = [
    "LAW_FORMAT",
    "LAW_FORMAT_VERSION",
    "condition_from_tree",
    "expression_from_tree",
    "expression_to_tree",
    "law_from_json",
    "law_to_json",
]


LAW_FORMAT = "creepkit-law"


LAW_FORMAT_VERSION = 1


_T = TypeVar("_T")


Number = Annotated[float, Field(allow_inf_nan=False)]


# ---- what a file may hold ------------------------------------------------------------------------------------------


class _StrictModel(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


class TermJson(_StrictModel):
    """One named term; `expression` is a tree."""

    name: str
    expression: Any


class ParamJson(_StrictModel):
    """One parameter of the table."""

    name: str
    meaning: str
    unit: str
    bounds: Annotated[list[Number], Field(min_length=2, max_length=2)]
    scale: ParameterScale
    off: Number | None
    limits: Annotated[list[Number | None], Field(min_length=2, max_length=2)] | None = None


class StateJson(_StrictModel):
    """One internal variable; `rate` is a tree."""

    name: str
    meaning: str
    unit: str
    initial: Number
    rate: Any
    limit: Number | None


class LawJson(_StrictModel):
    """A whole law."""

    format: Literal["creepkit-law"]
    version: Literal[1]
    name: str
    title: str
    fingerprint: str
    terms: list[TermJson]
    params: list[ParamJson]
    states: list[StateJson]
    constraints: list[Any]
    references: list[str]


# ---- writing -------------------------------------------------------------------------------------------------------


def law_to_json(law: CreepLaw) -> dict[str, Any]:
    """Return the law as a dictionary for json.dumps; `law_from_json` gives back an equal law."""
    return {
        "format": LAW_FORMAT,
        "version": LAW_FORMAT_VERSION,
        "name": law.name,
        "title": law.title,
        "fingerprint": law.fingerprint,
        "terms": [{"name": label, "expression": expression_to_tree(term)} for label, term in law.terms.items()],
        "params": [_param_to_json(name, param) for name, param in law.table.items()],
        "states": [_state_to_json(symbol.name, state) for symbol, state in law.states.items()],
        "constraints": [expression_to_tree(relation) for relation in law.constraints],
        "references": list(law.references),
    }


def _param_to_json(name: str, param: Param) -> dict[str, Any]:
    """A parameter; limits only where there are some, and null for an infinite one."""
    limits = () if param.limits is None else param.limits
    description = {"limits": [limit if math.isfinite(limit) else None for limit in limits]} if limits else {}
    return {
        "name": name,
        "meaning": param.meaning,
        "unit": param.unit,
        "bounds": list(param.bounds),
        "scale": param.scale,
        "off": param.off,
        **description,
    }


def _state_to_json(name: str, state: State) -> dict[str, Any]:
    return {
        "name": name,
        "meaning": state.meaning,
        "unit": state.unit,
        "initial": state.initial,
        "rate": expression_to_tree(state.rate),
        "limit": state.limit,
    }


# ---- reading -------------------------------------------------------------------------------------------------------


def law_from_json(data: Any, source: str = "law file") -> CreepLaw:
    """Return the law that `law_to_json` wrote; LawError, naming `source`, when the data are anything else."""
    try:
        model = LawJson.model_validate(data)
    except ValidationError as error:
        raise LawError(f"{source}: {_validation_message(error)}") from None
    try:
        law = _law_of(model)
    except LawError as error:
        raise LawError(f"{source}: {error}") from None
    if law.fingerprint != model.fingerprint:
        raise LawError(
            f"{source}: the equations of law '{law.name}' have fingerprint {law.fingerprint} but the file says "
            f"'{model.fingerprint:.40}'; it was changed after it was written, write it again from the law"
        )
    return law


def _law_of(model: LawJson) -> CreepLaw:
    names = [param.name for param in model.params] + [state.name for state in model.states]
    _check_unique(names, "parameter or state")
    _check_unique([term.name for term in model.terms], "term")
    symbols = {symbol.name: symbol for symbol in (*POINT_VARIABLES, *(sympy.Symbol(name, real=True) for name in names))}
    return CreepLaw(
        name=model.name,
        title=model.title,
        terms={
            t.name: _with_location(f"term '{t.name}'", expression_from_tree, t.expression, symbols) for t in model.terms
        },
        params={symbols[p.name]: _param_of(p) for p in model.params},
        states={symbols[s.name]: _state_of(s, symbols) for s in model.states},
        constraints=tuple(_with_location("a constraint", condition_from_tree, c, symbols) for c in model.constraints),
        references=tuple(model.references),
    )


def _param_of(entry: ParamJson) -> Param:
    low, high = entry.bounds
    if entry.limits is None:
        return Param(entry.meaning, (low, high), entry.unit, entry.scale, entry.off)
    lower, upper = entry.limits
    limits = -math.inf if lower is None else lower, math.inf if upper is None else upper
    return Param(entry.meaning, (low, high), entry.unit, entry.scale, entry.off, limits)


def _state_of(entry: StateJson, symbols: Mapping[str, sympy.Symbol]) -> State:
    rate = _with_location(f"rate of state '{entry.name}'", expression_from_tree, entry.rate, symbols)
    return State(entry.initial, rate, entry.meaning, entry.unit, entry.limit)


def _with_location(location: str, read: Callable[[Any, Mapping[str, sympy.Symbol]], _T], tree: Any, symbols: Any) -> _T:
    try:
        return read(tree, symbols)
    except LawError as error:
        raise LawError(f"{location}: {error}") from None


def _check_unique(names: Sequence[str], kind: str) -> None:
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise LawError(f"the {kind} name '{repeated[0]}' is used twice")


def _validation_message(error: ValidationError) -> str:
    """The first thing that is wrong, as one sentence with its place."""
    first = error.errors(include_url=False, include_input=False)[0]
    location = ".".join(str(part) for part in first["loc"]) or "the whole"
    count_text = f" (and {error.error_count() - 1} more)" if error.error_count() > 1 else ""
    return (
        f"{location}: {first['msg'][:1].lower()}{first['msg'][1:]}{count_text}; this is not a law that creepkit wrote"
    )
