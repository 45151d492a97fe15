"""Study files: every misspelt key, wrong type and unknown name is refused in one sentence, with its line."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from creepkit.errors import StudyError
from creepkit.studies.study_file import known_keys, parse_study
from helpers.paths import ROOT

FULL = (ROOT / "tests" / "data" / "study_with_every_table.toml").read_text(encoding="utf-8")


KEY = re.compile(r"^(\w+) = ", re.MULTILINE)


def keys_of(text: str) -> Iterator[tuple[int, str]]:
    """(position, key) of every key at the beginning of a line."""
    for match in KEY.finditer(text):
        yield match.start(), match[1]


def misspelt(word: str) -> Iterator[str]:
    """The word with a letter left out, or swapped with the next, in its middle, and with one more."""
    middle = len(word) // 2
    yield word[:middle] + word[middle + 1 :]
    yield word[: middle - 1] + word[middle] + word[middle - 1] + word[middle + 1 :] if middle else word + "s"
    yield word + "x"


MISSPELT = [
    (position, key, wrong)
    for position, key in keys_of(FULL)
    for wrong in misspelt(key)
    if wrong != key and len(wrong) > 1
]


def refusal(text: str, path: Path = Path("study.toml")) -> str:
    with pytest.raises(StudyError) as caught:
        parse_study(path, text)
    return str(caught.value)


def test_the_full_file_is_valid_and_names_most_keys():
    model = parse_study(Path("study.toml"), FULL).model
    assert model.design is not None
    assert model.design.budget_h == 300
    top = set(known_keys(()))
    assert top == set(tomllib.loads(FULL))
    assert len(MISSPELT) > 200


def test_the_page_has_the_name_of_its_study_where_none_is_given():
    """Several studies in one folder then do not replace each other's page."""
    text = '[data]\nfiles = ["*.csv"]\n[report]\n'
    named = {"study": "report.html", "blades": "blades.html"}
    found = {name: parse_study(Path(f"{name}.toml"), text).model.report for name in named}
    assert {name: report.file for name, report in found.items()} == named


def test_a_misspelt_key_is_refused_with_its_line_and_nearly_always_the_right_one():
    right = 0
    for position, key, wrong in MISSPELT:
        line = FULL.count("\n", 0, position) + 1
        told = refusal(FULL[:position] + wrong + FULL[position + len(key) :])
        assert told.startswith(f"study.toml:{line}: unknown key '{wrong}' in ["), told
        assert re.findall(r"^\[+([\w.]+)", FULL[:position], re.MULTILINE)[-1].split(".")[0] in told
        assert f"known: {', '.join(sorted(known_keys(_table_of(position))))}" in told
        assert "\n" not in told
        right += f"did you mean '{key}'" in told
    assert right >= 0.96 * len(MISSPELT)


def _table_of(position: int) -> list[str]:
    return re.findall(r"^\[+([\w.]+)", FULL[:position], re.MULTILINE)[-1].split(".")


@pytest.mark.parametrize("table", known_keys(()))
def test_a_misspelt_table_is_refused(table):
    for wrong in misspelt(table):
        text = FULL.replace(f"[{table}]", f"[{wrong}]").replace(f"[{table}.", f"[{wrong}.")
        told = refusal(text)
        assert f"unknown table [{wrong}] at the top of a study; did you mean '{table}'?" in told
        assert told.startswith(f"study.toml:{text[: text.index(wrong)].count(chr(10)) + 1}: ")


SEVERAL_TYPES = (
    "only fix ignore tests without_nuisances load weights laws files methods tensile_strengths temperature_C "
    "parameters targets frames names channels missing"
)
"""Keys whose values may be of more than one type."""

WRONG_VALUES = ('"text"', "true", "{ }", "nan", "1979-05-27", "[[1]]")


def test_values_of_a_wrong_type_are_refused_with_their_line():
    """No value of another type passes for a number, a text, a truth value or a table."""
    refused = 0
    for position, key in keys_of(FULL):
        end = FULL.index("\n", position)
        line = FULL.count("\n", 0, position) + 1
        right = tomllib.loads(f"value = {FULL[position:end].partition(' = ')[2]}")["value"]
        for wrong in WRONG_VALUES:
            value = tomllib.loads(f"value = {wrong}")["value"]
            if isinstance(value, type(right)) or (value == [] and isinstance(right, str)):
                continue
            text = f"{FULL[:position]}{key} = {wrong}{FULL[end:]}"
            try:
                parse_study(Path("study.toml"), text)
            except StudyError as error:
                told = str(error)
                refused += 1
                assert told.startswith(f"study.toml:{line}: "), told
                assert "\n" not in told
            else:
                assert f" {key} " in f" {SEVERAL_TYPES} ", (key, wrong)
    assert refused > 300


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("", 1, "has no 'data'"),
        ("[data]\n", 1, 'write files = ["*.csv"]'),
        ("[data]\nfiles = []\n", 2, "1 or more entries"),
        ("[data\nfiles = 1", 1, "not TOML"),
        ('[data]\nfiles = ["a"\n\n[study]\n', 4, "not TOML"),
        ('[data]\nfiles = ["a"]\nfiles = ["b"]\n', 3, "not TOML"),
        ('[data]\nfiles = ["a"]\n[[forecast]]\nend_h = 3\n', 3, "'name'"),
        ('[data]\nfiles = ["a"]\n[exclude]\ntest = "a"\n', 3, "in two brackets, [[exclude]]"),
        ('[data]\nfiles = ["a"]\n[forecast]\nname = "a"\n[forecast]\nname = "b"\n', 5, "write [[forecast]] above"),
        ('[data]\nfiles = ["a"]\n[study]\nseed = 1\n[study]\ntitle = "b"\n', 5, "under one heading"),
        ('[data]\nfiles = ["a"]\n[[design]]\ngoal = "law"\n', 3, "in one bracket, [design]"),
        (
            '[data]\nfiles = ["a"]\n[design]\ngoal = "laws"\n',
            4,
            "must be one of these: law, parameters, rate, exponent",
        ),
        ("# stress_MPa: 100\nTime (h),Creep strain (%)\n0.5,0.1\n", 2, "but looks like data"),
        ("a = " + "[" * 3000, None, "too deep"),
        ('[data]\nfiles = ["a"]\n[study]\nseed = ' + "1" * 5000, None, "too large"),
        ('[data]\nfiles = ["a"]\n[identification]\nlaws = ["norton"]\nweights = { s = 1e400 }', 5, "numbers by output"),
        ('[data]\nfiles = ["a"]\n[identification]\nlaws = ["norton"]\nweights = { s = 1' + "0" * 400 + "}", 5, ""),
    ],
)
def test_other_layouts_are_refused(text, line, words):
    told = refusal(text)
    assert words in told
    assert line is None or told.startswith(f"study.toml:{line}: ")
