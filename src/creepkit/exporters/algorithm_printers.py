"""An algorithm that is written once, in a small part of Python, printed as C99 or as fixed-form Fortran.

That part is: functions of numbers and of arrays of fixed size, `for` over ranges, `while`, `if`, assignments to names
and to elements, and calls. Numbers in capitals are constants, which each text puts in; a branch that they rule out, and
a loop that they leave empty, is not printed. Names that are assigned are double precision unless annotated.
"""

from __future__ import annotations

import ast
import inspect
import io
import tokenize
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import ClassVar

from creepkit.exporters.creep_subroutine import fortran_number, fortran_statements
from creepkit.exporters.law_description import comment_lines

ConstantValue = int | float | tuple[float, ...]

_LEVELS: tuple[tuple[type[ast.AST], ...], ...] = (
    (ast.IfExp,),
    (ast.Or,),
    (ast.And,),
    (ast.Not,),
    (ast.Eq, ast.NotEq, ast.Lt, ast.LtE, ast.Gt, ast.GtE),
    (ast.Add, ast.Sub),
    (ast.Mult, ast.Div, ast.FloorDiv),
    (ast.USub,),
)
_PRECEDENCE = {operator: level for level, operators in enumerate(_LEVELS) for operator in operators}
"""How strongly operators bind, here, in C and in Fortran; all others are printed as calls."""


@dataclass(frozen=True)
class Algorithm:
    """A module that holds one, with the constants of one text.

    functions : {name: its tree}; comments : {line: text}, of lines that hold nothing else; shapes : of arrays that are
    arguments, {name: what their lengths are}.
    """

    functions: Mapping[str, ast.FunctionDef]
    comments: Mapping[int, str]
    shapes: Mapping[str, tuple[ast.expr, ...]]
    constants: Mapping[str, ConstantValue]

    def known(self, node: ast.AST) -> ConstantValue | None:
        """The number that an expression of constants amounts to, None where it is none."""
        if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
            return node.value
        if isinstance(node, ast.Name):
            return self.constants.get(node.id)
        if isinstance(node, (ast.BinOp, ast.Compare)):
            other = node.right if isinstance(node, ast.BinOp) else node.comparators[0]
            left, right = self.known(node.left), self.known(other)
            if isinstance(left, int) and isinstance(right, int):
                operator = node.op if isinstance(node, ast.BinOp) else node.ops[0]
                return {ast.Add: left + right, ast.Sub: left - right, ast.Eq: left == right}.get(type(operator))
        return None


def algorithm(module: ModuleType, constants: Mapping[str, ConstantValue]) -> Algorithm:
    """Read a module's text; constants : {name: number} in the place of the module's own."""
    text = inspect.getsource(module)
    tree = ast.parse(text)
    functions = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    comments = {t.start[0]: t.string.lstrip("# ") for t in tokens if t.type == tokenize.COMMENT}
    assigned = (node for node in tree.body if isinstance(node, ast.Assign) and isinstance(node.value, ast.Dict))
    pairs = [(k, v) for node in assigned for k, v in zip(node.value.keys, node.value.values, strict=True)]  # type: ignore[attr-defined]
    shapes = {ast.literal_eval(k): tuple(v.elts) for k, v in pairs if isinstance(v, ast.Tuple)}
    return Algorithm(functions, comments, shapes, constants)


