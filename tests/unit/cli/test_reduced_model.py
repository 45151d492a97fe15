"""`creepkit base`: what it prints and writes."""

from typer.testing import CliRunner

from creepkit.cli.app import app
from creepkit.specimens.bulge.reduced_order.tables import read_tables


def test_tables_of_a_dimple_are_printed_drawn_and_written(tmp_path):
    file, picture = tmp_path / "small.safetensors", tmp_path / "small.png"
    words = ["reduced-model", "--to", str(file), "--picture", str(picture), "--geometry", "apex_thickness=0.52"]
    said = CliRunner().invoke(app, words)
    assert said.exit_code == 0, said.output
    assert "k = sigma*/P" in said.output
    assert "0.52" in said.output
    assert picture.stat().st_size > 10_000
    assert read_tables(file).geometry.apex_thickness == 0.52


def test_only_a_dimple_has_a_base(tmp_path):
    said = CliRunner().invoke(app, ["reduced-model", "--to", str(tmp_path / "none"), "--specimen", "uniaxial"])
    assert said.exit_code == 1
    assert "only a bulge has a one-degree-of-freedom model" in said.output
