"""code_aster: DEFI_MATERIAU with LEMAITRE, whose limit UN_SUR_M = 0 is Norton's law.

R5.03.08: rate = (UN_SUR_K s / e^UN_SUR_M)^N, so that A s^n e^m has N = n, UN_SUR_K = A^(1/n), UN_SUR_M = -m/n. With
an activation energy, LEMAITRE_FO takes UN_SUR_K as a formula of TEMP.
"""

from __future__ import annotations

import keyword
from dataclasses import dataclass

import sympy

from creepkit.errors import ExportError
from creepkit.export.cards.forms import Form, forms_of
from creepkit.export.cards.text import figure, moduli, number, top
from creepkit.export.identifiers import Identifiers
from creepkit.language.symbols import temperature
from creepkit.records import ValuedLaw

_INSTEAD = "export it as 'mfront', which code_aster reads with RELATION='MFRONT'"

_FORMULA = "LEMAITRE: rate = (UN_SUR_K s / e^UN_SUR_M)^N, of equivalent stress s and creep strain e."

_RESERVED = (*keyword.kwlist, "_F", "DEFI_CONSTANTE", "DEFI_MATERIAU", "FORMULE")


@dataclass(frozen=True)
class CodeAsterMaterial:
    """A material for COMPORTEMENT=_F(RELATION='LEMAITRE')."""

    name: str = "code_aster"
    title: str = "code_aster DEFI_MATERIAU with LEMAITRE (and Norton's law as its limit)"
    suffix: str = ".comm"

    def text(self, source: ValuedLaw) -> str:
        """Return DEFI_MATERIAU, with ELAS where moduli are given, and the formulas that it needs."""
        form = _lemaitre(source, forms_of(source, "code_aster's LEMAITRE", _INSTEAD))
        names = Identifiers(_RESERVED, longest=6)
        wanted = source.name or source.law.name
        label = names.name(wanted)
        functions, laws = _creep(source, form, label)
        before, elastic = _elastic(source, label)
        about = [_FORMULA, "Use it with COMPORTEMENT=_F(RELATION='LEMAITRE')."]
        about += ["TEMP, a variable de commande of the material field, must be in K."] if functions or before else []
        call = [f"{label} = DEFI_MATERIAU(", *(f"    {line}," for line in (*elastic, laws)), ")"]
        return "\n".join([*top(source, "#", [*about, *names.told([wanted])]), *before, *functions, *call]) + "\n"


def _lemaitre(source: ValuedLaw, forms: tuple[Form, ...]) -> Form:
    """The one form that LEMAITRE has."""
    form = forms[0]
    if len(forms) > 1:
        why = f"it is a sum ({' + '.join(f.label for f in forms)})"
    elif form.shape != "power":
        why = f"{form.label} is a {form.shape} of stress"
    elif form.time:
        why = f"{form.label} depends on time"
    elif not (form.n > 0.0 and form.strain <= 0.0):
        why = f"it asks for a positive stress exponent and hardening (n = {form.n:g}, m = {form.strain:g})"
    else:
        return form
    raise ExportError(f"law '{source.law.name}' is not code_aster's LEMAITRE: {why}; {_INSTEAD}")


def _creep(source: ValuedLaw, form: Form, label: str) -> tuple[list[str], str]:
    """Formulas, and the keyword that reads them."""
    hardening = abs(form.strain) / form.n
    inverse_K = number(form.log_coefficient / form.n, "UN_SUR_K", source)
    if not form.Q:
        constants = f"N={figure(form.n)}, UN_SUR_K={figure(inverse_K)}, UN_SUR_M={figure(hardening)}"
        return [], f"LEMAITRE=_F({constants})"
    slope = form.per_kelvin / form.n
    functions = [
        f"{label}_N = DEFI_CONSTANTE(VALE={figure(form.n)})",
        f"{label}_K = FORMULE(NOM_PARA='TEMP', VALE='{figure(inverse_K)} * exp({figure(-slope)} / TEMP)')",
        f"{label}_M = DEFI_CONSTANTE(VALE={figure(hardening)})",
    ]
    return functions, f"LEMAITRE_FO=_F(N={label}_N, UN_SUR_K={label}_K, UN_SUR_M={label}_M)"


def _elastic(source: ValuedLaw, label: str) -> tuple[list[str], list[str]]:
    """Formulas of moduli that depend on temperature, and the keyword for the moduli."""
    elastic = source.elastic
    if elastic is None:
        return [], []
    varies = [isinstance(v, sympy.Expr) and bool(v.free_symbols) for v in (elastic.E, elastic.nu)]
    if not any(varies):
        ((found),) = moduli(source)
        return [], [f"ELAS=_F(E={figure(found.E)}, NU={figure(found.nu)})"]
    scaled = (sympy.sympify(elastic.E) / source.units.megapascals, sympy.sympify(elastic.nu))
    texts = [sympy.sstr(e.xreplace({temperature: sympy.Symbol("TEMP")}), full_prec=False) for e in scaled]
    named = zip((f"{label}_E", f"{label}_P"), texts, strict=True)
    functions = [f"{name} = FORMULE(NOM_PARA='TEMP', VALE='{text}')" for name, text in named]
    return functions, [f"ELAS_FO=_F(E={label}_E, NU={label}_P)"]
