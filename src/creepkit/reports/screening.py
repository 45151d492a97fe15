"""A screened plate as text for a terminal, and its laws and rates as pictures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from creepkit.errors import FitError
from creepkit.reports.answer import SLOPES, interval_text, key_figures, table_of_groups
from creepkit.reports.blocks import Answer, Paragraph, as_text, ends, named, plural
from creepkit.reports.description import NewTestInterval, rejected, tested_range
from creepkit.reports.figures import empty_figure, place_legend
from creepkit.reports.rate_panels import draw_plate, plate_rates, plate_size
from creepkit.reports.verdicts import numerical_error_text
from creepkit.reports.wording import say
from creepkit.reports.words import PLATE
from creepkit.screening.results import AlloyResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from creepkit.inverse.identification import Identification
    from creepkit.screening.results import ScreeningResult


MOST_LAWS = 4
"""Laws that a headline names."""


def screening_text(plate: ScreeningResult) -> str:
    """The law, exponent and rate of each alloy, the share of each law in each class, and what failed."""
    table = table_of_groups({one.alloy: (one.best, one.decisive) for one in plate.identified})
    return as_text([*([table] if plate.identified else []), *map(Paragraph, summary_lines(plate))])


def plate_answer(
    fits: Sequence[tuple[str, Identification]], choices: Sequence[bool], *, failed: int, picture: Any = None
) -> Answer:
    """The laws of many materials in few words. fits : (material, best law). choices : whether each is decisive."""
    (first, count), *others = Counter(fit.law.name for _, fit in fits).most_common(MOST_LAWS)
    rejecting, missed = sum(rejected(fit) for _, fit in fits), [name for name, fit in fits if not fit.converged]
    told = {"failed": failed, "not converged": len(missed), "choice": len(choices) if not all(choices) else 0}
    values = {"failed": failed, "names": named(missed, "material"), "decisive": sum(choices), "choices": len(choices)}
    of_others, materials = [f"{name} in {number}" for name, number in others], plural(len(fits), "material")
    known = {"first": first, "count": count, "others": of_others, "materials": materials, "rejecting": rejecting}
    following = "search" if missed else "laws" if 2 * rejecting > len(fits) else "use"
    return Answer(
        say(PLATE["headline"], **known, range=tested_range(*(fit for _, fit in fits))),
        "",
        figures=_plate_figures(fits),
        cautions=[say(PLATE[kind], **values) for kind, many in told.items() if many],
        next_step=PLATE[f"next {following}"],
        picture=picture,
        role="caution" * bool(rejecting),
    )


def _plate_figures(fits: Sequence[tuple[str, Identification]]) -> list[tuple[str, str, str, str]]:
    """The largest and the smallest rate with their materials, and ends of exponents and of how far a new test lies."""
    stress, strain, rates = plate_rates(fits)
    at, known = f"{stress:.3g} MPa, {100 * strain:.2g} % strain", np.flatnonzero(np.isfinite(rates[:, 0]))
    order = known[np.argsort(rates[known, 0])]
    outer = [("largest", k) for k in order[-1:]] + [("smallest", k) for k in order[:1]]
    found = [(f"{side} creep rate", fits[k][0], interval_text([*rates[k]], "%/h"), at) for side, k in outer]
    exponents = [one.value for _, fit in fits for one in key_figures(fit)[:1] if one.name == SLOPES[0]]
    factors = [np.exp(one.half_width) for _, fit in fits if (one := NewTestInterval.of(fit)) is not None]
    if exponents:
        found.append(("stress exponents", "", ends(exponents, 2), plural(len(exponents), "material")))
    if factors:
        found.append(("a new test, within a factor of", "", ends(factors, 2), "95 %, from the best to the worst law"))
    return found


def summary_lines(plate: ScreeningResult) -> list[str]:
    """What the alloys say together, and what is odd, a line each."""
    decisive = sum(result.decisive for result in plate.identified)
    lines = [f"{len(plate.identified)} of {len(plate.results)} alloys identified, {decisive} of them decisively"]
    if plate.compositions is not None:
        for name, law_fractions in plate.law_fractions().items():
            fractions = ", ".join(
                f"{law} {100 * fraction:.0f} %" for law, fraction in sorted(law_fractions.items(), key=lambda p: -p[1])
            )
            lines.append(f"{name} ({len(plate.by_class()[name])}): {fractions}")
    lines += [f"failed: {_failure_text(alloy, reason)}" for alloy, reason in plate.failures.items()]
    for result in plate.identified:
        error = result.best.numerical_error
        if error is not None and not error.confirms:
            lines.append(f"{result.alloy}: not confirmed: {numerical_error_text(error)}")
    return [*lines, *(f"note: {note}" for note in plate.notes)]


def _failure_text(alloy: str, failure: str) -> str:
    """The reason, after the alloy's name where it does not say it itself."""
    return failure if f"'{alloy}'" in failure else f"alloy '{alloy}': {failure}"


LAWS_HEIGHT = 4.4
"""Inches, of the panel of laws by class."""


def screening_figure(plate: ScreeningResult) -> Figure:
    """The share of each law by class, and below it the rate of each alloy by its best law."""
    size = plate_size(len(_best_of_alloys(plate)))
    figure = empty_figure(size[0], LAWS_HEIGHT + size[1])
    laws, rates = figure.subplots(2, 1, height_ratios=(LAWS_HEIGHT, size[1]))
    _draw_law_fractions(laws, plate)
    draw_rates_of_alloys(rates, plate)
    return figure


def draw_rates_of_alloys(axes: Axes, plate: ScreeningResult) -> None:
    """The rate of each alloy at one stress by its best law."""
    draw_plate(axes, _best_of_alloys(plate))


def _best_of_alloys(plate: ScreeningResult) -> list[tuple[str, Identification]]:
    if not plate.identified:
        raise FitError("no alloy of this plate has a law, so there is nothing to draw; see Plate.failed")
    return [(one.alloy, one.best) for one in plate.identified]


def _draw_law_fractions(axes: Axes, plate: ScreeningResult) -> None:
    """Share of each law by class (Fig. 7c): full colour where decisive, hatched what is shared out between laws."""
    classes = plate.by_class()
    bottom, positions = np.zeros(len(classes)), range(len(classes))
    for k, law in enumerate(sorted({w.fit.law.name for a in plate.identified for w in a.laws})):
        for decisive in (True, False):
            share = np.array([_law_fraction(members, law, decisive) for members in classes.values()])
            style: Any = {} if decisive else {"alpha": 0.45, "hatch": "///", "edgecolor": "white", "linewidth": 0}
            label = law if decisive else None
            axes.bar(positions, share, bottom=bottom, color=f"C{k}", width=0.6, label=label, **style)
            bottom += share
    axes.set_xticks(positions, [f"{name}\n{len(m)} alloy{'s' if len(m) > 1 else ''}" for name, m in classes.items()])
    axes.set(ylim=(0, 1), xlim=(-0.6, max(len(classes), 3) - 0.4), ylabel="share of alloys")
    axes.set_title("identified laws by class; hatched: shared out by weight where not decisive", fontsize=10)
    place_legend(axes)


def _law_fraction(members: tuple[AlloyResult, ...], law: str, decisive: bool) -> float:
    """Mean weight of a law over the members that are decisive, or over those that are not, as a share of all."""
    weights = [w.weight for m in members if m.decisive is decisive for w in m.laws if w.fit.law.name == law]
    return sum(weights) / len(members)
