"""The server of a page refuses what its page does not ask, in one sentence, and gives nothing to strangers."""

import json

import pytest

from creepkit.app.server import LARGEST_BODY
from helpers.http_requests import ask, question, request, send, sentence


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


def test_a_number_too_small_for_a_time_is_refused(server):
    assert ask(server, client="00000001", program=question()["program"] | {"end": 5e-324}).status == 400
