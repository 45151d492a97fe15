"""Every material gives a number that its source prints, other than its values."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

import creepkit as ck
from creepkit.testing import check_material

MATERIALS = ck.available("materials")
CELSIUS = 273.15


def rates(name: str, **point: float | NDArray[np.float64]) -> NDArray[np.float64]:
    """The rate of creep, 1/s, of a material at a point, with its conditions."""
    material = ck.material(name)
    conditions = {one.name: point.pop(one.name) for one in material.law.conditions}
    return np.asarray(ck.lower(material.law, "numpy").rate({**material.values, **conditions}, **point))


def least_squares(
    T: NDArray[np.float64], stress: NDArray[np.float64], misfit: NDArray[np.float64], T_ref: float
) -> NDArray[np.float64]:
    """The covariance of ln A, n and Q of a line through ln rate, for the scatter about it."""
    X = np.stack([np.ones_like(T), np.log(stress), -(1 / T - 1 / T_ref) / ck.GAS_CONSTANT], axis=-1)
    return np.linalg.inv(X.T @ X) * (misfit @ misfit) / (T.size - 3)


@pytest.mark.parametrize("name", sorted(MATERIALS))
def test_every_material_conforms(name: str) -> None:
    report = check_material(MATERIALS[name])

    assert report.passed, str(report)


# ---- chromium --------------------------------------------------------------------------------------------------------

CHROMIUM = {
    (816, 0.23): "50.1 .37 61.2 .94 66.9 1.7 72.5 3.5 78.1 5.8 84.6 8.0 92.5 15 100.5 31",
    (816, 0.90): "54.9 .79 58.7 1.5 63.1 2.5 72.1 6.6 82.7 22",
    (982, 0.23): "20.0 .34 21.2 1.3 24.1 1.7 27.4 2.9 30.8 4.8 34.5 9.8 38.3 22 42.6 51",
    (982, 0.90): "25.6 .73 30.1 4.0 33.1 6.2 36.5 11 40.7 24 45.4 82",
    (1149, 0.23): "7.93 .30 11.5 1.7 14.5 4.8 18.6 14",
    (1149, 0.90): "10.5 2.0 11.1 2.2 11.8 2.4 12.9 2.8 13.9 3.8 15.4 9.1 18.1 21",
    (1316, 0.23): "3.70 .35 4.13 .52 5.01 1.5 5.92 3.3 7.45 7.3 9.38 20 11.6 65",
    (1316, 0.90): "5.04 2.8 5.67 4.2 6.61 7.8 7.72 10",
}
"""NASA TM X-2499, Table I: {(C, mm of grains): MN/m^2 and 1e-6/s by turns}."""


def test_chromium_misses_the_rates_of_its_table_by_what_is_printed() -> None:
    """The root mean square of ln rate is 0.51, and the covariance that of the least squares behind it."""
    tables = {C: np.array(text.split(), float).reshape(-1, 2) for C, text in CHROMIUM.items()}
    T = np.concatenate([np.full(len(table), C + CELSIUS) for (C, _), table in tables.items()])
    stress, rate = np.concatenate([*tables.values()]).T
    misfit = np.log(rates("chromium", stress=stress, temperature=T) / (1e-6 * rate))

    assert np.sqrt(np.mean(misfit**2)) == pytest.approx(0.51, abs=0.005)
    assert ck.material("chromium").covariance == pytest.approx(least_squares(T, stress, misfit, 1300.0), rel=1e-3)


# ---- Inconel 718 -----------------------------------------------------------------------------------------------------

INCONEL = {
    650: "551 1.3e-6 551 6e-7 620 3e-6 620 4.5e-6 689 1.39e-5 689 5.3e-5 724 4.4e-5 724 1e-4",
    704: "483 7.5e-6 483 9e-6 517 1.4e-5 517 3.26e-5 551 1.64e-4 551 1.23e-4 620 2.93e-4 620 4.15e-4",
    760: "483 8e-4 483 1.76e-3 345 1.42e-5 345 2.2e-5 276 1.8e-6 276 2.6e-6 413 1.92e-4",
}
"""Hayes (1991), Table III, as creep-fatigue-In718 has it: {C: MPa and 1/h by turns}."""


def test_inconel_misses_the_rates_of_its_table_by_what_is_printed() -> None:
    """norton_fit.txt: R2 is 0.924606 and the root mean square 0.251917, in log10 of the rate."""
    tables = {C: np.array(text.split(), float).reshape(-1, 2) for C, text in INCONEL.items()}
    T = np.concatenate([np.full(len(table), C + CELSIUS) for C, table in tables.items()])
    stress, rate = np.concatenate([*tables.values()]).T
    misfit = np.log(rates("inconel-718", stress=stress, temperature=T) / (rate / 3600.0))

    assert np.sqrt(np.mean(misfit**2)) / np.log(10.0) == pytest.approx(0.251917, rel=1e-4)
    assert 1.0 - np.mean(misfit**2) / np.var(np.log(rate)) == pytest.approx(0.924606, rel=1e-5)
    assert ck.material("inconel-718").covariance == pytest.approx(least_squares(T, stress, misfit, 973.15), rel=1e-3)


# ---- ice -------------------------------------------------------------------------------------------------------------

GLEN_A = {0: 2.4e-24, -2: 1.7e-24, -5: 9.3e-25, -15: 2.1e-25, -20: 1.2e-25, -25: 6.8e-26, -30: 3.7e-26, -35: 2.0e-26}
GLEN_A |= {-40: 1.0e-26, -45: 5.2e-27, -50: 2.6e-27}
"""Cuffey and Paterson (2010), Table 3.4: {C: A of D = A tau^2 s, 1/(s Pa^3)}; -10 C is among the values."""


def test_ice_has_the_softness_of_the_table() -> None:
    """In tension tau^2 = stress^2/3 and s = 2 stress/3. The table has two digits."""
    T, stress = np.array(list(GLEN_A), float) + CELSIUS, 0.1
    softness = rates("ice", stress=stress, temperature=T) / (2.0 / 9.0 * (stress * 1e6) ** 3)

    assert softness == pytest.approx(np.array(list(GLEN_A.values())), rel=0.04)


FLOW_FACTORS = {
    "ice-paterson-budd": (4.65791754e-16, 1.45114704e-14, 4.54299921e-14),
    "ice-hooke": (5.26775897e-16, 2.12325906e-14, 5.32397091e-13),
}
"""test/miscellaneous.py of PISM: {material: D/s at tau = 1e5 Pa, and -30, -5 and 0 C}, 1/(Pa s)."""


@pytest.mark.parametrize("name", FLOW_FACTORS)
def test_ice_flows_as_pism_has_it(name: str) -> None:
    """The gas constant of PISM is 8.31441: 2e-4 of the rate."""
    T, tau = np.array([-30.0, -5.0, 0.0]) + CELSIUS, 0.1
    factors = rates(name, stress=3**0.5 * tau, temperature=T) / (2.0 / 3.0 * 3**0.5 * tau * 1e6)

    assert factors == pytest.approx(np.array(FLOW_FACTORS[name]), rel=1e-3)


# ---- solder ----------------------------------------------------------------------------------------------------------

SATURATION = [(25, 1e-3, 40.5), (50, 1e-3, 33.5), (100, 1e-3, 24.0), (125, 1e-3, 21.5), (25, 1e-4, 35.5)]
SATURATION += [(25, 1e-5, 29.5)]
"""Motalab (2013), Fig. 3.10(a), as anand.py of CoupFE-EDA has read it, which finds the law within 12 %: C, 1/s, MPa."""


@pytest.mark.parametrize(("C", "rate", "printed"), SATURATION)
def test_sac305_flows_at_the_stress_of_the_figure(C: float, rate: float, printed: float) -> None:
    """Where the resistance no longer changes, the rate of creep is that of the tensile test."""
    material, kernel = ck.material("sac305"), ck.lower(ck.material("sac305").law, "numpy")

    def steady(stress: float) -> float:
        point = {"stress": stress, "temperature": C + CELSIUS}
        s = brentq(lambda s: kernel.state_rates(material.values, s=s, **point)["s"], 15.0, 60.0)
        return float(np.log(kernel.rate(material.values, s=s, **point) / rate))

    assert brentq(steady, 5.0, 60.0) == pytest.approx(printed, rel=0.12)


# ---- nuclear fuels and cladding --------------------------------------------------------------------------------------

FUEL = {"density": 95.0, "grain_size": 10.0, "fission_rate": 1.0}
AGED = {"fast_flux": 0.0, "fast_fluence": 5.0}
WET = {"pressure": 1000.0, "hydrogen": 0.01 / 0.01801528 / (0.99 / 0.1470027) * 1e6}

PRINTED = [
    # docs/theory/correlations.rst of dualmesh: "check values"
    ("uo2", {"stress": 20.0, "temperature": 1500.0, **FUEL}, 2.1008e-9, 1e-3),
    ("uo2", {"stress": 60.0, "temperature": 1800.0, **FUEL}, 6.3216e-7, 1e-3),
    # the same, "at 30 MPa, 1400 K and 10 um grains", and tests/python/test_correlations.py for both terms
    ("un", {"stress": 30.0, "temperature": 1400.0, **FUEL, "fission_rate": 0.0}, 7.740e-8 + 5.582e-9, 2e-3),
    # limback_thermal_creep_is_temperature_activated of outram_park_fork_offbeat; by flux 1.971430e-10 more
    ("zircaloy-4", {"stress": 100.0, "temperature": 620.0, **AGED}, 6.19516e-11, 1e-4),
    ("zircaloy-4", {"stress": 100.0, "temperature": 720.0, **AGED}, 1.31040e-8, 1e-4),
    ("zircaloy-4", {"stress": 100.0, "temperature": 620.0, "fast_flux": 1.0, "fast_fluence": 5.0}, 2.59095e-10, 1e-4),
    # test_fecral_correlations_are_those_of_the_handbook of dualmesh: 4.5e-11, and by heat four decades less
    ("fecral", {"stress": 100.0, "temperature": 600.0, "fast_flux": 1.0}, 4.5e-11, 1e-3),
    # docs/theory/triso.rst of dualmesh: K = 2.72e-4 at 1000 C, for 1e25 n/m^2
    ("pyrocarbon", {"stress": 1.0, "temperature": 1273.15, "fast_flux": 1.0}, 2.72e-4 * 1e-7, 3e-3),
    # heads of tests/*.prm of ASPECT: stress = 2 viscosity rate, and two rates at a stress
    ("olivine-wet", {"stress": 2 * 1.00291e13 * 1e-13, "temperature": 1173.0, **WET}, 1e-13, 1e-3),
    ("olivine-mei", {"stress": 1000.0, "temperature": 1073.0}, 9.576747017313619e-11, 2e-3),
    ("olivine-idrissi", {"stress": 109.2890, "temperature": 1073.0}, 1.000000e-13, 4e-3),
    # test/test_DislocationCreep.jl and test/test_DiffusionCreep.jl of GeoParams.jl, without tensor correction
    ("olivine", {"stress": 0.3, "temperature": 1673.0}, 4.612967949163285e-14, 1e-3),
    ("anorthite", {"stress": 1.0, "temperature": 923.15, "grain_size": 5000.0}, 9.451777858730959e-26, 1e-3),
]


@pytest.mark.parametrize(("name", "point", "printed", "tolerance"), PRINTED)
def test_a_rate_is_that_which_the_source_prints(
    name: str, point: dict[str, float], printed: float, tolerance: float
) -> None:
    assert rates(name, **point) == pytest.approx(printed, rel=tolerance)


def test_viscosity_of_gerya_s_olivine_is_that_of_his_exercise() -> None:
    """The mean over 400 to 1200 C at 1e-14 1/s, of invariants: stress 3^0.5 tau, rate 2/3^0.5 of theirs.

    test/test_DislocationCreep.jl of GeoParams.jl, "deviatoric stress & viscosity profiles (as in book)".
    """
    T = np.arange(400.0, 1201.0, 10.0) + CELSIUS
    stress = (2 / 3**0.5 * 1e-14 / rates("olivine-gerya", stress=1.0, temperature=T)) ** (1 / 3.5)

    assert np.mean(1e6 * stress / 3**0.5 / 2e-14) == pytest.approx(4.124658696991946e24, rel=1e-3)


STRAINS = [
    # material, point, MPa of Young, Poisson, days, 2-norm of the tensor of strain
    ("rock-salt", {"stress": 1.0, "temperature": 298.15, "grain_size": 5e4}, 25e3, 0.25, 2.0, 4.2636355248e-05),
    ("rock-salt-bgra", {"stress": 20.0, "temperature": 273.15}, 25e3, 0.27, 20.0, 1.5102310554e-3),
]
"""RangeMax of epsilon in uniax_compression_ts_2_t_2.000000.vtu and m2_1Dcreep_ts_400_t_20.000000.vtu of ogs."""


@pytest.mark.parametrize(("name", "point", "young", "poisson", "days", "printed"), STRAINS)
def test_salt_is_strained_as_ogs_has_it(
    name: str, point: dict[str, float], young: float, poisson: float, days: float, printed: float
) -> None:
    elastic, creep = point["stress"] / young, float(rates(name, **point)) * days * 86400.0

    def norm(creep: float) -> float:
        return float(np.hypot(elastic + creep, 2**0.5 * (poisson * elastic + creep / 2)))

    assert norm(creep) - norm(0.0) == pytest.approx(printed - norm(0.0), rel=1e-3)
