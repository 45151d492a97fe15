"""The numba target: a law as C functions, compiled once and kept on disk under the hash of what they are made from."""

from __future__ import annotations

import hashlib
import sys
from functools import cache, lru_cache, partial
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import numba
import numpy as np
from numba.core.registry import cpu_target

from creepkit.arrays import Floats, frozen
from creepkit.kernels import disk_cache
from creepkit.kernels.interface import CompiledLaw
from creepkit.language import symbols
from creepkit.language.fingerprint import structure_of

if TYPE_CHECKING:
    from creepkit.language.law import CreepLaw

_REFERENCE_POINT = (100.0, 0.0, 0.0, 1000.0, 100.0, 100.0 / 3.0)
"""Where exponents that vary with stress or temperature are taken unless a point is given."""


def compile_law(law: CreepLaw) -> CompiledLaw:
    """Return the law's compiled entries, from memory, from the disk cache or made now."""
    key = _cache_key(law)
    module = disk_cache.load_module(key, partial(_module_source, law))
    initial = frozen([state.initial for state in law.states.values()])
    return CompiledLaw(
        rate=module.rate,
        update=module.update,
        sensitivity=module.sensitivity,
        names=law.names,
        log_scale=frozen([p.scale == "log" for p in law.params.values()], dtype=bool),
        initial=initial,
        limits=frozen([np.inf if state.limit is None else state.limit for state in law.states.values()]),
        leading_exponent=partial(_leading_exponent, module, (*_REFERENCE_POINT, *initial)),
        source=module.SOURCE,
        fingerprint=key,
    )


def _module_source(law: CreepLaw) -> str:
    from creepkit.kernels.entries import symbolic_kernel
    from creepkit.kernels.module_text import module_source

    return module_source(symbolic_kernel(law))


@lru_cache(maxsize=1024)
def _cache_key(law: CreepLaw) -> str:
    """Kept, for printing a law takes a millisecond and a fit asks a thousand times."""
    return hashlib.sha256(f"{_code_fingerprint()}\n{structure_of(law)}".encode()).hexdigest()[:24]


@cache
def _code_fingerprint() -> str:
    """Hash of the code that makes kernels and of the machine they are for, so that no stale kernel survives."""
    digest = hashlib.sha256()
    for path in (*sorted(Path(__file__).parent.glob("*.py")), Path(str(symbols.__file__))):
        digest.update(path.read_bytes())
    machine = cpu_target.target_context.codegen().magic_tuple()
    for item in (sys.version, numba.__version__, *machine):
        digest.update(item.encode())
    return digest.hexdigest()


def _leading_exponent(module: ModuleType, reference_point: tuple[float, ...], theta: Floats, point: Floats | None = None) -> Floats:
    """Smallest (1 + a)/(1 - b) among the terms that are not switched off; 1 when all are."""
    theta = np.asarray(theta, float)
    smallest = np.full(theta.shape[:-1], np.inf)
    point_columns = reference_point if point is None else np.moveaxis(np.asarray(point, float), -1, 0)
    pairs = module.exponents(*point_columns, *np.moveaxis(theta, -1, 0))
    for (a, b), coefficients in zip(pairs, module.COEFFICIENTS, strict=True):
        b = np.minimum(b, 1.0 - 1e-12)  # a term that starts with strain itself does not lead
        beta = (1.0 + np.asarray(a)) / (1.0 - b)
        active = np.isfinite(theta[..., list(coefficients)]).all(axis=-1)
        smallest = np.where(active, np.minimum(smallest, beta), smallest)
    return np.where(np.isfinite(smallest), smallest, 1.0)
