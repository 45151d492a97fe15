"""Write the schemas of files, and keywords of options for type checkers: `python docs/schemas.py`.

The schemas, in docs/reference/schemas, are made from the models that read the files: the tables of study files, the
records of other documents. The keywords, in src/creepkit/option_keywords.pyi, are those of records of options. A test
compares both with what is there.
"""

from __future__ import annotations

import ast
import enum
import inspect
import json
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, is_dataclass
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np
from pydantic.json_schema import GenerateJsonSchema

from creepkit.discovery.discover import DiscoveryOptions
from creepkit.exporters import law_files
from creepkit.files.json_documents import DocumentFormat
from creepkit.files.record_codec import RecordCodec
from creepkit.instruments.reading_options import RecordOptions
from creepkit.inverse import identification_document, ranking_document
from creepkit.inverse.identification import Identification, IdentificationSettings
from creepkit.language import CreepLaw, law_codec
from creepkit.law_search.search import LawSearchOptions
from creepkit.rupture_assessment import assessment
from creepkit.rupture_assessment.assessment import RuptureAssessment
from creepkit.studies.tables import StudyTables

FOLDER = Path(__file__).parent / "reference" / "schemas"
DIALECT = "https://json-schema.org/draft/2020-12/schema"
SIMPLE: dict[Any, Any] = {bool: {"type": "boolean"}, str: {"type": "string"}, int: {"type": "integer"}, Any: {}}
NUMBER = {"anyOf": [{"type": "number"}, {"type": "null"}, {"enum": ["inf", "-inf"]}]}
"""NaN is written as null, infinities as texts."""


SHORT_FORMS: dict[str, Any] = {
    "_level_or_steps": {"type": "number"},
    "_one_or_more": {"type": "string"},
    "_label_values": {},
    "_word_or_numbers": {},
}
"""What a study file may hold in place of what a function of its model makes of it; anything, where that is empty."""


class Schemas:
    """Schemas of records, each a definition of its own."""

    def __init__(self, codec: RecordCodec) -> None:
        self._codec = codec
        self.definitions: dict[str, Any] = {}

    def of(self, hint: Any) -> Any:
        """The schema of what JSON holds of values with an annotation."""
        origin, arguments = get_origin(hint), get_args(hint)
        if hint is CreepLaw:
            law = Schemas(law_codec._CODEC)
            reference = law.of(law_codec.LawDocument)
            whole = document_schema(law_codec.LAW, law_codec._CODEC, law_codec.LawDocument)
            inner = {key: whole[key] for key in ("type", "properties", "required", "additionalProperties")}
            self.definitions |= law.definitions | {"LawDocument": inner}
            return reference
        if hint in SIMPLE:
            return SIMPLE[hint]
        if hint is float:
            return NUMBER
        if origin in (Union, UnionType):
            return {"anyOf": [{"type": "null"} if kind is NoneType else self.of(kind) for kind in arguments]}
        if origin is Literal:
            return {"enum": list(arguments)}
        if isinstance(hint, type) and issubclass(hint, enum.Enum):
            return {"enum": list(hint.__members__)}
        if isinstance(hint, type) and issubclass(hint, tuple):
            parts = [self.of(part) for part in get_type_hints(hint).values()]
            return {"type": "array", "prefixItems": parts, "minItems": len(parts), "maxItems": len(parts)}
        if origin is np.ndarray or hasattr(origin, "__value__"):
            return {"type": "array"}
        if isinstance(origin, type) and issubclass(origin, Mapping):
            return {"type": "object", "additionalProperties": self.of(arguments[1])}
        if isinstance(origin, type) and issubclass(origin, Sequence):
            if origin is tuple and arguments[-1] is not ...:
                parts = [self.of(part) for part in arguments]
                return {"type": "array", "prefixItems": parts, "minItems": len(parts), "maxItems": len(parts)}
            return {"type": "array", "items": self.of(arguments[0])}
        return self._record(hint) if is_dataclass(hint) and isinstance(hint, type) else {}

    def _record(self, record: type) -> Any:
        name = record.__name__.strip("_")
        if name not in self.definitions:
            self.definitions[name] = {}
            hints, stored = self._codec._hints(record), self._codec._stored_fields(record)
            self.definitions[name] = {
                "type": "object",
                "properties": {f.name: self.of(hints[f.name]) for f in stored},
                "required": [f.name for f in stored if f.default is MISSING and f.default_factory is MISSING],
                "additionalProperties": False,
            }
        return {"$ref": f"#/$defs/{name}"}


