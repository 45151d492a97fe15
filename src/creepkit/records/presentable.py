"""How records show themselves: what prints, plots and saves them stands in layers above and is imported when asked."""


class Presentable:
    """A record that prints an answer of its own, `__str__`, in notebooks too; one of long answers has `details()`."""

    __slots__ = ()

    def details(self) -> str:
        """Everything that there is to say, as text."""
        return str(self)

    def _repr_html_(self) -> str:
        """For notebooks."""
        from creepkit.reports.html.notebook import notebook_html

        return notebook_html(self)
