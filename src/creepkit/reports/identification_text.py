"""Text of identifications, for a terminal and as comments for exported laws."""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import median
from typing import TYPE_CHECKING

from creepkit.inverse.adequacy import UNDETECTED_SCATTER
from creepkit.inverse.nuisance_parameters import nuisance_unit
from creepkit.inverse.observation_vector import RELATIVE_DISCREPANCY_UNIT, RUPTURE_OUTPUT
from creepkit.inverse.tested_region import SAME_STRESS, stresses_at_temperatures
from creepkit.inverse.uncertainty.laplace_approximation import NOT_DETERMINED, POORLY_DETERMINED, interval_ends
from creepkit.language.printing import expression_text, state_equations
from creepkit.records import is_logarithmic, kind_and_start, output_unit
from creepkit.records.units import celsius_text
from creepkit.reports.interval_basis import interval_basis
from creepkit.reports.judged_readings import LAW_RATE_MEANING, LAW_RATE_MISFIT, OWN_RATE_CHI_SQUARE, judged_readings
from creepkit.reports.stress_exponents import reference_sentences

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.nuisance_parameters import NuisanceEstimate
    from creepkit.inverse.selection.ranking import Ranking
    from creepkit.inverse.single_values import SingleValue


LISTED_TESTS = 15
"""With more tests than this their rupture times, or minimum rates, are summed up alone."""


def identification_text(fit: Identification) -> str:
    """The law, its values with 95 % intervals, the scatter between tests, and what is not determined."""
    lines = [
        f"{fit.law.title or fit.law.name}",
        f"  {fit.headline}",
        *(f"  {label}: {expression_text(term)}" for label, term in fit.law.terms.items()),
        *(f"  {equation}" for equation in state_equations(fit.law)),
        "",
        *_values(fit),
        *([] if rejected(fit) else _reference(fit)),
        *(f"  {line}" for line in interval_basis(fit)),
        "",
        *_strains(fit),
        *_minimum_rates(fit),
        *_ruptures(fit),
        *_linear_outputs(fit),
        *_table(fit),
        *_adequacy(fit),
    ]
    lines += [f"  {fit.sparsity.verdict}"] if fit.sparsity is not None else []
    lines += [f"  note: {note}" for note in fit.notes]
    return "\n".join(lines)


def rejected(fit: Identification) -> bool:
    """Whether the tests reject the law, so that what it says of them, rates and exponents, is not theirs."""
    return fit.adequacy is not None and fit.adequacy.rejects


def _adequacy(fit: Identification) -> list[str]:
    """Whether the law explains the tests, and what it would say without each of them."""
    lines = [] if fit.adequacy is None else ["", f"  the law {fit.adequacy}"]
    return [*lines, *left_out_lines(fit)]


def left_out_lines(fit: Identification) -> list[str]:
    """Between which the stress exponent lies where one test is left out; none of fewer tests than four."""
    if not fit.left_out:
        return []
    low, high = min(fit.left_out, key=lambda one: one.exponent), max(fit.left_out, key=lambda one: one.exponent)
    far = max(fit.left_out, key=lambda one: abs(one.log_factor) / one.sd)
    factor, sd = math.exp(far.log_factor), far.sd
    return [
        f"  leaving one test out: stress exponent {low.exponent:.3g} (without '{low.test}') to {high.exponent:.3g} "
        f"(without '{high.test}'); farthest from the others: '{far.test}', {factor:.3g} times their rate "
        f"[{factor * math.exp(-1.96 * sd):.3g}, {factor * math.exp(1.96 * sd):.3g}]"
    ]


def _values(fit: Identification) -> list[str]:
    width, lines = max(len(e.name) for e in fit.estimates) if fit.estimates else 4, []
    for e in fit.estimates:
        unit = "" if e.unit == "1" else f" {e.unit}"
        note = "" if e.verdict == "determined" else f"   <- {e.verdict}"
        note += " by these data" if e.verdict in (NOT_DETERMINED, POORLY_DETERMINED) else ""
        low, high = interval_ends(fit.law, e)
        lines.append(f"  {e.name:{width}} = {e.value:.5g}  [{low}, {high}]{unit}{note}")
    return lines


