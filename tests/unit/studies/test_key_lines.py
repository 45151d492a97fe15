"""Lines of the keys of a TOML text are found for all that the parser of the standard library reads."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from creepkit.studies.study_file import key_lines

NAMES = st.sampled_from(["a", "b-c", "d_1", '"e f"', "'g.h'", '"i\\"j"'])
SCALARS = st.sampled_from(["1", "-2.5e3", "true", '"x # y"', "'''l\n]m'''", '"""n\n"} o"""', "1979-05-27", "[]", "{}"])
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, min_size=1, max_size=3).map(lambda items: "[ # c ]\n" + ",\n ".join(items) + ",\n]"),
    max_leaves=5,
)


def paths_of(data: Any, path: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    """Of keys and tables; items of a list that is a value stand on the line of its key."""
    tables = isinstance(data, list) and bool(data) and all(isinstance(one, dict) and one for one in data)
    for key, value in data.items() if isinstance(data, dict) else enumerate(data) if tables else ():
        yield (*path, key)
        yield from paths_of(value, (*path, key))


@settings(max_examples=150, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(["[{}]", "[[{}]]", ""]), NAMES, NAMES, VALUES), max_size=6))
def test_the_lines_are_those_of_all_keys_that_tomllib_reads(parts):
    """Whatever tomllib reads, the same keys and tables are found."""
    text = "# begin\n"
    for heading, table, key, value in parts:
        text += f"{heading.format(table)} # h\n" if heading else "\n"
        text += f"{key} = {value} # v\n"
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return
    lines = key_lines(text)
    assert set(paths_of(data)) == set(lines)
    for path, line in lines.items():
        name = next(part for part in reversed(path) if isinstance(part, str))
        shown = text.splitlines()[line - 1]
        if isinstance(path[-1], str):
            assert name in shown or name.replace('"', '\\"') in shown
