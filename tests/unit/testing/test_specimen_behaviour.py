"""Specimens that hear nothing of steps of their load or of the law, or that can be changed, do not conform."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest

import creepkit as ck
from creepkit.testing import ConformanceReport


class SteadyBar(ck.PerTest):
    """Strain = rate x time, of Norton's law at the largest stress, whatever the test and the law are."""

    name, title = "steady-bar", "Bar in steady creep"
    outputs: ClassVar[Any] = (ck.Output("strain", "strain"),)
    loads: ClassVar[Any] = (ck.Load("stress", "stress"),)

    def stress(self, history):
        return history.loading.program().values.max()

    def rate(self, law, values, stress):
        return values["A"] * stress ** values["n"]

    def one(self, law, values, history, nuisances):
        return {"strain": self.rate(law, values, self.stress(history)) * history.times}


class OfEveryLaw(SteadyBar):
    def rate(self, law, values, stress):
        return ck.lower(law, "numpy").rate(values, stress=stress, temperature=1073.15)


class Largest(OfEveryLaw):
    pass


class First(OfEveryLaw):
    def stress(self, history):
        return history.loading.program().values[0]


class Last(OfEveryLaw):
    def stress(self, history):
        return history.loading.program().values[-1]


class Mean(OfEveryLaw):
    """Of the whole test: so that a step changes what came before it."""

    def stress(self, history):
        return history.loading.program().at(history.times).mean()


class Following(OfEveryLaw):
    """The integral of the rate over time, by the rule of trapezoids."""

    def one(self, law, values, history, nuisances):
        program = history.loading.program()
        times = np.union1d(np.linspace(0.0, history.times[-1], 2001), program.times)
        rates = np.broadcast_to(self.rate(law, values, program.at(times)), times.shape)
        strain = np.append(0.0, np.cumsum(0.5 * (rates[1:] + rates[:-1]) * np.diff(times)))
        return {"strain": np.interp(history.times, times, strain)}


class FollowingNortonAlone(Following):
    rate = SteadyBar.rate


class Refusing(SteadyBar):
    def one(self, law, values, history, nuisances):
        stress = history.loading.program().values
        if law != ck.law("norton") or stress.min() != stress.max():
            raise ck.errors.SolveError("Norton's law at one stress alone")
        return super().one(law, values, history, nuisances)


@dataclass(unsafe_hash=True)
class Changeable(Refusing):
    factor: float = 1.0


@dataclass(frozen=True)
class OfList(Refusing):
    levels: Any = None

    def __post_init__(self):
        object.__setattr__(self, "levels", [1.0])


def failed(report: ConformanceReport) -> dict[str, str]:
    return {check.name: check.detail for check in report.failures}


@pytest.mark.parametrize("kind", [Following, Refusing])
def test_what_follows_and_what_refuses_conforms(kind: type[SteadyBar]) -> None:
    report = ck.check_specimen(kind())
    assert report.passed, str(report)


@pytest.mark.parametrize(("kind", "value"), [(Largest, "100"), (First, "80"), (Last, "85")])
def test_a_specimen_that_takes_one_level_of_a_load_is_told_which(kind: type[SteadyBar], value: str) -> None:
    found = failed(ck.check_specimen(kind()))
    assert f"simulated as one of {value} MPa held" in found.pop("steps of load stress")
    assert not found


def test_what_is_seen_before_a_step_does_not_depend_on_it() -> None:
    found = failed(ck.check_specimen(Mean()))
    assert "what is seen before a step must not depend on it" in found.pop("steps of load stress")
    assert not found


def test_a_specimen_of_one_law_refuses_the_others() -> None:
    found = failed(ck.check_specimen(FollowingNortonAlone()))
    assert "KeyError: 'A'" in found.pop("a law with other parameters")
    assert "5.0e-01 off; use the rate of the law that is given" in found.pop("another law with the same parameters")
    assert not found


def test_a_specimen_that_can_be_changed_is_told() -> None:
    assert "write @dataclass(frozen=True)" in failed(ck.check_specimen(Changeable()))["frozen"]
    assert "unhashable type: 'list'; a specimen is a key" in failed(ck.check_specimen(OfList()))["frozen"]
