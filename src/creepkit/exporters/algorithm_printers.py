"""An algorithm that is written once, in a small part of Python, printed as C99 or as fixed-form Fortran.

That part is: functions of numbers and of arrays of fixed size, `for` over ranges, `while`, `if`, assignments to names
and to elements, and calls. Arrays that are arguments have their shape as annotation. Numbers in capitals are constants;
a branch that they rule out, and a loop that they leave empty, is not printed. What is assigned is double precision
unless it is annotated.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any, ClassVar

from creepkit.exporters.fortran import fortran_number, fortran_statements
from creepkit.exporters.law_description import comment_lines

ConstantValue = int | float | tuple[float, ...]

_LEVELS: tuple[tuple[type[ast.AST], ...], ...] = (
    (ast.Or,),
    (ast.And,),
    (ast.Not,),
    (ast.Eq, ast.NotEq, ast.Lt, ast.LtE, ast.Gt, ast.GtE),
    (ast.Add, ast.Sub),
    (ast.Mult, ast.Div, ast.FloorDiv),
    (ast.USub,),
    (ast.Pow, ast.Mod),
)
_PRECEDENCE = {operator: level for level, operators in enumerate(_LEVELS) for operator in operators}
"""How strongly operators bind, here, in C and in Fortran."""

_SIGNS = {
    ast.Add: " + ", ast.Sub: " - ", ast.Mult: " * ", ast.Div: " / ", ast.FloorDiv: " / ", ast.Eq: " == ",
    ast.NotEq: " != ", ast.Lt: " < ", ast.LtE: " <= ", ast.Gt: " > ", ast.GtE: " >= ", ast.And: " && ",
    ast.Or: " || ", ast.Not: "!", ast.USub: "-",
}  # fmt: skip
"""Operators of C."""

_MATHEMATICS = ("abs", "exp", "float", "log", "max", "min", "sqrt")
"""Functions that are none of the algorithm's own."""

Shape = Sequence[ast.expr]


@lru_cache(maxsize=8)
def _parsed(text: str) -> tuple[dict[str, ast.FunctionDef], dict[str, ConstantValue], dict[int, str]]:
    """The functions, constants and comments by line of an algorithm."""
    tree = ast.parse(text)
    stated = [node for node in tree.body if isinstance(node, ast.Assign)]
    values = {ast.unparse(node.targets[0]): ast.literal_eval(node.value) for node in stated}
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    comments = {t.start[0]: t.string.lstrip("# ") for t in tokens if t.type == tokenize.COMMENT}
    return {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}, values, comments


