"""Bounds of a strength: those of a wider kind hold those of a narrower one, whatever the quantiles do on the way."""

import numpy as np
import pytest

from creepkit.rupture_assessment.strength import _bound

STRESS = np.geomspace(10.0, 1000.0, 301)


def median(stress):
    """log10 h: ten times longer at half the stress, 1e5 h at 100 MPa."""
    return 5.0 - np.log2(stress / 100.0)


def brute_force(curve, hours, value, upper):
    """The end of the stresses about the value at which the quantile is on its side of the time, on a fine grid."""
    fine = np.geomspace(STRESS[0], STRESS[-1], 100_001)
    inside = (curve(fine) >= np.log10(hours)) if upper else (curve(fine) <= np.log10(hours))
    start, step = int(np.searchsorted(fine, value)), 1 if upper else -1
    while 0 <= start + step < fine.size and inside[start + step]:
        start += step
    return fine[start]


@pytest.mark.parametrize("upper", [True, False])
@pytest.mark.parametrize("hours", [1e4, 1e5, 1e6])
@pytest.mark.parametrize("dip", [0.0, 0.8])
def test_a_bound_is_the_end_of_the_stresses_that_are_not_excluded(upper, hours, dip):
    """Half widths of 0.3 decades, with a dip of the quantile at 250 MPa and its mirror image at 30 MPa."""

    def curve(stress):
        bend = np.exp(-0.5 * (np.log(stress / (250.0 if upper else 30.0)) / 0.1) ** 2)
        return median(stress) + (0.3 - dip * bend) * (1.0 if upper else -1.0)

    value = 100.0 * 2.0 ** (5.0 - np.log10(hours))
    bound, reason = _bound(STRESS, curve(STRESS), hours, value, upper=upper)
    assert reason == ""
    assert bound == pytest.approx(brute_force(curve, hours, value, upper), rel=2e-3)


def test_wider_quantiles_give_wider_bounds():
    rng = np.random.default_rng(0)
    for _ in range(50):
        phase, size = rng.uniform(0, 6, 2), rng.uniform(0.0, 0.4)
        half = 0.2 + size * (1.0 + np.sin(phase[0] + 8.0 * np.log(STRESS)))
        wider = half + 0.1 * (1.0 + np.sin(phase[1] + 5.0 * np.log(STRESS)))
        for upper, sign in ((True, 1.0), (False, -1.0)):
            narrow, wide = (
                _bound(STRESS, median(STRESS) + sign * width, 1e5, 100.0, upper=upper)[0] for width in (half, wider)
            )
            assert wide is None or (narrow is not None and sign * (wide - narrow) > -1e-9 * wide)


def test_where_no_stress_is_excluded_there_is_no_bound():
    never_long = np.minimum(median(STRESS) - 0.5, 4.8)
    assert _bound(STRESS, never_long, 1e5, 100.0, upper=False)[0] is None
    turning = np.where(STRESS > 40.0, median(STRESS) - 2.0, median(np.array(40.0)) - 2.0 + np.log2(STRESS / 40.0))
    bound, reason = _bound(STRESS, turning, 1e5, 100.0, upper=False)
    assert bound is None
    assert "predicted times get shorter again below 39.8 MPa" in reason
