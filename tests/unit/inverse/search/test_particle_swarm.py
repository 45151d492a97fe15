"""ParticleSwarm: known minima, the rules of its sources, walls, seeds, and terms that may be off."""

import numpy as np
import pytest

from creepkit.inverse.bounds import Bounds
from creepkit.inverse.search.derivative_free import ParticleSwarm
from creepkit.inverse.settings import IdentificationSettings
from helpers.cost_functions import SUM, Known, cube, quadratic, rastrigin, rosenbrock

BARE = ParticleSwarm(refined_candidates=0)
SMALL = ParticleSwarm(particles=40, iterations=30)
BEYOND = Bounds(np.array([2.0, -5.0]), np.array([5.0, 5.0]))
"""The minimum lies beyond a wall."""


def paths(landscape):
    """(iterations, particles, parameters) where the particles were, in widths of the box."""
    return (np.array(landscape.seen) - landscape.bounds.lower) / landscape.bounds.width


# ---- known minima --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "swarm",
    [
        BARE,
        ParticleSwarm(refined_candidates=0, form="inertia"),
        ParticleSwarm(refined_candidates=0, boundary="reflect"),
    ],
)
@pytest.mark.parametrize(
    ("cost", "box", "at"),
    [
        (quadratic, cube(3), [1, 2, 3]),
        (quadratic, BEYOND, [2, 2]),
        (rosenbrock, cube(2), [1, 1]),
        (rastrigin, cube(3, 5.12), [0, 0, 0]),
    ],
)
def test_the_papers_swarm_finds_known_minima_by_itself(swarm, cost, box, at):
    found = swarm.minima(Known(cost, box)).minima[0]
    np.testing.assert_allclose(found.x, at, atol=0.02)
    assert found.cost == cost(found.x[None])[0]


def test_least_squares_finishes_what_the_swarm_leaves():
    rough, fine = (s.minima(Known(rosenbrock, cube(5))) for s in (BARE, ParticleSwarm()))
    assert rough.minima[0].cost > 0.01  # a curved valley in five dimensions is too long for 100 iterations
    np.testing.assert_allclose(fine.minima[0].x, 1.0, atol=1e-3)
    assert fine.trace.best_cost[-1] == rough.minima[0].cost
    assert fine.trace.refined_cost == fine.minima[0].cost


# ---- rules ---------------------------------------------------------------------------------------------------------


def test_constriction_is_the_published_one():
    """K = 0.7298437881283576 for c1 = c2 = 2.05 (Clerc & Kennedy 2002, and the authors' code)."""
    assert BARE.next_velocity(np.array([0.1]), np.zeros(1), 0) / 0.1 == pytest.approx(0.7298437881283576, rel=1e-15)
    assert BARE.next_velocity(np.zeros(1), np.array([0.1]), 0) / 0.1 == pytest.approx(0.7298437881283576, rel=1e-15)


def test_inertia_falls_from_its_first_value_to_its_last():
    swarm = ParticleSwarm(form="inertia", inertia=(0.9, 0.4), iterations=11)
    found = [swarm.next_velocity(np.array([0.1]), np.zeros(1), k)[0] / 0.1 for k in (0, 5, 10)]
    np.testing.assert_allclose(found, [0.9, 0.65, 0.4])


@pytest.mark.parametrize("boundary", ["absorb", "reflect"])
@pytest.mark.parametrize("velocity", [0.05, 0.15])
def test_no_step_is_longer_than_the_limit_and_none_leaves_the_box(boundary, velocity):
    landscape = Known(rastrigin, Bounds(np.array([0.5, -5.0]), np.array([5.0, 0.1])))
    swarm = ParticleSwarm(50, 40, boundary=boundary, max_velocity=velocity, refined_candidates=0)
    found = swarm.minima(landscape)
    assert landscape.calls == [50] * 40
    np.testing.assert_array_equal(found.trace.evaluations, 50 * np.arange(1, 41))
    x = paths(landscape)
    assert x.min() >= 0
    assert x.max() <= 1
    steps = np.abs(np.diff(x, axis=0))
    assert steps.max() <= velocity * (1 + 1e-12)
    assert steps.max() > 0.9 * velocity


