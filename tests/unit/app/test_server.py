"""The server of a page: right answers to its page, one sentence to everything else, nothing to strangers."""

import json
import math
import socket
import threading
import time
from contextlib import suppress

import numpy as np
import pytest

import creepkit as ck
from creepkit.app.answers import PageAnswers
from creepkit.app.connections import LARGEST_HEAD, MOST_CONNECTIONS
from creepkit.app.contents import page_contents
from creepkit.app.requests import read_request
from creepkit.app.server import LARGEST_BODY
from creepkit.app.turns import Superseded
from helpers.http_requests import ask, question, request, send, serving
from helpers.planted_bars import bars


@pytest.fixture(scope="module")
def server():
    with serving(page_contents("norton")) as one:
        yield one


def sentence(answer):
    """The one thing that a refusal says."""
    assert answer.data.keys() == {"error"}
    assert "\n" not in answer.data["error"]
    assert "Traceback" not in answer.data["error"]
    return answer.data["error"]


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


@pytest.mark.parametrize("token", ["", "x", "%2e%2e", "../../etc/passwd", "..%2f..%2fetc%2fpasswd"])
def test_a_wrong_token_is_refused(server, token):
    for method, path, body in (("GET", f"/{token}/", None), ("POST", f"/{token}/predict", b"{}")):
        answer = request(server, method, path, body)
        assert answer.status == 403
        assert "token" in sentence(answer)
        assert server.token.encode() not in answer.body


@pytest.mark.parametrize("tail", ["../../etc/passwd", "%2e%2e/%2e%2e/etc/passwd", "page.html", "predict/", "predict?x"])
def test_there_are_no_files(server, tail):
    assert request(server, "GET", f"/{server.token}/{tail}").status == 404
    assert request(server, "POST", f"/{server.token}/{tail}", b"{}").status == 404


@pytest.mark.parametrize("method", ["PUT", "DELETE", "OPTIONS", "PATCH", "TRACE", "CONNECT", "HEAD", "PROPFIND"])
def test_other_methods_are_refused(server, method):
    answer = request(server, method, f"/{server.token}/")
    assert answer.status == 405
    assert "Access-Control" not in answer.head


HOSTS = ["evil.example", "evil.example:{port}", "127.0.0.1", "127.0.0.1:{port}.evil", None, ""]


@pytest.mark.parametrize("host", HOSTS)
def test_another_host_is_refused_also_where_its_name_leads_here(server, host):
    """As after DNS rebinding: the browser sends the name that it was given."""
    name = None if host is None else host.format(port=server.server_address[1])
    for method, path, body in (("GET", "/", None), ("POST", "/predict", json.dumps(question()).encode())):
        answer = request(server, method, f"/{server.token}{path}", body, {"Host": name})
        assert answer.status == 403
        assert b"creepkit-page" not in answer.body


def test_two_hosts_are_refused(server):
    port = server.server_address[1]
    answer = send(server, f"GET /{server.token}/ HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nHost: evil\r\n\r\n".encode())
    assert answer.status == 403


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": "https://127.0.0.1:{port}"},
        {"Origin": "http://127.0.0.1:1"},
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
        {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"},
    ],
)
def test_a_page_of_another_origin_cannot_ask(server, headers):
    headers = {name: value.format(port=server.server_address[1]) for name, value in headers.items()}
    answer = request(server, "POST", f"/{server.token}/predict", json.dumps(question()).encode(), headers)
    assert answer.status == 403
    assert "own page" in sentence(answer)


def test_what_forms_of_other_pages_can_send_is_refused(server):
    """A browser sends these types across origins without asking first."""
    for kind in ("text/plain", "application/x-www-form-urlencoded", "multipart/form-data; boundary=x", ""):
        body = json.dumps(question()).encode()
        answer = request(server, "POST", f"/{server.token}/predict", body, {"Content-Type": kind})
        assert answer.status == 415


def test_sizes_are_limited(server):
    path = f"/{server.token}/predict"
    for length, status in (
        (str(LARGEST_BODY + 1), 413), ("9" * 5000, 413), ("-1", 411), ("1e3", 411), ("\u0663", 411), (None, 411),
    ):  # fmt: skip
        head = {"Content-Length": length if length is None or length.isascii() else "\xb2"}
        assert request(server, "POST", path, b"{}", head).status == status
    assert request(server, "POST", path, b"{}", {"Transfer-Encoding": "chunked"}).status == 411
    assert request(server, "GET", "/" + "x" * 70000).status in (414, 403, 0)


