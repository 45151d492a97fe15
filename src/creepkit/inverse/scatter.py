"""Sizes of the sources of scatter: those of each output, and that of the rate, which all outputs of a test share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.inverse.entries import ObservationVector
from creepkit.inverse.scales import RUPTURE_OUTPUT
from creepkit.records import Nuisance

MINIMUM_TESTS = 3
"""Below this many tests the scatter between them cannot be seen."""
ASSUMED_RATE_SD = 0.3
"""Scatter of ln rate between tests that is assumed then, unless a likelihood is asked for."""


@dataclass(frozen=True)
class OutputNoise:
    """Standard deviations of one output.

    noise, offset : in the output's unit; misfit, drift : on its scale (ln strain; for a linear scale the spread of
    what was measured is one); reach : on the clock of the output (see Entries.clock).
    """

    noise: float
    misfit: float = 0.0
    offset: float = 0.0
    drift: float = 0.0
    correlation_length: float = 1.0


@dataclass(frozen=True)
class NoiseModel:
    """Standard deviations of the sources of scatter: scatter["strain"].offset, scatter.rate.

    outputs : of each output, in the order of the entries; rate : of ln rate between tests.
    """

    outputs: Mapping[str, OutputNoise]
    rate: float = 0.0

    def __getitem__(self, output: str) -> OutputNoise:
        return self.outputs[output]

    def per_observation(self, output_index: Ints, component: str) -> Floats:
        """One size at each entry, (tests, entries), from the positions of the entries' outputs."""
        return np.asarray(np.array([getattr(s, component) for s in self.outputs.values()])[output_index])

    def with_output(self, output: str, **components: float) -> NoiseModel:
        """The same with other sizes of one output."""
        return replace(self, outputs={**self.outputs, output: replace(self.outputs[output], **components)})

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers by name."""
        return {"rate": float(self.rate), "outputs": {n: asdict(s) for n, s in self.outputs.items()}}


def initial_working_noise(observations: ObservationVector, nuisances: Sequence[Nuisance]) -> NoiseModel:
    """Working scatter assumed before anything was fitted: frames wrong by a third, offsets of the scale's floor."""
    by_output = {}
    for name, transform, noise in zip(observations.outputs, observations.transforms, observations.noise, strict=True):
        offset = initial_sd(nuisances, "offset", transform.floor, name)
        by_output[name] = OutputNoise(noise=max(float(noise), 1e-3 * transform.floor), misfit=0.3, offset=offset)
    return NoiseModel(by_output)


def initial_noise_model(working: NoiseModel, nuisances: Sequence[Nuisance]) -> NoiseModel:
    """Where the estimate of the whole scatter begins; a test's one rupture cannot drift."""
    outputs = {
        name: s if name == RUPTURE_OUTPUT else replace(s, misfit=0.3 * s.misfit, drift=0.5 * s.misfit, correlation_length=1.0)
        for name, s in working.outputs.items()
    }
    return NoiseModel(outputs, initial_sd(nuisances, "rate", ASSUMED_RATE_SD))


def initial_sd(nuisances: Sequence[Nuisance], kind: str, default: float, output: str = "") -> float:
    """Zero unless the nuisance is there for this output; its prior if it has one."""
    standard_deviations = [default if n.sd is None else n.sd for n in nuisances if n.kind == kind and n.output in ("", output)]
    return standard_deviations[0] if standard_deviations else 0.0


def fixed_components(nuisances: Sequence[Nuisance], outputs: Sequence[str]) -> set[tuple[str, str]]:
    """Those (output, source) whose size a nuisance states; the rate belongs to the output ""."""
    fixed: set[tuple[str, str]] = {("", "rate") for n in nuisances if n.kind == "rate" and n.sd is not None}
    for output in outputs:
        offset_nuisances = [n for n in nuisances if n.kind == "offset" and n.output in ("", output)]
        if offset_nuisances and offset_nuisances[0].sd is not None:
            fixed.add((output, "offset"))
    return fixed
