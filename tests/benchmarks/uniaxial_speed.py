"""Speed and accuracy of uniaxial creep: curves of the combined law, beside scipy's integrators.

    python tests/benchmarks/uniaxial_speed.py [--curves 10000] [--scipy 40] [--write]

Curves of 100 points under constant stress, parameters over the bounds of the paper's Table 1. The error is the largest
relative one of any strain against a run at a tolerance of 1e-10. On a few of the curves the same is integrated by a
hand-written loop over scipy's solve_ivp (LSODA and Radau, the rate as NumPy, from a start by the leading power of
time), in the same process. CPU time on one thread, without compilation; ratios are to creepkit at its default tolerance
of 1e-5.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from measured import Page, arguments
from scipy.integrate import solve_ivp
from scipy.stats import qmc

from creepkit.integration import Integration, IntegrationSettings, PointTest, integrate
from creepkit.kernels import lower
from creepkit.laws.combined import COMBINED
from creepkit.records import Program

POINTS = 100
STRESS, END = 100.0, 1e5
"""MPa, s."""
DEFAULT_TOLERANCE = 1e-5
TIMES = np.linspace(END / POINTS, END, POINTS)


def candidates(count: int) -> np.ndarray:
    """Internal parameters, (count, 9), over the bounds; each term alone gives a strain of 1e-6 to 0.1 at the end."""
    u = qmc.Sobol(9, seed=11).random(2 ** int(np.ceil(np.log2(count))))[:count]
    n = 1 + 7 * u[:, 0:3]
    log_breakdown = np.log(10.0) * (1 + 2 * u[:, 3])
    m_strain, m_time = -u[:, 4], -0.95 * u[:, 5]
    reach = np.log(10.0) * (-6 + 5 * u[:, 6:9])
    x = STRESS / np.exp(log_breakdown)
    log_sinh = x + np.log1p(-np.exp(-2 * x)) - np.log(2.0)
    log_stress, log_end = np.log(STRESS), np.log(END)
    a1 = reach[:, 0] - log_end - n[:, 0] * log_sinh
    a2 = (1 - m_strain) * reach[:, 1] - np.log1p(-m_strain) - log_end - n[:, 1] * log_stress
    a3 = reach[:, 2] + np.log1p(m_time) - (1 + m_time) * log_end - n[:, 2] * log_stress
    return np.stack([a1, n[:, 0], log_breakdown, a2, n[:, 1], m_strain, a3, n[:, 2], m_time], axis=1)


def by_scipy(theta: np.ndarray, method: str) -> np.ndarray:
    """One curve by solve_ivp, as one would write it by hand: start at 1e-9 of the end on the leading power."""
    A, n, B, A2, n2, m, A3, n3, q = theta
    steady = np.exp(A) * np.sinh(STRESS / np.exp(B)) ** n
    hardening, aging = np.exp(A2 + n2 * np.log(STRESS)), np.exp(A3 + n3 * np.log(STRESS))

    def rate(t: float, p: np.ndarray) -> np.ndarray:
        return steady + hardening * p**m + aging * t**q

    start = 1e-9 * END
    alone = [steady * start, ((1 - m) * hardening * start) ** (1 / (1 - m)), aging * start ** (1 + q) / (1 + q)]
    solution = solve_ivp(rate, (start, END), [sum(alone)], method=method, t_eval=TIMES, rtol=1e-6, atol=1e-10)
    return np.asarray(solution.y[0])


def timed(work: Callable[[], object]) -> tuple[float, object]:
    """CPU seconds of a call, and its result."""
    start = time.process_time()
    result = work()
    return time.process_time() - start, result


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--curves", type=int, default=10_000)
    parser.add_argument("--scipy", type=int, default=40, help="curves that scipy integrates")
    options = parser.parse_args()
    kernel, theta = lower(COMBINED, "compiled"), candidates(options.curves)
    test = PointTest(Program.constant(STRESS), Program.constant(1000.0), TIMES)

    def integrated(tolerance: float, curves: int = options.curves, sensitivities: bool = False) -> Integration:
        settings = IntegrationSettings(rtol=tolerance)
        return integrate(kernel, theta[:curves], [test], settings=settings, jacobian=sensitivities)

    integrated(DEFAULT_TOLERANCE, 1, True)
    exact = integrated(1e-10).strain
    page = Page("uniaxial_speed", __doc__)
    page.table(
        "integration",
        "curves",
        "CPU time, s",
        "CPU time of a curve, us",
        "over the default",
        "steps, rejected",
        "largest error",
    )
    default = timed(lambda: integrated(DEFAULT_TOLERANCE))[0] / options.curves

    def row(label: str, curves: int, seconds: float, steps: str, error: str) -> None:
        each = seconds / curves
        page.row(label, curves, f"{seconds:.3f}", f"{1e6 * each:.1f}", f"{each / default:.2f}", steps, error)

    def mean_steps(result: Integration) -> str:
        return ", ".join(f"{mean:.1f}" for mean in result.steps.reshape(-1, 2).mean(axis=0))

    for tolerance in (1e-3, 1e-4, DEFAULT_TOLERANCE, 1e-6):
        seconds, result = timed(lambda tolerance=tolerance: integrated(tolerance))
        error = np.abs(result.strain / exact - 1).max()
        row(f"creepkit, tolerance {tolerance:g}", options.curves, seconds, mean_steps(result), f"{error:.1e}")
    seconds, result = timed(lambda: integrated(DEFAULT_TOLERANCE, sensitivities=True))
    row(f"creepkit, tolerance {DEFAULT_TOLERANCE:g}, 9 sensitivities", options.curves, seconds, mean_steps(result), "")
    few = theta[: options.scipy]
    for method in ("LSODA", "Radau"):
        seconds, curves = timed(lambda method=method: [by_scipy(one, method) for one in few])
        error = max(float(np.abs(c / e - 1).max()) for c, e in zip(curves, exact, strict=False))
        row(f"scipy solve_ivp {method}, rtol 1e-6", len(few), seconds, "", f"{error:.1e}")
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
