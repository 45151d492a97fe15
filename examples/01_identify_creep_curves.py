r"""Identify a law from creep curves
================================

From measured creep curves to the values of a law with 95 % intervals.

Without an argument the simulated curves that ship with this package are used, whose law is known. ``--quick`` searches
from fewer starting points::

    python examples/01_identify_creep_curves.py [--quick] [FOLDER]
"""

import sys

import creepkit as ck

quick = "--quick" in sys.argv
folders = [word for word in sys.argv[1:] if word != "--quick"]
curves = ck.read_histories(folders[0] if folders else ck.example_data("planted creep curves"))
tests = [test.up_to("strain", 0.05) for test in curves]

# %%
# Two candidate laws
# ------------------
# Several temperatures call for an Arrhenius factor, written about one of them.

arrhenius = ck.arrhenius(T_ref=1073.15)
candidates = [ck.law(name).times(arrhenius) for name in ("strain-hardening", "time-hardening")]
fits = [ck.identify(law, tests, starts=1 if quick else 4) for law in candidates]

# %%
# Which of them?
# --------------
# Weights say how sure the choice is. Two laws that the tests cannot tell apart are both named.

ranking = ck.rank(fits)
print(ranking.verdict)

# %%
# Values with 95 % intervals, scatter between tests, and what is not determined.

fit = ranking.best
print(fit)

# %%
# Use the law
# -----------
# The creep rate at any stress and temperature, with its interval.

rate, low, high = fit.rate(stress=[60.0, 80.0, 100.0], temperature=1073.15)
for stress, *row in zip((60, 80, 100), rate, low, high, strict=True):
    print(f"{stress} MPa: {row[0]:.3g} 1/s, 95 % from {row[1]:.3g} to {row[2]:.3g}")

# %%
# Text for other programs; intervals and the range of validity are given as comments.

print(ck.export(fit, "latex"))
