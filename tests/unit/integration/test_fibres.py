"""Models of fibres: closed forms of bending, order of convergence, an explicit integration of the same equations."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import creepkit as ck
from creepkit import kernels
from creepkit.integration import (
    FibreInput,
    FibreModel,
    FibreTest,
    IntegrationSettings,
    PointTest,
    gauss_fibres,
    integrate,
    integrate_fibres,
)
from creepkit.integration.time_discretisation import SDIRK2, SDIRK4
from creepkit.records import Program, Status
from helpers.kachanov_law import kachanov

WIDTH, HEIGHT, E = 10.0, 5.0, 150e3
INERTIA = WIDTH * HEIGHT**3 / 12
MOMENT = 60.0 * WIDTH * HEIGHT**2 / 4
"""N mm; the skeletal stress is 60 MPa."""

CONSTANT = {"temperature": Program.constant(1000.0), "modulus": Program.constant(E)}
TIGHT = IntegrationSettings(rtol=1e-9, max_steps=100_000)


def rectangle(fibres=8):
    places, lengths = gauss_fibres(HEIGHT, fibres)
    return places, WIDTH * lengths


def bent(model, times, moment=MOMENT, **changed):
    programs = (Program.constant(0.0), moment if isinstance(moment, Program) else Program.constant(moment))
    return FibreTest(model, programs, **{**CONSTANT, **changed}, times=np.asarray(times, float))


def of(name, **values):
    law = ck.law(name) if isinstance(name, str) else name
    return kernels.lower(law, "compiled"), law.to_internal(law.values(values))[0]


def norton(n, rate=1e-8):
    return of("norton", A=rate / 60.0**n, n=n)


@pytest.mark.parametrize("n", [1.0, 3.0, 7.0])
def test_steady_curvature_rate_of_a_rectangle(n):
    """k' = A (M/I_n)^n, I_n = b h^(2 + 1/n) / (2^(1 + 1/n) (2 + 1/n)): Boyle and Spence (1983), chapter 3."""
    law, theta = norton(n)
    found = integrate_fibres(law, theta, bent(FibreModel.section(*rectangle(12)), [9e6, 1e7]))
    second = WIDTH * HEIGHT ** (2 + 1 / n) / (2 ** (1 + 1 / n) * (2 + 1 / n))

    assert found.status is Status.COMPLETE
    assert np.diff(found.recorded[:, 1])[0] / 1e6 == pytest.approx(1e-8 / 60**n * (MOMENT / second) ** n, rel=3e-5)
    assert np.abs(found.recorded[:, 0]).max() < 1e-9 * found.recorded[-1, 1]


@pytest.mark.parametrize("tableau", [SDIRK2, SDIRK4])
def test_order_of_convergence_in_time(tableau):
    """Errors fall with the length of equal steps to the order of the method."""
    law, theta = norton(3.0)
    test = bent(FibreModel.section(*rectangle(4)), [1e6])
    exact = integrate_fibres(law, theta, test, settings=IntegrationSettings(rtol=1e-12, max_steps=10**6)).recorded[0, 1]
    errors = []
    for steps in (16, 32, 64):
        equal = IntegrationSettings(rtol=1e3, first=1 / steps, longest=1 / steps)
        found = integrate_fibres(law, theta, test, settings=equal, tableau=tableau)
        assert found.steps == steps
        errors.append(abs(found.recorded[0, 1] - exact))
    order = np.log2(errors[0] / errors[2]) / 2

    assert order == pytest.approx(tableau.order, abs=0.5)


@pytest.mark.parametrize("n", [3.0, 7.0])
def test_convergence_with_the_number_of_fibres(n):
    """Gauss quadrature of y^(1 + 1/n): the error falls with the number of fibres to the power of 4 + 2/n.

    Davis and Rabinowitz, Methods of Numerical Integration (1984), section 4.12.4.
    """
    law, theta = norton(n)
    second = WIDTH * HEIGHT ** (2 + 1 / n) / (2 ** (1 + 1 / n) * (2 + 1 / n))
    rate = 1e-8 / 60**n * (MOMENT / second) ** n
    errors = []
    for fibres in (3, 6, 12):
        test = bent(FibreModel.section(*rectangle(fibres)), [9e6, 1e7])
        errors.append(
            abs(np.diff(integrate_fibres(law, theta, test, settings=TIGHT).recorded[:, 1])[0] / 1e6 / rate - 1)
        )
    order = np.log2(errors[0] / errors[2]) / 2

    assert order == pytest.approx(4 + 2 / n, abs=0.6)


