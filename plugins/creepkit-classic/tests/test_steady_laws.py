"""Laws without memory: exponents and activation energies measured on the rate, published figures, limits."""

import numpy as np
import pytest
from creepkit_classic import coble, dorn, double_power, garofalo, nabarro_herring
from numpy.typing import NDArray

import creepkit as ck
from creepkit.language import GAS_CONSTANT, arrhenius

NICKEL = 1300.0
"""K, about 0.75 of the melting temperature of nickel, 1726 K."""


def rate(name: str, values: dict[str, float], **point: float | NDArray[np.float64]) -> NDArray[np.float64]:
    return ck.lower(ck.law(name), "numpy").rate(values, **point)


def slope(name: str, values: dict[str, float], which: str, point: dict[str, float]) -> float:
    """d(ln rate)/d(ln x) by a central difference, x a variable of the point or a parameter."""
    logs = []
    for factor in (1 + 1e-4, 1 - 1e-4):
        moved = {k: v * factor if k == which else v for k, v in (values | point).items()}
        arguments = {k: moved[k] for k in point}
        logs.append(np.log(rate(name, {k: moved[k] for k in values}, **arguments)))
    return float((logs[0] - logs[1]) / np.log((1 + 1e-4) / (1 - 1e-4)))


DIFFUSION = {"nabarro-herring": (nabarro_herring.TYPICAL, 2), "coble": (coble.TYPICAL, 3)}


@pytest.mark.parametrize("name", DIFFUSION)
def test_diffusion_creep_is_newtonian_and_of_its_power_of_grain_size(name: str) -> None:
    values, power = DIFFUSION[name]
    point = {"stress": 5.0, "temperature": NICKEL}

    assert slope(name, values, "stress", point) == pytest.approx(1.0, abs=1e-9)
    assert slope(name, values, "d", point) == pytest.approx(-power, abs=1e-7)


@pytest.mark.parametrize("name", DIFFUSION)
def test_the_activation_energy_is_that_of_diffusion(name: str) -> None:
    """d(ln rate)/d(ln T) = Q/(R T) - 1: the 1 is that of 1/(k T)."""
    values, _ = DIFFUSION[name]
    found = (slope(name, values, "temperature", {"stress": 5.0, "temperature": NICKEL}) + 1) * GAS_CONSTANT * NICKEL

    assert found == pytest.approx(values["Q"], rel=1e-6)


def test_boundaries_rule_below_a_grain_size_and_the_lattice_above() -> None:
    """The rates are equal at d = pi delta D_b/D_v (Frost and Ashby, Eq. (2.30))."""
    lattice, boundary = nabarro_herring.TYPICAL, coble.TYPICAL
    diffusivities = [v * np.exp(-q / (GAS_CONSTANT * NICKEL)) for v, q in ((3.5e-6, 115e3), (190.0, 284e3))]
    equal = np.pi * diffusivities[0] / diffusivities[1]
    point = {"stress": 5.0, "temperature": NICKEL}

    for size, ratio in ((equal, 1.0), (equal / 10, 10.0), (10 * equal, 0.1)):
        along = rate("coble", boundary | {"d": size}, **point)
        through = rate("nabarro-herring", lattice | {"d": size}, **point)
        assert along / through == pytest.approx(ratio, rel=1e-12)


def test_nabarro_herring_in_si_units() -> None:
    """14 D Omega s/(k T d^2) in m, Pa and J: 1 MPa, 1000 K, grains of 50 micrometres."""
    D = 1.9e-4 * np.exp(-284e3 / (8.314462618 * 1000.0))
    expected = 14 * D * 1.09e-29 * 1e6 / (1.380649e-23 * 1000.0 * 50e-6**2)

    assert rate("nabarro-herring", nabarro_herring.TYPICAL, stress=1.0, temperature=1000.0) == pytest.approx(expected)


def test_coble_in_si_units() -> None:
    D = 3.5e-15 * np.exp(-115e3 / (8.314462618 * 1000.0))
    expected = 14 * np.pi * D * 1.09e-29 * 1e6 / (1.380649e-23 * 1000.0 * 10e-6**3)

    assert rate("coble", coble.TYPICAL, stress=1.0, temperature=1000.0) == pytest.approx(expected)


