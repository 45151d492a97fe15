"""MPC Omega: there is no steady state, every strain speeds the next one up. rate = A s^n exp(Omega e), e the strain.

At constant stress e = -ln(1 - Omega r t)/Omega with the initial rate r = A s^n: the strain is infinite, the life
over, at 1/(Omega r). Omega may fall with stress, Omega exp(-c s); `law.fix(c=0)` keeps it constant. API 579-1 gives
log r and log Omega as a constant and a cubic of log s over T; these can rise without bound towards zero stress, where
every finite element starts. For temperature: `law.times(arrhenius()).with_temperature(Omega=activated())`.
"""

import sympy

from creepkit.language import CreepLaw, Param, hookimpl, parameters, strain, stress

A, n, Omega, c = parameters("A n Omega c")
acceleration = Omega * sympy.exp(-c * stress) * strain

MPC_OMEGA = CreepLaw(
    name="mpc-omega",
    title="MPC Omega: the rate grows exponentially with strain",
    terms={"acceleration by strain": A * stress**n * sympy.exp(acceleration)},
    params={
        A: Param("initial rate at 1 MPa", unit="1/s", bounds=(1e-60, 1e-5), scale="log", off=0.0, widens=True),
        n: Param("stress exponent", bounds=(1, 20), widens=True),
        Omega: Param("acceleration by strain", unit="1", bounds=(1.0, 500.0), scale="log"),
        c: Param("fall of ln Omega with stress", unit="1/MPa", bounds=(0.0, 0.05), off=0.0),
    },
    constraints=(n - c * stress * acceleration >= 0,),
    references=(
        "Prager (1995), J. Pressure Vessel Technol. 117, 95",
        "API 579-1/ASME FFS-1, Fitness-For-Service, Part 10",
    ),
)

TYPICAL = {"A": 1e-22, "n": 6.0, "Omega": 50.0, "c": 0.0}
"""Orders of magnitude for a low-alloy steel in service: 1e-10 1/s at 100 MPa; Omega 10 (ductile) to 200 (aged)."""


@hookimpl
def creepkit_laws() -> list[CreepLaw]:
    return [MPC_OMEGA]
