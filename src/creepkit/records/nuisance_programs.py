"""What the rig did during a test, put into the programs of its history: steps and drifts of temperature and load."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import SolveError
from creepkit.records.history import History
from creepkit.records.loading import Program, RecordedLoading, held_of
from creepkit.records.prediction import PROGRAM_NUISANCES, RATE_NUISANCES, kind_and_start

STEP_DURATION = 5.0
"""s, in which a step of temperature, rate or load takes place: programs stay continuous."""


SCALABLE_LOADS = ("stress", "pressure", "force", "displacement")
"""Quantities of a loading that a load step can change."""


def changed_fields(history: History, values: Mapping[str, float]) -> dict[str, Any]:
    """{field of the history: what it is with nuisances {key: value}} of those that any of them changes.

    Nuisances that change no history do not count. A rate step changes no program; its breakpoints enter the
    temperature's, so that steps of an integration end there.
    """
    changed: dict[str, Any] = {}
    warmer, stiffer = values.get("temperature", 0.0), values.get("modulus", 0.0)
    if warmer:
        program = history.temperature_program()
        changed["temperature"] = Program(program.times, program.values + warmer)
    if stiffer and history.elastic is not None:
        changed["elastic"] = replace(history.elastic, E=history.elastic.E * (1.0 + stiffer))
    for key, value in values.items():
        kind, start = kind_and_start(key)
        if kind == "load step":
            loading = changed.get("loading", history.loading)
            if loading.quantity not in SCALABLE_LOADS:
                raise SolveError(
                    f"{history.origin}: a load step changes a stress or a pressure, and {history.loading.quantity} is "
                    "prescribed here; leave it out for this test"
                )
            merged = _with_breakpoints(loading.program(), step_program(start))
            load = Program(merged.times, merged.values * (1.0 + value * step_program(start).at(merged.times)))
            changed["loading"] = RecordedLoading(load, loading.quantity, held_of(loading))
        elif kind in PROGRAM_NUISANCES or kind == "rate step":
            shape = step_program(start) if start else drift_program(history)
            temperature = changed.get("temperature", history.temperature)
            merged = _with_breakpoints(
                temperature if isinstance(temperature, Program) else Program.constant(temperature), shape
            )
            change = 0.0 if kind in RATE_NUISANCES else value
            changed["temperature"] = Program(merged.times, merged.values + change * shape.at(merged.times))
    return changed


def with_changed_history(history: History, values: Mapping[str, float]) -> History:
    """The history as the rig made it, so many K warmer, its modulus larger by a share, by nuisances {key: value}."""
    changed = changed_fields(history, values)
    return history.replace(**changed) if changed else history


def step_program(start: float) -> Program:
    """0 up to `start`, s, and 1 from STEP_DURATION later on."""
    return Program(np.array([0.0, start, start + STEP_DURATION]), np.array([0.0, 0.0, 1.0]))


def drift_program(history: History) -> Program:
    """0 at the start of the test, 1 at its last used frame, linear in time."""
    return Program(np.array([0.0, drift_duration(history)]), np.array([0.0, 1.0]))


def drift_duration(history: History) -> float:
    """s, from the start of a test to its last used frame."""
    used: Floats = history.times[history.used]
    return float(used[-1] if used.size else history.times[-1])


def _with_breakpoints(program: Program, shape: Program) -> Program:
    """The same program with the breakpoints of `shape`; repeated times, which are jumps, stay."""
    added = np.setdiff1d(shape.times, program.times)
    times, values = np.append(program.times, added), np.append(program.values, program.at(added))
    order = np.argsort(times, kind="stable")
    return Program(times[order], values[order])
