"""A ranking as a file: its laws' identifications, each in a file beside it, with what ranks them.

It states the SHA-256 of each of these files: one that another run has written since under the same name is refused.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from creepkit.errors import FitError, quoted
from creepkit.files.json_documents import DocumentFormat, check_heading, read_json, write_json
from creepkit.files.reading import FileKind, sha256_of
from creepkit.files.record_codec import RecordCodec, RecordError
from creepkit.files.writing import LAW_SIGNS, numbered_stems
from creepkit.inverse.identification import Identification
from creepkit.inverse.identification_document import IDENTIFICATION, identification_from_json
from creepkit.inverse.selection.challenges import Challenge
from creepkit.inverse.selection.ranking import RankedLaw, Ranking
from creepkit.limits import numbers

if TYPE_CHECKING:
    from creepkit.language import CreepLaw

RANKING = DocumentFormat(
    "creepkit-ranking",
    3,
    FileKind("a ranking", FitError, "give a ranking.json that 'creepkit identify' wrote"),
    remedy="identify again",
)


MOST_LAWS = 100
"""In a ranking's file."""


@dataclass(frozen=True)
class LawFile:
    """A law of a ranking: the file of its identification, beside the ranking's, SHA-256 of it, and as RankedLaw."""

    file: str
    sha256: str
    excess: float
    weight: float
    chi_square: float
    same_as: str = ""


@dataclass(frozen=True)
class RankingFile:
    """What a ranking's file holds: the laws, the best first, and the other fields of a Ranking."""

    laws: tuple[LawFile, ...]
    failed: dict[str, str]
    further: tuple[str, ...]
    challenges: tuple[Challenge, ...] | None

    def __post_init__(self) -> None:
        names, total = [law.file for law in self.laws], sum(law.weight for law in self.laws)
        if not 0 < len(names) <= MOST_LAWS:
            raise FitError(f"laws is no list of 1 to {MOST_LAWS} laws")
        for name in names:
            if Path(name).name != name or name in ("", ".", ".."):
                raise FitError(f"a law's file is '{quoted(name, 60)}'; it is a name in the same folder")
            if names.count(name) > 1:
                raise FitError(f"{quoted(name, 60)} is among its laws twice; keep one of them")
        if not 0 < total <= 1.0 + 1e-6:
            raise FitError(f"the weights add up to {total:g}, which must be above 0 and at most 1")


UNKNOWN = numbers(0.0, nan=True, infinite=True)
CODEC = RecordCodec(ranges={LawFile: {"excess": UNKNOWN, "weight": numbers(0.0, 1.0), "chi_square": UNKNOWN}})


def stems_of_laws(laws: Iterable[CreepLaw], stem: str) -> list[str]:
    """Names of the laws' files beside the ranking's, without suffix; stem : of the ranking's file."""
    return numbered_stems([stem, *(law.name for law in laws)], "law", LAW_SIGNS)[1:]


def write_ranking(ranking: Ranking, path: str | Path) -> Path:
    """Write the ranking, and the identification of each law into a file beside it; returns the ranking's path."""
    path = Path(path)
    stems = stems_of_laws((one.fit.law for one in ranking.laws), path.stem)
    files = [one.fit.save(path.parent / f"{stem}.json") for stem, one in zip(stems, ranking.laws, strict=True)]
    digests = [(file.name, sha256_of(file, IDENTIFICATION.kind)) for file in files]
    return write_json(ranking_to_document(ranking, digests), path, RANKING.kind)


def ranking_to_document(ranking: Ranking, files: Sequence[tuple[str, str]]) -> dict[str, Any]:
    """The ranking as JSON-able data; files : of each law, that of its identification, beside it, and its SHA-256."""
    pairs = [*zip(files, ranking.laws, strict=True)][:MOST_LAWS]  # those of least weight say nothing
    laws = tuple(LawFile(*file, one.excess, one.weight, one.chi_square, one.same_as) for file, one in pairs)
    content = RankingFile(laws, dict(ranking.failed), ranking.further, ranking.challenges)
    return {**RANKING.heading, **CODEC.to_json(content)}


def files_of_ranking(path: Path) -> dict[str, str]:
    """{file of a law: its SHA-256}, the best first; {} where no ranking can be read."""
    try:
        return {law.file: law.sha256 for law in _ranking_file(read_json(path, RANKING.kind), path).laws}
    except FitError:
        return {}


def _ranking_file(data: Any, path: Path) -> RankingFile:
    content = check_heading(data, str(path), RANKING)
    try:
        return CODEC.from_json(RankingFile, content)
    except RecordError as error:
        raise FitError(f"{path}: {error}; {RANKING.kind.advice}") from None


def ranking_from_json(data: Any, source: str) -> Ranking:
    """The ranking of a document; source : its path, beside which the identifications of its laws lie."""
    path = Path(source)
    found = _ranking_file(data, path)
    laws = tuple(
        RankedLaw(_fit_of_law(path, one), one.excess, one.weight, one.chi_square, one.same_as) for one in found.laws
    )
    if len({one.fit.provenance.get("data") for one in laws}) > 1:
        raise FitError(f"{path}: its laws were not identified alike from the same tests; {RANKING.kind.advice}")
    failed = MappingProxyType(found.failed)
    return Ranking(laws, failed, found.further, found.challenges)


def _fit_of_law(path: Path, law: LawFile) -> Identification:
    """The identification in a file beside a ranking."""
    file = path.parent / law.file
    try:
        fit = identification_from_json(read_json(file, IDENTIFICATION.kind), str(file))
    except FitError as error:
        raise FitError(f"{path} names {law.file}: {error}") from None
    if sha256_of(file, IDENTIFICATION.kind) != law.sha256:
        raise FitError(
            f"{path}: {law.file} is not the file that this ranking was made with: it has been changed, or written by "
            f"another run; {RANKING.remedy}"
        )
    return fit
