"""Laws with internal variables go through every verb as others do, however the variables move."""

import numpy as np
import pytest

import creepkit as ck
from creepkit.language import CreepLaw, Param, State, parameters, states, strain, stress

A, n, c, D = parameters("A n c D")
hard, soft = states("hard soft")
RATE = Param("rate coefficient", bounds=(1e-30, 1e-5), unit="1/s", scale="log", off=0.0)
POWER = Param("stress exponent", bounds=(1, 8))
GROWTH = Param("rate of the internal variable", bounds=(1e-8, 1e-2), unit="1/s", scale="log")
SOFTENING = Param("softening", bounds=(0.1, 100))


def law(name, term, params, inner):
    return CreepLaw(name, {"creep": term}, params, title=name, references=("nobody",), states=inner)


FOLLOWING = law(
    "follows the strain",
    A * (stress * hard) ** n,
    {A: RATE, n: POWER, c: SOFTENING, D: GROWTH},
    {hard: State(1.0, D * (c * strain - hard + 1))},
)
FADING = law("fades", A * (stress * (1 + hard)) ** n, {A: RATE, n: POWER, D: GROWTH}, {hard: State(1.0, -D * hard)})
CHAINED = law(
    "one drives the other",
    A * stress**n * (1 + soft),
    {A: RATE, n: POWER, c: SOFTENING, D: GROWTH},
    {hard: State(0.0, D * (1 - hard)), soft: State(0.0, D * c * hard)},
)
CASES = {
    "follows": (FOLLOWING, {"A": 1e-16, "n": 4.0, "c": 20.0, "D": 3e-5}),
    "fades": (FADING, {"A": 1e-16, "n": 4.0, "D": 3e-5}),
    "chained": (CHAINED, {"A": 1e-16, "n": 4.0, "c": 5.0, "D": 3e-5}),
}
TIMES = np.geomspace(600, 4e5, 30)


@pytest.mark.parametrize("name", CASES)
def test_planted_values_come_back_from_creep_curves(name):
    law, values = CASES[name]
    tests = [
        ck.simulate(law, "uniaxial", values, loading=ck.constant_stress(s), times=TIMES, name=f"{s} MPa")
        for s in (60, 80, 100)
    ]
    fit = ck.identify(law, tests, starts=3)
    assert fit.values == pytest.approx(values, rel=1e-3)


def test_a_fading_state_is_the_exponential_it_solves():
    """d hard/dt = -D hard from 1 makes the rate A s^n (1 + exp(-D t))^n."""
    law, v = CASES["fades"]
    run = ck.simulate(law, "uniaxial", v, loading=ck.constant_stress(80, "stress"), times=TIMES)
    fine = np.linspace(0, TIMES[-1], 200_001)
    rate = v["A"] * 80.0 ** v["n"] * (1 + np.exp(-v["D"] * fine)) ** v["n"]
    strain = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(fine))])
    assert run.outputs["strain"] == pytest.approx(np.interp(TIMES, fine, strain), rel=2e-4)


@pytest.mark.parametrize("name", CASES)
def test_every_target_writes_it_or_says_why_not(name):
    law, values = CASES[name]
    refused = {target: _refusal(law, target, values) for target in ck.available("exporters")}
    assert all("internal variable" in said for said in refused.values() if said)
    written = {target for target, said in refused.items() if not said}
    assert {"abaqus", "calculix", "c", "json", "latex", "markdown", "mathml", "mfront", "numpy", "python"} <= written


def _refusal(law, target, values):
    """Why a target refuses; nothing if it writes the law with its states."""
    try:
        text = ck.export(law, target, values, elastic=ck.Elastic(150e3))
    except ck.errors.ExportError as error:
        return str(error)
    return "" if "hard" in text else "the internal variable is lost"
