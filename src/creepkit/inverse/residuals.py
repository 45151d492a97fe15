"""Residuals: how far predictions are from measurements, entry by entry, and how that changes."""

from __future__ import annotations

from dataclasses import dataclass, replace

from creepkit.arrays import Bools, Floats, Ints


@dataclass(frozen=True, eq=False)
class Residuals:
    """Predicted minus measured, for each test the entries of its outputs end to end (see inverse.entries).

    values, slopes : (tests, entries) residual, and dg/dy at the prediction (what one unit of offset changes).
    present : (tests, entries) which entries are data; the others are zero.
    clock : (tests, entries) that in which what the law cannot follow wanders (see Entries.clock).
    jacobian : (tests, entries, unknowns) with respect to x = (u, e), or None.
    rate_effect : (tests, entries) derivative with respect to ln of a factor on this test's creep rate.
    output : (tests, entries) position of the entry's output; loudness : its noise over that of its output.
    trust : (tests,) weight of each test; the covariance of a test is divided by it.
    known : (tests, entries, nuisances) what one standard deviation of further random effects does, or None.
    """

    values: Floats
    transform_derivatives: Floats
    present: Bools
    correlation_time: Floats
    jacobian: Floats | None
    log_rate_sensitivity: Floats
    output_index: Ints
    relative_noise: Floats
    test_weights: Floats
    random_effect_sensitivities: Floats | None = None

    def with_test_weights(self, test_weights: Floats) -> Residuals:
        """The same with other weights of tests."""
        return replace(self, test_weights=test_weights)
