"""LLVM assembly of a kernel, written by running its printed text on values that write themselves down.

A kernel's text is run once for a block of points, whose values are vectors of one number a point, and once for a single
point. What depends on theta alone is a single number in both. Every function that the text calls is defined in the same
module, for vectors or for numbers.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import count
from typing import Any

BLOCK_ROWS = 8
"""Points of a vector."""


DOUBLE, INTEGER, CONDITION = "double", "i64", "i1"


Number = float | int | bool


class Module:
    """Functions as LLVM assembly, each defined once."""

    def __init__(self) -> None:
        self._definitions: dict[str, str] = {}

    def __str__(self) -> str:
        return "\n".join(self._definitions.values())

    def add(self, name: str, text: str) -> None:
        """Add a definition or declaration."""
        self._definitions[name] = text

    def function(self, formula: Callable[..., Any], block: Block, arguments: int) -> str:
        """The name of a formula as a function of this module, for the lanes of a block."""
        name = f"{formula.__name__}.{block.lanes}"
        if name not in self._definitions:
            self._definitions[name] = ""  # its place: after the caller's, before those that it calls itself
            body = Block(self, block.lanes)
            inputs = [Value(body, f"%argument{k}", DOUBLE) for k in range(arguments)]
            result = body.text_of(formula(*inputs), DOUBLE)
            double = body.type_of(DOUBLE)
            declared = ", ".join(f"{double} {value.name}" for value in inputs)
            lines = "\n".join([*body.lines, f"  ret {double} {result}"])
            self._definitions[name] = (
                f"define internal {double} @{name}({declared}) {FUNCTION_ATTRIBUTES} {{\n{lines}\n}}"
            )
        return name

    def intrinsic(self, name: str, block: Block, arguments: int) -> str:
        """The name of an LLVM intrinsic for the lanes of a block."""
        full = f"llvm.{name}.{'f64' if block.lanes == 1 else f'v{block.lanes}f64'}"
        double = block.type_of(DOUBLE)
        self.add(full, f"declare {double} @{full}({', '.join([double] * arguments)})")
        return full


FUNCTION_ATTRIBUTES = "nounwind willreturn memory(none)"


@dataclass(eq=False)
class Block:
    """Lines in which every value has so many lanes. outer : the block before it, whose values have one."""

    module: Module
    lanes: int
    outer: Block | None = None
    prefix: str = "v"
    lines: list[str] = field(default_factory=list)
    _names: Iterator[int] = field(default_factory=count)
    _written: dict[str, Value] = field(default_factory=dict)

    def type_of(self, kind: str) -> str:
        """LLVM's type of a value here."""
        return kind if self.lanes == 1 else f"<{self.lanes} x {kind}>"

    def write(self, instruction: str, kind: str) -> Value:
        """Add an instruction, unless it is there already, and return its result."""
        value = self._written.get(instruction)
        if value is None:
            value = self._written[instruction] = Value(self, f"%{self.prefix}{next(self._names)}", kind)
            self.lines.append(f"  {value.name} = {instruction}")
        return value

    def text_of(self, value: Value | Number, kind: str) -> str:
        """An operand, repeated for every lane when it has one only."""
        if isinstance(value, Value):
            if value.block is self or self.lanes == 1:
                return value.name
            return self._repeated_value(value)
        number = constant_text(value, kind)
        return number if self.lanes == 1 else f"<{', '.join([f'{kind} {number}'] * self.lanes)}>"

    def _repeated_value(self, value: Value) -> str:
        vector, mask = self.type_of(value.kind), f"<{self.lanes} x i32> zeroinitializer"
        first = self.write(f"insertelement {vector} poison, {value.kind} {value.name}, i64 0", value.kind)
        return self.write(f"shufflevector {vector} {first.name}, {vector} poison, {mask}", value.kind).name


def _operator(instruction: str, *, reflected: bool = False) -> Callable[[Any, Any], Value]:
    return lambda self, other: operation(instruction, *((other, self) if reflected else (self, other)))


def _comparison(relation: str) -> Callable[[Any, Any], Value]:
    return lambda self, other: comparison(relation, self, other)


@dataclass(frozen=True, eq=False)
class Value:
    """A number, integer or condition in each lane of a block; its operators write instructions."""

    block: Block
    name: str
    kind: str

    __add__, __radd__ = _operator("fadd"), _operator("fadd", reflected=True)
    __sub__, __rsub__ = _operator("fsub"), _operator("fsub", reflected=True)
    __mul__, __rmul__ = _operator("fmul"), _operator("fmul", reflected=True)
    __truediv__, __rtruediv__ = _operator("fdiv"), _operator("fdiv", reflected=True)
    __lt__, __le__, __gt__, __ge__ = map(_comparison, ("olt", "ole", "ogt", "oge"))

    def __neg__(self) -> Value:
        block = self.block
        return block.write(f"fneg {block.type_of(DOUBLE)} {self.name}", DOUBLE)


