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
from creepkit.specimens.reduced_march import Batch, Ended, Schedule, march, rates_of, schedule
from creepkit.specimens.reduced_tables import LOAD_GRID, Tables, deflection_grid, tables

if TYPE_CHECKING:
    from creepkit.language import CreepLaw, Elastic
    from creepkit.specimens.bulge import Bulge


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
        assumed = dict(effects or {})
        for kind in assumed:
            if kind not in self.effects:
                raise SolveError(f"a bulge specimen does not know the nuisance '{kind}'; it knows {self.effects}")
        compiled = kernels.lower(law, "numba")
        theta = compiled.internal(values)
        shape = (max([len(theta), *(len(v) for v in assumed.values())]), len(histories))
        theta = np.broadcast_to(theta, (shape[0], theta.shape[1]))
        assumed = {kind: np.broadcast_to(value, shape) for kind, value in assumed.items()}
        plans = [schedule(self.specimen, history) for history in histories]
        thin, row = self._dimples(plans, assumed, shape)
        times, pressure, warmth = _stacked(plans)
        temperature = warmth[:, None, :] + assumed.get("temperature", np.zeros((1, shape[1])))
        stiffness = _moduli(histories, temperature) * (1.0 + assumed.get("modulus", np.zeros((1, shape[1]))))
        _refuse_soft(histories, stiffness)
        load = np.maximum(np.broadcast_to(pressure[:, None, :] / stiffness, (len(times), *shape)), 1e-15)
        batch = Batch(
            times[:, None, :], pressure[:, None, :], temperature,
            np.exp(LOAD_GRID.place(load, beyond=True).of(thin.elastic, np.broadcast_to(row, load.shape))),
            _beta(compiled.leading(theta), shape[0]), thin, deflection_grid(self.specimen), row,
            np.array(compiled.initial), np.array(compiled.limits), self.specimen.deflection_limit,
            self.specimen.strain_limit,
        )  # fmt: skip
        return _prediction(histories, plans, march(batch, rates_of(kernels.lower(law, "numpy"), theta)))

    def reference_stress(self, history: History) -> Floats:
        """As the specimen's."""
        return self.specimen.reference_stress(history)

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


def _stacked(plans: Sequence[Schedule]) -> tuple[Floats, Floats, Floats]:
    """Times, pressures and temperatures of all tests, (nodes, tests) each; the last node of shorter tests is repeated."""
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
