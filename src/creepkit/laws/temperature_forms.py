"""Built-in temperature forms and factors, by the names under which files and the command line ask for them."""

from collections.abc import Callable, Mapping
from typing import Any

from creepkit.language import (
    activated,
    arrhenius,
    boltzmann,
    curved,
    exponential,
    hookimpl,
    inverse_temperature,
    linear,
    logarithmic,
    modified_arrhenius,
    t_log_t,
    wachtman_form,
)


@hookimpl
def creepkit_temperature_forms() -> Mapping[str, Callable[..., Any]]:
    return {
        "activated": activated,
        "arrhenius": arrhenius,
        "boltzmann": boltzmann,
        "curved": curved,
        "exponential": exponential,
        "inverse": inverse_temperature,
        "linear": linear,
        "logarithmic": logarithmic,
        "modified-arrhenius": modified_arrhenius,
        "t-log-t": t_log_t,
        "wachtman": wachtman_form,
    }
