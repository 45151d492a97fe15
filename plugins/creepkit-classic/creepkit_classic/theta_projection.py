"""Theta projection as a rate law: hardening dies away, weakening feeds on itself.

    strain = theta_1 (1 - exp(-theta_2 t)) + theta_3 (exp(theta_4 t) - 1) at constant stress

is the sum of two strains that obey dp/dt = theta_2 (theta_1 - p) and dq/dt = theta_4 (theta_3 + q), which also hold
when the stress changes; when it falls so far that p is above theta_1, p stays (no recovery). Evans and Wilshire's
ln theta_i = a_i + c_i s is written theta_i exp(c_i s), so that theta_i is exp(a_i). Their terms b_i T + d_i s T come
by `law.with_temperature(theta_1=exponential(), c_1=linear(), ...)`.
"""

import sympy

from creepkit.language import CreepLaw, Param, State, hookimpl, parameters, states, stress

theta = parameters("theta_1 theta_2 theta_3 theta_4")
c = parameters("c_1 c_2 c_3 c_4")
p, q = states("p q")

limit, decay, scale, growth = (t * sympy.exp(k * stress) for t, k in zip(theta, c, strict=True))
hardening, weakening = decay * sympy.Max(limit - p, 0), growth * (scale + q)

THETA_PROJECTION = CreepLaw(
    name="theta-projection",
    title="Theta projection, its two transients as internal variables",
    terms={"primary": hardening, "tertiary": weakening},
    params={
        theta[0]: Param("primary strain at zero stress", unit="1", bounds=(1e-10, 1.0), scale="log"),
        theta[1]: Param(
            "rate constant of primary creep", unit="1/s", bounds=(1e-15, 1.0), scale="log", off=0.0, widens=True
        ),
        theta[2]: Param("scale of tertiary strain at zero stress", unit="1", bounds=(1e-10, 1.0), scale="log"),
        theta[3]: Param(
            "rate constant of tertiary creep", unit="1/s", bounds=(1e-15, 1.0), scale="log", off=0.0, widens=True
        ),
        **{k: Param(f"slope of ln theta_{i} with stress", unit="1/MPa", bounds=(0, 0.1)) for i, k in enumerate(c, 1)},
    },
    states={p: State(0.0, hardening, "strain of primary creep"), q: State(0.0, weakening, "strain of tertiary creep")},
    references=("Evans and Wilshire (1985), Creep of Metals and Alloys, The Institute of Metals",),
)

TYPICAL = {
    **{"theta_1": 1e-3, "theta_2": 1e-9, "theta_3": 1e-3, "theta_4": 1e-10},
    **{"c_1": 0.01, "c_2": 0.03, "c_3": 0.01, "c_4": 0.04},
}
"""Orders of magnitude for a low-alloy ferritic steel about 550 C and 200 MPa."""


@hookimpl
def creepkit_laws() -> list[CreepLaw]:
    return [THETA_PROJECTION]
