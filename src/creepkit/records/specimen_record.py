"""What a specimen says of itself: its outputs, its loads and the lengths of its test piece."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any

from creepkit.checked_arguments import checked
from creepkit.errors import SolveError, refuse_unknown
from creepkit.records.quantities import QUANTITIES, QuantityKind, unit_of

NAME_PATTERN = re.compile(r"[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*")
"""Names of outputs, loads and dimensions: they become columns of files and options of the command line."""


VISIBLE_IN_NOISE = 10.0
"""An output that moved by so many standard deviations of its noise plainly shows creep."""


class _OfQuantity:
    """What has a quantity that decides its unit."""

    quantity: str

    @property
    def unit(self) -> str:
        """creepkit's own unit of it, "" for a number without one."""
        return unit_of(self.quantity)

    @property
    def kind(self) -> QuantityKind:
        """The units that files may give it in."""
        return QUANTITIES[self.quantity]


@checked
class Output(_OfQuantity, str):
    """The name of something that is observed of a test piece, with what is known about it.

    An output is its name: `Output("deflection", "length") == "deflection"`.

    quantity : "strain", "number", "length" (mm), "stress", "signed stress" or "pressure" (MPa), "force" (N), "moment"
        (N mm), "angle" (rad), "temperature" (K) or "time" (s); it decides the unit.
    long_name : what people call it, for axes and tables; its name with spaces by default.
    grows : whether it grows with creep while the load is held; a stress that relaxes does not.
    noise : standard deviation of a usual measurement, in its unit: what data sets and planted tests are made with. An
        identification takes what a test states or shows. None: not known.
    visible : how much of it plainly shows creep, in its unit; ten times the noise by default.
    change_of : the length of the test piece that grows by it, "-notch_diameter" of one that shrinks; "" for none. Files
        may then hold that length itself, or its relative change.
    """

    long_name: str
    grows: bool
    noise: float | None
    visible: float | None
    change_of: str

    def __new__(
        cls,
        name: str,
        quantity: str = "number",
        long_name: str = "",
        *,
        grows: bool = True,
        noise: float | None = None,
        visible: float | None = None,
        change_of: str = "",
    ) -> Output:
        """Check and keep what is said."""
        _check_name("output", name)
        _check_quantity(f"output '{name}'", quantity)
        for what, value in (("noise", noise), ("visible", visible)):
            if value is not None and not 0.0 < value < math.inf:
                raise SolveError(f"output '{name}': {what} is {value!r}; allowed is a number above zero, or None")
        output = super().__new__(cls, name)
        output.quantity, output.long_name = quantity, long_name or name.replace("_", " ")
        output.grows, output.noise = grows, noise
        output.change_of = change_of
        output.visible = visible if visible is not None else None if noise is None else VISIBLE_IN_NOISE * noise
        return output

    @property
    def logarithmic(self) -> bool:
        """Whether tests scatter, and are compared, by its logarithm: creep strains, which are those that grow."""
        return self.quantity == "strain" and self.grows

    @property
    def label(self) -> str:
        """Its long name and unit, for the axis of a plot."""
        return f"{self.long_name}, {self.unit}" if self.unit else self.long_name

    def __getnewargs_ex__(self) -> tuple[tuple[str, ...], dict[str, Any]]:
        """Copies and other processes get all of it."""
        names = ("grows", "noise", "visible", "change_of")
        return (str(self), self.quantity, self.long_name), {name: getattr(self, name) for name in names}


@checked
@dataclass(frozen=True)
class Load(_OfQuantity):
    """What can be imposed on a test piece: `Load("force", "force")`, `Load("pressure", "pressure")`.

    quantity : as that of an output; it decides the unit. long_name : what people call it. ramp : s, in which it is
    reached where a planned test does not say.
    """

    name: str
    quantity: str
    long_name: str = ""
    ramp: float = 0.0

    def __post_init__(self) -> None:
        _check_name("load", self.name)
        if not 0.0 <= self.ramp < math.inf:
            raise SolveError(f"load '{self.name}': ramp is {self.ramp!r}; allowed is a time of 0 s or more")
        _check_quantity(f"load '{self.name}'", self.quantity)
        object.__setattr__(self, "long_name", self.long_name or self.name.replace("_", " "))


@checked
@dataclass(frozen=True)
class Dimension:
    """A length of a test piece, mm: a key of history files, an option of the command line, a nuisance parameter.

    default : what a test has that states no other. bounds : smallest and largest allowed.
    tolerance : relative standard deviation of the length of a test piece that nobody measured; 0 where it is exact.
    long_name : what people call it. alias : another name of the nuisance parameter.
    of_piece : whether a test piece has it; a window of a camera is a length that a file does not call geometry.
    """

    name: str
    default: float
    bounds: tuple[float, float] = (1e-3, 1e4)
    tolerance: float = 0.0
    long_name: str = ""
    alias: str = ""
    of_piece: bool = True

    def __post_init__(self) -> None:
        _check_name("dimension", self.name)
        low, high = self.bounds
        if not 0.0 < low < high < math.inf:
            raise SolveError(f"dimension '{self.name}': bounds are {self.bounds}; allowed is 0 < low < high, mm")
        if not low <= self.default <= high:
            raise SolveError(
                f"dimension '{self.name}': default is {self.default!r}; allowed is {low:g} to {high:g}, its bounds, mm"
            )
        if not 0.0 <= self.tolerance < 1.0:
            raise SolveError(
                f"dimension '{self.name}': tolerance is {self.tolerance!r}; allowed is 0 to 1, a relative deviation"
            )
        object.__setattr__(self, "long_name", self.long_name or self.name.replace("_", " "))

    @property
    def names(self) -> tuple[str, ...]:
        """Its name, and its alias if it has one."""
        return (self.name, self.alias) if self.alias else (self.name,)

    def checked(self, value: float, where: str) -> float:
        """A length within the bounds; SolveError, beginning with `where`, for any other."""
        low, high = self.bounds
        if not low <= value <= high:
            raise SolveError(f"{where}: {self.name} is {value:g} mm; allowed is {low:g} to {high:g} mm")
        return float(value)


def _check_name(what: str, name: str) -> None:
    if not (isinstance(name, str) and NAME_PATTERN.fullmatch(name)):
        raise SolveError(f"{what} {name!r}: a name has letters and digits, words joined by _, such as end_deflection")


def _check_quantity(what: str, quantity: str) -> None:
    refuse_unknown(quantity, QUANTITIES, SolveError, f"{what}: quantity {quantity!r} is not known")
