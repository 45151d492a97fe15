"""The minimum creep rates that tests state, as a table, with those of the law where they were compared."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from creepkit.reports.html.elements import Block, Table, number, printable

if TYPE_CHECKING:
    from creepkit.inverse.goodness_of_fit import RateComparison
    from creepkit.records import History
    from creepkit.reports.html.findings import GroupFindings


def minimum_rate_table(histories: Sequence[History], found: Sequence[GroupFindings]) -> list[Block]:
    """A row for each test that states its minimum creep rate; none where no test does.

    Tests with readings are compared by these, so that their stated rate has no prediction beside it.
    """
    stated = [h for h in histories if h.minimum_rate is not None]
    if not stated:
        return []
    compared: dict[str, RateComparison] = {
        test.name: test.minimum_rate for one in found for test in one.fit.tests if test.minimum_rate is not None
    }
    rows = []
    for history in stated:
        own = compared.get(history.name)
        law = (
            ("–", "–") if own is None else (number(own.predicted, 3), f"{number(own.low, 3)} to {number(own.high, 3)}")
        )
        sd = "–" if history.minimum_rate_sd is None else number(history.minimum_rate_sd, 2)
        name, condition = printable(history.name, 120), printable(history.condition, 200)
        rows.append((name, condition, number(history.minimum_rate or 0.0, 4), sd, *law))
    columns = (
        "test",
        "condition",
        "measured, 1/s",
        "standard deviation, 1/s",
        "of the law, 1/s",
        "95 % of a single test",
    )
    return [Table("Minimum creep rates that the tests state", columns, rows, numeric=(2, 3, 4, 5))]
