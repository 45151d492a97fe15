"""Commands made of functions: options from records, numbers with their limits, places of everything that is written.

A parameter of a command is one of

- `Annotated[str, typer.Argument(...)]` or `typer.Option(...)`, as typer has it; with `OutputPath("picture")` beside it
  the path is checked before the command begins, and the command has the option `--force`;
- `Annotated[float | None, Option(help=..., limits=...)]`, an option whose text, unit and limits are those of its type
  and declaration, see creepkit.options;
- `Annotated[dict[str, Any], Record]`, an option for each field of a record: {field: value} of those that were given.
  Fields named behind it, as in `Annotated[dict[str, Any], Training, ("epochs", "rate")]`, are those taken alone.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_type_hints

import typer
from typer.core import TyperCommand

from creepkit.cli.generated_options import NOTHING, default_text, given_value, text_form
from creepkit.errors import CreepkitError
from creepkit.files.writing import check_folder_target, check_target, overwriting
from creepkit.options import Option, Options, options_of


@dataclass(frozen=True)
class OutputPath:
    """An option that names what a command writes.

    kind : a file; a picture; a folder; or a file that is "resumed": the same command reads what is there, and refuses
        anything else itself. names : of files in the folder, as far as they are always the same.
    """

    kind: Literal["file", "picture", "folder", "resumed"] = "file"
    names: tuple[str, ...] = ()

    def check(self, path: Path, *, force: bool) -> None:
        """Raise CreepkitError where nothing can be written to `path`, or by force alone."""
        if self.kind == "folder":
            check_folder_target(path, CreepkitError, self.names)
        else:
            check_target(path, CreepkitError, force=force or self.kind == "resumed")
        if self.kind == "picture":
            from creepkit.reports.figures import check_picture_format

            check_picture_format(path, CreepkitError)


FORCE = Annotated[bool, typer.Option("--force", help="Overwrite files that creepkit did not write.")]


def checked(command: Callable[..., None]) -> Callable[..., None]:
    """The command as typer takes it; it is called with values once what its options declare was checked."""
    parameters: list[inspect.Parameter] = []
    generated: dict[str, tuple[str, Option, type[CreepkitError]]] = {}
    outputs: dict[str, OutputPath] = {}
    hints = get_type_hints(command, include_extras=True)
    for parameter in inspect.signature(command).parameters.values():
        kind, *beside = get_args(hints[parameter.name]) or (hints[parameter.name],)
        record = next(filter(_is_record, beside), None)
        declared = next((one for one in beside if isinstance(one, Option)), None)
        output = next((one for one in beside if isinstance(one, OutputPath)), None)
        if output is not None:
            outputs[parameter.name] = output
        if record is not None:
            names = next((one for one in beside if isinstance(one, tuple)), None)
            own = [one for one in options_of(record) if not one.python_only and (names is None or one.name in names)]
            generated |= {one.name: (parameter.name, one, record.error) for one in own}
        elif declared is not None:
            one = replace(declared.named(parameter.name, kind), default=parameter.default)
            generated[parameter.name] = ("", one, CreepkitError)
        else:
            parameters.append(parameter.replace(annotation=hints[parameter.name]))
    parameters += [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=_default(one), annotation=_annotation(one))
        for name, (_, one, _) in generated.items()
    ]
    own_force = any(one.name == "force" for one in parameters)
    if outputs and not own_force:
        parameters.append(inspect.Parameter("force", inspect.Parameter.KEYWORD_ONLY, default=False, annotation=FORCE))
    records = [name for name, hint in hints.items() if any(_is_record(one) for one in get_args(hint)[1:])]

    @functools.wraps(command)
    def run(**options: Any) -> None:
        force = bool(options["force"] if own_force else options.pop("force", False))
        given: dict[str, dict[str, Any]] = {name: {} for name in records}
        for name, (group, one, error) in generated.items():
            value = given_value(one, options.pop(name), error)
            stated = None if value is NOTHING else value
            if not group:
                options[name] = one.default if value is None else stated
            elif value is not None:
                given[group][name] = stated
        with overwriting() if force else nullcontext():
            for name, output in outputs.items():
                if options.get(name) is not None:
                    output.check(options[name], force=force)
            command(**options, **given)

    order = [one.replace(kind=inspect.Parameter.KEYWORD_ONLY) for one in parameters]
    run.__signature__ = inspect.Signature(order)  # type: ignore[attr-defined]
    run.__annotations__ = {one.name: one.annotation for one in parameters}
    del run.__wrapped__  # whose annotations typer would read instead
    return run


def _is_record(one: Any) -> bool:
    return isinstance(one, type) and issubclass(one, Options)


def _annotation(one: Option) -> Any:
    """The annotation with which typer makes an option; its text is read when the command is called."""
    help = f"{one.help}{default_text(one)}"
    if bool in (one.type, *get_args(one.type)):
        flag = one.flag if one.default is False else f"{one.flag}/--no-{one.flag[2:]}"
        return Annotated[bool | None, typer.Option(flag, help=help)]
    form = text_form(one.type)
    kind: Any = list[str] if form.several else str
    optional = kind if _default(one) is inspect.Parameter.empty else kind | None
    return Annotated[optional, typer.Option(one.flag, metavar=one.metavar or form.metavar, help=help)]


def _default(one: Option) -> Any:
    return inspect.Parameter.empty if one.default is inspect.Parameter.empty else None


class CheckedCommand(TyperCommand):
    """A command that refuses, in one sentence, options given twice and empty values: click takes the last of two."""

    def make_parser(self, ctx: Any) -> Any:
        """Return the parser of click with these checks."""
        parser: Any = super().make_parser(ctx)
        parse = parser.parse_args

        def parsed(args: list[str]) -> Any:
            values, rest, order = parse(args)
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
            return values, rest, order

        parser.parse_args = parsed
        return parser
