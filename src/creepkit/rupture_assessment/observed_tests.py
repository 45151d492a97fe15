"""Rupture tests as arrays: what a rupture assessment needs of histories, with or without frames."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from creepkit.arrays import Bools, Floats, frozen
from creepkit.errors import HistoryError, quoted
from creepkit.inverse.reference_conditions import ISOTHERMAL_RANGE
from creepkit.quality import repeated_row_notes
from creepkit.readers.ends_of_tests import invalidity_said_by
from creepkit.records import SECONDS_PER_HOUR, History

TensileStrength = Callable[[Floats], Floats]
"""MPa at temperatures in K, arrays of one shape; NaN where it is not known."""


TENSILE_LABEL = "tensile_strength_MPa"
"""Label of a history, or column of a table, with the tensile strength at the temperature of the test, MPa."""

GROUP_LABELS = ("heat", "laboratory")
"""Labels of histories whose values scatter: each is a random effect where tests have two or more values of it."""

NOT_STATED = "not stated"


@dataclass(frozen=True, eq=False)
class RuptureTests:
    """Rupture tests, one place in every array each.

    log_time : (tests,) log10 of the time to rupture, or to the end of a run-out, in hours. censored : (tests,)
    run-outs.
    stress : (tests,) MPa, constant and nominal. temperature : (tests,) K.
    tensile_strength : (tests,) MPa, at the temperature of the test; NaN where it is not known.
    minimum_rate : (tests,) 1/s, the minimum creep rate; NaN where it is not known.
    groups : {"heat": (tests,) names, "laboratory": ...}, of labels that scatter.
    """

    names: tuple[str, ...]
    log_time: Floats
    censored: Bools
    stress: Floats
    temperature: Floats
    tensile_strength: Floats
    minimum_rate: Floats
    groups: Mapping[str, tuple[str, ...]]

    def __len__(self) -> int:
        return len(self.names)

    def __getitem__(self, kept: Any) -> RuptureTests:
        """The tests at some places."""
        places = np.arange(len(self))[kept]
        arrays = {f: getattr(self, f)[places] for f in ARRAYS}
        names = tuple(self.names[k] for k in places)
        return replace(
            self, names=names, groups={g: tuple(v[k] for k in places) for g, v in self.groups.items()}, **arrays
        )

    @property
    def ruptured(self) -> int:
        """How many tests broke."""
        return int((~self.censored).sum())

    @property
    def isothermal(self) -> bool:
        """Whether the temperatures are too near one another to tell how rupture depends on them."""
        return bool(np.ptp(self.temperature) <= ISOTHERMAL_RANGE)

    @property
    def isotherms(self) -> tuple[float, ...]:
        """Temperatures of the tests, K, ascending; those within 5 K are one, their mean."""
        means: list[list[float]] = []
        for T in np.sort(self.temperature):
            if means and T - means[-1][0] <= ISOTHERMAL_RANGE:
                means[-1].append(float(T))
            else:
                means.append([float(T)])
        return tuple(round(float(np.mean(m)), 6) for m in means)

    @property
    def fingerprint(self) -> str:
        """Of all numbers and groups: assessments that share it saw the same tests."""
        digest = hashlib.sha256()
        for name in ARRAYS:
            digest.update(np.ascontiguousarray(getattr(self, name)).tobytes())
        digest.update(repr(sorted(self.groups.items())).encode())
        return digest.hexdigest()[:16]


ARRAYS = ("log_time", "censored", "stress", "temperature", "tensile_strength", "minimum_rate")


LOADING_TIME, STEADY_STRESS = 0.02, 0.02
"""Of the time of a test, within which its load is put on; and of the stress, by which it may change after that."""


def rupture_tests(histories: Sequence[History]) -> tuple[RuptureTests, RuptureTests, tuple[str, ...]]:
    """Tests whose end is known, tests with a minimum creep rate, and notes on what was left out.

    HistoryError for a test without a stress and one temperature, or when there is none to assess.
    """
    histories, notes = _valid(histories)
    known = [h for h in histories if h.end_known]
    with_rate = [h for h in histories if h.minimum_rate is not None]
    if not any(h.rupture_time is not None for h in histories):
        raise HistoryError(
            f"none of {len(histories)} tests broke; an assessment needs rupture times, such as a key rupture_time_h or "
            "a column of a table"
        )
    alloys = sorted({h.alloy for h in known if h.alloy})
    if len(alloys) > 1:
        raise HistoryError(
            f"the tests are of {len(alloys)} alloys ({', '.join(alloys[:4])}); assess one, by "
            f"--only alloy={alloys[0]} or select_tests(tests, alloy='{alloys[0]}')"
        )
    silent = sum(not h.end_known and h.minimum_rate is None for h in histories)
    if silent:
        notes.append(f"{silent} tests say neither when they broke nor that they were stopped before; they are left out")
    seen: set[tuple[object, ...]] = set()
    repeated = []
    for h in known:
        numbers = (h.rupture_time or float(h.times[-1]), h.unruptured, _constant_stress(h), _constant_temperature(h))
        key = (*numbers, *(h.labels.items() if h.unruptured else [h.labels.get("heat", "")]))
        if key in seen:
            repeated.append(h.name)
        seen.add(key)
    if repeated:
        notes.append(
            f"{len(repeated)} tests have the stress, temperature and time of another one, such as '{repeated[0]}'; "
            "leave them out if a table was read twice, for each counts"
        )
    notes += repeated_row_notes([h for h in with_rate if not h.end_known])
    return _as_arrays(known), _as_arrays(with_rate), tuple(notes)


def _valid(histories: Sequence[History]) -> tuple[list[History], list[str]]:
    """The tests under one stress that no label says to be invalid; notes on others and on what broke elsewhere."""
    said: dict[str, list[tuple[History, str]]] = {"invalid": [], "elsewhere": [], "steps": []}
    for h in histories:
        stresses = _stresses_after_loading(h) if h.loading.quantity == "stress" else np.ones(1)
        if np.ptp(stresses) > STEADY_STRESS * stresses.max():
            said["steps"].append((h, f"the stress changes from {stresses.min():.4g} to {stresses.max():.4g} MPa"))
            continue
        for name, text in h.labels.items():
            if isinstance(text, str) and (kind := invalidity_said_by(text)):
                said[kind].append((h, f"{name} says '{text}'"))
                break
    words = {"invalid": "left out as invalid", "elsewhere": "broken elsewhere than in the gauge length, and counted"}
    words["steps"] = "left out for steps of load"
    notes = [
        f"tests {words[kind]}: {len(found)}, such as '{found[0][0].name}', of which {found[0][1]}"
        for kind, found in said.items()
        if found
    ]
    left_out = {id(h) for h, _ in (*said["invalid"], *said["steps"])}
    return [h for h in histories if id(h) not in left_out], notes


def _as_arrays(histories: Sequence[History]) -> RuptureTests:
    times = [h.rupture_time or float(h.times[-1]) for h in histories]
    for history, time in zip(histories, times, strict=True):
        if not time > 0:
            raise HistoryError(f"{history.origin}: it ended at {time:g} s; a run-out needs a time above zero")
    return RuptureTests(
        tuple(h.name for h in histories),
        frozen(np.log10(np.array(times, float) / SECONDS_PER_HOUR)),
        frozen([h.unruptured for h in histories], dtype=bool),
        frozen([_constant_stress(h) for h in histories]),
        frozen([_constant_temperature(h) for h in histories]),
        frozen([_tensile_strength(h) for h in histories]),
        frozen([np.nan if h.minimum_rate is None else h.minimum_rate for h in histories]),
        _groups(histories),
    )


def _constant_stress(history: History) -> float:
    if history.loading.quantity != "stress":
        raise HistoryError(
            f"{history.origin}: its load is a {history.loading.quantity}; a rupture assessment needs tests of one "
            "constant stress"
        )
    stress = float(np.median(_stresses_after_loading(history)))
    if not stress > 0:
        raise HistoryError(f"{history.origin}: its stress is {stress:g} MPa; a rupture test needs one above zero")
    return stress


def _stresses_after_loading(history: History) -> Floats:
    """(levels,) MPa, of the program once the load was put on."""
    program = history.loading.program()
    end = history.rupture_time or (float(history.times[-1]) if history.times.size else 0.0)
    times = program.times[(program.times > LOADING_TIME * end) & (program.times <= end)]
    return program.at(np.array([LOADING_TIME * end, *times]))


def _constant_temperature(history: History) -> float:
    span = float(np.ptp(history.temperature_program().values))
    if span > ISOTHERMAL_RANGE:
        raise HistoryError(
            f"{history.origin}: its temperature changes by {span:.0f} K; leave out tests with steps of temperature"
        )
    return history.mean_temperature


def _tensile_strength(history: History) -> float:
    text = history.labels.get(TENSILE_LABEL, "")
    if not str(text).strip():
        return float("nan")
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not (np.isfinite(value) and value > 0):
        raise HistoryError(f"{history.origin}: {TENSILE_LABEL} is '{text}'; give a number above zero, in MPa")
    return value


def _groups(histories: Sequence[History]) -> dict[str, tuple[str, ...]]:
    """Labels with at least two values, one of which at least two tests share."""
    groups = {}
    for label in GROUP_LABELS:
        values = tuple(h.labels.get(label, "") or NOT_STATED for h in histories)
        if 1 < len(set(values)) < len(values):
            groups[label] = values
    return groups


def tensile_strengths(tests: RuptureTests, stated: Mapping[float, float] | None) -> tuple[Floats, Floats]:
    """Tensile strengths to interpolate, (known,) K and MPa, by temperature: as stated, else as tests have them.

    Both are empty where nothing is known.
    """
    if stated:
        pairs = sorted((float(T), float(s)) for T, s in stated.items())
        if not all(0 < T < 1e4 and 0 < s < 1e5 for T, s in pairs):
            raise HistoryError(
                f"tensile_strength is {quoted(repr(stated), 60)}; give numbers above zero: MPa by temperature in K"
            )
    else:
        known = np.isfinite(tests.tensile_strength)
        pairs = [
            (T, float(tests.tensile_strength[known & near].mean()))
            for T in tests.isotherms
            if (known & (near := np.abs(tests.temperature - T) <= ISOTHERMAL_RANGE)).any()
        ]
    temperatures, strengths = zip(*pairs, strict=True) if pairs else ((), ())
    return frozen(temperatures), frozen(strengths)
