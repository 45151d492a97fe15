"""SearchOptions: how laws are sought and compared, by the names that commands and study files have for it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from creepkit.checked_arguments import checked
from creepkit.options import Options, option


@checked
@dataclass(frozen=True)
class SearchOptions(Options, title="options of a search"):
    """What identify() and select() take as objects or arguments of their own.

    penalty : on the terms of a sum. sums : whether sums of
    two laws are tried; None where no candidate explains the tests. criterion : of a comparison.
    """

    penalty: Literal["l2", "subsets"] | None = option(None, "Keep those terms of a sum that the tests need.")
    sums: bool | None = option(None, "Whether sums of two laws are tried; by default where no law explains the tests.")
    criterion: Literal["bic", "aicc"] = option("bic", "Of a comparison of laws.")
