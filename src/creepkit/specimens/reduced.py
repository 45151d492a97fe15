"""The cheap stand-in of a bulge specimen: one degree of freedom, with tables of the very dimple.

A fit asks it where to begin; it is a hundred times cheaper than the finite elements and a few per cent off, most of all
in the first hour, in which stresses still redistribute from the elastic ones.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from creepkit import kernels
from creepkit.arrays import ArrayLike, Floats, Ints
from creepkit.errors import SolveError
from creepkit.records import Effects, History, Prediction, Status
from creepkit.specimens.dimple import DimpleGeometry
from creepkit.specimens.observation import OBSERVED
from creepkit.specimens.reduced_march import Batch, Ended, march, rates_of
from creepkit.specimens.reduced_schedule import Schedule, schedule
from creepkit.specimens.reduced_tables import LOAD_GRID, Tables, deflection_grid, tables

if TYPE_CHECKING:
    from creepkit.kernels.interface import CompiledLaw
    from creepkit.language import CreepLaw, Elastic
    from creepkit.specimens.bulge import Bulge

_NO_LOAD = 1e-15
"""P/E of a dimple at rest: its deflection is a million times below the least one measured."""


@dataclass(frozen=True)
class ReducedBulge:
    """A bulge specimen with one degree of freedom; same outputs, effects and complaints, no derivatives.

    Its tables come from some runs of `specimen` at the first prediction (about 1.5 s of CPU for each dimple). Law
    states are integrated beside the strain.
    """

    specimen: Bulge
    name: str = field(default="bulge, one degree of freedom", init=False)
    title: str = field(default="Bulge test with one degree of freedom, for screening", init=False)
    outputs: tuple[str, ...] = field(default=OBSERVED, init=False)

    effects: ClassVar[tuple[str, ...]] = ("thickness", "modulus", "temperature", "window")

    def predict(
        self,
        law: CreepLaw,
        values: Mapping[str, ArrayLike],
        histories: Sequence[History],
        *,
        jacobian: bool = False,
        effects: Effects | None = None,
    ) -> Prediction:
        """Predict amplitude, width and shape of each history at its times; see records.Predictor."""
        compiled = kernels.lower(law, "numba")
        theta = compiled.internal(values)
        assumed = _known(self.effects, effects or {})
        shape = (max([len(theta), *(len(v) for v in assumed.values())]), len(histories))
        theta = np.broadcast_to(theta, (shape[0], theta.shape[1]))
        assumed = {kind: np.broadcast_to(value, shape) for kind, value in assumed.items()}
        plans = [schedule(self.specimen, history) for history in histories]
        batch = self._batch(compiled, theta, histories, plans, assumed)
        return _prediction(histories, plans, march(batch, rates_of(kernels.lower(law, "numpy"), theta)))

    def reference_stress(self, history: History) -> Floats:
        """As the specimen's."""
        return self.specimen.reference_stress(history)

    def _batch(
        self,
        law: CompiledLaw,
        theta: Floats,
        histories: Sequence[History],
        plans: Sequence[Schedule],
        effects: Mapping[str, Floats],
    ) -> Batch:
        """What is marched: tests side by side, with what is assumed of them put in."""
        shape = (len(theta), len(histories))
        thin, row = self._dimples(plans, effects, shape)
        times, pressure, temperature = (values[:, None, :] for values in _stacked(plans))
        temperature = temperature + effects.get("temperature", 0.0)
        modulus = _moduli(histories, temperature) * (1.0 + np.asarray(effects.get("modulus", 0.0)))
        _refuse_soft(histories, modulus)
        load = np.broadcast_to(np.maximum(pressure / modulus, _NO_LOAD), (len(times), *shape))
        elastic = LOAD_GRID.place(load, beyond=True).of(thin.elastic, np.broadcast_to(row, load.shape))
        return Batch(
            times=times,
            pressure=pressure,
            temperature=temperature,
            elastic=np.exp(elastic),
            beta=_beta(law.leading(theta), len(theta)),
            tables=thin,
            grid=deflection_grid(self.specimen),
            row=row,
            initial=np.array(law.initial),
            limits=np.array(law.limits),
            deflection_limit=self.specimen.deflection_limit,
            strain_limit=self.specimen.strain_limit,
        )

    def _dimples(
        self, plans: Sequence[Schedule], effects: Mapping[str, Floats], shape: tuple[int, int]
    ) -> tuple[Tables, Ints]:
        """A row of tables for each different dimple, and which one each candidate has in each test."""
        own = np.array([(k, p.made.observation.window, p.made.geometry.apex_thickness) for k, p in enumerate(plans)])
        keys = np.broadcast_to(own, (*shape, 3)).copy()
        for column, kind in ((1, "window"), (2, "thickness")):
            if kind in effects:
                keys[..., column] = effects[kind]
        different, row = np.unique(keys.reshape(-1, 3), axis=0, return_inverse=True)
        parts = [self._tables(plans[int(k)], float(window)).at(float(h)) for k, window, h in different]
        return Tables.stacked(parts), row.reshape(shape)

    def _tables(self, plan: Schedule, window: float) -> Tables:
        """The tables of the dimple of a test, for all its thicknesses."""
        made, nominal = plan.made, self.specimen.geometry.apex_thickness
        room = made.geometry.plate_thickness - made.geometry.roof_axial
        geometry: DimpleGeometry = made.geometry.replace(apex_thickness=min(nominal, room))
        return tables(self.specimen, geometry, made.observation.replace(window=window))


