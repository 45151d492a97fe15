"""Checks of exporters: text or a reason for every registered law, the same each time, whatever the notes hold."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from creepkit.errors import CreepkitError, ExportError, quoted
from creepkit.exporters.exporting import exported_text
from creepkit.language.elastic import Elastic
from creepkit.language.symbols import temperature
from creepkit.records import Exporter, LawWithValues
from creepkit.registry import default_registry
from creepkit.testing.reports import ConformanceCheck

LONGEST_TEXT = 1_000_000
"""Characters of the text of one law."""


FIRST_LINE, SECOND_LINE = "firstnoteline", "secondnoteline"


HOSTILE_NOTES = (
    f"{FIRST_LINE}\n{SECOND_LINE}",
    "an end of comment */ --> ''' \"\"\" \\ % # { } $ & _ ^ ~",
    "Umlaute äöü, σ ≥ 3, 蠕变",
    "tab\tand return\rand null\x00",
)


HOSTILE_NAMES = ("two words", "9th", "class", "a\nb", "x*/ int y;", 'quote"d', "é")


@dataclass(frozen=True)
class ExporterCase:
    """An exporter and what it is given."""

    exporter: Exporter


def registered_sources() -> list[LawWithValues]:
    """Every registered law at the middle of its bounds, and at 1073 K where it depends on temperature."""
    sources = []
    for registered in default_registry().laws().values():
        law = registered.value
        source = LawWithValues(law, law.center(), elastic=Elastic(150e3))
        sources += [source, *([source.at(1073.0)] if law.uses(temperature) else [])]
    return sources


def check_every_law(case: ExporterCase) -> Iterator[ConformanceCheck]:
    """Every law gives text, or an ExportError that says why not; never another error."""
    written, refused = 0, 0
    for source in registered_sources():
        try:
            text = exported_text(case.exporter, source)
        except ExportError as error:
            message = str(error)
            if " raised " in message or "\n" in message or not message.strip():
                detail = f"law '{source.law.name}': {message!r}; raise ExportError with the reason, one sentence"
                yield ConformanceCheck("text or a reason for every law", False, detail)
                return
            refused += 1
            continue
        except CreepkitError as error:
            detail = f"law '{source.law.name}': {type(error).__name__}: {error}; raise ExportError with the reason"
            yield ConformanceCheck("text or a reason for every law", False, detail)
            return
        if not 0 < len(text) <= LONGEST_TEXT or "\x00" in text:
            detail = f"law '{source.law.name}': {len(text)} characters; a text of 1 to {LONGEST_TEXT} is wanted"
            yield ConformanceCheck("text or a reason for every law", False, detail)
            return
        written += 1
    detail = f"{written} texts, {refused} refused with a reason"
    yield ConformanceCheck("text or a reason for every law", written > 0, detail)


def check_determinism(case: ExporterCase) -> Iterator[ConformanceCheck]:
    """The same law gives the same text."""
    source = _first_source(case.exporter)
    same = source is None or exported_text(case.exporter, source) == exported_text(case.exporter, source)
    detail = "twice the same text" if same else "two texts of one law differ; leave out dates and orders of sets"
    yield ConformanceCheck("deterministic", same, detail)


def check_hostile_texts(case: ExporterCase) -> Iterator[ConformanceCheck]:
    """Notes and names break no lines and end no comments."""
    source = _first_source(case.exporter)
    if source is None:
        return
    text = exported_text(case.exporter, source.replace(notes=HOSTILE_NOTES))
    problem = _note_problem(text)
    yield ConformanceCheck("notes", not problem, problem or "stay in their comments")
    for name in HOSTILE_NAMES:
        try:
            text = exported_text(case.exporter, source.replace(name=name))
        except ExportError as error:
            if " raised " in str(error):
                yield ConformanceCheck("names", False, f"name {name!r}: {error}; raise ExportError, or change it")
                return
            continue
        if "\n" in name and name in text:
            yield ConformanceCheck("names", False, f"name {name!r} breaks a line; refuse it, or make it an identifier")
            return
    yield ConformanceCheck("names", True, f"{len(HOSTILE_NAMES)} names written or refused")


def _note_problem(text: str) -> str:
    lines = text.splitlines()
    first = [line for line in lines if FIRST_LINE in line]
    second = [line for line in lines if SECOND_LINE in line]
    for a, b in zip(first, second, strict=False):
        if a is not b and _prefix(a, FIRST_LINE) != _prefix(b, SECOND_LINE):
            found = quoted(repr(b), 60)
            return f"the second line of a note stands alone, {found}; put the comment sign before each line of it"
    if "\x00" in text:
        return "a null character of a note is in the text; creepkit.exporters.law_description leaves them out"
    return ""


def _prefix(line: str, marker: str) -> str:
    return re.sub(r"[\w:,.]+", "", line.partition(marker)[0]).strip()


def _first_source(exporter: Exporter) -> LawWithValues | None:
    """The first registered law that an exporter can write."""
    for source in registered_sources():
        try:
            exported_text(exporter, source)
        except CreepkitError:
            continue
        return source
    return None


def check_interface(case: ExporterCase) -> Iterator[ConformanceCheck]:
    """The ending of files begins with a dot."""
    suffix = case.exporter.suffix
    good = isinstance(suffix, str) and bool(re.fullmatch(r"\.[A-Za-z0-9_.]+", suffix))
    yield ConformanceCheck("suffix", good, suffix if good else f"{suffix!r} is none; write one such as '.inp'")
