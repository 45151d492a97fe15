"""MOOSE and NEML2, whose input files share the HIT format: power-law creep as blocks.

MOOSE, solid mechanics module, PowerLawCreepStressUpdate, one a term: rate = coefficient s^n_exponent
exp(-activation_energy/(gas_constant T)) (t - start_time)^m_exponent; its m_exponent is an exponent of time.

NEML2 3.1, PerzynaPlasticFlowRate without a yield stress: rate = (f/reference_stress)^exponent. f is the von Mises
stress itself here: NEML2's YieldFunction would multiply it by sqrt(2/3). A sum has one flow rate a term; an activation
energy makes the reference stress an ArrheniusParameter. NEML2 3.1 has no creep law of strain, of time or of a
hyperbolic sine.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from creepkit.errors import ExportError
from creepkit.exporters.creep_forms import (
    CreepForm,
    card_heading,
    constant_elasticity,
    creep_forms_of,
    exp_in_range,
    format_number,
)
from creepkit.exporters.law_code import Identifiers
from creepkit.hookspecs import hookimpl
from creepkit.language.symbols import GAS_CONSTANT
from creepkit.records import Exporter, LawWithValues

HitBlock = Mapping[str, "str | float | HitBlock"]
"""Entries of a block by name: a value, or another block."""


def hit_lines(blocks: HitBlock, depth: int = 0) -> list[str]:
    """Lines of the blocks, indented by two blanks a level."""
    lines = []
    for name, entry in blocks.items():
        if isinstance(entry, (str, int, float)):
            lines.append(f"{'  ' * depth}{name} = {entry if isinstance(entry, str) else format_number(entry)}")
        else:
            lines += [f"{'  ' * depth}[{name}]", *hit_lines(entry, depth + 1), f"{'  ' * depth}[]"]
    return lines


def hit_list(items: Sequence[str]) -> str:
    """A list as one value."""
    return f"'{' '.join(items)}'"


_MOOSE_ALTERNATIVE = "export it as 'mfront', whose Abaqus interface AbaqusUMATStress calls"


_MOOSE_FORMULA = (
    "PowerLawCreepStressUpdate: rate = coefficient s^n_exponent exp(-activation_energy/(gas_constant T)) "
    "(t - start_time)^m_exponent, of equivalent stress s; ComputeMultipleInelasticStress adds the models. "
    "t is the analysis time: start_time is when the load begins. It takes strain = FINITE, or incremental = true."
)


_MOOSE_RESERVED = ("stress", "elasticity")


class MooseBlock:
    """[Materials] with power-law creep, elasticity where moduli are given, and the stress that joins them."""

    name = "moose"
    title = "MOOSE [Materials] block of power-law creep (PowerLawCreepStressUpdate)"
    suffix = ".i"

    def text(self, source: LawWithValues) -> str:
        """Return the block; a variable called `temperature` must exist where the law depends on temperature."""
        forms = creep_forms_of(source, "MOOSE", _MOOSE_ALTERNATIVE)
        for form in forms:
            _check_moose_form(source, form)
        names = Identifiers(_MOOSE_RESERVED)
        labels_requested = [form.label for form in forms]
        labels = names.unique_names(labels_requested)
        several_models = len(forms) > 1
        models = {
            name: _moose_creep_model(source, form, name if several_models else "")
            for name, form in zip(labels, forms, strict=True)
        }
        stress_block: HitBlock = {"type": "ComputeMultipleInelasticStress", "inelastic_models": hit_list(labels)}
        block: HitBlock = {"Materials": {**_moose_elasticity(source), **models, "stress": stress_block}}
        comments = [_MOOSE_FORMULA, *_temperature_notes(forms), *names.renaming_notes(labels_requested)]
        return "\n".join([*card_heading(source, "#", comments), *hit_lines(block)]) + "\n"


def _moose_elasticity(source: LawWithValues) -> dict[str, HitBlock]:
    moduli = constant_elasticity(source)
    if moduli is None:
        return {}
    entries = {"youngs_modulus": moduli.E, "poissons_ratio": moduli.nu}
    return {"elasticity": {"type": "ComputeIsotropicElasticityTensor", **entries}}


def _check_moose_form(source: LawWithValues, form: CreepForm) -> None:
    """Refuse what is no power law of stress and time."""
    if form.stress_function == "power" and not form.strain_exponent:
        return
    description = (
        f"its {form.stress_function} of stress"
        if form.stress_function != "power"
        else f"its power {form.strain_exponent:g} of creep strain"
    )
    raise ExportError(
        f"law '{source.law.name}', term '{form.label}': MOOSE has no creep model for {description} "
        f"(its m_exponent is one of time); {_MOOSE_ALTERNATIVE}"
    )


def _moose_creep_model(source: LawWithValues, form: CreepForm, base_name: str) -> HitBlock:
    """One creep model; base_name : of its properties, whose names the models of a sum must not share."""
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


_NEML2_ALTERNATIVE = "export it as 'python', whose rate a flow rate of your own in NEML2 can follow"


_NEML2_FORMULA = (
    "For NEML2 3.1. PerzynaPlasticFlowRate: rate = (s/reference_stress)^exponent, of the von Mises stress s, which "
    "stands in the place of the yield function. The model called `model` makes the stress of strain E and time t."
)


_NEML2_ARRHENIUS = (
    "Reference stresses: reference_value exp(-activation_energy/(R T)), T the input called temperature, in K."
)


_NEML2_RESERVED = (
    *("mandel_stress", "vonmises", "flow", "normality", "flow_rate", "sum", "Eprate", "Erate", "Eerate", "elasticity"),
    *("integrate_stress", "implicit_rate", "predictor", "model", "temperature"),
)


class Neml2Model:
    """An input file with [Models], [EquationSystems] and [Solvers]; needs the moduli."""

    name = "neml2"
    title = "NEML2 3.1 material model with Norton's law (PerzynaPlasticFlowRate)"
    suffix = ".i"

    def text(self, source: LawWithValues) -> str:
        """Return the input file."""
        forms = creep_forms_of(source, "NEML2 3.1", _NEML2_ALTERNATIVE)
        for form in forms:
            _check_neml2_form(source, form)
        names = Identifiers(_NEML2_RESERVED)
        labels_requested = [form.label for form in forms]
        rates = _flow_rate_blocks(source, dict(zip(names.unique_names(labels_requested), forms, strict=True)))
        comments = [
            _NEML2_FORMULA,
            *([_NEML2_ARRHENIUS] if any(f.Q for f in forms) else []),
            *names.renaming_notes(labels_requested),
        ]
        return (
            "\n".join([*card_heading(source, "#", comments), *hit_lines(_neml2_file(rates, _neml2_elasticity(source)))])
            + "\n"
        )


def _check_neml2_form(source: LawWithValues, form: CreepForm) -> None:
    if not (form.stress_function == "power" and form.is_steady and form.n > 0.0):
        exponents = f"strain exponent {form.strain_exponent:g}, time exponent {form.time_exponent:g}"
        raise ExportError(
            f"law '{source.law.name}', term '{form.label}': NEML2 3.1 has steady power laws of stress only, "
            f"and this is a {form.stress_function} of stress, {exponents}; {_NEML2_ALTERNATIVE}"
        )


def _flow_rate_blocks(source: LawWithValues, forms: dict[str, CreepForm]) -> dict[str, HitBlock]:
    """The flow rate of each term, their reference stresses where these depend on temperature, and the sum."""
    blocks: dict[str, HitBlock] = {}
    outputs = [f"{name}_rate" for name in forms] if len(forms) > 1 else ["flow_rate"]
    for (name, form), output in zip(forms.items(), outputs, strict=True):
        reference: str | float = exp_in_range(-form.log_coefficient / form.n, "reference_stress", source)
        if form.Q:
            blocks[f"{name}_stress"] = {
                "type": "ArrheniusParameter",
                "reference_value": reference,
                "activation_energy": -form.Q / form.n,
                "ideal_gas_constant": GAS_CONSTANT,
                "temperature": "'temperature'",
            }
            reference = f"'{name}_stress'"
        blocks[name] = {
            "type": "PerzynaPlasticFlowRate",
            "reference_stress": reference,
            "exponent": form.n,
            "flow_rate": f"'{output}'",
        }
    if len(forms) > 1:
        blocks["sum"] = {"type": "ScalarLinearCombination", "from": hit_list(outputs), "to": "'flow_rate'"}
    return blocks


def _neml2_elasticity(source: LawWithValues) -> HitBlock:
    moduli = constant_elasticity(source)
    if moduli is None:
        raise ExportError(
            f"law '{source.law.name}': a NEML2 model needs the moduli; give elastic=Elastic(E=150e3, nu=0.3)"
        )
    return {
        "type": "LinearIsotropicElasticity",
        "coefficients": hit_list([format_number(moduli.E), format_number(moduli.nu)]),
        "coefficient_types": "'YOUNGS_MODULUS POISSONS_RATIO'",
        "rate_form": "true",
    }


def _neml2_file(rates: dict[str, HitBlock], elasticity: HitBlock) -> HitBlock:
    """The whole file: the rates of strain and stress, integrated by backward Euler and solved for the stress."""
    stress_blocks: dict[str, HitBlock] = {
        "mandel_stress": {"type": "IsotropicMandelStress", "cauchy_stress": "'stress'"},
        "vonmises": _typed_block(
            "SR2Invariant", invariant_type="VONMISES", tensor="mandel_stress", invariant="yield_function"
        ),
    }
    flow = _typed_block("ComposedModel", models="vonmises")
    rate_blocks: dict[str, HitBlock] = {
        "normality": {
            **_typed_block("Normality", model="flow", function="yield_function"),
            "from": "'mandel_stress'",
            "to": "'flow_direction'",
        },
        **rates,
        "Eprate": {"type": "AssociativePlasticFlow"},
        "Erate": _typed_block("SR2VariableRate", variable="E"),
        "Eerate": {
            "type": "SR2LinearCombination",
            "from": "'E_rate plastic_strain_rate'",
            "to": "'strain_rate'",
            "weights": "'1 -1'",
        },
        "elasticity": elasticity,
        "integrate_stress": _typed_block("SR2BackwardEulerTimeIntegration", variable="stress"),
    }
    model_names = [
        name for name, block in (stress_blocks | rate_blocks).items() if block["type"] != "ArrheniusParameter"
    ]
    return {
        "Models": {
            **stress_blocks,
            "flow": flow,
            **rate_blocks,
            "implicit_rate": {"type": "ComposedModel", "models": hit_list(model_names)},
            "predictor": _typed_block("ConstantExtrapolationPredictor", unknowns_SR2="stress"),
            "model": _typed_block(
                "ImplicitUpdate", equation_system="equations", solver="newton", predictor="predictor"
            ),
        },
        "EquationSystems": {
            "equations": _typed_block(
                "NonlinearSystem", model="implicit_rate", unknowns="stress", residuals="stress_residual"
            )
        },
        "Solvers": {"newton": _typed_block("Newton", linear_solver="lu"), "lu": {"type": "DenseLU"}},
    }


def _typed_block(type: str, **entries: str) -> dict[str, str]:
    """A block of a type with quoted entries."""
    return {"type": type, **{key: f"'{value}'" for key, value in entries.items()}}


@hookimpl
def creepkit_exporters() -> list[Exporter]:
    """The exporters of this module."""
    return [MooseBlock(), Neml2Model()]
