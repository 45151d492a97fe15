"""Sizes of the sources of scatter: those of each output, and that of the rate, which all outputs of a test share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from creepkit.arrays import Floats, Ints
from creepkit.inverse.entries import Entries
from creepkit.inverse.scales import RUPTURE
from creepkit.records import Nuisance

FEW_TESTS = 3
"""Below this many tests the scatter between them cannot be seen."""
ASSUMED_RATE = 0.3
"""Scatter of ln rate between tests that is assumed then, unless a likelihood is asked for."""


@dataclass(frozen=True)
class OutputScatter:
    """Standard deviations of one output.

    noise, offset : in the output's unit; misfit, drift : on its scale (ln strain; for a linear scale the spread of
    what was measured is one); reach : on the clock of the output (see Entries.clock).
    """

    noise: float
    misfit: float = 0.0
    offset: float = 0.0
    drift: float = 0.0
    reach: float = 1.0


@dataclass(frozen=True)
class Scatter:
    """Standard deviations of the sources of scatter: scatter["strain"].offset, scatter.rate.

    outputs : of each output, in the order of the entries; rate : of ln rate between tests.
    """

    outputs: Mapping[str, OutputScatter]
    rate: float = 0.0

    def __getitem__(self, output: str) -> OutputScatter:
        return self.outputs[output]

    def at(self, output: Ints, name: str) -> Floats:
        """One size at each entry, (tests, entries), from the positions of the entries' outputs."""
        return np.asarray(np.array([getattr(s, name) for s in self.outputs.values()])[output])

    def changed(self, output: str, **sizes: float) -> Scatter:
        """The same with other sizes of one output."""
        return replace(self, outputs={**self.outputs, output: replace(self.outputs[output], **sizes)})

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers by name."""
        return {"rate": float(self.rate), "outputs": {n: asdict(s) for n, s in self.outputs.items()}}


def working_guess(entries: Entries, nuisances: Sequence[Nuisance]) -> Scatter:
    """Working scatter assumed before anything was fitted: frames wrong by a third, offsets of the scale's floor."""
    found = {}
    for name, scale, noise in zip(entries.outputs, entries.scales, entries.noise, strict=True):
        offset = size_of(nuisances, "offset", scale.floor, name)
        found[name] = OutputScatter(noise=max(float(noise), 1e-3 * scale.floor), misfit=0.3, offset=offset)
    return Scatter(found)


def full_guess(working: Scatter, nuisances: Sequence[Nuisance]) -> Scatter:
    """Where the estimate of the whole scatter begins; a test's one rupture cannot drift."""
    outputs = {
        name: s if name == RUPTURE else replace(s, misfit=0.3 * s.misfit, drift=0.5 * s.misfit, reach=1.0)
        for name, s in working.outputs.items()
    }
    return Scatter(outputs, size_of(nuisances, "rate", ASSUMED_RATE))


def size_of(nuisances: Sequence[Nuisance], kind: str, default: float, output: str = "") -> float:
    """Zero unless the nuisance is there for this output; its prior if it has one."""
    sizes = [default if n.sd is None else n.sd for n in nuisances if n.kind == kind and n.output in ("", output)]
    return sizes[0] if sizes else 0.0


def given_sizes(nuisances: Sequence[Nuisance], outputs: Sequence[str]) -> set[tuple[str, str]]:
    """Those (output, source) whose size a nuisance states; the rate belongs to the output ""."""
    stated: set[tuple[str, str]] = {("", "rate") for n in nuisances if n.kind == "rate" and n.sd is not None}
    for output in outputs:
        mine = [n for n in nuisances if n.kind == "offset" and n.output in ("", output)]
        if mine and mine[0].sd is not None:
            stated.add((output, "offset"))
    return stated
