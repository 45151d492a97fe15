"""Data quality: checks of measured histories, each flag stated with numbers; nothing is dropped unless asked for.

Of frames: unloading, a creep output that decreases though its load does not, single outliers. Of tests: one far from
its replicates or from the trend of the others, a modulus off the trend, a first frame that is not elastic.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from creepkit.errors import HistoryError
from creepkit.quality.comparison import (
    first_frame_deviations,
    modulus_trend_outliers,
    replicate_deviations,
    temperature_trend_outliers,
)
from creepkit.quality.frames import FlaggedFrames, decreasing_frames, outlier_frames, unloading_frames
from creepkit.records import History, Predictor

FlagKind = Literal["unloading", "falling", "outlier", "replicate", "first frame", "temperature", "modulus"]


FRAME_FLAG_KINDS: tuple[FlagKind, ...] = ("unloading", "falling", "outlier")
"""Kinds that concern frames, which can be marked; the others question whole tests."""


@dataclass(frozen=True)
class QualityFlag:
    """Something of a history that may be wrong and should perhaps not be fitted.

    history : its name. kind : what is wrong. frames : which of its frames, counted from 0; empty for the whole test.
    reason : a sentence with the numbers.
    """

    history: str
    kind: FlagKind
    frames: tuple[int, ...]
    reason: str

    def __str__(self) -> str:
        which = f"{_frame_ranges_text(self.frames)}: " if self.frames else ""
        return f"{self.history}: {self.kind}: {which}{self.reason}"


def check_data_quality(histories: Sequence[History], specimen: Predictor | None = None) -> tuple[QualityFlag, ...]:
    """Everything suspect in the histories, test by test.

    specimen : what predicts the elastic deflection of a first frame; without it first frames are not checked. Tests are
    compared where they are of the same alloy and specimen and were loaded alike.
    """
    results = [[*_frame_flags(history, FRAME_FLAG_KINDS)] for history in histories]
    test_checks: list[tuple[FlagKind, dict[int, str]]] = [
        ("replicate", replicate_deviations(histories)),
        ("temperature", temperature_trend_outliers(histories)),
        ("modulus", modulus_trend_outliers(histories)),
    ]
    if specimen is not None:
        test_checks.append(("first frame", first_frame_deviations(histories, specimen)))
    for kind, reasons in test_checks:
        for k, reason in reasons.items():
            frames = (int(np.argmax(histories[k].used)),) if kind == "first frame" else ()
            results[k].append(QualityFlag(histories[k].name, kind, frames, reason))
    return tuple(suspect for each in results for suspect in each)


def exclude_suspect_frames(histories: Sequence[History], kinds: Collection[str] = FRAME_FLAG_KINDS) -> list[History]:
    """The histories with their suspect frames unused, and a label `suspect` that says which and why.

    kinds : "unloading", "falling" and "outlier" or some of them. Whole tests are never dropped: a fit with a robust
    loss of tests weighs them.
    """
    for kind in kinds:
        if kind not in FRAME_FLAG_KINDS:
            known = ", ".join(FRAME_FLAG_KINDS)
            also = "; that kind questions a whole test" if kind in get_args(FlagKind) else ""
            raise HistoryError(f"frames cannot be marked for '{kind}'{also}; the kinds of frames are {known}")
    return [_with_flags_excluded(history, _frame_flags(history, kinds)) for history in histories]


def _frame_flags(history: History, kinds: Collection[str]) -> list[QualityFlag]:
    """Suspect frames of a history; each check uses the frames that those before it have left."""
    result, remaining = [], history
    kind_findings: list[tuple[FlagKind, FlaggedFrames]] = []
    for kind, search in zip(FRAME_FLAG_KINDS, (unloading_frames, decreasing_frames, outlier_frames), strict=True):
        if kind in kinds:
            kind_findings = [(kind, finding) for finding in search(remaining)]
            result += [
                QualityFlag(history.name, kind, finding.frames, finding.reason) for kind, finding in kind_findings
            ]
            remaining = _with_frames_unused(remaining, [k for _, finding in kind_findings for k in finding.frames])
    return result


def _with_frames_unused(history: History, frames: Sequence[int]) -> History:
    used = np.array(history.used)
    used[list(frames)] = False
    return history.replace(used=used)


def _with_flags_excluded(history: History, flags: Sequence[QualityFlag]) -> History:
    frames = [k for suspect in flags for k in suspect.frames]
    if not frames:
        return history
    description = "; ".join(f"{suspect.kind}, {_frame_ranges_text(suspect.frames)}" for suspect in flags)
    return _with_frames_unused(history, frames).replace(labels={**history.labels, "suspect": description})


def _frame_ranges_text(frames: Sequence[int]) -> str:
    """Frames as people write them: 'frames 97-191, 193'."""
    runs: list[list[int]] = []
    for k in sorted(frames):
        if runs and k == runs[-1][-1] + 1:
            runs[-1] = [runs[-1][0], k]
        else:
            runs.append([k])
    text = ", ".join("-".join(map(str, run)) for run in runs)
    return f"frame{'s' if len(frames) > 1 else ''} {text}"
