"""Damage and strain against closed forms at constant stress, and the rule of life fractions when it steps."""

import numpy as np
import pytest
from creepkit_damage.kachanov_rabotnov import TYPICAL, damage
from scipy.integrate import quad

import creepkit as ck
from creepkit.records import Status, StressSteps

STRESS, LIFE = 120.0, 2e6
BAR = ck.specimen("uniaxial").replace(tolerance=1e-9, strain_limit=10.0, max_steps=100_000)
RATE = 1e-8

POWERS = {"A": RATE / STRESS**4, "n": 4.0, "B": 1 / (LIFE * STRESS**5), "alpha": 0.3}
KACHANOV = {**POWERS, "chi": 5.0, "phi": 6.0, "m": 0.0}
LIU = {**POWERS, "p": 5.0, "q_2": 3.0}
SINH = {
    **{"A": RATE / np.sinh(STRESS / 40), "s_s": 40.0, "lambda_": 2.0},
    **{"M": 1 / (LIFE * np.sinh(STRESS / 90) ** 3), "s_t": 90.0, "chi": 3.0, "phi": 4.0, "alpha": 0.3, "beta": 0.2},
}
VALUES = {"kachanov-rabotnov": KACHANOV, "liu-murakami": LIU, "sinh-damage": SINH}


def exponential(share: np.ndarray | float, growth: float) -> np.ndarray:
    """Damage of Liu-Murakami and of the sinh law at a share of the life: w = -ln(1 - (1 - exp(-q)) t/t_r)/q."""
    return -np.log1p(np.expm1(-growth) * share) / growth


DAMAGE = {
    "kachanov-rabotnov": lambda share: 1 - (1 - share) ** (1 / 7),
    "liu-murakami": lambda share: exponential(share, 3.0),
    "sinh-damage": lambda share: exponential(share, 4.0),
}


def state(name: str, share: np.ndarray) -> dict[str, np.ndarray]:
    """The internal variable at a share of the life, from its closed form."""
    return {"v": 1 - (1 - DAMAGE[name](share)) ** 7} if name == "kachanov-rabotnov" else {"w": DAMAGE[name](share)}


def growth_of(name: str, changes: dict[str, float] | None = None, **point: float | np.ndarray) -> np.ndarray:
    """dw/dt; of Kachanov and Rabotnov by the chain rule: w = 1 - (1-v)^(1/7)."""
    rates = ck.lower(ck.law(name), "numpy").state_rates(VALUES[name] | (changes or {}), **point)
    return rates["w"] if "w" in rates else rates["v"] * (1 - point.get("v", 0.0)) ** (-6 / 7) / 7


@pytest.mark.parametrize("name", VALUES)
def test_damage_grows_as_its_closed_form(name: str) -> None:
    """dw/dt of the kernel at w(t) is the derivative of w(t), at 50 shares of the life."""
    share = np.linspace(0.0, 0.98, 50)
    slope = (DAMAGE[name](share + 1e-6) - DAMAGE[name](share - 1e-6)) / 2e-6

    rate = growth_of(name, stress=STRESS, **state(name, share))

    np.testing.assert_allclose(rate * LIFE, slope, rtol=1e-6)


def test_kachanov_and_rabotnov_wrote_it_in_damage() -> None:
    """rate = A (s/(1-w))^n and dw/dt = B s_r^chi/((1+phi) (1-w)^phi), at any w."""
    w = np.linspace(0.0, 0.95, 20)
    v = 1 - (1 - w) ** 7
    rate = ck.lower(ck.law("kachanov-rabotnov"), "numpy").rate(KACHANOV, stress=STRESS, v=v)

    np.testing.assert_allclose(rate, RATE / (1 - w) ** 4, rtol=1e-6)
    np.testing.assert_allclose(damage(v, KACHANOV["phi"]), w, rtol=1e-6)
    grown = growth_of("kachanov-rabotnov", stress=STRESS, v=v)
    np.testing.assert_allclose(grown, 1 / (LIFE * 7 * (1 - w) ** 6), rtol=1e-6)


@pytest.mark.parametrize("name", VALUES)
def test_rupture_comes_when_the_damage_reaches_its_limit(name: str) -> None:
    """However steep the damage of Kachanov and Rabotnov: its life does not depend on phi."""
    times, loading = np.linspace(0.05, 1.2, 23) * LIFE, ck.constant_stress(STRESS, "stress")
    for phi in (2.0, 6.0, 30.0) if name == "kachanov-rabotnov" else (4.0,):
        values = VALUES[name] | ({"phi": phi, "n": 2.0, "A": RATE / STRESS**2} if "phi" in VALUES[name] else {})
        run = ck.simulate(name, BAR, {k: values[k] for k in VALUES[name]}, loading=loading, times=times)
        assert run.status is Status.RUPTURED
        assert run.end_time == pytest.approx(LIFE, rel=1e-6)
        assert (run.times == times[times < LIFE]).all()


