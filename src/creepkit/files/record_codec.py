"""Frozen records to JSON-able data and back, by their fields and annotations; nothing is evaluated.

A record is an object with a key for each field; a tuple or an array is a list; a mapping is an object; a member of an
enumeration is its name. NaN is null, infinities are "inf" and "-inf". What is read must fit the annotations: unknown
keys, missing keys and values of another type are errors that name their place, such as `tests.0.outputs.1.noise`.
"""

from __future__ import annotations

import enum
import math
import types
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, Field, dataclass, field, fields, is_dataclass
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

from creepkit.errors import CreepkitError
from creepkit.files.json_documents import check_keys

Record = TypeVar("Record")


class RecordError(CreepkitError):
    """Data do not fit a record; readers of files raise their own error with this message."""


@dataclass(frozen=True)
class NumberRange:
    """Which numbers a field may have.

    low, high : bounds, both allowed unless `open_low`, with which low itself is not. nan, infinite : whether NaN, and
    an infinity within the bounds, may stand there.
    """

    low: float = -math.inf
    high: float = math.inf
    open_low: bool = False
    nan: bool = False
    infinite: bool = False

    def problem(self, value: float) -> str:
        """What is wrong with a number, in a few words; "" when nothing is."""
        if math.isnan(value):
            return "" if self.nan else "is null, where a number is needed"
        if math.isinf(value) and not self.infinite:
            return f"is {value}, where a finite number is needed"
        if value < self.low or (self.open_low and value == self.low):
            return f"is {value:g}, which must be {'above' if self.open_low else 'at least'} {self.low:g}"
        return f"is {value:g}, which must be at most {self.high:g}" if value > self.high else ""


FINITE = NumberRange()


ANY_NUMBER = NumberRange(nan=True, infinite=True)


@dataclass(frozen=True)
class ValueCodec:
    """How values of one type that is no record are held: both ways as functions, which may raise CreepkitError."""

    to_json: Callable[[Any], Any]
    from_json: Callable[[Any, str], Any]
    """(data, place) -> value."""


