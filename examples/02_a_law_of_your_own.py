r"""Write a law of your own
=======================

A law that does not ship with the package: written in ten lines, then checked, simulated, added to another and printed.
"""

import numpy as np
import sympy

import creepkit as ck

# %%
# Equation and parameters
# -----------------------
# Primary creep that decays with strain, rate = A stress^n exp(-strain / e0): two variables and three parameters.

A, n, e0 = ck.parameters("A n e0")
law = ck.CreepLaw(
    name="fading",
    title="Primary creep that decays with strain",
    terms={"fading": A * ck.stress**n * sympy.exp(-ck.strain / e0)},
    params={
        A: ck.Param("rate coefficient", unit="1/s", bounds=(1e-40, 1e-5), scale="log", off=0.0),
        n: ck.Param("stress exponent", bounds=(1, 8)),
        e0: ck.Param("decay strain", bounds=(1e-4, 0.1), scale="log", unit="1"),
    },
    references=("Wyatt (1953), Proc. Phys. Soc. B 66, 459",),
)
print(ck.check_law(law, samples=16))
print(law.latex())

# %%
# Derivatives and kernels
# -----------------------
# They are derived from the equation; here the derivative of the rate with respect to stress.

kernel = ck.lower(law, "numpy")
values = {"A": 1e-14, "n": 4.0, "e0": 0.004}
print(kernel.derivatives(values, stress=100.0, strain=0.001)["stress"])

# %%
# Simulation
# ----------
# Compared with the closed form at constant true stress, strain = e0 ln(1 + rate t / e0).

times = np.linspace(0, 1e4, 50)
curve = ck.simulate(law, ck.specimen("uniaxial"), values, loading=ck.constant_stress(100.0, "stress"), times=times)
closed = 0.004 * np.log1p(1e-14 * 100.0**4 * times / 0.004)
print("largest relative difference:", np.max(np.abs(curve.outputs["strain"][1:] / closed[1:] - 1)))

# %%
# A sum of laws
# -------------
# A law adds to any other law; parameters of the same name are numbered.

print(law + ck.law("norton"))
