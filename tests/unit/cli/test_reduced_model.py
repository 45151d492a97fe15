"""`creepkit surrogate reduce`: what it says and draws."""

from typer.testing import CliRunner

from creepkit.cli.app import app


def test_a_model_is_trained_described_and_drawn(tmp_path):
    picture = tmp_path / "points.png"
    words = ["surrogate", "reduce", "--picture", str(picture), "--geometry", "apex_thickness=0.52"]
    said = CliRunner().invoke(app, words)
    assert said.exit_code == 0, said.output
    assert "modes" in said.output
    assert "amplitude" in said.output
    assert picture.stat().st_size > 10_000


def test_a_bar_has_no_reduced_order_model_to_train():
    said = CliRunner().invoke(app, ["surrogate", "reduce", "--specimen", "uniaxial"])
    assert said.exit_code == 1
    assert "it has no reduced-order model that is trained; name one of those that have one: bulge" in said.output
