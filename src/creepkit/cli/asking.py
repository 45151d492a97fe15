"""`creepkit read --ask`: the open questions of files of tests, one after another, answered in a file beside them."""

from __future__ import annotations

import fnmatch
import json
import re
import tomllib
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from creepkit.errors import CreepkitError, HistoryError, printable
from creepkit.files.delimited_text import Dialect, is_number
from creepkit.files.writing import write_text
from creepkit.readers.assembly import questions_of_assumed
from creepkit.readers.ends_of_tests import LABEL
from creepkit.readers.frames import UNUSED
from creepkit.readers.questions import ANSWERS_FILE, Answer, Question, merged, toml_value
from creepkit.readers.tests_file import read_answers
from creepkit.records import History
from creepkit.reports.terminal import tell

LEAVE_OPEN = "?"
"""What is typed to leave a question open."""


def put_questions(read: Callable[[], Iterable[History]], answer: Callable[[str], str] | None) -> list[Path]:
    """Put the questions that reading raises until none is left, and return the files of answers that were written.

    read : reads the files, and raises what is open. answer : what was typed at a prompt; None without a terminal, where
    each question is a line with the text that answers it, and the last of them an error.
    """
    asked, written = set[str](), dict[Path, None]()
    while questions := [one for one in _open_questions(read) if str(one) not in asked]:
        if answer is None:
            tell("\n".join(map(str, questions)))
            count = f"{len(questions)} question{'s' * (len(questions) > 1)} open"
            raise HistoryError(f"{count}; answer them in {ANSWERS_FILE}, or run this in a terminal")
        for question in questions:
            asked.add(str(question))
            if (value := _answer_to(question, answer)) is not None:
                written[_write(question, value)] = None
    return list(written)


def _open_questions(read: Callable[[], Iterable[History]]) -> list[Question]:
    """The questions that reading raises, or else of what it assumes; none where there are none, whatever is wrong."""
    try:
        found: Sequence[Exception] = [one for history in read() for one in questions_of_assumed(history)]
    except CreepkitError as error:
        found = [error]
    return [one for one in merged(found) if isinstance(one, Question)]


def _answer_to(question: Question, answer: Callable[[str], str]) -> Answer | None:
    """The answer; None where the question stays open."""
    tell(f"{question.places}{f', {question.pattern}' if len(question.names) > 1 else ''}: {question.sentence}")
    for number, choice in enumerate(question.choices, 1):
        tell(f"  {number}  {_in_words(choice)}{' [Enter]' if number == 1 else ''}")
    count = len(question.choices)
    listed = f"{'1 to ' * (count > 1)}{count}" if count else ""
    free = "what it is" if listed else question.key
    asked = " or ".join(filter(None, (listed, free if question.is_free else "")))
    while True:
        try:
            typed = answer(f"{asked}, {LEAVE_OPEN} leaves it open: ").strip()
        except EOFError:
            raise HistoryError(f"the input ended; the same command goes on from what {ANSWERS_FILE} holds") from None
        if typed == LEAVE_OPEN:
            return None
        chosen = typed or "1"
        if chosen.isdecimal() and 1 <= int(chosen) <= len(question.choices):
            return question.choices[int(chosen) - 1]
        if question.is_free and typed:
            first = question.choices[0] if question.choices else ""
            return dict.fromkeys(first, typed) if isinstance(first, dict) else _number_or_text(typed)
        tell(f"'{printable(typed)}' is none of these")


def _in_words(choice: Answer) -> str:
    if not isinstance(choice, dict):
        return str(choice)
    meanings = {LABEL: "only a label", UNUSED: "stays unread"}
    return ", ".join(
        f"{repr(name) if name else 'an empty cell'}: {meanings.get(what, what)}" for name, what in choice.items()
    )


def _number_or_text(typed: str) -> str | float:
    plain = typed.replace(",", ".")
    return float(plain) if is_number(plain, Dialect()) else typed


def _write(question: Question, value: Answer) -> Path:
    """Add an answer to the file beside the tests, and read that again."""
    file = question.path.parent / ANSWERS_FILE
    text = file.read_text(encoding="utf-8") if file.is_file() else ""
    matched = fnmatch.filter([one.name for one in file.parent.iterdir()], question.pattern)
    for name in [question.pattern] if set(matched) <= set(question.names) else question.names:
        text = with_answer(text, name, question.key, value)
    write_text(text, file, HistoryError, force=True)
    read_answers(file)
    return file


def with_answer(text: str, name: str, key: str, value: Answer) -> str:
    """The text of a file of answers with one more, of a file; {name: value} is added to what the key holds already."""
    lines, heading = text.rstrip("\n").split("\n") if text.strip() else [], f"[{json.dumps(name, ensure_ascii=False)}]"
    if heading not in lines:
        lines += [*([""] if lines else []), heading]
    start = lines.index(heading) + 1
    end = next((k for k in range(start, len(lines)) if lines[k].startswith("[")), len(lines))
    at = next((k for k in range(start, end) if re.match(rf"{re.escape(key)}\s*=", lines[k])), None)
    if at is None:
        at = end
        while at > start and not lines[at - 1].strip():
            at -= 1
        lines.insert(at, "")
    elif isinstance(value, dict) and isinstance(earlier := tomllib.loads(lines[at])[key], dict):
        value = {**earlier, **value}
    lines[at] = f"{key} = {toml_value(value)}"
    return "\n".join(lines) + "\n"
