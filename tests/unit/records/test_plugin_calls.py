"""What a plugin's object raises while a verb runs becomes one sentence with the plugin's file and line."""

import re
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import SolveError
from creepkit.exporters.exporting import exported_text
from creepkit.readers.reading import read_histories
from creepkit.records.predictor import checked_prediction
from helpers.mistakes import said_otherwise

TIMES = np.linspace(100.0, 5000.0, 8)
VALUES = {"A": 1e-14, "n": 4.0}


class Broken(ck.Specimen):
    """A specimen, reader and exporter whose code is wrong."""

    name, title, suffix, outputs, nuisances = "broken", "Broken", ".txt", ("strain",), ()

    def predict_batch(self, law, theta, histories, nuisances, sensitivities):
        return np.zeros(3)[7]

    def accepts(self, path):
        return True

    def read(self, path):
        return {}["no such column"]

    def text(self, source):
        return 1.0 / 0.0 + "text"


class WithRun(Broken):
    def run(self, law, values, plan):
        raise OSError("the other program is not there")


class Asked(Broken):
    def accepts(self, path):
        return path.read_text()[99]


class ReadsNothing(Broken):
    def read(self, path):
        return None


class ReadsNumbers(Broken):
    def read(self, path):
        return [3]


def test_what_a_plugin_raises_is_one_sentence_with_its_file_and_line(tmp_path: Path) -> None:
    (tmp_path / "test.txt").write_text("0 0\n")

    def simulate(specimen):
        return lambda: ck.simulate("norton", specimen, VALUES, loading=ck.constant_stress(80.0), times=TIMES)

    def read(*readers):
        return lambda: read_histories(tmp_path / "test.txt", [*readers])

    at = rf" \({re.escape(__file__)}, line \d+\)"
    cases = (
        (simulate(Broken()), rf"predictor 'broken': predict_batch\(\) raised IndexError: index 7.*{at}"),
        (simulate(WithRun()), r"specimen 'broken': run\(\) raised OSError: the other program"),
        (read(Broken()), rf"read\(\) of reader 'broken' raised KeyError.*{at}"),
        (read(Asked(), Broken()), rf"accepts\(\) of reader 'broken' raised IndexError.*{at}$"),
        (read(ReadsNothing()), "a NoneType; it must return a list"),
        (read(ReadsNumbers()), "a int in its list"),
        (lambda: exported_text(Broken(), ck.LawWithValues(ck.law("norton"), VALUES)),
         rf"exporter 'broken': text\(\) raised ZeroDivisionError.*{at}"),
    )  # fmt: skip
    assert said_otherwise(cases) == []


def test_what_creepkit_itself_does_wrong_is_not_put_down_to_a_plugin(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("creepkit.specimens.uniaxial.Uniaxial.point_test", None)
    test = ck.History("a", TIMES, {"strain": 1e-6 * TIMES}, ck.constant_stress(80.0), 1000.0)

    with pytest.raises(TypeError):
        ck.identify("norton", [test], starts=1, nuisances=[])


# ---- prediction checks -----------------------------------------------------------------------------------------------

# What a predictor may not return, said in one sentence to whoever simulates or identifies with it.


BAR = ck.specimen("uniaxial")
FRAMES = np.linspace(100.0, 5000.0, 20)


class Stub(ck.Predictor):
    """A plugin's specimen that returns the prediction of a bar, changed."""

    name, title, outputs, nuisances = "uniaxial", "Stub", ("strain",), ()

    def __init__(self, change) -> None:
        self.change = change

    def predict_batch(self, law, theta, histories, nuisances, sensitivities):
        return self.change(BAR.predict(law, theta, histories, sensitivities=sensitivities))


def simulated(using=BAR, stress: float = 100.0):
    return ck.simulate("norton", using, VALUES, loading=ck.constant_stress(stress), times=FRAMES)


def converted(name: str, kind):
    return lambda made: replace(made, **{name: getattr(made, name).astype(kind)})


def test_a_prediction_that_is_none_is_one_sentence() -> None:
    histories, cases = [simulated(), simulated(stress=150.0).replace(name="b")], []
    for change, said in (
        (lambda made: None, "a NoneType from predict_batch\\(\\); it must return a Prediction"),
        (lambda made: replace(made, values=made.values.tolist()), "a list as values; it must be an array of shape"),
        (lambda made: replace(made, values=made.values.ravel()), "values of shape .* it must be .* for what was asked"),
        (lambda made: replace(made, values=made.values[:, :, 1:]), "values of shape .* it must be .*20, 1\\)"),
        (lambda made: replace(made, status=made.status[0, 0]), "a int64 as status; it must be an array"),
        (lambda made: replace(made, status=made.status + 77), "the status 77; known are 0 \\(complete\\), 1"),
        (lambda made: replace(made, lengths=made.lengths - 1), "the lengths .19.*; they must be the numbers of times"),
        (lambda made: replace(made, outputs=("foo",)), "outputs foo; it must predict those that it names, strain"),
        (converted("values", complex), "values of type complex128; it must hold real floating point numbers"),
        (converted("end_times", str), "end_times of type <U.*; it must hold real numbers"),
    ):
        sentence, stub = f"^predictor 'uniaxial' (returned|predicted the) {said}", Stub(change)
        cases.append((partial(simulated, stub), sentence))
        cases.append((partial(ck.identify, "norton", histories, stub, seed=0), sentence))
    assert said_otherwise(cases) == []


def test_derivatives_have_a_column_for_each_parameter() -> None:
    law, history = ck.law("norton"), simulated()
    made = BAR.predict(law, law.to_internal(VALUES), [history], sensitivities=True)

    assert checked_prediction(made, BAR, [history], 1, 2) is made
    with pytest.raises(SolveError, match=r"jacobian of shape \(1, 1, 20, 1, 2\); it must be \(1, 1, 20, 1, 3\)"):
        checked_prediction(made, BAR, [history], 1, 3)
