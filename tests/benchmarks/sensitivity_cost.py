"""What sensitivities of a bulge test cost, and what the solver costs to start: ratios of CPU time within one run.

    python tests/benchmarks/sensitivity_cost.py [--cold]

Ten columns: the nine parameters of the combined law and the modulus. `--cold` also measures the first simulation of a
fresh machine, and a second one, each in a process of its own with an empty cache.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time

import numpy as np

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


def least(function, repeats: int = 12) -> float:
    """Least CPU time of some calls, s."""
    best = np.inf
    for _ in range(repeats):
        start = time.process_time()
        function()
        best = min(best, time.process_time() - start)
    return best


def main() -> None:
    """Print the table."""
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--cold", action="store_true", help="measure the first simulation of a fresh machine too")
    dimple, times = Bulge(threads=1), np.arange(150.0, 43200.0 + 1, 150.0)
    print("| law | forward, ms of CPU | with slopes to the law and E, ms | columns | ratio |\n|-|-|-|-|-|")
    for label, (name, values, loading) in CASES.items():
        law = ck.law(name)
        plan = ck.History(
            name=label, times=times, outputs={}, loading=loading, temperature=1000.0, specimen="bulge",
            elastic=ck.Elastic(E=150e3),
        )  # fmt: skip
        numbers, modulus = law.values(values), {"modulus": np.zeros((1, 1))}
        forward = least(
            lambda law=law, plan=plan, numbers=numbers: dimple.predict(law, law.to_internal(numbers), [plan])
        )
        both = least(
            lambda law=law, plan=plan, numbers=numbers, modulus=modulus: dimple.predict(
                law, law.to_internal(numbers), [plan], sensitivities=True, nuisances=modulus
            )
        )
        columns = len(law.names) + 1
        print(f"| {label} | {1e3 * forward:.1f} | {1e3 * both:.1f} | {columns} | {both / forward:.2f} |")
    if arguments.parse_args().cold:
        with tempfile.TemporaryDirectory() as folder:
            for label in ("first simulation on a machine", "second one"):
                before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
                places = {"NUMBA_CACHE_DIR": folder, "CREEPKIT_CACHE": folder}
                subprocess.run([sys.executable, "-c", START], check=True, env={**os.environ, **places})
                after = resource.getrusage(resource.RUSAGE_CHILDREN)
                cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
                print(f"{label}, Python's start included: {cpu:.1f} s of CPU, {time.perf_counter() - start:.1f} s wall")


if __name__ == "__main__":
    main()
