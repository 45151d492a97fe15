"""Predictors of which one candidate in one test is written, against the bar that ships, and what is said of errors."""

import subprocess
import sys
from dataclasses import dataclass

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import FitError, PluginError, SolveError
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
    found = Bar().predict(NORTON, theta, plans(60.0), nuisances={}, sensitivities=True)
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


# ---- hostile specimens -----------------------------------------------------------------------------------------------

# Specimens of plugins that say nonsense, or do it, are refused in one sentence and harm no other.


THETA = NORTON.to_internal({"A": 1e-16, "n": 4.0})
FRAMES = np.linspace(0.0, 3600.0, 5)

PLUGIN = """
import creepkit as ck
class Piece(ck.PerTest):
    name, title = "hostile-piece", "A piece"
    outputs, loads = {outputs}, {loads}
    def one(self, law, values, history, nuisances):
        return {{}}
@ck.hookimpl
def creepkit_specimens():
    return [Piece()]
"""
GOOD_OUTPUT, GOOD_LOAD = '(ck.Output("sag", "length"),)', '(ck.Load("push", "force"),)'


@pytest.mark.parametrize(
    ("outputs", "loads", "said"),
    [
        (GOOD_OUTPUT, '("push",)', "record that cannot be read"),
        ("None", GOOD_LOAD, "record that cannot be read"),
        ("()", GOOD_LOAD, "give at least one name"),
        ('(ck.Output("push", "length"),)', GOOD_LOAD, "an output and a load called 'push'"),
        ('(ck.Output("time", "time"),)', GOOD_LOAD, "calls something 'time', which means something else"),
        (GOOD_OUTPUT, '(ck.Load("temperature", "temperature"),)', "calls something 'temperature'"),
        (GOOD_OUTPUT, '(ck.Load("control", "force"),)', "calls something 'control'"),
    ],
)
def test_a_record_that_files_and_options_could_not_use_is_no_specimen(tmp_path, outputs, loads, said):
    path = tmp_path / "hostile.py"
    path.write_text(PLUGIN.format(outputs=outputs, loads=loads))
    with pytest.raises(PluginError, match=said):
        ck.load_plugin(path)
    assert "uniaxial" in ck.available("specimens")


class Piece(ck.PerTest):
    """What it returns is what a test gives it."""

    name, title = "returning", "A piece that returns something"
    outputs, loads = (ck.Output("sag", "length"),), (ck.Load("push", "force"),)

    def __init__(self, returned):
        self.returned = returned

    def one(self, law, values, history, nuisances):
        return self.returned() if callable(self.returned) else self.returned


def plan(**changes):
    return ck.History("test", FRAMES, {}, ck.constant_load("push", 3.0), 1000.0, "returning", **changes)


@pytest.mark.parametrize(
    ("returned", "said"),
    [
        (None, "one.. gave None; it must return"),
        ({"sag": 1j * FRAMES}, "one.. gave 'sag' as array.*real numbers"),
        ({"sag": ["a"] * 5}, "real numbers, one for each time, are needed"),
        ({"sag": FRAMES[:3]}, "of shape .3,.; the test has 5 times"),
        (lambda: ck.OneTest({"sag": FRAMES}, status="ruptured"), "gave the status 'ruptured'; use ck.Status"),
        (lambda: sys.exit(0), "SystemExit: 0 .*test_per_test.py"),
        (lambda: FRAMES.missing, r"AttributeError: .*missing.* \(.*test_per_test.py:\d+\)"),
        ({"sga": FRAMES}, r"one\(\) gave 'sga'; it must give 'sag'"),
        ({"sag": np.nan * FRAMES}, "no finite 'sag' at some time and no end"),
    ],
)
def test_what_one_returns_is_judged_where_it_is_written(returned, said):
    with pytest.raises(SolveError, match=said) as raised:
        Piece(returned).predict(NORTON, THETA, [plan()])
    assert "specimen 'returning', test 'test' with A = 1e-16, n = 4: " in str(raised.value)


@dataclass(frozen=True)
class Rod(ck.PerTest):
    """A rod whose length has two names."""

    thickness: float = ck.dimension(2.0, (1.0, 4.0), tolerance=0.02, alias="t")
    name, title = "rod", "A rod"
    outputs, loads = (ck.Output("sag", "angle"),), (ck.Load("push", "force"),)

    def reference_stress(self, history):
        return history.loading.program().values.max() / self.thickness**2

    def one(self, law, values, history, nuisances):
        return {"sag": values["A"] * self.reference_stress(history) ** values["n"] * history.times}


def rods(*pushes, **changes):
    rng = np.random.default_rng(1)
    times = np.geomspace(600.0, 3.6e5, 15)
    values, found = {"A": 1e-16, "n": 4.0}, []
    for push in pushes:
        plan = {"loading": ck.constant_load("push", push), "times": times, "temperature": 1000.0}
        run = ck.simulate(NORTON, Rod(), values, **plan)
        sag = run.outputs["sag"] * (1.0 + 1e-3 * rng.standard_normal(15))
        found.append(run.replace(name=f"{push:g}", outputs={"sag": sag}, **changes))
    return found


def test_a_length_by_its_name_has_the_tolerance_of_its_specimen():
    fit = ck.identify("norton", rods(200.0, 300.0), Rod(), starts=1, nuisances=["thickness"])
    assert [n.prior_sd for n in fit.nuisances] == pytest.approx([0.04, 0.04])


def test_beyond_its_bounds_a_length_counts_as_at_them():
    plans = rods(200.0)
    at, beyond = (
        Rod().predict(NORTON, THETA, plans, nuisances={"thickness": np.array([[value]])}).values for value in (4.0, 5.0)
    )
    np.testing.assert_array_equal(at, beyond)


def test_outputs_of_one_name_in_other_units_are_not_fitted_together():
    length = Piece({"sag": FRAMES})
    other = plan().replace(outputs={"sag": FRAMES})
    with pytest.raises(FitError, match="'sag' is a angle of specimen 'rod' and a length of 'returning'"):
        ck.identify("norton", [*rods(200.0), other], {"rod": Rod(), "returning": length}, starts=1)
