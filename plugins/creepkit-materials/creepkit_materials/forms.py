"""What several materials share: a power law with an activation energy, and coefficients brought to a reference."""

import math

from creepkit.language import GAS_CONSTANT, CreepLaw, arrhenius
from creepkit.laws.norton import NORTON


def norton_arrhenius(T_ref: float) -> CreepLaw:
    """A s^n exp(-(Q/R)(1/T - 1/T_ref)), the law that an identification finds; T_ref in K."""
    return NORTON.times(arrhenius(T_ref=T_ref))


def at_reference(A: float, Q: float, T_ref: float) -> float:
    """The coefficient at T_ref, K, of one that is printed for exp(-Q/(R T)); Q in J/mol."""
    return A * math.exp(-Q / (GAS_CONSTANT * T_ref))
