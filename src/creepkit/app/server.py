"""The local server of an interactive page: one page and one endpoint, for the person who started it alone.

It is bound to 127.0.0.1 and answers under a random token alone. A page of another site cannot read it (the name of the
host must be that of this machine, which keeps out names that were rebound to it) nor send to it (an origin must be this
server's, and a body must be JSON, which browsers do not send across origins unasked). No request names a file.
"""

from __future__ import annotations

import hmac
import json
import secrets
import socket
import threading
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from creepkit.app.answers import PageAnswers
from creepkit.app.connections import BoundedReader, Connections
from creepkit.app.contents import PageContents
from creepkit.app.page import page_html
from creepkit.app.requests import RequestError, read_request
from creepkit.app.turns import Superseded
from creepkit.errors import CreepkitError

ADDRESS = "127.0.0.1"
LARGEST_BODY = 64 * 1024
"""Bytes of a request."""


PATIENCE = 20.0
"""s that a connection may be silent."""


DEADLINE = 20.0
"""s in which a whole request must arrive, however slowly its bytes drip."""


class PageServer(ThreadingHTTPServer):
    """Serves one page; `url` is where. port : 0 for any that is free."""

    daemon_threads = True
    allow_reuse_address = True
    request_queue_size = 128

    def __init__(self, contents: PageContents, port: int = 0) -> None:
        self.token = secrets.token_urlsafe(24)
        self.answers = PageAnswers(contents)
        self.connections = Connections()
        super().__init__((ADDRESS, port), PageHandler)
        self.nonce = secrets.token_urlsafe(16)
        self.page = page_html(contents, nonce=self.nonce, endpoint=f"/{self.token}/predict").encode("utf-8")

    @property
    def url(self) -> str:
        """Of the page, with its token."""
        return f"http://{ADDRESS}:{self.server_address[1]}/{self.token}/"

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answer in a thread, unless too many connections are busy."""
        if not self.connections.enter():
            self.shutdown_request(request)
            return
        try:
            super().process_request(request, client_address)
        except BaseException:  # no further thread, say
            self.connections.leave()
            raise

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Answer one connection."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self.connections.leave()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing: a browser may close a connection when it likes."""