class AlgorithmPrinter:
    """What both languages share: expressions, and the walk through statements.

    prefix : of the functions' names. forms : of statements, by the name of the construct.
    """

    operators: ClassVar[Mapping[type[ast.AST], str]]
    forms: ClassVar[Mapping[str, str]]
    functions: ClassVar[Mapping[str, str]]
    kinds: ClassVar[Mapping[str, str]]
    element: ClassVar[tuple[str, str, str]]

    def __init__(self, source: Algorithm, prefix: str) -> None:
        self.source, self.prefix = source, prefix
        self.function: ast.FunctionDef = next(iter(source.functions.values()))
        self.used: dict[str, None] = {}

    # ---- expressions -----------------------------------------------------------------------------------------------

    def text(self, node: ast.expr, above: int = 0) -> str:
        """An expression; above : how strongly what stands around it binds."""
        if isinstance(node, ast.Constant):
            return self.number(node.value)
        if isinstance(node, ast.Name):
            if node.id in self.source.constants:
                self.used[node.id] = None
            return _printed(node)
        if isinstance(node, ast.Subscript):
            parts = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
            opening, comma, closing = self.element
            return f"{self.text(node.value)}{opening}{comma.join(map(self.text, parts))}{closing}"
        if isinstance(node, ast.Call):
            return self.call(node)
        if isinstance(node, ast.IfExp):
            if (known := self.source.known(node.test)) is not None:
                return self.text(node.body if known else node.orelse, above)
            return self.choice(node)
        return self.operation(node, above)

    def operation(self, node: ast.expr, above: int) -> str:
        """An operator with its operands, in brackets where what stands around binds as strongly."""
        if isinstance(node, ast.BinOp) and type(node.op) not in self.operators:
            form = self.functions[type(node.op).__name__]
            return form.format(self.text(node.left, 9), self.text(node.right, 9))
        if isinstance(node, ast.UnaryOp):
            level = _PRECEDENCE[type(node.op)]
            text = self.operators[type(node.op)] + self.text(node.operand, level + 1)
        elif isinstance(node, ast.BoolOp):
            level = _PRECEDENCE[type(node.op)]
            text = self.operators[type(node.op)].join(self.text(value, level + 1) for value in node.values)
        else:
            assert isinstance(node, (ast.BinOp, ast.Compare)), ast.dump(node)
            is_sum = isinstance(node, ast.BinOp)
            operator, right = (node.op, node.right) if is_sum else (node.ops[0], node.comparators[0])  # type: ignore[union-attr]
            level = _PRECEDENCE[type(operator)]
            text = f"{self.text(node.left, level)}{self.operators[type(operator)]}{self.text(right, level + 1)}"
        return f"({text})" if level < above else text

    def call(self, node: ast.Call) -> str:
        """A call of a function of the algorithm, or of one that every language has."""
        assert isinstance(node.func, ast.Name)
        name, arguments = node.func.id, [self.text(a) for a in node.args]
        if name in self.source.functions:
            return f"{self.prefix}_{name}({', '.join(arguments)})"
        return f"{self.functions.get(name, name)}({', '.join(arguments)})"

    def number(self, value: object) -> str:
        """A number or a truth value."""
        raise NotImplementedError

    def choice(self, node: ast.IfExp) -> str:
        """One of two expressions."""
        raise NotImplementedError

    # ---- statements ------------------------------------------------------------------------------------------------

    def block(self, body: Sequence[ast.stmt], depth: int) -> Iterator[str]:
        """Statements, each at its depth, with the comments above them."""
        indent = "  " * depth
        for node in body:
            comment = self.source.comments.get(node.lineno - 1)
            if comment:
                yield from self.comment([comment], depth)
            if isinstance(node, ast.For):
                yield from self.loop(node, depth)
            elif isinstance(node, ast.While):
                yield indent + self.forms["while"].format(self.text(node.test))
                yield from self.block(node.body, depth + 1)
                yield indent + self.forms["end while"]
            elif isinstance(node, ast.If):
                yield from self.branches(node, depth, "if")
            else:
                yield from (indent + line for line in self.simple(node))

    def loop(self, node: ast.For, depth: int) -> Iterator[str]:
        """A loop over a range, unless it is empty."""
        assert isinstance(node.target, ast.Name)
        assert isinstance(node.iter, ast.Call)
        first, last = node.iter.args if len(node.iter.args) == 2 else (ast.Constant(0), node.iter.args[0])
        bounds = self.source.known(first), self.source.known(last)
        if isinstance(bounds[0], int) and isinstance(bounds[1], int) and bounds[0] >= bounds[1]:
            return
        head = self.forms["for"].format(name=_printed(node.target), first=self.text(first), last=self.text(last, 5))
        yield "  " * depth + head
        yield from self.block(node.body, depth + 1)
        yield "  " * depth + self.forms["end for"]

    def branches(self, node: ast.If, depth: int, form: str) -> Iterator[str]:
        """If, else if, else: of a condition that is known, the branch that is taken."""
        known = self.source.known(node.test)
        if known is not None:
            yield from self.block(node.body if known else node.orelse, depth)
            return
        yield "  " * depth + self.forms[form].format(self.text(node.test))
        yield from self.block(node.body, depth + 1)
        if len(node.orelse) == 1 and isinstance(node.orelse[0], ast.If):
            yield from self.branches(node.orelse[0], depth, "else if")
            return
        if node.orelse:
            yield "  " * depth + self.forms["else"]
            yield from self.block(node.orelse, depth + 1)
        yield "  " * depth + self.forms["end if"]

    def simple(self, node: ast.stmt) -> Iterator[str]:
        """A statement of one line; of those that make an array nothing, for it is declared."""
        if isinstance(node, ast.Assign):
            if not _is_array(node.value):
                yield self.forms["assign"].format(self.text(node.targets[0]), self.text(node.value))
        elif isinstance(node, ast.AnnAssign):
            assert node.value is not None
            yield self.forms["assign"].format(self.text(node.target), self.text(node.value))
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
            yield self.forms["call"].format(self.text(node.value))
        elif isinstance(node, ast.Return) and node.value is not None:
            names = {"name": f"{self.prefix}_{self.function.name}", "value": self.text(node.value)}
            yield from self.forms["return"].format(**names).split("\n")
        elif isinstance(node, ast.Break):
            yield self.forms["break"]

    # ---- functions -------------------------------------------------------------------------------------------------

    def definition(self, name: str) -> list[str]:
        """A function of the algorithm, with its comment."""
        self.function = self.source.functions[name]
        self.used = {}
        body = list(self.block(self.function.body, 1))
        documentation = (ast.get_docstring(self.function) or "").splitlines()
        return ["", *self.comment(documentation, 0), *self.framed(body)]

    def framed(self, body: list[str]) -> Iterator[str]:
        """A body with the function's head and declarations."""
        raise NotImplementedError

    def comment(self, lines: Sequence[str], depth: int) -> list[str]:
        """Lines of comment."""
        raise NotImplementedError

    def local_variables(self, printed: Sequence[str]) -> dict[str, tuple[str, list[ast.expr]]]:
        """{name: (kind, shape)} of what a function assigns and its printed lines mention."""
        words = {word for line in printed for word in _words(line)}
        result: dict[str, tuple[str, list[ast.expr]]] = {}
        arguments = {a.arg for a in self.function.args.args}
        for node in ast.walk(self.function):
            if isinstance(node, ast.For) and isinstance(node.target, ast.Name):
                result.setdefault(_printed(node.target), ("int", []))
            elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
                result[node.target.id] = (ast.unparse(node.annotation), [])
            elif isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
                shape = node.value.args[0] if isinstance(node.value, ast.Call) and _is_array(node.value) else None
                lengths = [] if shape is None else shape.elts if isinstance(shape, ast.Tuple) else [shape]
                result.setdefault(node.targets[0].id, ("float", list(lengths)))
        return {name: found for name, found in result.items() if name in words and name not in arguments}

    def returned(self) -> str:
        """The kind of what a function returns."""
        assert self.function.returns is not None
        return self.kinds[ast.unparse(self.function.returns)]


