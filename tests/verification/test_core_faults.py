"""Faults that the compiled core must answer: laws that give nonsense, tangents without inverse, wrong entries."""

import ctypes
from dataclasses import replace

import numpy as np
import pytest

from creepkit import kernels
from creepkit.fem.finite_element_model import FiniteElementModel, finite_element_model
from creepkit.fem.simulation import LoadHistory, Simulation, sensitivity_directions, simulate
from creepkit.fem.solver import SolverSettings
from creepkit.integration import PointTest, integrate
from creepkit.kernels.interface import CompiledEntry, CompiledLaw
from creepkit.laws.norton import NORTON
from creepkit.records import Program, Status
from creepkit.specimens.bulge.geometry import DimpleGeometry

THETA = np.array([np.log(1e-14), 4.0])
RAMP = Program(np.array([0.0, 5.0]), np.array([0.0, 8.0]))
LOAD = LoadHistory(RAMP, Program.constant(1000.0), Program.constant(150e3), 3600.0)
DOUBLES = ctypes.POINTER(ctypes.c_double)
C_ENTRY = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64, DOUBLES, DOUBLES, DOUBLES)


@pytest.fixture(scope="module")
def body() -> FiniteElementModel:
    return finite_element_model(DimpleGeometry().mesh(0.5))


def norton() -> CompiledLaw:
    return kernels.lower(NORTON, "compiled")


def entry(columns: int, value: float) -> CompiledEntry:
    """A law's entry that gives one number everywhere."""

    def fill(rows, x, theta, out) -> int:
        for k in range(columns * rows):
            out[k] = value
        return 3

    function = C_ENTRY(fill)
    pointer = ctypes.cast(function, ctypes.c_void_p).value
    assert pointer is not None
    return CompiledEntry(pointer, function)


def run(body: FiniteElementModel, law: CompiledLaw, theta=THETA, **more) -> Simulation:
    return simulate(law, theta, body, LOAD, settings=SolverSettings(max_steps=200), **more)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e308, -1e308, 0.0])
def test_a_law_of_one_number_ends_in_a_status(body, value: float) -> None:
    law = replace(norton(), update=entry(7, value))
    assert run(body, law).status in Status
    point = PointTest(Program.constant(100.0), Program.constant(1000.0), np.array([10.0, 1000.0]))
    law = replace(law, rate=entry(1, value), sensitivity=entry(9, value))
    assert np.isin(integrate(law, THETA, [point], jacobian=True).status, [int(s) for s in Status]).all()


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_derivatives_that_are_no_numbers_end_the_simulation(body, value: float) -> None:
    made = run(body, replace(norton(), sensitivity=entry(9, value)), directions=sensitivity_directions(body, LOAD))
    assert made.status is Status.NOT_CONVERGED
    assert "tangent was singular" in made.reason


@pytest.mark.parametrize("theta", [[np.nan, 4.0], [0.0, np.inf], [-np.inf, 4.0], [700.0, 4.0], [-30.0, -5.0]])
def test_any_parameters_end_in_a_status(body, theta: list[float]) -> None:
    made = run(body, norton(), np.array(theta), directions=sensitivity_directions(body, LOAD))
    assert made.status in Status
    assert made.times.size >= 1


def test_one_thread_and_many_agree_to_the_last_bit(body) -> None:
    from concurrent.futures import ThreadPoolExecutor

    law = norton()
    thetas = [np.array([np.log(1e-14) + 0.1 * k, 4.0]) for k in range(8)]
    alone = [run(body, law, theta).displacements for theta in thetas]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda theta: run(body, law, theta).displacements, thetas))
    for one, other in zip(alone, together, strict=True):
        np.testing.assert_array_equal(one, other)
