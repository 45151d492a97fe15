"""The section on the data: the tests as measured, what is suspect in them, and what was left out."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from creepkit.inverse.compared_tests import duration_known
from creepkit.quality.flags import frame_ranges_text
from creepkit.records import SECONDS_PER_HOUR
from creepkit.reports.blocks import Block, PageSection, Paragraph, Table, number, plural
from creepkit.reports.compared_values import frame_counts, selection_sentence
from creepkit.reports.findings import findings_of
from creepkit.reports.load_programs import temperature_text

if TYPE_CHECKING:
    from creepkit.quality.flags import DataQuality
    from creepkit.records import History
    from creepkit.reports.contents import ReportContents
    from creepkit.reports.findings import GroupFindings


MOST_LISTED = 400
"""Rows of a table of tests."""


def data_section(contents: ReportContents, found: Sequence[GroupFindings] = ()) -> PageSection:
    """The tests as measured, what is suspect in them, and what was left out and why."""
    histories = [h for group in contents.groups for h in group.histories]
    blocks: list[Block] = []
    if histories:
        more = f"; {len(histories) - MOST_LISTED} more are not listed" if len(histories) > MOST_LISTED else ""
        blocks += [_table_of_histories(histories, more), *details_of_tests(histories[:MOST_LISTED], more)]
    blocks += [Paragraph(f"Source of the data: {text}") for text in contents.data_citations]
    if contents.quality is not None:
        blocks += _quality_blocks(contents.quality)
    in_tests = [(one.name, one.fit.adequacy) for one in found if one.fit.adequacy is not None]
    texts = [(name, adequacy.explanation_text) for name, adequacy in in_tests if adequacy.lies_in_tests]
    blocks += [Paragraph(f"{name}: {text}" if name else text, "warning") for name, text in texts]
    left_out = _exclusion_blocks(contents) if histories or contents.exclusions else []
    flags = 0 if contents.quality is None else len(contents.quality.flags)
    result = f"{plural(len(histories), 'test')} as measured; {plural(flags, 'flag') if flags else 'nothing suspect'}"
    result += f"; {len(contents.exclusions)} left out" if contents.exclusions else ""
    return PageSection("data", "Data", blocks, [PageSection("exclusions", "Left out", left_out)], result)


def _table_of_histories(histories: Sequence[History], more: str) -> Table:
    rows = [
        (
            h.name,
            h.alloy or NOT_STATED,
            h.condition,
            str(h.times.size) if h.outputs else "–",
            number(float(h.times[-1]) / SECONDS_PER_HOUR) if duration_known(h) else "–",
            _ending(h),
            re.split(r"[/\\]", h.source)[-1] or NOT_STATED,
        )
        for h in histories[:MOST_LISTED]
    ]
    columns = ("test", "alloy", "condition", "readings", "last reading, h", "ended", "file")
    return Table(f"{plural(len(histories), 'test')} as measured{more}", columns, rows, numeric=(3, 4))


def _ending(history: History) -> str:
    if history.rupture_time is not None:
        return f"ruptured at {number(history.rupture_time / SECONDS_PER_HOUR)} h"
    return "stopped unruptured" if history.unruptured else NOT_STATED


def _quality_blocks(quality: DataQuality) -> list[Block]:
    if not quality.tests:
        return [
            Paragraph(
                "No test has readings over time, so that there was nothing for the check of data quality to look at."
            )
        ]
    if not quality.flags:
        return [Paragraph(f"The check of data quality found nothing suspect in {plural(quality.tests, 'test')}.")]
    rows = [
        (
            flag.history,
            flag.kind,
            readings_text(flag.frames) if flag.frames else "–",
            "–" if flag.time is None else number(flag.time / SECONDS_PER_HOUR),
            flag.reason,
            flag.proposal or "–",
        )
        for flag in quality.flags[:MOST_LISTED]
    ]
    columns = ("test", "what", "readings", "at, h", "reason", "what may be done")
    caption = f"What the check of data quality found in {plural(quality.tests, 'test')}; it drops nothing by itself"
    return [Table(caption, columns, rows, numeric=(3,))]


def readings_text(frames: Sequence[int]) -> str:
    """Numbers of readings: 'readings 97-191, 193'; of a bar that has no camera as of what has one."""
    return frame_ranges_text(frames).replace("frame", "reading", 1)


def _exclusion_blocks(contents: ReportContents) -> list[Block]:
    selected = [Paragraph(text) for text in _selections(contents)]
    if not contents.exclusions:
        return [Paragraph("No reading was excluded by hand or by the check of data quality."), *selected]
    rows = [
        (one.test, readings_text(one.frames) if one.frames else "the whole test", one.reason)
        for one in contents.exclusions[:MOST_LISTED]
    ]
    return [Table("Left out of the identification", ("test", "what", "reason"), rows), *selected]


def _selections(contents: ReportContents) -> Iterator[str]:
    """How many frames of the tests of each group were selected for the fit."""
    for group in contents.groups:
        found = findings_of(group)
        if found is None or not any(h.outputs for h in found.fit.histories):
            continue
        most = found.fit.settings.frames
        text = selection_sentence(frame_counts(found.fit.histories, most), most)
        yield f"{group.name}: {text}" if len(contents.groups) > 1 else text


# ---- how tests were made ---------------------------------------------------------------------------------------------


NOT_STATED = "not stated"


HEAT_LABELS = ("heat", "batch", "cast")


CONTROLS = {"load": "load held", "stress": "true stress held"}


def details_of_tests(histories: Sequence[History], more: str) -> list[Block]:
    """What tests have in common in a sentence, and a row for each of what differs.

    more : what the caption says of tests that are not listed.
    """
    columns = ("specimen", "control", "temperature", "strain", "elastic strain", "heat", "dimensions, mm")
    rows = [
        (
            h.specimen,
            CONTROLS.get(str(getattr(h.loading, "control", "")), f"{h.loading.quantity} imposed"),
            temperature_text(h),
            *_strain(h),
            _heat(h),
            _dimensions(h),
        )
        for h in histories
    ]
    differing = [k for k in range(len(columns)) if len({row[k] for row in rows}) > 1]
    shared = [f"{name} {rows[0][k]}" for k, name in enumerate(columns) if k not in differing]
    blocks: list[Block] = [Paragraph(f"all tests: {', '.join(shared)}")] if shared else []
    if differing:
        named = [(h.name, *(row[k] for k in differing)) for h, row in zip(histories, rows, strict=True)]
        blocks.append(Table(f"How the tests were made{more}", ("test", *(columns[k] for k in differing)), named))
    return blocks


def _strain(history: History) -> tuple[str, str]:
    if "strain" not in history.outputs:
        return "none measured", "–"
    return history.strain_measure, "included" if history.includes_elastic else "not included"


def _heat(history: History) -> str:
    known = [history.labels[label] for label in HEAT_LABELS if history.labels.get(label)]
    return known[0] if known else NOT_STATED


def _dimensions(history: History) -> str:
    stated = [f"{name.replace('_', ' ')} {number(float(value))}" for name, value in history.geometry.items()]
    return ", ".join(stated) or NOT_STATED
