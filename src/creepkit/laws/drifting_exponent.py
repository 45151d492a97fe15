"""Drifting-exponent law (Eq. 1): a stress exponent n(t) that captures sigmoidal primary creep.

n(t) starts at n_0, rises on the time scale tau_r and decays to n_inf on tau_d; the strain exponent m is 0 in the
paper's identifications.
"""

import sympy

from creepkit.language import CreepLaw, Param, hookimpl, parameters, strain, stress, time
from creepkit.laws.paper import PAPER

A, n_0, n_inf, C, tau_d, tau_r, m = parameters("A n_0 n_inf C tau_d tau_r m")


n = n_inf + (C + n_0 - n_inf) * sympy.exp(-time / tau_d) - C * sympy.exp(-time / tau_r)


DRIFTING_EXPONENT = CreepLaw(
    name="drifting-exponent",
    title="Power law with a time-dependent stress exponent n(t)",
    terms={"drifting exponent": A * stress**n * strain**m},
    params={
        A: Param("rate coefficient", unit="1/s", bounds=(1e-40, 1e-5), scale="log", off=0.0, widens=True),
        n_0: Param("initial stress exponent", bounds=(1, 8), widens=True),
        n_inf: Param("saturated stress exponent", bounds=(1, 8), widens=True),
        C: Param("amplitude of the transient", bounds=(0, 8)),
        tau_d: Param("decay time", unit="s", bounds=(1000, 15000)),
        tau_r: Param("rise time", unit="s", bounds=(1000, 15000)),
        m: Param("strain exponent", bounds=(-1, 0), off=0.0),
    },
    constraints=(n >= 0,),
    references=(f"{PAPER}, Eq. (1)",),
)


@hookimpl
def creepkit_laws() -> list[CreepLaw]:
    return [DRIFTING_EXPONENT]
