"""tests.toml: what the files of a laboratory leave open, answered beside them; the files stay as they are.

    ["RX*.csv"]
    specimen = "uniaxial"
    gauge_length_mm = 40
    columns = {Dehnung = "strain_pct", Bemerkung = "label", Kanal7 = "unused"}

    ["rates.csv"]
    ended = {abgestellt = "stopped", K013 = "ruptured"}

    ["rates.csv".tests.C3]
    exclude = "the grip slipped"

A table holds for the files that its pattern matches, later ones over earlier ones. Its keys are conditions as they
stand in the head of a file; `columns`, {name as written: what it is}; `ended`, a word for all tests, or {text, code or
name of a test: ruptured, stopped or label}; `parts`, whether files that are parts of a test are joined or separate;
`decimal`, point or comma; `tests`, {name: conditions of that test alone, or why it is left out, `exclude`}.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import replace
from difflib import get_close_matches
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, NamedTuple

from creepkit.errors import HistoryError, quoted
from creepkit.files.reading import FileKind, read_text
from creepkit.readers.columns_of_tests import NAMES
from creepkit.readers.ends_of_tests import LABEL, RUPTURED, STOPPED
from creepkit.readers.frames import UNUSED
from creepkit.readers.questions import ANSWERS_FILE, raise_all
from creepkit.readers.standard_names import ELAPSED, OF_DAY
from creepkit.readers.vocabulary import HeaderVocabulary, NameTable, Terms, split_written_name, words_of

ANSWERS = FileKind("answers about tests", HistoryError, "correct or remove it", maximum_bytes=1_000_000)

_ENDS = (RUPTURED, STOPPED, LABEL)


DECIMAL_SIGNS: Mapping[str, str] = {".": ".", ",": ",", "point": ".", "comma": ","}
"""What `decimal` may say, here or in the head of a file."""


EXCLUDE = "exclude"
"""The key that says why a test is left out."""


JOINED, SEPARATE = "joined", "separate"
"""What `parts` may say of files that are parts of one test."""


class Answers(NamedTuple):
    """What tests.toml says of one file.

    stated : {condition: text and place}. columns : {name as written: what it is}. ended : {text: end}. parts : whether
    parts of a test are joined. decimal : the sign in numbers. tests : {name: what is stated of that test alone}.
    """

    stated: dict[str, tuple[str, str]]
    columns: dict[str, str]
    ended: dict[str, str]
    parts: str = ""
    decimal: str = ""
    tests: Mapping[str, Mapping[str, tuple[str, str]]] = {}

    def added_to(self, vocabulary: HeaderVocabulary) -> HeaderVocabulary:
        """The vocabulary of a reader with the answers."""
        names = NameTable({**vocabulary.terms().column_kinds, **NAMES.kinds})
        synonyms, kept = dict(vocabulary.synonyms), {LABEL: [*vocabulary.labels], UNUSED: [*vocabulary.ignored]}
        for name, what in self.columns.items():
            if what in kept:
                kept[what].append(name)
                continue
            unit = split_written_name(name)[1]  # that it has as it is written counts where the answer has none
            standard = names.standard(f"{what} ({unit})" if what in names.kinds and unit else what)
            synonyms[name] = what if words_of(what) in (*OF_DAY, ELAPSED) else standard  # which kind of clock counts
        return replace(
            vocabulary,
            synonyms=synonyms,
            labels=kept[LABEL],
            ignored=kept[UNUSED],
            end_of_test_terms={**vocabulary.end_of_test_terms, **self.ended},
            stated={**vocabulary.stated, **self.stated},
            of_tests={**vocabulary.of_tests, **self.tests},
        )


def answers_of(path: Path) -> Answers:
    """What the file of answers beside a file, or in a folder, says of it; HistoryError for what is wrong in that."""
    found, file = Answers({}, {}, {}), (path if path.is_dir() else path.parent) / ANSWERS_FILE
    if path.name == ANSWERS_FILE or not file.is_file():
        return found
    for pattern, table in read_answers(file).items():
        if path.name == pattern or fnmatchcase(path.name, pattern) or (path.is_dir() and pattern == "*"):
            for key, value in table.items():
                if key == "columns":
                    found.columns.update(value)
                elif key == "parts":
                    found = found._replace(parts=value)
                elif key == "decimal":
                    found = found._replace(decimal=DECIMAL_SIGNS[value])
                elif key == "ended" and isinstance(value, dict):
                    found.ended.update({text.casefold(): end for text, end in value.items()})
                elif key == "tests":
                    of_tests = {name: _texts(one, f'{file} ["{pattern}".tests.{name}]') for name, one in value.items()}
                    found = found._replace(tests={**found.tests, **of_tests})
                else:
                    found.stated.update(_texts({key: value}, f'{file} ["{pattern}"]'))
    return found


def _texts(table: Mapping[str, Any], place: str) -> dict[str, tuple[str, str]]:
    """{key: its value as a text, and its place}."""
    return {key: (value if isinstance(value, str) else repr(value), place) for key, value in table.items()}


def read_answers(file: Path) -> dict[str, dict[str, Any]]:
    """{pattern: table} of a file of answers, all of whose keys are checked."""
    try:
        data = tomllib.loads(read_text(file, ANSWERS))
    except (tomllib.TOMLDecodeError, ValueError, RecursionError) as error:
        reason = " ".join(str(error).split())
        raise HistoryError(f"{file}: is no TOML ({quoted(reason, 120)}); correct or remove it") from None
    errors, known = list[HistoryError](), HeaderVocabulary().terms()
    names = [path.name for path in file.parent.iterdir()]
    for pattern, table in data.items():
        if "." not in pattern and not any(fnmatchcase(name, pattern) for name in names):
            what = f"'{quoted(pattern)}' is no file here; write the name of one, or a pattern such as"
            errors.append(HistoryError(f'{file}: {what} ["*.csv"]'))
        if not isinstance(table, dict):
            what = f"'{quoted(pattern)}' stands in no table; begin with the files that it is about, such as"
            errors.append(HistoryError(f'{file}: {what} ["*.csv"]'))
            continue
        for key, value in table.items():
            if problem := _problem(key, value, known):
                errors.append(HistoryError(f'{file}: ["{quoted(pattern)}"] {quoted(key)}: {problem}'))
    raise_all(errors)
    return data


def _problem(key: str, value: Any, known: Terms) -> str:
    """What is wrong with a key of a table or its value; "" for nothing."""
    if key == "columns":
        is_table = isinstance(value, dict) and all(isinstance(one, str) and one for one in value.values())
        return "" if is_table else 'write {name of a column = what it is}, such as {Dehnung = "strain_pct"}'
    if key == "parts":
        return "" if value in (JOINED, SEPARATE) else f"is {quoted(repr(value))}; allowed: {JOINED}, {SEPARATE}"
    if key == "decimal":
        return "" if value in DECIMAL_SIGNS else f"is {quoted(repr(value))}; allowed: point, comma"
    if key == "ended":
        values = list(value.values()) if isinstance(value, dict) else [value]
        wrong = [one for one in values if one not in (_ENDS if isinstance(value, dict) else _ENDS[:2])]
        return f"'{quoted(wrong[0])}' is no end; allowed: {', '.join(_ENDS)}" if wrong else ""
    if key == "tests":
        tables = [*value.values()] if isinstance(value, dict) else []
        if not tables or not all(isinstance(one, dict) for one in tables):
            return 'write a table a test, such as ["a.csv".tests.C3] and exclude = "its grip slipped" below it'
        found = ((one, _problem(one, what, known)) for table in tables for one, what in table.items())
        return next((f"{one} {what}" for one, what in found if what and one != EXCLUDE), "")
    if known.is_condition(key):
        is_single = isinstance(value, (str, int, float)) and not isinstance(value, bool)
        return "" if is_single else "write a number or a text"
    near = get_close_matches(key, ["columns", "ended", "parts", "tests"], 1)
    meant = near[0] if near else known.suggestion(key)
    allowed = "allowed are columns, ended, parts, tests, and conditions as in the head of a file, such as stress_MPa"
    return f"is no key; did you mean '{meant}'?" if meant else f"is no key; {allowed}"
