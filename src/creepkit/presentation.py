"""How records print, plot and save themselves although the modules that do so import the records.

A method of a record says `return present("reports.design:design_figure", self, path)`: the module of that name, above
the record's, is imported when the method is first called. So records import nothing above them, and `fit.plot()`,
`print(fit)` and `fit.profile("n")` work.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Result = TypeVar("Result")


class Presentable:
    """A record whose text for a terminal is written by a function that its class names by text="module:function".

    Classes of long answers name another function for `details()`.
    """

    __slots__ = ()
    _text: ClassVar[str]
    _details: ClassVar[str]

    def __init_subclass__(cls, text: str = "", details: str = "", **further: Any) -> None:
        """Text, details : the functions, which take the record; those of the base class if none is named."""
        super().__init_subclass__(**further)
        if text:
            cls._text = text
            cls._details = details or text

    def details(self) -> str:
        """Everything that there is to say, as text."""
        return present(self._details, self)

    def __str__(self) -> str:
        return present(self._text, self)

    def _repr_html_(self) -> str:
        """For notebooks."""
        return present("reports.html.notebook:notebook_html", self)


class Plotted:
    """A record with a picture: its class names the function of the whole figure, and that of its leading panel.

    figure : "module:function" that takes the record and returns a Figure. panel : "module:function" that takes
    matplotlib axes and the record, and draws into them.
    """

    __slots__ = ()
    _figure: ClassVar[str]
    _panel: ClassVar[str]

    def __init_subclass__(cls, figure: str = "", panel: str = "", **further: Any) -> None:
        """Figure, panel : the functions; those of the base class if none are named."""
        super().__init_subclass__(**further)
        cls._figure, cls._panel = figure or cls._figure, panel or cls._panel

    def plot(self, path: str | Path | None = None, *, ax: Axes | None = None) -> Figure:
        """The Figure, drawn and written to `path` where one is given; its panels are `.axes`.

        ax : axes of matplotlib into which the leading panel alone is drawn; what is returned is their figure.
        ReportError for a path that cannot be written and for what is no axes.
        """
        return present("reports.figures:plotted", self, (self._figure, self._panel), path, ax)


def present(name: str, record: object, /, *arguments: Any, **options: Any) -> Result:  # type: ignore[type-var]
    """What the function "module:function" of creepkit makes of a record; a test compares its type with the method's."""
    result: Result = function_named(name)(record, *arguments, **options)
    return result


@cache
def function_named(name: str) -> Any:
    """The function that "module:function" names."""
    module, _, function = name.partition(":")
    return getattr(import_module(f"creepkit.{module}"), function)
