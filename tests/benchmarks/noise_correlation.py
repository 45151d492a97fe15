"""Correlated noise of two outputs, stated and not: coverage and width of intervals, chi-square.

    python tests/benchmarks/noise_correlation.py [--sets 200] [--write]

Two tests of 30 frames show an amplitude that grows and a width that falls, in closed form, with stated noise that is
correlated in each frame. Norton's law is identified by likelihood, with the correlation stated and without. Columns:
the share of 95 % intervals of the rate coefficient that hold the planted value; rms error of its logarithm, and half
the width of the interval (median); the same two of least squares; how often the law is said to explain the tests to
their stated noise.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from measured import Page, arguments

from creepkit.inverse.identify import identify
from creepkit.inverse.settings import IdentificationSettings

sys.path.insert(0, str(Path(__file__).parents[1]))
from helpers.correlated_noise import LAW, VALUES, least_squares, measured
from helpers.two_outputs_predictor import TwoOutputs

SETTINGS = IdentificationSettings(
    starts=1, sobol_points=8, frames=60, nuisances=(), weights="likelihood", usual_errors="none"
)
CORRELATIONS = (0.9, 0.0, -0.9)


def row(page: Page, rho: float, stated: bool, sets: int) -> None:
    """Identify from so many draws."""
    held, explained, errors, widths = 0, 0, [], []
    for seed in range(sets):
        tests = measured(rho, seed)
        if not stated:
            tests = [test.replace(noise_correlation={}) for test in tests]
        fit = identify(LAW, tests, TwoOutputs(), settings=SETTINGS)
        one = fit.estimates[0]
        held += one.low <= VALUES["A"] <= one.high
        errors.append(np.log(fit.values["A"] / VALUES["A"]))
        widths.append(0.5 * np.log(one.high / one.low))
        explained += fit.adequacy is not None and fit.adequacy.explains
    exact = least_squares(measured(rho, 0), rho)[1]
    page.row(
        f"{rho:g}", "yes" if stated else "no", f"{100 * held / sets:.1f} %",
        f"{np.sqrt(np.mean(np.square(errors))):.4f}", f"{np.median(widths):.4f}", f"{exact:.4f}", f"{1.96 * exact:.4f}",
        f"{100 * explained / sets:.0f} %",
    )  # fmt: skip


def main() -> None:
    """Print the table, and write it where asked to."""
    parser = arguments(__doc__)
    parser.add_argument("--sets", type=int, default=200, help="draws of the noise for each row")
    options = parser.parse_args()
    page = Page("noise_correlation", __doc__)
    page.table(
        "correlation", "stated", "coverage", "rms error of ln A", "half width",
        "least squares: sd of ln A", "half width", "explained",
    )  # fmt: skip
    for rho in CORRELATIONS:
        for stated in (True, False) if rho else (True,):
            row(page, rho, stated, options.sets)
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
