"""Every law that is installed keeps what every law promises."""

import pytest

from creepkit.registry import default_registry
from creepkit.testing import check_law

LAWS = sorted(default_registry().laws())
SHIPPED = {"norton", "strain-hardening", "time-hardening", "hyperbolic-sine", "drifting-exponent", "combined"}


def test_there_are_laws_to_judge() -> None:
    assert SHIPPED <= {*LAWS}


@pytest.mark.parametrize("name", LAWS)
def test_a_registered_law_conforms(name: str) -> None:
    report = check_law(default_registry().law(name))

    assert report.passed, str(report)
