"""Uniaxial creep, 10,000 curves of 100 points of the combined law: CPU time, and error against a tight run.

Run as ``python tests/benchmarks/uniaxial_speed.py``. On a subset the same curves are integrated by a hand-written loop
over scipy's solve_ivp (LSODA and Radau on the rate as NumPy, from a start by the leading power of time), in the same
process. CPU time of this process, compilation excluded. The compiled code is one thread.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.stats import qmc

from creepkit.integration import Integration, IntegrationSettings, PointTest, integrate
from creepkit.kernels import lower
from creepkit.laws.combined import COMBINED
from creepkit.records import Program

CURVES, POINTS, SUBSET = 10_000, 100, 40
STRESS, END = 100.0, 1e5
TIMES = np.linspace(END / POINTS, END, POINTS)


@dataclass(frozen=True)
class Row:
    """One line of the table: seconds of CPU for `curves` curves, and the worst relative error against a tight run."""

    what: str
    curves: int
    seconds: float
    error: float = np.nan

    def __str__(self) -> str:
        each = 1e6 * self.seconds / self.curves
        return f"{self.what:44s} {self.curves:7d} {self.seconds:9.3f} {each:11.1f} {self.error:10.1e}"


def candidates(count: int) -> np.ndarray:
    """Internal parameters over Table 1's bounds; each term alone gives 1e-6 to 0.1 at the end."""
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
    """Print the table."""
    kernel, theta = lower(COMBINED, "numba"), candidates(CURVES)
    test = PointTest(Program.constant(STRESS), Program.constant(1000.0), TIMES)

    def compiled(rows: np.ndarray, rtol: float, jacobian: bool = False) -> Integration:
        return integrate(kernel, rows, [test], settings=IntegrationSettings(rtol=rtol), jacobian=jacobian)

    compiled(theta[:1], 1e-5, True)
    exact = compiled(theta, 1e-10).strain
    print(f"{'':44s} {'curves':>7s} {'CPU s':>9s} {'us a curve':>11s} {'error':>10s}")
    rows = []
    for rtol in (1e-4, 1e-5, 1e-6):
        seconds, result = timed(lambda rtol=rtol: compiled(theta, rtol))
        error = float(np.abs(result.strain / exact - 1).max())
        rows.append(Row(f"creepkit, tolerance {rtol:g}", CURVES, seconds, error))
    seconds, result = timed(lambda: compiled(theta, 1e-5, True))
    rows.append(Row("creepkit, tolerance 1e-05, 9 sensitivities", CURVES, seconds))
    for method in ("LSODA", "Radau"):
        seconds, curves = timed(lambda method=method: [by_scipy(row, method) for row in theta[:SUBSET]])
        error = max(float(np.abs(c / e - 1).max()) for c, e in zip(curves, exact[:SUBSET], strict=True))
        rows.append(Row(f"scipy solve_ivp {method}, rtol 1e-6", SUBSET, seconds, error))
    for row in rows:
        print(row)
    base = rows[1].seconds / rows[1].curves
    for row in rows[4:]:
        ratio = row.seconds / row.curves / base
        print(f"{row.what}: {ratio:.0f} times the CPU of creepkit at its default tolerance")


if __name__ == "__main__":
    main()
