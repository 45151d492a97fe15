"""Hostile texts in every field of a law, through every exporter; what is written is compiled, run and compared."""

from __future__ import annotations

import re
import shutil
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import creepkit as ck
from creepkit.errors import CreepkitError
from creepkit.records import LawWithValues
from execution_attempts import texts
from execution_attempts.canaries import FAULTS, Attempt, Control, Found
from execution_attempts.driven import DRIVEN, judged_text, seen

SECTION = "Hostile texts through exporters"
ITSELF = "the law itself"
PLACE = "a note"
"""The note of the plain law, in the place of which an exporter that protects nothing writes a text as it is."""

AT_COST = ("title", "note")
"""Fields whose texts are compiled one at a time; the others are compiled together."""

PROGRAMS = ("python", "numpy", "abaqus", "calculix", "c", "javascript", "mfront")


@cache
def expected(exporter: str, kind: str) -> tuple[str, ...] | None:
    """What the plain law gives; None where the exporter does not take it."""
    try:
        text = ck.available("exporters")[exporter].text(texts.plain_law(kind))
    except CreepkitError:
        return None
    with tempfile.TemporaryDirectory(prefix="attempts_") as folder:
        return seen(exporter, text, Path(folder))


def outcome_of(exporter: str, source: LawWithValues, kind: str) -> tuple[str, str]:
    """Outcome and detail of one law through one exporter."""
    target = expected(exporter, kind)
    try:
        text = ck.available("exporters")[exporter].text(source)
    except CreepkitError:
        return "refused", ""
    except Exception as error:
        return "traceback", f"{type(error).__name__}: {error}"
    if target is None:
        return "broken", "the plain law is refused, and this one is not"
    return _judged(exporter, text, target)


@cache
def _judged(exporter: str, text: str, target: tuple[str, ...]) -> tuple[str, str]:
    """Kept: many texts are written alike, where a field is none of the target's."""
    with tempfile.TemporaryDirectory(prefix="attempts_") as folder:
        return judged_text(exporter, text, target, Path(folder))


def attempts(short: bool) -> Found:
    """Each text in each field, and in all of them at once, through each exporter that takes the law."""
    chosen = {name: texts.PAYLOADS[name] for name in (texts.SHORT if short else texts.PAYLOADS)}
    for name, text in chosen.items():
        for kind in texts.LAWS:
            for field in texts.FIELDS:
                outcome = texts.takes(kind, field, text)
                if outcome:
                    yield Attempt(SECTION, ITSELF, *_of_the_law(outcome, f"{field}: {name}"))
            one_by_one = texts.FIELDS if kind == texts.STRAIGHT and not short else ()
            fields = (*one_by_one, texts.EVERYWHERE)
            for field in fields:
                if field != texts.EVERYWHERE and texts.takes(kind, field, text):
                    continue
                source = texts.hostile_law(kind, field, text)
                for exporter in DRIVEN:
                    if kind == texts.CURVED and expected(exporter, kind) is None:
                        continue
                    if short and kind == texts.STRAIGHT and expected(exporter, texts.CURVED) is not None:
                        continue
                    if field not in (*AT_COST, texts.EVERYWHERE) and exporter in PROGRAMS:
                        continue
                    outcome, detail = outcome_of(exporter, source, kind)
                    yield Attempt(SECTION, exporter, outcome, f"{field}: {name}: {detail}")
    yield from _every_exporter_is_driven()
    yield from _controls(short)


def _of_the_law(outcome: str, detail: str) -> tuple[str, str]:
    return ("refused", "") if outcome == "refused" else ("traceback", f"{detail}: {outcome}")


def _every_exporter_is_driven() -> Iterator[Attempt]:
    for name in {*ck.available("exporters")} - {*DRIVEN}:
        yield Attempt(SECTION, name, "broken", "no way to drive it is known here")


# ---- exporters that protect nothing --------------------------------------------------------------------------------

LEAST = {
    "python": 1, "numpy": 1, "javascript": 2, "c": 2, "mfront": 1, "abaqus": 1, "calculix": 1, "code_aster": 2,
    "json": 1, "latex": 1, "markdown": 1, "mathml": 1, "abaqus-cards": 1, "ansys": 1, "moose": 1, "neml2": 1,
}  # fmt: skip
"""{exporter: how many of all texts at least are noticed where they are written as they are}."""

RUN = ("python", "numpy", "javascript", "c", "code_aster", "abaqus", "calculix")
"""Exporters whose unprotected texts must be seen to run, not to break alone."""

SHORT = {"c": "end of a C comment", "javascript": "line, then JavaScript", "code_aster": "encoding of a Python file"}
"""{exporter: a text that runs where it is written as it is}, for the short form."""

_INNER = {
    "abaqus": (r"(?m)^ +decra = 0\.0d0\n", "! {}\n"),
    "calculix": (r"(?m)^ +finish = ", "! {}\n"),
    "mfront": (r"(?m)^  const real rate = ", "  // {}\n"),
}
"""Where a comment stands among statements."""


def naive(exporter: str, text: str) -> str:
    """What an exporter would write that takes its texts as they are."""
    kind = texts.STRAIGHT
    written = str(ck.available("exporters")[exporter].text(texts.plain_law(kind)))
    if exporter in _INNER:
        pattern, comment = _INNER[exporter]
        return re.sub(pattern, lambda match: comment.format(text) + match[0], written, count=1)
    lines = written.splitlines()
    if exporter == "code_aster":
        lines[0] = f"# {text}"
    return "\n".join(lines).replace(PLACE, text) + "\n"


def _controls(short: bool) -> Iterator[Control]:
    """With all texts; in the short form with one that is known to run, in three languages."""
    for exporter in SHORT if short else LEAST:
        if not all(shutil.which(needed) for needed, _ in DRIVEN[exporter] if needed):
            continue
        target = expected(exporter, texts.STRAIGHT)
        assert target is not None
        noticed, executed = 0, 0
        chosen = [texts.PAYLOADS[SHORT[exporter]]] if short else [*texts.PAYLOADS.values()]
        for text in chosen:
            outcome, _ = _judged(exporter, naive(exporter, text), target)
            noticed += outcome in FAULTS
            executed += outcome == "executed"
        found = executed if exporter in RUN else noticed
        what = "executed" if exporter in RUN else "executed or broken"
        yield Control(
            SECTION, f"{exporter}, texts as they are: {what}", len(chosen), found, 1 if short else LEAST[exporter]
        )
