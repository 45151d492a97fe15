"""How records show themselves: what prints, plots and saves them stands in layers above and is imported when asked."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from pandas import DataFrame


class NotebookCell:
    """A record that a notebook shows as HTML."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        from creepkit.reports.html.notebook import notebook_html

        return notebook_html(self)


class Presentable(NotebookCell):
    """A record that prints an answer of its own, `__str__`, in notebooks too; one of long answers has `details()`."""

    __slots__ = ()

    def details(self) -> str:
        """Everything that there is to say, as text."""
        return str(self)


class Plotted:
    """A record with a picture."""

    __slots__ = ()

    def plot(self, path: str | Path | None = None, *, ax: Axes | None = None) -> Figure:
        """The Figure, drawn and written to `path` where one is given; its panels are `.axes`.

        ax : axes of matplotlib into which the leading panel alone is drawn; what is returned is their figure.
        ReportError for a path that cannot be written and for what is no axes.
        """
        from creepkit.reports.figures import plotted

        return plotted(self, *self._drawn_by(), path, ax)

    def _drawn_by(self) -> tuple[Any, Any]:
        """The function of the whole figure of a record, and that of its leading panel, of axes and the record."""
        raise NotImplementedError


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
