"""What is observed at the times of frames, from the accepted steps of a simulation, in one call."""

import numpy as np
import pytest

from creepkit.fem.time_interpolation import TimeInterpolation
from creepkit.specimens.bulge.observation import Observation
from helpers.bulge_profiles import NODES, bell, richardson

TIMES = np.concatenate([[0.0, 0.0], np.geomspace(10, 14400, 12), [14400.0], 14400 + np.geomspace(10, 28800, 12)])
SEGMENTS = np.repeat([0, 1], [14, 13])
PROGRAM = np.zeros((2, 10))
PROGRAM[:, :4] = [[0, 14400, 8, 8], [14400, 43200, 10, 10]]
STEPS = TimeInterpolation.from_steps(TIMES, SEGMENTS, PROGRAM)
FRAMES = np.append(np.linspace(0.0, 43200.0, 31), 50000.0)


def profiles(growth=1.0, width=3.6):
    """Of the accepted steps, at rest first: (steps, nodes), mm."""
    share = (TIMES / 43200.0)[:, None]
    moved = bell(NODES, 0.1 + 0.5 * growth * share**0.7, width + 0.3 * share, 2.0 + 0.3 * share)
    return np.where(np.arange(TIMES.size)[:, None] == 0, 0.0, moved)


@pytest.mark.parametrize("operator", [Observation(), Observation("field"), Observation("profile", 5.3, 51)], ids=str)
def test_one_call_does_what_two_do(operator):
    got = operator.observe_at_times(NODES, profiles(), STEPS, FRAMES)
    np.testing.assert_allclose(got, STEPS.interpolate(operator.observe(NODES, profiles()), FRAMES), rtol=1e-14)
    assert np.isnan(got[-1]).all()


@pytest.mark.parametrize("lanes", ["2", "4", "8"])
def test_every_width_of_vectors_gives_the_same(monkeypatch, lanes):
    expected, derivatives = Observation("field").observe_with_derivatives(NODES, profiles())
    monkeypatch.setenv("CREEPKIT_LANES", lanes)  # a processor that has fewer takes what it has
    got, got_derivatives = Observation("field").observe_with_derivatives(NODES, profiles())
    np.testing.assert_allclose(got, expected, rtol=1e-13)
    np.testing.assert_allclose(got_derivatives, derivatives, rtol=1e-10, atol=1e-12)


def test_derivatives_against_differences():
    operator = Observation()
    fit = operator.sampling(NODES).fit
    directions = [dict(growth=1.0), dict(width=3.6)]
    base = [1.0, 3.6]

    def difference(function, k):
        name = next(iter(directions[k]))
        return richardson(lambda h: function(**{name: base[k] + h}), 1e-3)

    changes = np.stack([difference(profiles, k) for k in range(2)], axis=-1)
    _, derivatives = fit.observe_at_times(profiles(), STEPS, FRAMES, changes)
    for k in range(2):
        expected = difference(lambda **v: operator.observe_at_times(NODES, profiles(**v), STEPS, FRAMES), k)
        np.testing.assert_allclose(derivatives[:-1, :, k], expected[:-1], rtol=1e-7, atol=1e-8)