def _printed(name: ast.Name) -> str:
    """A name, of loops that need none without its underscore."""
    return name.id.lstrip("_")


def _kind(argument: ast.arg) -> str:
    """Its annotation."""
    return ast.unparse(argument.annotation) if argument.annotation else ""


def _is_array(value: ast.expr) -> bool:
    return isinstance(value, ast.Call) and isinstance(value.func, ast.Name) and value.func.id == "zeros"


def _words(line: str) -> list[str]:
    return "".join(c if c.isalnum() or c == "_" else " " for c in line).split()


class CAlgorithm(AlgorithmPrinter):
    """C99; arrays start at nil in every call, and truth is an int."""

    operators: ClassVar = {
        ast.Add: " + ", ast.Sub: " - ", ast.Mult: " * ", ast.Div: " / ", ast.FloorDiv: " / ", ast.Eq: " == ",
        ast.NotEq: " != ", ast.Lt: " < ", ast.LtE: " <= ", ast.Gt: " > ", ast.GtE: " >= ", ast.And: " && ",
        ast.Or: " || ", ast.Not: "!", ast.USub: "-",
    }  # fmt: skip
    forms: ClassVar = {
        "assign": "{} = {};", "call": "{};", "return": "return {value};", "break": "break;", "if": "if ({}) {{",
        "else if": "}} else if ({}) {{", "else": "} else {", "end if": "}", "while": "while ({}) {{", "end while": "}",
        "for": "for ({name} = {first}; {name} < {last}; {name}++) {{", "end for": "}",
    }  # fmt: skip
    functions: ClassVar = {
        "abs": "fabs", "max": "fmax", "min": "fmin", "float": "(double)", "Pow": "pow({}, {})", "Mod": "{} % {}",
    }  # fmt: skip
    kinds: ClassVar = {"float": "double", "int": "int", "bool": "int", "None": "void"}
    element: ClassVar = ("[", "][", "]")

    def number(self, value: object) -> str:
        """A number."""
        return repr(int(value) if isinstance(value, bool) else value)

    def choice(self, node: ast.IfExp) -> str:
        """The conditional operator."""
        return f"({self.text(node.test, 1)} ? {self.text(node.body, 1)} : {self.text(node.orelse, 1)})"

    def comment(self, lines: Sequence[str], depth: int) -> list[str]:
        """One comment."""
        return [f"{'  ' * depth}/* " + f"\n{'  ' * depth}   ".join(line.strip() for line in lines if line) + " */"]

    def framed(self, body: list[str]) -> Iterator[str]:
        """Head, declarations, body."""
        arguments = []
        for argument in self.function.args.args:
            brackets = "".join(f"[{self.text(n)}]" for n in self.source.shapes.get(argument.arg, ()))
            arguments.append(f"{self.kinds.get(_kind(argument), 'double')} {argument.arg}{brackets}")
        scope = "" if self.function.name == "update" else "static "
        yield f"{scope}{self.returned()} {self.prefix}_{self.function.name}({', '.join(arguments)})"
        yield "{"
        for name, (kind, lengths) in self.local_variables(body).items():
            zeros = f" = {'{' * len(lengths)}0.0{'}' * len(lengths)}" if lengths else ""
            yield f"  {self.kinds[kind]} {name}{''.join(f'[{self.text(n)}]' for n in lengths)}{zeros};"
        yield from body
        yield "}"

    def constants(self, names: Sequence[str]) -> list[str]:
        """The constants of a file: what is a length has to be of an enumeration."""
        values = {name: self.source.constants[name] for name in names}
        numbers = [f"{name} = {int(value)}" for name, value in values.items() if isinstance(value, int)]
        lines = [f"enum {{ {', '.join(numbers)} }};"]
        for name, value in values.items():
            if isinstance(value, tuple):
                lines.append(f"static const double {name}[] = {{{', '.join(map(repr, value))}}};")
            elif isinstance(value, float):
                lines.append(f"static const double {name} = {value!r};")
        return lines


