"""ParticleSwarm and its trace: known minima, the rules of its sources, bounds, seeds."""

import numpy as np
import pytest

from creepkit.inverse.bounds import Bounds
from creepkit.inverse.search.global_search import SearchTrace
from creepkit.inverse.search.particle_swarm import ParticleSwarm
from creepkit.inverse.settings import IdentificationSettings
from helpers.cost_functions import Known, cube, quadratic, rastrigin, rosenbrock

SWARM = ParticleSwarm(refined_candidates=0)
BEYOND = Bounds(np.array([2.0, -5.0]), np.array([5.0, 5.0]))
"""The minimum lies beyond a bound."""
KNOWN = [
    (quadratic, cube(3), [1, 2, 3]),
    (quadratic, BEYOND, [2, 2]),
    (rosenbrock, cube(2), [1, 1]),
    (rastrigin, cube(3, 5.12), [0, 0, 0]),
]


def test_known_minima_are_found_without_refinement_and_no_candidate_leaves_the_bounds():
    missed = []
    for cost, box, at in KNOWN:
        landscape = Known(cost, box)
        found, everything = SWARM.minima(landscape).minima[0], np.concatenate(landscape.seen)
        if np.abs(found.x - at).max() > 0.02 or found.cost != cost(found.x[None])[0]:
            missed.append((cost.__name__, found))
        if (everything < box.lower).any() or (everything > box.upper).any():
            missed.append((cost.__name__, "left the bounds"))
    assert missed == []


def test_least_squares_finishes_what_the_swarm_leaves():
    rough, fine = (s.minima(Known(rosenbrock, cube(5))) for s in (SWARM, ParticleSwarm()))
    assert rough.minima[0].cost > 0.01  # a curved valley in five dimensions is too long for 100 iterations
    np.testing.assert_allclose(fine.minima[0].x, 1.0, atol=1e-3)
    assert fine.trace.best_cost[-1] == rough.minima[0].cost
    assert fine.trace.refined_cost == fine.minima[0].cost


def test_refined_minima_differ_and_come_best_first():
    found = ParticleSwarm(refined_candidates=4).minima(Known(rastrigin, cube(3, 5.12))).minima
    assert [m.cost for m in found] == sorted(m.cost for m in found)
    assert len(found) == 4
    assert len(np.unique(np.array([m.x for m in found]).round(2), axis=0)) > 1


def test_an_iteration_is_one_prediction_and_a_seed_gives_the_same_answer_twice():
    runs, search = [], ParticleSwarm(12, 25)
    for seed in (7, 7, 8):
        landscape = Known(rastrigin, cube(4), IdentificationSettings(seed=seed))
        runs.append(search.minima(landscape))
        assert landscape.calls == [12] * len(runs[-1].trace)
    np.testing.assert_array_equal(runs[0].minima[0].x, runs[1].minima[0].x)
    np.testing.assert_array_equal(runs[0].trace.quartiles, runs[1].trace.quartiles)
    assert (runs[0].trace.quartiles != runs[2].trace.quartiles).any()


# ---- rules ---------------------------------------------------------------------------------------------------------


def test_constriction_is_the_published_one():
    """K = 0.7298437881283576 for c1 = c2 = 2.05 (Clerc & Kennedy 2002, and the authors' code)."""
    for velocity, attraction in ((0.1, 0.0), (0.0, 0.1)):
        found = SWARM.next_velocity(np.array([velocity]), np.array([attraction]))
        assert found / 0.1 == pytest.approx(0.7298437881283576, rel=1e-15)


@pytest.mark.parametrize("velocity", [0.05, 0.15])
def test_no_step_of_a_particle_is_longer_than_the_limit(velocity):
    landscape = Known(rastrigin, Bounds(np.array([0.5, -5.0]), np.array([5.0, 0.1])))
    ParticleSwarm(50, 40, max_velocity=velocity, refined_candidates=0).minima(landscape)
    x = (np.array(landscape.seen) - landscape.bounds.lower) / landscape.bounds.width
    steps = np.abs(np.diff(x, axis=0))
    assert 0.9 * velocity < steps.max() <= velocity * (1 + 1e-12)


def test_the_swarm_starts_from_a_sobol_set():
    """One point in each of 64 equal boxes of a plane: balance of a scrambled Sobol set."""
    landscape = Known(quadratic, cube(2))
    ParticleSwarm(particles=64, iterations=1, refined_candidates=0).minima(landscape)
    counts, *_ = np.histogram2d(*landscape.seen[0].T, bins=8, range=[[-5, 5], [-5, 5]])
    assert (counts == 1).all()


def test_a_trace_keeps_the_lowest_so_far_what_was_asked_and_the_quartiles():
    costs = [np.array([9.0, 5.0, 7.0]), np.array([6.0, 8.0, 10.0]), np.array([3.0, 4.0, 5.0, 6.0, 7.0])]
    trace = SearchTrace.from_costs("search", costs)
    np.testing.assert_array_equal(trace.best_cost, [5, 5, 3])
    np.testing.assert_array_equal(trace.evaluations, [3, 6, 11])
    np.testing.assert_array_equal(trace.quartiles, [[6, 7, 8], [7, 8, 9], [4, 5, 6]])
    assert len(trace) == 3
