"""A law as the command line names it: a registered law, or a file that holds one with its values."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from creepkit.cli.options import is_file_name, parse_numbers

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from creepkit.inverse.identification import Identification
    from creepkit.language import CreepLaw
    from creepkit.records import LawWithValues


def read_law_file(path: str | Path) -> Identification | LawWithValues:
    """Return what a JSON file holds: an identification that was saved, or a law that was exported."""
    from creepkit.exporters.law_files import VALUED_LAW, valued_law_from_json
    from creepkit.files.json_documents import read_json

    data = read_json(Path(path), VALUED_LAW.kind)
    if isinstance(data, dict) and data.get("format") == VALUED_LAW.name:
        return valued_law_from_json(data, str(path))
    from creepkit.inverse.identification_document import identification_from_json

    return identification_from_json(data, str(path))


def law_source(text: str) -> CreepLaw | Identification | LawWithValues:
    """A law by name, or else what a file holds: an identification, or a law with values."""
    import creepkit as ck
    from creepkit.errors import LawError

    if is_file_name(text):
        return read_law_file(text)
    try:
        return ck.law(text)
    except LawError as error:
        if Path(text).is_file():
            raise LawError(f"{error}; for the file of that name write ./{text}") from None
        raise


def merged_values(
    source: CreepLaw | Identification | LawWithValues, assignments: Sequence[str] | None
) -> dict[str, float] | None:
    """The values of the source with those given by --set in their place; None for a source's own."""
    given = parse_numbers(assignments or [], "--set", "n=5.2")
    own: Mapping[str, float] | None = getattr(source, "values", None) if hasattr(source, "law") else None
    if own is None:
        return given
    return {**own, **given} if given else None
