"""Minimum creep rates and rupture times of tests without curves, measured beside predicted, among the findings."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from creepkit.records import SECONDS_PER_HOUR
from creepkit.reports.html.elements import Block, Paragraph, Table, number, printable

if TYPE_CHECKING:
    from creepkit.inverse.goodness_of_fit import TestFit
    from creepkit.inverse.identification import Identification
    from creepkit.inverse.single_values import SingleValue

MOST_LISTED = 40
"""Tests in the table: with more, those whose values lie farthest from the law."""


def single_value_blocks(fit: Identification) -> list[Block]:
    """A table of the tests without curves, and a warning first where their values contradict one another by the law."""
    tests = [test for test in fit.tests if not test.outputs and (test.minimum_rate or test.rupture)]
    if not tests:
        return []
    contradicting = None if fit.adequacy is None else fit.adequacy.contradicting
    warning = [] if contradicting is None else [Paragraph(f"Warning: {contradicting}.", "warning")]
    listed = tests
    if len(tests) > MOST_LISTED:
        farthest = sorted(tests, key=_distance, reverse=True)[:MOST_LISTED]
        listed = [test for test in tests if any(test is one for one in farthest)]
    return [*warning, _table(listed, len(tests))]


def _table(tests: list[TestFit], count: int) -> Table:
    rates, ends = any(t.minimum_rate for t in tests), any(t.rupture for t in tests)
    rows = [
        (
            printable(test.name, 120),
            printable(test.condition, 200),
            *(_rate_cells(test.minimum_rate) if rates else ()),
            *(_end_cells(test.rupture) if ends else ()),
        )
        for test in tests
    ]
    columns = ["test", "condition"]
    columns += ["minimum rate, 1/s", "by the law", "law / measured"] if rates else []
    columns += ["lasted, h", "by the law, h", "law / measured"] if ends else []
    caption = "Tests without curves, measured and predicted by the law alone; > marks tests that were stopped before"
    if any(t.rupture and not t.rupture.used for t in tests):
        caption += "; the law was identified without their ends"
    if len(tests) < count:
        caption += f"; the {len(tests)} of {count} that lie farthest from the law"
    return Table(caption, tuple(columns), rows, numeric=tuple(range(2, len(columns))))


def _rate_cells(rate: SingleValue | None) -> tuple[str, str, str]:
    if rate is None:
        return ("", "", "")
    predicted = "none" if not np.isfinite(rate.predicted) else number(rate.predicted, 3)
    return number(rate.measured, 3), predicted, _ratio(rate.ratio)


def _end_cells(end: SingleValue | None) -> tuple[str, str, str]:
    if end is None:
        return ("", "", "")
    lasted = f"{'> ' if end.censored else ''}{number(end.measured / SECONDS_PER_HOUR)}"
    predicted = "never" if not np.isfinite(end.predicted) else number(end.predicted / SECONDS_PER_HOUR)
    return lasted, predicted, "" if end.censored else _ratio(end.ratio)


def _ratio(ratio: float) -> str:
    return number(ratio, 3) if np.isfinite(ratio) else "–"


def _distance(test: TestFit) -> float:
    """The largest |ln| of predicted over measured of a test."""
    values = [test.minimum_rate] if test.minimum_rate else []
    ratios = [one.ratio for one in values]
    if test.rupture and test.rupture.used and not test.rupture.censored:
        ratios.append(test.rupture.ratio)
    return max((abs(float(np.log(r))) if np.isfinite(r) and r > 0 else np.inf for r in ratios), default=0.0)
