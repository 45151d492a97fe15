"""MFront (TFEL 3.4 and later): the law as an implicit behaviour with its exact Jacobian.

The domain specific language is Implicit with the brick StandardElasticity, which adds Hooke's law, the split of the
strain, plane stress and the consistent tangent operator. Sources: documentation of the Implicit DSL, of its keywords
and of the brick, and the gallery's ImplicitNorton, https://thelfer.github.io/tfel/web.

With the flow direction n = 3 s/(2 seq) of the deviator s and rate r(seq, p, ...) the system is
    feel = deel - deto + dp n,   fp = dp - dt r,   fw = dw - dt w'(seq, p, w, ...)   for each internal variable w.
Stresses at t + theta dt change with the elastic strain by d(seq) = 2 mu theta n, d(first principal stress) =
theta (lambda I + 2 mu n_1) with n_1 the dyad of its direction, d(mean stress) = theta (lambda + 2 mu/3) I.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property

import sympy

from creepkit.errors import ExportError
from creepkit.exporters.c import (
    C_RESERVED,
    STABLE_FUNCTION_NAMES,
    c_assignments,
    c_expression,
    cpp_lambda_definition,
    stable_functions_in,
)
from creepkit.exporters.creep_forms import elastic_expressions
from creepkit.exporters.law_code import CodeFunction, Identifiers, LawCode, factor_text
from creepkit.exporters.law_description import comment_lines, comment_safe, heading, printable_text
from creepkit.hookspecs import hookimpl
from creepkit.language.symbols import (
    POINT_VARIABLES,
    State,
    mean_stress,
    principal_stress,
    strain,
    stress,
    temperature,
    time,
)
from creepkit.records import Exporter, LawWithValues

_MFRONT_RESERVED = """
D Dt D_tdt N Type T dT dt t theta epsilon iterMax eel deel feel eto deto sig young nu lambda mu young_tdt nu_tdt
lambda_tdt mu_tdt p dp fp delta_dp delta_deel smt smflag zeros fzeros tzeros zeros_1 delta_zeros jacobian njacobian
jacobian_invert partial_jacobian vect_e error error_1 error_p iter converged idx idx2 idx3 hypothesis policy
policy_value errno integrate use_qt src1 src2 real stress strain time temperature length frequency strainrate
stressrate force displacement energy energydensity massdensity speed thermalexpansion thermalconductivity inv_length
ushort size_type Stensor Stensor4 StressStensor StrainStensor StiffnessTensor TVector Tensor Types F0 F1 F K Psi_s
Psi_d A0 behaviourData TangentOperator dl_l0 dl_l1 dl01_l0 dl0_l0 dl1_l0 alpha_Ti alpha_T_t time_scaling_factor tfel
math material utilities exception glossary string cout cerr endl sigmaeq deviator trace eval power
perturbatedSystemEvaluation numerical_jacobian_epsilon maximum_increment_value_per_iteration
jacobianComparisonCriterion etozz detozz sigzz computeMu computeLambda mfront_errno minimal_time_step_scaling_factor
maximal_time_step_scaling_factor current_time_step_scaling_factor v_sound rho_m0 seq inverse_seq flow shear lame
values axes first normal principal_slope time_power rate dyad_0 dyad_1 dyad_2 Damage Porosity Temperature Strain
Stress ElasticStrain PlasticStrain ViscoplasticStrain EquivalentStrain EquivalentPlasticStrain
EquivalentViscoplasticStrain EquivalentStress YoungModulus PoissonRatio ShearModulus BulkModulus Pressure
HydrostaticPressure GrainSize MassDensity TimeUnderLoad
"""
"""Names that MFront or TFEL keep, entries of its glossary that a law may come upon, and this block's own names."""


_DERIVATIVE_NAMES = {stress: "stress", principal_stress: "principal", mean_stress: "mean", strain: "strain"}
"""{variable: how the name of a derivative to it ends}."""


