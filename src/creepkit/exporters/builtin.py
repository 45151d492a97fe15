"""The exporters that ship, each a target of `ck.export` and `creepkit export`."""

from creepkit.exporters.abaqus_cards import AbaqusCards
from creepkit.exporters.ansys import AnsysCards
from creepkit.exporters.c import CExporter
from creepkit.exporters.code_aster import CodeAsterMaterial
from creepkit.exporters.creep_subroutine import AbaqusCreepSubroutine, CalculixCreepSubroutine
from creepkit.exporters.javascript import JavaScriptExporter
from creepkit.exporters.latex import LatexExporter, MarkdownExporter
from creepkit.exporters.law_files import JsonExporter
from creepkit.exporters.mathml import MathmlExporter
from creepkit.exporters.mfront import MfrontExporter
from creepkit.exporters.moose_neml2 import MooseBlock, Neml2Model
from creepkit.exporters.python import NumpyExporter, PythonExporter
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
        JavaScriptExporter(),
        MfrontExporter(),
        MarkdownExporter(),
        MathmlExporter(),
        AbaqusCards(),
        AnsysCards(),
        MooseBlock(),
        CodeAsterMaterial(),
        Neml2Model(),
    ]
