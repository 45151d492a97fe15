"""The folder of `creepkit identify`: it holds the files of one run, which alone writes there until it ends."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from creepkit.errors import FitError
from creepkit.files.locking import locked
from creepkit.files.reading import sha256_of
from creepkit.files.writing import check_folder_target, is_foreign

if TYPE_CHECKING:
    from creepkit.inverse.selection import Ranking
    from creepkit.language import CreepLaw

LOCK = ".creepkit-running"
"""The file that a run holds locked."""


RANKING_STEM = "ranking"


LAW_SUFFIXES, BEST_LAW_SUFFIXES = (".json", ".png"), (".tex", ".py")
"""Of the files of every law, and of those that the best one has beside them."""


@contextmanager
def identifying_alone(folder: Path, laws: Sequence[CreepLaw]) -> Iterator[None]:
    """Hold the folder for the files of these laws, from before the work until they are written.

    FitError where another process holds it, or where a file of the former run, or one that is going to be written, is
    not as creepkit wrote it. A folder that is made for nothing is removed again.
    """
    from creepkit.inverse.ranking_document import stems_of_laws

    stems = stems_of_laws(laws, RANKING_STEM)
    names = [f"{stem}{suffix}" for stem in stems for suffix in (*LAW_SUFFIXES, *BEST_LAW_SUFFIXES)]
    check_folder_target(folder, FitError, tuple(dict.fromkeys([*names, *(one.name for one in former_files(folder))])))
    made = not folder.exists()
    with ExitStack() as stack:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            held = stack.enter_context(locked(folder / LOCK))
        except OSError as error:
            raise FitError(f"{folder}: results cannot be kept there ({error.strerror}); name another folder") from None
        if not held:
            raise FitError(f"{folder}: another process is writing its results there; wait for it, or name another --to")
        try:
            yield
        finally:
            if made and [one.name for one in folder.iterdir()] == [LOCK]:
                with suppress(OSError):
                    (folder / LOCK).unlink()
                    folder.rmdir()


def former_files(folder: Path) -> list[Path]:
    """Files of the laws of the ranking that is there, as far as they are that run's; changed ones among them."""
    from creepkit.inverse.identification_document import IDENTIFICATION
    from creepkit.inverse.ranking_document import files_of_ranking

    found = []
    for number, (name, sha256) in enumerate(files_of_ranking(folder / f"{RANKING_STEM}.json").items()):
        path = folder / name
        if path.is_file() and not is_foreign(path) and sha256 not in (None, sha256_of(path, IDENTIFICATION.kind)):
            continue  # something else of creepkit has written it since
        suffixes = LAW_SUFFIXES if number else (*LAW_SUFFIXES, *BEST_LAW_SUFFIXES)
        found += [path.with_suffix(suffix) for suffix in suffixes]
    return [path for path in found if path.is_file() and not path.is_symlink()]


def write_ranking(ranking: Ranking, folder: Path) -> list[Path]:
    """Write JSON and plot of every law, the ranking's plot, and the best law as LaTeX and Python; returns the paths.

    Files of the ranking that was there before are removed where nobody has changed them.
    """
    import creepkit as ck
    from creepkit.inverse.ranking_document import stems_of_laws

    folder.mkdir(parents=True, exist_ok=True)
    former = former_files(folder)
    names = stems_of_laws((entry.fit.law for entry in ranking.laws), RANKING_STEM)
    written = [ranking.save(folder / f"{RANKING_STEM}.json"), folder / f"{RANKING_STEM}.png"]
    ranking.plot(folder / f"{RANKING_STEM}.png")
    for name, entry in zip(names, ranking.laws, strict=True):
        entry.fit.plot(folder / f"{name}.png")
        written += [folder / f"{name}.json", folder / f"{name}.png"]
    for language, suffix in (("latex", ".tex"), ("python", ".py")):
        path = folder / f"{names[0]}{suffix}"
        ck.export(ranking, language, to=path)
        written.append(path)
    for path in former:
        if path not in written and not is_foreign(path):
            path.unlink(missing_ok=True)
    return written