class IntegratorBlock:
    """The names and statements of one law.

    behaviour : the class's name. states : MFront's names of internal variables. elapsed : that of the time under load.
    """

    def __init__(self, source: LawWithValues) -> None:
        reduced = source.without_inactive_terms()
        identifiers = Identifiers(
            C_RESERVED | STABLE_FUNCTION_NAMES | {*_MFRONT_RESERVED.split()} | _derived_names(reduced)
        )
        self.behaviour = identifiers.unique(source.name or source.law.name)
        self.elapsed = identifiers.unique("elapsed")
        self.states = identifiers.unique_names(s.name for s in reduced.law.states)
        self.conditions = identifiers.unique_names(s.name for s in reduced.law.conditions)
        variable = (*POINT_VARIABLES, *reduced.law.states, *reduced.law.conditions)
        target_names = {s.name: f"{s.name}_now" for s in variable}
        self.code = LawCode(reduced, identifiers, target_names)
        self.source, self.law, self._units = self.code.source, self.code.law, source.units

    def renaming_notes(self) -> list[str]:
        """One line for each name of the author's that MFront cannot keep."""
        pairs = zip((*self.law.states, *self.law.conditions), (*self.states, *self.conditions), strict=True)
        notes = [f"'{old}' is called {new} here" for old, new in pairs if old.name != new]
        variables = {*self.law.names, *(s.name for s in POINT_VARIABLES)}
        return [*notes, *(line for line in self.code.identifiers.renaming_notes(variables) if line not in notes)]

    # ---- the statements --------------------------------------------------------------------------------------------

    def tensor_lines(self) -> list[str]:
        """The von Mises stress, the flow direction and, where needed, the first principal stress with its own."""
        lines = [
            "const auto seq = sigmaeq(sig);",
            "const auto inverse_seq = 1 / max(seq, real(1e-12) * young);",
            "const Stensor flow = 3 * deviator(sig) * inverse_seq / 2;",
            "const auto shear = computeMu(young, nu);",
        ]
        if self.law.uses(principal_stress) or self.law.uses(mean_stress):
            lines.append("const auto lame = computeLambda(young, nu);")
        if self.law.uses(principal_stress):
            lines += [
                "tfel::math::tvector<3u, stress> values;",
                "tfel::math::tmatrix<3u, 3u, real> axes;",
                "sig.computeEigenVectors(values, axes);",
                "Stensor dyad_0, dyad_1, dyad_2;",
                "Stensor::computeEigenTensors(dyad_0, dyad_1, dyad_2, axes);",
                "const int first = values[0] >= max(values[1], values[2]) ? 0 : (values[1] >= values[2] ? 1 : 2);",
                "const Stensor normal = first == 0 ? dyad_0 : (first == 1 ? dyad_1 : dyad_2);",
                # a tensor of its own: of the expression g++ -O2 loses the second part in the Jacobian
                "const Stensor principal_slope = lame * Stensor::Id() + 2 * shear * normal;",
            ]
        return lines

    def point_lines(self) -> list[str]:
        """The variables of the point and the internal ones at t + theta dt, in the law's own units."""
        megapascals, seconds = factor_text(self._units.megapascals), factor_text(self._units.seconds)
        texts = {
            stress: f"{megapascals}seq",
            strain: "p + theta * dp",
            time: f"{seconds}{self._time_text}",
            temperature: "T + theta * dT",
            principal_stress: f"{megapascals}values[first]",
            mean_stress: f"{megapascals}trace(sig) / 3",
        }
        values = {symbol: texts[variable] for symbol, variable in zip(self.code.point, POINT_VARIABLES, strict=True)}
        for symbol, name, state in zip(self.code.states, self.states, self.law.states.values(), strict=True):
            values[symbol] = f"{f'{state.initial!r} + ' if state.initial else ''}{name} + theta * d{name}"
        power = f"const real time_power = {c_expression(self.time_power)};"
        values |= {s: f"{n} + theta * d{n}" for s, n in zip(self.code.conditions, self.conditions, strict=True)}
        lines = [f"const real {s} = {text};" for s, text in values.items() if s in self._update_function.inputs]
        return [power, *lines] if self.time_power != 0 and self.law.uses(time) else lines

    @cached_property
    def time_power(self) -> sympy.Expr:
        """The exponent of time at which the law is singular at time zero, 0 where it is not."""
        values = {ln: sympy.log(self.code.parameters[symbol]) for ln, symbol in self.code.logarithms.items()}
        powers = [power for (power, _), _ in self.code.leading_exponents()]
        lowest = min(powers, key=lambda power: float(power.subs(values | self.code.parameters)))
        return lowest if float(lowest.subs(values | self.code.parameters)) < 0 else sympy.S.Zero

    @property
    def _time_text(self) -> str:
        """The time whose power is the mean of that power over the increment; else that at t + theta dt."""
        start, middle = self.elapsed, f"({self.elapsed} + theta * dt)"
        if self.time_power == 0:
            return middle
        mean = f"(pow({start} + dt, 1 + time_power) - pow({start}, 1 + time_power)) / ((1 + time_power) * dt)"
        return f"(dt > 0 && fabs(time_power) > 1e-3 ? pow({mean}, 1 / time_power) : {middle})"

    def rate_lines(self) -> list[str]:
        """The rate and each internal variable's, per unit of time, and what they change with."""
        code, update, time_factor = self.code, self._update_function, self._units.seconds
        logs = [f"const real {ln} = log({plain});" for ln, plain in code.logarithms_used(update).items()]
        lines = [*logs, *c_assignments(update.assignments, "const real")]
        for row, name in enumerate(self._rate_names):
            text = f"{'' if row else 'exp'}({c_expression(update.outputs[row])})"
            lines.append(f"const real {name} = {factor_text(time_factor)}{text};")
        for row, name in enumerate(self._rate_names):
            weight = factor_text(time_factor) if row else "rate * "
            for k, label in self._derivative_columns(row):
                unit = factor_text(self._units.megapascals) if k in (0, 4, 5) else ""
                text = c_expression(self._derivative(row, k))
                lines.append(f"const real {name}_by_{label} = {unit}{weight}({text});")
        return lines

    def jacobian_lines(self) -> list[str]:
        """The DSL has set the Jacobian to the identity."""
        lines = [
            "dfeel_ddeel += 2 * shear * theta * dp * inverse_seq * (Stensor4::M() - (flow ^ flow));",
            "dfeel_ddp = flow;",
        ]
        for row, (variable, rate) in enumerate(zip(("p", *self.states), self._rate_names, strict=True)):
            slopes = {k: f"{rate}_by_{label}" for k, label in self._derivative_columns(row)}
            tensor = [text.format(slopes[k]) for k, text in _ELASTIC_STRAIN_DERIVATIVES.items() if k in slopes]
            if tensor:
                lines.append(f"df{variable}_ddeel = -theta * dt * ({' + '.join(tensor)});")
            for k, other in ((1, "p"), *enumerate(self.states, len(POINT_VARIABLES))):
                if k in slopes:
                    sign = "-= " if other == variable else "= -"
                    lines.append(f"df{variable}_dd{other} {sign}theta * dt * {slopes[k]};")
        return lines

    # ---- what they are made of -------------------------------------------------------------------------------------

    @cached_property
    def _update_function(self) -> CodeFunction:
        """The update entry without the columns of time and temperature, which are known."""
        full = self.code.function("update")
        rows, width = len(self._rate_names), len(POINT_VARIABLES) + len(self.states)
        self._kept_columns = [0, 1, 4, 5, *range(len(POINT_VARIABLES), width)]
        return full.with_outputs(
            [*range(rows), *(rows + row * width + k for row in range(rows) for k in self._kept_columns)]
        )

    @property
    def _rate_names(self) -> list[str]:
        return ["rate", *(f"{name}_rate" for name in self.states)]

    def _derivative(self, row: int, column: int) -> sympy.Expr:
        outputs, rows = self._update_function.outputs, len(self._rate_names)
        return outputs[rows + row * len(self._kept_columns) + self._kept_columns.index(column)]

    def _derivative_columns(self, row: int) -> list[tuple[int, str]]:
        """The columns in which a rate has a derivative, and what they are called."""
        labels: Sequence[tuple[int, str]] = [
            *((POINT_VARIABLES.index(s), label) for s, label in _DERIVATIVE_NAMES.items()),
            *enumerate(self.states, len(POINT_VARIABLES)),
        ]
        return [(k, label) for k, label in labels if self._derivative(row, k) != 0]


