"""Term selection by each penalty: planted single laws, identified from the sum of Eq. (2).

    python tests/benchmarks/penalty_confusion.py [--specimens 12] [--laws HS ...] [--penalties L2 ...] [--through FILE]
                                                 [--write]

Plants HS, PL, SPL and TPL, `--specimens` of each, in a dimple of 0.5 mm simulated by finite elements: pressure from 8
to 10 MPa at 4 h, 48 times of 900 s, white noise of 1.5 um on D_amp, 0.02 mm on S_d, 0.02 on S_p. With R = log10 of the
rate at 120 MPa, a strain of 0.01 and 1e4 s: R uniform in -7.3 to -5.7; PL n 1.5 to 7; SPL and TPL n 2 to 6, m -0.7 to
-0.2; HS local exponent at 120 MPa 4 to 8 and n 1 to 4; E about 150 GPa by 10 %. Draws that do not end between 0.15 and
1.2 mm are drawn again. Each is identified from the sum of Eq. (2) through the reduced-order model (or --through), its
modulus a nuisance of 10 %, by: no penalty, L2, GroupL2, Sqrt, Subsets, Sqrt with automatic strength; and L2 with the
particle swarm, the paper's way. The answer is the term that contributes most to the reduced law; with its exponent m
switched off it is a power law (PL).

The first table gives shares with 95 % binomial intervals: of right answers, strict and with HS and PL merged (over one
jump of pressure a sinh of small argument is a power law), and of reduced laws with a single term; CPU time is the
median of one identification, in which the fits that rows share, of the whole sum and of each term alone, are counted
each time. The second table counts answers by planted law.
"""

import time

import numpy as np
from measured import Page, arguments, progress
from scipy.optimize import brentq

import creepkit as ck
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
LAST_AMPLITUDES = (0.15, 1.2)
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
    hardening_variable = STRAIN if name == "SPL" else TIME
    return {"A": rate / (LEVEL**n * hardening_variable**m), "n": n, "m": m}


def specimen(name, k):
    """One measured test of a planted law."""
    rng = np.random.default_rng([SEED, list(LAWS).index(name), k])
    while True:
        values, modulus = planted_values(name, rng), MODULUS * np.exp(0.1 * rng.standard_normal())
        run = ck.simulate(LAWS[name], "bulge", values, loading=JUMP, times=TIMES, elastic=ck.Elastic(modulus))
        clean = np.stack([run.outputs[output] for output in SD], axis=1)
        if (
            len(clean) == TIMES.size
            and np.isfinite(clean).all()
            and LAST_AMPLITUDES[0] < clean[-1, 0] < LAST_AMPLITUDES[1]
        ):
            break
    noisy = clean + rng.standard_normal(clean.shape) * list(SD.values())
    known = {output: np.full(TIMES.size, sd) for output, sd in SD.items()}
    outputs = dict(zip(SD, noisy.T, strict=True))
    elastic = ck.Elastic(MODULUS)
    return History(
        f"{name} {k}", TIMES, outputs, JUMP, 293.15, specimen="bulge", elastic=elastic, standard_deviation=known
    )


def answer(fit):
    """Name of the law that an identification ends with, and how many terms are left."""
    contributions = fit.sparsity.contributions_after_refit
    largest = max(contributions, key=contributions.get)
    hardens = any(name.startswith("m") for name in fit.law.only(largest).names)
    return (TERMS[largest] if largest == "hyperbolic sine" or hardens else "PL"), len(contributions)


def answers_of(test, law, model, settings, labels):
    """(label, (answer, terms, CPU seconds)) of one test by each penalty."""
    start = time.process_time()
    full, reductions = identify_full(law, [test], model, None, settings, None)
    reductions.single_terms()
    common = time.process_time() - start
    for label in labels:
        penalty, search = PENALTIES[label]
        start = time.process_time()
        if search is None:
            fit = identify_reduced(penalty, full, reductions)
        else:
            fit = ck.identify(law, [test], using=model, search=search, penalty=penalty, **SETTINGS)
        yield label, (*answer(fit), (common if search is None else 0.0) + time.process_time() - start)


def share(hits, trials):
    """A share with its binomial interval."""
    low, high = binomial_interval(hits, trials)
    return f"{hits / trials:.2f} [{low:.2f}, {high:.2f}]"


def share_row(page, label, rows):
    """Shares of [(planted, answer, terms, cpu)] by one penalty."""
    merged = {"PL": "HS"}
    counts = (
        sum(planted == answered for planted, answered, _, _ in rows),
        sum(merged.get(planted, planted) == merged.get(answered, answered) for planted, answered, _, _ in rows),
        sum(terms == 1 for _, _, terms, _ in rows),
    )
    cpu = np.median([cpu for *_, cpu in rows])
    page.row(label, len(rows), *(share(count, len(rows)) for count in counts), f"{cpu:.1f}")


def confusion_rows(page, label, rows):
    """Answers of one penalty by planted law."""
    for name in LAWS:
        answers = [answered for planted, answered, _, _ in rows if planted == name]
        if answers:
            page.row(label, name, *(answers.count(other) for other in LAWS))


def title_of(label):
    """Penalty, strength and search of a row."""
    penalty, search = PENALTIES[label]
    strength = f", strength {penalty.strength}" if hasattr(penalty, "strength") else ""
    return f"{type(penalty).__name__}{strength}{', particle swarm' if search else ''}"


def main():
    parser = arguments(__doc__)
    parser.add_argument("--specimens", type=int, default=12)
    parser.add_argument("--laws", nargs="*", default=list(LAWS), choices=list(LAWS))
    parser.add_argument("--penalties", nargs="*", default=list(PENALTIES), choices=list(PENALTIES))
    parser.add_argument("--through", default="dimple", help="a surrogate; by default the reduced-order model")
    options = parser.parse_args()
    model, law = ck.surrogate(options.through), ck.law("combined")
    settings = IdentificationSettings(**SETTINGS)
    results = {label: [] for label in options.penalties}
    for name in options.laws:
        for k in range(options.specimens):
            test = specimen(name, k)
            for label, row in answers_of(test, law, model, settings, options.penalties):
                results[label].append((name, *row))
                progress(f"{test.name}, {label}: {row[0]}, terms left {row[1]}")
    page = Page("penalty_confusion", __doc__)
    page.table("penalty", "specimens", "strict", "HS and PL merged", "single term left", "CPU time, s")
    for label, rows in results.items():
        share_row(page, title_of(label), rows)
    page.table("penalty", "planted law", *(f"answer {name}" for name in LAWS))
    for label, rows in results.items():
        confusion_rows(page, title_of(label), rows)
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
