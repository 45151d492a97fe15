"""Laws without memory: exponents and activation energies measured on the rate, published figures, limits."""

import re
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from creepkit_classic import coble, dorn, double_power, nabarro_herring, sellars_mctegart
from creepkit_classic.conversions import convert, per_second
from numpy.typing import NDArray

import creepkit as ck
from creepkit.language import GAS_CONSTANT, arrhenius, exponential, linear
from creepkit.records import Status, StressSteps

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


DIFFUSION = {
    "nabarro-herring": (nabarro_herring.TYPICAL | {"grain_size": 0.05}, 2),
    "coble": (coble.TYPICAL | {"grain_size": 0.01}, 3),
}


def test_diffusion_creep_is_newtonian_and_of_its_power_of_grain_size() -> None:
    """d(ln rate)/d(ln T) = Q/(R T) - 1: the 1 is that of 1/(k T)."""
    point = {"stress": 5.0, "temperature": NICKEL}
    for name, (values, power) in DIFFUSION.items():
        assert slope(name, values, "stress", point) == pytest.approx(1.0, abs=1e-9)
        assert slope(name, values, "grain_size", point) == pytest.approx(-power, abs=1e-7)
        by_heat = (slope(name, values, "temperature", point) + 1) * GAS_CONSTANT * NICKEL
        assert by_heat == pytest.approx(values["Q"], rel=1e-6)


def test_boundaries_rule_below_a_grain_size_and_the_lattice_above() -> None:
    """The rates are equal at d = pi delta D_b/D_v (Frost and Ashby, Eq. (2.30))."""
    lattice, boundary = nabarro_herring.TYPICAL, coble.TYPICAL
    diffusivities = [v * np.exp(-q / (GAS_CONSTANT * NICKEL)) for v, q in ((3.5e-6, 115e3), (190.0, 284e3))]
    equal = np.pi * diffusivities[0] / diffusivities[1]
    point = {"stress": 5.0, "temperature": NICKEL}

    for size, ratio in ((equal, 1.0), (equal / 10, 10.0), (10 * equal, 0.1)):
        along = rate("coble", boundary | {"grain_size": size}, **point)
        through = rate("nabarro-herring", lattice | {"grain_size": size}, **point)
        assert along / through == pytest.approx(ratio, rel=1e-12)


def test_diffusion_creep_in_si_units() -> None:
    """14 D Omega s/(k T d^2), or 14 pi D Omega s/(k T d^3), in m, Pa and J: 1 MPa, 1000 K, 50 and 10 micrometres."""
    (lattice, boundary), kT = (np.exp(-q / (8.314462618 * 1000.0)) for q in (284e3, 115e3)), 1.380649e-23 * 1000.0
    expected = {
        "nabarro-herring": 14 * 1.9e-4 * lattice * 1.09e-29 * 1e6 / (kT * 50e-6**2),
        "coble": 14 * np.pi * 3.5e-15 * boundary * 1.09e-29 * 1e6 / (kT * 10e-6**3),
    }
    found = {name: rate(name, DIFFUSION[name][0], stress=1.0, temperature=1000.0) for name in expected}
    assert found == pytest.approx(expected)


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


def test_sellars_mctegart_is_a_power_of_low_stress_and_an_exponential_of_high_stress() -> None:
    values = sellars_mctegart.TYPICAL
    steep = {"stress": 50 / values["alpha"], "temperature": 400.0}

    assert slope("sellars-mctegart", values, "stress", {"stress": 0.01, "temperature": 400.0}) == pytest.approx(
        values["n"]
    )
    assert slope("sellars-mctegart", values, "stress", steep) / 50 == pytest.approx(values["n"])
    by_heat = slope("sellars-mctegart", values, "temperature", {"stress": 20.0, "temperature": 400.0}) * 400.0
    assert by_heat == pytest.approx(6500.0, rel=1e-6)