class FortranAlgorithm(AlgorithmPrinter):
    """Fixed form, all in double precision; arrays start at index 0 and at nil in every call."""

    operators: ClassVar = {
        ast.Add: " + ", ast.Sub: " - ", ast.Mult: "*", ast.Div: "/", ast.FloorDiv: "/", ast.Eq: " == ",
        ast.NotEq: " /= ", ast.Lt: " < ", ast.LtE: " <= ", ast.Gt: " > ", ast.GtE: " >= ", ast.And: " .and. ",
        ast.Or: " .or. ", ast.Not: ".not. ", ast.USub: "-", ast.Pow: "**",
    }  # fmt: skip
    forms: ClassVar = {
        "assign": "{} = {}", "call": "call {}", "return": "{name} = {value}\nreturn", "break": "exit",
        "if": "if ({}) then", "else if": "elseif ({}) then", "else": "else", "end if": "endif",
        "while": "do while ({})", "end while": "enddo", "for": "do {name} = {first}, {last} - 1", "end for": "enddo",
    }  # fmt: skip
    functions: ClassVar = {"float": "dble", "Mod": "mod({}, {})"}
    kinds: ClassVar = {"float": "double precision", "int": "integer", "bool": "logical", "None": ""}
    element: ClassVar = ("(", ", ", ")")

    def number(self, value: object) -> str:
        """A number in double precision, or an integer, or a truth value."""
        if isinstance(value, bool):
            return f".{value}.".lower()
        return str(value) if isinstance(value, int) else fortran_number(float(str(value)))

    def choice(self, node: ast.IfExp) -> str:
        """The intrinsic function, which takes both."""
        return f"merge({self.text(node.body)}, {self.text(node.orelse)}, {self.text(node.test)})"

    def operation(self, node: ast.expr, above: int) -> str:
        """Powers are operators here."""
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
            return f"{self.text(node.left, 9)}**{self.text(node.right, 9)}"
        return super().operation(node, above)

    def comment(self, lines: Sequence[str], depth: int) -> list[str]:
        """Lines that begin with an exclamation mark."""
        return ["!", *comment_lines([line.strip() for line in lines if line], "!", 71)]

    def framed(self, body: list[str]) -> Iterator[str]:
        """Head, declarations, arrays at nil, body."""
        local = self.local_variables(body)
        arguments = self.function.args.args
        called = [
            f"{kind} {self.prefix}_{name}"
            for name, node in self.source.functions.items()
            if (kind := self.kinds.get(ast.unparse(node.returns) if node.returns else "", ""))
            and any(f"{self.prefix}_{name}" in _words(line) for line in body)
            and name != self.function.name
        ]
        shaped = {a.arg: (_kind(a), list(self.source.shapes.get(a.arg, ()))) for a in arguments}
        declared = [self._declaration(name, *variable) for name, variable in {**shaped, **local}.items()]
        result = self.returned()
        opening = f"{result} function" if result else "subroutine"
        names = ", ".join(shaped)
        lines = [
            f"{opening} {self.prefix}_{self.function.name}({names})",
            "  implicit none",
            *(f"  {line}" for line in (*self.constants([*self.used]), *called, *declared)),
            *(f"  {name} = 0.0d0" for name, (_, lengths) in local.items() if lengths),
            *body,
            f"end {opening.split()[-1]}",
        ]
        yield from fortran_statements(lines)

    def _declaration(self, name: str, kind: str, lengths: Sequence[ast.expr]) -> str:
        bounds = ", ".join(f"0:{self._last(n)}" for n in lengths)
        return f"{self.kinds.get(kind, 'double precision')} {name}{f'({bounds})' if lengths else ''}"

    def _last(self, length: ast.expr) -> str:
        known = self.source.known(length)
        return f"{self.text(length, 5)} - 1" if not isinstance(known, int) else str(known - 1)

    def constants(self, names: Sequence[str]) -> Iterator[str]:
        """Constants of one routine."""
        for name in names:
            value = self.source.constants[name]
            if isinstance(value, tuple):
                numbers = ", ".join(map(fortran_number, value))
                yield f"double precision, parameter :: {name}(0:{len(value) - 1}) = (/ {numbers} /)"
            else:
                kind = "integer" if isinstance(value, int) else "double precision"
                yield f"{kind}, parameter :: {name} = {value if isinstance(value, int) else fortran_number(value)}"
