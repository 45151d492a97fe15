"""How records show themselves: what prints, plots and saves them stands in layers above and is imported when asked."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from pandas import DataFrame


def function_of_reports(name: str) -> Callable[..., Any]:
    """A function of the layer above by its module and name, such as "forecast.forecast_answer"."""
    module, _, function = name.rpartition(".")
    found: Callable[..., Any] = getattr(import_module(f"creepkit.reports.{module}"), function)
    return found


def text_by(name: str, record: object) -> str:
    """The text of a record by a function that gives text, an Answer, or a list of blocks."""
    found = function_of_reports(name)(record)
    return str(function_of_reports("blocks.as_text")(found) if isinstance(found, list) else found)


class NotebookCell:
    """A record that a notebook shows as HTML."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        return str(function_of_reports("html.notebook.notebook_html")(self))


class Presentable(NotebookCell):
    """A record that prints an answer of its own, in notebooks too; one of long answers has `details()`.

    shown_by : the function of creepkit.reports that gives text, Answer or blocks, of those that have no `__str__`.
    detailed_by : that of its details, where these are more than the text.
    """

    __slots__ = ()
    shown_by: ClassVar[str] = ""
    detailed_by: ClassVar[str] = ""

    def __str__(self) -> str:
        return text_by(self.shown_by, self) if self.shown_by else repr(self)

    def details(self) -> str:
        """Everything that there is to say, as text."""
        return text_by(self.detailed_by, self) if self.detailed_by else str(self)


class Plotted:
    """A record with a picture.

    drawn_by : the functions of creepkit.reports of the whole figure, and of its leading panel, of axes and the record.
    """

    __slots__ = ()
    drawn_by: ClassVar[tuple[str, str]]

    def plot(self, path: str | Path | None = None, *, ax: Axes | None = None) -> Figure:
        """The Figure, drawn and written to `path` where one is given; its panels are `.axes`.

        ax : axes of matplotlib into which the leading panel alone is drawn; what is returned is their figure.
        ReportError for a path that cannot be written and for what is no axes.
        """
        from creepkit.reports.figures import plotted

        figure, panel = map(function_of_reports, self.drawn_by)
        return plotted(self, figure, panel, path, ax)


class Tabulated:
    """A record with a table."""

    __slots__ = ()

    def to_dataframe(self) -> DataFrame:
        """A table of pandas, with units in the names of its columns or beside.

        Of a test (frames,) rows: time_s, outputs, and whether a frame is used; of several the test before. Of an
        identification (parameters,): value, ends of the 95 % interval, unit, verdict. Of a ranking (laws,): weight,
        criterion less that of the best, chi-square, verdict. Of a forecast (tests, outputs, times): value and ends of
        the band. Of samples (draws,): values. Of a rupture assessment (strengths,): MPa, with bounds.
        """
        from creepkit.reports.dataframes import to_dataframe

        return to_dataframe(self)
