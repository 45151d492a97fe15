"""CmaEs and Trace: known minima, restarts, seeds, bounds, and the picture of a search."""

import numpy as np
import pytest

from creepkit.inverse.bounds import Bounds
from creepkit.inverse.search.derivative_free import CmaEs
from creepkit.inverse.search.global_search import SearchTrace
from creepkit.inverse.settings import IdentificationSettings
from helpers.cost_functions import Known, cube, quadratic, rastrigin, rosenbrock

BARE = CmaEs(refined_candidates=0)


@pytest.mark.parametrize(
    ("cost", "box", "at"),
    [(quadratic, cube(3), [1, 2, 3]), (rosenbrock, cube(2), [1, 1]), (rosenbrock, cube(5), [1, 1, 1, 1, 1])],
)
def test_it_finds_known_minima_by_itself(cost, box, at):
    found = BARE.minima(Known(cost, box)).minima[0]
    np.testing.assert_allclose(found.x, at, atol=0.02)
    assert found.cost == cost(found.x[None])[0]


def test_restarts_find_what_one_run_misses():
    """Of four runs on many minima the best one counts; each has twice the candidates of the one before."""
    landscape = Known(rastrigin, cube(4, 5.12))
    found = CmaEs(iterations=600, restarts=3).minima(landscape)
    np.testing.assert_allclose(found.minima[0].x, 0.0, atol=1e-3)
    starts = (0, *found.trace.restarts)
    assert [landscape.calls[k] for k in starts] == [landscape.calls[0] * 2**run for run in range(len(starts))]
    alone = CmaEs(iterations=600, restarts=0, refined_candidates=0).minima(Known(rastrigin, cube(4, 5.12)))
    assert alone.trace.best_cost[-1] > 0.5  # the next best minimum lies at 1
    assert alone.trace.restarts == ()


def test_candidates_stay_in_the_box_and_an_optimum_beyond_a_wall_is_found_on_it():
    landscape = Known(quadratic, Bounds(np.array([2.0, -5.0]), np.array([5.0, 5.0])))
    found = CmaEs().minima(landscape).minima[0]
    everything = np.concatenate(landscape.seen)
    assert (everything >= landscape.bounds.lower).all()
    assert (everything <= landscape.bounds.upper).all()
    np.testing.assert_allclose(found.x, [2.0, 2.0], atol=1e-4)


def test_a_generation_is_one_call_and_a_seed_gives_the_same_answer_twice():
    runs = []
    for seed in (7, 7, 8):
        landscape = Known(rosenbrock, cube(3), IdentificationSettings(seed=seed))
        runs.append(CmaEs(population=12, iterations=25, restarts=0).minima(landscape))
        assert landscape.calls == [12] * len(runs[-1].trace)
    np.testing.assert_array_equal(runs[0].minima[0].x, runs[1].minima[0].x)
    np.testing.assert_array_equal(runs[0].trace.quartiles, runs[1].trace.quartiles)
    assert (runs[0].trace.quartiles != runs[2].trace.quartiles).any()


# ---- trace ---------------------------------------------------------------------------------------------------------

COSTS = [np.array([9.0, 5.0, 7.0]), np.array([6.0, 8.0, 10.0]), np.array([3.0, 4.0, 5.0, 6.0, 7.0])]


def test_a_trace_keeps_the_lowest_so_far_what_was_asked_and_the_quartiles():
    trace = SearchTrace.from_costs("search", COSTS)
    np.testing.assert_array_equal(trace.best_cost, [5, 5, 3])
    np.testing.assert_array_equal(trace.evaluations, [3, 6, 11])
    np.testing.assert_array_equal(trace.quartiles, [[6, 7, 8], [7, 8, 9], [4, 5, 6]])
    assert len(trace) == 3
