"""Data quality: checks of measured histories, each flag stated with numbers; nothing is dropped unless asked for.

Of frames: fracture, unloading, a creep output that decreases though its load does not, single outliers. Of tests: one
with the readings of another, replicates that differ, strain of loading that nothing states, a strain above 100 %, a
record of load or temperature that contradicts the stated program. What one test says against all others, a fit tells.
Of the rig: a jump of an output without a step of the load, a step of a strain by thermal expansion, idle time in which
nothing crept.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from typing import get_args

import numpy as np

from creepkit.checked_arguments import checked
from creepkit.errors import HistoryError
from creepkit.language.elastic import STATE_MODULUS
from creepkit.quality.few_readings import doubtful_readings
from creepkit.quality.flags import DataQuality, FlagKind, QualityFlag, frame_ranges_text
from creepkit.quality.frames import decreasing_frames, fracture_frames, outlier_frames, unloading_frames
from creepkit.quality.idle_time import idle_flags
from creepkit.quality.loading_strain import unstated_loading_strain
from creepkit.quality.repeats import copied_tests, repeated_rows, replicate_deviations
from creepkit.quality.rig import expansion_flags, find_jumps, jump_flags, record_flags
from creepkit.readers.ends_of_tests import invalidity_said_by
from creepkit.readers.vocabulary import unit_suffix
from creepkit.records import History, known_specimens, output_named
from creepkit.records.units import UNITS

__all__ = [
    "FRAME_FLAG_KINDS",
    "DataQuality",
    "QualityFlag",
    "check_data_quality",
    "check_loading_strain",
    "check_rig",
    "copy_reason",
    "exclude_suspect_frames",
    "remark_flags",
    "repeated_row_notes",
    "without_copies",
]


LEVEL_AGREEMENT = 2e-3
"""Relative, of a level that a remark names and one of the test."""


FRAME_FLAG_KINDS: tuple[FlagKind, ...] = ("fracture", "unloading", "falling", "outlier")
"""Kinds that concern frames, which can be marked; the others question whole tests."""


@checked
def check_data_quality(histories: Sequence[History]) -> DataQuality:
    """What looks wrong: frames, tests that are copies of others or far from them, and what the rig did.

    Tests are compared where they are of the same alloy and specimen and were loaded alike.
    """
    framed = [_frame_flags(history, FRAME_FLAG_KINDS) for history in histories]
    flags = [flag for each in framed for flag in each]
    flags += [flag for rule in TEST_RULES for flag in rule(histories)]
    order = {history.name: k for k, history in enumerate(histories)}
    flags.sort(key=lambda flag: order[flag.tests[0]])
    sound = [
        _with_frames_unused(history, [k for flag in each for k in flag.frames])
        for history, each in zip(histories, framed, strict=True)
    ]
    flags += check_loading_strain(sound)
    flags += check_rig(sound)
    return DataQuality(tuple(flags), len(histories))


def _copy_flags(histories: Sequence[History]) -> Iterator[QualityFlag]:
    for k, original in copied_tests(histories).items():
        yield QualityFlag((histories[k].name,), "copy", (), copy_reason(histories[original]))


def _replicate_flags(histories: Sequence[History]) -> Iterator[QualityFlag]:
    """Replicates that differ, and rows of tables that repeat others."""
    differing = list(replicate_deviations(histories))
    yield from differing
    for k, reason in _row_reasons(histories).items():
        if histories[k].name not in [name for flag in differing for name in flag.tests]:
            yield QualityFlag((histories[k].name,), "replicate", (), reason)


def _doubtful_units(histories: Sequence[History]) -> Iterator[QualityFlag]:
    """Strains above one, as of percent read as fractions; growths that begin at a length of the test piece."""
    for one in histories:
        strain = float(np.nanmax(np.abs(one.outputs.get("strain", 0.0)), initial=0.0))
        reasons = [f"the strain reaches {100 * strain:.4g} %; look whether its unit is right"] * (strain > 1.0)
        reasons += [
            f"{output} begins at the {name}; take the first reading off its column, for creep is what it grows"
            for output in one.outputs
            if (name := output_named(output, one.specimen).change_of.lstrip("-")) in one.geometry
            and abs(one.outputs[output][0] / one.geometry[name] - 1) < 0.1
        ]
        yield from (QualityFlag((one.name,), "unit", (), reason) for reason in reasons)


def _unstated_moduli(histories: Sequence[History]) -> Iterator[QualityFlag]:
    """Tests whose specimen needs Young's modulus, which nothing states: one flag."""
    needing = {name for name, one in known_specimens().items() if "modulus" in one.conditions}
    names = [history.name for history in histories if history.elastic is None and history.specimen in needing]
    if names:
        yield QualityFlag(tuple(names), "modulus", (), "no simulation goes without it", proposal=STATE_MODULUS)


_CHANGED = re.compile(
    r"increas|rais|lower|reduc|chang|stepp|erhöh|gesenkt|senk|geändert|gesteigert|augment|rédui|abaiss|modifi|port[ée]",
    re.IGNORECASE,
)
_LEVEL = re.compile(r"(\d+(?:[.,]\d+)?)\s*(MPa|ksi|psi|N/mm2|N/mm²|° ?[CF]|deg\.? ?[CF]|K)(?!\w)")


