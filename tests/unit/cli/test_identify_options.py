"""Options of `creepkit identify`, from text."""

import pytest

from creepkit.cli.options import parse_nuisances, parse_weights
from creepkit.errors import FitError
from creepkit.records import Nuisance


def test_weights():
    assert parse_weights("noise") == "noise"
    assert parse_weights("paper") == "paper"
    assert parse_weights("amplitude=0.99, width=0.005") == {"amplitude": 0.99, "width": 0.005}
    with pytest.raises(
        FitError, match="--weights amplitude is not known; write noise, likelihood, equal, paper or amplitude=0.99"
    ):
        parse_weights("amplitude")


def test_nuisances_are_added_to_the_usual_two():
    assert parse_nuisances(None) is None
    usual = [Nuisance("offset"), Nuisance("rate")]
    assert parse_nuisances(["thickness=0.4935:0.027"]) == [*usual, Nuisance("thickness", mean=0.4935, sd=0.027)]
    assert parse_nuisances(["temperature", "rate=0:0.2"]) == [
        usual[0],
        Nuisance("temperature"),
        Nuisance("rate", sd=0.2),
    ]
    with pytest.raises(FitError, match="'width' is not known; allowed are offset, rate, thickness"):
        parse_nuisances(["width=3"])
    with pytest.raises(FitError, match="'thin' is not MEAN or MEAN:SD"):
        parse_nuisances(["thickness=thin"])
