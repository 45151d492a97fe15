"""The page that sends a browser to `creepkit app`: the token stands in no list of processes, and in no open file."""

import os
import queue
import re
import stat
import subprocess
import sys
import time
import urllib.request
from pathlib import Path
from urllib.parse import urlparse
from urllib.request import url2pathname

import pytest

from creepkit.cli import browser_page
from helpers.running_programs import running
from helpers.source_tree import PACKAGE

URL = "http://127.0.0.1:8000/a-token_of-24-bytes/"


def _file(uri: str) -> Path:
    return Path(url2pathname(urlparse(uri).path))


@pytest.fixture
def home(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setenv("TMPDIR", str(tmp_path / "temporary"))
    monkeypatch.setattr("tempfile.tempdir", None)
    for name in ("home", "temporary"):
        (tmp_path / name).mkdir()
    return tmp_path / "home"


@pytest.mark.skipif(os.name == "nt", reason="permissions are those of Unix")
def test_the_page_is_private_leads_to_the_address_and_goes(home, monkeypatch):
    opened = queue.Queue()
    monkeypatch.setattr("webbrowser.open", opened.put)
    before = os.umask(0)
    try:
        with browser_page.browser_at(URL) as started:
            assert started
            uri = opened.get(timeout=60)
            assert "a-token" not in uri
            path = _file(uri)
            assert re.search(r'content="0; url=([^"]*)"', path.read_text())[1] == URL
            assert stat.S_IMODE(path.stat().st_mode) == 0o600
            assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700
            if sys.platform.startswith("linux"):  # a snap sees the home folder, but neither /tmp nor hidden names
                assert path.parent.parent == home
                assert not path.parent.name.startswith(".")
    finally:
        os.umask(before)
    assert not path.parent.exists()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="elsewhere it is not the home folder that is taken")
def test_without_a_home_folder_the_temporary_one_is_taken_and_without_both_no_browser_is_started(home, monkeypatch):
    opened = queue.Queue()
    monkeypatch.setattr("webbrowser.open", opened.put)
    home.rmdir()
    with browser_page.browser_at(URL) as started:
        assert started
        assert _file(opened.get(timeout=60)).parent.parent == home.parent / "temporary"
    monkeypatch.setattr("tempfile.mkdtemp", lambda **options: (_ for _ in ()).throw(PermissionError(13, "no")))
    with browser_page.browser_at(URL) as started:
        assert not started


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_no_process_has_the_token_among_its_arguments(home, tmp_path):
    """A browser that follows the page as browsers do: it gets the page of the law, and its arguments name no token."""
    seen, got = tmp_path / "seen", tmp_path / "got"
    browser = tmp_path / "browser"
    browser.write_text(
        f"#!{sys.executable}\n"
        "import re, sys, urllib.request\n"
        f"open({str(seen)!r}, 'w').write(repr(sys.argv))\n"
        "page = urllib.request.urlopen(sys.argv[1]).read().decode()\n"
        "address = re.search('url=([^\"]*)', page)[1]\n"
        f"open({str(got)!r}, 'wb').write(urllib.request.urlopen(address).read())\n"
    )
    browser.chmod(0o700)
    program = "from creepkit.cli import main; main()"
    environment = {**os.environ, "BROWSER": str(browser), "PYTHONPATH": str(PACKAGE.parent)}
    words = [sys.executable, "-c", program, "app", "norton"]
    with running(words, stdout=subprocess.PIPE, env=environment) as process:
        line = process.stdout.readline()
        address = line.split()[-1]
        token = urlparse(address).path.strip("/")
        deadline = time.monotonic() + 60
        while not (got.exists() and got.stat().st_size) and time.monotonic() < deadline:
            time.sleep(0.05)
        assert len(token) == 32
        assert token not in seen.read_text()
        assert b"norton" in got.read_bytes().lower()
        assert b"norton" in urllib.request.urlopen(address, timeout=60).read().lower()  # the printed address holds
        assert list(home.glob("creepkit-app-*"))
        process.terminate()
        assert process.wait(60) == 0
    assert not list(home.glob("creepkit-app-*"))
