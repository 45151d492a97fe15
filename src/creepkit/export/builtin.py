"""The exporters that ship: LaTeX, plain Python and JSON."""

from creepkit.export.document import JsonExporter
from creepkit.export.latex import LatexExporter
from creepkit.export.python import PythonExporter
from creepkit.hookspecs import hookimpl
from creepkit.records import Exporter


@hookimpl
def creepkit_exporters() -> list[Exporter]:
    """The exporters of this package."""
    return [LatexExporter(), PythonExporter(), JsonExporter()]
