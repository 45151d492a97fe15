"""Options of `creepkit identify`, from text."""

import pytest

from creepkit.cli.identify import nuisances_of, weights_of
from creepkit.errors import FitError
from creepkit.records import Nuisance


def test_weights():
    assert weights_of("noise") == "noise"
    assert weights_of("paper") == "paper"
    assert weights_of("amplitude=0.99, width=0.005") == {"amplitude": 0.99, "width": 0.005}
    with pytest.raises(
        FitError, match="--weights amplitude is not known; write noise, likelihood, equal, paper or amplitude=0.99"
    ):
        weights_of("amplitude")


def test_nuisances_are_added_to_the_usual_two():
    assert nuisances_of(None) is None
    usual = [Nuisance("offset"), Nuisance("rate")]
    assert nuisances_of(["thickness=0.4935:0.027"]) == [*usual, Nuisance("thickness", mean=0.4935, sd=0.027)]
    assert nuisances_of(["temperature", "rate=0:0.2"]) == [usual[0], Nuisance("temperature"), Nuisance("rate", sd=0.2)]
    with pytest.raises(FitError, match="'width' is not known; allowed are offset, rate, thickness"):
        nuisances_of(["width=3"])
    with pytest.raises(FitError, match="'thin' is not MEAN or MEAN:SD"):
        nuisances_of(["thickness=thin"])
