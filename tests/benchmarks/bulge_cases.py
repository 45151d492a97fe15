"""Bulge tests to measure accuracy on: published reference cases, and new ones drawn over the paper's bounds.

Reference cases: five on the true dimple (pressure by 5 s ramps) and four on a plate with a fillet, clamped at its rim
and loaded at once; their converged histories lie in files beside the project. New cases: a Sobol sequence over the
bounds of Table 1, Eq. (1) and Eq. (2), E 50 to 300 GPa, Tj 2 to 10 h, 3 <= P1 <= P2 <= 25 MPa, one law after the other.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.stats import qmc

import creepkit as ck
from creepkit import kernels
from creepkit.arrays import Floats
from creepkit.fem.simulation import Simulation, simulate
from creepkit.language import CreepLaw
from creepkit.records import History, Loading, PressureJump, Program, RecordedLoading
from creepkit.specimens.bulge.geometry import DimpleGeometry
from creepkit.specimens.bulge.specimen import Bulge
from creepkit.specimens.finite_element_tests import FiniteElementTest, solver_settings

BENCHMARKS = Path(__file__).resolve().parents[2].parent / "shared/data/benchmarks"
HOUR = 3600.0
TIMES = np.arange(1, 289) * 150.0
"""s; a frame every 150 s over 12 h."""

FILLET = Bulge(geometry=DimpleGeometry(1.0, 5.0, 1.0, 1.5, 4.0, 7.5, ("rim",)), threads=1)
TRUE = Bulge(threads=1)
DRAWN_LAWS = ("norton", "strain-hardening", "time-hardening", "hyperbolic-sine", "drifting-exponent", "combined")


@dataclass(frozen=True)
class Case:
    """One fully specified test: law and values, E in MPa, loading, the specimen at its production settings."""

    name: str
    law: str
    values: dict[str, float]
    E: float
    loading: Loading
    specimen: Bulge = TRUE

    @cached_property
    def model(self) -> CreepLaw:
        """The law."""
        return ck.law(self.law)

    def history(self, times: Floats) -> History:
        """The test, observed at `times`."""
        return History(
            name=self.name,
            times=times,
            outputs={},
            loading=self.loading,
            temperature=1000.0,
            specimen="bulge",
            elastic=ck.Elastic(self.E),
        )

    def simulation(self, end: float, **changes: float) -> tuple[Simulation, FiniteElementTest]:
        """A run until `end`, s, by the specimen with some settings changed."""
        specimen = self.specimen.replace(**changes)
        setup = FiniteElementTest.of(specimen, self.history(np.array([end])), {})
        kernel = kernels.lower(self.model, "compiled")
        theta = self.model.to_internal(self.model.values(self.values))[0]
        return simulate(kernel, theta, setup.model, setup.load_history, settings=solver_settings(specimen)), setup

    def outcome(self, times: Floats, **changes: float) -> Floats:
        """Apex in mm, D_amp in mm, S_d in mm and S_p at `times`, (times, 4)."""
        run, setup = self.simulation(float(times[-1]), **changes)
        top = run.displacements[:, setup.model.top, 1]
        observed = setup.piece.observation.observe(setup.piece.top_radii, top)
        return np.column_stack([run.at(top[:, 0], times), run.at(observed, times)])


@dataclass(frozen=True)
class PublishedCase:
    """A case whose outcome is published: (times, 4), NaN where the publication gives the apex alone."""

    case: Case
    times: Floats
    outcome: Floats


def dimple_references() -> list[PublishedCase]:
    """The five cases on the true dimple."""
    text = json.loads((BENCHMARKS / "dimple_reference.json").read_text())
    return [_published_dimple(name, entry) for name, entry in text["cases"].items()]


def _published_dimple(name: str, entry: dict) -> PublishedCase:
    times = [0.0, 5.0] if entry["Tj"] is None else [0.0, 5.0, entry["Tj"], entry["Tj"] + 5.0]
    pressures = [0.0, entry["P1"], entry["P1"], entry["P2"]][: len(times)]
    law, values = _law_of(entry["law"])
    loading = RecordedLoading(Program(np.array(times), np.array(pressures)), "pressure")
    case = Case(name, law, values, entry["E"], loading)
    outcome = np.column_stack([entry[column] for column in ("apex", "D_amp", "S_d", "S_p")])
    return PublishedCase(case, np.array(entry["times_s"], float), outcome)


def _law_of(entry: dict) -> tuple[str, dict[str, float]]:
    kind, given = entry["type"], {k: v for k, v in entry.items() if k != "type"}
    if kind != "nt":
        return {"norton": "norton", "time": "time-hardening", "sinh": "hyperbolic-sine"}[kind], given
    rate = 10 ** given["log10A"] * np.exp(-given["Q"] / (8.314 * given["T"]))
    exponents = dict(n_0=given["n0"], n_inf=given["ninf"], C=given["C"], tau_d=given["td"], tau_r=given["tr"], m=0.0)
    return "drifting-exponent", {"A": rate, **exponents}


def fillet_references() -> list[PublishedCase]:
    """The four cases on the plate with a fillet; the file describes them in prose, so they are written out here."""
    combined = dict(A_1=1e-8, n_1=3, B=60, A_2=1e-13, n_2=4, m_1=-0.3, A_3=1e-11, n_3=3, m_2=-0.4)
    cases = [
        Case("c1", "norton", dict(A=1e-13, n=4.3), 150e3, _at_once(8.0), FILLET),
        Case("c2", "norton", dict(A=6e-19, n=7), 100e3, _at_once(8.0, 10.0), FILLET),
        Case("c3", "time-hardening", dict(A=1.2e-10, n=3.2, m=-0.4), 200e3, _at_once(6.0), FILLET),
        Case("c4", "combined", combined, 150e3, _at_once(8.0, 10.0), FILLET),
    ]
    text = json.loads((BENCHMARKS / "fe_reference.json").read_text())
    times = np.array(text["times_s"], float)
    return [PublishedCase(case, times, _apex_alone(text["cases"][case.name]["apex"])) for case in cases]


def _at_once(*pressures: float) -> Loading:
    steps = [(4 * HOUR * k, pressure) for k, pressure in enumerate(pressures)]
    return RecordedLoading(Program.steps(steps), "pressure")


def _apex_alone(apex: list[float]) -> Floats:
    return np.column_stack([apex, *np.full((3, len(apex)), np.nan)])


def drawn_cases(seed: int) -> Iterator[Case]:
    """New cases without end, those that the paper's first two criteria let pass."""
    sampler, number = qmc.Sobol(13, seed=seed), 0
    while True:
        for point in sampler.random(256):
            case = _drawn(number, DRAWN_LAWS[number % len(DRAWN_LAWS)], point)
            number += 1
            if _has_sensible_rates(case):
                yield case


