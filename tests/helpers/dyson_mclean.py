"""The creep law of Dyson and McLean with hardening and coarsening, as published.

    rate = e_0 sinh(s (1 - H) / (s_0 (1 - P))) exp(-Q/(R T)),  dH/dt = (h/s)(1 - H/H_s) rate,  dP/dt = K/3 (1 - P)^4

H is the share of the stress that dislocation structures carry, up to H_s; P the loss of strength by coarsening of
particles. Dyson and McLean (1983), Acta Metall. 31, 17; (2001), in Strang et al. (eds), IoM Communications, 3-16.
"""

import sympy

from creepkit.language import GAS_CONSTANT, CreepLaw, Param, State, parameters, states, stress, temperature

e_0, s_0, h, H_s, K, Q = parameters("e_0 s_0 h H_s K Q")
H, P = states("H P")

_rate = e_0 * sympy.sinh(stress * (1 - H) / (s_0 * (1 - P))) * sympy.exp(-Q / (GAS_CONSTANT * temperature))

DYSON_MCLEAN = CreepLaw(
    name="dyson-mclean",
    title="Dyson and McLean, hardening and coarsening",
    terms={"glide past particles": _rate},
    params={
        e_0: Param("rate coefficient", (1e-5, 1e15), "1/s", "log", off=0.0),
        s_0: Param("stress of the sine", (5.0, 200.0), "MPa", "log"),
        h: Param("hardening modulus", (1e3, 1e6), "MPa", "log"),
        H_s: Param("saturated hardening", (0.1, 0.9)),
        K: Param("coarsening rate", (1e-12, 1e-4), "1/s", "log"),
        Q: Param("activation energy", (1e5, 7e5), "J/mol"),
    },
    states={
        H: State(0.0, h / stress * (1 - H / H_s) * _rate, "hardening"),
        P: State(0.0, K / 3 * (1 - P) ** 4, "loss of strength by coarsening"),
    },
    references=("Dyson and McLean (1983), Acta Metall. 31, 17",),
)