def _reference(fit: Identification) -> list[str]:
    return [f"  {line}" for line in reference_sentences(fit)]


def scatter_of_rates(fit: Identification) -> str:
    """One standard deviation of ln rate between tests, in per cent; whether an estimate of it found none."""
    rate = fit.noise_model.rate
    return "none detected" if 0.0 < rate <= UNDETECTED_SCATTER else f"{100 * rate:.2g} %"


def _tests(count: int) -> str:
    return "1 test" if count == 1 else f"{count} tests"


def _strains(fit: Identification) -> list[str]:
    name = logarithmic_output(fit)
    if not name:
        return []
    noise = fit.noise_model[name]
    tests = [m for m in fit.tests if m.outputs and m.outputs[0].output == name]
    return [
        f"  {_tests(len(tests))}, {sum(m.frames for m in tests)} frames: {_rms_label(fit)} {fit.rms:.3g}",
        f"  scatter (one sd): rate between tests {scatter_of_rates(fit)}, "
        f"loading strain {noise.offset:.2g}, frame noise {noise.noise:.2g}, "
        f"what the law cannot follow {_discrepancy_of_strain(fit):.1f} % of strain",
    ]


def logarithmic_output(fit: Identification) -> str:
    """The output of a fit that is compared by its logarithm, such as the strain of bars; "" where there is none."""
    return next((name for name in fit.noise_model.outputs if is_logarithmic(name)), "")


def _discrepancy_of_strain(fit: Identification) -> float:
    """Per cent of strain: model discrepancy, drift and independent misfit together."""
    components = fit.noise_model[logarithmic_output(fit)]
    return 100 * math.hypot(
        RELATIVE_DISCREPANCY_UNIT * fit.noise_model.discrepancy, components.drift, components.misfit
    )


def _rms_label(fit: Identification) -> str:
    whole = bool(rupture_rows(fit))
    return "rms distance in ln strain and ln time" if whole else "rms of ln strain"


def _minimum_rates(fit: Identification) -> list[str]:
    """Minimum rates of tests without frames, predicted over measured, and each test's where they are few."""
    rows = [(m.name, m.condition, m.minimum_rate) for m in fit.tests if m.minimum_rate is not None]
    if not rows:
        return []
    ratios = [r.ratio for _, _, r in rows if math.isfinite(r.ratio)]
    text = _spread(ratios) if ratios else "not predicted"
    within_interval = sum(r.low <= r.measured <= r.high for _, _, r in rows)
    lines = [
        f"  minimum rates of {_tests(len(rows))} without frames: predicted over measured {text}; {within_interval} "
        f"within the 95 % interval of a single test{_if_the_law_holds(fit)}; "
        f"scatter of rates between tests {scatter_of_rates(fit)}"
    ]
    if len(rows) > LISTED_TESTS:
        return lines
    width, condition_width = max(len(name) for name, _, _ in rows), max(len(text) for _, text, _ in rows)
    lines.append(f"  {'test':{width}}  {'condition':{condition_width}} {'rate, 1/s':>11} {'predicted':>10}  [95 %]")
    return lines + [
        f"  {name:{width}}  {condition:{condition_width}} {r.measured:>11.3g} {r.predicted:>10.3g}  "
        f"[{r.low:.3g}, {r.high:.3g}]"
        for name, condition, r in rows
    ]


def _ruptures(fit: Identification) -> list[str]:
    """Rupture times, predicted over measured, and each test's where they are few."""
    ruptures, lines = rupture_rows(fit), _unused_ends(fit)
    if not ruptures:
        return lines
    ratios, censored = [r.ratio for _, _, r in ruptures if not r.censored], [r for _, _, r in ruptures if r.censored]
    line = f"  rupture: {len(ratios)} of {_tests(len(fit.tests))} broke"
    if ratios:
        within_interval = sum(r.low <= r.measured <= r.high for _, _, r in ruptures if not r.censored)
        line += (
            f"; time predicted over measured {_spread(ratios)}; "
            f"{within_interval} within the 95 % interval of a single test{_if_the_law_holds(fit)}"
        )
    if censored:
        unexpected = sum(r.predicted < r.measured for r in censored)
        line += f"; {len(censored)} stopped before, of which {unexpected or 'none'} should have broken"
    return [line, *(_rupture_table(ruptures) if len(ruptures) <= LISTED_TESTS else []), *lines]


