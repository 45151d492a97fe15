"""Published laws of materials: what a record refuses, and the range and source that go with it everywhere."""

from pathlib import Path
from typing import Any

import pytest

import creepkit as ck
from creepkit.errors import LawError
from helpers.command_line import creepkit, one_line

ARRHENIUS = ck.law("norton").times(ck.arrhenius(T_ref=1000.0))
STEEL: dict[str, Any] = {
    "name": "test-steel",
    "title": "a steel",
    "law": ARRHENIUS,
    "values": {"A": 1e-15, "n": 5.0, "Q": 3e5},
    "ranges": {"stress": (50.0, 100.0), "temperature": (873.15, 973.15)},
    "source": "Author (2001), Journal 1, 2, Table 3",
    "form": "hot-rolled",
}


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"values": {"A": 1e-15, "n": 5.0}}, "Q"),
        ({"ranges": {"stress": (100.0, 50.0)}}, "stress from 100 to 50; give the lower number first"),
        ({"ranges": {"grain_size": (1.0, 2.0)}}, "grain_size from 1 to 2"),
        ({"source": " "}, "the source ' ' must be one line"),
        ({"covariance": ((1.0, 0.0), (0.0, 1.0))}, "a row for each of A, n, Q"),
        ({"covariance": ((1.0, 2.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))}, "symmetric"),
    ],
)
def test_a_record_that_cannot_be_right_is_refused(changed: dict[str, Any], said: str) -> None:
    with pytest.raises(LawError, match=said):
        ck.Material(**STEEL | changed)


def test_its_form_range_standard_deviations_and_source_go_into_exports() -> None:
    steel = ck.Material(**STEEL, covariance=((0.04, 0.0, 0.0), (0.0, 0.01, 0.0), (0.0, 0.0, 0.0)))

    text = ck.export(steel, "python")
    for said in ("a steel (hot-rolled)", "50 to 100 MPa, 600 to 700 °C", "deviation of ln A: 0.2", "Table 3"):
        assert said in text
    assert "deviation of Q" not in text
    assert "extrapolated: temperature" not in ck.export(steel, "python", temperature=900.0)
    outside = "caution: extrapolated: temperature 1200 K (known from 873.1 to 973.1 K)"
    assert outside in " ".join(ck.export(steel, "python", temperature=1200.0).replace("#", " ").split())


PLUGIN = """
from creepkit import Material, hookimpl, law


@hookimpl
def creepkit_materials():
    return [
        Material(
            "lead-of-a-file", "lead", law("norton"), dict(A=1e-12, n=4.0), dict(stress=(1, 5)), "Smith (1990), p. 7"
        )
    ]
"""


def test_commands_take_a_material_by_its_name(tmp_path: Path) -> None:
    (tmp_path / "lead.py").write_text(PLUGIN)
    plugin = ["--plugin", str(tmp_path / "lead.py")]

    assert "1 to 5 MPa" in creepkit(*plugin, "list", "materials").stdout
    assert "Source: Smith (1990), p. 7" in creepkit(*plugin, "list", "materials", "lead-of-a-file").stdout
    assert '"source": "Smith (1990), p. 7"' in creepkit(*plugin, "list", "materials", "lead-of-a-file", "--json").stdout
    assert "known for 1 to 5 MPa" in creepkit(*plugin, "export", "lead-of-a-file", "--to", "c").stdout
    run = creepkit(*plugin, "simulate", "lead-of-a-file", "--stress", "9", "--end-h", "1", "--points", "3")
    assert "caution: extrapolated: stress 9 MPa (known from 1 to 5 MPa)" in run.stderr
    wrong = one_line(creepkit(*plugin, "export", "lead-of-a-fil", "--to", "c"))
    assert "there is no law or material 'lead-of-a-fil': did you mean 'lead-of-a-file'?" in wrong
