"""The block @Integrator of an MFront behaviour: the law at t + theta dt, the residuals and their derivatives.

With the flow direction n = 3 s/(2 seq) of the deviator s and rate r(seq, p, ...) the system is
    feel = deel - deto + dp n,   fp = dp - dt r,   fw = dw - dt w'(seq, p, w, ...)   for each internal variable w.
Stresses at t + theta dt change with the elastic strain by d(seq) = 2 mu theta n, d(first principal stress) =
theta (lambda I + 2 mu n_1) with n_1 the dyad of its direction, d(mean stress) = theta (lambda + 2 mu/3) I.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import sympy

from creepkit.export.c_text import OWN_WORDS, assignments, helpers_in, text_of
from creepkit.export.c_words import C_RESERVED
from creepkit.export.identifiers import Identifiers
from creepkit.export.program import Function, Program
from creepkit.language.symbols import POINT, mean_stress, principal_stress, strain, stress, temperature, time
from creepkit.records import ValuedLaw

_RESERVED = """
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
values axes first normal rate dyad_0 dyad_1 dyad_2 Damage Porosity Temperature Strain Stress ElasticStrain
PlasticStrain ViscoplasticStrain EquivalentStrain EquivalentPlasticStrain EquivalentViscoplasticStrain
EquivalentStress YoungModulus PoissonRatio ShearModulus BulkModulus Pressure HydrostaticPressure GrainSize MassDensity
TimeUnderLoad
"""
"""Names that MFront or TFEL keep, entries of its glossary that a law may come upon, and this block's own names."""

_BY = {stress: "stress", principal_stress: "principal", mean_stress: "mean", strain: "strain"}
"""What a derivative of a rate is called after."""


