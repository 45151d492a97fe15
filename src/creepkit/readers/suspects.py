"""What looks wrong in measured histories, said with numbers; nothing is dropped unless it is asked for.

Of frames: those of the unloading, an amplitude that falls though its load does not, single frames that jump. Of tests:
one far from its twins or from the trend of the others, a modulus out of line, a first frame that is not elastic.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from creepkit.errors import HistoryError
from creepkit.readers.suspect_frames import Finding, falling, outliers, unloading
from creepkit.readers.suspect_tests import far_from_twins, first_frames, moduli_out_of_line, temperatures_out_of_line
from creepkit.records import History, Predictor

Kind = Literal["unloading", "falling", "outlier", "twin", "first frame", "temperature", "modulus"]
OF_FRAMES: tuple[Kind, ...] = ("unloading", "falling", "outlier")
"""Kinds that concern frames, which can be marked; the others question whole tests."""


@dataclass(frozen=True)
class Suspect:
    """Something of a history that a fit should perhaps not believe.

    history : its name. kind : what is wrong. frames : which of its frames, counted from 0; empty for the whole test.
    reason : a sentence with the numbers.
    """

    history: str
    kind: Kind
    frames: tuple[int, ...]
    reason: str

    def __str__(self) -> str:
        which = f"{_listed(self.frames)}: " if self.frames else ""
        return f"{self.history}: {self.kind}: {which}{self.reason}"


def suspects(histories: Sequence[History], specimen: Predictor | None = None) -> tuple[Suspect, ...]:
    """Everything suspect in the histories, test by test.

    specimen : what predicts the elastic deflection of a first frame; without it first frames are believed. Tests are
    compared where they are of the same alloy and specimen and were loaded alike.
    """
    found = [[*_of_frames(history, OF_FRAMES)] for history in histories]
    compared: list[tuple[Kind, dict[int, str]]] = [
        ("twin", far_from_twins(histories)),
        ("temperature", temperatures_out_of_line(histories)),
        ("modulus", moduli_out_of_line(histories)),
    ]
    if specimen is not None:
        compared.append(("first frame", first_frames(histories, specimen)))
    for kind, reasons in compared:
        for k, reason in reasons.items():
            frames = (int(np.argmax(histories[k].used)),) if kind == "first frame" else ()
            found[k].append(Suspect(histories[k].name, kind, frames, reason))
    return tuple(suspect for each in found for suspect in each)


def with_suspects_marked(histories: Sequence[History], kinds: Collection[str] = OF_FRAMES) -> list[History]:
    """The histories with their suspect frames unused, and a label `suspect` that says which and why.

    kinds : "unloading", "falling" and "outlier" or some of them. Whole tests are never dropped: a fit with a robust
    loss of tests weighs them.
    """
    for kind in kinds:
        if kind not in OF_FRAMES:
            known = ", ".join(OF_FRAMES)
            also = "; that kind questions a whole test" if kind in get_args(Kind) else ""
            raise HistoryError(f"frames cannot be marked for '{kind}'{also}; the kinds of frames are {known}")
    return [_marked(history, _of_frames(history, kinds)) for history in histories]


def _of_frames(history: History, kinds: Collection[str]) -> list[Suspect]:
    """Suspect frames of a history; each kind looks at what those before it have left."""
    found, rest = [], history
    searches: list[tuple[Kind, Finding]] = []
    for kind, search in zip(OF_FRAMES, (unloading, falling, outliers), strict=True):
        if kind in kinds:
            searches = [(kind, finding) for finding in search(rest)]
            found += [Suspect(history.name, kind, finding.frames, finding.reason) for kind, finding in searches]
            rest = _without(rest, [k for _, finding in searches for k in finding.frames])
    return found


def _without(history: History, frames: Sequence[int]) -> History:
    used = np.array(history.used)
    used[list(frames)] = False
    return history.replace(used=used)


def _marked(history: History, found: Sequence[Suspect]) -> History:
    frames = [k for suspect in found for k in suspect.frames]
    if not frames:
        return history
    told = "; ".join(f"{suspect.kind}, {_listed(suspect.frames)}" for suspect in found)
    return _without(history, frames).replace(labels={**history.labels, "suspect": told})


def _listed(frames: Sequence[int]) -> str:
    """Frames as people write them: 'frames 97-191, 193'."""
    runs: list[list[int]] = []
    for k in sorted(frames):
        if runs and k == runs[-1][-1] + 1:
            runs[-1] = [runs[-1][0], k]
        else:
            runs.append([k])
    text = ", ".join("-".join(map(str, run)) for run in runs)
    return f"frame{'s' if len(frames) > 1 else ''} {text}"
