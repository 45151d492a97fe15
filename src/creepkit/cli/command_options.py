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
import math
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import MISSING, dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import typer

from creepkit.errors import ArgumentError, CreepkitError, quoted
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
        if self.kind == "folder" and path.suffix != ".py":
            check_folder_target(path, CreepkitError, self.names)
        else:
            check_target(path, CreepkitError, force=force or self.kind == "resumed")
        if self.kind == "picture":
            from creepkit.reports.figures import check_picture_format

            check_picture_format(path)


FORCE = Annotated[bool, typer.Option("--force", help="Overwrite files that creepkit did not write.")]


def checked(command: Callable[..., None]) -> Callable[..., None]:
    """The command as typer takes it; it is called with values once what its options declare was checked."""
    parameters: list[inspect.Parameter] = []
    generated: dict[str, tuple[str, Option]] = {}
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
            generated |= {one.name: (parameter.name, one) for one in own}
        elif declared is not None:
            one = replace(declared.named(parameter.name, kind), default=parameter.default)
            generated[parameter.name] = ("", one)
        else:
            parameters.append(parameter.replace(annotation=hints[parameter.name]))
    parameters += [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=_default(one), annotation=_annotation(one))
        for name, (_, one) in generated.items()
    ]
    if outputs:
        parameters.append(inspect.Parameter("force", inspect.Parameter.KEYWORD_ONLY, default=False, annotation=FORCE))
    records = [name for name, hint in hints.items() if any(_is_record(one) for one in get_args(hint)[1:])]

    @functools.wraps(command)
    def run(**options: Any) -> None:
        force = bool(options.pop("force", False))
        given: dict[str, dict[str, Any]] = {name: {} for name in records}
        for name, (group, one) in generated.items():
            value = given_value(one, options.pop(name))
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


# ---- text forms ------------------------------------------------------------------------------------------------------


def parsed_number(text: str) -> float:
    """The finite number that a text is; ValueError for digits of other scripts and 1_000, which Python would take."""
    number = float(text)
    if not text.isascii() or "_" in text or not math.isfinite(number):
        raise ValueError(text)
    return number


def parsed_integer(text: str) -> int:
    """The whole number that a text is; ValueError as parsed_number()."""
    parsed_number(text)
    return int(text)


def pair(text: str, separator: str = "=") -> tuple[str, str]:
    """Both sides of a separator, without spaces; ValueError where one of them is missing."""
    name, found, value = (part.strip() for part in text.partition(separator))
    if not (name and found and value):
        raise ValueError(text)
    return name, value


@dataclass(frozen=True)
class TextForm:
    """How values of a type are written: a text, or several; parse : raises ValueError or an error of ours."""

    metavar: str
    parse: Callable[[Any], Any]
    several: bool = False


NEXT_NAME = re.compile(r",(?=\s*\w[\w.-]*\s*=)")
"""The comma before another NAME=VALUE."""


def _by_name(
    parse: Callable[[str], Any], texts: Sequence[str], *, nested: bool = False, several: bool = False
) -> dict[str, Any]:
    """{name: value} from texts NAME=VALUE or A=VALUE,B=VALUE; nested : {group: {name: value}} from GROUP.NAME=VALUE.

    several : values of a name with commas between them; one that is given again has further values.
    """
    values: dict[str, Any] = {}
    for text in (part for whole in texts for part in NEXT_NAME.split(whole)):
        name, value = pair(text)
        group, dot, key = name.rpartition(".") if nested else ("", "", name)
        if nested and not dot:
            raise ValueError(text)
        inner = values.setdefault(group, {}) if nested else values
        if key in inner and not several:
            raise CreepkitError(f"{name} is given twice; keep one of them")
        inner[key] = (*inner.get(key, ()), *_listed(parse, value)) if several else parse(value)
    return values


def _listed(parse: Callable[[str], Any], text: str) -> tuple[Any, ...]:
    return tuple(parse(part.strip()) for part in text.split(","))


def _range(text: str) -> tuple[float, float]:
    low, high = (parsed_number(end) for end in text.split(":"))
    return low, high


def _word_or_numbers(words: Sequence[str], text: str) -> Any:
    return text if text in words else _by_name(parsed_number, [text])


def _is_mapping(hint: Any) -> bool:
    origin = get_origin(hint)
    return isinstance(origin, type) and issubclass(origin, Mapping)