_ELASTIC_STRAIN_DERIVATIVES = {
    0: "{} * 2 * shear * flow",
    4: "{} * principal_slope",
    5: "{} * (lame + 2 * shear / 3) * Stensor::Id()",
}
"""{column: derivative of a rate to the elastic strain through that stress, less theta}."""


def _derived_names(source: LawWithValues) -> set[str]:
    """What MFront calls after an internal variable, and what this block does."""
    names = [f"{s.name}{more}" for s in source.law.states for more in ("", "_2")]
    ends = ("stress", "principal", "mean", "strain", *names)
    rates = ["rate", *(f"{name}_rate" for name in names)]
    derived = {f"{start}{name}" for name in names for start in ("d", "f", "delta_d")}
    return derived | {f"{rate}_by_{end}" for rate in rates for end in ends} | {*rates}


_LINE_LENGTH = 120


_PREDICTOR_BLOCK = [
    "@Predictor {",
    "  // rates that are singular at zero strain need a first guess",
    "  if (p <= 0) {",
    "    dp = 1e-6;",
    "  }",
    "}",
]


_CONVERGENCE_BLOCK = [
    "@AdditionalConvergenceChecks {",
    "  // residuals of long increments round at more than epsilon: it ends where corrections change nothing, too",
    "  const real size = norm(zeros);",
    "  converged = converged || (iter > 1 && error < 1e-8 * size && norm(delta_zeros) < 1e-14 * size);",
    "}",
]


