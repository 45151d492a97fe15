"""Command options made of records of options: a text form for each type of a field, stated once.

A parameter `settings: Annotated[dict[str, Any], IdentificationSettings]` of a command stands for an option of every
field of that record; the command is called with {field: value} of those that were given, in creepkit's units.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, dataclass, replace
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import typer

from creepkit.errors import CreepkitError, quoted
from creepkit.options import Option, Options, options_of


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


def _words(words: Sequence[str], text: str) -> str:
    if text not in words:
        raise ValueError(text)
    return text


def _by_name(parse: Callable[[str], Any], texts: Sequence[str]) -> dict[str, Any]:
    """{name: value} from texts NAME=VALUE; a name with a dot, A.C=20, leads into a dictionary of its own."""
    values: dict[str, Any] = {}
    for text in texts:
        name, value = pair(text)
        group, _, key = name.rpartition(".")
        inner = values.setdefault(group, {}) if group else values
        if key in inner:
            raise CreepkitError(f"{text}: {name} is given twice; keep one of them")
        inner[key] = parse(value)
    return values


def _listed(parse: Callable[[str], Any], text: str) -> tuple[Any, ...]:
    return tuple(parse(part.strip()) for part in text.split(","))


def _range(text: str) -> tuple[float, float]:
    low, high = (parsed_number(end) for end in text.split(":"))
    return low, high


def _output_weights(words: Sequence[str], text: str) -> Any:
    return text if text in words else _by_name(parsed_number, text.split(","))


@functools.cache
def text_form(hint: Any) -> TextForm:
    """The text form of a type; TypeError for one that has none."""
    origin, parts = get_origin(hint), get_args(hint)
    if hint in SPECIAL:
        return SPECIAL[hint]
    if origin is Union or type(hint).__name__ == "UnionType":
        others = tuple(one for one in parts if one is not type(None))
        words = next((get_args(one) for one in others if get_origin(one) is Literal), None)
        if words is not None and len(others) > 1:
            return TextForm(f"{'|'.join(words)}|NAME=NUMBER,...", functools.partial(_output_weights, words))
        return text_form(others[0])
    if origin is Literal:
        return TextForm("|".join(parts), functools.partial(_words, parts))
    if origin is tuple and Ellipsis in parts:
        item = text_form(parts[0])
        return TextForm(f"{item.metavar},...", functools.partial(_listed, item.parse))
    if origin is tuple and parts == (float, float):
        return TextForm("LOW:HIGH", _range)
    if isinstance(origin, type) and issubclass(origin, Mapping):
        inner = get_args(parts[1])
        is_nested = isinstance(get_origin(parts[1]), type) and issubclass(get_origin(parts[1]), Mapping)
        item = text_form(inner[1] if is_nested else parts[1])
        name = "GROUP.NAME" if is_nested else "NAME"
        return TextForm(f"{name}={item.metavar}", functools.partial(_by_name, item.parse), several=True)
    raise TypeError(f"no option is made of {hint}; give its text form in SPECIAL")


def _nuisances(texts: Sequence[str]) -> Any:
    from creepkit.inverse.settings import default_nuisances

    without = [kind.strip() for kind, _, value in (text.partition("=") for text in texts) if value.strip() == "none"]
    return default_nuisances(*(_nuisance(t) for t in texts if t.partition("=")[2].strip() != "none"), without=without)


NUISANCE_SYNTAX = "KIND[=MEAN[:SD]][@START][ for TESTS]"
"""KIND=none leaves a default out; TESTS is test, alloy or all, or names with commas between them, which share one."""


def _nuisance(text: str) -> Any:
    """One nuisance, from text of NUISANCE_SYNTAX, such as "temperature step=0:30@8250 for all"."""
    from creepkit.records import Nuisance

    definition, _, whose = text.partition(" for ")
    definition, _, start = definition.partition("@")
    kind, _, numbers = definition.partition("=")
    mean, _, sd = numbers.partition(":")
    tests = tuple(name.strip() for name in whose.split(",") if name.strip())
    scope: Any = tests[0] if tests in (("test",), ("alloy",), ("all",)) else "all" if tests else "test"
    return Nuisance(
        kind.strip(),
        scope,
        mean=parsed_number(mean or "0"),
        sd=parsed_number(sd) if sd else None,
        start=parsed_number(start or "0"),
        tests=() if tests == (scope,) else tests,
    )


def _special() -> dict[Any, TextForm]:
    """Text forms of types that are not made of others."""
    from creepkit.records import Nuisance

    return {
        int: TextForm("INTEGER", parsed_integer),
        float: TextForm("NUMBER", parsed_number),
        str: TextForm("TEXT", str),
        tuple[Nuisance, ...]: TextForm(NUISANCE_SYNTAX, _nuisances, several=True),
    }


SPECIAL = _special()


def command_options(record: type[Any]) -> list[Option]:
    """The options of a record that commands have."""
    return [one for one in options_of(record) if not one.python_only]


def parameter_of(one: Option) -> Any:
    """The annotation with which typer makes the option of a field."""
    name = one.flag
    help = f"{one.help}{_default_text(one)}"
    if one.type is bool:
        return Annotated[bool | None, typer.Option(f"{name}/--no-{name[2:]}", help=help)]
    form = text_form(one.type)
    several: Any = list[str] if form.several else str
    return Annotated[several | None, typer.Option(name, metavar=one.metavar or form.metavar, help=help)]


def _default_text(one: Option) -> str:
    """The limits and the default, where a line can say it."""
    limits = f"{one.limits.low:g} to {one.limits.high:g}" if one.limits and one.limits.high < 1e6 else ""
    default = one.default
    if default is MISSING or default is None or isinstance(default, bool):
        text = ""
    elif isinstance(default, int | float):
        text = f"{(default - one.offset) / one.scale:g}"
    elif isinstance(default, tuple):
        text = ",".join(str(getattr(part, "kind", part)) for part in default)
    else:
        text = str(default)
    parts = ([limits] if limits else []) + ([f"default: {text}"] if text else [])
    return f" [{'; '.join(parts)}]" if parts else ""


def given_values(record: type[Options], texts: Mapping[str, Any]) -> dict[str, Any]:
    """{field: value} of the options that were given; an error of the record's kind names the option."""
    values = {}
    for one in command_options(record):
        text = texts.get(one.name)
        if text is None or text == []:
            continue
        values[one.name] = text if one.type is bool else _parsed(one, text, record.error)
        if one.limits is not None:
            _check_limits(one, values[one.name], record.error)
        values[one.name] = one.converted(values[one.name])
    return values


def _check_limits(one: Option, value: Any, error: type[CreepkitError]) -> None:
    """The error for a number beyond its limits, in the unit in which it was written."""
    replace(one, name=one.flag, scale=1.0, offset=0.0).check(value, error)


def _parsed(one: Option, text: Any, error: type[CreepkitError]) -> Any:
    form = text_form(one.type)
    shown = quoted(" ".join(text) if isinstance(text, list) else text)
    try:
        return form.parse(text)
    except ValueError as problem:
        if isinstance(problem, CreepkitError):
            raise error(f"{one.flag} {shown}: {problem}") from None
        example = f", such as {one.example}" if one.example else ""
        raise error(f"{one.flag} {shown} is not known; write {one.metavar or form.metavar}{example}") from None
    except CreepkitError as problem:
        raise error(f"{one.flag} {shown}: {problem}") from None
