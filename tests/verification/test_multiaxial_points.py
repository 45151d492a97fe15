"""Multiaxial points against closed forms and against what other codes publish.

Tolerances: creep at constant stress is a straight line in the march's clock, hence 1e-9, or the digits printed where
a figure is quoted from elsewhere. Where stress relaxes or a load steps, 1e-4 at the default tolerance of a step.
"""

from __future__ import annotations

import numpy as np
import pytest

from creepkit.integration import IntegrationSettings
from creepkit.integration.tensor_integration import PointTrajectory, integrate_tensor_point
from creepkit.kernels import lower
from creepkit.language import CreepLaw, Param, mean_stress, parameters, principal_stress, stress
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.laws.time_hardening import TIME_HARDENING
from creepkit.records import PointLoading, Program, Status

ENDLESS = IntegrationSettings(strain_limit=np.inf)
NAFEMS = {"A": 3.125e-14, "n": 5}
"""NAFEMS R0027, per hour and MPa, with E = 200 GPa and nu = 0.3: eps = A sigma^5 t^m."""
STEEL = (200e3, 0.3)
E, NU = STEEL
G, K = E / (2 * (1 + NU)), E / (3 * (1 - 2 * NU))


def imposed(controls) -> PointLoading:
    """From {component: (quantity, value)}."""
    kinds = ("stress", "strain")
    return PointLoading(*({k: value for k, (kind, value) in controls.items() if kind == one} for one in kinds))


def driven(law: CreepLaw, values, controls, times, elastic=STEEL, temperature=300.0) -> PointTrajectory:
    kernel = lower(law, "compiled")
    run = integrate_tensor_point(
        kernel, law.to_internal(values)[0], elastic, imposed(controls), temperature, times, settings=ENDLESS
    )
    assert run.status == Status.COMPLETE
    assert run.reason == ""
    return run


def constants(**components: float):
    return {name[1:]: ("stress", value) for name, value in components.items()}


CASES = {
    "1A": ({"s11": 200.0}, [0.01, -0.005, -0.005]),
    "2A": ({"s11": 200.0, "s22": 200.0}, [0.005, 0.005, -0.01]),
    "3A": ({"s11": 200.0, "s22": -200.0}, [0.135, -0.135, 0.0]),
}
"""NAFEMS R0027: stresses and the creep strains 11, 22, 33 after 1 h."""
HOURS = np.array([0.0, 1.0, 10.0, 100.0, 200.0, 500.0, 1000.0])


