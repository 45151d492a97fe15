"""Specimens of plugins that say nonsense, or do it, are refused in one sentence and harm no other."""

import sys
from dataclasses import dataclass

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import FitError, PluginError, SolveError

NORTON = ck.law("norton")
THETA = NORTON.to_internal({"A": 1e-16, "n": 4.0})
TIMES = np.linspace(0.0, 3600.0, 5)

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
    return ck.History("test", TIMES, {}, ck.constant_load("push", 3.0), 1000.0, "returning", **changes)


@pytest.mark.parametrize(
    ("returned", "said"),
    [
        (None, "one.. gave None; it must return"),
        ({"sag": 1j * TIMES}, "one.. gave 'sag' as array.*real numbers"),
        ({"sag": ["a"] * 5}, "real numbers, one for each time, are needed"),
        ({"sag": TIMES[:3]}, "of shape .3,.; the test has 5 times"),
        (lambda: ck.OneTest({"sag": TIMES}, status="ruptured"), "gave the status 'ruptured'; use ck.Status"),
        (lambda: sys.exit(0), "SystemExit: 0 .*test_hostile_specimens.py"),
        (lambda: TIMES.missing, r"AttributeError: .*missing.* \(.*test_hostile_specimens.py:\d+\)"),
        ({"sga": TIMES}, r"one\(\) gave 'sga'; it must give 'sag'"),
        ({"sag": np.nan * TIMES}, "no finite 'sag' at some time and no end"),
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
    length = Piece({"sag": TIMES})
    other = plan().replace(outputs={"sag": TIMES})
    with pytest.raises(FitError, match="'sag' is a angle of specimen 'rod' and a length of 'returning'"):
        ck.identify("norton", [*rods(200.0), other], {"rod": Rod(), "returning": length}, starts=1)
