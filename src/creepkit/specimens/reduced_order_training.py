"""Training of a reduced-order model for a body under pressure: power-law creep at drawn loads, on one or more meshes.

The spatial fields of the displacement matter, not the law that made them: power laws of exponents from one to those of
nearly plastic flow, from elastic deformation to large strains, also serve laws with hardening, drifting exponents or
several terms (tests/benchmarks/reduced_order_model.py measures it). Bases are kept in memory and on disk, by what they
were trained on.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

import numpy as np
from scipy.stats import qmc
from sympy import exp

from creepkit import core, kernels
from creepkit.errors import CreepkitError, SolveError
from creepkit.fem import reduced_order_training
from creepkit.fem.finite_element_model import FiniteElementModel
from creepkit.fem.reduced_order_model import ReducedBasis
from creepkit.fem.reduced_order_training import TrainingRun, snapshots, train
from creepkit.fem.simulation import LoadHistory, simulate
from creepkit.fem.solver import SolverSettings
from creepkit.files.json_documents import DocumentFormat
from creepkit.files.reading import FileKind
from creepkit.files.safetensors_files import read_safetensors, write_safetensors
from creepkit.files.writing import cache_folder
from creepkit.kernels.interface import CompiledLaw
from creepkit.language import CreepLaw, Param, parameters, principal_stress, stress
from creepkit.records import Program

MODES = 24
"""Of a model unless asked for others."""


POINT_SHARE, FEWEST_POINTS, MOST_POINTS = 0.4, 96, 120
"""Of all points of the mesh, those of a model unless asked for others; with fewer it errs by more than its modes."""


RUNS = 64
"""Training simulations; a power of two, for a Sobol sequence."""


EXPONENTS, NEARLY_PLASTIC = (1.0, 12.0), (12.0, 50.0)
"""Stress exponents of the training's power laws; every fourth has one of the latter range, which hyperbolic sines
reach at large stresses."""


TENSION = 1.0
"""Every fourth run creeps faster under tension: by exp(c sigma_1/sigma), c up to this, with sigma_1 the largest
principal and sigma the von Mises stress."""


ELASTIC_STRAIN = (2e-4, 8e-3)
"""Elastic strain that the largest stresses stand for at the training's pressures."""


CREEP_STRAIN = (1e-4, 1.0)
"""Creep strain at the first pressure's largest stress over the time of a run; many end by bursting before."""


RAMP = 5.0
"""s of a change of pressure."""


_MODULUS, _TIME = 1e5, 1e5
"""MPa and s; only ratios to pressures and rates matter."""


_TEMPERATURE = 1000.0


_A, _n, _c = parameters("A n c")


_POWER_LAW = CreepLaw(
    name="power-law",
    title="Power law, faster where the largest principal stress is a tension",
    terms={"power law": _A * stress**_n * exp(_c * principal_stress / stress)},
    params={
        _A: Param("rate coefficient", unit="1/s", bounds=(1e-300, 1.0), scale="log", off=0.0),
        _n: Param("stress exponent", bounds=(0.5, 60)),
        _c: Param("share of the principal stress", bounds=(0.0, 3.0)),
    },
    references=("Norton (1929), The Creep of Steel at High Temperatures",),
)


def power_law_runs(
    models: Sequence[FiniteElementModel], count: int, poisson: float = 0.3, seed: int = 0
) -> list[TrainingRun]:
    """Runs at drawn exponents, pressures and rates, every second with two pressures; meshes in turn."""
    law = kernels.lower(_POWER_LAW, "compiled")
    ratios = [stress_ratio(law, model, poisson) for model in models]
    runs = []
    for k, draw in enumerate(qmc.Sobol(5, seed=seed).random(count)):
        low, high = EXPONENTS
        exponent = _between(NEARLY_PLASTIC, draw[0]) if k % 4 == 3 else low + (high - low) * draw[0]
        ratio = ratios[k % len(models)]
        first = _between(ELASTIC_STRAIN, draw[1])
        second = _between((first, ELASTIC_STRAIN[1]), draw[2]) if k % 2 else first
        level = np.log(_between(CREEP_STRAIN, draw[3]) / _TIME) - exponent * np.log(first * _MODULUS)
        change = _between((1e-3 * _TIME, 0.5 * _TIME), draw[4])
        times = np.array([0.0, RAMP, change, change + RAMP])
        pressure = np.array([0.0, first, first, second]) * _MODULUS / ratio
        load_history = LoadHistory(
            Program(times, pressure), Program.constant(_TEMPERATURE), Program.constant(_MODULUS), _TIME, poisson
        )
        runs.append(
            TrainingRun(
                models[k % len(models)],
                law,
                np.array([level, exponent, TENSION * draw[0] if k % 4 == 1 else 0.0]),
                load_history,
            )
        )
    return runs