class TestNafemsAtConstantStress:
    """eps = A q^(n-1) 3/2 s t^m; the uniaxial 1A is Ansys VMR049-CR1 too, 10.0 and -5.0 at 1000 h."""

    @pytest.mark.parametrize("case", CASES)
    def test_secondary(self, case: str) -> None:
        stresses, after_an_hour = CASES[case]
        run = driven(NORTON, NAFEMS, constants(**stresses), HOURS)
        np.testing.assert_allclose(run.creep_strain[:, :3], np.outer(HOURS, after_an_hour), rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(run.creep_strain[:, 3:], 0.0, atol=1e-15)
        elastic = run.strain - run.creep_strain
        np.testing.assert_allclose(elastic[:, 0], (run.stress[:, 0] - NU * run.stress[:, 1]) / E, rtol=1e-6)

    @pytest.mark.parametrize("case", CASES)
    def test_primary(self, case: str) -> None:
        """8A, 9A, 10A: the same with t^0.5."""
        stresses, after_an_hour = CASES[case]
        law, values = TIME_HARDENING, {"A": 0.5 * NAFEMS["A"], "n": 5, "m": -0.5}
        run = driven(law, values, constants(**stresses), HOURS)
        expected = np.outer(np.sqrt(HOURS), after_an_hour)
        np.testing.assert_allclose(run.creep_strain[:, :3], expected, rtol=1e-9, atol=1e-12)

    def test_pure_shear_is_the_case_of_opposite_stresses_turned_by_45_degrees(self) -> None:
        run = driven(NORTON, NAFEMS, constants(s12=200.0), HOURS)
        np.testing.assert_allclose(run.creep_strain[:, 3], 0.135 * HOURS, rtol=1e-9)
        np.testing.assert_allclose(run.equivalent, 0.135 * 2 / np.sqrt(3) * HOURS, rtol=1e-9)


class TestNafemsWithASteppedLoad:
    """NAFEMS R0027 10C, (200, -200), then (250, -250) at 100 h, eps = A sigma^5 t^0.5, by time and by strain."""

    step = Program.steps([(0.0, 200.0), (100.0, 250.0)])
    controls = {"11": ("stress", step), "22": ("stress", Program(step.times, -step.values))}  # noqa: RUF012
    times = (100.0, 110.0, 150.0, 200.0)

    def test_time_hardening(self) -> None:
        run = driven(TIME_HARDENING, {"A": 0.5 * NAFEMS["A"], "n": 5, "m": -0.5}, self.controls, self.times)
        expected = [1.35, 1.5510862580252214, 2.2759203380695956, 3.0565072912709907]
        np.testing.assert_allclose(run.creep_strain[:, 0], expected, rtol=1e-4)

    def test_strain_hardening(self) -> None:
        """The same curve as a rate that strain slows: A^2/2 sigma^10 / eps."""
        run = driven(STRAIN_HARDENING, {"A": 0.5 * NAFEMS["A"] ** 2, "n": 10, "m": -1}, self.controls, self.times)
        expected = [1.35, 1.8761224353001882, 3.210790706536871, 4.335418540621781]
        np.testing.assert_allclose(run.creep_strain[:, 0], expected, rtol=1e-4)


def test_nafems_primary_and_secondary_creep_with_a_stepped_load() -> None:
    """NAFEMS R0027 12A, 12C: A1 = 1e-16, A2 = 1e-14, sigma^5 (A1 t + A2 t^0.5), 100 MPa then 110 MPa at 10 000 h."""
    values = {"A_1": 1e-16, "n_1": 5, "A_2": 0.5e-14, "n_2": 5, "m": -0.5}
    step = ("stress", Program.steps([(0.0, 100.0), (1e4, 110.0)]))
    run = driven(NORTON + TIME_HARDENING, values, {"11": step}, [1, 100, 1000, 1e4, 11000, 15000, 20000])
    expected = [0.000101, 0.0011, 0.004162277660168379, 0.02, 0.02239658138066511, 0.03167208862824868]
    np.testing.assert_allclose(run.creep_strain[:, 0], [*expected, 0.042776050843374935], rtol=1e-4)


class TestRelaxation:
    """Held strains: q = [q0^(1-n) + (n-1) k A t]^(-1/(n-1)), where dq/dt = -k A q^n; k follows from what is held."""

    times = np.array([0.0, 1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1000.0])

    def relaxed(self, start: float, stiffness: float, factor: float = 1.0) -> np.ndarray:
        return (start**-4.0 + 4 * stiffness * factor * NAFEMS["A"] * self.times) ** -0.25

    def test_uniaxial(self) -> None:
        """NAFEMS R0027 1B, strain 1e-3."""
        run = driven(NORTON, NAFEMS, {"11": ("strain", 1e-3)}, self.times)
        expected = [200, 198.04854714851308, 183.8645430449837, 133.74806099528442, 79.03765226488096]
        expected += [44.69345229175846, 25.147097047418033, 14.142047236764345]
        np.testing.assert_allclose(run.stress[:, 0], expected, rtol=1e-4)
        np.testing.assert_allclose(run.stress[:, 1:], 0.0, atol=1e-12)

    def test_uniaxial_with_time_hardening(self) -> None:
        """NAFEMS R0027 8B, strain 1e-3, eps = A sigma^5 t^0.5."""
        run = driven(
            TIME_HARDENING, {"A": 0.5 * NAFEMS["A"], "n": 5, "m": -0.5}, {"11": ("strain", 1e-3)}, self.times[1:]
        )
        expected = [163.0298794203759, 133.74806099528442, 104.05283253589862, 79.03765226488096]
        expected += [59.519602639852714, 44.69345229175846, 33.52966364209675]
        np.testing.assert_allclose(run.stress[:, 0], expected, rtol=1e-4)

    def test_equal_strains_in_a_plane(self) -> None:
        """k = E/(2(1-nu)): half of the creep lies in each direction of the plane."""
        run = driven(NORTON, NAFEMS, {"11": ("strain", 7e-4), "22": ("strain", 7e-4)}, self.times)
        expected = self.relaxed(E / (1 - NU) * 7e-4, E / (2 * (1 - NU)))
        np.testing.assert_allclose(run.stress[:, :2], np.stack([expected, expected], axis=-1), rtol=1e-4)

    @pytest.mark.parametrize("component", ["12", "23", "13"])
    def test_shear(self, component: str) -> None:
        """k = 3G, q = sqrt(3) tau, tau0 = 2G eps."""
        run = driven(NORTON, NAFEMS, {component: ("strain", 6e-4)}, self.times)
        expected = self.relaxed(np.sqrt(3) * 2 * G * 6e-4, 3 * G) / np.sqrt(3)
        np.testing.assert_allclose(run.stress[:, ["11", "22", "33", "12", "23", "13"].index(component)], expected, 1e-4)

    def test_all_strains_held(self) -> None:
        """k = 3G; the mean stress stays what it was."""
        held = np.array([1e-3, -2e-4, 1e-4, 3e-4, -2e-4, 4e-4])
        names = ("11", "22", "33", "12", "23", "13")
        run = driven(NORTON, NAFEMS, {n: ("strain", e) for n, e in zip(names, held, strict=True)}, self.times)
        mean = 3 * K * held[:3].mean()
        s = 2 * G * (held - held[:3].mean() * np.array([1, 1, 1, 0, 0, 0]))
        start = np.sqrt(1.5 * s**2 @ [1, 1, 1, 2, 2, 2])
        expected = np.outer(self.relaxed(start, 3 * G) / start, s) + mean * np.array([1, 1, 1, 0, 0, 0])
        np.testing.assert_allclose(run.stress, expected, rtol=1e-4, atol=1e-2)

    def test_a_law_of_the_largest_principal_stress_in_shear(self) -> None:
        """sigma_1 = tau = q/sqrt(3), so A is divided by sqrt(3)^5."""
        run = driven(PRINCIPAL, NAFEMS, {"12": ("strain", 6e-4)}, self.times)
        expected = self.relaxed(np.sqrt(3) * 2 * G * 6e-4, 3 * G, 3**-2.5) / np.sqrt(3)
        np.testing.assert_allclose(run.stress[:, 3], expected, rtol=1e-4)

    def test_a_law_of_the_mean_stress_under_held_strains(self) -> None:
        """The mean stress, 3 K e, does not relax: dq/dt = -3G A sigma_m q^5."""
        held = {"11": ("strain", 1e-3), "22": ("strain", 1e-4), "33": ("strain", 1e-4)}
        run = driven(MEAN, {"A": NAFEMS["A"] / 100, "n": 5}, held, self.times)
        expected = self.relaxed(2 * G * 9e-4, 3 * G, 3 * K * 4e-4 / 100)
        np.testing.assert_allclose(run.stress[:, 0] - run.stress[:, 1], expected, rtol=1e-4)


A, n = parameters("A n")
TABLE = {A: Param("rate coefficient", unit="1/s", bounds=(1e-40, 1e-5), scale="log"), n: Param("n", bounds=(1, 8))}
PRINCIPAL = CreepLaw(name="principal", terms={"creep": A * principal_stress**n}, params=TABLE)
MEAN = CreepLaw(name="mean", terms={"creep": A * mean_stress * stress**n}, params=TABLE)


def test_principal_and_mean_stress_of_a_general_state() -> None:
    """A state whose principal stresses are 140, 60 and 10 MPa, turned out of the axes."""
    c, s = np.cos(0.4), np.sin(0.4)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    tensor = turn @ np.diag([60.0, 140.0, 10.0]) @ turn.T
    controls = {f"{i + 1}{j + 1}": ("stress", tensor[i, j]) for i in range(3) for j in range(i, 3)}
    q = np.sqrt(0.5 * (80.0**2 + 130.0**2 + 50.0**2))
    run = driven(PRINCIPAL, {"A": 1e-12, "n": 3}, controls, [1e3])
    assert run.equivalent[0] == pytest.approx(1e-9 * 140.0**3, rel=1e-9)
    run = driven(MEAN, {"A": 1e-12, "n": 3}, controls, [1e3])
    assert run.equivalent[0] == pytest.approx(1e-9 * 70.0 * q**3, rel=1e-9)


@pytest.mark.parametrize("radius", [1.0, 2.0])
def test_a_maxwell_tube_in_plane_strain(radius: float) -> None:
    """Tube r = 1 to 2, E = 1, nu = 0.3, rate = q, pressure 1e-3: radial and hoop stress never change.

    sigma_z = (sr + st) [1/2 - (1/2 - nu) exp(-E t)]; code_aster ssna104a prints for r = 2, t = 0.9 (six digits)
    u = 2.14498e-3, sigma_z = 2.7912e-4, sigma_theta = 6.6660e-4. Its tube is meshed, so it is held to 1e-4.
    """
    radial, hoop = (1e-3 / 3 * (1 - sign * 4 / radius**2) for sign in (1, -1))
    times = np.array([1e-6, 0.1, 0.5, 0.9])
    controls = {"11": ("stress", radial), "22": ("stress", hoop), "33": ("strain", 0.0)}
    run = driven(NORTON, {"A": 1.0, "n": 1.0}, controls, times, elastic=(1.0, 0.3))
    decay = np.exp(-times)
    shift = (1.3 * 4 / radius + 0.6 * radius) - 0.08 * radius * decay + 6.0 * times / radius
    np.testing.assert_allclose(run.stress[:, 2], (radial + hoop) * (0.5 - 0.2 * decay), rtol=1e-5)
    np.testing.assert_allclose(run.strain[:, 1] * radius, 1e-3 / 3 * shift, rtol=1e-5)
    if radius == 2.0:
        assert run.strain[-1, 1] * radius == pytest.approx(2.14498e-3, rel=1e-4)
        assert run.stress[-1, 2] == pytest.approx(2.7912e-4, rel=1e-4)


def test_plane_strain_ends_with_the_axial_stress_in_the_middle() -> None:
    """NAFEMS 5A (200, 100) in plane strain: the steady axial stress is 150, and the rate that of q = 86.60."""
    held = {"11": ("stress", 200.0), "22": ("stress", 100.0), "33": ("strain", 0.0)}
    run = driven(NORTON, NAFEMS, held, [0.0, 900.0, 1000.0])
    q = np.sqrt(0.75) * 100
    assert run.stress[0, 2] == pytest.approx(NU * 300)
    assert run.stress[-1, 2] == pytest.approx(150, rel=1e-6)
    rate = (run.creep_strain[2, 0] - run.creep_strain[1, 0]) / 100
    assert rate == pytest.approx(1.5 * NAFEMS["A"] * q**4 * 50, rel=1e-5)


def test_two_bars_share_a_load() -> None:
    """Bars of equal section and lengths 1 and 2 under 300 MPa in all, n = 5, A = 1e-14.

    Steadily s1/s2 = 2^(1/5): 160.38058841422904 and 139.61941158577096, and both ends move at 0.0010611065920040734:
    drawn at this pace, each bar tends to its stress, and the two carry the load.
    """
    pace, end = 0.0010611065920040734, 60.0
    stresses = []
    for length, expected in ((1.0, 160.38058841422904), (2.0, 139.61941158577096)):
        ramp = Program(np.array([0.0, end]), np.array([0.0, pace * end / length]))
        run = driven(NORTON, {"A": 1e-14, "n": 5}, {"11": ("strain", ramp)}, [end])
        assert run.stress[0, 0] == pytest.approx(expected, rel=1e-5)
        stresses.append(run.stress[0, 0])
    assert sum(stresses) == pytest.approx(300.0, rel=1e-5)


class TestCodeAsterSsnp107:
    """code_aster ssnp107a: tension and shear, Lemaitre's law, rate = (q / (K p^(1/M)))^N.

    N = 11, 1/K = 8e-4, 1/M = 0.178571429, E = 178.6 GPa, sigma = 210 MPa and tau = 210/sqrt(3) (nodal forces on a
    unit cube). Plasticity, q = 120 + E Et/(E - Et) p with Et = 1930 MPa, comes first, then creep for 3600 s; the load
    is doubled with plasticity again, then creep for 60 s. The law hardens by the strain reached, whoever made it,
    so that plasticity is as good as earlier creep at the same stress. Strains are those of its file, six digits.
    """

    exponent = 1 + 11 * 0.178571429

    @pytest.mark.parametrize(
        ("load", "duration", "along", "across"), [(1, 3600.0, 0.0906364, 0.0784935), (2, 60.0, 0.280733, 0.243122)]
    )
    def test_creep_after_plasticity(self, load: int, duration: float, along: float, across: float) -> None:
        sigma, tau = 210.0 * load, 210.0 * load / np.sqrt(3)
        q, hardening = np.sqrt(2) * sigma, 178600 * 1930 / (178600 - 1930)
        plastic = (q - 120) / hardening
        earlier = plastic**self.exponent / (self.exponent * (8e-4 * q) ** 11)
        values = {"A": 8e-4**11, "n": 11, "m": 1 - self.exponent}
        controls = constants(s11=sigma, s12=tau)
        run = driven(STRAIN_HARDENING, values, controls, [earlier, earlier + duration], elastic=(178600, 0.3))
        assert run.equivalent[0] == pytest.approx(plastic, rel=1e-5)
        assert run.creep_strain[1, 0] == pytest.approx(along, rel=3e-6)
        assert run.creep_strain[1, 3] == pytest.approx(across, rel=3e-6)


def test_moose_power_law_creep_of_a_cube() -> None:
    """MOOSE, tensor_mechanics/power_law_creep: 1e-15 s^4 exp(-3e5/(8.3143 T)), T = 1000 K, 10 MPa, SI units.

    Effective creep strain after 0.1 and 1 s. Its iterations leave up to 6e-5 of a step in the first three of ten;
    from the fourth on the rate, and at the end the sum, is right to nine digits.
    """
    values = {"A": 1e-15 * 1e6**4 * np.exp(-3e5 / (8.3143 * 1000)), "n": 4}
    run = driven(NORTON, values, constants(s22=10.0), [0.1, 1.0])
    assert run.equivalent[0] == pytest.approx(0.00021359459285203, rel=5e-5)
    assert run.equivalent[1] == pytest.approx(0.0021360306230979, rel=1e-8)