def _changes_told(history: History) -> Iterator[tuple[str, str]]:
    """Labels that tell of a change to a stress or a temperature that the test never has, and that level."""
    programs = {"temperature": history.temperature_program(), history.loading.quantity: history.loading.program()}
    for label, text in history.labels.items() if history.outputs else ():
        levels = _LEVEL.findall(text) if label != "assumed" and _CHANGED.search(text) else ()
        for number, written in levels:
            unit = UNITS[unit_suffix(written) or "MPa"]
            value = unit.conversion.factor * float(number.replace(",", ".")) + unit.conversion.offset
            program = programs.get(unit.quantity)
            if program is not None and np.abs(program.values - value).min() > LEVEL_AGREEMENT * value:
                yield label, f"{number} {written}"


def remark_flags(histories: Sequence[History]) -> Iterator[QualityFlag]:
    """Tests of which a remark says that they do not count, or that their load or temperature was changed."""
    for history in histories:
        for label, level in _changes_told(history):
            reason = f"'{label}' tells of a change to {level}, which the test never has"
            yield QualityFlag((history.name,), "remark", (), reason, proposal="state its steps in the head of its file")
    for history in histories:
        for label, text in history.labels.items():
            if label != "assumed" and invalidity_said_by(text) == "invalid":
                line = f'[[exclude]] test = "{history.name}" reason = "its remark"'
                advice = f"to leave it out write into study.toml, in three lines: {line}"
                yield QualityFlag((history.name,), "remark", (), f"'{label}' says '{text}'", proposal=advice)
                break


TEST_RULES: tuple[Callable[[Sequence[History]], Iterable[QualityFlag]], ...] = (
    _copy_flags,
    _replicate_flags,
    _doubtful_units,
    _unstated_moduli,
    remark_flags,
)
"""What questions whole tests, each by itself or beside the others."""


def copy_reason(original: History) -> str:
    """Why a test that is a copy counts not at all beside its original."""
    return f"the same readings as {original.name}: one test, which counts once"


def without_copies(histories: Sequence[History]) -> tuple[list[History], dict[str, str]]:
    """The histories without those that are copies of others, and {name of a copy: why it is left out}."""
    copies = copied_tests(histories)
    kept = [history for k, history in enumerate(histories) if k not in copies]
    return kept, {histories[k].name: copy_reason(histories[original]) for k, original in copies.items()}


def repeated_row_notes(histories: Sequence[History]) -> tuple[str, ...]:
    """Rows of tables that state the numbers of other rows: how many and an example, in one sentence; () for none."""
    reasons = _row_reasons(histories)
    if not reasons:
        return ()
    example, reason = next(iter(reasons.items()))
    count = len(reasons) - 1
    others = f" (and {count} more such test{'s' * (count > 1)})" if count else ""
    return (f"{histories[example].name}{others}: {reason}",)


def _row_reasons(histories: Sequence[History]) -> dict[int, str]:
    return {
        k: f"the same numbers as {histories[earlier].name}, to all digits: each counts; leave one of them out if a "
        "table was read twice"
        for k, earlier in repeated_rows(histories).items()
    }


def check_loading_strain(histories: Sequence[History]) -> list[QualityFlag]:
    """Histories whose strain seems to hold strain of loading that nothing states; whole, for no frame is to blame."""
    return [flag for history in histories if (flag := unstated_loading_strain(history)) is not None]


def check_rig(histories: Sequence[History]) -> list[QualityFlag]:
    """What the rig did: records that differ from the program, idle time, jumps and thermal expansion.

    histories : without suspect frames, see exclude_suspect_frames.
    """
    flags = [flag for history in histories for flag in (*record_flags(history), *idle_flags(history))]
    flags += jump_flags(histories, find_jumps(histories))
    return [*flags, *(flag for history in histories for flag in expansion_flags(history))]


@checked
def exclude_suspect_frames(histories: Sequence[History], kinds: Collection[str] = FRAME_FLAG_KINDS) -> list[History]:
    """The histories with their suspect frames unused, and a label `suspect` that says which and why.

    kinds : "fracture", "unloading", "falling" and "outlier" or some of them. Whole tests are never dropped.
    """
    for kind in kinds:
        if kind not in FRAME_FLAG_KINDS:
            known = ", ".join(FRAME_FLAG_KINDS)
            also = "; that kind questions a whole test" if kind in get_args(FlagKind) else ""
            raise HistoryError(f"frames cannot be marked for '{kind}'{also}; the kinds of frames are {known}")
    return [_with_flags_excluded(history, _frame_flags(history, kinds)) for history in histories]


def _frame_flags(history: History, kinds: Collection[str]) -> list[QualityFlag]:
    """Suspect frames of a history; each check uses the frames that those before it have left."""
    result: list[QualityFlag] = []
    searches = (fracture_frames, unloading_frames, decreasing_frames, _outliers)
    for kind, search in zip(FRAME_FLAG_KINDS, searches, strict=True):
        if kind in kinds and (found := list(search(history))):
            history = _with_frames_unused(history, [k for flag in found for k in flag.frames])
            result += found
    return result


def _outliers(history: History) -> Iterator[QualityFlag]:
    found = list(outlier_frames(history))
    yield from found
    yield from (one for one in doubtful_readings(history) if one.frames not in [other.frames for other in found])


def _with_frames_unused(history: History, frames: Sequence[int]) -> History:
    used = np.array(history.used)
    used[list(frames)] = False
    return history.replace(used=used)


def _with_flags_excluded(history: History, flags: Sequence[QualityFlag]) -> History:
    frames = [k for suspect in flags for k in suspect.frames]
    if not frames:
        return history
    description = "; ".join(f"{suspect.kind}, {frame_ranges_text(suspect.frames)}" for suspect in flags)
    return _with_frames_unused(history, frames).replace(labels={**history.labels, "suspect": description})
