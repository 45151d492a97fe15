r"""From ten lines to an identified law
===================================

A law from ten lines: written, checked, simulated, given damage and temperature, identified, packaged, exported.

Every step leaves its result in the current folder: steel.py, tests of bars as CSV files, a figure, the identified law,
and a package. ``--quick`` searches from two starting points instead of four::

    python examples/04_a_law_from_ten_lines.py [--quick]
"""

import subprocess
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import creepkit as ck

HOUR = 3600.0  # s
starts = 2 if "--quick" in sys.argv else 4

# %%
# Ten lines
# ---------
# A law is one file: its equation, and one line for each parameter.

TEN_LINES = """\
import creepkit as ck
A, n = ck.parameters("A n")
STEEL = ck.CreepLaw("steel", {"creep": A * ck.stress**n}, {
    A: ck.Param("rate coefficient", bounds=(1e-30, 1e-8), unit="1/s", scale="log"),
    n: ck.Param("stress exponent", bounds=(1, 8)),
}, title="Steady creep of a steel", references=("Norton (1929), The Creep of Steel at High Temperatures",))

@ck.hookimpl
def creepkit_laws():
    return [STEEL]
"""
Path("steel.py").write_text(TEN_LINES)
ck.load_plugin("steel.py")  # creepkit --plugin steel.py ...
steel = ck.law("steel")
print(ck.check_law(steel, samples=16))  # creepkit check steel.py

# %%
# A first simulation
# ------------------
# Compared with the closed form strain = A s^n t.

times = np.linspace(0, 100 * HOUR, 40)
bar = ck.simulate(steel, "uniaxial", {"A": 1e-16, "n": 4.5}, loading=ck.constant_stress(100, "stress"), times=times)
print("steady creep, off by", np.abs(bar.outputs["strain"] - 1e-16 * 100**4.5 * times).max())

# %%
# Bars break
# ----------
# Damage w reduces the section, which raises the creep rate and the rate of damage itself: two more lines for the
# state, two for its parameters. Damage follows the largest principal stress, as cavities do.

A, n, C, v, Q = ck.parameters("A n C v Q")
(w,) = ck.states("w")
s, s_1 = ck.stress, ck.principal_stress
brittle = ck.CreepLaw(
    name="brittle-steel",
    title="Steel with Kachanov's damage",
    terms={"creep": A * (s / (1 - w)) ** n},
    params={
        **steel.params,
        C: ck.Param("damage coefficient", bounds=(1e-30, 1e-8), unit="1/s", scale="log"),
        v: ck.Param("stress exponent of damage", bounds=(1, 8)),
    },
    states={w: ck.State(0, C * (s_1 / (1 - w)) ** v, limit=0.99)},
    references=("Kachanov (1958), Izv. AN SSSR OTN 8, 26",),
)
print("conforms:", ck.check_law(brittle, samples=16).passed)

# %%
# Temperature
# -----------
# An Arrhenius factor on every rate: Q of creep and, since damage has a rate coefficient C of its own, Q_C of damage.

law = brittle.times(ck.arrhenius(T_ref=1073.15))
print(law)
truth = {"A": 2e-16, "n": 4.5, "C": 3e-14, "v": 4.0, "Q": 3e5, "Q_C": 2.8e5}
truth = {name: truth[name] for name in law.names}

# %%
# The same law in other tests
# ---------------------------
# Relaxation of a bar, and a tube under tension and torsion.

later = np.geomspace(1, 100 * HOUR, 40)
relaxation_run = ck.simulate(
    law,
    "relaxation",
    truth,
    loading=ck.constant_strain(0.001),
    times=later,
    temperature=1073.15,
    elastic=ck.Elastic(150e3),
)
tube = ck.simulate(
    law,
    "point",
    truth,
    loading=ck.PointLoading(stress={"11": 60, "12": [(0, 0), (10 * HOUR, 35)]}),
    times=times,
    temperature=1073.15,
)
print(relaxation_run)
print(tube)

# %%
# Tests as a laboratory would deliver them
# ----------------------------------------
# Five bars to rupture, with the noise of an extensometer.

rng = np.random.default_rng(5)
Path("tests").mkdir(exist_ok=True)
for celsius, level in ((770, 110), (800, 80), (800, 100), (800, 120), (830, 85)):
    plan = np.geomspace(60, 1e7, 2000)
    run = ck.simulate(
        law,
        "uniaxial",
        truth,
        loading=ck.constant_stress(level, "stress"),
        times=plan,
        temperature=celsius + 273.15,
        name=f"{celsius} C {level} MPa",
    )
    kept = np.unique(
        np.searchsorted(run.times, np.linspace(0, 1, 40) ** 2 * run.times[-1]).clip(max=run.times.size - 1)
    )
    strain = run.outputs["strain"][kept] + rng.normal(0, 2e-5, kept.size)
    ck.write_history(
        run.replace(times=run.times[kept], outputs={"strain": strain}), Path("tests", f"{celsius}_{level}.csv")
    )

# %%
# Identification
# --------------
# The values are recovered, with 95 % intervals.

tests = ck.read_histories("tests/*.csv")
fit = ck.identify(law, tests, starts=starts)
print(fit)
inside = {e.name: e.low <= truth[e.name] <= e.high for e in fit.estimates}
print("true values inside their intervals:", inside)
fit.save("brittle-steel.json")
fit.plot("brittle-steel.png")

# %%
# Prediction of other tests
# -------------------------
# The tube and the relaxation test, which were never fitted, compared with the truth.

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
left.plot(tube.times / HOUR, 100 * tube.outputs["strain_11"], "k-", label="truth, along")
left.plot(tube.times / HOUR, 100 * tube.outputs["strain_12"], "k--", label="truth, shear")
again = ck.simulate(law, "point", fit.values, loading=tube.loading, times=times, temperature=1073.15)
left.plot(again.times / HOUR, 100 * again.outputs["strain_11"], "C1.", label="identified from bars")
left.plot(again.times / HOUR, 100 * again.outputs["strain_12"], "C1.")
left.set(xlabel="time, h", ylabel="creep strain, %", title="60 MPa tension, 35 MPa torsion after 10 h")
relaxed = ck.simulate(
    law,
    "relaxation",
    fit.values,
    loading=relaxation_run.loading,
    times=later,
    temperature=1073.15,
    elastic=relaxation_run.elastic,
)
right.plot(relaxation_run.times / HOUR, relaxation_run.outputs["stress"], "k-", label="truth")
right.plot(relaxed.times / HOUR, relaxed.outputs["stress"], "C1.", label="identified from bars")
right.set(xscale="log", xlabel="time, h", ylabel="stress, MPa", title="a bar held at 0.1 % of strain")
for axes in (left, right):
    axes.legend(fontsize=8)
    axes.grid(alpha=0.25)
figure.savefig("brittle-steel-elsewhere.png", dpi=120)

# %%
# A package
# ---------
# What colleagues install; it holds a law of ten lines until yours replaces it.

command = Path(sys.executable).with_name("creepkit")
if not Path("new-steel").exists():
    print(subprocess.run([command, "new", "law", "new-steel"], check=True, capture_output=True, text=True).stdout)

# %%
# Text for other programs
# -----------------------
# Intervals and the range of validity are given as comments.

print(ck.export(fit, "python")[:700])
