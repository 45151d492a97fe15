"""What pydantic calls to validate the data of records, and its errors as sentences."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeVar

from pydantic import ValidationError
from pydantic_core import PydanticCustomError

from creepkit.errors import CreepkitError, printable, quoted, steering
from creepkit.files.json_documents import check_keys

Record = TypeVar("Record")

_NEEDED = {"bool_type": "true or false", "dict_type": "an object", "list_type": "a list", "string_type": "a text"}


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


def number(kind: type[float], problem_of: Callable[[float], str], data: Any) -> float:
    """A number; null is NaN, and "inf" infinity, where numbers need not be whole."""
    special = {None: math.nan, "inf": math.inf, "-inf": -math.inf}
    value: Any = special.get(data, data) if kind is float and (data is None or type(data) is str) else data
    if type(value) not in (int, kind):
        raise misfit(f" {shown(data)}, where a {'' if kind is float else 'whole '}number is needed")
    try:
        problem = problem_of(float(value))
    except OverflowError:
        problem = "is a whole number too large"
    if problem:
        raise misfit(f" {problem}")
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
        raise misfit(f" {shown(data)}, where a list is needed")
    if length not in (None, len(data)):
        raise misfit(f" is a list of {len(data)}, where {length} are needed")
    return tuple(data)


def built_record(record: type[Record], names: tuple[str, ...], data: Any, read: Callable[[Any], Any]) -> Record:
    """A record from an object, by `read` of its values."""
    if not isinstance(data, dict):
        raise misfit(f" {shown(data)}, where an object is needed")
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
    if kind == "literal_error":
        return f"{where} {found}; allowed are {first['ctx']['expected'].replace(' or ', ', ')}"
    if kind.startswith("union_tag"):
        return f"{where} {found}, which is none of its kinds"
    return f"{where} {found}, " + (f"where {_NEEDED[kind]} is needed" if kind in _NEEDED else first["msg"])


def shown(data: Any) -> str:
    """What was found, in a few words."""
    if isinstance(data, dict | list):
        return "is an object" if isinstance(data, dict) else "is a list"
    return "is null" if data is None else f"is {quoted(repr(data), 57)}"
