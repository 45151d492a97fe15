"""The numba target: a law as a generated module of C functions, compiled once and kept on disk.

The module's file lies in the cache folder under the hash of the law's structure and of the lowering code itself, so
numba caches its machine code beside it. Files are written under a temporary name and renamed: two processes may
write the same law at once. A file whose text does not match the hash in its first line is written anew.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import re
import sys
import tempfile
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np

from creepkit.arrays import Floats, frozen
from creepkit.kernels.interface import POINT_SIZE, CompiledLaw

if TYPE_CHECKING:
    from creepkit.kernels.entries import Entry, Lowered
    from creepkit.language.law import CreepLaw


def compiled(law: CreepLaw) -> CompiledLaw:
    """Return the law's compiled entries, from memory, from the disk cache or made now."""
    from creepkit.language.fingerprint import structure_of

    structure = structure_of(law)
    module = _module(_key(structure), _Source(law))
    initial = frozen([state.initial for state in law.states.values()])
    limits = frozen([np.inf if state.limit is None else state.limit for state in law.states.values()])
    return CompiledLaw(
        rate=module.rate,
        update=module.update,
        sensitivity=module.sensitivity,
        names=law.names,
        log_scale=frozen([p.scale == "log" for p in law.params.values()], dtype=bool),
        initial=initial,
        limits=limits,
        leading=lambda theta: _leading(module, theta),
        source=Path(str(module.__file__)).read_text(encoding="utf-8"),
        fingerprint=_key(structure),
    )


class _Source:
    """The text of a law's module, made only when the cache lacks it; equal for equal cache keys."""

    def __init__(self, law: CreepLaw) -> None:
        self.law = law

    def __hash__(self) -> int:
        return 0

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Source)

    def text(self) -> str:
        from creepkit.kernels.entries import entries

        return module_text(entries(self.law))


@cache
def _module(key: str, source: _Source) -> ModuleType:
    path = cache_folder() / f"law_{key}.py"
    if not _intact(path):
        _write(path, source.text())
    spec = importlib.util.spec_from_file_location(f"creepkit_kernel_{key}", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # numba finds the functions of cached machine code through their module
    spec.loader.exec_module(module)
    return module


def cache_folder() -> Path:
    """Where generated kernels are kept: CREEPKIT_CACHE, else the user's cache folder, else a temporary folder."""
    chosen = os.environ.get("CREEPKIT_CACHE")
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "creepkit"
    folder = (Path(chosen) if chosen else base) / "kernels"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if os.access(folder, os.W_OK):
            return folder
    except OSError:
        pass
    fallback = Path(tempfile.gettempdir()) / f"creepkit-{os.getuid()}"
    fallback.mkdir(mode=0o700, exist_ok=True)
    return fallback


@cache
def _lowering_version() -> str:
    """Hash of the code that makes kernels, so that no stale kernel survives a change of it."""
    folder = Path(__file__).parent
    digest = hashlib.sha256()
    for path in sorted(folder.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _key(structure: str) -> str:
    return hashlib.sha256((_lowering_version() + structure).encode()).hexdigest()[:24]


def _intact(path: Path) -> bool:
    try:
        first, _, rest = path.read_text(encoding="utf-8").partition("\n")
    except (OSError, UnicodeDecodeError):
        return False
    return first == f"# {_digest(rest)}"


def _write(path: Path, text: str) -> None:
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=path.stem, suffix=".tmp")
    with os.fdopen(handle, "w", encoding="utf-8") as file:
        file.write(f"# {_digest(text)}\n{text}")
    os.replace(temporary, path)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _leading(module: ModuleType, theta: Floats) -> Floats:
    """Smallest (1 + a)/(1 - b) among the terms that are not switched off; 1 when all are."""
    theta = np.asarray(theta, float)
    best = np.full(theta.shape[:-1], np.inf)
    pairs = module.exponents(*np.moveaxis(theta, -1, 0))
    for (a, b), coefficients in zip(pairs, module.COEFFICIENTS, strict=True):
        beta = (1.0 + np.asarray(a)) / (1.0 - np.asarray(b)) + np.zeros(theta.shape[:-1])
        active = np.isfinite(theta[..., list(coefficients)]).all(axis=-1)
        best = np.where(active, np.minimum(best, beta), best)
    return np.where(np.isfinite(best), best, 1.0)


# ---- the generated text --------------------------------------------------------------------------------------------

_HEAD = '''"""{title}

{equation}
"""

from math import isfinite

import numpy as np
from numba import cfunc

from creepkit.kernels.interface import SIGNATURE
from creepkit.kernels.numba_functions import {functions}

COEFFICIENTS = {coefficients}

'''


def module_text(lowered: Lowered) -> str:
    """The generated module of a law."""
    from creepkit.kernels.printing import FUNCTIONS

    law = lowered.law
    functions = [_exponents_text(lowered)]
    functions += [_entry_text(e, lowered) for e in (lowered.rate, lowered.update, lowered.sensitivity)]
    text = "\n\n".join(functions)
    head = _HEAD.format(
        title=f"Kernel of '{law.name}' ({law.title}); generated, do not edit.".replace('"""', "'''").replace("\\", "/"),
        equation="\n".join(f"{label}: {term}" for label, term in law.terms.items()),
        functions=", ".join(sorted(set(re.findall(r"\w+(?=\()", text)) & set(FUNCTIONS))) or "exp",
        coefficients=repr(lowered.form.coefficients),
    )
    return head + text


def _exponents_text(lowered: Lowered) -> str:
    from creepkit.kernels.leading import exponents
    from creepkit.kernels.printing import KernelPrinter, name_of

    printer = KernelPrinter({"standard": "python3"})
    rows = "".join(
        f"        ({printer.doprint(a)}, {printer.doprint(b)}),\n" for a, b in exponents(lowered.form)
    )
    arguments = ", ".join(name_of(t) for t in lowered.form.theta)
    return f"def exponents({arguments}):\n    return (\n{rows}    )\n"


def _entry_text(entry: Entry, lowered: Lowered) -> str:
    """One C function over rows of points."""
    from creepkit.kernels.printing import body, name_of, results

    states = len(lowered.law.states)
    width = POINT_SIZE + states
    point, theta = entry.inputs[:width], entry.inputs[width:]
    read = entry.read
    lines = [
        '@cfunc(SIGNATURE, cache=True, error_model="numpy")',
        f"def {entry.name}(rows, x, theta, out):",
        "    flags = 0",
        *(f"    {name_of(s)} = theta[{k}]" for k, s in enumerate(theta) if s in read),
        "    for row in range(rows):",
        *(f"        {name_of(s)} = x[row * {width} + {k}]" for k, s in enumerate(point) if s in read),
        *body(entry, "        "),
    ]
    outputs = results(entry)
    size = len(outputs)
    lines += [f"        y{k} = {text}" for k, text in enumerate(outputs)]
    lines += [f"        out[row * {size} + {k}] = y{k}" for k in range(size)]
    lines.append(f"        if not isfinite({' + '.join(f'y{k}' for k in range(1 + states))}):")
    lines.append("            flags |= 1")
    if size > 1 + states:
        lines.append(f"        if not isfinite({' + '.join(f'y{k}' for k in range(1 + states, size))}):")
        lines.append("            flags |= 2")
    lines.append("    return flags\n")
    return "\n".join(lines)
