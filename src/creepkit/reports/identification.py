"""What an identification says beyond its answer: values and verdict, tests, noise, and texts of what follows it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import median
from typing import TYPE_CHECKING

import numpy as np

from creepkit.inverse.adequacy import UNDETECTED_SCATTER
from creepkit.inverse.compared_tests import STRAIN_OF_UNKNOWN_DURATION, duration_known, rests_on_durations
from creepkit.inverse.extrapolation import SAME_STRESS, stresses_at_temperatures
from creepkit.inverse.nuisance_parameters import beyond_intervals, nuisance_unit
from creepkit.inverse.observation_vector import RELATIVE_DISCREPANCY_UNIT, RUPTURE_OUTPUT
from creepkit.inverse.uncertainty.correlation import STRONG_CORRELATION, Correlation
from creepkit.inverse.uncertainty.laplace_approximation import interval_ends
from creepkit.records import SECONDS_PER_HOUR, is_logarithmic, output_unit
from creepkit.records.units import celsius_text
from creepkit.reports.advice import cautions
from creepkit.reports.answer import (
    MOST_CAUTIONS,
    chosen_text,
    constant_load_sentence,
    equations,
    key_figures,
    reference_sentences,
    symbols_of,
    unit_text,
    value_cells,
)
from creepkit.reports.blocks import (
    Block,
    Cell,
    Formula,
    Items,
    Paragraph,
    Table,
    aligned,
    as_text,
    ends,
    first_of,
    listed,
    named,
    number,
    plural,
)
from creepkit.reports.compared_values import (
    LAW_RATE_MEANING,
    OWN_RATE_CHI_SQUARE,
    compared_observations,
    judged_readings,
    misfit_of,
)
from creepkit.reports.description import mean_misfit_text, rejected
from creepkit.reports.identification_plot import residual_caption, small_multiples
from creepkit.reports.methods import rate_scatter_sentence
from creepkit.reports.rate_panels import PERCENT_PER_HOUR, rupture_rows
from creepkit.reports.verdicts import perturbation_text, remarks
from creepkit.reports.wording import amount_text, shown_unit

if TYPE_CHECKING:
    from creepkit.inverse.cross_validation import CrossValidation
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.nuisance_parameters import NuisanceEstimate
    from creepkit.inverse.selection.ranking import ModelAverage, Ranking
    from creepkit.inverse.single_values import SingleValue
    from creepkit.inverse.sparsity.result import Sparsity
    from creepkit.inverse.uncertainty.correlation import Correlation
    from creepkit.inverse.uncertainty.importance_sampling import PosteriorSamples
    from creepkit.inverse.uncertainty.laplace_approximation import Estimate
    from creepkit.reports.svg import PageFigures


MOST_NAMED = 12
"""Tests, or temperatures, that are named in a sentence."""


MOST_CORRELATED = 12
"""Parameters up to which their correlations are a table."""


REJECTED = (
    "this law does not fit the tests: its values only bring it as near to them as it comes; rates and stress exponents "
    "of the tests are not derived from it"
)


def identification_text(fit: Identification) -> str:
    """Everything: the law, its values with 95 % intervals, the verdict, the tests, noise and nuisance parameters."""
    head: list[Block] = [Paragraph(fit.law.title or fit.law.name), Paragraph(fit.headline)]
    head.append(Items([one.line for one in key_figures(fit)]))
    formulas = [Formula(one) for one in equations(fit.law)]
    return as_text([*head, *formulas, *value_blocks(fit), *blocks_of_tests(fit, None), *noise_blocks(fit)])


# ---- values and verdict ----------------------------------------------------------------------------------------------


def value_blocks(fit: Identification, verdict: str = "", equivalents: Sequence[str] = ()) -> list[Block]:
    """The values with intervals, what these rest on, what is not determined, and the verdict by the noise.

    verdict : of a comparison of laws, with pairs that cannot be told apart, a sentence each.
    """
    blocks: list[Block] = [_values(fit)]
    blocks += [Paragraph(verdict), Items(equivalents)] if verdict else []
    if fit.adequacy is not None and str(fit.adequacy) not in verdict:
        blocks.append(Paragraph(f"the law {fit.adequacy}"))
    if rejected(fit):
        blocks.append(Paragraph(REJECTED))
    else:
        blocks += [Paragraph(text) for text in reference_sentences(fit)]
        blocks += [Paragraph(text) for text in _assumed_duration(fit)]
    blocks += [Paragraph(text) for text in (*_left_out(fit), *interval_basis(fit))]
    blocks += [] if fit.sparsity is None else [Paragraph(fit.sparsity.verdict)]
    if not rejected(fit):
        blocks.append(Items(fit.undetermined(), "what these tests do not determine, or poorly, given this law:"))
    unmodelled = [perturbation_text(effect) for effect in beyond_intervals(fit.unmodelled)]
    blocks.append(Items(unmodelled, "the intervals do not include what would move the rate amid the tests:"))
    return [*blocks, Items(remarks(fit, perturbations=False), "remarks:")]


def _values(fit: Identification) -> Table:
    """Values with intervals; of a law that the tests reject only which of them these would not determine."""
    table, symbols, held = fit.law.table, symbols_of(fit.law), ", if the law held" * rejected(fit)
    rows: list[dict[str, Cell]] = [
        {
            "parameter": symbols[e.name],
            "meaning": table[e.name].meaning,
            **value_cells(fit.law, e, held),
            f"by these tests{held or ', given this law'}": (
                "–" if held and e.verdict == "determined" else verdict_given_law(fit, e)
            ),
        }
        for e in fit.estimates
    ]
    caption = "values to ten digits (JSON has all), for stress as a ratio to 1 MPa and time as a ratio to 1 s"
    return Table.of(f"{'a law that does not fit the tests: ' * bool(held)}{caption}", rows)


def verdict_given_law(fit: Identification, estimate: Estimate) -> str:
    """What tests say of a parameter given its law; of a law that they do not test, that they do not."""
    untested = rests_on_durations(fit.law, fit.histories)
    return f"{estimate.verdict}, but not testable" if untested else estimate.verdict


def _assumed_duration(fit: Identification) -> list[str]:
    """What is said of the reference point where it rests on tests whose duration is not known."""
    unknown = sum(not duration_known(history) for history in fit.histories)
    if not unknown:
        return []
    return [
        f"the strain and the time of this point are assumed: of {plural(unknown, 'test')} only a minimum creep rate is "
        f"known, not the duration, and each is taken to last until a strain of {100 * STRAIN_OF_UNKNOWN_DURATION:g} % "
        "at that rate"
    ]


def _left_out(fit: Identification) -> list[str]:
    """Between which the stress exponent lies where one test is left out, of a law that is not rejected; and which test
    is farthest from the others; none of fewer tests than four.
    """
    if not fit.left_out:
        return []
    low, high = min(fit.left_out, key=lambda one: one.exponent), max(fit.left_out, key=lambda one: one.exponent)
    far = max(fit.left_out, key=lambda one: abs(one.log_factor) / one.sd)
    factor = math.exp(far.log_factor)
    span = f"{low.exponent:.3g} (without '{low.test}') to {high.exponent:.3g} (without '{high.test}')"
    return [
        *([] if rejected(fit) else [f"leaving one test out: stress exponent {span}"]),
        f"farthest from the others: '{far.test}', {factor:.3g} times their rate "
        f"[{factor * math.exp(-1.96 * far.sd):.3g}, {factor * math.exp(1.96 * far.sd):.3g}]",
    ]


# ---- what intervals rest on ------------------------------------------------------------------------------------------


def interval_basis(fit: Identification) -> list[str]:
    """What intervals rest on: errors of the tests, the weights of the readings, and the form of the law.

    That they hold only with the form of the law is not said of a law that the tests reject: none of its values does.
    """
    conditional = "" if rejected(fit) else constant_load_sentence(fit)
    return [*_usual_errors(fit), WEIGHTS[fit.settings.weights], *([conditional] if conditional else [])]


def _usual_errors(fit: Identification) -> list[str]:
    """Which errors of tests the intervals include, of which size, and how wide they are without."""
    included = {one.kind: one.amount for one in fit.unmodelled if one.included}
    if not included:
        return ["the intervals take the temperatures, loads and dimensions of the tests as exactly known"]
    errors = ", ".join(f"{kind} {amount}" for kind, amount in included.items())
    begin = f"the intervals include errors of the tests that nobody measured (one standard deviation: {errors})"
    if rejected(fit) or not fit.estimates:
        return [begin]
    rates = [one.rate(fit.tested_point.stress, warn=False) for one in (fit, fit.by_tests_alone)]
    with_errors, without = (float(high / value) for value, _, high in rates)
    exact = f'{without:.3g} if these were exact (usual_errors="none")'
    return [begin, f"the rate amid the tests is known to a factor of {with_errors:.3g}; {exact}"]


WEIGHTS = {
    "likelihood": 'the intervals rest on the likelihood (weights "likelihood"): readings count by their noise',
    "equal": 'the intervals rest on readings of equal weight (weights "equal") and all the scatter that was estimated',
}
"""{weights of a fit: what its intervals rest on}."""


# ---- tests -----------------------------------------------------------------------------------------------------------


def blocks_of_tests(fit: Identification, figures: PageFigures | None, *, of: str = "", most: int = 0) -> list[Block]:
    """Tables of the tests and, with `figures`, small multiples of those of largest misfit, at most so many.

    of : the material, " of CMSX-4".
    """
    contradicting = None if fit.adequacy is None else fit.adequacy.contradicting
    blocks: list[Block] = [] if contradicting is None else [Paragraph(str(contradicting), "warning")]
    blocks.append(_table_of_tests(fit))
    blocks += [Paragraph(text, "note") for text in (*_sums(fit), *_without_misfit(fit))]
    worst = worst_tests(fit)[:most]
    if figures is not None and fit.histories and fit.predictor is not None and worst:
        which = "" if len(worst) == len(fit.tests) else f"; the {len(worst)} of {len(fit.tests)} of largest misfit"
        title = f"Tests one by one{of}"
        caption = f"{title}: measured, by the law, and {residual_caption(fit)}{which}."
        description = f"Curves and residuals of {plural(len(worst), 'test')}; the table of tests holds the numbers."
        blocks.append(figures.picture(lambda: small_multiples(fit, sorted(worst)), title, description, caption))
    return blocks


def worst_tests(fit: Identification) -> list[int]:
    """Positions of tests with frames, the largest misfit first."""
    readings = judged_readings(fit)
    misfits = [misfit_of(test) if readings is None else readings.chi_square(k) for k, test in enumerate(fit.tests)]
    return sorted((k for k, t in enumerate(fit.tests) if t.outputs), key=lambda k: -np.nan_to_num(misfits[k]))


def _table_of_tests(fit: Identification) -> Table:
    """Of each test its misfits, and its minimum rate and life beside those by the law; empty columns are left out."""
    rows = []
    observations, readings = compared_observations(fit), judged_readings(fit)
    for k, test in enumerate(fit.tests):
        first, end = test.outputs[0] if test.outputs else None, test.rupture
        rows.append(
            (
                test.name,
                test.condition,
                "not known" if observations is None else str(int(observations.present[k].sum())),
                "–" if readings is None else number(readings.chi_square(k), 3),
                "–" if readings is None else number(readings.misfit_of_common_rate(k), 3),
                "–" if first is None else number(first.errors.relative_squared_error, 2),
                "–" if first is None else amount_text(first.offset, first.output),
                number(test.rate_factor, 3),
                number(test.life_factor, 3) if fit.noise_model.life > UNDETECTED_SCATTER else "–",
                *_single_cells(None if first is not None else test.minimum_rate, 1.0 / PERCENT_PER_HOUR),
                *_single_cells(end if first is None or (end and end.used) else None, SECONDS_PER_HOUR),
            )
        )
    columns = [
        *("test", "condition", "values", "χ², own rate", "misfit, law's rate", "squared error", "offset"),
        *("rate × law", "damage × law", "minimum rate, %/h", "by the law, %/h", "law / measured"),
        *("lasted, h", "by the law, h", "law / measured"),
    ]
    of_curves = "relative squared error and offset of the first output with the law's rate; a dash: no value is "
    of_lives = "> marks tests that were stopped; in brackets: 95 % intervals of a single test"
    without_ends = any(t.rupture and not t.rupture.used for t in fit.tests)
    captions = {
        f"{OWN_RATE_CHI_SQUARE}. Beside it the {LAW_RATE_MEANING}": readings is not None,
        f"{of_curves}predicted at some readings, as after a rupture": any(t.outputs for t in fit.tests),
        f"{of_lives}{_if_the_law_holds(fit)}": any(t.minimum_rate or t.rupture for t in fit.tests),
        "the law was identified without the ends of some tests": without_ends,
    }
    return Table(". ".join(f"{one[0].upper()}{one[1:]}" for one, said in captions.items() if said), columns, rows)


def _sums(fit: Identification) -> list[str]:
    """Over all tests: the misfit of logarithmic strains, minimum rates and rupture times, predicted over measured."""
    lines, ruptures = [], rupture_rows(fit)
    if name := logarithmic_output(fit):
        tests = [m for m in fit.tests if m.outputs and m.outputs[0].output == name]
        label = "rms distance in ln strain and ln time" if ruptures else "rms of ln strain"
        lines.append(f"{plural(len(tests), 'test')}, {sum(m.frames for m in tests)} readings: {label} {fit.rms:.3g}")
    rates = [m.minimum_rate for m in fit.tests if m.minimum_rate is not None]
    for what, values in (("minimum rates of tests without curves", rates), ("rupture times", ruptures)):
        known = [one.ratio for one in values if not one.censored and math.isfinite(one.ratio)]
        inside = sum(one.low <= one.measured <= one.high for one in values if not one.censored)
        if known:
            span = f"{min(known):.3g} to {max(known):.3g}, median {median(known):.3g}"
            lines.append(
                f"{len(known)} {what}: predicted over measured {span}; {inside} within the 95 % interval of a single "
                f"test{_if_the_law_holds(fit)}"
            )
    if stopped := [one for one in ruptures if one.censored]:
        unexpected = sum(one.predicted < one.measured for one in stopped)
        lines.append(
            f"{plural(len(stopped), 'test')} stopped before rupture, of which {unexpected or 'none'} should have broken"
        )
    return lines


def _if_the_law_holds(fit: Identification) -> str:
    """The condition of intervals of single tests."""
    return ", which they do not have: the tests reject the law" if rejected(fit) else ", if the law holds"


def _without_misfit(fit: Identification) -> list[str]:
    """Why chi-square of tests is a dash in their table, a sentence for each reason."""
    readings = judged_readings(fit)
    if readings is None:
        if not fit.histories or fit.predictor is None:
            return ["no χ² is known: the tests were not given with this identification"]
        return ["no χ² is known: the noise of a reading is not, well enough to judge by"]
    others = [t.name for k, t in enumerate(fit.tests) if t.outputs and not readings.mask(k).any()]
    said = f"a dash stands for χ² where the noise of a reading is not known: {first_of(others, MOST_NAMED)}"
    return [said] if others else []


def logarithmic_output(fit: Identification) -> str:
    """The output of a fit that is compared by its logarithm, such as the strain of bars; "" where there is none."""
    return next((name for name in fit.noise_model.outputs if is_logarithmic(name)), "")


# ---- tests without curves --------------------------------------------------------------------------------------------


def _single_cells(one: SingleValue | None, unit: float) -> tuple[str, str, str]:
    """What was measured, what the law predicts with its interval, and their ratio; unit : of the cells."""
    if one is None:
        return ("", "", "")
    low, predicted, high = (number(v / unit, 3) for v in (one.low, one.predicted, one.high))
    by_law = f"{predicted} [{low}, {high}]" if math.isfinite(one.predicted) else "none"
    known = math.isfinite(one.ratio) and not one.censored
    return f"{'> ' * one.censored}{number(one.measured / unit)}", by_law, number(one.ratio, 3) if known else ""


# ---- noise and nuisance parameters -----------------------------------------------------------------------------------


SMALLEST_SHARE = 5e-4
"""Of strain, from which on it is said that the law cannot follow it."""


def noise_blocks(fit: Identification) -> list[Block]:
    """Noise, scatter and misfits as they were estimated, explicit nuisance parameters, and correlations."""
    rows, readings = [], judged_readings(fit)
    for name, one in fit.noise_model.outputs.items():
        error = fit.errors.get(name) if name != RUPTURE_OUTPUT and not is_logarithmic(name) else None
        rms = "–" if error is None else f"{error.mean_squared_error**0.5:.3g} ({100 * error.relative_rms_error:.2g} %)"
        squared = "–" if error is None else number(error.relative_squared_error, 3)
        (factor, unit), judged = shown_unit(name), None if readings is None else readings.noise(output=name)
        of_reading = "–" if judged is None else ends(factor * np.array(judged), 2)
        sizes = {"of a reading": of_reading, "in the fit": number(factor * one.noise, 2)}
        sizes |= {"offset of a test": number(factor * one.offset, 2), "rms misfit": rms, "squared error": squared}
        if {*sizes.values()} - {"–", "0"}:
            rows.append({"output": name.replace("_", " "), "unit": unit or "1", **sizes})
    blocks: list[Block] = [Paragraph(rate_scatter_sentence(fit))]
    if name := logarithmic_output(fit):
        part = fit.noise_model[name]
        share = math.hypot(RELATIVE_DISCREPANCY_UNIT * fit.noise_model.discrepancy, part.drift, part.misfit)
        text = f"what the law cannot follow of a curve is {100 * share:.1f} % of strain"
        blocks += [Paragraph(text)] * (share >= SMALLEST_SHARE)
    caption = (
        "noise as it was estimated, one standard deviation. Of a reading: by which the law is judged, from what "
        "its test states or its neighbours show. In the fit: one for all. Misfit and error: what the law leaves"
    )
    unknown = {n.kind for n in fit.settings.nuisances if n.sd is None}
    nuisances = [
        {
            "nuisance parameter": n.key,
            "of": n.owner or "all",
            "estimate": f"{number(n.value)} +- {number(n.sd, 2)}",
            "prior": f"{number(n.prior_mean)} +- {number(n.prior_sd, 2)}" + ", spread estimated" * (n.kind in unknown),
            "unit": _nuisance_unit(n, fit),
            "deviation over sd of the prior": (
                number((n.value - n.prior_mean) / n.prior_sd, 2) if n.prior_sd > 0 else "–"
            ),
        }
        for n in fit.nuisances
    ]
    tables = [Table.of(caption, rows), Table.of("nuisance parameters estimated beside the law", nuisances)]
    return [*blocks, *(table for table in tables if table.rows), *_correlations(fit)]


def _nuisance_unit(nuisance: NuisanceEstimate, fit: Identification) -> str:
    """In words of the table: 1 of pure numbers; of an offset that of the outputs where these have one in common."""
    units = {output_unit(name) or "1" for name in fit.noise_model.outputs}
    return nuisance_unit(nuisance.kind) or (units.pop() if nuisance.kind == "offset" and len(units) == 1 else "1")


def _correlations(fit: Identification) -> list[Block]:
    """Correlations of the estimated parameters, given the law; that strongly correlated values go together."""
    correlation = fit.correlation()
    names, matrix = correlation.names, correlation.matrix
    if len(names) < 2:
        return []
    if len(names) > MOST_CORRELATED:
        return [Paragraph(f"the correlations of {len(names)} parameters are in the file of the identification")]
    caption = f"correlations of the estimates of {fit.law.name}; ln where the logarithm is estimated"
    table = correlation_table(correlation, caption)
    size = np.abs(np.triu(matrix, 1))
    if not size.max() > STRONG_CORRELATION:
        return [table]
    k, j = np.unravel_index(int(size.argmax()), size.shape)
    together = (
        f"{names[k]} and {names[j]} have a correlation of {number(float(matrix[k, j]), 4)}: their values hold together "
        "only. Rounding one of them changes the creep rate by far more than its interval. Carry all digits, and take "
        "uncertainties of rates from the covariance, which is among the files"
    )
    return [table, Paragraph(together, "warning")]


def correlation_table(correlation: Correlation, caption: str = "") -> Table:
    """The matrix with its names."""
    names, matrix = correlation.names, np.round(correlation.matrix, 3) + 0.0
    rows = [(name, *(number(float(v), 3) for v in row)) for name, row in zip(names, matrix, strict=True)]
    return Table(caption, ("parameter", *names), rows)


# ---- comments of exports ---------------------------------------------------------------------------------------------


def identification_comments(fit: Identification, ranking: Ranking | None = None) -> list[str]:
    """What an exported law says of itself, a line each: how well it describes its tests, intervals, range, cautions.

    ranking : the comparison of laws that it is the best of, where there was one. All else is in the identification.
    """
    origin = f"identified with creepkit {fit.provenance.get('creepkit', '')} from {plural(len(fit.tests), 'test')}"
    chosen = f"; {chosen_text(ranking)}" if ranking is not None and len(ranking.laws) > 1 else ""
    intervals = [f"{e.name} {' to '.join(interval_ends(fit.law, e))}" for e in fit.estimates]
    held = " (if the law held, which the tests reject)" if rejected(fit) else ""
    lines = [
        fit.headline,
        "; ".join(filter(None, (f"{origin}{chosen}", mean_misfit_text(fit)))),
        f"95 % intervals{held}: {', '.join(intervals)}",
    ]
    lines += [*_range_lines(fit), *cautions(fit, ranking)[:MOST_CAUTIONS]]
    return [line.replace("°C", "C").replace("–", " to ") for line in lines]  # sources in Fortran hold ASCII alone


def _range_lines(fit: Identification) -> list[str]:
    """The range of the tests, and at which temperatures not all of its stresses were tested."""
    units = {"stress": " MPa", "time": " s"}
    covered = {name: f"{low:.4g} to {high:.4g}{units.get(name, '')}" for name, (low, high) in fit.ranges.items()}
    if "temperature" in covered:
        covered["temperature"] = celsius_text(*fit.ranges["temperature"])
    lines = [f"range of the tests: {', '.join(f'{name} {text}' for name, text in covered.items())}"]
    at_temperatures = stresses_at_temperatures(fit)
    low, high = fit.ranges["stress"]
    tolerance = 1.0 + SAME_STRESS
    if any(s[0] > low * tolerance or s[1] * tolerance < high for _, s in at_temperatures):
        named = "; ".join(
            f"{celsius_text(T, digits=0)} {s[0]:.4g}{f' to {s[1]:.4g}' if s[1] > s[0] * tolerance else ''} MPa"
            for T, s in at_temperatures[:MOST_NAMED]
        )
        more = len(at_temperatures) - MOST_NAMED
        others = f"; and {more} more temperatures" if more > 0 else ""
        lines.append(f"not every combination of stress and temperature in this range was tested: at {named}{others}")
    return lines


# ---- term selection --------------------------------------------------------------------------------------------------


def sparsity_verdict(sparsity: Sparsity) -> str:
    """What was dropped, and what that cost, in one sentence."""
    dropped = [f"'{name}'" for name in sparsity.dropped_terms] + [f"exponent {e}" for e in sparsity.exponents_off]
    if not dropped:
        return f"all terms of '{sparsity.law}' are kept"
    cost = (
        f"chi-square rises by {max(sparsity.chi_square_rise, 0.0):.1f} for {sparsity.parameters_dropped} parameters "
        f"fewer (p = {sparsity.p_value:.2g}) and -2 ln of the evidence changes by {sparsity.score_difference:+.1f}"
    )
    kept = f"{named(sparsity.kept_terms, 'test')} suffice{'s' * (len(sparsity.kept_terms) == 1)}"
    return f"without {listed(dropped)} of '{sparsity.law}' {cost}: {kept}"


def sparsity_text(sparsity: Sparsity) -> str:
    """The verdict, and the contribution of every term in the whole sum, and after the refit."""
    kept = sparsity.contributions_after_refit
    rows = [
        (term, f"{share:.3f}", f"{kept[term]:.3f}" if term in kept else "dropped")
        for term, share in sparsity.contributions.items()
    ]
    return "\n".join([sparsity.verdict, *aligned(("contribution", "whole sum", "kept"), rows)])


# ---- uncertainty -----------------------------------------------------------------------------------------------------


def posterior_text(samples: PosteriorSamples) -> str:
    """The median and 95 % interval of every parameter."""
    width = max(len(name) for name in samples.coordinates.names)
    lines = [f"{len(samples.u)} draws from the posterior"]
    for name, param in samples.coordinates.law.table.items():
        median, low, high = samples.interval(name)
        lines.append(f"  {name:{width}} = {median:.5g}  [{low:.4g}, {high:.4g}] {unit_text(param.unit)}".rstrip())
    return "\n".join(lines)


def correlation_text(correlation: Correlation) -> str:
    """The matrix with its names."""
    table = correlation_table(correlation)
    return "\n".join(aligned(table.columns, table.rows, table.numeric))


def model_average_text(average: ModelAverage) -> str:
    """One line: the laws with their weights, rate and local exponent at the reference point."""
    reference = average.fits[0].reference
    rate, low, high = (float(v) for v in average.rate(reference.stress))
    exponent, exponent_low, exponent_high = (float(v) for v in average.local_exponent(reference.stress))
    names = ", ".join(f"{fit.law.name} ({w:.2g})" for fit, w in zip(average.fits, average.weights, strict=True))
    return (
        f"over the laws {names}: rate at {reference.stress:.4g} MPa, {celsius_text(reference.temperature)} {rate:.3g} "
        f"[{low:.3g}, {high:.3g}] 1/s, local stress exponent {exponent:.3g} [{exponent_low:.3g}, {exponent_high:.3g}]"
    )


# ---- cross-validation ------------------------------------------------------------------------------------------------


def cross_validation_text(validation: CrossValidation) -> str:
    """One line for each held-out test: its relative squared errors, about the mean of the test.

    Of its rupture time and minimum rate the prediction over the measured one, with its 95 % interval.
    """
    lines = [f"law '{validation.fit.law.name}', held out by {validation.by}: relative squared errors"]
    for name, errors in validation.errors.items():
        cells = [f"{output} {e.relative_squared_error:.3g}" for output, e in errors.items()]
        cells += [f"{what} {_held_out_text(one)}" for what, one in validation.single_values[name].items()]
        lines.append(f"  {name}: {', '.join(cells)}")
    return "\n".join(lines)


def _held_out_text(one: SingleValue) -> str:
    """Predicted over measured, with the interval of a single test."""
    low, high = one.low / one.measured, one.high / one.measured
    unbroken = " of the time it lasted unbroken" if one.censored else ""
    return f"predicted over measured {one.ratio:.3g} [{low:.3g}, {high:.3g}]{unbroken}"
