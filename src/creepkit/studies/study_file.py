"""Study files: TOML to a checked model; every mistake is one sentence with file and line, and the nearest valid key."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, get_args, get_origin

from pydantic import BaseModel, ValidationError

from creepkit.errors import CreepkitError, StudyError, nearest, quoted
from creepkit.files.reading import FileKind, read_text
from creepkit.studies.model import StudyModel
from creepkit.studies.toml_lines import KeyPath, key_lines, line_of

STUDY_FILE = FileKind(
    "a study file", StudyError, "give a study.toml, which 'creepkit init FOLDER' writes", maximum_bytes=1_000_000
)


MOST_PARTS, MOST_KEYS = 20, 20_000
"""Parts of one key, and keys of a file."""


LARGEST_WHOLE = 2**63
"""Whole numbers of TOML are below it."""


LARGE_NUMBER = "the number is too large; whole numbers have 18 digits at most"


_PART = r"""(?:[A-Za-z0-9_-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?<![A-Za-z0-9_-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{MOST_PARTS},}}")


SHOWN = 40
"""Signs of a value or a name that a message quotes."""


@dataclass(frozen=True)
class StudyFile:
    """A study file that was read: its path, its text, and what it says."""

    path: Path
    text: str
    model: StudyModel

    @cached_property
    def lines(self) -> Mapping[KeyPath, int]:
        """{path of a key: its line}."""
        return key_lines(self.text)

    def error(self, key: KeyPath, sentence: str) -> StudyError:
        """An error about what stands at a key."""
        return StudyError(f"{self.path}:{line_of(key, self.lines)}: {place_text(key)}: {sentence}")

    @contextmanager
    def at(self, *key: str | int) -> Iterator[None]:
        """Errors of what is done with the value of a key get its file, line and name in front."""
        try:
            yield
        except StudyError:
            raise
        except CreepkitError as error:
            raise self.error(key, str(error)) from None


def read_study_file(path: Path) -> StudyFile:
    """Read and check the layout of a study file; StudyError, in one sentence with the line, says what is wrong."""
    return parse_study(path, read_text(path, STUDY_FILE))


def parse_study(path: Path, text: str) -> StudyFile:
    """The study file of a text; path : its name, for messages."""
    _refuse_long_keys(path, text)
    try:
        data = tomllib.loads(text)
        lines = key_lines(text)
    except tomllib.TOMLDecodeError as error:
        raise StudyError(f"{path}:{_syntax_error(str(error), text)}") from None
    except ValueError:  # what int() says of thousands of digits
        found = re.search(r"[0-9_]{400}", text)
        line = 1 + text.count("\n", 0, found.start() if found else 0)
        raise StudyError(f"{path}:{line}: {LARGE_NUMBER}") from None
    except RecursionError:
        raise StudyError(f"{path}: lists or tables nested too deep for a study file; {STUDY_FILE.advice}") from None
    large = next(_large_numbers(data, ()), None)
    if large is not None:
        raise StudyError(f"{path}:{line_of(large, lines)}: {place_text(large)}: {LARGE_NUMBER}")
    try:
        model = StudyModel.model_validate(data)
    except ValidationError as error:
        raise StudyError(_sentence(path, error, lines)) from None
    if not model.data.files and not model.camera:
        raise StudyError(f"{path}:{_no_tests(data, lines)}")
    return StudyFile(path, text, model)


def _no_tests(data: Mapping[str, Any], lines: Mapping[KeyPath, int]) -> str:
    """What a study lacks that names neither files of tests nor cameras, with its line."""
    if "data" not in data:
        return f"1: the study has no 'data', which it needs; {EXAMPLES['data']}"
    if "files" not in data["data"]:
        return f"{line_of(('data',), lines)}: [data] has no 'files', which it needs; {EXAMPLES['files']}"
    return f"{line_of(('data', 'files'), lines)}: [data] files is [], and needs 1 or more entries"


def _refuse_long_keys(path: Path, text: str) -> None:
    """StudyError for keys whose reading would take minutes: of thousands of parts, or tens of thousands of them."""
    found = _LONG_KEY.search(text)
    if found is not None:
        line = 1 + text.count("\n", 0, found.start())
        raise StudyError(f"{path}:{line}: a key has more than {MOST_PARTS} parts; a study has keys of four at most")
    if text.count("=") > MOST_KEYS:
        raise StudyError(f"{path}: has more than {MOST_KEYS} keys, which a study file never has; {STUDY_FILE.advice}")


def _large_numbers(data: Any, key: KeyPath) -> Iterator[KeyPath]:
    """Keys of whole numbers beyond those of TOML."""
    if isinstance(data, int) and not -LARGEST_WHOLE <= data < LARGEST_WHOLE:
        yield key
    elif isinstance(data, dict | list):
        for name, value in data.items() if isinstance(data, dict) else enumerate(data):
            yield from _large_numbers(value, (*key, name))


def place_text(key: KeyPath) -> str:
    """A key as people write it: [forecast 2] end_h."""
    if not key:
        return "the study"
    words, numbers = [one for one in key if isinstance(one, str)], {}
    for k, one in enumerate(key):
        if isinstance(one, int):
            numbers[sum(isinstance(e, str) for e in key[:k]) - 1] = one
    shown = [f"{quoted(word, SHOWN)}{f' {numbers[k] + 1}' if k in numbers else ''}" for k, word in enumerate(words)]
    table = f"[{shown[0]}]"
    return table if len(shown) == 1 else f"{table} {'.'.join(shown[1:])}"


def _syntax_error(message: str, text: str) -> str:
    """Line and reason of an error of tomllib, which names the line at the end."""
    found = re.search(r" \(at line (\d+), column (\d+)\)$", message)
    line, column = (found[1], f", column {found[2]}") if found else (str(text.count("\n") + 1), "")
    twice = re.match(r"Cannot (?:declare|overwrite|mutate).*?\('([^']*)',\)", message)
    if twice and twice[1] in StudyModel.model_fields:
        several = _takes_several(twice[1])
        remedy = f"write [[{twice[1]}]] above each of them" if several else "put its keys under one heading"
        return f"{line}: [{twice[1]}] stands there twice; {remedy}"
    if not re.search(r"^\s*(?:\[|[\w\"'.-]+\s*=)", text, re.MULTILINE):
        return f"{line}: this is no study file, but looks like data; {STUDY_FILE.advice}"
    reason = re.sub(r" \(at .*\)$", "", message)
    reason = reason[:1].lower() + reason[1:]
    return f"{line}: this is not TOML: {quoted(reason, 120)}{column}; texts stand in quotes, and each key on a line"


# ---- what pydantic says, as a sentence -----------------------------------------------------------------------------


def _sentence(path: Path, error: ValidationError, lines: Mapping[KeyPath, int]) -> str:
    """The first mistake in the order of the file; first unknown keys, for they make others look missing."""
    found = error.errors(include_url=False)
    first = min(found, key=lambda one: (one["type"] != "extra_forbidden", line_of(_key(one), lines)))
    key = _key(first)
    more = len(found) - 1
    others = f" ({more} more mistake{'s' if more > 1 else ''} in the file)" if more else ""
    return f"{path}:{line_of(key, lines)}: {_problem(first, key)}{others}"


def _takes_several(table: str) -> bool:
    """Whether a study may have several tables of a name."""
    return get_origin(StudyModel.model_fields[table].annotation) is list


def _key(error: Any) -> KeyPath:
    """The path of a key in the file, without what pydantic adds for its own types."""
    return tuple(part for part in error["loc"] if part != "[key]")


def _problem(error: Any, key: KeyPath) -> str:
    kind, given, context = error["type"], error["input"], error.get("ctx", {})
    if kind == "extra_forbidden":
        table = key[:-1]
        known = known_keys(table)
        where = f"in {place_text(table)}" if table else "at the top of a study"
        what = f"[{quoted(key[-1], SHOWN)}]" if not table else f"key '{quoted(key[-1], SHOWN)}'"
        return f"unknown {'table ' if not table else ''}{what} {where}; {nearest(str(key[-1])[:SHOWN], known)}"
    if kind == "missing":
        table = key[:-1]
        example = f"; {EXAMPLES[str(key[-1])]}" if str(key[-1]) in EXAMPLES else ""
        return f"{place_text(table) if table else 'the study'} has no '{key[-1]}', which it needs{example}"
    if len(key) == 1 and kind == "list_type" and isinstance(given, dict):
        return f"[{key[0]}] may stand there several times; write it in two brackets, [[{key[0]}]]"
    if len(key) == 1 and kind in ("model_type", "model_attributes_type") and isinstance(given, list):
        return f"[[{key[0]}]] stands there once at most; write it in one bracket, [{key[0]}]"
    return f"{place_text(key)} is {_shown(given)}, and {_needed(kind, given, context, error)}"


EXAMPLES = {
    "data": 'add the table [data] with files = ["*.csv"], or a [[camera]] with frames = "frames"',
    "files": 'write files = ["*.csv"]',
    "frames": 'write frames = "folder of frames"',
    "file": 'write file = "record.csv"',
    "laws": 'write laws = ["norton"]',
    "reason": 'write reason = "why it is left out"',
    "target": 'write target = "latex"',
}


def _needed(kind: str, given: Any, context: Mapping[str, Any], error: Any) -> str:
    """What would be right in the place of what was found."""
    simple = {
        "string_type": "must be a text in quotes",
        "int_type": "must be a whole number",
        "int_from_float": "must be a whole number",
        "float_type": "must be a number",
        "finite_number": "must be a finite number",
        "bool_type": "must be true or false",
        "list_type": "must be a list, such as [1, 2]",
        "dict_type": "must be a table",
        "model_type": "must be a table",
        "model_attributes_type": "must be a table",
        "string_too_short": "must not be empty",
        "string_too_long": f"may have {context.get('max_length')} signs at most",
        "too_short": f"needs {context.get('min_length')} or more entries",
        "too_long": f"may have {context.get('max_length')} entries at most",
    }
    if kind in simple:
        return simple[kind]
    if kind == "literal_error":
        words = re.findall(r"'([^']*)'", str(context.get("expected", "")))
        return f"must be one of these: {', '.join(words)}"
    limits = {"greater_than": "above", "greater_than_equal": "at least", "less_than": "below"}
    limits["less_than_equal"] = "at most"
    if kind in limits:
        bound = next(value for name, value in context.items() if name in ("gt", "ge", "lt", "le"))
        return f"must be {limits[kind]} {bound:g}"
    return str(error["msg"])


def _shown(value: Any) -> str:
    text = {True: "true", False: "false"}[value] if isinstance(value, bool) else repr(value)
    return quoted(text, SHOWN)


def known_keys(table: Iterable[str | int]) -> list[str]:
    """Keys that a table of a study file may have."""
    model: Any = StudyModel
    named = False  # whether the next key is a name that the user chose
    for part in table:
        if isinstance(part, int) or named:
            named = named and isinstance(part, int)
            continue
        annotation = model.model_fields[part].annotation if part in model.model_fields else None
        model, named = next(_models_in(annotation), None), get_origin(annotation) is dict
        if model is None:
            return []
    return list(model.model_fields)


def _models_in(annotation: Any) -> Any:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for inner in get_args(annotation):
        yield from _models_in(inner)