def _unused_ends(fit: Identification) -> list[str]:
    """What the law would say of rupture times that it was not compared with."""
    ends = [m.rupture for m in fit.tests if m.rupture is not None and not m.rupture.used]
    ratios = [end.ratio for end in ends if not end.censored and math.isfinite(end.ratio)]
    text = f"  ends of {_tests(len(ends))} were not used"
    return [text + (f": time predicted over measured {_spread(ratios)}" if ratios else "")] if ends else []


def _spread(ratios: Sequence[float]) -> str:
    return f"{min(ratios):.2g} to {max(ratios):.2g}, median {median(ratios):.3g}"


def _if_the_law_holds(fit: Identification) -> str:
    """The condition of intervals of single tests."""
    rejected = fit.adequacy is not None and fit.adequacy.verdict == "leaves a discrepancy"
    return ", which they do not have: the tests contradict the law" if rejected else ", if the law holds"


def _rupture_table(ruptures: Sequence[tuple[str, str, SingleValue]]) -> list[str]:
    width, condition_width = (
        max(len(name) for name, _, _ in ruptures),
        max(len(condition) for _, condition, _ in ruptures),
    )
    lines = [f"  {'test':{width}}  {'condition':{condition_width}} {'lasted, h':>11} {'predicted':>10}  [95 %]"]
    for name, condition, r in ruptures:
        duration = f"{'> ' if r.censored else ''}{r.measured / 3600:.4g}"
        low, time, high = (v / 3600 for v in (r.low, r.predicted, r.high))
        lines.append(
            f"  {name:{width}}  {condition:{condition_width}} {duration:>11} {time:>10.4g}  [{low:.4g}, {high:.4g}]"
        )
    return lines


def _linear_outputs(fit: Identification) -> list[str]:
    """Errors of outputs that are compared as they are, over all used frames of all tests."""
    lines = []
    for name, e in fit.errors.items():
        if name == RUPTURE_OUTPUT or is_logarithmic(name):
            continue
        unit, s = f" {output_unit(name)}" if output_unit(name) else "", fit.noise_model[name]
        rms = f"rms {e.mean_squared_error**0.5:.3g}{unit} ({100 * e.relative_rms_error:.2g} %)"
        lines.append(
            f"  {name}: relative squared error {e.relative_squared_error:.3g}, {rms}, noise {s.noise:.2g}{unit}, "
            f"offsets {s.offset:.2g}{unit}, {LAW_RATE_MISFIT} {e.chi_square:.3g}"
        )
    lines += [f"  the {LAW_RATE_MEANING}"] if lines else []
    if lines and not logarithmic_output(fit):
        count = _tests(len(fit.tests))
        lines.append(f"  {count}; scatter of the rate between tests (one sd) {scatter_of_rates(fit)}")
    return lines


