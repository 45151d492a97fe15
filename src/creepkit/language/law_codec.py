"""Laws as JSON and back: a document is checked field by field, rebuilt node by node, and its fingerprint compared."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import sympy

from creepkit.errors import SAID, LawError, quoted, restated
from creepkit.files.json_documents import DocumentFormat, check_heading
from creepkit.files.reading import FileKind
from creepkit.files.record_codec import RecordCodec, RecordError
from creepkit.language.expression_trees import condition_from_tree, expression_from_tree, expression_to_tree
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import POINT_VARIABLES, ConditionSymbol, Param, ParameterScale, State, StateKind, Symbol
from creepkit.limits import numbers

__all__ = ["LAW", "condition_from_tree", "expression_from_tree", "expression_to_tree", "law_from_json", "law_to_json"]


LAW = DocumentFormat(
    "creepkit-law",
    2,
    FileKind("a law", LawError, "give a law that creepkit wrote"),
    remedy="write it again from the law",
)


_T = TypeVar("_T")


# ---- what a document holds -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class TermDocument:
    """One named term; `expression` is a tree."""

    name: str
    expression: Any


@dataclass(frozen=True)
class ParamDocument:
    """One parameter of the table; limits may be infinite, None stands for no limits of its own."""

    name: str
    meaning: str
    unit: str
    bounds: tuple[float, float]
    scale: ParameterScale
    off: float | None
    limits: tuple[float, float] | None = None
    widens: bool = False


@dataclass(frozen=True)
class StateDocument:
    """One internal variable; `rate` is a tree."""

    name: str
    meaning: str
    unit: str
    initial: float
    rate: Any
    limit: float | None
    kind: StateKind = "scalar"


@dataclass(frozen=True)
class LawDocument:
    """A whole law; constraints are trees, conditions {name: unit}."""

    name: str
    title: str
    fingerprint: str
    terms: tuple[TermDocument, ...]
    params: tuple[ParamDocument, ...]
    states: tuple[StateDocument, ...]
    constraints: tuple[Any, ...]
    references: tuple[str, ...]
    conditions: dict[str, str] = field(default_factory=dict)


_CODEC = RecordCodec(ranges={ParamDocument: {"limits": numbers(infinite=True)}})


# ---- writing -------------------------------------------------------------------------------------------------------


def law_to_json(law: CreepLaw) -> dict[str, Any]:
    """Return the law as JSON-able data; `law_from_json` gives back an equal law."""
    record = LawDocument(
        name=law.name,
        title=law.title,
        fingerprint=law.fingerprint,
        terms=tuple(TermDocument(label, expression_to_tree(term)) for label, term in law.terms.items()),
        params=tuple(ParamDocument(name, **vars(param)) for name, param in law.table.items()),
        states=tuple(
            StateDocument(symbol.name, **{**vars(state), "rate": expression_to_tree(state.rate)})
            for symbol, state in law.states.items()
        ),
        constraints=tuple(expression_to_tree(relation) for relation in law.constraints),
        references=tuple(law.references),
        conditions={symbol.name: symbol.unit for symbol in law.conditions},
    )
    return {**LAW.heading, **_CODEC.to_json(record)}


# ---- reading -------------------------------------------------------------------------------------------------------


def law_from_json(data: Any, source: str = "law file") -> CreepLaw:
    """Return the law that `law_to_json` wrote; LawError, naming `source`, when the data are anything else."""
    content = check_heading(data, source, LAW)
    with restated(RecordError, LawError, f"{source}: {SAID}; this is not a law that creepkit wrote"):
        record = _CODEC.from_json(LawDocument, content)
    with restated(LawError, LawError, f"{source}: {SAID}"):
        law = _law_of(record)
    if law.fingerprint != record.fingerprint:
        raise LawError(
            f"{source}: the equations of law '{law.name}' have fingerprint {law.fingerprint} but the file says "
            f"'{quoted(record.fingerprint)}'; it was changed after it was written, write it again from the law"
        )
    return law


def _law_of(record: LawDocument) -> CreepLaw:
    names = [param.name for param in record.params] + [state.name for state in record.states]
    stated = {name: ConditionSymbol(name, unit) for name, unit in record.conditions.items()}
    _check_unique([*names, *stated], "parameter, state or condition")
    _check_unique([term.name for term in record.terms], "term")
    symbols = {symbol.name: symbol for symbol in (*POINT_VARIABLES, *(Symbol(name) for name in names))} | stated
    return CreepLaw(
        name=record.name,
        title=record.title,
        terms={
            t.name: _with_location(f"term '{t.name}'", expression_from_tree, t.expression, symbols)
            for t in record.terms
        },
        params={symbols[p.name]: Param(**_without_name(p)) for p in record.params},
        states={symbols[s.name]: _state_of(s, symbols) for s in record.states},
        constraints=tuple(_with_location("a constraint", condition_from_tree, c, symbols) for c in record.constraints),
        references=tuple(record.references),
    )


def _state_of(entry: StateDocument, symbols: Mapping[str, sympy.Symbol]) -> State:
    rate = _with_location(f"rate of state '{entry.name}'", expression_from_tree, entry.rate, symbols)
    return State(**{**_without_name(entry), "rate": rate})


def _without_name(entry: ParamDocument | StateDocument) -> dict[str, Any]:
    return {name: value for name, value in vars(entry).items() if name != "name"}


def _with_location(location: str, read: Callable[[Any, Mapping[str, sympy.Symbol]], _T], tree: Any, symbols: Any) -> _T:
    with restated(LawError, LawError, f"{location}: {SAID}"):
        return read(tree, symbols)


def _check_unique(names: Sequence[str], kind: str) -> None:
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise LawError(f"the {kind} name '{repeated[0]}' is used twice")
