"""NEML2 3.1: a material model whose flow rate is Perzyna's without a yield stress, which is Norton's law.

PerzynaPlasticFlowRate: rate = (f/reference_stress)^exponent. f is the von Mises stress itself here: NEML2's
YieldFunction would multiply it by sqrt(2/3). A sum has one flow rate a term; an activation energy makes the reference
stress an ArrheniusParameter. NEML2 3.1 has no creep law of strain, of time or of a hyperbolic sine.
"""

from __future__ import annotations

from dataclasses import dataclass

from creepkit.errors import ExportError
from creepkit.export.cards.blocks import Block, several, written
from creepkit.export.cards.forms import Form, forms_of
from creepkit.export.cards.text import figure, moduli, number, top
from creepkit.export.identifiers import Identifiers
from creepkit.language.symbols import GAS_CONSTANT
from creepkit.records import ValuedLaw

_INSTEAD = "export it as 'python', whose rate a flow rate of your own in NEML2 can follow"

_FORMULA = (
    "For NEML2 3.1. PerzynaPlasticFlowRate: rate = (s/reference_stress)^exponent, of the von Mises stress s, which "
    "stands in the place of the yield function. The model called `model` makes the stress of strain E and time t."
)

_ARRHENIUS = "Reference stresses: reference_value exp(-activation_energy/(R T)), T the input called temperature, in K."

_RESERVED = (
    *("mandel_stress", "vonmises", "flow", "normality", "flow_rate", "sum", "Eprate", "Erate", "Eerate", "elasticity"),
    *("integrate_stress", "implicit_rate", "predictor", "model", "temperature"),
)


@dataclass(frozen=True)
class Neml2Model:
    """An input file with [Models], [EquationSystems] and [Solvers]; needs the moduli."""

    name: str = "neml2"
    title: str = "NEML2 3.1 material model with Norton's law (PerzynaPlasticFlowRate)"
    suffix: str = ".i"

    def text(self, source: ValuedLaw) -> str:
        """Return the input file."""
        forms = forms_of(source, "NEML2 3.1", _INSTEAD)
        for form in forms:
            _check(source, form)
        names = Identifiers(_RESERVED)
        wanted = [form.label for form in forms]
        rates = _rates(source, dict(zip(names.names(wanted), forms, strict=True)))
        about = [_FORMULA, *([_ARRHENIUS] if any(f.Q for f in forms) else []), *names.told(wanted)]
        return "\n".join([*top(source, "#", about), *written(_file(rates, _elasticity(source)))]) + "\n"


def _check(source: ValuedLaw, form: Form) -> None:
    if not (form.shape == "power" and form.steady and form.n > 0.0):
        what = f"{form.shape} of stress, strain exponent {form.strain:g}, time exponent {form.time:g}"
        raise ExportError(
            f"law '{source.law.name}', term '{form.label}': NEML2 3.1 has steady power laws of stress only, "
            f"and this is a {what}; {_INSTEAD}"
        )


def _rates(source: ValuedLaw, forms: dict[str, Form]) -> dict[str, Block]:
    """The flow rate of each term, their reference stresses where these depend on temperature, and the sum."""
    blocks: dict[str, Block] = {}
    outputs = [f"{name}_rate" for name in forms] if len(forms) > 1 else ["flow_rate"]
    for (name, form), output in zip(forms.items(), outputs, strict=True):
        reference: str | float = number(-form.log_coefficient / form.n, "reference_stress", source)
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
        blocks["sum"] = {"type": "ScalarLinearCombination", "from": several(outputs), "to": "'flow_rate'"}
    return blocks


def _elasticity(source: ValuedLaw) -> Block:
    found = moduli(source)
    if not found:
        raise ExportError(
            f"law '{source.law.name}': a NEML2 model needs the moduli; give elastic=Elastic(E=150e3, nu=0.3)"
        )
    return {
        "type": "LinearIsotropicElasticity",
        "coefficients": several([figure(found[0].E), figure(found[0].nu)]),
        "coefficient_types": "'YOUNGS_MODULUS POISSONS_RATIO'",
        "rate_form": "true",
    }


def _file(rates: dict[str, Block], elasticity: Block) -> Block:
    """The whole file: the rates of strain and stress, integrated by backward Euler and solved for the stress."""
    first: dict[str, Block] = {
        "mandel_stress": {"type": "IsotropicMandelStress", "cauchy_stress": "'stress'"},
        "vonmises": _of("SR2Invariant", invariant_type="VONMISES", tensor="mandel_stress", invariant="yield_function"),
    }
    flow = _of("ComposedModel", models="vonmises")
    then: dict[str, Block] = {
        "normality": {
            **_of("Normality", model="flow", function="yield_function"),
            "from": "'mandel_stress'",
            "to": "'flow_direction'",
        },
        **rates,
        "Eprate": {"type": "AssociativePlasticFlow"},
        "Erate": _of("SR2VariableRate", variable="E"),
        "Eerate": {
            "type": "SR2LinearCombination",
            "from": "'E_rate plastic_strain_rate'",
            "to": "'strain_rate'",
            "weights": "'1 -1'",
        },
        "elasticity": elasticity,
        "integrate_stress": _of("SR2BackwardEulerTimeIntegration", variable="stress"),
    }
    parts = [name for name, block in (first | then).items() if block["type"] != "ArrheniusParameter"]
    return {
        "Models": {
            **first,
            "flow": flow,
            **then,
            "implicit_rate": {"type": "ComposedModel", "models": several(parts)},
            "predictor": _of("ConstantExtrapolationPredictor", unknowns_SR2="stress"),
            "model": _of("ImplicitUpdate", equation_system="equations", solver="newton", predictor="predictor"),
        },
        "EquationSystems": {
            "equations": _of("NonlinearSystem", model="implicit_rate", unknowns="stress", residuals="stress_residual")
        },
        "Solvers": {"newton": _of("Newton", linear_solver="lu"), "lu": {"type": "DenseLU"}},
    }


def _of(type: str, **entries: str) -> dict[str, str]:
    """A block of a type with quoted entries."""
    return {"type": type, **{key: f"'{value}'" for key, value in entries.items()}}