def _increment_block(behaviour: IntegratorBlock) -> Iterator[str]:
    """Increments that are given back: in which the material ruptures, or the midpoint rule overshoots."""
    yield "@APosterioriTimeStepScalingFactor {"
    for name, state in zip(behaviour.states, behaviour.law.states.values(), strict=True):
        if state.limit is not None:
            yield f"  if ({_is_broken(name, state)}) throw OutOfBoundsException({_rupture_text(name)});"
    yield "  // the midpoint rule overshoots where creep takes more than a fifth of the stress"
    yield "  const StrainStensor start = eel - deel;"
    yield "  const bool relaxes = sigmaeq(eel) < 0.8 * sigmaeq(start) && 3 * dp > 0.4 * sigmaeq(start);"
    yield "  if (theta < 1 && relaxes) return {false, real(1) / 2};"
    yield "}"


_FORMULA_NODES = (sympy.Add, sympy.Mul, sympy.Pow, sympy.exp, sympy.log, sympy.Symbol, sympy.Number)
"""What the formulas of @ElasticMaterialProperties may hold."""


class MfrontExporter:
    """An .mfront file; stress and time are in the units asked for, which are those of the solver."""

    serves = ("umat", "vumat", "usermat", "usercreep")
    name = "mfront"
    title = "MFront behaviour (Implicit DSL) with its exact Jacobian"
    suffix = ".mfront"

    def text(self, source: LawWithValues) -> str:
        """Return the file's text."""
        behaviour = IntegratorBlock(source)
        sections = [
            list(_header(behaviour)),
            list(_behaviour_declaration(behaviour)),
            list(_mfront_elasticity(behaviour.source)),
            list(_state_variables(behaviour)),
            list(_parameters(behaviour)),
            *([_PREDICTOR_BLOCK] if behaviour.law.uses(strain) else []),
            list(_integrator_block(behaviour)),
            _CONVERGENCE_BLOCK,
            list(_increment_block(behaviour)),
        ]
        if behaviour.law.uses(time):
            sections.append(["@UpdateAuxiliaryStateVariables {", f"  {behaviour.elapsed} += dt;", "}"])
        return "\n\n".join("\n".join(section) for section in sections) + "\n"


def _header(behaviour: IntegratorBlock) -> Iterator[str]:
    units = behaviour.source.units
    header_lines = [
        *heading(behaviour.source, mentions_floors=True),
        *behaviour.renaming_notes(),
        "",
        f"Stress and Young's modulus are in {units.stress}, time in {units.time}, temperature in K.",
        "The creep strain p flows along the deviator of the stress; damage does not weaken the elasticity.",
        "The midpoint rule (theta = 0.5) is of second order. It overshoots where the stress relaxes much, so that an "
        "increment in which creep takes more than a fifth of it is given back, to be halved. A code that does not "
        "halve increments needs short ones, or @Theta 1 (first order).",
        "Powers of strain stay finite at the start; if the rate falls steeply there, keep increments short.",
        "Behaviours of one name in one folder of MFront replace each other: give each material a name of its own, "
        "--name in a command, ck.law_with_values(..., name=...).",
    ]
    if behaviour.law.uses(time):
        header_lines.append(
            f"Time is counted in {behaviour.elapsed} from the first increment on, where the loading begins; a power "
            "of it that is infinite there is integrated over the increment."
        )
    for state, symbol in zip(behaviour.law.states.values(), behaviour.states, strict=True):
        if state.initial:
            header_lines.append(
                f"{symbol} holds the internal variable less its start, {state.initial!r}, and starts at 0."
            )
    return iter(comment_lines(header_lines, "//", _LINE_LENGTH))


def _behaviour_declaration(behaviour: IntegratorBlock) -> Iterator[str]:
    title = printable_text(behaviour.source.title).replace("\\", " ").replace('"', "'")
    yield from ("@DSL Implicit;", f"@Behaviour {behaviour.behaviour};")
    yield from (f'@Description{{ "{comment_safe(title)}, exported by creepkit" }}', "")
    yield from ('@ModellingHypotheses {".+"};', "@Brick StandardElasticity;", "@Algorithm NewtonRaphson;")
    yield from ("@Theta 0.5;", "@Epsilon 1e-14;", "@IterMax 100;")


