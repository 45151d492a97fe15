"""The sections on one material: curves, tests, ranking of laws, noise and nuisance parameters."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from creepkit.errors import CreepkitError
from creepkit.inverse.nuisance_parameters import nuisance_unit
from creepkit.inverse.selection.discrimination import DISTINGUISHABLE_CHI_SQUARE, chi_square_by_test
from creepkit.records import output_unit
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
from creepkit.reports.html.findings import GroupFindings
from creepkit.reports.html.law_names import LawNames, title_in_sentence
from creepkit.reports.html.law_tables import correlation_table, titled_law
from creepkit.reports.html.methods_identification import rate_scatter_sentence
from creepkit.reports.html.page_figures import PageFigures
from creepkit.reports.identification_plot import identification_figure
from creepkit.reports.identification_text import rupture_rows
from creepkit.reports.judged_readings import LAW_RATE_MEANING, OWN_RATE_CHI_SQUARE, judged_readings
from creepkit.reports.load_programs import SECONDS_PER_HOUR
from creepkit.reports.minimum_rate_panel import compared_minimum_rates, exponent_sentence
from creepkit.reports.prediction_bands import fitted_curves
from creepkit.reports.ranking import explanation, misfit_cells, misfit_columns
from creepkit.reports.ranking_plot import misfit_name, misfit_of, ranking_figure
from creepkit.reports.residual_panels import residual_caption
from creepkit.reports.test_figure import fitted_test_figure, fitted_test_text

if TYPE_CHECKING:
    from creepkit.inverse.goodness_of_fit import TestFit
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.nuisance_parameters import NuisanceEstimate
    from creepkit.inverse.selection.ranking import Ranking


MOST_NAMED = 12
"""Tests that are named in a sentence."""


# ---- curves and tests ------------------------------------------------------------------------------------------------


def curve_blocks(found: GroupFindings, figures: PageFigures) -> list[Block]:
    """All tests in one figure: measured over identified, residuals, rates over stress, rupture."""
    fit = found.fit
    if not fit.histories or fit.predictor is None:
        return [Paragraph("No curves are drawn: the tests were not given with this identification.", "note")]
    minimum_rates = compared_minimum_rates(fit)
    panels = ["minimum creep rate over stress" if minimum_rates else "creep rate of the law over stress"]
    panels += ["time to rupture, identified over measured"] if rupture_rows(fit) else []
    exponents = exponent_sentence(minimum_rates) if minimum_rates else ""
    exponents = f" Minimum creep rates, {exponents}." if exponents else ""
    return [
        figures.picture(
            lambda: identification_figure(fit),
            f"Identified law and tests{_of(found)}",
            f"Curves of {plural(len(fit.histories), 'test')} over time with the law's 95 % bands, residuals, "
            f"{', '.join(panels)}.{exponents} The table of tests holds the numbers.",
            f"Measured (dots) and identified (lines with 95 % band); {residual_caption(fit)}; {'; '.join(panels)}.",
        )
    ]


def test_blocks(found: GroupFindings, figures: PageFigures, most: int) -> list[Block]:
    """A table of all tests, and a figure for each of those whose misfit is largest, at most so many."""
    fit = found.fit
    blocks: list[Block] = [_table_of_tests(fit), *[Paragraph(text, "note") for text in _without_misfit(fit)]]
    if rupture_rows(fit):
        blocks.append(_table_of_ruptures(fit))
    with_frames = [k for k, test in enumerate(fit.tests) if test.outputs]
    if not fit.histories or fit.predictor is None or not with_frames:
        return blocks
    curves = fitted_curves(fit)
    readings = judged_readings(fit)
    misfits = [misfit_of(test) if readings is None else readings.chi_square(k) for k, test in enumerate(fit.tests)]
    worst = sorted(with_frames, key=lambda k: -np.nan_to_num(misfits[k]))[:most]
    if len(worst) < len(with_frames):
        blocks.append(
            Paragraph(f"Drawn are the {len(worst)} of {len(with_frames)} tests whose misfit is largest.", "note")
        )
    blocks.append(
        Paragraph(f"Figures of tests: measured (dots), identified with 95 % band, and {residual_caption(fit)}.")
    )
    for k in sorted(worst):
        name = printable(fit.tests[k].name, 120)
        blocks.append(
            figures.picture(
                partial(fitted_test_figure, fit, curves, k),
                f"Test {name}",
                fitted_test_text(fit, curves, k),
                f"{name}: measured, identified and residuals.",
            )
        )
    return blocks


def _table_of_tests(fit: Identification) -> Table:
    rows = []
    compared, readings = compared_values(fit), judged_readings(fit)
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
            )
        )
    columns = (
        *("test", "condition", "values compared", "reduced chi-square, own rate", "misfit, the law's rate"),
        *("relative squared error", "offset", "rate × law", "weight"),
    )
    caption = (
        f"Tests: {OWN_RATE_CHI_SQUARE}. Beside it the {LAW_RATE_MEANING}. Relative squared error of the first output "
        "with the law's rate (sum of squared "
        "differences over that about the mean of the test; a dash: the law predicts no value at some of the readings, "
        "as after a rupture that it puts too early), and its offset; the test's own factor on the rate; weight of the "
        "test in the fit (1: as any other, less for one far from the others)"
    )
    return Table(caption, columns, rows, numeric=(2, 3, 4, 5, 6, 7, 8))


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


def _table_of_ruptures(fit: Identification) -> Table:
    rows = [
        (
            printable(name, 120),
            printable(condition, 200),
            f"{'> ' if r.censored else ''}{number(r.measured / SECONDS_PER_HOUR)}",
            number(r.predicted / SECONDS_PER_HOUR),
            f"{number(r.low / SECONDS_PER_HOUR)} to {number(r.high / SECONDS_PER_HOUR)}",
        )
        for name, condition, r in rupture_rows(fit)
    ]
    columns = (
        "test",
        "condition",
        "lasted, h",
        "by the law, h",
        "95 % interval of a single test if the law is right, h",
    )
    rejected = fit.adequacy is not None and fit.adequacy.verdict == "leaves a discrepancy"
    doubt = ". The tests contradict the law: the intervals do not have this probability" if rejected else ""
    caption = f"Rupture times; > marks tests that were stopped before{doubt}"
    return Table(caption, columns, rows, numeric=(2, 3, 4))


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
    """The sections on what was found, but for the verdict."""
    return [
        PageSection(f"{prefix}curves", "The law over the tests", curve_blocks(found, figures)),
        PageSection(f"{prefix}tests", "Tests", test_blocks(found, figures, most_tests)),
        PageSection(f"{prefix}ranking", "Laws tried", ranking_blocks(found, figures, drawn=ranking_drawn)),
        PageSection(f"{prefix}nuisances", "Noise, nuisance parameters and correlations", nuisance_blocks(found)),
    ]
