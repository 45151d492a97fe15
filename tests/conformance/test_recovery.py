"""Every law that is installed is identified from its own simulation: intervals hold the values that were planted."""

from __future__ import annotations

import itertools

import numpy as np
from scipy.stats import binom

import creepkit as ck
from creepkit.language import CreepLaw, temperature
from creepkit.specimens.uniaxial import Uniaxial
from helpers.registered_laws import registered_laws

STRAIN, NOISE = 0.01, 2e-5
STRESSES = np.array([75.0, 90.0, 110.0, 130.0])
FINE = Uniaxial(tolerance=1e-8)
"""The tests are simulated with another discretisation than the one that identifies them."""

PLANTED = {
    "coble": {"Q": 2e5},
    "double-power": {"A_1": 6e5, "A_2": 6e-8},
    "hyperbolic-sine": {"A": 1e-10, "B": 60.0},
    "nabarro-herring": {"Q": 2.5e5},
    "sinh-damage": {"A": 1e-10, "s_s": 30.0, "M": 1e-9, "s_t": 80.0, "chi": 2.0},
    "threshold-stress": {"A": 1e-16, "s_0": 30.0, "n": 4.0},
    "time-hardening": {"A": 1e-16},
}
"""Values in the place of the middle of their bounds, with which a bar creeps in hours to years."""


def simulated(law: CreepLaw, values: dict[str, float], stress: float, T: float, times: np.ndarray) -> ck.Run:
    return ck.simulate(law, FINE, values, times=times, loading=ck.constant_stress(stress, "stress"), temperature=T)


def time_to_strain(law: CreepLaw, values: dict[str, float], stress: float, T: float) -> float:
    """The last of many times at which the strain is below 1 %, s."""
    scan = simulated(law, values, stress, T, np.geomspace(1.0, 1e12, 160))
    strain = scan.outputs["strain"]
    return scan.times[: strain.size][np.isfinite(strain) & (strain < STRAIN)].max(initial=0.0)


def planted_tests(law: CreepLaw, values: dict[str, float]) -> list[ck.History]:
    """Bars at four stresses, and two temperatures where the law knows them, where a creep test takes hours to years."""
    temperatures = (1000.0, 800.0, 1200.0, 600.0, 400.0) if law.uses(temperature) else (1000.0,)
    scale, T = next(
        (scale, T)
        for scale, T in itertools.product((1.0, 0.3, 3.0, 0.1), temperatures)
        if all(1e2 < time_to_strain(law, values, float(s), T) < 1e11 for s in scale * STRESSES[[0, -1]])
    )
    rng, tests = np.random.default_rng(38), []
    for stress, warmth in itertools.product(scale * STRESSES, (0.0, 0.02 * T) if law.uses(temperature) else (0.0,)):
        end = time_to_strain(law, values, stress, T + warmth)
        run = simulated(law, values, stress, T + warmth, np.geomspace(end / 300, end, 40))
        noisy = {"strain": run.outputs["strain"] + NOISE * rng.standard_normal(40)}
        name = f"{stress:g} MPa, {T + warmth:g} K"
        tests.append(run.replace(name=name, outputs=noisy, standard_deviation={"strain": NOISE}))
    return tests


def test_laws_are_found_in_their_own_simulations() -> None:
    """Intervals of 95 %: of all values together no more are missed than once in a hundred such tests."""
    missed, contradicted, count = [], [], 0
    for name, law in registered_laws().items():
        values = {**law.center(), **PLANTED.get(name, {})}
        fit = ck.identify(law, planted_tests(law, values), weights="likelihood", nuisances=[], starts=2, frames=40)
        count += len(fit.estimates)
        missed += [
            f"{name}: {e.name} = {values[e.name]:.4g} is not in [{e.low:.4g}, {e.high:.4g}]"
            for e in fit.estimates
            if not e.low <= values[e.name] <= e.high
        ]
        if not fit.adequacy.explains:
            contradicted.append(f"{name}: {fit.adequacy}")
    assert contradicted == []
    assert len(missed) <= binom.ppf(0.99, count, 0.05), missed
