"""Multi-start and ParticleSwarm: known minima, the rules of its sources, bounds, seeds; planted values are found."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.inverse.bounds import Bounds
from creepkit.inverse.identify import identify
from creepkit.inverse.initial_search import search_problem
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.search.global_search import refined
from creepkit.inverse.search.multistart import screened_starts
from creepkit.inverse.search.particle_swarm import ParticleSwarm
from creepkit.inverse.settings import IdentificationSettings
from creepkit.records import History
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


def test_an_iteration_is_one_prediction_and_a_seed_gives_the_same_answer_twice():
    runs, search = [], ParticleSwarm(12, 25)
    for seed in (7, 7, 8):
        landscape = Known(rastrigin, cube(4), IdentificationSettings(seed=seed))
        runs.append(search.minima(landscape))
        assert landscape.calls == [12] * len(runs[-1].trace.best_cost)
    np.testing.assert_array_equal(runs[0].minima[0].x, runs[1].minima[0].x)
    np.testing.assert_array_equal(runs[0].trace.best_cost, runs[1].trace.best_cost)
    assert (runs[0].trace.best_cost != runs[2].trace.best_cost).any()


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


# ---- multi-start -----------------------------------------------------------------------------------------------------

# Least squares from several starts: planted values found from them, within bounds.


TIMES = np.geomspace(600.0, 4e5, 25)


def landscape(law, values, stresses=(60.0, 90.0, 130.0)):
    """Uniaxial tests without noise."""
    bar = ck.specimen("uniaxial")
    tests = []
    for stress in stresses:
        run = ck.simulate(law, bar, values, loading=ck.constant_stress(stress), times=TIMES)
        tests.append(History(name=f"{stress:g}", times=TIMES, outputs=run.outputs, loading=run.loading,
                             temperature=293.15))  # fmt: skip
    return search_problem(LeastSquaresProblem.from_histories(law, tests, bar, IdentificationSettings()), bar)


@pytest.mark.parametrize(
    ("name", "values"),
    [("norton", {"A": 1e-16, "n": 4.2}), ("strain-hardening", {"A": 3e-16, "n": 4.0, "m": -0.4}),
     ("hyperbolic-sine", {"A": 2e-9, "n": 1.7, "B": 45.0})],
)  # fmt: skip
def test_planted_values_are_found_from_many_starts(name, values):
    law = ck.law(name)
    view = landscape(law, values)
    ends = refined(view, screened_starts(view, starts=6, draws=32))
    found = view.coordinates.values(ends[0].x)
    assert {n: found[n] for n in values} == pytest.approx(values, rel=1e-3)
    assert sum(end.cost < ends[0].cost + 1e-4 for end in ends) >= 2
    assert all((view.bounds.lower <= end.x).all() and (end.x <= view.bounds.upper).all() for end in ends)


def test_one_prediction_for_all_starts_is_as_good_as_one_each():
    law = ck.law("strain-hardening")
    view = landscape(law, {"A": 3e-16, "n": 4.0, "m": -0.4})
    starts = np.array(screened_starts(view, starts=4, draws=16))
    values, jacobian = view.candidate_jacobian(starts)
    for k, u in enumerate(starts):
        alone = view.residuals(u)
        assert values[k] == pytest.approx(alone.values, rel=1e-6, abs=1e-9)
        assert jacobian[k] == pytest.approx(alone.jacobian, rel=1e-4, abs=1e-6)


# ---- bulge -----------------------------------------------------------------------------------------------------------

# The swarm on the real landscape: a planted bulge test through the reduced-order model.


TRUTH = {"A": 2e-16, "n": 4.5}
FRAMES = np.arange(1800.0, 43201.0, 1800.0)
LOADING, ELASTIC = ck.PressureJump(P1=8, P2=10, Tj=14400), ck.Elastic(E=150e3)
NORTON = ck.law("norton")
SMALL_SWARM = ParticleSwarm(particles=40, iterations=15, refined_candidates=2)


@pytest.fixture(scope="module")
def stand_in():
    return ck.specimen("bulge").reduced_order_model()


@pytest.fixture(scope="module")
def test():
    """By finite elements, to which an identification through the stand-in is corrected."""
    run = ck.simulate(NORTON, ck.specimen("bulge"), TRUTH, elastic=ELASTIC, loading=LOADING, times=FRAMES)
    rng = np.random.default_rng(1)
    sizes = {"amplitude": 1.5e-3, "width": 0.02, "shape": 0.02}
    noisy = {name: run.outputs[name] + sd * rng.standard_normal(FRAMES.size) for name, sd in sizes.items()}
    return ck.History("planted", FRAMES, noisy, LOADING, 293.15, specimen="bulge", elastic=ELASTIC)


def test_a_planted_law_lies_in_its_intervals_whatever_searched(stand_in, test):
    fit = identify(NORTON, [test], stand_in, search=SMALL_SWARM)
    default = identify(NORTON, [test], stand_in)
    assert all(e.low <= TRUTH[e.name] <= e.high for e in fit.estimates)
    assert fit.log_likelihood == pytest.approx(default.log_likelihood, abs=0.01)
    assert fit.search_trace is not None
    assert fit.search_trace.refined_cost <= fit.search_trace.best_cost[-1] + 1e-3 < fit.search_trace.best_cost[0]
    assert fit.search_trace.evaluations[-1] <= fit.provenance["search_evaluations"]
