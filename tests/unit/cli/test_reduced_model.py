"""`creepkit reduced-model`: what it says and draws."""

from typer.testing import CliRunner

from creepkit.cli.app import app


def test_a_model_is_trained_described_and_drawn(tmp_path):
    picture = tmp_path / "points.png"
    words = ["reduced-model", "--picture", str(picture), "--geometry", "apex_thickness=0.52"]
    said = CliRunner().invoke(app, words)
    assert said.exit_code == 0, said.output
    assert "modes" in said.output
    assert "amplitude" in said.output
    assert picture.stat().st_size > 10_000


def test_only_a_dimple_has_a_reduced_order_model():
    said = CliRunner().invoke(app, ["reduced-model", "--specimen", "uniaxial"])
    assert said.exit_code == 1
    assert "only a bulge has a reduced-order model" in said.output
