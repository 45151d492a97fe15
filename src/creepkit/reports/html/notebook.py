"""What a notebook shows of a record: the blocks of the report page that say it, in one cell."""

from __future__ import annotations

from collections.abc import Sequence
from functools import singledispatch
from itertools import count

from creepkit.inverse.identification import Identification
from creepkit.inverse.selection.ranking import Ranking
from creepkit.language import CreepLaw
from creepkit.records import Histories, History, Specimen
from creepkit.records.presentable import Presentable, function_of_reports
from creepkit.reports.answer import equations
from creepkit.reports.blocks import Block, Formula, Paragraph, Verbatim, plural
from creepkit.reports.catalogue import specimen_blocks
from creepkit.reports.contents import ReportContents, ReportGroup
from creepkit.reports.histories import history_blocks, tests_figure
from creepkit.reports.html.page import block_shown, findings_section, group_answer, template
from creepkit.reports.law_names import LawNames, symbols_table
from creepkit.reports.ranking import ranking_blocks
from creepkit.reports.svg import PageFigures

STYLE = (
    ".creepkit .seen .scroll{display:grid;grid-template-columns:repeat(auto-fit,minmax(18rem,1fr));gap:0 1rem}"
    ".creepkit .formula math{width:fit-content;margin:0}"
    ".creepkit .lead{font-weight:600}.creepkit dd{margin:0;font-weight:600}"
    ".creepkit dl>div{margin:.4rem 0}.creepkit figure{margin:.5rem 0}"
    ".creepkit dd.note{font-weight:400;opacity:.7}.creepkit .drawing svg{width:100%;height:auto}"
    ".creepkit table{border-collapse:collapse}.creepkit caption{text-align:left;opacity:.7}"
    ".creepkit th,.creepkit td{text-align:left;padding:.2rem 1rem .2rem 0;border-bottom:1px solid #8886}"
    ".creepkit .n{text-align:right}"
)
"""Of what stands in a cell."""


_CELLS = count(1)


def notebook_html(record: object) -> str:
    """A record as HTML for one cell; identifiers of its figures are those of no other cell."""
    block = template("blocks.html").module.block  # type: ignore[attr-defined]
    groups = [ReportGroup("", record)] if isinstance(record, Identification | Ranking) else []
    groups += record.groups if isinstance(record, ReportContents) else ()
    fits = [fit for group in groups for fit in group.fits]
    blocks = [block(block_shown(one, LawNames(fits))) for one in _blocks(record)]
    return f'<div class="creepkit"><style>{STYLE}</style>{"".join(blocks)}</div>'


def _figures() -> PageFigures:
    return PageFigures(f"cell{next(_CELLS)}f")


@singledispatch
def _blocks(record: object) -> Sequence[Block]:
    """Its details with figures, of a record that has these as blocks; of others the text of a terminal."""
    if isinstance(record, Presentable) and record.detailed_by:
        blocks: Sequence[Block] = function_of_reports(record.detailed_by)(record, _figures())
        return blocks
    return [Verbatim(type(record).__name__, str(record))]


@_blocks.register(Identification)
@_blocks.register(Ranking)
def _(result: Identification | Ranking) -> Sequence[Block]:
    found = ReportGroup("", result)
    return [group_answer(found, _figures()), *([] if found.ranking is None else ranking_blocks(found.ranking))]


@_blocks.register
def _(law: CreepLaw) -> Sequence[Block]:
    table = symbols_table("stress as a ratio to 1 MPa, time to 1 s", law)
    return [Paragraph(law.title or law.name, "lead"), *map(Formula, equations(law)), table]


@_blocks.register
def _(tests: Histories) -> Sequence[Block]:
    caption = f"{plural(len(tests), 'test')} over time; hollow: readings that are not used."
    drawn = [_figures().picture(lambda: tests_figure(tests), "Tests", caption, caption)]
    return [*history_blocks(tests), *(drawn if any(one.outputs for one in tests) else [])]


_blocks.register(History)(lambda history: _blocks(Histories([history])))
_blocks.register(Specimen)(specimen_blocks)


@_blocks.register
def _(contents: ReportContents) -> Sequence[Block]:
    return [Paragraph(contents.title, "lead"), *findings_section(contents, _figures()).blocks]
