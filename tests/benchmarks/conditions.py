"""A planted exponent of the grain size: coverage of its interval, in bars and through dimples.

    python tests/benchmarks/conditions.py [--sets 200] [--rows NAME ...] [--write]

Three grain sizes (20, 50, 120 um) by three loads, creep by A s^n (d/50 um)^-p with n = 4.2, p = 2; rates scatter by
10 %, readings by 2e-5 of strain or 1.5 um of D_amp. Bars are integrated by scipy, dimples by finite elements on a mesh
three times as fine, and identified by the reduced-order model. Grain sizes of the last two rows are known to 2 %, every
third to 30 %. Seeds: 0 on.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from measured import Page, arguments, binomial_interval
from planted_bulge_tests import FINE, TIMES
from scipy.integrate import solve_ivp

import creepkit as ck

A, n, p = ck.parameters("A n p")
(size,) = ck.conditions("grain_size", unit="um")
RATE = ck.Param("rate coefficient", (1e-25, 1e-8), "1/s", "log")
TABLE = {A: RATE, n: ck.Param("stress exponent", (1, 10)), p: ck.Param("exponent of the grain size", (0, 4))}
LAW = ck.CreepLaw("grains", {"power": A * ck.stress**n * (size / 50) ** -p}, TABLE)
PLANTED = {"A": 3e-16, "n": 4.2, "p": 2.0}
SIZES, STRESSES, PRESSURES = (20.0, 50.0, 120.0), (60.0, 80.0, 110.0), (7.0, 9.0, 11.0)
SCATTER, STRAIN_NOISE, APEX_NOISE, MODULUS = 0.1, 2e-5, 1.5e-3, 150e3
ROWS = {"bars": True, "dimples": True, "bars of sizes known to 2 and 30 %, stated": True, "the same, not stated": False}
"""{name: whether tests state the errors of their grain sizes}."""
ERRORS = (0.02, 0.02, 0.3)
SETTINGS = ck.IdentificationSettings(starts=1, usual_errors="none")


def labelled(name: str, grain: float, **more) -> ck.History:
    """A test whose table states its grain size."""
    return ck.History(name, temperature=1000.0, labels={"grain size (um)": f"{grain:g}"}, **more)


def bar(grain: float, load: float, factor: float, rng: np.random.Generator) -> ck.History:
    """A bar under a constant force: its stress grows with its strain."""
    rate = factor * PLANTED["A"] * (grain / 50) ** -PLANTED["p"]
    times = np.linspace(0, 0.02 / (rate * load ** PLANTED["n"]), 41)[1:]
    run = solve_ivp(
        lambda _, e: rate * (load * np.exp(e)) ** PLANTED["n"], (0, times[-1]), [0.0], "DOP853", times, rtol=1e-10
    )
    outputs = {"strain": run.y[0] + STRAIN_NOISE * rng.normal(size=times.size)}
    return labelled(
        f"{grain:g} um, {load:g} MPa", grain, times=times, outputs=outputs, loading=ck.constant_stress(load)
    )


def dimple(grain: float, pressure: float, factor: float, rng: np.random.Generator) -> ck.History:
    """A bulge test at constant pressure."""
    loading, elastic = ck.PressureJump(pressure, pressure, TIMES[-1]), ck.language.Elastic(MODULUS)
    values = PLANTED | {"A": factor * PLANTED["A"], "grain_size": grain}
    fine = ck.specimen("bulge").replace(threads=1, **FINE)
    run = ck.simulate(LAW, fine, values, loading=loading, times=TIMES, elastic=elastic, temperature=1000.0)
    outputs = {"amplitude": run.outputs["amplitude"] + APEX_NOISE * rng.normal(size=run.times.size)}
    return labelled(
        f"{grain:g} um, {pressure:g} bar", grain, times=run.times, outputs=outputs, loading=loading, elastic=elastic,
        specimen="bulge",
    )  # fmt: skip


def uncertain(grain: float, load: float, factor: float, rng: np.random.Generator, stated: bool) -> ck.History:
    """A bar whose grains are not quite of the size that is stated."""
    sd = ERRORS[STRESSES.index(load)] * grain
    test = bar(max(grain + sd * rng.normal(), 0.2 * grain), load, factor, rng)
    labels = {"grain size (um)": f"{grain:g} ± {sd:g}" if stated else f"{grain:g}"}
    return test.replace(name=f"{grain:g} um, {load:g} MPa", labels=labels)


def row(page: Page, name: str, sets: int) -> None:
    """Identify from so many draws."""
    held, errors, widths, using = 0, [], [], "uniaxial"
    make, loads = (dimple, PRESSURES) if name == "dimples" else (bar, STRESSES)
    if name == "dimples":
        using = ck.specimen("bulge").reduced_order_model()
    elif name != "bars":
        make = partial(uncertain, stated=ROWS[name])
    for seed in range(sets):
        rng = np.random.default_rng(seed)
        tests = [make(g, load, np.exp(SCATTER * rng.normal()), rng) for g in SIZES for load in loads]
        one = ck.identify(LAW, tests, using, settings=SETTINGS).estimates[2]
        held += one.low <= PLANTED["p"] <= one.high
        errors.append(one.value - PLANTED["p"])
        widths.append(0.5 * (one.high - one.low))
    low, high = binomial_interval(held, sets)
    share = f"{100 * held / sets:.1f} % [{100 * low:.1f}, {100 * high:.1f}]"
    rms, bias = np.sqrt(np.mean(np.square(errors))), np.mean(errors)
    page.row(name, sets, share, f"{rms:.4f}", f"{bias:+.4f}", f"{np.median(widths):.4f}")


def main() -> None:
    """Print the table, and write it where asked to."""
    parser = arguments(__doc__)
    parser.add_argument("--sets", type=int, default=200, help="data sets of each row")
    parser.add_argument("--rows", nargs="+", default=ROWS, help="names of rows")
    options = parser.parse_args()
    page = Page("conditions", __doc__)
    page.table("tests", "sets", "95 % intervals of p that hold 2", "rms error", "mean error", "half width, median")
    for name in options.rows:
        row(page, name, options.sets)
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
