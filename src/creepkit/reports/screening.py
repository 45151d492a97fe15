"""A screened plate, its laws and rates as text and pictures, and creep over the compositions of its alloys."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy

from creepkit.arrays import Floats, Ints
from creepkit.composition.mapping import CompositionMap, PredictedAlloy
from creepkit.composition.regression import CompositionRegression
from creepkit.errors import FitError
from creepkit.records.units import celsius_text
from creepkit.reports.answer import SLOPES, interval_text, key_figures, table_of_groups
from creepkit.reports.blocks import Answer, Block, Items, Paragraph, Table, as_text, ends, named, number, plural
from creepkit.reports.description import NewTestInterval, rejected, tested_range
from creepkit.reports.figures import draw_parity, empty_figure, logarithmic_labels, panels_of, place_legend
from creepkit.reports.rate_panels import PERCENT_PER_HOUR, draw_plate, plate_rates, plate_size
from creepkit.reports.svg import PageFigures
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
    for alloy, why in plate.failures.items():  # after the alloy's name where it does not say it itself
        lines.append(f"failed: {why}" if f"'{alloy}'" in why else f"failed: alloy '{alloy}': {why}")
    for result in plate.identified:
        error = result.best.numerical_error
        if error is not None and not error.confirms:
            lines.append(f"{result.alloy}: not confirmed: {numerical_error_text(error)}")
    return [*lines, *(f"note: {note}" for note in plate.notes)]


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


# ---- creep over compositions -----------------------------------------------------------------------------------------


CHANGED = 0.05
"""Of ln of a rate, from which on it is said that the others change it."""


CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 3**0.5 / 2.0]])
"""Of the triangle, (3, 2): left, right, top."""


KNOWN = 0.7
"""Part of the standard deviation of all alloys, from which on a composition is left blank: nothing is known there."""


def composition_text(mapped: CompositionMap) -> str:
    """How well compositions predict alloys that are left out, the polynomial, what the others change, what to make."""
    return as_text([Paragraph(map_sentence(mapped), "lead"), *composition_blocks(mapped)])


def map_sentence(mapped: CompositionMap) -> str:
    """What the map is worth, in one sentence."""
    error = np.exp(mapped.log_rate.left_out_error)
    return (
        f"the composition predicts the creep rate of an alloy to a factor of {error:.2f} (standard deviation over "
        f"{len(mapped.alloys)} alloys of {', '.join(mapped.elements)}, each left out)"
    )


def composition_blocks(mapped: CompositionMap, figures: PageFigures | None = None, of: str = "") -> list[Block]:
    """The same as blocks; figures : of a page, where the picture is wanted. of : whose, in its captions."""
    rate, exponent, point = mapped.log_rate, mapped.stress_exponent, mapped.point
    at = f"{point['stress']:.3g} MPa, {celsius_text(point['temperature'])} and {100 * point['strain']:.2g} % strain"
    noise = float(np.sqrt(np.mean(rate.sd**2)))
    lines = [
        f"rates are compared at {at}; by an alloy's own tests they are known to a factor of {np.exp(noise):.2f}",
        f"stress exponents of alloys left out are predicted within {exponent.left_out_error:.2g}",
        *_energy_lines(mapped),
        f"{round(rate.left_out_coverage * len(rate.values))} of {len(rate.values)} rates lie in the 95 % intervals "
        f"that the other alloys give them; alloys of one composition differ by {100 * np.expm1(rate.scatter):.0f} %",
        f"nearly, with atomic fractions x: ln(rate, 1/s) = {formula_text(rate)}",
    ]
    lowest = min(one.rate[0] for one in mapped.proposals)
    beyond = "these rates are below all that were measured: an extrapolation that only a test can confirm"
    lines += [f"left out: {name}: {why}" for name, why in mapped.left_out.items()]
    title = f"Creep rate over compositions{of}"
    description = f"{title}: a triangle of the elements that vary most, and alloys left out over their own rates."
    return [
        *([] if figures is None else [figures.picture(lambda: composition_figure(mapped), title, description, title)]),
        Items(lines),
        *_shared_blocks(mapped),
        proposals_table(mapped.proposals, "the compositions to make next for the lowest creep rate"),
        *([Paragraph(beyond)] if lowest < float(np.exp(rate.values.min())) else []),
    ]


def _energy_lines(mapped: CompositionMap) -> list[str]:
    """How well activation energies of alloys left out are predicted, and over which range they are."""
    energy = mapped.activation_energy
    if energy is None:
        return []
    low, high = (number(float(one) / 1e3, 3) for one in (energy.values.min(), energy.values.max()))
    error = number(energy.left_out_error / 1e3, 2)
    return [f"activation energies, {low} to {high} kJ/mol, of alloys left out are predicted within {error} kJ/mol"]


def formula_text(regression: CompositionRegression) -> str:
    """The sparse polynomial, elements first and then pairs."""
    terms = sorted(regression.formula.as_ordered_terms(), key=lambda one: (len(one.free_symbols), str(one)))
    return str(sympy.sstr(sympy.Add(*terms, evaluate=False), order="none")).replace("*", " ")


def _shared_blocks(mapped: CompositionMap) -> list[Block]:
    """The alloys to whom the others give another rate, by more than CHANGED, or another law."""
    rate, laws = mapped.log_rate, mapped.laws
    value, sd, share = rate.shared
    changed = np.abs(value - rate.values) > CHANGED
    changed |= laws.shared.argmax(axis=1) != laws.weights.argmax(axis=1)
    rows = []
    for k in sorted(np.flatnonzero(changed), key=lambda alloy: -abs(value[alloy] - rate.values[alloy])):
        low, high = (PERCENT_PER_HOUR * float(np.exp(value[k] + side * 1.96 * sd[k])) for side in (-1, 1))
        own, both = (PERCENT_PER_HOUR * float(np.exp(one[k])) for one in (rate.values, value))
        by = [laws.laws[int(one[k].argmax())] for one in (laws.weights, laws.shared)]
        shown = f"{number(both, 3)} [{number(low, 3)}, {number(high, 3)}]"
        rows.append((mapped.alloys[k], number(own, 3), shown, f"{100 * share[k]:.0f} %", by[0], by[1]))
    if not rows:
        return [Paragraph("what alloys show by their own tests, the others change by less than 5 %")]
    columns = (
        "alloy",
        "rate by its tests, %/h",
        "with the others",
        "weight of the others",
        "law by its tests",
        "law with the others",
    )
    return [Table("alloys whose own tests say less than their neighbours do", columns, rows)]


def proposals_table(proposals: Sequence[PredictedAlloy], caption: str) -> Table:
    """Compositions with their predicted rate, exponent and law."""
    rows = []
    for one in proposals:
        contents = " ".join(f"{element}{content:.3g}" for element, content in one.composition.items() if content > 0.05)
        value, low, high = (number(PERCENT_PER_HOUR * rate, 2) for rate in one.rate)
        law, share = max(one.laws.items(), key=lambda pair: pair[1])
        energy = [] if one.activation_energy is None else [number(one.activation_energy[0] / 1e3, 3)]
        exponent = f"{one.stress_exponent[0]:.2g}"
        rows.append((contents, f"{value} [{low}, {high}]", exponent, *energy, f"{law} ({share:.2f})"))
    energy = ["activation energy, kJ/mol"] if proposals and proposals[0].activation_energy else []
    return Table(caption, ("composition, at.%", "creep rate, %/h", "stress exponent", *energy, "law"), rows)


def composition_figure(mapped: CompositionMap) -> Figure:
    """Rates over a triangle of the three elements that vary most, or over one of two; and alloys left out."""
    figure, (left, right) = panels_of(11.0, 4.6, 1, 2, width_ratios=(1.25, 1.0))
    draw_map(left, mapped)
    rate = mapped.log_rate
    own, others = (PERCENT_PER_HOUR * np.exp(v) for v in (rate.values, rate.left_out[0]))
    reach = np.exp(1.96 * rate.left_out[1])
    draw_parity(right, own, others / reach, others * reach, logarithmic=True)
    right.errorbar(own, others, yerr=[others - others / reach, others * reach - others], fmt="o", ms=4, lw=0.7)
    right.set(xlabel="creep rate by an alloy's own tests, %/h", ylabel="by the other alloys, %/h")
    return figure


def draw_map(axes: Axes, mapped: CompositionMap) -> None:
    """The rate over the three elements that vary most, the others at their mean; or over one of two."""
    from matplotlib.tri import Triangulation

    if len(mapped.elements) < 3:
        _draw_line(axes, mapped)
        return
    contents, rate = mapped.contents, mapped.log_rate
    shown = np.sort(np.argsort(-contents.std(axis=0))[:3])
    rest = contents.mean(axis=0)
    rest[shown] = 0.0
    room, steps = 1.0 - rest.sum(), 60
    lattice = np.array([(a, b, steps - a - b) for a in range(steps + 1) for b in range(steps + 1 - a)]) / steps
    points = np.tile(rest, (len(lattice), 1))
    points[:, shown] = room * lattice
    value, sd = rate.predict(points, of_alloy=False)
    triangles = Triangulation(*(lattice @ CORNERS).T)
    triangles.set_mask((sd > KNOWN * rate.scale)[triangles.triangles].any(axis=1))
    levels, of_alloys = (np.log10(PERCENT_PER_HOUR) + v / np.log(10.0) for v in (value, rate.shared[0]))
    limits = float(min(levels.min(), of_alloys.min())), float(max(levels.max(), of_alloys.max()))
    colours: Any = {"cmap": "viridis", "vmin": limits[0], "vmax": limits[1]}
    drawn = axes.tripcolor(triangles, levels, shading="gouraud", rasterized=True, **colours)
    own = contents[:, shown] / np.maximum(contents[:, shown].sum(axis=1, keepdims=True), 1e-9)
    best = mapped.laws.shared.argmax(axis=1)
    for law in np.unique(best):
        of_law, marker, name = best == law, "osD^v"[law % 5], mapped.laws.laws[law]
        across, up = (own[of_law] @ CORNERS).T
        axes.scatter(across, up, c=of_alloys[of_law], s=42, marker=marker, edgecolors="white", zorder=3, **colours)
        axes.scatter([], [], marker=marker, color="0.5", label=name)
    made = np.array([[one.composition[mapped.elements[k]] for k in shown] for one in mapped.proposals])
    place = made / np.maximum(made.sum(axis=1, keepdims=True), 1e-9) @ CORNERS
    across, up = place.T
    axes.scatter(across, up, marker="*", s=130, color="crimson", edgecolors="white", label="to make next", zorder=4)
    for a, b in combinations(CORNERS, 2):
        axes.plot(*np.column_stack([a, b]), color="0.3", lw=0.8, zorder=1)
    _name_corners(axes, mapped, shown, rest)
    ticks = logarithmic_labels(10.0 ** limits[0], 10.0 ** limits[1], most=6)
    bar = axes.figure.colorbar(drawn, ax=axes, shrink=0.75, pad=0.02)
    bar.set_ticks(np.log10(ticks).tolist(), labels=[number(tick, 2) for tick in ticks])
    bar.ax.set_ylim(*limits)
    bar.set_label(f"creep rate at {mapped.point['stress']:.3g} MPa, {celsius_text(mapped.point['temperature'])}, %/h")
    place_legend(axes, below=True)


def _name_corners(axes: Axes, mapped: CompositionMap, shown: Ints, rest: Floats) -> None:
    """Elements at the corners, and what the others are held at."""
    for k, (corner, place) in enumerate(
        zip(CORNERS, (("right", "top"), ("left", "top"), ("center", "bottom")), strict=True)
    ):
        name = mapped.elements[int(shown[k])]
        axes.annotate(
            name, corner, xytext=(0, 6 if k == 2 else -6), textcoords="offset points", ha=place[0], va=place[1]
        )
    held = [f"{e} {100 * x:.2g} at.%" for e, x in zip(mapped.elements, rest, strict=True) if x > 0]
    if held:
        axes.set_title(f"colours at {', '.join(held)}; marks at their own, filled by their rates", fontsize=9, pad=16)
    axes.set(aspect="equal", xlim=(-0.12, 1.12), ylim=(-0.1, 0.98))
    axes.axis("off")


def _draw_line(axes: Axes, mapped: CompositionMap) -> None:
    """The rate over the content of the second of two elements, with the 95 % band of an alloy."""
    grid = np.linspace(mapped.contents[:, -1].min(), mapped.contents[:, -1].max(), 101)
    points = np.column_stack([1.0 - grid, grid][-len(mapped.elements) :])
    value, sd = mapped.log_rate.predict(points)
    low, middle, high = (PERCENT_PER_HOUR * np.exp(value + side * 1.96 * sd) for side in (-1, 0, 1))
    axes.fill_between(100 * grid, low, high, alpha=0.2, lw=0)
    axes.plot(100 * grid, middle)
    axes.errorbar(100 * mapped.contents[:, -1], PERCENT_PER_HOUR * np.exp(mapped.log_rate.values), fmt="o", ms=4)
    axes.set(yscale="log", xlabel=f"{mapped.elements[-1]}, at.%", ylabel="creep rate, %/h")
