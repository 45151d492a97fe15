"""Which criteria each box has."""

from __future__ import annotations

from creepkit.dataset.conditions import BULGE
from creepkit.dataset.criteria import (
    ConstraintsHold,
    TotalCreepAbove,
    Criterion,
    FinalOutputAbove,
    CreepInEachHold,
    SurvivesTime,
    RateLimit,
    WithinBounds,
)
from creepkit.language import CreepLaw

PAPER_LEAST_CREEP = {"bulge": 0.01, "uniaxial": 1e-4}
"""mm of amplitude, of criteria 4 and 5: twice the resolution of the paper's cameras; and the like of a strain."""

VISIBLE_CREEP = {"bulge": 0.02, "uniaxial": 2e-4}
"""Creep, mm and strain, that an informative sample shows."""


def paper_criteria(kind: str) -> tuple[Criterion, ...]:
    """Criteria 1 to 5 of the paper; of a bar 4 and 5 speak of its strain."""
    least = _with_unit(kind, PAPER_LEAST_CREEP[kind])
    output = "amplitude" if kind == BULGE else "strain"
    return (
        RateLimit("1", "rate of 1e-20 1/s or more at 600 MPa, strain .01, 10,000 s", 600.0, lower=-20.0),
        RateLimit("2", "rate of 1 1/s or less at 50 MPa, strain .01, 10,000 s", 50.0, upper=0.0),
        SurvivesTime("3", "simulation converged and lasted 1 h", 3600.0),
        CreepInEachHold("4", f"creep of more than {least} in each hold", PAPER_LEAST_CREEP[kind]),
        FinalOutputAbove("5", f"{output} of more than {least} at the end", PAPER_LEAST_CREEP[kind]),
    )


def conditioned_criteria(law: CreepLaw, kind: str, end: float) -> tuple[Criterion, ...]:
    """What the conditioned box asks: a law as its author means it, a full history, and visible creep."""
    label = ("constraints", "what the law declares of its parameters holds throughout the test")
    constraint_criteria = (ConstraintsHold(*label, end),) if law.constraints else ()
    return (
        WithinBounds("bounds", "every parameter lies within the law's bounds"),
        *constraint_criteria,
        SurvivesTime("full history", "simulation went on to the end of the test"),
        TotalCreepAbove("visible creep", f"creep of {_with_unit(kind, VISIBLE_CREEP[kind])} or more", VISIBLE_CREEP[kind]),
    )


def _with_unit(kind: str, value: float) -> str:
    return f"{value:g} mm" if kind == BULGE else f"{value:g}"
