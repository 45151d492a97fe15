"""A planned test of any specimen, from what its record says: loads, ranges of conditions and reference stress."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from creepkit.errors import CreepkitError
from creepkit.records.history import History
from creepkit.records.loading import Loading, PointLoading, constant_strain, constant_stress, load_steps
from creepkit.records.specimen_lookup import loads_of
from creepkit.records.specimen_record import Load

if TYPE_CHECKING:
    from creepkit.records.predictor import Predictor

TYPICAL_STRESS = 100.0
"""MPa, reference stress of a test whose specimen states no range of the load."""


TYPICAL_TEMPERATURE, TYPICAL_DURATION = 1073.15, 36000.0
"""K and s."""


TYPICAL_VALUES = {"strain": 1e-3, "pressure": 10.0, "force": 100.0, "moment": 1000.0}
"""{quantity: value in its unit} of a load of which nothing is known; others are TYPICAL_STRESS."""


def typical_history(
    specimen: Predictor, load: str = "", *, level: float = 0.5, frames: int = 20, end: float = TYPICAL_DURATION
) -> History:
    """A test without outputs that a specimen can be simulated in: one load held, at 800 C, frames from time zero on.

    specimen : or another predictor, which has the record of its `specimen`.
    load : name of a load that it takes; by default its first.
    level : where in the range of its conditions the load lies, 0 to 1 on a logarithm; without such a range the load has
        a reference stress of 100 MPa, twice that for each 0.5 above the middle.
    frames : number of times; end : s, the last of them.
    """
    from creepkit.language.elastic import Elastic

    record: Predictor = specimen.specimen
    loads = loads_of(record)
    chosen = next((one for one in loads if one.name == load), None) or (
        Load(load or "stress", "stress") if load or not loads else loads[0]
    )
    conditions = dict(record.conditions)
    value = TYPICAL_VALUES.get(chosen.quantity, TYPICAL_STRESS)
    low, high = conditions.get("modulus", (150e3, 150e3))
    plan = History(
        name=f"typical test of {record.label}",
        times=np.linspace(0.0, end, frames),
        outputs={},
        loading=_held(chosen, value),
        temperature=TYPICAL_TEMPERATURE,
        specimen=record.name or "uniaxial",
        elastic=Elastic(round(math.sqrt(low * high), 3)),
        includes_elastic=chosen.name == "stress",
    )
    if chosen.name in conditions:
        low, high = conditions[chosen.name]
        return plan.replace(loading=_held(chosen, float(f"{low ** (1.0 - level) * high**level:.6g}")))
    scale = _reference_scale(record, plan) * 4.0 ** (level - 0.5)
    return plan.replace(loading=_held(chosen, float(f"{value * scale:.6g}")))


def _reference_scale(record: Predictor, plan: History) -> float:
    """The factor on a load that makes its reference stress the typical one; 1 where the specimen does not say."""
    if not record.states("reference_stress"):
        return 1.0
    try:
        stress = float(np.max(record.reference_stress(plan), initial=0.0))
    except CreepkitError:
        return 1.0
    return TYPICAL_STRESS / stress if 0.0 < stress < math.inf else 1.0


def _held(load: Load, value: float) -> Loading:
    """One value held; loads other than of a bar or a point after a ramp of 5 s."""
    if load.name == "components":
        return PointLoading(stress={"11": value})
    if load.name == "stress":
        return constant_stress(value)
    if load.name == "strain":
        return constant_strain(value)
    return load_steps(load.name, [(0.0, value)], ramp=5.0)