def _table(fit: Identification) -> list[str]:
    """A line a test: its error, its chi-square (as the law is judged, where noise is known), offset and nuisances."""
    linear_output_tests = [m for m in fit.tests if m.outputs and not is_logarithmic(m.outputs[0].output)]
    estimates_by_owner = {(n.key, n.owner): n for n in fit.nuisances if n.scope == "test"}
    kinds = list(dict.fromkeys(n.key for n in fit.nuisances if n.scope == "test"))
    if not (linear_output_tests or kinds):
        return _shared_nuisances(fit)
    width = max(len(m.name) for m in fit.tests)
    readings = judged_readings(fit)
    head = f"  {'test':{width}}  {'condition':22} {'error':>9} {'chi2':>8} {'offset':>9} {'rate':>6} {'weight':>6}"
    explained = [f"  chi2: {OWN_RATE_CHI_SQUARE}"] if readings is not None else []
    lines = ["", *explained, head + "".join(f" {kind + _unit(kind):>18}" for kind in kinds)]
    for k, m in enumerate(fit.tests):
        first_output = m.outputs[0]
        test_estimates = [estimates_by_owner.get((kind, m.name)) for kind in kinds]
        errors = first_output.errors
        chi_square = errors.chi_square if readings is None else readings.chi_square(k)
        lines.append(
            f"  {m.name:{width}}  {m.condition:22} {errors.relative_squared_error:9.2g} {chi_square:8.3g} "
            f"{first_output.offset:9.2g} {m.rate_factor:6.2f} {m.weight:6.2f}"
            + "".join(f" {'-' if n is None else _plus_minus(n):>18}" for n in test_estimates)
        )
    return [*lines, *_shared_nuisances(fit)]


def _shared_nuisances(fit: Identification) -> list[str]:
    """Nuisances that tests share, and spreads that were estimated."""
    lines = [
        f"  {n.key} of {n.owner or 'one alloy'}{_unit(n.key)}: {_plus_minus(n)}"
        for n in fit.nuisances
        if n.scope != "test"
    ]
    for nuisance in fit.settings.nuisances:
        prior_sds = [
            n.prior_sd for n in fit.nuisances if n.key == nuisance.key and n.owner in (nuisance.tests or [n.owner])
        ]
        if nuisance.sd is None and prior_sds:
            lines.append(f"  {nuisance.key}: spread estimated as {prior_sds[0]:.3g}{_unit(nuisance.key)}")
    return lines


def _plus_minus(n: NuisanceEstimate) -> str:
    return f"{n.value:.4g} +- {n.sd:.2g}"


def _unit(key: str) -> str:
    unit = nuisance_unit(kind_and_start(key)[0])
    return f", {unit}" if unit else ""


def identification_comments(fit: Identification, ranking: Ranking | None = None) -> list[str]:
    """What an exported law says of itself, a line each: how well it describes its tests, intervals, range, cautions.

    ranking : the comparison of laws that it is the best of, where there was one. All else is in the identification.
    """
    from creepkit.reports.answer import MOST_CAUTIONS, cautions, chosen_text

    origin = f"identified with creepkit {fit.provenance.get('creepkit', '')} from {_tests(len(fit.tests))}"
    chosen = f"; {chosen_text(ranking)}" if ranking is not None and len(ranking.laws) > 1 else ""
    intervals = [f"{e.name} {' to '.join(interval_ends(fit.law, e))}" for e in fit.estimates]
    held = " (if the law held, which the tests reject)" if rejected(fit) else ""
    lines = [fit.headline, f"{origin}{chosen}", f"95 % intervals{held}: {', '.join(intervals)}"]
    lines += [*_range_lines(fit), *cautions(fit, ranking)[:MOST_CAUTIONS]]
    return [line.replace("°C", "C") for line in lines]  # sources in Fortran hold ASCII alone


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
    part = [(T, s) for T, s in at_temperatures if s[0] > low * tolerance or s[1] * tolerance < high]
    if part:
        named = "; ".join(
            f"{celsius_text(T, digits=0)} {s[0]:.4g}{f' to {s[1]:.4g}' if s[1] > s[0] * tolerance else ''} MPa"
            for T, s in at_temperatures[:MOST_TEMPERATURES_NAMED]
        )
        more = len(at_temperatures) - MOST_TEMPERATURES_NAMED
        others = f"; and {more} more temperatures" if more > 0 else ""
        lines.append(f"not every combination of stress and temperature in this range was tested: at {named}{others}")
    return lines


MOST_TEMPERATURES_NAMED = 12
"""Temperatures whose stresses an exported text states."""


def rupture_rows(fit: Identification) -> list[tuple[str, str, SingleValue]]:
    """(test, condition, rupture) of the tests whose end is known and was compared with the law."""
    return [(m.name, m.condition, m.rupture) for m in fit.tests if m.rupture is not None and m.rupture.used]
