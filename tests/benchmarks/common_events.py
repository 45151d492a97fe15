"""Changes of rate at one clock time in several tests: false alarms, and steps that are found.

    python tests/benchmarks/common_events.py [--plates 240] [--steps 60] [--write]

Simulated plates of 3 to 9 dimples or bars, observed at the same times, of eight kinds of law; tests run at 1013 to
1083 K, under one load or with a change of load. Every second plate has noise of which half the variance is common to
all tests and the rest is autocorrelated. The first table counts plates without any event in which one is flagged, the
second the flags on measured tests. The third has a step of the furnace that multiplies the rate by the factor; it is
found where a flag is within one frame.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from measured import Page, arguments, binomial_interval, progress
from planted_bulge_tests import SIGMA, drawn_sum, drawn_values

import creepkit as ck
from creepkit.errors import CreepkitError
from creepkit.quality import check_data_quality
from creepkit.quality.rig import temperature_step
from creepkit.records import History, Program

SEED = 14
DATA = Path(__file__).resolve().parents[2].parent / "shared/data"
T_REF, TEMPERATURES = 1050.0, (1013.0, 1083.0)
NOISE = {"amplitude": 1.5e-3, "strain": 2e-5}
LEAST_GROWTH = 10.0
"""Noises."""
TIMES = (150.0 * np.arange(1, 97), 900.0 * np.arange(1, 49))
FACTORS = (1 / 1.2, 1 / 1.5, 1 / 3, 1.2, 1.5, 3.0)
SINGLE = ("hyperbolic-sine", "norton", "strain-hardening", "time-hardening")
SUMS = {"norton+strain-hardening": ("norton", "strain-hardening"), "fading primary": ("norton", "time-hardening")}
KINDS = (*SINGLE, *SUMS, "drifting-exponent", "kachanov-rabotnov")


def alloy(kind, rng):
    """A law with an Arrhenius factor, and values."""
    if kind in SUMS:
        law, values = drawn_sum(SUMS[kind], rng)
    elif kind == "drifting-exponent":
        law = ck.law(kind).fix(m=0)
        n_inf, C, excess = rng.uniform(3, 5), rng.uniform(0, 2), rng.uniform(-0.5, 0.5)
        rate = 10.0 ** rng.uniform(-7.3, -5.7)
        tau_r, ratio = rng.uniform(1500, 6000), rng.uniform(1.2, 3)
        values = dict(A=rate / SIGMA**n_inf, n_0=n_inf + excess, n_inf=n_inf, C=C, tau_d=tau_r * ratio, tau_r=tau_r)
    elif kind == "kachanov-rabotnov":
        law = ck.law(kind)
        rate, n, chi = 10.0 ** rng.uniform(-7.3, -5.7), rng.uniform(3, 6), rng.uniform(3, 5)
        life = 10.0 ** rng.uniform(4.5, 6)
        damage = {"B": 1 / life / SIGMA**chi, "chi": chi, "phi": rng.uniform(2, 5), "alpha": 0.5, "m": 0.0}
        values = {"A": rate / SIGMA**n, "n": n, **damage}
    else:
        law, values = ck.law(kind), drawn_values(kind, rng)
    return law.times(ck.arrhenius(T_ref=T_REF)), values


def with_activation(law, values, Q):
    """Values with Q for every activation energy of the law."""
    return {**values, **{name: Q for name in law.names if name not in values}}


def noises(rng, count, frames, sd, coloured):
    """(tests, frames) noise."""
    white = rng.standard_normal((count, frames))
    if not coloured:
        return sd * white
    own = white.copy()
    for k in range(1, frames):
        own[:, k] = 0.7 * own[:, k - 1] + np.sqrt(1 - 0.7**2) * white[:, k]
    return sd * np.sqrt(0.5) * (own + rng.standard_normal(frames))


def plate(number, factor=1.0):
    """The tests of one plate, and when its furnace steps, s."""
    rng = np.random.default_rng([SEED, number, round(1000 * factor)])
    while True:
        kind, is_bulge = KINDS[number % len(KINDS)], number // len(KINDS) % 2 == 0
        count, times = int(rng.integers(3, 10)), TIMES[rng.integers(2)]
        half = float(times[times.size // 2 - 1])
        change = (1.0, 1.25, 0.8)[number % 3]
        while True:
            event = float(times[int(rng.integers(times.size // 5, 4 * times.size // 5))])
            if change == 1.0 or abs(event - half) > 8 * times[0]:
                break
        law, values = alloy(kind, rng)
        values = with_activation(law, values, Q := rng.uniform(350e3, 450e3))
        temperatures = rng.uniform(*TEMPERATURES, count)
        step = temperature_step(float(temperatures.mean()), factor, Q)
        using = ck.specimen("bulge").reduced_order_model() if is_bulge else "uniaxial"
        output = "amplitude" if is_bulge else "strain"
        tests = []
        try:
            for k, T in enumerate(temperatures):
                load = 8.0 if is_bulge else rng.choice((60.0, 80.0, 100.0, 120.0, 140.0))
                loading = (
                    ck.PressureJump(load, load * change, half)
                    if is_bulge
                    else ck.StressSteps(((0, load), (half, load * change)))
                )
                furnace = Program.steps([(0, T), (event, T + step)]) if factor != 1.0 else T
                elastic = ck.Elastic(150e3) if is_bulge else None
                run = ck.simulate(
                    law,
                    using,
                    values,
                    loading=loading,
                    times=times,
                    temperature=furnace,
                    elastic=elastic,
                    name=f"test {k}",
                )
                tests.append((run.outputs[output], loading, float(T)))
        except CreepkitError:
            continue
        sd = NOISE[output]
        if any(y.size < times.size or not np.isfinite(y).all() or np.ptp(y) < LEAST_GROWTH * sd for y, *_ in tests):
            continue
        noise = noises(rng, count, times.size, sd, coloured=number % 2 == 1)
        return [
            History(f"test {k}", times, {output: y + e}, loading, T, specimen="bulge" if is_bulge else "uniaxial")
            for k, ((y, loading, T), e) in enumerate(zip(tests, noise, strict=True))
        ], event


def flags(number, factor=1.0):
    """The flags of a plate, its tests by name, and when its furnace steps, s."""
    tests, event = plate(number, factor)
    return [*check_data_quality(tests)], {test.name: test for test in tests}, event


def share(hits, trials):
    """A share with its binomial interval."""
    low, high = binomial_interval(hits, trials)
    return f"{hits / trials:.3f} [{low:.3f}, {high:.3f}]"


def false_alarms(page, plates):
    """Plates without an event, by kind of law."""
    found = {kind: [0, 0, 0] for kind in KINDS}
    for number in range(plates):
        kinds = {flag.kind for flag in flags(number)[0]}
        counts = found[KINDS[number % len(KINDS)]]
        for k, counted in enumerate((True, "rate change" in kinds, "jump" in kinds)):
            counts[k] += counted
        progress(f"clean plate {number + 1} of {plates}: {', '.join(sorted(kinds)) or 'no flag'}")
    page.heading("False alarms")
    page.table("tests", "plates", "share with a change of rate", "share with a jump")
    rows = [*found.items(), ("all plates", [sum(column) for column in zip(*found.values(), strict=True)])]
    for name, (count, changes, jumps) in rows:
        page.row(name, count, share(changes, count), share(jumps, count))


def measured(page):
    """Flags on measured tests, where these are at hand."""
    page.table("measured tests", "tests", "changes of rate", "jumps, tests")
    for name, folder in (
        ("Inconel 625", "dabi/in625"),
        ("CMSX-6", "uniaxial/cmsx6"),
        ("Alloy 617", "uniaxial/alloy617"),
    ):
        if (DATA / folder).is_dir():
            quality = check_data_quality(ck.read_histories(DATA / folder))
            changes = [f"{flag.time:g} s in {len(flag.tests)} tests" for flag in quality if flag.kind == "rate change"]
            jumps = sum(len(flag.tests) for flag in quality if flag.kind == "jump")
            page.row(name, quality.tests, ", ".join(changes) or "none", jumps)


def power(page, plates):
    """Plates with a step of the furnace, by factor."""
    page.heading("Steps that are found")
    page.table(
        "factor on the rate",
        "plates",
        "share found",
        "plates with a flag at another time",
        "factors held by their error",
        "flags that see a step of the load",
    )
    for factor in FACTORS:
        found = others = loads = held = sizes = 0
        for number in range(plates):
            result, tests, event = flags(number, factor)
            frame = next(iter(tests.values())).times[0]
            changes = [flag for flag in result if flag.kind == "rate change"]
            near = [flag for flag in changes if abs(flag.time - event) <= 1.01 * frame]
            found, others = found + bool(near), others + (len(near) < len(changes))
            loads += sum("load step" in flag.proposal for flag in near)
            for flag in near[:1]:
                sizes += len(flag.rate_factors)
                held += sum(
                    abs(np.log(flag.rate_factors[name] / factor)) < np.log(flag.factor_errors[name])
                    for name in flag.tests
                )
        page.row(f"{factor:.2f}", plates, share(found, plates), others, f"{held} of {sizes}", loads)


def main():
    parser = arguments(__doc__)
    parser.add_argument("--plates", type=int, default=240)
    parser.add_argument("--steps", type=int, default=60, help="plates for each factor")
    options = parser.parse_args()
    page = Page("common_events", __doc__)
    false_alarms(page, options.plates)
    measured(page)
    power(page, options.steps)
    if options.write:
        page.write()


if __name__ == "__main__":
    main()