@pytest.mark.parametrize("m", [0.0, -0.5])
def test_strain_of_kachanov_and_rabotnov(m: float) -> None:
    """With x = (t/t_r)^(1+m): e = A s^n/(B s^chi) (1+phi)/(1+phi-n) [1 - (1-x)^(1-n/(1+phi))]."""
    values = KACHANOV | {"m": m}
    life = ((1 + m) * LIFE) ** (1 / (1 + m))
    x = np.linspace(0.02, 0.999, 40)
    times = life * x ** (1 / (1 + m))
    run = ck.simulate("kachanov-rabotnov", BAR, values, loading=ck.constant_stress(STRESS, "stress"), times=times)

    np.testing.assert_allclose(run.outputs["strain"], RATE * LIFE * 7 / 3 * (1 - (1 - x) ** (3 / 7)), rtol=1e-6)


@pytest.mark.parametrize("name", ["liu-murakami", "sinh-damage"])
def test_strain_is_the_integral_over_the_damage(name: str) -> None:
    """e = r times the integral of exp(c w(t)^1.5), c = 2 (n+1)/(pi sqrt(1 + 3/n)) or lambda, by quadrature."""
    softening = {"liu-murakami": 10 / (np.pi * np.sqrt(1.75)), "sinh-damage": 2.0}[name]
    shares = np.array([0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99, 0.9999])
    exact = [quad(lambda x: np.exp(softening * DAMAGE[name](x) ** 1.5), 0, s, epsrel=1e-11)[0] for s in shares]
    run = ck.simulate(name, BAR, VALUES[name], loading=ck.constant_stress(STRESS, "stress"), times=LIFE * shares)

    np.testing.assert_allclose(run.outputs["strain"], RATE * LIFE * np.array(exact), rtol=1e-6)


@pytest.mark.parametrize("name", VALUES)
def test_shares_of_life_add_up_to_one(name: str) -> None:
    """Robinson's rule: each growth is a function of stress times one of damage."""
    higher = 1.25 * STRESS
    by_stress = {"sinh-damage": (np.sinh(higher / 90) / np.sinh(STRESS / 90)) ** 3}.get(name, 1.25**5)
    loading = StressSteps(((0.0, STRESS), (0.4 * LIFE, higher)), "stress")
    run = ck.simulate(name, BAR, VALUES[name], loading=loading, times=[1.0, LIFE])

    assert run.end_time == pytest.approx((0.4 + 0.6 / by_stress) * LIFE, rel=1e-6)


@pytest.mark.parametrize("name", VALUES)
def test_the_largest_principal_stress_counts_by_its_share(name: str) -> None:
    """Under shear s_1 = s/sqrt(3) and the mean is 0; under two equal tensions s_1 = s and the mean 2 s/3."""
    by_stress = {"sinh-damage": lambda s: np.sinh(s / 90) ** 3}.get(name, lambda s: s**5)
    beta = VALUES[name].get("beta", 0.0)
    in_shear = 0.3 / np.sqrt(3) + 1 - 0.3 - beta
    in_two = 0.3 + 2 * beta + 1 - 0.3 - beta

    for share, largest, mean in ((in_shear, 1 / np.sqrt(3), 0.0), (in_two, 1.0, 2 / 3)):
        point = dict(stress=STRESS, principal_stress=largest * STRESS, mean_stress=mean * STRESS)
        ratio = growth_of(name, **point) / growth_of(name, stress=STRESS)
        assert ratio == pytest.approx(by_stress(share * STRESS) / by_stress(STRESS), rel=1e-12)


@pytest.mark.parametrize("name", VALUES)
def test_compression_does_not_damage(name: str) -> None:
    shares = {"alpha": 1.0, "beta": 0.0} if name == "sinh-damage" else {"alpha": 1.0}
    squeezed = dict(stress=STRESS, principal_stress=-3 * STRESS, mean_stress=-3.4 * STRESS)

    assert 0 <= growth_of(name, shares, **squeezed) < 1e-80 / LIFE


def test_typical_values_say_what_they_claim() -> None:
    """Type 316 steel at 600 C and 240 MPa: rupture after 3200 h at 27 % strain."""
    run = ck.simulate(
        "kachanov-rabotnov", BAR, TYPICAL, loading=ck.constant_stress(240.0, "stress"), times=[3600.0, 4000 * 3600.0]
    )
    largest = (1 + TYPICAL["phi"]) / (1 + TYPICAL["phi"] - TYPICAL["n"])

    assert run.end_time / 3600 == pytest.approx(3200, rel=0.02)
    assert largest * TYPICAL["A"] * 240 ** TYPICAL["n"] * run.end_time == pytest.approx(0.27, abs=0.005)


