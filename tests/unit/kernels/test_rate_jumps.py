"""Jumps of a rate along a ray of points are found, and told from steep slopes."""

import numpy as np
import pytest

from creepkit.kernels.rate_jumps import find_rate_jump


@pytest.mark.parametrize("factor", [0.1, 1.01, 10.0])
def test_a_jump_is_found_to_its_place_and_size(factor: float) -> None:
    jump = find_rate_jump(lambda s: 5 * np.log(s) + np.where(s < 77.7, 0.0, np.log(factor)), 1e-3, 2e3)

    assert jump is not None
    assert jump.place == pytest.approx(77.7, rel=1e-9)
    assert np.exp(jump.after - jump.before) == pytest.approx(factor, rel=1e-6)


@pytest.mark.parametrize("power", [1.0, 3.0, 40.0])
def test_steep_slopes_and_kinks_are_no_jumps(power: float) -> None:
    def kinked(places):
        with np.errstate(divide="ignore"):
            return power * np.log(np.maximum(places - 50.0, 0.0))

    assert find_rate_jump(kinked, 1e-3, 2e3) is None
    assert find_rate_jump(lambda places: power * np.log(places), 1e-3, 2e3) is None