@pytest.mark.parametrize(
    "body",
    [
        b"", b"{", b"[]", b"null", b"1", b'"x"', b"\xff\xfe", b"[" * 50000, b'{"law": NaN}', b'{"law": 1e999}',
        b'{"law": ' + b"9" * 5000 + b"}", b'{"a":1,"a":2}',
    ],
    ids=range(12),
)  # fmt: skip
def test_what_is_no_request_is_refused_in_a_sentence(server, body):
    answer = request(server, "POST", f"/{server.token}/predict", body)
    assert answer.status == 400
    assert len(sentence(answer)) < 400


WRONG = {
    "unknown key": {"path": "/etc/passwd"},
    "text for a number": {"law": "0"},
    "negative law": {"law": -1},
    "boolean law": {"law": True},
    "law that is not there": {"law": 7},
    "test that is not there": {"tests": [0]},
    "too many tests": {"tests": [0] * 1000},
    "values of text": {"values": {"A": "1e-16", "n": 4.0}},
    "value of null": {"values": {"A": None, "n": 4.0}},
    "huge value": {"values": {"A": 1e308, "n": 4.0}},
    "long name": {"values": {"A" * 1000: 1.0}},
    "client": {"client": "<script>"},
    "no temperature": {"rate_temperature": 0.0},
    "exact in words": {"exact": "yes"},
}


@pytest.mark.parametrize("case", WRONG)
def test_strict_models_refuse(server, case):
    answer = ask(server, **WRONG[case])
    assert answer.status == 400
    assert sentence(answer)


PROGRAMS = {
    "no specimen of the page": {"specimen": "<img src=x onerror=alert(1)>"},
    "no load of it": {"load": "pressure"},
    "a length it has not": {"lengths": {"span": 3.0}},
    "a path for a length": {"lengths": {"../../x": 3.0}},
    "backwards": {"steps": [[0.0, 100.0], [-5.0, 90.0]]},
    "beyond numbers": {"steps": [[0.0, 1e59]]},
    "negative": {"steps": [[0.0, -1.0]]},
    "no steps": {"steps": []},
    "too many steps": {"steps": [[float(k), 1.0] for k in range(51)]},
    "a triple": {"steps": [[0.0, 1.0, 2.0]]},
    "no end": {"end": 0.0},
    "temperature": {"temperature": 1e9},
}


@pytest.mark.parametrize("case", PROGRAMS)
def test_programs_that_cannot_be_are_refused(server, case):
    answer = ask(server, number=2, program={**question()["program"], **PROGRAMS[case]})
    assert answer.status in (400, 422)
    assert sentence(answer)


@pytest.mark.parametrize("values", [{"A": -1.0, "n": 4.0}, {"A": 1e-16}, {"A": 1e-16, "n": 4.0, "x": 1.0}])
def test_values_that_the_law_refuses(server, values):
    answer = ask(server, number=3, values=values)
    assert answer.status == 422
    assert "norton" in sentence(answer)


def test_extreme_values_end_in_an_answer(server):
    """Whatever the sliders say, the page gets numbers or a sentence."""
    for A, n in ((1e60, 4.0), (1e-60, 4.0), (0.0, 4.0), (1e-16, 60.0), (1e-16, -60.0), (1e-16, 1e60)):
        answer = ask(server, number=4, values={"A": A, "n": n})
        assert answer.status in (200, 422)
        assert "error" in answer.data or answer.data["program"]


def test_garbage_does_not_end_the_server(server):
    texts = [b"", b"\r\n\r\n", b"GET", b"GET / HTTP/9.9\r\n\r\n", b"\x16\x03\x01\x02\x00\x01\x00"]
    for text in (*texts, b"GET / HTTP/1.1\r\nx\r\n\r\n", b"POST / HTTP/1.1\r\n" + b"x: y\r\n" * 500 + b"\r\n"):
        send(server, text)
    assert ask(server, number=5).status == 200


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


