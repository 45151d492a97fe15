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
    TemperatureFactor,
    TemperatureForm,
    activated,
    arrhenius,
    exponential,
    inverse_temperature,
    linear,
    wachtman,
)
from creepkit.language.thermal_shapes import (
    boltzmann,
    curved,
    logarithmic,
    modified_arrhenius,
    t_log_t,
    wachtman_form,
)

__all__ = [
    "GAS_CONSTANT",
    "CreepLaw",
    "Elastic",
    "TemperatureFactor",
    "Param",
    "State",
    "TemperatureForm",
    "activated",
    "arrhenius",
    "boltzmann",
    "curved",
    "exponential",
    "hookimpl",
    "inverse_temperature",
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
    "wachtman_form",
]
