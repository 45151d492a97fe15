"""Planted bars for the benchmark of forecasts: creep curves by closed forms, not by the specimen that identifies them.

With r = A s^n exp(-Q/R (1/T - 1/T_ref)) f, f the test's own factor on all rates, the curves are

- hardening, constant true stress, r e^m: e^(1-m) = (1 - m) r t; Norton's law has m = 0;
- Kachanov-Rabotnov, constant true stress: v = t / t_r, e = r t_r (1 - (1 - v)^(1-q)) / (1 - q), q = n / (1 + phi), with
  1 / t_r = B s^chi f g, g the test's own factor on the growth of damage;
- MPC Omega, constant load: e = -ln(1 - t / t_r) / (n + Omega), 1 / t_r = (n + Omega) r, Omega having the factor g.

Values are drawn for each campaign: at 50 MPa and T_ref = 1000 K a bar reaches a strain of 0.01 in 1e5 to 1e6 s; n 3 to
6, Q 250 to 400 kJ/mol, m -0.6 to -0.2; q 0.5 to 0.8, chi 0.8 to 0.95 n, a strain of 0.02 to 0.2 at rupture, which is
twice as late; Omega 20 to 60.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

import creepkit as ck
from creepkit.records import History, constant_stress

GAS_CONSTANT = 8.314462618
T_REF = 1000.0
"""K."""
STRESS = 50.0
"""MPa, of the drawn values."""
NOISE = 5e-5
"""Standard deviation of a strain."""
OFFSET = 1e-4
"""Standard deviation of the loading strain of a test."""
HARDENING, KACHANOV, OMEGA = "strain-hardening", "kachanov-rabotnov", "mpc-omega"
CONTROL = {HARDENING: "stress", "norton": "stress", KACHANOV: "stress", OMEGA: "load"}
LIFE_FRACTIONS = np.concatenate([np.geomspace(3e-3, 0.3, 14), 1 - np.geomspace(0.6, 3e-3, 22)])
"""Times of frames over the time to rupture."""
END_STRAIN = 0.03
"""That a hardening bar without scatter reaches at the end of its test."""
CONDITIONS = ((40, 1000), (70, 1000), (50, 1030), (55, 970), (70, 970), (40, 1030))
"""MPa, K; repeated from the first one where there are more tests."""
ISOTHERMAL = ((40, 1000), (70, 1000), (50, 1000), (60, 1000))


@dataclass(frozen=True)
class Alloy:
    """A planted law: its name in the catalogue, and its values."""

    name: str
    values: Mapping[str, float]

    @property
    def law(self) -> ck.CreepLaw:
        """The law that is identified."""
        law = ck.law(self.name)
        if self.name == KACHANOV:
            return law.fix(alpha=0, m=0)
        if self.name == OMEGA:
            law = law.fix(c=0)
        return law.times(ck.arrhenius(T_ref=T_REF))

    def rate(self, stress: float, temperature: float) -> float:
        """r of a bar without scatter, 1/s."""
        v = self.values
        activation = v.get("Q", 0.0) / GAS_CONSTANT * (1.0 / temperature - 1.0 / T_REF)
        return v["A"] * stress ** v["n"] * np.exp(-activation)

    def life(self, stress: float, temperature: float, damage: float = 1.0) -> float:
        """Time to rupture of a bar without scatter of its rate, s; infinite for hardening."""
        v = self.values
        if self.name == KACHANOV:
            return 1.0 / (v["B"] * stress ** v["chi"] * damage)
        if self.name == OMEGA:
            return 1.0 / ((v["n"] + v["Omega"] * damage) * self.rate(stress, temperature))
        return np.inf

    def strain(self, times: np.ndarray, stress: float, temperature: float, damage: float = 1.0) -> np.ndarray:
        """Of a bar without scatter of its rate, before its rupture."""
        v, rate = self.values, self.rate(stress, temperature)
        if self.name == KACHANOV:
            life, q = self.life(stress, temperature, damage), v["n"] / (1 + v["phi"])
            return rate * life * (1 - (1 - times / life) ** (1 - q)) / (1 - q)
        if self.name == OMEGA:
            return -np.log1p(-times / self.life(stress, temperature, damage)) / (v["n"] + v["Omega"] * damage)
        m = v.get("m", 0.0)
        return ((1 - m) * rate * times) ** (1 / (1 - m))

    def time_to(self, strain: np.ndarray, stress: float, temperature: float, damage: np.ndarray | float = 1.0):
        """s, when a bar without scatter of its rate reaches strains; its rupture where that comes before."""
        v, rate = self.values, self.rate(stress, temperature)
        if self.name == KACHANOV:
            life, q = self.life(stress, temperature, damage), v["n"] / (1 + v["phi"])
            return life * (1 - np.maximum(1 - strain * (1 - q) / (rate * life), 0.0) ** (1 / (1 - q)))
        if self.name == OMEGA:
            life = self.life(stress, temperature, damage)
            return -life * np.expm1(-(v["n"] + v["Omega"] * damage) * strain)
        m = v.get("m", 0.0)
        return strain ** (1 - m) / ((1 - m) * rate)


def drawn_alloy(name: str, rng: np.random.Generator) -> Alloy:
    """Values of a law, see above."""
    time, n, Q = 10 ** rng.uniform(5, 6), rng.uniform(3, 6), rng.uniform(250e3, 400e3)
    if name == KACHANOV:
        q, chi = rng.uniform(0.5, 0.8), n * rng.uniform(0.8, 0.95)
        life = 2.0 * time
        rate = rng.uniform(0.01, 0.04) / life
        return Alloy(
            name, {"A": rate / STRESS**n, "n": n, "B": 1.0 / (life * STRESS**chi), "chi": chi, "phi": n / q - 1}
        )
    if name == OMEGA:
        return Alloy(name, {"A": 0.01 / time / STRESS**n, "n": n, "Omega": rng.uniform(20, 60), "Q": Q})
    m = rng.uniform(-0.6, -0.2) if name == HARDENING else 0.0
    values = {"A": 0.01 ** (1 - m) / (1 - m) / time / STRESS**n, "n": n, "Q": Q}
    return Alloy(name, {**values, "m": m} if name == HARDENING else values)


@dataclass(frozen=True)
class Factors:
    """ln of a test's own factors: on all its rates, and on the growth of its damage."""

    rate: float
    damage: float = 0.0


