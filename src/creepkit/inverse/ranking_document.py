"""A ranking as a file: its laws' identifications, each in a file beside it, with their weights.

It states the SHA-256 of each of these files: one that another run has written since under the same name is refused.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from creepkit.checked_arguments import checked
from creepkit.errors import FitError, quoted
from creepkit.files.json_documents import DocumentFormat, check_heading, read_json, write_json
from creepkit.files.reading import FileKind, sha256_of
from creepkit.files.record_codec import RecordCodec, RecordError
from creepkit.files.writing import LAW_SIGNS, numbered_stems
from creepkit.inverse.identification import Identification
from creepkit.inverse.identification_document import IDENTIFICATION, identification_from_json, load
from creepkit.inverse.uncertainty.model_averaging import ModelAverage
from creepkit.limits import numbers

if TYPE_CHECKING:
    from creepkit.inverse.selection import Ranking
    from creepkit.language import CreepLaw

RANKING = DocumentFormat(
    "creepkit-ranking",
    1,
    FileKind("a ranking", FitError, "give a ranking.json that 'creepkit identify' wrote"),
    remedy="identify again",
)


MOST_LAWS = 100
"""In a ranking's file."""


@dataclass(frozen=True)
class LawFile:
    """A law of a ranking: the file of its identification, beside the ranking's, its weight, and SHA-256 of the file."""

    file: str
    weight: float
    sha256: str


@dataclass(frozen=True)
class RankingFile:
    """What a ranking's file holds: the laws, the best first."""

    laws: tuple[LawFile, ...]

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


CODEC = RecordCodec(ranges={LawFile: {"weight": numbers(0.0, 1.0)}})


def stems_of_laws(laws: Iterable[CreepLaw], stem: str) -> list[str]:
    """Names of the laws' files beside the ranking's, without suffix; stem : of the ranking's file."""
    return numbered_stems([stem, *(law.name for law in laws)], "law", LAW_SIGNS)[1:]


def write_ranking(ranking: Ranking, path: str | Path) -> Path:
    """Write the ranking, and the identification of each law into a file beside it; returns the ranking's path."""
    path = Path(path)
    weights = {}
    for stem, entry in zip(stems_of_laws((one.fit.law for one in ranking.laws), path.stem), ranking.laws, strict=True):
        weights[entry.fit.save(path.parent / f"{stem}.json").name] = entry.weight
    return write_ranking_document(weights, path)


def write_ranking_document(weights: Mapping[str, float], path: Path) -> Path:
    """Write the ranking; weights : {file of an identification, which is there beside it: weight}."""
    digests = {name: sha256_of(path.parent / name, IDENTIFICATION.kind) for name in weights}
    return write_json(ranking_to_document(weights, digests), path, RANKING.kind)


def ranking_to_document(weights: Mapping[str, float], digests: Mapping[str, str]) -> dict[str, Any]:
    """The ranking as JSON-able data.

    weights : {file of an identification, beside it: weight}. digests : {the same file: SHA-256 of what it holds}.
    """
    if len(weights) > MOST_LAWS:  # those of least weight say nothing
        weights = dict(sorted(weights.items(), key=lambda pair: -pair[1])[:MOST_LAWS])
    laws = tuple(LawFile(name, weight, digests[name]) for name, weight in weights.items())
    return {**RANKING.heading, **CODEC.to_json(RankingFile(laws))}


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


def read_fit_or_ranking(path: str | Path) -> Identification | ModelAverage:
    """What a file of either holds: an identification, or the laws of a ranking with their weights."""
    data = read_json(Path(path), IDENTIFICATION.kind)
    if not (isinstance(data, dict) and data.get("format") == RANKING.name):
        return identification_from_json(data, str(path))
    return _ranking_from_json(data, Path(path))


@checked
def load_ranking(path: str | Path) -> ModelAverage:
    """Return the laws of a ranking.json with their weights, as forecasts take them; the files of laws lie beside it."""
    return _ranking_from_json(read_json(Path(path), RANKING.kind), Path(path))


def _ranking_from_json(data: Any, path: Path) -> ModelAverage:
    laws = _ranking_file(data, path).laws
    fits = tuple(_fit_of_law(path, law) for law in laws)
    if len({fit.provenance.get("data") for fit in fits}) > 1:
        raise FitError(f"{path}: its laws were not identified alike from the same tests; {RANKING.kind.advice}")
    return ModelAverage(fits, tuple(law.weight for law in laws))


def _fit_of_law(path: Path, law: LawFile) -> Identification:
    """The identification in a file beside a ranking."""
    file = path.parent / law.file
    try:
        fit = load(file)
    except FitError as error:
        raise FitError(f"{path} names {law.file}: {error}") from None
    if sha256_of(file, IDENTIFICATION.kind) != law.sha256:
        raise FitError(
            f"{path}: {law.file} is not the file that this ranking was made with: it has been changed, or written by "
            f"another run; {RANKING.remedy}"
        )
    return fit