class AlgorithmPrinter:
    """What both languages share: expressions, and the walk through statements.

    text : of the algorithm. constants : {name: number}, beside those that the text gives. prefix : of the functions'
    names.
    """

    signs: ClassVar[Mapping[type[ast.AST], str]] = _SIGNS
    forms: ClassVar[Mapping[str, str]]
    names: ClassVar[Mapping[str, str]]
    kinds: ClassVar[Mapping[str, str]]
    element: ClassVar[tuple[str, str, str]]

    def __init__(self, text: str, constants: Mapping[str, ConstantValue], prefix: str) -> None:
        self.functions, values, self.comments = _parsed(text)
        self.prefix, self.numbers = prefix, {**values, **constants}
        self.function = next(iter(self.functions.values()))
        self.used: dict[str, None] = {}

    # ---- expressions -----------------------------------------------------------------------------------------------

    def known(self, node: ast.AST) -> ConstantValue | None:
        """The number that an expression of constants amounts to, None where it is none."""
        if isinstance(node, (ast.Constant, ast.Name)):
            return node.value if isinstance(node, ast.Constant) else self.numbers.get(node.id)  # type: ignore[return-value]
        if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Add, ast.Sub)):
            left, right = self.known(node.left), self.known(node.right)
            if isinstance(left, int) and isinstance(right, int):
                return left + right if isinstance(node.op, ast.Add) else left - right
        return None

    def text(self, node: Any, above: int = 0) -> str:
        """An expression; above : how strongly what stands around it binds."""
        if isinstance(node, ast.Constant):
            return self.number(node.value)
        if isinstance(node, ast.Name):
            if node.id in self.numbers:
                self.used[node.id] = None
            return node.id.lstrip("_")
        if isinstance(node, ast.Subscript):
            opening, comma, closing = self.element
            parts = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
            return f"{self.text(node.value)}{opening}{comma.join(map(self.text, parts))}{closing}"
        if isinstance(node, ast.Call):
            name = ast.unparse(node.func)
            called = self.names.get(name, name) if name in _MATHEMATICS else f"{self.prefix}_{name}"
            return f"{called}({', '.join(map(self.text, node.args))})"
        if isinstance(node, ast.IfExp):
            return self.forms["choice"].format(*(self.text(part, 1) for part in (node.test, node.body, node.orelse)))
        operator, operands = _operation(node)
        level = _PRECEDENCE[type(operator)]
        if type(operator) not in self.signs:
            return self.names[type(operator).__name__].format(*(self.text(part, level + 1) for part in operands))
        sign = self.signs[type(operator)]
        first, *rest = (self.text(part, level + (k > 0 or len(operands) == 1)) for k, part in enumerate(operands))
        text = sign.join((first, *rest)) if rest else sign + first
        return f"({text})" if level < above else text

    def number(self, value: Any) -> str:
        """A number or a truth value."""
        raise NotImplementedError

    # ---- statements ------------------------------------------------------------------------------------------------

    def block(self, body: Sequence[ast.stmt], depth: int) -> Iterator[str]:
        """Statements, each at its depth, with the comments above them."""
        for node in body:
            if comment := self.comments.get(node.lineno - 1):
                yield from self.comment([comment], depth)
            if isinstance(node, ast.For):
                yield from self._loop(node, depth)
            elif isinstance(node, ast.While):
                yield from self._around("while", [self.text(node.test)], node.body, depth)
                yield "  " * depth + self.forms["end while"]
            elif isinstance(node, ast.If):
                yield from self._branches(node, depth, "if")
            else:
                yield from ("  " * depth + line for line in self._simple(node))

    def _around(self, form: str, parts: Sequence[str], body: Sequence[ast.stmt], depth: int) -> Iterator[str]:
        yield "  " * depth + self.forms[form].format(*parts)
        yield from self.block(body, depth + 1)

    def _loop(self, node: ast.For, depth: int) -> Iterator[str]:
        assert isinstance(node.iter, ast.Call)
        first, last = ([ast.Constant(0), *node.iter.args])[-2:]
        low, high = self.known(first), self.known(last)
        if isinstance(low, int) and isinstance(high, int) and low >= high:
            return
        parts = [self.text(node.target), self.text(first), self.text(last, 5)]
        yield from self._around("for", parts, node.body, depth)
        yield "  " * depth + self.forms["end for"]

    def _branches(self, node: ast.If, depth: int, form: str) -> Iterator[str]:
        known = self.known(node.test)
        if known is not None:
            yield from self.block(node.body if known else node.orelse, depth)
            return
        yield from self._around(form, [self.text(node.test)], node.body, depth)
        if len(node.orelse) == 1 and isinstance(node.orelse[0], ast.If):
            yield from self._branches(node.orelse[0], depth, "else if")
            return
        if node.orelse:
            yield from self._around("else", [], node.orelse, depth)
        yield "  " * depth + self.forms["end if"]

    def _simple(self, node: Any) -> list[str]:
        """A statement of one line; of those that make an array nothing, for it is declared."""
        if isinstance(node, (ast.Assign, ast.AnnAssign)):
            target = node.targets[0] if isinstance(node, ast.Assign) else node.target
            return [] if _lengths(node.value) else [f"{self.text(target)} = {self.text(node.value)}{self.forms['end']}"]
        if isinstance(node, ast.Return):
            name = f"{self.prefix}_{self.function.name}"
            return self.forms["return"].format(name, self.text(node.value)).split("\n")
        if isinstance(node, ast.Break):
            return [self.forms["break"]]
        is_call = isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)
        return [self.forms["call"].format(self.text(node.value))] if is_call else []

    # ---- functions -------------------------------------------------------------------------------------------------

    def program(self, entry: str) -> tuple[list[str], set[str]]:
        """The functions that one needs, itself last, and the constants that they use."""
        printed, constants, needed = dict[str, list[str]](), set[str](), {entry}
        for name in reversed(self.functions):
            if name in needed:
                printed[name] = self.definition(name)
                constants |= {*self.used}
                needed |= {*re.findall(rf"\b{self.prefix}_(\w+)\(", "\n".join(printed[name]))}
        return [line for lines in reversed(printed.values()) for line in lines], constants

    def definition(self, name: str) -> list[str]:
        """A function of the algorithm, with its comment."""
        self.function, self.used = self.functions[name], {}
        body = list(self.block(self.function.body, 1))
        documentation = (ast.get_docstring(self.function) or "").splitlines()
        arguments = {a.arg: _variable(a.annotation) for a in self.function.args.args}
        words = {word for line in body for word in re.findall(r"\w+", line)}
        local = {k: v for k, v in self._assigned().items() if k in words and k not in arguments}
        return ["", *self.comment(documentation, 0), *self.framed(body, arguments, local)]

    def _assigned(self) -> dict[str, tuple[str, Shape]]:
        """{name: (kind, shape)} of what a function assigns."""
        result: dict[str, tuple[str, Shape]] = {}
        for node in ast.walk(self.function):
            if isinstance(node, ast.For):
                result.setdefault(self.text(node.target), ("int", []))
            elif isinstance(node, ast.AnnAssign):
                result[ast.unparse(node.target)] = _variable(node.annotation)
            elif isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
                result.setdefault(node.targets[0].id, ("float", _lengths(node.value)))
        return result

    def framed(
        self, body: list[str], arguments: Mapping[str, tuple[str, Shape]], local: Mapping[str, tuple[str, Shape]]
    ) -> Iterator[str]:
        """A body with the function's head and declarations."""
        raise NotImplementedError

    def comment(self, lines: Sequence[str], depth: int) -> list[str]:
        """Lines of comment."""
        raise NotImplementedError


