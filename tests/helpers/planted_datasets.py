"""Small data sets whose histories are known: Norton bars under held loads in closed form, and a few dimples."""

from collections.abc import Mapping

import numpy as np

import creepkit as ck
from creepkit.dataset.dataset import Dataset
from creepkit.records import History
from creepkit.sampling.conditions import TimeGrid

HOURS = 3600.0


def bars(count: int = 96, grid: TimeGrid | None = None, ends: tuple[float, float] | None = None) -> Dataset:
    """Norton bars whose load jumps once; ends : s, between which tests end.

    Rates at 100 MPa from 1e-8 to 3e-7 1/s, n from 3 to 6, loads of 60 to 150 MPa.
    """
    grid = grid or TimeGrid(np.linspace(0.0, 10 * HOURS, 11))
    unit = np.random.default_rng(5).random((count, 6))
    n = 3.0 + 3.0 * unit[:, 1]
    parameters = np.stack([10.0 ** (-8.0 + 1.5 * unit[:, 0]) / 100.0**n, n], axis=1)
    low = 60.0 + 60.0 * unit[:, 2]
    last = np.full(count, grid.values[-1]) if ends is None else ends[0] * (ends[1] / ends[0]) ** unit[:, 5]
    columns = {"stress_1": low, "stress_2": low * (1.05 + 0.2 * unit[:, 3]), "Tj": last * (0.25 + 0.5 * unit[:, 4])}
    if ends is not None:
        columns["end_time"] = last
    values = [
        strains(*parameters[k], *(column[k] for column in [*columns.values()][:3]), grid.times(last[k]))
        for k in range(count)
    ]
    return data_set("uniaxial", ck.law("norton"), grid, parameters, columns, np.array(values)[..., None])


def strains(A: float, n: float, low: float, high: float, jump: float, times: np.ndarray) -> np.ndarray:
    """Logarithmic creep strain under held loads: exp(-n e) falls by n A sigma^n dt."""
    early, late = np.minimum(times, jump), np.maximum(times - jump, 0.0)
    return -np.log1p(-n * A * (low**n * early + high**n * late)) / n


def dimples(count: int = 24) -> Dataset:
    """Norton dimples with moduli and thicknesses that differ, by finite elements; seven frames of 12 h."""
    grid, unit = TimeGrid(np.array([0.0, 0.02, 0.1, 0.25, 0.5, 0.75, 1.0]), relative=True), None
    unit = np.random.default_rng(3).random((count, 8))
    n = 3.0 + 2.0 * unit[:, 1]
    parameters = np.stack([10.0 ** (-7.5 + 0.8 * unit[:, 0]) / 120.0**n, n], axis=1)
    ends = 4 * HOURS * 3.0 ** unit[:, 5]
    columns = {
        "modulus": 1e5 + 1e5 * unit[:, 2],
        "P1": 6.0 + 3.0 * unit[:, 3],
        "P2": 10.0 + 3.0 * unit[:, 4],
        "Tj": ends * (0.3 + 0.4 * unit[:, 6]),
        "end_time": ends,
        "apex_thickness": 0.46 + 0.08 * unit[:, 7],
    }
    empty = data_set("bulge", ck.law("norton"), grid, parameters, columns, np.zeros((count, grid.frames, 3)))
    found = [empty.specimen.predict(empty.law, empty.theta_of(k), [empty.planned_test(k)]).of(0) for k in range(count)]
    return data_set("bulge", empty.law, grid, parameters, columns, np.array(found))


def data_set(
    specimen: str,
    law: ck.CreepLaw,
    grid: TimeGrid,
    parameters: np.ndarray,
    columns: Mapping[str, np.ndarray],
    values: np.ndarray,
) -> Dataset:
    """A data set of accepted samples."""
    count, outputs = len(parameters), ck.specimen(specimen).outputs
    ends = columns.get("end_time", np.full(count, grid.values[-1]))
    return Dataset(
        law=law,
        specimen=ck.specimen(specimen),
        design_document={"name": "planted"},
        grid=grid,
        outputs=outputs,
        parameter_names=law.names,
        condition_names=tuple(columns),
        parameters=np.array(parameters, float),
        conditions=np.stack([*columns.values()], axis=1),
        values=np.array(values, np.float32),
        hold_outputs=np.full((count, 4, len(outputs)), np.nan, np.float32),
        status=np.zeros(count, np.int64),
        end_times=np.array(ends, float),
        reasons=np.zeros(count, np.int64),
        reason_names=("accepted",),
        reason_texts=("all criteria are met",),
        index=np.arange(count),
        provenance={"seed": 1},
    )


def measured(plan: History, outputs: np.ndarray, names: tuple[str, ...], name: str) -> History:
    """A plan with what was measured, (frames, outputs)."""
    return plan.replace(name=name, outputs=dict(zip(names, outputs.T, strict=True)), used=np.ones(len(outputs), bool))
