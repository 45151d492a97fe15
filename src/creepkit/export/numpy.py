"""NumPy: a module that needs `numpy` alone and evaluates the law for arrays, which broadcast."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from creepkit.export.python_text import Dialect, functions_of, module_text
from creepkit.kernels.printing import FUNCTIONS, KernelPrinter
from creepkit.records import ValuedLaw


@dataclass(frozen=True)
class NumpyExporter:
    """A Python module of arrays with `rate` (and `state_rates`), the values as defaults."""

    name: str = "numpy"
    title: str = "Python module for arrays that needs nothing but NumPy"
    suffix: str = ".py"

    def text(self, source: ValuedLaw) -> str:
        """Return the module's text; stress and time are converted on entry, rates on exit."""
        return module_text(source, _arrays())


def _imports(names: set[str]) -> str:
    """The error function is the standard library's: NumPy has none."""
    taken = sorted(name for name in names & {*FUNCTIONS, "errstate"} if hasattr(np, name))
    lines = ["import numpy as np", *([f"from numpy import {', '.join(taken)}"] if taken else [])]
    return "\n".join(["import math", "", *lines] if "math" in names else lines)


@cache
def _arrays() -> Dialect:
    """Whole arrays; branches are evaluated everywhere, hence the guard against warnings of those not taken."""
    return Dialect(
        printer=KernelPrinter({"standard": "python3"}),
        helpers=functions_of("numpy_functions.py") | {"erf": "erf = np.vectorize(math.erf, otypes=[float])"},
        imports=_imports,
        log=lambda name: f"log_or_off({name})",
        guard='with errstate(over="ignore", divide="ignore", invalid="ignore")',
        overflow="Arguments and parameters broadcast as arrays do. A result beyond 1.8e308 is inf.",
    )
