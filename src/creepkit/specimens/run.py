"""Run: the result of one simulated test, a history that also says how it ended."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import SolveError
from creepkit.records import History, Status
from creepkit.records.presentable import Presentable

if TYPE_CHECKING:
    from creepkit.language import CreepLaw, Elastic


_RunType = TypeVar("_RunType", bound="Run")


@dataclass(frozen=True, eq=False)
class Run(Presentable, History):
    """A simulated test up to where it ended: the times asked for that were reached, and the outputs there.

    status : how it ended; end_time : s, where; reason : why, in words (empty when complete).
    A run that ended early has the label `ended`, with the reason, and a rupture time if it burst.
    """

    status: Status = Status.COMPLETE
    end_time: float = 0.0
    reason: str = ""

    drawn_by = "histories.run_figure", "histories.draw_tests"

    shown_by = "simulation.run_text"


def run_from_outputs(
    kind: type[_RunType],
    plan: History,
    names: Sequence[str],
    rows: Floats,
    status: Status,
    end_time: float,
    reason: str = "",
    **more: Any,
) -> _RunType:
    """The run of a plan: its frames up to the end; SolveError if it ended before any of them, or the law was refused.

    rows : (times, names) outputs at the times of the plan. Further keywords are fields that this kind of run has
    beside those of Run.
    """
    reason = reason or ("" if status is Status.COMPLETE else status.text)
    if status is Status.OUTSIDE_CLASS:
        raise SolveError(reason)
    reached = np.isfinite(rows).all(axis=1)
    labels = dict(plan.labels)
    if status is not Status.COMPLETE:
        reached &= plan.times <= end_time
        labels["ended"] = reason
    # at rest, at time zero, there is nothing to leave out
    if not (reached & ((plan.times > 0.0) | (plan.times[-1] == 0.0))).any():
        if status is Status.COMPLETE and not reason:
            reason = f"its outputs ({', '.join(names)}) are not all finite numbers"
        raise SolveError(
            f"{plan.source or plan.name} ended at {end_time:g} s, before any of the times asked for: {reason}; "
            "check values, loading and times"
        )
    known = {f.name: getattr(plan, f.name) for f in fields(History)}
    outputs = {name: rows[reached, k] for k, name in enumerate(names)}
    correlation = {pair: rho for pair, rho in plan.noise_correlation.items() if set(pair) <= set(names)}
    frames = {"times": plan.times[reached], "used": plan.used[reached], "outputs": outputs, "labels": labels}
    frames["noise_correlation"] = correlation
    ends = {"rupture_time": end_time if status is Status.RUPTURED else None, "unruptured": False}
    return kind(**{**known, **frames, **ends, **more}, status=status, end_time=end_time, reason=reason)


SMALLEST_USUAL_MODULUS = 1e3
"""MPa, below which a number may have been meant in GPa."""


def unusual_values(law: CreepLaw, values: Mapping[str, float], elastic: Elastic | None) -> str:
    """What may explain that a simulation ended early, as the end of a sentence; "" where nothing is unusual."""
    found = []
    for symbol, param in law.params.items():
        value, (low, high) = values[symbol.name], param.bounds
        if value != param.off and not low <= value <= high:
            found.append(f"{symbol.name} = {value:g} lies outside its bounds, {low:g} to {high:g}")
    E = getattr(elastic, "E", None)
    if isinstance(E, int | float) and E < SMALLEST_USUAL_MODULUS:
        found.append(f"E is {E:g} MPa (write {E * 1e3:g} if GPa were meant)")
    return "".join(f"; {each}" for each in found)


def with_explanation(run: _RunType, explanation: str) -> _RunType:
    """A run that ended early, its reason with an explanation."""
    if run.status is Status.COMPLETE or not explanation:
        return run
    reason = f"{run.reason}{explanation}"
    return replace(run, reason=reason, labels={**run.labels, "ended": reason})
