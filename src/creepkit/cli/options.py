"""Texts of the command line as values: loadings, numbers, nuisance parameters, weights, searches, penalties."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from creepkit.api.searches import PENALTIES, SEARCHES, penalty_of_name, search_of_name
from creepkit.cli.generated_options import parsed_number

if TYPE_CHECKING:
    from creepkit.inverse.search.global_search import GlobalSearch
    from creepkit.inverse.sparsity.penalties import ContributionPenalty, Subsets


PAPER_SPECIMEN, DEFAULT_SPECIMEN = "bulge", "uniaxial"
"""What a data set is made of, and what a test is of that names no specimen and whose load it takes."""


def is_law_name(word: str) -> bool:
    """Whether a word names a registered law, or a sum of them as norton+strain-hardening, whatever files there are."""
    import creepkit as ck

    laws = ck.available("laws")
    return word in laws or all(part.strip() in laws for part in word.split("+"))


def is_file_name(word: str) -> bool:
    """Whether a word that may name a law names a file: it has a suffix or a folder, as ./norton, and is no law."""
    return not is_law_name(word) and (Path(word).suffix != "" or Path(word).name != word)


def search_named(name: str) -> GlobalSearch | None:
    """The search of this name; None for the default."""
    from creepkit.errors import FitError

    for known in SEARCHES:
        if known == name:
            return search_of_name(known)
    raise FitError(f"--search {name} is not known; allowed are {', '.join(SEARCHES)}")


def penalty_named(name: str | None) -> ContributionPenalty | Subsets | None:
    """The penalty of this name, its strength chosen automatically; None for none."""
    from creepkit.errors import FitError

    if name is None:
        return None
    for known in PENALTIES:
        if known == name:
            return penalty_of_name(known)
    raise FitError(f"--penalty {name} is not known; allowed are {', '.join(PENALTIES)}")


def parse_steps(texts: Sequence[str], option: str) -> list[tuple[float, float]]:
    """(start in s, value) pairs from texts such as 100 and 3600:120."""
    from creepkit.errors import SolveError

    pairs = []
    for text in texts:
        start, _, value = text.rpartition(":")
        try:
            pairs.append((parsed_number(start or "0"), parsed_number(value)))
        except ValueError:
            raise SolveError(f"{option} {text}: write a number, or SECONDS:NUMBER for a later step") from None
    return pairs


def parse_numbers(texts: Sequence[str], option: str, example: str) -> dict[str, float]:
    """{name: value} from texts such as n=5.2."""
    from creepkit.errors import SolveError

    values: dict[str, float] = {}
    for text in texts:
        name, separator, number = text.partition("=")
        name = name.strip()
        if separator and name in values:
            raise SolveError(f"{option} {text}: {name} is given twice; keep one of them")
        try:
            values[name] = parsed_number(number)
        except ValueError:
            raise SolveError(f"{option} {text}: write NAME=NUMBER, such as {example}") from None
    return values