def constant_text(value: Number, kind: str) -> str:
    """A constant in LLVM's notation; doubles as their bits."""
    if kind == DOUBLE:
        return f"0x{struct.pack('>d', value).hex().upper()}"
    return str(int(value))


def block_of(values: Sequence[Any]) -> Block | None:
    """The innermost block of some values; None when all are numbers."""
    blocks = [value.block for value in values if isinstance(value, Value)]
    return next((block for block in blocks if block.outer is not None), blocks[0] if blocks else None)


def _common_block(values: Sequence[Any]) -> Block:
    """The innermost block of some values, one of which at least is a Value."""
    block = block_of(values)
    if block is None:
        raise TypeError(f"an instruction of constants only: {values}")
    return block


def operation(instruction: str, a: Any, b: Any, kind: str = DOUBLE) -> Value:
    """An instruction with two operands, and a result, of one kind; one of the operands at least is a Value."""
    block = _common_block((a, b))
    return block.write(f"{instruction} {block.type_of(kind)} {block.text_of(a, kind)}, {block.text_of(b, kind)}", kind)


def comparison(relation: str, a: Any, b: Any) -> Value:
    """A comparison of two doubles, `relation` as LLVM names it."""
    block = _common_block((a, b))
    operands = f"{block.text_of(a, DOUBLE)}, {block.text_of(b, DOUBLE)}"
    return block.write(f"fcmp {relation} {block.type_of(DOUBLE)} {operands}", CONDITION)


def select(condition: Value | bool, a: Any, b: Any) -> Any:
    """Return a where the condition holds, else b."""
    if not isinstance(condition, Value):
        return a if condition else b
    block = _common_block((condition, a, b))
    operands = [
        f"{block.type_of(kind)} {block.text_of(value, kind)}"
        for value, kind in ((condition, CONDITION), (a, DOUBLE), (b, DOUBLE))
    ]
    return block.write(f"select {', '.join(operands)}", DOUBLE)


def bits(value: Value) -> Value:
    """The bits of doubles as integers."""
    return _cast("bitcast", value, INTEGER)


def number_of_bits(value: Value) -> Value:
    """The doubles that have these bits."""
    return _cast("bitcast", value, DOUBLE)


def _cast(instruction: str, value: Value, kind: str) -> Value:
    block = value.block
    return block.write(f"{instruction} {block.type_of(value.kind)} {value.name} to {block.type_of(kind)}", kind)


def call_intrinsic(name: str, *arguments: Any) -> Value:
    """An LLVM intrinsic of doubles."""
    block = _common_block(arguments)
    return _call(block, block.module.intrinsic(name, block, len(arguments)), arguments)


def call_formula(formula: Callable[..., Any], *arguments: Any) -> Value:
    """A call of a formula's function, which is defined where it is not yet."""
    block = _common_block(arguments)
    return _call(block, block.module.function(formula, block, len(arguments)), arguments)


def call_libm(name: str, *arguments: Any) -> Value:
    """A function of the C library, lane by lane."""
    block = _common_block(arguments)
    declared = ", ".join([DOUBLE] * len(arguments))
    block.module.add(name, f"declare {DOUBLE} @{name}({declared}) {FUNCTION_ATTRIBUTES}")
    if block.lanes == 1:
        return _call(block, name, arguments)
    operands, vector, result = [block.text_of(a, DOUBLE) for a in arguments], block.type_of(DOUBLE), "poison"
    for lane in range(block.lanes):
        numbers = [block.write(f"extractelement {vector} {text}, i64 {lane}", DOUBLE).name for text in operands]
        one = block.write(f"call {DOUBLE} @{name}({', '.join(f'{DOUBLE} {number}' for number in numbers)})", DOUBLE)
        result = block.write(f"insertelement {vector} {result}, {DOUBLE} {one.name}, i64 {lane}", DOUBLE).name
    return Value(block, result, DOUBLE)


def _call(block: Block, name: str, arguments: Sequence[Any]) -> Value:
    double = block.type_of(DOUBLE)
    operands = ", ".join(f"{double} {block.text_of(a, DOUBLE)}" for a in arguments)
    return block.write(f"call {double} @{name}({operands})", DOUBLE)


# ---- entries -------------------------------------------------------------------------------------------------------


_POINTS = """define internal i64 @{name}(i64 %rows, i64 %row, {arrays}) noinline nounwind {{
{lines}
  ret i64 {flags}
}}"""


