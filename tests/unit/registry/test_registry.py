"""Plugins as pip, the environment and --plugin bring them: good ones, clashing ones and broken ones."""

import os
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from time import sleep
from typing import Any

import numpy as np
import pytest

from creepkit.errors import ExportError, HistoryError, LawError, PluginError, SolveError
from creepkit.language import CreepLaw, arrhenius
from creepkit.records import History, constant_load
from creepkit.registry import Plugin, Registry, default_registry, kinds, plugin_sources
from creepkit.registry.arguments import resolve_predictors
from helpers.cantilever import Cantilever
from helpers.mistakes import said_otherwise

LAW = """
from creepkit.language import CreepLaw, Param, hookimpl, parameters, stress

A, n = parameters("A n")
LAW = CreepLaw(
    name="{name}",
    title="A law of an outsider",
    terms={{"power law": A * stress**n}},
    params={{
        A: Param("rate coefficient", unit="1/s", bounds=(1e-40, 1e-5), scale="log"),
        n: Param("stress exponent", bounds=(1, 8)),
    }},
)


@hookimpl
def creepkit_laws():
    return [LAW]
"""

Write = Callable[[str, str], Path]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Write]:
    """Leave a distribution with one module and one entry point on the path, as pip would."""
    modules = []

    def write(name: str, source: str) -> Path:
        site, module = tmp_path / name, name.replace("-", "_")
        info = site / f"{module}-1.2.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.2\n")
        groups = [plugin_sources.GROUP_PREFIX + word for word in ("laws", "specimens", "temperature_forms")]
        (info / "entry_points.txt").write_text("".join(f"[{group}]\nmine = {module}\n" for group in groups))
        file = site / f"{module}.py"
        file.write_text(source)
        monkeypatch.syspath_prepend(site)
        modules.append(module)
        return file

    yield write
    for module in modules:
        sys.modules.pop(module, None)


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Write a plugin file."""

    def write(name: str, source: str) -> Path:
        file = tmp_path / f"{name}.py"
        file.write_text(source)
        return file

    return write


def of(registry: Registry, origin: str) -> Plugin:
    return next(plugin for plugin in registry.plugins() if plugin.provenance.origin.startswith(origin))


# ---- what creepkit brings itself -----------------------------------------------------------------------------------


def test_every_built_in_plugin_loads() -> None:
    own = [plugin for plugin in Registry().plugins() if plugin.provenance.origin.startswith("creepkit ")]

    assert len(own) >= 10
    assert [plugin.problem for plugin in own if plugin.problem] == []
    assert [plugin.provenance.name for plugin in own if not any(plugin.contributions.values())] == []


def test_every_object_has_its_name_and_its_plugin() -> None:
    laws = Registry().laws()

    assert all(isinstance(found.value, CreepLaw) and found.value.name == name for name, found in laws.items())
    assert str(laws["norton"].provenance).startswith("plugin 'norton' (creepkit ")
    assert Registry().all(kinds.TEMPERATURE_FORMS)["arrhenius"].value(T_ref=1000.0) == arrhenius(T_ref=1000.0)


def test_an_unknown_name_is_an_error_of_its_kind_with_the_nearest_name() -> None:
    registry = Registry()
    reader, exporter = partial(registry.one, kinds.READERS), partial(registry.one, kinds.EXPORTERS)
    for error, ask, name, sentence in (
        (LawError, registry.law, "nortn", r"there is no law 'nortn': did you mean 'norton'\?"),
        (SolveError, registry.specimen, "uniaxal", r"there is no specimen 'uniaxal': did you mean 'uniaxial'\?"),
        (HistoryError, reader, "no-such", "there is no reader 'no-such': known: "),
        (ExportError, exporter, "no-such", "there is no exporter 'no-such': known: "),
        (ExportError, exporter, "UMAT", "those that serve it: abaqus-umat, calculix-umat, ls-dyna-umat, mfront"),
    ):
        assert said_otherwise([(partial(ask, name), sentence)], error) == []


# ---- where plugins come from ---------------------------------------------------------------------------------------


def test_an_installed_plugin_is_found_with_its_distribution(install: Write) -> None:
    install("outsider-pack", LAW.format(name="outsider"))

    found = Registry().laws()["outsider"]

    assert found.value.names == ("A", "n")
    assert str(found.provenance) == "plugin 'mine' (outsider-pack 1.2)"


def test_files_in_the_environment_are_loaded_once(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    files = [write("one", LAW.format(name="one")), write("two", LAW.format(name="two"))]
    listed = [*files, files[0].parent / "." / files[0].name]
    monkeypatch.setenv("CREEPKIT_PLUGINS", os.pathsep.join(map(str, listed)))
    registry = Registry()
    registry.load_file(files[0])

    laws = registry.laws()
    assert laws["one"].provenance.origin == str(files[0].resolve())
    assert laws["two"].provenance.name == "two"
    assert sum(plugin.provenance.name == "one" for plugin in registry.plugins()) == 1


def test_an_edited_file_is_read_anew_and_leaves_no_bytecode(write: Write) -> None:
    file = write("edited", LAW.format(name="before"))
    Registry().load_file(file)
    file.write_text(LAW.format(name="behind"))

    assert list(Registry().load_file(file).contributions["law"]) == ["behind"]
    assert not (file.parent / "__pycache__").exists()


# ---- what can be wrong ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("file_first", [True, False])
def test_a_file_stands_in_for_an_installed_plugin(file_first: bool, install: Write, write: Write) -> None:
    install("first-pack", LAW.format(name="same"))
    file, registry = write("second", LAW.format(name="same")), Registry()
    if not file_first:
        registry.laws()
    plugin = registry.load_file(file)

    assert registry.laws()["same"].provenance == plugin.provenance
    assert registry.conflicts() == ()
    (notice,) = registry.replaced(plugin)
    assert notice.endswith("in place of plugin 'mine' (first-pack 1.2)")


def test_two_plugins_with_one_name_are_both_named_and_creepkit_is_one_of_them(write: Write) -> None:
    registry, own = Registry(), Registry()
    files = [write(name, LAW.format(name="same")) for name in ("first", "second")]
    for file in files:
        registry.load_file(file)
    own.load_file(write("mine", LAW.format(name="norton")))
    for asked, name in ((own, "norton"), (registry, "same")):
        with pytest.raises(PluginError, match=f"the law '{name}' is offered twice") as caught:
            asked.law(name)
    told = str(caught.value)
    assert all(f"plugin '{file.stem}' ({file.resolve()})" in told for file in files)
    assert registry.conflicts() == (told,)


def test_one_plugin_with_a_name_twice_is_broken(write: Write) -> None:
    file = write("double", LAW.format(name="double").replace("[LAW]", "[LAW, LAW]"))

    with pytest.raises(PluginError, match="offers the law 'double' twice"):
        Registry().load_file(file)


def bad(before: str, after: str) -> str:
    """The plugin of a law with a fault."""
    return LAW.format(name="bad").replace(before, after)


HOOK = "from creepkit.language import hookimpl\n\n@hookimpl\ndef creepkit_"
WRONG = (
    ("import creepkit\n\n1 / 0\n", "ZeroDivisionError: division by zero", "line 3"),
    ("import sys\nsys.exit('bye')\n", "SystemExit: bye", "line 2"),
    ("A = 1\nB = (\n", "SyntaxError: '(' was never closed", "line 2"),
    ("import no_such_module_of_mine\n", "No module named 'no_such_module_of_mine'", "line 1"),
    (bad("bounds=(1, 8)", "bounds=(8, 1)"), "bounds are reversed", "line 11"),
    (bad("creepkit_laws", "creepkit_law"), "unknown hook 'creepkit_law': did you mean 'creepkit_laws'?", ""),
    (bad("@hookimpl", ""), "'creepkit_laws' without @", ""),
    ("A = 1\n", "offers nothing", ""),
    (bad("creepkit_laws()", "creepkit_laws(registry)"), "does not fit the hooks of creepkit", ""),
    (bad("[LAW]", "[LAW][3]"), "raised IndexError", "line 18"),
    (bad("return [LAW]", "[LAW]"), "found NoneType None", ""),
    (bad("[LAW]", "LAW"), "must return a list of CreepLaw", ""),
    (bad("[LAW]", "[LAW, LAW]"), "offers the law 'bad' twice", ""),
    (bad("[LAW]", "['A*stress**n']"), "found str 'A*stress**n' in it", ""),
    (bad("[LAW]", "[CreepLaw]"), "found the class CreepLaw in it", ""),
    (f"{HOOK}specimens():\n    return [1.5]\n", "must return a list of Specimen records, found float 1.5 in it", ""),
    (f"{HOOK}temperature_forms(): return {{'x': '1/T'}}\n", "found str '1/T' for 'x'", ""),
)
"""(source of a plugin, what is said of it, the line that is named)."""


def test_a_wrong_plugin_is_one_sentence_and_leaves_the_others_standing(install: Write, write: Write) -> None:
    install("right-pack", LAW.format(name="right"))
    for number, (source, told, line) in enumerate(WRONG):
        file, registry = write(f"wrong{number}", source), Registry()
        with pytest.raises(PluginError) as caught:
            registry.load_file(file)
        sentence = str(caught.value)
        assert all(part in sentence for part in (told, str(file), line))
        assert "\n" not in sentence
        assert all(plugin.provenance.name != file.stem for plugin in registry.plugins())
        install(f"wrong-pack{number}", source)
    registry = Registry()
    assert {"norton", "right"} <= set(registry.laws())
    for number, (_, told, line) in enumerate(WRONG):
        problem = of(registry, f"wrong-pack{number} 1.2").problem
        assert all(part in problem for part in (told, line, f"wrong-pack{number} 1.2"))


def test_a_missing_file_is_an_error_when_asked_for_and_a_note_in_the_environment_and_loads_once_mended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    missing = tmp_path / "nowhere.py"
    monkeypatch.setenv("CREEPKIT_PLUGINS", str(missing))
    registry = Registry()

    assert of(registry, str(missing)).problem.startswith(f"plugin file {missing} does not exist; name a Python file")
    with pytest.raises(PluginError, match="does not exist"):
        registry.load_file(missing)


TWO_LAWS = LAW.format(name="first").replace("[LAW]", "[LAW, LAW.rename('second')]")


def test_a_module_with_several_laws_has_an_entry_point_for_each(install: Write) -> None:
    file = install("twin-pack", TWO_LAWS)
    assert Registry().law("second").name == "second"  # whatever the entry points are called

    (file.parent / "twin_pack-1.2.dist-info" / "entry_points.txt").write_text(
        "[creepkit.laws]\nfirst = twin_pack\nsecond = twin_pack\n"
    )
    registry = Registry()

    assert registry.law("second").name == "second"
    assert {name: str(found.provenance) for name, found in registry.laws().items() if name in ("first", "second")} == {
        "first": "plugin 'first' (twin-pack 1.2)",
        "second": "plugin 'first' (twin-pack 1.2)",
    }


def test_a_hook_without_an_entry_point_in_its_group_is_told(install: Write) -> None:
    file = install("twin-pack", LAW.format(name="twin"))
    (file.parent / "twin_pack-1.2.dist-info" / "entry_points.txt").write_text("[creepkit.readers]\nmine = twin_pack\n")

    problem = of(Registry(), "twin-pack").problem
    assert problem == (
        "plugin 'mine' (twin-pack 1.2) has the hook creepkit_laws, but no entry point in the group 'creepkit.laws' "
        "names its module; add one"
    )


# ---- names ---------------------------------------------------------------------------------------------------------


def test_one_name_imports_one_module_and_the_registry_none(install: Write) -> None:
    for name in ("one-pack", "other-pack"):
        install(name, LAW.format(name=name))
        entry_points = Path(sys.path[0]) / f"{name.replace('-', '_')}-1.2.dist-info" / "entry_points.txt"
        entry_points.write_text(f"[creepkit.laws]\n{name} = {name.replace('-', '_')}\n")

    registry = Registry()
    assert not {"one_pack", "other_pack"} & {*sys.modules}
    assert registry.law("one-pack").name == "one-pack"
    assert "other_pack" not in sys.modules
    assert "other-pack" in registry.laws()


def test_a_law_is_found_whatever_its_capitals_and_by_its_aliases() -> None:
    registry = Registry()
    names = {
        "Norton": "norton", "strain hardening": "strain-hardening", "Time_Hardening": "time-hardening",
        "sinh": "hyperbolic-sine", "omega": "mpc-omega",
    }  # fmt: skip
    for word, name in names.items():
        assert registry.law(word) == registry.law(name)
        assert word not in registry.laws()
    assert registry.law("sinh + norton") == registry.law("hyperbolic-sine") + registry.law("norton")
    assert registry.one(kinds.EXPORTERS, "tex").name == "latex"


def test_threads_that_ask_first_wait_until_all_plugins_are_loaded(monkeypatch: pytest.MonkeyPatch) -> None:
    waiting = threading.Barrier(4)
    original = plugin_sources.InstalledModule.load

    def slow_import(module: Any) -> Any:
        sleep(0.02)
        return original(module)

    def ask(registry: Registry) -> list[str]:
        waiting.wait()
        return sorted(registry.specimens())

    monkeypatch.setattr(plugin_sources.InstalledModule, "load", slow_import)
    registry = Registry()
    with ThreadPoolExecutor(4) as threads:
        answers = list(threads.map(ask, [registry] * 4))
    assert answers[0]
    assert answers == [answers[0]] * 4


def test_a_specimen_that_was_given_is_found_by_the_name_that_histories_have():
    beam = Cantilever()
    history = History("beam", np.ones(1), {"deflection": np.ones(1)}, constant_load("force", 8.0), 973.15, beam.name)
    with pytest.raises(SolveError, match="cantilever"):
        resolve_predictors(None, [history])
    default_registry().remember(beam)
    assert resolve_predictors(None, [history]) is beam is resolve_predictors("cantilever", [history])
