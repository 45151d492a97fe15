"""What was found of one material, whatever it was found by, and the blocks that say so: verdict, formula, values."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from markupsafe import Markup

from creepkit.exporters.mathml import expression_mathml, law_equations
from creepkit.inverse.compared_tests import STRAIN_OF_UNKNOWN_DURATION, duration_known
from creepkit.inverse.perturbation import NOT_INCLUDED
from creepkit.inverse.uncertainty.laplace_approximation import bound_marks
from creepkit.reports.answer import MOST_CAUTIONS, KeyFigure, cautions, key_figures, next_step, tests_text
from creepkit.reports.html.elements import (
    Answer,
    Block,
    Items,
    PageSection,
    Paragraph,
    Table,
    number,
    plural,
    printable,
    sentence,
    with_interval,
)
from creepkit.reports.html.law_names import LawNames, title_in_sentence
from creepkit.reports.html.law_tables import credible_values, titled_law, verdict_given_law
from creepkit.reports.html.single_values import single_value_blocks
from creepkit.reports.identification_plot import summary_figure
from creepkit.reports.identification_text import rejected, rupture_rows
from creepkit.reports.interval_basis import interval_basis
from creepkit.reports.ranking import equivalents_among_remaining
from creepkit.reports.stress_exponents import reference_sentences

if TYPE_CHECKING:
    from collections.abc import Sequence

    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection.ranking import Ranking
    from creepkit.quality.flags import DataQuality
    from creepkit.reports.contents import ReportGroup
    from creepkit.reports.html.svg import PageFigures


REJECTED = (
    "This law does not fit the tests. Its values only bring it as near to them as it comes: what the tests determine, "
    "and the creep rate and the stress exponent amid them, are not derived from it."
)


_DEPENDENCE = re.compile(r" with [\w-]+ temperature dependence")
"""Of titles in a headline, which the equation shows."""


MOST_FILES = 4
"""On the first screen."""


@dataclass(frozen=True)
class GroupFindings:
    """What was found of one material, whatever it was found by.

    name : of the material, "" where there is only one. fit : the best law, with its values in the author's units.
    ranking : of all laws, None where one law alone was identified. verdict : in a sentence.
    equivalents : pairs of laws that the tests do not separate, a sentence each. remarks : further sentences.
    decisive : whether the verdict is that this law is the one, None where no laws were compared.
    """

    name: str
    fit: Identification
    ranking: Ranking | None
    verdict: str
    equivalents: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    decisive: bool | None = None

    @property
    def weight(self) -> float:
        """Of the best law among those compared, 1 of one law alone."""
        return 1.0 if self.ranking is None else self.ranking.laws[0].weight

    @property
    def fits(self) -> list[Identification]:
        """Of all laws, the best first."""
        return [self.fit] if self.ranking is None else [one.fit for one in self.ranking.laws]


def findings_of(group: ReportGroup) -> GroupFindings | None:
    """What was found of a group, laws in its sentences by their titles; None where nothing was."""
    found = _found(group)
    if found is None:
        return None
    in_text = LawNames.of(found.fits).in_text
    equivalents, remarks = tuple(map(in_text, found.equivalents)), tuple(map(in_text, found.remarks))
    return replace(found, verdict=in_text(found.verdict), equivalents=equivalents, remarks=remarks)


def _found(group: ReportGroup) -> GroupFindings | None:
    """The same with the names of laws, by which commands know them."""
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.selection.ranking import RankedLaw, Ranking
    from creepkit.screening.results import AlloyResult

    result = group.result
    if isinstance(result, AlloyResult):
        if not result.identified:
            return None
        laws = tuple(RankedLaw(w.fit, w.bic_difference, w.weight) for w in result.laws)
        ranking = Ranking(laws, failed=result.failed_laws) if len(laws) > 1 else None
        decisive = None if ranking is None else result.decisive
        return GroupFindings(
            group.name, result.best, ranking, result.verdict, result.equivalents, result.notes, decisive
        )
    if isinstance(result, Ranking):
        equivalents = () if result.decisive else tuple(map(str, equivalents_among_remaining(result)))
        return GroupFindings(group.name, result.best, result, result.verdict, equivalents, (), result.decisive)
    if isinstance(result, Identification):
        adequacy = "was identified; whether the tests contradict it is not known"
        adequacy = adequacy if result.adequacy is None else str(result.adequacy)
        law = f"the {title_in_sentence(result.law)}" if result.law.title else f"the law '{result.law.name}'"
        return GroupFindings(group.name, result, None, f"{law} {adequacy}")
    return None


def with_histories(group: ReportGroup) -> ReportGroup:
    """The group with its histories taken from its result where it states none."""
    found = findings_of(group)
    return group if group.histories or found is None else replace(group, histories=found.fit.histories)


# ---- the answer ------------------------------------------------------------------------------------------------------


def answer_block(
    found: GroupFindings,
    figures: PageFigures,
    *,
    asked: Sequence[KeyFigure] = (),
    quality: DataQuality | None = None,
    files: Sequence[tuple[str, str, str]] = (),
) -> Answer:
    """The first screen of one material. asked : what forecasts say, quality : of its data, files : to download."""
    fit, in_text = found.fit, LawNames.of(found.fits).in_text
    picture = None
    if fit.histories and fit.predictor is not None:
        rupture = ", and times to rupture, identified over measured" if rupture_rows(fit) else ""
        title = f"The law over the tests{f' of {printable(found.name, 80)}' if found.name else ''}"
        description = f"Curves of {plural(len(fit.tests), 'test')} over time, creep rate over stress{rupture}."
        picture = figures.picture(lambda: summary_figure(fit), title, description, f"{title}: {tests_text(fit)}.")
    rows = [
        (one.name, printable(one.where, 160), one.text(number), one.remark) for one in [*asked[:2], *key_figures(fit)]
    ]
    said = [sentence(in_text(text)) for text in cautions(fit, found.ranking, quality)[:MOST_CAUTIONS]]
    equations = [Markup(equation) for equation in law_equations(fit.law)]
    headline = sentence(_DEPENDENCE.sub("", in_text(fit.headline)))
    step = sentence(next_step(fit, found.ranking))
    return Answer(
        headline, picture, titled_law(fit.law), equations, _on_a_line(fit), rows, said, step, files[:MOST_FILES]
    )


def _on_a_line(fit: Identification) -> Markup:
    """The parameters with their values; intervals are in the table of values."""
    symbols = {str(symbol): symbol for symbol in fit.law.params}
    texts = [
        Markup("{} = {}{}").format(
            Markup(expression_mathml(symbols[e.name])), number(e.value, 4), "" if e.unit == "1" else f" {e.unit}"
        )
        for e in fit.estimates
    ]
    return Markup(", ").join(texts)


# ---- values and verdict ----------------------------------------------------------------------------------------------


def values_section(found: GroupFindings, prefix: str = "") -> PageSection:
    """The values with intervals, what they rest on, what is not determined, and the verdict by the noise."""
    fit = found.fit
    determined = sum(e.verdict == "determined" for e in fit.estimates)
    result = f"{determined} of {plural(len(fit.estimates), 'value')} determined by these tests"
    return PageSection(f"{prefix}values", "Values and verdict", _value_blocks(found), result=result)


def _value_blocks(found: GroupFindings) -> list[Block]:
    fit = found.fit
    misfit = rejected(fit)
    blocks: list[Block] = [_values(fit), Paragraph(sentence(found.verdict))]
    if found.equivalents:
        blocks.append(Items([sentence(text) for text in found.equivalents]))
    if fit.adequacy is not None and (found.ranking is not None or misfit) and str(fit.adequacy) not in found.verdict:
        blocks.append(Paragraph(sentence(f"the law {fit.adequacy}")))
    blocks += [] if misfit else [_point(fit)]
    blocks += single_value_blocks(fit)
    blocks += [Paragraph(sentence(text)) for text in interval_basis(fit)]
    undetermined = () if misfit else _undetermined(fit)
    if misfit:
        blocks.append(Paragraph(REJECTED))
    elif undetermined:
        blocks += [Paragraph("What these tests do not determine, or poorly, given this law:"), Items(undetermined)]
    blocks += credible_values(found.ranking)
    unmodelled = [sentence(effect.sentence) for effect in fit.unmodelled if not effect.included]
    if unmodelled:
        blocks += [
            Paragraph("The intervals do not include what would move the rate amid the tests:"),
            Items(unmodelled),
        ]
    notes = [note for note in fit.notes if not (unmodelled and note.startswith(NOT_INCLUDED))]  # said above
    remarks = list(dict.fromkeys(map(sentence, [*found.remarks, *map(LawNames.of(found.fits).in_text, notes)])))
    return [*blocks, Paragraph("Remarks:"), Items(remarks)] if remarks else blocks


def _undetermined(fit: Identification) -> list[str]:
    return [sentence(text) for text in fit.undetermined()]


def _values(fit: Identification) -> Table:
    """Values with intervals; of a law that the tests reject only which of them these would not determine."""
    table, symbols = fit.law.table, {str(symbol): symbol for symbol in fit.law.params}
    rows = [
        (
            Markup(expression_mathml(symbols[e.name])),
            table[e.name].meaning,
            *with_interval(e.value, e.low, e.high, bound_marks(fit.law, e)),
            "" if e.unit == "1" else e.unit,
            "–" if rejected(fit) and e.verdict == "determined" else verdict_given_law(fit, e),
        )
        for e in fit.estimates
    ]
    interval = "95 % interval, if the law held" if rejected(fit) else "95 % interval"
    last = "by these tests, if the law held" if rejected(fit) else "by these tests, given this law"
    columns = ("parameter", "meaning", "value", interval, "unit", last)
    caption = "Values for stress in MPa as a ratio to 1 MPa, and time in s as a ratio to 1 s"
    caption = f"A law that does not fit the tests: v{caption[1:]}" if rejected(fit) else caption
    return Table(caption, columns, rows, numeric=(2, 3))


def _point(fit: Identification) -> Paragraph:
    """Rate and stress exponent at the reference point, and which derivative the exponent is."""
    lines = [*reference_sentences(fit, lambda v, digits: number(v, digits))]
    return Paragraph(" ".join(f"{line[:1].upper()}{line[1:]}." for line in lines) + _assumed_duration(fit))


def _assumed_duration(fit: Identification) -> str:
    """What is said of the reference point where it rests on tests whose duration is not known."""
    unknown = sum(not duration_known(history) for history in fit.histories)
    if not unknown:
        return ""
    return (
        f" The strain and the time of this point are assumed: of {plural(unknown, 'test')} only a minimum creep rate "
        "is known, not the duration, and each is taken to last until a strain of "
        f"{100 * STRAIN_OF_UNKNOWN_DURATION:g} % at that rate."
    )
