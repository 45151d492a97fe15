"""Derivatives of the one-degree-of-freedom bulge: against central differences of the march itself."""

import numpy as np
import pytest
from creepkit_damage.kachanov_rabotnov import KACHANOV_RABOTNOV

from creepkit import kernels
from creepkit.language import Elastic, linear, symbols
from creepkit.laws.drifting_exponent import DRIFTING_EXPONENT
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.norton import NORTON
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.records import History, PressureJump, Program, RecordedLoading
from creepkit.specimens.bulge.reduced_order.step_equations import TRAJECTORY_COLUMNS
from creepkit.specimens.bulge.reduced_order.step_solution import NUISANCE_DIRECTIONS, FeatureFactors
from creepkit.specimens.bulge.reduced_order.trajectories import TrajectoryOptions, simulate_trajectories
from creepkit.specimens.bulge.specimen import Bulge

BULGE = Bulge(threads=1)
HOURS = 3600.0
FACTORS = FeatureFactors(np.array([0.6, 1.0, 1.6]), np.array([0.2, 1.0]))
STEPS = {"thickness": 1e-5, "modulus": 1e-4, "temperature": 1e-2}


def test(loading, **more):
    elastic = Elastic(1.5e5 - 50.0 * symbols.temperature)
    times = np.linspace(600, 4 * HOURS, 12)
    return History("planned", times, {}, loading, 1000.0, specimen="bulge", elastic=elastic, **more)


test.__test__ = False
JUMP = test(PressureJump(8.0, 10.0, 2 * HOURS), geometry={"apex_thickness": 0.53})
DOWN = test(
    RecordedLoading(Program(np.array([0.0, 600.0, 7200.0, 9000.0]), np.array([0.0, 9.0, 9.0, 6.0])), "pressure")
)
WARM = NORTON.with_temperature(n=linear(T_ref=1000.0, slope=(-0.01, 0.01)))

CASES = {
    "norton, warm": (WARM, {"A": 3e-15, "n": 3.5, "n_T": 0.004}),
    "strain hardening": (STRAIN_HARDENING, {"A": 3e-16, "n": 3.0, "m": -0.5}),
    "hyperbolic sine": (HYPERBOLIC_SINE, {"A": 3e-9, "n": 3.0, "B": 90.0}),
    "damage": (KACHANOV_RABOTNOV, {"A": 1e-13, "n": 3.5, "B": 1e-10, "chi": 3.0, "phi": 3.0, "alpha": 0.5, "m": -0.2}),
    "drifting": (
        DRIFTING_EXPONENT,
        {"A": 1e-14, "n_0": 3.8, "n_inf": 3.2, "C": 0.3, "tau_d": 3e3, "tau_r": 6e3, "m": -0.2},
    ),
}


def values_of(law, theta, history, **nuisances):
    assumed = {kind: np.array([[value]]) for kind, value in nuisances.items()}
    found = simulate_trajectories(
        BULGE, law, theta, [history], nuisances=assumed, options=TrajectoryOptions(factors=FACTORS, exact=True)
    )
    assert (found.status == 0).all()
    return found


@pytest.mark.parametrize("history", [JUMP, DOWN], ids=["jump", "unloading"])
@pytest.mark.parametrize("case", CASES)
def test_derivatives_are_those_of_the_march(case, history):
    law, values = CASES[case]
    compiled = kernels.lower(law, "numba")
    theta = law.to_internal(values)[0]
    found = values_of(compiled, theta, history).jacobian[0, 0]
    for p in range(theta.size):
        step = np.zeros(theta.size)
        step[p] = 1e-5 * max(1.0, abs(theta[p]) ** 0.5)
        _close(found[..., p], *(values_of(compiled, theta + s * step, history).values[0, 0] for s in (1, -1)), step[p])
    nominal = {"thickness": history.geometry.get("apex_thickness", 0.5), "modulus": 0.0, "temperature": 0.0}
    for e, kind in enumerate(NUISANCE_DIRECTIONS):
        both = (
            values_of(compiled, theta, history, **{kind: nominal[kind] + s * STEPS[kind]}).values[0, 0] for s in (1, -1)
        )
        _close(found[..., theta.size + e], *both, STEPS[kind])


def _close(found, above, below, step):
    expected = (above - below) / (2 * step)
    scale = np.abs(expected).max(axis=0) + 1e-7 * np.abs(above).max(axis=0) / step
    worst = (np.abs(found - expected) / (scale + 1e-6)).max(axis=0)
    names = [*TRAJECTORY_COLUMNS, *(f"feature {k}" for k in range(found.shape[1] - len(TRAJECTORY_COLUMNS)))]
    assert (worst < 2e-4).all(), {n: float(w) for n, w in zip(names, worst, strict=True) if w >= 2e-4}


def test_threads_do_the_same():
    law, values = CASES["strain hardening"]
    compiled = kernels.lower(law, "numba")
    theta = law.to_internal({**values, "n": np.linspace(2.5, 3.5, 7)})
    one, three = (
        simulate_trajectories(
            BULGE, compiled, theta, [JUMP, DOWN], options=TrajectoryOptions(factors=FACTORS, threads=n)
        )
        for n in (1, 3)
    )
    assert np.array_equal(one.values, three.values)


def test_features_of_a_power_law_are_its_exponents():
    """f ~ s^3 eps^-0.5: log10 of the rate changes by 3 log10(1.6), and by -0.5 log10(0.2)."""
    law, values = CASES["strain hardening"]
    compiled = kernels.lower(law, "numba")
    found = simulate_trajectories(
        BULGE, compiled, law.to_internal(values), [JUMP], options=TrajectoryOptions(factors=FACTORS)
    ).values[0, 0, 1:, len(TRAJECTORY_COLUMNS) :]
    expected = 3 * np.log10(FACTORS.stress) - 0.5 * np.log10(FACTORS.strain)[:, None]
    np.testing.assert_allclose(found, np.broadcast_to(expected.ravel(), found.shape), rtol=1e-3, atol=1e-9)
