"""The dry run of a design: what its criteria reject and how many samples look useful, before anything is simulated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Bools, Floats
from creepkit.dataset.box import SamplingDomain
from creepkit.dataset.design import Draws
from creepkit.dataset.looks import mean_ln_rate
from creepkit.dataset.term_rates import internal_parameters

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DEFAULT_DRAWS = 4096
"""Rows drawn."""


@dataclass(frozen=True, eq=False)
class Acceptance:
    """What is known of a design without simulating it.

    draws : rows of the design. met : {criterion before simulation: (rows,) whether it is met on its own}.
    strains : (rows,) log10 of the mean rate at the reference stress times the duration of the test.
    window : (rows, 2) log10 of the strains between which creep is visible and the test lasts, as a rule.
    """

    design: SamplingDomain
    seed: int
    draws: Draws
    criteria_met: Mapping[str, Bools]
    log10_strains: Floats
    useful_strains: Floats

    @property
    def kept(self) -> Bools:
        """Which rows meet every criterion that needs no simulation, (rows,)."""
        return np.asarray(np.all([np.ones(len(self.draws), bool), *self.criteria_met.values()], axis=0))

    @property
    def useful(self) -> Bools:
        """Which of them have a useful rate, (rows,); of the others some may be useful, too.

        Of Eq. (2) in the paper's box 8 % have, and 16 % of 600 simulated draws crept visibly and lasted: a dimple
        relieves itself of stress as it deflects, and so outlasts rates above the window.
        """
        in_range = (self.log10_strains >= self.useful_strains[:, 0]) & (self.log10_strains <= self.useful_strains[:, 1])
        return np.asarray(self.kept & in_range)

    def figure(self, path: str | Path | None = None) -> Figure:
        """Draw the sampled rates, with the useful ones and criteria 1 and 2 marked; write them to `path` if given."""
        from creepkit.dataset.plotting_rates import acceptance_figure

        return acceptance_figure(self, path)

    def __str__(self) -> str:
        return "\n".join([self._title(), *self._table(), self._last()])

    def _title(self) -> str:
        domain = self.design
        count = f"{len(self.draws)} draws, seed {self.seed}"
        return f"law '{domain.law.name}', {domain.name} box, {domain.specimen} test of {domain.grid.frames} frames: {count}"

    def _table(self) -> list[str]:
        lines, remaining = [f"{'criterion':<14} {'meet it':>8} {'rejected':>9}  asks"], np.ones(len(self.draws), bool)
        for criterion in self.design.criteria:
            if criterion.stage == "after":
                numbers = f"{'after simulation':>18}"
            else:
                is_met = self.criteria_met[criterion.name]
                numbers = f"{_percent(is_met):>8} {_percent(remaining & ~is_met):>9}"
                remaining = remaining & is_met
            lines.append(f"{criterion.name:<14} {numbers}  {criterion.text}")
        return lines

    def _last(self) -> str:
        simulated, useful = _percent(self.kept), _percent(self.useful)
        exception = (
            " but for those that burst far too early by a cheap stand-in" if getattr(self.design, "screened", 0) else ""
        )
        description = "a rate at which creep is visible and the test lasts (others may, too)"
        return f"{simulated} of the draws would be simulated{exception}; {useful} of all have {description}"


def acceptance(design: SamplingDomain, draws: int = DEFAULT_DRAWS, seed: int = 0) -> Acceptance:
    """Return what a design's criteria reject before simulation, and how its rates lie; nothing is simulated.

    draws : how many rows; a rejection counts for the first criterion that is not met.
    """
    rows = design.draw(0, draws, seed)
    criteria_met = {c.name: c.passes(design.law, rows) for c in design.criteria if c.stage == "before"}
    end, reference = design.conditions.end, design.reference_stress
    points = reference.evaluation_points(rows, end)
    log10_rates = mean_ln_rate(design.law, internal_parameters(design.law, rows.parameters), points) / np.log(10.0)
    log10_end_times = np.log10(rows.condition("end_time", end))
    useful_rates = np.stack(np.broadcast_arrays(*reference.useful_rates(rows, end)), axis=1)
    return Acceptance(design, seed, rows, criteria_met, log10_rates + log10_end_times, useful_rates + log10_end_times[:, None])


def _percent(mask: Bools) -> str:
    return f"{100 * float(mask.mean()):.1f} %"
