"""Texts of the command line as values: loadings, numbers, nuisance parameters, weights, searches, penalties."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from creepkit.api.searches import PENALTIES, SEARCHES, penalty_of_name, search_of_name

if TYPE_CHECKING:
    from creepkit.inverse.search.global_search import GlobalSearch
    from creepkit.inverse.sparsity.penalties import ContributionPenalty, Subsets


if TYPE_CHECKING:
    from collections.abc import Sequence

    from creepkit.records import Nuisance


PAPER_SPECIMEN, DEFAULT_SPECIMEN = "bulge", "uniaxial"
"""What a data set is made of, and what a test is of that names no specimen and whose load it takes."""


def parsed_number(text: str) -> float:
    """The number that a text is; ValueError for digits of other scripts and for 1_000, which Python would take."""
    if not text.isascii() or "_" in text:
        raise ValueError(text)
    return float(text)


def parsed_integer(text: str) -> int:
    """The whole number that a text is; ValueError as parsed_number()."""
    if not text.isascii() or "_" in text:
        raise ValueError(text)
    return int(text)


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


def parse_weights(text: str) -> Any:
    """The weights of outputs, from text such as amplitude=0.99,width=0.01; or a word."""
    from creepkit.errors import FitError
    from creepkit.inverse.settings import WEIGHTINGS

    if text in WEIGHTINGS:
        return text
    pairs = [part.partition("=") for part in text.split(",")]
    try:
        return {name.strip(): parsed_number(value) for name, _, value in pairs}
    except ValueError:
        words = f"{', '.join(WEIGHTINGS)} or amplitude=0.99,width=0.005"
        raise FitError(f"--weights {text} is not known; write {words}") from None


NUISANCE_SYNTAX = "KIND[=MEAN[:SD]][@START][ for TESTS]"
"""KIND=none leaves a default out; TESTS is test, alloy or all, or names with commas between them, which share one."""


def parse_nuisances(texts: Sequence[str] | None) -> tuple[Nuisance, ...] | None:
    """The default nuisances and those named, such as thickness=0.4935:0.027 or "temperature step=0:30@8250 for all".

    rate=none leaves the scatter of the rate out. None where nothing is named: the settings' own then hold.
    """
    from creepkit.inverse.settings import default_nuisances

    if not texts:
        return None
    without = [kind.strip() for kind, _, value in (text.partition("=") for text in texts) if value.strip() == "none"]
    further = [_nuisance(text) for text in texts if text.partition("=")[2].strip() != "none"]
    return default_nuisances(*further, without=without)


def _nuisance(text: str) -> Nuisance:
    """One nuisance, from text of NUISANCE_SYNTAX."""
    from creepkit.errors import FitError, SolveError
    from creepkit.records import Nuisance

    definition, _, whose = text.partition(" for ")
    definition, _, start = definition.partition("@")
    kind, _, numbers_text = definition.partition("=")
    mean, _, sd = numbers_text.partition(":")
    try:
        numbers = parsed_number(mean or "0"), parsed_number(sd) if sd else None, parsed_number(start or "0")
    except ValueError:
        raise FitError(f"--nuisance {text}: write {NUISANCE_SYNTAX}, such as thickness=0.4935:0.027") from None
    if not all(math.isfinite(number) for number in numbers if number is not None):
        raise FitError(f"--nuisance {text}: MEAN, SD and START must be finite numbers")
    tests = [name.strip() for name in whose.split(",") if name.strip()]
    scope: Any = tests[0] if tests in (["test"], ["alloy"], ["all"]) else "all" if tests else "test"
    try:
        return Nuisance(
            kind.strip(),
            scope,
            mean=numbers[0],
            sd=numbers[1],
            start=numbers[2],
            tests=() if tests == [scope] else tuple(tests),
        )
    except SolveError as error:
        raise FitError(f"--nuisance {text}: {error}") from None