def planted_bar(
    name: str,
    alloy: Alloy,
    condition: tuple[float, float],
    factors: Factors,
    rng: np.random.Generator,
    *,
    states_noise: bool = True,
    stopped: bool = False,
    labels: Mapping[str, str] | None = None,
) -> History:
    """One measured bar; stopped : at half its life, or else followed to rupture where its law has one."""
    stress, temperature = map(float, condition)
    damage, faster = float(np.exp(factors.damage)), float(np.exp(factors.rate))
    end = {}
    if np.isfinite(life := alloy.life(stress, temperature, damage)):
        fractions = LIFE_FRACTIONS[LIFE_FRACTIONS < 0.5] if stopped else LIFE_FRACTIONS
        own_times = life * fractions  # on a clock that runs faster by the factor on its rates
        end = {"unruptured": True} if stopped else {"rupture_time": life / faster}
    else:
        duration = float(alloy.time_to(np.array(END_STRAIN), stress, temperature))
        own_times = np.geomspace(1e-3, 1.0, 40) * duration * faster
    strain = alloy.strain(own_times, stress, temperature, damage)
    strain = strain + OFFSET * rng.standard_normal() + NOISE * rng.standard_normal(strain.size)
    return History(
        name,
        own_times / faster,
        {"strain": strain},
        constant_stress(stress, CONTROL[alloy.name]),
        temperature,
        standard_deviation={"strain": np.full(strain.size, NOISE)} if states_noise else {},
        labels=dict(labels or {}),
        **end,
    )


def oracle_half_width(
    alloy: Alloy,
    condition: tuple[float, float],
    draw_factors,
    target: float | None,
    rng: np.random.Generator,
    draws: int = 4000,
) -> float:
    """Half width of the 95 % interval of ln time to a strain (None: to rupture) where law and scatter are known.

    draw_factors : of (draws, rng), ln factors (draws,) on rate and damage.
    """
    rate, damage = draw_factors(draws, rng)
    stress, temperature = map(float, condition)
    if target is None:
        times = alloy.life(stress, temperature, np.exp(damage)) * np.ones(draws)
    else:
        measured = np.maximum(target - OFFSET * rng.standard_normal(draws), 0.1 * target)
        times = alloy.time_to(measured, stress, temperature, np.exp(damage))
    low, high = np.quantile(np.log(times) - rate, [0.025, 0.975])
    return float(0.5 * (high - low))
