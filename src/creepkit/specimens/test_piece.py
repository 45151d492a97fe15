"""TestPiece: a specimen as a frozen dataclass whose fields are the lengths of its test piece and its settings."""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Callable, Mapping
from dataclasses import Field, field, replace
from functools import lru_cache, wraps
from typing import Any, Self, TypeVar

from creepkit.checked_arguments import checked
from creepkit.errors import SolveError, refuse_unknown
from creepkit.records import (
    Dimension,
    History,
    Specimen,
    check_geometry,
    check_load,
    dimension_named,
    with_changed_history,
)

BASIC_NUISANCES = ("temperature", "modulus")
"""Kinds that every test piece follows: they change the history itself."""


Made = TypeVar("Made")


def kept(make: Callable[..., Made]) -> Callable[..., Made]:
    """What is made of a test piece, kept, for a fit needs it a thousand times; made anew for one without a hash."""
    cached = lru_cache(maxsize=256)(make)

    @wraps(make)
    def made(piece: Any, *further: Any) -> Made:
        try:
            hash(piece)
        except TypeError:
            return make(piece, *further)
        return cached(piece, *further)

    return made


@checked
def dimension(
    default: float,
    bounds: tuple[float, float] = (1e-3, 1e4),
    *,
    tolerance: float = 0.0,
    long_name: str = "",
    alias: str = "",
) -> Any:
    """A field of a TestPiece that is a length of it, mm; see records.Dimension.

    The name of the field is a key of history files, an option of the command line and a nuisance parameter.
    """
    return field(
        default=default,
        metadata={"dimension": {"bounds": bounds, "tolerance": tolerance, "long_name": long_name, "alias": alias}},
    )


class TestPiece(Specimen):
    """A specimen whose subclasses are frozen dataclasses; what `dimension()` marks are its lengths.

    `self.span` in its methods is the length of the test at hand: what the test states, or a nuisance parameter that is
    being estimated, takes the place of the default.
    """

    __test__ = False  # not a test case, whatever its name says to pytest

    def __new__(cls, *args: Any, **kwargs: Any) -> Self:
        """SolveError, with its signature, where a method that a subclass has to write is missing."""
        for method in sorted(getattr(cls, "__abstractmethods__", ())):
            own = [name for name, value in vars(cls).items() if inspect.isfunction(value)]
            near = difflib.get_close_matches(method, own, n=1, cutoff=0.55)
            arguments = ", ".join(inspect.signature(getattr(cls, method)).parameters)
            meant = f"; is {near[0]}() meant?" if near else ""
            raise SolveError(f"{cls.__name__} has no {method}(); write a method {method}({arguments}){meant}")
        return super().__new__(cls)

    @property
    def dimensions(self) -> tuple[Dimension, ...]:  # type: ignore[override]
        """The lengths of the test piece, with its own values as defaults."""
        marked = (f for f in _fields_of(self) if "dimension" in f.metadata)
        return tuple(Dimension(f.name, float(getattr(self, f.name)), **f.metadata["dimension"]) for f in marked)

    @property
    def nuisances(self) -> tuple[str, ...]:  # type: ignore[override]
        """Kinds of explicit nuisances that predict() understands: lengths, temperature and modulus."""
        return (*(name for d in self.dimensions for name in d.names), *BASIC_NUISANCES)

    def replace(self, **changes: Any) -> Self:
        """The same specimen with some fields changed."""
        known = {f.name for f in _fields_of(self) if f.init}
        if not known:
            raise SolveError(f"specimen '{self.name}' has no fields to replace; make its class a frozen dataclass")
        for name in changes:
            refuse_unknown(name, known, SolveError, f"specimen '{self.name}' has no field '{name}'")
        for length in (d for d in self.dimensions if d.name in changes):
            length.checked(changes[length.name], f"specimen '{self.name}'")
        changed: Self = replace(self, **changes)  # type: ignore[type-var]
        return changed

    def of_test(self, history: History, nuisances: Mapping[str, float]) -> tuple[Self, History]:
        """The test piece and the history of one test, as that test and its nuisances {kind: value} say.

        SolveError for a load that the specimen does not take, and for a length that it does not have. A nuisance
        parameter beyond the bounds of its length counts as at them.
        """
        check_load(self, history)
        check_geometry(self, history.geometry, history.origin)
        lengths = {name: self._length(name, value, history) for name, value in history.geometry.items()}
        for kind, value in nuisances.items():
            known = dimension_named(self, kind)
            if known is not None:  # what an estimate tries beyond the bounds is drawn back by its penalty
                lengths[known.name] = float(min(max(value, known.bounds[0]), known.bounds[1]))
        piece = self.replace(**lengths) if lengths and self.dimensions else self
        return piece, with_changed_history(history, nuisances)

    def _length(self, name: str, value: float, history: History) -> float:
        known = dimension_named(self, name)
        return value if known is None else known.checked(value, history.origin)


def _fields_of(record: object) -> tuple[Field[Any], ...]:
    """The fields of a dataclass; () of another class."""
    return tuple(getattr(type(record), "__dataclass_fields__", {}).values())
