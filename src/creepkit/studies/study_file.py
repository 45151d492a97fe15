"""Study files: TOML to checked tables; every mistake is one sentence with file and line, and the nearest valid key."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path, PurePosixPath
from typing import Any, get_args, get_origin

from pydantic import BaseModel, ValidationError

from creepkit.errors import CreepkitError, StudyError, nearest, quoted
from creepkit.files.reading import FileKind, read_text
from creepkit.studies.tables import StudyTables

STUDY_FILE = FileKind(
    "a study file", StudyError, "give a study.toml, which 'creepkit init FOLDER' writes", maximum_bytes=1_000_000
)


KeyPath = tuple[str | int, ...]
"""Keys from the top on; a number counts the tables of a list of tables, and the items of a list."""


SHOWN = 40
"""Signs of a value or a name that a message quotes."""


@dataclass(frozen=True)
class StudyFile:
    """A study file that was read: its path, its text, and what it says.

    root : folder of the data that a report carried, in which `..` is written `up`; None for those beside the file.
    """

    path: Path
    text: str
    model: StudyTables
    root: Path | None = None

    @cached_property
    def lines(self) -> Mapping[KeyPath, int]:
        """{path of a key: its line}."""
        return key_lines(self.text)

    def error(self, key: KeyPath, sentence: str) -> StudyError:
        """An error about what stands at a key."""
        return StudyError(f"{self.path}:{line_of(key, self.lines)}: {place_text(key)}: {sentence}")

    def check_name(self, key: KeyPath, noun: str, name: str | None, known: Collection[str]) -> None:
        """StudyError, with the nearest, for a name of what there is not; None is no name."""
        if name is not None and name not in known:
            raise self.error(key, f"there is no {noun} '{name}'; {nearest(name, known)}")

    @contextmanager
    def at(self, *key: str | int) -> Iterator[None]:
        """Errors of what is done with the value of a key get its file, line and name in front."""
        try:
            yield
        except StudyError:
            raise
        except CreepkitError as error:
            raise self.error(key, str(error)) from None

    # ---- files that it names -----------------------------------------------------------------------------------

    @property
    def base(self) -> Path:
        """The folder that paths are relative to."""
        return self.path.parent if self.root is None else self.root

    def place_of(self, key: KeyPath, text: str) -> PurePosixPath:
        """A path or pattern relative to the base; StudyError for one that is absolute, or of folders of any depth."""
        path = PurePosixPath(text.replace("\\", "/"))
        if path.is_absolute() or text.startswith("~") or re.match(r"^[A-Za-z]:", text):
            raise self.error(key, f"'{text}' is absolute; write it relative to the study file, such as data/*.csv")
        if "**" in path.parts:
            raise self.error(key, f"'{text}' goes through folders of any depth; name the folders")
        return path if self.root is None else PurePosixPath(carried_name(path))

    def paths(self, key: KeyPath, texts: Sequence[str]) -> list[Path]:
        """Existing files and folders of the patterns at a key; StudyError where there is none."""
        found: dict[Path, None] = {}
        for k, text in enumerate(texts):
            place = self.place_of((*key, k), text)
            try:
                path = self.base / place
                matches = [path] if path.exists() else sorted(self.base.glob(str(place)))
            except OSError as error:  # a folder that may not be entered, a name too long
                what = f"'{text}' cannot be read ({error.strerror}); check its name and who may read it"
                raise self.error((*key, k), what) from None
            if not matches:
                what = f"there is no file or folder '{text}' beside the study, and none matches it"
                raise self.error((*key, k), what)
            found |= dict.fromkeys(matches)
        return list(found)


def carried_name(path: PurePosixPath) -> str:
    """The name under which a report carries a file: plain parts only."""
    return str(PurePosixPath(*("up" if part == ".." else part for part in path.parts)))


def read_study_file(path: Path, root: Path | None = None) -> StudyFile:
    """Read and check the layout of a study file; StudyError, in one sentence with the line, says what is wrong."""
    return parse_study(path, read_text(path, STUDY_FILE), root)


def parse_study(path: Path, text: str, root: Path | None = None) -> StudyFile:
    """The study file of a text; path : its name, for messages."""
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise StudyError(f"{path}:{_syntax_error(str(error), text)}") from None
    except (ValueError, RecursionError):  # what int() says of thousands of digits, or brackets in brackets
        raise StudyError(f"{path}: numbers too large or lists too deep for a study file; {STUDY_FILE.advice}") from None
    try:
        model = StudyTables.model_validate(data)
    except ValidationError as error:
        raise StudyError(_sentence(path, error, key_lines(text))) from None
    if not model.data.files and not model.camera:
        raise StudyError(f"{path}:{_no_tests(data, key_lines(text))}")
    if model.report is not None and "file" not in model.report.model_fields_set and path.stem != "study":
        named = model.report.model_copy(update={"file": f"{path.stem}.html"})  # of several studies in a folder
        model = model.model_copy(update={"report": named})
    return StudyFile(path, text, model, root)


def _no_tests(data: Mapping[str, Any], lines: Mapping[KeyPath, int]) -> str:
    """What a study lacks that names neither files of tests nor cameras, with its line."""
    if "data" not in data:
        return f"1: the study has no 'data', which it needs; {EXAMPLES['data']}"
    if "files" not in data["data"]:
        return f"{line_of(('data',), lines)}: [data] has no 'files', which it needs; {EXAMPLES['files']}"
    return f"{line_of(('data', 'files'), lines)}: [data] files is [], and needs 1 or more entries"


# ---- lines ---------------------------------------------------------------------------------------------------------


def key_lines(text: str) -> Mapping[KeyPath, int]:
    """{path: line, counted from 1} of every key and table in a text that tomllib reads.

    Lines are gathered until tomllib takes them for a whole statement: a heading, or a key with its value.
    """
    lines: dict[KeyPath, int] = {}
    table: KeyPath = ()
    statement, first = "", 1
    for number, line in enumerate(text.splitlines(keepends=True), 1):
        first = first if statement else number
        statement += line
        try:
            data = tomllib.loads(statement)
        except tomllib.TOMLDecodeError:
            continue
        if statement.lstrip().startswith("["):
            table = _counted(_keys_of(data), lines, new="[[" in statement.partition("#")[0])
            for length in range(1, len(table) + 1):
                lines.setdefault(table[:length], first)
        else:
            _note(data, table, first, lines)
        statement = ""
    return lines


def _keys_of(data: Any) -> tuple[str, ...]:
    """The keys of a heading, of which tomllib has made tables in one another."""
    while isinstance(data, list):
        data = data[0]
    return (key, *_keys_of(data[key])) if (key := next(iter(data), None)) is not None else ()


def _counted(keys: Iterable[str], lines: Mapping[KeyPath, int], *, new: bool) -> KeyPath:
    """Keys with the number of the last table where one names a list of tables; new : the last key begins one more."""
    path: KeyPath = ()
    for key in keys:
        path = (*path, key)
        count = sum(1 for one in lines if one[:-1] == path and isinstance(one[-1], int))
        path = (*path, count - 1) if count else path
    if new and not isinstance(path[-1], int):
        return (*path, 0)
    return (*path[:-1], int(path[-1]) + 1) if new else path


def _note(data: Any, path: KeyPath, line: int, lines: dict[KeyPath, int]) -> None:
    """Note the line of every key of a statement, those of tables within braces too."""
    for key, value in data.items() if isinstance(data, dict) else ():
        lines.setdefault((*path, key), line)
        _note(value, (*path, key), line, lines)


def line_of(path: KeyPath, lines: Mapping[KeyPath, int]) -> int:
    """The line of a key, or of the innermost table around it that stands in the text; 1 where none does."""
    return next((lines[path[:length]] for length in range(len(path), 0, -1) if path[:length] in lines), 1)


def place_text(key: KeyPath) -> str:
    """A key as people write it: [forecast 2] end_h."""
    shown: list[str] = []
    for part in key:
        if isinstance(part, int):
            shown[-1] += f" {part + 1}"
        else:
            shown.append(quoted(part, SHOWN))
    return f"[{shown[0]}] {'.'.join(shown[1:])}".rstrip() if shown else "the study"


# ---- what tomllib and pydantic say, as a sentence ------------------------------------------------------------------


def _syntax_error(message: str, text: str) -> str:
    """Line and reason of an error of tomllib, which names the line at the end."""
    found = re.search(r" \(at line (\d+), column (\d+)\)$", message)
    line, column = (found[1], f", column {found[2]}") if found else (str(text.count("\n") + 1), "")
    twice = re.match(r"Cannot (?:declare|overwrite|mutate).*?\('([^']*)',\)", message)
    if twice and twice[1] in StudyTables.model_fields:
        several = get_origin(StudyTables.model_fields[twice[1]].annotation) is list
        remedy = f"write [[{twice[1]}]] above each of them" if several else "put its keys under one heading"
        return f"{line}: [{twice[1]}] stands there twice; {remedy}"
    if not re.search(r"^\s*(?:\[|[\w\"'.-]+\s*=)", text, re.MULTILINE):
        return f"{line}: this is no study file, but looks like data; {STUDY_FILE.advice}"
    reason = re.sub(r" \(at .*\)$", "", message)
    reason = reason[:1].lower() + reason[1:]
    return f"{line}: this is not TOML: {quoted(reason, 120)}{column}; texts stand in quotes, and each key on a line"


def _sentence(path: Path, error: ValidationError, lines: Mapping[KeyPath, int]) -> str:
    """The first mistake in the order of the file; first unknown keys, for they make others look missing."""
    found: list[Any] = [{**one, "loc": tuple(part for part in one["loc"] if part != "[key]")} for one in error.errors()]
    first = min(found, key=lambda one: (one["type"] != "extra_forbidden", line_of(one["loc"], lines)))
    more = len(found) - 1
    others = f" ({more} more mistake{'s' if more > 1 else ''} in the file)" if more else ""
    return f"{path}:{line_of(first['loc'], lines)}: {_problem(first)}{others}"


EXAMPLES = {
    "data": 'add the table [data] with files = ["*.csv"], or a [[camera]] with frames = "frames"',
    "files": 'write files = ["*.csv"]',
    "frames": 'write frames = "folder of frames"',
    "file": 'write file = "record.csv"',
    "laws": 'write laws = ["norton"]',
    "reason": 'write reason = "why it is left out"',
    "target": 'write target = "latex"',
}


NEEDED = {
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
    "string_too_long": "may have {max_length} signs at most",
    "too_short": "needs {min_length} or more entries",
    "too_long": "may have {max_length} entries at most",
    "greater_than": "must be above {gt:g}",
    "greater_than_equal": "must be at least {ge:g}",
    "less_than": "must be below {lt:g}",
    "less_than_equal": "must be at most {le:g}",
    "literal_error": "must be one of these: {expected}",
}
"""{kind of an error of pydantic: what would be right}, with the numbers of its context."""


def _problem(error: Any) -> str:
    kind, given, key = error["type"], error["input"], error["loc"]
    table, name = key[:-1], str(key[-1]) if key else ""
    if kind == "extra_forbidden":
        what = f"key '{quoted(name, SHOWN)}' in {place_text(table)}"
        what = what if table else f"table [{quoted(name, SHOWN)}] at the top of a study"
        return f"unknown {what}; {nearest(name[:SHOWN], known_keys(table))}"
    if kind == "missing":
        example = f"; {EXAMPLES[name]}" if name in EXAMPLES else ""
        return f"{place_text(table)} has no '{name}', which it needs{example}"
    if len(key) == 1 and kind == "list_type" and isinstance(given, dict):
        return f"[{name}] may stand there several times; write it in two brackets, [[{name}]]"
    if len(key) == 1 and kind in ("model_type", "model_attributes_type") and isinstance(given, list):
        return f"[[{name}]] stands there once at most; write it in one bracket, [{name}]"
    context = error.get("ctx", {})
    words = ", ".join(re.findall(r"'([^']*)'", str(context.get("expected"))))
    needed = NEEDED[kind].format(**{**context, "expected": words}) if kind in NEEDED else error["msg"]
    shown = quoted(str(given).lower() if isinstance(given, bool) else repr(given), SHOWN)
    return f"{place_text(key)} is {shown}, and {needed}"


def known_keys(table: Iterable[str | int]) -> list[str]:
    """Keys that a table of a study file may have."""
    model: Any = StudyTables
    for part in table:
        if isinstance(part, str) and model is not None and part in model.model_fields:
            model = next(_tables_in(model.model_fields[part].annotation), None)
    return [] if model is None else list(model.model_fields)


def _tables_in(annotation: Any) -> Any:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for inner in get_args(annotation):
        yield from _tables_in(inner)
