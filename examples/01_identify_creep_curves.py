"""From creep curves to a law with error bars.

python examples/01_identify_creep_curves.py            the curves of `creepkit demo`, whose law is known
python examples/01_identify_creep_curves.py FOLDER     your own
"""

import sys
from pathlib import Path

import creepkit as ck
from creepkit.cli.demo import PLANTED

folder = Path(sys.argv[1]) if len(sys.argv) > 1 else PLANTED
tests = [test.up_to("strain", 0.05) for test in ck.read_histories(folder)]

# Two candidates. Several temperatures call for an Arrhenius factor, written about one of them.
arrhenius = ck.arrhenius(T_ref=1073.15)
fits = [ck.identify(ck.law(name).times(arrhenius), tests, starts=4) for name in ("strain-hardening", "time-hardening")]

# Which of them? Weights say how sure; two laws that the tests cannot tell apart are both named.
ranking = ck.rank(fits)
print(ranking.verdict)

# Values with 95 % intervals, scatter between tests, and what is not determined.
fit = ranking.best
print(fit)

# The rate at any stress and temperature, with its interval.
rate, low, high = fit.rate(stress=[60.0, 80.0, 100.0], temperature=1073.15)
for stress, *row in zip((60, 80, 100), rate, low, high, strict=True):
    print(f"{stress} MPa: {row[0]:.3g} 1/s, 95 % from {row[1]:.3g} to {row[2]:.3g}")

# Text that runs elsewhere; intervals and range of validity travel as comments.
print(ck.export(fit, "latex"))