def _between(ends: tuple[float, float], share: float) -> float:
    """A number between two, even in its logarithm."""
    return float(ends[0] * (ends[1] / ends[0]) ** share)


def stress_ratio(law: CompiledLaw, model: FiniteElementModel, poisson: float) -> float:
    """Large von Mises stress over a small pressure, the body elastic: a twentieth of its volume has more."""
    pressure = 1e-6 * _MODULUS
    load_history = LoadHistory(
        Program.constant(pressure), Program.constant(_TEMPERATURE), Program.constant(_MODULUS), 1.0, poisson
    )
    made = simulate(law, np.array([-np.inf, 1.0, 0.0]), model, load_history)
    mises, weights = made.mises[-1][: model.weights.size], model.weights.ravel()
    order = np.argsort(mises)
    share = np.cumsum(weights[order]) / weights.sum()
    ratio = float(mises[order][np.searchsorted(share, 0.95)]) / pressure
    if not (np.isfinite(ratio) and ratio > 0.0):
        raise SolveError("pressure does not stress the body, so that it has no reduced-order model; check its mesh")
    return ratio


def trained_basis(
    models: tuple[FiniteElementModel, ...], settings: SolverSettings, *, modes: int = MODES, points: int | None = None
) -> ReducedBasis:
    """Modes and points for meshes of the same numbering; from memory, from disk, or trained now (some CPU seconds).

    settings : of which the limits count, up to which training goes.
    """
    if points is None:
        points = int(np.clip(POINT_SHARE * models[0].weights.size, FEWEST_POINTS, MOST_POINTS))
    settings = SolverSettings(deflection_limit=settings.deflection_limit, strain_limit=settings.strain_limit)
    key = _key(models, settings, modes, points)
    if key not in _IN_MEMORY:
        folder = cache_folder("reduced_bases")
        path = None if folder is None else folder / f"{key}.safetensors"
        basis = None if path is None else _read(path, models[0])
        if basis is None:
            basis = train(snapshots(power_law_runs(models, RUNS), settings), modes, points, settings.deflection_limit)
            arrays = {"modes": basis.modes, "points": basis.points, "factors": basis.factors}
            with suppress(OSError, CreepkitError):  # then the next process trains it again
                if path is not None:
                    write_safetensors(path, arrays, {}, _FORMAT, internal=True)
        _IN_MEMORY[key] = basis
    return _IN_MEMORY[key]


_IN_MEMORY: dict[str, ReducedBasis] = {}


_FORMAT = DocumentFormat(
    "creepkit-reduced-basis",
    1,
    FileKind("a file of modes", SolveError, "delete it", maximum_bytes=2**30),
    remedy="delete it",
)


@lru_cache(maxsize=256)
def _key(models: tuple[FiniteElementModel, ...], settings: SolverSettings, modes: int, points: int) -> str:
    """Of everything that a basis follows from; kept, for a fit asks a thousand times."""
    digest = hashlib.sha256(repr((_FORMAT, settings, modes, points)).encode())
    for source in (__file__, reduced_order_training.__file__, core.library_path()):
        digest.update(Path(source).read_bytes())  # what it is trained by, and solved with
    for model in models:
        for array in (model.nodes, model.elements, model.equations, model.pressed, model.top):
            digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:32]


def _read(path: Path, model: FiniteElementModel) -> ReducedBasis | None:
    """The basis of a file of ours; None where there is none for this mesh."""
    try:
        arrays, _ = read_safetensors(path, _FORMAT)
        basis = ReducedBasis(*(arrays[name] for name in ("modes", "points", "factors")))
    except (CreepkitError, KeyError):
        return None
    return basis if basis.modes.shape[1:] == model.nodes.shape else None
