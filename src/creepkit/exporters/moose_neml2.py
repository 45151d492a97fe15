"""MOOSE and NEML2, whose input files share the HIT format: power-law creep as blocks.

MOOSE, solid mechanics module, PowerLawCreepStressUpdate, one a term: rate = coefficient s^n_exponent
exp(-activation_energy/(gas_constant T)) (t - start_time)^m_exponent; its m_exponent is an exponent of time.

NEML2 3.1, PerzynaPlasticFlowRate without a yield stress: rate = (f/reference_stress)^exponent. f is the von Mises
stress itself here: NEML2's YieldFunction would multiply it by sqrt(2/3). A sum has one flow rate a term; an activation
energy makes the reference stress an ArrheniusParameter. NEML2 3.1 has no creep law of strain, of time or of a
hyperbolic sine.
"""

from __future__ import annotations

import keyword
from collections.abc import Mapping, Sequence

from creepkit.errors import ExportError
from creepkit.exporters.creep_forms import CodeInput, CreepForm, constant_elasticity, exp_in_range, format_number
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


_MOOSE_FORMULA = (
    "PowerLawCreepStressUpdate: rate = coefficient s^n_exponent exp(-activation_energy/(gas_constant T)) "
    "(t - start_time)^m_exponent, of equivalent stress s; ComputeMultipleInelasticStress adds the models. "
    "t is the analysis time: start_time is when the load begins. It takes strain = FINITE, or incremental = true."
)


_MOOSE_RESERVED = ("stress", "elasticity")


class MooseBlock(CodeInput):
    """[Materials] with power-law creep, elasticity where moduli are given, and the stress that joins them.

    A variable called `temperature` must exist where the law depends on temperature.
    """

    code, marker = "MOOSE", "#"
    alternative = "export it as 'mfront', whose Abaqus interface AbaqusUMATStress calls"
    name = "moose"
    title = "MOOSE [Materials] block of power-law creep (PowerLawCreepStressUpdate)"
    suffix = ".i"

    def content(self, source: LawWithValues, forms: Sequence[CreepForm]) -> tuple[list[str], list[str]]:
        """Comments and the block."""
        for form in forms:
            if form.stress_function != "power" or form.strain_exponent:
                part = f"{form.stress_function} of stress"
                if form.stress_function == "power":
                    part = f"power {form.strain_exponent:g} of creep strain"
                reason = f"MOOSE has no creep model for its {part} (its m_exponent is one of time)"
                raise self.refusal(source, f", term '{form.label}': {reason}")
        names = Identifiers(_MOOSE_RESERVED)
        labels = names.unique_names(form.label for form in forms)
        models = {
            name: _moose_creep_model(source, form, name if len(forms) > 1 else "")
            for name, form in zip(labels, forms, strict=True)
        }
        moduli = constant_elasticity(source)
        elasticity: dict[str, HitBlock] = (
            {}
            if moduli is None
            else {
                "elasticity": {
                    "type": "ComputeIsotropicElasticityTensor",
                    "youngs_modulus": moduli.E,
                    "poissons_ratio": moduli.nu,
                }
            }
        )
        stress_block: HitBlock = {"type": "ComputeMultipleInelasticStress", "inelastic_models": hit_list(labels)}
        notes = ["The variable called temperature must be in K."] if any(form.Q for form in forms) else []
        comments = [_MOOSE_FORMULA, *notes, *names.renaming_notes([form.label for form in forms])]
        return comments, hit_lines({"Materials": {**elasticity, **models, "stress": stress_block}})


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


_NEML2_FORMULA = (
    "For NEML2 3.1. PerzynaPlasticFlowRate: rate = (s/reference_stress)^exponent, of the von Mises stress s, which "
    "stands in the place of the yield function. The model called `model` makes the stress of strain E and time t."
)


_NEML2_ARRHENIUS = (
    "Reference stresses: reference_value exp(-activation_energy/(R T)), T the input called temperature, in K."
)


