"""Plain Python: a module that needs `math` alone and evaluates the law as kernels do, from its log form."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Any

from creepkit.export.python_text import PythonDialect, kernel_functions, module_text
from creepkit.kernels.printing import KernelPrinter
from creepkit.records import LawWithValues


@dataclass(frozen=True)
class PythonExporter:
    """A Python module with `rate` (and `state_rates`), the values as defaults."""

    name: str = "python"
    title: str = "Python module that needs nothing but the standard library"
    suffix: str = ".py"

    def text(self, source: LawWithValues) -> str:
        """Return the module's text; stress and time are converted on entry, rates on exit."""
        return module_text(source, _scalar_dialect())


class _ScalarPrinter(KernelPrinter):
    """Kernel text for one number at a time: branches are taken lazily, maxima are Python's."""

    def _print_Max(self, e: Any) -> str:
        return f"max({', '.join(self._print(a) for a in e.args)})"

    def _print_Min(self, e: Any) -> str:
        return f"min({', '.join(self._print(a) for a in e.args)})"

    def _print_And(self, e: Any) -> str:
        return f"({' and '.join(self._print(a) for a in e.args)})"

    def _print_Or(self, e: Any) -> str:
        return f"({' or '.join(self._print(a) for a in e.args)})"

    def _print_Piecewise(self, e: Any) -> str:
        branches = [f"{self._print(branch)} if {self._print(condition)} else " for branch, condition in e.args[:-1]]
        return f"({''.join(branches)}{self._print(e.args[-1].expr)})"


def _math_imports(names: set[str]) -> str:
    return f"from math import {', '.join(sorted(name for name in names if hasattr(math, name)))}"


@cache
def _scalar_dialect() -> PythonDialect:
    """One number at a time."""
    return PythonDialect(
        printer=_ScalarPrinter({"standard": "python3"}),
        helpers=kernel_functions("numba_functions.py"),
        import_lines=_math_imports,
        log_expression=lambda name: f"log({name}) if {name} != 0.0 else -inf",
        context_manager="",
        overflow_sentence="A result beyond 1.8e308 raises OverflowError.",
    )
