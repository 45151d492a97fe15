"""Cost of the sensitivities of a bulge test, and of the solver's first start.

    python tests/benchmarks/sensitivity_cost.py [--repeats 12] [--cold] [--write]

CPU time of one simulation of 12 h by finite elements, without and with its sensitivities to all parameters of the law
and to the modulus: the least of the repeats, on one thread, and the ratio of both. `--cold` also measures the first
simulation on a machine and a second one, each in a process of its own with an empty cache; Python's start is included.
"""

import os
import resource
import subprocess
import sys
import tempfile
import time

import numpy as np
from measured import Page, arguments
from public_calls import predict

import creepkit as ck
from creepkit.specimens.bulge.specimen import Bulge

CASES = {
    "combined, jump": (
        "combined",
        dict(A_1=1e-9, n_1=3, B=60, A_2=1e-14, n_2=4, m_1=-0.3, A_3=3e-12, n_3=3, m_2=-0.4),
        ck.PressureJump(8.0, 9.0, 14400.0),
    ),
    "norton": ("norton", dict(A=2e-12, n=3.0), ck.PressureJump(8.0, 8.0, 14400.0)),
    "n(t)": (
        "drifting-exponent",
        dict(A=1.14e-15, n_0=4.43, n_inf=4.3, C=1.29, tau_d=7818.0, tau_r=4754.0, m=0.0),
        ck.PressureJump(8.0, 8.0, 10800.0),
    ),
}
START = """
import creepkit as ck
ck.simulate(ck.law("norton"), ck.specimen("bulge"), dict(A=2e-12, n=3.0), loading=ck.PressureJump(8.0, 8.0, 1800.0),
            times=[600.0, 3600.0], elastic=ck.Elastic(E=150e3))
"""


def least_cpu(function, repeats: int) -> float:
    """Least CPU time of some calls, s; the first, which may compile, does not count."""
    function()
    best = np.inf
    for _ in range(repeats):
        start = time.process_time()
        function()
        best = min(best, time.process_time() - start)
    return best


def warm_table(page: Page, repeats: int) -> None:
    """Cost of sensitivities, law by law."""
    dimple, times = Bulge(threads=1), np.arange(150.0, 43200.0 + 1, 150.0)
    page.table("law", "simulation, CPU ms", "with sensitivities, CPU ms", "sensitivities", "ratio")
    for label, (name, values, loading) in CASES.items():
        law = ck.law(name)
        plan = ck.History(
            name=label,
            times=times,
            outputs={},
            loading=loading,
            temperature=1000.0,
            specimen="bulge",
            elastic=ck.Elastic(E=150e3),
        )
        call = (dimple, law, law.values(values), [plan])
        modulus = {"modulus": np.zeros((1, 1))}
        alone = least_cpu(lambda a=call: predict(*a), repeats)
        both = least_cpu(lambda a=call, m=modulus: predict(*a, nuisances=m, sensitivities=True), repeats)
        page.row(label, f"{1e3 * alone:.1f}", f"{1e3 * both:.1f}", len(law.names) + 1, f"{both / alone:.2f}")


def cold_table(page: Page) -> None:
    """The first simulation on a machine, and a second one."""
    page.table("simulation in a new process", "CPU time, s", "wall time, s")
    with tempfile.TemporaryDirectory() as folder:
        for label in ("first on a machine", "second"):
            before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
            environment = {**os.environ, "CREEPKIT_CACHE": folder}
            subprocess.run([sys.executable, "-c", START], check=True, env=environment)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            page.row(label, f"{cpu:.1f}", f"{time.perf_counter() - start:.1f}")


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--repeats", type=int, default=12)
    parser.add_argument("--cold", action="store_true", help="measure the first simulation on a machine too")
    options = parser.parse_args()
    page = Page("sensitivity_cost", __doc__)
    warm_table(page, options.repeats)
    if options.cold:
        cold_table(page)
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
