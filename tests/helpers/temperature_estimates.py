"""Estimates at single temperatures with known covariances, planted without any test."""

import numpy as np

from creepkit.discovery.regression import IsothermalEstimates
from creepkit.inverse.reference_conditions import ReferencePoint
from creepkit.language import GAS_CONSTANT, CreepLaw
from creepkit.laws.norton import NORTON

T_REF = 1033.15
STRESS = 100.0
NINE = np.linspace(973.15, 1083.15, 9)


def conditioned(sd_rate: float, sd_n: float, stress: float = STRESS) -> np.ndarray:
    """Covariance of (ln A, n) where ln of the rate at `stress` and n are independent."""
    to_theta = np.array([[1.0, -np.log(stress)], [0.0, 1.0]])
    return to_theta @ np.diag([sd_rate**2, sd_n**2]) @ to_theta.T


def arrhenius_line(T: np.ndarray, ln_A: float, Q: float) -> np.ndarray:
    """ln A with an activation energy, J/mol, about T_REF."""
    return ln_A - Q / GAS_CONSTANT * (1.0 / T - 1.0 / T_REF)


def points(
    theta: np.ndarray, covariance: np.ndarray, T: np.ndarray = NINE, seed: int | None = None, law: CreepLaw = NORTON
) -> IsothermalEstimates:
    """Points about theta (temperatures, parameters); scattered by their covariance when there is a seed."""
    every = np.broadcast_to(covariance, (T.size, *covariance.shape[-2:]))
    if seed is not None:
        rng = np.random.default_rng(seed)
        theta = theta + np.stack([np.linalg.cholesky(c) @ rng.normal(size=c.shape[0]) for c in every])
    reference = ReferencePoint(STRESS, 0.01, 7200.0, T_REF)
    return IsothermalEstimates(law, T, theta, every, reference, {"temperature": (float(T.min()), float(T.max()))})