def stresses(model, creep):
    """(times, fibres) MPa under MOMENT: sigma = stress M + E (modes u - c), u = projection c."""
    return MOMENT * model.stress[1] + E * ((creep @ model.projection.T) @ model.modes.T - creep)


def test_the_skeletal_point_keeps_its_stress():
    """Stress at y = h/2 ((2n + 1)/(3n))^(n/(n - 1)) is the same before creep and in steady creep.

    Marriott and Leckie (1964), Proc. Inst. Mech. Eng. 178 (3L), 115; in between it moves by some per cent.
    """
    n = 5.0
    law, theta = norton(n)
    model = FibreModel.section(*rectangle(20))
    places = rectangle(20)[0]
    test = bent(model.observing(np.eye(model.fibres)), np.geomspace(10, 1e7, 30))
    creep = integrate_fibres(law, theta, test).recorded
    stress = np.abs(stresses(model, creep))
    skeletal = HEIGHT / 2 * ((2 * n + 1) / (3 * n)) ** (n / (n - 1))
    there = np.array([np.interp(skeletal, places, row) for row in stress])
    elastic = MOMENT * skeletal / INERTIA

    assert there[-1] == pytest.approx(elastic, rel=2e-3)
    assert np.abs(there / elastic - 1).max() < 0.08
    assert stress[-1].max() < 0.8 * MOMENT * HEIGHT / 2 / INERTIA  # far from it stresses have moved a lot


HARDENING = {"A": 1e-14, "n": 3.0, "m": -0.6}


def test_fibres_under_a_force_alone_are_a_bar():
    """Constant true stress and primary creep from a virgin state, against the closed form of the integrated rate."""
    law, theta = of("strain-hardening", **HARDENING)
    times = np.geomspace(1, 1e6, 12)
    loads = (Program.constant(80.0 * WIDTH * HEIGHT), Program.constant(0.0))
    found = integrate_fibres(law, theta, FibreTest(FibreModel.section(*rectangle(2)), loads, **CONSTANT, times=times))
    grown = 1.6  # p' = A s^n p^m with m = -0.6: p^(1 - m) = (1 - m) A s^n t

    np.testing.assert_allclose(found.recorded[:, 0], (grown * 1e-14 * 80.0**3 * times) ** (1 / grown), rtol=2e-4)
    assert np.abs(found.recorded[:, 1]).max() < 1e-10


def test_held_strains_relax_as_maxwell_and_as_the_point():
    """n = 1: sigma = E e exp(-A E t), so force and moment fall alike; n = 5 against the integrator of points."""
    y, areas = rectangle(4)
    times = np.geomspace(10, 1e6, 12)
    strain, nothing = np.stack([np.ones_like(y), -y]), np.zeros((y.size, 0))
    model = FibreModel(np.zeros_like(strain), strain, nothing, nothing.T, areas * strain)
    held = (Program.constant(2e-4), Program.constant(1e-4))

    def relaxed(law, theta):
        test = FibreTest(model, held, **CONSTANT, times=times, follows_stress=True)
        return integrate_fibres(law, theta, test, settings=IntegrationSettings(rtol=1e-7)).recorded

    lost = relaxed(*norton(1.0))
    gone = 1 - np.exp(-1e-8 / 60 * E * times)
    np.testing.assert_allclose(lost, gone[:, None] * [2e-4 * areas.sum(), 1e-4 * INERTIA], rtol=1e-5)

    law, theta = norton(5.0)
    total = 2e-4 - 1e-4 * y
    stiff = [PointTest(Program.constant(E * abs(e)), Program.constant(1000.0), times, stiffness=E) for e in total]
    points = integrate(law, theta[None], stiff, settings=IntegrationSettings(rtol=1e-8)).strain.reshape(y.size, -1)
    forces = (areas * np.sign(total)) @ points
    np.testing.assert_allclose(relaxed(law, theta)[:, 0], forces, rtol=1e-5)


