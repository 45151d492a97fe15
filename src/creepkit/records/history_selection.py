"""Subsets of tests by their labels: name, alloy, specimen, temperature, load, and what the files say besides."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase

from creepkit.checked_arguments import checked
from creepkit.errors import HistoryError, refuse_unknown, restated
from creepkit.records.history import Histories, History

LabelValues = str | float | Sequence[str | float]
"""A value of a label, or several, of which a test has one."""


LABEL_TEMPERATURE, LABEL_LOAD = 1.0, 1e-3
"""K, and relative, by which a test may be off a label: 1073 means 1073.15 as well."""


MOST_NAMED = 12
"""Values of a label that an error names."""


@checked
def select_tests(histories: Sequence[History], **labels: LabelValues) -> Histories:
    """Return the tests that have these labels: select_tests(tests, temperature=[1073, 1123], alloy="X", name="a*").

    labels : `name`, `alloy`, `specimen`, `temperature` (mean, K, to 1 K), the quantity of the load, such as `stress` or
        `pressure` (largest, MPa), and every label of the history files. Text may have * and ? in it. Of several values
        a test has one; of several labels it has all.
    """
    labels_by_test = [_labels_of(history) for history in histories]
    known = {label for test_labels in labels_by_test for label in test_labels}
    selected = list(range(len(histories)))
    for label, given in labels.items():
        values = [given] if isinstance(given, str | float | int) else list(given)
        refuse_unknown(label, known, HistoryError, f"no test has a label '{label}'")
        for value in values:
            if not any(_matches(label, test_labels, value) for test_labels in labels_by_test):
                raise HistoryError(
                    f"no test has {label}={_text(value)}; there are {_values_text(label, labels_by_test)}"
                )
        selected = [k for k in selected if any(_matches(label, labels_by_test[k], value) for value in values)]
    if not selected:
        conditions = " and ".join(f"{label}={given}" for label, given in labels.items())
        raise HistoryError(f"no test has {conditions} at once; leave one of them out")
    return Histories(histories[k] for k in selected)


def _labels_of(history: History) -> dict[str, str | float]:
    """{label: value} of a test; labels that are empty are left out."""
    labels: dict[str, str | float] = {**history.labels, "name": history.name, "alloy": history.alloy}
    labels |= {"specimen": history.specimen, "temperature": history.mean_temperature}
    if history.loading.quantity in ("stress", "strain", "pressure"):
        labels[history.loading.quantity] = float(history.loading.program().values.max())
    return {label: value for label, value in labels.items() if value != ""}


def _matches(label: str, labels: Mapping[str, str | float], value: str | float) -> bool:
    if label not in labels:
        return False
    found = labels[label]
    if isinstance(found, str):
        return fnmatchcase(found, str(value))
    with restated(ValueError, HistoryError, f"{label}={value} is not a number; write one, as in {label}={found:g}"):
        number = float(value)
    tolerance = LABEL_TEMPERATURE if label == "temperature" else LABEL_LOAD * abs(found)
    return math.isclose(found, number, rel_tol=0.0, abs_tol=tolerance)


def _values_text(label: str, labels_by_test: Sequence[Mapping[str, str | float]]) -> str:
    """The values of a label, each once."""
    values = sorted({labels[label] for labels in labels_by_test if label in labels}, key=lambda v: (str(type(v)), v))
    named = [_text(value) for value in values[:MOST_NAMED]]
    more = len(values) - len(named)
    return ", ".join(dict.fromkeys(named)) + (f" and {more} more" if more else "")


def _text(value: str | float) -> str:
    if isinstance(value, str):
        return value
    return f"{value:g}" if abs(value) < 1e3 else f"{value:.2f}".rstrip("0").rstrip(".")
