"""Histories of bars, and the contributions of the terms of a law over them."""

import numpy as np

from creepkit.inverse.coordinates import Coordinates
from creepkit.inverse.reference_conditions import ReferencePoint
from creepkit.inverse.sparsity.contributions import EvaluationPoints, TermContributions
from creepkit.records import History, constant_stress

HOUR = 3600.0


def bar(stress, name="bar", T=1000.0, frames=10):
    times = np.linspace(HOUR, 10 * HOUR, frames)
    return History(name, times, {"strain": 1e-6 * times / HOUR}, constant_stress(stress, "stress"), T)


def contributions(law, tests):
    return TermContributions(
        law, Coordinates(law, ReferencePoint.from_histories(tests)), EvaluationPoints.from_histories(tests)
    )


def internal(law, **values):
    return np.array([p.to_internal(values[name]) for name, p in law.table.items()])
