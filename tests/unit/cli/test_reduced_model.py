"""`creepkit surrogate reduce`: what it says."""

from helpers.command_line import creepkit, one_line


def test_a_model_is_trained_and_described():
    said = creepkit("surrogate reduce --geometry apex_thickness=0.52")
    assert said.exit_code == 0, said.output
    assert "modes" in said.output
    assert "amplitude" in said.output


def test_a_bar_has_no_reduced_order_model_to_train():
    words = "it has no reduced-order model that is trained; name one of those that have one: bulge"
    assert words in one_line(creepkit("surrogate reduce --specimen uniaxial"))
