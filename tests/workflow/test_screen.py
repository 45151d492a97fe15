"""A small plate from a folder of files to its table, on the command line."""

import csv
import json

import pytest
from typer.testing import CliRunner

from creepkit.cli.app import app
from creepkit.readers.history_csv import write_history
from creepkit.screening.planted import planted_plate
from helpers.planted_alloys import bulge

LAWS = ("--law", "norton", "--law", "strain-hardening")
HOW = (*LAWS, "--surrogate", "dimple", "--dense", "none", "--confirm", "always", "--workers", "1")


def screen(folder, *more):
    return CliRunner().invoke(app, ["screen", str(folder / "tests"), "--to", str(folder / "screened"), *HOW, *more])


@pytest.fixture(scope="module")
def plate(tmp_path_factory):
    """An alloy of strain hardening, one that stays elastic, and a table that knows the first alone."""
    folder = tmp_path_factory.mktemp("plate")
    planted = planted_plate(2)
    one = planted.histories[1]
    assert planted.truth[one.alloy].law == "strain-hardening"
    (folder / "tests").mkdir()
    write_history(one, folder / "tests" / "one.csv")
    write_history(bulge("flat", "Flat", rise=0.0), folder / "tests" / "flat.csv")
    contents = planted.compositions.atomic[one.alloy]
    text = f"alloy,{','.join(contents)}\n{one.alloy},{','.join(map(str, contents.values()))}\n"
    (folder / "compositions.csv").write_text(f"# unit: at.%\n{text}")
    told = screen(folder, "--compositions", str(folder / "compositions.csv"))
    assert told.exit_code == 0, told.output
    return folder, one.alloy, told


def test_it_finds_the_planted_law_and_confirms_it(plate):
    folder, alloy, told = plate
    with (folder / "screened" / "plate.csv").open() as stream:
        rows = {row["alloy"]: row for row in csv.DictReader(stream)}
    assert (rows[alloy]["law"], rows[alloy]["decisive"], rows[alloy]["confirmed"]) == ("strain-hardening", "yes", "yes")
    assert rows["Flat"]["law"] == ""
    assert "2 alloys" in told.stdout
    assert "failed: alloy 'Flat': elastic only, there is no creep to identify" in " ".join(told.stdout.split())
    assert "no alloy 'Flat', whose class stays unknown" in told.stdout


def test_everything_is_written(plate):
    folder, alloy, _ = plate
    written = {str(path.relative_to(folder / "screened")) for path in (folder / "screened").rglob("[!.]*.*")}
    pictures = {f"pictures/{name}.png" for name in ("histories", "laws", "parity")}
    assert written == {f"{alloy}.json", "Flat.json", f"fits/{alloy}.json", "plate.csv", "plate.h5", *pictures}


def test_what_is_done_is_not_done_again(plate):
    folder, alloy, _ = plate
    before = (folder / "screened" / f"{alloy}.json").stat().st_mtime_ns
    told = screen(folder, "--json")
    assert (folder / "screened" / f"{alloy}.json").stat().st_mtime_ns == before
    assert [row["alloy"] for row in json.loads(told.stdout)["alloys"]] == ["Flat", alloy]


def test_a_wrong_word_is_told_in_a_line(plate):
    words = [str(plate[0] / "tests"), "--to", str(plate[0] / "screened"), *LAWS, "--confirm", "perhaps"]
    told = CliRunner().invoke(app, ["screen", *words])
    assert told.exit_code == 1
    assert told.stderr == ("creepkit: --confirm perhaps is not known; allowed are when-in-doubt, always, never\n")
