"""What a ranking or a search of laws says: the laws with misfits and weights, and what else the tests allow."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.evidence import CREDIBLE_WEIGHT
from creepkit.reports.answer import answer_text, titled_law
from creepkit.reports.blocks import Block, Cell, Items, Paragraph, Table, as_text, listed, number, plural
from creepkit.reports.compared_values import judged_readings, misfit_of
from creepkit.reports.condition_colours import distinct_colours, temperatures_celsius
from creepkit.reports.description import Description, spread_text
from creepkit.reports.figures import empty_figure, logarithmic_labels, panel_grid, power_of_ten, shortened, wrapped
from creepkit.reports.histories import program_text
from creepkit.reports.identification_plot import (
    FittedCurves,
    curve_of_test,
    draw_curve,
    fitted_curves,
    set_curve_ranges,
)
from creepkit.reports.terminal import print_table, tell, tell_written
from creepkit.reports.verdicts import challenge_text, scatter_text, verdict_text
from creepkit.reports.words import COMPARED

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection.ranking import RankedLaw, Ranking
    from creepkit.law_search.results import LawSearch
    from creepkit.reports.svg import PageFigures


MOST_BEHIND, SMALLER = 3, 0.95
"""Laws behind the best of which it is said why, though their misfits are smaller; and by which factor on its own."""


def ranking_text(ranking: Ranking) -> str:
    """How well the best law describes the tests, the verdict, then all laws."""
    equivalents = equivalents_among_remaining(ranking)
    head: list[Block] = [Paragraph(ranking.best.headline), Paragraph(ranking.verdict), Items(equivalents)]
    return as_text([*head, *ranking_blocks(ranking)])


def ranking_blocks(ranking: Ranking, figures: PageFigures | None = None, of: str = "") -> list[Block]:
    """The laws tried with misfits and weights, and with `figures` the misfit of each law in each test.

    of : the material, " of CMSX-4".
    """
    blocks: list[Block] = [_table(ranking), Items(_behind(ranking))]
    if any(math.isfinite(one.chi_square) for one in ranking.laws):
        blocks.append(Paragraph(COMPARED["chi-square"], "note"))
    blocks.append(Items([*map(challenge_text, ranking.challenges or ())], "what the tests allow beside the best law:"))
    blocks.append(Items([f"{name}: {reason}" for name, reason in ranking.failed.items()]))
    if figures is not None and np.isfinite(misfits(ranking)).any():
        weights = ", ".join(f"{r.fit.law.name} {r.weight:.3f}" for r in ranking.laws)
        description = (
            f"{misfit_name(ranking)}: {plural(len(ranking.laws), 'law')} in {plural(len(ranking.best.tests), 'test')}, "
            f"and the curves of the credible ones. Weights: {weights}."
        )
        caption = f"Where the laws differ: {misfit_name(ranking)}."
        title = f"Misfit of each law in each test{of}"
        blocks.append(figures.picture(lambda: ranking_figure(ranking), title, description, caption))
    return blocks


def _table(ranking: Ranking) -> Table:
    rows: list[dict[str, Cell]] = [
        {
            "law": titled_law(one.fit.law),
            "parameters": str(len(one.fit.law.params)),
            "mean misfit": ", ".join(f"{name} {spread_text(v)}" for name, v in Description.of(one.fit).items()),
            "test to test": scatter_text(one.fit.noise_model.rate),
            "behind": number(one.excess, 3) if math.isfinite(one.excess) else "–",
            "weight": f"as {one.same_as}" if one.same_as else f"{one.weight:.3f}",
            "chi-square": number(one.chi_square, 4),
            "by the noise": verdict_text(one.fit.adequacy),
        }
        for one in ranking.laws
    ]
    return Table.of("laws tried, the best first", rows)


def _behind(ranking: Ranking) -> list[str]:
    """Why laws that have a smaller misfit than the best are behind it, a sentence each."""
    best, own, found = ranking.laws[0], Description.of(ranking.best), list[str]()
    for one in ranking.laws[1:]:
        theirs = dict(Description.of(one.fit).items())
        smaller = [name for name, misfit in own.items() if theirs.get(name, math.inf) < SMALLER * misfit]
        more = one.chi_square - best.chi_square
        kind = "parameters" if not more > 0 else "readings"
        if not math.isfinite(one.excess):
            kind = "left out" if one.fit.law.name in ranking.further else "unpredicted"
        if smaller and not one.same_as and (kind != "readings" or math.isfinite(more)):
            values = {"law": one.fit.law.name, "what": listed(smaller)}
            found.append(COMPARED[kind].format(**values, more=number(more, 3), excess=number(one.excess, 3)))
    return found[:MOST_BEHIND]


def equivalents_among_remaining(ranking: Ranking) -> list[str]:
    """Pairs of credible laws that the tests do not separate; none where one is decisive or the tests were not given."""
    if ranking.decisive:
        return []
    names = {r.fit.law.name for r in ranking.credible}
    if any(r.fit.predictor is None or not r.fit.histories for r in ranking.laws):
        return []
    return [str(pair) for pair in ranking.equivalents() if {pair.first, pair.second} <= names]


# ---- commands --------------------------------------------------------------------------------------------------------


def print_ranking(ranking: Ranking, written: Sequence[Path], test_count: int) -> None:
    """Print the table of laws, the answer, and what was written."""
    table = _table(ranking)
    print_table(f"{test_count} tests", table.columns, [[*map(str, row)] for row in table.rows])
    files = [path for path in written if path.suffix == ".json"]  # the ranking, where there are several laws
    tell(f"{answer_text(ranking.best, ranking, ' '.join(('creepkit report', *map(str, files[:1]))))}\n")
    for path in written:
        tell_written(path)


# ---- figure ----------------------------------------------------------------------------------------------------------


MOST_TESTS_DRAWN, MOST_LAWS_DRAWN = 6, 5
"""Tests whose curves are drawn, those in which the credible laws differ most, and laws, the best first."""


MOST_TEST_NAMES, MOST_NUMBERS = 24, 14
"""Columns of the misfits that are named, and up to which each misfit is written in its cell."""


SHOWN_QUANTILE = 0.97
"""Of the misfits: where the colours end. A test of hardly any noise has a misfit of any size."""


NOT_JUDGED = "this noise is not known well enough to judge the laws by it: compare them, not with 1"


OWN_RATE_MISFIT = "reduced chi-square of each law in each test, its own rate and offset taken out (1: noise alone)"
"""Of laws whose tests are at hand, judged as where it is said whether they explain them."""


COMMON_RATE_MISFIT = "mean square misfit of each law in each test over noise², the law's rate for every test"
"""Of identifications without their tests."""


def ranking_figure(ranking: Ranking) -> Figure:
    """Draw the misfit of each law in each test, and the curves of the laws that tests do not tell apart.

    The misfit is that of `misfits`; the title is the verdict.
    """
    credible = [r for r in ranking.laws if r.weight > CREDIBLE_WEIGHT][:MOST_LAWS_DRAWN]
    with_tests = len(credible) > 1 and all(r.fit.histories and r.fit.predictor is not None for r in credible)
    curves = [fitted_curves(r.fit) for r in credible] if with_tests else []
    shown = _tests_to_draw(ranking.best, curves) if curves else []
    heights, width = [2.0 + 0.42 * len(ranking.laws), *([3.0 * -(-len(shown) // 3)] if shown else [])], 12.5
    figure = empty_figure(width, sum(heights) + 0.7)
    parts = figure.subfigures(len(heights), 1, height_ratios=heights, squeeze=False)[:, 0]
    draw_misfits(parts[0].subplots(), ranking)
    if shown:
        panels = panel_grid(len(shown), 3, 0.0, 0.0, part=parts[1])[1]
        for axes, test in zip(panels, shown, strict=True):
            _draw_test(axes, credible, curves, test)
        names = ["measured", *(f"{r.fit.law.name}, weight {r.weight:.3f}" for r in credible)]
        title = "credible laws with their 95 % bands; of many tests those in which they differ most"
        parts[1].legend(panels[0].lines, names, loc="outside lower center", ncols=3, fontsize=8, title=title)
    figure.suptitle(wrapped(ranking.verdict, width), fontsize=10)
    return figure


# ---- misfits and weights ---------------------------------------------------------------------------------------------


def misfit_name(ranking: Ranking) -> str:
    """What `misfits` are of a ranking."""
    return OWN_RATE_MISFIT if _all_judged(ranking) else COMMON_RATE_MISFIT


def _all_judged(ranking: Ranking) -> bool:
    return all(judged_readings(ranked.fit) is not None for ranked in ranking.laws)


def misfits(ranking: Ranking) -> Floats:
    """(laws, tests) misfit of each law in each test, in the order of the ranking and of its tests.

    The reduced chi-square by which laws are judged, tests with their own rates, lives and offsets; where tests or
    their noise are not known, that against the noise of a frame with the laws' own rates.
    """
    if _all_judged(ranking):
        readings = [judged_readings(ranked.fit) for ranked in ranking.laws]
        return np.array([[one.chi_square(k) for k in range(len(ranking.best.tests))] for one in readings if one])
    return np.array([[misfit_of(test) for test in ranked.fit.tests] for ranked in ranking.laws])


def draw_misfits(axes: Axes, ranking: Ranking) -> None:
    """The misfit of each law in each test, as colours."""
    from matplotlib.colors import LogNorm
    from matplotlib.ticker import NullLocator

    best = ranking.best
    order = _columns(best)
    values = misfits(ranking)[:, order]
    finite = values[np.isfinite(values) & (values > 0)]
    low, high = np.quantile(finite, (0.0, SHOWN_QUANTILE)) if finite.size else (1.0, 1.0)
    labels = logarithmic_labels(min(float(low), 0.8), max(float(high), 2.0), 6)
    norm = LogNorm(labels[0], labels[-1])
    image = axes.imshow(np.where(values > 0, values, np.nan), norm=norm, cmap="YlOrRd", aspect="auto")
    names = [f"{r.fit.law.name}, weight {r.weight:.3f}" for r in ranking.laws]
    axes.set_yticks(range(len(names)), names, fontsize=8)
    step = -(-len(order) // MOST_TEST_NAMES)
    tests = [shortened(best.tests[k].name) for k in order[::step]]
    axes.set_xticks(range(0, len(order), step), tests, rotation=35, ha="right", rotation_mode="anchor", fontsize=8)
    axes.set_xlabel(f"{len(order)} tests, from the coldest to the hottest" if step > 1 else "", fontsize=9)
    for (row, column), value in np.ndenumerate(values) if len(order) <= MOST_NUMBERS else ():
        colour = "white" if norm(value) > 0.7 else "black"
        axes.text(column, row, _number(value), ha="center", va="center", fontsize=7.5, color=colour)
    extend = "max" if (finite > labels[-1]).any() else "neither"
    bar = axes.figure.colorbar(image, ax=axes, label="misfit / noise²", pad=0.01, aspect=12, extend=extend)
    bar.set_ticks(list(labels), labels=[_number(v) for v in labels])
    bar.ax.yaxis.set_minor_locator(NullLocator())
    judged = best.adequacy is None or best.adequacy.outputs
    title = wrapped(misfit_name(ranking), 9.0, 9.0)
    axes.set_title(title if judged else f"{title}\n{NOT_JUDGED}", fontsize=9)


def _number(value: float) -> str:
    """Two digits; large numbers as powers of ten."""
    if not np.isfinite(value):
        return "-"
    return f"{value:.2g}" if value < 100 else f"{value:.0f}" if value < 9999.5 else power_of_ten(float(f"{value:.0e}"))


def _columns(fit: Identification) -> list[int]:
    """The tests from the coldest to the hottest, of one temperature, or without histories, in their order."""
    celsius = np.round(temperatures_celsius(fit.histories)) if fit.histories else np.zeros(len(fit.tests))
    return [int(k) for k in np.argsort(celsius, kind="stable")]


# ---- curves ----------------------------------------------------------------------------------------------------------


def _tests_to_draw(best: Identification, curves: Sequence[FittedCurves]) -> list[int]:
    """Positions of the tests in which the curves of laws differ most, in noises of the best one."""

    def separation(test: int) -> float:
        output = best.tests[test].outputs[0]
        values = np.stack([c.of(test, output.output)[0] for c in curves])
        distance = float(np.sqrt(np.nanmean((values - values[0])[1:] ** 2)))
        return float(np.nan_to_num(distance / output.noise if output.noise > 0 else distance))

    with_frames = [k for k, test in enumerate(best.tests) if test.outputs]
    if len(with_frames) <= MOST_TESTS_DRAWN:
        return with_frames
    return sorted(sorted(with_frames, key=separation, reverse=True)[:MOST_TESTS_DRAWN])


def _draw_test(axes: Axes, laws: Sequence[RankedLaw], curves: Sequence[FittedCurves], test: int) -> None:
    history, output = laws[0].fit.histories[test], laws[0].fit.tests[test].outputs[0].output
    drawn = [curve_of_test(r.fit, c, test, output) for r, c in zip(laws, curves, strict=True)]
    for k, (curve, colour) in enumerate(zip(drawn, distinct_colours(len(laws)), strict=True)):
        draw_curve(axes, curve, colour, "-" if k == 0 else "--", dots="0.35" if k == 0 else None)
    set_curve_ranges(axes, drawn, output)
    axes.set(xlabel="time, h", ylabel=drawn[0].label)
    axes.set_title(wrapped(f"{shortened(history.name, 48)}: {shortened(program_text(history), 96)}", 3.0), fontsize=8.5)


# ---- search of laws --------------------------------------------------------------------------------------------------


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
