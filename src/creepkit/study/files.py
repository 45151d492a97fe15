"""Measured files and saved results."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from creepkit import registry
from creepkit.records import History, Predictor
from creepkit.study.nouns import check_histories, resolve_predictor

if TYPE_CHECKING:
    from creepkit.inverse.identification import Identification
    from creepkit.readers.suspects import QualityFlag


def read_histories(paths: str | Path | Iterable[str | Path], reader: str | None = None) -> list[History]:
    """Read measured histories from a file, a folder, a pattern such as "in625/*.csv", or several of these.

    reader : name of the reader; by default the one that accepts the file.
    """
    from creepkit.readers.reading import read_histories as run

    readers = [entry.value for entry in registry.default_registry().readers().values()]
    return run(paths, readers, reader)


def check_data_quality(histories: Sequence[History], specimen: Predictor | str | None = None) -> tuple[QualityFlag, ...]:
    """Return what looks wrong in histories: unloading, falling amplitudes, outliers, tests far from others.

    specimen : what the first frames are compared with, which should show its elastic deflection; None believes them.
    """
    from creepkit.readers.suspects import check_data_quality as run

    return run(check_histories(histories), None if specimen is None else resolve_predictor(specimen))


def exclude_suspect_frames(histories: Sequence[History], kinds: Collection[str] | None = None) -> list[History]:
    """Return the histories with suspect frames unused and a label that says which; whole tests stay.

    kinds : of "unloading", "falling" and "outlier"; all of them by default.
    """
    from creepkit.readers.suspects import FRAME_FLAG_KINDS
    from creepkit.readers.suspects import exclude_suspect_frames as run

    return run(check_histories(histories), FRAME_FLAG_KINDS if kinds is None else kinds)


def load(path: str | Path) -> Identification:
    """Return the identification saved in a JSON file; attach its histories again with `.on(histories, using)`."""
    from creepkit.inverse.files import load_identification as run

    return run(path)
