"""Which criteria each box has."""

from __future__ import annotations

from creepkit.dataset.conditions import BULGE
from creepkit.dataset.criteria import (
    ConstraintsHold,
    Creeps,
    Criterion,
    EndsAbove,
    GrowsInEachHold,
    Lasts,
    RateLimit,
    WithinBounds,
)
from creepkit.language import CreepLaw

LEAST = {"bulge": 0.01, "uniaxial": 1e-4}
"""mm of amplitude, of criteria 4 and 5: twice the resolution of the paper's cameras; and the like of a strain."""

VISIBLE = {"bulge": 0.02, "uniaxial": 2e-4}
"""Creep, mm and strain, that an informative sample shows."""


def paper_criteria(kind: str) -> tuple[Criterion, ...]:
    """Criteria 1 to 5 of the paper; of a bar 4 and 5 speak of its strain."""
    least = _amount(kind, LEAST[kind])
    end = "amplitude" if kind == BULGE else "strain"
    return (
        RateLimit("1", "rate of 1e-20 1/s or more at 600 MPa, strain .01, 10,000 s", 600.0, least=-20.0),
        RateLimit("2", "rate of 1 1/s or less at 50 MPa, strain .01, 10,000 s", 50.0, most=0.0),
        Lasts("3", "simulation converged and lasted 1 h", 3600.0),
        GrowsInEachHold("4", f"creep of more than {least} in each hold", LEAST[kind]),
        EndsAbove("5", f"{end} of more than {least} at the end", LEAST[kind]),
    )


def informative(law: CreepLaw, kind: str, end: float) -> tuple[Criterion, ...]:
    """What the conditioned box asks: a law as its author means it, a full history, and visible creep."""
    told = ("constraints", "what the law declares of its parameters holds throughout the test")
    declared = (ConstraintsHold(*told, end),) if law.constraints else ()
    return (
        WithinBounds("bounds", "every parameter lies within the law's bounds"),
        *declared,
        Lasts("full history", "simulation went on to the end of the test"),
        Creeps("visible creep", f"creep of {_amount(kind, VISIBLE[kind])} or more", VISIBLE[kind]),
    )


def _amount(kind: str, value: float) -> str:
    return f"{value:g} mm" if kind == BULGE else f"{value:g}"