@dataclass(frozen=True)
class RecordCodec:
    """How records of some classes are written and read.

    omitted : {class: fields} that are not stored; they take their defaults when a record is read. `object` stands for
        every class.
    ranges : {class: {field: numbers that may stand there}}; by default those that are finite. Of a field that holds
        several numbers it holds for each. values : {type: codec} of what is no record, such as a law.
    names : {name: type} of annotations that a module imports for type checkers alone. default_range : of fields that
        `ranges` does not name.
    """

    omitted: Mapping[type, tuple[str, ...]] = field(default_factory=dict)
    ranges: Mapping[type, Mapping[str, NumberRange]] = field(default_factory=dict)
    values: Mapping[type, ValueCodec] = field(default_factory=dict)
    names: Mapping[str, Any] = field(default_factory=dict)
    default_range: NumberRange = FINITE

    def __post_init__(self) -> None:
        for table in (self.omitted, self.ranges):
            for record, names in table.items():
                unknown = set(names) - ({f.name for f in fields(record)} if is_dataclass(record) else set(names))
                if unknown:
                    raise TypeError(f"{record.__name__} has no field {', '.join(sorted(unknown))}")

    # ---- writing -------------------------------------------------------------------------------------------------

    def to_json(self, value: Any, place: str = "the record") -> Any:
        """JSON-able data of a record, or of anything that its fields may hold; RecordError for anything else."""
        codec = next((codec for kind, codec in self.values.items() if isinstance(value, kind)), None)
        if codec is not None:
            return codec.to_json(value)
        if isinstance(value, enum.Enum):
            return value.name
        if value is None or isinstance(value, bool | int | str):
            return value
        if isinstance(value, float | np.floating):
            return _number_to_json(float(value))
        if isinstance(value, np.ndarray | np.generic):
            return _numbers_to_json(value.tolist())
        if isinstance(value, Mapping):
            return {str(key): self.to_json(item, f"{place}.{key}") for key, item in value.items()}
        if isinstance(value, tuple | list):
            return [self.to_json(item, f"{place}.{k}") for k, item in enumerate(value)]
        if is_dataclass(value) and not isinstance(value, type):
            stored = self._stored_fields(type(value))
            return {f.name: self.to_json(getattr(value, f.name), f"{place}.{f.name}") for f in stored}
        raise RecordError(f"{place} is a {type(value).__name__}, which cannot be stored")

    # ---- reading -------------------------------------------------------------------------------------------------

    def from_json(self, record: type[Record], data: Any, place: str = "") -> Record:
        """The record that `to_json` wrote; RecordError, in one sentence with its place, for any other data."""
        stored = self._stored_fields(record)
        if not isinstance(data, dict):
            raise RecordError(f"{place or 'the document'} {_shown(data)}, where an object is needed")
        problem = check_keys(data, tuple(f.name for f in stored), place or "the document", optional=True)
        for f in stored:
            if not problem and f.name not in data and f.default is MISSING and f.default_factory is MISSING:
                problem = f"{place or 'the document'}: '{f.name}' is missing"
        if problem:
            raise RecordError(problem)
        return self._build(record, data, place)

    def updated(self, template: Record, data: Any, place: str = "") -> Record:
        """A record like `template` with the fields that `data` names, those of records within records likewise."""
        record: Any = type(template)
        if not isinstance(data, dict):
            raise RecordError(f"{place or 'the document'} {_shown(data)}, where an object is needed")
        stored = self._stored_fields(record)
        problem = check_keys(data, tuple(f.name for f in stored), place or "the document", optional=True)
        if problem:
            raise RecordError(problem)
        values = {f.name: getattr(template, f.name) for f in fields(record) if f.init}
        try:
            hints = self._hints(record)
        except NameError:  # a plugin's record, some of whose annotations only type checkers can follow
            hints = dict.fromkeys(values, Any)
        for name, item in data.items():
            inner, current = f"{place}.{name}".lstrip("."), values[name]
            if is_dataclass(current) and isinstance(item, dict):
                values[name] = self.updated(current, item, inner)
            else:
                value = self._value(hints[name], item, inner, self._range(record, name))
                values[name] = _tuples(value) if isinstance(current, tuple) else value
        result: Record = _construct(record, values, place)
        return result

    def _build(self, record: type[Record], data: Mapping[str, Any], place: str) -> Record:
        hints = self._hints(record)
        values = {
            name: self._value(hints[name], item, f"{place}.{name}".lstrip("."), self._range(record, name))
            for name, item in data.items()
        }
        return _construct(record, values, place)

    def _value(self, hint: Any, data: Any, place: str, allowed: NumberRange) -> Any:
        """The value of one field, or of a part of it."""
        origin, arguments = get_origin(hint), get_args(hint)
        if hint is Any or hint is object:
            return data
        if origin in (Union, types.UnionType):
            return self._value(_arm(arguments, data, place), data, place, allowed)
        if origin is Literal:
            if type(data) not in (str, int) or data not in arguments:
                allowed_words = ", ".join(map(repr, arguments))
                raise RecordError(f"{place} {_shown(data)}; allowed are {allowed_words}")
            return data
        if isinstance(origin, type) and issubclass(origin, np.ndarray):
            return _array(arguments[1], data, place, allowed)
        if isinstance(origin, type) and issubclass(origin, Mapping):
            if not isinstance(data, dict):
                raise RecordError(f"{place} {_shown(data)}, where an object is needed")
            return {
                key: self._value(arguments[1], item, f"{place}.{repr(key)[1:-1][:40]}", allowed)
                for key, item in data.items()
            }
        if isinstance(origin, type) and issubclass(origin, Sequence):
            values = self._sequence(arguments, data, place, allowed)
            return list(values) if origin is list else values
        return self._scalar(hint, data, place, allowed)

    def _sequence(self, hints: tuple[Any, ...], data: Any, place: str, allowed: NumberRange) -> tuple[Any, ...]:
        if not isinstance(data, list):
            raise RecordError(f"{place} {_shown(data)}, where a list is needed")
        if len(hints) == 1 or hints[-1] is Ellipsis:
            hints = (hints[0],) * len(data)
        if len(data) != len(hints):
            raise RecordError(f"{place} is a list of {len(data)}, where {len(hints)} are needed")
        pairs = enumerate(zip(hints, data, strict=True))
        return tuple(self._value(hint, item, f"{place}.{k}", allowed) for k, (hint, item) in pairs)

    def _scalar(self, hint: Any, data: Any, place: str, allowed: NumberRange) -> Any:
        if hint in self.values:
            try:
                return self.values[hint].from_json(data, place)
            except CreepkitError as error:
                raise RecordError(str(error)) from None
        if hint is None or hint is type(None):
            if data is not None:
                raise RecordError(f"{place} {_shown(data)}, where null is needed")
            return None
        if hint is float:
            return _number(data, place, allowed)
        if isinstance(hint, type) and issubclass(hint, enum.Enum):
            if not isinstance(data, str) or data not in hint.__members__:
                raise RecordError(f"{place} {_shown(data)}; allowed are {', '.join(hint.__members__)}")
            return hint[data]
        if hint in (bool, int, str):
            if type(data) is not hint:
                raise RecordError(f"{place} {_shown(data)}, where {_WORDS[hint]} is needed")
            if hint is int and (problem := allowed.problem(data)):
                raise RecordError(f"{place} {problem}")
            return data
        if _is_named_tuple(hint):
            return hint(*self._sequence(tuple(get_type_hints(hint).values()), data, place, allowed))
        if is_dataclass(hint) and isinstance(hint, type):
            return self.from_json(hint, data, place)
        raise RecordError(f"{place} cannot be read: nothing is known of {hint}")

    # ---- classes ---------------------------------------------------------------------------------------------------

    def _stored_fields(self, record: type) -> list[Field[Any]]:
        omitted = {name for kind, names in self.omitted.items() if issubclass(record, kind) for name in names}
        return [f for f in fields(record) if f.init and f.name not in omitted]

    def _hints(self, record: type) -> dict[str, Any]:
        return get_type_hints(record, localns=dict(self.names))

    def _range(self, record: type, name: str) -> NumberRange:
        return next(
            (r[name] for kind, r in self.ranges.items() if issubclass(record, kind) and name in r), self.default_range
        )


