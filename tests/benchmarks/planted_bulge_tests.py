"""Planted bulge tests for the benchmarks of identification: laws, values and noise drawn by fixed seeds and priors.

Tests are simulated on another discretisation than those that identify: FINE has a mesh of a third of the element size
(450 elements instead of 50) and a thirtieth of the time-step tolerance.

Priors of the single laws, at 120 MPa: log10 of the rate at a strain of 0.01 and 1e4 s uniform in -7.3 to -5.7; exponent
n of Norton's law 1.5 to 7, of the hardening laws 2 to 6; m -0.7 to -0.2; local exponent of sinh 4 to 8 with n 1 to 4.
Modulus 150 GPa with 10 % (one value a specimen, fitted with that prior). Tests end at 12 h, 48 frames of 900 s. A draw
whose dimple does not grow by 20 um, or bursts, is drawn again: it is not informative.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

import creepkit as ck
from creepkit.errors import CreepkitError
from creepkit.records import History

TIMES = np.arange(1, 49) * 900.0
SIGMA = 120.0
NOISE = {"amplitude": 1.5e-3, "width": 0.02, "shape": 0.02}
SINGLE = ("hyperbolic-sine", "norton", "strain-hardening", "time-hardening")
NOMINAL = 0.5
"""mm, apex thickness."""
MODULUS = ck.Nuisance("modulus", sd=0.1, scope="all")
LEAST_GROWTH = 0.02
"""mm, of the amplitude over a test."""
JUMP = ck.PressureJump(P1=8, P2=10, Tj=14400)
FINE = {"refinement": 3.0, "tolerance": 3e-4}
"""Of the specimen that makes the tests."""
ACTIVATION_ENERGY = 400e3
"""J/mol, of laws in a furnace that drifts; tests are at 1073.15 K."""
TEST_TEMPERATURE = 1073.15


@dataclass(frozen=True)
class Design:
    """How specimens of a design are tested and fitted.

    thicknesses : (dimples,) mm, nominal; spread : relative standard deviation of what they really are.
    loadings : one a dimple, or one for all. correlated : AR(1) noise (coefficient, sd in mm) of D_amp.
    What the fit is not told: drift : K over the test. thickness_error : relative, its sign drawn. offset : mm, added to
    D_amp, its sign drawn. rate : standard deviation of ln of a factor of each dimple on its creep rate.
    """

    title: str
    thicknesses: tuple[float, ...] = (NOMINAL,)
    loadings: tuple = (JUMP,)
    spread: float = 0.0
    correlated: tuple[float, float] | None = None
    drift: float = 0.0
    thickness_error: float = 0.0
    offset: float = 0.0
    rate: float = 0.0

    @property
    def nuisances(self):
        """Nuisance parameters of a fit."""
        if not self.spread:
            return [MODULUS]
        return [MODULUS, ck.Nuisance("thickness", sd=self.spread * NOMINAL)]


DESIGNS = {
    "jump": Design("pressure of 8, then 10 MPa; D_amp, S_d, S_p"),
    "thickness": Design("pressure of 8, then 10 MPa; D_amp, S_d, S_p; apex thickness unknown by 2 %", spread=0.02),
    "correlated": Design(
        "pressure of 8, then 10 MPa; D_amp, S_d, S_p; apex thickness unknown by 2 %; AR(1) noise of D_amp (0.9, 5 um)",
        spread=0.02,
        correlated=(0.9, 5e-3),
    ),
    "noise": Design(
        "pressure of 8, then 10 MPa; D_amp, S_d, S_p; AR(1) noise of D_amp (0.9, 5 um)", correlated=(0.9, 5e-3)
    ),
    "dimples": Design(
        "dimples of 0.44, 0.50, 0.58 mm under 8, then 10 MPa, thickness unknown by 1 %",
        thicknesses=(0.44, 0.50, 0.58),
        spread=0.01,
    ),
    "levels": Design("dimples of 0.44, 0.50, 0.58 mm under 8, then 10 MPa", thicknesses=(0.44, 0.50, 0.58)),
    "drift": Design("furnace drifts by 5 K over the test, unknown to the fit", drift=5.0),
    "thickness-error": Design("apex thickness off by 2 %, unknown to the fit", thickness_error=0.02),
    "offset": Design("D_amp off by 5 um, unknown to the fit", offset=5e-3),
}


@dataclass(frozen=True)
class Specimen:
    """One planted alloy: its law, true values and modulus (MPa), and its measured tests."""

    name: str
    law: ck.CreepLaw
    values: dict
    tests: list
    modulus: float


def drawn_values(name, rng):
    """Values of a single law from the priors above."""
    rate = 10.0 ** rng.uniform(-7.3, -5.7)
    if name == "norton":
        n = rng.uniform(1.5, 7.0)
        return {"A": rate / SIGMA**n, "n": n}
    if name == "hyperbolic-sine":
        n, local = rng.uniform(1.0, 4.0), rng.uniform(4.0, 8.0)
        local = max(local, 1.05 * n)
        x = brentq(lambda x: n * x / np.tanh(x) - local, 1e-3, 60.0)
        return {"A": rate / np.sinh(x) ** n, "n": n, "B": SIGMA / x}
    n, m = rng.uniform(2.0, 6.0), rng.uniform(-0.7, -0.2)
    hardened = 0.01**m if name == "strain-hardening" else 1e4**m
    return {"A": rate / (SIGMA**n * hardened), "n": n, "m": m}


def drawn_other(name, rng):
    """A law and its values that is not among the candidates, nor among their sums; or sinh at the bound of its n."""
    if name == "sinh with n = 1":
        local = rng.uniform(4.0, 8.0)
        x = brentq(lambda x: x / np.tanh(x) - local, 1e-3, 60.0)
        rate = 10.0 ** rng.uniform(-7.3, -5.7)
        return ck.law("hyperbolic-sine"), {"A": rate / np.sinh(x), "n": 1.0, "B": SIGMA / x}
    if name == "threshold sinh":
        values, threshold = drawn_values("hyperbolic-sine", rng), rng.uniform(20.0, 60.0)
        x = np.arcsinh((values["A"] * np.sinh(SIGMA / values["B"]) ** values["n"] / values["A"]) ** (1 / values["n"]))
        B = (SIGMA - threshold) / x
        return THRESHOLD_SINH, {"A": values["A"], "n": values["n"], "B": B, "s_0": threshold}
    if name == "softening":
        values, strain = drawn_values("norton", rng), rng.uniform(0.005, 0.02)
        return SOFTENING, {**values, "e_s": strain}
    law, n_0 = ck.law("drifting-exponent").fix(m=0.0), rng.uniform(3.0, 5.0)
    n_inf = n_0 + rng.uniform(-0.4, 0.4)
    tau_d, tau_r = rng.uniform(2000.0, 12000.0, 2)
    rate = 10.0 ** rng.uniform(-7.3, -5.7)
    values = {"A": rate / SIGMA**n_inf, "n_0": n_0, "n_inf": n_inf, "C": rng.uniform(0.3, 1.5)}
    return law, {**values, "tau_d": tau_d, "tau_r": tau_r}


def _outside_laws():
    A, n, B, s_0, e_s = ck.parameters("A n B s_0 e_s")
    import sympy

    coefficient = ck.Param("rate coefficient", unit="1/s", bounds=(1e-60, 1e5), scale="log")
    exponent = ck.Param("exponent", bounds=(0.5, 12))
    threshold_sinh = ck.CreepLaw(
        name="threshold sinh",
        title="Hyperbolic sine above a threshold",
        terms={"sinh": A * sympy.sinh(sympy.Max(ck.stress - s_0, 0) / B) ** n},
        params={
            A: coefficient,
            n: exponent,
            B: ck.Param("stress", unit="MPa", bounds=(1, 1000)),
            s_0: ck.Param("threshold", unit="MPa", bounds=(0, 200)),
        },
        references=["planted"],
    )
    softening = ck.CreepLaw(
        name="softening",
        title="Norton's law that softens with strain",
        terms={"power law": A * ck.stress**n * (1 + ck.strain / e_s)},
        params={A: coefficient, n: exponent, e_s: ck.Param("strain", unit="1", bounds=(1e-4, 1.0))},
        references=["planted"],
    )
    return threshold_sinh, softening


THRESHOLD_SINH, SOFTENING = _outside_laws()
OTHERS = ("threshold sinh", "softening", "n(t)", "sinh with n = 1")


def drawn_sum(names, rng):
    """A sum of two laws whose terms each carry 30 to 70 % of the rate at 120 MPa, a strain of 0.01 and 1e4 s."""
    fraction = rng.uniform(0.3, 0.7)
    total = ck.law(names[0]) + ck.law(names[1])
    parts = [drawn_values(name, rng) for name in names]
    level = parts[0]["A"] * _rate(names[0], parts[0])
    rates = fraction * level, (1.0 - fraction) * level
    scaled = [{**p, "A": rate / _rate(n, p)} for n, p, rate in zip(names, parts, rates, strict=True)]
    flat = [value for part, name in zip(scaled, names, strict=True) for value in _ordered(name, part)]
    return total, dict(zip(total.names, flat, strict=True))


def _ordered(name, part):
    return [part[key] for key in ck.law(name).names]


def _rate(name, v):
    """The rate over A at the reference."""
    if name == "hyperbolic-sine":
        return np.sinh(SIGMA / v["B"]) ** v["n"]
    hardened = {"norton": 1.0, "strain-hardening": 0.01 ** v.get("m", 0), "time-hardening": 1e4 ** v.get("m", 0)}[name]
    return SIGMA ** v["n"] * hardened


def specimen(k, names, design, using, seed=2026):
    """Planted specimen number k of a design: its law is names[k % len(names)]."""
    name = names[k % len(names)]
    rng = np.random.default_rng([seed, k, len(design.thicknesses)])
    for _ in range(100):
        if isinstance(name, tuple):
            law, values = drawn_sum(name, rng)
        else:
            law, values = drawn_other(name, rng) if name in OTHERS else (ck.law(name), drawn_values(name, rng))
        modulus = 150e3 * (1.0 + 0.1 * np.clip(rng.standard_normal(), -3, 3))
        try:
            law.values(values)
        except CreepkitError:
            continue
        alloy = law, values, ck.Elastic(E=modulus)
        tests = [planted_test(alloy, j, design, using, rng) for j in range(len(design.thicknesses))]
        if all(t is not None for t in tests):
            return Specimen(f"{law.name} {k}", law, values, tests, modulus)
    raise SystemExit(f"no specimen of {name} in 100 draws")


def planted_test(alloy, number, design, using, rng):
    """One noisy history, or None where the dimple hardly moves or bursts; alloy : law, values and elastic data."""
    law, values, elastic = alloy
    nominal = design.thicknesses[number]
    error = design.spread * rng.standard_normal() + design.thickness_error * rng.choice((-1.0, 1.0))
    dimple = using.replace(apex_thickness=nominal * (1.0 + error), **FINE)
    loading = design.loadings[number % len(design.loadings)]
    temperature = 293.15
    if design.rate:
        values = {**values, "A": values["A"] * np.exp(design.rate * rng.standard_normal())}
    if design.drift:
        law = law.times(ck.arrhenius(T_ref=TEST_TEMPERATURE))
        values = {**values, "Q": ACTIVATION_ENERGY}
        change = design.drift * rng.choice((-1.0, 1.0))
        temperature = ck.Program([0.0, TIMES[-1]], [TEST_TEMPERATURE, TEST_TEMPERATURE + change])
    run = ck.simulate(law, dimple, values, elastic=elastic, loading=loading, times=TIMES, temperature=temperature)
    amplitude = run.outputs["amplitude"]
    noises = {name: sd * rng.standard_normal(TIMES.size) for name, sd in NOISE.items()}
    standard_deviations = dict(NOISE)
    if design.correlated:
        noises["amplitude"] = ar1(rng, *design.correlated)
        standard_deviations["amplitude"] = design.correlated[1]
    noises["amplitude"] += design.offset * rng.choice((-1.0, 1.0))
    complete = amplitude.size == TIMES.size and np.isfinite(amplitude).all() and run.status == 0
    if not complete or np.ptp(amplitude) < LEAST_GROWTH:
        return None
    return History(
        name=f"dimple {number}",
        times=TIMES,
        outputs={name: run.outputs[name] + noises[name] for name in NOISE},
        loading=loading,
        temperature=293.15,
        specimen="bulge",
        elastic=ck.Elastic(E=150e3),
        geometry={"apex_thickness": nominal},
        standard_deviation={name: np.full(TIMES.size, sd) for name, sd in standard_deviations.items()},
    )


def ar1(rng, coefficient, sd):
    """Stationary AR(1) noise."""
    white = rng.standard_normal(TIMES.size) * sd * np.sqrt(1.0 - coefficient**2)
    white[0] *= 1.0 / np.sqrt(1.0 - coefficient**2)
    for k in range(1, TIMES.size):
        white[k] += coefficient * white[k - 1]
    return white
