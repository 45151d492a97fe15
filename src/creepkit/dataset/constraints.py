"""Where the relations that a law declares between its parameters and the point hold."""

from __future__ import annotations

import numpy as np
import sympy

from creepkit.arrays import Bools, Floats
from creepkit.dataset.conditions import ROOM_TEMPERATURE
from creepkit.dataset.design import Draws
from creepkit.language import CreepLaw
from creepkit.language.symbols import POINT_VARIABLES

TIME_FRACTIONS = np.concatenate([np.zeros(1), np.geomspace(1e-3, 1.0, 60)])
"""Times, as shares of a test's end, at which relations are looked at."""

CONSTRAINT_STRESS, CONSTRAINT_STRAIN = 100.0, 0.01
"""MPa and strain at which they are, where they depend on these."""


def constraints_hold(law: CreepLaw, draws: Draws, end_times: Floats) -> Bools:
    """Which draws meet every relation at every time of their tests, (rows,); what is not a number does not."""
    parameters = [column[:, None] for column in draws.parameters.T]
    stress, strain = np.full((len(draws), TIME_FRACTIONS.size), CONSTRAINT_STRESS), CONSTRAINT_STRAIN
    temperature = draws.condition("temperature", ROOM_TEMPERATURE)[:, None]
    arguments = (stress, strain, TIME_FRACTIONS * end_times[:, None], temperature, stress, stress / 3.0)
    states = [state.initial for state in law.states.values()]
    holds = np.ones(len(draws), bool)
    for relation in law.constraints:
        function = sympy.lambdify((*POINT_VARIABLES, *law.states, *law.params), relation, "numpy", dummify=True)
        with np.errstate(all="ignore"):
            satisfied = np.broadcast_to(function(*arguments, *states, *parameters), stress.shape)
        holds &= satisfied.all(axis=1)
    return holds
