"""Ends that are answers: how a march says that a body burst, or that it could not go on, and what it keeps."""

import numpy as np
import pytest
import sympy

from creepkit import kernels
from creepkit.fem.finite_element_model import FiniteElementModel, finite_element_model
from creepkit.fem.simulation import REASONS, LoadHistory, Simulation, simulate
from creepkit.fem.solver import DEFLECTION_LIMIT, LIMIT_LOAD, STRAIN_LIMIT, TOO_MANY_STEPS, SolverSettings
from creepkit.language import CreepLaw, Elastic, strain, stress, time
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.records import History, PressureJump, Program, Status
from creepkit.specimens.bulge.geometry import DimpleGeometry
from creepkit.specimens.bulge.specimen import Bulge
from helpers.literature_laws import POWER, RATE, A, k, law, n, number

FAST = {"A": 1e-11, "n": 3.0}
RAMP = Program(np.array([0.0, 5.0]), np.array([0.0, 8.0]))
END = 14400.0


@pytest.fixture(scope="module")
def body() -> FiniteElementModel:
    return finite_element_model(DimpleGeometry().mesh(0.5))


def run(
    body: FiniteElementModel, creep: CreepLaw, values, pressure: Program = RAMP, end: float = END, **settings
) -> Simulation:
    kernel = kernels.lower(creep, "compiled")
    course = LoadHistory(pressure, Program.constant(300.0), Program.constant(150e3), end)
    return simulate(
        kernel, creep.to_internal(values)[0], body, course, settings=SolverSettings(**settings), keep_points=True
    )


def history_is_kept(made: Simulation, body: FiniteElementModel) -> None:
    """Finite up to the end, nothing after it."""
    assert made.end_time == made.times[-1]
    assert np.isfinite(made.displacements).all()
    assert np.isfinite(made.mises).all()
    apex = made.displacements[:, body.top[0], 1]
    assert made.at(apex, made.times[-1:])[0] == pytest.approx(apex[-1], rel=1e-12)
    assert np.isnan(made.at(apex, np.array([made.end_time * 1.001 + 1e-6, END]))).all()


def test_burst_by_deflection(body) -> None:
    made = run(body, NORTON, FAST, deflection_limit=1.0)
    apex = made.displacements[:, body.top[0], 1]
    assert (made.status, made.reason) == (Status.RUPTURED, REASONS[DEFLECTION_LIMIT])
    assert apex[-2] < 1.0 <= apex[-1]
    assert 0 < made.end_time < END
    history_is_kept(made, body)


def test_the_time_of_a_burst_does_not_depend_on_the_steps(body) -> None:
    """The limit is located within a step: to a thousandth of itself, whatever the tolerance of the steps."""
    coarse, fine = (run(body, NORTON, FAST, deflection_limit=1.0, tolerance=t, newton=1e-2 * t) for t in (3e-2, 3e-4))
    for made in (coarse, fine):
        assert made.displacements[-1, body.top[0], 1] == pytest.approx(1.0, rel=2e-3)
    assert coarse.times.size < fine.times.size / 3
    assert coarse.end_time == pytest.approx(fine.end_time, rel=5e-3)


def test_burst_by_strain(body) -> None:
    made = run(body, NORTON, FAST, strain_limit=0.05)
    largest = made.values[:, :, 3].max(axis=1)
    assert (made.status, made.reason) == (Status.RUPTURED, REASONS[STRAIN_LIMIT])
    assert largest[-2] < 0.05 <= largest[-1]
    history_is_kept(made, body)


def test_a_burst_lies_where_the_unlimited_run_passes_the_limit(body) -> None:
    """Limits change no step before the one that passes them, which they cut."""
    limited, free = run(body, NORTON, FAST, deflection_limit=1.0), run(body, NORTON, FAST, deflection_limit=2.0)
    apex = free.displacements[:, body.top[0], 1]
    count = int(np.argmax(apex > 1.0))
    np.testing.assert_array_equal(limited.times[:count], free.times[:count])
    np.testing.assert_array_equal(limited.displacements[:count], free.displacements[:count])
    times = np.linspace(free.times[count - 1], free.times[count], 4001)
    passed = times[np.argmax(free.at(apex, times) > 1.0)]
    assert limited.end_time == pytest.approx(passed, rel=3e-3)