@functools.cache
def text_form(hint: Any) -> TextForm:
    """The text form of a type; TypeError for one that has none."""
    origin, parts = get_origin(hint), get_args(hint)
    if hint in SPECIAL:
        return SPECIAL[hint]
    of_records = any(getattr(one, "__module__", "").startswith("creepkit.records") for one in (hint, *parts))
    if of_records and hint in _forms_of_records():
        return _forms_of_records()[hint]
    if origin is Union or type(hint).__name__ == "UnionType":
        others = tuple(one for one in parts if one is not type(None))
        words = next((get_args(one) for one in others if get_origin(one) is Literal), None)
        if words is not None and len(others) > 1:
            return TextForm(f"{'|'.join(words)}|NAME=NUMBER,...", functools.partial(_word_or_numbers, words))
        return text_form(others[0])
    if origin is Literal:
        return TextForm("|".join(parts), str)
    if origin is tuple and Ellipsis in parts and get_origin(parts[0]) is tuple:
        item = text_form(parts[0])
        return TextForm(item.metavar, lambda texts: tuple(item.parse(text) for text in texts), several=True)
    if origin is tuple and Ellipsis in parts:
        item = text_form(parts[0])
        return TextForm(f"{item.metavar},...", functools.partial(_listed, item.parse))
    if origin is tuple and parts == (float, float):
        return TextForm("LOW:HIGH", _range)
    if _is_mapping(hint):
        value, nested = parts[1], _is_mapping(parts[1])
        several = get_origin(value) is not None and not nested and get_args(value) != (float, float)
        item = text_form(get_args(value)[1] if nested else get_args(value)[0] if several else value)
        metavar = f"{'GROUP.' * nested}NAME={item.metavar}{',...' * several}"
        parse = functools.partial(_by_name, item.parse, nested=nested, several=several)
        return TextForm(metavar, parse, several=True)
    raise TypeError(f"no option is made of {hint}; give its text form in SPECIAL")


def steps(texts: Sequence[str]) -> tuple[tuple[float, float], ...]:
    """(start in s, value) pairs from texts such as 100 and 3600:120."""
    parts = [text.rpartition(":") for text in texts]
    return tuple((parsed_number(start or "0"), parsed_number(value)) for start, _, value in parts)


Levels = tuple[tuple[str, float, float], ...]
"""Steps of a load, or of its components: (component or "", start in s, value)."""


def level(text: str) -> tuple[str, float, float]:
    """Component, start in s and value of a text such as 100, 3600:120 or 11=100."""
    component, value = pair(text) if "=" in text else ("", text)
    return component, *steps([value])[0]


def _part(text: str) -> tuple[int, int]:
    k, n = (parsed_integer(part) for part in pair(text, "/"))
    if not 1 <= k <= n:
        raise ValueError(text)
    return k, n


def _surrogate(name: str) -> Any:
    import creepkit as ck

    return ck.surrogate(name)


SPECIAL: dict[Any, TextForm] = {
    tuple[int, int]: TextForm("K/N", _part),
    tuple[str, float, float]: TextForm("[S:]NUMBER", level),
    tuple[tuple[float, float], ...]: TextForm("[S:]NUMBER", steps, several=True),
    Path: TextForm("PATH", Path),
    int: TextForm("INTEGER", parsed_integer),
    float: TextForm("NUMBER", parsed_number),
    str: TextForm("TEXT", str),
}
"""Text forms of types that are not made of others."""


@functools.cache
def _forms_of_records() -> dict[Any, TextForm]:
    """Those of records, which are imported for the commands that take them alone."""
    from creepkit.records import Nuisance, Predictor
    from creepkit.studies.arguments import NUISANCE_SYNTAX, nuisances_of_texts

    return {
        Predictor: TextForm("NAME", _surrogate),
        tuple[Nuisance, ...]: TextForm(NUISANCE_SYNTAX, nuisances_of_texts, several=True),
    }


def default_text(one: Option) -> str:
    """The limits and the default, where a line can say it."""
    limits = f"{one.limits.low:g} to {one.limits.high:g}" if one.limits and one.limits.high < 1e6 else ""
    default = one.default
    if default in (MISSING, None, inspect.Parameter.empty, {}, ()) or isinstance(default, bool):
        text = ""
    elif isinstance(default, int | float):
        text = f"{(default - one.offset) / one.scale:g}"
    elif isinstance(default, tuple):
        text = ",".join(str(getattr(part, "kind", part)) for part in default)
    else:
        text = str(default)
    parts = ([limits] if limits else []) + ([f"default: {text}"] if text else [])
    return f" [{'; '.join(parts)}]" if parts else ""


NOTHING = object()
"""What `none` is of an option that may be None, and is not without it."""


def _without_unit(one: Option, text: Any) -> Any:
    """What was written, without the unit of the option behind its numbers, as in 1e4h."""
    if not one.unit or not isinstance(text, str):
        return text
    return re.sub(rf"(?<=[\d.])\s?{re.escape(one.unit)}(?=,|:|$)", "", text)


def given_value(one: Option, text: Any) -> Any:
    """The value of what was written, in creepkit's unit; None where the option was not given.

    ArgumentError, which names the option, for what is not understood or beyond its limits.
    """
    if text is None or text == [] or isinstance(text, bool):
        return text if isinstance(text, bool) else None
    if text == "none" and one.is_optional and one.default is not None:
        return NOTHING
    form, text = text_form(one.type), _without_unit(one, text)
    shown = quoted(" ".join(text) if isinstance(text, list) else text)
    try:
        value = form.parse(text)
    except (CreepkitError, ValueError) as problem:
        if isinstance(problem, CreepkitError):
            raise ArgumentError(f"{one.flag} {shown}: {problem}") from None
        example = f", such as {one.example}" if one.example else ""
        raise ArgumentError(f"{one.flag} {shown} is not known; write {one.metavar or form.metavar}{example}") from None
    if wrong := one.kind.mismatch(value):
        raise ArgumentError(wrong.sentence(one.flag))
    return one.converted(value)
