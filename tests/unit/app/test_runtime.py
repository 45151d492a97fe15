"""The runtime of the page, run in node, gives the creep and relaxation of bars that the specimens give."""

import re

import numpy as np
import pytest

import creepkit as ck
from creepkit.app.models import rom_data
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.records import Program, RecordedLoading
from helpers.export_cases import LAWS
from helpers.javascript import run_in_node
from helpers.page_runtime import in_page, pairs, values_that_creep
from helpers.paths import ROOT
from helpers.registered_laws import laws_of_scalars

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
    return laws_of_scalars() | {name: LAWS[name] for name in ("combined with temperature", "Kachanov with temperature")}


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


# ---- runtime dimple --------------------------------------------------------------------------------------------------

# The runtime of the page, run in node, gives the bulge test that the reduced-order model of the core gives.


DIMPLE_AGREEMENT = 1e-6
"""Relative, of amplitude, width and shape: modes and gradients are packed in single precision."""

DIMPLE_TIMES = [0.0, 2.0, 60.0, 900.0, 7200.0, 1.4e4, 1.6e4, 3e4, 4.32e4]
JUMP = ck.PressureJump(P1=7.0, P2=8.5, Tj=14400.0)


@pytest.fixture(scope="module")
def model():
    return ck.surrogate("dimple")


@pytest.fixture(scope="module")
def data(model):
    return rom_data(model)


def options(loading, T=1073.0, **more):
    temperature = pairs(T) if isinstance(T, Program) else T
    elastic = {"modulus": 150e3, "poisson": 0.3}
    return {
        "pressure": pairs(loading.program()),
        "times": DIMPLE_TIMES,
        "temperature": temperature,
        "elastic": elastic,
    } | more


def simulated(model, law, values, loading, T=1073.0):
    elastic = ck.Elastic(150e3)
    return ck.simulate(law, model, values, loading=loading, times=DIMPLE_TIMES, temperature=T, elastic=elastic)


def planned(**more):
    """The planned test of `options(JUMP)`."""
    elastic = ck.Elastic(150e3)
    return ck.History("plan", np.array(DIMPLE_TIMES), {}, JUMP, 1073.0, specimen="bulge", elastic=elastic, **more)


def check(found, run, what, rtol=DIMPLE_AGREEMENT):
    assert isinstance(found, dict), (what, found)
    reached = len(run.times)
    for name in ("amplitude", "width", "shape"):
        shown = np.array(found["outputs"][name], float)
        assert np.isnan(shown[reached:]).all(), (what, name)
        np.testing.assert_allclose(shown[:reached], run.outputs[name], rtol=rtol, atol=1e-9, err_msg=f"{what}, {name}")
    assert found["endTime"] == pytest.approx(run.end_time, rel=1e-3), what
    assert found["status"] == run.status.name.lower().replace("_", " "), what


def test_a_dimple_of_every_law_is_that_of_the_core(model, data, tmp_path):
    cases, runs = [], []
    for name, law in (laws_of_scalars() | {"warm": LAWS["Kachanov with temperature"]}).items():
        values = values_that_creep(law, 100.0, goal=0.01, duration=4e4)
        cases.append((law, "simulateDimple", values, options(JUMP)))
        runs.append((name, simulated(model, law, values, JUMP)))
    for (what, run), found in zip(runs, in_page(tmp_path, cases, data), strict=True):
        check(found, run, what)


def test_jumps_of_pressure_ramps_of_temperature_and_bursting(model, data, tmp_path):
    sudden = RecordedLoading(Program(np.array([0.0, 2e4, 2e4]), np.array([8.0, 8.0, 5.0])), "pressure")
    heated = Program(np.array([0.0, 1e4, 1.2e4]), np.array([1053.0, 1053.0, 1083.0]))
    warm = LAWS["combined with temperature"]
    values = values_that_creep(warm, 100.0, goal=0.01, duration=4e4)
    soft = {"A": 6e-15, "n": 5.0}
    cases = [(warm, "simulateDimple", values, options(sudden, heated)), (NORTON, "simulateDimple", soft, options(JUMP))]
    steps, burst = in_page(tmp_path, cases, data)
    check(steps, simulated(model, warm, values, sudden, heated), "jump")
    run = simulated(model, NORTON, soft, JUMP)
    check(burst, run, "burst")
    assert burst["status"] == "ruptured"
    assert burst["reason"] == "the surface reached the deflection limit"


