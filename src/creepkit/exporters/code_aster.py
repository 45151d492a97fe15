"""code_aster: DEFI_MATERIAU with LEMAITRE, whose limit UN_SUR_M = 0 is Norton's law.

R5.03.08: rate = (UN_SUR_K s / e^UN_SUR_M)^N, so that A s^n e^m has N = n, UN_SUR_K = A^(1/n), UN_SUR_M = -m/n. With
an activation energy, LEMAITRE_FO takes UN_SUR_K as a formula of TEMP.
"""

from __future__ import annotations

import keyword
from collections.abc import Sequence

import sympy

from creepkit.exporters.creep_forms import (
    CodeInput,
    CreepForm,
    constant_elasticity,
    elastic_expressions,
    elasticity_varies,
    exp_in_range,
    format_number,
)
from creepkit.exporters.law_code import Identifiers
from creepkit.hookspecs import hookimpl
from creepkit.records import Exporter, LawWithValues

_FORMULA = "LEMAITRE: rate = (UN_SUR_K s / e^UN_SUR_M)^N, of equivalent stress s and creep strain e."


_RESERVED = (*keyword.kwlist, "_F", "DEFI_CONSTANTE", "DEFI_MATERIAU", "FORMULE")


class CodeAsterMaterial(CodeInput):
    """A material for COMPORTEMENT=_F(RELATION='LEMAITRE')."""

    code = "code_aster's LEMAITRE"
    alternative = "export it as 'mfront', which code_aster reads with RELATION='MFRONT'"
    marker = "#"
    first_lines = ("# -*- coding: utf-8 -*-",)
    """The file is Python, which else takes the encoding from what a title or note says (PEP 263)."""
    serves = ("aster",)
    name = "code_aster"
    title = "code_aster DEFI_MATERIAU with LEMAITRE (and Norton's law as its limit)"
    suffix = ".comm"

    def content(self, source: LawWithValues, forms: Sequence[CreepForm]) -> tuple[list[str], list[str]]:
        """DEFI_MATERIAU, with ELAS where moduli are given, and the formulas that it needs."""
        form = self._lemaitre_form(source, forms)
        names = Identifiers(_RESERVED, max_length=6)
        requested = source.name or source.law.name
        label = names.unique(requested)
        creep_formulas, creep_keyword = _creep_keyword(source, form, label)
        elastic_formulas, elastic_keywords = _elastic_keywords(source, label)
        formulas = [*elastic_formulas, *creep_formulas]
        comments = [_FORMULA, "Use it with COMPORTEMENT=_F(RELATION='LEMAITRE')."]
        comments += ["TEMP, a variable de commande of the material field, must be in K."] if formulas else []
        call = [f"{label} = DEFI_MATERIAU(", *(f"    {line}," for line in (*elastic_keywords, creep_keyword)), ")"]
        return [*comments, *names.renaming_notes([requested])], [*formulas, *call]

    def _lemaitre_form(self, source: LawWithValues, forms: Sequence[CreepForm]) -> CreepForm:
        """The one form that LEMAITRE has."""
        form = forms[0]
        if len(forms) > 1:
            reason = f"it is a sum ({' + '.join(f.label for f in forms)})"
        elif form.stress_function != "power":
            reason = f"{form.label} is a {form.stress_function} of stress"
        elif form.time_exponent:
            reason = f"{form.label} depends on time"
        elif not (form.n > 0.0 and form.strain_exponent <= 0.0):
            exponents = f"n = {form.n:g}, m = {form.strain_exponent:g}"
            reason = f"it asks for a positive stress exponent and hardening ({exponents})"
        else:
            return form
        raise self.refusal(source, f" is not code_aster's LEMAITRE: {reason}")


def _creep_keyword(source: LawWithValues, form: CreepForm, label: str) -> tuple[list[str], str]:
    """Formulas, and the keyword that reads them."""
    inverse_K = exp_in_range(form.log_coefficient / form.n, "UN_SUR_K", source)
    n, K, hardening = map(format_number, (form.n, inverse_K, abs(form.strain_exponent) / form.n))
    if not form.Q:
        return [], f"LEMAITRE=_F(N={n}, UN_SUR_K={K}, UN_SUR_M={hardening})"
    slope = format_number(-form.activation_temperature / form.n)
    formulas = [
        f"{label}_N = DEFI_CONSTANTE(VALE={n})",
        f"{label}_K = FORMULE(NOM_PARA='TEMP', VALE='{K} * exp({slope} / TEMP)')",
        f"{label}_M = DEFI_CONSTANTE(VALE={hardening})",
    ]
    return formulas, f"LEMAITRE_FO=_F(N={label}_N, UN_SUR_K={label}_K, UN_SUR_M={label}_M)"


def _elastic_keywords(source: LawWithValues, label: str) -> tuple[list[str], list[str]]:
    """Formulas of moduli that depend on temperature, and the keyword for the moduli."""
    elastic = source.elastic
    if elastic is None or not elasticity_varies(elastic):
        moduli = constant_elasticity(source)
        text = "" if moduli is None else f"ELAS=_F(E={format_number(moduli.E)}, NU={format_number(moduli.nu)})"
        return [], [text] if text else []
    texts = [sympy.sstr(e, full_prec=False) for e in elastic_expressions(source, elastic, "TEMP")]
    named_texts = zip((f"{label}_E", f"{label}_P"), texts, strict=True)
    formulas = [f"{name} = FORMULE(NOM_PARA='TEMP', VALE='{text}')" for name, text in named_texts]
    return formulas, [f"ELAS_FO=_F(E={label}_E, NU={label}_P)"]


@hookimpl
def creepkit_exporters() -> list[Exporter]:
    """The exporter of this module."""
    return [CodeAsterMaterial()]
