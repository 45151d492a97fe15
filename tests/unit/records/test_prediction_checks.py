"""What a predictor may not return, said in one sentence to whoever simulates or identifies with it."""

from dataclasses import replace

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import SolveError
from creepkit.records import Prediction, checked_prediction

BAR = ck.specimen("uniaxial")
VALUES = {"A": 1e-14, "n": 4.0}
TIMES = np.linspace(100.0, 5000.0, 20)


class Stub:
    """A plugin's specimen that returns the prediction of a bar, changed."""

    name, title, outputs, nuisances = "uniaxial", "Stub", ("strain",), ()

    def __init__(self, change) -> None:
        self.change = change

    def predict(self, law, theta, histories, *, nuisances=None, sensitivities=False):
        return self.change(BAR.predict(law, theta, histories, sensitivities=sensitivities))


def simulated(using=BAR, stress: float = 100.0):
    return ck.simulate("norton", using, VALUES, loading=ck.constant_stress(stress), times=TIMES)


def converted(name: str, kind):
    return lambda made: replace(made, **{name: getattr(made, name).astype(kind)})


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda made: None, "a NoneType from predict\\(\\); it must return a Prediction"),
        (lambda made: made.values, "a ndarray from predict\\(\\)"),
        (lambda made: replace(made, values=made.values.tolist()), "a list as values; it must be an array of shape"),
        (lambda made: replace(made, values=made.values.ravel()), "values of shape .* it must be .* for what was asked"),
        (lambda made: replace(made, values=made.values[:, :, 1:]), "values of shape .* it must be .*20, 1\\)"),
        (lambda made: replace(made, status=made.status[0, 0]), "a int64 as status; it must be an array"),
        (lambda made: replace(made, status=made.status + 77), "the status 77; known are 0 \\(complete\\), 1"),
        (lambda made: replace(made, lengths=made.lengths - 1), "the lengths .19.*; they must be the numbers of times"),
        (lambda made: replace(made, outputs=("foo",)), "outputs foo; it must predict those that it names, strain"),
        (converted("values", complex), "values of type complex128; it must hold real floating point numbers"),
        (converted("values", object), "values of type object"),
        (converted("end_times", str), "end_times of type <U.*; it must hold real numbers"),
    ],
)
def test_a_prediction_that_is_none_is_one_sentence(change, said: str) -> None:
    histories = [simulated(), simulated(stress=150.0).replace(name="b")]
    for ask in (lambda: simulated(Stub(change)), lambda: ck.identify("norton", histories, Stub(change), seed=0)):
        with pytest.raises(SolveError, match=f"^predictor 'uniaxial' (returned|predicted the) {said}"):
            ask()


def test_derivatives_have_a_column_for_each_parameter() -> None:
    law, history = ck.law("norton"), simulated()
    made = BAR.predict(law, law.to_internal(VALUES), [history], sensitivities=True)
    assert isinstance(made, Prediction)
    assert checked_prediction(made, BAR, [history], 1, 2) is made
    with pytest.raises(SolveError, match=r"jacobian of shape \(1, 1, 20, 1, 2\); it must be \(1, 1, 20, 1, 3\)"):
        checked_prediction(made, BAR, [history], 1, 3)
