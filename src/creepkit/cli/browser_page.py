"""How a browser is sent to an address with a token that other users of the machine must not learn.

What a browser is started with stands in the list of processes, for everybody to read. It is started with the name of a
page that only its user can read, and that page sends it on.
"""

from __future__ import annotations

import html
import os
import shutil
import sys
import tempfile
import threading
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="referrer" content="no-referrer">
<meta http-equiv="refresh" content="0; url={url}"><title>creepkit</title></head>
<body><p><a href="{url}">creepkit app</a></p></body></html>
"""


FOLDER_PREFIX = "creepkit-app-"


@contextmanager
def browser_at(url: str) -> Iterator[bool]:
    """Have a browser opened at an address that is served meanwhile; the page that sends it there goes at the end.

    Yields whether that page could be written: without it no browser is started. A thread waits for browsers that end
    only when the user leaves them, as those of a terminal.
    """
    folder = _private_folder()
    page = None if folder is None else _written_page(folder, url)
    try:
        if page is not None:
            threading.Thread(target=webbrowser.open, args=(page.as_uri(),), daemon=True).start()
        yield page is not None
    finally:
        if folder is not None:
            shutil.rmtree(folder, ignore_errors=True)


def _private_folder() -> Path | None:
    """A new folder that only this user can enter; None where none can be made.

    On Linux it lies in the home folder, under a name without a dot: browsers that are snaps have a /tmp of their own
    and see no hidden folders. Elsewhere temporary folders are those of the user, and browsers read them.
    """
    homes = [os.path.expanduser("~")] if sys.platform.startswith("linux") else []
    for place in [*homes, None]:
        try:
            return Path(tempfile.mkdtemp(prefix=FOLDER_PREFIX, dir=place)).absolute()
        except OSError:
            continue
    return None


def _written_page(folder: Path, url: str) -> Path | None:
    """The page; None where it cannot be written, as on a full disk."""
    path = folder / "open.html"
    try:
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with open(descriptor, "w", encoding="utf-8") as file:
            file.write(PAGE.format(url=html.escape(url)))
    except OSError:
        return None
    return path
