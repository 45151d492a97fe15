"""Damage over several temperatures: creep and damage keep activation energies of their own, through to rupture."""

import numpy as np
import pytest

import creepkit as ck

T_REF = 873.15
GAS_CONSTANT = 8.314462618  # J/(mol K)
LAW = ck.law("kachanov-rabotnov").fix(alpha=0, m=0).times(ck.arrhenius(T_ref=T_REF))
PLANTED = {"A": 1e-8 / 120**4, "n": 4.0, "B": 5e-7 / 120**5, "Q_B": 2.6e5, "chi": 5.0, "phi": 6.0, "Q": 3.6e5}
CONDITIONS = [(T, stress) for T in (848.15, 873.15, 898.15) for stress in (90.0, 120.0, 150.0)]
BAR = ck.specimen("uniaxial").replace(strain_limit=10.0)


def life(T: float, stress: float) -> float:
    """Kachanov's rupture time at constant stress, s: 1/(B(T) s^chi), B being (1 + phi) times that of dw/dt."""
    B = PLANTED["B"] * np.exp(-PLANTED["Q_B"] / GAS_CONSTANT * (1 / T - 1 / T_REF))
    return float(1 / (B * stress ** PLANTED["chi"]))


def strain(T: float, stress: float, share: np.ndarray) -> np.ndarray:
    """Creep strain at a share of the life: the integral of A(T) s^n (1 - t/t_r)^(-n/(1 + phi))."""
    A = PLANTED["A"] * np.exp(-PLANTED["Q"] / GAS_CONSTANT * (1 / T - 1 / T_REF))
    power = 1 - PLANTED["n"] / (1 + PLANTED["phi"])
    return A * stress ** PLANTED["n"] * life(T, stress) / power * (1 - (1 - share) ** power)


def measured(noise: float) -> list[ck.History]:
    """Nine tests to rupture from the closed forms, with noise of the strain."""
    rng, share = np.random.default_rng(3), np.linspace(0.02, 0.97, 40)
    return [
        ck.History(
            f"{T:g} K {stress:g} MPa",
            share * life(T, stress),
            {"strain": strain(T, stress, share) + rng.normal(0, noise, share.size)},
            ck.constant_stress(stress, "stress"),
            T,
            rupture_time=life(T, stress),
        )
        for T, stress in CONDITIONS
    ]


@pytest.mark.parametrize(("T", "stress"), CONDITIONS)
def test_bars_break_when_the_closed_form_says_at_each_temperature(T: float, stress: float) -> None:
    plan = ck.History("plan", np.array([10 * life(T, stress)]), {}, ck.constant_stress(stress, "stress"), T)
    theta = LAW.to_internal({name: PLANTED[name] for name in LAW.names})
    rupture = BAR.predict_to_rupture(LAW, theta, [plan]).times_to_strain.rupture_times[0, 0]

    assert rupture == pytest.approx(life(T, stress), rel=1e-4)


def test_both_activation_energies_are_identified_from_tests_to_rupture() -> None:
    fit = ck.identify(LAW, measured(noise=5e-5), using=BAR, starts=2, frames=30)

    missed = {e.name: (e.low, PLANTED[e.name], e.high) for e in fit.estimates if not e.low <= PLANTED[e.name] <= e.high}
    assert not missed
    assert fit.values["Q_B"] == pytest.approx(PLANTED["Q_B"], rel=0.02)
    assert fit.values["Q"] == pytest.approx(PLANTED["Q"], rel=0.02)


def test_one_activation_energy_for_both_does_not_explain_them() -> None:
    """100 kJ/mol apart over 50 K is a factor of 2.2 in the strain at rupture."""
    tests = measured(noise=5e-5)
    shared = ck.law("kachanov-rabotnov").fix(alpha=0, m=0).times(ck.arrhenius(T_ref=T_REF), shared=True)
    fits = [ck.identify(law, tests, using=BAR, starts=2, frames=30) for law in (LAW, shared)]

    assert ck.rank(fits).best.law.name == LAW.name
    assert fits[1].rms > 5 * fits[0].rms
