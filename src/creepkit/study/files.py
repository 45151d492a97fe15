"""Measured files and saved results."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from creepkit import registry
from creepkit.records import History, Predictor
from creepkit.study.nouns import histories_given, predictor_given

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.readers.suspects import Suspect


def read_histories(paths: str | Path | Iterable[str | Path], reader: str | None = None) -> list[History]:
    """Read measured histories from a file, a folder, a pattern such as "in625/*.csv", or several of these.

    reader : name of the reader; by default the one that accepts the file.
    """
    from creepkit.readers.reading import read_histories as run

    readers = [found.value for found in registry.default().readers().values()]
    return run(paths, readers, reader)


def suspects(histories: Sequence[History], specimen: Predictor | str | None = None) -> tuple[Suspect, ...]:
    """Return what looks wrong in histories: unloading, falling amplitudes, outliers, tests far from others.

    specimen : what the first frames are compared with, which should show its elastic deflection; None believes them.
    """
    from creepkit.readers.suspects import suspects as run

    return run(histories_given(histories), None if specimen is None else predictor_given(specimen))


def with_suspects_marked(histories: Sequence[History], kinds: Collection[str] | None = None) -> list[History]:
    """Return the histories with suspect frames unused and a label that says which; whole tests stay.

    kinds : of "unloading", "falling" and "outlier"; all of them by default.
    """
    from creepkit.readers.suspects import OF_FRAMES
    from creepkit.readers.suspects import with_suspects_marked as run

    return run(histories_given(histories), OF_FRAMES if kinds is None else kinds)


def load(path: str | Path) -> Identification:
    """Return the identification saved in a JSON file; attach its histories again with `.on(histories, using)`."""
    from creepkit.inverse.files import load as run

    return run(path)
