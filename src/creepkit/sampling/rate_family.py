"""The rate family: a sampling domain of diverse rate functions, to train surrogates that take creep rates as input.

One to three terms A stress^n strain^m time^k exp(-q time). It contains neither sinh nor n(t), so that the named laws
remain unseen in training.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import sympy

from creepkit.arrays import Bools, Floats
from creepkit.language import CreepLaw, Param, parameters, strain, stress, time
from creepkit.records import Specimen
from creepkit.sampling.conditions import (
    BULGE,
    PAPER_RANGES,
    RELATIVE_TIMES,
    ConditionRange,
    TimeGrid,
    condition_ranges,
    test_kind,
)
from creepkit.sampling.criteria import conditioned_criteria
from creepkit.sampling.domains import ConditionedDomain, uniform_in_bounds
from creepkit.sampling.rates import RateEvaluationPoints, reference_stress_of
from creepkit.specimens.bulge.specimen import Bulge

LARGEST_STRESS_EXPONENTS = (14.0, 14.0, 8.0)
"""Largest stress exponent of each term: two steep ones and a milder one."""


FAMILY_TERM_COUNT_PROBABILITIES = (0.25, 0.45, 0.3)
"""Fractions of rows with one, two and three terms: from one term a network learns little."""


STRAIN_EXPONENTS, TIME_EXPONENTS = (-0.7, 0.5), (-0.7, 2.0)
"""Bounds of the exponents: decay and rise."""


STRAIN_EXPONENT_FRACTIONS, TIME_EXPONENT_FRACTIONS = (0.5, 0.4), (0.4, 0.3)
"""Fractions of the exponents that are 0, and below it; the rest are above."""


DECAYING_FRACTION, DECAY_TIME_FRACTIONS = 0.35, (0.03, 1.0)
"""Fraction of the terms that decay, and their time scales as fractions of the end of the test, uniform in the log."""


THICKNESS_FACTORS = (0.88, 1.2)
"""Bounds of the apex thickness over the specimen's own: 0.44 to 0.60 mm of the paper's dimple."""


END_TIME_RANGE, JUMP_FRACTIONS = (1200.0, 86400.0), (0.15, 0.85)
"""s, from 20 min to 24 h; fractions of the end at which the load jumps."""


def _law() -> CreepLaw:
    terms, params = {}, {}
    for number, largest_exponent in enumerate(LARGEST_STRESS_EXPONENTS, start=1):
        A, n, m, k, q = parameters(" ".join(f"{letter}_{number}" for letter in "Anmkq"))
        terms[f"slope {number}"] = A * stress**n * strain**m * time**k * sympy.exp(-q * time)
        params[A] = Param("rate coefficient", unit="1/s", bounds=(1e-60, 1e2), scale="log", off=0.0)
        params[n] = Param("stress exponent", bounds=(1.0, largest_exponent))
        params[m] = Param("strain exponent", bounds=STRAIN_EXPONENTS, off=0.0)
        params[k] = Param("time exponent", bounds=TIME_EXPONENTS, off=0.0)
        params[q] = Param("rate of fading", unit="1/s", bounds=(0.0, 1.0), off=0.0)
    return CreepLaw("rate-family", terms, params, title="Three power laws of stress, strain and time that may fade")


RATE_FAMILY_LAW = _law()


PARAMETERS_PER_TERM = len(RATE_FAMILY_LAW.params) // len(LARGEST_STRESS_EXPONENTS)


@dataclass(frozen=True)
class RateFamilyDomain(ConditionedDomain):
    """Rate functions with their mean rate over the test drawn."""

    name: ClassVar[str] = "rate-family"

    def shape_parameters(self, unit_coordinates: Floats, active: Bools, points: RateEvaluationPoints) -> Floats:
        """Internal values, (rows, parameters), before coefficients: n uniform; m, k and q may be off.

        unit_coordinates : (rows, parameters) from 0 to 1. active : (rows, terms) which terms a law has.
        A term that is alone does not rise with strain: it would have no strain to begin with.
        """
        theta = uniform_in_bounds(self.law, unit_coordinates)
        single_term = active.sum(axis=1) == 1
        for first in range(0, theta.shape[1], PARAMETERS_PER_TERM):
            m, k, q = first + 2, first + 3, first + 4
            theta[:, m] = _exponents_of_either_sign(unit_coordinates[:, m], STRAIN_EXPONENTS, STRAIN_EXPONENT_FRACTIONS)
            theta[:, k] = _exponents_of_either_sign(unit_coordinates[:, k], TIME_EXPONENTS, TIME_EXPONENT_FRACTIONS)
            theta[:, q] = _decay_rates(unit_coordinates[:, q], points.end_times)
            theta[single_term, m] = -np.abs(theta[single_term, m])
        return theta


def rate_family(specimen: Specimen | None = None, *, grid: TimeGrid | None = None, **ranges: Any) -> RateFamilyDomain:
    """Return the rate family for a specimen, by default the paper's dimple, whose apex thickness is drawn too.

    grid : other times than fractions of the end (see conditions.RELATIVE_TIMES). ranges : other ranges of conditions,
        as sampling_design() takes them.
    """
    specimen = specimen or Bulge()
    kind = test_kind(specimen)
    grid = grid or TimeGrid(np.array(RELATIVE_TIMES), relative=True)
    reference = reference_stress_of(specimen)
    defaults: dict[str, Any] = {
        "end_time": ConditionRange(*END_TIME_RANGE, scale="log"),
        "Tj": ConditionRange(*JUMP_FRACTIONS, fraction_of="end_time"),
    }
    if kind == BULGE:
        defaults["apex_thickness"] = tuple(factor * reference.thickness for factor in THICKNESS_FACTORS)
    condition_space = condition_ranges(kind, grid, ranges, {**PAPER_RANGES[kind], **defaults}, needs_temperature=False)
    return RateFamilyDomain(
        RATE_FAMILY_LAW,
        condition_space,
        grid,
        conditioned_criteria(RATE_FAMILY_LAW, kind, condition_space.end),
        reference,
        FAMILY_TERM_COUNT_PROBABILITIES,
    )


def _exponents_of_either_sign(
    unit_coordinates: Floats, exponent_range: tuple[float, float], fractions: tuple[float, float]
) -> Floats:
    zero_fraction, negative_fraction = fractions
    negative = exponent_range[0] * (unit_coordinates - zero_fraction) / negative_fraction
    positive = (
        exponent_range[1]
        * (unit_coordinates - zero_fraction - negative_fraction)
        / (1.0 - zero_fraction - negative_fraction)
    )
    return np.asarray(
        np.select(
            [unit_coordinates < zero_fraction, unit_coordinates < zero_fraction + negative_fraction],
            [0.0, negative],
            positive,
        )
    )


def _decay_rates(unit_coordinates: Floats, end_times: Floats) -> Floats:
    """(rows,) 1/s, rates of decay of tests with these ends, (rows,) s."""
    low, high = DECAY_TIME_FRACTIONS
    time_fraction = low * (high / low) ** np.clip(unit_coordinates / DECAYING_FRACTION, 0.0, 1.0)
    return np.asarray(np.where(unit_coordinates < DECAYING_FRACTION, 1.0 / (time_fraction * end_times), 0.0))
