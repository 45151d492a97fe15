"""Options of `creepkit identify`, from text."""

from dataclasses import replace

import pytest

from creepkit.cli.command_options import given_value
from creepkit.errors import FitError
from creepkit.inverse.settings import IdentificationSettings, default_nuisances
from creepkit.options import options_of
from creepkit.records import Nuisance

OPTIONS = {one.name: one for one in options_of(IdentificationSettings)}


def parse_nuisances(texts):
    return given_value(OPTIONS["nuisances"], texts, FitError)


def parse_weights(text):
    return given_value(OPTIONS["weights"], text, FitError)


def test_weights():
    assert parse_weights("noise") == "noise"
    assert parse_weights("paper") == "paper"
    assert parse_weights("amplitude=0.99, width=0.005") == {"amplitude": 0.99, "width": 0.005}
    with pytest.raises(
        FitError, match="--weights amplitude is not known; write noise.likelihood.equal.paper.NAME=NUMBER,..., such as"
    ):
        parse_weights("amplitude")


def test_nuisances_are_added_to_the_usual_two():
    assert parse_nuisances(None) is None
    offset, rate = Nuisance("offset"), Nuisance("rate")
    thickness = Nuisance("thickness", mean=0.4935, sd=0.027)
    assert parse_nuisances(["thickness=0.4935:0.027"]) == default_nuisances(thickness) == (offset, rate, thickness)
    assert parse_nuisances(["temperature", "rate=0:0.2"]) == (offset, Nuisance("temperature"), Nuisance("rate", sd=0.2))
    assert parse_nuisances(["thickness=0.4935:0.027", "rate=none"]) == (offset, thickness)
    assert parse_nuisances(["rate=none", "offset=none"]) == ()


def test_steps_have_a_start_and_tests():
    step = Nuisance("temperature step", sd=30.0, start=8250.0)
    for text, scope, tests in (
        ("", "test", ()),
        (" for all", "all", ()),
        (" for alloy", "alloy", ()),
        (" for test_09, test_11", "all", ("test_09", "test_11")),
    ):
        assert parse_nuisances([f"temperature step=0:30@8250{text}"])[-1] == replace(step, scope=scope, tests=tests)


def test_nuisances_that_cannot_be_read_are_refused():
    with pytest.raises(FitError, match="--nuisance ofset=3: nuisance 'ofset' is not known; did you mean 'offset'"):
        parse_nuisances(["ofset=3"])
    with pytest.raises(FitError, match="nuisance 'thicknes' is not known; did you mean 'thickness'"):
        parse_nuisances(["thicknes=0.5"])
    with pytest.raises(
        FitError, match="--nuisance rat=none: 'rat' is no default nuisance that could be left out; did you mean 'rate'"
    ):
        parse_nuisances(["rat=none"])
    with pytest.raises(FitError, match="--nuisance thickness=thin is not known; write KIND"):
        parse_nuisances(["thickness=thin"])
    with pytest.raises(FitError, match="--nuisance rate step=0:1: nuisance 'rate step': start is 0 s; say when"):
        parse_nuisances(["rate step=0:1"])
    with pytest.raises(FitError, match="--nuisance temperature=nan is not known; write KIND"):
        parse_nuisances(["temperature=nan"])
