"""CPU time until a law can be simulated, in new interpreters.

    python tests/benchmarks/kernel_start.py [--laws norton ...] [--repeats 3] [--write]

A law that was never used is lowered, compiled and called once, with an empty cache folder ("first use"); then the same
in a second interpreter, which finds the compiled code on disk ("later use"). CPU time without imports, median of the
repeats. Limits: 6 s and 0.5 s.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile

from measured import Page, arguments

LAWS = ("norton", "strain-hardening", "time-hardening", "hyperbolic-sine", "drifting-exponent", "combined")
PROGRAM = """
import sys, time
import llvmlite, numpy, sympy
import creepkit
from creepkit.integration import integrate
from creepkit.kernels import compilation
from creepkit.kernels.interface import call_entry

law = creepkit.law(sys.argv[1])
if sys.argv[1] == "combined":
    law = law.times(creepkit.arrhenius()).with_temperature(n_2=creepkit.linear())
start = time.process_time()
kernel = creepkit.lower(law, "compiled")
point = numpy.array([[100.0, 0.01, 10.0, 1000.0, 100.0, 33.0]])
call_entry(kernel, "update", point, law.to_internal(law.center())[0])
print(time.process_time() - start)
"""


def seconds(law: str, folder: str) -> float:
    """CPU seconds until `law` was called, in a new interpreter that uses a cache folder."""
    environment = {**os.environ, "CREEPKIT_CACHE": folder}
    result = subprocess.run(
        [sys.executable, "-c", PROGRAM, law], check=True, capture_output=True, text=True, env=environment
    )
    return float(result.stdout)


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--laws", nargs="*", default=list(LAWS), choices=list(LAWS))
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    page = Page("kernel_start", __doc__)
    page.table("law", "first use: CPU s", "later use: CPU s")
    for law in options.laws:
        first, later = [], []
        for _ in range(options.repeats):
            with tempfile.TemporaryDirectory() as folder:
                first.append(seconds(law, folder))
                later.append(seconds(law, folder))
        label = "combined x arrhenius, n_2(T)" if law == "combined" else law
        page.row(label, f"{statistics.median(first):.2f}", f"{statistics.median(later):.2f}")
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
