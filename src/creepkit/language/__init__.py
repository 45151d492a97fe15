"""The language in which creep laws are written: all that a law plugin imports."""

from creepkit.hookspecs import hookimpl
from creepkit.language.elastic import Elastic
from creepkit.language.law import CreepLaw
from creepkit.language.params import Param, State
from creepkit.language.symbols import (
    GAS_CONSTANT,
    mean_stress,
    parameters,
    principal_stress,
    states,
    strain,
    stress,
    temperature,
    time,
)
from creepkit.language.thermal import (
    Factor,
    TemperatureForm,
    activated,
    arrhenius,
    exponential,
    inverse,
    linear,
    wachtman,
)
from creepkit.language.thermal_shapes import (
    boltzmann,
    curved,
    logarithmic,
    modified_arrhenius,
    t_log_t,
    wachtman_like,
)

__all__ = [
    "GAS_CONSTANT",
    "CreepLaw",
    "Elastic",
    "Factor",
    "Param",
    "State",
    "TemperatureForm",
    "activated",
    "arrhenius",
    "boltzmann",
    "curved",
    "exponential",
    "hookimpl",
    "inverse",
    "linear",
    "logarithmic",
    "mean_stress",
    "modified_arrhenius",
    "parameters",
    "principal_stress",
    "states",
    "strain",
    "stress",
    "t_log_t",
    "temperature",
    "time",
    "wachtman",
    "wachtman_like",
]
