"""Conditions that tests state beside load and temperature, for laws that use them: grain size, composition, dose.

A test states them as labels, however its table or file writes them: {"grain size (um)": "50"}, {"dose": "2 ± 0.1 dpa"}.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats
from creepkit.errors import HistoryError, nearest, quoted
from creepkit.records.history import History
from creepkit.records.prediction import Prediction
from creepkit.records.units import UNITS, UnitConversion, spellings

if TYPE_CHECKING:
    from creepkit.language.law import CreepLaw
    from creepkit.language.symbols import ConditionSymbol

_NUMBER = r"(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?"


_VALUE = re.compile(rf"\s*([-+]?{_NUMBER})\s*(?:(?:±|\+/?-)\s*({_NUMBER}))?\s*(.*?)\s*")
"""A number, its standard deviation and its unit, as labels hold them: 50, 0,05 mm, 12.5 ± 0.3 wt%."""


def stated_condition(history: History, condition: ConditionSymbol) -> tuple[float, float]:
    """What a test states of a condition and its standard deviation (0 where none is stated), in the law's unit.

    HistoryError, which says what to write, where it states nothing, no number, or a unit of another kind.
    """
    name, unit = condition.name.replace("_", " "), condition.unit
    head_of_it = re.compile(r"[\W_]*".join(name.split()) + r"\s*(?:[\[(,/_]\s*(.*?)\s*[\])]?)?\s*", re.IGNORECASE)
    for head, text in history.labels.items():
        if (named := head_of_it.fullmatch(head.strip())) is None:
            continue
        value = _VALUE.fullmatch(text)
        conversion = _conversion(value[3] or named[1] or "", unit) if value else None
        if value is None or conversion is None:
            raise HistoryError(
                f"{history.origin}: {head} is {quoted(text)}; write a number and a unit that becomes {unit}, such as "
                f"'{name} ({unit})' above numbers"
            )
        number, sd = (float((part or "0").replace(",", ".")) for part in value.groups()[:2])
        return conversion.factor * number + conversion.offset, conversion.factor * sd
    raise HistoryError(
        f"{history.origin}: states no {name}, which the law needs; add a column '{name} ({unit})', a line "
        f"'label {name}: 1 {unit}' or in a command --label '{name}=1 {unit}'; {nearest(name, tuple(history.labels))}"
    )


def _conversion(stated: str, wanted: str) -> UnitConversion | None:
    """How a number in one unit becomes one in another; None where they are of different kinds."""
    if re.sub(r"[\s.]", "", stated) == re.sub(r"[\s.]", "", wanted) or (not stated and wanted == "1"):
        return UnitConversion(1.0)
    spelled = spellings(*UNITS)
    one, other = (UNITS.get(spelled.get(text, spelled.get(text.casefold(), ""))) for text in (stated, wanted))
    if one is None or other is None or one.quantity != other.quantity:
        return None
    per_unit = 1.0 / other.conversion.factor
    return UnitConversion(
        one.conversion.factor * per_unit, (one.conversion.offset - other.conversion.offset) * per_unit
    )


def condition_values(law: CreepLaw, histories: Sequence[History]) -> Floats:
    """(tests, conditions) what tests state of the conditions of a law, in its order and units."""
    stated = [[stated_condition(history, one)[0] for one in law.conditions] for history in histories]
    return np.array(stated, float).reshape(len(histories), len(law.conditions))


def reference_conditions(law: CreepLaw, histories: Sequence[History]) -> Mapping[str, float]:
    """{condition: the median of the tests}, in the units of the law."""
    medians = np.median(condition_values(law, histories), axis=0)
    return {one.name: float(value) for one, value in zip(law.conditions, medians, strict=True)}


def with_values_of_tests(law: CreepLaw, theta: Floats, histories: Sequence[History]) -> tuple[CreepLaw, Floats]:
    """The law with its conditions as parameters, and internal values (candidates[, tests], parameters and conditions).

    theta : (candidates[, tests], parameters).
    """
    from creepkit.language.algebra import with_conditions_as_parameters

    if not law.conditions:
        return law, theta
    values = condition_values(law, histories)
    if theta.ndim == 2 and (values == values[0]).all():
        values = values[0]
    elif theta.ndim == 2:
        theta = np.repeat(theta[:, None], len(histories), axis=1)
    stated = np.broadcast_to(values, (*theta.shape[:-1], len(law.conditions)))
    return with_conditions_as_parameters(law), np.concatenate([theta, stated], axis=-1)


def of_parameters(prediction: Prediction, count: int) -> Prediction:
    """A prediction with derivatives to the first parameters alone."""
    times, jacobian = prediction.times_to_strain, prediction.jacobian
    if times is not None and times.time_jacobian is not None and times.rupture_jacobian is not None:
        first = (times.time_jacobian[..., :count], times.rupture_jacobian[..., :count])
        times = replace(times, time_jacobian=first[0], rupture_jacobian=first[1])
    return replace(prediction, jacobian=None if jacobian is None else jacobian[..., :count], times_to_strain=times)
