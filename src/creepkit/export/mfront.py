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
from creepkit.export.c_text import cpp_lambda, safe
from creepkit.export.heading import comments, heading, printable
from creepkit.export.mfront_integrator import Integrator
from creepkit.language.elastic import Elastic
from creepkit.language.symbols import temperature
from creepkit.records import ValuedLaw

_WIDTH = 120
_PREDICTOR = [
    "@Predictor {",
    "  // rates that are singular at zero strain need a first guess",
    "  if (p <= 0) {",
    "    dp = 1e-6;",
    "  }",
    "}",
]

_FORMULA = (sympy.Add, sympy.Mul, sympy.Pow, sympy.exp, sympy.log, sympy.Symbol, sympy.Number)
"""What the formulas of @ElasticMaterialProperties may hold."""


@dataclass(frozen=True)
class MfrontExporter:
    """An .mfront file; stress and time are in the units asked for, which are those of the solver."""

    name: str = "mfront"
    title: str = "MFront behaviour (Implicit DSL) with its exact Jacobian"
    suffix: str = ".mfront"

    def text(self, source: ValuedLaw) -> str:
        """Return the file's text."""
        law = Integrator(source)
        blocks = [
            list(_head(law)),
            list(_scheme(law)),
            list(_elasticity(law.source)),
            list(_variables(law)),
            list(_parameters(law)),
            *([_PREDICTOR] if law.needs_strain else []),
            list(_integrator(law)),
        ]
        if law.needs_time:
            blocks.append(["@UpdateAuxiliaryStateVariables {", f"  {law.elapsed} += dt;", "}"])
        return "\n\n".join("\n".join(block) for block in blocks) + "\n"


def _head(law: Integrator) -> Iterator[str]:
    units = law.source.units
    told = [
        *heading(law.source, floors=True),
        *law.renamed(),
        "",
        f"Stress and Young's modulus are in {units.stress}, time in {units.time}, temperature in K.",
        "The creep strain p flows along the deviator of the stress; damage does not weaken the elasticity.",
        "The midpoint rule (theta = 0.5) is of second order; theta = 1 is of first order and damps more.",
        "Powers of time and strain stay finite at the start; if the rate falls steeply there, keep increments short.",
    ]
    if law.needs_time:
        told.append(f"Time is counted in {law.elapsed} from the first increment on, where the loading begins.")
    for state, symbol in zip(law.source.law.states.values(), law.states, strict=True):
        if state.initial:
            told.append(f"{symbol} holds the internal variable less its start, {state.initial!r}, and starts at 0.")
    return iter(comments(told, "//", _WIDTH))


def _scheme(law: Integrator) -> Iterator[str]:
    title = printable(law.source.title).replace("\\", " ").replace('"', "'")
    yield "@DSL Implicit;"
    yield f"@Behaviour {law.behaviour};"
    yield f'@Description{{ "{safe(title)}, exported by creepkit" }}'
    yield ""
    yield '@ModellingHypotheses {".+"};'
    yield "@Brick StandardElasticity;"
    yield "@Algorithm NewtonRaphson;"
    yield "@Theta 0.5;"
    yield "@Epsilon 1e-14;"
    yield "@IterMax 100;"


def _elasticity(source: ValuedLaw) -> Iterator[str]:
    """Numbers or formulas of the temperature where they are known, else properties that the solver gives."""
    if source.elastic is None:
        yield "@MaterialProperty stress young;"
        yield 'young.setGlossaryName("YoungModulus");'
        yield "@MaterialProperty real nu;"
        yield 'nu.setGlossaryName("PoissonRatio");'
    else:
        young, nu = _moduli(source.elastic, source.units.megapascals)
        yield f"@ElasticMaterialProperties {{{young}, {nu}}};"


def _moduli(elastic: Elastic, megapascals: float) -> tuple[str, str]:
    return _modulus(sympy.sympify(elastic.E) / megapascals), _modulus(sympy.sympify(elastic.nu))


def _modulus(expression: sympy.Expr) -> str:
    """A number, or a formula of T in quotes."""
    if not expression.free_symbols:
        return repr(float(expression))
    odd = [node for node in sympy.preorder_traversal(expression) if not isinstance(node, _FORMULA)]
    if odd:
        raise ExportError(
            f"the elastic data hold {odd[0]}, which no formula of MFront can; export with Elastic at a temperature"
        )
    numbers = {n: sympy.Float(repr(float(n)), 17) for n in expression.atoms(sympy.Float)}
    text = sympy.sstr(expression.xreplace(numbers).xreplace({temperature: sympy.Symbol("T")}))
    return f'"{text}"'


def _variables(law: Integrator) -> Iterator[str]:
    yield "@StateVariable strain p;"
    yield 'p.setGlossaryName("EquivalentViscoplasticStrain");'
    for symbol, state in zip(law.states, law.source.law.states.values(), strict=True):
        yield from comments([state.meaning], f"@StateVariable real {symbol}; //")
        if state.limit is not None:
            room = state.limit - state.initial
            if room > 0:
                yield f"@PhysicalBounds {symbol} in ]*:{room!r}]; // where the material has failed"
            else:
                yield f"// the material has failed where {symbol} reaches {room!r}"
    if law.needs_time:
        yield f"@AuxiliaryStateVariable real {law.elapsed};"
        yield f'{law.elapsed}.setEntryName("TimeUnderLoad");'


def _parameters(law: Integrator) -> Iterator[str]:
    yield "// for stress as a ratio to 1 MPa and time to 1 s"
    table = law.source.law.params.values()
    for (symbol, value), param in zip(law.program.parameters.items(), table, strict=True):
        unit = "" if param.unit == "1" else f"{param.unit}, "
        yield from comments([f"{unit}{param.meaning}"], f"@Parameter {symbol} = {value!r}; //")


def _integrator(law: Integrator) -> Iterator[str]:
    parts = {
        "stable functions": [cpp_lambda(name) for name in law.helpers()],
        "stress and its direction, at t + theta dt": law.tensors(),
        "the point, in MPa and s": law.point(),
        "the law": law.rates(),
        "the implicit system": law.residuals(),
        "its Jacobian": law.jacobian(),
    }
    yield "@Integrator {"
    for title, lines in parts.items():
        if lines:
            yield f"  // ---- {title}"
            yield from (f"  {line}" for line in lines)
    yield "}"