def test_dorn_in_si_units() -> None:
    """A D G b/(k T) (s/G)^n in m, Pa and J, with the numbers of nickel at 1300 K and 20 MPa."""
    D, G = 1.9e-4 * np.exp(-284e3 / (8.314462618 * NICKEL)), 78.9e9 * (1 - 0.64 * (NICKEL - 300) / 1726)
    expected = 3e6 * D * G * 2.49e-10 / (1.380649e-23 * NICKEL) * (20e6 / G) ** 4.6

    assert rate("dorn", dorn.TYPICAL, stress=20.0, temperature=NICKEL) == pytest.approx(expected, rel=1e-9)


def test_the_apparent_activation_energy_of_dorn_holds_the_modulus() -> None:
    """Q_app = Q - R T [1 + (n-1) (T/G) dG/dT]: above Q, since the modulus falls."""
    found = slope("dorn", dorn.TYPICAL, "temperature", {"stress": 20.0, "temperature": NICKEL}) * GAS_CONSTANT * NICKEL
    softening = NICKEL * dorn.TYPICAL["g"] / (1 + dorn.TYPICAL["g"] * (NICKEL - 300))
    expected = 284e3 - GAS_CONSTANT * NICKEL * (1 + 3.6 * softening)

    assert found == pytest.approx(expected, rel=1e-6)
    assert found > 284e3
    assert slope("dorn", dorn.TYPICAL, "stress", {"stress": 20.0, "temperature": NICKEL}) == pytest.approx(4.6)


def test_garofalo_is_a_power_of_low_stress_and_an_exponential_of_high_stress() -> None:
    values = garofalo.TYPICAL
    steep = {"stress": 50 / values["alpha"], "temperature": 400.0}

    assert slope("garofalo", values, "stress", {"stress": 0.01, "temperature": 400.0}) == pytest.approx(values["n"])
    assert slope("garofalo", values, "stress", steep) / 50 == pytest.approx(values["n"])
    by_heat = slope("garofalo", values, "temperature", {"stress": 20.0, "temperature": 400.0}) * 400.0
    assert by_heat == pytest.approx(6500.0, rel=1e-6)


def test_garofalo_is_the_built_in_sinh_about_a_reference_temperature() -> None:
    built_in = ck.law("hyperbolic-sine").times(arrhenius(T_ref=400.0))
    at_reference = garofalo.TYPICAL["A"] * np.exp(-6500.0 / 400.0)
    values = {"A": at_reference, "n": 6.41, "B": 1 / 0.02447, "Q": garofalo.TYPICAL["Q"]}
    point = {"stress": np.array([1.0, 10.0, 80.0]), "temperature": np.array([300.0, 350.0, 420.0])}

    expected = ck.lower(built_in, "numpy").rate(values, **point)
    np.testing.assert_allclose(rate("garofalo", garofalo.TYPICAL, **point), expected, rtol=1e-12)


def test_two_laws_of_one_solder_agree_within_an_order_of_magnitude() -> None:
    """Sn-Ag-Cu by Schubert et al. (sinh) and by Wiese et al. (double power), 20 and 30 MPa, 300 to 398 K."""
    stress, temperature = np.meshgrid([20.0, 30.0], [300.0, 348.0, 398.0])
    sinh = rate("garofalo", garofalo.TYPICAL, stress=stress, temperature=temperature)
    powers = rate("double-power", double_power.TYPICAL, stress=stress, temperature=temperature)

    assert (np.abs(np.log10(sinh / powers)) < 1).all()


def test_the_double_power_law_has_one_exponent_at_each_end() -> None:
    for stress, exponent, energy in ((0.1, 3.0, 3223.0), (500.0, 12.0, 7348.0)):
        point = {"stress": stress, "temperature": 350.0}
        assert slope("double-power", double_power.TYPICAL, "stress", point) == pytest.approx(exponent, rel=1e-4)
        by_heat = slope("double-power", double_power.TYPICAL, "temperature", point) * 350.0
        assert by_heat == pytest.approx(energy, rel=1e-3)


def test_below_the_threshold_nothing_creeps() -> None:
    values = {"A": 1e-16, "n": 4.0, "s_0": 60.0}
    stress = np.array([10.0, 60.0, 61.0, 180.0])

    np.testing.assert_allclose(
        rate("threshold-stress", values, stress=stress), [0, 0, 1e-16, 1e-16 * 120**4], atol=1e-100
    )


def test_a_threshold_raises_the_apparent_exponent() -> None:
    """n s/(s - s_0): 4 becomes 12 at 1.5 s_0."""
    values = {"A": 1e-16, "n": 4.0, "s_0": 60.0}

    assert slope("threshold-stress", values, "stress", {"stress": 90.0}) == pytest.approx(12.0, rel=1e-6)
