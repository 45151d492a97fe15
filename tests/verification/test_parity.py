"""Kernels against 50-digit arithmetic over the full bounds: value to 1e-12, derivatives to 1e-10, every target.

Stress 1e-3 to 2000 MPa, strain 1e-12 to 1, time 1e-3 to 1e6 s; relative differences wherever float64 can hold the
result, and ln rate everywhere. Nothing is forgiven for cancellation here.
"""

import functools

import numpy as np
import pytest

import creepkit
from creepkit.kernels.multiprecision import MultiprecisionLaw
from creepkit.language import CreepLaw
from creepkit.testing import draw_samples
from creepkit.testing.parity import KERNEL_EVALUATORS, MultiprecisionReference, largest_differences

SAMPLES = 1024
SHIPPED = ("norton", "strain-hardening", "time-hardening", "hyperbolic-sine", "drifting-exponent", "combined")
VALUE, DERIVATIVE = 1e-12, 1e-10


def law_of(name: str) -> CreepLaw:
    """A law that ships, or a sum of two with temperature in the rates and in an exponent."""
    if name != "sum with temperature":
        return creepkit.law(name)
    both = creepkit.law("hyperbolic-sine") + creepkit.law("strain-hardening")
    return both.times(creepkit.arrhenius()).with_temperature(n_2=creepkit.linear())


@functools.cache
def truth_of(name: str) -> MultiprecisionReference:
    """Exact rows at Sobol points, made once for all targets."""
    law = law_of(name)
    return MultiprecisionReference(MultiprecisionLaw(law), draw_samples(law, SAMPLES, seed=7))


@pytest.mark.parametrize("target", KERNEL_EVALUATORS)
@pytest.mark.parametrize("name", [*SHIPPED, "sum with temperature"])
def test_a_kernel_is_exact(name: str, target: str) -> None:
    truth = truth_of(name)

    with np.errstate(over="ignore", invalid="ignore"):  # sinh^8 of 2000 is 1e6941: no float64, and judged in ln rate
        values, derivatives = largest_differences(truth, KERNEL_EVALUATORS[target](law_of(name), truth.samples))

    assert values.size <= VALUE, truth.location_text(values)
    assert derivatives.size <= DERIVATIVE, truth.location_text(derivatives)


@pytest.mark.parametrize("name", SHIPPED)
def test_enough_of_the_points_have_a_rate_that_float64_holds(name: str) -> None:
    rates = [float(abs(rows[0][0])) for rows in truth_of(name).rows if rows[0][0] < 1e308]

    assert sum(1e-308 < rate < 1e308 for rate in rates) > 0.5 * SAMPLES


@pytest.mark.parametrize("name", SHIPPED)
def test_the_points_fill_the_bounds(name: str) -> None:
    drawn, law = truth_of(name).samples, law_of(name)

    low, high = np.array([[p.to_internal(b) for b in p.bounds] for p in law.params.values()]).T
    reached = (drawn.theta - low) / (high - low)
    assert (reached.min(axis=0) < 0.02).all()
    assert (reached.max(axis=0) > 0.98).all()
    spread = np.log10(drawn.points[:, :3])
    np.testing.assert_allclose(spread.min(axis=0), [-3, -12, -3], atol=0.1)
    np.testing.assert_allclose(spread.max(axis=0), [np.log10(2000), 0, 6], atol=0.1)
