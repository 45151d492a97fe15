"""Sections of a page on its data, files to download, methods, how to repeat, and what is missing."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from creepkit.files.writing import file_stem
from creepkit.quality.flags import frame_ranges_text
from creepkit.reports.blocks import (
    Block,
    Downloads,
    Items,
    PageSection,
    Paragraph,
    Table,
    Verbatim,
    plural,
    printable,
    printable_lines,
    sentence,
)
from creepkit.reports.compared_values import reading_counts, selection_sentence
from creepkit.reports.contents import covariance_file
from creepkit.reports.histories import history_blocks, quality_blocks
from creepkit.reports.law_names import definition_blocks
from creepkit.reports.methods import laws_of, methods_text
from creepkit.reports.verdicts import explanation_text

if TYPE_CHECKING:
    from creepkit.reports.contents import ExportedFile, ReportContents, ReportGroup


MOST_FILES = 4
"""On the first screen."""


def closing_sections(contents: ReportContents) -> list[PageSection]:
    """Exports, methods, provenance, and what is missing."""
    return [
        _exports_section(contents),
        PageSection(
            "methods",
            "Methods text",
            _methods_blocks(contents) if contents.identified or contents.rupture else [],
            result="for a paper, with equations and references",
        ),
        PageSection(
            "provenance", "How to repeat", _provenance_blocks(contents), result="commands, settings, versions, inputs"
        ),
        PageSection("missing", "What is missing", _missing_blocks(contents)),
    ]


# ---- methods ---------------------------------------------------------------------------------------------------------


def _methods_blocks(contents: ReportContents) -> list[Block]:
    """The text to be copied, and the equations that it numbers: set, with their symbols, and as text."""
    text = Verbatim("To be copied into a paper and shortened", printable_lines(methods_text(contents)), prose=True)
    return [text, *definition_blocks(laws_of(contents.identified).values())]


# ---- files -----------------------------------------------------------------------------------------------------------


def _covariances(found: Sequence[ReportGroup]) -> list[ExportedFile]:
    """The covariance of the best law of each material."""
    files = [(one, covariance_file(one.fit)) for one in found if one.fit.estimates]
    if len(found) == 1:
        return [file for _, file in files]
    return [
        replace(file, name=f"covariance_{file_stem(one.name, str(k))}.csv", target=f"{file.target}, {one.name}")
        for k, (one, file) in enumerate(files, start=1)
    ]


def files_to_download(contents: ReportContents) -> list[tuple[str, str, str]]:
    """(name, address, what it is) of exports and covariances; the address holds the content.

    Laws as text come first, then what is kept of single identifications.
    """
    files = [*contents.exports, *_covariances(contents.identified)]
    return [
        (file_name(one.name), _address(one.text), f"{one.target}, {_size(one.text)}")
        for one in sorted(files, key=lambda one: one.name.endswith(".json"))
    ]


def _exports_section(contents: ReportContents) -> PageSection:
    """The files that do not stand on the first screen."""
    files = files_to_download(contents)
    files = files[MOST_FILES:] if len(contents.identified) == 1 else files
    blocks = [Downloads(files)] if files else []
    return PageSection("exports", "Files to download", blocks, result=plural(len(files), "further file"))


def file_name(name: str) -> str:
    """A name under which any system can save a file: letters, digits, dots, hyphens and underscores."""
    stem, dot, suffix = name.rpartition(".")
    plain = file_stem(stem or suffix, signs="A-Za-z0-9._-", gap="_")
    return f"{plain}.{file_stem(suffix, 'txt', signs='A-Za-z0-9', gap='')}" if dot and stem else plain


def _address(text: str) -> str:
    encoded = base64.b64encode(text.encode("utf-8", "replace")).decode("ascii")
    return f"data:text/plain;charset=utf-8;base64,{encoded}"


def _size(text: str) -> str:
    size = len(text.encode("utf-8", "replace"))
    return f"{size} bytes" if size < 1000 else f"{size / 1000:.3g} kB"


# ---- provenance ------------------------------------------------------------------------------------------------------


def _provenance_blocks(contents: ReportContents) -> list[Block]:
    provenance, blocks = contents.provenance, list[Block]()
    if contents.attachments:
        total = sum(len(one.content) for one in contents.attachments)
        blocks.append(
            Paragraph(
                f"This page carries {plural(len(contents.attachments), 'file')} of the study ({total / 1e6:.3g} MB): "
                "'creepkit run' with the name of this page repeats the study from them."
            )
        )
    if provenance.commands:
        blocks.append(Verbatim("Commands that repeat the work", printable_lines("\n".join(provenance.commands))))
    settings = {"seed": provenance.seed} if provenance.seed is not None else {}
    rows = [(k, printable(v, 400)) for k, v in _flat({**settings, **provenance.settings}) if v not in ("", None)]
    if rows:
        blocks.append(Table("Settings", ("setting", "value"), rows))
    if provenance.versions:
        rows = [(k, v) for k, v in provenance.versions.items()]
        blocks.append(Table("Versions", ("package", "version"), rows))
    inputs = dict(provenance.inputs)
    files = {one.name: inputs.pop(one.name.rpartition("/")[2], "") for one in contents.attachments} | inputs
    if files:
        blocks.append(Table("Files of the study", ("file", "sha256 of its content"), [*files.items()]))
    return blocks


def _flat(settings: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Nested settings under names with dots; lists of numbers and words on one line."""
    for name, value in settings.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{name}.")
        elif isinstance(value, list | tuple) and any(isinstance(one, Mapping) for one in value):
            yield from _flat({f"{name}[{k}]": one for k, one in enumerate(value, start=1)}, prefix)
        else:
            yield f"{prefix}{name}", ", ".join(map(str, value)) if isinstance(value, list | tuple) else value


