"""CalculiX and creepkit on the same mesh: accuracy and CPU time of bulge tests.

    python tests/benchmarks/calculix.py [N3 N7 TH c1 c2 c3] [--cetol 1e-4 1e-5] [--refinement 1] [--alone] [--write]

Needs `ccx` on the PATH (Debian: calculix-ccx). N3, N7 and TH are on the dimple, loaded by ramps of 5 s; c1 to c3 on a
plate with a fillet, its rim clamped, loaded at once. CalculiX is backward Euler, so two values of its tolerance cetol
give its limit of small increments on this mesh, and with it the error in time of either code: the largest difference of
the apex displacement from that limit, from 10 min on, in percent of the apex at the end. CPU time is user and system;
creepkit's is the mean of 20 runs after compilation.
"""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from calculix_deck import Deck, Norton, displacements, extrapolated, increments
from measured import Page, arguments

import creepkit as ck
from creepkit.arrays import Floats
from creepkit.fem.mesh import Mesh
from creepkit.language import CreepLaw, Elastic
from creepkit.laws.norton import NORTON
from creepkit.laws.time_hardening import TIME_HARDENING
from creepkit.records import Loading, PressureJump, Program, RecordedLoading
from creepkit.specimens.bulge.geometry import DimpleGeometry
from creepkit.specimens.bulge.run import BulgeRun
from creepkit.specimens.bulge.specimen import Bulge

TIMES = np.array([150, 600, 1800, 3600, 7200, 10800, 14400, 14550, 21600, 28800, 36000, 43200], dtype=float)
LONGEST_WAIT = 3600.0
"""Seconds after which CalculiX is taken to be stuck."""

_REPEATS = 20
_FIRST_COMPARED = 600.0


@dataclass(frozen=True)
class Case:
    """A specimen, a law that CalculiX has, E in MPa (nu is 0.3), a pressure and the converged apex at 12 h, mm.

    first : CalculiX's first increment, s; with a load at once and t^m a longer one ends in divergence.
    """

    geometry: DimpleGeometry
    creep: Norton
    E: float
    loading: Loading
    apex: float
    first: float = 0.01

    @property
    def law(self) -> tuple[CreepLaw, dict[str, float]]:
        """The same law in creepkit."""
        values = {"A": self.creep.A, "n": self.creep.n}
        return (TIME_HARDENING, values | {"m": self.creep.m}) if self.creep.m else (NORTON, values)


def _at_once(*steps: tuple[float, float]) -> RecordedLoading:
    return RecordedLoading(Program.steps(steps), "pressure")


DIMPLE = DimpleGeometry()
PLATE = DimpleGeometry(
    apex_thickness=1.0,
    cavity_radius=5.0,
    roof_radial=1.0,
    roof_axial=1.5,
    plate_thickness=4.0,
    outer_radius=7.5,
    clamped=("rim",),
)
CASES = {
    "N3": Case(DIMPLE, Norton(2e-12, 3.0), 150e3, PressureJump(8.0, 8.0, 14400.0), 1.197059),
    "N7": Case(DIMPLE, Norton(5e-21, 7.0), 100e3, PressureJump(8.0, 10.0, 14400.0), 0.914546),
    "TH": Case(DIMPLE, Norton(3e-11, 3.2, -0.4), 200e3, PressureJump(8.0, 8.0, 14400.0), 1.121230),
    "c1": Case(PLATE, Norton(1e-13, 4.3), 150e3, _at_once((0.0, 8.0)), 0.673673),
    "c2": Case(PLATE, Norton(6e-19, 7.0), 100e3, _at_once((0.0, 8.0), (14400.0, 10.0)), 0.489343),
    "c3": Case(PLATE, Norton(1.2e-10, 3.2, -0.4), 200e3, _at_once((0.0, 6.0)), 0.163046, first=1e-4),
}
"""Ramped over 5 s on the true dimple; at once on a plate with a fillet, its rim held."""


class Stopped(RuntimeError):
    """CalculiX did not reach the end."""


@dataclass(frozen=True, eq=False)
class Result:
    """displacements : (times, nodes, 2) mm. increments, iterations : of CalculiX. cpu : s, user and system."""

    displacements: Floats
    increments: int
    iterations: int
    cpu: float