def _known(kinds: Sequence[str], effects: Effects) -> dict[str, Floats]:
    """The effects, each of a kind that is known."""
    for kind in effects:
        if kind not in kinds:
            raise SolveError(f"a bulge specimen does not know the nuisance '{kind}'; it knows {', '.join(kinds)}")
    return dict(effects)


def _stacked(plans: Sequence[Schedule]) -> tuple[Floats, Floats, Floats]:
    """Times, pressures and temperatures of all tests, (nodes, tests); shorter tests repeat their last node."""
    count = max(plan.times.size for plan in plans)

    def padded(values: Sequence[Floats]) -> Floats:
        return np.stack([np.pad(v, (0, count - v.size), mode="edge") for v in values], axis=1)

    return padded([p.times for p in plans]), padded([p.pressure for p in plans]), padded([p.temperature for p in plans])


def _beta(leading: Floats, candidates: int) -> Floats:
    """Exponent of the clock, (1, candidates, 1); plain time where strain begins faster than time."""
    return np.clip(np.broadcast_to(leading, candidates), 0.05, 1.0)[None, :, None]


def _moduli(histories: Sequence[History], temperature: Floats) -> Floats:
    """Young's moduli, MPa, at temperatures (nodes, candidates, tests)."""
    out = np.empty(temperature.shape)
    for k, history in enumerate(histories):
        assert history.elastic is not None  # the schedule has complained
        warm, which = np.unique(temperature[..., k], return_inverse=True)
        out[..., k] = np.array([_modulus(history.elastic, float(T)) for T in warm])[which].reshape(out.shape[:2])
    return out


@lru_cache(maxsize=65536)
def _modulus(elastic: Elastic, temperature: float) -> float:
    return float(elastic.at(temperature).E)


def _refuse_soft(histories: Sequence[History], stiffness: Floats) -> None:
    lowest = stiffness.min(axis=(0, 1))
    for history, modulus in zip(histories, lowest, strict=True):
        if not modulus > 0:
            where = history.source or f"history '{history.name}'"
            raise SolveError(f"{where}: the modulus is {modulus:g} MPa; it must be above zero")


def _prediction(histories: Sequence[History], plans: Sequence[Schedule], ended: Ended) -> Prediction:
    """What was observed at the times of the histories, NaN after the end of a row."""
    lengths = np.array([h.times.size for h in histories], dtype=np.int64)
    values = np.full((*ended.status.shape, int(lengths.max()), len(OBSERVED)), np.nan)
    for k, (history, plan) in enumerate(zip(histories, plans, strict=True)):
        seen = np.moveaxis(np.tensordot(plan.frames, ended.outputs[: plan.times.size, :, k], axes=1), 1, 0)
        cut = ended.status[:, k] != Status.COMPLETE
        seen[cut[:, None] & (history.times >= ended.end_times[:, k, None])] = np.nan
        values[:, k, : history.times.size] = seen
    return Prediction(
        values, OBSERVED, lengths, ended.status, ended.end_times, times=tuple(h.times for h in histories)
    )  # fmt: skip
