"""Requests to a page's server as a stranger could send them: bytes over a socket, and what comes back."""

from __future__ import annotations

import json
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, NamedTuple

from creepkit.app.contents import PageContents
from creepkit.app.server import PageServer


class Answer(NamedTuple):
    status: int
    head: str
    body: bytes

    @property
    def data(self) -> Any:
        return json.loads(self.body)


@contextmanager
def serving(contents: PageContents) -> Iterator[PageServer]:
    """A server of these contents in this process."""
    with PageServer(contents) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        yield server
        server.shutdown()
        thread.join()


def send(server: PageServer, text: bytes) -> Answer:
    """What the server answers to these bytes; an empty answer has status 0."""
    with socket.create_connection(server.server_address[:2], timeout=30) as connection:
        connection.sendall(text)
        with suppress(OSError):  # the server may have ended it already
            connection.shutdown(socket.SHUT_WR)
        received = b""
        while part := connection.recv(1 << 16):
            received += part
    head, _, body = received.partition(b"\r\n\r\n")
    words = head.split()
    known = len(words) > 1 and head.startswith(b"HTTP/")
    return Answer(int(words[1]) if known else 0, head.decode("latin-1"), body)


def request(
    server: PageServer, method: str, path: str, body: bytes | None = None, headers: dict[str, str] | None = None
) -> Answer:
    """One request with the right host, unless `headers` say otherwise; None takes a header away."""
    given: dict[str, Any] = {"Host": f"127.0.0.1:{server.server_address[1]}", "Connection": "close"}
    if body is not None:
        given |= {"Content-Type": "application/json", "Content-Length": str(len(body))}
    given |= headers or {}
    lines = [f"{method} {path} HTTP/1.1", *(f"{name}: {value}" for name, value in given.items() if value is not None)]
    return send(server, "\r\n".join([*lines, "", ""]).encode("latin-1") + (body or b""))


def question(**changes: Any) -> dict[str, Any]:
    """What a page asks of a bar under 100 MPa by Norton's law."""
    program = {"specimen": "uniaxial", "load": "stress", "steps": [[0.0, 100.0]], "end": 36000.0, "temperature": 1073.0}
    values = {"A": 1e-16, "n": 4.0}
    return {
        **{"client": "0123456789abcdef", "number": 1, "law": 0, "values": values, "program": program},
        **{"tests": [], "rate_temperature": 1073.0, "exact": False},
        **changes,
    }


def ask(server: PageServer, **changes: Any) -> Answer:
    """The answer to such a question."""
    return request(server, "POST", f"/{server.token}/predict", json.dumps(question(**changes)).encode())


def sentence(answer: Answer) -> str:
    """The one thing that a refusal says."""
    assert answer.data.keys() == {"error"}
    assert "\n" not in answer.data["error"]
    assert "Traceback" not in answer.data["error"]
    return str(answer.data["error"])
