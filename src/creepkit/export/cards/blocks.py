"""Blocks of the HIT format, which MOOSE and NEML2 read: [name] key = value [], nested."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from creepkit.export.cards.text import format_number

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
