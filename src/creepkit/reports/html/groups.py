"""The sections on one material: curves, tests, ranking of laws, noise and nuisance parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from creepkit.errors import CreepkitError
from creepkit.inverse.nuisance_parameters import nuisance_unit
from creepkit.inverse.selection.discrimination import DISTINGUISHABLE_CHI_SQUARE, chi_square_by_test
from creepkit.records import output_unit
from creepkit.reports.answer import tests_text
from creepkit.reports.html.compared_values import compared_values
from creepkit.reports.html.elements import (
    Block,
    Items,
    PageSection,
    Paragraph,
    Table,
    number,
    plural,
    printable,
    sentence,
)
from creepkit.reports.html.findings import GroupFindings, values_section
from creepkit.reports.html.law_names import LawNames, title_in_sentence
from creepkit.reports.html.law_tables import correlation_table, titled_law
from creepkit.reports.html.methods_identification import rate_scatter_sentence
from creepkit.reports.html.svg import PageFigures
from creepkit.reports.identification_text import rejected, rupture_rows, scatter_of_rates
from creepkit.reports.judged_readings import LAW_RATE_MEANING, OWN_RATE_CHI_SQUARE, judged_readings
from creepkit.reports.load_programs import SECONDS_PER_HOUR
from creepkit.reports.ranking import explanation, misfit_cells, misfit_columns
from creepkit.reports.ranking_plot import misfit_name, misfit_of, ranking_figure
from creepkit.reports.residual_panels import residual_caption
from creepkit.reports.test_figure import small_multiples

if TYPE_CHECKING:
    from creepkit.inverse.goodness_of_fit import TestFit
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.nuisance_parameters import NuisanceEstimate
    from creepkit.inverse.selection.ranking import Ranking
    from creepkit.inverse.single_values import SingleValue


MOST_NAMED = 12
"""Tests that are named in a sentence."""


# ---- tests -----------------------------------------------------------------------------------------------------------


def test_blocks(found: GroupFindings, figures: PageFigures, most: int) -> list[Block]:
    """A table of all tests, and small multiples of those whose misfit is largest, at most so many."""
    fit = found.fit
    blocks: list[Block] = [_table_of_tests(fit), *[Paragraph(text, "note") for text in _without_misfit(fit)]]
    worst = _worst_tests(fit)[:most]
    if not fit.histories or fit.predictor is None or not worst:
        return blocks
    which = "" if len(worst) == len(fit.tests) else f"; the {len(worst)} of {len(fit.tests)} of largest misfit"
    caption = f"Tests one by one{_of(found)}: measured, by the law, and {residual_caption(fit)}{which}."
    description = f"Curves and residuals of {plural(len(worst), 'test')}; the table of tests holds the numbers."
    title = f"Tests one by one{_of(found)}"
    blocks.append(figures.picture(lambda: small_multiples(fit, sorted(worst)), title, description, caption))
    return blocks


def _worst_tests(fit: Identification) -> list[int]:
    """Positions of tests with frames, the largest misfit first."""
    readings = judged_readings(fit)
    misfits = [misfit_of(test) if readings is None else readings.chi_square(k) for k, test in enumerate(fit.tests)]
    return sorted((k for k, t in enumerate(fit.tests) if t.outputs), key=lambda k: -np.nan_to_num(misfits[k]))


def _table_of_tests(fit: Identification) -> Table:
    rows = []
    compared, readings, ruptures = compared_values(fit), judged_readings(fit), bool(rupture_rows(fit))
    for k, test in enumerate(fit.tests):
        first = test.outputs[0] if test.outputs else None
        unit = f" {output_unit(first.output)}" if first is not None and output_unit(first.output) else ""
        rows.append(
            (
                printable(test.name, 120),
                printable(test.condition, 200),
                "not known" if compared is None else str(compared.by_test.get(test.name, 0)),
                "–" if readings is None else number(readings.chi_square(k), 3),
                "–" if readings is None else number(readings.misfit_of_common_rate(k), 3),
                "–" if first is None else number(first.errors.relative_squared_error, 2),
                "–" if first is None else f"{number(first.offset, 2)}{unit}",
                number(test.rate_factor, 3),
                number(test.weight, 2),
                *(_life_cells(test.rupture) if ruptures else ()),
            )
        )
    columns = [
        *("test", "condition", "values", "reduced chi-square, own rate", "misfit, the law's rate"),
        *("relative squared error", "offset", "rate × law", "weight"),
        *(("lasted, h", "by the law, h") if ruptures else ()),
    ]
    caption = (
        f"{OWN_RATE_CHI_SQUARE[:1].upper()}{OWN_RATE_CHI_SQUARE[1:]}. Beside it the {LAW_RATE_MEANING}. Relative "
        "squared error and offset of the first output with the law's rate; a dash: no value is predicted at some "
        "readings, as after a rupture. Weight in the fit: 1 as any other, less for one far from the others"
    )
    if ruptures:
        rejected = fit.adequacy is not None and fit.adequacy.verdict == "leaves a discrepancy"
        right = "which the tests contradict" if rejected else "if the law is right"
        caption += f". Lives: > marks tests that were stopped; 95 % intervals of a single test, {right}"
    return Table(caption, columns, rows, numeric=tuple(range(2, len(columns))))


def _life_cells(life: SingleValue | None) -> tuple[str, str]:
    """How long a test lasted, and how long by the law with the interval of a single test."""
    if life is None or not life.used:
        return "", ""
    low, predicted, high = (number(v / SECONDS_PER_HOUR) for v in (life.low, life.predicted, life.high))
    measured = f"{'> ' if life.censored else ''}{number(life.measured / SECONDS_PER_HOUR)}"
    return measured, f"{predicted} [{low}, {high}]"


def _without_misfit(fit: Identification) -> list[str]:
    """Why chi-square of tests is a dash in their table, a sentence for each reason."""
    readings = judged_readings(fit)
    if readings is None:
        if not fit.histories or fit.predictor is None:
            return ["χ² is a dash: the tests were not given with this identification."]
        return ["χ² is a dash: the noise of a reading is not known well enough to judge by, as the findings say."]
    others = [t for k, t in enumerate(fit.tests) if t.outputs and not readings.mask(k).any()]
    return [f"χ² is a dash where the noise of a reading is not known: {_listed_tests(others)}."] if others else []


def _listed_tests(tests: Sequence[TestFit]) -> str:
    named = ", ".join(printable(test.name, 120) for test in tests[:MOST_NAMED])
    return f"{named} and {len(tests) - MOST_NAMED} more" if len(tests) > MOST_NAMED else named


def _of(found: GroupFindings) -> str:
    return f" of {printable(found.name, 80)}" if found.name else ""


# ---- ranking ---------------------------------------------------------------------------------------------------------


def ranking_blocks(found: GroupFindings, figures: PageFigures, *, drawn: bool) -> list[Block]:
    """The laws tried with misfits and weights, and what separates them: the misfit of each law in each test."""
    ranking = found.ranking
    if ranking is None:
        return []
    names = LawNames.of(found.fits)
    rows = [
        (
            titled_law(one.fit.law),
            str(len(one.fit.law.params)),
            *misfit_cells(one.fit),
            number(one.excess, 3),
            f"{one.weight:.3f}",
            explanation(one.fit),
        )
        for one in ranking.laws
    ]
    columns = (
        *("law", "parameters", *misfit_columns(ranking.best)),
        *(f"{criterion_name(ranking)} − best", "weight", "by the noise of the tests"),
    )
    blocks: list[Block] = [Table("Laws tried, the best first", columns, rows, numeric=(1, 2, 3, 4, 5))]
    separation = [names.in_text(text) for text in _separation(ranking)]
    blocks += [Paragraph(text) for text in separation]
    if ranking.challenges:
        blocks += [
            Paragraph("What the tests allow beside the best law:"),
            Items([sentence(names.in_text(str(challenge))) for challenge in ranking.challenges]),
        ]
    if ranking.failed:
        blocks.append(Items([sentence(f"the law {name}: {reason}") for name, reason in ranking.failed.items()]))
    if drawn and ranking.best.tests:
        blocks.append(
            figures.picture(
                lambda: ranking_figure(ranking),
                f"Misfit of each law in each test{_of(found)}",
                f"{sentence(misfit_name(ranking))} {plural(len(ranking.laws), 'law')} in "
                f"{plural(len(ranking.best.tests), 'test')}, the weights of the laws, and the curves of the credible "
                f"ones. {' '.join(separation)} Weights: "
                + ", ".join(f"{title_in_sentence(r.fit.law)} {r.weight:.3f}" for r in ranking.laws)
                + ".",
                f"Where the laws differ: {misfit_name(ranking)}, and weights.",
            )
        )
    return blocks


def _separation(ranking: Ranking) -> list[str]:
    """The test that speaks most for the best law against the second, and by how much the second is worse in all."""
    if len(ranking.laws) < 2 or ranking.criterion == "hold-out" or len(ranking.best.tests) < 2:
        return []
    fits, second = [one.fit for one in ranking.laws], ranking.laws[1]
    if any(fit.linearised is None for fit in fits):
        fits = fits[:2]  # others cost a prediction each
    if any(fit.linearised is None and (not fit.histories or fit.predictor is None) for fit in fits):
        return []
    try:
        chi_square = chi_square_by_test(fits)
    except CreepkitError:
        return []
    differences = chi_square[1] - chi_square[0]
    if not np.isfinite(differences).all():
        return []
    if min(float(differences.sum()), second.excess) < DISTINGUISHABLE_CHI_SQUARE:
        return []
    k, name = int(np.argmax(differences)), second.fit.law.name
    against = float(np.maximum(differences, 0.0).sum())
    share = f"{100 * float(differences[k]) / against:.0f} % of the chi-square that speaks against {name} is its own; "
    test = f"test {printable(fits[0].tests[k].name, 120)} ({printable(fits[0].tests[k].condition, 200)})"
    criterion = criterion_name(ranking)
    return [
        f"What separates {name} from {fits[0].law.name} most is {test}: {share}"
        f"{criterion} of {name} is {number(second.excess, 3)} larger in all."
    ]


def criterion_name(ranking: Ranking) -> str:
    """The abbreviation of the criterion by which laws are ranked."""
    return {"bic": "BIC", "aicc": "AICc"}.get(ranking.criterion, ranking.criterion)


# ---- nuisance parameters ---------------------------------------------------------------------------------------------


def nuisance_blocks(found: GroupFindings) -> list[Block]:
    """Noise and scatter as they were estimated, and explicit nuisance parameters."""
    fit = found.fit
    noise = [
        (
            name.replace("_", " "),
            _judged_noise(fit, name),
            number(one.noise, 2),
            number(one.offset, 2),
            output_unit(name) or "1",
        )
        for name, one in fit.noise_model.outputs.items()
    ]
    blocks: list[Block] = [Paragraph(rate_scatter_sentence(fit))]
    if noise:
        blocks.append(
            Table(
                "Noise as it was estimated, one standard deviation: of a reading from what its test states or its "
                "neighbouring readings show, by which the law is judged; and in the weights of the fit",
                ("output", "of a reading", "of a reading, one for all in the fit", "of the offset of a test", "unit"),
                noise,
                numeric=(1, 2, 3),
            )
        )
    rows = [
        (
            n.key,
            printable(n.owner, 120) or "all",
            f"{number(n.value)} ± {number(n.sd, 2)}",
            f"{number(n.prior_mean)} ± {number(n.prior_sd, 2)}",
            _nuisance_unit(n, fit),
            number((n.value - n.prior_mean) / n.prior_sd, 2) if n.prior_sd > 0 else "–",
        )
        for n in fit.nuisances
    ]
    if rows:
        columns = ("nuisance parameter", "of", "estimate", "prior", "unit", "deviation over sd of the prior")
        blocks.append(Table("Nuisance parameters estimated beside the law", columns, rows, numeric=(2, 3, 5)))
    return [*blocks, *correlation_table(fit)]


def _judged_noise(fit: Identification, output: str) -> str:
    """The noise of a reading by which the law is judged; its ends where readings differ."""
    readings = judged_readings(fit)
    ends = None if readings is None else readings.noise(output=output)
    if ends is None:
        return "–"
    low, high = (number(end, 2) for end in ends)
    return low if low == high else f"{low} to {high}"


def _nuisance_unit(nuisance: NuisanceEstimate, fit: Identification) -> str:
    """In words of the table: 1 of pure numbers; of an offset that of the outputs where these have one in common."""
    units = {output_unit(name) or "1" for name in fit.noise_model.outputs}
    return nuisance_unit(nuisance.kind) or (units.pop() if nuisance.kind == "offset" and len(units) == 1 else "1")


def group_sections(
    found: GroupFindings, figures: PageFigures, prefix: str, *, most_tests: int, ranking_drawn: bool
) -> Sequence[PageSection]:
    """The sections on what was found behind the answer."""
    fit, ranking = found.fit, found.ranking
    worst = _worst_tests(fit)[:1]
    far = f"; farthest from the law: {printable(fit.tests[worst[0]].name, 60)}" if len(fit.tests) > 1 and worst else ""
    none = ", none of which explains the tests" if rejected(fit) else f": weight {found.weight:.2f}"
    laws = "" if ranking is None else f"best of {plural(len(ranking.laws), 'law')}{none}"
    noise = (
        f"rates of tests scatter by {scatter_of_rates(fit)}" if len(fit.tests) > 1 else "of the readings of one test"
    )
    tests, ranked = test_blocks(found, figures, most_tests), ranking_blocks(found, figures, drawn=ranking_drawn)
    return [
        values_section(found, prefix),
        PageSection(f"{prefix}tests", "Tests", tests, result=f"{tests_text(fit)}{far}"),
        PageSection(f"{prefix}ranking", "Laws compared", ranked, result=laws),
        PageSection(f"{prefix}nuisances", "Noise and nuisance parameters", nuisance_blocks(found), result=noise),
    ]
