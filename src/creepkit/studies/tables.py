"""What a study file may hold: strict models of its tables. Units stand in the names of keys.

A key that is missing takes the default of the function that it goes to.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, StringConstraints
from pydantic_core import PydanticCustomError

from creepkit.discovery.discover import DiscoveryOptions
from creepkit.experiments.design_task import GoalOptions
from creepkit.experiments.rig import Rig
from creepkit.exporters.exporting import ExportOptions
from creepkit.extraction.options import ClockOptions, ExtractionOptions
from creepkit.forecasts.planned_tests import ForecastOptions, PlannedTestOptions
from creepkit.instruments.reading_options import RecordOptions
from creepkit.inverse.candidate_laws import LawChanges, SearchOptions
from creepkit.inverse.settings import IdentificationSettings, UsualErrors
from creepkit.law_search.search import LawSearchOptions
from creepkit.options import Options, table_of
from creepkit.rupture_assessment.assessment import RuptureQuestion, RuptureSettings

MOST_ITEMS = 1000
"""In a list of a study file."""


def _printable(text: str) -> str:
    if text.isprintable():
        return text
    raise PydanticCustomError("misfit", "must be a text of one line, without signs that cannot be seen")


Text = Annotated[str, StringConstraints(min_length=1, max_length=500), AfterValidator(_printable)]
"""Without line breaks, and without signs that steer a terminal."""


Positive = Annotated[float, Field(gt=0.0)]
Texts = Annotated[list[Text], Field(max_length=MOST_ITEMS)]
SomeTexts = Annotated[list[Text], Field(min_length=1, max_length=MOST_ITEMS)]
Numbers = Annotated[list[float], Field(min_length=1, max_length=MOST_ITEMS)]


class TableModel(BaseModel):
    """A table of a study file: no other keys, no values of other types."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


class Step(TableModel):
    """A level that begins at a time: { from_h = 4, level = 10 }, in the unit of the key that it belongs to."""

    from_h: Annotated[float, Field(ge=0.0)]
    level: float


