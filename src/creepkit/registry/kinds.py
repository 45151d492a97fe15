"""The kinds of what plugins contribute, one row each, and the validation of what their hooks return.

Of a row follow the hook, the group of entry points, what `ck.available`, `creepkit list` and `creepkit new` know, and
the kit of `creepkit.testing` that checks it: the hook of "camera format" is the function `hookspecs.creepkit_cameras`,
its group "creepkit.cameras", its kit `check_camera_format`, and the file from which `creepkit new` starts, if there is
one, `cli/new_plugin/camera_format.py.txt`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from creepkit import hookspecs, language
from creepkit.errors import (
    CreepkitError,
    ExportError,
    HistoryError,
    LawError,
    PluginError,
    SolveError,
    nearest,
    quoted,
    raised_text,
)

T = TypeVar("T")


def group_of(hook: str) -> str:
    """The group of entry points of a hook: creepkit.laws of creepkit_laws."""
    return hook.replace("_", ".", 1)


@dataclass(frozen=True)
class PluginKind(Generic[T]):
    """One kind of contribution.

    label : one of it, in words. function : the hook that returns those of a plugin. error : raised of unknown names.
    record : gives the class that each must be, imported when there is one to check; None of functions, which come with
        their names. problem : says what is wrong with one, as the end of a sentence, or "".
    edit, use : of `creepkit new`: what its author edits first, and a command that uses it.
    listed : what `creepkit list` calls several, where that is another word.
    """

    label: str
    function: Callable[[], Sequence[T] | Mapping[str, T]]
    error: type[CreepkitError]
    record: Callable[[], type] | None = None
    problem: Callable[[Any], str] = lambda value: ""
    edit: str = ""
    use: str = ""
    listed: str = ""

    @property
    def hook(self) -> str:
        """The name of its hook."""
        return self.function.__name__

    @property
    def plural(self) -> str:
        """Several of it in one word, such as laws, or temperature-forms."""
        return self.hook.removeprefix("creepkit_").replace("_", "-")

    def named(self, returned: Any) -> dict[str, T]:
        """{name: object} of what a hook returned; PluginError when it is not what the hook promises."""
        if self.record is None:
            return _named_functions(returned)
        required: Any = self.record()
        promised = f"must return a list of {required.__name__} records, found"
        if not isinstance(returned, Sequence) or isinstance(returned, str):
            raise PluginError(f"{promised} {_type_text(returned)}{_remedy(returned)}")
        result: dict[str, Any] = {}
        for one in returned:
            if isinstance(one, type):
                raise PluginError(f"{promised} {_type_text(one)} in it; return an instance, {one.__name__}()")
            if not isinstance(one, required):
                raise PluginError(f"{promised} {_type_text(one)} in it{_missing_members(one, required)}")
            name: Any = getattr(one, "name")  # noqa: B009  of a type that is known at run time
            if not (isinstance(name, str) and name.strip()):
                raise PluginError(f"returned a {self.label} whose name is {name!r}; give it a short name in words")
            if name in result:
                raise PluginError(f"offers the {self.label} '{name}' twice; rename one")
            if wrong_with_it := self.problem(one):
                raise PluginError(f"returned the {self.label} '{name}', which {wrong_with_it}")
            result[name] = one
        return result


def _named_functions(returned: Any) -> dict[str, Any]:
    if not isinstance(returned, Mapping):
        raise PluginError(f"must return {{name: function of T_ref}}, found {_type_text(returned)}")
    for name, function in returned.items():
        if not callable(function):
            raise PluginError(f"must return {{name: function of T_ref}}, found {_type_text(function)} for '{name}'")
    return dict(returned)


def _specimen_problem(specimen: Any) -> str:
    """What is wrong with the record of a specimen, as the end of a sentence; "" where files and options can use it."""
    try:
        outputs, loads, lengths = map(tuple, (specimen.outputs, specimen.loads, specimen.dimensions))
        outputs += tuple(specimen.optional_outputs) if outputs else ()
        known = (*(str(name) for name in outputs), *(one.name for one in loads), *(one.name for one in lengths))
    except Exception as error:
        return (
            f"has a record that cannot be read: {raised_text(error)}; outputs are names, loads ck.Load, lengths fields"
        )
    if not outputs or not all(isinstance(name, str) for name in outputs):
        return f"has outputs {quoted(repr(outputs), 60)}; give at least one name, or ck.Output"
    if both := {str(o) for o in outputs} & {load.name for load in loads}:
        return f"has an output and a load called '{both.pop()}', which a file could not tell apart; rename one"
    for name in known:
        if name in _RESERVED_NAMES or name.endswith("_sd"):
            return f"calls something '{name}', which means something else in files or options; rename it"
    return ""


_RESERVED = """time used temperature modulus poisson jump_time end_time rupture ended label geometry offset rate control
ramp specimen name alloy operator set to help points every picture end_h modulus_gpa temperature_c level draws target
tolerance json plot"""


_RESERVED_NAMES = frozenset(_RESERVED.split())
"""Columns and keys of files, options of commands and kinds of nuisance parameters that every specimen has."""


def _missing_members(contribution: object, required: type) -> str:
    """What an object lacks of an interface, as the end of a sentence."""
    members = sorted(getattr(required, "__protocol_attrs__", ())) or [
        name for one in required.__mro__ for name in vars(one) if getattr(one, "_is_protocol", False) and name[0] != "_"
    ]
    missing = [name for name in members if not hasattr(contribution, name)]
    return f"; it has no {', '.join(missing)}" if missing else f"; derive its class from ck.{required.__name__}"


def _remedy(returned: Any) -> str:
    """What to do about something that is no list, as the end of a sentence."""
    if returned is None:
        return "; add a return statement"
    if isinstance(returned, Iterator):
        return "; return list(...) of it"
    return "; put it into a list" if hasattr(returned, "name") else ""


def _type_text(thing: Any) -> str:
    """Name something unexpected: a class by its own name, else by its type."""
    return f"the class {thing.__name__}" if isinstance(thing, type) else quoted(f"{type(thing).__name__} {thing!r}", 80)


def _records() -> Any:
    from creepkit import records  # which a law needs nothing of

    return records


LAWS = PluginKind(
    "law", hookspecs.creepkit_laws, LawError, lambda: language.CreepLaw,
    edit="its terms and params", use="creepkit list laws $name",
)  # fmt: skip
SPECIMENS = PluginKind(
    "specimen", hookspecs.creepkit_specimens, SolveError, lambda: _records().Specimen, _specimen_problem,
    edit="its lengths, outputs and one()", use="creepkit list specimens",
)  # fmt: skip
READERS = PluginKind(
    "reader", hookspecs.creepkit_readers, HistoryError, lambda: _records().Reader,
    edit="the names of files and columns", use="creepkit identify FOLDER --law norton",
)  # fmt: skip
CAMERAS = PluginKind("camera format", hookspecs.creepkit_cameras, HistoryError, lambda: _records().CameraFormat)
INSTRUMENTS = PluginKind(
    "instrument format", hookspecs.creepkit_instruments, HistoryError, lambda: _records().InstrumentFormat
)
EXPORTERS = PluginKind(
    "exporter", hookspecs.creepkit_exporters, ExportError, lambda: _records().Exporter, listed="targets",
    edit="text()", use="creepkit export norton --to $name --set A=1e-16 --set n=5",
)  # fmt: skip
MATERIALS = PluginKind(
    "material", hookspecs.creepkit_materials, LawError, lambda: _records().Material,
    edit="its values, ranges and source", use="creepkit list materials $name",
)  # fmt: skip
TEMPERATURE_FORMS = PluginKind("temperature form", hookspecs.creepkit_temperature_forms, LawError)


KINDS: tuple[PluginKind[Any], ...] = (
    *(LAWS, SPECIMENS, READERS, CAMERAS, INSTRUMENTS, EXPORTERS, MATERIALS, TEMPERATURE_FORMS),
)


LISTED = {one.listed or one.plural: one for one in KINDS}
"""{word of `creepkit list`: kind}."""


def kind(word: str) -> PluginKind[Any]:
    """The kind of a word, one or several, such as law, laws or temperature_forms; PluginError where there is none."""
    known = LISTED | {one.plural: one for one in KINDS}
    key = word.lower().replace("_", "-").replace(" ", "-")
    if key not in known and f"{key}s" not in known:
        raise PluginError(f"there is no kind of plugin '{word}'; {nearest(word, known)}")
    return known[key if key in known else f"{key}s"]
