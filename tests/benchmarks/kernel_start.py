"""Time until a law can be simulated, in new interpreters: python kernel_start.py.

A law never seen before is lowered, compiled and called, with an empty cache folder; then the same in a second
interpreter, which finds it on disk. CPU time, imports apart; median of a few runs. The issue allows 6 s and 0.5 s.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile

LAWS = ("norton", "strain-hardening", "time-hardening", "hyperbolic-sine", "drifting-exponent", "combined")
REPEATS = 3
PROGRAM = """
import sys, time
import numpy, numba, sympy
import creepkit
from creepkit.kernels import compilation, interface
from creepkit.integration import integrate

law = creepkit.law(sys.argv[1])
if sys.argv[1] == "combined":
    law = law.times(creepkit.arrhenius()).with_temperature(n_2=creepkit.linear())
start = time.process_time()
ready = creepkit.lower(law, "numba")
point = numpy.array([[100.0, 0.01, 10.0, 1000.0, 100.0, 33.0]])
interface.call_entry(ready, "update", point, law.to_internal(law.center())[0])
print(time.process_time() - start)
"""


def seconds(law: str, folder: str) -> float:
    """CPU seconds until `law` answers, in a new interpreter that uses a cache folder."""
    environment = {**os.environ, "CREEPKIT_CACHE": folder}
    found = subprocess.run(
        [sys.executable, "-c", PROGRAM, law], check=True, capture_output=True, text=True, env=environment
    )
    return float(found.stdout)


def main() -> None:
    """Print the table."""
    print(f"{'CPU s':36}{'new':>8}{'known':>8}")
    for law in LAWS:
        new, known = [], []
        for _ in range(REPEATS):
            with tempfile.TemporaryDirectory() as folder:
                new.append(seconds(law, folder))
                known.append(seconds(law, folder))
        label = "combined x arrhenius, n_2(T)" if law == "combined" else law
        print(f"{label:36}{statistics.median(new):8.2f}{statistics.median(known):8.2f}", flush=True)


if __name__ == "__main__":
    main()
