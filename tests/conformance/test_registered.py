"""All laws, specimens, readers, formats, exporters and temperature forms installed keep what each of them promises."""

import pytest

from creepkit.registry import default_registry
from creepkit.testing import check_named, check_predictor

KNOWN = default_registry()
OFFERED = {
    "law": (KNOWN.laws(), "norton strain-hardening time-hardening hyperbolic-sine drifting-exponent combined"),
    "specimen": (KNOWN.specimens(), "uniaxial relaxation point bulge"),
    "reader": (KNOWN.readers(), "csv indexed-table indexed-files"),
    "camera format": (KNOWN.cameras(), "vic-3d vic-3d-mat dice matchid zeiss pyvale"),
    "exporter": (KNOWN.exporters(), "python c mfront latex"),
    "instrument format": (KNOWN.instruments(), "plate-of-dimples table"),
    "temperature form": (KNOWN.temperature_forms(), "arrhenius linear"),
}
"""{kind: (what is installed, what must be)}."""


def test_there_is_something_to_judge() -> None:
    assert [kind for kind, (found, shipped) in OFFERED.items() if not {*shipped.split()} <= {*found}] == []


@pytest.mark.parametrize("name", sorted({name for found, _ in OFFERED.values() for name in found}))
def test_what_is_registered_conforms(name: str) -> None:
    reports = check_named(name)

    assert {report.kind for report in reports} == {kind for kind, (found, _) in OFFERED.items() if name in found}
    assert [str(report) for report in reports if not report.passed] == []


def test_the_reduced_order_model_of_the_dimple_conforms_as_a_predictor() -> None:
    report = check_predictor(default_registry().specimen("bulge").reduced_order_model())

    assert report.passed, str(report)
