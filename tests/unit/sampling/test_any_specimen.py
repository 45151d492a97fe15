"""Specimens that no module knows by name: their conditions, tests and reference stresses come from their records."""

from __future__ import annotations

import pickle
from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest

import creepkit as ck
from creepkit.errors import DatasetError
from creepkit.records import Program, Status
from creepkit.sampling.conditions import TimeGrid, creep_output, hold_times, planned_test, specimen_conditions
from creepkit.sampling.criteria import SimulationOutcome, paper_criteria
from creepkit.sampling.domains import sampling_design
from helpers.cantilever import Cantilever
from helpers.mistakes import said_otherwise

BEAM, NORTON = Cantilever(), ck.law("norton")
HOURS_12 = 43200.0
TEST = {"force_1": 10.0, "force_2": 12.0, "jump_time": 7200.0}


def test_conditions_are_those_of_the_record() -> None:
    known = specimen_conditions(BEAM)
    assert known.names == (
        "force_1", "force_2", "jump_time", "end_time", "span", "breadth", "height", "temperature",
    )  # fmt: skip
    assert known.required == ("force_1",)
    assert [known.unit(name) for name in known.names] == ["N", "N", "s", "s", "mm", "mm", "mm", "K"]
    relaxation = specimen_conditions(ck.specimen("relaxation"))
    assert relaxation.names == ("modulus", "strain_1", "strain_2", "jump_time", "end_time", "temperature")
    assert [relaxation.unit(name) for name in relaxation.names] == ["MPa", "", "", "s", "s", "K"]


def test_the_test_of_a_beam() -> None:
    made = planned_test(BEAM, {**TEST, "span": 60.0, "end_time": 36000.0}, TimeGrid.every())
    assert made.loading.quantity == "force"
    assert made.loading.program() == Program(np.array([0.0, 7200.0, 7205.0]), np.array([10.0, 10.0, 12.0]))
    assert (made.specimen, made.geometry, made.elastic) == ("cantilever", {"span": 60.0}, None)
    np.testing.assert_array_equal(hold_times(made), [0.0, 7200.0, 7205.0, 36000.0])


def test_the_test_of_a_bar_in_relaxation() -> None:
    conditions = {"modulus": 150e3, "strain_1": 0.002, "strain_2": 0.003, "jump_time": 600.0}
    made = planned_test(ck.specimen("relaxation"), conditions, TimeGrid.every(60.0, 3600.0))
    assert (made.loading.quantity, made.elastic) == ("strain", ck.Elastic(150e3))
    np.testing.assert_allclose(hold_times(made), [0.0, 600.0, 600.6, 3600.0])


def test_general_names_are_those_of_a_specimen_with_names_of_its_own() -> None:
    dimple = ck.specimen("bulge")
    own, general = {"P1": 8.0, "P2": 9.0, "Tj": 7200.0}, {"pressure_1": 8.0, "pressure_2": 9.0, "jump_time": 7200.0}
    grid = TimeGrid.every()
    assert (
        planned_test(dimple, {"modulus": 1e5, **general}, grid).loading
        == planned_test(dimple, {"modulus": 1e5, **own}, grid).loading
    )
    designs = [sampling_design(NORTON, dimple, **{name: (3, 20)}) for name in ("P1", "pressure_1")]
    assert designs[0] == designs[1]
    both = sampling_design(NORTON, dimple, pressure=(5, 20))
    assert both == sampling_design(NORTON, dimple, P1=(5, 20), P2=(5, 20))
    with pytest.raises(DatasetError, match="the range of pressure is that of both its levels, and P2 has one as well"):
        sampling_design(NORTON, dimple, pressure=(5, 20), P2=20)
    with pytest.raises(DatasetError, match="'pressure_1' and 'P1' are the same one"):
        sampling_design(NORTON, dimple, P1=5, pressure_1=5)


def test_rates_of_a_beam_lie_where_its_deflection_is_visible_and_the_test_lasts() -> None:
    """By hand, for tests without a jump: 12 h at the reference stress."""
    design = sampling_design(NORTON, BEAM, force_1=10.0, force_2=10.0, span=(40.0, 60.0))
    draws = design.draw(0, 512, seed=2)
    stress = 0.7 * 6.0 * 10.0 * draws.condition("span") / (10.0 * 2.0**2)
    strain = np.log10(draws.parameters[:, 0] * stress ** draws.parameters[:, 1] * HOURS_12)
    lowest = np.log10(0.5 * 0.02 / (draws.condition("span") ** 2 / 6.0))
    share = (strain - lowest) / (np.log10(0.2) - lowest)
    assert -1e-9 < share.min() < 0.01
    assert 0.99 < share.max() < 1 + 1e-9
    assert abs(share.mean() - 0.5) < 3e-3  # uniform in the logarithm


