"""MOOSE: a [Materials] block with PowerLawCreepStressUpdate, one for each term of a sum.

Solid mechanics module: rate = coefficient s^n_exponent exp(-activation_energy/(gas_constant T)) (t - start_time)^
m_exponent. Its m_exponent is an exponent of time; an exponent of strain does not exist there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from creepkit.errors import ExportError
from creepkit.export.cards.blocks import Block, several, written
from creepkit.export.cards.forms import Form, forms_of
from creepkit.export.cards.text import moduli, number, top
from creepkit.export.identifiers import Identifiers
from creepkit.language.symbols import GAS_CONSTANT
from creepkit.records import ValuedLaw

_INSTEAD = "export it as 'mfront', whose Abaqus interface AbaqusUMATStress calls"

_FORMULA = (
    "PowerLawCreepStressUpdate: rate = coefficient s^n_exponent exp(-activation_energy/(gas_constant T)) "
    "(t - start_time)^m_exponent, of equivalent stress s; ComputeMultipleInelasticStress adds the models. "
    "t is the analysis time: start_time is when the load begins. It takes strain = FINITE, or incremental = true."
)

_BASES = ("stress", "elasticity")


@dataclass(frozen=True)
class MooseBlock:
    """[Materials] with power-law creep, elasticity where moduli are given, and the stress that joins them."""

    name: str = "moose"
    title: str = "MOOSE [Materials] block of power-law creep (PowerLawCreepStressUpdate)"
    suffix: str = ".i"

    def text(self, source: ValuedLaw) -> str:
        """Return the block; a variable called `temperature` must exist where the law depends on temperature."""
        forms = forms_of(source, "MOOSE", _INSTEAD)
        for form in forms:
            _check(source, form)
        names = Identifiers(_BASES)
        wanted = [form.label for form in forms]
        labels = names.names(wanted)
        shared = len(forms) > 1
        models = {name: _model(source, form, name if shared else "") for name, form in zip(labels, forms, strict=True)}
        joined: Block = {"type": "ComputeMultipleInelasticStress", "inelastic_models": several(labels)}
        block: Block = {"Materials": {**_elasticity(source), **models, "stress": joined}}
        about = [_FORMULA, *_temperature(forms), *names.told(wanted)]
        return "\n".join([*top(source, "#", about), *written(block)]) + "\n"


def _elasticity(source: ValuedLaw) -> dict[str, Block]:
    found = moduli(source)
    if not found:
        return {}
    entries = {"youngs_modulus": found[0].E, "poissons_ratio": found[0].nu}
    return {"elasticity": {"type": "ComputeIsotropicElasticityTensor", **entries}}


def _check(source: ValuedLaw, form: Form) -> None:
    """Refuse what is no power law of stress and time."""
    if form.shape == "power" and not form.strain:
        return
    what = f"its {form.shape} of stress" if form.shape != "power" else f"its power {form.strain:g} of creep strain"
    raise ExportError(
        f"law '{source.law.name}', term '{form.label}': MOOSE has no creep model for {what} "
        f"(its m_exponent is one of time); {_INSTEAD}"
    )


def _model(source: ValuedLaw, form: Form, base: str) -> Block:
    """One creep model; base : of the names of its properties, which the models of a sum must not share."""
    entries: dict[str, str | float] = {
        "type": "PowerLawCreepStressUpdate",
        "coefficient": number(form.log_coefficient, "coefficient", source),
        "n_exponent": form.n,
        "m_exponent": form.time,
        "activation_energy": form.Q,
    }
    if form.time:
        entries["start_time"] = 0.0
    if form.Q:
        entries |= {"gas_constant": GAS_CONSTANT, "temperature": "temperature"}
    return entries | ({"base_name": base} if base else {})


def _temperature(forms: Sequence[Form]) -> list[str]:
    return ["The variable called temperature must be in K."] if any(form.Q for form in forms) else []
