"""The runtime of the page, run in node, gives the creep and relaxation of bars that the specimens give."""

import re

import numpy as np
import pytest

import creepkit as ck
from creepkit.laws.norton import NORTON
from creepkit.records import Program, RecordedLoading
from creepkit.registry import default_registry
from helpers.export_cases import LAWS
from helpers.javascript import run_in_node
from helpers.page_runtime import in_page, pairs, values_that_creep
from helpers.paths import ROOT

AGREEMENT = 1e-10
"""Relative; it is the same core, and the law differs by rounding."""


CONDITIONS = {
    "constant load": (ck.constant_stress(110.0), 1073.0),
    "steps of true stress": (ck.StressSteps(((0.0, 90.0), (3e4, 120.0), (7e4, 60.0)), "stress"), 1073.0),
    "ramps and heating": (
        RecordedLoading(
            Program(np.array([0.0, 600.0, 4e4, 4e4, 9e4]), np.array([0.0, 80.0, 80.0, 130.0, 100.0])), "stress"
        ),
        Program(np.array([0.0, 5e4, 6e4]), np.array([1063.0, 1063.0, 1083.0])),
    ),
}  # fmt: skip
TIMES = [0.0, 1.0, 60.0, 900.0, 7200.0, 2.9e4, 3.1e4, 5e4, 8e4, 1e5]


def as_options(loading, T):
    return {
        "stress": pairs(loading.program()),
        "control": getattr(loading, "control", "stress"),
        "temperature": pairs(T) if isinstance(T, Program) else T,
        "times": TIMES,
        "elastic": {"modulus": 150e3},
    }


def laws():
    registered = {name: default_registry().law(name) for name in default_registry().laws()}
    return registered | {name: LAWS[name] for name in ("combined with temperature", "Kachanov with temperature")}


def test_creep_of_every_law_is_that_of_the_specimen(tmp_path):
    cases, expected = [], []
    for name, law in laws().items():
        values = values_that_creep(law, 100.0)
        for condition, (loading, T) in CONDITIONS.items():
            elastic = ck.Elastic(150e3)
            run = ck.simulate(law, "uniaxial", values, loading=loading, times=TIMES, temperature=T, elastic=elastic)
            cases.append((law, "simulateCreep", values, as_options(loading, T)))
            expected.append((f"{name}, {condition}", run))
    for (what, run), found in zip(expected, in_page(tmp_path, cases), strict=True):
        assert isinstance(found, dict), (what, found)
        strain = np.array(found["strain"], float)
        reached = len(run.times)
        assert np.isfinite(strain[:reached]).all(), what
        assert np.isnan(strain[reached:]).all(), what
        np.testing.assert_allclose(strain[:reached], run.outputs["strain"], rtol=AGREEMENT, atol=1e-15, err_msg=what)
        for state, history in run.states.items():
            np.testing.assert_allclose(
                found["states"][state][:reached], history, rtol=AGREEMENT, atol=1e-12, err_msg=what
            )
        assert found["endTime"] == pytest.approx(run.end_time, rel=AGREEMENT), what
        assert found["status"] == run.status.name.lower().replace("_", " "), what
        assert (found["ruptureTime"] is None) == (found["status"] != "ruptured")
        assert found["reason"] == run.reason or run.reason.startswith(found["reason"]), what


def test_relaxation_of_every_law_is_that_of_the_specimen(tmp_path):
    steps = ck.StrainSteps(((0.0, 8e-4), (3e4, 1.2e-3)), ramp=60.0)
    cases, expected = [], []
    for name, law in laws().items():
        values = values_that_creep(law, 100.0)
        elastic = ck.Elastic(150e3)
        run = ck.simulate(law, "relaxation", values, loading=steps, times=TIMES, temperature=1073.0, elastic=elastic)
        options = {
            "strain": pairs(steps.program()), "temperature": 1073.0, "times": TIMES, "elastic": {"modulus": 150e3},
        }  # fmt: skip
        cases.append((law, "simulateRelaxation", values, options))
        expected.append((name, run))
    for (what, run), found in zip(expected, in_page(tmp_path, cases), strict=True):
        assert isinstance(found, dict), (what, found)
        stress, reached = np.array(found["stress"], float), len(run.times)
        np.testing.assert_allclose(stress[:reached], run.outputs["stress"], rtol=AGREEMENT, atol=1e-9, err_msg=what)


