"""Exported programs in every language, compiled or loaded, and called at points by the names of the law."""

from __future__ import annotations

import ctypes
import math
import re
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from creepkit.language import stress
from creepkit.language.symbols import POINT_VARIABLES
from creepkit.records import LawWithValues
from creepkit.registry import default_registry, kinds
from helpers.compiled_fortran import compile_fortran, pointer
from helpers.compilers import compiler_or_skip, shared_library
from helpers.export_cases import renamed
from helpers.javascript import run_in_node

Points = Sequence[Mapping[str, float]]
"""Variables of the point and internal variables by the author's names, in the units of the text; 0 where left out."""

STRICT = ("-Wall", "-Wextra", "-Werror")
CALL = """
async function main(points) {
  const { rate, terms, stateRates, law } = await import("./law.mjs");
  return points.map((point) => {
    const grown = stateRates(point);
    return [rate(point), ...law.states.map((s) => grown[s.name]), Object.values(terms(point)).reduce((a, b) => a + b)];
  });
}
"""


def program_text(name: str, source: LawWithValues) -> str:
    """The text of an exporter."""
    return str(default_registry().one(kinds.EXPORTERS, name).text(source))


def rates(language: str, folder: Path, source: LawWithValues, points: Points) -> np.ndarray:
    """Rate and rates of internal variables, (points, 1 + states), by an exported program in a folder of its own."""
    return np.array(LANGUAGES[language](Path(tempfile.mkdtemp(dir=folder)), source, points), float)


def _c(command: Sequence[str], opening: str = "{}") -> Callable[..., Any]:
    def run(folder: Path, source: LawWithValues, points: Points) -> list[list[float]]:
        text, law = program_text("c", source), source.without_inactive_terms().law
        file = folder / "law.c"
        file.write_text(opening.format(text), encoding="utf-8")
        compiler = compiler_or_skip(command[0])
        library = shared_library([compiler, *command[1:], *STRICT, file, "-lm"], folder / "law.so")[0]
        prefix = re.search(r"^double (\w+)_rate\(", text, re.MULTILINE)[1]
        used = [s.name for s in POINT_VARIABLES if s == stress or law.uses(s)] + [s.name for s in law.states]
        conditions = [one.name for one in law.conditions]
        rate, count = getattr(library, f"{prefix}_rate"), len(law.states)
        rate.restype, found = ctypes.c_double, []
        for point in points:
            given = [ctypes.c_double(point.get(name, 0.0)) for name in (*used, *conditions)]
            grown, slopes = (ctypes.c_double * count)(), (ctypes.c_double * (count * len(used)))()
            if count:
                getattr(library, f"{prefix}_state_rates")(*given, grown, slopes)
            found.append([rate(*given), *grown])
        return found

    return run


def _fortran(folder: Path, source: LawWithValues, points: Points) -> list[list[float]]:
    """The law's own subroutine, which takes MPa and s."""
    text, states = program_text("abaqus", source), [s.name for s in source.law.states]
    library = compile_fortran(compiler_or_skip("gfortran"), text, folder, "law")[0]
    law, found = getattr(library, re.search(r"call (\w+_law)\(", text)[1] + "_"), []
    for point in points:
        names = (*(s.name for s in POINT_VARIABLES), *states, *(one.name for one in source.law.conditions))
        given = [point.get(name, 0.0) for name in names]
        out = np.zeros((1 + len(states)) * (1 + len(POINT_VARIABLES) + len(states)))
        law(pointer(np.array(given)), pointer(out))
        found.append([math.exp(out[0]), *out[1 : 1 + len(states)]])
    return found


def _javascript(folder: Path, source: LawWithValues, points: Points) -> list[list[float]]:
    """Where the rates of terms add up to the rate."""
    rows = np.array(run_in_node(folder, CALL, points, {"law.mjs": program_text("javascript", source)}), float)
    np.testing.assert_allclose(rows[:, -1], rows[:, 0], rtol=1e-12)
    return rows[:, :-1].tolist()


def _python(exporter: str) -> Callable[..., Any]:
    def run(_: Path, source: LawWithValues, points: Points) -> list[list[float]]:
        text, module = program_text(exporter, source), {}
        exec(compile(text, "law.py", "exec"), module)
        other, law, found = renamed(text), source.without_inactive_terms().law, []
        for point in points:
            used = {s.name: 0.0 for s in POINT_VARIABLES if law.uses(s)} | {"stress": 0.0, **point}
            given = {other.get(name, name): value for name, value in used.items()}
            grown = module["state_rates"](**given).values() if law.states else ()
            found.append([float(module["rate"](**given)), *map(float, grown)])
        return found

    return run


LANGUAGES: dict[str, Callable[..., Any]] = {
    "c": _c(("gcc", "-std=c99")),
    "c of gnu": _c(("gcc",)),
    "c++": _c(("g++", "-x", "c++"), 'extern "C" {{\n{}\n}}\n'),
    "fortran": _fortran,
    "javascript": _javascript,
    "python": _python("python"),
    "numpy": _python("numpy"),
}