_ENTRY = """define i64 @{name}(i64 %rows, {arrays}) nounwind {{
start:
  switch i64 %rows, label %blocks [ i64 1, label %one_point i64 {size}, label %one_block ]
one_point:
  %of_point = tail call i64 @{name}.1(i64 1, i64 0, {arguments})
  ret i64 %of_point
one_block:
  %of_block = tail call i64 @{name}.{size}(i64 {size}, i64 0, {arguments})
  ret i64 %of_block
blocks:
  %first = phi i64 [ 0, %start ], [ %after, %block ]
  %flags = phi i64 [ 0, %start ], [ %with_block, %block ]
  %after = add nsw i64 %first, {size}
  %whole = icmp sle i64 %after, %rows
  br i1 %whole, label %block, label %points
block:
  %block_flags = call i64 @{name}.{size}(i64 %rows, i64 %first, {arguments})
  %with_block = or i64 %flags, %block_flags
  br label %blocks
points:
  %row = phi i64 [ %first, %blocks ], [ %next, %point ]
  %so_far = phi i64 [ %flags, %blocks ], [ %with_point, %point ]
  %more = icmp slt i64 %row, %rows
  br i1 %more, label %point, label %end
point:
  %point_flags = call i64 @{name}.1(i64 %rows, i64 %row, {arguments})
  %with_point = or i64 %so_far, %point_flags
  %next = add nsw i64 %row, 1
  br label %points
end:
  ret i64 %so_far
}}"""
"""One point and one block need no loop: constants taken out of one would fill the registers."""


_ARRAYS = "ptr noalias readonly %x, ptr noalias readonly %theta, ptr noalias %out"


_ARGUMENTS = "ptr %x, ptr %theta, ptr %out"


def add_entry(
    module: Module, name: str, kernel: Callable[..., Sequence[Any]], sizes: tuple[int, int], rates: int
) -> None:
    """Add an entry, as kernels.interface lays it out.

    kernel : function of the variables of a point, then theta, to the outputs, the `rates` first. sizes : how many
    variables and how many theta there are.
    """
    module.add(name, _ENTRY.format(name=name, size=BLOCK_ROWS, arrays=_ARRAYS, arguments=_ARGUMENTS))
    for lanes in (BLOCK_ROWS, 1):
        of_theta = Block(module, 1, prefix="c")
        block = Block(module, lanes, of_theta)
        flags = _write_points((of_theta, block), kernel, sizes, rates)
        lines = "\n".join([*of_theta.lines, *block.lines])
        points = f"{name}.{lanes}"
        module.add(points, _POINTS.format(name=points, arrays=_ARRAYS, lines=lines, flags=flags))


def _write_points(
    blocks: tuple[Block, Block], kernel: Callable[..., Sequence[Any]], sizes: tuple[int, int], rates: int
) -> str:
    """Read theta and the points from %row on, run the kernel and write its outputs; return the flags."""
    of_theta, block = blocks
    variables, parameters = sizes
    vector = block.type_of(DOUBLE)

    def address(array: str, k: int) -> str:
        column = block.write(f"mul nsw i64 %rows, {k}", INTEGER)
        index = block.write(f"add nsw i64 {column.name}, %row", INTEGER)
        return block.write(f"getelementptr double, ptr {array}, i64 {index.name}", "ptr").name

    def parameter(k: int) -> Value:
        place = of_theta.write(f"getelementptr double, ptr %theta, i64 {k}", "ptr")
        return of_theta.write(f"load double, ptr {place.name}", DOUBLE)

    point = [block.write(f"load {vector}, ptr {address('%x', k)}, align 8", DOUBLE) for k in range(variables)]
    outputs = kernel(*point, *(parameter(k) for k in range(parameters)))
    for k, output in enumerate(outputs):
        block.lines.append(f"  store {vector} {block.text_of(output, DOUBLE)}, ptr {address('%out', k)}, align 8")
    flags = "0"
    for flag, columns in ((1, outputs[:rates]), (2, outputs[rates:])):
        flags = _with_flag(block, columns, flag, flags)
    return flags


def _with_flag(block: Block, columns: Sequence[Any], flag: int, flags: str) -> str:
    """Add a flag where a column is not finite: y - y is 0 for what is finite, NaN for what is not."""
    numbers = [column for column in columns if isinstance(column, Value)]
    if not numbers:
        return flags
    total = numbers[0] - numbers[0]
    for number in numbers[1:]:
        total = total + (number - number)
    operands = f"{block.text_of(total, DOUBLE)}, {block.text_of(0.0, DOUBLE)}"
    found = block.write(f"fcmp une {block.type_of(DOUBLE)} {operands}", CONDITION).name
    if block.lanes > 1:
        mask = f"i{block.lanes}"
        lanes = block.write(f"bitcast {block.type_of(CONDITION)} {found} to {mask}", mask)
        found = block.write(f"icmp ne {mask} {lanes.name}, 0", CONDITION).name
    added = block.write(f"select i1 {found}, i64 {flag}, i64 0", INTEGER)
    return block.write(f"or i64 {flags}, {added.name}", INTEGER).name
