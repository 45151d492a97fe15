"""What a search of laws says: the answer, what was tried, and the front of accuracy against complexity."""

from __future__ import annotations

from typing import TYPE_CHECKING

from creepkit.reports.answer import answer_text
from creepkit.reports.blocks import Paragraph, Table, as_text, number, plural
from creepkit.reports.figures import empty_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.law_search.results import LawSearch


def law_search_text(search: LawSearch) -> str:
    """The answer of the best law, the front with the registered laws, and what the budget left out."""
    front = search.front
    laws = {one.law.name: one for one in [*(one for one in search.tried if one.registered), *front]}
    rows = [
        (
            f"{one.law.name}{' (registered)' if one.registered else ''}",
            *(str(one.parameters), str(one.complexity), f"{one.misfit:.3f}", number(one.excess, 3)),
            "yes" if one in front else "",
        )
        for one in sorted(laws.values(), key=lambda law: (law.complexity, law.misfit))
    ]
    columns = ("law", "parameters", "complexity", "rms ln strain", "behind", "on the front")
    table = Table("no simpler law than one on the front has a smaller misfit", columns, rows)
    answer = answer_text(search.best, search.ranking, searched=[one.law.name for one in search.tried])
    return f"{answer}\n\n{as_text([table, Paragraph(effort_text(search))])}"


def effort_text(search: LawSearch) -> str:
    """How many sentences were tried in which time, and what was left out."""
    tried = f"{plural(len(search.tried), 'law')} identified in {search.seconds:.0f} s of CPU time"
    if not search.untried:
        return f"{tried}; no change of one factor improves the best"
    return f"{tried}; the budget of {search.budget:g} s left changes of {plural(search.untried, 'sentence')} untried"


def front_figure(search: LawSearch) -> Figure:
    """The front as a picture of its own."""
    figure = empty_figure(7.5, 5.0)
    draw_front(figure.subplots(), search)
    return figure


def draw_front(axes: Axes, search: LawSearch) -> None:
    """Misfit against complexity: all laws that were tried, the front, and names of the ranked ones."""
    front = search.front
    axes.plot([one.complexity for one in search.tried], [one.misfit for one in search.tried], "o", ms=3, color="0.7")
    axes.step([one.complexity for one in front], [one.misfit for one in front], where="post", color="C0")
    named = dict.fromkeys([*front, *(one for one in search.tried if one.registered)])
    for one in named:
        axes.plot(one.complexity, one.misfit, "s" if one.registered else "o", color="C1" if one.registered else "C0")
        axes.annotate(one.law.name, (one.complexity, one.misfit), fontsize=7, xytext=(3, 3), textcoords="offset points")
    axes.set(xlabel="complexity: parameters and operations", ylabel="rms of ln strain", yscale="log")
