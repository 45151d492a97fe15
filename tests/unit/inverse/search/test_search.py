"""Multi-start: planted values are found within bounds."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.inverse.search.multistart import refined, screened_starts, search_problem
from creepkit.inverse.settings import IdentificationSettings
from creepkit.records import History

# Least squares from several starts: planted values found from them, within bounds.


TIMES = np.geomspace(600.0, 4e5, 25)


def landscape(law, values, stresses=(60.0, 90.0, 130.0)):
    """Uniaxial tests without noise."""
    bar = ck.specimen("uniaxial")
    tests = []
    for stress in stresses:
        run = ck.simulate(law, bar, values, loading=ck.constant_stress(stress), times=TIMES)
        tests.append(History(name=f"{stress:g}", times=TIMES, outputs=run.outputs, loading=run.loading,
                             temperature=293.15))  # fmt: skip
    return search_problem(LeastSquaresProblem.from_histories(law, tests, bar, IdentificationSettings()), bar)


@pytest.mark.parametrize(
    ("name", "values"),
    [("norton", {"A": 1e-16, "n": 4.2}), ("strain-hardening", {"A": 3e-16, "n": 4.0, "m": -0.4}),
     ("hyperbolic-sine", {"A": 2e-9, "n": 1.7, "B": 45.0})],
)  # fmt: skip
def test_planted_values_are_found_from_many_starts(name, values):
    law = ck.law(name)
    view = landscape(law, values)
    ends = refined(view, screened_starts(view, starts=6, draws=32))
    found = view.coordinates.values(ends[0].x)
    assert {n: found[n] for n in values} == pytest.approx(values, rel=1e-3)
    assert sum(end.cost < ends[0].cost + 1e-4 for end in ends) >= 2
    assert all((view.bounds.lower <= end.x).all() and (end.x <= view.bounds.upper).all() for end in ends)


def test_one_prediction_for_all_starts_is_as_good_as_one_each():
    law = ck.law("strain-hardening")
    view = landscape(law, {"A": 3e-16, "n": 4.0, "m": -0.4})
    starts = np.array(screened_starts(view, starts=4, draws=16))
    values, jacobian = view.candidate_jacobian(starts)
    for k, u in enumerate(starts):
        alone = view.residuals(u)
        assert values[k] == pytest.approx(alone.values, rel=1e-6, abs=1e-9)
        assert jacobian[k] == pytest.approx(alone.jacobian, rel=1e-4, abs=1e-6)
