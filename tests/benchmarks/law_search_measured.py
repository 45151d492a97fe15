"""Laws found in measured creep curves, and what they say of tests that were left out, beside regression of rates.

    python tests/benchmarks/law_search_measured.py [--data FOLDER] [--sets cmsx6 ...] [--budget 60]
                                                   [--gplearn PYTHON] [--write]

CMSX-6 (980 °C) without its tests at the highest stress, Alloy 617 (base metal) without those at the highest
temperature; curves up to 5 % strain. Every answer is judged by the rms of ln rate: mean rates of the smoothed curves,
at the strain and time that were measured, fitted tests and tests left out. The best law of search_laws() and the best
registered law beside it; pysindy 2.1.0, STLSQ on polynomials of second degree of ln stress, ln strain, ln time and
1/T; gplearn 0.4.3 with its default settings but 30 generations and a parsimony of 0.003, of the same. Both are given ln
rate, less its mean, and features over their standard deviations. gplearn runs in another environment, of --gplearn.
"""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

import numpy as np
from measured import Page, arguments
from measured_creep import STRAIN_LIMIT, sets
from scipy.integrate import solve_ivp

import creepkit as ck
from creepkit.kernels import lower
from creepkit.law_search.smoothed_rates import SmoothedRates

GPLEARN = """
import json, sys
import numpy as np
from gplearn.genetic import SymbolicRegressor
x, y, z = (np.array(one) for one in json.load(sys.stdin))
found = SymbolicRegressor(generations=30, parsimony_coefficient=0.003, random_state=0).fit(x, y)
print(json.dumps([str(found._program), list(found.predict(x)), list(found.predict(z))]))
"""


def features(rates: SmoothedRates, reference: SmoothedRates) -> np.ndarray:
    """(intervals, 3 or 4) ln stress, ln strain, ln time and, where temperatures differ, 1/T, over ranges of the fit."""

    def columns(of: SmoothedRates) -> np.ndarray:
        found = [np.log(of.stress[:, 1]), np.log(of.strain[:, 1]), np.log(of.time[:, 1]), 1 / of.temperature[:, 0]]
        return np.stack(found if np.ptp(reference.temperature) > 1.0 else found[:3], axis=1)

    fitted = columns(reference)
    return (columns(rates) - fitted.mean(axis=0)) / fitted.std(axis=0)


def of_law(fit: ck.Identification, rates: SmoothedRates) -> np.ndarray:
    """(intervals,) ln of mean rates along the smoothed curves, with internal variables from the start."""
    kernel, states = lower(fit.law, "numpy"), [state.name for state in fit.law.states]
    logs = np.empty_like(rates.time)
    for k in range(int(rates.test[-1]) + 1):
        own = rates.test == k
        time, strain, stress = (one[own].ravel() for one in (rates.time, rates.strain, rates.stress))
        at = {"temperature": rates.temperature[own][0, 0]}

        def now(t, time=time, strain=strain, stress=stress, at=at):
            return at | {"time": t, "strain": np.interp(t, time, strain), "stress": np.interp(t, time, stress)}

        if states:
            slope = lambda t, z: [  # noqa: E731
                float(one)
                for one in kernel.state_rates(fit.values, **now(t), **dict(zip(states, z, strict=True))).values()
            ]
            start = [state.initial for state in fit.law.states.values()]
            run = solve_ivp(slope, (0, time[-1]), start, "LSODA", time, rtol=1e-6, atol=1e-9)
            at |= dict(zip(states, run.y, strict=True))
        logs[own] = kernel.log_rate(fit.values, **now(time)).reshape(-1, 3)
    return np.logaddexp.reduce(rates.log_weight + logs, axis=1)


def split(name: str, tests: list[ck.History]) -> tuple[list[ck.History], list[ck.History]]:
    """Tests that are fitted, and those left out."""
    key = {"cmsx6": lambda h: round(h.loading.program().values[-1])}.get(name, lambda h: round(h.mean_temperature))
    last = max(map(key, tests))
    return [h for h in tests if key(h) < last], [h for h in tests if key(h) == last]


def main() -> None:
    """Print the table, and write it where asked to."""
    parser = arguments(__doc__)
    parser.add_argument("--data", type=Path, default=Path("../shared/data/uniaxial"))
    parser.add_argument("--sets", nargs="+", default=["cmsx6", "alloy617-base"])
    parser.add_argument("--budget", type=float, default=60.0, help="CPU seconds of each search")
    parser.add_argument("--gplearn", default="", help="interpreter of an environment with gplearn")
    options = parser.parse_args()
    page = Page("law_search_measured", __doc__)
    page.table("tests", "by", "law", "free numbers", "rms ln rate, fitted", "rms ln rate, left out")
    for name in options.sets:
        tests = [h.up_to("strain", STRAIN_LIMIT) for h in sets(options.data)[name]]
        fitted, left_out = split(name, [h for h in tests if (h.used & (h.times > 0)).sum() >= 8])
        both = [SmoothedRates.of_tests(one) for one in (fitted, left_out)]

        def row(by, law, count, predicted, name=name, both=both):
            misfits = [np.sqrt(np.mean((p - one.log_rate) ** 2)) for p, one in zip(predicted, both, strict=True)]
            page.row(name, by, law, count, *(f"{one:.2f}" for one in misfits))

        search = ck.search_laws(fitted, budget=options.budget)
        registered = {one.law.name for one in search.tried if one.registered}
        laws = [ranked.fit for ranked in search.ranking.laws]
        first = {"search_laws()": laws[0]}
        first["registered"] = next((fit for fit in laws if fit.law.name in registered), laws[0])
        for by, fit in first.items():
            row(by, fit.law.name, len(fit.law.params), [of_law(fit, one) for one in both])
        x, y, z = features(both[0], both[0]), both[0].log_rate, features(both[1], both[0])
        import pysindy

        library = pysindy.PolynomialLibrary(degree=2).fit(x)
        solver = pysindy.STLSQ(threshold=0.1, alpha=1e-3).fit(np.asarray(library.transform(x)), (y - y.mean())[:, None])
        predicted = [y.mean() + np.asarray(library.transform(one)) @ solver.coef_[0] for one in (x, z)]
        row("pysindy", "polynomial of logarithms", int((solver.coef_ != 0).sum()), predicted)
        if options.gplearn:
            given = json.dumps([x.tolist(), (y - y.mean()).tolist(), z.tolist()])
            command = [options.gplearn, "-c", GPLEARN]
            run = subprocess.run(command, input=given, capture_output=True, text=True, check=True)
            program, *predicted = json.loads(run.stdout)
            row(
                "gplearn",
                f"`{program}`" if len(program) < 60 else f"{program.count('(')} operations",
                len(re.findall(r"\d\.\d", program)),
                [y.mean() + np.array(one) for one in predicted],
            )
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
