"""Acceptance criteria of samples: before simulation (rates, bounds, constraints of the law) and after it.

Criteria 1 to 5 are those of the paper (Materials and Methods, "Data generation and preparation"). Criterion 4 of the
paper asks for a displacement above 0.01 mm, meant to remove samples without creep. The elastic deflection alone is 0.01
to 0.2 mm, so criterion 4 is applied here to the growth of the output by creep within each of the two holds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import sympy

from creepkit.arrays import Bools, Floats
from creepkit.language import CreepLaw
from creepkit.language.symbols import POINT_VARIABLES
from creepkit.records import Specimen, Status
from creepkit.sampling.conditions import ROOM_TEMPERATURE, creep_output
from creepkit.sampling.rates import Draws, RateArguments, log10_rate

TIME_FRACTIONS = np.concatenate([np.zeros(1), np.geomspace(1e-3, 1.0, 60)])
"""Times at which the constraints of a law are evaluated, as fractions of the end of a test."""


CONSTRAINT_STRESS, CONSTRAINT_STRAIN = 100.0, 0.01
"""MPa and strain at which constraints are evaluated that depend on these."""


@lru_cache(maxsize=64)
def constraint_functions(law: CreepLaw) -> tuple[Callable[..., Any], ...]:
    """Each constraint of a law as a function of the point, the internal variables and the author's parameters."""
    arguments = (*POINT_VARIABLES, *law.states, *law.params)
    return tuple(sympy.lambdify(arguments, relation, "numpy", dummify=True) for relation in law.constraints)


def constraints_hold(law: CreepLaw, draws: Draws, end_times: Floats) -> Bools:
    """Which draws meet every constraint at every time of their tests, (rows,); what is not a number does not.

    end_times : (rows,) s.
    """
    parameters = [column[:, None] for column in draws.parameters.T]
    stress, strain = np.full((len(draws), TIME_FRACTIONS.size), CONSTRAINT_STRESS), CONSTRAINT_STRAIN
    temperature = draws.condition("temperature", ROOM_TEMPERATURE)[:, None]
    arguments = (stress, strain, TIME_FRACTIONS * end_times[:, None], temperature, stress, stress / 3.0)
    states = [state.initial for state in law.states.values()]
    holds = np.ones(len(draws), bool)
    for function in constraint_functions(law):
        with np.errstate(all="ignore"):
            satisfied = np.broadcast_to(function(*arguments, *states, *parameters), stress.shape)
        holds &= satisfied.all(axis=1)
    return holds


FIRST_HOLD, BEFORE_JUMP, AFTER_JUMP, END = range(4)
"""Rows of `hold_outputs`: a hold is from the first to the second, and from the third to the fourth."""


BURST_TIME_FACTOR = 2.0
"""How many times too early the reduced-order model must burst before that counts; that of the paper's test piece is
within 1.6 as a rule."""


@dataclass(frozen=True, eq=False)
class SimulationOutcome:
    """One simulated sample, or what the reduced-order model predicts of it.

    times : (frames,) s. outputs : (frames, outputs) in their units; NaN after the end.
    hold_outputs : (4, outputs) at the end of the first ramp, just before the jump, at the end of the second ramp and
        at the end of the test; NaN where the simulation ended before. end_time : s, up to which it went.
    column : of the output that shows creep. falls : whether creep makes it smaller.
    """

    times: Floats
    outputs: Floats
    hold_outputs: Floats
    status: Status
    end_time: float
    conditions: Mapping[str, float]
    column: int = 0
    falls: bool = False

    def bursts_long_before(self, time: float) -> bool:
        """Whether a reduced-order model bursts so early that a simulation is bound to burst before a time, s."""
        return self.status == Status.RUPTURED and BURST_TIME_FACTOR * self.end_time < time

    @property
    def last_output(self) -> float:
        """The output that shows creep in the last frame that has one; NaN without any."""
        values = self.outputs[:, self.column]
        finite = values[np.isfinite(values)]
        return float(finite[-1]) if finite.size else float("nan")

    @property
    def creep_in_holds(self) -> tuple[float, float]:
        """Growth of the output that shows creep in each hold, or its fall; elastic jumps are left out.

        Of a hold that a burst cut short up to the last frame; NaN of one that never began.
        """
        start, before, after, end = self.hold_outputs[:, self.column]
        sign = -1.0 if self.falls else 1.0
        first_hold = (self.last_output if np.isnan(before) else before) - start
        return sign * float(first_hold), sign * float((self.last_output if np.isnan(end) else end) - after)


@dataclass(frozen=True)
class Criterion:
    """What criteria have in common: a name, and in words what is asked for."""

    name: str
    text: str


class DrawCriterion(Criterion):
    """What is asked of a draw before it is simulated."""

    def passes(self, law: CreepLaw, draws: Draws) -> Bools:
        """Which draws meet it, (rows,)."""
        raise NotImplementedError


class OutcomeCriterion(Criterion):
    """What is asked of a simulated sample."""

    def passes(self, outcome: SimulationOutcome) -> bool:
        """Whether the outcome meets it."""
        raise NotImplementedError

    def rejects_early(self, screening_outcome: SimulationOutcome) -> bool:
        """Whether the outcome by the reduced-order model shows that the simulation is bound to fail the criterion."""
        return False


@dataclass(frozen=True)
class RateLimit(DrawCriterion):
    """The law's rate at one point lies within limits, None where there is none: criteria 1 and 2.

    stress : MPa. lower, upper : log10 of the rate in 1/s: as logarithms rates do not underflow. time : s.
    """

    stress: float
    lower: float | None = None
    upper: float | None = None
    strain: float = 0.01
    time: float = 1e4

    def passes(self, law: CreepLaw, draws: Draws) -> Bools:
        """Which draws meet it, (rows,)."""
        arguments = RateArguments(self.stress, self.strain, self.time, draws.condition("temperature", ROOM_TEMPERATURE))
        log10_rates = log10_rate(law, draws.parameters, arguments)
        low, high = (limit if limit is not None else log10_rates for limit in (self.lower, self.upper))
        return np.asarray((log10_rates >= low) & (log10_rates <= high))


