"""The rate family: diverse rate functions rather than named laws, for surrogates that are fed with rates.

One law of three terms A stress^n strain^m time^k exp(-q time), of which one, two or three are there. Two slopes bend
log rate over log stress as sinh does; terms that decay with strain or time, fade, or rise, each with a slope of its
own, change over time what the stress does, as sigmoidal creep and damage do. No sinh and no n(t) are among them, so
that these remain laws never seen. A network trained on single power laws, for which features of the rate are
collinear, has many times the error on them; one trained without fading and steeply rising terms has it on laws that
change over time.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import sympy

from creepkit.arrays import Bools, Floats
from creepkit.dataset.box import within_bounds
from creepkit.dataset.conditioned_box import ConditionedBox
from creepkit.dataset.conditions import BULGE, kind_of
from creepkit.dataset.criteria_of_boxes import informative
from creepkit.dataset.looks import Looks
from creepkit.dataset.ranges import PAPER, Range, conditions
from creepkit.dataset.reference import reference_of
from creepkit.dataset.time_grid import SHARES, TimeGrid
from creepkit.language import CreepLaw, Param, parameters, strain, stress, time
from creepkit.records import Specimen
from creepkit.specimens.bulge import Bulge

STEEPEST = (14.0, 14.0, 8.0)
"""Largest stress exponent of each term: two slopes and a milder one."""

HOW_MANY = (0.25, 0.45, 0.3)
"""Shares of rows with one, two and three terms: a rate with one slope in stress teaches a network little."""

STRAIN_EXPONENTS, TIME_EXPONENTS = (-0.7, 0.5), (-0.7, 2.0)
"""Their ends: decay and rise."""

STRAIN_SHARES, TIME_SHARES = (0.5, 0.4), (0.4, 0.3)
"""Shares of the exponents that are 0, and below it; the rest are above."""

FADING, FADING_TIMES = 0.35, (0.03, 1.0)
"""Share of the terms that fade, and on which time scales, as shares of the end of the test, uniform in the log."""

THICKNESS_SHARES = (0.88, 1.2)
"""Of the specimen's own apex thickness: .44 to .60 mm of the paper's dimple."""

ENDS, JUMP_SHARES = (1200.0, 86400.0), (0.15, 0.85)
"""s, from 20 min to 24 h; shares of the end at which the load jumps."""


def _law() -> CreepLaw:
    terms, params = {}, {}
    for number, steepest in enumerate(STEEPEST, start=1):
        A, n, m, k, q = parameters(" ".join(f"{letter}_{number}" for letter in "Anmkq"))
        terms[f"slope {number}"] = A * stress**n * strain**m * time**k * sympy.exp(-q * time)
        params[A] = Param("rate coefficient", unit="1/s", bounds=(1e-60, 1e2), scale="log", off=0.0)
        params[n] = Param("stress exponent", bounds=(1.0, steepest))
        params[m] = Param("strain exponent", bounds=STRAIN_EXPONENTS, off=0.0)
        params[k] = Param("time exponent", bounds=TIME_EXPONENTS, off=0.0)
        params[q] = Param("rate of fading", unit="1/s", bounds=(0.0, 1.0), off=0.0)
    return CreepLaw("rate-family", terms, params, title="Three power laws of stress, strain and time that may fade")


LAW = _law()
PER_TERM = len(LAW.params) // len(STEEPEST)


@dataclass(frozen=True)
class RateFamily(ConditionedBox):
    """Rate functions with their mean rate over the test drawn."""

    name: ClassVar[str] = "rate-family"

    def exponents(self, unit: Floats, there: Bools, looks: Looks) -> Floats:
        """Internal parameters before coefficients: n uniform; m and k off, decaying or rising; q off or fading.

        A term that is alone does not rise with strain: it would have no strain to begin with.
        """
        theta = within_bounds(self.law, unit)
        alone = there.sum(axis=1) == 1
        for first in range(0, theta.shape[1], PER_TERM):
            m, k, q = first + 2, first + 3, first + 4
            theta[:, m] = _decaying_or_rising(unit[:, m], STRAIN_EXPONENTS, STRAIN_SHARES)
            theta[:, k] = _decaying_or_rising(unit[:, k], TIME_EXPONENTS, TIME_SHARES)
            theta[:, q] = _fading(unit[:, q], looks.ends)
            theta[alone, m] = -np.abs(theta[alone, m])
        return theta


def rate_family(specimen: Specimen | None = None, *, grid: TimeGrid | None = None, **given: Any) -> RateFamily:
    """Return the rate family for a specimen, by default the paper's dimple, whose apex thickness is drawn too.

    grid : other times than shares of the end (see time_grid.SHARES). given : other ranges of conditions, see design_of.
    """
    specimen = specimen or Bulge()
    kind = kind_of(specimen)
    grid = grid or TimeGrid(np.array(SHARES), relative=True)
    reference = reference_of(specimen)
    own: dict[str, Any] = {"end_time": Range(*ENDS, scale="log"), "Tj": Range(*JUMP_SHARES, share_of="end_time")}
    if kind == BULGE:
        own["apex_thickness"] = tuple(share * reference.thickness for share in THICKNESS_SHARES)
    space = conditions(kind, grid, given, {**PAPER[kind], **own}, warm=False)
    return RateFamily(LAW, space, grid, informative(LAW, kind, space.end), reference, HOW_MANY)


def _decaying_or_rising(unit: Floats, ends: tuple[float, float], shares: tuple[float, float]) -> Floats:
    off, below = shares
    decaying = ends[0] * (unit - off) / below
    rising = ends[1] * (unit - off - below) / (1.0 - off - below)
    return np.asarray(np.select([unit < off, unit < off + below], [0.0, decaying], rising))


def _fading(unit: Floats, ends: Floats) -> Floats:
    """Rates of fading, 1/s, of tests that end then, s."""
    low, high = FADING_TIMES
    share = low * (high / low) ** np.clip(unit / FADING, 0.0, 1.0)
    return np.asarray(np.where(unit < FADING, 1.0 / (share * ends), 0.0))
