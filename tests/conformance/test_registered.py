"""All laws, specimens, readers, formats, exporters and temperature forms installed keep what each of them promises."""

import pytest

from creepkit.registry import default_registry, kinds
from creepkit.testing import check_named, check_predictor

KNOWN = default_registry()
SHIPPED = {
    "law": "norton strain-hardening time-hardening hyperbolic-sine drifting-exponent combined",
    "specimen": "uniaxial relaxation point bulge",
    "reader": "csv indexed-table indexed-files",
    "camera format": "vic-3d vic-3d-mat dice matchid zeiss pyvale",
    "exporter": "python c mfront latex",
    "instrument format": "plate-of-dimples table",
    "temperature form": "arrhenius linear",
}
OFFERED = {kind.label: KNOWN.all(kind) for kind in kinds.KINDS}


def test_there_is_something_to_judge() -> None:
    assert [kind for kind, names in SHIPPED.items() if not {*names.split()} <= {*OFFERED[kind]}] == []


@pytest.mark.parametrize("name", sorted({name for found in OFFERED.values() for name in found}))
def test_what_is_registered_conforms(name: str) -> None:
    reports = check_named(name)

    assert {report.kind for report in reports} == {kind for kind, found in OFFERED.items() if name in found}
    assert [str(report) for report in reports if not report.passed] == []


def test_the_reduced_order_model_of_the_dimple_conforms_as_a_predictor() -> None:
    report = check_predictor(default_registry().specimen("bulge").reduced_order_model())

    assert report.passed, str(report)
