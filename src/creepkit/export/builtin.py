"""The exporters that ship, each a target of `ck.export` and `creepkit export`."""

from creepkit.export.c import CExporter
from creepkit.export.cards.abaqus import AbaqusCards
from creepkit.export.cards.ansys import AnsysCards
from creepkit.export.cards.code_aster import CodeAsterMaterial
from creepkit.export.cards.moose import MooseBlock
from creepkit.export.cards.neml2 import Neml2Model
from creepkit.export.document import JsonExporter
from creepkit.export.fortran.creep import AbaqusCreepSubroutine, CalculixCreepSubroutine
from creepkit.export.latex import LatexExporter
from creepkit.export.markdown import MarkdownExporter
from creepkit.export.mathml import MathmlExporter
from creepkit.export.mfront import MfrontExporter
from creepkit.export.numpy import NumpyExporter
from creepkit.export.python import PythonExporter
from creepkit.hookspecs import hookimpl
from creepkit.records import Exporter


@hookimpl
def creepkit_exporters() -> list[Exporter]:
    """The exporters of this package."""
    return [
        LatexExporter(),
        PythonExporter(),
        JsonExporter(),
        AbaqusCreepSubroutine(),
        CalculixCreepSubroutine(),
        NumpyExporter(),
        CExporter(),
        MfrontExporter(),
        MarkdownExporter(),
        MathmlExporter(),
        AbaqusCards(),
        AnsysCards(),
        MooseBlock(),
        CodeAsterMaterial(),
        Neml2Model(),
    ]
