"""Plugin files that commands are given, packages that `creepkit new` writes, and limits of laws from plugins."""

import json
import math
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import creepkit as ck
from creepkit.errors import LawError
from creepkit.language import CreepLaw, Param, parameters, stress
from creepkit.language.law_codec import law_from_json, law_to_json
from helpers.command_line import creepkit, one_line

pytestmark = pytest.mark.usefixtures("own_registry")


@pytest.mark.parametrize(("files", "advice"), [("none.py", "correct or unset it"), ("a.py,b.py", "separate several")])
def test_a_file_of_the_environment_that_is_not_there_is_one_sentence(
    files: str, advice: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CREEPKIT_PLUGINS", files)
    result = creepkit("list", "laws")
    assert (result.exit_code, result.stdout) == (1, "")
    assert f"CREEPKIT_PLUGINS names the file {files}, which does not exist; {advice}" in result.stderr


EXECUTED = "from pathlib import Path\nPath('executed').touch()\n"


@pytest.mark.parametrize("name", ["measured.csv", "norton", "plugin", "plugin.py.txt", "plugin.pyc"])
def test_no_file_is_executed_but_one_whose_name_ends_in_py(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    Path(name).write_text(EXECUTED)

    option = creepkit("--plugin", name, "list", "laws")
    monkeypatch.setenv("CREEPKIT_PLUGINS", name)
    variable = creepkit("list", "laws")

    for result in (option, variable):
        assert (result.exit_code, result.stdout, result.stderr.count("\n")) == (1, "", 1)
        assert "only files whose names end in .py are" in result.stderr
    assert not Path("executed").exists()


# ---- new packages ----------------------------------------------------------------------------------------------------

# `new law`, `new specimen`, `new reader`, `new exporter`: packages whose own tests pass, or one file.


KINDS = ("law", "specimen", "reader", "exporter")

TAKEN = {"law": "norton", "specimen": "bulge", "reader": "csv", "exporter": "latex"}

kinds = pytest.mark.parametrize("kind", KINDS)


@kinds
def test_a_new_package_says_what_to_do_next(kind: str) -> None:
    told = creepkit("new", kind, "my-own").stdout
    project = tomllib.loads(Path("my-own", "pyproject.toml").read_text())

    assert project["project"]["entry-points"][f"creepkit.{kind}s"] == {"my-own": "creepkit_my_own"}
    assert project["project"]["dependencies"] == ["creepkit"]
    files = {str(p.relative_to("my-own")) for p in Path("my-own").rglob("*") if p.is_file()}
    assert files == {"creepkit_my_own.py", "pyproject.toml", "README.md", "tests/test_my_own.py"}
    assert sum(len(Path("my-own", file).read_text().splitlines()) for file in files) < 130
    assert "pip install -e ./my-own" in told
    assert "$" not in "".join(Path("my-own", file).read_text() for file in files)
    assert "creepkit check my-own/creepkit_my_own.py" in told


def test_their_tests_pass_once_they_are_installed(tmp_path: Path) -> None:
    """Each is on the path with its entry point, as `pip install -e` puts it there."""
    site, places = tmp_path / "site", []
    for kind in KINDS:
        creepkit("new", kind, f"my-{kind}")
        (name, module) = next(iter(_project(kind)["entry-points"][f"creepkit.{kind}s"].items()))
        info = site / f"{module}-0.1.0.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {_project(kind)['name']}\nVersion: 0.1.0\n")
        (info / "entry_points.txt").write_text(f"[creepkit.{kind}s]\n{name} = {module}\n")
        places.append(tmp_path / f"my-{kind}")
    path = os.pathsep.join([*map(str, places), str(site), os.environ.get("PYTHONPATH", "")])
    words = [sys.executable, "-m", "pytest", "-q", "--import-mode=importlib", "-p", "no:cacheprovider", "-W", "error"]
    how = {"env": {**os.environ, "PYTHONPATH": path}, "cwd": tmp_path, "capture_output": True, "text": True}
    done = subprocess.run([*words, *map(str, places)], check=False, **how)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "4 passed" in done.stdout


def _project(kind: str) -> dict:
    return tomllib.loads(Path(f"my-{kind}", "pyproject.toml").read_text())["project"]


@kinds
def test_one_file_is_enough_for_a_start(kind: str) -> None:
    written = creepkit("new", kind, "my-own", "--file")
    assert written.exit_code == 0
    assert "my_own.py" in written.stdout
    assert len(Path("my_own.py").read_text().splitlines()) <= 50
    plugins = json.loads(creepkit("--plugin", "my_own.py", "list", "plugins", "--json").stdout)["plugins"]
    (mine,) = (plugin for plugin in plugins if plugin["name"] == "my_own")
    assert (mine["status"], mine["offers"]) == ("ok", {kind: ["my-own"]})


@kinds
def test_what_exists_is_left_as_it_is(kind: str) -> None:
    for words, place in (("", "my-own"), (" --file", "my_own.py")):
        Path(place).write_text("precious")
        assert f"{place} exists already" in one_line(creepkit(f"new {kind} my-own{words}"))
        assert Path(place).read_text() == "precious"


@kinds
def test_a_name_must_be_new_and_words_of_lower_case(kind: str) -> None:
    taken = TAKEN[kind]
    assert f"there is a {kind} '{taken}' already" in one_line(creepkit("new", kind, taken))
    assert not Path(taken).exists()
    for name in ("Bad", "two words", "under_score", "../up", "9lives", "a--b", ""):
        refused = creepkit("new", kind, name)
        assert refused.exit_code == 2
        assert f"is not a {kind}'s name" in " ".join(refused.stderr.split())
    assert not any(Path().iterdir())


@kinds
@pytest.mark.parametrize("name", ["none", "a", "class", "history"])
def test_a_name_that_python_uses_does_no_harm(kind: str, name: str) -> None:
    creepkit("new", kind, name, "--file")
    assert creepkit("--plugin", f"{name}.py", "list", "plugins").exit_code == 0


# ---- missing laws ----------------------------------------------------------------------------------------------------

# The package that a law came from; hard limits of parameters.


A, n = parameters("A n")


# ---- limits --------------------------------------------------------------------------------------------------------


def limited(limits, off=None) -> CreepLaw:
    rate = Param("rate coefficient", unit="1/s", bounds=(1e-40, 1e-5), scale="log")
    return CreepLaw("limited", {"creep": A * stress**n}, {A: rate, n: Param("n", (1, 8), off=off, limits=limits)})


def test_values_outside_the_physical_limits_are_refused() -> None:
    law = limited((0.5, 12), off=0.0)
    assert law.values({"A": 1e-16, "n": 10.0})["n"] == 10.0, "bounds are where a fit looks, not what is possible"
    assert law.values({"A": 1e-16, "n": 0.0})["n"] == 0.0, "off is allowed"
    with pytest.raises(LawError, match=r"'limited', parameter 'n': 13 is not physical, which is from 0.5 to 12 \(or 0"):
        law.values({"A": 1e-16, "n": 13.0})
    with pytest.raises(LawError, match="not physical"):
        ck.simulate(law, "uniaxial", {"A": 1e-16, "n": 0.1}, loading=ck.constant_stress(50), times=[1.0])


@pytest.mark.parametrize("limits", [None, (0.5, 12), (0.5, math.inf), (-math.inf, math.inf)])
def test_limits_travel_in_json_and_are_no_mathematics(limits) -> None:
    law = limited(limits)
    data = json.loads(json.dumps(law_to_json(law), allow_nan=False))
    assert law_from_json(data) == law
    assert law.fingerprint == limited(None).fingerprint
    assert (data["params"][1]["limits"] is not None) == (limits is not None)


def test_sums_and_temperature_keep_limits() -> None:
    law = (limited((0.5, 12)) + ck.law("norton")).times(ck.arrhenius()).with_temperature(n_1=ck.linear())
    assert law.table["n_1"].limits == (0.5, 12.0)
    assert "physical from 0.5 to 12" in str(law)