def test_sellars_mctegart_is_the_built_in_sinh_about_a_reference_temperature() -> None:
    built_in = ck.law("hyperbolic-sine").times(arrhenius(T_ref=400.0))
    at_reference = sellars_mctegart.TYPICAL["A"] * np.exp(-6500.0 / 400.0)
    values = {"A": at_reference, "n": 6.41, "B": 1 / 0.02447, "Q": sellars_mctegart.TYPICAL["Q"]}
    point = {"stress": np.array([1.0, 10.0, 80.0]), "temperature": np.array([300.0, 350.0, 420.0])}

    expected = ck.lower(built_in, "numpy").rate(values, **point)
    np.testing.assert_allclose(rate("sellars-mctegart", sellars_mctegart.TYPICAL, **point), expected, rtol=1e-12)


def test_the_double_power_law_has_one_exponent_at_each_end() -> None:
    for stress, exponent, energy in ((0.1, 3.0, 3223.0), (500.0, 12.0, 7348.0)):
        point = {"stress": stress, "temperature": 350.0}
        assert slope("double-power", double_power.TYPICAL, "stress", point) == pytest.approx(exponent, rel=1e-4)
        by_heat = slope("double-power", double_power.TYPICAL, "temperature", point) * 350.0
        assert by_heat == pytest.approx(energy, rel=1e-3)


def test_below_the_threshold_nothing_creeps() -> None:
    """Above it the apparent exponent is n s/(s - s_0): 4 becomes 12 at 1.5 s_0."""
    values, stress = {"A": 1e-16, "n": 4.0, "s_0": 60.0}, np.array([10.0, 60.0, 61.0, 180.0])
    found = rate("threshold-stress", values, stress=stress)
    np.testing.assert_allclose(found, [0, 0, 1e-16, 1e-16 * 120**4], atol=1e-100)
    assert slope("threshold-stress", values, "stress", {"stress": 90.0}) == pytest.approx(12.0, rel=1e-6)


# ---- classic laws ----------------------------------------------------------------------------------------------------

# Each law comes through its entry point, keeps what every law promises, and has values to begin with.


LAWS = [
    *(
        "blackburn",
        "coble",
        "dorn",
        "double-power",
        "sellars-mctegart",
        "graham-walles",
        "mpc-omega",
        "nabarro-herring",
    ),
    *("norton-bailey-rate", "norton-bailey-strain", "norton-bailey-time", "theta-projection", "threshold-stress"),
]


@pytest.mark.parametrize("name", LAWS)
def test_typical_values_are_within_the_bounds(name: str) -> None:
    law, typical = ck.law(name), import_module(f"creepkit_classic.{name.replace('-', '_')}").TYPICAL

    assert law.values(typical) == typical
    assert [key for key, value in typical.items() if not law.table[key].within_bounds(value)] == []


# ---- conversions -----------------------------------------------------------------------------------------------------

# Converted values: the same rates along the same curve, round trips, and values without a counterpart.


NAMES = ["norton-bailey-time", "norton-bailey-rate", "norton-bailey-strain", "time-hardening", "strain-hardening"]
TEXTBOOK = {"A": 4e-13, "n": 4.0, "m": 0.4}
"""strain = A s^n t^m."""


@pytest.mark.parametrize("name", NAMES)
def test_rates_are_those_of_the_curve_in_seconds_and_in_hours(name: str) -> None:
    """At constant stress and the strain A s^n t^m every notation's rate is A m s^n t^(m-1); there and back again."""
    stress, time = (grid.ravel() for grid in np.meshgrid([20.0, 90.0, 300.0], np.geomspace(1.0, 1e7, 8)))
    kernel, values = ck.lower(ck.law(name), "numpy"), convert(TEXTBOOK, "norton-bailey-time", name)
    point = {"stress": stress, "strain": 4e-13 * stress**4 * time**0.4}

    rate = kernel.rate(values, time=time, **point)

    np.testing.assert_allclose(rate, 1.6e-13 * stress**4 * time**-0.6, rtol=1e-12)
    np.testing.assert_allclose(3600 * kernel.rate(per_second(values, name, "h"), time=3600 * time, **point), rate)
    for other in NAMES:
        again = convert(convert(values, name, other), other, name)
        assert again == pytest.approx(values, rel=1e-12, abs=0)


