r"""Find how parameters depend on temperature
=========================================

From creep curves at three temperatures or more to closed forms of the parameters, Arrhenius among them.

One temperature fixes no activation energy, and two temperatures fix no form. With three or more, closed forms are found
through the estimates of each temperature, put back into the law, and judged by the curves themselves. Without an
argument simulated curves are used: Arrhenius, and an exponent that falls with temperature. ``--quick`` takes fewer
forms::

    python examples/06_form_of_temperature.py [--quick] [FOLDER [OUT]]
"""

import sys
from pathlib import Path

import numpy as np

import creepkit as ck

T_REF = 1023.15  # K
STRESSES = (60.0, 90.0, 120.0)  # MPa
bar = ck.specimen("uniaxial")
quick = "--quick" in sys.argv
paths = [Path(word) for word in sys.argv[1:] if word != "--quick"]
folder = paths[0] if paths else None
out = paths[1] if len(paths) > 1 else Path("form_of_temperature")

# %%
# The tests
# ---------


def planted() -> list[ck.History]:
    """Three stresses at five temperatures: n falls by 0.9 from 973 to 1083 K; strains noisy, rates within 1 %."""
    law = ck.law("norton").with_temperature(n=ck.linear(T_REF)).times(ck.arrhenius(T_REF))
    truth = dict(A=1.5e-16, Q=4.2e5, n=4.6, n_T=-8e-3)
    rng, tests = np.random.default_rng(6), []
    for T in np.linspace(973.0, 1083.0, 5):
        for stress in STRESSES:
            values = truth | {"A": truth["A"] * np.exp(0.01 * rng.normal())}
            rate = float(ck.lower(law).rate(values, stress=stress, temperature=T))
            times = np.geomspace(0.02, 1.0, 16) * 0.02 / rate
            loading, name = ck.constant_stress(stress, "stress"), f"{T:.0f} K, {stress:.0f} MPa"
            run = ck.simulate(law, bar, values, loading=loading, times=times, temperature=T, name=name)
            tests.append(run.replace(outputs={"strain": run.outputs["strain"] + 1e-5 * rng.normal(size=times.size)}))
    return tests


tests = planted() if folder is None else ck.read_histories(folder)

# %%
# Each temperature alone
# ----------------------

law = ck.law("norton")
starts = 1 if quick else 2
fits = [ck.identify(law, group, using=bar, starts=starts, frames=16) for group in ck.group_by_temperature(tests)]
for fit in fits:
    n = next(e for e in fit.estimates if e.name == "n")
    print(f"{fit.reference.temperature:.0f} K: n = {n.value:.2f} [{n.low:.2f}, {n.high:.2f}]")

# %%
# Forms through these estimates
# -----------------------------
# A and n are correlated to -0.999 at every temperature, so they are regressed together with their covariances. Forms
# that a range of ten per cent in temperature cannot separate are called equivalent. Prior odds are printed with them.

forms = {"A": ("arrhenius", "logarithmic", "exponential"), "n": ("constant", "linear", "inverse", "logarithmic")}
if quick:
    forms = {"A": ("arrhenius",), "n": ("constant", "linear")}
trend = ck.discover(fits, forms=forms)  # forms=None: every registered form
print(f"\n{trend}")

# %%
# Put back into the law, and judged by the curves
# -----------------------------------------------

trend = ck.discover(fits, forms=forms, histories=tests)
print(f"\n{trend}")

# %%
# An ordinary law
# ---------------

Q = trend.estimate("Q")
print(f"\nQ = {Q.value / 1e3:.0f} kJ/mol, 95 % from {Q.low / 1e3:.0f} to {Q.high / 1e3:.0f}")
print(f"at 1050 K: {', '.join(f'{name} = {float(v[0]):.4g}' for name, v in trend.parameters_at(1050.0).items())}")
out.mkdir(parents=True, exist_ok=True)
trend.plot(out / "temperature.png")
trend.save(out / "temperature.json")
ck.export(trend.valued, "abaqus", to=out / "creep.f", force=True)
print(f"wrote {out}/temperature.png, temperature.json, creep.f")
