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


def law_source(text: str) -> CreepLaw | Identification | LawWithValues:
    """A law by name, or else what a file holds: an identification, or a law with values."""
    import creepkit as ck
    from creepkit.errors import LawError

    if is_file_name(text):
        from creepkit.exporters.law_files import read_law_file

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