def test_walls_absorb_or_reflect():
    """Pushed through a wall by .1 of the box, a particle stops there, or comes back by what it went too far."""
    from creepkit.inverse.search.derivative_free import _Swarm

    for walls, place, speed in (("absorb", 1.0, 0.0), ("reflect", 0.93, -0.1)):
        flight = _Swarm(ParticleSwarm(particles=2, boundary=walls), Known(quadratic, cube(2)))
        flight.velocity = np.full((2, 2), 0.1)
        flight._apply_boundary(np.array([[1.07, 0.5], [0.2, 0.3]]))
        np.testing.assert_allclose(flight.x, [[place, 0.5], [0.2, 0.3]])
        np.testing.assert_allclose(flight.velocity, [[speed, 0.1], [0.1, 0.1]])


def test_it_starts_from_a_sobol_set_at_rest():
    """One point in each of 64 equal boxes of a plane: balance of a scrambled Sobol set."""
    landscape = Known(quadratic, cube(2))
    ParticleSwarm(particles=64, iterations=1, refined_candidates=0).minima(landscape)
    counts, *_ = np.histogram2d(*paths(landscape)[0].T, bins=8, range=[[0, 1], [0, 1]])
    assert (counts == 1).all()


# ---- one prediction an iteration, seeds, progress ------------------------------------------------------------------


def test_a_seed_gives_the_same_answer_twice_and_another_seed_another():
    runs = [SMALL.minima(Known(rastrigin, cube(4), IdentificationSettings(seed=seed))) for seed in (7, 7, 8)]
    np.testing.assert_array_equal(runs[0].minima[0].x, runs[1].minima[0].x)
    np.testing.assert_array_equal(runs[0].trace.quartiles, runs[1].trace.quartiles)
    assert (runs[0].trace.quartiles != runs[2].trace.quartiles).any()


def test_patience_ends_a_swarm_that_gains_nothing():
    landscape = Known(quadratic, cube(1))
    found = ParticleSwarm(particles=50, patience=5).minima(landscape)
    assert len(found.trace) < 60
    assert found.minima[0].x == pytest.approx(1.0, abs=1e-4)


# ---- terms that may be off -----------------------------------------------------------------------------------------

WAVE = 0.02
BOX = Bounds(np.array([-12.0, 1.0, -12.0, 1.0, -1.0]), np.array([6.0, 8.0, 6.0, 8.0, 0.0]))
POWER, HARDENING = SUM.terms


def curve(u):
    """A sum of two terms at 20 times: exp(u0) (1 + n1 t) + exp(u2) t^(1 + m)."""
    t = np.linspace(0.05, 1.0, 20)
    first = np.exp(u[:, :1]) * (1 + u[:, 1:2] * t)
    return first + np.exp(u[:, 2:3]) * t ** (1 + u[:, 4:5])


def planted(*terms, price=5.0):
    """The landscape of a curve that has only these terms, with waves of .02; rates lie at 0 and 2.

    price : added to half of chi-square for each term whose rate is above a thousandth, more or less.
    """
    truth = np.array([[0.5 if POWER in terms else -60.0, 3.0, 0.3 if HARDENING in terms else -60.0, 4.0, -0.6]])
    data = curve(truth)[0] + WAVE * np.cos(np.arange(20.0))

    def cost(u):
        size = np.exp(u[:, [0, 2]])
        return 0.5 * (((curve(u) - data) / WAVE) ** 2).sum(axis=1) + price * (size / (size + 1e-3)).sum(axis=1)

    return Known(cost, BOX, law=SUM, rates=(0, 2))


def test_refined_minima_differ_and_come_best_first():
    found = ParticleSwarm(refined_candidates=4).minima(Known(rastrigin, cube(3, 5.12))).minima
    assert [m.cost for m in found] == sorted(m.cost for m in found)
    starts = np.array([m.x for m in found])
    assert len(found) == 4
    assert len(np.unique(starts.round(2), axis=0)) > 1
