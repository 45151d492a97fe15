"""Laws with tertiary creep on measured curves from loading to rupture: the tables of the README.

    python tests/benchmarks/whole_life.py [--data FOLDER] [--sets cmsx6 ...] [--laws ...] [--quick] [--plots FOLDER]

Alloy 617 base metal (750 to 1000 C) and CMSX-6 (980 C), every frame to rupture. Columns: parameters; rms distance of a
frame from the curve in ln strain and ln time (loading strains taken off); Z = 10^(2.5 s) of the time to rupture, fitted
and leave-one-condition-out; predicted over measured rupture time, median and the range of 95 % of the tests; stopped
tests that the law breaks too early; scatter of the rate between tests; BIC less the best; CPU seconds of the
identification (a tolerance of 1e-4 in each step: strains within some 1e-3, far below the scatter).

The first laboratory of Alloy 617 (22 tests) does not say how its tests ended: they count as having lasted to their last
frame. A test that stands twice in the set counts once.
"""

import argparse
import time
from collections import defaultdict
from pathlib import Path

import numpy as np

import creepkit as ck
from creepkit.inverse.cross_validation import cross_validate, times_to_rupture
from creepkit.inverse.reference_conditions import reference_temperature, spans_temperatures
from creepkit.inverse.selection import rank
from creepkit.quality.comparison import duplicate_tests

HEAD = (
    "| law | K | rms distance | Z fitted | Z held out | predicted/measured, 95 % | stopped, broken early "
    "| rate between tests | BIC - best | CPU s | not determined, or at a bound |"
)


def catalogue(histories):
    """{name: law}: laws with tertiary creep as bars see them, their growth with an activation energy of its own."""
    plain = {
        "liu-murakami": ck.law("liu-murakami").fix(alpha=0),
        "mpc-omega": ck.law("mpc-omega").fix(c=0),
        "kachanov-rabotnov": ck.law("kachanov-rabotnov").fix(alpha=0, m=0),
        "sinh-damage": ck.law("sinh-damage").fix(alpha=0, beta=0),
        "norton": ck.law("norton"),
        "mpc-omega, Omega(stress)": ck.law("mpc-omega"),
        "kachanov-rabotnov, primary": ck.law("kachanov-rabotnov").fix(alpha=0),
    }
    if not spans_temperatures(histories):
        return plain
    T = reference_temperature(histories)
    grows = {"kachanov": ("B",), "liu": ("B",), "sinh": ("M", "s_s", "s_t"), "mpc": ("Omega",)}
    warm = {}
    for name, law in plain.items():
        law = law.times(ck.arrhenius(T_ref=T))
        own = grows.get(name.split("-")[0], ())
        warm[name] = law.with_temperature(**{param: ck.activated(T_ref=T) for param in own}) if own else law
    return warm


def sets(folder):
    """{name: histories whose end is known, or that lasted to their last frame}."""
    alloy = [h for h in ck.read_histories(folder / "alloy617") if h.labels.get("product") == "Base"]
    twins = {other for _, other in duplicate_tests(alloy)}
    alloy = [h if h.end_known else h.replace(unruptured=True) for h in alloy if h.name not in twins]
    return {"alloy617-base": alloy, "cmsx6": ck.read_histories(folder / "cmsx6")}


def spread_of_repeats(histories):
    """(Z, tests beyond the first of each condition) of rupture times: what no law can better."""
    logs = defaultdict(list)
    for h in histories:
        if h.rupture_time is not None:
            logs[h.condition].append(np.log10(h.rupture_time))
    freedom = sum(len(v) - 1 for v in logs.values())
    squares = sum(((np.array(v) - np.mean(v)) ** 2).sum() for v in logs.values())
    return 10 ** (2.5 * np.sqrt(squares / freedom)), freedom


def row(name, fit, histories, cpu, quick):
    """One line of the table, without BIC."""
    fitted = times_to_rupture(fit.law, fit.values, histories, fit.predictor)
    held = "-" if quick else f"{cross_validate(fit, histories, by='condition').times_to_rupture().z_factor:.2f}"
    low, middle, high = np.percentile(fitted.predicted / fitted.measured, [2.5, 50, 97.5])
    ends = [m.rupture for m in fit.tests if m.rupture is not None and m.rupture.stopped]
    early = sum(r.predicted < r.measured for r in ends)
    flaws = [e.name for e in fit.estimates if e.verdict != "determined"]
    return [
        name, str(len(fit.law.params)), f"{fit.rms:.3f}", f"{fitted.z_factor:.2f}", held,
        f"{middle:.2f} ({low:.2f} to {high:.2f})", f"{early} of {len(ends)}", f"{100 * fit.noise_model.rate:.0f} %",
        "", f"{cpu:.1f}", ", ".join(flaws) or "none",
    ]  # fmt: skip


def main():
    """Print one table a set, rows by BIC."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=Path("../shared/data/uniaxial"))
    parser.add_argument("--sets", nargs="*")
    parser.add_argument("--laws", nargs="*")
    parser.add_argument("--quick", action="store_true", help="no leave-one-condition-out")
    parser.add_argument("--held-out", type=int, default=400, help="hold out where tests x parameters are up to so many")
    parser.add_argument("--starts", type=int, default=4)
    parser.add_argument("--plots", type=Path)
    given = parser.parse_args()
    bar = ck.specimen("uniaxial").replace(tolerance=1e-4)
    for title, histories in sets(given.data).items():
        if given.sets and title not in given.sets:
            continue
        broke = sum(h.rupture_time is not None for h in histories)
        repeats = "repeats of one condition alone: Z = {:.2f}, from {} repeats".format(*spread_of_repeats(histories))
        print(f"\n### {title}: {len(histories)} tests, {broke} of them ruptured; {repeats}", flush=True)
        fits, rows = [], []
        for name, law in catalogue(histories).items():
            if given.laws and name not in given.laws:
                continue
            before = time.process_time()
            try:
                fit = ck.identify(law, histories, bar, starts=given.starts)
            except ck.errors.FitError as error:
                print(f"no fit: {error}", flush=True)
                continue
            quick = given.quick or len(histories) * len(law.params) > given.held_out
            rows.append(row(name, fit, histories, time.process_time() - before, quick))
            fits.append(fit)
            print(
                "done:",
                " | ".join(rows[-1]),
                f"| ln L {fit.log_likelihood:.1f}, size {fit.effective_frames:.1f}",
                flush=True,
            )
            if given.plots:
                given.plots.mkdir(parents=True, exist_ok=True)
                fit.plot(given.plots / f"{title}_{name.replace(' ', '_')}.png")
                (given.plots / f"{title}_{name.replace(' ', '_')}.txt").write_text(str(fit))
        print(f"\n{HEAD}\n{'|-' * (HEAD.count('|') - 1)}|")
        for entry in rank(fits).laws:
            line = rows[fits.index(entry.fit)]
            line[8] = f"{entry.excess:.0f}"
            print("| " + " | ".join(line) + " |")


if __name__ == "__main__":
    main()