def _drawn(number: int, law: str, point: Floats) -> Case:
    table = ck.law(law).table
    values = {}
    for fraction, (name, param) in zip(point[4:], table.items(), strict=False):
        low, high = param.bounds
        values[name] = float(low * (high / low) ** fraction if param.scale == "log" else low + (high - low) * fraction)
    first = 3.0 + 22.0 * point[0]
    loading = PressureJump(first, first + (25.0 - first) * point[1], (2.0 + 8.0 * point[2]) * HOUR)
    return Case(f"{law} {number}", law, values, 50e3 + 250e3 * point[3], loading)


def _has_sensible_rates(case: Case) -> bool:
    """Criteria 1 and 2 of the paper, and an exponent n(t) that is nowhere negative."""
    if case.law == "drifting-exponent" and _least_exponent(case.values) < 0.0:
        return False
    stress = np.array([600.0, 50.0])
    rate = kernels.lower(case.model, "numpy").log_rate(case.values, stress=stress, strain=0.01, time=1e4)
    return bool(rate[0] >= np.log(1e-20) and rate[1] <= 0.0)


def _least_exponent(v: dict[str, float]) -> float:
    t = TIMES
    drift = (v["C"] + v["n_0"] - v["n_inf"]) * np.exp(-t / v["tau_d"]) - v["C"] * np.exp(-t / v["tau_r"])
    return float((v["n_inf"] + drift).min())
