"""The swarm on the real landscape: a planted bulge test through the stand-in of one degree of freedom."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.inverse.identify import identify
from creepkit.inverse.search.particle_swarm import ParticleSwarm

TRUTH = {"A": 2e-16, "n": 4.5}
TIMES = np.arange(1800.0, 43201.0, 1800.0)
LOADING, ELASTIC = ck.PressureJump(P1=8, P2=10, Tj=14400), ck.Elastic(E=150e3)
NORTON = ck.law("norton")
SWARM = ParticleSwarm(particles=40, iterations=15, refined_candidates=2)


@pytest.fixture(scope="module")
def stand_in():
    return ck.specimen("bulge").reduced_order_model()


@pytest.fixture(scope="module")
def test(stand_in):
    run = ck.simulate(NORTON, stand_in, TRUTH, elastic=ELASTIC, loading=LOADING, times=TIMES)
    rng = np.random.default_rng(1)
    sizes = {"amplitude": 1.5e-3, "width": 0.02, "shape": 0.02}
    noisy = {name: run.outputs[name] + sd * rng.standard_normal(TIMES.size) for name, sd in sizes.items()}
    return ck.History("planted", TIMES, noisy, LOADING, 293.15, specimen="bulge", elastic=ELASTIC)


def test_a_planted_law_lies_in_its_intervals_whatever_searched(stand_in, test):
    fit = identify(NORTON, [test], stand_in, search=SWARM)
    default = identify(NORTON, [test], stand_in)
    assert all(e.low <= TRUTH[e.name] <= e.high for e in fit.estimates)
    assert fit.log_likelihood == pytest.approx(default.log_likelihood, abs=0.01)
    assert fit.search_trace is not None
    assert fit.search_trace.refined_cost <= fit.search_trace.best_cost[-1] + 1e-3 < fit.search_trace.best_cost[0]
    assert fit.search_trace.evaluations[-1] <= fit.provenance["search_evaluations"]
