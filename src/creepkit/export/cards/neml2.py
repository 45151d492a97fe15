"""NEML2 3.1: a material model whose flow rate is Perzyna's without a yield stress, which is Norton's law.

PerzynaPlasticFlowRate: rate = (f/reference_stress)^exponent. f is the von Mises stress itself here: NEML2's
YieldFunction would multiply it by sqrt(2/3). A sum has one flow rate a term; an activation energy makes the reference
stress an ArrheniusParameter. NEML2 3.1 has no creep law of strain, of time or of a hyperbolic sine.
"""

from __future__ import annotations

from dataclasses import dataclass

from creepkit.errors import ExportError
from creepkit.export.cards.blocks import HitBlock, hit_list, hit_lines
from creepkit.export.cards.forms import CreepForm, creep_forms_of
from creepkit.export.cards.text import format_number, elastic_constants, exp_in_range, card_heading
from creepkit.export.identifiers import Identifiers
from creepkit.language.symbols import GAS_CONSTANT
from creepkit.records import LawWithValues

_NEML2_ALTERNATIVE = "export it as 'python', whose rate a flow rate of your own in NEML2 can follow"

_NEML2_FORMULA = (
    "For NEML2 3.1. PerzynaPlasticFlowRate: rate = (s/reference_stress)^exponent, of the von Mises stress s, which "
    "stands in the place of the yield function. The model called `model` makes the stress of strain E and time t."
)

_NEML2_ARRHENIUS = "Reference stresses: reference_value exp(-activation_energy/(R T)), T the input called temperature, in K."

_NEML2_RESERVED = (
    *("mandel_stress", "vonmises", "flow", "normality", "flow_rate", "sum", "Eprate", "Erate", "Eerate", "elasticity"),
    *("integrate_stress", "implicit_rate", "predictor", "model", "temperature"),
)


@dataclass(frozen=True)
class Neml2Model:
    """An input file with [Models], [EquationSystems] and [Solvers]; needs the moduli."""

    name: str = "neml2"
    title: str = "NEML2 3.1 material model with Norton's law (PerzynaPlasticFlowRate)"
    suffix: str = ".i"

    def text(self, source: LawWithValues) -> str:
        """Return the input file."""
        forms = creep_forms_of(source, "NEML2 3.1", _NEML2_ALTERNATIVE)
        for form in forms:
            _check_neml2_form(source, form)
        names = Identifiers(_NEML2_RESERVED)
        labels_requested = [form.label for form in forms]
        rates = _flow_rate_blocks(source, dict(zip(names.unique_names(labels_requested), forms, strict=True)))
        comments = [_NEML2_FORMULA, *([_NEML2_ARRHENIUS] if any(f.Q for f in forms) else []), *names.renaming_notes(labels_requested)]
        return "\n".join([*card_heading(source, "#", comments), *hit_lines(_neml2_file(rates, _neml2_elasticity(source)))]) + "\n"


def _check_neml2_form(source: LawWithValues, form: CreepForm) -> None:
    if not (form.stress_function == "power" and form.is_steady and form.n > 0.0):
        description = f"{form.stress_function} of stress, strain exponent {form.strain_exponent:g}, time exponent {form.time_exponent:g}"
        raise ExportError(
            f"law '{source.law.name}', term '{form.label}': NEML2 3.1 has steady power laws of stress only, "
            f"and this is a {description}; {_NEML2_ALTERNATIVE}"
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
    constants = elastic_constants(source)
    if not constants:
        raise ExportError(
            f"law '{source.law.name}': a NEML2 model needs the moduli; give elastic=Elastic(E=150e3, nu=0.3)"
        )
    return {
        "type": "LinearIsotropicElasticity",
        "coefficients": hit_list([format_number(constants[0].E), format_number(constants[0].nu)]),
        "coefficient_types": "'YOUNGS_MODULUS POISSONS_RATIO'",
        "rate_form": "true",
    }


def _neml2_file(rates: dict[str, HitBlock], elasticity: HitBlock) -> HitBlock:
    """The whole file: the rates of strain and stress, integrated by backward Euler and solved for the stress."""
    stress_blocks: dict[str, HitBlock] = {
        "mandel_stress": {"type": "IsotropicMandelStress", "cauchy_stress": "'stress'"},
        "vonmises": _typed_block("SR2Invariant", invariant_type="VONMISES", tensor="mandel_stress", invariant="yield_function"),
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
    model_names = [name for name, block in (stress_blocks | rate_blocks).items() if block["type"] != "ArrheniusParameter"]
    return {
        "Models": {
            **stress_blocks,
            "flow": flow,
            **rate_blocks,
            "implicit_rate": {"type": "ComposedModel", "models": hit_list(model_names)},
            "predictor": _typed_block("ConstantExtrapolationPredictor", unknowns_SR2="stress"),
            "model": _typed_block("ImplicitUpdate", equation_system="equations", solver="newton", predictor="predictor"),
        },
        "EquationSystems": {
            "equations": _typed_block("NonlinearSystem", model="implicit_rate", unknowns="stress", residuals="stress_residual")
        },
        "Solvers": {"newton": _typed_block("Newton", linear_solver="lu"), "lu": {"type": "DenseLU"}},
    }


def _typed_block(type: str, **entries: str) -> dict[str, str]:
    """A block of a type with quoted entries."""
    return {"type": type, **{key: f"'{value}'" for key, value in entries.items()}}
