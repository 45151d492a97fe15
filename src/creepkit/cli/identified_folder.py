"""The folder of `creepkit identify`: the files of one run, in the place of those of the run before."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from creepkit.errors import FitError
from creepkit.files.reading import sha256_of
from creepkit.files.writing import check_folder_target, is_foreign

if TYPE_CHECKING:
    from creepkit.inverse.selection import Ranking
    from creepkit.language import CreepLaw

RANKING_STEM = "ranking"


LAW_SUFFIXES, BEST_LAW_SUFFIXES = (".json", ".png"), (".tex", ".py")
"""Of the files of every law, and of those that the best one has beside them."""


def check_identified_folder(folder: Path, laws: Sequence[CreepLaw]) -> None:
    """FitError, before the work, where a file that it writes or removes is not as creepkit wrote it."""
    from creepkit.inverse.ranking_document import stems_of_laws

    stems = stems_of_laws(laws, RANKING_STEM)
    names = [f"{stem}{suffix}" for stem in stems for suffix in (*LAW_SUFFIXES, *BEST_LAW_SUFFIXES)]
    check_folder_target(folder, FitError, tuple(dict.fromkeys([*names, *(one.name for one in former_files(folder))])))


def former_files(folder: Path) -> list[Path]:
    """Files of the laws of the ranking that is there, as far as they are that run's; changed ones among them."""
    from creepkit.inverse.identification_document import IDENTIFICATION
    from creepkit.inverse.ranking_document import files_of_ranking

    found = []
    for number, (name, sha256) in enumerate(files_of_ranking(folder / f"{RANKING_STEM}.json").items()):
        path = folder / name
        if path.is_file() and not is_foreign(path) and sha256 != sha256_of(path, IDENTIFICATION.kind):
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
    ranking.plot(written[1])
    for name, entry in zip(names, ranking.laws, strict=True):
        written += [folder / f"{name}{suffix}" for suffix in LAW_SUFFIXES]
        entry.fit.plot(written[-1])
    for language, suffix in zip(("latex", "python"), BEST_LAW_SUFFIXES, strict=True):
        written.append(folder / f"{names[0]}{suffix}")
        ck.export(ranking, language, to=written[-1])
    for path in former:
        if path not in written and not is_foreign(path):
            path.unlink(missing_ok=True)
    return written