def test_the_numbers_of_each_notation_by_hand() -> None:
    """strain = 4e-12 s^2 t^(1/2): rate = 2e-12 s^2 t^(-1/2), and with t = (e/(4e-12 s^2))^2, rate = 8e-24 s^4/e."""
    given = {"A": 4e-12, "n": 2.0, "m": 0.5}

    assert convert(given, "norton-bailey-time", "norton-bailey-rate") == {"A": 2e-12, "n": 2.0, "m": -0.5}
    assert convert(given, "norton-bailey-time", "norton-bailey-strain") == {"A": 2e-12, "n": 2.0, "m": -0.5}
    by_strain = convert(given, "norton-bailey-time", "strain-hardening")
    assert by_strain == pytest.approx({"A": 8e-24, "n": 4.0, "m": -1.0}, rel=1e-12)


def test_the_example_of_the_readme() -> None:
    """strain = 2.16e-13 s^4 t^0.5 in hours is 3.6e-15 s^4 t^0.5 in seconds; with t eliminated, 6.48e-30 s^8/e."""
    (block,) = re.findall(r"```python\n(.*?)```", (Path(__file__).parents[1] / "README.md").read_text(), re.DOTALL)
    found: dict[str, dict[str, float]] = {}
    exec(block, found)

    assert found["textbook"] == pytest.approx({"A": 3.6e-15, "n": 4.0, "m": 0.5}, rel=1e-12)
    assert found["abaqus"] == pytest.approx({"A": 1.8e-15, "n": 4.0, "m": -0.5}, rel=1e-12)
    assert found["ansys"] == pytest.approx({"A": 6.48e-30, "n": 8.0, "m": -1.0}, rel=1e-12)


# ---- curves ----------------------------------------------------------------------------------------------------------

# Laws with memory: strain curves at constant stress and after a step, through the uniaxial specimen.


STRESS = 120.0
BAR = ck.specimen("uniaxial").replace(tolerance=1e-9, strain_limit=10.0, max_steps=100_000)
TIMES = np.concatenate([np.geomspace(10.0, 1e5, 9), np.linspace(2e5, 1e6, 9)])


def strain(law: str | ck.CreepLaw, values: dict[str, float], times=TIMES, loading=None, **more) -> NDArray[np.float64]:
    held = loading or ck.constant_stress(STRESS, "stress")
    return ck.simulate(law, BAR, values, loading=held, times=times, **more).outputs["strain"]


THETA = {
    **{"theta_1": 1e-3, "theta_2": 1e-6, "theta_3": 2e-3, "theta_4": 4e-7},
    **{"c_1": 0.01, "c_2": 0.02, "c_3": 0.008, "c_4": 0.015},
}


def thetas(stress: float) -> list[float]:
    return [THETA[f"theta_{i}"] * np.exp(THETA[f"c_{i}"] * stress) for i in (1, 2, 3, 4)]


def test_theta_projection() -> None:
    one, two, three, four = thetas(STRESS)
    exact = -one * np.expm1(-two * TIMES) + three * np.expm1(four * TIMES)

    np.testing.assert_allclose(strain("theta-projection", THETA), exact, rtol=1e-6)


def test_theta_projection_after_a_step() -> None:
    """Each strain goes on from where it is, towards or from the thetas of the new stress."""
    step, higher = 3e5, 150.0
    one, two, three, four = thetas(STRESS)
    p, q = -one * np.expm1(-two * step), three * np.expm1(four * step)
    one, two, three, four = thetas(higher)
    later = np.array([4e5, 6e5, 1e6])
    exact = one + (p - one) * np.exp(-two * (later - step)) - three + (q + three) * np.exp(four * (later - step))
    loading = StressSteps(((0.0, STRESS), (step, higher)), "stress")

    np.testing.assert_allclose(strain("theta-projection", THETA, later, loading), exact, rtol=1e-6)


