"""Noise model: residuals, standard deviations of the sources of scatter, and the covariance of one test.

Beside white noise and offsets there are two autocorrelated parts. The drift of an output is slow noise of its
instrument, with a short correlation length. The model discrepancy is what the law cannot follow: one standard deviation
and one, longer, correlation length for all outputs, in units in which their noises are alike, so that no law can call
the misfit of one output noise and fit the others.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from creepkit.arrays import Bools, Floats, Ints
from creepkit.inverse.observation_series import ObservationSeries, SharedNoise
from creepkit.inverse.observation_vector import RUPTURE_OUTPUT, SINGLE_VALUES
from creepkit.records import Nuisance


@dataclass(frozen=True, eq=False)
class StoppedTests:
    """What stopped tests say, as Gaussian observations about one point (see inverse.noise_covariance).

    shift, sd : (tests, observations) -, what is added to the residuals of their ends, and the standard deviation that
    these have beyond the noise model, None where no test was stopped. chi_square, log_variance : -2 ln of the
    probability to last, and ln of the variance of the ends, over those of the Gaussian observations, summed over tests.
    """

    shift: Floats = field(default_factory=lambda: np.zeros(0))
    sd: Floats | None = None
    chi_square: float = 0.0
    log_variance: float = 0.0

    @property
    def log_likelihood(self) -> float:
        """What is to be added to that of the Gaussian observations."""
        return -0.5 * (self.chi_square + self.log_variance)


@dataclass(frozen=True, eq=False)
class Residuals:
    """Residuals of the observation vector (see inverse.observation_vector), with what their covariance depends on.

    values : (tests, observations) -, transformed prediction less transformed observation.
    offset_sensitivity : (tests, observations) 1 / unit, effect of one unit of offset.
    present : (tests, observations) which are data; the others are zero.
    correlation_coordinate : (tests, observations) -, in which drifts decay: ln t or a share of the duration.
    jacobian : (tests, observations, unknowns) derivatives to x = (u, e).
    log_rate_sensitivity : (tests, observations) -, derivative to ln of a factor on the creep rate of the test.
    log_life_sensitivity : (tests, observations) -, derivative to ln of a factor on the rate of its damage, by which its
        life is shorter, or None where no test is followed to rupture.
    output_index : (tests, observations) position of the output; relative_noise : (tests, observations) -, noise over
        the typical noise of that output.
    random_effect_sensitivities : (tests, observations, effects) -, effect of one standard deviation of further random
        effects, independent in each test, or None. common_effects : (tests, observations, effects) -, of effects that
        all tests have alike, or None.
    discrepancy_unit : (tests, observations) -, what a model discrepancy of one is in the transformed output: the stated
        or estimated noise of the frame; 1 % where the transform is logarithmic; 0 where there can be none.
    shared_noise : how the noise of the outputs of a frame is correlated; None where it is not.
    rate_errors : (tests,) -, standard deviation of ln rate by errors that tests state of their material, or None.
    stopped : what tests that were stopped before rupture say, which is in their values.
    """

    values: Floats
    offset_sensitivity: Floats
    present: Bools
    correlation_coordinate: Floats
    jacobian: Floats
    log_rate_sensitivity: Floats
    output_index: Ints
    relative_noise: Floats
    log_life_sensitivity: Floats | None = None
    random_effect_sensitivities: Floats | None = None
    common_effects: Floats | None = None
    discrepancy_unit: Floats | None = None
    shared_noise: SharedNoise | None = None
    rate_errors: Floats | None = None
    stopped: StoppedTests = field(default_factory=StoppedTests)

    def with_effects(self, own: Sequence[Floats], common: Sequence[Floats] = ()) -> Residuals:
        """The same with further random effects.

        own, common : (tests, observations) -, one standard deviation of each of those that tests have independently,
        and of those that all tests have alike.
        """

        def joined(present: Floats | None, more: Sequence[Floats]) -> Floats | None:
            columns = [*([] if present is None else [present]), *(one[..., None] for one in more)]
            return np.concatenate(columns, axis=-1) if columns else None

        return replace(
            self,
            random_effect_sensitivities=joined(self.random_effect_sensitivities, own),
            common_effects=joined(self.common_effects, common),
        )

    def where(self, mask: Bools) -> Residuals:
        """The same of some observations alone; mask : (tests, observations)."""

        def kept(array: Floats | None) -> Any:
            return None if array is None else np.where(mask if array.ndim == 2 else mask[..., None], array, 0.0)

        return replace(
            self,
            values=kept(self.values),
            offset_sensitivity=kept(self.offset_sensitivity),
            present=mask,
            jacobian=kept(self.jacobian),
            log_rate_sensitivity=kept(self.log_rate_sensitivity),
            log_life_sensitivity=kept(self.log_life_sensitivity),
            discrepancy_unit=kept(self.discrepancy_unit),
            common_effects=kept(self.common_effects),
        )

    @cached_property
    def series(self) -> ObservationSeries:
        """The same as the compiled covariance takes it."""
        unit, life, further = self.discrepancy_unit, self.log_life_sensitivity, self.random_effect_sensitivities
        effects = [
            self.relative_noise * self.offset_sensitivity,
            self.offset_sensitivity,
            np.zeros_like(self.values) if unit is None else unit,
            self.log_rate_sensitivity,
            np.zeros_like(self.values) if life is None else life,
        ]
        stacked = np.stack(effects, axis=-1)
        ends = None if self.stopped.sd is None else self.stopped.sd[..., None]
        rates = None if self.rate_errors is None else (self.rate_errors[:, None] * self.log_rate_sensitivity)[..., None]
        stacked = np.concatenate([stacked, *(one for one in (further, ends, rates) if one is not None)], axis=-1)
        return ObservationSeries.of_observations(
            self.present, self.output_index, self.correlation_coordinate, stacked, self.shared_noise
        )


MINIMUM_TESTS = 3
"""Below this many tests the scatter between them cannot be estimated."""


ASSUMED_RATE_SD = 0.3
"""Scatter of ln rate between tests that is assumed then, unless a likelihood is asked for."""


@dataclass(frozen=True)
class OutputNoise:
    """Standard deviations of one output.

    noise : of one frame, and offset : of a test, in the output's unit. misfit : independent error of a frame, and
    drift : autocorrelated noise of the instrument, in the transformed output. correlation_length : of the drift, in
    correlation time. stated : the noise that the histories state, its lower bound, in the output's unit; 0 where they
    state none.
    """

    noise: float
    misfit: float = 0.0
    offset: float = 0.0
    drift: float = 0.0
    correlation_length: float = 1.0
    stated: float = 0.0


OUTPUT_COMPONENTS = ("noise", "misfit", "offset", "drift", "correlation_length")


SHARED_COMPONENTS = ("rate", "life", "discrepancy", "discrepancy_length")
"""Components that outputs share; they belong to the output ""."""


@dataclass(frozen=True)
class NoiseModel:
    """Standard deviations of the sources of scatter, such as noise_model["strain"].offset and noise_model.rate.

    outputs : of each output, in the order of the observations; rate, life : of ln rate, and of ln rate of damage
        beside it, between tests.
    discrepancy : of the model discrepancy, in noises (see Residuals.discrepancy_unit), and discrepancy_length : its
        correlation length, in correlation time.
    """

    outputs: Mapping[str, OutputNoise]
    rate: float = 0.0
    discrepancy: float = 0.0
    discrepancy_length: float = 1.0
    life: float = 0.0

    def __getitem__(self, output: str) -> OutputNoise:
        return self.outputs[output]

    def per_observation(self, output_index: Ints, component: str) -> Floats:
        """(tests, observations) one component at each observation; output_index : (tests, observations)."""
        return np.asarray(np.array([getattr(s, component) for s in self.outputs.values()])[output_index])

    @property
    def components(self) -> Floats:
        """(5 outputs + 4,) OUTPUT_COMPONENTS of each output, then SHARED_COMPONENTS."""
        own = [getattr(s, name) for s in self.outputs.values() for name in OUTPUT_COMPONENTS]
        return np.array([*own, *(getattr(self, name) for name in SHARED_COMPONENTS)], float)

    def position(self, output: str, component: str) -> int:
        """The position of a component among `components`; "" is the output of shared ones."""
        own = len(OUTPUT_COMPONENTS)
        if not output:
            return own * len(self.outputs) + SHARED_COMPONENTS.index(component)
        return own * list(self.outputs).index(output) + OUTPUT_COMPONENTS.index(component)

    def with_components(self, components: Floats) -> NoiseModel:
        """The same with other components.

        components : (5 outputs + 4,) in the order of the property.
        """
        own = np.split(components, range(len(OUTPUT_COMPONENTS), components.size, len(OUTPUT_COMPONENTS)))
        outputs = {
            name: replace(output, **dict(zip(OUTPUT_COMPONENTS, values.tolist(), strict=True)))
            for (name, output), values in zip(self.outputs.items(), own, strict=False)
        }
        shared = components[-len(SHARED_COMPONENTS) :].tolist()
        return NoiseModel(outputs, **dict(zip(SHARED_COMPONENTS, shared, strict=True)))

    def with_output(self, output: str, **components: float) -> NoiseModel:
        """The same with other components of one output."""
        return replace(self, outputs={**self.outputs, output: replace(self.outputs[output], **components)})

    def scatter_of_value(self, output: str) -> float:
        """Standard deviation of ln of a single value of a test beside what its rate makes of it; 0 of none."""
        if output not in self.outputs:
            return 0.0
        return float(np.hypot(self[output].misfit, self.life if output == RUPTURE_OUTPUT else 0.0))

    @property
    def without_offsets(self) -> NoiseModel:
        """The same without offsets of tests."""
        return replace(self, outputs={name: replace(one, offset=0.0) for name, one in self.outputs.items()})


def without_confounded_misfit(noise_model: NoiseModel) -> NoiseModel:
    """The same; where each test has one value alone, all its scatter is that of the rates between tests, if any."""
    (name, *others) = noise_model.outputs
    confounded = not others and name in SINGLE_VALUES and noise_model.rate > 0
    return noise_model.with_output(name, misfit=0.0) if confounded else noise_model


def known_sd(nuisances: Sequence[Nuisance], kind: str, output: str = "") -> float | None:
    """The standard deviation that is stated of a nuisance; 0 where there is no such one, None where it is estimated."""
    return next((n.sd for n in nuisances if n.kind == kind and n.output in ("", output)), 0.0)


NEGLIGIBLE_DRIFT = 1e-3
"""A drift below this, in transformed outputs, is none."""


NEGLIGIBLE_DISCREPANCY = 0.02
"""A model discrepancy below this, in noises, is none."""


def autocorrelated_components(noise_model: NoiseModel) -> int:
    """How many components the autocorrelated parts of a noise model have: a size and a length each."""
    drifting = sum(components.drift > NEGLIGIBLE_DRIFT for components in noise_model.outputs.values())
    return 2 * (drifting + int(noise_model.discrepancy > NEGLIGIBLE_DISCREPANCY))
