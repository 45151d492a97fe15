"""A ranking as a file: its laws' identifications, each in a file beside it, with their weights.

It states the SHA-256 of each of these files: one that another run has written since under the same name is refused.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from creepkit.checked_arguments import checked
from creepkit.errors import FitError, quoted
from creepkit.files.file_names import LAW_SIGNS, numbered_stems
from creepkit.files.json_documents import DocumentFormat, check_heading, check_keys, read_json, write_json
from creepkit.files.reading import FileKind, sha256_of
from creepkit.inverse.identification import Identification
from creepkit.inverse.identification_document import IDENTIFICATION, identification_from_json, load
from creepkit.inverse.uncertainty.model_averaging import ModelAverage

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
    laws = [{"file": name, "weight": weight, "sha256": digests[name]} for name, weight in weights.items()]
    return {**RANKING.heading, "laws": laws}


def files_of_ranking(path: Path) -> dict[str, str | None]:
    """{file of a law: its SHA-256, None where it is not stated}, the best first; {} where no ranking can be read."""
    try:
        laws = check_heading(read_json(path, RANKING.kind), str(path), RANKING).get("laws")
    except FitError:
        return {}
    entries = [one for one in laws if isinstance(one, dict)] if isinstance(laws, list) else []
    names = [(entry.get("file"), entry.get("sha256")) for entry in entries]
    return {name: sha256 for name, sha256 in names if isinstance(name, str) and Path(name).name == name}


def read_fit_or_ranking(path: str | Path) -> Identification | ModelAverage:
    """What a file of either holds: an identification, or the laws of a ranking with their weights."""
    data = read_json(Path(path), IDENTIFICATION.kind)
    if not (isinstance(data, dict) and data.get("format") == RANKING.name):
        return identification_from_json(data, str(path))
    return _ranking_from_json(data, path)


@checked
def load_ranking(path: str | Path) -> ModelAverage:
    """Return the laws of a ranking.json with their weights, as forecasts take them; the files of laws lie beside it."""
    return _ranking_from_json(read_json(Path(path), RANKING.kind), path)


def _ranking_from_json(data: Any, path: str | Path) -> ModelAverage:
    content = check_heading(data, str(path), RANKING)
    laws = content.get("laws")
    problem = check_keys(content, ("laws",), "ranking")
    if problem or not isinstance(laws, list) or not 0 < len(laws) <= MOST_LAWS:
        raise FitError(f"{path}: {problem or f'laws is no list of 1 to {MOST_LAWS} laws'}; {RANKING.kind.advice}")
    fits: list[Identification] = []
    weights: list[float] = []
    for entry in laws:
        if not isinstance(entry, dict) or check_keys(entry, ("file", "weight", "sha256"), "laws"):
            raise FitError(f"{path}: each of its laws is file, weight and sha256, found {quoted(repr(entry), 60)}")
        name, weight = entry["file"], entry["weight"]
        if not isinstance(name, str) or Path(name).name != name or name in ("", ".", "..", Path(path).name):
            raise FitError(f"{path}: a law's file is {quoted(repr(name), 60)}; it is a name in the same folder")
        if isinstance(weight, bool) or not isinstance(weight, int | float) or not 0 <= weight <= 1:
            raise FitError(f"{path}: the weight of {name} is {quoted(repr(weight), 20)}; it is a number from 0 to 1")
        if name in (known["file"] for known in laws[: len(fits)]):
            raise FitError(f"{path}: {name} is among its laws twice; keep one of them")
        fits.append(_fit_of_law(Path(path), name, entry["sha256"]))
        weights.append(float(weight))
    if len({fit.provenance.get("data") for fit in fits}) > 1:
        raise FitError(f"{path}: its laws were not identified alike from the same tests; {RANKING.kind.advice}")
    if sum(weights) > 1.0 + 1e-6:
        raise FitError(f"{path}: the weights add up to {sum(weights):g}, more than 1; {RANKING.kind.advice}")
    if not sum(weights) > 0:
        raise FitError(f"{path}: no law has a weight above zero; {RANKING.kind.advice}")
    return ModelAverage(tuple(fits), tuple(weights))


def _fit_of_law(path: Path, name: str, sha256: Any) -> Identification:
    """The identification in a file beside a ranking; sha256 : of the file, as the ranking states it."""
    try:
        fit = load(path.parent / name)
    except FitError as error:
        raise FitError(f"{path} names {name}: {error}") from None
    if sha256_of(path.parent / name, IDENTIFICATION.kind) != sha256:
        raise FitError(
            f"{path}: {name} is not the file that this ranking was made with: it has been changed, or written by "
            f"another run; {RANKING.remedy}"
        )
    return fit
