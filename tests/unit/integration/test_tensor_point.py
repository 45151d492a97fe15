"""A driven point: its tangent, its order, frames, programs, ends and refusals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from creepkit.integration import IntegrationSettings
from creepkit.integration.tensor_integration import TENSOR_COMPONENTS, integrate_tensor_point
from creepkit.integration.time_discretisation import SDIRK2, SDIRK4
from creepkit.kernels import lower
from creepkit.language import CreepLaw, State, arrhenius, mean_stress, principal_stress, stress
from creepkit.laws.norton import NORTON
from creepkit.records import PointLoading, Program, Status
from helpers.kachanov_law import A, C, damage, kachanov, n, v

STEEL = (150e3, 0.3)
DAMAGING = kachanov(0.6 * principal_stress + 0.4 * mean_stress, 0.9)
KACHANOV = kachanov(stress, 0.9)
RATES = KACHANOV.params


def imposed(controls) -> PointLoading:
    """From {component: (quantity, value)}."""
    kinds = ("stress", "strain")
    return PointLoading(*({k: value for k, (kind, value) in controls.items() if kind == one} for one in kinds))


def run(law, values, controls, times, temperature=300.0, settings=None, tableau=SDIRK2):
    kernel = lower(law, "compiled")
    theta = law.to_internal(values)[0]
    return integrate_tensor_point(
        kernel, theta, STEEL, imposed(controls), temperature, times, settings=settings, tableau=tableau
    )


@pytest.mark.parametrize("tableau", [SDIRK2, SDIRK4], ids=["SDIRK2", "SDIRK4"])
def test_the_order_is_that_of_the_tableau(tableau) -> None:
    """A strain and a stress that grow, in equal steps; the error falls by 2^order when the steps are halved."""
    ramp = Program(np.array([0.0, 100.0]), np.array([2e-4, 1.2e-3]))
    controls = {
        "11": ("strain", ramp),
        "12": ("strain", 3e-4),
        "22": ("stress", Program(ramp.times, 6e4 * ramp.values)),
    }

    def end(step: float) -> float:
        loose = IntegrationSettings(rtol=1e9, first=step, longest=step)
        return float(run(NORTON, {"A": 1e-11, "n": 3}, controls, [100.0], settings=loose, tableau=tableau).stress[0, 0])

    coarse, middle, fine = (end(step) for step in (1 / 8, 1 / 16, 1 / 32))
    assert np.log2((coarse - middle) / (middle - fine)) == pytest.approx(tableau.order, abs=0.35)


def test_a_turned_frame_turns_the_answer() -> None:
    """Relaxation of a strain and of the same strain seen from axes turned about two of them."""
    c, s = np.cos(0.5), np.sin(0.5)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    strain = np.diag([1e-3, 2e-4, -1e-4])
    rows, columns = [int(k[0]) - 1 for k in TENSOR_COMPONENTS], [int(k[1]) - 1 for k in TENSOR_COMPONENTS]
    tensors = []
    for tensor in (strain, turn @ strain @ turn.T):
        controls = {k: ("strain", e) for k, e in zip(TENSOR_COMPONENTS, tensor[rows, columns], strict=True)}
        values = {"A": 1e-14, "n": 4.0, "C": 1e-12, "v": 3.5}
        result = run(DAMAGING, values, controls, [1e3])
        full = np.zeros((3, 3))
        full[rows, columns] = full[columns, rows] = result.stress[0]
        tensors.append(full)
    np.testing.assert_allclose(turn @ tensors[0] @ turn.T, tensors[1], rtol=1e-8, atol=1e-8 * tensors[0].max())


STRESSES = {
    "compression, the two largest equal": [-100.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    "the two largest equal": [80.0, 80.0, 0.0, 0.0, 0.0, 0.0],
    "the two largest equal, turned": [40.0, 40.0, 80.0, 40.0, 0.0, 0.0],
    "shear": [0.0, 0.0, 0.0, 60.0, 0.0, 0.0],
    "all different": [60.0, -20.0, 35.0, 18.0, -42.0, 27.0],
    "nearly equal": [70.0, 70.0 + 1e-7, -10.0, 1e-7, 1e-8, 0.0],
}


@pytest.mark.parametrize("stresses", STRESSES.values(), ids=STRESSES)
def test_a_law_of_the_largest_principal_stress(stresses: list[float]) -> None:
    """At constant stress p = A lambda^n t, with lambda the largest eigenvalue by NumPy, shifted to stay above zero."""
    shift = 150.0
    law = CreepLaw("principal", {"creep": A * (principal_stress + shift) ** n}, {k: RATES[k] for k in (A, n)})
    controls = {k: ("stress", value) for k, value in zip(TENSOR_COMPONENTS, stresses, strict=True)}
    result = run(law, {"A": 1e-13, "n": 3.0}, controls, [1e3])
    s11, s22, s33, s12, s23, s13 = stresses
    largest = np.linalg.eigvalsh(np.array([[s11, s12, s13], [s12, s22, s23], [s13, s23, s33]]))[-1]
    assert result.equivalent[0] == pytest.approx(1e-13 * (largest + shift) ** 3 * 1e3, rel=1e-9)


def test_temperature_follows_its_program() -> None:
    """Strain is the integral of the rate, here over a temperature that rises evenly."""
    law = NORTON.times(arrhenius(T_ref=1000.0))
    values = {"A": 1e-14, "n": 4.0, "Q": 3e5}
    heating = Program(np.array([0.0, 3600.0]), np.array([900.0, 1100.0]))
    result = run(law, values, {"12": ("stress", 40.0)}, [3600.0], temperature=heating)

    def rate(t: float) -> float:
        return 1e-14 * 3**2 * 40.0**4 * np.exp(-3e5 / 8.314462618 * (1 / (900 + t / 18) - 1 / 1000))

    assert result.equivalent[0] == pytest.approx(quad(rate, 0, 3600)[0], rel=1e-5)


def test_outputs_at_a_jump_show_what_holds_from_then_on() -> None:
    controls = {"11": ("stress", Program.steps([(0.0, 50.0), (100.0, 80.0)]))}
    result = run(NORTON, {"A": 1e-12, "n": 3}, controls, [0.0, 100.0, 100.0, 150.0])
    np.testing.assert_allclose(result.stress[:, 0], [50.0, 80.0, 80.0, 80.0])
    np.testing.assert_allclose(result.creep_strain[:, 0], 1e-12 * 50**3 * 100 * np.array([0, 1, 1, 1 + 0.5 * 1.6**3]))
    np.testing.assert_allclose(
        result.strain[:, 1], -0.5 * result.creep_strain[:, 0] - 0.3 * result.stress[:, 0] / 150e3
    )


class TestEnds:
    def test_a_state_at_its_limit(self) -> None:
        """Kachanov: (1 - damage)^(v+1) = 1 - (v+1) C s^v t; outputs beyond are left out."""
        result = run(KACHANOV, {"A": 1e-16, "n": 4, "C": 1e-13, "v": 4}, {"11": ("stress", 100.0)}, [5e3, 1.5e4, 1e5])
        expected = (1 - 0.1**5) / (5 * 1e-13 * 100**4)
        assert result.status == Status.RUPTURED
        assert result.reason == "an internal variable reached its limit"
        assert result.end_time == pytest.approx(expected, rel=1e-4)
        np.testing.assert_array_equal(result.times, [5e3, 1.5e4])
        np.testing.assert_allclose(result.states[:, 0], 1 - (1 - 5e-5 * result.times) ** 0.2, rtol=1e-4)

    def test_the_strain_limit(self) -> None:
        values, settings = {"A": 1e-13, "n": 4}, IntegrationSettings(strain_limit=0.25)
        result = run(NORTON, values, {"11": ("stress", 100.0)}, [1e4, 1e5], settings=settings)
        assert result.status == Status.RUPTURED
        assert result.end_time == pytest.approx(0.25 / 1e-5, rel=1e-9)
        assert result.times.tolist() == [1e4]

    def test_a_limit_that_is_met_faster_than_any_step(self) -> None:
        """w = 1 - (1 - t/t_r)^(1/15): past w = 0.9 less is left than doubles tell from t_r."""
        growth = C * stress**v / (15 * (1 - damage) ** 14)
        law = CreepLaw("rabotnov", {"creep": A * stress**n}, RATES, states={damage: State(0.0, growth, limit=0.99)})
        values = {"A": 1e-15, "n": 3.0, "C": 1e-14, "v": 4.0}
        result = run(law, values, {"11": ("stress", 100.0)}, [1.0, 2e6], tableau=SDIRK4)
        assert result.status == Status.RUPTURED
        assert result.reason == "an internal variable reached its limit"
        assert result.end_time == pytest.approx(1e6, rel=1e-4)

    def test_the_cap_on_steps(self) -> None:
        settings = IntegrationSettings(max_steps=5)
        result = run(NORTON, {"A": 1e-10, "n": 4}, {"11": ("strain", 1e-3)}, [0.0, 1e6], settings=settings)
        assert result.status == Status.NOT_CONVERGED
        assert result.reason == "the cap on steps was reached"
        assert result.times.tolist() == [0.0]
