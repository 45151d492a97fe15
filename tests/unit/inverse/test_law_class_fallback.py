"""Laws that a surrogate does not know are identified with its specimen: alone, in a mixed list, and on the way."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.inverse.identify import identify
from creepkit.inverse.selection.select import select
from creepkit.inverse.settings import IdentificationSettings
from creepkit.records import History, constant_stress
from helpers.narrow_predictor import Narrow

BARS = ck.specimen("uniaxial")
NORTON, HARDENING = ck.law("norton"), ck.law("strain-hardening")
TRUTH = {"A": 2e-16, "n": 4.6}
TIMES = np.geomspace(600.0, 2e5, 12)
FEW = {"starts": 2, "sobol_points": 32}


@pytest.fixture(scope="module")
def tests() -> list[History]:
    rng = np.random.default_rng(1)
    runs = [
        ck.simulate(NORTON, BARS, TRUTH, loading=constant_stress(s, control="stress"), times=TIMES)
        for s in (60.0, 80.0, 110.0)
    ]
    return [
        History(
            f"bar {k}",
            TIMES,
            {"strain": run.outputs["strain"] * (1 + 0.02 * rng.standard_normal(12))},
            run.loading,
            run.temperature,
        )
        for k, run in enumerate(runs)
    ]


def settings(**changes):
    return IdentificationSettings(**{**FEW, **changes})


def test_the_specimen_takes_the_place_of_the_surrogate(tests: list[History]) -> None:
    found = identify(NORTON, tests, Narrow(), settings=settings())
    true = identify(NORTON, tests, BARS, settings=settings())
    assert found.values == true.values
    assert found.predictor is BARS
    assert found.notes == (
        *true.notes,
        "identified with 'uniaxial' in the place of 'narrow': law 'norton' is none of its laws",
    )


def test_a_law_that_it_knows_is_left_to_it(tests: list[History]) -> None:
    surrogate = Narrow(unknown=())
    found = identify(NORTON, tests, surrogate, through=surrogate, settings=settings())
    assert found.predictor is surrogate
    assert not any("narrow" in note for note in found.notes)


def test_a_mixed_list_is_ranked_on_the_same_data(tests: list[History]) -> None:
    found = select([NORTON, HARDENING], tests, Narrow(), settings=settings(frames=12))
    true = select([NORTON, HARDENING], tests, BARS, settings=settings(frames=12))
    assert [r.fit.law.name for r in found.laws] == [r.fit.law.name for r in true.laws]
    assert [r.weight for r in found.laws] == pytest.approx([r.weight for r in true.laws])
    fits = {r.fit.law.name: r.fit for r in found.laws}
    assert fits["norton"].provenance["data"] == fits["strain-hardening"].provenance["data"]
    assert fits["norton"].provenance["specimen"] == "uniaxial"
    assert fits["strain-hardening"].provenance["specimen"] == "narrow"
    assert "in the place of 'narrow'" in fits["norton"].notes[-1]