def explicit(law_rate, model, moment_at, times, states=0):
    """The same fibres by an explicit method of scipy; law_rate(size of stress, path, t, states, sign) -> rates."""
    m = model.fibres

    def slope(t, unknowns):
        c, p, z = unknowns[:m], unknowns[m : 2 * m], unknowns[2 * m :].reshape(m, states)
        stress = E * (model.modes @ (model.projection @ c) - c) + moment_at(t) * model.stress[1]
        rate, state_rates = law_rate(np.abs(stress), p, t, z, np.sign(stress))
        return np.concatenate([np.sign(stress) * rate, rate, np.ravel(state_rates)])

    start = np.zeros(m * (2 + states))
    found = solve_ivp(slope, (0.0, times[-1]), start, "DOP853", times, rtol=1e-9, atol=1e-14, max_step=times[-1] / 200)
    return (model.observed @ found.y[:m]).T


@pytest.mark.parametrize("driver", [ck.stress, ck.principal_stress], ids=["by the stress", "by tension alone"])
def test_a_law_with_damage_against_an_explicit_integration(driver):
    """Damage by tension alone shifts the neutral axis, so the axis of the beam strains too."""
    values = {"A": 1e-8 / 60**3, "n": 3.0, "C": 3e-7 / 60**2, "v": 2.0}
    law, theta = of(kachanov(driver, 0.99), **values)
    model, times = FibreModel.section(*rectangle(4)), np.linspace(2e4, 6e5, 7)
    found = integrate_fibres(law, theta, bent(model, times), settings=IntegrationSettings(rtol=1e-7))

    def rates(stress, p, t, z, sign):
        damage = z[:, 0]
        driving = np.where(sign > 0, stress, 0.0) if driver == ck.principal_stress else stress
        growth = values["C"] * (driving / (1 - damage)) ** values["v"]
        return values["A"] * (stress / (1 - damage)) ** values["n"], growth

    np.testing.assert_allclose(
        found.recorded[:, 1], explicit(rates, model, lambda t: MOMENT, times, 1)[:, 1], rtol=1e-5
    )
    if driver == ck.principal_stress:
        axial = explicit(rates, model, lambda t: MOMENT, times, 1)[:, 0]
        assert axial[-1] > 0.01 * found.recorded[-1, 1] * HEIGHT / 2
        np.testing.assert_allclose(found.recorded[:, 0], axial, rtol=1e-4)


def test_load_steps_ramps_and_reversal_against_an_explicit_integration():
    """A ramp, a hold, a step down to the reverse moment: fibres change the direction in which they creep."""
    law, theta = norton(4.0)
    program = Program([0.0, 1e4, 2e5, 2e5, 5e5], [0.0, MOMENT, MOMENT, -0.8 * MOMENT, -0.8 * MOMENT])
    model, times = FibreModel.section(*rectangle(4)), np.array([5e3, 1e4, 1e5, 2e5, 2.1e5, 3e5, 5e5])
    found = integrate_fibres(law, theta, bent(model, times, program), settings=IntegrationSettings(rtol=1e-7))

    def slope(t, c, moment):
        stress = E * (model.modes @ (model.projection @ c) - c) + moment(t) * model.stress[1]
        return 1e-8 / 60**4 * np.abs(stress) ** 4 * np.sign(stress)

    how = dict(method="LSODA", rtol=1e-9, atol=1e-15)
    ramp = solve_ivp(slope, (0, 1e4), np.zeros(model.fibres), t_eval=times[:2], args=(program.at,), **how).y
    up = solve_ivp(slope, (1e4, 2e5), ramp[:, -1], t_eval=times[2:4], args=(lambda t: MOMENT,), **how).y
    down = solve_ivp(slope, (2e5, 5e5), up[:, -1], t_eval=times[4:], args=(lambda t: -0.8 * MOMENT,), **how).y
    exact = model.observed[1] @ np.concatenate([ramp, up, down], axis=1)

    np.testing.assert_allclose(found.recorded[:, 1], exact, rtol=1e-5)
    assert np.all(np.diff(exact[3:]) < 0)


