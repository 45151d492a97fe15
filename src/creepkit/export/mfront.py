"""MFront (TFEL 3.4 and later): the law as an implicit behaviour with its exact Jacobian.

The domain specific language is Implicit with the brick StandardElasticity, which adds Hooke's law, the split of the
strain, plane stress and the consistent tangent operator. Sources: documentation of the Implicit DSL, of its keywords
and of the brick, and the gallery's ImplicitNorton, https://thelfer.github.io/tfel/web.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import sympy

from creepkit.errors import ExportError
from creepkit.export.c_text import cpp_lambda_definition, comment_safe
from creepkit.export.heading import comment_lines, heading, printable_text
from creepkit.export.mfront_integrator import IntegratorBlock
from creepkit.language.elastic import Elastic
from creepkit.language.symbols import temperature
from creepkit.records import LawWithValues

_LINE_LENGTH = 120
_PREDICTOR_BLOCK = [
    "@Predictor {",
    "  // rates that are singular at zero strain need a first guess",
    "  if (p <= 0) {",
    "    dp = 1e-6;",
    "  }",
    "}",
]

_FORMULA_NODES = (sympy.Add, sympy.Mul, sympy.Pow, sympy.exp, sympy.log, sympy.Symbol, sympy.Number)
"""What the formulas of @ElasticMaterialProperties may hold."""


@dataclass(frozen=True)
class MfrontExporter:
    """An .mfront file; stress and time are in the units asked for, which are those of the solver."""

    name: str = "mfront"
    title: str = "MFront behaviour (Implicit DSL) with its exact Jacobian"
    suffix: str = ".mfront"

    def text(self, source: LawWithValues) -> str:
        """Return the file's text."""
        block_source = IntegratorBlock(source)
        sections = [
            list(_header(block_source)),
            list(_behaviour_declaration(block_source)),
            list(_mfront_elasticity(block_source.source)),
            list(_state_variables(block_source)),
            list(_parameters(block_source)),
            *([_PREDICTOR_BLOCK] if block_source.needs_strain else []),
            list(_integrator_block(block_source)),
        ]
        if block_source.needs_time:
            sections.append(["@UpdateAuxiliaryStateVariables {", f"  {block_source.elapsed} += dt;", "}"])
        return "\n\n".join("\n".join(section) for section in sections) + "\n"


def _header(behaviour: IntegratorBlock) -> Iterator[str]:
    units = behaviour.source.units
    header_lines = [
        *heading(behaviour.source, mentions_floors=True),
        *behaviour.renaming_notes(),
        "",
        f"Stress and Young's modulus are in {units.stress}, time in {units.time}, temperature in K.",
        "The creep strain p flows along the deviator of the stress; damage does not weaken the elasticity.",
        "The midpoint rule (theta = 0.5) is of second order; theta = 1 is of first order and damps more.",
        "Powers of time and strain stay finite at the start; if the rate falls steeply there, keep increments short.",
    ]
    if behaviour.needs_time:
        header_lines.append(f"Time is counted in {behaviour.elapsed} from the first increment on, where the loading begins.")
    for state, symbol in zip(behaviour.source.law.states.values(), behaviour.states, strict=True):
        if state.initial:
            header_lines.append(f"{symbol} holds the internal variable less its start, {state.initial!r}, and starts at 0.")
    return iter(comment_lines(header_lines, "//", _LINE_LENGTH))


def _behaviour_declaration(behaviour: IntegratorBlock) -> Iterator[str]:
    title = printable_text(behaviour.source.title).replace("\\", " ").replace('"', "'")
    yield "@DSL Implicit;"
    yield f"@Behaviour {behaviour.behaviour};"
    yield f'@Description{{ "{comment_safe(title)}, exported by creepkit" }}'
    yield ""
    yield '@ModellingHypotheses {".+"};'
    yield "@Brick StandardElasticity;"
    yield "@Algorithm NewtonRaphson;"
    yield "@Theta 0.5;"
    yield "@Epsilon 1e-14;"
    yield "@IterMax 100;"


def _mfront_elasticity(source: LawWithValues) -> Iterator[str]:
    """Numbers or formulas of the temperature where they are known, else properties that the solver gives."""
    if source.elastic is None:
        yield "@MaterialProperty stress young;"
        yield 'young.setGlossaryName("YoungModulus");'
        yield "@MaterialProperty real nu;"
        yield 'nu.setGlossaryName("PoissonRatio");'
    else:
        young, nu = _elastic_formulas(source.elastic, source.units.megapascals)
        yield f"@ElasticMaterialProperties {{{young}, {nu}}};"


def _elastic_formulas(elastic: Elastic, megapascals: float) -> tuple[str, str]:
    return _formula(sympy.sympify(elastic.E) / megapascals), _formula(sympy.sympify(elastic.nu))


def _formula(expression: sympy.Expr) -> str:
    """A number, or a formula of T in quotes."""
    if not expression.free_symbols:
        return repr(float(expression))
    unsupported = [node for node in sympy.preorder_traversal(expression) if not isinstance(node, _FORMULA_NODES)]
    if unsupported:
        raise ExportError(
            f"the elastic data hold {unsupported[0]}, which no formula of MFront can; export with Elastic at a temperature"
        )
    numbers = {n: sympy.Float(repr(float(n)), 17) for n in expression.atoms(sympy.Float)}
    text = sympy.sstr(expression.xreplace(numbers).xreplace({temperature: sympy.Symbol("T")}))
    return f'"{text}"'


def _state_variables(behaviour: IntegratorBlock) -> Iterator[str]:
    yield "@StateVariable strain p;"
    yield 'p.setGlossaryName("EquivalentViscoplasticStrain");'
    for symbol, state in zip(behaviour.states, behaviour.source.law.states.values(), strict=True):
        yield from comment_lines([state.meaning], f"@StateVariable real {symbol}; //")
        if state.limit is not None:
            span = state.limit - state.initial
            if span > 0:
                yield f"@PhysicalBounds {symbol} in ]*:{span!r}]; // where the material has failed"
            else:
                yield f"// the material has failed where {symbol} reaches {span!r}"
    if behaviour.needs_time:
        yield f"@AuxiliaryStateVariable real {behaviour.elapsed};"
        yield f'{behaviour.elapsed}.setEntryName("TimeUnderLoad");'


def _parameters(behaviour: IntegratorBlock) -> Iterator[str]:
    yield "// for stress as a ratio to 1 MPa and time to 1 s"
    table = behaviour.source.law.params.values()
    for (symbol, value), param in zip(behaviour.code.parameters.items(), table, strict=True):
        unit = "" if param.unit == "1" else f"{param.unit}, "
        yield from comment_lines([f"{unit}{param.meaning}"], f"@Parameter {symbol} = {value!r}; //")


def _integrator_block(behaviour: IntegratorBlock) -> Iterator[str]:
    parts = {
        "stable functions": [cpp_lambda_definition(name) for name in behaviour.stable_functions()],
        "stress and its direction, at t + theta dt": behaviour.tensor_lines(),
        "the point, in MPa and s": behaviour.point_lines(),
        "the law": behaviour.rate_lines(),
        "the implicit system": behaviour.residual_lines(),
        "its Jacobian": behaviour.jacobian_lines(),
    }
    yield "@Integrator {"
    for title, lines in parts.items():
        if lines:
            yield f"  // ---- {title}"
            yield from (f"  {line}" for line in lines)
    yield "}"