def _operation(node: Any) -> tuple[ast.AST, list[ast.expr]]:
    """The operator of an expression, and its operands."""
    if isinstance(node, ast.BinOp):
        return node.op, [node.left, node.right]
    if isinstance(node, ast.Compare):
        return node.ops[0], [node.left, node.comparators[0]]
    return node.op, node.values if isinstance(node, ast.BoolOp) else [node.operand]


def _lengths(value: Any) -> Shape:
    """The shape of the array that an expression makes; nothing of any other."""
    if not (isinstance(value, ast.Call) and ast.unparse(value.func) == "zeros"):
        return []
    return value.args[0].elts if isinstance(value.args[0], ast.Tuple) else value.args


def _variable(annotation: Any) -> tuple[str, Shape]:
    return ("float", annotation.elts) if isinstance(annotation, ast.Tuple) else (ast.unparse(annotation), [])


class CAlgorithm(AlgorithmPrinter):
    """C99; arrays start at nil in every call, and truth is an int."""

    forms: ClassVar = {
        "end": ";", "call": "{};", "return": "return {1};", "break": "break;", "choice": "({} ? {} : {})",
        "if": "if ({}) {{", "else if": "}} else if ({}) {{", "else": "}} else {{", "end if": "}",
        "while": "while ({}) {{", "end while": "}", "for": "for ({0} = {1}; {0} < {2}; {0}++) {{", "end for": "}",
    }  # fmt: skip
    names: ClassVar = {
        "abs": "fabs", "max": "fmax", "min": "fmin", "float": "(double)", "Pow": "pow({}, {})", "Mod": "{} % {}",
    }  # fmt: skip
    kinds: ClassVar = {"float": "double", "int": "int", "bool": "int", "None": "void"}
    element: ClassVar = ("[", "][", "]")

    def number(self, value: Any) -> str:
        """A number."""
        return repr(int(value) if isinstance(value, bool) else value)

    def comment(self, lines: Sequence[str], depth: int) -> list[str]:
        """One comment."""
        return [f"{'  ' * depth}/* " + f"\n{'  ' * depth}   ".join(line.strip() for line in lines if line) + " */"]

    def framed(
        self, body: list[str], arguments: Mapping[str, tuple[str, Shape]], local: Mapping[str, tuple[str, Shape]]
    ) -> Iterator[str]:
        """Head, declarations, body."""
        scope = "" if self.function.name == "update" else "static "
        head = ", ".join(self._declared(name, *variable) for name, variable in arguments.items())
        kind = self.kinds[ast.unparse(self.function.returns or ast.Constant(None))]
        yield f"{scope}{kind} {self.prefix}_{self.function.name}({head})"
        yield "{"
        for name, (kind, shape) in local.items():
            nil = f" = {'{' * len(shape)}0.0{'}' * len(shape)}" if shape else ""
            yield f"  {self._declared(name, kind, shape)}{nil};"
        yield from (*body, "}")

    def _declared(self, name: str, kind: str, shape: Shape) -> str:
        return f"{self.kinds[kind]} {name}{''.join(f'[{self.text(n)}]' for n in shape)}"

    def constants(self, names: Sequence[str]) -> Iterator[str]:
        """The constants of a file: what is a length has to be of an enumeration."""
        values = {name: self.numbers[name] for name in names}
        integers = [f"{name} = {int(value)}" for name, value in values.items() if isinstance(value, int)]
        yield f"enum {{ {', '.join(integers)} }};"
        for name, value in values.items():
            if isinstance(value, tuple):
                yield f"static const double {name}[] = {{{', '.join(map(repr, value))}}};"
            elif isinstance(value, float):
                yield f"static const double {name} = {value!r};"


