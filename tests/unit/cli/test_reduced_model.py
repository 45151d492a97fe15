"""`creepkit surrogate reduce`: what it says and draws."""

from helpers.command_line import creepkit, one_line


def test_a_model_is_trained_described_and_drawn(tmp_path):
    picture = tmp_path / "points.png"
    said = creepkit(f"surrogate reduce --picture {picture} --geometry apex_thickness=0.52")
    assert said.exit_code == 0, said.output
    assert "modes" in said.output
    assert "amplitude" in said.output
    assert picture.stat().st_size > 10_000


def test_a_bar_has_no_reduced_order_model_to_train():
    words = "it has no reduced-order model that is trained; name one of those that have one: bulge"
    assert words in one_line(creepkit("surrogate reduce --specimen uniaxial"))