def document_schema(document: DocumentFormat, codec: RecordCodec, record: type) -> dict[str, Any]:
    """The schema of a document: its format and version, then the fields of the record."""
    schemas = Schemas(codec)
    schemas.of(record)
    own = schemas.definitions.pop(record.__name__.strip("_"))
    heading = {"format": {"const": document.name}, "version": {"const": document.version}}
    return {
        "$schema": DIALECT,
        "title": f"{document.name}, version {document.version}",
        **own,
        "properties": {**heading, **own["properties"]},
        "required": [*heading, *own["required"]],
        "$defs": dict(sorted(schemas.definitions.items())),
    }


def valued_law_schema() -> dict[str, Any]:
    """The schema of an exported law: its conventions are these and no others."""
    whole = document_schema(law_files.VALUED_LAW, RecordCodec(), law_files._Values)
    schemas = Schemas(RecordCodec())
    own = {"law": schemas.of(CreepLaw), **{key: {"const": value} for key, value in law_files._CONVENTIONS.items()}}
    return {
        **whole,
        "properties": {**whole["properties"], **own},
        "required": [*whole["required"], *own],
        "$defs": dict(sorted({**whole["$defs"], **schemas.definitions}.items())),
    }


class StudySchema(GenerateJsonSchema):
    """Of the tables of a study file, where a short form stands for a list."""

    def function_before_schema(self, schema: Any) -> dict[str, Any]:
        """What the model makes of a value before it checks it, and the value itself."""
        after, before = (
            super().function_before_schema(schema),
            SHORT_FORMS.get(schema["function"]["function"].__name__, {}),
        )
        return {"anyOf": [before, after]} if before else {}


def schemas() -> dict[str, dict[str, Any]]:
    """{name of the file: schema}."""
    study = {
        "$schema": DIALECT,
        **StudyTables.model_json_schema(schema_generator=StudySchema),
        "title": "a study file, as TOML",
    }
    identification = document_schema(
        identification_document.IDENTIFICATION, identification_document.CODEC, Identification
    )
    law = document_schema(law_codec.LAW, law_codec._CODEC, law_codec.LawDocument)
    return {
        "study.schema.json": study,
        "identification.schema.json": identification,
        "ranking.schema.json": document_schema(
            ranking_document.RANKING, ranking_document.CODEC, ranking_document.RankingFile
        ),
        "law.schema.json": law,
        "valued-law.schema.json": valued_law_schema(),
        "rupture-assessment.schema.json": document_schema(assessment.ASSESSMENT, assessment.CODEC, RuptureAssessment),
    }


def text_of(schema: dict[str, Any]) -> str:
    """The content of its file."""
    return json.dumps(schema, indent=1, ensure_ascii=False) + "\n"


KEYWORDS = Path(__file__).parents[1] / "src" / "creepkit" / "option_keywords.pyi"
HEAD = '''"""Options of verbs as keywords for type checkers and editors; `python docs/schemas.py` writes this file."""

from collections.abc import Mapping, Sequence
from typing import Literal, TypedDict

from creepkit.inverse.settings import UsualErrors, Weights
from creepkit.records import Nuisance
'''


def keywords_text() -> str:
    """The stub: a TypedDict for each record of options that a public function takes as keywords."""
    text = HEAD
    for record in (IdentificationSettings, DiscoveryOptions, LawSearchOptions, RecordOptions):
        text += f"\nclass {record.__name__}Keywords(TypedDict, total=False):\n"
        (tree,) = ast.parse(textwrap.dedent(inspect.getsource(record))).body
        for field in (one for one in tree.body if isinstance(one, ast.AnnAssign)):  # type: ignore[attr-defined]
            kind = ast.unparse(field.annotation).replace(
                "tuple[Nuisance, ...]", "Nuisance | str | Sequence[Nuisance | str]"
            )
            kind = kind.replace("tuple[str, ...]", "Sequence[str]").removesuffix(" | None").replace("'", '"')
            text += f"    {ast.unparse(field.target)}: {kind} | None\n"
    return text


def main() -> None:
    """Write them all."""
    KEYWORDS.write_text(keywords_text(), encoding="utf-8")
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name, schema in schemas().items():
        (FOLDER / name).write_text(text_of(schema), encoding="utf-8")


if __name__ == "__main__":
    main()
