"""JSON, strictly: no repeated keys, no numbers that JSON does not know, limited size and depth."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from creepkit.errors import LONGEST_QUOTE, nearest, quoted
from creepkit.files.reading import FileKind, read_text
from creepkit.files.writing import write_text

MAXIMUM_DEPTH = 200
"""Lists and objects inside one another; the equations of laws are the deepest, with some 60."""


@dataclass(frozen=True)
class DocumentFormat:
    """A document with a format name and a version, such as the identification's.

    name, version : stand first in every document. kind : of the file that holds it.
    remedy : what to do about a document of an older version: "identify again".
    """

    name: str
    version: int
    kind: FileKind
    remedy: str

    @property
    def heading(self) -> dict[str, str | int]:
        """The two entries that stand first in every document."""
        return {"format": self.name, "version": self.version}


def json_text(data: Any) -> str:
    """JSON-able data as indented text; ValueError for NaN and infinities, which a codec must have replaced."""
    return json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def compact_json(data: Any, *, sort_keys: bool = False) -> str:
    """JSON-able data on one line, as the headers of binary files hold it."""
    return json.dumps(data, allow_nan=False, sort_keys=sort_keys)


def canonical_json(data: Any) -> bytes:
    """JSON-able data in one defined form, keys sorted: what fingerprints are made from."""
    return json.dumps(data, sort_keys=True).encode()


def as_read_back(data: Any) -> Any:
    """JSON-able data as a file would give them back, with lists for tuples."""
    return json.loads(json.dumps(data))


def write_json(data: Any, path: Path, kind: FileKind, *, force: bool = False, internal: bool = False) -> Path:
    """Write JSON-able data, whole or not at all; force, internal : as files.writing.write_text() takes them."""
    return write_text(json_text(data), path, kind.error, force=force, internal=internal)


def read_json(path: Path, kind: FileKind) -> Any:
    """The data of a JSON file; the error of `kind` says what is wrong with any other."""
    return parse_json(read_text(path, kind), str(path), kind)


def parse_json(text: str, source: str, kind: FileKind) -> Any:
    """The data of a JSON text; the error of `kind`, naming `source`, for any other text."""
    try:
        data = json.loads(text, object_pairs_hook=_unique_keys, parse_constant=_no_constant, parse_float=_finite_number)
        _check_depth(data)
    except json.JSONDecodeError as error:
        problem = f"{source}, line {error.lineno}: not JSON: {error.msg[:1].lower()}{error.msg[1:]}"
        raise kind.error(f"{problem}; {kind.advice}") from None
    except RecursionError:
        raise kind.error(f"{source}: lists nested too deep for {kind.noun}; {kind.advice}") from None
    except _JsonError as error:
        raise kind.error(f"{source}: {error}; {kind.advice}") from None
    except ValueError:  # Python limits the digits of an integer
        raise kind.error(f"{source}: an integer too long for {kind.noun}; {kind.advice}") from None
    return data


def check_heading(data: Any, source: str, document: DocumentFormat) -> dict[str, Any]:
    """The entries of a document below its heading; the error of its kind when it is no such document or version."""
    kind = document.kind
    if not isinstance(data, dict) or data.get("format") != document.name:
        name = data.get("format") if isinstance(data, dict) else None
        if other := OTHER_DOCUMENTS.get(str(name)):
            raise kind.error(f"{source}: this is {other[0]}, and not {kind.noun}; {other[1]}")
        raise kind.error(
            f"{source}: this is not {kind.noun} that creepkit wrote (format '{document.name}', version "
            f"{document.version}); {kind.advice}"
        )
    version = data.get("version")
    if type(version) is not int or version != document.version:
        newer = type(version) is int and version > document.version
        advice = f"written by a newer creepkit: update creepkit, or {document.remedy}" if newer else document.remedy
        raise kind.error(
            f"{source}: in version {quoted(repr(version))} of the format; this one reads version {document.version}: "
            f"{advice}"
        )
    return {key: value for key, value in data.items() if key not in ("format", "version")}


OTHER_DOCUMENTS = {
    "creepkit-ranking": ("a ranking", "'creepkit report', 'creepkit predict' and 'creepkit export' take it"),
    "creepkit-identification": (
        "an identification",
        "'creepkit report', 'creepkit predict' and 'creepkit export' take it",
    ),
    "creepkit-temperature-law": (
        "a law of temperature for other programs",
        "'creepkit discover' wrote law.tex and law.py beside it, and ck.discover gives the law",
    ),
    "creepkit-valued-law": ("an exported law with its values", "'creepkit export' takes it"),
    "creepkit-law": ("a law without values", "identify its values from tests"),
    "creepkit-rupture-assessment": ("a rupture assessment", "'creepkit report' takes it"),
    "creepkit-stage-result": (
        "what a stage of a study found, kept for its next run",
        "'creepkit run' of its study.toml writes the page, identifications are in the folder identified beside it, and "
        "'creepkit rupture TESTS --to FILE' writes an assessment",
    ),
}
"""{format: (what it is, what can be done with it)}, for whoever gives one document in the place of another."""


def check_keys(data: Mapping[str, Any], allowed: tuple[str, ...], place: str, *, optional: bool = False) -> str:
    """What is wrong with the keys of an object, in one clause: "" when they are those allowed, in any order.

    optional : whether keys may be missing.
    """
    for key in data:
        if key not in allowed:
            return f"{place}: unknown key '{quoted(key)}'; {nearest(str(key)[:LONGEST_QUOTE], allowed)}"
    missing = [key for key in allowed if key not in data]
    return f"{place}: '{missing[0]}' is missing" if missing and not optional else ""


class _JsonError(ValueError):
    """Text that Python takes for JSON, and JSON does not."""


def _unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result = dict(pairs)
    if len(result) < len(pairs):
        seen: set[str] = set()
        repeated = next(key for key, _ in pairs if key in seen or seen.add(key))  # type: ignore[func-returns-value]
        raise _JsonError(f"the key '{quoted(repeated)}' stands twice in one object")
    return result


def _no_constant(word: str) -> float:
    raise _JsonError(f"{word} is no number of JSON")


def _finite_number(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise _JsonError(f"the number {quoted(text, 40)} is too large")
    return value


def _check_depth(data: Any, depth: int = 1) -> None:
    """RecursionError beyond the largest depth, before what reads the data meets one."""
    if depth > MAXIMUM_DEPTH:
        raise RecursionError
    for item in data.values() if isinstance(data, dict) else data if isinstance(data, list) else ():
        if isinstance(item, dict | list):
            _check_depth(item, depth + 1)
