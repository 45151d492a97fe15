"""Problems with closed forms: a predictor whose output is the ln of the creep rate, linear in ln A and in n."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import identify
from creepkit.inverse.noise_model import NoiseModel, OutputNoise
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.uncertainty.laplace_approximation import covariance_of_values
from creepkit.kernels import lower
from creepkit.language import CreepLaw
from creepkit.records import History, Nuisance, Prediction, Predictor, constant_stress
from helpers.planted_bars import carried_out

END = 1e5
"""s."""


class LogRates(Predictor):
    """Predictor: amplitude = ln(rate at the test's stress) + time / END, in mm, whatever that would be.

    nuisances : "thickness" adds its distance from `nominal` times `by`.
    """

    name = "log rates"
    outputs = ("amplitude",)

    def __init__(self, nominal: float = 0.5, by: float = 0.0) -> None:
        self.nominal, self.by = nominal, by
        self.nuisances = ("thickness",) if by else ()

    def reference_strain(self, history: History) -> float:
        """That of a rate of exp(-15) 1/s."""
        return float(np.exp(-15.0) * END)

    def predict_batch(self, law, theta, histories, nuisances, sensitivities):
        count, longest = len(theta), max(h.times.size for h in histories)
        kernel, found = lower(law, "numpy"), np.full((count, len(histories), longest, 1), np.nan)
        for k, h in enumerate(histories):
            s = h.loading.program().values[0]
            log = np.broadcast_to(kernel.internal_log_rate(s, 1.0, 1.0, h.temperature, s, s / 3, *theta.T), (count,))
            found[:, k, : h.times.size, 0] = log[:, None] + h.times / END
        found += self.by * (nuisances.get("thickness", np.full((1, 1), self.nominal)) - self.nominal)[..., None, None]
        ends, status = np.full(found.shape[:2], np.inf), np.zeros(found.shape[:2], np.int64)
        slopes = {"thickness": np.full(found.shape, self.by)} if sensitivities and nuisances else {}
        lengths = np.array([h.times.size for h in histories])
        return Prediction(found, self.outputs, lengths, status, ends, nuisance_jacobian=slopes)


def measured(
    law: CreepLaw, values: Mapping[str, float], stresses: Sequence[float], *, sd: float, seed: int = 0,
    frames: int = 10, using: LogRates | None = None,
) -> list[History]:  # fmt: skip
    """Tests at these stresses with white noise."""
    times = np.linspace(0.1, 1.0, frames) * END
    blank = [
        History(f"{k}: {s:g} MPa", times, {"amplitude": 0 * times}, constant_stress(s, "stress"), 1000.0)
        for k, s in enumerate(stresses)
    ]
    return carried_out(using or LogRates(), law, values, blank, noise=sd, seed=seed)


def known_scatter(
    law: CreepLaw, tests: Sequence[History], sd: float, *, using: LogRates | None = None,
    nuisances: tuple[Nuisance, ...] = (),
) -> Identification:  # fmt: skip
    """The identification of these tests with white noise of a known size and nothing else.

    Its covariance is that of least squares with the predictor's derivatives, taken by differences.
    """
    settings = IdentificationSettings(starts=2, sobol_points=8, nuisances=nuisances, usual_errors="none")
    fit = identify(law, tests, using or LogRates(), settings=settings)
    known = NoiseModel({"amplitude": OutputNoise(noise=sd)})
    assert fit.linearised is not None
    covariance = covariance_of_values(fit.linearised, known)[: fit.u.size, : fit.u.size]
    return replace(fit, noise_model=known, covariance=covariance, freedom=1e9)


def least_squares(tests: Sequence[History], sd: float) -> tuple[np.ndarray, np.ndarray]:
    """(ln A, n) of a power law by linear regression of ln rate on ln stress, and their covariance: textbook algebra."""
    rows = [(1.0, float(np.log(h.loading.program().values[0]))) for h in tests for _ in h.times]
    y = np.concatenate([h.outputs["amplitude"] - h.times / END for h in tests])
    X = np.array(rows)
    covariance = sd**2 * np.linalg.inv(X.T @ X)
    return covariance @ X.T @ y / sd**2, covariance
