"""Young's moduli from the first frames of tests, and Wachtman's form through them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from creepkit.arrays import Floats
from creepkit.checked_arguments import checked
from creepkit.errors import FitError
from creepkit.inverse.identification import Identification
from creepkit.inverse.identify import identify
from creepkit.inverse.settings import IdentificationSettings
from creepkit.language import CreepLaw
from creepkit.language.elastic import Elastic, wachtman
from creepkit.presentation import Presentable
from creepkit.records import History, Nuisance, Predictor
from creepkit.registry import resolve_law
from creepkit.registry.arguments import resolve_predictors

FIRST_FRAMES = 15


MODULUS_BOUNDS = (-0.7, 2.0)
"""Bounds of a modulus, relative to what the history states."""


_T0_BOUNDS = (100.0, 3000.0)
"""K, bounds of T0: below, the form is a straight line in T; above, a constant over any test."""


@dataclass(frozen=True, eq=False)
class ModulusEstimates(Presentable, text="reports.temperature_law:modulus_estimates_text"):
    """What the first frames say of the modulus.

    names : of the tests. temperatures : (tests,) K; values, sd : (tests,) MPa.
    elastic : Wachtman's form through them, with the first history's Poisson's ratio, or None for fewer than three
        temperatures. fit : the identification that they come from; its law holds for these frames alone.
    """

    names: tuple[str, ...]
    temperatures: Floats
    values: Floats
    sd: Floats
    elastic: Elastic | None
    fit: Identification


@checked
def moduli(
    law: CreepLaw | str,
    histories: Sequence[History],
    using: Predictor | str | None = None,
    *,
    frames: int = FIRST_FRAMES,
    settings: IdentificationSettings | None = None,
) -> ModulusEstimates:
    """Identify Young's modulus of each bulge test from its first frames, and Wachtman's form through the moduli.

    law : the creep law, with its temperature; frames : used frames of each test, the paper's 15 by default.
    Every history states a modulus to begin from.
    `[h.replace(elastic=estimates.elastic) for h in histories]` then fixes the moduli.
    """
    histories = list(histories)
    predictor = resolve_predictors(using, histories)
    if isinstance(predictor, Mapping):
        raise FitError("moduli are identified from tests of one specimen; give those alone, and using= that one")
    without_modulus = [h.name for h in histories if h.elastic is None]
    if without_modulus:
        raise FitError(f"history '{without_modulus[0]}' states no modulus to begin from; set elastic=Elastic(E=...)")
    if frames < 3:
        raise FitError(f"frames is {frames}; at least 3 are needed to tell a modulus from creep")
    first_frames = [h.replace(used=h.used & (np.cumsum(h.used) <= frames)) for h in histories]
    modulus = Nuisance("modulus", sd=np.inf, bounds=MODULUS_BOUNDS)
    chosen = replace(settings or IdentificationSettings(starts=4), nuisances=(modulus,))
    fit = identify(resolve_law(law), first_frames, predictor, settings=chosen)
    estimates = {n.owner: n for n in fit.nuisances if n.kind == "modulus"}
    stated = np.array([float(h.elastic.at(h.mean_temperature).E) for h in histories if h.elastic is not None])
    values = stated * (1.0 + np.array([estimates[h.name].value for h in histories]))
    sd = stated * np.array([estimates[h.name].sd for h in histories])
    temperatures = np.array([h.mean_temperature for h in histories])
    first_elastic = histories[0].elastic
    poisson_ratio = first_elastic.at(float(temperatures[0])).nu if first_elastic is not None else 0.3
    elastic = (
        Elastic(wachtman(*fit_wachtman(temperatures, values, sd)), poisson_ratio)
        if np.unique(temperatures).size > 2
        else None
    )
    return ModulusEstimates(tuple(h.name for h in histories), temperatures, values, sd, elastic, fit)


def fit_wachtman(temperatures: Floats, values: Floats, sd: Floats) -> tuple[float, float, float]:
    """E0 MPa, b MPa/K and T0 K of Wachtman's form.

    temperatures : (tests,) K. values : (tests,) MPa, the moduli. sd : (tests,) MPa, their standard deviations.
    """
    weights = 1.0 / np.maximum(sd, 1e-3 * values)

    def linear(T0: float) -> tuple[Floats, Floats]:
        columns = np.stack([np.ones_like(temperatures), -temperatures * np.exp(-T0 / temperatures)], axis=1)
        coefficients, *_ = np.linalg.lstsq(columns * weights[:, None], values * weights, rcond=None)
        return np.asarray(coefficients, float), np.asarray((columns @ coefficients - values) * weights, float)

    start = np.log(np.clip(np.median(temperatures), *_T0_BOUNDS))
    result = least_squares(lambda x: linear(float(np.exp(x[0])))[1], [start], bounds=np.log(_T0_BOUNDS))
    T0 = float(np.exp(result.x[0]))
    E0, b = linear(T0)[0]
    return float(E0), float(b), T0
