"""Connections to the server of a page: slow, silent and broken ones end, and the page keeps its own."""

import socket
import threading
from contextlib import suppress

from creepkit.app.connections import LARGEST_HEAD, MOST_CONNECTIONS
from creepkit.app.contents import page_contents
from helpers.http_requests import ask, request, send, serving


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
