"""Text of what follows an identification: term selection, posterior, cross-validation."""

from __future__ import annotations

from typing import TYPE_CHECKING

from creepkit.records.units import celsius_text
from creepkit.reports.answer import unit_text
from creepkit.reports.blocks import aligned, listed, named
from creepkit.reports.identification import correlation_table

if TYPE_CHECKING:
    from creepkit.inverse.cross_validation import CrossValidation
    from creepkit.inverse.selection.ranking import ModelAverage
    from creepkit.inverse.single_values import SingleValue
    from creepkit.inverse.sparsity.result import Sparsity
    from creepkit.inverse.uncertainty.correlation import Correlation
    from creepkit.inverse.uncertainty.importance_sampling import PosteriorSamples


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
