"""The minimum creep rates that tests state, as a table; the findings compare them with those of the law."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from creepkit.reports.html.elements import Block, Table, number, printable

if TYPE_CHECKING:
    from creepkit.records import History


def minimum_rate_table(histories: Sequence[History]) -> list[Block]:
    """A row for each test that states its minimum creep rate; none where no test does."""
    rows = [
        (
            printable(one.name, 120),
            printable(one.condition, 200),
            number(one.minimum_rate, 4),
            "–" if one.minimum_rate_sd is None else number(one.minimum_rate_sd, 2),
        )
        for one in histories
        if one.minimum_rate is not None
    ]
    if not rows:
        return []
    columns = ("test", "condition", "minimum creep rate, 1/s", "standard deviation, 1/s")
    return [Table("Minimum creep rates that the tests state", columns, rows, numeric=(2, 3))]
