"""Built-in temperature forms and factors, by the names under which files and the command line ask for them."""

from collections.abc import Callable, Mapping
from typing import Any

from creepkit.language import activated, arrhenius, exponential, hookimpl, inverse, linear


@hookimpl
def creepkit_temperature_forms() -> Mapping[str, Callable[..., Any]]:
    return {
        "activated": activated,
        "arrhenius": arrhenius,
        "exponential": exponential,
        "inverse": inverse,
        "linear": linear,
    }