class FortranAlgorithm(AlgorithmPrinter):
    """Fixed form, all in double precision; arrays start at index 0 and at nil in every call."""

    signs: ClassVar = {
        **_SIGNS, ast.Mult: "*", ast.Div: "/", ast.FloorDiv: "/", ast.NotEq: " /= ", ast.And: " .and. ",
        ast.Or: " .or. ", ast.Not: ".not. ", ast.Pow: "**",
    }  # fmt: skip
    forms: ClassVar = {
        "end": "", "call": "call {}", "return": "{} = {}\nreturn", "break": "exit", "choice": "merge({1}, {2}, {0})",
        "if": "if ({}) then", "else if": "elseif ({}) then", "else": "else", "end if": "endif",
        "while": "do while ({})", "end while": "enddo", "for": "do {} = {}, {} - 1", "end for": "enddo",
    }  # fmt: skip
    names: ClassVar = {"float": "dble", "Mod": "mod({}, {})"}
    kinds: ClassVar = {"float": "double precision", "int": "integer", "bool": "logical", "None": ""}
    element: ClassVar = ("(", ", ", ")")

    def number(self, value: Any) -> str:
        """A number in double precision, or an integer, or a truth value."""
        if isinstance(value, bool):
            return f".{value}.".lower()
        return str(value) if isinstance(value, int) else fortran_number(value)

    def comment(self, lines: Sequence[str], depth: int) -> list[str]:
        """Lines that begin with an exclamation mark."""
        return ["!", *comment_lines([line.strip() for line in lines if line], "!", 71)]

    def framed(
        self, body: list[str], arguments: Mapping[str, tuple[str, Shape]], local: Mapping[str, tuple[str, Shape]]
    ) -> Iterator[str]:
        """Head, declarations, arrays at nil, body."""
        returned = {
            name: self.kinds[ast.unparse(node.returns)] for name, node in self.functions.items() if node.returns
        }
        called = {name for line in body for name in re.findall(rf"{self.prefix}_(\w+)\(", line)}
        declared = [self._declared(name, *variable) for name, variable in {**arguments, **local}.items()]
        declared += [f"{returned[name]} {self.prefix}_{name}" for name in sorted(called) if returned.get(name)]
        opening = f"{returned[self.function.name]} function" if returned[self.function.name] else "subroutine"
        lines = [
            f"{opening} {self.prefix}_{self.function.name}({', '.join(arguments)})",
            "  implicit none",
            *(f"  {line}" for line in (*self._constants(), *declared)),
            *(f"  {name} = 0.0d0" for name, (_, shape) in local.items() if shape),
            *body,
            f"end {opening.split()[-1]}",
        ]
        yield from fortran_statements(lines)

    def _declared(self, name: str, kind: str, shape: Shape) -> str:
        bounds = ", ".join(f"0:{self.text(n, 5)} - 1" for n in shape)
        return f"{self.kinds[kind]} {name}{f'({bounds})' if shape else ''}"

    def _constants(self) -> Iterator[str]:
        for name in self.used:
            value = self.numbers[name]
            if isinstance(value, tuple):
                numbers = ", ".join(map(fortran_number, value))
                yield f"double precision, parameter :: {name}(0:{len(value) - 1}) = (/ {numbers} /)"
            else:
                kind = "integer" if isinstance(value, int) else "double precision"
                yield f"{kind}, parameter :: {name} = {self.number(value)}"
