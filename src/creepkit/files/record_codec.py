"""Frozen records to JSON-able data and back, validated by pydantic; nothing is evaluated.

A record is an object with a key for each field; a tuple or an array is a list; a mapping is an object; a member of an
enumeration is its name. NaN is null, infinities are "inf" and "-inf". What is read must fit the annotations, from
which a strict schema is made: unknown keys, missing keys and values of another type are errors that name their place,
such as `tests.0.outputs.1.noise`.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, Field, dataclass, field, fields, is_dataclass, replace
from functools import partial
from types import GenericAlias, NoneType, UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np
from pydantic import ConfigDict, GetPydanticSchema, TypeAdapter, ValidationError
from pydantic_core import CoreConfig, CoreSchema, PydanticCustomError
from pydantic_core import core_schema as schemas
from pydantic_core.core_schema import no_info_plain_validator_function as plain

from creepkit.errors import CreepkitError, printable, quoted, steering
from creepkit.files.json_documents import check_keys
from creepkit.limits import FINITE, Limits

Record = TypeVar("Record")

_ALLOWED = {"bool_type": "true or false", "dict_type": "an object", "list_type": "a list", "string_type": "a text"}


def misfit(message: str) -> PydanticCustomError:
    """What a validator raises; its message stands behind the place."""
    return PydanticCustomError("misfit", message.encode(errors="backslashreplace").decode())


def unknown_type(hint: Any, data: Any) -> Any:
    """Refuse whatever stands in a field whose annotation no schema is known for."""
    raise misfit(f" {shown(data)}, where nothing is known of {hint}")


def foreign_value(from_json: Callable[[Any, str], Any], data: Any) -> Any:
    """What the codec of a type that is no record reads."""
    try:
        return from_json(data, "")
    except CreepkitError as error:
        raise misfit(": " + str(error).removeprefix(": ")) from None


def number(kind: type[float], limits: Limits, data: Any) -> float:
    """A number; null is NaN, and "inf" infinity, where numbers need not be whole."""
    special = {None: math.nan, "inf": math.inf, "-inf": -math.inf}
    value: Any = special.get(data, data) if kind is float and (data is None or type(data) is str) else data
    if type(value) not in (int, kind) or value not in limits:
        raise misfit(f" {shown(data)}; allowed is {limits if kind is float else replace(limits, whole=True)}")
    return kind(value)


def kept_text(text: str) -> str:
    """A text as files hold it: what must not reach a terminal as its code, so that the file can be read again."""
    return "".join(one if one in "\n\r\t" else printable(one) for one in text) if steering(text) else text


def shown_text(text: str) -> str:
    """A text that may be shown on a terminal."""
    if found := steering(text):
        raise misfit(f" holds the character U+{ord(found):04X}, which cannot be printed; remove it from the text")
    return text


def as_tuple(length: int | None, data: Any) -> tuple[Any, ...]:
    """A list of a length as a tuple; None stands for any."""
    if not isinstance(data, list):
        raise misfit(f" {shown(data)}; allowed is a list")
    if length not in (None, len(data)):
        raise misfit(f" is a list of {len(data)}; allowed is one of {length}")
    return tuple(data)


def built_record(record: type[Record], names: tuple[str, ...], data: Any, read: Callable[[Any], Any]) -> Record:
    """A record from an object, by `read` of its values."""
    if not isinstance(data, dict):
        raise misfit(f" {shown(data)}; allowed is an object")
    if problem := check_keys(data, names, "", optional=True):
        raise misfit(problem)
    values = read(data)
    try:
        return record(**values)
    except CreepkitError as error:
        raise misfit(f": {error}") from None
    except (ValueError, TypeError, ArithmeticError, IndexError, KeyError) as error:
        raise misfit(f" is no {record.__name__} ({quoted(' '.join(str(error).split()), 200)})") from None


def sentence(error: ValidationError, place: str) -> str:
    """The first problem, with its place."""
    first = error.errors(include_url=False)[0]
    kind, found = first["type"], shown(first["input"])
    steps = [quoted(step, 40) for step in first["loc"] if not str(step).startswith("|")]
    missing = steps.pop() if kind == "missing" else ""
    where = ".".join([place, *steps]).strip(".") or "the document"
    if kind == "misfit":
        return where + first["msg"]
    if kind == "missing":
        return f"{where}: '{missing}' is missing"
    if kind.startswith("union_tag"):
        return f"{where} {found}, which is none of its kinds"
    allowed = first["ctx"]["expected"] if kind == "literal_error" else _ALLOWED.get(kind, "")
    return f"{where} {found}" + (f"; allowed is {allowed}" if allowed else f", {first['msg']}")


def shown(data: Any) -> str:
    """What was found, in a few words."""
    if isinstance(data, dict | list):
        return "is an object" if isinstance(data, dict) else "is a list"
    return "is null" if data is None else f"is {quoted(repr(data), 57)}"


class RecordError(CreepkitError):
    """Data do not fit a record; readers of files raise their own error with this message."""


@dataclass(frozen=True)
class ValueCodec:
    """How values of one type that is no record are held: both ways as functions, which may raise CreepkitError."""

    to_json: Callable[[Any], Any]
    from_json: Callable[[Any, str], Any]
    """(data, source) -> value; the source is empty, since the place of an error is put before its message."""


@dataclass(frozen=True)
class RecordCodec:
    """How records of some classes are written and read.

    omitted : {class: fields} that are not stored; they take their defaults when a record is read. `object` stands for
        every class.
    ranges : {class: {field: numbers that may stand there}}, "*" for its other fields; by default those that are finite.
        Of a field that holds several numbers it holds for each. values : {type: codec} of what is no record: a law.
    names : {name: type} of annotations that a module imports for type checkers alone. default_range : of fields that
        `ranges` does not name.
    """

    omitted: Mapping[type, tuple[str, ...]] = field(default_factory=dict)
    ranges: Mapping[type, Mapping[str, Limits]] = field(default_factory=dict)
    values: Mapping[type, ValueCodec] = field(default_factory=dict)
    names: Mapping[str, Any] = field(default_factory=dict)
    default_range: Limits = FINITE
    _adapters: dict[Any, TypeAdapter[Any]] = field(default_factory=dict, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        for record, names in (*self.omitted.items(), *self.ranges.items()):
            if is_dataclass(record) and (unknown := set(names) - {"*", *(f.name for f in fields(record))}):
                raise TypeError(f"{record.__name__} has no field {', '.join(sorted(unknown))}")

    def to_json(self, value: Any, place: str = "the record") -> Any:
        """JSON-able data of a record, or of anything that its fields may hold; RecordError for anything else."""
        for kind, codec in self.values.items():
            if isinstance(value, kind):
                return codec.to_json(value)
        if isinstance(value, enum.Enum):
            return value.name
        if isinstance(value, str):
            return kept_text(value)
        if value is None or isinstance(value, bool | int):
            return value
        if isinstance(value, float | np.floating):
            return float(value) if math.isfinite(value) else None if math.isnan(value) else str(float(value))
        if isinstance(value, np.ndarray | np.generic):
            return self.to_json(value.tolist(), place)
        if isinstance(value, Mapping):
            return {_key(key): self.to_json(item, f"{place}.{key}") for key, item in value.items()}
        if isinstance(value, tuple | list):
            return [self.to_json(item, f"{place}.{k}") for k, item in enumerate(value)]
        if is_dataclass(value) and not isinstance(value, type):
            stored = self._stored_fields(type(value))
            return {f.name: self.to_json(getattr(value, f.name), f"{place}.{f.name}") for f in stored}
        raise RecordError(f"{place} is a {type(value).__name__}, which cannot be stored")

    def from_json(self, record: type[Record], data: Any, place: str = "") -> Record:
        """The record that `to_json` wrote; RecordError, in one sentence with its place, for any other data."""
        result: Record = self._read(record, self.default_range, data, place)
        return result

    def updated(self, template: Record, data: Any, place: str = "") -> Record:
        """A record like `template` with the fields that `data` names, those of records within records likewise."""
        record: Any = type(template)
        values = {f.name: getattr(template, f.name) for f in fields(record) if f.init}
        try:
            hints = self._hints(record)
        except NameError:  # a plugin's record, some of whose annotations only type checkers can follow
            hints = dict.fromkeys(values, Any)

        def value(name: str, item: Any) -> Any:
            inner, current = f"{place}.{name}".lstrip("."), values[name]
            if is_dataclass(current) and isinstance(item, dict):
                return self.updated(current, item, inner)
            found = self._read(hints[name], self._range(record, name), item, inner)
            return _tuples(found) if isinstance(current, tuple) else found

        names = tuple(f.name for f in self._stored_fields(record))
        try:
            result: Record = built_record(record, names, data, lambda _: values | {k: value(k, data[k]) for k in data})
            return result
        except PydanticCustomError as error:
            raise RecordError((place or "the document") + error.message()) from None

    def _read(self, hint: Any, allowed: Limits, data: Any, place: str) -> Any:
        try:
            return self._adapter(hint, allowed).validate_python(data)
        except ValidationError as error:
            raise RecordError(sentence(error, place)) from None

    def _adapter(self, hint: Any, allowed: Limits) -> TypeAdapter[Any]:
        """What validates data of values with an annotation; made when the first is read."""
        if (hint, allowed) not in self._adapters:
            schema = GetPydanticSchema(lambda *_: self._schema(hint, allowed))
            config = ConfigDict(strict=True, extra="forbid")
            self._adapters[hint, allowed] = TypeAdapter(Annotated[Any, schema], config=config)
        return self._adapters[hint, allowed]

    def _schema(self, hint: Any, allowed: Limits) -> CoreSchema:
        """The schema of what JSON holds of values with an annotation."""
        hint = _without_alias(hint)
        origin, arguments = get_origin(hint), get_args(hint)
        if hint in self.values:
            return plain(partial(foreign_value, self.values[hint].from_json))
        if hint in (float, int):
            return plain(partial(number, hint, allowed))
        if hint in _SCHEMAS:
            return _SCHEMAS[hint]
        if origin in (Union, UnionType):
            kinds = {_json_kind(kind): self._schema(kind, allowed) for kind in arguments if kind is not NoneType}
            tags = {"|int": "|float", **{tag: tag for tag in kinds}}
            union = schemas.tagged_union_schema(kinds, lambda data: tags.get(f"|{type(data).__name__}"))
            kind = union if len(kinds) > 1 else next(iter(kinds.values()))
            return schemas.nullable_schema(kind) if NoneType in arguments else kind
        if origin is Literal:
            return schemas.literal_schema(list(arguments))
        if _is_a(hint, enum.Enum):
            names = schemas.literal_schema(list(hint.__members__))
            return schemas.no_info_after_validator_function(hint.__getitem__, names)
        if _is_a(hint, tuple):  # with named parts
            parts = self._schema(GenericAlias(tuple, tuple(get_type_hints(hint).values())), allowed)
            return schemas.no_info_after_validator_function(hint._make, parts)
        if _is_a(origin, np.ndarray):
            return plain(partial(self._array, np.dtype(get_args(arguments[1])[0]), allowed))
        if _is_a(origin, Mapping):
            table = schemas.dict_schema(_TEXT, self._schema(arguments[1], allowed))
            pairs = get_origin(arguments[0]) is tuple
            return schemas.no_info_after_validator_function(_with_pairs, table) if pairs else table
        if _is_a(origin, Sequence):
            items = [self._schema(part, allowed) for part in arguments if part is not ...]
            if origin is list:
                return schemas.list_schema(items[0], fail_fast=True)
            length = None if origin is not tuple or arguments[-1] is ... else len(items)
            values = schemas.tuple_schema(items, variadic_item_index=0 if length is None else None, fail_fast=True)
            return schemas.no_info_before_validator_function(partial(as_tuple, length), values)
        if is_dataclass(hint) and isinstance(hint, type):
            return self._record_schema(hint)
        return plain(partial(unknown_type, hint))

    def _record_schema(self, record: type[Any]) -> CoreSchema:
        hints, keys = self._hints(record), {}
        for f in self._stored_fields(record):
            required = f.default is MISSING and f.default_factory is MISSING
            value = self._schema(hints[f.name], self._range(record, f.name))
            keys[f.name] = schemas.typed_dict_field(value, required=required)
        data = schemas.typed_dict_schema(keys, config=CoreConfig(strict=True, extra_fields_behavior="forbid"))
        return schemas.no_info_wrap_validator_function(partial(built_record, record, tuple(keys)), data)

    def _array(self, kind: np.dtype[Any], allowed: Limits, data: Any) -> Any:
        """An array from lists, as deep within one another as the first of them are."""
        hint, first = GenericAlias(list, ({"f": float, "b": bool}.get(kind.kind, int),)), data
        for _ in range(_MAX_DIMENSIONS - 1):
            first = first[0] if isinstance(first, list) and first else None
            hint = GenericAlias(list, (hint,)) if isinstance(first, list) else hint
        values = self._adapter(hint, allowed).validate_python(data)
        try:
            return np.array(values, dtype=kind)
        except (ValueError, OverflowError):
            raise misfit(" holds lists of different lengths; allowed is an array") from None

    def _stored_fields(self, record: type) -> list[Field[Any]]:
        omitted = {name for kind, names in self.omitted.items() if issubclass(record, kind) for name in names}
        return [f for f in fields(record) if f.init and f.name not in omitted]

    def _hints(self, record: type) -> dict[str, Any]:
        return get_type_hints(record, localns=dict(self.names))

    def _range(self, record: type, name: str) -> Limits:
        tables = (table for kind, table in self.ranges.items() if issubclass(record, kind))
        return next((table[key] for table in tables for key in (name, "*") if key in table), self.default_range)


_MAX_DIMENSIONS = 8
_SCHEMAS: dict[Any, CoreSchema] = dict.fromkeys((Any, object), schemas.any_schema())
_TEXT = schemas.no_info_after_validator_function(shown_text, schemas.str_schema())
_SCHEMAS |= {bool: schemas.bool_schema(), str: _TEXT}


def _without_alias(hint: Any) -> Any:
    """What an alias of a type stands for, with its arguments: newer releases of NumPy define NDArray as one."""
    alias = get_origin(hint)
    return alias.__value__[get_args(hint)] if hasattr(alias, "__value__") else getattr(hint, "__value__", hint)


def _json_kind(hint: Any) -> str:
    """The name of the type that values with an annotation have in JSON, behind a bar."""
    hint = _without_alias(hint)
    if hint is str or get_origin(hint) is Literal or _is_a(hint, enum.Enum):
        return "|str"
    if _is_a(hint, bool | int | float):
        return f"|{hint.__name__}"
    return "|list" if _is_a(hint, tuple) or _is_a(get_origin(hint), (Sequence, np.ndarray)) else "|dict"


def _is_a(hint: Any, kinds: Any) -> bool:
    return isinstance(hint, type) and issubclass(hint, kinds)


def _key(key: Any) -> str:
    """A key of a mapping as JSON has it; names of a pair, such as two outputs, stand on both sides of a bar."""
    return "|".join(key) if isinstance(key, tuple) else str(key)


def _with_pairs(table: Mapping[str, Any]) -> Any:
    return {tuple(key.split("|")): value for key, value in table.items()}


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


def record_to_json(value: Any) -> Any:
    """JSON-able data of any record without laws in it, as `--json` and notes of what was done show it."""
    return RecordCodec().to_json(value)
