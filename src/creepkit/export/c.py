"""C: one file of C99 that needs math.h alone, with the rate, its logarithm with derivatives, and internal variables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import sympy

from creepkit.export.c_text import OWN_WORDS, assignments, block_comment, c_function, helpers_in, safe, text_of
from creepkit.export.c_words import C_RESERVED
from creepkit.export.heading import comments, heading, printable
from creepkit.export.identifiers import Identifiers
from creepkit.export.program import Function, Program
from creepkit.language.symbols import POINT, mean_stress, principal_stress, stress, time
from creepkit.records import ValuedLaw

_WIDTH = 120


@dataclass(frozen=True)
class CExporter:
    """A C file: NAME_rate, NAME_log_rate with slopes and, for laws with internal variables, NAME_state_rates."""

    name: str = "c"
    title: str = "C99 file with the rate and its derivatives"
    suffix: str = ".c"

    def text(self, source: ValuedLaw) -> str:
        """Return the file's text; stress and time are converted on entry, rates on exit."""
        return _File(source).text()


class _File:
    """One law as C."""

    def __init__(self, source: ValuedLaw) -> None:
        identifiers = Identifiers(C_RESERVED | OWN_WORDS | {"rates", "slopes"})
        self.prefix = identifiers.name(source.name or source.law.name)
        identifiers.names(f"{self.prefix}_{end}" for end in ("rate", "log_rate", "state_rates", "initial", "limit"))
        self.program = Program(source, identifiers)
        self.source, self.law, self.units = self.program.source, self.program.law, source.units
        used = [k for k, s in enumerate(POINT) if s == stress or self.law.uses(s)]
        self.columns = [*used, *(len(POINT) + k for k in range(len(self.law.states)))]
        everything = (*self.program.point, *self.program.states)
        self.arguments = [everything[k] for k in self.columns]
        scales = dict.fromkeys((stress, principal_stress, mean_stress), self.units.megapascals)
        scales[time] = self.units.seconds
        self.scales = [scales.get(s, 1.0) for s in (*POINT, *self.law.states)]
        self.rate, self.update = self.program.function("rate").only([0]), self.program.function("update")

    def text(self) -> str:
        """The whole file."""
        functions = [self._rate(), self._log_rate(), *([self._state_rates()] if self.law.states else [])]
        helpers = [c_function(name) for name in helpers_in([line for body in functions for line in body])]
        blocks = [
            self._head(),
            ["#include <math.h>"],
            ["/* The parameters, for stress as a ratio to 1 MPa and time to 1 s. */", *self._parameters()],
            *([self._starts()] if self.law.states else []),
            *([helpers] if helpers else []),
            *functions,
        ]
        return "\n\n".join("\n".join(block) for block in blocks) + "\n"

    # ---- what is told ----------------------------------------------------------------------------------------------

    def _head(self) -> list[str]:
        floors = any("log_floor" in line or "floored" in line for line in (*self._rate(), *self._log_rate()))
        told = [*heading(self.source, floors=floors), *self.program.renamed(), "A result beyond 1.8e308 is INFINITY."]
        declared = [
            "",
            "Declarations for the code that calls this file (exported by creepkit; link with -lm):",
            f"  {self._declaration('double', 'rate')};",
            f"  {self._declaration('double', 'log_rate', self._slopes())};",
            *([f"  {self._declaration('void', 'state_rates', *self._outputs())};"] if self.law.states else []),
            f"Slopes are derivatives to {', '.join(map(str, self.arguments))}, in this order.",
        ]
        return block_comment([*comments(told, " *", _WIDTH), *comments(declared, " *")])

    def _parameters(self) -> list[str]:
        lines = []
        for (symbol, value), param in zip(self.program.parameters.items(), self.law.params.values(), strict=True):
            unit = "" if param.unit == "1" else f"{param.unit}, "
            lines.append(f"static const double {symbol} = {value!r}; /* {safe(unit + param.meaning)} */")
        return lines

    def _starts(self) -> list[str]:
        """Where internal variables start, and where the material has failed."""
        states, count = self.law.states.values(), len(self.law.states)
        limits = ["INFINITY" if state.limit is None else repr(state.limit) for state in states]
        names = ", ".join(map(str, self.program.states))
        return [
            f"/* Start of {names}, and the value at which the material has failed. */",
            f"const double {self.prefix}_initial[{count}] = {{{', '.join(repr(state.initial) for state in states)}}};",
            f"const double {self.prefix}_limit[{count}] = {{{', '.join(limits)}}};",
        ]

    # ---- the functions ---------------------------------------------------------------------------------------------

    def _rate(self) -> list[str]:
        labels = [safe(printable(label)) for label in self.law.terms]
        about = f"/* Rate of equivalent creep strain, 1/{self.units.time}: {' + '.join(labels)}. */"
        body = [f"return {self._per_time()}{_tight(self.rate.outputs[0], self.units.seconds)};"]
        return self._function(about, self._declaration("double", "rate"), self.rate, body)

    def _log_rate(self) -> list[str]:
        part = self.update.only([0, *(self._place(0, k) for k in self.columns)])
        about = f"/* ln of the rate in 1/{self.units.time}, and its derivatives. */"
        shift = "" if self.units.seconds == 1 else f"log({self.units.seconds!r}) + "
        body = [*self._row("slopes", part.outputs[1:], 1.0), f"return {shift}{text_of(part.outputs[0])};"]
        return self._function(about, self._declaration("double", "log_rate", self._slopes()), part, body)

    def _state_rates(self) -> list[str]:
        count, width = len(self.law.states), len(self.columns)
        rows = [self._place(row, k) for row in range(1, count + 1) for k in self.columns]
        part = self.update.only([*range(1, count + 1), *rows])
        body = []
        for k in range(count):
            slopes = part.outputs[count + k * width : count + (k + 1) * width]
            body += [f"rates[{k}] = {self._per_time()}{_tight(part.outputs[k], self.units.seconds)};"]
            body += self._row(f"slopes[{k}]", slopes, self.units.seconds)
        about = f"/* Rates of internal variables, 1/{self.units.time}, and their derivatives, a row each. */"
        return self._function(about, self._declaration("void", "state_rates", *self._outputs()), part, body)

    def _function(self, about: str, declaration: str, part: Function, results: Sequence[str]) -> list[str]:
        logs = [f"const double {ln} = log({plain});" for ln, plain in self.program.logarithms_in(part).items()]
        idle = [f"(void){s};" for s in self.arguments if s not in part.read]
        body = [*idle, *self._converted(part), *logs, *assignments(part.steps), *results]
        return [about, declaration, "{", *(f"    {line}" for line in body), "}"]

    def _converted(self, part: Function) -> list[str]:
        """Stress and time on entry, in the law's own units."""
        pairs = [(s, self.scales[k]) for k, s in zip(self.columns, self.arguments, strict=True)]
        return [f"{s} *= {scale!r};" for s, scale in pairs if scale != 1 and s in part.read]

    def _row(self, target: str, slopes: Sequence[sympy.Expr], factor: float) -> list[str]:
        """One row of derivatives, to the arguments in the units in which they come."""
        factors = [self.scales[k] * factor for k in self.columns]
        texts = [
            f"{'' if f == 1 or e == 0 else f'{f!r} * '}{_tight(e, f)}" for f, e in zip(factors, slopes, strict=True)
        ]
        return [f"{target}[{k}] = {text};" for k, text in enumerate(texts)]

    def _place(self, row: int, column: int) -> int:
        """Where a derivative stands in the update entry."""
        rows = 1 + len(self.law.states)
        return rows + row * (len(POINT) + rows - 1) + column

    def _declaration(self, kind: str, name: str, *outputs: str) -> str:
        inputs = [f"double {s}" for s in self.arguments]
        return f"{kind} {self.prefix}_{name}({', '.join((*inputs, *outputs))})"

    def _slopes(self) -> str:
        return f"double slopes[{len(self.columns)}]"

    def _outputs(self) -> tuple[str, str]:
        count = len(self.law.states)
        return f"double rates[{count}]", f"double slopes[{count}][{len(self.columns)}]"

    def _per_time(self) -> str:
        return "" if self.units.seconds == 1 else f"{self.units.seconds!r} * "


def _tight(expression: sympy.Expr, factor: float) -> str:
    """An expression after a factor, in brackets where that is needed."""
    return f"({text_of(expression)})" if factor != 1 and expression.is_Add else text_of(expression)
