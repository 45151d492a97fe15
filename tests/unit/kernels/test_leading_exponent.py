"""The leading exponent of time: strain ~ t^beta from a virgin state at constant stress."""

import numpy as np
import pytest

from creepkit.kernels import lower
from creepkit.language import CreepLaw, strain, stress, time
from creepkit.laws.combined import COMBINED
from creepkit.laws.drifting_exponent import DRIFTING_EXPONENT
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.laws.time_hardening import TIME_HARDENING
from helpers.literature_laws import EQUATIONS, POWER, RATE, A, law, m, n, number


def leading(of: CreepLaw, point: list[float] | None = None, **values: float) -> float:
    compiled = lower(of, "compiled")
    theta = of.to_internal({**of.center(), **values})
    return float(
        compiled.leading_exponent(theta)[0] if point is None else compiled.leading_exponent(theta, np.array([point]))[0]
    )


@pytest.mark.parametrize(
    ("of", "values", "beta"),
    [
        (NORTON, {}, 1.0),
        (TIME_HARDENING, {"m": -0.7}, 0.3),  # strain = A s^n t^(1+m)/(1+m)
        (STRAIN_HARDENING, {"m": -0.6}, 1 / 1.6),  # strain^(1-m) = (1-m) A s^n t
        (DRIFTING_EXPONENT, {"m": -0.5}, 1 / 1.5),
        (COMBINED, {"m_1": -0.5, "m_2": -0.8}, 0.2),
        (COMBINED, {"m_1": -0.5, "m_2": -0.1}, 1 / 1.5),
        (COMBINED, {"m_1": -0.5, "m_2": -0.8, "A_3": 0.0}, 1 / 1.5),
        (COMBINED, {"m_1": -0.5, "m_2": -0.8, "A_2": 0.0, "A_3": 0.0}, 1.0),
        (COMBINED, {"A_1": 0.0, "A_2": 0.0, "A_3": 0.0}, 1.0),
        (EQUATIONS["saturating"], {}, 2.0),  # 1 - exp(-r t) starts as r t
        (EQUATIONS["saturating to a power"], {"m": 0.5}, 1.5),
        (EQUATIONS["erf and atan"], {}, 1.0),
        (law(A * stress**n * time**m * strain**m, {A: RATE, n: POWER, m: number(-0.9, 0)}), {"m": -0.5}, 0.5 / 1.5),
        (law(A * stress**n * (strain + 1e-4), {A: RATE, n: POWER}), {}, 1.0),
    ],
)
def test_the_exponent_is_that_of_the_closed_form(of: CreepLaw, values: dict[str, float], beta: float) -> None:
    assert leading(of, **values) == pytest.approx(beta, rel=1e-12)


def test_a_term_that_starts_with_strain_itself_does_not_lead() -> None:
    growing = law({"base": A * stress, "growing": A * stress**n * strain**2}, {A: RATE, n: POWER})

    assert leading(growing) == 1.0


def test_an_exponent_that_varies_with_temperature_is_taken_at_the_point() -> None:
    warm = EQUATIONS["exponent of time with temperature"]
    point = [100.0, 0.0, 0.0, 1173.15, 100.0, 33.0]  # 100 K above T_ref

    assert leading(warm, point, m=-0.5, m_T=1e-3) == pytest.approx(0.6, rel=1e-12)


def test_candidates_are_taken_together() -> None:
    compiled = lower(TIME_HARDENING, "compiled")
    theta = TIME_HARDENING.to_internal({"A": 1e-10, "n": 3.0, "m": np.array([-0.9, -0.5, 0.0])})

    np.testing.assert_allclose(compiled.leading_exponent(theta), [0.1, 0.5, 1.0], rtol=1e-12)
