"""MOOSE: a [Materials] block with PowerLawCreepStressUpdate, one for each term of a sum.

Solid mechanics module: rate = coefficient s^n_exponent exp(-activation_energy/(gas_constant T)) (t - start_time)^
m_exponent. Its m_exponent is an exponent of time; an exponent of strain does not exist there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from creepkit.errors import ExportError
from creepkit.export.cards.blocks import HitBlock, hit_list, hit_lines
from creepkit.export.cards.forms import CreepForm, creep_forms_of
from creepkit.export.cards.text import elastic_constants, exp_in_range, card_heading
from creepkit.export.identifiers import Identifiers
from creepkit.language.symbols import GAS_CONSTANT
from creepkit.records import LawWithValues

_MOOSE_ALTERNATIVE = "export it as 'mfront', whose Abaqus interface AbaqusUMATStress calls"

_MOOSE_FORMULA = (
    "PowerLawCreepStressUpdate: rate = coefficient s^n_exponent exp(-activation_energy/(gas_constant T)) "
    "(t - start_time)^m_exponent, of equivalent stress s; ComputeMultipleInelasticStress adds the models. "
    "t is the analysis time: start_time is when the load begins. It takes strain = FINITE, or incremental = true."
)

_MOOSE_RESERVED = ("stress", "elasticity")


@dataclass(frozen=True)
class MooseBlock:
    """[Materials] with power-law creep, elasticity where moduli are given, and the stress that joins them."""

    name: str = "moose"
    title: str = "MOOSE [Materials] block of power-law creep (PowerLawCreepStressUpdate)"
    suffix: str = ".i"

    def text(self, source: LawWithValues) -> str:
        """Return the block; a variable called `temperature` must exist where the law depends on temperature."""
        forms = creep_forms_of(source, "MOOSE", _MOOSE_ALTERNATIVE)
        for form in forms:
            _check_moose_form(source, form)
        names = Identifiers(_MOOSE_RESERVED)
        labels_requested = [form.label for form in forms]
        labels = names.unique_names(labels_requested)
        several_models = len(forms) > 1
        models = {name: _moose_creep_model(source, form, name if several_models else "") for name, form in zip(labels, forms, strict=True)}
        stress_block: HitBlock = {"type": "ComputeMultipleInelasticStress", "inelastic_models": hit_list(labels)}
        block: HitBlock = {"Materials": {**_moose_elasticity(source), **models, "stress": stress_block}}
        comments = [_MOOSE_FORMULA, *_temperature_notes(forms), *names.renaming_notes(labels_requested)]
        return "\n".join([*card_heading(source, "#", comments), *hit_lines(block)]) + "\n"


def _moose_elasticity(source: LawWithValues) -> dict[str, HitBlock]:
    constants = elastic_constants(source)
    if not constants:
        return {}
    entries = {"youngs_modulus": constants[0].E, "poissons_ratio": constants[0].nu}
    return {"elasticity": {"type": "ComputeIsotropicElasticityTensor", **entries}}


def _check_moose_form(source: LawWithValues, form: CreepForm) -> None:
    """Refuse what is no power law of stress and time."""
    if form.stress_function == "power" and not form.strain_exponent:
        return
    description = f"its {form.stress_function} of stress" if form.stress_function != "power" else f"its power {form.strain_exponent:g} of creep strain"
    raise ExportError(
        f"law '{source.law.name}', term '{form.label}': MOOSE has no creep model for {description} "
        f"(its m_exponent is one of time); {_MOOSE_ALTERNATIVE}"
    )


def _moose_creep_model(source: LawWithValues, form: CreepForm, base_name: str) -> HitBlock:
    """One creep model; base : of the names of its properties, which the models of a sum must not share."""
    entries: dict[str, str | float] = {
        "type": "PowerLawCreepStressUpdate",
        "coefficient": exp_in_range(form.log_coefficient, "coefficient", source),
        "n_exponent": form.n,
        "m_exponent": form.time_exponent,
        "activation_energy": form.Q,
    }
    if form.time_exponent:
        entries["start_time"] = 0.0
    if form.Q:
        entries |= {"gas_constant": GAS_CONSTANT, "temperature": "temperature"}
    return entries | ({"base_name": base_name} if base_name else {})


def _temperature_notes(forms: Sequence[CreepForm]) -> list[str]:
    return ["The variable called temperature must be in K."] if any(form.Q for form in forms) else []