_WORDS = {bool: "true or false", int: "a whole number", str: "a text"}


_KINDS = {bool: (bool,), int: (int,), float: (int, float, type(None), str), str: (str,), type(None): (type(None),)}


def _arm(arguments: Sequence[Any], data: Any, place: str) -> Any:
    """The first alternative of a union that fits the kind of the data."""
    for hint in (type(None), *arguments):
        if hint in arguments and type(data) in _json_kinds(hint):
            return hint
    raise RecordError(f"{place} {_shown(data)}, which is none of its kinds")


def _json_kinds(hint: Any) -> tuple[type, ...]:
    origin = get_origin(hint)
    if hint in _KINDS:
        return _KINDS[hint]
    if origin is Literal:
        return tuple({type(word) for word in get_args(hint)})
    if isinstance(hint, type) and issubclass(hint, enum.Enum):
        return (str,)
    if _is_named_tuple(hint) or (isinstance(origin, type) and issubclass(origin, Sequence | np.ndarray)):
        return (list,)
    return (dict,)


def _is_named_tuple(hint: Any) -> bool:
    return isinstance(hint, type) and issubclass(hint, tuple) and hasattr(hint, "_fields")


def _number_to_json(value: float) -> float | str | None:
    if math.isfinite(value):
        return value
    return None if math.isnan(value) else "inf" if value > 0 else "-inf"


def _numbers_to_json(values: Any) -> Any:
    if isinstance(values, list):
        return [_numbers_to_json(item) for item in values]
    return _number_to_json(values) if isinstance(values, float) else values


def _number(data: Any, place: str, allowed: NumberRange) -> float:
    value = math.nan if data is None else {"inf": math.inf, "-inf": -math.inf}.get(data) if type(data) is str else data
    if type(value) not in (int, float):
        raise RecordError(f"{place} {_shown(data)}, where a number is needed")
    try:
        number = float(value)  # type: ignore[arg-type]
    except OverflowError:
        raise RecordError(f"{place} is a whole number too large") from None
    if problem := allowed.problem(number):
        raise RecordError(f"{place} {problem}")
    return number


def _array(dtype_hint: Any, data: Any, place: str, allowed: NumberRange) -> Any:
    """An array from nested lists of equal lengths."""
    kind = np.dtype(get_args(dtype_hint)[0])

    def checked(item: Any, where: str) -> Any:
        if isinstance(item, list):
            return [checked(part, f"{where}.{k}") for k, part in enumerate(item)]
        if kind.kind == "f":
            return _number(item, where, allowed)
        if type(item) is not (bool if kind.kind == "b" else int):
            raise RecordError(f"{where} {_shown(item)}, where {_WORDS[bool if kind.kind == 'b' else int]} is needed")
        return item

    if not isinstance(data, list):
        raise RecordError(f"{place} {_shown(data)}, where a list of numbers is needed")
    values = checked(data, place)
    try:
        return np.array(values, dtype=kind)
    except (ValueError, OverflowError):
        raise RecordError(f"{place} holds lists of different lengths, where an array is needed") from None


def _construct(record: type[Record], values: Mapping[str, Any], place: str) -> Record:
    try:
        return record(**values)
    except CreepkitError as error:
        raise RecordError(f"{place}: {error}" if place else str(error)) from None
    except (ValueError, TypeError, ArithmeticError, IndexError, KeyError) as error:
        reason = " ".join(str(error).split())
        raise RecordError(f"{place or 'the document'} is no {record.__name__} ({reason[:200]})") from None


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


def record_to_json(value: Any) -> Any:
    """JSON-able data of any record without laws in it, as `--json` and notes of what was done show it."""
    return RecordCodec().to_json(value)


def _shown(data: Any) -> str:
    """What was found, in a few words."""
    if isinstance(data, dict | list):
        return "is an object" if isinstance(data, dict) else "is a list"
    return "is null" if data is None else f"is {data!r}"[:60]
