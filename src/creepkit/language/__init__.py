"""The language in which creep laws are written: all that a law plugin imports."""

from creepkit.hookspecs import hookimpl
from creepkit.language.elastic import Elastic, wachtman
from creepkit.language.law import CreepLaw
from creepkit.language.symbols import (
    GAS_CONSTANT,
    Param,
    State,
    mean_stress,
    parameters,
    principal_stress,
    states,
    strain,
    stress,
    temperature,
    time,
)
from creepkit.language.temperature_forms import (
    TemperatureFactor,
    TemperatureForm,
    activated,
    arrhenius,
    boltzmann,
    curved,
    exponential,
    inverse_temperature,
    linear,
    logarithmic,
    modified_arrhenius,
    t_log_t,
    wachtman_form,
)

__all__ = [
    "GAS_CONSTANT",
    "CreepLaw",
    "Elastic",
    "Param",
    "State",
    "TemperatureFactor",
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
