"""NumPy: a module that needs `numpy` alone and evaluates the law for arrays, which broadcast."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from creepkit.export.python_text import PythonDialect, kernel_functions, module_text
from creepkit.kernels.printing import TARGET_FUNCTIONS, KernelPrinter
from creepkit.records import LawWithValues


@dataclass(frozen=True)
class NumpyExporter:
    """A Python module of arrays with `rate` (and `state_rates`), the values as defaults."""

    name: str = "numpy"
    title: str = "Python module for arrays that needs nothing but NumPy"
    suffix: str = ".py"

    def text(self, source: LawWithValues) -> str:
        """Return the module's text; stress and time are converted on entry, rates on exit."""
        return module_text(source, _array_dialect())


def _numpy_imports(names: set[str]) -> str:
    """The error function is the standard library's: NumPy has none."""
    imported = sorted(name for name in names & {*TARGET_FUNCTIONS, "errstate"} if hasattr(np, name))
    lines = ["import numpy as np", *([f"from numpy import {', '.join(imported)}"] if imported else [])]
    return "\n".join(["import math", "", *lines] if "math" in names else lines)


@cache
def _array_dialect() -> PythonDialect:
    """Whole arrays; branches are evaluated everywhere, hence the guard against warnings of those not taken."""
    return PythonDialect(
        printer=KernelPrinter({"standard": "python3"}),
        helpers=kernel_functions("numpy_functions.py") | {"erf": "erf = np.vectorize(math.erf, otypes=[float])"},
        import_lines=_numpy_imports,
        log_expression=lambda name: f"log_or_off({name})",
        context_manager='with errstate(over="ignore", divide="ignore", invalid="ignore")',
        overflow_sentence="Arguments and parameters broadcast as arrays do. A result beyond 1.8e308 is inf.",
    )