class Integrator:
    """The names and statements of one law.

    behaviour : the class's name. states : MFront's names of internal variables. elapsed : that of the time under load.
    """

    def __init__(self, source: ValuedLaw) -> None:
        reduced = source.reduced()
        identifiers = Identifiers(C_RESERVED | OWN_WORDS | {*_RESERVED.split()} | _derived(reduced))
        self.behaviour = identifiers.name(source.name or source.law.name)
        self.elapsed = identifiers.name("elapsed")
        self.states = identifiers.names(s.name for s in reduced.law.states)
        called = {s.name: f"{s.name}_now" for s in (*POINT, *reduced.law.states)}
        self.program = Program(reduced, identifiers, called)
        self.source = self.program.source
        self._law, self._units = self.source.law, self.source.units

    @property
    def needs_time(self) -> bool:
        """Whether the law reads the time."""
        return self._law.uses(time)

    @property
    def needs_strain(self) -> bool:
        """Whether the law reads the creep strain."""
        return self._law.uses(strain)

    def renamed(self) -> list[str]:
        """One line for each name of the author's that MFront cannot keep."""
        named = dict(zip((s.name for s in self._law.states), self.states, strict=True))
        told = [f"'{old}' is called {new} here" for old, new in named.items() if old != new]
        own = [line for line in self.program.renamed() if not line.endswith("_now here")]
        return [*told, *(line for line in own if line not in told)]

    def helpers(self) -> list[str]:
        """The stable functions that the law calls."""
        return helpers_in(self.rates())

    # ---- the statements --------------------------------------------------------------------------------------------

    def tensors(self) -> list[str]:
        """The von Mises stress, the flow direction and, where needed, the first principal stress with its own."""
        lines = [
            "const auto seq = sigmaeq(sig);",
            "const auto inverse_seq = 1 / max(seq, real(1e-12) * young);",
            "const Stensor flow = 3 * deviator(sig) * inverse_seq / 2;",
            "const auto shear = computeMu(young, nu);",
        ]
        if self._law.uses(principal_stress) or self._law.uses(mean_stress):
            lines.append("const auto lame = computeLambda(young, nu);")
        if self._law.uses(principal_stress):
            lines += [
                "tfel::math::tvector<3u, stress> values;",
                "tfel::math::tmatrix<3u, 3u, real> axes;",
                "sig.computeEigenVectors(values, axes);",
                "Stensor dyad_0, dyad_1, dyad_2;",
                "Stensor::computeEigenTensors(dyad_0, dyad_1, dyad_2, axes);",
                "const int first = values[0] >= max(values[1], values[2]) ? 0 : (values[1] >= values[2] ? 1 : 2);",
                "const Stensor normal = first == 0 ? dyad_0 : (first == 1 ? dyad_1 : dyad_2);",
            ]
        return lines

    def point(self) -> list[str]:
        """The variables of the point and the internal ones at t + theta dt, in the law's own units."""
        megapascals, seconds = self._factor(self._units.megapascals), self._factor(self._units.seconds)
        texts = {
            stress: f"{megapascals}seq",
            strain: "p + theta * dp",
            time: f"{seconds}({self.elapsed} + theta * dt)" if seconds else f"{self.elapsed} + theta * dt",
            temperature: "T + theta * dT",
            principal_stress: f"{megapascals}values[first]",
            mean_stress: f"{megapascals}trace(sig) / 3",
        }
        pairs = list(zip(self.program.point, POINT, strict=True))
        lines = [f"const real {symbol} = {texts[own]};" for symbol, own in pairs if symbol in self._update.read]
        inner = zip(self.program.states, self.states, self._law.states.values(), strict=True)
        for symbol, name, state in inner:
            start = f"{state.initial!r} + " if state.initial else ""
            lines += [f"const real {symbol} = {start}{name} + theta * d{name};"] if symbol in self._update.read else []
        return lines

    def rates(self) -> list[str]:
        """The rate and each internal variable's, per unit of time, and what they change with."""
        program, update, scale = self.program, self._update, self._units.seconds
        logs = [f"const real {ln} = log({plain});" for ln, plain in program.logarithms_in(update).items()]
        lines = [*logs, *assignments(update.steps, "const real")]
        lines.append(f"const real rate = {self._factor(scale)}exp({text_of(update.outputs[0])});")
        for row, name in enumerate(self._rows[1:], 1):
            lines.append(f"const real {name} = {self._factor(scale)}({text_of(update.outputs[row])});")
        for row, name in enumerate(self._rows):
            for k, label in self._columns(row):
                weight = "rate * " if row == 0 else self._factor(scale)
                unit = self._factor(self._units.megapascals) if k in (0, 4, 5) else ""
                lines.append(f"const real {name}_by_{label} = {unit}{weight}({text_of(self._slope(row, k))});")
        return lines

    def residuals(self) -> list[str]:
        """The brick has set feel to deel - deto, the DSL every other residual to its increment."""
        inner = zip(self.states, self._rows[1:], strict=True)
        return ["feel += dp * flow;", "fp -= dt * rate;", *(f"f{name} -= dt * {rate};" for name, rate in inner)]

    def jacobian(self) -> list[str]:
        """The DSL has set the Jacobian to the identity."""
        lines = [
            "dfeel_ddeel += 2 * shear * theta * dp * inverse_seq * (Stensor4::M() - (flow ^ flow));",
            "dfeel_ddp = flow;",
        ]
        for row, (own, rate) in enumerate(zip(("p", *self.states), self._rows, strict=True)):
            found = dict(self._columns(row))
            tensor = [text.format(f"{rate}_by_{found[k]}") for k, text in _BY_STRAIN.items() if k in found]
            if tensor:
                lines.append(f"df{own}_ddeel = -theta * dt * ({' + '.join(tensor)});")
            for k, other in ((1, "p"), *enumerate(self.states, len(POINT))):
                if k in found:
                    sign = "-= " if other == own else "= -"
                    lines.append(f"df{own}_dd{other} {sign}theta * dt * {rate}_by_{found[k]};")
        return lines

    # ---- what they are made of -------------------------------------------------------------------------------------

    @cached_property
    def _update(self) -> Function:
        """The update entry without the columns of time and temperature, which are known."""
        full = self.program.function("update")
        rows, width = len(self._rows), len(POINT) + len(self.states)
        self._kept = [0, 1, 4, 5, *range(len(POINT), width)]
        return full.only([*range(rows), *(rows + row * width + k for row in range(rows) for k in self._kept)])

    @property
    def _rows(self) -> list[str]:
        return ["rate", *(f"{name}_rate" for name in self.states)]

    def _slope(self, row: int, column: int) -> sympy.Expr:
        outputs, rows = self._update.outputs, len(self._rows)
        return outputs[rows + row * len(self._kept) + self._kept.index(column)]

    def _columns(self, row: int) -> list[tuple[int, str]]:
        """The columns in which a rate has a derivative, and what they are called."""
        labels: Sequence[tuple[int, str]] = [
            *((POINT.index(s), label) for s, label in _BY.items()),
            *enumerate(self.states, len(POINT)),
        ]
        return [(k, label) for k, label in labels if self._slope(row, k) != 0]

    @staticmethod
    def _factor(factor: float) -> str:
        return "" if factor == 1 else f"{factor!r} * "


_BY_STRAIN = {
    0: "{} * 2 * shear * flow",
    4: "{} * (lame * Stensor::Id() + 2 * shear * normal)",
    5: "{} * (lame + 2 * shear / 3) * Stensor::Id()",
}
"""{column: derivative of a rate to the elastic strain through that stress, less theta}."""


def _derived(source: ValuedLaw) -> set[str]:
    """What MFront calls after an internal variable, and what this block does."""
    names = [f"{s.name}{more}" for s in source.law.states for more in ("", "_2")]
    ends = ("stress", "principal", "mean", "strain", *names)
    rates = ["rate", *(f"{name}_rate" for name in names)]
    derived = {f"{start}{name}" for name in names for start in ("d", "f", "delta_d")}
    return derived | {f"{rate}_by_{end}" for rate in rates for end in ends} | {*rates}