def test_a_modulus_that_falls_with_temperature_against_an_explicit_integration():
    law, theta = norton(3.0)
    model, times = FibreModel.section(*rectangle(4)), np.array([1e5, 2e5, 3e5])
    modulus = Program([0.0, 3e5], [E, 0.6 * E])
    found = integrate_fibres(law, theta, bent(model, times, modulus=modulus), settings=IntegrationSettings(rtol=1e-7))
    m = model.fibres

    def slope(t, c):
        stress = modulus.at(t) * (model.modes @ (model.projection @ c) - c) + MOMENT * model.stress[1]
        return 1e-8 / 60**3 * np.abs(stress) ** 3 * np.sign(stress)

    exact = solve_ivp(slope, (0, 3e5), np.zeros(m), "LSODA", times, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(found.recorded[:, 1], (model.observed @ exact.y)[1], rtol=1e-5)


def test_a_threshold_leaves_the_middle_of_the_section_elastic():
    """Fibres below the threshold do not creep; the curvature comes to rest where elastic fibres can carry no more."""
    law, theta = of("threshold-stress", A=1e-12, n=3.0, s_0=70.0)
    model = FibreModel.section(*rectangle(10))
    test = bent(model.observing(np.eye(model.fibres)), np.geomspace(1e3, 1e10, 20))
    found = integrate_fibres(law, theta, test)
    stress = stresses(model, found.recorded)

    assert found.status is Status.COMPLETE
    assert np.abs(stress[-1]).max() == pytest.approx(70.0, abs=0.1)
    # plastic hinge of a rectangle: M = s b h^2/4 (1 - (c/h)^2/3), c the height that stays elastic
    left = np.sqrt(3 * (1 - MOMENT / (70.0 * WIDTH * HEIGHT**2 / 4)))
    crept = np.abs(found.recorded[-1]) > 1e-9
    places = np.abs(rectangle(10)[0])
    assert places[~crept].max() < left * HEIGHT / 2 < places[crept].min()


def test_sensitivities_are_the_derivatives_of_what_is_recorded():
    """Of a law with a state, to its parameters, the moment, the temperature and the modulus, by central differences."""
    law_record = kachanov(ck.principal_stress, 0.99).times(ck.arrhenius(T_ref=1000.0))
    values = {"A": 1e-8 / 60**3, "n": 3.0, "C": 3e-7 / 60**2, "v": 2.0, "Q": 3e5}
    values |= {name: 2e5 for name in law_record.names if name not in values}
    law, theta = of(law_record, **values)
    model, times = FibreModel.section(*rectangle(4)), np.geomspace(1e4, 5e5, 6)
    still = np.zeros_like(model.modes)
    more = FibreInput(np.stack([0 * model.stress[0], model.stress[1]]), 0 * model.strain, still, still.T)
    inputs = [more, FibreInput.uniform(model, temperature=1.0), FibreInput.uniform(model, modulus=1.0)]
    settings = IntegrationSettings(rtol=1e-9, max_steps=100_000)

    def recorded(theta=theta, load=1.0, T=1000.0, modulus=E):
        changed = {"temperature": Program.constant(T), "modulus": Program.constant(modulus)}
        test = bent(model, times, load * MOMENT, **changed)
        return integrate_fibres(law, theta, test, settings=settings).recorded

    exact = integrate_fibres(law, theta, bent(model, times), settings=settings, jacobian=True, inputs=inputs).jacobian
    columns = []
    for k in range(theta.size):
        size = 1e-4 * max(1.0, abs(theta[k]))
        step = size * np.eye(theta.size)[k]
        columns.append((recorded(theta + step) - recorded(theta - step)) / (2 * size))
    columns.append((recorded(load=1.0001) - recorded(load=0.9999)) / 2e-4)
    columns.append((recorded(T=1000.01) - recorded(T=999.99)) / 0.02)
    columns.append((recorded(modulus=1.0001 * E) - recorded(modulus=0.9999 * E)) / 2e-4)
    for k, column in enumerate(columns):
        np.testing.assert_allclose(exact[..., k], column, rtol=1e-4, atol=1e-5 * np.abs(column).max())


def test_the_first_fibre_at_a_limit_ends_the_test():
    law, theta = of(kachanov(ck.stress, 0.99), A=1e-8 / 60**3, n=3.0, C=3e-6 / 60**2, v=2.0)
    found = integrate_fibres(law, theta, bent(FibreModel.section(*rectangle(4)), np.linspace(1e4, 1e7, 50)))

    assert found.status is Status.RUPTURED
    assert found.reason == "an internal variable reached its limit"
    assert np.isfinite(found.recorded[:, 1]).sum() == (np.linspace(1e4, 1e7, 50) <= found.end_time).sum()

    short = IntegrationSettings(max_steps=5)
    stopped = integrate_fibres(*norton(5.0), bent(FibreModel.section(*rectangle(4)), [1e7]), settings=short)
    assert stopped.status is Status.NOT_CONVERGED
    assert stopped.reason == "the cap on steps was reached"