@dataclass(frozen=True)
class OneByOne(type(ck.specimen("uniaxial"))):  # type: ignore[misc]
    """A bar whose tests are asked one by one for their stress."""

    load_scaling = None

    def reference_stress(self, history):
        return history.loading.program().values


def test_tests_asked_one_by_one_have_the_stresses_of_all_rows_at_once() -> None:
    bar = ck.specimen("uniaxial")
    designs = [sampling_design(NORTON, specimen) for specimen in (bar, OneByOne())]
    draws = [design.draw(0, 64, seed=1) for design in designs]
    np.testing.assert_allclose(draws[1].conditions, draws[0].conditions)
    np.testing.assert_allclose(draws[1].parameters, draws[0].parameters, rtol=1e-9)


def test_a_design_of_any_specimen_travels() -> None:
    design = sampling_design(NORTON, BEAM)
    assert pickle.loads(pickle.dumps(design)) == design
    assert design.document()["reference_stress"]["visible_creep"] == 0.02


def test_an_output_that_falls_shows_creep_by_its_fall() -> None:
    shown = creep_output(ck.specimen("relaxation"))
    assert (shown.falls, shown.column, str(shown.output)) == (True, 0, "stress")
    criteria = {c.name: c for c in paper_criteria(ck.specimen("relaxation"))}
    assert list(criteria) == ["1", "2", "3", "4"]  # a stress that has relaxed is no rejection
    marks = np.array([300.0, 280.0, 420.0, 400.0])[:, None]
    fallen = SimulationOutcome(np.arange(4.0), marks, marks, Status.COMPLETE, 4.0, {}, falls=True)
    assert fallen.creep_in_holds == (20.0, 20.0)
    assert criteria["4"].passes(fallen)
    risen = SimulationOutcome(np.arange(4.0), marks[::-1], marks[::-1], Status.COMPLETE, 4.0, {}, falls=True)
    assert not criteria["4"].passes(risen)


class Silent(ck.PerTest):
    """A specimen that says nothing but what PerTest asks for."""

    name, title = "silent", "A specimen that says little"
    outputs = ("deflection",)

    def one(self, law, values, history, nuisances):
        return {"deflection": history.times}


def saying(**said):
    return type("Saying", (Silent,), said)()


FORCE = {"loads": (ck.Load("force", "force"),)}
RANGE = {**FORCE, "conditions": {"force": (5.0, 20.0)}}
NOISE = {**RANGE, "outputs": (ck.Output("deflection", "length", noise=0.002),)}


BEAM_MISTAKES = [
    ({"P1": (5, 20)}, "a cantilever test has no condition 'P1'"),
    ({"modulus": 1e5}, "a cantilever test has no condition 'modulus'"),
    ({"force_1": (10, 20)}, "force_2 from 5 to 20 N reaches below force_1, 10 to 20 N"),
    ({"jump_time": (7200, 90000)}, "jump_time reaches 90000 s"),
    ({"span": "long"}, r"condition 'span' is 'long'; give a number or \(low, high\) in mm"),
]
UNSAID = [
    ({}, r"add the attribute loads = \(ck.Load"),
    (FORCE, r'add the attribute conditions = {"force": \(low, high\)}, in N'),
    ({**FORCE, "conditions": {"farce": (5.0, 20.0)}}, r"add the attribute conditions"),
    ({**RANGE, "conditions": {"force": (5.0, 20.0), "spam": (1.0, 2.0)}}, "`conditions` name 'spam', which no test"),
    (RANGE, r'write ck.Output\("deflection", "number", noise=...\)'),
    (NOISE, r"add the method reference_stress\(self, history\)"),
    ({**NOISE, "reference_stress": lambda self, h: 1.0}, r"add the method growth_per_strain\(self, history\)"),
    (
        {**NOISE, "reference_stress": lambda self, h: float("nan"), "growth_per_strain": lambda self, h: 1.0},
        r"its reference_stress\(history\) gives 0 for a planned test",
    ),
]


def test_what_a_record_does_not_say_and_what_is_no_design_of_a_beam_is_a_sentence() -> None:
    designs = [(partial(sampling_design, NORTON, BEAM, **changes), told) for changes, told in BEAM_MISTAKES]
    unsaid = [(lambda said=said: sampling_design(NORTON, saying(**said)).draw(0, 4, 1), told) for said, told in UNSAID]
    assert not said_otherwise([*designs, *unsaid], DatasetError)
