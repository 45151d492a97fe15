"""Every specimen, reader, exporter and temperature form that is installed keeps what every one promises."""

import pytest

from creepkit.registry import default_registry
from creepkit.testing import (
    check_camera_format,
    check_exporter,
    check_named,
    check_predictor,
    check_reader,
    check_specimen,
)

SPECIMENS = sorted(default_registry().specimens())
READERS = sorted(default_registry().readers())
CAMERAS = sorted(default_registry().cameras())
EXPORTERS = sorted(default_registry().exporters())
INSTRUMENTS = sorted(default_registry().instruments())
FORMS = sorted(default_registry().temperature_forms())


def test_there_is_something_to_judge() -> None:
    assert {"uniaxial", "relaxation", "point", "bulge"} <= {*SPECIMENS}
    assert {"csv", "indexed-table", "indexed-files"} <= {*READERS}
    assert {"vic-3d", "vic-3d-mat", "dice", "matchid", "zeiss", "pyvale", "pyvale-binary"} <= {*CAMERAS}
    assert {"python", "c", "mfront", "latex"} <= {*EXPORTERS}
    assert {"plate-of-dimples", "table"} <= {*INSTRUMENTS}
    assert {"arrhenius", "linear"} <= {*FORMS}


@pytest.mark.parametrize("name", SPECIMENS)
def test_a_registered_specimen_conforms(name: str) -> None:
    report = check_specimen(default_registry().specimen(name))

    assert report.passed, str(report)


def test_the_reduced_order_model_of_the_dimple_conforms_as_a_predictor() -> None:
    report = check_predictor(default_registry().specimen("bulge").reduced_order_model())

    assert report.passed, str(report)


@pytest.mark.parametrize("name", READERS)
def test_a_registered_reader_conforms(name: str) -> None:
    report = check_reader(default_registry().reader(name))

    assert report.passed, str(report)


@pytest.mark.parametrize("name", CAMERAS)
def test_a_registered_camera_format_conforms(name: str) -> None:
    report = check_camera_format(default_registry().camera(name))

    assert report.passed, str(report)


@pytest.mark.parametrize("name", EXPORTERS)
def test_a_registered_exporter_conforms(name: str) -> None:
    report = check_exporter(default_registry().exporter(name))

    assert report.passed, str(report)


@pytest.mark.parametrize("name", INSTRUMENTS)
def test_a_registered_format_of_instruments_conforms(name: str) -> None:
    reports = check_named(name)

    assert [report.kind for report in reports] == ["instrument format"]
    assert all(report.passed for report in reports), str(reports)


@pytest.mark.parametrize("name", FORMS)
def test_a_registered_temperature_form_conforms(name: str) -> None:
    reports = check_named(name)

    assert [str(report) for report in reports if report.kind == "temperature form" and not report.passed] == []
