"""Laws on measured creep curves up to 5 % strain: Alloy 617, base metal, and CMSX-6.

    python tests/benchmarks/measured_creep.py [--data FOLDER] [--sets cmsx6 ...] [--laws NAME ...] [--quick]
                                              [--max-work 100] [--plots FOLDER] [--write]

Columns: rms of ln(predicted/measured strain), each test's own loading strain subtracted; Z = 10^(2.5 s), s the standard
deviation of log10(measured/predicted time to 1 % creep strain), of the fit and, where tests times parameters are up to
100, with each condition left out; standard deviation of the creep rate between tests. No law can do better than tests
repeated at one condition agree with each other: their own Z stands above each table. Weights are the default ones: by
likelihood every test has a rate of its own, and a law whose curves have the wrong shape bends them by its exponent.
"""

import time
from collections import defaultdict
from pathlib import Path

import numpy as np
from measured import Page, arguments, progress
from public_calls import cross_validated_times
from time_comparison import loading_strains, measured_time_to_strain, times_to_strain

import creepkit as ck
from creepkit.inverse.reference_conditions import reference_temperature, spans_temperatures
from creepkit.quality.repeats import duplicate_tests

STRAIN_LIMIT = 0.05
"""Frames above it are left out."""
STRAIN = 0.01
"""Of the time that is predicted."""
LAWS = (
    "norton",
    "hyperbolic-sine",
    "strain-hardening",
    "time-hardening",
    "logarithmic",
    "drifting-exponent",
    "combined",
)
HEADS = (
    "law",
    "parameters",
    "rms of ln strain",
    "Z fitted",
    "Z cross-validated",
    "rate between tests, %",
    "not determined, or at a bound",
)


def catalogue(histories):
    """{name: law}: each law alone, with temperature forms where tests differ in temperature, and sums of laws."""
    isothermal = {name: ck.law(name) for name in LAWS}
    isothermal["norton + strain-hardening"] = ck.law("norton") + ck.law("strain-hardening")
    if not spans_temperatures(histories):
        return isothermal
    T = reference_temperature(histories)
    laws = {f"{name} x arrhenius": law.times(ck.arrhenius(T_ref=T)) for name, law in isothermal.items()}
    laws["norton x arrhenius, n(T)"] = laws["norton x arrhenius"].with_temperature(n=ck.linear(T_ref=T))
    laws["strain-hardening x arrhenius, n(T)"] = laws["strain-hardening x arrhenius"].with_temperature(
        n=ck.linear(T_ref=T)
    )
    laws["logarithmic x arrhenius, n(T)"] = laws["logarithmic x arrhenius"].with_temperature(n=ck.linear(T_ref=T))
    laws["hyperbolic-sine x arrhenius, B(T)"] = laws["hyperbolic-sine x arrhenius"].with_temperature(
        B=ck.activated(T_ref=T)
    )
    terms = [ck.law(name).times(ck.arrhenius(T_ref=T)) for name in ("norton", "strain-hardening")]
    laws["norton + strain-hardening, own Q"] = terms[0] + terms[1]
    return laws


def sets(folder):
    """{name: histories with all frames}."""
    alloy = ck.read_histories(folder / "alloy617")
    return {
        "alloy617-base": [h for h in alloy if h.labels.get("product") == "Base"],
        "cmsx6": ck.read_histories(folder / "cmsx6"),
    }


def usable(page, histories):
    """Frames up to the strain limit; a curve that has less than two after time zero is left out, and named."""
    tests = [h.up_to("strain", STRAIN_LIMIT) for h in histories]
    enough = [(h.used & (h.times > 0)).sum() >= 2 for h in tests]
    for h, kept in zip(tests, enough, strict=True):
        if not kept:
            page.paragraph(f"Left out: {h.name}, which begins above {100 * STRAIN_LIMIT:g} % strain.")
    return [h for h, kept in zip(tests, enough, strict=True) if kept]


def spread_of_repeats(histories):
    """(Z, tests beyond the first of each condition): the scatter of tests repeated at one condition."""
    duplicates = {other for _, other in duplicate_tests(histories)}
    logs = defaultdict(list)
    for h, start in zip(histories, loading_strains(histories), strict=True):
        if h.name not in duplicates and (reached := measured_time_to_strain(h, STRAIN + start)) is not None:
            logs[h.condition].append(np.log10(reached))
    degrees_of_freedom = sum(len(v) - 1 for v in logs.values())
    squares = sum(((np.array(v) - np.mean(v)) ** 2).sum() for v in logs.values())
    return 10 ** (2.5 * np.sqrt(squares / degrees_of_freedom)), degrees_of_freedom


def cells(name, fit, histories, max_work):
    """One row of the table."""
    fitted = times_to_strain(fit.law, fit.values, histories, fit.predictor, STRAIN, loading_strains(histories))
    validated = "-"
    if len(histories) * len(fit.law.params) <= max_work:
        validated = f"{cross_validated_times(fit, histories, STRAIN).z_factor:.2f}"
    undetermined = [e.name for e in fit.estimates if e.verdict != "determined"]
    return [
        name,
        len(fit.law.params),
        f"{fit.rms:.3f}",
        f"{fitted.z_factor:.2f}",
        validated,
        f"{100 * fit.noise_model.rate:.0f}",
        ", ".join(undetermined) or "none",
    ]


def table_of(page, title, histories, options):
    """Identify all laws from one set of tests, and their table in the order of their misfit."""
    page.heading(title)
    tests = usable(page, histories)
    z, repeats = spread_of_repeats(tests)
    fits, rows = [], []
    for name, law in catalogue(tests).items():
        if options.laws and name not in options.laws:
            continue
        start = time.process_time()
        try:
            fit = ck.identify(law, tests)
        except ck.errors.FitError as error:
            page.paragraph(f"{name}: no identification: {error}.")
            continue
        cpu = time.process_time() - start
        rows.append(cells(name, fit, tests, 0 if options.quick else options.max_work))
        fits.append(fit)
        progress(f"{title}, {name}: {cpu:.1f} CPU s")
        if options.plots:
            options.plots.mkdir(parents=True, exist_ok=True)
            fit.plot(options.plots / f"{title}_{name.replace(' ', '_')}.png")
    frames = sum(m.frames for m in fits[0].tests)
    page.paragraph(f"{len(tests)} tests, {frames} frames; Z = {z:.2f} between repeats of one condition ({repeats}).")
    page.table(*HEADS)
    for _, row in sorted(zip((fit.rms for fit in fits), rows, strict=True)):
        page.row(*row)


def main():
    parser = arguments(__doc__)
    parser.add_argument("--data", type=Path, default=Path("../shared/data/uniaxial"))
    parser.add_argument("--sets", nargs="*", help="some of alloy617-base, cmsx6")
    parser.add_argument("--laws", nargs="*")
    parser.add_argument("--quick", action="store_true", help="without cross-validation")
    parser.add_argument(
        "--max-work", type=int, default=100, help="cross-validate where tests times parameters are up to so many"
    )
    parser.add_argument("--plots", type=Path)
    options = parser.parse_args()
    page = Page("measured_creep", __doc__)
    for title, histories in sets(options.data).items():
        if not options.sets or title in options.sets:
            table_of(page, title, histories, options)
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
