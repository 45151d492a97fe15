"""Combined law (Eq. 2): hyperbolic sine + strain hardening + time hardening, built by addition."""

from creepkit.language import CreepLaw, hookimpl
from creepkit.laws.hyperbolic_sine import HYPERBOLIC_SINE
from creepkit.laws.strain_hardening import STRAIN_HARDENING
from creepkit.laws.time_hardening import TIME_HARDENING

COMBINED = (HYPERBOLIC_SINE + STRAIN_HARDENING + TIME_HARDENING).rename("combined", "Combined law of Eq. (2)")


@hookimpl
def creepkit_laws() -> list[CreepLaw]:
    return [COMBINED]