class PageHandler(BaseHTTPRequestHandler):
    """Answers GET of the page and POST of its endpoint; everything else is refused in one sentence."""

    server: PageServer
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "creepkit", ""
    timeout = PATIENCE
    wbufsize = -1  # head and body leave together
    disable_nagle_algorithm = True
    _late = _trusted = False
    _deadline: threading.Timer

    def setup(self) -> None:
        """What is read is bounded."""
        super().setup()
        self._reader = BoundedReader(self.rfile)
        self.rfile: Any = self._reader

    def finish(self) -> None:
        """Close both ways, also where nobody listens any more."""
        try:
            with suppress(OSError):
                super().finish()
        finally:
            self._reader.close()

    def handle_one_request(self) -> None:
        """One request: its first byte within the patience for a silent connection, all of it before a deadline."""
        self.server.connections.waits(self.connection, self._trusted)
        try:
            self._reader.begin()
        except OSError:
            self._end_waiting()
            self.close_connection = True
            return
        self._deadline = threading.Timer(DEADLINE, self._end_reading)
        self._deadline.daemon = True
        self._deadline.start()
        try:
            super().handle_one_request()
        finally:
            self._end_waiting()
            self.close_connection |= self._late

    def _end_waiting(self) -> None:
        """The request has arrived, or will not."""
        self.server.connections.is_busy(self.connection)
        if deadline := self.__dict__.get("_deadline"):
            deadline.cancel()

    def _end_reading(self) -> None:
        """What waits for further bytes of a late request finds its end."""
        self._late = True
        with suppress(OSError):
            self.connection.shutdown(socket.SHUT_RD)

    def do_GET(self) -> None:
        """The page."""
        if not self._allowed():
            return
        self._end_waiting()
        if self.path == f"/{self.server.token}/":
            self._send(HTTPStatus.OK, self.server.page, "text/html; charset=utf-8")
        else:
            self._refuse(HTTPStatus.NOT_FOUND, "there is nothing here but the page and its endpoint")

    def do_POST(self) -> None:
        """A prediction."""
        if not self._allowed():
            return
        if self.path != f"/{self.server.token}/predict":
            self._refuse(HTTPStatus.NOT_FOUND, "there is nothing here but the page and its endpoint")
            return
        body = self._body()
        if body is None:
            return
        try:
            answer = self.server.answers.answer(read_request(body))
        except Superseded:
            self._send_json(HTTPStatus.OK, {"superseded": True})
        except RequestError as error:
            self._send_json(HTTPStatus.BAD_REQUEST, {"error": _sentence(error)})
        except CreepkitError as error:
            self._send_json(HTTPStatus.UNPROCESSABLE_ENTITY, {"error": _sentence(error)})
        except (Exception, KeyboardInterrupt, SystemExit) as error:  # of somebody's specimen or law: the page shows it
            problem = f"the prediction failed: {type(error).__name__}: {_sentence(error)}"
            self._send_json(HTTPStatus.INTERNAL_SERVER_ERROR, {"error": problem})
        else:
            self._send_json(HTTPStatus.OK, answer)

    def __getattr__(self, name: str) -> Any:
        """Any other method is refused."""
        if name.startswith("do_"):
            return self._refuse_method
        raise AttributeError(name)

    def _refuse_method(self) -> None:
        if self._allowed():
            self._refuse(HTTPStatus.METHOD_NOT_ALLOWED, "only GET of the page and POST of its endpoint are answered")

    # ---- what is let in --------------------------------------------------------------------------------------------

    def _allowed(self) -> bool:
        """Whether host, origin and token are right; refuses the request where they are not."""
        port = self.server.server_address[1]
        hosts = {f"{name}:{port}" for name in (ADDRESS, "localhost")}
        origin, site = self.headers.get("Origin"), self.headers.get("Sec-Fetch-Site", "none")
        if self.headers.get_all("Host", []) not in [[host] for host in hosts]:
            self._refuse(HTTPStatus.FORBIDDEN, "this server answers to its own address alone")
        elif (origin is not None and origin not in {f"http://{host}" for host in hosts}) or (
            site not in ("none", "same-origin") and not self._is_navigation()
        ):
            self._refuse(HTTPStatus.FORBIDDEN, "this server answers its own page alone")
        elif not self._token_is_right():
            self._refuse(HTTPStatus.FORBIDDEN, "the token of this address is wrong; use the one that was printed")
        else:
            self._trusted = True
            return True
        return False

    def _is_navigation(self) -> bool:
        """Whether a person followed a link, from a mail or a terminal in the browser, to the page itself."""
        return self.command == "GET" and self.headers.get("Sec-Fetch-Mode") == "navigate"

    def _token_is_right(self) -> bool:
        given = self.path.split("/")[1] if self.path.startswith("/") else ""
        return hmac.compare_digest(given.encode("utf-8", "replace"), self.server.token.encode())

    def _body(self) -> bytes | None:
        """The body of a POST; None, and refused, where it is not JSON of a known and allowed length."""
        kind = self.headers.get("Content-Type", "").partition(";")[0].strip().lower()
        length = self.headers.get("Content-Length", "")
        if kind != "application/json":
            self._refuse(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "a request is application/json")
        elif self.headers.get("Transfer-Encoding") or not (length.isascii() and length.isdigit()):
            self._refuse(HTTPStatus.LENGTH_REQUIRED, "a request states its Content-Length")
        elif len(length) > 9 or int(length) > LARGEST_BODY:
            self._refuse(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"a request has at most {LARGEST_BODY} bytes")
        else:
            body = self._reader.read(int(length))
            self._end_waiting()  # the answer may take longer
            return body
        return None

    # ---- what leaves -----------------------------------------------------------------------------------------------

    def _refuse(self, status: HTTPStatus, sentence: str) -> None:
        """Refuse, and close the connection, for its body was not read."""
        self.close_connection = True
        self._send_json(status, {"error": sentence})

    def _send_json(self, status: HTTPStatus, data: dict[str, Any]) -> None:
        text = json.dumps(data, allow_nan=False, separators=(",", ":"))
        self._send(status, text.encode("utf-8"), "application/json")

    def _send(self, status: HTTPStatus, body: bytes, kind: str) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        for name, value in self._security_headers():
            self.send_header(name, value)
        if self.close_connection:
            self.send_header("Connection", "close")
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)
        self.wfile.flush()

    def _security_headers(self) -> list[tuple[str, str]]:
        nonce = self.server.nonce
        policy = (
            f"default-src 'none'; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; connect-src 'self'; "
            "img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
        )
        return [
            ("Content-Security-Policy", policy),
            ("X-Content-Type-Options", "nosniff"),
            ("Referrer-Policy", "no-referrer"),
            ("Cross-Origin-Resource-Policy", "same-origin"),
            ("Cross-Origin-Opener-Policy", "same-origin"),
            ("Cache-Control", "no-store"),
        ]

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """Errors that http.server finds itself are one sentence too."""
        self.close_connection = True
        if not hasattr(self, "headers"):
            self.command = getattr(self, "command", None) or "GET"
        self._send_json(HTTPStatus(code), {"error": message or HTTPStatus(code).phrase})

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing of requests."""


def _sentence(error: BaseException) -> str:
    return " ".join(str(error).split())[:2000]
