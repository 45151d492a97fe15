"""Every sensible law of the catalogue on measured creep curves: the table of the README.

    python tests/benchmarks/measured_creep.py [--data FOLDER] [--sets alloy617 ...] [--quick] [--plots FOLDER]

Alloy 617 (750 to 1000 C) and CMSX-6 (980 C) up to 5 % strain; engineering strain under constant load is compared with
true stress and logarithmic strain inside. Columns: parameters; rms of ln strain (each test's own loading strain taken
off); Z = 10^(2.5 s) of the time to 1 % creep strain, fitted and leave-one-condition-out (the first frame counts as
loading strain); scatter of the rate between tests; BIC less the best; CPU seconds of the identification.
"""

import argparse
import time
from collections import defaultdict
from pathlib import Path

import numpy as np

import creepkit as ck
from creepkit.inverse.cross_validation import (
    cross_validate,
    loading_strains,
    measured_time_to_strain,
    times_to_strain,
)
from creepkit.inverse.reference_conditions import reference_temperature, spans_temperatures
from creepkit.inverse.selection import rank
from creepkit.quality.comparison import duplicate_tests

LIMIT, LEVEL = 0.05, 0.01
LAWS = (
    "norton",
    "hyperbolic-sine",
    "strain-hardening",
    "time-hardening",
    "logarithmic",
    "drifting-exponent",
    "combined",
)
HEAD = (
    "| law | K | rms ln strain | Z fitted | Z held out | rate between tests | BIC - best | CPU s "
    "| not determined, or at a bound |"
)


def catalogue(histories):
    """{name: law}: each law alone, with temperature where the tests call for it, and what grows from them."""
    plain = {name: ck.law(name) for name in LAWS}
    plain["norton + strain-hardening"] = ck.law("norton") + ck.law("strain-hardening")
    if not spans_temperatures(histories):
        return plain
    T = reference_temperature(histories)
    warm = {f"{name} x arrhenius": law.times(ck.arrhenius(T_ref=T)) for name, law in plain.items()}
    warm["norton x arrhenius, n(T)"] = warm["norton x arrhenius"].with_temperature(n=ck.linear(T_ref=T))
    warm["strain-hardening x arrhenius, n(T)"] = warm["strain-hardening x arrhenius"].with_temperature(
        n=ck.linear(T_ref=T)
    )
    warm["logarithmic x arrhenius, n(T)"] = warm["logarithmic x arrhenius"].with_temperature(n=ck.linear(T_ref=T))
    warm["hyperbolic-sine x arrhenius, B(T)"] = warm["hyperbolic-sine x arrhenius"].with_temperature(
        B=ck.activated(T_ref=T)
    )
    own = [ck.law(name).times(ck.arrhenius(T_ref=T)) for name in ("norton", "strain-hardening")]
    warm["norton + strain-hardening, own Q"] = own[0] + own[1]
    return warm


def sets(folder):
    """{name: histories with all frames}."""
    alloy = ck.read_histories(folder / "alloy617")
    return {
        "alloy617": alloy,
        "alloy617-base": [h for h in alloy if h.labels.get("product") == "Base"],
        "cmsx6": ck.read_histories(folder / "cmsx6"),
    }


def usable(histories):
    """Frames up to the strain limit; a curve that has none after time zero is left out, and said."""
    cut = [h.up_to("strain", LIMIT) for h in histories]
    for h in cut:
        if (h.used & (h.times > 0)).sum() < 2:
            print(f"left out: {h.name}, which begins above {100 * LIMIT:g} % strain")
    return [h for h in cut if (h.used & (h.times > 0)).sum() >= 2]


def spread_of_repeats(histories):
    """(Z, tests beyond the first of each condition): what repeats of one condition scatter, which no law can better."""
    twins = {other for _, other in duplicate_tests(histories)}
    logs = defaultdict(list)
    for h, start in zip(histories, loading_strains(histories), strict=True):
        if h.name not in twins and (reached := measured_time_to_strain(h, LEVEL + start)) is not None:
            logs[h.condition].append(np.log10(reached))
    freedom = sum(len(v) - 1 for v in logs.values())
    squares = sum(((np.array(v) - np.mean(v)) ** 2).sum() for v in logs.values())
    return 10 ** (2.5 * np.sqrt(squares / freedom)), freedom


def row(name, fit, histories, cpu, largest):
    """One line of the table, without BIC."""
    fitted = times_to_strain(fit.law, fit.values, histories, fit.predictor, LEVEL, loading_strains(histories))
    held = "-"
    if len(fit.law.params) <= largest:
        held = f"{cross_validate(fit, histories, by='condition').times_to_strain(LEVEL).z_factor:.2f}"
    ends = [e.name for e in fit.estimates if e.verdict != "determined"]
    scatter = f"{100 * fit.noise_model.rate:.0f} %"
    first = [name, str(len(fit.law.params)), f"{fit.rms:.3f}", f"{fitted.z_factor:.2f}", held, scatter]
    return [*first, "", f"{cpu:.1f}", ", ".join(ends) or "all"]


def main():
    """Print one table a set, rows by BIC."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=Path("../shared/data/uniaxial"))
    parser.add_argument("--sets", nargs="*")
    parser.add_argument("--laws", nargs="*")
    parser.add_argument("--quick", action="store_true", help="no leave-one-condition-out")
    parser.add_argument("--held-out", type=int, default=7, help="hold out for laws of up to so many parameters")
    parser.add_argument("--plots", type=Path)
    given = parser.parse_args()
    for title, histories in sets(given.data).items():
        if given.sets and title not in given.sets:
            continue
        print(f"\n### {title}", flush=True)
        tests = usable(histories)
        print(
            "repeats of one condition alone: Z = {:.2f}, from {} repeats".format(*spread_of_repeats(tests)), flush=True
        )
        fits, rows = [], []
        for name, law in catalogue(tests).items():
            if given.laws and name not in given.laws:
                continue
            before = time.process_time()
            try:
                fit = ck.identify(law, tests)
            except ck.errors.FitError as error:
                print(f"no fit: {error}", flush=True)
                continue
            rows.append(row(name, fit, tests, time.process_time() - before, 0 if given.quick else given.held_out))
            fits.append(fit)
            print("done:", " | ".join(rows[-1]), flush=True)
            if given.plots:
                given.plots.mkdir(parents=True, exist_ok=True)
                fit.plot(given.plots / f"{title}_{name.replace(' ', '_')}.png")
        print(f"\n{len(tests)} tests, {sum(m.frames for m in fits[0].tests)} frames\n")
        print(HEAD)
        print("|-|-|-|-|-|-|-|-|-|")
        for entry in rank(fits).laws:
            line = rows[fits.index(entry.fit)]
            line[6] = f"{entry.excess:.0f}"
            line[8] = "none" if line[8] == "all" else line[8]
            print("| " + " | ".join(line) + " |")


if __name__ == "__main__":
    main()
