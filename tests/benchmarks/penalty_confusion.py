"""What each penalty makes of planted single laws: the confusion matrices of the README.

    python tests/benchmarks/penalty_confusion.py [--specimens 12] [--laws HS ...] [--penalties L2 ...] [--through FILE]

Plants HS, PL, SPL and TPL, `--specimens` of each, in a dimple of .5 mm simulated by finite elements: pressure from 8 to
10 MPa at 4 h, 49 times of 900 s, white noise of 1.5 um on D_amp, .02 mm on S_d, .02 on S_p. With R = log10 of the rate
at 120 MPa, strain .01 and 1e4 s: R uniform in -7.3 to -5.7; PL n 1.5 to 7; SPL and TPL n 2 to 6, m -.7 to -.2; HS local
exponent at 120 MPa 4 to 8 and n 1 to 4; E about 150 GPa by 10 %. Draws that do not end between .15 and 1.2 mm are drawn
again. Seed 2026, one stream a specimen.

Each is identified from the sum of Eq. (2) through the surrogate that comes with creepkit (or --through), its modulus a
nuisance of 10 %, by: no penalty, L2, GroupL2, Sqrt, Subsets, Sqrt with automatic strength; and L2 in the paper's way,
identify(ck.law("combined"), tests, using=model, search=ck.ParticleSwarm(), penalty=ck.L2()). The answer is the term
that contributes most to the reduced law; with its exponent m switched off it is a power law (PL).

Printed for each: the confusion matrix (rows planted), share right with 95 % binomial interval, strict and with HS = PL
(over one jump of pressure a sinh of small argument is a power law), share left with one term, CPU seconds of one
identification. What rows share, the fits of the whole sum and of each term alone, is made once and counted in each.
--specimens 50 makes 200 specimens.
"""

import argparse
import sys
import time

import numpy as np
from scipy.optimize import brentq

import creepkit as ck
from creepkit.cli import set_numba_cache
from creepkit.inverse.settings import IdentificationSettings
from creepkit.inverse.sparsity.bootstrap import binomial_interval
from creepkit.inverse.sparsity.term_selection import identify_full, identify_reduced
from creepkit.records import History

SEED = 2026
LAWS = {"HS": "hyperbolic-sine", "PL": "norton", "SPL": "strain-hardening", "TPL": "time-hardening"}
TERMS = {"hyperbolic sine": "HS", "strain hardening": "SPL", "time hardening": "TPL"}
LEVEL, STRAIN, TIME = 120.0, 0.01, 1e4
MODULUS = 150e3
SD = {"amplitude": 1.5e-3, "width": 0.02, "shape": 0.02}
TIMES = 900.0 * np.arange(1, 49)
ENDS = (0.15, 1.2)
"""mm."""
JUMP = ck.PressureJump(P1=8, P2=10, Tj=14400)
SETTINGS = {"frames": 48, "starts": 4, "nuisances": (ck.Nuisance("modulus", sd=0.1),)}
PENALTIES = {
    "none": (ck.L2(0.0), None),
    "L2": (ck.L2(), None),
    "GroupL2": (ck.GroupL2(), None),
    "Sqrt": (ck.Sqrt(), None),
    "Subsets": (ck.Subsets(), None),
    "Sqrt auto": (ck.Sqrt("auto"), None),
    "paper": (ck.L2(), ck.ParticleSwarm()),
}


def planted_values(name, rng):
    """Values of a law, from the priors above."""
    rate = 10.0 ** rng.uniform(-7.3, -5.7)
    if name == "HS":
        n, local = rng.uniform(1, 4), rng.uniform(4, 8)
        x = brentq(lambda x: n * x / np.tanh(x) - local, 1e-3, 50) if local > n else 1e-3
        return {"A": rate / np.sinh(x) ** n, "n": n, "B": LEVEL / x}
    if name == "PL":
        n = rng.uniform(1.5, 7)
        return {"A": rate / LEVEL**n, "n": n}
    n, m = rng.uniform(2, 6), rng.uniform(-0.7, -0.2)
    memory = STRAIN if name == "SPL" else TIME
    return {"A": rate / (LEVEL**n * memory**m), "n": n, "m": m}