@dataclass(frozen=True)
class WithinBounds(DrawCriterion):
    """Every parameter lies within the law's bounds, or is off."""

    def passes(self, law: CreepLaw, draws: Draws) -> Bools:
        """Which draws meet it, (rows,)."""
        low, high = np.array([param.bounds for param in law.params.values()]).reshape(-1, 2).T
        off_values = np.array([np.nan if param.off is None else param.off for param in law.params.values()])
        values, slack = draws.parameters, 1e-9 * np.abs([low, high])
        return np.asarray(
            (((values >= low - slack[0]) & (values <= high + slack[1])) | (values == off_values)).all(axis=1)
        )


@dataclass(frozen=True)
class ConstraintsHold(DrawCriterion):
    """The constraints that the law declares hold throughout the test; end : s, of tests whose end is not drawn."""

    end: float

    def passes(self, law: CreepLaw, draws: Draws) -> Bools:
        """Which draws meet it, (rows,)."""
        return constraints_hold(law, draws, draws.condition("end_time", self.end))


@dataclass(frozen=True)
class SurvivesTime(OutcomeCriterion):
    """The simulation converged and went on for `seconds`, or to the end of a shorter test: criterion 3.

    None stands for the whole test. A burst is no failure of the simulation: with a number of seconds, one after them
    is admitted.
    """

    seconds: float | None = None

    def passes(self, outcome: SimulationOutcome) -> bool:
        """Whether the outcome meets it."""
        if outcome.status == Status.COMPLETE:
            return True
        return self.seconds is not None and outcome.status == Status.RUPTURED and outcome.end_time >= self.seconds

    def rejects_early(self, screening_outcome: SimulationOutcome) -> bool:
        """Whether the reduced-order model bursts so early that the simulation is bound to fail the criterion."""
        return self.seconds is not None and screening_outcome.bursts_long_before(self.seconds)


@dataclass(frozen=True)
class CreepInEachHold(OutcomeCriterion):
    """Creep above `threshold` in either hold, elastic jumps left out: criterion 4.

    A hold that a burst cut short counts up to its last frame; a second hold that was never reached is no growth.
    """

    threshold: float

    def passes(self, outcome: SimulationOutcome) -> bool:
        """Whether the outcome meets it."""
        return all(growth > self.threshold for growth in outcome.creep_in_holds)

    def rejects_early(self, screening_outcome: SimulationOutcome) -> bool:
        """Whether the reduced-order model bursts long before the second hold begins.

        Little creep is no reason. Under a nearly plastic law a clamped test piece creeps at its edge, where the stress
        is high: a model that knows one stress predicted 1e-5 mm where the simulation had 0.02 mm.
        """
        return screening_outcome.bursts_long_before(float(screening_outcome.times[-2]))


@dataclass(frozen=True)
class TotalCreepAbove(OutcomeCriterion):
    """Creep of `threshold` or more in both holds together, elastic jumps left out."""

    threshold: float

    def passes(self, outcome: SimulationOutcome) -> bool:
        """Whether the outcome meets it."""
        return float(np.nansum(outcome.creep_in_holds)) >= self.threshold


@dataclass(frozen=True)
class FinalOutputAbove(OutcomeCriterion):
    """The output that shows creep is above `threshold` at the end: criterion 5.

    After a burst, in the last frame before it.
    """

    threshold: float

    def passes(self, outcome: SimulationOutcome) -> bool:
        """Whether the outcome meets it."""
        return outcome.last_output > self.threshold


PAPER_SHARE_OF_VISIBLE = 0.5
"""Of the creep that is plainly visible, what criteria 4 and 5 ask for: 0.01 mm, twice the resolution of the paper's
cameras."""


def paper_criteria(specimen: Specimen) -> tuple[Criterion, ...]:
    """Criteria 1 to 5 of the paper; 4 and 5 concern the output that shows creep, and 5 only one that grows with it."""
    shown = creep_output(specimen)
    least = PAPER_SHARE_OF_VISIBLE * shown.visible
    final = FinalOutputAbove("5", f"{shown.output} of more than {shown.text(least)} at the end", least)
    return (
        RateLimit("1", "rate of 1e-20 1/s or more at 600 MPa, strain 0.01, 10,000 s", 600.0, lower=-20.0),
        RateLimit("2", "rate of 1 1/s or less at 50 MPa, strain 0.01, 10,000 s", 50.0, upper=0.0),
        SurvivesTime("3", "simulation converged and lasted 1 h", 3600.0),
        CreepInEachHold("4", f"creep of more than {shown.text(least)} in each hold", least),
        *(() if shown.falls else (final,)),
    )


def conditioned_criteria(law: CreepLaw, specimen: Specimen, end: float) -> tuple[Criterion, ...]:
    """Criteria of the conditioned domain: a law as its author means it, a full history, and visible creep.

    end : s, of tests whose end is not drawn.
    """
    label = ("constraints", "what the law declares of its parameters holds throughout the test")
    constraint_criteria = (ConstraintsHold(*label, end),) if law.constraints else ()
    shown = creep_output(specimen)
    return (
        WithinBounds("bounds", "every parameter lies within the law's bounds"),
        *constraint_criteria,
        SurvivesTime("full history", "simulation went on to the end of the test"),
        TotalCreepAbove("visible creep", f"creep of {shown.text(shown.visible)} or more", shown.visible),
    )