# ---- temperature -----------------------------------------------------------------------------------------------------

# Damage over several temperatures: creep and damage keep activation energies of their own, through to rupture.


T_REF = 873.15
GAS_CONSTANT = 8.314462618  # J/(mol K)
LAW = ck.law("kachanov-rabotnov").fix(alpha=0, m=0).times(ck.arrhenius(T_ref=T_REF))
PLANTED = {"A": 1e-8 / 120**4, "n": 4.0, "B": 5e-7 / 120**5, "Q_B": 2.6e5, "chi": 5.0, "phi": 6.0, "Q": 3.6e5}
CONDITIONS = [(T, stress) for T in (848.15, 873.15, 898.15) for stress in (90.0, 120.0, 150.0)]
HOT_BAR = ck.specimen("uniaxial").replace(strain_limit=10.0)


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


def test_bars_break_when_the_closed_form_says_at_each_temperature() -> None:
    theta = LAW.to_internal({name: PLANTED[name] for name in LAW.names})
    lives = np.array([life(T, stress) for T, stress in CONDITIONS])
    plans = [
        ck.History(f"{T} {stress}", np.array([10 * life(T, stress)]), {}, ck.constant_stress(stress, "stress"), T)
        for T, stress in CONDITIONS
    ]
    ruptures = HOT_BAR.predict_to_rupture(LAW, theta, plans).times_to_strain.rupture_times[0]
    np.testing.assert_allclose(ruptures, lives, rtol=1e-4)


def test_both_activation_energies_are_identified_and_one_for_both_does_not_explain_the_tests() -> None:
    """100 kJ/mol apart over 50 K is a factor of 2.2 in the strain at rupture."""
    tests = measured(noise=5e-5)
    shared = ck.law("kachanov-rabotnov").fix(alpha=0, m=0).times(ck.arrhenius(T_ref=T_REF), shared=True)
    how = {"using": HOT_BAR, "starts": 2, "frames": 30, "usual_errors": "none"}  # loads and temperatures are exact
    fit, other = fits = [ck.identify(law, tests, **how) for law in (LAW, shared)]

    assert [e.name for e in fit.estimates if not e.low <= PLANTED[e.name] <= e.high] == []
    assert [fit.values[name] for name in ("Q_B", "Q")] == pytest.approx([PLANTED["Q_B"], PLANTED["Q"]], rel=0.02)
    assert ck.rank(fits).best.law.name == LAW.name
    assert other.rms > 5 * fit.rms


# ---- bulge rupture ---------------------------------------------------------------------------------------------------

# Damage laws in the dimple: finite elements with an internal variable, to rupture.


TIMES = np.geomspace(60.0, 1e6, 12)
PRESSED = dict(elastic=ck.Elastic(E=150e3), loading=ck.PressureJump(P1=8, P2=8, Tj=3600), times=TIMES)
DIMPLE_POWERS = {"A": 1e-14, "n": 4.0, "B": 1e-13, "alpha": 0.5}
DIMPLE_VALUES = {
    "kachanov-rabotnov": {**DIMPLE_POWERS, "chi": 4.0, "phi": 5.0, "m": 0.0},
    "liu-murakami": {**DIMPLE_POWERS, "p": 4.0, "q_2": 3.0},
    "sinh-damage": {
        **{"A": 1e-9, "s_s": 30.0, "lambda_": 5.0, "M": 1e-5, "s_t": 120.0, "chi": 3.0, "phi": 4.0},
        **{"alpha": 0.5, "beta": 0.0},
    },
}


@pytest.mark.parametrize("name", DIMPLE_VALUES)
def test_rupture_ends_the_test_with_its_reason(name: str) -> None:
    """The frames before it are kept; damage is not felt at first and only ever adds to the deflection."""
    law, values = ck.law(name), DIMPLE_VALUES[name]
    run = ck.simulate(law, "bulge", values, **PRESSED)
    sound = law.fix(**{"M" if name == "sinh-damage" else "B": 0})
    steady = ck.simulate(sound, "bulge", {name: values[name] for name in sound.names}, **PRESSED)

    assert run.status is Status.RUPTURED
    assert "internal variable" in run.reason
    assert "limit" in run.reason
    assert run.times[-1] <= run.end_time < steady.end_time
    more = run.outputs["amplitude"] / steady.outputs["amplitude"][: run.times.size]
    assert (run.times == TIMES[: run.times.size]).all()
    assert abs(more[0] - 1) < 0.01
    assert (np.diff(more) > -1e-5).all()
    assert more[-1] > 1.01
