"""The dry run of a design: what its criteria reject and how many samples look useful, before anything is simulated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.dataset.box import Box
from creepkit.dataset.design import Draws
from creepkit.dataset.looks import mean_ln_rate
from creepkit.dataset.term_rates import internal

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SAMPLE = 4096
"""Rows drawn."""


@dataclass(frozen=True, eq=False)
class Acceptance:
    """What is known of a design without simulating it.

    draws : rows of the design. met : {criterion before simulation: (rows,) whether it is met on its own}.
    strains : (rows,) log10 of the mean rate at the reference stress times the duration of the test.
    window : (rows, 2) log10 of the strains between which creep is visible and the test lasts, as a rule.
    """

    design: Box
    seed: int
    draws: Draws
    met: Mapping[str, Bools]
    strains: Floats
    window: Floats

    @property
    def kept(self) -> Bools:
        """Which rows meet every criterion that needs no simulation, (rows,)."""
        return np.asarray(np.all([np.ones(len(self.draws), bool), *self.met.values()], axis=0))

    @property
    def useful(self) -> Bools:
        """Which of them have a useful rate, (rows,); of the others some may be useful, too.

        Of Eq. (2) in the paper's box 8 % have, and 16 % of 600 simulated draws crept visibly and lasted: a dimple
        relieves itself of stress as it deflects, and so outlasts rates above the window.
        """
        inside = (self.strains >= self.window[:, 0]) & (self.strains <= self.window[:, 1])
        return np.asarray(self.kept & inside)

    def figure(self, path: str | Path | None = None) -> Figure:
        """Draw the sampled rates, with the useful ones and criteria 1 and 2 marked; write them to `path` if given."""
        from creepkit.dataset.plotting_rates import figure_of

        return figure_of(self, path)

    def __str__(self) -> str:
        return "\n".join([self._title(), *self._table(), self._last()])

    def _title(self) -> str:
        d = self.design
        count = f"{len(self.draws)} draws, seed {self.seed}"
        return f"law '{d.law.name}', {d.name} box, {d.specimen} test of {d.grid.frames} frames: {count}"

    def _table(self) -> list[str]:
        lines, left = [f"{'criterion':<14} {'meet it':>8} {'rejected':>9}  asks"], np.ones(len(self.draws), bool)
        for criterion in self.design.criteria:
            if criterion.stage == "after":
                numbers = f"{'after simulation':>18}"
            else:
                met = self.met[criterion.name]
                numbers = f"{_percent(met):>8} {_percent(left & ~met):>9}"
                left = left & met
            lines.append(f"{criterion.name:<14} {numbers}  {criterion.text}")
        return lines

    def _last(self) -> str:
        simulated, useful = _percent(self.kept), _percent(self.useful)
        some = (
            " but for those that burst far too early by a cheap stand-in" if getattr(self.design, "screened", 0) else ""
        )
        what = "a rate at which creep is visible and the test lasts (others may, too)"
        return f"{simulated} of the draws would be simulated{some}; {useful} of all have {what}"


def acceptance(design: Box, draws: int = SAMPLE, seed: int = 0) -> Acceptance:
    """Return what a design's criteria reject before simulation, and how its rates lie; nothing is simulated.

    draws : how many rows; a rejection counts for the first criterion that is not met.
    """
    drawn = design.draw(0, draws, seed)
    met = {c.name: c.passes(design.law, drawn) for c in design.criteria if c.stage == "before"}
    end, reference = design.conditions.end, design.reference
    looks = reference.looks(drawn, end)
    rates = mean_ln_rate(design.law, internal(design.law, drawn.parameters), looks) / np.log(10.0)
    ends = np.log10(drawn.condition("end_time", end))
    window = np.stack(np.broadcast_arrays(*reference.window(drawn, end)), axis=1)
    return Acceptance(design, seed, drawn, met, rates + ends, window + ends[:, None])


def _percent(which: Bools) -> str:
    return f"{100 * float(which.mean()):.1f} %"
