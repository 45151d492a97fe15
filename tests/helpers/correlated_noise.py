"""Tests of two outputs whose noise is correlated in each frame, and what generalised least squares says of them."""

from __future__ import annotations

import numpy as np

from creepkit.laws.norton import NORTON
from creepkit.records import History
from helpers.steady_rate_predictor import planted
from helpers.two_outputs_predictor import GAIN, with_two_outputs

VALUES = {"A": 1e-15, "n": 4.0}
LAW = NORTON.fix(n=4.0)
NOISE = {"amplitude": 2e-2, "width": 1e-1}
BARS = planted(NORTON, VALUES, [(50.0, 1000.0), (80.0, 1000.0)], seed=0, frames=30)
PAIR = ("amplitude", "width")


def measured(rho: float, seed: int) -> list[History]:
    """Tests with correlated noise, which they state."""
    rng, tests = np.random.default_rng(seed), with_two_outputs(BARS, dict.fromkeys(NOISE, 0.0), seed=0)
    root = np.linalg.cholesky([[1.0, rho], [rho, 1.0]])
    made = []
    for test in tests:
        errors = root @ rng.standard_normal((2, test.times.size))
        outputs = {name: test.outputs[name] + NOISE[name] * errors[k] for k, name in enumerate(PAIR)}
        sd = {name: np.full(test.times.size, NOISE[name]) for name in PAIR}
        correlation = {PAIR: rho} if rho else {}
        made.append(test.replace(outputs=outputs, standard_deviation=sd, noise_correlation=correlation))
    return made


def least_squares(tests: list[History], rho: float) -> tuple[float, float]:
    """The factor on the planted rate, and its standard deviation, of linear generalised least squares.

    y = base + gain strain + e, e of two outputs in a frame with the covariance S: (x'S^-1 (y - base)) / (x'S^-1 x).
    """
    S = np.array([[NOISE[a] * NOISE[b] * (1.0 if a == b else rho) for b in PAIR] for a in PAIR])
    inverse, information, weighted = np.linalg.inv(S), 0.0, 0.0
    for test, bar in zip(tests, BARS, strict=True):
        x = np.stack([GAIN[name] * bar.outputs["strain"] for name in PAIR])
        y = np.stack([test.outputs[name] - base for name, base in zip(PAIR, (0.0, 3.0), strict=True)])
        information += float(np.einsum("if,ij,jf->", x, inverse, x))
        weighted += float(np.einsum("if,ij,jf->", x, inverse, y))
    return weighted / information, information**-0.5
