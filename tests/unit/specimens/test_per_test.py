"""Predictors of which one candidate in one test is written, against the bar that ships, and what is said of errors."""

import subprocess
import sys
from dataclasses import dataclass

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import SolveError
from creepkit.inverse.composite_predictor import predict_with_sensitivities
from creepkit.records import Status
from creepkit.specimens.per_test import OneTest, PerTest

NORTON = ck.law("norton")
TRUTH = {"A": 1e-16, "n": 4.0}
TIMES = np.geomspace(600.0, 4e5, 20)


class Bar(PerTest):
    """Norton bars at constant true stress, in closed form."""

    name, title, outputs = "closed-form-bar", "Bar in closed form", ("strain",)
    nuisances = ("temperature",)

    def one(self, law, values, history, nuisances):
        stress = history.loading.program().values[0]
        return {"strain": values["A"] * stress ** values["n"] * history.times}


class Awk(PerTest):
    """The same by another program."""

    name, title, outputs, workers = "awk", "Another program", ("strain",), 2

    def one(self, law, values, history, nuisances):
        stress = history.loading.program().values[0]
        code = "import sys; A, n, s, *t = map(float, sys.argv[1:]); print(*[A * s**n * x for x in t])"
        numbers = map(repr, map(float, (values["A"], values["n"], stress, *history.times)))
        answer = subprocess.run([sys.executable, "-c", code, *numbers], capture_output=True, text=True, check=True)
        return {"strain": [float(word) for word in answer.stdout.split()]}


def plans(*stresses):
    return [ck.History(f"bar {s:g}", TIMES, {}, ck.constant_stress(s, "stress"), 1000.0) for s in stresses]


def planted(noise=1e-6):
    rng = np.random.default_rng(4)
    runs = ck.specimen("uniaxial").predict(NORTON, NORTON.to_internal(TRUTH), plans(60.0, 80.0, 100.0))
    return [
        h.replace(
            outputs={"strain": runs.of(k)[:, 0] + noise * rng.standard_normal(20)},
            standard_deviation={"strain": np.full(20, noise)},
        )
        for k, h in enumerate(plans(60.0, 80.0, 100.0))
    ]


def test_a_batch_is_that_of_the_bar_that_ships():
    theta = NORTON.to_internal({"A": np.array([1e-16, 3e-16, 1e-17]), "n": np.array([4.0, 3.5, 5.0])})
    tests = [plans(60.0)[0], plans(90.0)[0].replace(times=TIMES[:7])]
    found, bar = Bar().predict(NORTON, theta, tests), ck.specimen("uniaxial").predict(NORTON, theta, tests)
    np.testing.assert_allclose(found.values, bar.values, rtol=1e-6)
    assert (found.status == Status.COMPLETE).all()
    np.testing.assert_array_equal(found.lengths, [20, 7])


@pytest.mark.parametrize("using", [Bar(), Awk()], ids=["formula", "program"])
def test_planted_values_are_found_from_data_of_another_solver(using):
    fit = ck.identify(NORTON, planted(), using, starts=1, sobol_points=4, nuisances=[], weights="likelihood")
    for estimate in fit.estimates:
        assert estimate.low < TRUTH[estimate.name] < estimate.high
    assert fit.values["n"] == pytest.approx(4.0, rel=1e-3)


class Ends(Bar):
    def one(self, law, values, history, nuisances):
        strain = np.asarray(super().one(law, values, history, nuisances)["strain"])
        if strain[-1] > 0.01:
            return OneTest({"strain": np.where(strain > 0.01, np.nan, strain)}, Status.RUPTURED, 1e5)
        if values["n"] > 7.0:
            raise SolveError("no equilibrium")
        return {"strain": strain}


def test_an_early_end_and_values_without_a_solution_are_results():
    theta = NORTON.to_internal({"A": np.array([1e-16, 1e-12, 1e-30]), "n": np.array([4.0, 4.0, 7.5])})
    found = Ends().predict(NORTON, theta, plans(60.0))
    assert found.status[:, 0].tolist() == [Status.COMPLETE, Status.RUPTURED, Status.NOT_CONVERGED]
    assert found.end_times[1, 0] == 1e5
    assert np.isnan(found.values[2]).all()
    assert found.reason == "no equilibrium"


