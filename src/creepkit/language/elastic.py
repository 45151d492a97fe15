"""Elastic data as a record of its own: Young's modulus and Poisson's ratio, constant or functions of temperature."""

from __future__ import annotations

from dataclasses import dataclass

import sympy

from creepkit.checked_arguments import checked
from creepkit.errors import LawError
from creepkit.language.symbols import temperature

STATE_MODULUS = (
    "state Young's modulus: modulus_GPa = 150 in tests.toml or the head of its file, elastic=Elastic(E=150e3) in Python"
)
"""What to write where a simulation needs it."""


@checked
@dataclass(frozen=True)
class Elastic:
    """Isotropic linear elasticity; E in MPa, a number or an expression of `temperature` such as wachtman(...)."""

    E: float | sympy.Expr
    nu: float | sympy.Expr = 0.3

    def __post_init__(self) -> None:
        for name in ("E", "nu"):
            value = getattr(self, name)
            if isinstance(value, sympy.Expr):
                stray = value.free_symbols - {temperature}
                if stray:
                    result = ", ".join(sorted(map(str, stray)))
                    raise LawError(f"Elastic: {name} may depend on temperature alone, found {result}")
                if value.free_symbols:
                    continue
            object.__setattr__(self, name, float(value))
        if isinstance(self.E, float) and not 0 < self.E < 1e8:
            raise LawError(f"Elastic: E = {self.E:g} MPa is not a modulus; write it in MPa, such as 150e3")
        if isinstance(self.nu, float) and not -1 < self.nu < 0.5:
            raise LawError(f"Elastic: nu = {self.nu:g} is outside (-1, 0.5)")

    @checked
    def at(self, T: float) -> Elastic:
        """The same record with numbers, at temperature `T` in K."""
        if isinstance(self.E, float) and isinstance(self.nu, float):
            return self
        E, nu = (float(v.subs(temperature, T)) if isinstance(v, sympy.Expr) else float(v) for v in (self.E, self.nu))
        return Elastic(E, nu)


@checked
def wachtman(E0: float, b: float, T0: float) -> sympy.Expr:
    """Young's modulus E0 - b T exp(-T0/T) as an expression of temperature; E0 in MPa, b in MPa/K, T0 and T in K.

    Wachtman et al. (1961), Phys. Rev. 122, 1754.
    """
    return sympy.Float(E0) - sympy.Float(b) * temperature * sympy.exp(-sympy.Float(T0) / temperature)


def elastic_of(modulus: float | None, poisson: float = 0.3) -> Elastic | None:
    """Elastic data of Young's modulus, MPa; None without it."""
    return None if modulus is None else Elastic(E=modulus, nu=poisson)