@pytest.mark.parametrize("most", [0, 1, 12])
def test_the_cap_on_steps_counts_those_refused_as_well(body, most: int) -> None:
    made = run(body, NORTON, FAST, max_steps=most)
    assert (made.status, made.reason) == (Status.NOT_CONVERGED, REASONS[TOO_MANY_STEPS])
    assert made.iterations[:2].sum() == most
    history_is_kept(made, body)


def test_limit_load(body) -> None:
    """sinh(s/1 MPa)^3 flows at any rate near 10 MPa: a roof of that strength carries no 8 MPa.

    Its plastic limit load as a clamped plate, 11.3 s (h/a)^2/4 (Hopkins and Wang 1954), is 0.1 to 1 MPa; as a dome,
    when it has bulged, more.
    """
    made = run(body, HYPERBOLIC_SINE, {"A": 1e-5, "n": 3.0, "B": 1.0}, deflection_limit=np.inf, strain_limit=np.inf)
    assert (made.status, made.reason) == (Status.RUPTURED, REASONS[LIMIT_LOAD])
    assert made.end_time < 5.0
    assert made.mises.max() < 30.0
    history_is_kept(made, body)


def test_an_elastic_roof_that_buckles_has_a_limit_load_too(body) -> None:
    """Suction of 5e5 MPa, at once: no equilibrium, and no row but that of rest."""
    made = run(body, NORTON, {"A": 1e-40, "n": 1.0}, Program.constant(-5e5), deflection_limit=np.inf)
    assert (made.status, made.reason) == (Status.RUPTURED, REASONS[LIMIT_LOAD])
    assert made.times.tolist() == [0.0]


WILD = {
    "no number beyond a stress": (law(A * stress**n * sympy.log(k - stress), {A: RATE, n: POWER, k: number(1, 100)}),
                                  {"A": 1e-9, "n": 2.0, "k": 50.0}),
    "a pole in strain": (law(A * stress**n / (k - strain), {A: RATE, n: POWER, k: number(1e-3, 1)}),
                         {"A": 1e-12, "n": 3.0, "k": 0.02}),
    "beyond all numbers at once": (law(A * sympy.exp(k * stress), {A: RATE, k: number(1, 100)}),
                                   {"A": 1e-5, "k": 100.0}),
    "tertiary creep": (law(A * stress**n * sympy.exp(k * strain), {A: RATE, n: POWER, k: number(1, 1000)}),
                       {"A": 1e-12, "n": 3.0, "k": 500.0}),
    "without bound in time": (law(A * stress**n * sympy.exp(k * time), {A: RATE, n: POWER, k: number(0, 2)}),
                              {"A": 1e-12, "n": 3.0, "k": 1.0}),
    "the fastest of Table 1": (NORTON, {"A": 1e-5, "n": 8.0}),
}  # fmt: skip
"""Laws that grow without bound or are no number, with values that take them there."""


@pytest.mark.parametrize("name", WILD)
def test_a_wild_law_ends_with_a_status(body, name: str) -> None:
    made = run(body, *WILD[name])
    assert made.status in (Status.RUPTURED, Status.NOT_CONVERGED)
    assert made.reason
    assert made.iterations[:2].sum() <= SolverSettings().max_steps
    history_is_kept(made, body)


def test_a_failed_test_predicts_nothing_after_its_end() -> None:
    """Of three candidates in one call only the mild one has numbers at the end; none is infinite."""
    times = np.array([5.0, 60.0, 600.0, END])
    test = History(
        name="planted", times=times, outputs={}, loading=PressureJump(8.0, 8.0, 7200.0), temperature=300.0,
        specimen="bulge", elastic=Elastic(E=150e3),
    )  # fmt: skip
    found = Bulge(refinement=0.5, threads=1, deflection_limit=0.5).predict(
        NORTON, NORTON.to_internal({"A": np.array([1e-13, 1e-11, 1e-5]), "n": np.array([3.0, 3.0, 8.0])}), [test]
    )
    assert found.status[:, 0].tolist() == [Status.COMPLETE, Status.RUPTURED, Status.RUPTURED]
    for c in range(3):
        assert (np.isfinite(found.values[c, 0]) == (times <= found.end_times[c, 0])[:, None]).all()
    assert found.end_times[0, 0] == END
    assert 600.0 < found.end_times[1, 0] < END
    assert found.end_times[2, 0] < 5.0
