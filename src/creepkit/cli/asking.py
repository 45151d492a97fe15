"""`creepkit read --ask`: the open questions of files of tests, one after another, answered in a file beside them."""

from __future__ import annotations

import fnmatch
from collections.abc import Callable, Iterable, Sequence
from itertools import takewhile
from pathlib import Path

from creepkit.errors import CreepkitError, HistoryError, printable
from creepkit.files.delimited_text import Dialect, is_number
from creepkit.files.writing import write_text
from creepkit.readers.assembly import questions_of_assumed
from creepkit.readers.ends_of_tests import LABEL
from creepkit.readers.frames import UNUSED
from creepkit.readers.questions import ANSWERS_FILE, Question, single_errors, toml_value
from creepkit.readers.tests_file import read_answers, with_answer
from creepkit.records import History
from creepkit.reports.terminal import tell

LEAVE_OPEN = "?"
"""What is typed to leave a question open."""


def put_questions(read: Callable[[], Iterable[History]], answer: Callable[[str], str] | None) -> list[Path]:
    """Put the questions that reading raises until none is left, and return the files of answers that were written.

    read : reads the files, and raises what is open. answer : what was typed at a prompt; None without a terminal, where
    each question is a line with the text that answers it, and the last of them an error.
    """
    asked, written = set[tuple[object, ...]](), dict[Path, None]()
    while groups := {key: found for key, found in _open_questions(read).items() if key not in asked}:
        if answer is None:
            for questions in groups.values():
                tell(questions[0].asked_of(_name_of(questions), len(questions)))
            count = f"{len(groups)} question{'s' if len(groups) > 1 else ''}"
            raise HistoryError(f"{count} open; answer them in {ANSWERS_FILE}, or run this in a terminal")
        for key, questions in groups.items():
            asked.add(key)
            if (value := _answer_to(questions, answer)) is not None:
                written[_write(questions, value)] = None
    return list(written)


def _open_questions(read: Callable[[], Iterable[History]]) -> dict[tuple[object, ...], list[Question]]:
    """The questions that reading raises, or else of what it assumes, those of a folder that say the same together.

    {} where there are none, whatever else is wrong.
    """
    groups: dict[tuple[object, ...], list[Question]] = {}
    try:
        found: Sequence[Exception] = [one for history in read() for one in questions_of_assumed(history)]
    except CreepkitError as error:
        found = single_errors(error)
    for one in found:
        if isinstance(one, Question):
            groups.setdefault((one.path.parent, one.key, one.sentence, repr(one.choices)), []).append(one)
    return groups


def _name_of(questions: Sequence[Question]) -> str:
    """The name of the file that questions are about; of several a pattern, such as RX*.csv, which may match others."""
    names = _names_of(questions)
    if len(names) == 1:
        return names[0]
    suffixes = {one.path.suffix for one in questions}
    shared = takewhile(lambda signs: len(set(signs)) == 1, zip(*names, strict=False))
    return f"{''.join(signs[0] for signs in shared)}*{suffixes.pop() if len(suffixes) == 1 else ''}"


def _names_of(questions: Sequence[Question]) -> list[str]:
    return sorted({one.path.name for one in questions})


def _answer_to(questions: Sequence[Question], answer: Callable[[str], str]) -> str | None:
    """The answer as TOML; None where the question stays open."""
    question = questions[0]
    more = f" (and {len(questions) - 1} more, {_name_of(questions)})" if len(questions) > 1 else ""
    tell(f"{question.place}{more}: {question.sentence}")
    for number, choice in enumerate(question.choices, 1):
        tell(f"  {number}  {_in_words(choice)}{' [Enter]' if number == 1 else ''}")
    count = len(question.choices)
    listed = f"{'1 to ' * (count > 1)}{count}" if count else ""
    asked = " or ".join(filter(None, (listed, "what it is" if question.is_free else "")))
    while True:
        typed = answer(f"{asked}, {LEAVE_OPEN} leaves it open: ").strip()
        if typed == LEAVE_OPEN:
            return None
        chosen = typed or "1"
        if chosen.isdecimal() and 1 <= int(chosen) <= len(question.choices):
            return toml_value(question.choices[int(chosen) - 1])
        if question.is_free and typed:
            first = question.choices[0] if question.choices else ""
            return toml_value(dict.fromkeys(first, typed) if isinstance(first, dict) else _number_or_text(typed))
        tell(f"'{printable(typed)}' is none of these")


def _in_words(choice: str | float | dict[str, str]) -> str:
    if not isinstance(choice, dict):
        return str(choice)
    meanings = {LABEL: "only a label", UNUSED: "stays unread"}
    return ", ".join(
        f"{repr(name) if name else 'an empty cell'}: {meanings.get(what, what)}" for name, what in choice.items()
    )


def _number_or_text(typed: str) -> str | float:
    plain = typed.replace(",", ".")
    return float(plain) if is_number(plain, Dialect()) else typed


def _write(questions: Sequence[Question], value: str) -> Path:
    """Add an answer to the file beside the tests, and read that again."""
    question = questions[0]
    file = question.path.parent / ANSWERS_FILE
    text = file.read_text(encoding="utf-8") if file.is_file() else ""
    names, pattern = _names_of(questions), _name_of(questions)
    matched = fnmatch.filter([one.name for one in file.parent.iterdir()], pattern)
    for name in [pattern] if len(names) > 1 and set(matched) <= set(names) else names:
        text = with_answer(text, name, question.key, value)
    write_text(text, file, HistoryError, force=True)
    read_answers(file)
    return file
