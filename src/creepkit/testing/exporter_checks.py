"""Checks of exporters: text or a reason for every registered law, the same each time, whatever the notes hold."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import suppress

from creepkit.errors import CreepkitError, ExportError, quoted
from creepkit.exporters.exporting import exported_text
from creepkit.language.elastic import Elastic
from creepkit.language.symbols import temperature
from creepkit.records import Exporter, LawWithValues
from creepkit.registry import default_registry, kinds
from creepkit.testing.reports import finding
from creepkit.testing.sample_points import with_numbers

LONGEST_TEXT = 1_000_000
"""Characters of the text of one law."""


FIRST_LINE, SECOND_LINE = "firstnoteline", "secondnoteline"


HOSTILE_NOTES = (
    f"{FIRST_LINE}\n{SECOND_LINE}",
    "an end of comment */ --> ''' \"\"\" \\ % # { } $ & _ ^ ~",
    "Umlaute äöü, σ ≥ 3, 蠕变",
    "tab\tand return\rand null\x00",
)


def registered_sources() -> list[LawWithValues]:
    """Every registered law at the middle of its bounds, and at 1073 K where it depends on temperature."""
    laws = default_registry().values(kinds.LAWS)
    laws = list(dict.fromkeys(one for law in laws for one in (law, with_numbers(law))))
    sources = [LawWithValues(law, law.center(), elastic=Elastic(150e3)) for law in laws]
    return [*sources, *(source.at(1073.0) for source in sources if source.law.uses(temperature))]


@finding("suffix")
def check_suffix(exporter: Exporter) -> str:
    """The ending of files begins with a dot."""
    suffix = exporter.suffix
    good = isinstance(suffix, str) and re.fullmatch(r"\.[A-Za-z0-9_.]+", suffix)
    assert good, f"{suffix!r} is none; write one such as '.inp'"
    return suffix


@finding("text or a reason for every law")
def check_every_law(exporter: Exporter) -> str:
    """Every law gives text, or an ExportError that says why not; never another error."""
    sources, refused = registered_sources(), 0
    for source in sources:
        law = f"law '{source.law.name}'"
        try:
            text = exported_text(exporter, source)
        except CreepkitError as error:
            said = str(error)
            reason = isinstance(error, ExportError) and said.strip() and " raised " not in said and "\n" not in said
            assert reason, f"{law}: {said!r}; raise ExportError with the reason, one sentence"
            refused += 1
        else:
            sound = 0 < len(text) <= LONGEST_TEXT and "\x00" not in text
            assert sound, f"{law}: {len(text)} characters; a text of 1 to {LONGEST_TEXT} is wanted"
    assert refused < len(sources), f"no law is written, {refused} are refused"
    return f"{len(sources) - refused} texts, {refused} refused with a reason"


def _writable(exporter: Exporter) -> Iterator[LawWithValues]:
    """The first registered law that an exporter can write."""
    for source in registered_sources():
        with suppress(CreepkitError):
            exported_text(exporter, source)
            yield source
            return


@finding("notes", each=_writable)
def check_notes(exporter: Exporter, source: LawWithValues) -> str:
    """Notes break no lines and end no comments."""
    text = exported_text(exporter, source.replace(notes=HOSTILE_NOTES))
    first, second = ([line for line in text.splitlines() if mark in line] for mark in (FIRST_LINE, SECOND_LINE))
    for a, b in zip(first, second, strict=False):
        assert a == b or _prefix(a, FIRST_LINE) == _prefix(b, SECOND_LINE), (
            f"the second line of a note stands alone, {quoted(repr(b), 60)}; put the comment sign before each line"
        )
    assert "\x00" not in text, (
        "a null character of a note is in the text; creepkit.exporters.law_description leaves them out"
    )
    return "stay in their comments"


def _prefix(line: str, marker: str) -> str:
    return re.sub(r"[\w:,.]+", "", line.partition(marker)[0]).strip()