_NEML2_RESERVED = (
    *("mandel_stress", "vonmises", "flow", "normality", "flow_rate", "sum", "Eprate", "Erate", "Eerate", "elasticity"),
    *("integrate_stress", "implicit_rate", "predictor", "model", "temperature", "E", "t", "stress", "yield_function"),
    *("flow_direction", "E_rate", "strain_rate", "plastic_strain_rate", "stress_rate", "stress_residual", "equations"),
    *("newton", "lu", *keyword.kwlist, *keyword.softkwlist),
)
"""Blocks and variables of the file itself, and words of Python, in whose expressions NEML2 takes names."""


class Neml2Model(CodeInput):
    """An input file with [Models], [EquationSystems] and [Solvers]; needs the moduli."""

    code, marker = "NEML2 3.1", "#"
    alternative = "export it as 'python', whose rate a flow rate of your own in NEML2 can follow"
    name = "neml2"
    title = "NEML2 3.1 material model with Norton's law (PerzynaPlasticFlowRate)"
    suffix = ".i"

    def content(self, source: LawWithValues, forms: Sequence[CreepForm]) -> tuple[list[str], list[str]]:
        """Comments and the input file."""
        for form in forms:
            if not (form.stress_function == "power" and form.is_steady and form.n > 0.0):
                exponents = f"strain exponent {form.strain_exponent:g}, time exponent {form.time_exponent:g}"
                reason = (
                    f"NEML2 3.1 has steady power laws of stress only, and this is a {form.stress_function} of stress"
                )
                raise self.refusal(source, f", term '{form.label}': {reason}, {exponents}")
        names, labels = Identifiers(_NEML2_RESERVED), [form.label for form in forms]
        unique = [names.unique(label, ("_rate", "_stress")) for label in labels]
        rates = _flow_rate_blocks(source, dict(zip(unique, forms, strict=True)))
        arrhenius = [_NEML2_ARRHENIUS] if any(f.Q for f in forms) else []
        comments = [_NEML2_FORMULA, *arrhenius, *names.renaming_notes(labels)]
        return comments, hit_lines(_neml2_file(rates, _neml2_elasticity(source)))


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
            f"law '{source.law.name}': a NEML2 model needs the moduli; give "
            "export(..., elastic=ck.Elastic(E=150e3, nu=0.3)), in a command --modulus-gpa"
        )
    coefficients = f"{format_number(moduli.E)} {format_number(moduli.nu)}"
    types = "YOUNGS_MODULUS POISSONS_RATIO"
    block = _typed_block("LinearIsotropicElasticity", coefficients=coefficients, coefficient_types=types)
    return {**block, "rate_form": "true"}


def _neml2_file(rates: dict[str, HitBlock], elasticity: HitBlock) -> HitBlock:
    """The whole file: the rates of strain and stress, integrated by backward Euler and solved for the stress."""
    stress_blocks: dict[str, HitBlock] = {
        "mandel_stress": _typed_block("IsotropicMandelStress", cauchy_stress="stress"),
        "vonmises": _typed_block(
            "SR2Invariant", invariant_type="VONMISES", tensor="mandel_stress", invariant="yield_function"
        ),
    }
    from_mandel = {"from": "mandel_stress", "to": "flow_direction"}
    from_strain = {"from": "E_rate plastic_strain_rate", "to": "strain_rate", "weights": "1 -1"}
    rate_blocks: dict[str, HitBlock] = {
        "normality": _typed_block("Normality", model="flow", function="yield_function", **from_mandel),
        **rates,
        "Eprate": {"type": "AssociativePlasticFlow"},
        "Erate": _typed_block("SR2VariableRate", variable="E"),
        "Eerate": _typed_block("SR2LinearCombination", **from_strain),
        "elasticity": elasticity,
        "integrate_stress": _typed_block("SR2BackwardEulerTimeIntegration", variable="stress"),
    }
    model_names = [
        name for name, block in (stress_blocks | rate_blocks).items() if block["type"] != "ArrheniusParameter"
    ]
    return {
        "Models": {
            **stress_blocks,
            "flow": _typed_block("ComposedModel", models="vonmises"),
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
