"""The server of a page: the page under its policy, right answers, newer questions before older ones."""

import json
import math
import threading
import time

import numpy as np
import pytest

import creepkit as ck
from creepkit.app.answers import PageAnswers
from creepkit.app.contents import page_contents
from creepkit.app.requests import read_request
from creepkit.app.turns import Superseded
from helpers.http_requests import ask, question, request, sentence, serving
from helpers.planted_bars import bars


def test_the_page_is_served_under_its_token_with_a_policy(server):
    page = request(server, "GET", f"/{server.token}/")
    assert page.status == 200
    assert b"Norton power law" in page.body
    policy = next(line for line in page.head.splitlines() if line.startswith("Content-Security-Policy"))
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert "frame-ancestors 'none'" in policy
    assert "no-store" in page.head
    assert "Python" not in page.head


def test_it_is_bound_to_this_machine_alone(server):
    assert server.server_address[0] == "127.0.0.1"
    assert server.url.startswith("http://127.0.0.1:")
    assert len(server.token) >= 32


def test_a_prediction_meets_the_closed_form(server):
    """Norton under constant load: exp(-n p) = 1 - n A sigma^n t."""
    answer = ask(server).data
    times, strain = (np.array(v) for v in (answer["program"]["times"], answer["program"]["outputs"]["strain"]))
    A, n = 1e-16, 4.0
    assert strain == pytest.approx(-np.log1p(-n * A * 100.0**n * times) / n, rel=2e-5)
    assert times[-1] == 36000.0
    stress, log_rate = (np.array(answer["rate"][name]) for name in ("stress", "log_rate"))
    assert log_rate == pytest.approx(math.log10(A) + n * np.log10(stress), rel=1e-5)


def test_an_older_question_is_dropped():
    answers = PageAnswers(page_contents("norton"))

    def asked(number, **changes):
        return answers.answer(read_request(json.dumps(question(number=number, **changes)).encode()))

    assert asked(5)["number"] == 5
    with pytest.raises(Superseded):
        asked(4)
    assert asked(1, client="fedcba98")["number"] == 1  # another page counts for itself


def test_a_question_that_waits_is_dropped_when_a_newer_one_comes():
    answers = PageAnswers(page_contents("norton"))
    given = {}

    def waiting():
        try:
            given["old"] = answers.answer(read_request(json.dumps(question(number=1, exact=True)).encode()))
        except Superseded:
            given["old"] = "superseded"

    other = answers.turns.announce("fedcba98", 1)
    with answers.turns.taken(other, True):  # as while an exact answer of another page is worked out
        thread = threading.Thread(target=waiting)
        thread.start()
        while "0123456789abcdef" not in answers.turns._latest:
            time.sleep(0.001)
        answers.answer(read_request(json.dumps(question(number=2)).encode()))
    thread.join()
    assert given == {"old": "superseded"}


def test_a_newer_exact_answer_does_not_wait_for_one_that_runs(monkeypatch):
    """A simulation of a slider's last place is under way when it is let go at a new one."""
    answers, given = PageAnswers(page_contents("norton")), {}
    begun, go_on, work = threading.Event(), threading.Event(), PageAnswers._program_document

    def slow(self, page_law, values, theta, request):
        if request.number == 1:
            begun.set()
            assert go_on.wait(60)
        return work(self, page_law, values, theta, request)

    def asked(number):
        try:
            request = read_request(json.dumps(question(number=number, exact=True)).encode())
            given[number] = answers.answer(request)["number"]
        except Superseded:
            given[number] = "superseded"

    monkeypatch.setattr(PageAnswers, "_program_document", slow)
    first = threading.Thread(target=asked, args=(1,))
    first.start()
    assert begun.wait(60)
    asked(2)
    assert given == {2: 2}  # while the first still runs
    go_on.set()
    first.join()
    assert given == {2: 2, 1: "superseded"}


def test_answers_that_are_wanted_are_worked_out_one_at_a_time():
    turns, order = PageAnswers(page_contents("norton")).turns, []

    def second():
        with turns.taken(turns.announce("b", 1), True):
            order.append("second")

    with turns.taken(turns.announce("a", 1), True):
        thread = threading.Thread(target=second)
        thread.start()
        with turns.taken(turns.announce("c", 1), False):  # a quick one does not wait
            order.append("quick")
        time.sleep(0.02)
        order.append("first")
    thread.join()
    assert order == ["quick", "first", "second"]


def test_a_bulge_test_by_the_reduced_order_model_and_by_finite_elements():
    contents = page_contents(ck.law("norton"), specimen="bulge")
    answers = PageAnswers(contents)
    answers.train("bulge")
    program = {"specimen": "bulge", "load": "pressure", "steps": [[0.0, 8.0], [14400.0, 10.0]], "ramp": 5.0}
    program |= {"end": 28800.0, "temperature": 1123.0, "modulus": 150e3, "lengths": {"apex_thickness": 0.48}}
    values = {"A": 1e-16, "n": 5.0}
    quick, exact = (
        answers.answer(read_request(json.dumps(question(number=1, values=values, program=program, exact=e)).encode()))
        for e in (False, True)
    )
    run = ck.simulate(
        "norton", ck.specimen("bulge").replace(apex_thickness=0.48), values,
        loading=ck.load_steps("pressure", [(0.0, 8.0), (14400.0, 10.0)], 5.0), times=[28800.0], temperature=1123.0,
        elastic=ck.Elastic(150e3),
    )  # fmt: skip
    for name, values in run.outputs.items():
        assert exact["program"]["outputs"][name][-1] == pytest.approx(float(values[-1]), rel=1e-5)
        assert quick["program"]["outputs"][name][-1] == pytest.approx(float(values[-1]), rel=0.02)
    for answer in (quick, exact):
        section = answer["program"]["section"]
        nodes, moved = (np.array(v).reshape(-1, 2) for v in (section["nodes"], section["displacements"][-1]))
        top = moved[np.lexsort((nodes[:, 0], -nodes[:, 1]))[0], 1]
        assert top == pytest.approx(float(run.displacement(0.0, 28800.0)), rel=0.02)
    assert quick["program"]["section"]["stress"] is None
    assert len(exact["program"]["section"]["stress"][0]) == len(exact["program"]["section"]["elements"])


@pytest.mark.parametrize("stop", [KeyboardInterrupt, SystemExit, ZeroDivisionError])
def test_what_a_specimen_raises_is_an_answer(server, monkeypatch, stop):
    def fails(*_):
        raise stop("of a plugin")

    monkeypatch.setattr(PageAnswers, "_program_document", fails)
    answer = ask(server, client="00000000")
    assert answer.status == 500
    assert sentence(answer) == f"the prediction failed: {stop.__name__}: of a plugin"


def test_an_answer_warns_of_a_law_without_temperature_over_several_temperatures():
    tests = bars(ck.law("norton"), {"A": 1e-16, "n": 4.0}, [ck.constant_stress(s) for s in (40.0, 60.0)], seed=1)
    tests = [tests[0], tests[1].replace(temperature=tests[1].mean_temperature + 50.0)]
    with serving(page_contents("norton", tests)) as one:
        assert "does not depend on temperature" in ask(one, tests=[0, 1]).data["warning"]
        assert "warning" not in ask(one, tests=[0]).data