def test_the_coarse_model_is_near_and_the_section_is_that_of_the_modes(model, data, tmp_path):
    """The middle of the top, as the section has it, is where the profile says; the section at rest is the mesh."""
    values = {"A": 1e-17, "n": 5.0, "m": -0.3}
    then = "(found) => ({ places: found.placesAt(43200), rest: found.placesAt(0) })"
    cases = [(STRAIN_HARDENING, "simulateDimple", values, options(JUMP, fast=fast)) for fast in (False, True)]
    full, fast = in_page(tmp_path, cases, data, then)
    amplitude = np.array(full["outputs"]["amplitude"])
    np.testing.assert_allclose(np.array(fast["outputs"]["amplitude"])[3:], amplitude[3:], rtol=0.02)
    assert fast["steps"] < full["steps"]
    mesh = model.specimen.finite_elements()
    rest, places = (np.reshape(full[name], (-1, 2)) for name in ("rest", "places"))
    np.testing.assert_allclose(rest, mesh.nodes, atol=1e-12)
    run = model.run(STRAIN_HARDENING, values, planned())
    expected = mesh.nodes + run.simulation.displacements[-1]
    np.testing.assert_allclose(places, expected, atol=1e-6)
    contour = full["contour"]
    assert {int(node) for node in mesh.top} <= set(contour)
    assert mesh.nodes[[contour[0], contour[-1]], 0] == pytest.approx(0.0)


def test_a_dimple_of_another_thickness(model, tmp_path):
    values, thickness = {"A": 1e-17, "n": 5.0, "m": -0.3}, 0.53
    case = (STRAIN_HARDENING, "simulateDimple", values, options(JUMP))
    (found,) = in_page(tmp_path, [case], rom_data(model, {"apex_thickness": thickness}))
    test = planned(geometry={"apex_thickness": thickness})
    theta = STRAIN_HARDENING.to_internal(values)
    exact = model.predict(STRAIN_HARDENING, theta, [test]).of(0)
    for k, name in enumerate(("amplitude", "width", "shape")):
        np.testing.assert_allclose(found["outputs"][name], exact[:, k], rtol=DIMPLE_AGREEMENT, atol=1e-9, err_msg=name)


def test_numbers_that_make_no_sense_end_a_simulation_and_raise_nothing(data, tmp_path):
    bar = {"stress": 100.0, "times": DIMPLE_TIMES}
    values = [{"A": "NaN"}, {"A": 0.0}, {"A": 1e300, "n": 5.0}, {"A": 1e-17, "n": 1e6}, {"A": -1.0, "n": 5.0}]
    cases = [(NORTON, "simulateDimple", each, options(JUMP, fast=True, maxSteps=60)) for each in values]
    for found in in_page(tmp_path, cases, data):
        assert found["status"] in ("complete", "ruptured", "not converged"), found
        assert found["steps"] <= 60
    for found in in_page(tmp_path, [(NORTON, "simulateCreep", each, bar) for each in values]):
        assert found["status"] in ("complete", "ruptured", "not converged"), found


def test_mistakes_about_a_dimple_are_one_sentence(data, tmp_path):
    good = options(JUMP)
    found = in_page(
        tmp_path,
        [
            (NORTON, "simulateDimple", {}, {k: v for k, v in good.items() if k != "elastic"}),
            (NORTON, "simulateDimple", {}, good | {"pressure": 0.0}),
            (NORTON, "simulateDimple", {}, good | {"times": [0.0]}),
        ],
        data,
    )
    assert found == [
        "RangeError: a bulge test needs elastic data: elastic: {modulus: 150e3}, in MPa",
        "RangeError: the pressure must not be negative, and a bulge test needs one above zero",
        "RangeError: the last time is 0 s, where the load only begins; ask for a time after it",
    ]