def test_a_request_whose_bytes_drip_is_ended(server, monkeypatch):
    """Whoever sends a byte now and then holds no connection for long."""
    monkeypatch.setattr("creepkit.app.server.DEADLINE", 0.2)
    with socket.create_connection(server.server_address[:2], timeout=30) as connection:
        connection.settimeout(0.05)
        for _ in range(200):  # 10 s, and less than the patience for a connection that is silent
            try:
                connection.sendall(b"G")
                if connection.recv(1 << 16) is not None:
                    break
            except TimeoutError:
                continue
            except OSError:
                break
        else:
            raise AssertionError("the server still reads")
    assert ask(server).status == 200


@pytest.mark.parametrize("stop", [KeyboardInterrupt, SystemExit, ZeroDivisionError])
def test_what_a_specimen_raises_is_an_answer(server, monkeypatch, stop):
    def fails(*_):
        raise stop("of a plugin")

    monkeypatch.setattr(PageAnswers, "_program_document", fails)
    answer = ask(server, client="00000000")
    assert answer.status == 500
    assert sentence(answer) == f"the prediction failed: {stop.__name__}: of a plugin"


def test_a_number_too_small_for_a_time_is_refused(server):
    assert ask(server, client="00000001", program=question()["program"] | {"end": 5e-324}).status == 400


def test_an_answer_warns_of_a_law_without_temperature_over_several_temperatures():
    tests = bars(ck.law("norton"), {"A": 1e-16, "n": 4.0}, [ck.constant_stress(s) for s in (40.0, 60.0)], seed=1)
    tests = [tests[0], tests[1].replace(temperature=tests[1].mean_temperature + 50.0)]
    with serving(page_contents("norton", tests)) as one:
        assert "does not depend on temperature" in ask(one, tests=[0, 1]).data["warning"]
        assert "warning" not in ask(one, tests=[0]).data


def test_connections_that_ask_for_nothing_give_their_places(capfd):
    """200 of them, silent or begun, neither keep the page from anybody nor make a thread each."""
    with serving(page_contents("norton")) as one:
        before, idle = threading.active_count(), []
        try:
            for k in range(200):
                connection = socket.create_connection(one.server_address[:2], timeout=30)
                idle.append(connection)
                if k % 3:
                    connection.sendall(b"GET / HTTP/1.1\r\nX: " if k % 3 == 1 else b"P")
                if k % 50 == 49:
                    assert ask(one, number=k).status == 200
            assert request(one, "GET", f"/{one.token}/").status == 200
            assert threading.active_count() - before <= 2 * MOST_CONNECTIONS + 2
        finally:
            for connection in idle:
                connection.close()
    assert capfd.readouterr() == ("", "")


def test_a_page_that_waits_keeps_its_connection_before_strangers():
    with serving(page_contents("norton")) as one, socket.create_connection(one.server_address[:2], timeout=30) as page:
        head = f"GET /{one.token}/ HTTP/1.1\r\nHost: 127.0.0.1:{one.server_address[1]}\r\n\r\n".encode()

        def asked():
            page.sendall(head)
            received = b""
            while len(received) < len(one.page):
                received += page.recv(1 << 16)
            return received.startswith(b"HTTP/1.1 200")

        assert asked()
        strangers = [socket.create_connection(one.server_address[:2], timeout=30) for _ in range(2 * MOST_CONNECTIONS)]
        assert asked()
        for stranger in strangers:
            stranger.close()


def test_what_no_browser_sends_is_ended_without_a_word_to_the_terminal(server, capfd):
    """HTTP/0.9, garbage after a request, heads without end."""
    host = f"Host: 127.0.0.1:{server.server_address[1]}\r\n".encode()
    page = f"GET /{server.token}/".encode()
    assert send(server, page + b"\r\n" + host + b"\r\n").status in (0, 400, 403)
    both = send(server, page + b" HTTP/1.1\r\n" + host + b"\r\n" + b"\x00\xff garbage \r\n\r\n" * 50)
    assert both.status == 200
    assert both.body.count(b"HTTP/1.1 400") <= 1
    for header in (b"X-%d: " + b"x" * 5000 + b"\r\n", b"X-%d: " + b"x" * 70000 + b"\r\n"):
        head = b"".join(header % k for k in range(80))
        assert len(head) > LARGEST_HEAD
        with suppress(ConnectionError):  # it may be ended while it still sends
            assert send(server, page + b" HTTP/1.1\r\n" + host + head + b"\r\n").status in (0, 431)
    assert ask(server, number=6).status == 200
    assert capfd.readouterr() == ("", "")
