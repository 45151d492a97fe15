"""Specimens of plugins that say nonsense, or do it, are refused in one sentence and harm no other."""

import sys

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import PluginError, SolveError

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
    ],
)
def test_what_one_returns_is_judged_where_it_is_written(returned, said):
    with pytest.raises(SolveError, match=said) as raised:
        Piece(returned).predict(NORTON, THETA, [plan()])
    assert "specimen 'returning', test 'test'" in str(raised.value)