def test_the_sixteen_constants_of_evans_and_wilshire() -> None:
    """ln theta_i = a_i + b_i T + c_i s + d_i s T, about T_ref = 800 K."""
    law = ck.law("theta-projection").with_temperature(
        **{f"theta_{i}": exponential(T_ref=800.0) for i in (1, 2, 3, 4)},
        **{f"c_{i}": linear(T_ref=800.0) for i in (1, 2, 3, 4)},
    )
    b, d, T = [0.001, 0.02, -0.002, 0.03], [1e-5, 2e-5, -1e-5, 3e-5], 825.0
    values = THETA | {f"theta_{i}_T": v for i, v in enumerate(b, 1)} | {f"c_{i}_T": v for i, v in enumerate(d, 1)}
    warm = [
        theta * np.exp(k * (T - 800) + slope * STRESS * (T - 800))
        for theta, k, slope in zip(thetas(STRESS), b, d, strict=True)
    ]
    exact = -warm[0] * np.expm1(-warm[1] * TIMES) + warm[2] * np.expm1(warm[3] * TIMES)

    assert len(law.names) == 16
    np.testing.assert_allclose(strain(law, values, temperature=T), exact, rtol=1e-6)


BLACKBURN = {"A": 1e-9 / STRESS**5, "n": 5.0, "C_f": 1e-9, "C_s": 5e-9, "a": 2.5, "K_f": 2e4, "K_s": 3e3}


def test_blackburn() -> None:
    """X_f (1 - exp(-K_f r t)) + X_s (1 - exp(-K_s r t)) + r t."""
    rate, fast, slow = 1e-9, 1e-9 * STRESS**2.5, 5e-9 * STRESS**2.5
    exact = -fast * np.expm1(-2e4 * rate * TIMES) - slow * np.expm1(-3e3 * rate * TIMES) + rate * TIMES

    np.testing.assert_allclose(strain("blackburn", BLACKBURN), exact, rtol=1e-6)


def test_the_transients_of_blackburn_do_not_recover() -> None:
    """When the stress falls to a half of itself the transients are beyond their new limits: steady creep is left."""
    loading = StressSteps(((0.0, STRESS), (5e5, STRESS / 2)), "stress")
    found = strain("blackburn", BLACKBURN, np.array([5e5, 7e5, 9e5]), loading)

    np.testing.assert_allclose(np.diff(found), 1e-9 / 32 * 2e5, rtol=1e-6)


def test_graham_walles() -> None:
    values = {"C_1": 2e-9, "n_1": 2.0, "C_2": 1e-19, "n_2": 5.0, "C_3": 1e-36, "n_3": 7.0}
    parts = ((2e-9, 2.0, 1 / 3), (1e-19, 5.0, 1.0), (1e-36, 7.0, 3.0))
    exact = sum(C * STRESS**n * TIMES**k for C, n, k in parts)

    np.testing.assert_allclose(strain("graham-walles", values), exact, rtol=1e-6)


@pytest.mark.parametrize("c", [0.0, 0.004])
def test_mpc_omega(c: float) -> None:
    """e = -ln(1 - Omega r t)/Omega; the life is 1/(Omega r), less exp(-Omega) of it at a strain limit of 1."""
    values = {"A": 1e-9 / STRESS**6, "n": 6.0, "Omega": 60.0, "c": c}
    omega = 60.0 * np.exp(-c * STRESS)
    times = np.linspace(0.05, 0.999, 20) / (omega * 1e-9)
    run = ck.simulate(
        "mpc-omega",
        BAR.replace(strain_limit=1.0),
        values,
        loading=ck.constant_stress(STRESS, "stress"),
        times=[*times, 1.1 / (omega * 1e-9)],
    )

    np.testing.assert_allclose(run.outputs["strain"], -np.log1p(-omega * 1e-9 * times) / omega, rtol=1e-6)
    assert run.status is Status.RUPTURED
    assert run.end_time * omega * 1e-9 == pytest.approx(1 - np.exp(-omega), rel=1e-7)


def test_norton_bailey_in_its_three_notations() -> None:
    """A s^n t^m with A = 4e-13, n = 4, m = 0.4, from each notation's own numbers."""
    rate_form = {"A": 4e-13 * 0.4, "n": 4.0, "m": -0.6}
    for name, values in (("time", TEXTBOOK), ("rate", rate_form), ("strain", rate_form)):
        np.testing.assert_allclose(strain(f"norton-bailey-{name}", values), 4e-13 * STRESS**4 * TIMES**0.4, rtol=1e-6)
