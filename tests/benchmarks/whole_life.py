"""Laws with tertiary creep on measured creep curves from loading to rupture.

    python tests/benchmarks/whole_life.py [--data FOLDER] [--sets cmsx6 ...] [--laws NAME ...] [--quick]
                                          [--max-work 100] [--starts 4] [--plots FOLDER] [--write]

Alloy 617 base metal (750 to 1000 C) and CMSX-6 (980 C), every frame to rupture. Columns: rms distance of a frame from
the curve in ln strain and ln time; Z = 10^(2.5 s), s the standard deviation of log10(measured/predicted time to
rupture), of the fit and, for up to 100 tests times parameters, with each condition left out; predicted over measured
time to rupture, median and the range of 95 % of the tests; standard deviation of the creep rate between tests. Repeats
at one condition have a Z of their own. The first laboratory of Alloy 617 does not say how its
22 tests ended: they count as having lasted to their last frame.
"""

import time
from collections import defaultdict
from pathlib import Path

import numpy as np
from measured import Page, arguments, progress
from public_calls import cross_validated_times
from time_comparison import times_to_rupture

import creepkit as ck
from creepkit.inverse.reference_conditions import reference_temperature, spans_temperatures
from creepkit.quality.repeats import duplicate_tests

HEADS = (
    "law",
    "parameters",
    "rms distance",
    "Z fitted",
    "Z cross-validated",
    "predicted over measured (95 %)",
    "rate between tests, %",
    "not determined, or at a bound",
)


def catalogue(histories):
    """{name: law}: laws with tertiary creep; their damage grows with an activation energy of its own."""
    isothermal = {
        "liu-murakami": ck.law("liu-murakami").fix(alpha=0),
        "mpc-omega": ck.law("mpc-omega").fix(c=0),
        "kachanov-rabotnov": ck.law("kachanov-rabotnov").fix(alpha=0, m=0),
        "sinh-damage": ck.law("sinh-damage").fix(alpha=0, beta=0),
        "norton": ck.law("norton"),
        "mpc-omega, Omega(stress)": ck.law("mpc-omega"),
        "kachanov-rabotnov, primary": ck.law("kachanov-rabotnov").fix(alpha=0),
    }
    if not spans_temperatures(histories):
        return isothermal
    T = reference_temperature(histories)
    damage_parameters = {"kachanov": ("B",), "liu": ("B",), "sinh": ("M", "s_s", "s_t"), "mpc": ("Omega",)}
    laws = {}
    for name, law in isothermal.items():
        law = law.times(ck.arrhenius(T_ref=T))
        damage = damage_parameters.get(name.split("-")[0], ())
        # rate coefficients of damage have theirs from times() already
        further = [p for p in damage if f"Q_{p}" not in law.names]
        laws[name] = law.with_temperature(**{p: ck.activated(T_ref=T) for p in further}) if further else law
    return laws


def sets(folder):
    """{name: histories whose end is known, or that lasted to their last frame}."""
    alloy = [h for h in ck.read_histories(folder / "alloy617") if h.labels.get("product") == "Base"]
    duplicates = {other for _, other in duplicate_tests(alloy)}
    alloy = [h if h.end_known else h.replace(unruptured=True) for h in alloy if h.name not in duplicates]
    return {"alloy617-base": alloy, "cmsx6": ck.read_histories(folder / "cmsx6")}


def spread_of_repeats(histories):
    """(Z, tests beyond the first of each condition) of rupture times of tests repeated at one condition."""
    logs = defaultdict(list)
    for h in histories:
        if h.rupture_time is not None:
            logs[h.condition].append(np.log10(h.rupture_time))
    degrees_of_freedom = sum(len(v) - 1 for v in logs.values())
    squares = sum(((np.array(v) - np.mean(v)) ** 2).sum() for v in logs.values())
    return 10 ** (2.5 * np.sqrt(squares / degrees_of_freedom)), degrees_of_freedom


def cells(name, fit, histories, cross_validate):
    """One row of the table."""
    fitted = times_to_rupture((m.name, m.rupture) for m in fit.tests)
    low, middle, high = np.percentile(fitted.predicted / fitted.measured, [2.5, 50, 97.5])
    undetermined = [e.name for e in fit.estimates if e.verdict != "determined"]
    return [
        name,
        len(fit.law.params),
        f"{fit.rms:.3f}",
        f"{fitted.z_factor:.2f}",
        f"{cross_validated_times(fit, histories, None).z_factor:.2f}" if cross_validate else "-",
        f"{middle:.2f} ({low:.2f} to {high:.2f})",
        f"{100 * fit.noise_model.rate:.0f}",
        ", ".join(undetermined) or "none",
    ]


def table_of(page, title, histories, options):
    """Identify all laws from one set of tests, and their table in the order of their misfit."""
    page.heading(title)
    ruptured = sum(h.rupture_time is not None for h in histories)
    z, repeats = spread_of_repeats(histories)
    page.paragraph(
        f"{len(histories)} tests, {ruptured} of them ruptured; "
        f"Z = {z:.2f} between repeats of one condition ({repeats})."
    )
    bar = ck.specimen("uniaxial").replace(tolerance=1e-4)
    fits, rows = [], []
    for name, law in catalogue(histories).items():
        if options.laws and name not in options.laws:
            continue
        start = time.process_time()
        try:
            fit = ck.identify(law, histories, bar, starts=options.starts)
        except ck.errors.FitError as error:
            page.paragraph(f"{name}: no identification: {error}.")
            continue
        cpu = time.process_time() - start
        cross_validate = not options.quick and len(histories) * len(law.params) <= options.max_work
        rows.append(cells(name, fit, histories, cross_validate))
        fits.append(fit)
        progress(f"{title}, {name}: {cpu:.1f} CPU s, ln L {fit.log_likelihood:.1f}")
        if options.plots:
            options.plots.mkdir(parents=True, exist_ok=True)
            stem = f"{title}_{name.replace(' ', '_')}"
            fit.plot(options.plots / f"{stem}.png")
            (options.plots / f"{stem}.txt").write_text(str(fit))
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
    parser.add_argument("--starts", type=int, default=4)
    parser.add_argument("--plots", type=Path)
    options = parser.parse_args()
    page = Page("whole_life", __doc__)
    for title, histories in sets(options.data).items():
        if not options.sets or title in options.sets:
            table_of(page, title, histories, options)
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
