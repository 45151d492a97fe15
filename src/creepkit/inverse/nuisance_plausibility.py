"""What can be believed of nuisances: estimates that are far larger than they should be, and pairs that do the same.

A nuisance parameter stands for something small about a test. A law that fits only with a large one does not explain the
test. Each estimate is compared with the standard deviation that was stated for it; where none was, an offset with the
noise of a frame and the size of the output, another one with the size that is usual for its kind.

With s_a, s_b the derivatives of a test's residuals to two nuisances, in standard deviations of the noise, and the part
that an offset of each output takes up removed where there is one, their correlation is s_a . s_b / (|s_a| |s_b|).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import FitError
from creepkit.inverse.noise_model import Residuals
from creepkit.inverse.nuisance_parameters import NuisanceEstimate, initial_prior_sd, nuisance_unit
from creepkit.inverse.problem import LeastSquaresProblem
from creepkit.records import Nuisance, is_length_nuisance, output_unit

MOST_STANDARD_DEVIATIONS = 3.0
"""Distance of a nuisance from its prior mean, in standard deviations that were stated or are usual, that is plausible;
and that it must be in its own, so that a value that says nothing is not named."""


MOST_OFFSET_NOISES, MOST_OFFSET_SHARE = 5.0, 0.1
"""An offset without a stated prior is named above both: in noises of a frame, and as a share of the largest value."""


HIGH_CORRELATION = 0.99
"""In the median test: nuisances that correlate by more are named."""


EXACT_CORRELATION = 1.0 - 1e-9
"""In every test: nuisances without a prior that correlate by more have no estimate."""


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

    @property
    def description(self) -> str:
        """Such as "an offset of 0.095 mm in amplitude of 'D1', 24 % of its largest value"."""
        article = "an" if self.kind[0] in "aeiou" else "a"
        where = f"in {self.output} of '{self.owner}'" if self.output else f"in '{self.owner}'"
        return f"{article} {self.kind} of {self._amount} {where}{self._share}"

    @property
    def sentence(self) -> str:
        """The note of an identification."""
        size = {
            "stated": "the standard deviation that was stated for it",
            "noise": "the noise of a frame",
            "usual": f"a usual {self.kind}",
        }[self.size_source]
        return (
            f"the {self.kind}{f' of {self.output}' if self.output else ''} of '{self.owner}' is {self._amount}"
            f"{self._share}, {self.standard_deviations:.2g} times {size} ({_amount(self.size, self.unit)}): it stands "
            "for more than its name says, look at the test or try another law"
        )

    @property
    def _amount(self) -> str:
        return _amount(self.value, self.unit)

    @property
    def _share(self) -> str:
        if not np.isfinite(self.share):
            return ""
        whole = "its largest value" if self.output else "its nominal length"
        return f", {100 * self.share:.2g} % {'of' if self.output else 'from'} {whole}"


def _amount(value: float, unit: str) -> str:
    return f"{value:.2g}{' ' + unit if unit else ''}"


def implausible_nuisances(
    problem: LeastSquaresProblem, random_effects: tuple[Floats, Floats], estimates: Sequence[NuisanceEstimate]
) -> tuple[ImplausibleNuisance, ...]:
    """Those of a fit, the furthest from its prior first.

    random_effects : offsets (tests, outputs) in the output's unit, and ln rate factors (tests,).
    """
    found = [*_offsets(problem, random_effects[0]), *_rates(problem, random_effects[1]), *_explicit(problem, estimates)]
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


# ---- correlations ----------------------------------------------------------------------------------------------------


def nuisance_correlation_notes(problem: LeastSquaresProblem, residuals: Residuals) -> list[str]:
    """One sentence for each pair of nuisances of one scope that cannot be told apart; FitError without their priors."""
    directions = _directions(problem, residuals)
    free = {n.key for n in problem.settings.nuisances if n.sd == np.inf}
    scopes = {n.key: n.scope for n in problem.settings.nuisances}
    sentences = []
    for first, second in combinations(directions, 2):
        tests = directions[first].keys() & directions[second].keys()
        correlations = [abs(_correlation(directions[first][t], directions[second][t])) for t in tests]
        if not correlations or scopes[first] != scopes[second]:
            continue
        if {first, second} <= free and min(correlations) > EXACT_CORRELATION:
            raise FitError(
                f"nuisances '{first}' and '{second}' do the same to every test, and neither has a prior; leave one "
                "of them out, or give it sd="
            )
        if np.median(correlations) > HIGH_CORRELATION:
            sentences.append(
                f"nuisances '{first}' and '{second}' cannot be told apart: what they do to a test correlates by "
                f"{np.median(correlations):.3f} in the median; their priors divide it between them, so leave one of "
                "them out or state its prior"
            )
    return sentences


def _directions(problem: LeastSquaresProblem, residuals: Residuals) -> dict[str, dict[int, Floats]]:
    """{key: {test: (observations,)}} derivatives to the nuisances of each test, in standard deviations of the noise."""
    settings, observations = problem.settings, problem.observations
    kinds = {n.kind for n in settings.nuisances}
    by_key = {"rate": residuals.log_rate_sensitivity} if "rate" in kinds else {}
    tests_of = {"rate": list(range(len(residuals.values)))}
    nuisances = problem.nuisance_parameters
    if nuisances.size and residuals.jacobian is not None:
        columns = residuals.jacobian[..., -nuisances.size :]
        for key, index in nuisances.test_index.items():
            tests_of[key] = [int(t) for t in np.flatnonzero(index >= 0)]
            by_key[key] = np.stack([columns[t, :, index[t]] for t in range(len(index))])
    noise = np.abs(residuals.offset_sensitivity) * observations.noise[residuals.output_index] * residuals.relative_noise
    result: dict[str, dict[int, Floats]] = {key: {} for key in by_key}
    for key, derivatives in by_key.items():
        for t in tests_of[key]:
            mask = residuals.present[t] & (noise[t] > 0)
            scaled = derivatives[t, mask] / noise[t, mask]
            if "offset" in kinds:
                scaled = _without_offsets(scaled, residuals.output_index[t, mask], residuals.relative_noise[t, mask])
            if np.linalg.norm(scaled) > 0:
                result[key][t] = scaled
    return result


def _without_offsets(scaled: Floats, output: Floats, relative_noise: Floats) -> Floats:
    """The part orthogonal to an offset of each output; all (observations,)."""
    result = scaled.copy()
    for position in np.unique(output):
        offset = np.where(output == position, 1.0 / relative_noise, 0.0)
        result -= offset * (offset @ scaled) / (offset @ offset)
    return result


def _correlation(first: Floats, second: Floats) -> float:
    return float(first @ second / (np.linalg.norm(first) * np.linalg.norm(second)))
