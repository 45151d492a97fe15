"""Norton-Bailey in its strain-hardening form: rate = (A s^n ((m+1) e)^m)^(1/(m+1)), e the creep strain, -1 < m <= 0.

The notation of Abaqus (*CREEP, LAW=STRAIN): A, n and m are those of `norton-bailey-rate`, from which the time has been
eliminated at constant stress. When the stress changes the two differ. The built-in law `strain-hardening` is the same
equation as A s^n e^m, with other A, n and m: see `creepkit_classic.conversions`.
"""

from creepkit.language import CreepLaw, Param, hookimpl, parameters, strain, stress

A, n, m = parameters("A n m")

NORTON_BAILEY_STRAIN = CreepLaw(
    name="norton-bailey-strain",
    title="Norton-Bailey, strain hardening in the notation of Abaqus",
    terms={"strain hardening": (A * stress**n * ((m + 1) * strain) ** m) ** (1 / (m + 1))},
    params={
        A: Param("rate at 1 MPa and 1 s", unit="1/s", bounds=(1e-40, 1e-2), scale="log", widens=True),
        n: Param("stress exponent of the time form", bounds=(1, 12), widens=True),
        m: Param("time exponent of the rate", bounds=(-0.9, 0.0), off=0.0),
    },
    references=(
        "Abaqus Analysis User's Guide, Rate-dependent plasticity: creep and swelling",
        "Bailey (1935), Proc. Inst. Mech. Eng. 131, 131",
    ),
)

TYPICAL = {"A": 1e-13 / 3, "n": 4.0, "m": -2 / 3}
"""The TYPICAL values of `norton-bailey-time` in this notation."""


@hookimpl
def creepkit_laws() -> list[CreepLaw]:
    return [NORTON_BAILEY_STRAIN]