def _level_or_steps(value: Any) -> Any:
    """A number as one step from 0 h on."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return [{"from_h": 0.0, "level": value}]
    if isinstance(value, list):
        return value
    raise PydanticCustomError("misfit", "must be a number, or a list of steps such as { from_h = 4, level = 10 }")


def _one_or_more(value: Any) -> Any:
    """A single text as a list of one."""
    return [value] if isinstance(value, str) else value


LARGEST_NUMBER = 1e300
"""Below which a number of a table of any names is."""


def _is_number(value: Any) -> bool:
    return type(value) in (int, float) and abs(value) < LARGEST_NUMBER


def _label_values(value: Any) -> Any:
    """One value of a label, or several, as a list."""
    values = value if isinstance(value, list) else [value]
    if values and all(isinstance(one, str) or _is_number(one) for one in values):
        return values
    raise PydanticCustomError("misfit", "must be a text, a number, or a list of them")


def _word_or_numbers(value: Any) -> Any:
    """A word, or numbers by name."""
    numbers = isinstance(value, dict) and all(_is_number(one) for one in value.values())
    if isinstance(value, str) or (value and numbers):
        return value
    raise PydanticCustomError("misfit", "must be a word such as none, or numbers by name such as { load = 0.01 }")


def _channels(value: Any) -> Any:
    """Channels of all test pieces as those of the name ""; else by name."""
    return {"": value} if isinstance(value, list) else value


LevelOrSteps = Annotated[list[Step], BeforeValidator(_level_or_steps), Field(min_length=1, max_length=MOST_ITEMS)]
Labels = Annotated[list[Any], BeforeValidator(_label_values)]
OneOrMore = Annotated[SomeTexts, BeforeValidator(_one_or_more)]
ChannelNames = Annotated[list[Text], Field(min_length=1, max_length=100)]
Bounds = Annotated[list[Annotated[float, Field(ge=-1e100, le=1e100)]], Field(min_length=2, max_length=2)]


TYPES: dict[Any, Any] = {
    str: Text,
    Path: Text,
    tuple[str, ...]: OneOrMore,
    tuple[tuple[float, ...], ...]: Annotated[list[Bounds], Field(max_length=MOST_ITEMS)],
    UsualErrors: Annotated[Any, BeforeValidator(_word_or_numbers)],
}
"""{type of an option: that of its key}, where it is another one in TOML."""


def _keys(*records: type[Options], without: tuple[str, ...] = (), only: tuple[str, ...] | None = None) -> Any:
    """A table with the options of records as keys, None where they are missing; `only` these, with their defaults."""
    keys: Any = TableModel
    for record in records:
        keys = table_of(record, keys, types=TYPES, without=without, only=only)
    return keys


class StudyTable(_keys(IdentificationSettings, only=("seed",)), TableModel):  # type: ignore[misc]
    """[study]: what the report is called, and the seed of all random draws."""

    title: Text = "creep study"


class DataTable(_keys(IdentificationSettings, only=("suspect_frames",)), TableModel):  # type: ignore[misc]
    """[data]: files of tests, patterns or folders, relative to the study file; none where cameras give the tests.

    only : values of labels that tests must have. up_to_strain : frames beyond it are left out.
    citation : where the data were published, one text or several, as a list of references has them.
    """

    files: Annotated[Texts, BeforeValidator(_one_or_more)] = []
    reader: Text | None = None
    ignore: Texts = []
    only: dict[Text, Labels] = {}
    up_to_strain: Positive | None = None
    check_quality: bool = True
    citation: Annotated[Texts, BeforeValidator(_one_or_more)] = []


class RecordTable(_keys(RecordOptions), TableModel):  # type: ignore[misc]
    """[[record]]: what an instrument recorded of loads and temperatures, and what its file does not say, as in
    ck.read_record.
    """

    name: Text
    file: Text
    format: Text | None = None


class AlloysTable(TableModel):
    """[alloys]: the table that says which test piece of the cameras is of which alloy, with lengths and modulus."""

    file: Text


class InfraredTable(TableModel):
    """infrared of a [[camera]]: images of temperatures, and where they lie in the axes of the frames.

    images : a folder, a pattern or files. center_mm : of the middle of an image. emissivity : of the surface;
    camera_emissivity : with which the infrared camera made its temperatures.
    """

    images: OneOrMore
    center_mm: Bounds
    mm_per_pixel: Positive
    emissivity: Annotated[float, Field(gt=0.0, le=1.0)]
    emissivity_sd: Annotated[float, Field(ge=0.0, lt=0.5)] = 0.02
    camera_emissivity: Annotated[float, Field(gt=0.0, le=1.0)] = 1.0
    surroundings_C: Annotated[float, Field(gt=-273.0, lt=3000.0)] = 25.0
    wavelength_um: Annotated[float, Field(ge=0.4, le=20.0)] = 10.0
    unit: Literal["C", "K"] = "C"


class CameraTable(_keys(ExtractionOptions, ClockOptions), TableModel):  # type: ignore[misc]
    """[[camera]]: frames of a surface, what is made of them as in ck.extract, and what was imposed meanwhile.

    frames : a folder, a pattern or files in their order. name : by default that of the folder. names, centers_mm : of
    the test pieces in the field of view. record : a [[record]], by default the only one. channels : load, then
    thermocouples, of all test pieces or of each by its name. thermocouples_mm : {channel: its x and y in the axes of
    the frames}, between which the temperature of each test piece is interpolated. load, temperature_C : where there is
    no record, counted from the first load.
    """

    name: Text | None = None
    frames: OneOrMore
    specimen: Text | None = None
    operator: Text | None = None
    record: Text | None = None
    channels: Annotated[dict[str, ChannelNames], BeforeValidator(_channels)] = {}
    thermocouples_mm: dict[Text, Bounds] = {}
    infrared: InfraredTable | None = None
    load: dict[Text, LevelOrSteps] = {}
    ramp_s: Annotated[float, Field(ge=0.0)] | None = None
    temperature_C: LevelOrSteps | None = None
    modulus_GPa: Positive | None = None
    poisson: Annotated[float, Field(gt=-1.0, lt=0.5)] = 0.3
    lengths: dict[Text, Positive] = {}
    alloy: Text | None = None
    labels: dict[Text, Text] = {}


class ExcludeTable(TableModel):
    """[[exclude]]: a test, or some of its frames, with the reason. Frames are counted from 0: "97-191, 193"."""

    test: Text
    reason: Text
    frames: Text | None = None
    from_h: Annotated[float, Field(ge=0.0)] | None = None
    to_h: Positive | None = None


class SpecimenTable(TableModel):
    """[specimen]: what the tests are of where files do not say, and lengths of the test piece, as thickness_mm."""

    name: Text
    lengths: dict[Text, Positive] = {}


ELSEWHERE = ("nuisances", "seed", "suspect_frames", "further_laws", "bounds", "sums")
"""Options of identifications whose keys stand in tables of their own, in [study], [data] and [selection]."""


_OF_IDENTIFICATION: Any = _keys(IdentificationSettings, LawChanges, SearchOptions, without=ELSEWHERE)


class IdentificationTable(_OF_IDENTIFICATION, TableModel):  # type: ignore[misc]
    """[identification]: candidate laws and how each is fitted, for every group of tests.

    nuisances : as "thickness=0.49:0.03", mean and standard deviation; "rate=none" leaves out one that is usual.
    """

    laws: OneOrMore
    group_by: Text | None = None
    using: Text | None = None
    bounds: dict[Text, Bounds] = {}
    nuisances: Texts = []


_OF_SELECTION: Any = _keys(IdentificationSettings, only=("further_laws",))


class SelectionTable(_keys(SearchOptions, without=("penalty",)), _OF_SELECTION):  # type: ignore[misc]
    """[selection]: how laws are compared; without sums, sums are tried where no candidate explains the tests."""


class LawSearchTable(_keys(LawSearchOptions), TableModel):  # type: ignore[misc]
    """[law_search]: of tests of bars, laws that nobody wrote down are candidates of [identification] too."""


class TemperatureTable(_keys(DiscoveryOptions, without=("forms",)), TableModel):  # type: ignore[misc]
    """[temperature]: forms of temperature for the parameters of a law, by default the best law of each group."""

    law: Text | None = None
    forms: dict[Text, OneOrMore] | None = None


class TensileStrength(TableModel):
    """A tensile strength at a temperature."""

    temperature_C: float
    strength_MPa: Positive


class RuptureTable(_keys(RuptureSettings, RuptureQuestion, without=("seed",)), TableModel):  # type: ignore[misc]
    """[rupture]: parametric methods for rupture tests."""

    tensile_strengths: Annotated[list[TensileStrength], Field(max_length=MOST_ITEMS)] = []


class ForecastTable(_keys(PlannedTestOptions, ForecastOptions, without=("temperature",)), TableModel):  # type: ignore[misc]
    """[[forecast]]: measured tests by their files, or a planned one by its load, temperature and end.

    load : as { stress_MPa = 80 } or steps, of components as
    { stress_11_MPa = 60, strain_12 = 0 }; lengths as { thickness_mm = 0.5 }; targets as { strain = [0.01] }.
    """

    name: Text
    group: Text | None = None
    tests: Annotated[Texts, BeforeValidator(_one_or_more)] = []
    load: dict[Text, LevelOrSteps] = {}
    temperature_C: LevelOrSteps | None = None
    lengths: dict[Text, Positive] = {}
    labels: dict[Text, Text] = {}
    targets: dict[Text, Numbers] = {}
    tolerances: dict[Text, Positive] = {}


class DesignTable(_keys(GoalOptions, Rig, without=("levels", "dimensions")), TableModel):  # type: ignore[misc]
    """[design]: further tests, by what they tell for each hour of machine time; what is not said of the rig it did."""

    group: Text | None = None
    levels: dict[Text, Bounds] = {}
    lengths: dict[Text, Numbers] = {}


class ExportTable(_keys(ExportOptions), TableModel):  # type: ignore[misc]
    """[[export]]: the best law of a group, or its law of temperature, as text for a target."""

    target: Text
    file: Text | None = None
    group: Text | None = None
    law: Literal["identified", "temperature"] = "identified"


class ReportTable(TableModel):
    """[report]: the page. Data files up to attach_MB in all are put into it, of others their hashes alone."""

    file: Text = "report.html"
    attach_MB: Annotated[float, Field(ge=0.0, le=50.0)] = 3.0


class StudyTables(TableModel):
    """A whole study file; every table but [data], or but [[camera]], may be missing."""

    study: StudyTable = StudyTable()
    record: Annotated[list[RecordTable], Field(max_length=100)] = []
    camera: Annotated[list[CameraTable], Field(max_length=100)] = []
    alloys: AlloysTable | None = None
    data: DataTable = DataTable()
    exclude: Annotated[list[ExcludeTable], Field(max_length=MOST_ITEMS)] = []
    specimen: SpecimenTable | None = None
    identification: IdentificationTable | None = None
    selection: SelectionTable | None = None
    law_search: LawSearchTable | None = None
    temperature: TemperatureTable | None = None
    rupture: RuptureTable | None = None
    forecast: Annotated[list[ForecastTable], Field(max_length=100)] = []
    design: DesignTable | None = None
    export: Annotated[list[ExportTable], Field(max_length=100)] = []
    report: ReportTable | None = None
