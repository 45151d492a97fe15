"""What can be believed of nuisances: estimates that are far larger than they should be.

A nuisance parameter stands for something small about a test. A law that fits only with a large one does not explain the
test. Each estimate is compared with the standard deviation that was stated for it; where none was, an offset with the
noise of a frame and the size of the output, another one with the size that is usual for its kind.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from creepkit.arrays import Floats
from creepkit.inverse.noise_covariance import RandomEffects
from creepkit.inverse.nuisance_parameters import NuisanceEstimate, initial_prior_sd, nuisance_unit
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.records import Nuisance, is_length_nuisance, output_unit

MOST_STANDARD_DEVIATIONS = 3.0
"""Distance of a nuisance from its prior mean, in standard deviations that were stated or are usual, that is plausible;
and that it must be in its own, so that a value that says nothing is not named."""


MOST_OFFSET_NOISES, MOST_OFFSET_SHARE = 5.0, 0.1
"""An offset without a stated prior is named above both: in noises of a frame, and as a share of the largest value."""


@dataclass(frozen=True)
class ImplausibleNuisance:
    """A nuisance whose estimate lies far from its prior.

    kind, owner : which, of which test (or alloy, group, "all"). output : of an offset, else "". value : in `unit`.
    standard_deviations : its distance from the prior mean, over `size`, in the same unit. size_source : "stated" of a
        prior, "noise" of a frame, or what is "usual" for the kind. share : of an offset in the largest value of that
        output of the test; of a length the change relative to its mean; NaN for others.
    """

    kind: str
    owner: str
    output: str
    value: float
    unit: str
    standard_deviations: float
    size: float
    size_source: str
    share: float


def implausible_nuisances(
    problem: LeastSquaresProblem, random_effects: RandomEffects, estimates: Sequence[NuisanceEstimate]
) -> tuple[ImplausibleNuisance, ...]:
    """Those of a fit, the furthest from its prior first."""
    offsets, (rates, _) = random_effects
    found = [*_offsets(problem, offsets), *_rates(problem, rates), *_explicit(problem, estimates)]
    return tuple(sorted(found, key=lambda one: -one.standard_deviations))


def _offsets(problem: LeastSquaresProblem, offsets: Floats) -> Iterator[ImplausibleNuisance]:
    """Offsets of tests, (tests, outputs) in the output's unit."""
    observations = problem.observations
    for position, output in enumerate(observations.outputs):
        stated, unit = _stated_sd(problem.settings.nuisances, "offset", output), output_unit(output)
        size, source = (float(observations.noise[position]), "noise") if stated is None else (stated, "stated")
        if not (size > 0 and np.isfinite(size)):
            continue
        for test, history in enumerate(problem.histories):
            mask = observations.present[test] & (observations.output_index[test] == position)
            largest = float(np.abs(observations.values[test, mask]).max(initial=0.0))
            value = float(offsets[test, position])
            share, ratio = abs(value) / largest if largest > 0 else np.nan, abs(value) / size
            noisy = ratio > MOST_OFFSET_NOISES and share > MOST_OFFSET_SHARE
            if noisy if stated is None else ratio > MOST_STANDARD_DEVIATIONS:
                yield ImplausibleNuisance("offset", history.name, output, value, unit, ratio, size, source, share)


def _stated_sd(nuisances: Sequence[Nuisance], kind: str, output: str = "") -> float | None:
    return next((n.sd for n in nuisances if n.kind == kind and n.output in ("", output)), None)


def _rates(problem: LeastSquaresProblem, log_factors: Floats) -> Iterator[ImplausibleNuisance]:
    """ln factors on the rates of tests, (tests,), where their scatter was stated; else it was estimated from them."""
    sd, unit = _stated_sd(problem.settings.nuisances, "rate"), nuisance_unit("rate")
    if sd is None or not np.isfinite(sd):
        return
    for history, value in zip(problem.histories, map(float, log_factors), strict=True):
        if abs(value) > MOST_STANDARD_DEVIATIONS * sd:
            yield ImplausibleNuisance("rate", history.name, "", value, unit, abs(value) / sd, sd, "stated", np.nan)


def _explicit(problem: LeastSquaresProblem, estimates: Sequence[NuisanceEstimate]) -> Iterator[ImplausibleNuisance]:
    """Estimated nuisance parameters; a prior that is free or estimated counts as one of the usual size."""
    for nuisance, one in zip(problem.nuisance_parameters.nuisances, estimates, strict=True):
        stated = nuisance.sd is not None and np.isfinite(nuisance.sd)
        size = one.prior_sd if stated else initial_prior_sd(replace(nuisance, sd=None), one.prior_mean)
        distance, unit = abs(one.value - one.prior_mean), nuisance_unit(one.kind)
        if size > 0 and distance > MOST_STANDARD_DEVIATIONS * max(size, one.sd):
            relative = is_length_nuisance(one.kind) and one.prior_mean
            share = distance / abs(one.prior_mean) if relative else np.nan
            far, source = distance / size, "stated" if stated else "usual"
            yield ImplausibleNuisance(one.key, one.owner, "", one.value, unit, far, size, source, share)
