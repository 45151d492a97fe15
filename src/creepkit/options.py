"""Options of a verb, declared once: keyword arguments, command options and study keys are made of one record.

    @checked
    @dataclass(frozen=True)
    class IdentificationSettings(Options, title="settings of an identification"):
        starts: int = option(8, "Starts of the search.", Limits(1, 10_000))
        rupture_times: Literal["auto", "use", "ignore"] = option("auto", "Whether rupture times are compared.")

A field has its type, default, help, limits and unit here and nowhere else. Words are those of a Literal. A field whose
commands and study files use another unit than Python says so by `unit`, and `scale` or `offset`; the unit stands in
their names, as in --end-h and end_h.

- Python: `@takes_options(IdentificationSettings)` gives a function with `**changes` the fields as keyword arguments in
  its signature; `settings.changed(changes)` is the record with them.
- Command line: a parameter `settings: Annotated[dict[str, Any], IdentificationSettings]` of a command becomes an option
  for each field, and holds the values that were given, ready for `changed()` (see cli.command_options).
- Studies: `table_of(IdentificationSettings, base)` is a strict model with a key for each field, None where it is
  missing; `values_of_table()` gives the values that a table states, in creepkit's units, ready for `changed()`.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields, replace
from types import UnionType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self, TypeVar, Union, get_args, get_origin, get_type_hints

from creepkit.checked_arguments import Kind, kind_of
from creepkit.errors import ArgumentError, refuse_unknown
from creepkit.limits import FINITE, Limits

if TYPE_CHECKING:
    from pydantic import BaseModel

Function = TypeVar("Function", bound=Callable[..., Any])

HOURS: dict[str, Any] = {"unit": "h", "scale": 3600.0}
CELSIUS: dict[str, Any] = {"unit": "C", "offset": 273.15}
GIGAPASCAL: dict[str, Any] = {"unit": "GPa", "scale": 1e3}
"""Units of commands and study files for what Python has in s, K and MPa."""


@dataclass(frozen=True)
class Option:
    """What a field of a record declares beside its type and default.

    help : one sentence. limits : of its numbers, in the unit of commands and study files. unit : of these; a value in
    it times `scale` plus `offset` is the one of Python. key : its name there, by default the field's with the unit.
    flag : of the command line, where it is not the key's, as that of an option which is given once for each part.
    metavar, example : of its value there, where its type does not say them. python_only : whether it has
    neither an option nor a key.
    """

    name: str = ""
    type: Any = None
    default: Any = None
    help: str = ""
    limits: Limits | None = None
    unit: str = ""
    scale: float = 1.0
    offset: float = 0.0
    key: str = ""
    flag: str = ""
    metavar: str = ""
    example: str = ""
    python_only: bool = False

    @property
    def is_optional(self) -> bool:
        """Whether None is a value."""
        return type(None) in _alternatives(self.type)

    @property
    def kind(self) -> Kind:
        """What a value of a command or a study file may be."""
        return kind_of(self.type, self.limits or FINITE)

    def named(self, name: str, type: Any) -> Option:
        """The option of a field or an argument of this name and type, with its key and its flag."""
        key = self.key or (f"{name}_{self.unit}" if self.unit else name)
        flag = f"--{self.flag or key.lower().replace('_', '-')}"
        return replace(self, name=name, type=type, key=key, flag=flag)

    def converted(self, value: Any) -> Any:
        """A value of a command or a study file, numbers at any depth, in the unit of Python; lists as tuples."""
        if isinstance(value, list | tuple):
            return tuple(self.converted(one) for one in value)
        if isinstance(value, Mapping):
            return {name: self.converted(one) for name, one in value.items()}
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        return value * self.scale + self.offset if is_number and (self.scale, self.offset) != (1.0, 0.0) else value


def option(default: Any, help: str, limits: Limits | None = None, **further: Any) -> Any:
    """A field of a record with this default; further : as Option has it. A default that is called makes one."""
    if limits is not None and isinstance(default, float):
        limits = replace(limits, whole=False)  # Limits(0, 1) of a share allows 0.5
    declared = Option(help=help, limits=limits, **further)
    metadata: dict[str, Any] = {"option": declared}
    if limits is not None:
        low, high = declared.converted(limits.low), declared.converted(limits.high)
        metadata["limits"] = replace(limits, low=low, high=high)
    if default is MISSING:
        return field(metadata=metadata)
    if callable(default):
        return field(default_factory=default, metadata=metadata)
    return field(default=default, metadata=metadata)


class Options:
    """Base of the records, which are @checked; changes some of their fields by name."""

    title: ClassVar[str] = ""
    fields_are_arguments: ClassVar[bool] = True
    __dataclass_fields__: ClassVar[dict[str, Any]]

    def __init_subclass__(cls, title: str = "") -> None:
        """Title : what the record is, in words."""
        cls.title = title or cls.title or cls.__name__

    def changed(self, changes: Mapping[str, Any]) -> Self:
        """The record with fields changed by name; None leaves a field as it is, but where None is a value of it."""
        known = {one.name: one for one in options_of(type(self))}
        for name in changes:
            refuse_unknown(name, known, ArgumentError, f"{self.title} have no '{name}'")
        given = {name: value for name, value in changes.items() if value is not None or known[name].is_optional}
        return replace(self, **given) if given else self


def options_of(record: type[Any]) -> tuple[Option, ...]:
    """The options of a record, in the order of its fields; those without a declaration are of Python alone."""
    if "_options" in record.__dict__:
        return record.__dict__["_options"]  # type: ignore[no-any-return]
    hints, options = get_type_hints(record), []
    for one in fields(record):
        declared = one.metadata.get("option", Option(python_only=True)).named(one.name, hints[one.name])
        default = one.default_factory() if one.default_factory is not MISSING else one.default
        options.append(replace(declared, default=default))
    record._options = tuple(options)
    return tuple(options)


def takes_options(*records: type[Options]) -> Callable[[Function], Function]:
    """The function, which has `**changes`, with the fields of records as keyword arguments in its signature."""

    def decorate(function: Function) -> Function:
        signature = inspect.signature(function)
        own = [one for one in signature.parameters.values() if one.kind is not inspect.Parameter.VAR_KEYWORD]
        further = [
            inspect.Parameter(one.name, inspect.Parameter.KEYWORD_ONLY, default=one.default, annotation=one.type)
            for record in records
            for one in options_of(record)
            if one.name not in signature.parameters
        ]
        function.__signature__ = signature.replace(parameters=[*own, *further])  # type: ignore[attr-defined]
        return function

    return decorate


def table_of(
    record: type[Options],
    base: type[BaseModel],
    *,
    types: Mapping[Any, Any] | None = None,
    without: Sequence[str] = (),
    only: Sequence[str] | None = None,
    **further: Any,
) -> Any:
    """A strict model of a table of a study file: a key for each option, None where it is missing.

    base : of the model, with its settings. types : {type of a field: that of its key}, where TOML has none of the kind.
    without : fields that are no keys. only : the fields that are keys, with their defaults, where a table has some of a
    record for all that the study does. further : keys beside, {key: (type, default)} as pydantic has them.
    """
    from pydantic import Field, create_model

    keys: dict[str, Any] = {}
    for one in options_of(record):
        if one.python_only or one.name in without or (only is not None and one.name not in only):
            continue
        hint = _toml_type(one.type, one.limits, types or {})
        keys[one.key] = (
            (hint | None, Field(None, description=one.help)) if only is None
            else (hint, Field(one.default, description=one.help))
        )  # fmt: skip
    return create_model(record.__name__, __base__=base, **{**keys, **further})


def values_of_table(record: type[Options], table: Any) -> dict[str, Any]:
    """{field: value} of what a table of a study file states, in creepkit's units."""
    stated = {one.name: (one, getattr(table, one.key, None)) for one in options_of(record)}
    return {name: one.converted(value) for name, (one, value) in stated.items() if value is not None}


def _toml_type(hint: Any, limits: Limits | None, types: Mapping[Any, Any]) -> Any:
    """The type of a key for the type of a field: lists for tuples, numbers within their limits."""
    from pydantic import Field

    if hint in types:
        return types[hint]
    origin, parts = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        return functools.reduce(
            lambda a, b: a | b, [_toml_type(one, limits, types) for one in parts if one is not type(None)]
        )
    if hint in (int, float) and limits is not None:
        low: dict[str, Any] = {"gt" if limits.above else "ge": limits.low}
        return Annotated[hint, Field(**low, le=limits.high)]
    if origin is tuple:
        length: Any = {"min_length": 1} if Ellipsis in parts else {"min_length": len(parts), "max_length": len(parts)}
        return Annotated[list[_toml_type(parts[0], limits, types)], Field(**length)]  # type: ignore[misc]
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return dict[str, _toml_type(parts[1], limits, types)]  # type: ignore[misc]
    if isinstance(origin, type) and issubclass(origin, Sequence | Iterable):
        return list[_toml_type(parts[0], limits, types)]  # type: ignore[misc]
    return hint


def _alternatives(hint: Any) -> tuple[Any, ...]:
    """The types that a union is made of, or the type itself."""
    return get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
