"""CPU time of what users run, of one version of creepkit.

    python tests/benchmarks/user_costs.py [--write]
    PYTHONPATH=OTHER/src python tests/benchmarks/user_costs.py      the same of another version, checked out at OTHER

One process, CPU time of all its threads, everything compiled and trained before. A prediction is one dimple under 8
MPa, then 10 MPa, with 289 frames of 12 h, least of repeats, mean over six laws of the paper; derivatives are those to
the law's parameters, thickness, modulus and temperature. Identifications are of three planted specimens (median), of
the 94 creep curves of Alloy 617 and of nine dimples of Inconel 625 (offset and thickness free, four starts).
"""

import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from measured import Page, arguments

import creepkit as ck
from creepkit.records import History, PressureJump
from creepkit.specimens.bulge.specimen import Bulge

ROOT = Path(ck.__file__).resolve().parents[2]
DATA = Path(__file__).resolve().parents[2].parent / "shared" / "data"
TIMES = np.maximum(np.arange(289) * 150.0, 1.0)
CASES = {
    "norton": dict(A=1e-14, n=4.0),
    "strain-hardening": dict(A=2e-15, n=4.0, m=-0.4),
    "time-hardening": dict(A=3e-12, n=3.6, m=-0.4),
    "hyperbolic-sine": dict(A=1e-7, n=3.0, B=60.0),
    "drifting-exponent": dict(A=1e-14, n_0=3.6, n_inf=4.0, C=0.3, tau_d=1e4, tau_r=3e3, m=0.0),
    "combined": dict(A_1=1e-9, n_1=3, B=60, A_2=1e-14, n_2=4, m_1=-0.3, A_3=3e-12, n_3=3, m_2=-0.4),
}


def cpu_seconds(call: Callable[[], object], repeats: int = 1) -> float:
    """Least CPU time of some calls."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        call()
        times.append(time.process_time() - start)
    return min(times)


def predictions() -> tuple[float, float]:
    """CPU s of a prediction, without and with derivatives, mean over the laws."""
    specimen, values, derivatives = Bulge(threads=1), [], []
    nuisances = {"thickness": np.array([[0.5]]), "modulus": np.array([[0.0]]), "temperature": np.array([[0.0]])}
    for name, case in CASES.items():
        law = ck.law(name)
        theta = law.to_internal(law.values(case))
        history = History(
            name=name, times=TIMES, outputs={}, loading=PressureJump(8.0, 10.0, 14400.0), temperature=1000.0,
            specimen="bulge", elastic=ck.Elastic(150e3),
        )  # fmt: skip
        specimen.predict(law, theta, [history], nuisances=nuisances, sensitivities=True)

        def predict(law=law, theta=theta, history=history):
            return specimen.predict(law, theta, [history])

        def differentiate(law=law, theta=theta, history=history):
            return specimen.predict(law, theta, [history], nuisances=nuisances, sensitivities=True)

        values.append(cpu_seconds(predict, 9))
        derivatives.append(cpu_seconds(differentiate, 5))
    return float(np.mean(values)), float(np.mean(derivatives))


def identifications() -> tuple[float, float]:
    """CPU s of one law, and of the four single laws of the paper, on a planted dimple."""
    sys.path.insert(0, str(ROOT / "tests" / "benchmarks"))
    sys.path.insert(0, str(ROOT / "tests"))
    import planted_bulge_tests as planted

    design, dimple = planted.DESIGNS["jump"], ck.specimen("bulge")
    specimens = [planted.specimen(k, planted.SINGLE, design, dimple) for k in range(4)]

    def one(x) -> None:
        ck.identify(x.law, x.tests, dimple, nuisances=design.nuisances, weights="likelihood", frames=60)

    def four(x) -> None:
        ck.select(planted.SINGLE, x.tests, dimple, nuisances=design.nuisances)

    four(specimens[0])
    one(specimens[0])
    times = [(cpu_seconds(lambda x=x: one(x)), cpu_seconds(lambda x=x: four(x))) for x in specimens[1:]]
    return tuple(np.median(times, axis=0))


def alloy_617() -> float:
    """CPU s of Norton's law with an Arrhenius factor on 94 creep curves."""
    curves, law = ck.read_histories(DATA / "uniaxial" / "alloy617"), ck.law("norton").times(ck.arrhenius())
    ck.identify(law, curves, "uniaxial")
    return cpu_seconds(lambda: ck.identify(law, curves, "uniaxial"))


def inconel_625() -> float:
    """CPU s of n(t) with an Arrhenius factor on nine dimples."""
    tests = ck.read_histories(DATA / "dabi" / "in625")
    tests = [test.replace(outputs={"amplitude": test.outputs["amplitude"]}) for test in tests]
    law = ck.law("drifting-exponent").fix(m=0).times(ck.arrhenius())
    unknown = (ck.Nuisance("offset", sd=0.012), ck.Nuisance("thickness", mean=0.4935, sd=0.027))
    return cpu_seconds(lambda: ck.identify(law, tests, "bulge", nuisances=unknown, starts=4, test_loss="student"))


def main() -> None:
    """Run all."""
    options = arguments(__doc__).parse_args()
    page = Page("user_costs", __doc__)
    page.table("what", "CPU time")
    value, derivatives = predictions()
    page.row("prediction of one 12 h test", f"{1e3 * value:.2f} ms")
    page.row("the same with derivatives", f"{1e3 * derivatives:.1f} ms")
    one, four = identifications()
    page.row("one law on one dimple, with intervals", f"{one:.2f} s")
    page.row("four laws on one dimple, with intervals", f"{four:.2f} s")
    page.row("Alloy 617, 94 curves, one law", f"{alloy_617():.1f} s")
    page.row("nine Inconel 625 tests, offset and thickness, four starts", f"{inconel_625():.1f} s")
    page.row("largest memory of this process", f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
