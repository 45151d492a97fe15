"""Exports of testing machines: load and extension from the first second on, with the ramp in sight."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

import creepkit as ck

MODULUS, STRESS, RAMP = 155e3, 120.0, 60.0
AREA, LENGTH = 0.25 * math.pi * 8.0**2, 50.0
TIMES = np.concatenate([np.linspace(0.0, RAMP, 7), np.geomspace(90.0, 1.08e6, 40)])
LOAD = AREA * STRESS * np.minimum(TIMES / RAMP, 1.0)
CREEP = 2e-5 * np.maximum(TIMES - RAMP, 0.0) ** 0.4

ZWICK = (
    '"Prüfnorm";"DIN EN ISO 204"\n"Proben-Nr.";"ZK1"\n"Probendurchmesser d0";8,00;"mm"\n'
    '"Anfangsmesslänge Le";50,00;"mm"\n'
    '"Prüftemperatur";600;"°C"\n"Prüfkraft";6031,9;"N"\n\n"Prüfzeit";"Standardkraft";"Dehnung";"Probentemperatur"\n'
    '"s";"N";"mm";"°C"\n'
)
INSTRON = (
    '"Results Table 1"\n"Specimen label","BH1"\n"Diameter","8.00","mm"\n"Gauge length","50.00","mm"\n\n'
    '"Time","Load","Tensile extension","Temperature 1"\n"(sec)","(N)","(mm)","(C)"\n'
)
MTS = (
    "MTS793|MPT|ENU|1|2|.|/|:|1|0|0|A\n\nStation Name: Frame3\n\n"
    "Time\tAxial Force\tAxial Extensometer\tTemp Ctrl\nSec\tkN\tmm/mm\tdegC\n"
)


def _rows(columns: Sequence[np.ndarray], form: Callable[[float], str], separator: str) -> str:
    return "".join(separator.join(map(form, row)) + "\n" for row in zip(*columns, strict=True))


def _zwick(folder: Path, strain: np.ndarray) -> Path:
    columns = (TIMES, LOAD, LENGTH * strain, np.full(TIMES.size, 600.0))
    path = folder / "ZK1.TRA"
    path.write_text(ZWICK + _rows(columns, lambda x: f"{x:.6f}".replace(".", ","), ";"), encoding="latin-1")
    return path


def _instron(folder: Path, strain: np.ndarray) -> Path:
    columns = (TIMES, LOAD, LENGTH * strain, np.full(TIMES.size, 600.0))
    path = folder / "BH1.csv"
    path.write_text(INSTRON + _rows(columns, lambda x: f'"{x:.6f}"', ","))
    return path


def _mts(folder: Path, strain: np.ndarray) -> Path:
    columns = (TIMES, 1e-3 * LOAD, strain, np.full(TIMES.size, 600.0))
    path = folder / "bar_120MPa.txt"
    path.write_text(MTS + _rows(columns, lambda x: f"{x:.9f}", "\t"))
    return path


@pytest.mark.parametrize("export", [_zwick, _instron, _mts])
def test_the_elastic_strain_of_a_ramp_is_no_creep(tmp_path: Path, export: Callable[[Path, np.ndarray], Path]) -> None:
    noise = 1e-6 * np.random.default_rng(1).standard_normal(TIMES.size)
    (history,) = ck.read_histories(export(tmp_path, LOAD / AREA / MODULUS + CREEP + noise))
    assert history.includes_elastic
    assert history.elastic is not None
    assert history.elastic.E == pytest.approx(MODULUS, rel=0.02)
    assert history.loading.program().at(np.array([30.0, 1e5])) == pytest.approx([60.0, STRESS], rel=2e-3)
    assert history.temperature == pytest.approx(873.15)
    assert not history.used[TIMES < RAMP].any()
    assert history.used[TIMES >= RAMP].all()


def test_what_loading_left_beside_elastic_strain_is_subtracted(tmp_path: Path) -> None:
    ratio = LOAD / LOAD[-1]
    loading = LOAD / AREA / MODULUS + 2e-3 * np.maximum(ratio - 0.6, 0.0) ** 1.5
    (history,) = ck.read_histories(_zwick(tmp_path, loading + CREEP))
    assert not history.includes_elastic
    assert history.outputs["strain"][history.used] == pytest.approx(CREEP[TIMES >= RAMP], abs=1e-7)


def test_a_creep_strain_that_does_not_rise_with_the_load_is_left_as_it_is(tmp_path: Path) -> None:
    (history,) = ck.read_histories(_instron(tmp_path, CREEP))
    assert not history.includes_elastic
    assert history.used.all()
    assert history.outputs["strain"] == pytest.approx(CREEP, abs=1e-7)
