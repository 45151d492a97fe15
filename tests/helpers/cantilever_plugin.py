"""A plugin of one file: the cantilever, whose force and deflection have names that no option of a command has."""

from dataclasses import dataclass

import creepkit as ck
from helpers.cantilever import Cantilever


@dataclass(frozen=True)
class EndLoaded(Cantilever):
    """A cantilever of rectangular section under a force at its end."""

    name = "test-cantilever"
    outputs = (ck.Output("end_deflection", "length", "deflection of the end", noise=0.002),)
    loads = (ck.Load("end_force", "force"),)
    conditions = {"end_force": (5.0, 20.0)}  # noqa: RUF012

    def one(self, law, values, history, nuisances):
        """The deflection of the end, mm."""
        return {"end_deflection": super().one(law, values, history, nuisances)["deflection"]}


@ck.hookimpl
def creepkit_specimens():
    """The cantilever."""
    return [EndLoaded()]