def run(deck: Deck, program: str | Path | None = None, preload: Path | None = None) -> Result:
    """Run CalculiX on one thread in a folder of its own.

    program : by default `ccx` on the PATH. preload : a shared library whose symbols come before those of the program.
    """
    program = program or shutil.which("ccx")
    if program is None:
        raise SystemExit("CalculiX is not installed: no 'ccx' on the PATH; on Debian, apt install calculix-ccx")
    variables = {"OMP_NUM_THREADS": "1"} | ({"LD_PRELOAD": str(preload)} if preload else {})
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "job.inp").write_text(deck.text())
        before = _children()
        done = subprocess.run(
            [program, "job"],
            cwd=folder,
            env=os.environ | variables,
            capture_output=True,
            text=True,
            timeout=LONGEST_WAIT,
        )
        cpu = _children() - before
        if done.returncode != 0 or "Job finished" not in done.stdout:
            raise Stopped(
                f"CalculiX stopped with code {done.returncode} at cetol {deck.cetol:g}: {_error(done.stdout)}"
            )
        with (folder / "job.dat").open() as dat, (folder / "job.sta").open() as sta:
            return Result(displacements(dat, deck), *increments(sta), cpu)


def _error(output: str) -> str:
    """The last error message of CalculiX."""
    messages = [line.strip() for line in output.splitlines() if "*ERROR" in line]
    return messages[-1] if messages else "there is no error message"


def _children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def calculix_runs(case: Case, mesh: Mesh, cetols: list[float]) -> list[Result]:
    """CalculiX's runs, the coarsest first; the apex is their only node."""
    deck = Deck(mesh, case.E, 0.3, case.creep, case.loading.program(), TIMES, mesh.top[:1], first=case.first)
    return [run(replace(deck, cetol=cetol)) for cetol in sorted(cetols, reverse=True)]


def creepkit_run(case: Case, refinement: float) -> tuple[Floats, float]:
    """Apex displacement, (times,) mm, and CPU seconds a run."""
    law, values = case.law
    specimen = Bulge(geometry=case.geometry, refinement=refinement)

    def simulate() -> Floats:
        result = ck.simulate(law, specimen, values, loading=case.loading, times=TIMES, elastic=Elastic(E=case.E))
        assert isinstance(result, BulgeRun)
        return result.displacement(radius=0.0)

    apex = simulate()
    start = time.process_time()
    for _ in range(_REPEATS):
        simulate()
    return apex, (time.process_time() - start) / _REPEATS


def difference(values: Floats, reference: Floats) -> float:
    """Largest difference from 10 min on, percent of the last value of the reference."""
    compared = TIMES >= _FIRST_COMPARED
    return float(100 * np.abs(values - reference)[compared].max() / reference[-1])


def report(page: Page, name: str, cetols: list[float], refinement: float, alone: bool) -> None:
    """The rows of one case."""
    case = CASES[name]
    mesh = case.geometry.mesh(refinement)
    runs = calculix_runs(case, mesh, cetols)
    apexes = [r.displacements[:, 0, 1] for r in runs]
    limit = extrapolated(apexes[-2], apexes[-1], (runs[-2].increments, runs[-1].increments))
    converged = 100 * (limit[-1] / case.apex - 1)
    apex, cpu = (None, np.nan) if alone else creepkit_run(case, refinement)
    whole = f"{limit[-1]:.6f} ({converged:+.3f})"
    for cetol, result, theirs in zip(sorted(cetols, reverse=True), runs, apexes, strict=True):
        ratio = "" if alone else f"{result.cpu / cpu:.0f}"
        code = f"CalculiX, cetol {cetol:g}"
        page.row(name, code, whole, result.increments, f"{result.cpu:.2f}", ratio, f"{difference(theirs, limit):.3f}")
    if apex is not None:
        page.row(name, "creepkit", whole, "", f"{cpu:.4f}", "1", f"{difference(apex, limit):.3f}")


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("cases", nargs="*", default=list(CASES), help="some of " + " ".join(CASES))
    parser.add_argument("--cetol", nargs="+", type=float, default=[1e-4, 1e-5])
    parser.add_argument("--refinement", type=float, default=1.0)
    parser.add_argument("--alone", action="store_true", help="leave creepkit out")
    options = parser.parse_args()
    unknown = [name for name in options.cases if name not in CASES]
    if unknown:
        parser.error(f"no case is called {', '.join(unknown)}; there are {', '.join(CASES)}")
    if len(set(options.cetol)) < 2:
        parser.error("two values of cetol are needed, for the limit of small increments")
    page = Page("calculix", __doc__)
    page.table(
        "case",
        "code",
        "limit of the apex at 12 h, mm (from the converged apex, %)",
        "increments",
        "CPU time, s",
        "CPU time over creepkit",
        "difference from the limit, %",
    )
    for name in options.cases:
        try:
            report(page, name, options.cetol, options.refinement, options.alone)
        except Stopped as stopped:
            page.row(name, str(stopped), "", "", "", "", "")
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