def test_a_closed_form_is_met(tmp_path):
    """Norton under constant load: exp(-n p) = 1 - n A sigma^n t, bursting at p = 1."""
    A, n, stress = 1e-15, 5.0, 100.0
    rate = A * stress**n
    times = [0.0, 1e3, 1e4, 5e4, 1e6]
    values, held = {"A": A, "n": n}, {"stress": stress, "times": times, "tolerance": 1e-9}
    curve = (NORTON, "rateCurve", values, {"stresses": [50.0, 100.0, 200.0]})
    creep, curve = in_page(tmp_path, [(NORTON, "simulateCreep", values, held), curve])
    exact = -np.log1p(-n * rate * np.array(times[:3])) / n
    np.testing.assert_allclose(np.array(creep["strain"][:3], float), exact, rtol=1e-8)
    assert creep["strain"][4] == "NaN"
    assert creep["ruptureTime"] == pytest.approx(-np.expm1(-n) / (n * rate), rel=1e-7)
    assert creep["reason"] == "creep strain reached the strain limit"
    assert curve["rate"] == [pytest.approx(A * s**n, rel=1e-12) for s in (50.0, 100.0, 200.0)]
    assert curve["terms"] == {"power law": curve["rate"]}


def test_mistakes_are_one_sentence(tmp_path):
    good, held = {"stress": 100.0, "times": [1.0]}, {"strain": 1e-3, "times": [1.0]}
    elastic = {"modulus": [[1000.0, 160e3], [1100.0, 150e3]]}
    warm = [[0, 1000.0], [9, 1100.0]]
    found = in_page(
        tmp_path,
        [
            (NORTON, "simulateCreep", {"m": 1.0}, good),
            (NORTON, "simulateCreep", {}, good | {"stress": [[5, 100.0]]}),
            (NORTON, "simulateCreep", {}, good | {"stress": -1.0}),
            (NORTON, "simulateCreep", {}, good | {"times": [2.0, 1.0]}),
            (LAWS["combined with temperature"], "simulateCreep", {}, good),
            (NORTON, "simulateRelaxation", {}, held),
            (NORTON, "simulateRelaxation", {}, held | {"temperature": warm, "elastic": elastic}),
        ],
    )
    assert found == [
        "RangeError: the law has no parameter 'm'; allowed are A, n",
        "RangeError: the times of the stress must start at 0 and never decrease",
        "RangeError: a stress must not be negative",
        "RangeError: output times must be finite, at or after 0 s, and must not decrease",
        "RangeError: the law depends on temperature: give one, in K",
        "RangeError: a relaxation test needs elastic data: elastic: {modulus: 150e3}, in MPa",
        "RangeError: the modulus changes with the temperature of the test; a relaxation test takes one modulus",
    ]


def test_the_page_of_the_guide_computes(tmp_path):
    """The second snippet of the guide, its scripts run one after another: the creep of Norton's law in closed form."""
    text = (ROOT / "docs" / "how-to" / "use_laws_in_javascript.md").read_text(encoding="utf-8")
    names: dict[str, object] = {}
    for block in re.findall(r"```python\n(.*?)```", text, re.S):
        exec(compile(block, "guide", "exec"), names)
    program = """
    import vm from "node:vm";
    async function main(page) {
      globalThis.document = {};
      for (const [, script] of page.matchAll(/<script>([^]*?)<\\/script>/g)) vm.runInThisContext(script);
      await creepkit.ready;
      return document.title;
    }
    """
    rate = 1e-16 * 100.0**5
    assert float(run_in_node(tmp_path, program, names["page"])) == pytest.approx(
        -np.log1p(-5 * rate * 36000) / 5, rel=1e-6
    )