def _missing_blocks(contents: ReportContents) -> list[Block]:
    groups = [group for group in contents.groups if group.failure]
    rows = [
        *((one.stage, sentence(one.sentence)) for one in contents.failures),
        *((f"identification of {group.name}", sentence(group.failure)) for group in groups),
    ]
    table = [Table("Stages that failed, and why", ("stage", "reason"), rows)] if rows else []
    return [*table, *([Items(contents.notes)] if contents.notes else [])]


# ---- data ------------------------------------------------------------------------------------------------------------


MOST_LISTED = 400
"""Rows of a table of tests."""


def data_section(contents: ReportContents) -> PageSection:
    """The tests as measured, what is suspect in them, and what was left out and why."""
    histories = [h for group in contents.groups for h in group.histories]
    blocks: list[Block] = []
    if histories:
        more = f"; {len(histories) - MOST_LISTED} more are not listed" if len(histories) > MOST_LISTED else ""
        blocks += history_blocks(histories[:MOST_LISTED], more)
    blocks += [Paragraph(f"Source of the data: {text}") for text in contents.data_citations]
    if contents.quality is not None:
        blocks += quality_blocks(contents.quality, MOST_LISTED)
    in_tests = [(one.name, one.fit.adequacy) for one in contents.identified if one.fit.adequacy is not None]
    texts = [(name, explanation_text(adequacy)) for name, adequacy in in_tests if adequacy.lies_in_tests]
    blocks += [Paragraph(f"{name}: {text}" if name else text, "warning") for name, text in texts]
    left_out = _exclusion_blocks(contents) if histories or contents.exclusions else []
    flags = 0 if contents.quality is None else len(contents.quality.flags)
    result = f"{plural(len(histories), 'test')} as measured; {plural(flags, 'flag') if flags else 'nothing suspect'}"
    result += f"; {len(contents.exclusions)} left out" if contents.exclusions else ""
    return PageSection("data", "Data", blocks, [PageSection("exclusions", "Left out", left_out)], result)


def _exclusion_blocks(contents: ReportContents) -> list[Block]:
    selected = [Paragraph(text) for text in _selections(contents)]
    if not contents.exclusions:
        return [Paragraph("No reading was excluded by hand or by the check of data quality."), *selected]
    rows = []
    for one in contents.exclusions[:MOST_LISTED]:  # of a bar that has no camera as of what has one
        readings = frame_ranges_text(one.frames).replace("frame", "reading", 1)
        rows.append((one.test, readings if one.frames else "the whole test", one.reason))
    return [Table("Left out of the identification", ("test", "what", "reason"), rows), *selected]


def _selections(contents: ReportContents) -> Iterator[str]:
    """How many frames of the tests of each group were selected for the fit."""
    for group in contents.identified:
        if not any(h.outputs for h in group.fit.histories):
            continue
        most = group.fit.settings.frames
        text = selection_sentence(reading_counts(group.fit.histories, most), most)
        yield f"{group.name}: {text}" if len(contents.groups) > 1 else text
