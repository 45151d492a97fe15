"""What is written on the command line, before it is read as values: no option twice, none empty, numbers as in files.

Click takes the last of two values without a word, and Python reads 1_0 as 10.
"""

from __future__ import annotations

from typing import Any

from typer.core import TyperCommand

from creepkit.errors import CreepkitError, quoted


class CheckedCommand(TyperCommand):
    """A command that refuses, in one sentence, options given twice, empty values and numbers with underscores."""

    def make_parser(self, ctx: Any) -> Any:
        """Return the parser of click with these checks."""
        parser: Any = super().make_parser(ctx)
        parse = parser.parse_args

        def parsed(args: list[str]) -> Any:
            values, rest, order = parse(args)
            _check(values, order)
            return values, rest, order

        parser.parse_args = parsed
        return parser


def _check(values: dict[str, Any], order: list[Any]) -> None:
    """CreepkitError for options that were given in a way that cannot be meant; order : as they were given."""
    seen = set()
    for option in order:
        if option.param_type_name != "option" or option.is_flag or option.count:
            continue
        name = max(option.opts, key=len)
        if option.name in seen and not option.multiple:
            raise CreepkitError(f"{name} is given twice; keep one of them")
        seen.add(option.name)
        given = values.get(option.name)
        for text in given if isinstance(given, list | tuple) else (given,):
            if isinstance(text, str) and not text.strip():
                raise CreepkitError(f"{name} is empty; give a value, or leave the option out")
            if isinstance(text, str) and _is_number(option) and (not text.isascii() or "_" in text):
                raise CreepkitError(f"{name} {quoted(text)}: write a number without underscores, such as 1000")


def _is_number(option: Any) -> bool:
    """Whether an option takes whole numbers or others; typer before 0.27 has types of click in its options."""
    described = getattr(option, "type_descriptor", None)
    if described is not None:
        return described.annotation in (int, float)
    return option.type.name.partition(" ")[0] in ("integer", "float")
