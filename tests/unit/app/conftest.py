"""A server of a page of Norton's law."""

import pytest

from creepkit.app.contents import page_contents
from helpers.http_requests import serving


@pytest.fixture(scope="module")
def server():
    with serving(page_contents("norton")) as one:
        yield one