def _mfront_elasticity(source: LawWithValues) -> Iterator[str]:
    """Numbers or formulas of the temperature where they are known, else properties that the solver gives."""
    if source.elastic is None:
        yield "@MaterialProperty stress young;"
        yield 'young.setGlossaryName("YoungModulus");'
        yield "@MaterialProperty real nu;"
        yield 'nu.setGlossaryName("PoissonRatio");'
    else:
        young, nu = map(_formula, elastic_expressions(source, source.elastic, "T"))
        yield f"@ElasticMaterialProperties {{{young}, {nu}}};"


def _formula(expression: sympy.Expr) -> str:
    """A number, or a formula of T in quotes."""
    if not expression.free_symbols:
        return repr(float(expression))
    unsupported = [node for node in sympy.preorder_traversal(expression) if not isinstance(node, _FORMULA_NODES)]
    if unsupported:
        raise ExportError(
            f"the elastic data hold {unsupported[0]}, which no formula of MFront can; "
            "export with Elastic at a temperature"
        )
    numbers = {n: sympy.Float(repr(float(n)), 17) for n in expression.atoms(sympy.Float)}
    return f'"{sympy.sstr(expression.xreplace(numbers))}"'


def _state_variables(behaviour: IntegratorBlock) -> Iterator[str]:
    yield "@StateVariable strain p;"
    yield 'p.setGlossaryName("EquivalentViscoplasticStrain");'
    for symbol, state in zip(behaviour.states, behaviour.law.states.values(), strict=True):
        yield from comment_lines([state.meaning], f"@StateVariable real {symbol}; //", 0)
        if state.limit is not None:
            span = state.limit - state.initial
            if span > 0:
                yield f"@PhysicalBounds {symbol} in ]*:{span!r}]; // where the material has failed"
            else:
                yield f"// the material has failed where {symbol} reaches {span!r}"
    for name, condition in zip(behaviour.conditions, behaviour.law.conditions, strict=True):
        yield f"@ExternalStateVariable real {name}; // {comment_safe(condition.unit)}"
    if behaviour.law.uses(time):
        yield f"@AuxiliaryStateVariable real {behaviour.elapsed};"
        yield f'{behaviour.elapsed}.setEntryName("TimeUnderLoad");'


def _parameters(behaviour: IntegratorBlock) -> Iterator[str]:
    yield "// for stress as a ratio to 1 MPa and time to 1 s"
    table = behaviour.law.params.values()
    for (symbol, value), param in zip(behaviour.code.parameters.items(), table, strict=True):
        unit = "" if param.unit == "1" else f"{param.unit}, "
        yield from comment_lines([f"{unit}{param.meaning}"], f"@Parameter {symbol} = {value!r}; //", 0)
        low, high = param.bounds
        if low <= value <= high:
            yield f"@Bounds {symbol} in [{low!r}:{high!r}];"
    if covered := behaviour.source.ranges.get("temperature"):
        yield f"@Bounds T in [{covered[0]!r}:{covered[1]!r}]; // of the tests"


def _is_broken(value: str, state: State) -> str:
    """The condition that a state, less its start, has not stayed within its limit; a NaN has not."""
    span = float(state.limit or 0.0) - state.initial
    return f"!({value} {'<' if span > 0 else '>'} {span!r})"


def _rupture_text(name: str) -> str:
    return f'"the material ruptures: {name} reaches its limit within this increment"'


def _integrator_block(behaviour: IntegratorBlock) -> Iterator[str]:
    # the brick has set feel to deel - deto, the DSL every other residual to its increment
    state_residuals = [f"f{name} -= dt * {name}_rate;" for name in behaviour.states]
    ends = [
        f"if (iter + 1 == iterMax && {_is_broken(f'{name} + dt * {name}_rate', state)}) "
        f"throw OutOfBoundsException({_rupture_text(name)});"
        for name, state in zip(behaviour.states, behaviour.law.states.values(), strict=True)
        if state.limit is not None
    ]
    parts = {
        "stable functions": [cpp_lambda_definition(name) for name in stable_functions_in(behaviour.rate_lines())],
        "stress and its direction, at t + theta dt": behaviour.tensor_lines(),
        "the point, in MPa and s": behaviour.point_lines(),
        "the law": behaviour.rate_lines(),
        "where the last iteration has no solution": ends,
        "the implicit system": ["feel += dp * flow;", "fp -= dt * rate;", *state_residuals],
        "its Jacobian": behaviour.jacobian_lines(),
    }
    yield "@Integrator {"
    for title, lines in parts.items():
        if lines:
            yield f"  // ---- {title}"
            yield from (f"  {line}" for line in lines)
    yield "}"


@hookimpl
def creepkit_exporters() -> list[Exporter]:
    """The exporter of this module."""
    return [MfrontExporter()]
