"""Creep that no sentence of search_laws() describes, predicted a third beyond the stresses of the tests.

    python tests/benchmarks/law_search_outside.py [--budget 60] [--truths NAME ...] [--write]

Twelve curves each, as in law_search: 60 to 150 MPa at 850, 900 and 950 K, to 4 % of strain, 40 readings, rates of tests
that scatter by 3 %. Asked is the time to 1 % of strain at 200 MPa and the three temperatures: the rms of ln of
predicted over planted time, of the best law of the search, and of the best of the registered laws that suit the tests.
"""

from __future__ import annotations

import time

import numpy as np
from law_search import LAST_STRAIN, LAST_TIME, SCATTER, STRAIN_NOISE, STRESSES, T_REF, TEMPERATURES
from measured import Page, arguments
from scipy.integrate import solve_ivp

import creepkit as ck
from creepkit.language.symbols import GAS_CONSTANT
from creepkit.records import History

BEYOND, ASKED = 200.0, 0.01
"""MPa, and the strain whose time is asked for."""


TRUTHS = {
    "exponent falling with time": lambda s, e, t: (s / 100) ** (3.5 + 2.5 * np.exp(-t / 3e4)),
    "two transients": lambda s, e, t: (s / 100) ** 4.5 * (1 + 6 * np.exp(-e / 8e-4) + 3 * np.exp(-e / 6e-3)),
    "transient that grows with stress": lambda s, e, t: (s / 100) ** 4 * (1 + 5 * np.exp(-e / (0.003 * s / 100))),
    "mechanisms in series": lambda s, e, t: 1 / ((s / 100) ** -7 + 0.5 * (s / 100) ** -3),
    "softening that falls with stress": lambda s, e, t: (s / 100) ** 5 * np.exp(60 * e * (100 / s) ** 1.5),
    "sine above a threshold": lambda s, e, t: np.sinh(np.maximum(s - 35, 0) / 40) ** 3,
    "hyperbolic hardening": lambda s, e, t: (s / 100) ** 4 * (1 + 1 / (0.05 + e / 2e-3)),
    "exponent falling with strain": lambda s, e, t: (s / 100) ** (4 + 3 * np.exp(-e / 0.01)),
}
"""{name: rate, relative, of stress in MPa, strain and time in s at T_REF}."""


LEVEL, ENERGY = 2e-7, 3.2e5
"""1/s at 100 MPa, and J/mol."""


def solved(name: str, stress: float, T: float, factor: float = 1.0):
    """(end s, function of time to strain) of a bar under a constant true stress."""
    level = factor * LEVEL * np.exp(-ENERGY / GAS_CONSTANT * (1 / T - 1 / T_REF))

    def slope(x: float, y: np.ndarray) -> np.ndarray:
        t = max(x, 1e-12) ** 5
        return level * TRUTHS[name](stress, max(y[0], 1e-14), t) * 5 * max(x, 1e-12) ** 4 * np.ones(1)

    def end(x: float, y: np.ndarray) -> float:
        return y[0] - LAST_STRAIN

    end.terminal = True
    run = solve_ivp(
        slope, (0, LAST_TIME**0.2), [1e-12], "Radau", events=[end], dense_output=True, rtol=1e-8, atol=1e-12
    )
    return run.t[-1] ** 5, lambda times: run.sol(np.asarray(times) ** 0.2)[0]


def curve(name: str, stress: float, T: float, rng: np.random.Generator) -> History:
    """A test of the planted creep."""
    end, strain = solved(name, stress, T, np.exp(SCATTER * rng.normal()))
    times = np.geomspace(3e-3, 1.0, 40) * end
    strains = strain(times) + STRAIN_NOISE * rng.normal(size=times.size)
    loading = ck.StressSteps([(0.0, stress)], control="stress")
    return History(f"{T:g} K, {stress:g} MPa", times=times, outputs={"strain": strains}, loading=loading, temperature=T)


def time_to(strain_at, times: np.ndarray) -> float:
    """s, when a strain is reached; times : (times,) at which it is evaluated."""
    return float(np.exp(np.interp(np.log(ASKED), np.log(strain_at), np.log(times))))


def predicted(fit: ck.Identification, T: float, about: float) -> float:
    """s, to ASKED by a law, at BEYOND MPa; about : the planted time."""
    times = about * np.geomspace(1e-3, 1e3, 400)
    loading = ck.StressSteps([(0.0, BEYOND)], control="stress")
    run = ck.simulate(fit.law, "uniaxial", fit.values, loading=loading, times=times, temperature=T)
    return time_to(np.maximum(run.outputs["strain"], 1e-14), run.times)


def main() -> None:
    """Print the table, and write it where asked to."""
    parser = arguments(__doc__)
    parser.add_argument("--budget", type=float, default=60.0, help="CPU seconds of each search")
    parser.add_argument("--truths", nargs="*", default=[*TRUTHS], help="names")
    options = parser.parse_args()
    page = Page("law_search_outside", __doc__)
    page.table("planted", "law of the search", "rms ln time", "best registered law", "rms ln time", "CPU s")
    rows = []
    for seed, name in enumerate(options.truths):
        rng, started = np.random.default_rng(seed), time.process_time()
        tests = [curve(name, s, T, rng) for T in TEMPERATURES for s in STRESSES]
        found = ck.search_laws(tests, budget=options.budget).ranking.best
        registered = ck.select(ck.candidates(tests), tests).best
        errors = []
        for fit in (found, registered):
            planted = [time_to(strain(t), t) for T in TEMPERATURES for t, strain in [planted_curve(name, T)]]
            times = [predicted(fit, T, about) for T, about in zip(TEMPERATURES, planted, strict=True)]
            errors.append(float(np.sqrt(np.mean(np.log(np.divide(times, planted)) ** 2))))
        rows.append(errors)
        seconds = f"{time.process_time() - started:.0f}"
        page.row(name, found.law.name, f"{errors[0]:.3f}", registered.law.name, f"{errors[1]:.3f}", seconds)
    medians = np.median(rows, axis=0)
    better = sum(a <= b * 1.05 for a, b in rows)
    page.paragraph(
        f"No worse than the best registered law (by 5 %): {better} of {len(rows)}; medians {medians[0]:.3f} and "
        f"{medians[1]:.3f}."
    )
    if options.write:
        page.write()


def planted_curve(name: str, T: float):
    """((times,) s, function of time to strain) at BEYOND MPa."""
    end, strain = solved(name, BEYOND, T)
    return np.geomspace(1e-4, 1.0, 400) * end, strain


if __name__ == "__main__":
    main()
