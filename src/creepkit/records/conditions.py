"""Conditions that tests state beside load and temperature, for laws that use them: grain size, composition, dose.

A test states them as labels, however its table or file writes them: {"grain size (um)": "50"}, {"dose": "2 dpa"}.
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
from creepkit.records.units import UNITS

if TYPE_CHECKING:
    from creepkit.language.law import CreepLaw
    from creepkit.language.symbols import ConditionSymbol

_HEAD = re.compile(r"^(?P<name>.*?)\s*(?:\[(?P<a>[^\]]*)\]|\((?P<b>[^)]*)\)|/\s*(?P<c>\S+)|,\s*(?P<d>\S+))?\s*$")
"""Names with their units: grain size (um), grain size [um], dose / dpa, d, um."""


_VALUE = re.compile(
    r"^\s*(?P<number>[-+]?[\d.,]+(?:[eE][-+]?\d+)?)\s*(?:(?:±|\+/?-)\s*(?P<sd>[\d.,]+))?\s*(?P<unit>.*?)\s*$"
)
"""Numbers as labels hold them: 50, 0,05 mm, 12.5 ± 0.3 wt%."""


def stated_condition(history: History, condition: ConditionSymbol) -> tuple[float, float]:
    """What a test states of a condition and its standard deviation (0 where none is stated), in the law's unit.

    HistoryError, which says what to write, where it states nothing, no number, or a unit of another kind.
    """
    plain = _plain(condition.name)
    for head, text in history.labels.items():
        name, unit = _name_and_unit(head, plain)
        if _plain(name) != plain:
            continue
        value = _VALUE.match(text)
        numbers = value and [_number(value[part] or "0") for part in ("number", "sd")]
        if value is None or numbers is None or None in numbers:
            raise HistoryError(f"{history.origin}: {head} is {quoted(text)}; a number is needed for {condition.name}")
        factor = _factor(value["unit"] or unit or "", condition.unit)
        if factor is None:
            raise HistoryError(
                f"{history.origin}: {head} = {quoted(text)} for {condition.name} in {condition.unit}; write its unit, "
                f"such as '{condition.name} ({condition.unit})'"
            )
        return factor * numbers[0], factor * numbers[1]  # type: ignore[operator]
    stated = tuple(head for head in history.labels)
    raise HistoryError(
        f"{history.origin}: states no {condition.name}, which the law needs; add a column "
        f"'{condition.name.replace('_', ' ')} ({condition.unit})' or a line 'label {condition.name}: 1 "
        f"{condition.unit}'" + (f"; {nearest(condition.name, stated)}" if stated else "")
    )


def condition_values(law: CreepLaw, histories: Sequence[History]) -> Floats:
    """(tests, conditions) what tests state of the conditions of a law, in its order and units."""
    stated = [[stated_condition(history, one)[0] for one in law.conditions] for history in histories]
    return np.array(stated, float).reshape(len(histories), len(law.conditions))


def reference_conditions(law: CreepLaw, histories: Sequence[History]) -> Mapping[str, float]:
    """{condition: the median of the tests}, in the units of the law."""
    medians = np.median(condition_values(law, histories), axis=0) if law.conditions else []
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
    cut = {} if prediction.jacobian is None else {"jacobian": prediction.jacobian[..., :count]}
    times = prediction.times_to_strain
    if times is not None and times.time_jacobian is not None and times.rupture_jacobian is not None:
        jacobians = {"time_jacobian": times.time_jacobian, "rupture_jacobian": times.rupture_jacobian}
        cut["times_to_strain"] = replace(times, **{name: each[..., :count] for name, each in jacobians.items()})  # type: ignore[assignment]
    return replace(prediction, **cut) if cut else prediction  # type: ignore[arg-type]


def _plain(name: str) -> str:
    return re.sub(r"[\W_]+", "", name).casefold()


def _name_and_unit(head: str, plain: str) -> tuple[str, str]:
    """A head as its name and its unit, "" where it has none: 'grain size (um)', 'grain_size_um'."""
    match = _HEAD.match(head)
    name, unit = (match["name"], match["a"] or match["b"] or match["c"] or match["d"] or "") if match else (head, "")
    stem, _, suffix = name.rpartition("_")
    return (stem, suffix) if not unit and stem and _plain(stem) == plain else (name, unit)


def _number(text: str) -> float | None:
    """A number with a decimal point or comma."""
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return None


def _factor(stated: str, wanted: str) -> float | None:
    """By which a number in one unit becomes one in another; None where they are of different kinds."""
    if stated == wanted or (not stated and wanted == "1"):
        return 1.0
    spelled = {text: symbol for symbol, unit in UNITS.items() for text in (symbol, *unit.spellings)}
    units = [UNITS.get(spelled.get(text, spelled.get(text.casefold(), text))) for text in (stated, wanted)]
    first, second = units
    if first is None or second is None or first.quantity != second.quantity:
        return None
    return first.conversion.factor / second.conversion.factor