def specimen(name, k):
    """One measured test of a planted law."""
    rng = np.random.default_rng([SEED, list(LAWS).index(name), k])
    while True:
        values, modulus = planted_values(name, rng), MODULUS * np.exp(0.1 * rng.standard_normal())
        run = ck.simulate(LAWS[name], "bulge", values, loading=JUMP, times=TIMES, elastic=ck.Elastic(modulus))
        clean = np.stack([run.outputs[output] for output in SD], axis=1)
        if len(clean) == TIMES.size and np.isfinite(clean).all() and ENDS[0] < clean[-1, 0] < ENDS[1]:
            break
    noisy = clean + rng.standard_normal(clean.shape) * list(SD.values())
    known = {output: np.full(TIMES.size, sd) for output, sd in SD.items()}
    return History(
        f"{name} {k}", TIMES, dict(zip(SD, noisy.T, strict=True)), JUMP, 293.15, specimen="bulge",
        elastic=ck.Elastic(MODULUS), standard_deviation=known,
    )  # fmt: skip


def answer(fit):
    """Name of the law that an identification ends with, and how many terms are left."""
    after = fit.sparsity.shares_after
    largest = max(after, key=after.get)
    has_memory = any(name.startswith("m") for name in fit.law.only(largest).names)
    return (TERMS[largest] if largest == "hyperbolic sine" or has_memory else "PL"), len(after)


def rows_of(test, law, model, settings, labels):
    """(label, (answer, terms, CPU seconds)) of one test by each penalty."""
    began = time.process_time()
    dense, reductions = identify_full(law, [test], model, None, settings, None)
    reductions.single_terms()
    common = time.process_time() - began
    for label in labels:
        penalty, search = PENALTIES[label]
        began = time.process_time()
        if search is None:
            fit = identify_reduced(penalty, dense, reductions)
        else:
            fit = ck.identify(law, [test], using=model, search=search, penalty=penalty, **SETTINGS)
        yield label, (*answer(fit), (common if search is None else 0.0) + time.process_time() - began)


def table(rows):
    """The confusion matrix and shares of [(planted, answer, terms, cpu)]."""
    names = list(LAWS)
    for name in names:
        mine = [given for planted, given, _, _ in rows if planted == name]
        print(f"| {name} | " + " | ".join(str(mine.count(other)) for other in names) + " |")
    merged = {"PL": "HS"}
    right = {
        "strict": sum(p == a for p, a, _, _ in rows),
        "HS = PL": sum(merged.get(p, p) == merged.get(a, a) for p, a, _, _ in rows),
        "one term": sum(terms == 1 for _, _, terms, _ in rows),
    }
    for what, count in right.items():
        low, high = binomial_interval(count, len(rows))
        print(f"{what}: {count / len(rows):.2f} ({low:.2f} to {high:.2f})", end="; ")
    print(f"CPU {np.median([cpu for *_, cpu in rows]):.1f} s an identification (median)\n", flush=True)


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--specimens", type=int, default=12)
    options.add_argument("--laws", nargs="*", default=list(LAWS), choices=list(LAWS))
    options.add_argument("--penalties", nargs="*", default=list(PENALTIES), choices=list(PENALTIES))
    options.add_argument("--through", default="dimple")
    given = options.parse_args()
    set_numba_cache()
    model, law = ck.surrogate(given.through), ck.law("combined")
    settings = IdentificationSettings(**SETTINGS)
    found = {label: [] for label in given.penalties}
    for name in given.laws:
        for k in range(given.specimens):
            test = specimen(name, k)
            for label, row in rows_of(test, law, model, settings, given.penalties):
                found[label].append((name, *row))
                print(f"{test.name}, {label}: {row[0]}, terms left {row[1]}", file=sys.stderr, flush=True)
    for label, rows in found.items():
        penalty, search = PENALTIES[label]
        strength = f", strength {penalty.strength}" if hasattr(penalty, "strength") else ""
        print(f"## {label}: {type(penalty).__name__}{strength}{', particle swarm' if search else ''}\n")
        print("| planted | " + " | ".join(LAWS) + " |\n" + "|-" * (1 + len(LAWS)) + "|")
        table(rows)


if __name__ == "__main__":
    main()
