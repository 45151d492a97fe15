"""A design cheap enough for tests: bars that creep by Norton's law, with a closed form; and criteria that misbehave."""

import os
import signal
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import creepkit as ck
from creepkit.sampling.conditions import TimeGrid
from creepkit.sampling.domains import DrawCriterion, OutcomeCriterion, SamplingDomain
from creepkit.sampling.rates import Draws, additive_recurrence_step

NORTON = ck.law("norton")
BAR = ck.specimen("uniaxial")
GRID = TimeGrid(np.array([0.0, 100.0, 1000.0, 3600.0]))


@dataclass(frozen=True)
class Strong(DrawCriterion):
    """Bars of at most 120 MPa."""

    name: str = "strong"
    text: str = "first stress of 120 MPa or less"

    def passes(self, law, draws):
        return draws.condition("stress_1") <= 120.0


@dataclass(frozen=True)
class Visible(OutcomeCriterion):
    """Some creep; `log` gets a byte for each sample that was looked at."""

    name: str = "visible"
    text: str = "strain above 1e-5"
    log: str = ""
    seconds: float = 0.0

    def passes(self, outcome):
        if self.log:
            with Path(self.log).open("ab") as file:
                file.write(b".")
        time.sleep(self.seconds)
        return outcome.last_output > 1e-5


@dataclass(frozen=True)
class Deadly(OutcomeCriterion):
    """Kills its process for bars of one stress; `once` names a file that says that it has done so."""

    name: str = field(default="deadly", init=False)
    text: str = field(default="survives", init=False)
    stress: float
    once: str = ""

    def passes(self, outcome):
        if outcome.conditions["stress_1"] == self.stress and not (self.once and Path(self.once).exists()):
            if self.once:
                Path(self.once).touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return True


@dataclass(frozen=True)
class Raising(OutcomeCriterion):
    """A criterion of a plugin that was not thought through; of one stress, or of all of them."""

    name: str = field(default="raising", init=False)
    text: str = field(default="is defined", init=False)
    stress: float | None = None

    def passes(self, outcome):
        if self.stress in (None, outcome.conditions["stress_1"]):
            raise ZeroDivisionError("stress of\nno use")
        return True


@dataclass(frozen=True)
class Planted(SamplingDomain):
    """A of 1e-12 to 1e-10 1/s, n of 1 to 3, stresses of 50 to 150 MPa and a jump at 2000 s."""

    criteria: tuple = (Strong(), Visible())
    name: str = field(default="planted", init=False)
    specimen: str = field(default="uniaxial", init=False)
    law: object = field(default=NORTON, init=False)
    conditions: object = field(default=None, init=False)
    reference_stress: object = field(default=None, init=False)
    grid: TimeGrid = field(default=GRID, kw_only=True)
    low: float = 50.0

    condition_names = ("stress_1", "stress_2", "Tj")

    def draw(self, first, count, seed):
        rows = np.arange(first + 1, first + count + 1)[:, None]
        unit = (
            rows * additive_recurrence_step(4) + 0.37 * seed
        ) % 1.0  # no Sobol sequence: workers start quicker without scipy
        parameters = np.stack([10.0 ** (-12.0 + 2.0 * unit[:, 0]), 1.0 + 2.0 * unit[:, 1]], axis=1)
        stresses = self.low + (150.0 - self.low) * unit[:, 2:]
        return Draws(parameters, np.column_stack([stresses, np.full(count, 2000.0)]), self.condition_names)

    def document(self):
        return {
            "name": self.name,
            "low": self.low,
            "grid": self.grid.values.tolist(),
            "criteria": [{"name": c.name, "text": c.text} for c in self.criteria],
        }


def strain(values, conditions, times):
    """Logarithmic strain under constant load: each hold grows by d(e) = A s^n exp(n e) dt, s the nominal stress."""
    A, n = values["A"], values["n"]
    held = np.minimum(times, conditions["Tj"])
    grown = A * (conditions["stress_1"] ** n * held + conditions["stress_2"] ** n * (times - held))
    return -np.log1p(-n * grown) / n


def stress_of(row, seed=0, design=None):
    """The first stress of one row of the sequence."""
    return float((design or Planted()).draw(row, 1, seed).condition("stress_1")[0])
