"""What options declare beside their type: where a command writes, and which numbers it takes; checked before it begins.

`Annotated[Path | None, typer.Option(...), OutputPath("picture")]` names a file that the command writes, and brings the
command the option `--force`; `Annotated[int, typer.Option(...), limits.STARTS]` a number with its limits, which the
help quotes. A test holds every number and every output of every command to such a declaration.
"""

from __future__ import annotations

import copy
import functools
import inspect
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import typer
from typer.models import ParameterInfo

from creepkit.cli.generated_options import command_options, given_values, parameter_of
from creepkit.errors import CreepkitError
from creepkit.files.writing import check_folder_target, check_target, overwriting
from creepkit.limits import Limits
from creepkit.options import Options


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
    """The command with what its options declare checked before it begins, and with `--force` where it writes."""
    hints = get_type_hints(command, include_extras=True)
    records = {name: found for name, hint in hints.items() if (found := _record_of(hint)) is not None}
    outputs = {name: found for name, hint in hints.items() if (found := _declared(hint, OutputPath)) is not None}
    limits = {name: found for name, hint in hints.items() if (found := _declared(hint, Limits)) is not None}
    signature = inspect.signature(command)
    parameters = {
        name: parameter.replace(annotation=_quoting(hints[name], limits.get(name)))
        for name, parameter in signature.parameters.items()
        if name not in records
    }
    generated = {one.name: (name, one) for name, record in records.items() for one in command_options(record)}
    for field, (_, one) in generated.items():
        parameters[field] = inspect.Parameter(
            field, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=parameter_of(one)
        )
    own_force = "force" in parameters
    if outputs and not own_force:
        parameters["force"] = inspect.Parameter(
            "force", inspect.Parameter.KEYWORD_ONLY, default=False, annotation=FORCE
        )

    @functools.wraps(command)
    def run(**options: Any) -> None:
        force = bool(options["force"] if own_force else options.pop("force", False))
        _check_numbers(options, limits, parameters)
        texts = {field: options.pop(field) for field in generated}
        for name, record in records.items():
            options[name] = given_values(
                record, {field: texts[field] for field in texts if generated[field][0] == name}
            )
        with overwriting() if force else nullcontext():
            for name, output in outputs.items():
                if options.get(name) is not None:
                    output.check(options[name], force=force)
            command(**options)

    run.__signature__ = signature.replace(parameters=list(parameters.values()))  # type: ignore[attr-defined]
    run.__annotations__ = {name: parameter.annotation for name, parameter in parameters.items()}
    run.__annotations__["return"] = None
    del run.__wrapped__  # whose annotations typer would read instead
    return run


def _record_of(hint: Any) -> type[Options] | None:
    """The record of options that a parameter stands for; None for another parameter."""
    metadata = get_args(hint)[1:] if get_origin(hint) is Annotated else ()
    return next((one for one in metadata if isinstance(one, type) and issubclass(one, Options)), None)


def _declared(hint: Any, kind: type) -> Any:
    """What the annotation of a parameter holds of a kind; None where it holds none."""
    metadata = get_args(hint)[1:] if get_origin(hint) is Annotated else ()
    return next((one for one in metadata if isinstance(one, kind)), None)


def _quoting(hint: Any, limits: Limits | None) -> Any:
    """The annotation with the limits of a number in its help."""
    info = _declared(hint, ParameterInfo)
    if limits is None or info is None:
        return hint
    info = copy.copy(info)
    low = "above " if limits.above else ""
    info.help = f"{info.help} [{low}{limits.low:.6g} to {limits.high:.6g}]"
    return Annotated[get_args(hint)[0], info]


def _check_numbers(
    options: Mapping[str, Any], limits: Mapping[str, Limits], parameters: Mapping[str, inspect.Parameter]
) -> None:
    """CreepkitError for a number that is not within its limits."""
    for name, allowed in limits.items():
        value = options.get(name)
        for number in value if isinstance(value, list | tuple) else () if value is None else (value,):
            if number not in allowed:
                raise CreepkitError(f"{option_name(name, parameters)} {number:.12g}: allowed are {allowed}")


def option_name(name: str, parameters: Mapping[str, inspect.Parameter]) -> str:
    """How a parameter of a command is written on the command line."""
    info = _declared(parameters[name].annotation, ParameterInfo)
    declared = (
        getattr(info, "default", None),
        *(getattr(info, "param_decls", None) or ()),
    )  # the first is the default to typer
    words = [word for word in declared if isinstance(word, str) and word.startswith("--")]
    return words[0] if words else f"--{name.replace('_', '-')}"