def test_differences_leave_a_coefficient_off_that_is_off():
    """-inf has no neighbours: its derivative is zero, and nothing is warned of."""
    theta = NORTON.to_internal({"A": 0.0, "n": 4.0})
    found = predict_with_sensitivities(Bar(), NORTON, theta[0], plans(60.0), {})
    np.testing.assert_array_equal(found.jacobian, np.zeros_like(found.jacobian))


@dataclass(frozen=True)
class Wire(PerTest):
    """A wire that hangs under a weight, of a length and a diameter."""

    name, title = "wire", "Wire under a weight"
    outputs = (ck.Output("elongation", "length", noise=1e-3),)
    loads = (ck.Load("weight", "force"),)
    gauge: float = ck.dimension(1000.0)
    diameter: float = ck.dimension(1.0, (0.1, 10.0), tolerance=0.01)

    def reference_stress(self, history):
        return history.loading.program().values.max() / (np.pi / 4 * self.diameter**2)

    def one(self, law, values, history, nuisances):
        stress = history.loading.program().values[0] / (np.pi / 4 * self.diameter**2)
        return {"elongation": values["A"] * stress ** values["n"] * history.times * self.gauge}


def wire(**geometry):
    return ck.History("wire", TIMES, {}, ck.constant_load("weight", 60.0), 1000.0, "wire", geometry=geometry)


def test_a_length_is_what_the_test_states_else_its_nuisance_else_the_default():
    theta = NORTON.to_internal(TRUTH)
    as_built, stated = Wire().predict(NORTON, theta, [wire()]), Wire().predict(NORTON, theta, [wire(diameter=1.1)])
    np.testing.assert_allclose(stated.values, as_built.values * 1.1**-8, rtol=1e-12)
    given = Wire().predict(NORTON, theta, [wire(diameter=1.1)], nuisances={"diameter": np.array([[1.2]])})
    np.testing.assert_allclose(given.values, as_built.values * 1.2**-8, rtol=1e-12)
    changed = Wire().replace(diameter=1.2).predict(NORTON, theta, [wire()])
    np.testing.assert_allclose(changed.values, given.values, rtol=1e-12)


def test_a_diameter_is_found_as_a_nuisance_parameter():
    """Five wires drawn to 1 %: each diameter lies within three of its standard deviations."""
    rng = np.random.default_rng(5)
    tests, diameters = [], 1.0 + 0.01 * rng.standard_normal(5)
    for k, (diameter, weight) in enumerate(zip(diameters, (40.0, 50.0, 60.0, 70.0, 80.0), strict=True)):
        plan = wire(diameter=diameter).replace(loading=ck.constant_load("weight", weight), name=f"wire {k}")
        exact = Wire().predict(NORTON, NORTON.to_internal(TRUTH), [plan]).of(0)[:, 0]
        noisy = exact + 1e-3 * rng.standard_normal(TIMES.size)
        sd = {"elongation": np.full(TIMES.size, 1e-3)}
        tests.append(plan.replace(outputs={"elongation": noisy}, standard_deviation=sd, geometry={}))
    nuisance = ck.Nuisance("diameter", sd=0.01)
    fit = ck.identify("norton", tests, Wire(), starts=1, sobol_points=16, nuisances=[nuisance], weights="likelihood")
    for estimate in fit.estimates:
        assert estimate.low < TRUTH[estimate.name] < estimate.high
    assert "mm" in fit.details()
    for estimate, truth in zip(fit.nuisances, diameters, strict=True):
        assert abs(estimate.value - truth) < 3.0 * estimate.sd


def test_it_simulates_and_forecasts():
    run = ck.simulate(NORTON, Bar(), TRUTH, loading=ck.constant_stress(80.0, "stress"), times=TIMES)
    np.testing.assert_allclose(run.outputs["strain"], 1e-16 * 80.0**4 * TIMES, rtol=1e-12)
    fit = ck.identify(NORTON, planted(), Bar(), starts=1, nuisances=[ck.Nuisance("rate", sd=0.1)])
    one = fit.forecast(plans(70.0)).tests[0].outputs["strain"]
    assert one.band.low[-1] < 1e-16 * 70.0**4 * TIMES[-1] < one.band.high[-1]
